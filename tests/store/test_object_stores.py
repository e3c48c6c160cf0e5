"""Results on object stores: written without renaming, right whatever fails, by one writer at a time."""

from __future__ import annotations

import errno
import io
import itertools
import json
import os
import socket
from collections import Counter
from functools import cache
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest

from boulder_sweep import locations
from boulder_sweep.locations import RemotePath, location_of
from boulder_sweep.store import lock as locks
from boulder_sweep.store.failures import (
    DamagedError,
    FolderInUseError,
    ForeignFilesError,
    NotASweepError,
    OutputExistsError,
    StoreError,
    WriteError,
)
from boulder_sweep.store.files import MANIFEST_NAME, is_part_name, version_name
from boulder_sweep.store.manifest import load
from boulder_sweep.store.reader import finished_table
from boulder_sweep.store.storage import KEPT, newest
from tests.runner.grids import same_bits
from tests.store import folders
from tests.store.object_stores import FaultyFileSystem, Trouble, store
from tests.store.states import status
from tests.waiting import wait_until

OUT = "faulty://bucket/out"
FIRSTS = range(0, folders.ROWS, folders.SIZE)
NOW = 1e9


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    monkeypatch.setattr(locations, "FIRST_WAIT_S", 0.0)
    monkeypatch.setattr(folders, "part_bytes", cache(folders.part_bytes))


@pytest.fixture
def stopped_clock(monkeypatch):
    """A clock that stands still."""
    monkeypatch.setattr(locks, "time", SimpleNamespace(time=lambda: NOW))


@pytest.fixture
def out():
    with store():
        yield location_of(OUT)


def names(out: RemotePath) -> list[str]:
    return out.names()


def test_a_finished_folder_holds_the_bytes_that_a_local_one_holds(out, tmp_path):
    folders.finished_folder(out)
    local = folders.finished_folder(tmp_path / "out")
    parts = [path.name for path in sorted(local.glob("rows-*"))]
    assert [name for name in names(out) if is_part_name(name)] == parts
    assert all((out / name).read_bytes() == (local / name).read_bytes() for name in parts)
    assert same_bits(finished_table(out), finished_table(local))
    assert [name for name in names(out) if name not in parts] == [
        *(version_name(number) for number in range(1, 8)),
        "_manifest.parquet",
    ]
    found = status(OUT, verify=True)
    assert (found.rows_done, found.running, found.damaged) == (folders.ROWS, False, {})


def test_nobody_sees_a_part_before_it_is_committed(out):
    folder = folders.open_folder(out)
    staged = folder.stage(folders.encoded_part(0))
    assert not any(is_part_name(name) for name in names(out))
    folder.commit([staged])
    assert [name for name in names(out) if is_part_name(name) or name.endswith(".writing")] == [staged.name]
    folder.close("stopped")


def test_every_version_of_the_manifest_stays_as_it_was_written(out):
    folder = folders.open_folder(out)
    seen: dict[str, bytes] = {}
    for first in FIRSTS:
        folders.commit(folder, first)
        for name in names(out):
            if name.startswith("_manifest-"):
                assert seen.setdefault(name, (out / name).read_bytes()) == (out / name).read_bytes()
    folder.close("finished")
    assert len(seen) >= len(FIRSTS)


def test_old_versions_go_and_the_last_ones_stay(out):
    folder = folders.open_folder(out)
    for _ in range(2 * KEPT):
        folders.commit(folder, 0)
    folder.close("stopped")
    assert len([name for name in names(out) if name.startswith("_manifest-")]) == KEPT
    assert newest(out).number == 2 * KEPT + 2


@pytest.mark.parametrize("behind", ["the copy", "the list", "both"])
def test_the_newest_manifest_is_found_where_copy_and_list_are_behind(out, monkeypatch, behind):
    folders.finished_folder(out)
    if behind in ("the copy", "both"):
        (out / "_manifest.parquet").put((out / version_name(3)).read_bytes())
    if behind in ("the list", "both"):
        monkeypatch.setattr(RemotePath, "names", lambda self: [version_name(2)])
    assert load(out).rows_done == folders.ROWS


