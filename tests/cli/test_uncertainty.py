"""``sweep uncertainty``: lines, one JSON object, files."""

from __future__ import annotations

import json
from pathlib import Path

CONFIG = Path(__file__).parents[2] / "configs" / "uncertain_site.yaml"


def test_lines_fit_the_terminal(sweep):
    code, out, err = sweep("uncertainty", CONFIG, "--rare")
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "P(pass)" in out
    assert "Sobol" in out
    assert "seed 0" in err


def test_json_and_files(sweep, tmp_path):
    words = ("uncertainty", CONFIG, "--json", "-o", tmp_path / "c.parquet", "--plot", tmp_path / "c.png", "-q")
    code, out, _ = sweep(*words)
    assert code == 0
    assert 0.0 < json.loads(out)["rows"][0]["p_pass"] < 1.0
    assert {file.name for file in tmp_path.iterdir()} >= {
        "c.parquet",
        "c.indices.parquet",
        "c.samples.parquet",
        "c.png",
    }


def test_need_with_a_probability(sweep):
    code, out, _ = sweep("need", CONFIG, "--probability", "0.9", "--own-readings", "-q")
    assert code == 0
    assert "P(pass)" in out.splitlines()[0]
    code, _, err = sweep("need", CONFIG)
    assert code == 2
    assert "distribution" in err


def test_published_spreads_have_sources(sweep):
    code, out, _ = sweep("uncertainty", "--published")
    assert code == 0
    assert "JCSS" in out
    assert out.count("as quoted by others") == 4


def test_doubts(sweep, monkeypatch):
    monkeypatch.setattr("boulder_sweep.answers.doubts.DRAWN", 32)
    code, out, _ = sweep("uncertainty", CONFIG, "--doubts", "-q")
    assert code == 0
    assert "readings of the paper" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    assert len(json.loads(sweep("uncertainty", CONFIG, "--doubts", "--json", "-q")[1])["doubts"]) == 4
