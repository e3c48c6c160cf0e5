"""The manifest on an object store: every version is an object of its own, numbered and never changed.

``_manifest-000000000042.parquet`` is version 42, and ``_manifest.parquet`` a copy of the newest. A request that arrives
late, or twice, can therefore only write what is there already. The copy may be behind and a list of names may be, so
neither is believed: whichever is further is where the search begins, and it ends where the next number does not exist.
The last versions are kept for that.
"""

from __future__ import annotations

import errno
import io
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import NamedTuple

from boulder_sweep.locations import RemotePath
from boulder_sweep.store.files import MANIFEST_NAME

KEPT = 16
"""Versions kept; the copy or the list may be behind by as many."""
Encode = Callable[[Mapping[bytes, bytes]], memoryview | bytes]
"""Gives the bytes of a manifest with some more metadata."""
_NUMBER_KEY, _WRITER_KEY = b"boulder_sweep.generation", b"boulder_sweep.writer"
_DIGITS = 12
_NAME = re.compile(rf"_manifest-([0-9]{{{_DIGITS}}})\.parquet")
_ATTEMPTS = 5
_PROBE = "_probe-"


class OtherWriterError(Exception):
    """Another run has written the next version."""


class Generation(NamedTuple):
    """One version of a manifest."""

    number: int
    content: bytes


def generation_name(number: int) -> str:
    """Return the name of a version."""
    return f"_manifest-{number:0{_DIGITS}d}.parquet"


def is_generation(name: str) -> bool:
    """Whether a name is that of a version."""
    return bool(_NAME.fullmatch(name))


def newest(folder: RemotePath) -> Generation:
    """Return the newest version.

    Raises
    ------
    FileNotFoundError
        There is none.
    OSError
        The store does not answer.
    """
    for _ in range(_ATTEMPTS):
        found = _begin(folder)
        if found is not None:
            while (later := _version(folder, found.number + 1)) is not None:
                found = later
            return found
    raise OSError(errno.EIO, "the newest manifest is gone each time it is read")


class Generations:
    """Writes versions; each is refused if another run has written it.

    Parameters
    ----------
    folder
        The output folder.
    writer
        Unique name of this run.
    only_new
        Whether the store itself refuses to write an object that exists. Otherwise it is asked before, and what it holds
        is read back.
    """

    def __init__(self, folder: RemotePath, writer: str, only_new: bool):
        self._folder, self._writer, self._only_new = folder, writer, only_new
        self._number = 0

    def look(self) -> None:
        """Find out which version is the newest."""
        try:
            self._number = newest(self._folder).number
        except FileNotFoundError:
            self._number = 0

    def put(self, encode: Encode) -> None:
        """Write the next version, then the copy.

        Raises
        ------
        OtherWriterError
            Another run has written it.
        OSError
            The store does not answer. The version may be there; writing it again is right.
        """
        while True:
            number = self._number + 1
            content = bytes(encode({_NUMBER_KEY: str(number).encode(), _WRITER_KEY: self._writer.encode()}))
            try:
                there = self._created(number, content)
            except OSError:
                if not self._only_new:
                    self._number = number  # it may arrive late, and must then not replace another
                raise
            if there != content and _metadata(there).get(_WRITER_KEY, b"") != self._writer.encode():
                raise OtherWriterError
            self._number = number
            if there == content:
                break  # else: what this run wrote before, and was told it could not
        (self._folder / MANIFEST_NAME).put(content)
        with suppress(OSError):
            (self._folder / generation_name(number - KEPT)).unlink(missing_ok=True)

    def discard(self) -> None:
        """Remove all versions."""
        for name in self._folder.names():
            if is_generation(name) or name == MANIFEST_NAME:
                (self._folder / name).unlink(missing_ok=True)

    def _created(self, number: int, content: bytes) -> bytes:
        """Write a version unless it exists; return what is there."""
        path = self._folder / generation_name(number)
        with suppress(FileExistsError):
            if self._only_new:
                path.put(content, only_new=True)
                return content
            if not path.exists():
                path.put(content)
        return path.read_bytes()


def is_probe(name: str) -> bool:
    """Whether a name is that of an object that `refuses_existing` wrote."""
    return name.startswith(_PROBE)


def refuses_existing(folder: RemotePath, token: str) -> bool:
    """Find out whether the store can refuse to write an object that exists; and whether it can be written at all.

    Raises
    ------
    OSError
        It cannot be written.
    """
    probe = folder / f"{_PROBE}{token}"
    try:
        probe.put(b"1", only_new=True)
    except FileExistsError:
        pass  # the answer to a first try was lost
    except OSError:
        probe.put(b"1")  # the store may not know such requests
        probe.unlink(missing_ok=True)
        return False
    try:
        probe.put(b"2", only_new=True)
    except FileExistsError:
        return True
    except OSError:
        return False
    else:
        return False
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)


def _begin(folder: RemotePath) -> Generation | None:
    """Return the newest version that the copy or the list of names knows of; None if it has been removed since.

    Raises
    ------
    FileNotFoundError
        Neither knows any.
    """
    copied: Generation | None = None
    with suppress(FileNotFoundError):
        content = (folder / MANIFEST_NAME).read_bytes()
        copied = Generation(_number(content), content)
    last = max((int(match[1]) for match in map(_NAME.fullmatch, folder.names()) if match), default=0)
    if copied is not None and copied.number >= last:
        return copied
    if not last:
        raise FileNotFoundError(errno.ENOENT, "there is no manifest", str(folder))
    return _version(folder, last)


def _version(folder: RemotePath, number: int) -> Generation | None:
    """Return a version; None if there is none."""
    try:
        return Generation(number, (folder / generation_name(number)).read_bytes())
    except FileNotFoundError:
        return None


def _number(content: bytes) -> int:
    """Return the number of a version; 0 for a manifest without one."""
    text = _metadata(content).get(_NUMBER_KEY, b"")
    return int(text) if text.isdigit() and len(text) <= _DIGITS else 0


def _metadata(content: bytes) -> Mapping[bytes, bytes]:
    """Return the metadata of a Parquet file; none if it is damaged."""
    import pyarrow as pa  # heavy, and only needed on object stores
    import pyarrow.parquet as pq

    try:
        return pq.read_metadata(io.BytesIO(content)).metadata or {}
    except (pa.ArrowException, OSError, ValueError):
        return {}
