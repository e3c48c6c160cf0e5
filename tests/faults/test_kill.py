"""Kills and damage, again and again: the table equals an undisturbed run's."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.faults.processes import ROOT
from tests.waiting import HANG_GUARD_S

pytestmark = pytest.mark.faults


@pytest.mark.parametrize("kills", [5, pytest.param(55, marks=pytest.mark.nightly)])
def test_many_kills_lose_no_row_and_double_none(tmp_path, kills):
    seed = int(os.environ.get("TEST_SEED", "20261"))
    command = [sys.executable, "-m", "tests.faults.kills", str(tmp_path), str(kills), str(seed)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANG_GUARD_S)  # hang guard
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["kills"] == kills
    assert found["faults"] == [], f"TEST_SEED={seed}"
    assert found["tables"]
    for table in found["tables"]:
        assert table == {"lost": 0, "double": 0, "different": 0}, f"TEST_SEED={seed}"


@pytest.mark.nightly
def test_damage_of_a_table_is_seen(tmp_path):
    seed = os.environ.get("TEST_SEED", "20261")
    command = [sys.executable, "-m", "tests.store.damages", str(tmp_path), "320", seed]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANG_GUARD_S)  # hang guard
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    assert json.loads(done.stdout.splitlines()[-1])["faults"] == [], f"TEST_SEED={seed}"
