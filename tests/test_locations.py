"""Paths and URLs: what they name, what is refused, and that no message repeats a secret."""

from __future__ import annotations

import asyncio
import os
import pickle
import re
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import fsspec
import pytest
from fsspec.asyn import AsyncFileSystem

import boulder_sweep
from boulder_sweep import locations
from boulder_sweep.errors import LinkError, PictureError
from boulder_sweep.locations import (
    LocationError,
    _machine,
    beside,
    is_folder,
    location_of,
    names_in,
    opened,
    put,
    read_bytes,
    remove,
    replacing,
    stat_of,
)
from boulder_sweep.store.folder import check_target


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("out", "out"),
        ("/data/m30.sweep", "/data/m30.sweep"),
        ("file:///data/my%20out", "/data/my out"),
        ("file://localhost/data/out", "/data/out"),
    ],
)
def test_paths_and_file_urls_are_paths(text, path):
    assert location_of(text) == Path(path)


@pytest.mark.parametrize(
    "url",
    [
        "s3://AKIA:SECRET@bucket/out",
        "s3://SECRET@bucket/out",
        "s3://bucket/out?X-Amz-Signature=SECRET",
        "s3://bucket/out#SECRET",
        "memory://user:SECRET@x/out",
        "file://user:SECRET@host/out",
    ],
)
def test_a_url_with_credentials_is_refused_without_repeating_them(url):
    with pytest.raises(LocationError, match="leave credentials where the library") as refused:
        location_of(url)
    assert "SECRET" not in str(refused.value)
    assert "AKIA" not in str(refused.value)
    assert refused.value.__cause__ is None


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("file://host/out", "another machine"),
        ("nosuch://x/out", "cannot be opened.*nosuch"),
        ("gs://bucket/out", "gs:// needs another package: .*gcsfs"),
        ("abfs://bucket/out", "abfs:// needs another package: .*adlfs"),
        ("a b://x", "not the beginning of a URL"),
    ],
)
def test_urls_that_cannot_be_opened_are_refused(url, words):
    with pytest.raises(LocationError, match=words):
        location_of(url)


def test_a_url_can_be_read_written_and_sent():
    place = location_of("memory://places/m30.sweep/")
    assert str(place / "a.csv") == "memory://places/m30.sweep/a.csv"
    assert ((place / "a.csv").name, (place / "a.csv").suffix, (place / "a.csv").parent) == ("a.csv", ".csv", place)
    assert pickle.loads(pickle.dumps(place)) == location_of(str(place)) == location_of(place) == place
    assert names_in(place) == []
    put(place / "a.csv", "a,é\n".encode())
    assert opened(place / "a.csv").read().decode() == "a,é\n"
    assert stat_of(place / "a.csv").st_size == 5
    assert is_folder(place)
    assert names_in(place) == ["a.csv"]
    for _ in range(2):  # it may be gone
        remove(place / "a.csv")
    with pytest.raises(FileNotFoundError):
        read_bytes(place / "a.csv")


@pytest.mark.parametrize(
    ("act", "method"),
    [(read_bytes, "cat_file"), (names_in, "ls"), (stat_of, "info"), (lambda place: put(place, b""), "pipe_file")],
)
def test_what_a_store_raises_is_an_error_of_the_system_without_secrets(monkeypatch, act, method):
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "no-one-may-read-this")
    place = location_of("memory://places/out")

    def fail(*_, **__):
        raise LookupError("no-one-may-read-this at https://user:pw@host/x?signature=abc")

    monkeypatch.setattr(type(place.fs), method, fail)
    with pytest.raises(OSError, match=r"\*\*\* at https://host/x\?\*\*\*") as told:
        act(place)
    assert "pw" not in str(told.value)
    assert told.value.__cause__ is None


def test_files_made_from_a_result_lie_beside_it_or_here():
    assert beside(Path("runs/m30.sweep"), ".png") == Path("runs/m30.png")
    assert beside(location_of("memory://x/m30.sweep"), ".html") == Path("m30.html")


def test_options_of_the_user_stay_and_win(monkeypatch):
    monkeypatch.setitem(fsspec.config.conf, "s3", {"config_kwargs": {"signature_version": "s3v4"}})
    assert location_of("s3://bucket/out").fs.config_kwargs == {"read_timeout": 30, "signature_version": "s3v4"}
    monkeypatch.setitem(fsspec.config.conf, "s3", {"config_kwargs": {"read_timeout": 9}})
    assert location_of("s3://bucket/out").fs.config_kwargs == {"read_timeout": 9}


