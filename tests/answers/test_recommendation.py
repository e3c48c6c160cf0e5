"""The design that `need` recommends: what it claims is judged again, and nothing better is overlooked."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.answers.advice import advice, depth_text
from boulder_sweep.answers.need import Need, need
from boulder_sweep.answers.printing import need_screen
from boulder_sweep.answers.recommendation import PREFERENCES, Design, _Boulders
from boulder_sweep.answers.trials import Open, block_at, judges_of
from boulder_sweep.columns import GRADES
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.judge.validity import BY_FLAG
from boulder_sweep.settings import Sweep, load, load_text
from boulder_sweep.text import NO_BREAK_SPACE
from tests.answers.designs import DEPTH, UNCERTAIN_FRICTION, bare_need, site

CONFIGS = Path(__file__).parents[2] / "configs"
SIX = {"height": "{from: 2.6 m, to: 3.6 m, step: 0.2 m}"}
TRUCKS = """
name: trucks
boulder: {length: 1.65 m, width: 1.68 m, height: [3 m, 3.4 m], density: 2600 kg/m^3}
site: {embedment_depth: 2 m}
soil: {density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
vehicle:
  - {name: fast, mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.4 m}
  - {name: high, mass: 9000 lb, speed: 20 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.93 m}
"""


def design_of(found: Need) -> Design:
    """Return the design that is recommended."""
    assert found.recommendation is not None
    assert found.recommendation.design is not None
    return found.recommendation.design


def said(found: Need, units: str = "si") -> str:
    """Return the recommendation in words, with plain spaces."""
    return " ".join(advice(found, units)).replace(NO_BREAK_SPACE, " ")


def holds(found: Need, sizes: dict[str, float]) -> np.ndarray:
    """Judge a boulder at one depth in every soil and before every vehicle of a grid, as the question asks."""
    sweep = found.sweep
    axes = tuple(axis for axis in sweep.axes if not axis.name.startswith(("boulder_", "embedment_")))
    constants = {name: value for name, value in sweep.constants.items() if name != "embedment_ratio"}
    fixed = {name: value for name, value in sizes.items() if name != "boulder_mass_kg"}
    one = replace(sweep, axes=axes, constants=constants | fixed, cases=())
    judges = judges_of(one, found.least_margin, robust=found.robust)
    block = one.block(0, one.n_designs)
    return judges.holds(judges.final(block), block)


def changed(sweep: Sweep, **inputs: float) -> Sweep:
    """Return a sweep with other single values, and without axes of these inputs."""
    axes = tuple(axis for axis in sweep.axes if axis.name not in inputs)
    return replace(sweep, axes=axes, constants=sweep.constants | inputs)


def test_it_is_the_lightest_that_holds_in_every_soil_at_one_depth() -> None:
    found = need(site(**SIX))
    design, frame = design_of(found), found.frame
    assert holds(found, design.sizes).tolist() == [True, True]
    assert not holds(found, design.sizes | {DEPTH: design.sizes[DEPTH] - 0.001}).all(), "no depth to spare"
    robust = frame[frame.robustness == "robust"].groupby("boulder_height_m").least_embedment_depth_m
    common = robust.max()[robust.count() == 2]
    assert design.sizes["boulder_height_m"] == common.index.min()
    assert design.sizes[DEPTH] == common.iloc[0]
    assert [row["friction_angle_deg"] for row in design.rows] == [36.0, 40.0]
    assert (design.grade, design.margin >= 0.25) == ("robust", True)
    assert design.excavated_m3 == max(row["excavated_m3"] for row in design.rows)
    assert "to spare, and with 25 % under the weakest of three soil models." in said(found)
    assert "3 boulders qualify; this is the lightest of the 2 that are robust." in said(found)


def test_a_depth_that_one_row_needs_and_another_fails_at_is_not_recommended() -> None:
    """Both trucks are stopped by each boulder; but so deep as the fast one asks for, the high one rides over it."""
    found = need(load_text(TRUCKS, Path("trucks.yaml")))
    assert found.frame.least_embedment_depth_m.notna().all()
    assert found.recommendation is not None
    assert (found.recommendation.qualified, found.recommendation.design) == (2, None)
    for _, rows in found.frame.groupby("boulder_height_m"):
        sizes = rows.iloc[0][["boulder_length_m", "boulder_width_m", "boulder_height_m"]].to_dict()
        assert not holds(found, sizes | {DEPTH: rows.least_embedment_depth_m.max()}).all()
    alone = need(load_text(TRUCKS.replace("bumper_height: 0.93", "bumper_height: 0.5"), Path("trucks.yaml")))
    rows = alone.frame[alone.frame.boulder_height_m == design_of(alone).sizes["boulder_height_m"]]
    assert design_of(alone).sizes[DEPTH] == rows.least_embedment_depth_m.max()
    assert "it passes before both vehicles" in said(alone)


@pytest.mark.parametrize("prefer", PREFERENCES)
def test_what_is_preferred_is_least_among_those_that_hold(prefer: str) -> None:
    found = need(CONFIGS / "embassy_street.yaml", prefer=prefer)
    rows = found.frame[found.frame.passes_at.notna() & (found.frame.robustness == "robust")]
    column = PREFERENCES[prefer]
    least = rows.assign(embedment_depth_m=rows.least_embedment_depth_m)[column].min()
    assert design_of(found).to_dict()[column] == pytest.approx(least, rel=1e-12)
    assert found.recommendation is not None
    for other, design in found.recommendation.others.items():
        assert design.to_dict()[PREFERENCES[other]] < design_of(found).to_dict()[PREFERENCES[other]]
        assert design.grade == "robust"
    assert set(found.recommendation.others) == ({"mass"} if prefer != "mass" else {"depth", "excavation"})


def test_a_robust_boulder_goes_before_a_lighter_one_that_is_sensitive() -> None:
    found = need(CONFIGS / "embassy_street.yaml", robust=False)
    grades = found.frame.robustness[found.frame.passes_at.notna()].tolist()
    assert grades.count("robust") == 1
    assert grades.count("sensitive") == 12
    design = design_of(found)
    assert design.grade == "robust"
    assert design.sizes["boulder_mass_kg"] == found.frame.boulder_mass_kg.max()
    assert "13 boulders qualify; this is the only one that is robust." in said(found)


def test_a_boulder_whose_grade_turns_out_worse_waits_for_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if all had been robust at their answers."""
    file, figures = CONFIGS / "embassy_street.yaml", _Boulders._figures
    expected = design_of(need(file, robust=False)).sizes
    monkeypatch.setattr(_Boulders, "_figures", lambda self: (figures(self)[0], np.zeros_like(figures(self)[1])))
    assert design_of(need(file, robust=False)).sizes == expected


def test_a_sensitive_boulder_is_recommended_as_such_only() -> None:
    found = bare_need(site(**SIX))
    assert design_of(found).grade == "sensitive"
    assert "with 0 % to spare, but a second opinion overturns it (sensitive)." in said(found)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"vehicle.mass": "1500 kg", "vehicle.speed": "45 mph"}, "a vehicle unlike the one that was tested"),
        ({"soil.friction_angle": "25 deg", "vehicle.speed": "20 mph"}, "a soil outside the realistic range"),
    ],
    ids=["car", "loose"],
)
def test_what_no_study_covers_is_said_after_the_design_that_stands_under_the_second_opinion(
    changes: dict, why: str
) -> None:
    found = need(load(CONFIGS / "site.yaml", [f"{key}={value}" for key, value in changes.items()]))
    assert design_of(found).grade == "open"
    words = said(found)
    assert words.startswith("Bury the ")
    assert why in words.partition(" Its grade is open: no study of second opinions covers ")[2]
    flags = words.partition("No crash test covers it: ")[2]
    assert why in flags
    assert all(BY_FLAG[name].meaning in flags for name in design_of(found).flags)
    assert "to spare, and with 25 % under the weakest of three soil models" in words
    assert all("width_capped" in row["stands_under"] for row in design_of(found).rows)


