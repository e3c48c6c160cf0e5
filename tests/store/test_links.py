"""A link where a file of ours belongs is refused in words, and never followed."""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import boulder_sweep
from boulder_sweep.errors import PictureError
from boulder_sweep.store import files
from boulder_sweep.store.failures import DamagedError, LinkError
from boulder_sweep.store.files import (
    MANIFEST_NAME,
    check_target,
    hidden_name,
    is_ours,
    part_name,
    put_file,
    replacing,
    staged_name,
)
from tests.store.folders import ROWS, SIZE, encoded_part, finished_folder, open_folder, part_bytes
from tests.store.states import is_locked, status

TOKEN = "0123456789abcdef"
FIRST = part_name(0, SIZE, ROWS)


def names(out):
    return sorted(path.name for path in out.iterdir())


@pytest.fixture
def outside(tmp_path):
    """A file that somebody else would like to see overwritten."""
    path = tmp_path / "outside"
    path.write_text("precious")
    yield path
    assert path.read_text() == "precious"


@pytest.fixture(params=["nameless", "named"])
def way(request, monkeypatch):
    if request.param == "named":
        monkeypatch.delattr(os, "O_TMPFILE")


@pytest.mark.parametrize("how", [{}, {"overwrite": True}, {"resume": True}])
@pytest.mark.parametrize("name", ["_lock", hidden_name(MANIFEST_NAME)])
def test_a_link_in_the_folder_of_a_run_is_refused(tmp_path, outside, name, how):
    out = tmp_path / "out"
    if how:
        finished_folder(out)
    out.mkdir(exist_ok=True)
    (out / name).symlink_to(outside)
    with pytest.raises(LinkError, match=f"{name} is a link") as refused:
        open_folder(out, **how)
    assert refused.value.exit_code == 2
    assert (out / name).is_symlink()
    assert not is_locked(out)


@pytest.mark.parametrize("how", ["overwrite", "resume"])
def test_a_linked_manifest_is_refused_before_a_part_is_removed(tmp_path, how):
    out = finished_folder(tmp_path / "out")
    (out / MANIFEST_NAME).rename(tmp_path / "elsewhere")
    (out / MANIFEST_NAME).symlink_to(tmp_path / "elsewhere")
    before = names(out)
    with pytest.raises(LinkError, match=f"{MANIFEST_NAME} is a link"):
        open_folder(out, **{how: True})
    assert names(out) == before


@pytest.mark.parametrize("name", [MANIFEST_NAME, hidden_name(MANIFEST_NAME)])
def test_a_link_that_comes_later_is_refused(way, tmp_path, outside, name):
    folder = open_folder(tmp_path / "out")
    staged = folder.stage(encoded_part(0))
    (tmp_path / "out" / name).unlink(missing_ok=True)
    (tmp_path / "out" / name).symlink_to(outside)
    with pytest.raises(LinkError, match=f"{name} is a link"):
        folder.commit([staged])
    folder.close("stopped")


def test_a_link_with_the_name_of_a_staged_part_is_refused(way, tmp_path, outside):
    folder = open_folder(tmp_path / "out")
    content, _ = part_bytes(0, SIZE)
    name = staged_name(FIRST, folder.token, hashlib.sha256(content).hexdigest())
    assert is_ours(name)
    (tmp_path / "out" / name).symlink_to(outside)
    with pytest.raises(LinkError, match="is a link"):
        folder.stage(encoded_part(0))
    folder.close("stopped")


@pytest.mark.parametrize("name", ["page.html", hidden_name("page.html")])
def test_no_file_is_put_through_a_link(way, tmp_path, outside, name):
    (tmp_path / "folder").mkdir()
    put_file(tmp_path / "folder", "page.html", b"old")
    (tmp_path / "folder" / name).unlink(missing_ok=True)
    (tmp_path / "folder" / name).symlink_to(outside)
    with pytest.raises(LinkError, match="is a link"):
        put_file(tmp_path / "folder", "page.html", b"new")


@pytest.mark.parametrize("name", ["map.png", f".map.png.{TOKEN}.part"])
def test_no_output_is_written_through_a_link(tmp_path, outside, monkeypatch, name):
    monkeypatch.setattr(files, "secrets", SimpleNamespace(token_hex=lambda _: TOKEN))
    (tmp_path / name).symlink_to(outside)
    with pytest.raises(LinkError, match="is a link"), replacing(tmp_path / "map.png"):
        pytest.fail("nothing may be written")
    if name == "map.png":
        with pytest.raises(LinkError, match="is a link"):
            check_target(tmp_path / name, PictureError)


@pytest.mark.parametrize("dangling", [True, False])
def test_a_pipe_or_a_dangling_link_is_refused_too(tmp_path, dangling):
    target = tmp_path / "map.png"
    target.symlink_to(tmp_path / "nowhere") if dangling else os.mkfifo(target)
    with pytest.raises(LinkError):
        check_target(target, PictureError)
    assert not (tmp_path / "nowhere").exists()


def test_a_pipe_in_place_of_a_manifest_is_not_waited_for(tmp_path):
    out = finished_folder(tmp_path / "out")
    (out / MANIFEST_NAME).unlink()
    os.mkfifo(out / MANIFEST_NAME)
    os.mkfifo(out / "_lock")
    with pytest.raises(DamagedError, match="cannot be read"):
        status(out)


def test_what_a_killed_process_left_of_an_output_does_not_matter(tmp_path):
    """It stays: another process may be writing it."""
    left = tmp_path / f".map.png.{TOKEN}.part"
    left.write_bytes(b"half of a longer one")
    with replacing(tmp_path / "map.png") as file:
        file.write(b"whole")
    assert names(tmp_path) == [left.name, "map.png"]
    assert (tmp_path / "map.png").read_bytes() == b"whole"


@pytest.mark.parametrize("name", ["map.png", "é" * 125 + ".png"])
def test_two_that_write_one_output_leave_it_whole(tmp_path, name):
    target = tmp_path / name
    with replacing(target) as first:
        first.write(b"of the first")
        with replacing(target) as second:
            second.write(b"of the second")
        assert target.read_bytes() == b"of the second"
    assert target.read_bytes() == b"of the first"
    assert names(tmp_path) == [name]


def test_an_output_that_cannot_be_completed_changes_nothing(tmp_path):
    (tmp_path / "map.png").write_bytes(b"whole")

    def half():
        with replacing(tmp_path / "map.png") as file:
            file.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        half()
    assert names(tmp_path) == ["map.png"]
    assert (tmp_path / "map.png").read_bytes() == b"whole"


WRITES = re.compile(r"""O_TRUNC|O_CREAT|write_(text|bytes)\(|open\([^)]*["'][wax]b?\+?["']""")
BY_ITSELF = {
    "store/files.py": "creates files",
    "store/lock.py": "opens a file that is there",
    "cli/settings_files.py": "only a new file",
    "cli/output.py": "nowhere, and its own cache",
    "report/build.py": "for developers",
    "report/writing.py": "a folder of its own for the browser",
}


def test_no_other_module_opens_files_for_writing_by_itself():
    root = Path(boulder_sweep.__file__).parent
    found = {str(path.relative_to(root)) for path in root.rglob("*.py") if WRITES.search(path.read_text())}
    assert found == BY_ITSELF.keys()
