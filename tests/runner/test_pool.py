"""Calls in threads and on a cluster: the same results in the same order."""

from __future__ import annotations

import itertools
import os
import pickle
import threading

import pytest

from boulder_sweep.errors import BackendError, ClusterLostError, QuestionError
from boulder_sweep.runner import dispatch
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
    with pool(1, "dask") as workers, pytest.raises(BackendError, match="zero division error: by chance"):
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


def run_out(_):
    raise TimeoutError("no answer from the store")


def test_a_call_that_runs_out_of_time_itself_is_not_waited_for():
    with pool(1, "dask") as workers, pytest.raises(BackendError, match="timeout error: no answer from the store"):
        list(workers([(run_out, (1,), {})]))


class Hanging:
    """A cluster of workers of which some hang: they have calls, but no heartbeats and no results."""

    status, silent, kind, address = "running", frozenset(), None, "tcp://scheduler"

    def __init__(self, *names, hung=("b",)):
        self.client, self.given, self.names, self.hung = self, [], list(names), hung
        self.turn, self.looks, self.given_before = itertools.cycle(names), 0, None

    def submit(self, function, *arguments, workers=None, pure=True):
        if workers and self.given_before is None:
            self.given_before, self.looks_before = len(self.given), self.looks
        worker = workers[0] if workers else next(self.turn)
        self.given.append((worker, arguments[0]))
        return self.kind(worker, worker in self.hung, function(*arguments))

    def threads(self):
        return dict.fromkeys(self.names, 1)

    def last_seen(self):
        self.looks += 1
        return {name: -1.0 if name in self.hung else float(self.looks) for name in self.names}

    def tasks_of(self, workers):
        return {f"{worker} {value}" for worker, value in self.given if worker in workers}

    def lost_text(self):
        return "the scheduler was lost"


class HangingCall:
    """A call on a worker, done at once but on one that hangs."""

    def __init__(self, worker, hung, value):
        self.hung, self.value, self.key = hung, value, f"{worker} {value // 2}"
        self.released = threading.Event()
        self.status = "finished" if self.done() else "pending"

    def add_done_callback(self, tell):
        if self.done():
            tell(self)

    def cancelled(self):
        return self.released.is_set()

    def done(self):
        return not self.hung

    def result(self, timeout):
        assert not self.released.is_set()
        if self.hung:
            raise TimeoutError
        return self.value

    def release(self):
        self.released.set()


class HeldResult(HangingCall):
    """The same where the worker has hung when the call was done: its result is there, but is never sent."""

    def done(self):
        return True

    def result(self, timeout):
        if self.hung and timeout > 0.01:
            self.released.wait(HANG_GUARD_S)
        return super().result(timeout)


@pytest.fixture(params=[HangingCall, HeldResult])
def cluster(request, monkeypatch):
    """Return a function that makes a cluster, and a pool on it whose clock goes on by five seconds at every look."""
    monkeypatch.setattr(dispatch, "FETCH_S", 0.01)
    monkeypatch.setattr(Hanging, "kind", request.param)

    def make(*names, **how):
        cluster, clock = Hanging(*names, **how), itertools.count(step=5.0)
        return cluster, Pool(1, cluster, lambda: next(clock))

    return make


def test_calls_of_a_worker_that_hangs_are_made_by_others(cluster):
    """Half a minute after its last heartbeat, all that it has, and nothing more is given to it."""
    cluster, workers = cluster("a", "b")
    assert list(workers((times, (value,), {}) for value in range(9))) == list(range(0, 18, 2))
    assert {(worker, value) for worker, value in cluster.given[:4]} == {("a", 0), ("b", 1), ("a", 2), ("b", 3)}
    assert cluster.looks_before in (7, 8), "found out by counting looks"
    assert {worker for worker, value in cluster.given[cluster.given_before :]} == {"a"}
    assert {value for worker, value in cluster.given if worker == "a"} == set(range(9))
    cluster.given.clear()
    assert list(workers((times, (value,), {}) for value in range(9))) == list(range(0, 18, 2))
    assert {worker for worker, value in cluster.given} == {"a"}, "the next calls need not find it out again"


def test_where_every_worker_hangs_that_is_told(cluster):
    _, workers = cluster("a", "b", hung=("a", "b"))
    with pytest.raises(ClusterLostError, match="workers a, b are silent, and there is no other"):
        list(workers((times, (value,), {}) for value in range(9)))


def test_where_no_worker_is_left_that_is_told(cluster):
    cluster, workers = cluster("a", hung=("a",))

    def calls():
        yield times, (1,), {}
        cluster.names.clear()

    with pytest.raises(ClusterLostError, match="scheduler at tcp://scheduler has no worker; start one with: dask wor"):
        list(workers(calls()))


def test_a_worker_that_leaves_when_all_is_done_is_not_missed(cluster):
    cluster, workers = cluster("a", hung=())

    def calls():
        yield times, (1,), {}
        cluster.names.clear()

    assert list(workers(calls())) == [2]


def test_calls_wait_for_a_worker_that_comes_later(cluster):
    cluster, workers = cluster("a", hung=())
    names, looks = cluster.names.copy(), itertools.count()
    cluster.names.clear()
    cluster.threads = lambda: dict.fromkeys(names, 1) if next(looks) > 1 else {}
    assert list(workers((times, (value,), {}) for value in range(9))) == list(range(0, 18, 2))


def test_a_mistake_in_making_calls_is_not_blamed_on_the_workers(cluster):
    def calls():
        yield times, (1,), {}
        raise ZeroDivisionError("by chance")

    with pytest.raises(ZeroDivisionError, match="by chance"):
        list(cluster("a", hung=())[1](calls()))


@pytest.mark.parametrize("status", ["running", "closed"])
def test_a_result_that_cannot_be_fetched_is_told(cluster, monkeypatch, status):
    def refuse(self, timeout):
        cluster.status = status
        raise ConnectionError("broken off")

    monkeypatch.setattr(HangingCall, "result", refuse)
    cluster, workers = cluster("a", hung=())
    lost = {"closed": (ClusterLostError, "the scheduler was lost")}
    error, words = lost.get(status, (BackendError, "cannot answer this: connection error: broken off"))
    with pytest.raises(error, match=words):
        list(workers([(times, (1,), {})]))