def test_a_copy_of_the_manifest_that_cannot_be_written_costs_no_row(out, monkeypatch):
    """The version is there: to take the parts for not recorded would compute them again."""
    folder = folders.open_folder(out)
    put = RemotePath.put

    def denied(self: RemotePath, content: memoryview | bytes, **how: bool) -> None:
        if self.name == MANIFEST_NAME:
            raise PermissionError(errno.EACCES, "not yours")
        put(self, content, **how)

    with monkeypatch.context() as patch:
        patch.setattr(RemotePath, "put", denied)
        folders.commit(folder, 0)
    assert (load(out).rows_done, folder.rows_safe) == (folders.SIZE, folders.SIZE)
    folder.close("stopped")


def test_a_second_run_is_refused_while_the_first_is_alive(out, stopped_clock):
    folder = folders.open_folder(out)
    assert status(OUT).running
    with pytest.raises(FolderInUseError, match=rf"process {os.getpid()} on .*last heartbeat was 0 s ago"):
        folders.open_folder(out, resume=True)
    folder.close("stopped")
    assert not status(OUT).running
    folders.open_folder(out, resume=True).close("stopped")


@pytest.mark.parametrize(
    ("holder", "refused"),
    [
        ({"host": "elsewhere", "pid": 1, "time": 0.0}, True),
        ({"host": "elsewhere", "pid": 1, "time": -1e4}, False),
        ({"host": socket.gethostname(), "pid": 2**30, "time": 0.0}, False),
        ({}, False),
    ],
    ids=["alive elsewhere", "silent elsewhere", "dead here", "unreadable"],
)
def test_the_lock_of_a_dead_run_is_taken(out, stopped_clock, holder, refused):
    folders.open_folder(out).close("stopped")
    record = {**holder, "time": NOW + holder["time"]} if holder else {}
    (out / "_lock").put(json.dumps(record).encode())
    if refused:
        with pytest.raises(FolderInUseError):
            folders.open_folder(out, resume=True)
    else:
        folders.open_folder(out, resume=True).close("stopped")


@pytest.mark.parametrize("only_new", [True, False])
def test_a_run_that_was_thought_dead_cannot_change_the_table(only_new, monkeypatch):
    with store(Trouble(0, 0.0, only_new)):
        out = location_of(OUT)
        asleep = folders.open_folder(out)
        folders.commit(asleep, 0)
        monkeypatch.setattr(locks, "DEAD_AFTER_S", 0.0)
        other = folders.open_folder(out, resume=True)
        for first in FIRSTS[1:]:
            folders.commit(other, first)
        with pytest.raises(FolderInUseError, match="taken over by another run"):
            folders.commit(asleep, 100)
        asleep.close("stopped")
        other.close("finished")
        assert same_bits(finished_table(out), whole())
        assert [name for name in names(out) if is_part_name(name)] == sorted(load(out).parts)


@pytest.mark.parametrize("only_new", [True, False])
def test_no_row_is_lost_or_double_whatever_fails(only_new, monkeypatch):
    """Puts that fail, whose answer is lost, or that arrive late; lists that are stale: many times each."""
    seeds, least = 12, 50
    monkeypatch.setattr(locks, "DEAD_AFTER_S", 0.0)  # a lock that arrives late is that of a dead run
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "SECRET-KEY")
    monkeypatch.setattr(locations, "_TRIES", 2)
    expected, counts, told = whole(), Counter(), ""
    for seed in range(seeds):
        trouble = Trouble(seed, 0.3, only_new)
        with store(trouble) as faulty:
            out = location_of(OUT)
            for _ in range(60):
                try:
                    one_run(out)
                    break
                except (StoreError, OSError) as stop:
                    told += f"{stop} {stop.__cause__!r}\n"
            trouble.share = 0.0
            while faulty.late:
                faulty.arrive()
            one_run(out)  # finds everything there, or computes again what a last fault has cost
            assert same_bits(finished_table(out), expected), f"seed {seed}"
            assert sorted(load(out).parts) == [name for name in names(out) if is_part_name(name)], f"seed {seed}"
        counts.update(trouble.counts)
    assert min(counts.values()) >= least, counts
    assert told.count("\n") >= seeds
    assert "SECRET" not in told


def one_run(out: RemotePath) -> None:
    """Resume a run, in small parts that are merged at the end."""
    folder = folders.open_folder(out, resume=True)
    try:
        for first, stop in list(folder.manifest.missing()):
            for start in range(first, stop, 50):
                folders.commit(folder, start, min(50, stop - start))
        for group in folder.manifest.mergeable():
            first = folder.manifest.parts[group[0]].first
            rows = sum(folder.manifest.parts[name].rows for name in group)
            folder.merge(group, folders.part_bytes(first, rows)[0])
    except BaseException:
        folder.close("stopped")
        raise
    folder.close("finished")


