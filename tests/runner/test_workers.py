"""Blocks handed out, results collected, failures retried."""

from __future__ import annotations

import threading
from typing import NamedTuple

import numpy as np
import pytest

from boulder_sweep.columns import REASONS, VERDICTS
from boulder_sweep.errors import BackendError
from boulder_sweep.judge.judged import Judged, not_computed
from boulder_sweep.runner.admission import Admission
from boulder_sweep.runner.backends import Backend
from boulder_sweep.runner.estimate import blocks
from boulder_sweep.runner.workers import Ended, Workers


class Rows(NamedTuple):
    """Stands for a block: just its rows."""

    start: int
    stop: int


def good(block: Rows) -> Judged:
    """Judged rows whose margin is the number of the row."""
    n = block.stop - block.start
    rows = not_computed(("x",), np.zeros(n, dtype=int))
    own = {
        "verdict": np.zeros(n, dtype=np.int8),
        "reason": np.zeros(n, dtype=np.int32),
        "margin": np.arange(block.start, block.stop, dtype=float),
    }
    return Judged(rows.columns | own, rows.words | {"reason": REASONS})


def work_off(evaluate, rows=1000, size=32, jobs=2, limit=10**9, backend="threading"):
    """Run workers to their end; rows by their place, and what was told."""
    engine = Backend(backend, jobs)
    admission = Admission(limit)
    workers = Workers(engine, evaluate, Rows, blocks(iter([(0, rows)]), size), admission)
    workers.start()
    margin = np.full(rows, -1.0)
    verdict = np.full(rows, -1)
    reasons = [""] * rows
    while True:
        piece = workers.results.get(timeout=60)
        if isinstance(piece, Ended):
            break
        n = len(piece.judged.verdict)
        place = slice(piece.start, piece.start + n)
        assert (verdict[place] == -1).all(), "rows came twice"
        margin[place], verdict[place] = piece.judged["margin"], piece.judged.verdict
        reasons[place] = [piece.judged.reasons[code] for code in piece.judged.reason]
        admission.release(n)
    engine.close()
    return margin, verdict, reasons, piece.problem, workers


@pytest.mark.parametrize("jobs", [1, 2, 5])
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_every_row_comes_once(jobs, size):
    margin, verdict, _, problem, _ = work_off(good, rows=200, jobs=jobs, size=size)
    assert problem is None
    assert np.array_equal(margin, np.arange(200.0))
    assert (verdict == 0).all()


def test_rows_under_way_stay_within_bounds():
    under_way, most = set(), 0
    lock = threading.Lock()

    def watched(block):
        nonlocal most
        with lock:
            under_way.add(block.start)
            most = max(most, len(under_way))
        try:
            return good(block)
        finally:
            with lock:
                under_way.discard(block.start)

    margin, *_ = work_off(watched, rows=500, size=10, jobs=4, limit=20)
    assert np.array_equal(margin, np.arange(500.0))
    assert most <= 2


@pytest.mark.parametrize("size", [1, 32])
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_block_that_raises_once_is_tried_again(jobs, size):
    raised = []

    def flaky(block):
        if not raised:
            raised.append(block)
            raise MemoryError("just now")
        return good(block)

    margin, verdict, _, problem, _ = work_off(flaky, rows=200, jobs=jobs, size=size)
    assert problem is None
    assert len(raised) == 1
    assert (verdict == 0).all()
    assert np.array_equal(margin, np.arange(200.0))


@pytest.mark.parametrize("size", [1, 32, 999])
def test_only_the_rows_that_raise_become_errors(size):
    bad = {17, 18, 500, 999}

    def picky(block):
        if bad & set(range(*block)):
            raise ZeroDivisionError("bad luck\nin two lines")
        return good(block)

    margin, verdict, reasons, problem, _ = work_off(picky, size=size)
    assert problem is None
    assert set(np.flatnonzero(verdict == VERDICTS.index("error"))) == bad
    assert np.array_equal(np.delete(margin, sorted(bad)), np.delete(np.arange(1000.0), sorted(bad)))
    assert {reasons[row] for row in bad} == {
        "the computation of this design failed: ZeroDivisionError: bad luck in two lines"
    }


def test_when_everything_raises_it_ends_all_the_same():
    def broken(block):
        raise ValueError("x" * 1000)

    _, verdict, reasons, problem, _ = work_off(broken, rows=20_000, size=5000)
    assert problem is None
    assert (verdict == VERDICTS.index("error")).all()
    assert len(max(reasons, key=len)) < 300


def test_a_mistake_in_making_blocks_is_reported_like_one_in_computing_them():
    engine = Backend("threading", 2)

    def no_block(start, stop):
        raise IndexError("no such rows")

    workers = Workers(engine, good, no_block, iter([(0, 4)]), Admission(100))
    workers.start()
    found = [workers.results.get(timeout=30) for _ in range(5)]
    assert sorted(piece.start for piece in found[:4]) == [0, 1, 2, 3]
    assert found[4] == Ended(None)


def test_stopped_workers_hand_out_no_more():
    begun = threading.Event()
    count = []

    def slow(block):
        begun.set()
        count.append(block)
        threading.Event().wait(0.05)
        return good(block)

    engine = Backend("threading", 2)
    workers = Workers(engine, slow, Rows, blocks(iter([(0, 10**9)]), 1), Admission(10**9))
    workers.start()
    assert begun.wait(10)
    workers.stop()
    workers.join(10)
    assert not workers.is_alive()
    assert len(count) < 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("ray", 2), "threading, dask"),
        (("threading", 2, "tcp://127.0.0.1:1"), "needs the backend dask"),
    ],
)
def test_backends_that_cannot_be_had(arguments, words):
    with pytest.raises(BackendError, match=words):
        Backend(*arguments)
