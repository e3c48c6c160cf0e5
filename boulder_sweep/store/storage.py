"""What a run does to its output folder, for folders on a disk and for folders on an object store.

On a disk a file gets its final name by renaming, see `files`. An object store has no renaming: a part is put under its
temporary name and copied to the final one within the store.

There, every version of the manifest is an object of its own, numbered and never changed.
``_manifest-000000000042.parquet`` is version 42, and ``_manifest.parquet`` a copy of the newest. A request that arrives
late, or twice, can therefore only write what is there already. The copy may be behind and a list of names may be, so
neither is believed: whichever is further is where the search begins, and it ends where the next number does not exist.
The last versions are kept for that.
"""

from __future__ import annotations

import errno
import os
import queue
import threading
import uuid
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from stat import S_ISREG
from typing import IO, Any, NamedTuple

from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.store import failures
from boulder_sweep.store.files import (
    MANIFEST_NAME,
    PROBE_PREFIX,
    check_writable,
    flush_folder,
    hidden_name,
    is_file,
    opened_folder,
    put_file,
    version_name,
    version_number,
)
from boulder_sweep.store.lock import FolderLock, ObjectLock
from boulder_sweep.text import why

KEPT = 16
"""Versions of a manifest kept on an object store; the copy or the list may be behind by as many."""
Encode = Callable[[Mapping[bytes, bytes]], memoryview | bytes]
"""Gives the bytes of a manifest with some more metadata."""
_NUMBER_KEY, _WRITER_KEY = b"boulder_sweep.generation", b"boulder_sweep.writer"
_LONGEST_NUMBER = 12
_ATTEMPTS = 5
_PROBE_BYTES = 1 << 16
"""More than a first manifest takes."""
_REQUESTS = 16
"""Requests to a store at the same time."""


class _Storage:
    """What folders on a disk and on an object store have in common."""

    _lock: FolderLock | ObjectLock | None = None

    def _check_lock(self) -> None:
        """Refuse to change what may belong to another run by now."""
        if self._lock is not None:
            self._lock.check()


class DiskStorage(_Storage):
    """A folder on a disk, local or shared."""

    checks_content = False

    def __init__(self, path: Path):
        self.path = path
        self._is_made = False

    def make(self) -> None:
        """Create the folder if it does not exist."""
        path = self.path
        if not path.parent.is_dir():
            raise failures.StoreError(f"the folder {path.parent} does not exist: {path.name} cannot be created in it")
        try:
            path.mkdir()
        except FileExistsError:
            if not path.is_dir():
                raise failures.StoreError(f"{path} is a file; the output of a sweep is a folder") from None
        except OSError as problem:
            raise failures.WriteError(f"cannot create the folder {path}: {why(problem)}") from problem
        else:
            self._is_made = True

    def unmake(self) -> None:
        """Remove the folder if `make` created it, it is empty and can be removed."""
        if self._is_made:
            with suppress(OSError):
                self.path.rmdir()

    def lock(self, last_host: str | None, holder: str) -> Lock:
        """Become the only writer."""
        self._lock = FolderLock(self.path, last_host, holder)
        return self._lock

    def check_writable(self) -> None:
        """Raise OSError if the folder cannot be written."""
        is_file(self.path / MANIFEST_NAME)  # a link would be refused only when old parts are gone
        check_writable(self.path, hidden_name(MANIFEST_NAME), _PROBE_BYTES)

    def names(self) -> list[str]:
        """Return the names in the folder."""
        return sorted(entry.name for entry in self.path.iterdir())

    def is_folder(self, name: str) -> bool:
        """Whether one of the names is that of a folder."""
        return (self.path / name).is_dir()

    def put(self, name: str, content: memoryview | bytes) -> None:
        """Write a file whole or not at all, durably."""
        put_file(self.path, name, content)

    def publish(self, names: Mapping[str, str], sizes: Mapping[str, int] | None = None) -> None:
        """Give staged files, by their temporary names, their final names, durably."""
        self._check_lock()
        with opened_folder(self.path) as at:
            for staged, final in names.items():
                os.rename(staged, final, src_dir_fd=at, dst_dir_fd=at)
            os.fsync(at)

    def remove(self, names: Iterable[str]) -> None:
        """Remove files that may exist, durably."""
        self._check_lock()
        names = sorted(names, reverse=True)  # the last rows first: no gap, wherever a run is killed
        for name in names:
            (self.path / name).unlink(missing_ok=True)
        if names:
            flush_folder(self.path)

    def open_manifest(self) -> IO[bytes]:
        """Open the manifest; raises OSError."""
        # A pipe of this name must not be waited for.
        return open(self.path / MANIFEST_NAME, "rb", opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK))

    def put_manifest(self, encode: Encode) -> None:
        """Replace the manifest in one step."""
        self._check_lock()
        put_file(self.path, MANIFEST_NAME, encode({}))

    def discard_manifest(self) -> None:
        """Remove the manifest."""
        self._check_lock()
        (self.path / MANIFEST_NAME).unlink()


