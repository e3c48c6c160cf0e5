"""Ranges and names of parts; files that appear whole, once, and leave nothing behind."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boulder_sweep.errors import PictureError, QuestionError
from boulder_sweep.locations import _machine, location_of
from boulder_sweep.store import folder
from boulder_sweep.store.failures import FolderInUseError, StoreError, WriteError
from boulder_sweep.store.folder import (
    _TRIES,
    PartFile,
    Ranges,
    check_target,
    clear,
    hash_of,
    hidden_folder,
    locked,
    make,
    part_file,
    put_part,
    ranges_of,
    remove_parts,
)
from tests.store.folders import finished_folder, parts_of

CONTENT = b"a part" * 1000


@pytest.mark.parametrize(
    ("rows", "wanted", "count"),
    [
        (1, 1e9, 1),
        (255, 1e9, 1),
        (255, 1, 4),
        (256, 1e9, 4),
        (441, 25_000, 4),
        (441, 1, 4),
        (512, 1, 8),
        (107_008, 25_000, 8),
        (107_008, 1e9, 4),
        (10**6, 1e9, 32),
        (10**6, 1000, 1000),
        (10**12, 1e9, 30_517_580),
    ],
)
def test_the_ranges_of_a_table(rows, wanted, count):
    ranges = ranges_of(rows, wanted)
    assert (ranges.rows, ranges.count) == (rows, count)
    assert ranges.bounds(0)[0] == 0
    assert ranges.bounds(count - 1)[1] == rows


@given(st.integers(1, 10**5), st.floats(0.1, 1e6), st.data())
def test_ranges_hold_every_row_once_and_are_equal_but_for_a_row(rows, wanted, data):
    ranges = ranges_of(rows, wanted)
    cut = list(ranges)
    assert [stop for _, stop in cut[:-1]] == [first for first, _ in cut[1:]]
    assert (cut[0][0], cut[-1][1]) == (0, rows)
    lengths = {stop - first for first, stop in cut}
    assert max(lengths) - min(lengths) <= 1
    assert max(lengths) <= folder.MOST_ROWS
    assert rows < 4 * folder.FEWEST_ROWS or (len(cut) % 4 == 0 and min(lengths) >= folder.FEWEST_ROWS)
    row = data.draw(st.integers(0, rows - 1))
    first, stop = ranges.of(row)
    assert first <= row < stop
    assert (first, stop) in ranges
    assert (first, stop + 1) not in ranges


def test_names_sort_as_the_rows_do_and_say_them():
    names = [PartFile(*bounds, "0" * 16).name for bounds in Ranges(10**13, 10**4)]
    assert names[:1000] == sorted(names[:1000])
    assert [part_file(name)[:2] for name in names] == list(Ranges(10**13, 10**4))


@pytest.mark.parametrize(
    "name",
    [
        "rows-000000000000-000000000100.parquet",
        "rows-0-100-0123456789abcdef.parquet",
        "rows-0000000000000-0000000000100-0123456789abcdef.parquet",  # more digits would sort otherwise
        "rows-000000000000-000000000100-0123456789ABCDEF.parquet",
        "rows-000000000000-000000000100-0123456789abcdef.parquet\n",
        "../rows-000000000000-000000000100-0123456789abcdef.parquet",
        "rows-" + 12 * "\u0660" + "-000000000100-0123456789abcdef.parquet",
    ],
)
def test_other_names_are_those_of_no_part(name):
    assert part_file(name) is None


def failing(monkeypatch, call, number=errno.ENOSPC):
    def refuse(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, call, refuse)


@pytest.mark.parametrize("call", ["fsync", "rename"])
def test_what_cannot_be_written_is_told_and_leaves_nothing(tmp_path, monkeypatch, call):
    out = tmp_path / "out"
    out.mkdir()
    with monkeypatch.context() as patch:
        failing(patch, call)
        with pytest.raises(WriteError, match=r"cannot write into .*out: No space left on device"):
            put_part(out, 0, 100, CONTENT)
    clear(out)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("beside", ["a folder", "a link", "a file", "not ours"])
def test_a_part_is_written_once_whatever_lies_beside_the_folder(tmp_path, beside, monkeypatch):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    if beside == "a link":
        hidden_folder(out).symlink_to(elsewhere)
    elif beside == "a file":
        hidden_folder(out).write_text("mine")
    elif beside == "not ours":
        access = os.access
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != hidden_folder(out) and access(path, mode))
    for _ in range(2):  # the same work, twice
        part = put_part(out, 0, 100, CONTENT)
        assert part.name == f"rows-000000000000-000000000100-{hash_of(CONTENT)}.parquet"
    assert parts_of(out) == {part.name: CONTENT}
    assert list(elsewhere.iterdir()) == []


def test_a_link_with_the_name_of_a_part_is_replaced_and_not_followed(tmp_path):
    out, victim = tmp_path / "out", tmp_path / "victim"
    out.mkdir()
    victim.write_text("precious")
    (out / PartFile(0, 100, hash_of(CONTENT)).name).symlink_to(victim)
    path = out / put_part(out, 0, 100, CONTENT).name
    assert not path.is_symlink()
    assert path.read_bytes() == CONTENT
    assert victim.read_text() == "precious"


@pytest.mark.parametrize("times", [1, _TRIES - 1, _TRIES])
def test_a_hidden_folder_that_others_remove_meanwhile_is_made_again_some_times(tmp_path, monkeypatch, times):
    out = tmp_path / "out"
    out.mkdir()
    rename, turns = os.rename, iter([*times * [True], False])

    def remove_first(source, target, **how):
        if next(turns):
            for path in hidden_folder(out).iterdir():
                path.unlink()
        return rename(source, target, **how)

    monkeypatch.setattr(os, "rename", remove_first)
    with nullcontext() if times < _TRIES else pytest.raises(WriteError, match="No such file"):
        name = put_part(out, 0, 100, CONTENT).name
        assert parts_of(out) == {name: CONTENT}


def test_the_last_rows_are_removed_first(tmp_path, monkeypatch):
    removed = []
    monkeypatch.setattr("boulder_sweep.store.folder.remove", removed.append)
    remove_parts(tmp_path, ["b", "c", "a"])
    assert [path.name for path in removed] == ["c", "b", "a"]


def test_a_folder_that_was_removed_is_told(tmp_path):
    with pytest.raises(WriteError, match="No such file or directory"):
        put_part(tmp_path / "gone", 0, 100, CONTENT)


def test_unfinished_files_of_dead_processes_are_removed_and_others_stay(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    hidden_folder(out).mkdir()
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    dead, alive = (f"{_machine()}-{pid}-{'0' * 16}.writing" for pid in (child.pid, os.getpid()))
    old, young = f"00000000-1-{'0' * 16}.writing", f"00000000-1-{'1' * 16}.writing"  # of another machine
    for name in (dead, alive, old, young, "mine"):
        (hidden_folder(out) / name).write_text("x")
        (out / f".{name}").write_text("x")
    for place in (hidden_folder(out) / old, out / f".{old}"):
        os.utime(place, (0, 0))
    clear(out)
    kept = sorted([alive, young, "mine"])
    assert sorted(path.name for path in hidden_folder(out).iterdir()) == kept
    assert sorted(path.name for path in out.iterdir()) == [f".{name}" for name in kept]


def test_one_run_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "link").symlink_to(out)
    for there in (out, location_of("memory://bucket/out")):
        with locked(there):
            with pytest.raises(FolderInUseError, match="another run on this machine writes into"), locked(there):
                pass
            with locked(tmp_path / "another"):
                pass
        with locked(there):
            pass
    with locked(out), pytest.raises(FolderInUseError), locked(tmp_path / "link"):
        pass
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("place", ["a file", "a link"])
def test_without_a_folder_for_locks_there_are_none(tmp_path, monkeypatch, place):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    if place == "a file":
        (tmp_path / "boulder-sweep").write_text("mine")
    else:
        (tmp_path / "boulder-sweep").symlink_to(tmp_path)
    with locked(tmp_path / "out"), locked(tmp_path / "out"):
        pass


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none/out", "the folder .*none does not exist: out cannot be created in it"),
        ("file", "file is a file; the output of a sweep is a folder"),
        ("/proc/out", "cannot create the folder /proc/out"),
    ],
)
def test_a_folder_that_cannot_be_made_is_told(tmp_path, name, words):
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=words):
        make(tmp_path / name)
    assert make(tmp_path / "new")
    assert not make(tmp_path / "new")


def test_many_who_write_the_same_rows_leave_one_file(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    with ThreadPoolExecutor(8) as pool:
        names = {part.name for part in pool.map(lambda _: put_part(out, 0, 100, CONTENT), range(40))}
    assert list(parts_of(out).items()) == [(names.pop(), CONTENT)]
    assert not hidden_folder(out).exists()


def test_a_part_on_an_object_store_is_one_file():
    out = location_of("memory://parts/out.sweep")
    part = put_part(out, 0, 100, CONTENT)
    assert (out / part.name).read_bytes() == CONTENT
    assert [path.name for path in out.iterdir()] == [part.name]


def test_nothing_else_is_written_into_a_result(tmp_path, monkeypatch):
    result = finished_folder(tmp_path / "out.sweep")
    inside = rf"^out\.sweep/new\.parquet: the folder {result} holds the result of a run; name a file outside it$"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(QuestionError, match=inside):
        check_target(location_of("out.sweep/new.parquet"), QuestionError)
    (tmp_path / "link").symlink_to(result)
    with pytest.raises(PictureError, match="holds the result of a run"):
        check_target(tmp_path / "link" / "map.png", PictureError)
    for name, content in parts_of(result).items():
        put = location_of(f"memory://results/kept.sweep/{name}")
        put.fs.pipe_file(put.path, content)
    with pytest.raises(QuestionError, match=r"the folder memory://results/kept\.sweep holds the result of a run"):
        check_target(location_of("memory://results/kept.sweep/new.parquet"), QuestionError)
    check_target(result.with_name("new.parquet"), QuestionError)
    check_target(location_of("memory://tables/new.parquet"), QuestionError)


def test_a_target_whose_folder_is_missing_or_that_is_one_is_told(tmp_path):
    with pytest.raises(QuestionError, match=rf"none/new\.parquet: the folder {tmp_path}/none does not exist$"):
        check_target(tmp_path / "none" / "new.parquet", QuestionError)
    (tmp_path / "new.parquet").mkdir()
    with pytest.raises(QuestionError, match=r"new\.parquet cannot be written: Is a directory$"):
        check_target(tmp_path / "new.parquet", QuestionError)
