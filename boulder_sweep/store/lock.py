"""One writer per folder: a lock that the system releases when its holder dies.

The lock is `flock` on the empty file ``_lock``. A killed run therefore never leaves a folder locked, and the
file it leaves behind is recognised as stale because the lock can be acquired. On network folders the lock may
not be seen by other machines; there the heartbeat of the holder counts: it keeps renewing the time of ``_lock``.
"""

from __future__ import annotations

import errno
import fcntl
import math
import os
import socket
import time
from contextlib import suppress
from pathlib import Path

from boulder_sweep.store.errors import FolderInUseError, FolderRemovedError, LinkError, WriteError

LOCK_NAME = "_lock"
HEARTBEAT_S = 10.0
"""How often the holder renews the time of the lock file [s]."""
DEAD_AFTER_S = 6 * HEARTBEAT_S
"""Time without a heartbeat after which a run on another machine counts as dead [s]."""
_ATTEMPTS = 4
_NOT_SUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)


class FolderLock:
    """The right to write into a folder, held from construction to `release`.

    Parameters
    ----------
    folder
        The folder, which exists.
    last_host
        Machine of the last run into this folder that did not end properly, if any.
    holder
        Description of the run that seems to hold the lock.

    Raises
    ------
    FolderInUseError
        Another run holds it.
    WriteError
        The lock file cannot be created, as in a read-only folder, or not be locked.
    LinkError
        A link has its name.
    """

    def __init__(self, folder: Path, last_host: str | None, holder: str):
        self._path = folder / LOCK_NAME
        self.stale = self._path.exists()
        """Whether a run that died left its lock file."""
        age = self._age()
        while True:
            try:
                descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
            except OSError as problem:
                if problem.errno == errno.ELOOP:
                    raise LinkError(f"{self._path} is a link, where a run keeps a file: remove it first") from None
                raise WriteError(f"cannot write into {folder}: {problem.strerror}") from problem
            try:
                shared = _lock(descriptor)
            except OSError as problem:
                os.close(descriptor)
                if isinstance(problem, BlockingIOError):
                    raise FolderInUseError(f"{folder} is being written by {holder}") from None
                raise WriteError(f"cannot lock {folder}: {problem.strerror}") from problem
            # The previous holder may have removed the file between opening and locking: then try again.
            if _is(self._path, descriptor):
                break
            os.close(descriptor)
        elsewhere = last_host is not None and last_host != socket.gethostname()
        if (elsewhere or not shared) and self.stale and age < DEAD_AFTER_S:
            os.close(descriptor)
            raise FolderInUseError(
                f"{folder} seems to be written by {holder}: its last heartbeat was {age:.0f} s ago. "
                f"If that run is dead, try again in {DEAD_AFTER_S:.0f} s"
            )
        self._descriptor: int | None = descriptor
        self._renewed = -math.inf
        self.renew()

    def check(self) -> None:
        """Look whether the lock is still that of this folder.

        Raises
        ------
        FolderRemovedError
            The folder was removed, or another was put in its place.
        """
        if self._descriptor is not None and not _is(self._path, self._descriptor):
            raise FolderRemovedError(self._path.parent)

    def renew(self) -> None:
        """Send a heartbeat if one is due; cheap, call it often. Errors as for `check`."""
        if self._descriptor is not None and time.monotonic() - self._renewed > HEARTBEAT_S:
            self._renewed = time.monotonic()
            with suppress(OSError):
                self.check()
                os.utime(self._descriptor)

    def release(self) -> None:
        """Release the lock; may be called twice."""
        if self._descriptor is None:
            return
        with suppress(OSError):
            if _is(self._path, self._descriptor):
                self._path.unlink()
        os.close(self._descriptor)
        self._descriptor = None

    def _age(self) -> float:
        """Seconds since the last heartbeat."""
        try:
            return max(time.time() - self._path.stat().st_mtime, 0.0)
        except OSError:
            return float("inf")


def is_locked(folder: Path) -> bool:
    """Whether a run on this machine, or on one that shares its locks, is writing into a folder."""
    try:
        descriptor = os.open(folder / LOCK_NAME, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    else:
        return False
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Lock an open file; False where the file system has no locks."""
    for attempt in range(_ATTEMPTS):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if attempt == _ATTEMPTS - 1:
                raise
            time.sleep(0.05)  # it may only be a call of `is_locked`
        except OSError as problem:
            if problem.errno in _NOT_SUPPORTED:
                return False
            raise
        else:
            break
    return True


def _is(path: Path, descriptor: int) -> bool:
    """Whether a path still names an open file."""
    try:
        there = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    mine = os.fstat(descriptor)
    return (there.st_dev, there.st_ino) == (mine.st_dev, mine.st_ino)
