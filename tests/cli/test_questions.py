"""Questions on the command line: ``need``, ``uncertainty``, ``capacity``, uncertain inputs, and what is asked next."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest

CONFIG = Path(__file__).parents[2] / "configs" / "site.yaml"


BARE = ("--margin", "0", "--any")
"""Asks for the bare least depth."""
SHALLOW = ("--set", "site.embedment_depth=1.9 m")
"""A depth in place of the one that is to be found."""


def table_of(out):
    """Return the printed lines from the head of the table on."""
    return out.splitlines()[out.splitlines().index("") + 1 :]


@pytest.mark.parametrize("shown", [(), ("--table",), ("--notes",), ("--table", "--notes", "--units", "us")])
@pytest.mark.parametrize(
    "words", [[], ["--least", "height"], ["--most", "speed"], ["--margin", "10 %", "--any"], ["--margin", "90%"]]
)
def test_lines_fit_the_terminal(sweep, words, shown):
    code, out, err = sweep("need", CONFIG, *words, *shown)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines() if not line.startswith("  sweep need "))
    assert "simulations" in err


def test_the_answer_is_at_most_a_screen_and_the_boulder_stands_first(sweep):
    _, out, _ = sweep("need", CONFIG, "-q")
    assert out.startswith("Bury the 3.4 m boulder (24.5 t) 2.433 m deep: it passes in both soils with 34 %")
    assert out.endswith(f"More:\n  sweep need {CONFIG} --table\n  sweep need {CONFIG} --notes\n")
    assert len(out.splitlines()) <= 24
    assert sum(line.startswith("→") for line in out.splitlines()) == 1


def test_notes_say_what_words_mean_and_only_notes_do(sweep):
    plain, noted = (sweep("need", CONFIG, "-q", *BARE, *words)[1] for words in ((), ("--notes",)))
    said = (
        "blocked: does not pass by what was asked, up to where the truck would pass or\n"
        "  ride over the boulder (3 rows)\n",
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
    asked = ((), ("--margin", "25 %", "--robust"), ("--any",), ("--margin", "0"))
    default, said, any_, bare = (sweep("need", CONFIG, "-q", *words)[1].partition("\nMore:")[0] for words in asked)
    assert default == said
    assert default not in (any_, bare)


@pytest.mark.parametrize("command", ["need", "uncertainty"])
def test_a_bare_number_above_one_is_per_cent_and_that_is_said(sweep, command):
    file = CONFIG if command == "need" else CONFIG.with_name("uncertain_site.yaml")
    one, other = (sweep(command, file, "--margin", margin) for margin in ("25", "25 %"))
    assert one[0] == other[0]
    assert one[1].replace("--margin 25", "--margin '25 %'") == other[1]
    assert "note: --margin 25 is read as 25 %\n" in one[2]
    assert "is read as" not in other[2]


def test_json_and_parquet_agree(sweep, tmp_path):
    code, out, err = sweep("need", CONFIG, "--json", "-o", tmp_path / "depths.parquet", "--plot", tmp_path / "d.png")
    assert err.endswith(f"written  {tmp_path / 'depths.parquet'}\nwritten  {tmp_path / 'd.png'}\n")
    found = json.loads(out)
    frame = pd.read_parquet(tmp_path / "depths.parquet")
    assert code == 0
    assert found["asked"] == "least_embedment_depth_m"
    assert found["unit"] == "m"
    assert len(found["rows"]) == len(frame) == 12
    assert [row["found"] for row in found["rows"]] == frame.found.tolist()
    assert sum(found["found"].values()) == 12
    assert (tmp_path / "d.png").exists()


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


UNCERTAIN = Path(__file__).parents[2] / "configs" / "uncertain_site.yaml"


def test_json_and_files(sweep, tmp_path):
    words = (
        "uncertainty",
        UNCERTAIN,
        "--json",
        "-o",
        tmp_path / "c.parquet",
        "--plot",
        tmp_path / "c.png",
        "-q",
    )
    code, out, _ = sweep(*words)
    assert code == 0
    assert 0.0 < json.loads(out)["rows"][0]["p_pass"] < 1.0
    assert {file.name for file in tmp_path.iterdir()} >= {"c.parquet", "c.samples.parquet", "c.png"}


def test_need_with_a_probability(sweep):
    code, out, _ = sweep("need", UNCERTAIN, "--probability", "0.9", "-q")
    assert code == 0
    words = (
        "Bury the boulder 1.65 m long, 1.68 m wide and 3.2 m high (23.1 t) 2.254 m deep: it passes with a probability"
    )
    assert " ".join(out.split()).startswith(f"{words} of 90.")
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
    assert re.search(r"^ *undecided( +0\.0000 +0\.0000 +1\.0000){2} +1\.0000 ", out, re.MULTILINE)
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


def test_lines_json_and_parquet(sweep, tmp_path):
    code, out, _ = sweep("capacity", CONFIG, *SHALLOW)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "simulated" in out
    code, out, err = sweep("capacity", CONFIG, *SHALLOW, "--json", "-o", tmp_path / "w.parquet")
    assert err.endswith(f"written  {tmp_path / 'w.parquet'}\n")
    rows = json.loads(out)["rows"]
    frame = pd.read_parquet(tmp_path / "w.parquet")
    assert code == 0
    speeds = frame.withstands_speed_m_s.astype(object).where(frame.withstands_speed_m_s.notna(), None)
    assert [row["withstands_speed_m_s"] for row in rows] == speeds.tolist()
    assert frame.attrs["units"]["withstands_speed_m_s"] == frame.attrs["units"]["speed_fails_at"] == "m/s"
    assert {"found", "blocked_by_overlap"} == {row["speed_found"] for row in rows}


def test_rows_that_cannot_be_computed_give_exit_code_3_for_capacity(sweep, grid):
    code, out, _ = sweep("capacity", grid, "--json")
    assert code == 3
    assert [row["verdict"] for row in json.loads(out)["rows"]].count("error") == 6


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


CONFIGS = Path(__file__).parents[2] / "configs"
LOW = ("--set", "boulder.height=[2.6 m, 3 m]")
ASKED = {
    "less margin, and another boulder": ("site", *LOW),
    "all that was asked is kept": ("site", *LOW, "--units", "us", "--prefer", "depth", "--set", "vehicle.speed=31 mph"),
    "another margin": ("site", *LOW, "--margin", "35%"),
    "without a grade": ("site", *LOW, "--margin", "40%", "--any"),
    "nothing passes at any margin": ("abg",),
    "at the unfavourable ends": ("uncertain_site", "--at", "p10"),
    "a depth between": ("site", *LOW, "--between", "1.5 m", "1.8 m"),
    "the height, at the depth of the file": ("site", "--least", "height", "--units", "us", *SHALLOW),
    "depths in a narrow range": ("site", *LOW, "--set", "site.embedment_ratio=[0.4, 0.5]"),
}
KEPT = ("--units", "--prefer", "--at", "--probability")


def suggested(out: str) -> list[list[str]]:
    """Return the commands by which an answer leads on, each of which has a line of its own after words."""
    lines = out.splitlines()
    return [shlex.split(line) for before, line in pairwise(lines) if before.startswith("next, ")]


def more(out: str) -> list[list[str]]:
    """Return the commands that print more of an answer, at its end."""
    return [shlex.split(line) for line in out.partition("\nMore:\n")[2].splitlines()]


@pytest.mark.parametrize("words", ASKED.values(), ids=ASKED)
def test_every_command_is_run_and_leads_on(sweep, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / f"{words[0]}.yaml", "my site.yaml")
    code, out, _ = sweep("need", "my site.yaml", "-q", *words[1:])
    commands = suggested(out)
    assert code == 0
    assert commands
    assert out.count("sweep ") == len(commands) + len(more(out)), "nothing else looks like a command"
    for program, *command in commands:
        assert program == "sweep"
        options = [word for word in command if word.startswith("--") and word != "--set"]
        assert len(options) == len(set(options))
        assert not {"--robust", "--any"} <= set(options)
        assert sorted(command) != sorted(["need", "my site.yaml", *words[1:]])
        if any("count: " in word for word in command):  # of more boulders the depth is asked
            assert {"--least", "--between"}.isdisjoint(command)
        for option, value in pairwise(words):
            if option in KEPT:
                assert command[command.index(option) + 1] == value
            if option == "--set" and not value.startswith(("boulder.", "site.")):
                assert value in command
        code, answer, err = sweep(*command, "-q")
        assert (code, err) == (0, "")
        assert re.search(r"\b[Bb]ury\s+the\s", answer)


@pytest.mark.parametrize(
    ("depths", "more"),
    [
        ("embedment_ratio=[0.4, 0.5]", True),
        ("embedment_ratio=[0.2, 0.5]", True),
        ("embedment_depth=[1.5 m, 1.6 m]", True),
        ("embedment_ratio=[0.3, 0.8]", False),
        ("embedment_ratio=0.5", False),
    ],
)
def test_a_narrow_range_of_depths_is_widened(sweep, depths, more):
    _, out, _ = sweep("need", CONFIGS / "site.yaml", "-q", *LOW, "--set", f"site.{depths}")
    (command,) = (one for one in suggested(out) if any("count: " in word for word in one))
    assert ("site.embedment_ratio=[0.35, 0.75]" in command) == more


def test_a_table_that_would_show_the_same_is_not_suggested(sweep):
    _, out, _ = sweep("need", CONFIGS / "rwg.yaml", "-q")
    assert more(out) == [["sweep", "need", str(CONFIGS / "rwg.yaml"), "--notes"]]


@pytest.mark.parametrize(
    ("words", "said"), [((), True), (("--most", "speed"), False), (("--least", "embedment_ratio"), True)]
)
def test_a_depth_that_is_given_in_vain_is_said_and_not_called_unusual(sweep, words, said):
    _, _, err = sweep("need", CONFIGS / "rwg.yaml", "--set", "site.embedment_depth=0.3 m", *words)
    assert ("site.embedment_depth: not used: the depth is searched" in err) == said
    assert ("computed as given" in err) != said


def test_a_probability_is_kept(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "uncertain_site.yaml", "site.yaml")
    asked = ("--probability", "90 %", "--set", "boulder.height=2.6 m")
    (command,) = suggested(sweep("need", "site.yaml", "-q", *asked)[1])
    code, out, _ = sweep(*command[1:], "-q")
    assert code == 0
    assert out.startswith("Bury ")
    assert "with a probability of 90." in out


def test_where_something_qualifies_nothing_is_asked_next(sweep):
    _, out, _ = sweep("need", CONFIGS / "site.yaml", "-q")
    assert suggested(out) == []
    assert out.count("sweep ") == len(more(out)) == 2
    for option, command in zip(("--table", "--notes"), more(out), strict=True):
        assert command == ["sweep", "need", str(CONFIGS / "site.yaml"), option]


def test_more_of_an_answer_repeats_all_that_was_asked(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "site.yaml", "my site.yaml")
    asked = ("--units", "us", "--margin", "10%", "--any", "--prefer", "depth", "--set", "vehicle.speed=31 mph")
    first = sweep("need", "my site.yaml", "-q", *asked)[1]
    commands = more(first)
    assert len(commands) == 2
    for program, *command in commands:
        code, out, err = sweep(*command, "-q")
        assert (program, code, err) == ("sweep", 0, "")
        assert out.splitlines()[:2] == first.splitlines()[:2]
        (last,) = more(out)
        assert sorted(last[-2:]) == ["--notes", "--table"]
        assert more(sweep(*last[1:], "-q")[1]) == []


YARD = """stone,boulder_length_cm,boulder_width_cm,boulder_height_cm,boulder_mass_t
deep,150,150,300,13.2
flat,160,160,120,5.2
good,170,180,280,19.8
"""


@pytest.fixture
def yard(tmp_path):
    """Write a list of taped stones, and return its settings."""
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
    return tmp_path / "yard.yaml"


def test_a_yard_of_taped_stones_is_sorted_by_depth_and_says_which_serve(sweep, yard):
    _, out, _ = sweep("need", yard, "-q", "--margin", "0", "--any")
    assert "2 of the 3 boulders serve at this site: good, deep" in out
    _, out, _ = sweep("need", yard, "-q", "--margin", "0", "--any", "--set", "vehicle.speed=28 mph")
    assert "1 of the 3 boulders serves at this site: good" in out
    assert "the boulder good, 1.7 m long, 1.8 m wide and 2.8 m high (19.8 t)" in " ".join(out.split())
    places = [out.index(f"{name} ", out.index("stone  design")) for name in ("good", "deep", "flat")]
    assert places == sorted(places)


def test_a_stone_too_heavy_for_its_sizes_is_an_error_and_the_others_are_answered(sweep, yard):
    with (yard.parent / "yard.csv").open("a", encoding="utf-8") as file:
        file.write("slip,170,180,280,198\n")
    _, _, err = sweep("check", yard)
    assert f"{yard.parent}/yard.csv:5: boulder.mass: row 4 fills 872% of the box of its sizes by its mass" in err
    code, out, err = sweep("need", yard, "--margin", "0", "--any", "--table")
    lines = [line.split() for line in out.splitlines()]
    assert code == 3
    assert ["slip", "3", "error", "198.0", "-"] in lines
    assert [line[1] for line in lines if line and line[0] == "→"] == ["deep"]
    assert "error: slip: boulder is heavier than a solid box of its size and rock" in out
    assert "At no depth: flat." in out
    assert "blocked_by_overlap 1, error 1" in err
