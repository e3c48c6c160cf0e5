"""Calls in threads and on a cluster: the same results in the same order."""

from __future__ import annotations

import threading

import pytest
from distributed import LocalCluster, default_client

from boulder_sweep.errors import BackendError, QuestionError
from boulder_sweep.runner.pool import Pool, call, cluster
from boulder_sweep.runner.run import estimate, run
from tests.runner.grids import grid_of, plausible


def times(number, *, by=2):
    return number * by


def refuse(_):
    raise QuestionError("not this one")


def fail(_):
    raise ZeroDivisionError("by chance")


def run_out(_):
    raise TimeoutError("no answer from the store")


def scaled(by, value):
    return by[0] * value


@pytest.mark.parametrize("jobs", [1, 3])
def test_results_come_in_the_order_of_the_calls(jobs):
    assert list(Pool(jobs)(call(times, value, by=5) for value in range(50))) == list(range(0, 250, 5))
    with pytest.raises(QuestionError, match="not this one"):
        list(Pool(jobs)([call(refuse, 1)]))


@pytest.mark.parametrize(("how", "first"), [({}, True), ({"in_order": False}, 2)])
def test_threads_work_side_by_side_and_results_are_in_order_by_default(how, first):
    """The first call ends after the third has begun."""
    begun = threading.Event()
    calls = [call(begun.wait, 60.0), call(times, 1), call(begun.set)]
    results = list(Pool(2)(calls, **how))
    assert results[0] == first
    three = threading.Barrier(3)
    assert sorted(Pool(3)([call(three.wait, 60.0)] * 3)) == [0, 1, 2]


@pytest.mark.parametrize(("jobs", "count", "own"), [(1, 2, True), (2, 1, True), (2, 2, False)])
def test_what_is_not_side_by_side_runs_in_the_calling_thread(jobs, count, own):
    threads = set(Pool(jobs)(call(threading.get_ident) for _ in range(count)))
    assert (threads == {threading.get_ident()}) is own


def test_a_cluster_makes_every_call_and_passes_on_errors_of_ours():
    with cluster(3, None) as workers:
        shared = [3]
        assert workers.jobs == 3
        assert sorted(workers((call(scaled, shared, value) for value in range(50)), shared)) == list(range(0, 150, 3))
        with pytest.raises(QuestionError, match="not this one"):
            list(workers([call(refuse, 1)]))
        with pytest.raises(ValueError, match="No client"):
            default_client()


@pytest.mark.parametrize(
    ("fails", "words"),
    [("fail", "zero division error: by chance"), ("run_out", "timeout error: no answer from the store")],
)
def test_a_failure_on_a_cluster_is_told_in_one_line(fails, words):
    with cluster(1, None) as workers, pytest.raises(BackendError, match=words):
        list(workers([call(globals()[fails], 1)]))


def test_a_cluster_of_others_is_used_and_no_client_becomes_the_default(tmp_path):
    with (
        LocalCluster(processes=False, n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as there,
        cluster(None, there.scheduler_address) as workers,
    ):
        assert workers.jobs == 1
        assert list(workers([call(times, 4)])) == [8]
        how = {"backend": "dask", "scheduler": there.scheduler_address, "simulate": plausible}
        assert run(grid_of(10), tmp_path / "out", jobs=3, **how).jobs == 1
        with pytest.raises(ValueError, match="No client"):
            default_client()


def test_other_failures_of_calls_are_passed_on():
    with pytest.raises(ZeroDivisionError, match="by chance"):
        list(Pool(2)([call(fail, 1)]))


def test_a_scheduler_without_a_worker_is_told(monkeypatch):
    def wait(*_, **__):
        raise TimeoutError

    monkeypatch.setattr("distributed.Client.wait_for_workers", wait)
    with LocalCluster(processes=False, n_workers=0, dashboard_address="127.0.0.1:0") as there:
        words = f"the Dask scheduler at {there.scheduler_address} has no worker; start one with: dask worker"
        with pytest.raises(BackendError, match=words), cluster(None, there.scheduler_address):
            pass


@pytest.mark.parametrize("jobs", [0, -5])
def test_a_number_of_threads_below_one_is_refused(jobs):
    with pytest.raises(ValueError, match=f"jobs must be at least 1, not {jobs}"):
        Pool(jobs)
    with pytest.raises(ValueError, match=f"jobs must be at least 1, not {jobs}"):
        estimate(grid_of(10), jobs=jobs)
