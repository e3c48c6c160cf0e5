"""``sweep need``: a table for a terminal, one JSON object, files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd
import pytest

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"


def test_table_fits_the_terminal(sweep):
    for words in ([], ["--least", "mass"], ["--most", "speed"], ["--margin", "10 %"]):
        code, out, err = sweep("need", CONFIG, *words)
        assert code == 0
        assert all(len(line) <= 80 for line in out.splitlines())
        assert "simulations" in err


def test_columns_of_the_table(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    head = out.splitlines()[0].split()
    assert head == ["H", "φ′", "depth", "ratio", "above", "mass", "margin", "second", "dig", "fill"]
    assert len(out.splitlines()) >= 3 + 12


def test_what_does_not_pass_is_counted_with_the_next_question(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    assert "up to where the truck would pass or ride over the boulder\n  (3 rows)\n" in out
    assert f"next: another boulder: sweep need {CONFIG} --least mass" in out.replace("\n  ", " ")
    _, out, _ = sweep("need", CONFIG, "-q", "--between", "1.0 m", "1.2 m")
    assert "never: passes nowhere in the searched range (12 rows)\n" in out
    assert "blocked" not in out
    _, out, _ = sweep("need", CONFIG, "-q", "--set", "boulder.height=[3.4, 3.6] m")
    assert "next:" not in out


def test_what_passes_is_a_simulation_with_its_flags(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    assert "an answer is a simulation, not a rating by test\n" in out
    assert "flags: 0 of 9 answers inside what the model was tested on; rotation 9," in out
    assert out.index("sensitive: a second opinion overturns it") < out.index("flags: ")
    _, out, _ = sweep("need", CONFIG, "-q", "--between", "1.0 m", "1.2 m")
    assert "flags" not in out


def test_the_lightest_boulder_says_at_which_ends_it_lies(sweep):
    one = ("--set", "soil.friction_angle=40 deg")
    wide = (*one, "--set", "boulder.width=[1.4, 1.9] m", "--set", "site.embedment_ratio=[0.45, 0.75]")
    _, out, _ = sweep("need", CONFIG, "-q", "--least", "mass", *wide)
    assert "edges: W is the least, 1.4 m (1 of 1); " in out
    assert "H is" not in out
    _, out, _ = sweep("need", CONFIG, "-q", "--least", "mass", *wide, "--units", "us")
    assert "edges: W is the least, 4.593 ft (1 of 1); " in out
    _, out, _ = sweep("need", CONFIG, "-q", "--least", "mass", *one, "--set", "boulder.height=3.4 m")
    assert "at no end of one" in out.replace("\n  ", " ")


def test_json_and_parquet_agree(sweep, tmp_path):
    code, out, _ = sweep("need", CONFIG, "--json", "-o", tmp_path / "depths.parquet", "--plot", tmp_path / "d.png")
    found = json.loads(out)
    frame = pd.read_parquet(tmp_path / "depths.parquet")
    assert code == 0
    assert found["asked"] == "least_embedment_depth_m"
    assert found["unit"] == "m"
    assert len(found["rows"]) == len(frame) == 12
    assert [row["found"] for row in found["rows"]] == frame.found.tolist()
    assert sum(found["found"].values()) == 12
    assert (tmp_path / "d.png").exists()


def test_what_is_robust_stands_under_the_law_that_decides(sweep):
    one = ("need", CONFIG, "--json", "--set", "boulder.height=3.4 m", "--set", "soil.friction_angle=40 deg")
    assert json.loads(sweep(*one, "--robust")[1])["rows"][0]["stands_under"] == "paper;width_capped"


def test_the_answer_typed_into_the_file_passes(sweep, tmp_path):
    out = sweep("need", CONFIG, "--json", "--set", "boulder.height=3 m", "--set", "soil.friction_angle=40 deg")[1]
    row = json.loads(out)["rows"][0]
    for value, verdict in ((row["passes_at"], "pass"), (row["fails_at"], "fail")):
        words = ["boulder.height=3 m", "soil.friction_angle=40 deg", f"site.embedment_depth={value} m"]
        options = [part for word in words for part in ("--set", word)]
        assert json.loads(sweep("simulate", CONFIG, *options, "--json")[1])["verdict"] == verdict


def test_names_of_listed_designs_stand_with_their_answers(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = CONFIG.read_text().replace("name: site", "name: listed\ntable: t.csv")
    Path("listed.yaml").write_text(re.sub(r"  (height|friction_angle): .*\n", "", text))
    Path("t.csv").write_text("site_name,boulder_height_m,friction_angle_deg\nnorth,3.4,40\nsouth,3.0,36\n")
    code, out, _ = sweep("need", "listed.yaml", "-q")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[3:5]] == ["north", "south"]
    Path("t.csv").write_text("site_name,embedment_depth_m\nnorth,1.9\nsouth,2.0\n")
    text = re.sub(r"site:\n  embedment_depth: .*\n", "", text)
    Path("listed.yaml").write_text(
        text.replace("{from: 2.6 m, to: 3.6 m, step: 0.2 m}", "3.4 m").replace("[36, 40]", "40")
    )
    code, out, err = sweep("need", "listed.yaml", "-q")
    assert (code, err) == (0, "")
    assert sum(line.lstrip()[0].isdigit() for line in out.splitlines()) == 1


def test_rows_that_cannot_be_computed_give_exit_code_3(sweep):
    code, _, _ = sweep("need", CONFIG, "--set", "vehicle.bumper_height=[0.5, 2] m")
    assert code == 3


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--between", "3.5 m", "4 m"], "embedment depth is not less than the boulder's height"),
        (["--between", "2 m", "2.2 m", "--set", "site.impact_height=1.1 m"], "impact height is above the top"),
    ],
)
def test_rows_that_are_blocked_give_exit_code_0(sweep, words, reason):
    options = ["--set", "boulder.height=3 m", "--set", "soil.friction_angle=40 deg"]
    code, out, _ = sweep("need", CONFIG, *options, *words, "--json")
    row = json.loads(out)["rows"][0]
    assert (row["found"], row["verdict"]) == ("blocked_by_overlap", "error")
    assert row["reason"].startswith(reason)
    assert code == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--least", "depth"], "did you mean embedment_depth?"),
        (["-o", "depths.csv"], "must end in .parquet"),
        (["--plot", "chart.bmp"], "must end in"),
        (["--json", "--units", "us"], "--json is in SI units for this command"),
    ],
)
def test_mistakes_are_said_before_anything_is_computed(sweep, words, message):
    code, out, err = sweep("need", CONFIG, *words)
    assert (code, out) == (2, "")
    assert message in err
