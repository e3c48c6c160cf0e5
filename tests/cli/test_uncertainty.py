"""``sweep uncertainty``: lines, one JSON object, files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

CONFIG = Path(__file__).parents[2] / "configs" / "uncertain_site.yaml"


def test_lines_fit_the_terminal(sweep):
    code, out, err = sweep("uncertainty", CONFIG)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "P(pass)" in out
    assert "soil.friction_angle" in out
    assert "seed 0" in err


def test_json_and_files(sweep, tmp_path):
    words = ("uncertainty", CONFIG, "--json", "-o", tmp_path / "c.parquet", "--plot", tmp_path / "c.png", "-q")
    code, out, _ = sweep(*words)
    assert code == 0
    assert 0.0 < json.loads(out)["rows"][0]["p_pass"] < 1.0
    assert {file.name for file in tmp_path.iterdir()} >= {
        "c.parquet",
        "c.samples.parquet",
        "c.png",
    }


def test_need_with_a_probability(sweep):
    code, out, _ = sweep("need", CONFIG, "--probability", "0.9", "-q")
    assert code == 0
    assert out.startswith("Bury the boulder (23.1 t) 2.254 m deep: it passes with a probability of 90.1 %")
    assert "P(pass)" in out.splitlines()[out.splitlines().index("") + 1]


AS_WEIGHED = """
name: quarry
boulder: {mass: 23.5 t, length: 1.65 m, width: 1.68 m, height: 3.4 m}
site: {embedment_depth: 2.55 m}
soil: {density: 1900 kg/m^3, friction_angle: {mean: 38 deg, sd: 2 deg}, subgrade_reaction: 40 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.fixture
def weighed(tmp_path):
    """A stone that fills less than 40 % of the box of its sides, by a density that is a mistake."""
    text = AS_WEIGHED.replace("mass: 23.5 t", "mass: 23.5 t, density: 6500 kg/m^3")
    (tmp_path / "weighed.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "weighed.yaml"


def test_a_stone_whose_shape_is_not_known_is_undecided_and_no_failure(sweep, weighed):
    """Its density decides: with the one that fills the box every design drawn passes."""
    row = json.loads(sweep("uncertainty", weighed, "--json", "-q")[1])["rows"][0]
    assert (row["p_pass"], row["p_undecided"], row["p_undecided_reason"]) == (0.0, 1.0, "shape")
    assert (row["p_pass_low"], row["p_pass_high"]) == (0.0, 1.0)
    out = sweep("uncertainty", weighed, "-q")[1]
    assert re.search(r"^undecided +0\.0000 +0\.0000 +1\.0000 +1\.0000 ", out, re.MULTILINE)
    assert "not decided: undecided (shape)" in out
    assert "undecided (shape): by its mass the boulder fills less" in out
    known = ("--set", "boulder.density=2485 kg/m^3")
    row = json.loads(sweep("uncertainty", weighed, "--json", "-q", *known)[1])["rows"][0]
    assert (row["p_pass"], row["p_undecided"], row["p_undecided_reason"]) == (1.0, 0.0, None)
    assert "not\n" not in sweep("uncertainty", weighed, "-q", *known)[1].split("foot:")[0]


@pytest.mark.parametrize("words", [("--probability", "95%"), (), ("--most", "speed"), ("--least", "friction_angle")])
def test_a_need_that_nothing_decides_names_the_reason(sweep, weighed, words):
    if words[:1] == ("--least",):
        words = (*words, "--at", "mean")
    out = sweep("need", weighed, "-q", "--notes", *words)[1]
    assert "undecided: no value is known to pass" in out
    assert "undecided (shape): by its mass the boulder fills less" in out
    assert "blocked" not in out
    assert "another boulder" not in out


def test_an_object_in_us_units_is_refused(sweep):
    code, out, err = sweep("uncertainty", CONFIG, "--json", "--units", "us")
    assert (code, out) == (2, "")
    assert "leave out --units us or --json" in err


@pytest.mark.parametrize("command", ["need", "uncertainty"])
@pytest.mark.parametrize("margin", ["250", "200%", "-0.5", "1"])
def test_a_margin_that_no_design_has_is_refused(sweep, command, margin):
    chance = ("--probability", "0.9") if command == "need" else ()
    code, out, err = sweep(command, CONFIG, f"--margin={margin}", *chance)
    assert (code, out) == (2, "")
    assert f"--margin {margin}: must be 0 or more and less than 100 %" in err


@pytest.mark.parametrize(
    ("design", "words"), [("1", "holds 1 design, numbered from 0; there is no 1"), ("-1", "is not in the range x>=0")]
)
def test_a_design_that_the_file_does_not_hold_is_refused_at_once(sweep, monkeypatch, design, words):
    monkeypatch.setattr("boulder_sweep.answers.uncertainty.uncertainty", lambda *_, **__: pytest.fail("sampled"))
    code, out, err = sweep("uncertainty", CONFIG, "--design", design)
    assert (code, out) == (2, "")
    assert words in err
