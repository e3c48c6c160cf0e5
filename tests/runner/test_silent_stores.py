"""Runs into an object store that stops answering or refuses: the first signal ends them, no request waits for ever."""

from __future__ import annotations

import itertools
import signal
import threading

import pytest

from boulder_sweep import locations
from boulder_sweep.errors import Interrupted
from boulder_sweep.locations import RemotePath, location_of
from boulder_sweep.runner import interruption
from boulder_sweep.runner.interruption import Signals
from boulder_sweep.runner.sweeper import run
from boulder_sweep.store import lock as locks
from boulder_sweep.store import storage
from boulder_sweep.store.failures import WriteError
from boulder_sweep.store.reader import finished_table
from boulder_sweep.store.writer import OutputFolder
from tests.runner.grids import grid_of, plausible, same_bits
from tests.store.silent_stores import SilentFileSystem, store
from tests.store.states import status
from tests.waiting import HANG_GUARD_S, wait_until

OUT = "silent://bucket/out"
LATE = ("interruptible work", "last work", "committer", "workers", "heartbeat", "request", "requests")
ROWS, ROWS_PER_PART = 6000, 1000


@pytest.fixture
def silent(monkeypatch):
    monkeypatch.setattr(locations, "FIRST_WAIT_S", 0.0)
    monkeypatch.setattr(locations, "REQUEST_S", HANG_GUARD_S)  # hang guard
    before = set(threading.enumerate())
    with store() as found:
        yield found
    wait_until(lambda: not [one for one in set(threading.enumerate()) - before if one.name in LATE], "all has ended")


def start(**options):
    return run(grid_of(ROWS), OUT, jobs=1, rows_per_part=ROWS_PER_PART, simulate=plausible, **options)


def fall_silent_at(silent, monkeypatch, kind, method, which):
    """Let all requests from a call of a method on be given up."""
    ask, count = getattr(kind, method), itertools.count(1)

    def ask_in_vain(self, *arguments):
        if next(count) == which:
            silent.quiet.set()
            monkeypatch.setattr(locations, "REQUEST_S", 0.2)  # no answer comes, however long it is
        return ask(self, *arguments)

    monkeypatch.setattr(kind, method, ask_in_vain)


@pytest.mark.parametrize("when", ["info", "pipe_file", "cp_file", "ls"])
def test_the_first_signal_ends_a_run_while_the_store_is_silent(silent, monkeypatch, when):
    """No request is answered from the first of a kind on, and none is given up."""
    monkeypatch.setattr(interruption, "LAST_S", 0.2)  # no answer comes, however long it is
    answer, before, begun = SilentFileSystem._answer, signal.getsignal(signal.SIGINT), []

    def answer_until_then(self, request):
        if request == when and not begun:
            begun.append(request)
            silent.quiet.set()
            threading.Timer(0.3, signal.raise_signal, [signal.SIGINT]).start()
        answer(self, request)

    monkeypatch.setattr(SilentFileSystem, "_answer", answer_until_then)
    with pytest.raises(Interrupted) as stop:
        start()
    assert begun
    assert not silent.speaks.is_set()
    assert stop.value.rows_done == 0
    if when == "cp_file":
        assert "0 of 6,000 rows are safe. Resume with: " in str(stop.value)
    assert signal.getsignal(signal.SIGINT) == before


def test_what_goes_on_after_a_signal_is_undone(silent, monkeypatch):
    """In a notebook the process goes on, and may not hold the folder for ever."""
    monkeypatch.setattr(interruption, "LAST_S", 0.2)  # no answer comes, however long it is
    monkeypatch.setattr(locks, "HEARTBEAT_S", HANG_GUARD_S)  # hang guard
    begin = storage.refuses_existing

    def stop(folder, token):
        signal.raise_signal(signal.SIGINT)
        silent.quiet.set()
        return begin(folder, token)

    with monkeypatch.context() as patch:
        patch.setattr(storage, "refuses_existing", stop)
        with pytest.raises(Interrupted):
            start()
    silent.speaks.set()
    # First the probe is removed, then the lock.
    wait_until(lambda: silent.asked.count("rm_file") == 2 and not location_of(OUT).names(), "the folder is released")
    assert start().rows == ROWS


@pytest.mark.parametrize(
    ("kind", "method", "safe"),
    [(RemotePath, "stat", ""), (OutputFolder, "commit", ".*0 of 6,000 rows are safe; resume with: ")],
)
def test_a_silent_store_is_told_of_after_the_limit_of_a_request(silent, monkeypatch, kind, method, safe):
    monkeypatch.setattr(interruption, "LAST_S", 0.2)  # no answer comes, however long it is
    fall_silent_at(silent, monkeypatch, kind, method, 1)
    with pytest.raises(WriteError, match=f"the store has not answered for 0 s{safe}"):
        start()


def test_a_store_that_refuses_is_told_of_after_a_few_tries(silent):
    silent.refuses.set()
    with pytest.raises(WriteError, match=r"cannot write into silent://bucket/out: .*connection refused"):
        start()
    assert silent.asked == ["info"] * 4


def test_a_run_whose_store_was_silent_goes_on_to_the_same_table(silent, monkeypatch, tmp_path):
    monkeypatch.setattr(interruption, "LAST_S", 0.2)  # no answer comes, however long it is
    fall_silent_at(silent, monkeypatch, OutputFolder, "commit", 2)
    with pytest.raises(WriteError, match=r"[1-5],000 of 6,000 rows are safe"):
        start()
    silent.speaks.set()
    monkeypatch.setattr(locations, "REQUEST_S", HANG_GUARD_S)  # hang guard
    wait_until(lambda: not status(OUT).running, "the lock is released")
    start(resume=True)
    run(grid_of(ROWS), tmp_path / "whole", rows_per_part=ROWS_PER_PART, simulate=plausible)
    assert same_bits(finished_table(location_of(OUT)), finished_table(tmp_path / "whole"))


def test_a_last_attempt_waits_without_limit_until_there_is_a_signal(monkeypatch):
    monkeypatch.setattr(interruption, "LAST_S", 0.0)
    signals, ended, may_end = Signals(), [], threading.Event()

    def last():
        may_end.wait(HANG_GUARD_S)  # hang guard
        ended.append(True)

    threading.Timer(0.1, may_end.set).start()
    signals.attempt(last, hurry=False)
    assert ended == [True]
    may_end.clear()
    signals.attempt(last, hurry=True)
    threading.Timer(0.1, setattr, (signals, "caught", signal.SIGINT)).start()
    signals.attempt(last, hurry=False)
    assert ended == [True]
    assert len(signals._abandoned) == 2
    may_end.set()
