"""What designs withstand, judged again at the value and one beside it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.answers.keys import key_of
from boulder_sweep.answers.printing import reserve_lines
from boulder_sweep.answers.reserves import CLASSES, ISO_MASS_KG, ISO_SPEEDS, RESERVES, classes, reserves
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.sweep import DesignList
from tests.answers.designs import random_designs, site

CONFIGS = Path(__file__).parents[2] / "configs"


def passes(frame: pd.DataFrame, **inputs: np.ndarray) -> np.ndarray:
    listed = {name: frame[name].to_numpy(dtype=float) for name in INPUT_COLUMNS if name != "impact_height_m"}
    sweep = Sweep("again", None, (), {}, DesignList("again.csv", listed | inputs))
    return evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, sweep.n_designs)).verdict == PASS


@pytest.fixture(scope="module", params=[240, pytest.param(400, marks=pytest.mark.nightly)])
def reserves_of_many(request: pytest.FixtureRequest) -> pd.DataFrame:
    """What random designs withstand."""
    return reserves(random_designs(request.param)).frame


def with_constants(sweep: Sweep, **values: float) -> Sweep:
    return dataclasses.replace(sweep, constants=sweep.constants | values)


@pytest.mark.parametrize(
    ("column", "own", "worse"),
    [
        ("withstands_speed_m_s", "impact_speed_m_s", 0.01),
        pytest.param("withstands_mass_kg", "vehicle_mass_kg", 1.0, marks=pytest.mark.nightly),
        ("withstands_friction_angle_deg", "friction_angle_deg", -0.01),
    ],
)
def test_a_design_passes_at_what_it_withstands_and_not_beyond(
    reserves_of_many: pd.DataFrame, column: str, own: str, worse: float
) -> None:
    frame = reserves_of_many
    ends = [getattr(reserve, end) for reserve in RESERVES if reserve.column == column for end in ("best", "worst")]
    there = frame[frame[column].notna()]
    assert len(there) > 100
    assert passes(there, **{own: there[column].to_numpy()}).all()
    inside = there[~np.isclose(there[column], ends[0]) & ~np.isclose(there[column], ends[1])]
    # The very value that was judged: a boulder that rocks near its limit for long may turn over by the last bit.
    beside = np.round((inside[column].to_numpy() + worse) / abs(worse)) / round(1.0 / abs(worse))
    assert not passes(inside, **{own: beside}).any()
    assert (frame[frame.verdict == "pass"][column].notna()).all()


def test_reserves_of_designs_that_pass_are_on_the_worse_side() -> None:
    frame = reserves(site(site="embedment_depth: [1.8, 2.1] m")).frame
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
    frame = reserves(with_constants(site(), vehicle_mass_kg=7200.0)).frame
    assert set(frame.simulated_iso_speed.dropna()) == {"48 km/h"}
    assert frame.simulated_class.isna().all()
    assert reserves(site()).frame.simulated_iso_speed.isna().all()


def test_crash_tests() -> None:
    found = reserves(load(CONFIGS / "crash_tests.yaml"))
    abg, rwg = found.frame.to_dict("records")
    assert abg["withstands_speed_m_s"] < 13.0
    assert rwg["withstands_speed_m_s"] > 14.0
    assert rwg["simulated_class"] == "M30"
    lines = reserve_lines(found)
    assert all(len(line) <= 80 for line in lines)
    assert "M30" in lines[4]
    assert lines[5].startswith("robust: ")


@pytest.mark.parametrize(
    ("column", "value", "shown"),
    [
        ("impact_speed_m_s", 45.0, "≥45.00 (+0%)"),
        ("vehicle_mass_kg", 70_000.4, "≥70000 (+0%)"),
        ("friction_angle_deg", 14.0, "≤14.00 (+0%)"),
    ],
)
def test_a_design_that_passes_beyond_what_is_tried_withstands_its_own_value(
    column: str, value: float, shown: str
) -> None:
    strong = site(height="3.2 m", site="embedment_depth: 2.2 m", friction="44 deg")
    mild = {"impact_speed_m_s": 2.0, "vehicle_mass_kg": 100.0}
    found = reserves(with_constants(strong, **(mild | {column: value})))
    (row,) = found.frame.to_dict("records")
    assert row["verdict"] == "pass"
    (own,) = (reserve for reserve in RESERVES if key_of(reserve.input).name == column)
    assert row[own.column] == value
    lines = reserve_lines(found)
    assert shown in lines[3]
    assert lines[4].startswith("≥, ≤: ")
    assert all("≥" in line or "≤" in line for line in reserve_lines(found, units="us")[3:5])


def test_a_design_that_fails_beyond_the_best_value_tried_withstands_none() -> None:
    fast = {"impact_speed_m_s": 22.0}
    frame = reserves(with_constants(site(friction="59.5 deg", site="embedment_depth: 1.2 m"), **fast)).frame
    assert (frame.verdict == "fail").all()
    assert frame.withstands_friction_angle_deg.isna().all()


def test_only_the_end_of_what_is_tried_is_marked() -> None:
    text = "\n".join(reserve_lines(reserves(site())))
    assert "≥" not in text
    assert "≤" not in text


def test_threads_do_not_matter() -> None:
    one, two = (reserves(site(), jobs=jobs) for jobs in (1, 2))
    assert one.arrow.equals(two.arrow)


def test_distributions_are_taken_at_their_unfavourable_quantiles() -> None:
    uncertain = site(friction="{mean: 38 deg, sd: 3 deg}")
    assert reserves(uncertain).arrow.equals(reserves(at_values(uncertain)).arrow)
