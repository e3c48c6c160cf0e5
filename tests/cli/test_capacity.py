"""``sweep capacity``: lines, JSON, Parquet."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"


def test_lines_json_and_parquet(sweep, tmp_path):
    code, out, _ = sweep("capacity", CONFIG)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "simulated" in out
    code, out, _ = sweep("capacity", CONFIG, "--json", "-o", tmp_path / "w.parquet")
    rows = json.loads(out)["rows"]
    frame = pd.read_parquet(tmp_path / "w.parquet")
    assert code == 0
    speeds = frame.withstands_speed_m_s.astype(object).where(frame.withstands_speed_m_s.notna(), None)
    assert [row["withstands_speed_m_s"] for row in rows] == speeds.tolist()
    assert frame.attrs["units"]["withstands_speed_m_s"] == frame.attrs["units"]["speed_fails_at"] == "m/s"
    assert {"found", "blocked_by_overlap"} == {row["speed_found"] for row in rows}


def test_rows_that_cannot_be_computed_give_exit_code_3(sweep, grid):
    code, out, _ = sweep("capacity", grid, "--json")
    assert code == 3
    assert [row["verdict"] for row in json.loads(out)["rows"]].count("error") == 6
