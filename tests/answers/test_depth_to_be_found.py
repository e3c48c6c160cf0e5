"""A file whose depth is to be found: questions about another input take the depth that suits it best."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.answers.trials import depth_within
from boulder_sweep.errors import QuestionError, ReportError
from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.soil_readings import BELOW_FOOT
from tests.answers.designs import bare_need, site

CONFIGS = Path(__file__).parents[2] / "configs"
SOUGHT = "embedment_depth: to be found"
ONE = {"height": "3.4 m", "friction": "40 deg"}
SLIDES = {"length": "3 m", "width": "0.8 m", "height": "1.6 m", "friction": "40 deg"}
QUESTIONS = {
    "speed": {"most": "speed"},
    "height": {"least": "boulder.height"},
    "width": {"least": "boulder.width"},
    "angle": {"least": "friction_angle"},
}


@pytest.mark.parametrize(
    ("given", "asked"),
    [*((ONE, asked) for asked in QUESTIONS.values()), (SLIDES, QUESTIONS["speed"])],
    ids=[*QUESTIONS, "best where it slides"],
)
def test_no_other_depth_of_the_usual_range_gives_a_better_answer(given, asked):
    """Asked at each of many depths, nothing passes with more speed, a smaller boulder or a weaker soil."""
    found = bare_need(site(**given, site=SOUGHT), **asked).arrow.to_pylist()[0]
    name = next(column for column in found if column.startswith(("least_", "most_")))
    assert found["verdict"] == "pass"
    assert 0.35 <= found["embedment_depth_m"] / found["boulder_height_m"] <= 0.7501
    sign = 1.0 if name.startswith("most_") else -1.0
    best = -np.inf
    for ratio in np.linspace(0.35, 0.75, 41):
        own = bare_need(site(**given, site=f"embedment_ratio: {ratio}"), **asked).arrow.to_pylist()[0]
        if own[name] is not None:
            best = max(best, sign * own[name])
    assert sign * found[name] >= best - 0.002 * abs(best)
    there = bare_need(site(**given, site=f"embedment_depth: {found['embedment_depth_m']}"), **asked).arrow
    assert there.to_pylist()[0][name] == found[name]


@pytest.mark.parametrize("least", [0.0, 0.1, 0.25, 0.3])
def test_the_deepest_that_is_tried_overlaps_enough_by_the_sums_of_the_verdict(least):
    height = np.arange(1600, 4001) / 1000
    depth = depth_within(0.1, 4.0, np.ones(len(height)), height, np.full(len(height), 0.5), least)
    overlap = height - depth - 0.5
    assert (overlap >= least).all()
    assert (overlap > 0.0).all()
    assert (overlap < least + 2.1e-3).all()


def test_the_depth_itself_is_asked_for_as_of_any_file():
    sought, given = (bare_need(site(**ONE, site=depth)).arrow for depth in (SOUGHT, "embedment_depth: 2 m"))
    assert sought.equals(given)


def test_where_nothing_passes_the_deepest_is_shown():
    row = bare_need(site(friction="40 deg", height="1.6 m", site=SOUGHT), least="boulder.width").arrow.to_pylist()[0]
    assert row["found"] == "never"
    assert row["embedment_depth_m"] == pytest.approx(0.85)  # the bumper is at 0.5 m, and must be overlapped by 0.25 m


def test_a_boulder_is_recommended_at_a_depth_that_all_soils_bear():
    found = boulder_sweep.need(site(friction="[36, 40] deg", height="3.4 m", site=SOUGHT), "boulder.width")
    best = found.recommendation.design
    assert len(best.rows) == 2
    assert {row["verdict"] for row in best.rows} == {"pass"}
    assert best.margin >= 0.25
    assert best.grade == "robust"


def test_a_probability_is_asked_for_at_the_best_depth_too():
    uncertain = {"height": "3.4 m", "friction": "{mean: 38 deg, sd: 2 deg}"}
    found = bare_need(site(**uncertain, site=SOUGHT), most="speed", probability=0.9).arrow.to_pylist()[0]
    assert found["p_pass"] == pytest.approx(0.9, abs=0.01)
    for depth in (2.0, 2.4):
        own = bare_need(site(**uncertain, site=f"embedment_depth: {depth}"), most="speed", probability=0.9)
        assert own.arrow.to_pylist()[0]["most_impact_speed_m_s"] <= found["most_impact_speed_m_s"] + 0.02


def test_a_file_of_answers_keeps_that_it_was_to_be_found(tmp_path):
    found = bare_need(site(**ONE, site=SOUGHT), most="speed")
    found.write(tmp_path / "a.parquet")
    again = AnswerFile(tmp_path / "a.parquet", ReportError).answers()
    assert again.seeks_depth
    assert again.sweep.resolved()["inputs"]["embedment_depth_m"] == "to be found"
    page = boulder_sweep.write_report(tmp_path / "a.parquet", tmp_path / "a.html")
    assert "to be found" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "words",
    [
        ("run",),
        ("run", "--dry-run"),
        ("simulate",),
        ("capacity",),
        ("explore",),
        ("tradeoff",),
        ("uncertainty", "--set", "vehicle.speed={mean: 30 mph, cov: 5 %}"),
    ],
    ids=" ".join,
)
def test_what_takes_a_depth_names_the_command_that_finds_it(sweep, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "site.yaml", "my site.yaml")
    code, out, err = sweep(words[0], "my site.yaml", "--set", "boulder.height=3.4 m", *words[1:])
    assert (code, out) == (2, "")
    assert "error: site.embedment_depth is to be found, and one that is given is needed here" in err
    assert [path.name for path in tmp_path.iterdir()] == ["my site.yaml"]
    program, *command = shlex.split(err.splitlines()[-1])
    assert program == "sweep"
    assert "boulder.height=3.4 m" in command
    code, out, _ = sweep(*command, "-q")
    assert code == 0
    assert "ury the boulder" in " ".join(out.split())


def test_functions_refuse_it_too(tmp_path):
    sought = load(CONFIGS / "site.yaml")
    for compute in (
        lambda: boulder_sweep.run(sought, tmp_path / "out"),
        lambda: boulder_sweep.simulate(sought),
        lambda: sought.block(0, 1),
    ):
        with pytest.raises(QuestionError, match=r"site\.embedment_depth is to be found"):
            compute()
    assert not (tmp_path / "out").exists()


def test_check_says_what_finds_it(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "site.yaml", "site.yaml")
    code, out, err = sweep("check", "site.yaml", "--set", "vehicle.speed=31 mph")
    assert (code, err) == (0, "")
    assert "embedment_depth_m             to be found\n" in out
    lines = out.splitlines()
    assert lines[-2] == "next, the depth:"
    assert sweep(*shlex.split(lines[-1])[1:], "-q")[0] == 0


@pytest.mark.parametrize("text", ["to be found", "To  be found", "'to be found'"])
def test_it_is_read(text):
    assert site(site=f"embedment_depth: {text}").depth_sought


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("embedment_ratio: to be found", "is not a number"),
        ("embedment_depth: [to be found, 2 m]", "is not a number"),
        ("embedment_depth: found", "is not a number"),
        ("embedment_depth: to be found, embedment_ratio: 0.5", "not both"),
    ],
)
def test_mistakes_about_it_are_refused(text, words):
    with pytest.raises(SettingsError, match=words):
        site(site=text)


def test_an_option_gives_or_takes_the_depth():
    assert not load(CONFIGS / "site.yaml", ["site.embedment_ratio=0.5"]).depth_sought
    assert load(CONFIGS / "rwg.yaml", ["site.embedment_depth=to be found"]).depth_sought


LOG = """boulder: {length: 1.7 m, width: 1.7 m, height: [2.4 m, 3.0 m], density: 2600 kg/m^3}
site: {embedment_depth: to be found}
soil:
  spt: [{n: 20, energy_ratio: 60 %, depth: 1 m}, {n: 22, energy_ratio: 60 %, depth: 2.4 m},
        {n: 24, energy_ratio: 60 %, depth: 2.8 m}, {n: 9, energy_ratio: 60 %, depth: 6 m}]
