"""A file with uncertain inputs works in every command; ``--at`` chooses their values."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

SITE = Path(__file__).parents[2] / "configs" / "uncertain_site.yaml"
NOTE = "soil.friction_angle 33.07 deg (p5"


@pytest.mark.parametrize(
    "words",
    [
        ("run", SITE, "-o", "table"),
        ("run", SITE, "--dry-run"),
        ("simulate", SITE),
        ("need", SITE),
        ("capacity", SITE),
        ("tradeoff", SITE, "--designs", "1", "--seconds", "0"),
        ("explore", SITE, "--no-open", "-o", "page.html"),
    ],
    ids=lambda words: " ".join(map(str, words[:1] + words[2:])),
)
def test_every_command_takes_the_file(sweep, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = sweep(*words)
    assert code == 0
    assert NOTE in " ".join(err.split())


def test_the_file_is_checked_and_asked_for_probabilities_as_before(sweep):
    assert sweep("check", SITE)[0] == 0
    code, _, err = sweep("need", SITE, "--probability", "0.5", "-q", "--between", "2 m", "2.02 m")
    assert (code, err) == (0, "")


def test_the_mean_is_asked_for(sweep):
    code, out, err = sweep("simulate", SITE, "--at", "mean", "--json")
    assert code == 0
    assert "soil.friction_angle 38 deg (mean)" in " ".join(err.split())
    assert json.loads(out)["max_rotation_deg"] == pytest.approx(15.26, abs=0.01)


def test_the_values_do_not_hide_an_entry_that_is_set(sweep):
    _, _, err = sweep("simulate", SITE, "--set", "soil.friction_angle=40 deg")
    assert "soil.friction_angle" not in err
    assert "vehicle.speed" in err


def test_an_interrupted_run_is_resumed_with_the_same_values(sweep, tmp_path):
    out = tmp_path / "table"
    assert sweep("run", SITE, "-o", out, "--at", "p10")[0] == 0
    code, _, err = sweep("run", SITE, "-o", out, "--resume")
    assert code == 4
    assert "friction_angle" in err
    assert sweep("run", SITE, "-o", out, "--at", "p10", "--resume")[0] == 0


def test_the_report_says_what_was_taken(sweep, tmp_path):
    sweep("run", SITE, "-o", tmp_path / "table", "-q")
    assert sweep("report", tmp_path / "table", "-o", tmp_path / "page.html")[0] == 0
    assert "p5 low" in (tmp_path / "page.html").read_text(encoding="utf-8")