class ObjectStorage(_Storage):
    """A folder on an object store, or on any other file system of fsspec."""

    checks_content = True
    """Whether it sees to it itself that a file holds what was written, so that comparing its size is enough."""

    def __init__(self, path: RemotePath):
        self.path = path
        self._token = uuid.uuid4().hex
        self._only_new = False
        """Whether the store itself refuses to write an object that exists. Otherwise it is asked before, and what it
        holds is read back."""
        self._version = 0
        """Number of the newest manifest that this run knows of."""

    def make(self) -> None:
        """Create nothing, for folders exist by their files only."""
        try:
            if S_ISREG(self.path.stat().st_mode):
                raise failures.StoreError(f"{self.path} is a file; the output of a sweep is a folder")
        except FileNotFoundError:
            pass
        except OSError as problem:
            raise failures.WriteError(f"cannot write into {self.path}: {problem.strerror}") from None

    def unmake(self) -> None:
        """Do nothing."""

    def lock(self, last_host: str | None, holder: str) -> Lock:
        """Become the only writer; then look which version of the manifest is the newest."""
        try:
            self._only_new = refuses_existing(self.path, self._token)
            self._lock = ObjectLock(self.path, self._token, self._only_new, holder)
        except OSError as problem:
            raise failures.WriteError(f"cannot write into {self.path}: {problem.strerror}") from None
        try:
            with suppress(FileNotFoundError):
                self._version = newest(self.path).number
        except BaseException:
            self._lock.release()
            raise
        return self._lock

    def check_writable(self) -> None:
        """Do nothing: `lock` has written."""

    def names(self) -> list[str]:
        """Return the names in the folder."""
        return self.path.names()

    def is_folder(self, name: str) -> bool:
        """Whether one of the names is that of a folder."""
        return name.endswith("/")

    def put(self, name: str, content: memoryview | bytes) -> None:
        """Write a file whole or not at all."""
        (self.path / name).put(content)

    def publish(self, names: Mapping[str, str], sizes: Mapping[str, int] | None = None) -> None:
        """Copy staged files to their final names and remove the staged ones."""
        self._check_lock()
        for_size = sizes or {}
        self._each(lambda name: self._publish(name, names[name], for_size.get(name)), names)

    def remove(self, names: Iterable[str]) -> None:
        """Remove files that may exist, unless they are another run's by now."""
        self._check_lock()
        self._each(lambda name: (self.path / name).unlink(missing_ok=True), names)

    def open_manifest(self) -> IO[bytes]:
        """Open the newest version of the manifest.

        Raises
        ------
        FileNotFoundError
            There is none.
        StoreError
            The store does not answer, which says nothing about the manifest.
        """
        try:
            return BytesIO(newest(self.path).content)
        except FileNotFoundError:
            raise
        except OSError as problem:
            raise failures.StoreError(f"{self.path} cannot be read: {problem.strerror}") from None

    def put_manifest(self, encode: Encode) -> None:
        """Write the next version of the manifest, then the copy.

        Raises
        ------
        FolderInUseError
            Another run has written it.
        OSError
            The store does not answer. The version may be there; writing it again is right.
        """
        writer = self._token.encode()
        while True:
            number = self._version + 1
            content = bytes(encode({_NUMBER_KEY: str(number).encode(), _WRITER_KEY: writer}))
            try:
                there = self._created(number, content)
            except OSError:
                if not self._only_new:
                    self._version = number  # it may arrive late, and must then not replace another
                raise
            if there != content and _metadata(there).get(_WRITER_KEY, b"") != writer:
                raise failures.FolderInUseError(f"{self.path} was taken over by another run")
            self._version = number
            if there == content:
                break  # else: what this run wrote before, and was told it could not
        with suppress(OSError):  # the version is what counts, and is there
            (self.path / MANIFEST_NAME).put(content)
            (self.path / version_name(number - KEPT)).unlink(missing_ok=True)

    def discard_manifest(self) -> None:
        """Remove all versions of the manifest."""
        for name in self.path.names():
            if name == MANIFEST_NAME or version_number(name) is not None:
                (self.path / name).unlink(missing_ok=True)

    def _created(self, number: int, content: bytes) -> bytes:
        """Write a version of the manifest unless it exists; return what is there."""
        path = self.path / version_name(number)
        with suppress(FileExistsError):
            if self._only_new:
                path.put(content, only_new=True)
                return content
            if not path.exists():
                path.put(content)
        return path.read_bytes()

    def _publish(self, staged_name: str, name: str, size: int | None) -> None:
        """Copy one staged file to its final name."""
        staged = self.path / staged_name
        if size is not None and staged.stat().st_size != size:
            raise failures.DamagedError(f"{staged} is not what a worker wrote there: it has another size")
        staged.copy_to(self.path / name)
        with suppress(OSError):
            staged.unlink(missing_ok=True)

    def _each(self, act: Callable[[str], Any], names: Iterable[str]) -> None:
        """Send requests for several files at the same time."""
        waiting = queue.SimpleQueue[str]()
        done: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()
        for name in names:
            waiting.put(name)

        def work() -> None:
            with suppress(queue.Empty):
                while True:
                    name = waiting.get_nowait()
                    try:
                        act(name)
                    except BaseException as problem:
                        done.put(problem)
                    else:
                        done.put(None)

        count = waiting.qsize()
        for _ in range(min(count, _REQUESTS)):  # not those of a pool: Python would wait for them at its end
            threading.Thread(target=work, name="requests", daemon=True).start()
        for problem in [done.get() for _ in range(count)]:
            if problem is not None:
                raise problem


