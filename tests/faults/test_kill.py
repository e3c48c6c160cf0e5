"""Kills, failing stores, dying workers and damage, each again and again: the table equals an undisturbed run's."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.faults.processes import ROOT
from tests.waiting import HANG_GUARD_S

pytestmark = pytest.mark.faults


@pytest.mark.parametrize(
    ("kills", "by_time"),
    [
        (5, 0.0),
        # A third of them after a random time: by chance, so not for every commit.
        pytest.param(55, 1 / 3, marks=pytest.mark.nightly),
    ],
    ids=["5", "55"],
)
def test_many_kills_lose_no_row_and_double_none(tmp_path, kills, by_time):
    seed = int(os.environ.get("TEST_SEED", "20261"))
    command = [sys.executable, "-m", "tests.faults.kills", str(tmp_path), str(kills), str(seed), str(by_time)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANG_GUARD_S)  # hang guard
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["kills"] == kills
    assert found["faults"] == [], f"TEST_SEED={seed}"
    assert found["tables"]
    for table in found["tables"]:
        assert table == {"lost": 0, "double": 0, "different": 0}, f"TEST_SEED={seed}"


@pytest.mark.nightly
@pytest.mark.parametrize(
    "command",
    [
        ("tests.store.damages", "320"),
        ("tests.faults.stress s3", "3"),
        ("tests.faults.stress killed", "3"),
        ("tests.faults.stress stopped", "1"),
    ],
    ids=lambda command: command[0],
)
def test_what_disturbs_a_table_or_a_run_does_no_harm(tmp_path, command):
    (words, times), seed = command, os.environ.get("TEST_SEED", "20261")
    done = subprocess.run(
        [sys.executable, "-m", *words.split(), str(tmp_path), times, seed],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=HANG_GUARD_S,  # hang guard
    )
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    assert json.loads(done.stdout.splitlines()[-1])["faults"] == [], f"TEST_SEED={seed}"
