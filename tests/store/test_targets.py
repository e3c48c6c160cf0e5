"""What is written beside results never gets into them."""

from __future__ import annotations

import pytest

from boulder_sweep.errors import PictureError, QuestionError
from boulder_sweep.locations import location_of
from boulder_sweep.store.files import check_target
from tests.store.folders import finished_folder


@pytest.fixture
def result(tmp_path):
    return finished_folder(tmp_path / "out.sweep")


def test_a_place_within_a_result_is_refused(result, tmp_path, monkeypatch):
    inside = rf"^out\.sweep/new\.parquet: the folder {result} holds the result of a run; name a file outside it$"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(QuestionError, match=inside):
        check_target(location_of("out.sweep/new.parquet"), QuestionError)
    (tmp_path / "link").symlink_to(result)
    with pytest.raises(PictureError, match="holds the result of a run"):
        check_target(tmp_path / "link" / "map.png", PictureError)
    monkeypatch.chdir(result)
    with pytest.raises(QuestionError, match="holds the result of a run"):
        check_target(location_of("new.parquet"), QuestionError)


def test_a_place_beside_it_is_accepted(result):
    check_target(result.with_name("new.parquet"), QuestionError)
    check_target(location_of("memory://tables/new.parquet"), QuestionError)


def test_a_result_on_an_object_store_is_kept_too(result):
    for path in result.iterdir():
        location_of(f"memory://results/kept.sweep/{path.name}").put(path.read_bytes())
    with pytest.raises(QuestionError, match=r"the folder memory://results/kept\.sweep holds the result of a run"):
        check_target(location_of("memory://results/kept.sweep/new.parquet"), QuestionError)


def test_a_store_that_cannot_be_read_is_left_to_the_writing(monkeypatch):
    target = location_of("memory://tables/new.parquet")

    def refused(self):
        raise PermissionError

    monkeypatch.setattr(type(target), "stat", refused)
    check_target(target, QuestionError)


def test_a_folder_that_is_missing_or_has_the_name_is_said(tmp_path):
    with pytest.raises(QuestionError, match=rf"none/new\.parquet: the folder {tmp_path}/none does not exist$"):
        check_target(tmp_path / "none" / "new.parquet", QuestionError)
    (tmp_path / "new.parquet").mkdir()
    with pytest.raises(QuestionError, match=r"new\.parquet cannot be written: Is a directory$"):
        check_target(tmp_path / "new.parquet", QuestionError)
