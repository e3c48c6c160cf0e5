"""Small parts become one, wherever the run is killed."""

from __future__ import annotations

import errno

import pyarrow as pa
import pytest

from boulder_sweep.store import storage, verify, writer
from boulder_sweep.store.failures import DamagedError, StoreError, WriteError
from boulder_sweep.store.files import MANIFEST_NAME
from boulder_sweep.store.manifest import load
from boulder_sweep.store.provenance import FORMAT
from boulder_sweep.store.reader import FinishedRows, finished_table
from tests.runner.grids import same_bits
from tests.store.folders import ROWS, commit, open_folder, part_bytes
from tests.store.states import status

SMALL = [(0, 30), (30, 30), (60, 40)]


class Killed(BaseException):
    """Stands for SIGKILL: nothing is cleaned up."""


@pytest.fixture
def out(tmp_path):
    """A folder with three small parts in place of the first whole one."""
    folder = open_folder(tmp_path / "out")
    for first, rows in SMALL:
        commit(folder, first, rows)
    folder.close("interrupted")
    return tmp_path / "out"


def names(out):
    return sorted(path.name for path in out.iterdir() if path.name not in (MANIFEST_NAME, "_lock"))


def merge(out):
    folder = open_folder(out, resume=True)
    (group,) = folder.manifest.mergeable()
    folder.merge(group, part_bytes(0, 100)[0])
    return folder


def test_small_parts_are_replaced_by_the_file_that_a_fast_run_writes(out, tmp_path):
    before = finished_table(out)
    folder = merge(out)
    folder.close("finished")
    assert names(out) == ["rows-000000000000-000000000100.parquet"]
    assert same_bits(finished_table(out), before)
    assert sum(load(out).verdicts.values()) == 100
    assert status(out, verify=True).damaged == {}
    assert load(out).merge is None


def killed_at(monkeypatch, step: int):
    """Kill the merge before its step-th change to the disk."""
    done = []

    def watched(change):
        def maybe(*arguments, **words):
            done.append(change)
            if len(done) > step:
                raise Killed
            return change(*arguments, **words)

        return maybe

    monkeypatch.setattr(writer, "save", watched(writer.save))
    monkeypatch.setattr(storage, "flush_folder", watched(storage.flush_folder))
    monkeypatch.setattr(storage.DiskStorage, "put", watched(storage.DiskStorage.put))
    monkeypatch.setattr(storage.DiskStorage, "publish", watched(storage.DiskStorage.publish))
    monkeypatch.setattr(storage.Path, "unlink", watched(storage.Path.unlink))


@pytest.mark.parametrize("step", range(9))
def test_a_merge_killed_at_any_step_loses_and_doubles_nothing(out, monkeypatch, step):
    before = finished_table(out)
    folder = open_folder(out, resume=True)
    (group,) = folder.manifest.mergeable()
    content = part_bytes(0, 100)[0]
    with monkeypatch.context() as patch:
        killed_at(patch, step)
        try:
            folder.merge(group, content)
        except Killed:
            killed = True
        else:
            killed = False
    folder._lock.release()
    assert killed == (step < 8)  # announce, put, three unlinks, flush, rename, record
    for deep in (False, True):
        assert status(out, verify=deep).rows_done == 100
        assert status(out, verify=deep).damaged == {}
    assert same_bits(finished_table(out), before)
    again = open_folder(out, resume=True)
    assert again.damaged == {}
    assert again.manifest.rows_done == 100
    for group in again.manifest.mergeable():
        again.merge(group, content)
    again.close("finished")
    assert names(out) == ["rows-000000000000-000000000100.parquet"]
    assert same_bits(finished_table(out), before)


@pytest.mark.parametrize("failing", ["save", "put_file"])
def test_a_full_disk_leaves_the_small_parts(out, monkeypatch, failing):
    folder = open_folder(out, resume=True)
    (group,) = folder.manifest.mergeable()

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr({"save": writer, "put_file": storage}[failing], failing, full)
        with pytest.raises(WriteError, match="No space left"):
            folder.merge(group, part_bytes(0, 100)[0])
    folder.close("stopped")
    assert len(names(out)) == 3
    assert status(out, verify=True).rows_done == 100
    merge(out).close("finished")
    assert len(names(out)) == 1


def test_verdicts_add_up(out):
    expected = load(out).verdicts
    folder = merge(out)
    assert folder.manifest.verdicts == expected
    assert next(folder.manifest.missing()) == (100, 200)
    assert folder.manifest.rows == ROWS
    folder.close("interrupted")


def test_rows_are_read_on_where_they_went(out):
    before = finished_table(out)
    begun, known, one = (FinishedRows(out) for _ in range(3))
    tables = begun.tables(["design_id", "margin"])
    first = next(tables)
    merge(out).close("finished")
    rest = list(tables)
    assert same_bits(pa.concat_tables([first, *rest]), before.select(["design_id", "margin"]))
    assert same_bits(pa.concat_tables(known.tables()), before)
    assert same_bits(one.row(70), before.slice(70, 1))
    assert one.row(100) is None


@pytest.mark.parametrize("step", range(1, 8))
def test_rows_are_read_on_in_the_middle_of_a_merge(out, monkeypatch, step):
    before = finished_table(out)
    finished = FinishedRows(out)
    folder = open_folder(out, resume=True)
    (group,) = folder.manifest.mergeable()
    killed_at(monkeypatch, step)
    with pytest.raises(Killed):
        folder.merge(group, part_bytes(0, 100)[0])
    monkeypatch.undo()
    folder._lock.release()
    assert same_bits(pa.concat_tables(finished.tables()), before)
    assert same_bits(finished_table(out), before)
    assert status(out, verify=True).damaged == {}


@pytest.mark.parametrize("verify_parts", [False, True])
def test_a_merge_between_a_look_at_the_manifest_and_one_at_the_parts_is_no_damage(out, monkeypatch, verify_parts):
    looks = []

    def load_and_merge(folder):
        looks.append(load(folder))
        if len(looks) == 1:
            merge(out).close("finished")
        return looks[-1]

    monkeypatch.setattr(verify, "load", load_and_merge)
    found = status(out, verify=verify_parts)
    assert (found.damaged, found.rows_done, found.parts) == ({}, 100, 1)


def test_a_result_that_is_replaced_while_it_is_read_is_not_mixed_with_the_other(out):
    finished = FinishedRows(out)
    folder = open_folder(out, overwrite=True, identity={"format": FORMAT, "settings": {"soil": 2}})
    commit(folder, 0)
    folder.close("interrupted")
    with pytest.raises(StoreError, match="replaced by the result of another sweep"):
        list(finished.tables())


def test_a_part_that_is_gone_is_told_though_nothing_changes(out):
    finished = FinishedRows(out)
    (out / "rows-000000000030-000000000060.parquet").unlink()
    with pytest.raises(DamagedError, match=r"rows-000000000030-000000000060.parquet: missing"):
        list(finished.tables())
    with pytest.raises(DamagedError, match=r"rows-000000000030-000000000060.parquet: missing"):
        finished.row(40)
    assert finished.row(10)["design_id"].to_pylist() == [10]
