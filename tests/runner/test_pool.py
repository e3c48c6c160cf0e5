"""Calls in threads and on a cluster: the same results in the same order."""

from __future__ import annotations

import os
import pickle

import pytest

from boulder_sweep.errors import BackendError, QuestionError
from boulder_sweep.runner.pool import Pool, pool


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
