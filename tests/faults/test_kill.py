"""kill -9 at random instants, resumed again and again: the table is that of an undisturbed run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import pytest

from tests.faults.processes import ROOT

pytestmark = pytest.mark.faults


@pytest.mark.parametrize("kills", [5, pytest.param(55, marks=pytest.mark.nightly)])
def test_many_kills_lose_no_row_and_double_none(tmp_path, kills):
    seed = int(os.environ.get("TEST_SEED", time.time_ns() % 2**32))
    command = [sys.executable, "-m", "tests.faults.kills", str(tmp_path), str(kills), str(seed)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["kills"] == kills
    assert found["faults"] == [], f"TEST_SEED={seed}"
    assert found["tables"]
    for table in found["tables"]:
        assert table == {"lost": 0, "double": 0, "different": 0}, f"TEST_SEED={seed}"
