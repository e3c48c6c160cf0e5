"""Two Dask workers that write into an S3-compatible server; one of them is killed, then the scheduler."""

from __future__ import annotations

import pytest

from boulder_sweep.errors import ClusterLostError
from boulder_sweep.locations import RemotePath, location_of
from boulder_sweep.runner import cluster as backend
from boulder_sweep.runner.sweeper import run
from boulder_sweep.settings import load
from boulder_sweep.store.files import is_part_name
from boulder_sweep.store.reader import finished_table
from tests.faults.clusters import Cluster
from tests.faults.processes import ROOT
from tests.faults.s3_server import BUCKET, SECRET, S3Server
from tests.runner.grids import same_bits
from tests.store.states import status
from tests.waiting import HANG_GUARD_S

pytestmark = [pytest.mark.faults, pytest.mark.nightly]

WORKER_DIES_AT, SCHEDULER_DIES_AT = 0.25, 0.55
"""Shares of the rows."""


def test_a_table_on_a_store_is_the_local_one_though_a_worker_and_the_scheduler_are_killed(tmp_path, monkeypatch):
    sweep = load(ROOT / "configs" / "m30_sizing.yaml", ["boulder.width={from: 1.2 m, to: 2.4 m, count: 80}"])
    monkeypatch.setattr(backend, "CONNECT_S", HANG_GUARD_S)  # hang guard
    monkeypatch.setattr(backend, "FIRST_WORKER_S", HANG_GUARD_S)  # hang guard
    rows, out, kills = sweep.n_designs, f"s3://{BUCKET}/runs/m30.sweep", []
    run(sweep, tmp_path / "whole")
    with S3Server() as server:
        for name, value in server.environment.items():
            monkeypatch.setenv(name, value)

        with Cluster(2, tmp_path) as cluster:

            def kill(progress):
                if not kills and progress.rows_done > WORKER_DIES_AT * rows:
                    cluster.kill_worker()
                    kills.append("worker")
                elif kills == ["worker"] and progress.rows_done > SCHEDULER_DIES_AT * rows:
                    cluster.kill_scheduler()
                    kills.append("scheduler")

            with pytest.raises(ClusterLostError, match=f"rows are safe. Resume with: .*-o {out} .*--resume"):
                run(sweep, out, backend="dask", scheduler=cluster.address, progress=kill)
        assert kills == ["worker", "scheduler"]
        found = status(out, verify=True)
        assert found.damaged == {}
        assert 0 < found.rows_done < rows
        with Cluster(2, tmp_path) as cluster:
            summary = run(sweep, out, backend="dask", scheduler=cluster.address, resume=True)
        assert summary.rows_computed == rows - found.rows_done
        assert not any("does not share" in note for note in summary.notes)
        place = location_of(out)
        assert isinstance(place, RemotePath)
        assert same_bits(finished_table(place), finished_table(tmp_path / "whole"))
        parts = {path.name: path.read_bytes() for path in (tmp_path / "whole").glob("rows-*")}
        objects = {name: (place / name).read_bytes() for name in place.names()}
        assert {name: content for name, content in objects.items() if is_part_name(name)} == parts
        assert not any(SECRET.encode() in content for content in objects.values())
