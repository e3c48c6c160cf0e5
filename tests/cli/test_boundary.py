"""``sweep boundary``: counts, the share saved, files."""

from __future__ import annotations

import json
from pathlib import Path

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"
HEIGHTS = ("--set", "boulder.height={from: 2.4 m, to: 3.6 m, count: 61}")


def test_counts_and_share(sweep, tmp_path):
    code, out, _ = sweep("boundary", CONFIG, *HEIGHTS, "-o", tmp_path / "map.parquet", "--plot", tmp_path / "map.png")
    assert code == 0
    assert "saved" in out.splitlines()[-1]
    assert (tmp_path / "map.png").exists()
    found = json.loads(sweep("boundary", CONFIG, *HEIGHTS, "--json")[1])
    assert found["designs"] == 122 == sum(found["verdicts"].values())
    assert found["simulations"] < 40


def test_a_grid_too_small_to_save_anything(sweep):
    changes = ("--set", "boulder.height=[2.8, 3.4] m", "--set", "soil.friction_angle=40 deg")
    code, out, _ = sweep("boundary", CONFIG, *changes)
    assert code == 0
    last = out.splitlines()[-1]
    assert last == "6 simulations for 2 designs: nothing saved; 'sweep run' simulates each design once"
