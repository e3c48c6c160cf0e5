"""Taking an output folder, writing parts, letting go; and what is refused."""

from __future__ import annotations

import errno
import os
import shutil
from contextlib import suppress

import pandas as pd
import pytest

from boulder_sweep.store import storage, writer
from boulder_sweep.store.failures import (
    DamagedError,
    FolderInUseError,
    ForeignFilesError,
    OutputExistsError,
    SettingsDifferError,
    StoreError,
    WriteError,
)
from boulder_sweep.store.files import MANIFEST_NAME
from boulder_sweep.store.manifest import load
from boulder_sweep.store.reader import finished_table
from tests.store.folders import IDENTITY, ROWS, commit, finished_folder, open_folder, rewrite_records
from tests.store.states import status


def names(folder):
    return sorted(path.name for path in folder.iterdir())


PARTS = [f"rows-{first:012d}-{min(first + 100, ROWS):012d}.parquet" for first in range(0, ROWS, 100)]


def test_a_finished_folder_holds_parts_and_manifest_only(tmp_path):
    out = finished_folder(tmp_path / "out")
    assert names(out) == [MANIFEST_NAME, *PARTS]
    assert finished_table(out)["design_id"].to_pylist() == list(range(ROWS))
    manifest = load(out)
    assert manifest.rows_done == ROWS
    (session,) = manifest.sessions
    assert session.how == "finished"
    assert session.ended >= session.started


