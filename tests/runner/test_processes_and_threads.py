"""Several runs in one process: side by side, one after the other, after a fork, after an interruption."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from boulder_sweep.errors import Interrupted
from boulder_sweep.runner.run import run
from boulder_sweep.signals import Signals, noted_signals
from boulder_sweep.store.failures import FolderInUseError
from boulder_sweep.store.reading import finished_table
from tests.faults.faulty import Bar, held, slowly
from tests.runner.grids import grid_of, plausible, same_bits
from tests.store.folders import nothing_left
from tests.waiting import HANG_GUARD_S


def test_runs_side_by_side(tmp_path):
    def one(number):
        return run(grid_of(2000 + number), tmp_path / f"out-{number}", jobs=2, simulate=plausible)

    with ThreadPoolExecutor(4) as pool:
        assert [summary.rows for summary in pool.map(one, range(4))] == [2000, 2001, 2002, 2003]
    for number in range(4):
        assert finished_table(tmp_path / f"out-{number}")["design_id"].to_pylist() == list(range(2000 + number))


def test_two_threads_cannot_write_into_one_folder(tmp_path):
    refused = []

    def try_it(progress):
        if not refused:
            with pytest.raises(FolderInUseError) as problem:
                run(grid_of(5000), tmp_path / "out", resume=True, simulate=slowly)
            refused.append(problem)

    assert run(grid_of(5000), tmp_path / "out", progress=try_it, simulate=slowly).rows == 5000
    assert refused


def test_a_forked_process_can_run(tmp_path):
    run(grid_of(500), tmp_path / "before", simulate=plausible)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            run(grid_of(500), tmp_path / "out", simulate=plausible)
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    assert same_bits(finished_table(tmp_path / "out"), finished_table(tmp_path / "before"))


@pytest.mark.parametrize("backend", ["threading", "dask"])
def test_an_interrupted_run_leaves_the_process_as_it_was(tmp_path, monkeypatch, backend):
    """As in a notebook, where the interpreter goes on. The last rows are held until then."""
    bar = Bar(tmp_path / "held", 20_000)
    bar.allow(10_000)
    monkeypatch.setenv(*next(iter(bar.environment.items())))
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]

    def interrupt(progress):
        signal.raise_signal(signal.SIGINT)
        bar.allow()  # the run has not ended, so it looks for signals again

    how = {"backend": backend, "jobs": 2, "simulate": held}
    with pytest.raises(KeyboardInterrupt, match=r"interrupted by SIGINT; .* of 20,000 rows are safe") as stop:
        run(grid_of(20_000), tmp_path / "out", progress=interrupt, **how)
    assert isinstance(stop.value, Interrupted)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
    assert nothing_left(tmp_path / "out")
    assert run(grid_of(20_000), tmp_path / "out", resume=True, **how).rows == 20_000
    assert finished_table(tmp_path / "out")["design_id"].to_pylist() == list(range(20_000))


def test_a_call_returns_raises_and_is_left_at_a_signal():
    signals = Signals()
    assert signals.call(lambda: 3) == 3
    with pytest.raises(ZeroDivisionError):
        signals.call(lambda: 1 // 0)
    with pytest.raises(SystemExit):
        signals.call(lambda: (_ for _ in ()).throw(SystemExit(2)))
    going = threading.Event()

    def endless():
        signals.caught = signal.SIGTERM
        going.wait(HANG_GUARD_S)  # hang guard

    with pytest.raises(Interrupted) as stop:
        signals.call(endless)
    assert stop.value.exit_code == 143
    going.set()
    with pytest.raises(Interrupted):  # nothing new is begun
        signals.call(lambda: pytest.fail("begun"))


def test_within_noted_signals_others_give_the_same():
    with noted_signals() as outer, noted_signals() as inner:
        assert outer is inner
    with noted_signals() as later:
        assert later is not outer
