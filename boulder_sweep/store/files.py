"""Files that appear whole or not at all, survive a power cut once they are there, and lie where they may; their names.

A file is written without a name where the file system can do that (``O_TMPFILE``: Linux on ext4, XFS,
Btrfs, tmpfs), else under a name that begins with ``_``; it is flushed to the disk, gets its name in one step,
and then the folder is flushed. So readers see finished files only, even after ``kill -9`` at any instant,
and a killed run leaves no partly written file under a final name.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_ISREG
from typing import BinaryIO

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import Location
from boulder_sweep.store.failures import LinkError

MANIFEST_NAME = "_manifest.parquet"
"""A folder with such a file is the result of a run, see `manifest`."""
LOCK_NAME = "_lock"
PROBE_PREFIX = "_probe-"
"""Of objects that are written to find out what an object store can."""
WRITING_SUFFIX = ".writing"
"""Suffix of a file that does not have its final name yet; such names begin with ``_``, and readers skip them."""
PART_SUFFIX = ".parquet"
_DIGITS = 12
_PART_NAME = re.compile(rf"rows-[0-9]{{{_DIGITS},}}-[0-9]{{{_DIGITS},}}{re.escape(PART_SUFFIX)}")
_VERSION_NAME = re.compile(rf"_manifest-([0-9]{{{_DIGITS}}})\.parquet")
_TOKENS = re.compile(r"(\.[0-9a-f]{16})+$")
_PIECE = 8 << 20
_SHOWN = 40
"""Characters of a name that are repeated in a temporary one: four bytes each, and 255 bytes are a name's limit."""
_FATAL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)


def part_name(first: int, stop: int, table_rows: int) -> str:
    """Return the file name of the part with the rows [first, stop) of a table; names sort as the rows do."""
    digits = max(_DIGITS, len(str(table_rows)))
    return f"rows-{first:0{digits}d}-{stop:0{digits}d}{PART_SUFFIX}"


def is_part_name(name: str) -> bool:
    """Whether a file name is that of a part."""
    return bool(_PART_NAME.fullmatch(name))


def version_name(number: int) -> str:
    """Return the name of a version of the manifest on an object store, see `storage`."""
    return f"_manifest-{number:0{_DIGITS}d}.parquet"


def version_number(name: str) -> int | None:
    """Return which version of a manifest has a name; None for another name."""
    match = _VERSION_NAME.fullmatch(name)
    return None if match is None else int(match[1])


def hidden_name(name: str) -> str:
    """Return the temporary name of a file, such as a merged part while the parts it replaces still exist."""
    return f"_{name}{WRITING_SUFFIX}"


def staged_name(name: str, token: str, sha256: str) -> str:
    """Return the temporary name of a part: no other run, and no other content, has the same."""
    return hidden_name(f"{name}.{token}.{sha256[:16]}")


def is_kept(name: str) -> bool:
    """Whether a file stays when a run begins: the lock and the manifest, which is replaced in one step."""
    return name in (LOCK_NAME, MANIFEST_NAME) or version_number(name) is not None


def is_ours(name: str) -> bool:
    """Whether a sweep gives its files such a name, temporary names included."""
    if name.endswith(WRITING_SUFFIX):
        return name.startswith("_") and is_ours(_TOKENS.sub("", name[1 : -len(WRITING_SUFFIX)]))
    return is_part_name(name) or is_kept(name) or name.startswith(PROBE_PREFIX)


def is_file(path: Path) -> bool:
    """Whether there is a file of a name that is about to be written.

    Raises
    ------
    LinkError
        There is something else, such as a link.
    """
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return False
    if not S_ISREG(mode):
        raise LinkError(f"{path} is a link or not a plain file, and would not be what is written: remove it first")
    return True


def created(path: Path) -> int:
    """Create a file and return its descriptor; a file of this name, which a killed run has left, is removed.

    Raises
    ------
    LinkError
        Something else has this name, such as a link; nothing has changed.
    OSError
        It cannot be created.
    """
    if is_file(path):
        path.unlink()
    # Should a link have come since, it is not followed.
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)


@contextmanager
def replacing(target: Path) -> Iterator[BinaryIO]:
    """Give a file to write that takes the place of another when it is complete, or is removed.

    Raises
    ------
    LinkError
        A link has the name of the one or the other.
    OSError
        It cannot be written; an old file is untouched.
    """
    is_file(target)
    # No other process that writes the same file has this name.
    passing = target.with_name(f".{target.name[:_SHOWN]}.{secrets.token_hex(8)}.part")
    with open(passing, "wb", opener=lambda path, _: created(Path(path))) as file:
        try:
            yield file
            file.flush()
            passing.replace(target)
        except BaseException:
            passing.unlink(missing_ok=True)
            raise