@pytest.mark.parametrize(
    ("grade", "under", "stands"),
    [
        ("robust", None, True),
        ("open", "paper;width_capped", True),
        ("open", None, False),
        ("sensitive", "width_capped", False),
        (None, None, False),
    ],
)
def test_a_design_stands_where_every_row_is_robust_or_nearly_so(
    grade: str | None, under: str | None, stands: bool
) -> None:
    robust, row = ({"robustness": name, "stands_under": laws} for name, laws in (("robust", None), (grade, under)))
    assert Design([robust, row]).stands is stands


@pytest.mark.parametrize(
    ("depth", "shown"), [(2.433, "2.433"), (2.6409999999999996, "2.641"), (8.66470, "8.665"), (8.66410, "8.665")]
)
def test_a_depth_is_shown_no_less_than_what_passes(depth: float, shown: str) -> None:
    assert depth_text(depth) == shown


def test_what_second_opinions_do_not_know_is_asked_by_the_margin_alone() -> None:
    printed = load(CONFIGS / "quarry_stone.yaml", ["model.readings={preset: corrected, inertia: printed}"])
    found = need(printed)
    assert (found.robust, found.least_margin, design_of(found).grade) == (False, 0.25, "open")
    assert said(found).startswith("Not graded: second opinions know rock of given density and corrected")
    sides = r"[\d.]+ m long, [\d.]+ m wide and [\d.]+ m high"
    assert re.search(rf"By the margin alone, bury the boulder {sides} \(23\.0 t\) ", said(found))
    with pytest.raises(QuestionError, match="second opinions know rock"):
        need(printed, robust=True)