@pytest.mark.parametrize("package", ["upath", "fsspec.config"])
def test_without_the_extra_every_url_is_refused_by_its_name(monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(LocationError, match=r"gs:// needs another package: in a clone .* pip install '.\[s3\]'"):
        location_of("gs://bucket/out")


class Silent(AsyncFileSystem):
    """A store that never answers, whatever it is asked."""

    protocol = "silent"
    cachable = False

    async def _for_ever(self, *_, **__):
        await asyncio.Event().wait()

    _cat_file = _info = _isdir = _ls = _pipe_file = _rm_file = _for_ever


@pytest.mark.filterwarnings("ignore:UPath")
@pytest.mark.parametrize("act", [read_bytes, stat_of, is_folder, names_in, lambda place: put(place, b""), remove])
def test_a_store_that_never_answers_is_given_up(monkeypatch, act):
    monkeypatch.setattr(locations, "_WITHIN_S", 0.01)
    fsspec.register_implementation("silent", Silent, clobber=True)
    with pytest.raises(OSError, match="no answer, or failures only, for"):
        act(location_of("silent://bucket/out"))


def test_a_file_is_not_named_in_a_store_that_fails_but_in_one_that_lets_nobody_read(monkeypatch):
    """Computing first and then failing to write helps nobody."""
    target = location_of("memory://places/answers.parquet")
    for problem, allowed in [(PermissionError(13, "denied"), True), (OSError(5, "not now"), False)]:
        monkeypatch.setattr(type(target.fs), "ls", Mock(side_effect=problem))
        with nullcontext() if allowed else pytest.raises(PictureError, match=r"cannot be written: .*not now"):
            check_target(target, PictureError)


@pytest.mark.parametrize("closed", ["folder", "folder/map.png"])
def test_a_target_that_may_not_be_written_is_refused_before_the_work(tmp_path, monkeypatch, closed):
    target = tmp_path / "folder" / "map.png"
    target.parent.mkdir()
    target.touch()
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path / closed or not mode & os.W_OK)
    with pytest.raises(PictureError, match="Permission denied"):
        check_target(target, PictureError)


def test_no_output_is_written_through_a_link(tmp_path):
    outside = tmp_path / "outside"
    outside.write_text("precious")
    (tmp_path / "map.png").symlink_to(outside)
    with pytest.raises(LinkError, match="is a link"), replacing(tmp_path / "map.png"):
        pytest.fail("nothing may be written")
    with pytest.raises(LinkError, match="is a link"):
        check_target(tmp_path / "map.png", PictureError)
    assert outside.read_text() == "precious"


@pytest.mark.parametrize("dangling", [True, False])
def test_a_pipe_or_a_dangling_link_is_refused_too(tmp_path, dangling):
    target = tmp_path / "map.png"
    target.symlink_to(tmp_path / "nowhere") if dangling else os.mkfifo(target)
    with pytest.raises(LinkError):
        check_target(target, PictureError)
    assert not (tmp_path / "nowhere").exists()


def test_what_killed_processes_left_is_removed_and_the_rest_stays(tmp_path):
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    dead, alive = (f"{_machine()}-{pid}-{'0' * 16}.writing" for pid in (child.pid, os.getpid()))
    old, young = f"00000000-1-{'0' * 16}.writing", f"00000000-1-{'1' * 16}.writing"  # of another machine
    names = [before + one for before in (".map.png.", ".other.csv.", "") for one in (dead, alive, old, young)]
    for name in (*names, "mine", f"x{dead}"):
        (tmp_path / name).write_text("x")
    for name in (dead, alive):
        (tmp_path / f"sweep-{name}" / "inside").mkdir(parents=True)
    for name in names:
        if name.endswith(old):
            os.utime(tmp_path / name, (0, 0))
    with replacing(tmp_path / "map.png") as file:
        file.write(b"whole")
    kept = [name for name in names if name.endswith((alive, young))]
    assert names_in(tmp_path) == sorted([*kept, "map.png", "mine", f"x{dead}", f"sweep-{alive}"])
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
    assert names_in(tmp_path) == [name]


def test_an_output_that_cannot_be_completed_changes_nothing(tmp_path):
    (tmp_path / "map.png").write_bytes(b"whole")

    def half():
        with replacing(tmp_path / "map.png") as file:
            file.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        half()
    assert names_in(tmp_path) == ["map.png"]
    assert (tmp_path / "map.png").read_bytes() == b"whole"


WRITES = re.compile(r"""O_TRUNC|O_CREAT|write_(text|bytes)\(|open\([^)]*["'][wax]b?\+?["']""")
BY_ITSELF = {
    "locations.py": "creates files",
    "cli/settings_files.py": "only a new file",
    "cli/output.py": "nowhere, and its own cache",
    "report/build.py": "for developers",
    "report/writing.py": "a folder of its own for the browser",
}


def test_no_other_module_opens_files_for_writing_by_itself():
    root = Path(boulder_sweep.__file__).parent
    found = {str(path.relative_to(root)) for path in root.rglob("*.py") if WRITES.search(path.read_text())}
    assert found == BY_ITSELF.keys()