@contextmanager
def opened_folder(folder: Path) -> Iterator[int]:
    """Give a descriptor of a folder, to flush it and to create files relative to it."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def flush_folder(folder: Path) -> None:
    """Make the names in a folder durable."""
    with opened_folder(folder) as descriptor:
        os.fsync(descriptor)


def check_writable(folder: Path, name: str, size: int) -> None:
    """Check that a file of some size can be written into a folder; it is removed again.

    Raises
    ------
    OSError
        It cannot.
    """
    path = folder / name
    descriptor = created(path)
    try:
        _write_all(descriptor, bytes(size))
    finally:
        os.close(descriptor)
        with suppress(OSError):
            path.unlink()


def put_file(folder: Path, name: str, content: memoryview | bytes) -> None:
    """Put a file into a folder in one step, replacing any file of that name, and make it durable.

    Parameters
    ----------
    folder
        The folder.
    name
        Its name.
    content
        All of it.

    Raises
    ------
    OSError
        Nothing has changed then: an old file of that name is untouched, and no temporary file is left.
    LinkError
        A link has this name or the temporary one.
    """
    # Two machines may stage the same bytes at the same time.
    passing = f"{name}.{secrets.token_hex(8)}" if name.endswith(WRITING_SUFFIX) else name
    is_file(folder / name)
    with opened_folder(folder) as at:
        if not _put_unnamed(at, folder / name, content, folder / hidden_name(passing)):
            _put_named(at, folder / name, content, folder / hidden_name(passing))
        os.fsync(at)


def _put_unnamed(at: int, path: Path, content: memoryview | bytes, temporary: Path) -> bool:
    """Write a file that has no name until it is complete; False where the file system cannot do that."""
    flag = getattr(os, "O_TMPFILE", None)
    if flag is None:
        return False
    try:
        descriptor = os.open(".", flag | os.O_WRONLY, 0o666, dir_fd=at)
    except OSError:
        # Not every file system can; a real problem (no permission, no space) occurs in _put_named as well.
        return False
    try:
        _write_all(descriptor, content)
        # linkat follows the link to the nameless file only if the folder is given by a descriptor.
        source = f"/proc/self/fd/{descriptor}"
        try:
            os.link(source, path.name, dst_dir_fd=at, follow_symlinks=True)
        except FileExistsError:
            if is_file(temporary):
                temporary.unlink()
            os.link(source, temporary.name, dst_dir_fd=at, follow_symlinks=True)
            _rename(at, temporary, path)
    except OSError as problem:
        if problem.errno in _FATAL:
            raise
        return False  # no /proc, or links from there not allowed
    finally:
        os.close(descriptor)
    return True


def _put_named(at: int, path: Path, content: memoryview | bytes, temporary: Path) -> None:
    """Write a file under a temporary name, then rename it."""
    descriptor = created(temporary)
    try:
        _write_all(descriptor, content)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
    finally:
        os.close(descriptor)
    _rename(at, temporary, path)


def _rename(at: int, temporary: Path, path: Path) -> None:
    """Give a file its name, or remove it."""
    try:
        os.rename(temporary.name, path.name, src_dir_fd=at, dst_dir_fd=at)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def _write_all(descriptor: int, content: memoryview | bytes) -> None:
    """Write everything and flush it to the disk."""
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest[:_PIECE]) :]
    os.fsync(descriptor)


def check_target(target: Location, refusal: type[BoulderSweepError]) -> None:
    """Check that a file may be written at a location; readers would take one within a result for rows of it.

    Parameters
    ----------
    target
        The file, by path or URL.
    refusal
        The error to raise.

    Raises
    ------
    BoulderSweepError
        Its folder does not exist, cannot be written or holds the result of a run, or a folder has its name.
    LinkError
        A link has its name.
    """
    if not isinstance(target, Path):
        with suppress(OSError):  # a store that does not answer, or lets nobody read: writing will tell
            _check_no_result(target, target.parent, refusal)
        return
    folder = target.absolute().parent
    if not folder.is_dir():
        raise refusal(f"{target}: the folder {folder} does not exist")
    _check_no_result(target, folder, refusal)
    if target.is_dir():
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EISDIR)}")
    try:
        is_there = is_file(target)
    except OSError as problem:
        raise refusal(f"{target} cannot be written: {problem.strerror}") from problem
    if not os.access(folder, os.W_OK | os.X_OK) or (is_there and not os.access(target, os.W_OK)):
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EACCES)}")


def _check_no_result(target: Location, folder: Location, refusal: type[BoulderSweepError]) -> None:
    """Check that a folder is not the result of a run."""
    if (folder / MANIFEST_NAME).exists():
        raise refusal(f"{target}: the folder {folder} holds the result of a run; name a file outside it")