vehicle: {mass: 15000 lb, speed: 20 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.6 m}
"""


def test_readings_count_to_below_the_deepest_foot_that_can_stop_the_truck(tmp_path):
    """The tallest boulder reaches the bumper at 0.6 m with its foot at 2.4 m: the next reading below counts, too."""
    (tmp_path / "log.yaml").write_text(LOG)
    sweep = load(tmp_path / "log.yaml")
    (soil,) = sweep.derived["soil"]
    assert soil["foot_m"] == pytest.approx(2.4)
    assert [reading.get("left_out") for reading in soil["readings"]] == [None, None, None, BELOW_FOOT]
    assert len(bare_need(boulder_sweep.at_values(sweep, "mean"))) == 2
    assert len(bare_need(sweep, least="boulder.width", probability=0.5)) == 2
    with pytest.raises(QuestionError, match=r"readings of the soil below 2\.8 m were left out"):
        bare_need(boulder_sweep.at_values(sweep, "mean"), least="boulder.height", between=("2.4 m", "3.9 m"))


def test_a_list_of_boulders_and_a_log_are_answered(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("yard.csv").write_text("stone,boulder_length_m,boulder_width_m,boulder_height_m\na,1.7,1.7,3\nb,1.5,1.6,1.2\n")
    text = LOG.replace("length: 1.7 m, width: 1.7 m, height: [2.4 m, 3.0 m], ", "")
    Path("log.yaml").write_text(f"table: yard.csv\n{text}")
    code, out, _ = sweep("need", "log.yaml", "--json", "--margin", "0")
    rows = json.loads(out)["rows"]
    assert code == 0
    assert [row["found"] for row in rows] == ["found", "blocked_by_overlap"]
