"""Paths and URLs: what they name, what is refused, and that no message repeats a secret."""

from __future__ import annotations

import pickle
import threading
from pathlib import Path

import fsspec
import pytest

from boulder_sweep import locations
from boulder_sweep.locations import LocationError, RemotePath, beside, location_of
from tests.waiting import HANG_GUARD_S, wait_until


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
        ("a b://x", "not the beginning of a URL"),
    ],
)
def test_urls_that_cannot_be_opened_are_refused(url, words):
    with pytest.raises(LocationError, match=words):
        location_of(url)


def test_a_url_behaves_like_a_path_and_can_be_sent():
    place = location_of("memory://places/m30.sweep/")
    assert isinstance(place, RemotePath)
    assert str(place / "a.csv") == "memory://places/m30.sweep/a.csv"
    assert ((place / "a.csv").name, (place / "a.csv").suffix, (place / "a.csv").parent) == ("a.csv", ".csv", place)
    assert pickle.loads(pickle.dumps(place)) == place
    assert not (place / "a.csv").exists()
    (place / "a.csv").put("a,é\n".encode())
    assert (place / "a.csv").open(encoding="utf-8").read() == "a,é\n"
    assert (place / "a.csv").stat().st_size == 5
    assert place.is_dir()
    assert place.names() == ["a.csv"]
    with pytest.raises(FileExistsError):
        (place / "a.csv").put(b"", only_new=True)
    (place / "a.csv").unlink()
    with pytest.raises(FileNotFoundError):
        (place / "a.csv").read_bytes()


def test_files_made_from_a_result_lie_beside_it_or_here():
    assert beside(Path("runs/m30.sweep"), ".png") == Path("runs/m30.png")
    assert beside(location_of("memory://x/m30.sweep"), ".html") == Path("m30.html")


def test_a_try_at_a_store_has_limits_of_its_own_and_other_options_stay(monkeypatch):
    """Without them botocore tries for minutes by itself."""
    monkeypatch.setitem(fsspec.config.conf, "s3", {"config_kwargs": {"signature_version": "s3v4", "read_timeout": 9}})
    config = location_of("s3://bucket/out")._filesystem.config_kwargs
    assert config == {
        "connect_timeout": 3,
        "read_timeout": 9,
        "retries": {"total_max_attempts": 1},
        "signature_version": "s3v4",
    }


def test_a_request_that_is_given_up_is_not_tried_again(monkeypatch):
    monkeypatch.setattr(locations, "REQUEST_S", 0.05)  # no answer comes, however long it is
    monkeypatch.setattr(locations, "FIRST_WAIT_S", HANG_GUARD_S)  # hang guard
    place, asked = location_of("memory://places/out"), []

    def fail(path):
        asked.append(path)
        raise ConnectionResetError("not now")

    monkeypatch.setattr(place._filesystem, "info", fail)
    with pytest.raises(TimeoutError, match="the store has not answered for 0 s"):
        place.stat()
    wait_until(lambda: not [one for one in threading.enumerate() if one.name == "request"], "no thread is left")
    assert len(asked) == 1


def test_a_file_of_any_size_has_the_time_to_be_read(monkeypatch):
    place, limits = location_of("memory://places/design.csv"), []
    monkeypatch.setattr(RemotePath, "read_bytes", lambda self, most=None: limits.append(most) or b"")
    for size in (10**9, 5):
        monkeypatch.setattr(place._filesystem, "info", lambda path, size=size: {"size": size, "type": "file"})
        place.open("rb")
    assert limits == [10**9, 1 << 24]


def test_a_list_of_many_pages_has_more_time_than_one_answer(monkeypatch):
    monkeypatch.setattr(locations, "REQUEST_S", 0.2)  # no answer comes, however long it is
    place, end = location_of("memory://places/out"), threading.Event()
    monkeypatch.setattr(place._filesystem, "ls", lambda path, detail: end.wait(HANG_GUARD_S))  # hang guard
    with pytest.raises(TimeoutError, match="the store has not answered for 1 s"):
        place.names()
    end.set()
