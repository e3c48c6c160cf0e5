"""One writer per folder on an object store: an object with the name of the holder and the time of its last heartbeat.

The lock keeps two runs from working at the same time. Should one believe that the other is dead while it is not, it
still cannot spoil the table: a version of the manifest is written once, see `generations`.
"""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from contextlib import suppress
from typing import Any

from boulder_sweep.locations import RemotePath
from boulder_sweep.store.errors import FolderInUseError, FolderRemovedError, StoreError
from boulder_sweep.store.lock import DEAD_AFTER_S, HEARTBEAT_S, LOCK_NAME

_PROBE = "_probe-"
_RECORD_BYTES = 1000


class ObjectLock:
    """The right to write into a folder, held from construction to `release`.

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
            raise FolderInUseError(_in_use_text(folder, holder, there))
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


def is_held(folder: RemotePath) -> bool:
    """Whether a run seems to be writing into a folder."""
    there = _record(folder / LOCK_NAME)
    return there is not None and _is_alive(there)


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


def _record(path: RemotePath) -> dict[str, Any] | None:
    """Return what a lock says; None if there is no lock."""
    try:
        found = json.loads(path.read_bytes(_RECORD_BYTES))
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


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


def _in_use_text(folder: RemotePath, holder: str, there: dict[str, Any]) -> str:
    """Say who holds the lock."""
    return (
        f"{folder} seems to be written by {holder}: its last heartbeat was {_age(there):.0f} s ago. "
        f"If that run is dead, try again in {DEAD_AFTER_S:.0f} s"
    )
