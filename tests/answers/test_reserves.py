"""What designs withstand, judged again at the value and one beside it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.answers.printing import reserve_lines
from boulder_sweep.answers.questions import Answers, ValueSearch
from boulder_sweep.answers.reserves import CLASSES, ISO_MASS_KG, ISO_SPEEDS, RESERVES, Reserve, capacity, classes
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings import Sweep, load, load_text
from boulder_sweep.settings.sweep import DesignList
from tests.answers.designs import bare_need, random_designs, site

CONFIGS = Path(__file__).parents[2] / "configs"


def passes(frame: pd.DataFrame, **inputs: np.ndarray) -> np.ndarray:
    listed = {name: frame[name].to_numpy(dtype=float) for name in INPUT_COLUMNS if name != "impact_height_m"}
    sweep = Sweep("again", None, (), {}, DesignList("again.csv", listed | inputs))
    return evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, sweep.n_designs)).verdict == PASS


@pytest.fixture(scope="module", params=[240, pytest.param(400, marks=pytest.mark.nightly)])
def reserves_of_many(request: pytest.FixtureRequest) -> pd.DataFrame:
    """What random designs withstand."""
    return capacity(random_designs(request.param)).frame


def with_constants(sweep: Sweep, **values: float) -> Sweep:
    return dataclasses.replace(sweep, constants=sweep.constants | values)


@pytest.mark.parametrize("reserve", [RESERVES[0], pytest.param(RESERVES[1], marks=pytest.mark.nightly), RESERVES[2]])
def test_a_design_passes_at_what_it_withstands_and_not_beyond(reserves_of_many: pd.DataFrame, reserve: Reserve) -> None:
    frame, own = reserves_of_many, reserve.key.name
    there = frame[frame[reserve.column].notna()]
    assert len(there) > 50
    assert passes(there, **{own: there[reserve.column].to_numpy()}).all()
    inside = there[there[f"{reserve.word}_found"] != "always"]
    assert not passes(inside, **{own: inside[f"{reserve.word}_fails_at"].to_numpy()}).any()
    beside = (inside[f"{reserve.word}_fails_at"] - inside[reserve.column]).abs()
    assert np.allclose(beside, reserve.key.step, rtol=1e-6)


@pytest.mark.parametrize("reserve", RESERVES)
def test_the_answers_are_those_of_the_same_questions(reserve: Reserve) -> None:
    sweep = shallow_designs(24)
    found, key = capacity(sweep).frame, reserve.key
    asked = bare_need(sweep, **{"most" if key.most else "least": key.field.path}).frame
    for column, same in (
        (reserve.column, key.answer),
        (f"{reserve.word}_fails_at", "fails_at"),
        (f"{reserve.word}_found", "found"),
        (f"{reserve.word}_passes_within", "passes_within"),
    ):
        assert found[column].equals(asked[same]), column


def shallow_designs(count: int) -> Sweep:
    """Return a list of designs of 0.1 to 0.45 of their height deep, many of which slide."""
    sweep = random_designs(count, seed=3)
    assert sweep.table is not None
    columns = dict(sweep.table.columns)
    columns["embedment_depth_m"] = np.linspace(0.1, 0.45, count) * columns["boulder_height_m"]
    return dataclasses.replace(sweep, table=DesignList("shallow.csv", columns))


def test_everything_passes_up_to_what_a_shallow_boulder_withstands() -> None:
    """Also at speeds that no search has tried; of angles from the strongest soil downwards."""
    found = capacity(shallow_designs(120)).frame
    assert set(found.speed_found) == {"found"}, "beyond a speed that overturns it nothing passes"
    assert (found.soil_found == "not_monotone").sum() >= 1
    rng = np.random.default_rng(0)
    for reserve, safe in ((RESERVES[0], 0.0), (RESERVES[2], 49.0)):
        there = found[found[reserve.column].notna()]
        again = there.loc[there.index.repeat(20)]
        share = rng.random(len(again))
        values = share * safe + (1.0 - share) * again[reserve.column].to_numpy()
        failing = ~passes(again, **{reserve.key.name: values})
        assert failing.sum() <= 5e-3 * len(again)


SLIDES = """
name: slides
boulder: {length: 2 m, width: 2.4 m, height: 2.0 m, density: 2600 kg/m^3}
site: {embedment_depth: 0.6 m}
soil: {density: 1860 kg/m^3, friction_angle: 32 deg, subgrade_reaction: 30 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


def test_a_boulder_that_a_slower_truck_overturns_has_no_class() -> None:
    """It passes at 30 mph by sliding, and overturns at 12.6 m/s; in better soil it overturns at 30 mph, too."""
    seen: list[tuple[int, int]] = []
    found = capacity(load_text(SLIDES, Path("slides.yaml")), progress=lambda *now: seen.append(now))
    assert seen == [(0, 1), (1, 1)]
    row = found.frame.iloc[0]
    assert row.withstands_speed_m_s < 12.6
    assert row.speed_fails_at == pytest.approx(row.withstands_speed_m_s + 0.01)
    assert (row.verdict, row.reason) == ("fail", "slower_truck")
    assert (row.speed_found, row.soil_found) == ("found", "never")
    assert np.isnan(row.withstands_friction_angle_deg)
    assert row.simulated_class is None or pd.isna(row.simulated_class)
    text = " ".join(reserve_lines(found))
    assert f"{row.withstands_speed_m_s:.2f} (-" in text
    assert "fail (slower_truck): a slower truck overturns it" in text


def test_reserves_of_designs_that_pass_are_on_the_worse_side() -> None:
    frame = capacity(site(site="embedment_depth: [1.8, 2.1] m")).frame
    held, failed = frame[frame.verdict == "pass"], frame[frame.reason == "overturns"]
    assert len(held)
    assert len(failed)
    assert (held.withstands_speed_m_s > held.impact_speed_m_s.astype(float) - 0.01).all()
    assert (held.withstands_friction_angle_deg < held.friction_angle_deg.astype(float) + 0.01).all()
    assert (failed.withstands_speed_m_s < failed.impact_speed_m_s.astype(float)).all()


def test_classes_are_named_for_medium_trucks_only() -> None:
    speed = np.array([13.40, 13.41, 17.87, 17.88, 22.4, 30.0, np.nan, 30.0])
    mass = np.array([6800.0] * 7 + [7500.0])
    assert classes(speed, mass) == [None, "M30", "M30", "M40", "M50", "M50", None, None]
    assert list(CLASSES) == ["M30", "M40", "M50"]


def test_speeds_of_iso_22343_are_named_for_trucks_of_7200_kg_only() -> None:
    speed = np.array([13.32, 13.33, 17.78, 22.21, 22.22, 22.22])
    mass = np.array([7200.0] * 5 + [6800.0])
    named = ["48 km/h", "64 km/h", "64 km/h", "80 km/h", None]
    assert classes(speed, mass, ISO_SPEEDS, ISO_MASS_KG) == [None, *named]
    frame = capacity(with_constants(site(), vehicle_mass_kg=7200.0)).frame
    assert set(frame.simulated_iso_speed.dropna()) == {"48 km/h"}
    assert frame.simulated_class.isna().all()
    assert capacity(site()).frame.simulated_iso_speed.isna().all()


def test_crash_tests() -> None:
    found = capacity(load(CONFIGS / "crash_tests.yaml"))
    abg, rwg = found.frame.to_dict("records")
    assert abg["withstands_speed_m_s"] < 13.0
    assert rwg["withstands_speed_m_s"] > 14.0
    assert rwg["simulated_class"] == "M30"
    lines = reserve_lines(found)
    assert all(len(line) <= 80 for line in lines)
    assert lines[0] == "What each design just withstands, without a margin (need --most speed has one):"
    assert "M30" in lines[5]
    assert any(line.startswith("robust: ") for line in lines)


@pytest.mark.parametrize(
    ("column", "value", "shown"),
    [
        ("impact_speed_m_s", 45.0, "≥45.00 (+0%)"),
        ("vehicle_mass_kg", 70_000.4, "≥70000 (-0%)"),
        ("friction_angle_deg", 14.0, "≤14.00 (+0%)"),
    ],
)
def test_a_design_that_passes_beyond_the_usual_range_withstands_its_own_value(
    column: str, value: float, shown: str
) -> None:
    strong = site(height="3.2 m", site="embedment_depth: 2.2 m", friction="44 deg")
    mild = {"impact_speed_m_s": 2.0, "vehicle_mass_kg": 100.0}
    found = capacity(with_constants(strong, **(mild | {column: value})))
    (row,) = found.frame.to_dict("records")
    assert row["verdict"] == "pass"
    (own,) = (reserve for reserve in RESERVES if reserve.key.name == column)
    assert row[own.column] == pytest.approx(value, abs=0.5)
    lines = reserve_lines(found)
    assert shown in lines[4]
    assert any(line.startswith("≥, ≤: ") for line in lines)


def test_a_design_that_fails_in_the_strongest_soil_withstands_none() -> None:
    fast = {"impact_speed_m_s": 22.0}
    frame = capacity(with_constants(site(friction="59.5 deg", site="embedment_depth: 1.2 m"), **fast)).frame
    assert (frame.verdict == "fail").all()
    assert frame.withstands_friction_angle_deg.isna().all()
    assert set(frame.soil_found) <= {"never", "blocked_by_overlap", "not_monotone"}


def test_only_the_end_of_what_is_tried_is_marked() -> None:
    text = "\n".join(reserve_lines(capacity(site())))
    assert "≥" not in text
    assert "≤" not in text


def test_designs_that_differ_in_what_is_asked_for_ask_once(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = site(height="[3.0, 3.4] m", friction="[36, 40, 45] deg", site="embedment_depth: [1.8, 2.1] m")
    asked, answers_of = [], ValueSearch.answers_of

    def counted(self: ValueSearch, rows: dict[str, np.ndarray], low: np.ndarray, high: np.ndarray) -> Answers:
        asked.append(len(low))
        return answers_of(self, rows, low, high)

    monkeypatch.setattr(ValueSearch, "answers_of", counted)
    found = capacity(grid, jobs=1).frame
    assert asked == [12, 12, 4]
    alone = [
        capacity(with_constants(site(height="3.0 m", friction=f"{angle} deg"), embedment_depth_m=depth)).frame
        for angle in (36, 40, 45)
        for depth in (1.8, 2.1)
    ]
    again = pd.concat(alone).set_index(["friction_angle_deg", "embedment_depth_m"]).sort_index()
    same = found[found.boulder_height_m == 3.0].set_index(["friction_angle_deg", "embedment_depth_m"]).sort_index()
    columns = [name for one in RESERVES for name in (one.column, f"{one.word}_fails_at", f"{one.word}_found")]
    assert same[columns].astype(object).equals(again[columns].astype(object))


def test_threads_do_not_matter() -> None:
    one, two = (capacity(site(), jobs=jobs) for jobs in (1, 2))
    assert one.arrow.equals(two.arrow)
