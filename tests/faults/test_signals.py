"""SIGINT, SIGTERM and SIGKILL against runs with each backend."""

from __future__ import annotations

import signal
import time

import pytest

from boulder_sweep.runner.sweeper import run
from boulder_sweep.store import status
from boulder_sweep.store.reader import read_table
from tests.faults.faulty import slowly
from tests.faults.processes import Driver
from tests.runner.grids import grid_of, same_bits

pytestmark = pytest.mark.faults

ROWS = 100_000
SLOW = ("--rows", str(ROWS), "--simulate", "slowly", "--rows-per-part", "20000")
SOON = 5.0
"""A second on a free machine; several where others work, too."""


@pytest.mark.parametrize(
    ("number", "code", "backend"),
    [
        (signal.SIGINT, 130, "threading"),
        (signal.SIGTERM, 143, "threading"),
        (signal.SIGTERM, 143, "dask"),
    ],
)
def test_a_run_stops_soon_keeps_what_is_done_and_says_how_to_go_on(tmp_path, backend, number, code):
    out = tmp_path / "out"
    driver = Driver(out, *SLOW, "--backend", backend)
    driver.wait_for_rows(10_000)  # so many that the first ones must be among them
    begun = time.monotonic()
    driver.signal(number)
    returned, told, complaints = driver.end()
    assert time.monotonic() - begun < SOON
    assert returned == code
    assert signal.Signals(number).name in told["problem"]
    assert "resume=True" in told["problem"] or "--resume" in told["problem"]
    assert complaints == ""
    assert driver.left_behind() == []
    found = status(out, verify=True)
    assert found.damaged == {}
    assert not found.running
    assert 0 < found.rows_done < ROWS
    assert found.sessions[-1].how == f"interrupted by signal {int(number)}"
    assert read_table(out)["design_id"].to_pylist() == list(range(found.rows_done))


def test_an_interrupted_run_goes_on_to_the_same_table(tmp_path):
    rows = ("--rows", "10000", "--simulate", "slowly", "--rows-per-part", "4000")
    driver = Driver(tmp_path / "out", *rows)
    driver.wait_for_rows(2000)
    driver.signal(signal.SIGINT)
    assert driver.end()[0] == 130
    done = status(tmp_path / "out").rows_done
    again = run(grid_of(10_000), tmp_path / "out", resume=True, simulate=slowly)
    assert again.rows_computed == 10_000 - done
    run(grid_of(10_000), tmp_path / "whole", simulate=slowly, rows_per_part=4000)
    assert same_bits(read_table(tmp_path / "out"), read_table(tmp_path / "whole"))


@pytest.mark.parametrize("backend", ["threading", pytest.param("dask", marks=pytest.mark.nightly)])
def test_the_second_signal_ends_it_at_once(tmp_path, backend):
    driver = Driver(tmp_path / "out", *SLOW, "--backend", backend)
    driver.wait_for_rows()
    driver.signal(signal.SIGINT)
    time.sleep(0.02)
    driver.signal(signal.SIGINT)
    returned, _, _ = driver.end()
    assert returned in (-signal.SIGINT, 130)  # 130 where the first was quicker
    assert driver.left_behind() == []
    assert status(tmp_path / "out", verify=True).damaged == {}


def test_a_signal_before_the_computing_begins_leaves_no_trace(tmp_path):
    driver = Driver(tmp_path / "out", *SLOW)
    while not (tmp_path / "out" / "_manifest.parquet").exists():
        time.sleep(0.002)
    driver.signal(signal.SIGTERM)
    returned, told, _ = driver.end()
    assert returned == 143
    assert "SIGTERM" in told["problem"]


@pytest.mark.parametrize("backend", ["threading", "dask"])
def test_no_worker_outlives_a_killed_run(tmp_path, backend):
    driver = Driver(tmp_path / "out", *SLOW, "--backend", backend)
    driver.wait_for_rows()
    driver.signal(signal.SIGKILL)
    driver.end()
    assert driver.left_behind() == []
    found = status(tmp_path / "out", verify=True)
    assert found.damaged == {}
    assert not found.running
    assert found.sessions[-1].ended is None
