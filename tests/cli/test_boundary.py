"""``sweep boundary``: counts, the share saved, files."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq

import boulder_sweep

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"
HEIGHTS = ("--set", "boulder.height={from: 2.4 m, to: 3.6 m, count: 61}")


def test_counts_and_share(sweep, tmp_path):
    code, out, _ = sweep("boundary", CONFIG, *HEIGHTS, "-o", tmp_path / "map.parquet", "--plot", tmp_path / "map.png")
    assert code == 0
    assert "saved" in out.splitlines()[-1]
    assert (tmp_path / "map.png").exists()
    assert sweep("plot", tmp_path / "map.parquet", "-o", tmp_path / "again.png")[2] == ""
    table = pq.read_table(tmp_path / "map.parquet")
    metadata = {**table.schema.metadata, b"boulder_sweep.rules_sha256": b"abcdef0123456789"}
    pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "map.parquet")
    err = sweep("plot", tmp_path / "map.parquet", "-o", tmp_path / "again.png")[2]
    version = boulder_sweep.__version__
    assert err.startswith(f"note: {tmp_path}/map.parquet was judged by the rules of version {version} (rules abcdef01,")
    found = json.loads(sweep("boundary", CONFIG, *HEIGHTS, "--json")[1])
    assert found["designs"] == 122 == sum(found["verdicts"].values())
    assert found["simulations"] < 40


def test_a_grid_too_small_to_save_anything(sweep):
    changes = ("--set", "boulder.height=[2.8, 3.4] m", "--set", "soil.friction_angle=40 deg")
    code, out, _ = sweep("boundary", CONFIG, *changes)
    assert code == 0
    last = out.splitlines()[-1]
    assert last == "6 simulations for 2 designs: nothing saved; 'sweep run' simulates each design once"
