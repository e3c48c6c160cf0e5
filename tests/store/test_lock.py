"""One writer to a folder."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from boulder_sweep.store import lock as locks
from boulder_sweep.store.failures import FolderInUseError, WriteError
from boulder_sweep.store.files import LOCK_NAME
from boulder_sweep.store.lock import DEAD_AFTER_S, HEARTBEAT_S, FolderLock
from tests.store.states import is_locked

_HOLD = """
import signal, sys
from pathlib import Path
from boulder_sweep.store.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]), None, "nobody")
print("held", flush=True)
signal.pause()
"""


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the lock."""
    process = subprocess.Popen([sys.executable, "-c", _HOLD, tmp_path], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_second_writer_is_refused(holder, tmp_path):
    assert is_locked(tmp_path)
    with pytest.raises(FolderInUseError, match="written by process 7 on moon") as refused:
        FolderLock(tmp_path, None, "process 7 on moon")
    assert refused.value.exit_code == 4


def test_the_lock_of_a_killed_run_is_stale(holder, tmp_path):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / LOCK_NAME).exists()
    assert not is_locked(tmp_path)
    lock = FolderLock(tmp_path, os.uname().nodename, "a dead run")
    assert lock.stale
    assert is_locked(tmp_path)
    lock.release()


def test_released_is_free_and_leaves_nothing(tmp_path):
    lock = FolderLock(tmp_path, None, "nobody")
    assert not lock.stale
    lock.release()
    lock.release()
    assert names(tmp_path) == []
    FolderLock(tmp_path, None, "nobody").release()


def test_the_lock_file_is_empty(tmp_path):
    """An empty file is no part of a table to any reader."""
    lock = FolderLock(tmp_path, None, "nobody")
    assert (tmp_path / LOCK_NAME).stat().st_size == 0
    lock.release()


@pytest.fixture
def no_shared_locks(monkeypatch):
    """A network folder whose locks do not reach other machines."""

    def unsupported(descriptor, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", unsupported)


NOW = 1e9


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until the test sets it."""
    clock = SimpleNamespace(now=NOW)
    stopped = SimpleNamespace(time=lambda: clock.now, monotonic=lambda: clock.now)
    monkeypatch.setattr(locks, "time", stopped)
    return clock


def test_a_fresh_sign_of_life_on_another_machine_counts(tmp_path, no_shared_locks, clock):
    FolderLock(tmp_path, None, "nobody")
    os.utime(tmp_path / LOCK_NAME, (NOW, NOW))
    clock.now = NOW + 0.9 * DEAD_AFTER_S
    with pytest.raises(FolderInUseError, match=r"last heartbeat was 54 s ago"):
        FolderLock(tmp_path, "othermachine", "process 7 on othermachine")


def test_an_old_sign_of_life_does_not(tmp_path, no_shared_locks, clock):
    FolderLock(tmp_path, None, "nobody")
    os.utime(tmp_path / LOCK_NAME, (NOW, NOW))
    clock.now = NOW + 1.1 * DEAD_AFTER_S
    lock = FolderLock(tmp_path, "othermachine", "process 7 on othermachine")
    assert lock.stale
    assert (tmp_path / LOCK_NAME).stat().st_mtime != NOW
    lock.release()
    assert names(tmp_path) == []


def test_the_holder_gives_signs_of_life(tmp_path, clock):
    lock = FolderLock(tmp_path, None, "nobody")
    os.utime(tmp_path / LOCK_NAME, (1000, 1000))
    clock.now = NOW + 0.9 * HEARTBEAT_S
    lock.renew()
    assert (tmp_path / LOCK_NAME).stat().st_mtime == 1000  # not yet due
    clock.now = NOW + 1.1 * HEARTBEAT_S
    lock.renew()
    assert (tmp_path / LOCK_NAME).stat().st_mtime > 1000
    lock.release()


def test_a_folder_that_is_gone_cannot_be_locked(tmp_path):
    with pytest.raises(WriteError, match="cannot write into"):
        FolderLock(tmp_path / "gone", None, "nobody")


@pytest.mark.parametrize("call", ["flock", "utime"])
def test_a_system_that_refuses_a_call_leaves_no_lock(tmp_path, monkeypatch, call):
    def refuse(*_):
        raise OSError(errno.EPERM, "Operation not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(fcntl if call == "flock" else os, call, refuse)
        if call == "flock":
            with pytest.raises(WriteError, match=r"cannot lock .*: Operation not permitted"):
                FolderLock(tmp_path, None, "nobody")
        else:
            FolderLock(tmp_path, None, "nobody").release()
    assert not is_locked(tmp_path)
