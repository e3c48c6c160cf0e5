"""Workers: blocks computed, failures retried, parts staged in any order and committed in theirs."""

from __future__ import annotations

import itertools
import queue
import threading
from typing import NamedTuple

import numpy as np
import pytest

from boulder_sweep.columns import REASONS, VERDICTS
from boulder_sweep.errors import BackendError, ComputationError
from boulder_sweep.judge.judged import Judged, not_computed
from boulder_sweep.runner.pool import check_backend
from boulder_sweep.runner.running import COMMIT_SHARE, GAP_S, Committer
from boulder_sweep.runner.workers import Assembly, Computation, Computed, Ended, ThreadWorkers, blocks
from boulder_sweep.store.files import part_name
from boulder_sweep.store.manifest import Manifest, Part
from boulder_sweep.store.writer import EncodedPart, StagedPart
from tests.waiting import HANG_GUARD_S, wait_until


class Rows(NamedTuple):
    """Stands for a block: just its rows."""

    start: int
    stop: int


class Recorder(Computation):
    """Keeps judged rows in place of their encoded bytes."""

    def encoded(self, first, pieces):
        rows = sum(len(piece.verdict) for piece in pieces)
        return EncodedPart(first, rows, b"", {"pieces": pieces})


class Folder:
    """Stands for an output folder: keeps what is staged and what is committed."""

    def __init__(self, rows, size):
        self.manifest = Manifest({}, rows, size, "")
        self.committed = []

    def stage(self, encoded):
        part = Part(encoded.first, encoded.rows, 0, "", encoded.verdicts, "")
        return StagedPart(part_name(part.first, part.stop, self.manifest.rows), part)

    def commit(self, staged):
        self.committed += staged
        self.manifest.parts.update(staged)


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


def work_off(evaluate, rows=1000, size=32, jobs=2, limit=10**9, part=100, make_block=Rows):
    """Run workers to their end; margin, verdict and reason of every row in the order of the commits."""
    folder, computation = Folder(rows, part), Recorder(evaluate, make_block, {})
    ranges = blocks(folder.manifest.missing(), size)
    workers = ThreadWorkers(jobs, computation, ranges, limit, folder)
    committer = Committer(folder, computation, workers)
    committer.start()
    workers.start()
    computed = 0
    while not isinstance(message := workers.messages.get(timeout=HANG_GUARD_S), Ended):  # hang guard
        if isinstance(message, Computed):
            computed += message.rows
        else:
            committer.put(message)
    committer.finish()
    committer.join(HANG_GUARD_S)  # hang guard
    assert committer.problem is None
    assert message.problem is None
    assert computed == rows
    assert [staged.part.first for staged in folder.committed] == sorted(range(0, rows, part))
    pieces = [piece for staged in folder.committed for piece in staged.part.verdicts["pieces"]]
    reasons = [piece.reasons[code] for piece in pieces for code in piece.reason]
    return np.concatenate([piece["margin"] for piece in pieces]), np.concatenate([p.verdict for p in pieces]), reasons


@pytest.mark.parametrize("jobs", [1, 2, 5])
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_every_row_comes_once_and_in_order(jobs, size):
    margin, verdict, _ = work_off(good, rows=200, jobs=jobs, size=size, part=30)
    assert np.array_equal(margin, np.arange(200.0))
    assert (verdict == 0).all()


def test_rows_in_progress_stay_within_bounds():
    in_progress, most = set(), 0
    lock = threading.Lock()

    def watched(block):
        nonlocal most
        with lock:
            in_progress.add(block.start)
            most = max(most, len(in_progress))
        try:
            return good(block)
        finally:
            with lock:
                in_progress.discard(block.start)

    margin, *_ = work_off(watched, rows=500, size=10, jobs=4, limit=20, part=10)
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

    margin, verdict, _ = work_off(flaky, rows=200, jobs=jobs, size=size)
    assert len(raised) == 1
    assert (verdict == 0).all()
    assert np.array_equal(margin, np.arange(200.0))


@pytest.mark.parametrize("size", [1, 32, 99])
def test_only_the_rows_that_raise_become_errors(size):
    bad = {17, 18, 500, 999}

    def picky(block):
        if bad & set(range(*block)):
            raise ZeroDivisionError("bad luck\nin two lines")
        return good(block)

    margin, verdict, reasons = work_off(picky, size=size)
    assert set(np.flatnonzero(verdict == VERDICTS.index("error"))) == bad
    assert np.array_equal(np.delete(margin, sorted(bad)), np.delete(np.arange(1000.0), sorted(bad)))
    assert {reasons[row] for row in bad} == {
        "the computation of this design failed: zero division error: bad luck in two lines"
    }


