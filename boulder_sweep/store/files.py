"""Files that appear whole or not at all, and that survive a power cut once they are there.

A file is written without a name where the file system can do that (``O_TMPFILE``: Linux on ext4, XFS,
Btrfs, tmpfs), else under a name that begins with ``_``; it is flushed to the disk, gets its name in one step,
and then the folder is flushed. So readers see finished files only, even after ``kill -9`` at any instant,
and a killed run leaves no partly written file under a final name.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

WRITING_SUFFIX = ".writing"
"""Suffix of a file that does not have its final name yet; such names begin with ``_``, and readers skip them."""
_PIECE = 8 << 20
_FATAL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)


def hidden_name(name: str) -> str:
    """Return the temporary name of a staged part, or of a merged one while the parts it replaces still exist."""
    return f"_{name}{WRITING_SUFFIX}"


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
    with opened_folder(folder) as at:
        try:
            descriptor = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666, dir_fd=at)
            try:
                _write_all(descriptor, bytes(size))
            finally:
                os.close(descriptor)
        finally:
            _remove(at, name)


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
    """
    temporary = f"_{name}{WRITING_SUFFIX}"
    with opened_folder(folder) as at:
        if not _put_unnamed(at, name, content, temporary):
            _put_named(at, name, content, temporary)
        os.fsync(at)


def _put_unnamed(at: int, name: str, content: memoryview | bytes, temporary: str) -> bool:
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
            os.link(source, name, dst_dir_fd=at, follow_symlinks=True)
        except FileExistsError:
            _remove(at, temporary)
            os.link(source, temporary, dst_dir_fd=at, follow_symlinks=True)
            try:
                os.rename(temporary, name, src_dir_fd=at, dst_dir_fd=at)
            except BaseException:
                _remove(at, temporary)
                raise
    except OSError as problem:
        if problem.errno in _FATAL:
            raise
        return False  # no /proc, or links from there not allowed
    finally:
        os.close(descriptor)
    return True


def _put_named(at: int, name: str, content: memoryview | bytes, temporary: str) -> None:
    """Write a file under a temporary name, then rename it."""
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666, dir_fd=at)
    try:
        try:
            _write_all(descriptor, content)
        finally:
            os.close(descriptor)
        os.rename(temporary, name, src_dir_fd=at, dst_dir_fd=at)
    except BaseException:
        _remove(at, temporary)
        raise


def _remove(at: int, name: str) -> None:
    """Remove a file if it can be."""
    with suppress(OSError):
        os.unlink(name, dir_fd=at)


def _write_all(descriptor: int, content: memoryview | bytes) -> None:
    """Write everything and flush it to the disk."""
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest[:_PIECE]) :]
    os.fsync(descriptor)