@cache
def whole():
    """Return the whole table, as it is on a disk."""
    import pyarrow as pa

    tables = [
        pq.read_table(io.BytesIO(folders.part_bytes(first, min(folders.SIZE, folders.ROWS - first))[0]))
        for first in FIRSTS
    ]
    return pa.concat_tables(tables)


def test_what_is_there_is_not_overwritten_unasked(out):
    folders.finished_folder(out)
    with pytest.raises(OutputExistsError, match=f"{OUT} exists and is finished"):
        folders.open_folder(out)
    folder = folders.open_folder(out, overwrite=True)
    assert not any(is_part_name(name) for name in names(out))
    folders.commit(folder, 0)
    folder.close("stopped")
    assert load(out).rows_done == 100


def test_foreign_files_and_places_without_a_result_are_refused(out):
    with pytest.raises(NotASweepError, match=f"there is no {OUT}"):
        finished_table(out)
    (out / "thesis.tex").put(b"x")
    with pytest.raises(ForeignFilesError, match=r"thesis\.tex"):
        folders.open_folder(out)
    with pytest.raises(NotASweepError, match="is not the result of a sweep"):
        finished_table(out)
    with pytest.raises(StoreError, match="is a file"):
        folders.open_folder(out / "thesis.tex")


@pytest.mark.parametrize("reads", [True, False])
def test_a_store_that_cannot_be_written_is_refused_before_anything_is_computed(monkeypatch, reads):
    def of(self: Trouble, *kinds: str) -> str:
        return "refused" if "refused" in kinds else "" if reads else kinds[0]

    monkeypatch.setattr(Trouble, "of", of)
    with (
        store(Trouble(0, 1.0, True)),
        pytest.raises(WriteError, match=f"cannot write into {OUT}: (timeout|connection) error: no answer"),
    ):
        folders.open_folder(location_of(OUT))


@pytest.mark.parametrize("resume", [True, False])
def test_a_store_that_does_not_answer_is_not_taken_for_damaged(out, monkeypatch, resume):
    """Nothing is removed, and nothing is computed again."""
    folders.finished_folder(out)
    before = names(out)

    def denied(self, path, **_):
        if "rows-" in path:
            raise PermissionError("not yours")
        return info(self, path)

    info = FaultyFileSystem.info
    monkeypatch.setattr(FaultyFileSystem, "info", denied)
    with pytest.raises(StoreError, match=r"rows-0.* cannot be read: permission error: not yours") as refused:
        folders.open_folder(out, resume=True) if resume else status(OUT)
    assert not isinstance(refused.value, DamagedError)
    assert names(out) == before


def test_a_store_that_does_not_say_whether_a_part_is_there_is_told_of_with_what_is_safe(out, monkeypatch):
    folder = folders.open_folder(out)
    staged = folder.stage(folders.encoded_part(0))
    with monkeypatch.context() as patch:
        patch.setattr(FaultyFileSystem, "_may_fail", lambda self: (_ for _ in ()).throw(PermissionError("not yours")))
        with pytest.raises(WriteError, match=r"not yours\. 0 of 441 rows are safe; resume with: "):
            folder.is_staged(staged)
    folder.close("stopped")


def test_a_refused_run_leaves_no_trace(out):
    folders.open_folder(out).discard()
    assert names(out) == []


def test_the_heartbeat_goes_on_until_the_lock_is_released_or_taken(out, monkeypatch):
    monkeypatch.setattr(locks, "HEARTBEAT_S", 0.01)
    monkeypatch.setattr(locks, "time", SimpleNamespace(time=itertools.count().__next__))
    folder = folders.open_folder(out)
    first = json.loads((out / "_lock").read_bytes())["time"]
    wait_until(lambda: json.loads((out / "_lock").read_bytes())["time"] != first, "there is another heartbeat")
    folder.heartbeat()

    def taken_over():
        (out / "_lock").put(json.dumps({"token": "another"}).encode())
        folder.heartbeat()
        return False

    with pytest.raises(FolderInUseError, match="taken over by another run"):
        wait_until(taken_over, "the lock is taken over")
    folder.close("stopped")
    assert json.loads((out / "_lock").read_bytes()) == {"token": "another"}