def test_where_none_qualifies_the_nearest_has_what_is_said_of_it() -> None:
    sweep = site(height="[2.6, 3.14] m")
    found = need(sweep)
    assert found.recommendation is not None
    assert found.recommendation.design is None
    nearest = found.recommendation.nearest
    assert nearest is not None
    assert (nearest.margin, nearest.robust) == (0.15, True)
    again = need(sweep, margin=nearest.margin)
    assert nearest.design is not None
    assert design_of(again).sizes == nearest.design.sizes
    words = said(found)
    models = "under the weakest of three soil models"
    assert words.startswith(f"No boulder of the file passes with 25 % to spare {models} in both soils.")
    assert f"Nearest: the 3.14 m boulder (22.6 t) 2.360 m deep, with 15 % to spare {models}." in words
    assert "or less; or soil.friction_angle" in words
    assert words.endswith(" or boulder.height 3.216 m or more.")


def test_what_passes_in_one_model_alone_is_the_nearest_where_nothing_need_be_spared() -> None:
    words = said(need(site(height="2.95 m"), margin=0.0))
    assert re.search(r"Nearest: the boulder .* deep, with nothing to spare, but not under every soil model\.", words)


def test_no_change_of_an_uncertain_input_is_named() -> None:
    found = need(site(height="[2.6, 3] m", friction="{mean: 38 deg, sd: 3 deg}"))
    assert found.recommendation is not None
    assert found.recommendation.nearest is not None
    assert set(found.recommendation.nearest.changes) == {"impact_speed_m_s", "boulder_height_m"}


def test_each_change_that_is_named_would_do_and_less_would_not() -> None:
    sweep = changed(site(height="[2.6, 3] m"), boulder_height_m=3.0)
    found = need(sweep)
    assert found.recommendation is not None
    nearest = found.recommendation.nearest
    assert nearest is not None
    assert set(nearest.changes) == {"impact_speed_m_s", "friction_angle_deg", "boulder_height_m"}
    for name, step in (("impact_speed_m_s", -0.01), ("friction_angle_deg", 0.01), ("boulder_height_m", 0.001)):
        design = nearest.changes[name]
        values = [row[name] for row in design.rows]
        value = min(values) if step < 0.0 else max(values)
        inputs: dict[str, Any] = {name: value, DEPTH: design.sizes[DEPTH]}
        own = {DEPTH: inputs[DEPTH], "boulder_length_m": 1.65, "boulder_width_m": 1.68}
        own["boulder_height_m"] = design.sizes["boulder_height_m"]
        assert holds(replace(found, sweep=changed(sweep, **{name: value})), own).all()
        if name != "boulder_height_m":  # its depth goes with it
            assert not holds(replace(found, sweep=changed(sweep, **{name: value - step})), own).all()


@pytest.mark.parametrize("units", ["si", "us"])
def test_a_change_that_is_named_would_do_as_it_is_printed(units: str) -> None:
    given = ["boulder.height=2.8 m", "soil.friction_angle=36 deg"]
    words = said(need(load(CONFIGS / "site.yaml", given)), units)
    named = re.findall(r"([a-z_.]+) ([\d.]+) ?(°|[a-z/]+) or (?:less|more)", words)
    assert [path for path, *_ in named] == ["vehicle.speed", "soil.friction_angle", "boulder.height"]
    for path, value, unit in named:
        found = need(load(CONFIGS / "site.yaml", [*given, f"{path}={value} {unit.replace('°', 'deg')}"]))
        assert found.recommendation is not None
        assert found.recommendation.design is not None, (path, value, unit)


