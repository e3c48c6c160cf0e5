"""Clusters whose workers and schedulers die: the same files, or an end in words and a run that goes on."""

from __future__ import annotations

import os
import time

import pytest

from boulder_sweep.errors import BackendError, ClusterLostError
from boulder_sweep.runner import pool
from boulder_sweep.runner.run import run
from tests.faults.clusters import Cluster
from tests.faults.faulty import slowly
from tests.runner.grids import grid_of, plausible
from tests.store.folders import nothing_left, parts_of

pytestmark = pytest.mark.faults

ROWS = 100_000


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The files of a run on this machine."""
    out = tmp_path_factory.mktemp("whole") / "out"
    run(grid_of(ROWS), out, simulate=plausible)
    return parts_of(out)


def at_first_rows(act):
    """Return a function for progress that acts once some rows are there."""
    acted = []

    def report(progress):
        if progress.rows_done and not acted:
            acted.append(True)
            act()

    return report


def on(cluster, out, **how):
    return run(grid_of(ROWS), out, backend="dask", scheduler=cluster.address, simulate=slowly, **how)


def test_the_work_of_a_killed_worker_is_done_by_others(tmp_path, whole):
    with Cluster(2, tmp_path) as cluster:
        summary = on(cluster, tmp_path / "out", progress=at_first_rows(cluster.kill_worker))
    assert (summary.rows_computed, summary.jobs) == (ROWS, 2)
    assert parts_of(tmp_path / "out") == whole


def test_a_killed_scheduler_ends_the_run_in_words_and_it_goes_on(tmp_path, whole):
    out = tmp_path / "out"
    words = r"Dask.* rows are safe\. Resume with:\n  .*--backend dask --scheduler tcp.*--resume"
    with Cluster(2, tmp_path) as cluster, pytest.raises(ClusterLostError, match=words) as lost:
        on(cluster, out, progress=at_first_rows(cluster.kill_scheduler))
    assert lost.value.exit_code == 130
    assert run(grid_of(ROWS), out, resume=True, simulate=plausible).rows_computed < ROWS
    assert parts_of(out) == whole
    assert nothing_left(out)


def test_a_cluster_does_the_work_from_its_first_thread_on_and_threads_that_come_later_help(tmp_path):
    with Cluster(1, tmp_path) as cluster, pool.cluster(None, cluster.address) as workers:
        assert list(workers([pool.call(os.getpid)])) == [cluster.workers[0].pid]
        results = workers(pool.call(_pid, 0.1) for _ in range(60))
        seen = {next(results)}
        cluster.start_worker(wait=True)
        seen.update(results)
        assert seen == {worker.pid for worker in cluster.workers}


def _pid(seconds):
    time.sleep(seconds)
    return os.getpid()


def test_work_of_which_workers_die_ends_in_words(tmp_path, monkeypatch):
    """Dask gives it up after three tries."""
    with Cluster(5, tmp_path) as cluster, pytest.raises(ClusterLostError, match="Dask has given up"):
        run(grid_of(100), tmp_path / "out", backend="dask", scheduler=cluster.address, simulate=_dies)


def _dies(table, readings, control):
    if control.horizon > control.h and "TEST_DASK_WORKER" in os.environ:
        os._exit(1)
    return plausible(table, readings, control)


@pytest.mark.parametrize("when", ["before the run", "later"])
def test_workers_of_other_versions_are_refused(tmp_path, monkeypatch, when):
    monkeypatch.setattr("boulder_sweep.store.provenance.kernels_sha256", lambda: "0" * 64)
    if when == "later":
        monkeypatch.setattr(pool, "_check_workers", lambda *_: None)
        monkeypatch.setattr("boulder_sweep.runner.run.fingerprint", lambda: ({"numba": "0.1"}, "0" * 64, "0" * 64))
    with Cluster(1, tmp_path) as cluster, pytest.raises(BackendError, match="different versions of boulder-sweep"):
        run(grid_of(100), tmp_path / "out", backend="dask", scheduler=cluster.address, simulate=plausible)


def test_a_worker_that_does_not_share_the_folder_is_told(tmp_path, monkeypatch):
    with Cluster(1, tmp_path) as cluster:
        monkeypatch.setattr("boulder_sweep.runner.run.names_in", lambda out: [])
        with pytest.raises(
            BackendError, match=r"1 of 1 parts that workers wrote are not in .* need a file system that"
        ):
            run(grid_of(100), tmp_path / "out", backend="dask", scheduler=cluster.address, simulate=plausible)