def test_an_empty_folder_is_taken(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    inode = out.stat().st_ino
    finished_folder(out)
    assert out.stat().st_ino == inode
    assert names(out) == [MANIFEST_NAME, *PARTS]


def test_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("x")
    with pytest.raises(StoreError, match="is a file"):
        open_folder(tmp_path / "out")
    assert (tmp_path / "out").read_text() == "x"


def test_a_folder_in_a_folder_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(StoreError, match="does not exist") as refused:
        open_folder(tmp_path / "typo" / "out")
    assert refused.value.exit_code == 2
    assert names(tmp_path) == []


@pytest.mark.parametrize("how", [{}, {"resume": True}, {"overwrite": True}])
@pytest.mark.parametrize("name", ["notes.txt", "data.parquet", "rows-000000000000-000000000100.parquet/"])
def test_foreign_files_are_left_alone(tmp_path, how, name):
    out = tmp_path / "out"
    out.mkdir()
    if name.endswith("/"):
        (out / name).mkdir()
    else:
        (out / name).write_text("mine")
    with pytest.raises((ForeignFilesError, DamagedError)):
        open_folder(out, **how)
    assert names(out) == [name.rstrip("/")]


@pytest.mark.parametrize("name", [".DS_Store", ".nfs000000000001"])
def test_files_of_the_system_do_not_matter_and_stay(tmp_path, name):
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("of the system")
    open_folder(out).close("interrupted")
    open_folder(out, overwrite=True).close("interrupted")
    assert (out / name).read_text() == "of the system"


@pytest.mark.parametrize(
    ("number", "advice"), [(errno.ENOSPC, "free some space and resume"), (errno.EACCES, "; resume with: sweep run")]
)
def test_the_advice_depends_on_what_is_wrong(tmp_path, number, advice):
    folder = open_folder(tmp_path / "out")
    assert advice in str(folder.write_error(OSError(number, os.strerror(number))))
    folder.close("interrupted")


def test_a_file_that_is_only_named_like_a_part_is_foreign(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / PARTS[0]).write_text("mine")
    with pytest.raises(ForeignFilesError, match="rows-000000000000"):
        open_folder(out, overwrite=True)
    assert (out / PARTS[0]).read_text() == "mine"


@pytest.mark.parametrize("removed", range(4))
def test_a_run_killed_while_it_removes_unrecorded_parts_leaves_no_gap(tmp_path, monkeypatch, removed):
    """Killed between naming five parts and recording the last three, resumed, and killed again."""

    class Killed(BaseException):
        """Stands for SIGKILL."""

    out = finished_folder(tmp_path / "out")
    rewrite_records(out, lambda records: [records["parts"].pop(name) for name in PARTS[2:]])
    unlink, done = storage.Path.unlink, []

    def deadly(path, **how):
        if path.name in PARTS and len(done) == removed:
            raise Killed
        unlink(path, **how)
        done.extend({path.name} & set(PARTS))

    monkeypatch.setattr(storage.Path, "unlink", deadly)
    with suppress(Killed):
        open_folder(out, resume=True).close("interrupted")
    ids = pd.read_parquet(out)["design_id"].to_list()
    assert ids == list(range([ROWS, 400, 300, 200][removed]))


def test_to_overwrite_a_result_with_foreign_files_is_refused(tmp_path):
    out = finished_folder(tmp_path / "out")
    (out / "notes.txt").write_text("mine")
    before = names(out)
    with pytest.raises(ForeignFilesError, match=r"notes\.txt"):
        open_folder(out, overwrite=True)
    assert names(out) == before


def test_overwriting_removes_what_a_sweep_wrote_and_follows_no_links(tmp_path):
    out = finished_folder(tmp_path / "out")
    elsewhere = tmp_path / "elsewhere.parquet"
    (out / PARTS[1]).rename(elsewhere)
    (out / PARTS[1]).symlink_to(elsewhere)
    folder = open_folder(out, overwrite=True)
    assert [name for name in names(out) if name.startswith("rows")] == []
    folder.close("finished")
    assert elsewhere.exists()


def test_what_exists_is_refused_with_how_far_it_got(tmp_path):
    out = tmp_path / "out"
    folder = open_folder(out)
    commit(folder, 0)
    folder.close("interrupted")
    with pytest.raises(OutputExistsError, match=r"holds 100 of 441 rows.*--resume"):
        open_folder(out)


def test_two_writers_in_one_process(tmp_path):
    folder = open_folder(tmp_path / "out")
    with pytest.raises(FolderInUseError, match=f"process {os.getpid()} on"):
        open_folder(tmp_path / "out", resume=True)
    with pytest.raises(FolderInUseError):
        open_folder(tmp_path / "out", overwrite=True)
    commit(folder, 0)
    folder.close("finished")
    open_folder(tmp_path / "out", resume=True).close("finished")


def test_what_differs_is_said(tmp_path):
    out = finished_folder(tmp_path / "out")
    settings = {**IDENTITY["settings"], "name": "another"}
    other = {
        **IDENTITY,
        "settings": settings,
        "settings_sha256": "b" * 64,
        "versions": {**IDENTITY["versions"], "numba": "2"},
    }
    with pytest.raises(SettingsDifferError) as refused:
        open_folder(out, identity=other, resume=True)
    version = IDENTITY["versions"]["numba"]
    assert refused.value.differences == ['settings.name: "test" -> "another"', f'versions.numba: "{version}" -> "2"']
    assert not status(out).running
    with pytest.raises(SettingsDifferError, match="rows: 441 -> 442"):
        open_folder(out, rows=442, resume=True)


@pytest.mark.parametrize("damage", ["flip", "truncate", "grow", "remove"])
def test_damaged_parts_are_found_and_missing_again(tmp_path, damage):
    out = finished_folder(tmp_path / "out")
    path = out / PARTS[2]
    content = bytearray(path.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 4
        path.write_bytes(content)
    elif damage == "truncate":
        path.write_bytes(content[:-1])
    elif damage == "grow":
        path.write_bytes(content + b"x")
    else:
        path.unlink()
    folder = open_folder(out, resume=True)
    assert list(folder.damaged) == [PARTS[2]]
    assert list(folder.manifest.missing()) == [(200, 300)]
    assert not path.exists()
    commit(folder, 200)
    folder.close("finished")
    assert finished_table(out)["design_id"].to_pylist() == list(range(ROWS))


def test_a_part_that_was_put_but_not_recorded_is_computed_again(tmp_path, monkeypatch):
    out = tmp_path / "out"
    folder = open_folder(out)
    commit(folder, 0)

    def killed(manifest, where):
        raise KeyboardInterrupt

    monkeypatch.setattr(writer, "save", killed)
    with pytest.raises(KeyboardInterrupt):
        commit(folder, 100)
    monkeypatch.undo()
    folder._lock.release()
    assert PARTS[1] in names(out)
    again = open_folder(out, resume=True)
    assert again.damaged == {}
    assert next(again.manifest.missing()) == (100, 200)
    assert PARTS[1] not in names(out)
    again.close("finished")


def test_a_full_disk_says_what_is_safe_and_how_to_go_on(tmp_path, monkeypatch):
    out = tmp_path / "out"
    folder = open_folder(out)
    commit(folder, 0)
    before = names(out)

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(storage, "put_file", full)
    with pytest.raises(WriteError, match=r"No space left.*100 of 441 rows are safe.*--resume"):
        commit(folder, 100)
    monkeypatch.undo()
    folder.close("stopped")
    assert names(out) == [name for name in before if name != "_lock"]
    assert status(out, verify=True).rows_done == 100


def test_a_run_that_was_refused_leaves_no_trace(tmp_path):
    folder = open_folder(tmp_path / "out")
    folder.discard()
    folder.close("later")
    assert names(tmp_path) == []
    (tmp_path / "mine").mkdir()
    open_folder(tmp_path / "mine").discard()
    assert names(tmp_path / "mine") == []
    finished_folder(tmp_path / "done")
    open_folder(tmp_path / "done", resume=True).discard()
    assert finished_table(tmp_path / "done").num_rows == ROWS


def test_a_refused_run_whose_folder_is_gone_releases_it(tmp_path):
    folder = open_folder(tmp_path / "out")
    shutil.rmtree(tmp_path / "out")
    folder.discard()
    assert folder._lock._descriptor is None


def test_what_is_written_after_closing_is_dropped(tmp_path):
    folder = open_folder(tmp_path / "out")
    commit(folder, 0)
    folder.close("interrupted")
    commit(folder, 100)
    assert status(tmp_path / "out", verify=True).rows_done == 100
    assert names(tmp_path / "out") == [MANIFEST_NAME, PARTS[0]]


def test_a_lost_manifest_is_named(tmp_path):
    out = finished_folder(tmp_path / "out")
    (out / MANIFEST_NAME).unlink()
    for how in ({}, {"resume": True}):
        with pytest.raises(DamagedError, match=f"no {MANIFEST_NAME}"):
            open_folder(out, **how)
    open_folder(out, overwrite=True).close("finished")
    assert names(out) == [MANIFEST_NAME]


def test_a_damaged_manifest_can_be_overwritten_but_not_resumed(tmp_path):
    out = finished_folder(tmp_path / "out")
    content = (out / MANIFEST_NAME).read_bytes()
    (out / MANIFEST_NAME).write_bytes(content[: len(content) // 2])
    with pytest.raises(DamagedError):
        open_folder(out, resume=True)
    open_folder(out, overwrite=True).close("finished")
    assert names(out) == [MANIFEST_NAME]
