"""``sweep run --backend dask`` from the command line, with a cluster of its own and with one that is there."""

from __future__ import annotations

import shlex

import pytest
from distributed import LocalCluster

from boulder_sweep.errors import ClusterLostError
from boulder_sweep.runner import pool
from boulder_sweep.store.reading import finished_table
from tests.runner.grids import same_bits


@pytest.fixture(scope="module")
def scheduler():
    """Address of the scheduler of a cluster of one worker in another process."""
    with LocalCluster(n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


def assert_is_the_table_of_threads(sweep, grid, options):
    assert sweep("run", grid, "-q", "-o", "threads")[0] == 0
    code, out, err = sweep("run", grid, "-q", "-o", "dask", "--backend", "dask", *options)
    assert (code, err) == (0, "")
    assert "18 designs" in out
    assert "dask" in out
    assert same_bits(finished_table(grid.parent / "dask"), finished_table(grid.parent / "threads"))


def test_a_run_on_a_cluster_that_is_there(sweep, possible_grid, scheduler):
    assert_is_the_table_of_threads(sweep, possible_grid, ["--jobs", "1", "--scheduler", scheduler])


def test_the_command_to_go_on_names_the_scheduler(sweep, possible_grid, scheduler, monkeypatch):
    def lost(*_):
        raise ClusterLostError("the connection to the Dask scheduler was lost")

    words = ["-q", "-o", "out", "--backend", "dask", "--scheduler", scheduler]
    with monkeypatch.context() as patch:
        patch.setattr(pool.Cluster, "_results", lost)
        code, out, err = sweep("run", possible_grid, *words)
    assert (code, out) == (130, "")
    command = f"sweep run grid.yaml -o out --backend dask --scheduler {scheduler} --resume"
    assert f"0 of 18 rows are safe. Resume with:\n  {command}" in err
    assert sweep(*shlex.split(command)[1:], "-q")[0] == 0
    assert len(finished_table(possible_grid.parent / "out")) == 18


def test_a_scheduler_that_does_not_answer_is_wrong_use(sweep, possible_grid, monkeypatch):
    monkeypatch.setattr("boulder_sweep.runner.pool.CONNECT_S", 1.0)
    code, out, err = sweep(
        "run", possible_grid, "-q", "-o", "out", "--backend", "dask", "--scheduler", "tcp://127.0.0.1:9"
    )
    assert (code, out) == (2, "")
    assert err.startswith("error: no Dask scheduler answers at tcp://127.0.0.1:9")
    assert not (possible_grid.parent / "out").exists()
