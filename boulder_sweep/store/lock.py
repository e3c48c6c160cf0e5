"""One writer per folder.

On a disk the lock is `flock` on the empty file ``_lock``: the system releases it when its holder dies. A killed run
therefore never leaves a folder locked, and the file it leaves behind is recognised as stale because the lock can be
acquired. On network folders the lock may not be seen by other machines; there the heartbeat of the holder counts: it
keeps renewing the time of ``_lock``.

An object store has no locks: ``_lock`` holds the name of the holder and the time of its last heartbeat. That keeps two
runs from working at the same time. Should one believe that the other is dead while it is not, it still cannot spoil
the table: a version of the manifest is written once, see `storage`.
"""

from __future__ import annotations

import errno
import fcntl
import json
import math
import os
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.store.failures import FolderInUseError, FolderRemovedError, LinkError, StoreError, WriteError
from boulder_sweep.store.files import LOCK_NAME

HEARTBEAT_S = 10.0
"""How often the holder renews the lock [s]."""
DEAD_AFTER_S = 6 * HEARTBEAT_S
"""Time without a heartbeat after which a run on another machine counts as dead [s]."""
_NOT_SUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
_RECORD_BYTES = 1000


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
            raise FolderInUseError(_in_use_text(folder, holder, age))
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


class ObjectLock:
    """The same right on an object store: an object with the name of the holder and the time of its last heartbeat.

    Parameters
    ----------
    folder
        The output folder.
    token
        Unique name of this run.
    only_new
        Whether the store itself refuses to write an object that exists.
    holder
        Description of the run that seems to hold the lock.

    Raises
    ------
    FolderInUseError
        Another run holds it.
    OSError
        The folder cannot be written.
    """

    def __init__(self, folder: RemotePath, token: str, only_new: bool, holder: str):
        self._folder, self._path, self._token = folder, folder / LOCK_NAME, token
        self._lost: StoreError | None = None
        self._released = threading.Event()
        there = _record(self._path)
        if there is not None and _is_alive(there):
            raise FolderInUseError(_in_use_text(folder, holder, _age(there)))
        with suppress(FileExistsError):  # another was quicker, or the answer to the first try was lost
            self._path.put(self._content(), only_new=only_new and there is None)
        if (_record(self._path) or {}).get("token") != token:
            raise FolderInUseError(f"{folder} is being written by {holder}")
        self._heart = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
        self._heart.start()

    def check(self) -> None:
        """Look whether the lock is still held.

        Raises
        ------
        FolderInUseError
            Another run has taken it, because this one was silent for long.
        FolderRemovedError
            It was removed, as by another run that has ended.
        OSError
            The store does not answer.
        """
        self._look()
        self.renew()

    def renew(self) -> None:
        """Do nothing if the lock was held when the thread that sends heartbeats last looked; cheap, call it often.

        Raises
        ------
        FolderInUseError, FolderRemovedError
            As for `check`.
        """
        if self._lost is not None:
            raise self._lost

    def release(self) -> None:
        """Release the lock; may be called twice. If the store does not answer, it is that of a dead run."""
        self._released.set()
        self._heart.join()

    def _beat(self) -> None:
        """Renew the lock until it is released or taken; remove it then, so that no late heartbeat leaves a new one."""
        while not self._released.wait(HEARTBEAT_S):
            with suppress(OSError):
                self._look()
                if self._lost is not None:
                    return
                self._path.put(self._content())
        with suppress(OSError):
            if (_record(self._path) or {}).get("token") == self._token:
                self._path.unlink(missing_ok=True)

    def _look(self) -> None:
        """Note if the lock is that of another run, or gone: it is not put there again, for others may have written."""
        there = _record(self._path)
        if there is None:
            self._lost = FolderRemovedError(self._folder)
        elif there.get("token") != self._token:
            self._lost = FolderInUseError(f"{self._folder} was taken over by another run while this one was silent")

    def _content(self) -> bytes:
        record = {"token": self._token, "host": socket.gethostname(), "pid": os.getpid(), "time": time.time()}
        return json.dumps(record).encode()


def _in_use_text(folder: Location, holder: str, age_s: float) -> str:
    """Say who holds the lock."""
    return (
        f"{folder} seems to be written by {holder}: its last heartbeat was {age_s:.0f} s ago. "
        f"If that run is dead, try again in {DEAD_AFTER_S:.0f} s"
    )


def _lock(descriptor: int) -> bool:
    """Lock an open file; False where the file system has no locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as problem:
        if problem.errno in _NOT_SUPPORTED:
            return False
        raise
    return True


def _is(path: Path, descriptor: int) -> bool:
    """Whether a path still names an open file."""
    try:
        there = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    mine = os.fstat(descriptor)
    return (there.st_dev, there.st_ino) == (mine.st_dev, mine.st_ino)


def _record(path: RemotePath) -> dict[str, Any] | None:
    """Return what a lock says; None if there is no lock."""
    try:
        record = json.loads(path.read_bytes(_RECORD_BYTES))
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _is_alive(there: dict[str, Any]) -> bool:
    """Whether the holder of a lock may still be at work: not if its process is gone, or silent for long."""
    if there.get("host") == socket.gethostname() and isinstance(there.get("pid"), int):
        try:
            os.kill(there["pid"], 0)
        except (ProcessLookupError, OverflowError):
            return False
        except OSError:
            pass  # somebody else's process
    return _age(there) < DEAD_AFTER_S


def _age(there: dict[str, Any]) -> float:
    """Return the time since the last heartbeat [s]."""
    moment = there.get("time")
    with suppress(OverflowError):
        if isinstance(moment, int | float):
            return abs(time.time() - moment)
    return float("inf")