def test_a_boulder_that_passes_at_no_depth_names_the_speed_that_it_holds() -> None:
    found = need(CONFIGS / "abg.yaml")
    assert "passes at no depth; 1.442 m deep: overturns. It would qualify with vehicle.speed 3.62 m/s or" in said(found)


def test_the_nearest_fails_at_a_depth_that_may_be_built_as_a_simulation_says() -> None:
    found = need(site(height="2.4 m", friction="[32, 34] deg"))
    assert found.recommendation is not None
    nearest = found.recommendation.nearest
    assert nearest is not None
    for row in nearest.rows:
        assert row["passes_at"] is None
        assert row["overlap_m"] >= found.sweep.criterion.min_overlap_m
        one = changed(site(height="2.4 m"), friction_angle_deg=row["friction_angle_deg"], **{DEPTH: row[DEPTH]})
        simulated = boulder_sweep.simulate(one)
        assert (row["verdict"], row["reason"]) == (simulated.verdict, simulated.reason)


def test_the_end_of_a_search_is_not_passed_off_as_the_least_depth() -> None:
    words = " Lesser depths were not searched."
    assert words in said(need(site(height="3.4 m"), between=("2.5 m", "2.6 m")))
    assert words not in said(need(site(height="3.4 m")))


@pytest.mark.parametrize("question", [{"most": "speed"}, {"least": "friction_angle"}, {"most": "embedment_depth"}])
def test_a_question_about_soil_or_vehicle_names_no_boulder(question: dict) -> None:
    found = need(site(height="3.4 m"), **question)
    assert found.recommendation is None
    assert advice(found) == []


def test_a_least_height_is_recommended_at_the_depth_of_the_file() -> None:
    found = bare_need(site(height="3 m", site="embedment_ratio: 0.7"), "height")
    assert design_of(found).sizes["boulder_height_m"] == found.frame.least_boulder_height_m.max()
    assert holds(found, design_of(found).sizes).all()


def test_of_a_list_each_boulder_holds_in_its_own_rows() -> None:
    found = need(CONFIGS / "crash_tests.yaml")
    assert found.recommendation is not None
    assert (found.recommendation.boulders, found.recommendation.qualified, found.recommendation.conditions) == (2, 1, 1)
    assert "No other of the 2 boulders qualifies." in said(found)


def test_uncertain_soil_is_held_at_both_ends() -> None:
    found = need(site(height="3.6 m", **UNCERTAIN_FRICTION))
    mean = need(site(height="3.6 m", friction="38 deg"))
    assert design_of(found).sizes[DEPTH] > design_of(mean).sizes[DEPTH]


def test_a_probability_takes_the_place_of_margin_and_grade() -> None:
    found = need(CONFIGS / "uncertain_site.yaml", probability=0.95)
    assert (found.least_margin, found.robust) == (0.0, False)
    design = design_of(found)
    assert design.chance == found.frame.p_pass[0]
    assert design.grade is None
    assert "it passes with a probability of 95." in said(found)
    assert " No margin and no second opinion were asked for." in said(found)


