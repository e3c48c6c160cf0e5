"""Calls in threads and on a cluster: the same results in the same order."""

from __future__ import annotations

import itertools
import os
import pickle
import threading

import pytest

from boulder_sweep.errors import BackendError, QuestionError
from boulder_sweep.runner.pool import Pool, pool
from boulder_sweep.runner.sweeper import estimate
from tests.runner.grids import grid_of
from tests.waiting import HANG_GUARD_S


def times(number, *, by=2):
    return number * by


def refuse(_):
    raise QuestionError("not this one")


def fail(_):
    raise ZeroDivisionError("by chance")


def ask_again(workers, number):
    """Use the pool that came with the call."""
    return list(workers((times, (value,), {"by": 3}) for value in range(number))), os.getpid()


@pytest.mark.parametrize("how", [(1,), (3,), (2, "dask")], ids=["one", "threads", "dask"])
def test_results_come_in_the_order_of_the_calls(how):
    with pool(*how) as workers:
        assert list(workers((times, (value,), {"by": 5}) for value in range(50))) == list(range(0, 250, 5))
        ((nested, _),) = workers([(ask_again, (workers, 4), {})])
        assert nested == [0, 3, 6, 9]
        with pytest.raises(QuestionError, match="not this one"):
            list(workers([(refuse, (1,), {})]))


def test_a_failure_on_a_cluster_is_told_in_one_line():
    with pool(1, "dask") as workers, pytest.raises(BackendError, match="ZeroDivisionError: by chance"):
        list(workers([(fail, (1,), {})]))


def test_no_more_calls_are_in_progress_than_the_workers_can_take():
    made = []

    def calls():
        for value in range(100):
            made.append(value)
            yield times, (value,), {}

    with pool(1, "dask") as workers:
        next(workers(calls()))
        assert len(made) <= 4


def test_a_pool_that_is_sent_works_in_the_calling_thread():
    assert pickle.loads(pickle.dumps(Pool(8)))._jobs == 1


def test_unknown_backends_are_refused():
    with pytest.raises(BackendError, match="unknown backend"), pool(1, "ray"):
        pass


@pytest.mark.parametrize("started", [0, 2])
def test_threads_that_the_system_does_not_start_are_told_in_one_line(no_more_threads, started):
    no_more_threads(started)
    with pytest.raises(BackendError, match="the system cannot start 3,000 threads; give a smaller number of --jobs"):
        list(Pool(3000)((times, (value,), {}) for value in range(9)))


def test_other_failures_of_calls_are_passed_on():
    with pytest.raises(ZeroDivisionError, match="by chance"):
        list(Pool(2)([(fail, (1,), {})]))


@pytest.mark.parametrize("jobs", [0, -5])
def test_a_number_of_threads_below_one_is_refused(jobs):
    with pytest.raises(ValueError, match=f"jobs must be at least 1, not {jobs}"):
        Pool(jobs)
    with pytest.raises(ValueError, match=f"jobs must be at least 1, not {jobs}"):
        estimate(grid_of(10), jobs=jobs)


class Late:
    """A call on a cluster whose result is there, but takes its time to be sent."""

    def __init__(self):
        self.status, self.asked = "finished", 0

    def done(self):
        return True

    def result(self, timeout):
        self.asked += 1
        if self.asked < 3:
            raise TimeoutError(f"timed out after {timeout} s")
        return 7


class Failed(Late):
    """A call that ran out of time itself."""

    def result(self, timeout):
        self.status = "error"
        raise TimeoutError("no answer from the store")


class Workers:
    """A cluster of one worker that never works."""

    def threads(self):
        return {"tcp://worker": 1}


def test_a_result_that_comes_late_is_waited_for():
    assert Pool(1)._result(Workers(), late := Late()) == 7
    assert late.asked == 3
    with pytest.raises(BackendError, match="TimeoutError: no answer from the store"):
        Pool(1)._result(Workers(), Failed())


class Hanging:
    """A cluster whose worker b hangs: it has calls, but no heartbeats and no results."""

    status, silent, kind = "running", frozenset(), None

    def __init__(self):
        self.client, self.given, self.turn = self, [], itertools.cycle("ab")
        self.beats = itertools.count()

    def submit(self, function, *arguments, workers=None, pure=True):
        worker = workers[0] if workers else next(self.turn)
        self.given.append((worker, arguments[0]))
        return self.kind(worker, function(*arguments))

    def threads(self):
        return {"a": 1, "b": 1}

    def last_seen(self):
        return {"a": float(next(self.beats)), "b": -1.0}

    def tasks_of(self, workers):
        return {f"{worker} {value}" for worker, value in self.given if worker in workers}

    def lost_text(self):
        return "the scheduler was lost"


class HangingCall:
    """A call on a worker, done at once but on the one that hangs."""

    status = "pending"

    def __init__(self, worker, value):
        self.worker, self.value, self.key = worker, value, f"{worker} {value // 2}"
        self.released = threading.Event()

    def done(self):
        return self.worker == "a"

    def result(self, timeout):
        assert not self.released.is_set()
        if self.worker == "b":
            raise TimeoutError
        return self.value

    def release(self):
        self.released.set()


class HeldResult(HangingCall):
    """The same where the worker has hung when the call was done: its result is there, but is never sent."""

    def done(self):
        return True

    def result(self, timeout):
        if self.worker == "b" and timeout > 0.01:
            self.released.wait(HANG_GUARD_S)
        return super().result(timeout)


@pytest.mark.parametrize("kind", [HangingCall, HeldResult])
def test_calls_of_a_worker_that_hangs_are_made_by_others(kind, monkeypatch):
    """Half a minute after its last heartbeat, all that it has, and nothing more is given to it."""
    monkeypatch.setattr("boulder_sweep.runner.pool.FETCH_S", 0.01)
    monkeypatch.setattr(Hanging, "kind", kind)
    cluster, clock = Hanging(), itertools.count(step=5.0)
    workers = Pool(1, cluster, lambda: next(clock))
    workers._fetch_s = 0.01
    assert list(workers((times, (value,), {}) for value in range(9))) == list(range(0, 18, 2))
    by_b = [value for worker, value in cluster.given if worker == "b"]
    assert by_b == [1, 3, 5]
    assert [worker for worker, value in cluster.given[6:]] == ["a"] * (len(cluster.given) - 6)
    assert sorted(value for worker, value in cluster.given if worker == "a") == list(range(9))
    assert next(clock) <= 5.0 * 10, "found out by counting looks"
