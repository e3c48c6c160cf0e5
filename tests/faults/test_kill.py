"""kill -9 at random instants, resumed again and again: the table is that of an undisturbed run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from boulder_sweep.store import status
from boulder_sweep.store.reader import read_table
from tests.faults.processes import ROOT, Driver, run_driver
from tests.runner.grids import same_bits

pytestmark = pytest.mark.faults

KILLS = 55


def test_many_kills_lose_no_row_and_double_none(tmp_path):
    seed = int(os.environ.get("TEST_SEED", time.time_ns() % 2**32))
    command = [sys.executable, "-m", "tests.faults.kills", str(tmp_path), str(KILLS), str(seed)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["kills"] == KILLS
    assert found["faults"] == [], f"TEST_SEED={seed}"
    assert found["tables"]
    for table in found["tables"]:
        assert table == {"lost": 0, "double": 0, "different": 0}, f"TEST_SEED={seed}"


def test_kills_with_worker_processes(tmp_path):
    options = ("--rows", "6000", "--simulate", "slowly", "--rows-per-part", "1000", "--backend", "loky")
    for kill, rows in enumerate((500, 3000)):
        driver = Driver(tmp_path / "out", *options, "--resume")
        driver.wait_for_rows(rows)
        driver.signal(signal.SIGKILL)
        driver.end()
        assert driver.left_behind() == [], f"kill {kill}"
        assert status(tmp_path / "out", verify=True).damaged == {}
    code, told, _ = run_driver(tmp_path / "out", *options, "--resume")
    assert (code, told["rows"]) == (3, 6000)  # the stand-in gives rows that cannot be computed, too
    run_driver(tmp_path / "whole", *options)
    assert same_bits(read_table(tmp_path / "out"), read_table(tmp_path / "whole"))
