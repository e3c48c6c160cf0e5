"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import stat

import pytest

from boulder_sweep.store import files
from boulder_sweep.store.files import is_ours, put_file


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture(params=["nameless", "named", "no proc"])
def way(request, monkeypatch):
    """The ways a file can be written, depending on the file system and the machine."""
    if request.param == "named":
        monkeypatch.delattr(os, "O_TMPFILE")
    elif request.param == "no proc":
        link = os.link

        def no_link(source, target, **where):
            if str(source).startswith("/proc/"):
                raise FileNotFoundError(errno.ENOENT, "no /proc", source)
            return link(source, target, **where)

        monkeypatch.setattr(os, "link", no_link)
    return request.param


def test_a_file_is_put(way, tmp_path):
    put_file(tmp_path, "a.bin", b"x" * 20_000_000)
    assert (tmp_path / "a.bin").read_bytes() == b"x" * 20_000_000
    assert names(tmp_path) == ["a.bin"]


def test_a_file_is_replaced(way, tmp_path):
    put_file(tmp_path, "a.bin", b"old")
    with (tmp_path / "a.bin").open("rb") as reader:
        put_file(tmp_path, "a.bin", memoryview(b"new and longer"))
        assert reader.read() == b"old"  # who reads already is not disturbed
    assert (tmp_path / "a.bin").read_bytes() == b"new and longer"
    assert names(tmp_path) == ["a.bin"]


def test_the_usual_rights_are_given(way, tmp_path):
    before = os.umask(0o027)
    try:
        put_file(tmp_path, "a.bin", b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.bin").stat().st_mode) == 0o640


@pytest.mark.parametrize("failing", [0, 1, 2])
def test_a_full_disk_changes_nothing(way, tmp_path, monkeypatch, failing):
    put_file(tmp_path, "a.bin", b"old")
    write, calls = os.write, []

    def full(descriptor, content):
        calls.append(len(content))
        if len(calls) > failing:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, content)

    monkeypatch.setattr(os, "write", full)
    monkeypatch.setattr(files, "_PIECE", 4)
    with pytest.raises(OSError, match="No space left"):
        put_file(tmp_path, "a.bin", b"new content")
    assert (tmp_path / "a.bin").read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_a_failed_rename_leaves_nothing_behind(way, tmp_path, monkeypatch):
    put_file(tmp_path, "a.bin", b"old")

    def refuse(*names, **where):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "rename", refuse)
    with pytest.raises(OSError, match="Input/output"):
        put_file(tmp_path, "a.bin", b"new")
    assert names(tmp_path) == ["a.bin"]


def test_what_a_killed_run_left_is_written_over(way, tmp_path):
    (tmp_path / "_a.bin.writing").write_bytes(b"half")
    put_file(tmp_path, "a.bin", b"old")
    (tmp_path / "_a.bin.writing").write_bytes(b"half")
    put_file(tmp_path, "a.bin", b"new")
    assert (tmp_path / "a.bin").read_bytes() == b"new"


def test_passing_names_begin_with_an_underscore_and_are_known_as_ours(tmp_path, monkeypatch):
    seen = []
    rename = os.rename

    def watch(source, target, **where):
        seen.append(source)
        rename(source, target, **where)

    monkeypatch.setattr(os, "rename", watch)
    for _ in range(2):
        put_file(tmp_path, "rows-000000000000-000000000100.parquet", b"x")
    assert seen == ["_rows-000000000000-000000000100.parquet.writing"]
    assert is_ours(seen[0])


def test_content_and_folder_are_flushed_before_it_returns(way, tmp_path, monkeypatch):
    flushed = []
    fsync = os.fsync

    def watch(descriptor):
        flushed.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watch)
    put_file(tmp_path, "a.bin", b"x")
    assert flushed[-2:] == ["file", "folder"]
