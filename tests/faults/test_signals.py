"""SIGINT, SIGTERM and SIGKILL against runs with each backend."""

from __future__ import annotations

import signal

import pytest

from boulder_sweep.store.reading import finished_table
from tests.faults.faulty import Bar
from tests.faults.processes import Driver, signalled
from tests.store.folders import nothing_left, rows_done
from tests.waiting import wait_until

pytestmark = pytest.mark.faults

ROWS = 100_000
REACHED = ROWS // 2
"""The end of a part; a run that is held there has written those before."""
JOBS = 2
HELD = ("--rows", str(ROWS), "--simulate", "held", "--jobs", str(JOBS))


@pytest.fixture
def bar(tmp_path):
    bar = Bar(tmp_path / "held", ROWS)
    bar.allow(REACHED)
    return bar


def held_up(out, bar, *options):
    """Start a run and wait until each of its threads waits in a block and all before is written."""
    driver = Driver(out, *HELD, *options, **bar.environment)
    bar.wait_for(JOBS)
    wait_until(lambda: rows_done(out) == REACHED, "the first parts are written")
    return driver


@pytest.mark.parametrize(
    ("number", "code", "backend"),
    [
        (signal.SIGINT, 130, "threading"),
        (signal.SIGTERM, 143, "threading"),
        (signal.SIGTERM, 143, "dask"),
    ],
)
def test_a_run_stops_soon_keeps_what_is_done_and_says_how_to_go_on(tmp_path, bar, backend, number, code):
    """It ends while blocks in hand go on: no other is begun, but for tasks that Dask was given before."""
    out = tmp_path / "out"
    driver = held_up(out, bar, "--backend", backend)
    begun = bar.begun()
    driver.signal(number)
    returned, told, complaints = driver.end()
    assert returned == code
    assert bar.begun() - begun <= (JOBS if backend == "dask" else 0)
    assert signal.Signals(number).name in told["problem"]
    assert "resume=True" in told["problem"] or "--resume" in told["problem"]
    assert complaints == ""
    driver.leaves_nothing_behind()
    assert f"{REACHED:,} of {ROWS:,} rows are safe" in told["problem"]
    assert nothing_left(out)
    assert rows_done(out) == REACHED
    assert finished_table(out)["design_id"].to_pylist() == list(range(REACHED))


@pytest.mark.parametrize("backend", ["threading", pytest.param("dask", marks=pytest.mark.nightly)])
def test_the_second_signal_ends_it_at_once(tmp_path, bar, backend):
    """The first one is noted, and nobody is there to act on it."""
    driver = Driver(tmp_path / "out", *HELD, "--backend", backend, "--stuck", **bar.environment)
    driver.wait_for_rows()
    wait_until(lambda: signalled(driver.process, signal.SIGINT), "the process has ended")
    returned, _, complaints = driver.end()
    assert (returned, complaints) == (130, "")
    driver.leaves_nothing_behind()
    assert nothing_left(tmp_path / "out")
    assert rows_done(tmp_path / "out") <= REACHED


def test_a_signal_before_the_computing_begins_leaves_no_trace(tmp_path, bar):
    driver = Driver(tmp_path / "out", *HELD, "--simulate", "never_ends", **bar.environment)
    bar.wait_for(1)
    driver.signal(signal.SIGTERM)
    returned, told, _ = driver.end()
    assert returned == 143
    assert "SIGTERM" in told["problem"]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("backend", ["threading", "dask"])
def test_no_worker_outlives_a_killed_run(tmp_path, bar, backend):
    driver = held_up(tmp_path / "out", bar, "--backend", backend)
    driver.signal(signal.SIGKILL)
    driver.end()
    driver.leaves_nothing_behind()
    assert rows_done(tmp_path / "out") == REACHED