def test_the_same_probability_is_held_in_every_soil() -> None:
    text = """
name: two
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_depth: 2 m}
soil:
  - {name: weak, density: 1860 kg/m^3, friction_angle: {mean: 37 deg, sd: 1 deg}, subgrade_reaction: 60 MN/m^3}
  - {name: firm, density: 1860 kg/m^3, friction_angle: {mean: 40 deg, sd: 1 deg}, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
    found = need(load_text(text, Path("two.yaml")), probability=0.9)
    design = design_of(found)
    chances = {row["soil"]: row["p_pass"] for row in design.rows}
    assert design.sizes[DEPTH] == found.frame.least_embedment_depth_m.max()
    assert chances["weak"] == found.frame.p_pass[found.frame.soil == "weak"].iloc[0]
    assert chances["firm"] > chances["weak"]


@pytest.mark.parametrize(("at", "mass"), [("p5", "at least 24.0 t"), ("mean", "25.0 t")])
def test_a_boulder_of_uncertain_density_has_its_rock_and_its_least_mass(at: str, mass: str) -> None:
    text = TRUCKS.replace("density: 2600 kg/m^3}", "rock: granite}", 1)
    found = bare_need(at_values(load_text(text, Path("g.yaml")), at))
    assert f"ury the 3.4 m granite boulder ({mass}) " in said(found)
    for units, unit in (("si", "t"), ("us", "lb")):  # the head of the column says it, too
        heads = [head for head, _ in need_screen(found, units).columns]
        assert ("mass", f"≥ {unit}" if mass.startswith("at least") else unit) in heads


def test_a_boulder_that_nothing_else_tells_apart_is_named_by_its_size() -> None:
    assert "Bury the boulder 1.65 m long, 1.68 m wide and 3.4 m high (24.5 t) " in said(need(site(height="3.4 m")))


def test_numbers_are_read_in_the_units_asked_for() -> None:
    words = said(need(site(**SIX)), "us")
    assert words.startswith("Bury the 11.15 ft boulder (54,023 lb) 7.983 ft deep: ")
    assert " m " not in words


@pytest.mark.parametrize("height", ["3.4 m", "3.6 m"])
def test_a_design_holds_down_to_its_greatest_depth_and_no_further(height: str) -> None:
    found = need(site(height=height))
    best = found.recommendation
    assert best is not None
    assert best.design is not None
    least, most = best.design.sizes[DEPTH], best.deepest_m
    assert most is not None
    judges = judges_of(found.sweep, found.least_margin, robust=True)
    rows = Open(found.sweep, (DEPTH,)).rows(0, best.conditions)

    def holds(depth: float) -> bool:
        block = block_at(rows, np.arange(best.conditions), **{DEPTH: np.full(best.conditions, depth)})
        judged = judges.final(block)
        grades = judges.final.graded(judged, block)["robustness"]
        return bool(judges.holds(judged, block).all()) and {GRADES[grade] for grade in grades} == {best.design.grade}

    assert [holds(depth) for depth in (least - 0.001, *np.linspace(least, most, 7), most + 0.001)] == [
        False,
        *([True] * 7),
        False,
    ]


def test_a_path_is_asked_as_its_settings_are() -> None:
    file = CONFIGS / "site.yaml"
    answers = [boulder_sweep.need(one) for one in (file, str(file), load(file))]
    assert answers[0].arrow.equals(answers[1].arrow)
    assert answers[0].arrow.equals(answers[2].arrow)
    assert answers[0].least_margin == 0.25
    assert answers[0].robust


def test_a_notebook_shows_the_recommendation() -> None:
    found = need(site(**SIX))
    html = found._repr_html_()
    assert "<p>Bury the 3.4" in html
    assert "<pre>" in html
    assert "→" in html


def test_plain_data_has_the_recommendation() -> None:
    for found in (need(site(**SIX)), need(site(height="2.6 m")), need(site(), most="speed")):
        plain = json.loads(json.dumps(found.to_dict()))
        assert plain["robust"] is True
        best = found.recommendation
        assert (plain["recommendation"] is None) == (best is None)
        if best is not None and best.design is not None:
            assert plain["recommendation"]["design"]["embedment_depth_m"] == best.design.sizes[DEPTH]


def test_what_cannot_be_preferred_is_refused_and_nothing_need_be() -> None:
    assert need(site(), prefer=None).recommendation is None
    with pytest.raises(QuestionError, match="--prefer height: must be mass, depth, excavation"):
        need(site(), prefer="height")


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ("p5", "it passes at the 5 % ends of its uncertain inputs with"),
        ("mean", "it passes at the means of its uncertain inputs with"),
    ],
)
def test_an_answer_says_at_which_values_uncertain_inputs_are_taken(at: str, words: str) -> None:
    sweep = at_values(load(CONFIGS / "uncertain_site.yaml", ["boulder.height=3.6 m", "boulder.width=3 m"]), at)
    assert words in said(bare_need(sweep))


def test_boulders_of_a_yard_that_will_not_do_are_named_with_what_was_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = (
        "kind,stone,boulder_length_m,boulder_width_m,boulder_height_m,boulder_mass_t",
        "limestone,S3,1.5,2,3,16.55",
        "limestone,S4,1.8,2.1,3.3,23.8",
        "limestone,S8,1.6,2.3,3.4,29.84",
    )
    Path("yard.csv").write_text("\n".join(lines))
    soil = "soil: {density: 1900, friction_angle: 38, subgrade_reaction: 70}\n"
    vehicle = "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3e3, damper: 138.91e3}\n"
    boulder = "table: yard.csv\nboulder: {rock: granite}\nsite: {embedment_depth: to be found}\n"
    Path("yard.yaml").write_text(boulder + soil + vehicle)
    found = need("yard.yaml")
    assert "At no depth with 25 % to spare under the weakest of three soil models: limestone S3." in said(found)
    assert "Bury the boulder limestone S8, 1.6 m long, 2.3 m wide and 3.4 m high (" in said(found)
