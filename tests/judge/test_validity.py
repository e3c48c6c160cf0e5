"""Flags on rows outside what the model was tested on."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from boulder_kernels import Control, Status, corrected, rules
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge import validity
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import CHANGES_SIDE, Judged, joined
from boulder_sweep.judge.validity import FLAGS, TESTED_ROTATION_DEG, flag_counts, has_odd_layers, meanings
from boulder_sweep.judge.verdict import Limits, judge, limits_of
from boulder_sweep.settings import load
from boulder_sweep.settings.model import PRESETS, Ground, Layer
from tests.judge.plain import plain_designs
from tests.judge.test_verdict import outcome

CONFIGS = Path(__file__).parents[2] / "configs"
LIMITS = Limits(math.radians(20.0), "P1")
INSIDE = {"W": 1.2, "H": 2.7, "d": 1.5, "rho_b": 2600.0, "phi": math.radians(40.0), "beta": 60.0}


def flags_of(row: Judged) -> str:
    """Return the flags of the only row."""
    return str(row.row(0)["validity"])


def judged(status: Status = Status.SETTLED, changes: dict[str, float] | None = None, **outcomes: float) -> Judged:
    """One row inside what the model was tested on unless told otherwise."""
    return judge(outcome(status, **{"F_v_max": 1e3} | outcomes), plain_designs(**INSIDE | (changes or {})), LIMITS)


def test_inside_there_are_none() -> None:
    assert flags_of(judged()) == ""


@pytest.mark.parametrize(
    ("flag", "changes", "outcomes"),
    [
        ("crush", {}, {"crush_max": 1.01}),
        ("rotation", {}, {"theta_max": math.radians(13.9)}),
        ("size", {"L": 0.05}, {}),
        ("size", {"W": 0.5}, {}),
        ("embedment", {"d": 1.1, "W": 0.9, "H": 3.3}, {}),
        ("embedment", {"H": 4.0, "d": 3.005}, {}),
        ("rock_density", {"rho_b": 1.0}, {}),
        ("rock_density", {"rho_b": 3100.0}, {}),
        ("soil_pair", {"phi": math.radians(28.0), "beta": 110.0}, {}),
        ("soil_pair", {"beta": 5.0}, {}),
        ("overlap", {"H": 2.4}, {}),
        ("slides", {}, {"x_b_max": 0.51}),
        ("vehicle", {"m_v": 4990.0}, {}),
        ("vehicle", {"m_v": 9010.0}, {}),
        ("vehicle", {"v_0": 10.9}, {}),
        ("vehicle", {"v_0": 18.1}, {}),
        ("vehicle", {"k_v": 1.7e6}, {}),  # mass and speed of a truck, the spring of a softer one
        ("vehicle", {"k_v": 1e8}, {}),
        ("vehicle", {"c_v": 3e5}, {}),
        ("soil", {"phi": math.radians(50.0), "beta": 200.0}, {}),
        ("soil", {"rho_s": 1500.0}, {}),
        ("soil", {"rho_s": 2260.0}, {}),
        ("soil", {"K_epsilon": 1.3}, {}),
        ("soil", {"K_epsilon": 0.9}, {}),
    ],
)
def test_each_flag_is_raised_alone(flag: str, changes: dict[str, float], outcomes: dict[str, float]) -> None:
    row = judged(changes=changes, **outcomes)
    assert flags_of(row) == flag
    assert row.row(0)["verdict"] == "pass"  # a flag does not change it


@pytest.mark.parametrize(
    ("below", "flag"), [({"friction_angle_deg": 55.0}, "soil"), ({"density_kg_m3": 2300.0}, "soil"), ({}, "")]
)
def test_deeper_layers_count_as_soil(below: dict[str, float], flag: str) -> None:
    usual = {"from_m": 1.0, "density_kg_m3": 2000.0, "friction_angle_deg": 38.0, "subgrade_reaction_MN_m3": 60.0}
    odd = has_odd_layers(Ground((Layer(**usual | below),)))
    row = judge(outcome(Status.SETTLED, F_v_max=1e3), plain_designs(**INSIDE), LIMITS._replace(odd_layers=odd))
    assert flags_of(row) == flag


def test_a_law_of_the_resistance_is_no_strain_rate() -> None:
    """A law is a factor on the strain rate factor in the kernels; the flag looks at what was given."""
    sweep = load(CONFIGS / "rwg.yaml", ["model.resistance=width_capped"])
    designs = designs_of(sweep.block(0, 1), None, sweep.model)
    assert designs.table.K_epsilon[0] < 0.9
    assert flags_of(judge(outcome(Status.SETTLED, F_v_max=1e3), designs, limits_of(sweep))) == ""


def test_several_flags_stand_in_the_order_of_the_register() -> None:
    both = judged(changes={"rho_b": 1.0}, crush_max=2.0)
    assert flags_of(both) == "crush;rock_density"
    assert meanings(flags_of(both))[1] == "a density that rock does not have"
    assert meanings("") == []


def test_words_are_the_same_however_the_rows_are_cut() -> None:
    rows = [judged(), judged(changes={"rho_b": 1.0}), judged(crush_max=2.0), judged()]
    whole = joined(rows)
    assert whole.words["validity"] == ("", "crush", "rock_density")
    halves = joined([joined(rows[:1]), joined(rows[1:])])
    assert halves.words == whole.words
    assert np.array_equal(halves["validity"], whole["validity"])


def test_counts_by_flag() -> None:
    assert flag_counts([("", 3), ("crush;size", 2), ("size", 1)]) == {"": 3, "crush": 2, "size": 3}
    assert flag_counts([]) == {"": 0}


def test_the_crash_tests_are_inside() -> None:
    """What the thresholds are taken from: the tests lie just inside."""
    rwg, abg = (crash_test(name).constants for name in ("rwg", "abg"))
    for preset in PRESETS:
        found = simulate(crash_test("rwg"), readings=preset)
        assert found.summary()["validity"] == ""
        rotation = found.summary()["max_rotation_deg"]
        assert TESTED_ROTATION_DEG[preset] == pytest.approx(rotation, abs=0.05)
        assert TESTED_ROTATION_DEG[preset] > rotation
    overlap = min(c["boulder_height_m"] - c["embedment_depth_m"] - c["bumper_height_m"] for c in (rwg, abg))
    assert validity.TESTED_OVERLAP_M <= overlap < validity.TESTED_OVERLAP_M + 0.01


def test_a_truck_inside_the_boulder_is_never_a_pass() -> None:
    """65,000 lb at 40 mph before a boulder that stands: it drives 4.6 m, and its cab is 2.9 m long."""
    heavy = plain_designs(
        L=2.0, W=2.5, H=4.0, rho_b=2600.0, d=3.0, e=0.75, rho_s=1860.0, phi=math.radians(42.0), beta=60.0,
        m_v=29483.5, v_0=17.8816, k_v=3103.3e3, c_v=138.91e3,
    )  # fmt: skip
    control = Control(0.008, 1.0, LIMITS.rotation, 0, True, longest_horizon=10.0)
    row = Evaluation(corrected(), control, LIMITS).judged(heavy).row(0)
    assert (row["verdict"], row["reason"]) == ("undecided", "crush")
    assert row["max_rotation_deg"] < 20.0
    assert row["max_vehicle_displacement_m"] == pytest.approx(4.6, abs=0.2)
    assert row["vehicle_crush_m"] > 2.9
    assert str(row["validity"]).startswith("crush")
    assert row["margin"] is None
    assert row["rating"] is None


def test_the_kernels_raise_the_flags_of_the_register() -> None:
    """All but one, which takes several judgements of a design."""
    assert tuple(flag.name for flag in FLAGS) == (*rules.FLAGS, CHANGES_SIDE)
    assert set(rules.UNSTUDIED) < set(rules.FLAGS)


def test_the_page_names_every_flag() -> None:
    page = (Path(__file__).parents[2] / "docs" / "validity.md").read_text()
    assert re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE) == [flag.name for flag in FLAGS]
