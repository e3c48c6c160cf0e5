"""Calls in threads and on a cluster: the same results in the same order."""

from __future__ import annotations

import os
import pickle

import pytest

from boulder_sweep.errors import BackendError, QuestionError
from boulder_sweep.runner.pool import Pool, pool
from boulder_sweep.runner.run import estimate
from tests.runner.grids import grid_of


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
