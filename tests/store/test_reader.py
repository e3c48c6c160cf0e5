"""Reading a result back."""

from __future__ import annotations

import pandas as pd
import polars as pl
import pytest

from boulder_sweep.columns import COLUMNS
from boulder_sweep.store import read
from boulder_sweep.store.failures import DamagedError, NotASweepError
from tests.store.folders import ROWS, commit, finished_folder, open_folder


def test_what_is_read_is_what_pandas_reads(tmp_path):
    out = finished_folder(tmp_path / "out")
    frame = read(out)
    pd.testing.assert_frame_equal(frame, pd.read_parquet(out), check_categorical=False)
    assert frame.attrs["rows"] == ROWS
    assert frame.attrs["complete"]
    assert isinstance(frame["verdict"].dtype, pd.CategoricalDtype)


def test_some_columns(tmp_path):
    frame = read(str(finished_folder(tmp_path / "out")), columns=["margin", "design_id"])
    assert list(frame.columns) == ["margin", "design_id"]
    assert frame.attrs["units"] == {"margin": "1", "design_id": ""}


def test_an_unknown_column_is_named(tmp_path):
    finished_folder(tmp_path / "out")
    with pytest.raises(ValueError, match=r"has no column 'nope'; its columns are design_id, "):
        read(tmp_path / "out", columns=["margin", "nope"])


def test_an_unfinished_result(tmp_path):
    folder = open_folder(tmp_path / "out")
    for reader in (read, pl.read_parquet):
        empty = reader(tmp_path / "out") if reader is read else reader(f"{tmp_path}/out/*.parquet")
        assert len(empty) == 0
        assert list(empty.columns) == [spec.name for spec in COLUMNS]
    commit(folder, 0)
    commit(folder, 100, rows=20)
    frame = read(tmp_path / "out")
    assert list(frame["design_id"]) == list(range(120))
    assert not frame.attrs["complete"]
    folder.close("interrupted")


def test_no_result(tmp_path):
    with pytest.raises(NotASweepError, match="is not the result of a sweep"):
        read(tmp_path)
    with pytest.raises(NotASweepError):
        read(tmp_path / "gone")


@pytest.mark.parametrize("damage", ["flip", "truncate", "remove"])
def test_damage_is_never_read_as_data(tmp_path, damage):
    out = finished_folder(tmp_path / "out")
    path = out / "rows-000000000100-000000000200.parquet"
    content = bytearray(path.read_bytes())
    if damage == "flip":
        content[2000] ^= 1
        path.write_bytes(content)
    elif damage == "truncate":
        path.write_bytes(content[:3000])
    else:
        path.unlink()
    with pytest.raises(DamagedError, match=r"--resume recomputes .*--dry-run"):
        read(out)