def test_a_thousand_rows_that_raise_become_errors():
    def broken(block):
        raise ValueError("x" * 1000)

    _, verdict, reasons = work_off(broken, rows=1000, size=500)
    assert (verdict == VERDICTS.index("error")).all()
    assert len(max(reasons, key=len)) < 300


@pytest.mark.parametrize("size", [1, 5000])
def test_when_everything_raises_nothing_more_is_computed(size):
    """What has not been tried alone is never a row of verdict error."""

    def broken(block):
        raise ValueError("x" * 1000)

    computation = Computation(broken, Rows, {})
    judged = (computation.judged(start, start + size) for start in range(0, 20_000, size))
    with pytest.raises(ComputationError, match="5,000 attempts to compute designs failed, the last with: value error"):
        list(judged)


def test_a_mistake_in_making_blocks_is_reported_like_one_in_computing_them():
    def no_block(start, stop):
        raise IndexError("no such rows")

    _, verdict, reasons = work_off(good, rows=4, make_block=no_block)
    assert (verdict == VERDICTS.index("error")).all()
    assert set(reasons) == {"the computation of this design failed: index error: no such rows"}


def test_stopped_workers_hand_out_no_more():
    begun, may_end = [], threading.Event()

    def held(block):
        begun.append(block)
        assert may_end.wait(HANG_GUARD_S)  # hang guard
        return good(block)

    folder = Folder(10**9, 10**9)
    ranges = blocks(folder.manifest.missing(), 1)
    workers = ThreadWorkers(2, Recorder(held, Rows, {}), ranges, 10**9, folder)
    workers.start()
    wait_until(lambda: len(begun) == 2, "both threads are at work")
    workers.stop()
    may_end.set()
    workers.join(HANG_GUARD_S)  # hang guard
    assert not workers.is_alive()
    assert sorted(begun) == [(0, 1), (1, 2)]


def test_a_problem_in_writing_ends_the_run():
    class Full(Folder):
        def stage(self, *_):
            raise OSError(28, "No space left on device")

    folder = Full(100, 50)
    ranges = blocks(folder.manifest.missing(), 10)
    workers = ThreadWorkers(2, Recorder(good, Rows, {}), ranges, 10**9, folder)
    workers.start()
    while not isinstance(message := workers.messages.get(timeout=HANG_GUARD_S), Ended):  # hang guard
        pass
    assert isinstance(message.problem, OSError)


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]])
def test_blocks_in_any_order_make_parts_in_order(order):
    assembly = Assembly(iter([(0, 20), (20, 40)]))
    parts = [ready for place in order for ready in assembly.add(10 * place, good(Rows(10 * place, 10 * place + 10)))]
    assert [ready.first for ready in parts] == [0, 20]
    assert all(sum(len(piece.verdict) for piece in ready.pieces) == 20 for ready in parts)
    assert assembly.flush() == []


def test_a_slow_run_writes_what_it_has_and_an_interrupted_one_flushes():
    hasty = Assembly(iter([(0, 30)]), commit_every_s=0.0, clock=itertools.count().__next__)
    assert [len(hasty.add(first, good(Rows(first, first + 10)))) for first in (0, 10, 20)] == [1, 1, 1]
    patient = Assembly(iter([(0, 30)]), clock=lambda: 0.0)
    assert patient.add(0, good(Rows(0, 10))) == patient.add(20, good(Rows(20, 30))) == []
    (flushed,) = patient.flush()
    assert (flushed.first, len(flushed.pieces)) == (0, 1)
    (rest,) = patient.add(10, good(Rows(10, 20)))
    assert (rest.first, len(rest.pieces)) == (10, 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("ray", None), "threading, dask"),
        (("threading", "tcp://127.0.0.1:1"), "needs the backend dask"),
    ],
)
def test_backends_that_do_not_exist(arguments, words):
    with pytest.raises(BackendError, match=words):
        check_backend(*arguments)


