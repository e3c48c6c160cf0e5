"""Whole runs into an object store: the same bytes as on a disk, resumable, read and drawn by every command."""

from __future__ import annotations

import pytest

from boulder_sweep.errors import Interrupted
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.locations import location_of
from boulder_sweep.runner import sweeper
from boulder_sweep.store import read
from boulder_sweep.store.failures import OutputExistsError
from boulder_sweep.store.files import is_part_name
from boulder_sweep.store.reader import finished_table
from tests.runner.grids import grid, plausible, same_bits
from tests.store.object_stores import store
from tests.store.states import status

OUT = "faulty://bucket/m30.sweep"
HOW = {"rows_per_part": 100, "jobs": 2, "simulate": plausible}


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    out = tmp_path_factory.mktemp("local") / "out"
    sweeper.run(grid(), out, **HOW)
    return out


@pytest.fixture(autouse=True)
def _store():
    with store():
        yield


@pytest.mark.parametrize("how", [{}, {"commit_every_s": 0.0}, {"backend": "dask"}], ids=["threads", "slow", "dask"])
def test_a_run_into_a_store_writes_the_bytes_of_a_local_one(local, how):
    summary = sweeper.run(grid(), OUT, **(HOW | how))
    assert str(summary.out) == summary.to_dict()["out"] == OUT
    out = location_of(OUT)
    parts = {path.name: path.read_bytes() for path in local.glob("rows-*")}
    assert {name: (out / name).read_bytes() for name in out.names() if is_part_name(name)} == parts
    assert read(OUT).equals(read(local))
    assert status(OUT, verify=True).complete


def test_a_run_into_a_store_is_interrupted_and_resumed(local, monkeypatch):
    told = []

    def interrupt(progress):
        told.append(progress)
        raise Interrupted(2)

    with pytest.raises(Interrupted, match=f"rows are safe. Resume with: .*{OUT}"):
        sweeper.run(grid(), OUT, progress=interrupt, **HOW)
    assert told
    found = status(OUT)
    assert not found.running
    if not found.complete:
        sweeper.run(grid(), OUT, resume=True, **HOW)
    assert same_bits(finished_table(location_of(OUT)), finished_table(local))
    with pytest.raises(OutputExistsError, match="is finished"):
        sweeper.run(grid(), OUT, **HOW)


def test_a_row_in_a_store_is_explained():
    sweeper.run(grid(), OUT, rows_per_part=100, jobs=2)
    found = recompute(OUT, 7)
    assert found.unequal == ()
    assert found.changed == ()
