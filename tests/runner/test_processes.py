"""The side of a worker process."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
import time

import numpy as np
import pytest

from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.pilot import accuracy_of
from boulder_sweep.runner import processes
from boulder_sweep.runner.processes import Failure, NoRoom, Parcel, Work, compute_here, new_exchange, one_line, opened
from tests.runner.grids import grid, plausible


@pytest.fixture
def exchange():
    folder = new_exchange()
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def worker(exchange, monkeypatch):
    """This process as a worker that has begun."""
    sweep = grid()
    work = Work(evaluation_of(sweep, accuracy_of(sweep), plausible), sweep.block, exchange)
    monkeypatch.setattr(processes, "_work", work)
    return work


def test_a_result_goes_through_a_file_that_is_gone_afterwards(worker):
    parcel = compute_here(10, 30)
    assert isinstance(parcel, Parcel)
    judged = opened(parcel)
    expected = worker.evaluate(worker.make_block(10, 30))
    assert np.array_equal(judged.margin, expected.margin, equal_nan=True)
    assert judged.reasons == expected.reasons
    assert list(worker.exchange.iterdir()) == []


def test_only_this_user_can_look_into_the_exchange(exchange):
    assert stat.S_IMODE(exchange.stat().st_mode) == 0o700


def test_a_mistake_is_told_not_raised(worker):
    assert compute_here(0, 10**9) == Failure(compute_here(0, 10**9).text)
    assert compute_here(0, 10**9).text.startswith("IndexError")


def test_a_result_that_cannot_be_handed_over_is_said(worker):
    shutil.rmtree(worker.exchange)
    outcome = compute_here(0, 5)
    assert isinstance(outcome, NoRoom)
    assert "No such file" in outcome.text


def test_a_process_that_was_told_nothing_says_so(monkeypatch):
    monkeypatch.setattr(processes, "_work", None)
    assert isinstance(compute_here(0, 5), NoRoom)


def test_folders_of_runs_that_were_killed_are_removed_and_others_kept(exchange):
    ended = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    dead = int(ended.stdout)
    old = time.time() - 10_000
    made = {}
    for name, owner, when in (("killed", dead, old), ("new", dead, time.time()), ("alive", os.getpid(), old)):
        made[name] = exchange.parent / f"boulder-sweep-{owner}-test{name}"
        made[name].mkdir()
        os.utime(made[name], (when, when))
    try:
        shutil.rmtree(new_exchange())
        assert [name for name, folder in made.items() if folder.exists()] == ["new", "alive"]
    finally:
        for folder in made.values():
            shutil.rmtree(folder, ignore_errors=True)


def test_problems_in_one_line():
    assert one_line(ValueError("a\n  b")) == "ValueError: a b"
    assert one_line(MemoryError()) == "MemoryError"
    assert len(one_line(ValueError("x" * 500))) == 200