def test_a_large_manifest_is_written_seldom():
    """Parts that arrive while it would be too early share the next one; the last ones do not wait."""
    folder, commits, now = Folder(200, 10), queue.SimpleQueue(), [0.0]
    commit_s = 1.0
    rest_s = commit_s / COMMIT_SHARE
    folder.commit = lambda staged: (Folder.commit(folder, staged), commits.put(len(staged)))
    work_clock = itertools.count(step=commit_s).__next__  # it is read before and after a commit
    writer = Committer(folder, Recorder(good, Rows, {}), clock=lambda: now[0], work_clock=work_clock)

    def put(*firsts):
        for first in firsts:
            writer.put(folder.stage(EncodedPart(first, 10, b"", {"pieces": []})))

    writer.start()
    put(0)
    assert commits.get(timeout=HANG_GUARD_S) == 1  # hang guard
    put(*range(10, 80, 10))
    now[0] = 0.99 * rest_s
    put(80)
    wait_until(lambda: len(writer._waiting) == 8 or not commits.empty(), "all have arrived")
    assert commits.empty()
    now[0] = 1.01 * rest_s
    put(90)
    assert commits.get(timeout=HANG_GUARD_S) == 9  # hang guard
    put(*range(100, 200, 10))
    writer.finish()
    writer.join(HANG_GUARD_S)  # hang guard
    assert commits.get() == 10
    assert commits.empty()
    assert writer.problem is None


@pytest.mark.parametrize("first_comes", [True, False])
def test_parts_do_not_wait_for_ever_for_the_one_before_them(first_comes):
    """As where it is with a worker that hangs. What has come is committed, and the rest when it comes."""
    folder, commits, now = Folder(100, 10), queue.SimpleQueue(), [0.0]
    folder.commit = lambda staged: (Folder.commit(folder, staged), commits.put([one.part.first for one in staged]))
    writer = Committer(folder, Recorder(good, Rows, {}), clock=lambda: now[0], work_clock=lambda: 0.0)

    def put(*firsts):
        for first in firsts:
            writer.put(folder.stage(EncodedPart(first, 10, b"", {"pieces": []})))

    writer.start()
    put(0)
    assert commits.get(timeout=HANG_GUARD_S) == [0]  # hang guard
    put(30, 20, 60)
    wait_until(lambda: len(writer._waiting) == 3, "all have arrived")
    now[0] = 0.99 * GAP_S
    put(40)
    wait_until(lambda: len(writer._waiting) == 4, "it has arrived")
    assert commits.empty()
    now[0] = 1.01 * GAP_S
    put(90)
    assert commits.get(timeout=HANG_GUARD_S) == [20, 30, 40, 60, 90]  # hang guard
    if first_comes:
        put(50, 10)
        assert commits.get(timeout=HANG_GUARD_S) == [10, 50]  # hang guard
        put(80, 70)
    else:
        put(50, 70, 80)
    writer.finish()
    writer.join(HANG_GUARD_S)  # hang guard
    assert writer.problem is None
    assert sorted(part.first for part in folder.manifest.parts.values()) == [
        first for first in range(0, 100, 10) if first_comes or first not in (10, 50, 70, 80)
    ]


def test_parts_behind_a_gap_are_not_lost_where_a_run_is_stopped():
    folder = Folder(100, 10)
    writer = Committer(folder, Recorder(good, Rows, {}), clock=lambda: 0.0, work_clock=lambda: 0.0)
    for first in (0, 20, 30, 70):
        writer.put(folder.stage(EncodedPart(first, 10, b"", {"pieces": []})))
    writer.stop()
    writer.run()
    assert writer.problem is None
    assert [staged.part.first for staged in folder.committed] == [0, 20, 30, 70]


@pytest.mark.parametrize(("started", "jobs"), [(0, 3000), (2, 3000), (2, 1_000_000)])
def test_threads_that_the_system_does_not_start_end_the_run(no_more_threads, started, jobs):
    no_more_threads(started)
    folder = Folder(1000, 100)
    ranges = blocks(folder.manifest.missing(), 32)
    workers = ThreadWorkers(jobs, Recorder(good, Rows, {}), ranges, 10**9, folder)
    workers.start()
    message = workers.messages.get(timeout=HANG_GUARD_S)  # hang guard
    workers.join(HANG_GUARD_S)  # hang guard
    assert isinstance(message, Ended)
    assert isinstance(message.problem, BackendError)
    assert str(message.problem) == f"the system cannot start {jobs:,} threads; give a smaller number of --jobs"
