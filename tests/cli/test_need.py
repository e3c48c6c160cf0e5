"""``sweep need``: a table for a terminal, one JSON object, files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd
import pytest

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"


BARE = ("--margin", "0", "--any")
"""Asks for the bare least depth."""


def table_of(out):
    """Return the printed lines from the head of the table on."""
    return out.splitlines()[out.splitlines().index("") + 1 :]


@pytest.mark.parametrize("shown", [(), ("--table",), ("--notes",), ("--table", "--notes", "--units", "us")])
@pytest.mark.parametrize(
    "words", [[], ["--least", "mass"], ["--most", "speed"], ["--margin", "10 %", "--any"], ["--margin", "90%"]]
)
def test_lines_fit_the_terminal(sweep, words, shown):
    code, out, err = sweep("need", CONFIG, *words, *shown)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines() if not line.startswith("  sweep need "))
    assert "simulations" in err


def test_the_answer_is_at_most_a_screen_and_the_boulder_stands_first(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    assert out.startswith("Bury the 3.4 m boulder (24.5 t) 2.433 m deep: it passes in both soils with 34 %")
    assert out.endswith("More: --table, --notes\n")
    assert len(out.splitlines()) <= 24
    assert sum(line.startswith("→") for line in out.splitlines()) == 1


def test_columns_of_the_table(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    assert table_of(out)[0].split() == ["H", "mass", "all", "φ′", "36", "φ′", "40"]
    _, out, _ = sweep("need", CONFIG, "-q", "--table")
    head = ["H", "φ′", "depth", "ratio", "above", "mass", "margin", "second", "dig", "fill"]
    assert table_of(out)[0].split() == head
    assert len(table_of(out)) >= 3 + 12


def test_notes_say_what_words_mean_and_only_notes_do(sweep):
    plain, noted = (sweep("need", CONFIG, "-q", *BARE, *words)[1] for words in ((), ("--notes",)))
    said = (
        "up to where the truck would pass or ride over the boulder\n  (3 rows)\n",
        "an answer is a simulation, not a rating by test\n",
        "flags: 0 of 9 answers inside what the model was tested on; rotation 9,",
        "sensitive: a second opinion overturns it",
        "foot: flat",
    )
    for words in said:
        assert words in noted
        assert words not in plain
    assert noted.index("sensitive: a second opinion overturns it") < noted.index("flags: ")
    assert "dig, fill: soil to excavate" in sweep("need", CONFIG, "-q", "--table", "--notes")[1]
    _, out, _ = sweep("need", CONFIG, "-q", *BARE, "--notes", "--between", "1.0 m", "1.2 m")
    assert "never: passes nowhere in the searched range (12 rows)\n" in out
    assert "blocked" not in out
    assert "flags" not in out


def test_defaults_are_a_quarter_to_spare_and_every_second_opinion(sweep):
    default, said = (sweep("need", CONFIG, "-q", *words)[1] for words in ((), ("--margin", "25 %", "--robust")))
    assert default == said
    assert default != sweep("need", CONFIG, "-q", "--any")[1]
    assert default != sweep("need", CONFIG, "-q", "--margin", "0")[1]


@pytest.mark.parametrize("command", ["need", "uncertainty"])
def test_a_bare_number_above_one_is_per_cent_and_that_is_said(sweep, command):
    file = CONFIG if command == "need" else CONFIG.with_name("uncertain_site.yaml")
    one, other = (sweep(command, file, "--margin", margin) for margin in ("25", "25 %"))
    assert one[:2] == other[:2]
    assert "note: --margin 25 is read as 25 %\n" in one[2]
    assert "is read as" not in other[2]


def test_the_lightest_boulder_says_at_which_ends_it_lies(sweep):
    one = (*BARE, "--set", "soil.friction_angle=40 deg")
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
    one = ("--set", "boulder.height=3 m", "--set", "soil.friction_angle=40 deg")
    out = sweep("need", CONFIG, "--json", *BARE, *one)[1]
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
    assert [line.replace("→", "").split()[0] for line in table_of(out)[3:5]] == ["north", "south"]
    Path("t.csv").write_text("site_name,embedment_depth_m\nnorth,1.9\nsouth,2.0\n")
    text = re.sub(r"site:\n  embedment_depth: .*\n", "", text)
    Path("listed.yaml").write_text(
        text.replace("{from: 2.6 m, to: 3.6 m, step: 0.2 m}", "3.4 m").replace("[36, 40]", "40")
    )
    code, out, err = sweep("need", "listed.yaml", "-q")
    assert (code, err) == (0, "")
    assert sum(line.lstrip()[0].isdigit() for line in table_of(out)) == 1


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
        (["--margin", "1"], "--margin 1: must be 0 or more and less than 100 %"),
        (["--probability", "120%"], "must be more than 0 and less than 100 %"),
        (["--prefer", "height"], "'height' is not one of 'mass', 'depth', 'excavation'"),
    ],
)
def test_mistakes_are_said_before_anything_is_computed_and_before_any_note(sweep, words, message):
    noted = ("--set", "site.embedment_ratio=[0.3, 0.7]")
    assert "note: " in sweep("need", CONFIG, *noted)[2]
    code, out, err = sweep("need", CONFIG, *noted, *words)
    assert (code, out) == (2, "")
    assert message in err
    assert "note: " not in err


YARD = """stone,boulder_length_cm,boulder_width_cm,boulder_height_cm,boulder_mass_t
deep,150,150,300,13.2
flat,160,160,120,5.2
good,170,180,280,19.8
"""


def test_a_yard_of_taped_stones_is_sorted_by_depth_and_says_which_serve(sweep, tmp_path):
    (tmp_path / "yard.csv").write_text(YARD, encoding="utf-8")
    (tmp_path / "yard.yaml").write_text(
        """table: yard.csv
boulder: {density: 2650 kg/m^3}
site: {embedment_depth: 1 m}
soil: {density: 1860 kg/m^3, friction_angle: 38 deg, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 20 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
""",
        encoding="utf-8",
    )
    _, out, _ = sweep("need", tmp_path / "yard.yaml", "-q", "--margin", "0")
    assert "2 of the 3 stones serve at this site: good, deep" in out
    places = [out.index(f"{name} ", out.index("stone  design")) for name in ("good", "deep", "flat")]
    assert places == sorted(places)