Lock = FolderLock | ObjectLock
"""The right to write into a folder."""
Storage = DiskStorage | ObjectStorage
"""What a run does to its output folder, and where the manifest is read. Both have the same methods."""


def storage_of(location: Location) -> Storage:
    """Return how a run writes into a folder."""
    return DiskStorage(location) if isinstance(location, Path) else ObjectStorage(location)


class Version(NamedTuple):
    """One version of the manifest on an object store."""

    number: int
    content: bytes


def newest(folder: RemotePath) -> Version:
    """Return the newest version of the manifest.

    Raises
    ------
    FileNotFoundError
        There is none.
    OSError
        The store does not answer.
    """
    for _ in range(_ATTEMPTS):
        version = _begin(folder)
        if version is not None:
            while (later := _version(folder, version.number + 1)) is not None:
                version = later
            return version
    raise OSError(errno.EIO, "the newest manifest is gone each time it is read")


def refuses_existing(folder: RemotePath, token: str) -> bool:
    """Find out whether the store can refuse to write an object that exists; and whether it can be written at all.

    Raises
    ------
    OSError
        It cannot be written.
    """
    probe = folder / f"{PROBE_PREFIX}{token}"
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


def _begin(folder: RemotePath) -> Version | None:
    """Return the newest version that the copy or the list of names knows of; None if it has been removed since.

    Raises
    ------
    FileNotFoundError
        Neither knows any.
    """
    copied: Version | None = None
    with suppress(FileNotFoundError):
        content = (folder / MANIFEST_NAME).read_bytes()
        copied = Version(_number(content), content)
    last = max((version_number(name) or 0 for name in folder.names()), default=0)
    if copied is not None and copied.number >= last:
        return copied
    if not last:
        raise FileNotFoundError(errno.ENOENT, "there is no manifest", str(folder))
    return _version(folder, last)


def _version(folder: RemotePath, number: int) -> Version | None:
    """Return a version; None if there is none."""
    try:
        return Version(number, (folder / version_name(number)).read_bytes())
    except FileNotFoundError:
        return None


def _number(content: bytes) -> int:
    """Return the number of a version; 0 for a manifest without one."""
    text = _metadata(content).get(_NUMBER_KEY, b"")
    return int(text) if text.isdigit() and len(text) <= _LONGEST_NUMBER else 0


def _metadata(content: bytes) -> Mapping[bytes, bytes]:
    """Return the metadata of a Parquet file; none if it is damaged."""
    import pyarrow as pa  # heavy, and only needed on object stores
    import pyarrow.parquet as pq

    try:
        return pq.read_metadata(BytesIO(content)).metadata or {}
    except (pa.ArrowException, OSError, ValueError):
        return {}
