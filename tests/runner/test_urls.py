"""Whole runs into an object store: the same bytes as on a disk, resumable, read and drawn by every command."""

from __future__ import annotations

import pytest
from fsspec.implementations.memory import MemoryFileSystem

from boulder_sweep.errors import Interrupted
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.locations import location_of
from boulder_sweep.runner.run import run
from boulder_sweep.store import read
from boulder_sweep.store.failures import OutputExistsError, WriteError
from boulder_sweep.store.reading import finished_table
from tests.runner.grids import grid, plausible, same_bits

OUT = "memory://bucket/m30.sweep"
HOW = {"jobs": 2, "simulate": plausible}


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    out = tmp_path_factory.mktemp("local") / "out"
    run(grid(), out, **HOW)
    return out


@pytest.fixture(autouse=True)
def _empty_store():
    MemoryFileSystem.store.clear()


@pytest.mark.parametrize("how", [{}, {"backend": "dask"}], ids=["threads", "dask"])
def test_a_run_into_a_store_writes_the_bytes_of_a_local_one(local, how):
    summary = run(grid(), OUT, **(HOW | how))
    assert str(summary.out) == summary.to_dict()["out"] == OUT
    parts = {path.name: path.read_bytes() for path in local.iterdir()}
    assert {path.name: path.read_bytes() for path in location_of(OUT).iterdir()} == parts
    assert read(OUT).equals(read(local))


def test_a_run_into_a_store_is_interrupted_and_resumed(local):
    told = []

    def interrupt(progress):
        told.append(progress)
        raise Interrupted(2)

    with pytest.raises(Interrupted, match=f"rows are safe. Resume with:\n  .*{OUT}"):
        run(grid(), OUT, progress=interrupt, **HOW)
    assert told
    assert run(grid(), OUT, resume=True, **HOW).rows == 441
    assert same_bits(finished_table(location_of(OUT)), finished_table(local))
    with pytest.raises(OutputExistsError, match="is finished"):
        run(grid(), OUT, **HOW)
    assert run(grid(), OUT, overwrite=True, **HOW).rows_computed == 441


def test_a_store_that_does_not_answer_ends_the_run_in_words(monkeypatch):
    """The first of four parts that cannot be written is told; one thread has taken the second by then."""
    refused = []

    def refuse(self, path, content, **_):
        refused.append(path)
        raise ConnectionResetError("not now")

    monkeypatch.setattr(MemoryFileSystem, "pipe_file", refuse)
    with pytest.raises(WriteError, match=f"cannot write into {OUT}: .*not now. .* rows are safe. Resume with:\n  "):
        run(grid(), OUT, **(HOW | {"jobs": 1}))
    assert len(refused) <= 2


@pytest.mark.parametrize("last", [0, 1, 2], ids=["before", "to replace", "at the end"])
def test_a_store_that_lists_nothing_any_more_ends_the_run_in_words(monkeypatch, last):
    run(grid(), OUT, **HOW)
    left, ls = iter(range(last)), MemoryFileSystem.ls

    def refuse(self, path, **more):
        if next(left, None) is None:
            raise ConnectionResetError("not now")
        return ls(self, path, **more)

    monkeypatch.setattr(MemoryFileSystem, "ls", refuse)
    with pytest.raises(WriteError, match=f"cannot write into {OUT}: .*not now. .* rows are safe. Resume with:\n  "):
        run(grid(), OUT, overwrite=True, **HOW)


def test_rows_of_an_earlier_run_are_not_said_to_be_none_before_they_are_counted(monkeypatch):
    run(grid(), OUT, **HOW)

    def refuse(self, path, **more):
        raise ConnectionResetError("not now")

    monkeypatch.setattr(MemoryFileSystem, "ls", refuse)
    with pytest.raises(WriteError, match=r"not now\. the rows that were there are safe\. Resume with:\n  "):
        run(grid(), OUT, resume=True, **HOW)


def test_a_row_in_a_store_is_explained():
    run(grid(), OUT, jobs=2)
    found = recompute(OUT, 7)
    assert found.unequal == ()
    assert found.changed == ()
