"""A distribution whose mean is searched."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boulder_sweep.answers.moving import Moving
from boulder_sweep.answers.need import need
from boulder_sweep.answers.spread import Spread
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings import Sweep, load_text
from tests.answers.designs import site
from tests.answers.test_spread import NAMED

Z = np.linspace(-3.0, 3.0, 13)
ONE = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "40 deg"}
ENDS = "low: 2.15 m, high: 2.25 m"


def one(**changes: str) -> Sweep:
    """Return a sweep of one design."""
    return site(**ONE | changes)


def drawn(sweep: Sweep, name: str, mean: float) -> np.ndarray:
    """Return the values of an input at `Z` if its mean is another than that of the file."""
    rows = {own: np.repeat(values, len(Z)) for own, values in sweep.plan.given_rows(0, 1).items()}
    rows[name] = np.full(len(Z), mean)
    return Spread(sweep, name).filled(rows, Z[:, None])[name]


@pytest.mark.parametrize(
    ("spread", "proportional"),
    [
        ("{distribution: uniform, low: 2.15 m, high: 2.25 m}", False),
        ("{distribution: triangular, low: 2.1 m, mode: 2.2 m, high: 2.3 m}", False),
        (f"{{distribution: beta, mean: 2.2 m, sd: 0.02 m, {ENDS}}}", False),
        (f"{{distribution: beta, mean: 2.2 m, cov: 1 %, {ENDS}}}", True),
        (f"{{mean: 2.2 m, sd: 0.03 m, {ENDS}}}", False),
        (f"{{mean: 2.2 m, cov: 2 %, {ENDS}}}", True),
        ("{mean: 2.2 m, sd: 0.03 m, low: 2.15 m}", False),
        (f"{{distribution: lognormal, mean: 2.2 m, cov: 2 %, {ENDS}}}", True),
    ],
)
def test_a_distribution_keeps_its_shape_as_its_mean_moves(spread: str, proportional: bool) -> None:
    sweep = one(site=f"embedment_depth: {spread}")
    own = drawn(sweep, "embedment_depth_m", 2.2)
    for mean in (1.3, 2.6):
        moved = own * mean / 2.2 if proportional else own + mean - 2.2
        assert drawn(sweep, "embedment_depth_m", mean) == pytest.approx(moved, rel=1e-9)


def test_the_ends_of_a_lognormal_distribution_with_a_standard_deviation_move_by_as_much_as_its_mean() -> None:
    sweep = one(site=f"embedment_depth: {{distribution: lognormal, mean: 2.2 m, sd: 0.03 m, {ENDS}}}")
    found = drawn(sweep, "embedment_depth_m", 1.3)
    assert found[0] == pytest.approx(1.25, abs=2e-3)
    assert found[-1] == pytest.approx(1.35, abs=2e-3)


def test_the_mean_of_a_characteristic_value_is_searched() -> None:
    sweep = one(friction="{characteristic: 36 deg, sd: 2 deg, low: 34 deg, high: 44 deg}")
    moving = Moving(sweep, "friction_angle_deg")
    low, high = moving.ends(sweep.distributions["friction_angle_deg"], np.array([36.0 + 1.644854 * 2.0 + 1.0]))
    assert (low[0], high[0]) == pytest.approx((35.0, 45.0))


def test_named_ends_stop_at_the_admitted_range_and_others_stay() -> None:
    sweep = one(friction="{mean: 40 deg, sd: 3 deg, high: 46 deg}")
    spread = sweep.distributions["friction_angle_deg"]
    low, high = Moving(sweep, "friction_angle_deg").ends(spread, np.array([30.0, 58.0]))
    assert low.tolist() == [1.0, 1.0]
    assert high.tolist() == [36.0, 60.0]


def test_every_named_soil_moves_from_its_own_mean() -> None:
    spread = "{distribution: uniform, low: 38 deg, high: 41 deg}"
    sweep = load_text(NAMED.replace("{mean: 40 deg, cov: 10 %}", spread), Path("named.yaml"))
    moving = Moving(sweep, "friction_angle_deg")
    uniform = sweep.distributions["friction_angle_deg"].each[2]
    assert np.ravel(moving.ends(uniform, np.array([30.0]))) == pytest.approx([28.5, 31.5])
    assert moving.means(0.01) == pytest.approx((2.5, 58.5))


@pytest.mark.parametrize(
    ("changes", "asked", "exact"),
    [
        # From 1.9225 m, 15.985 m/s and 35.175 deg on, one design passes, by the searches without a distribution.
        ({"site": "embedment_depth: {distribution: uniform, low: 2.15 m, high: 2.25 m}"}, {}, 1.9225 + 0.045),
        ({"site": f"embedment_depth: {{mean: 2.2 m, sd: 0.03 m, {ENDS}}}"}, {}, 1.9625),
        ({"friction": "{distribution: uniform, low: 38 deg, high: 42 deg}"}, {"least": "friction_angle"}, 36.975),
    ],
)
def test_the_answer_moves_with_what_is_searched(changes: dict[str, str], asked: dict[str, str], exact: float) -> None:
    row = need(one(**changes), probability=0.95, **asked).frame.iloc[0]
    assert row.found in ("found", "not_monotone")
    assert row.passes_at == pytest.approx(exact, abs=0.011 if asked else 0.0021)
    assert row.p_pass == pytest.approx(0.95, abs=0.01)


def test_the_largest_mean_speed_for_a_probability() -> None:
    text = "{distribution: triangular, low: 12 m/s, mode: 13 m/s, high: 14 m/s}"
    sweep = load_text(FILE.format(speed=text), Path("speed.yaml"))
    row = need(sweep, most="speed", probability=0.95).frame.iloc[0]
    assert row.found == "found"
    assert row.passes_at == pytest.approx(15.985 - (1.0 - np.sqrt(0.1)), abs=0.02)


FILE = """
name: speed
boulder: {{length: 1.65 m, width: 1.68 m, height: 3.2 m, density: 2600 kg/m^3}}
site: {{embedment_depth: 2.2 m}}
soil: {{density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: {speed}, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""


@pytest.mark.parametrize(
    ("changes", "asked", "message"),
    [
        ({"friction": "{mean: [38, 40] deg, sd: 1 deg, low: 30 deg}"}, {"least": "friction_angle"}, "several means"),
        (
            {"site": "embedment_depth: {mean: 2.2 m, sd: 0.1 m}"},
            {"least": "embedment_ratio"},
            "ask for embedment_depth",
        ),
        ({"site": "embedment_ratio: {mean: 0.6, sd: 0.1}"}, {"least": "embedment_depth"}, "ask for embedment_ratio"),
        (
            {"friction": "{distribution: uniform, low: 38 deg, high: 42 deg}"},
            {"least": "friction_angle", "between": ("30 deg", "59 deg")},
            "only for means from 3 to 58 deg",
        ),
    ],
)
def test_what_cannot_move_is_refused(changes: dict[str, str], asked: dict, message: str) -> None:
    with pytest.raises(QuestionError, match=message):
        need(one(**changes), probability=0.95, **asked)


def test_the_usual_range_is_narrowed_to_the_means_that_are_admitted() -> None:
    sweep = one(friction="{distribution: uniform, low: 10 deg, high: 60 deg}")
    likely, likelier = (need(sweep, "friction_angle", probability=wanted).frame.iloc[0] for wanted in (0.45, 0.5))
    assert likely.passes_at == pytest.approx(35.175 - 25.0 + 0.45 * 50.0, abs=0.05)
    assert (likelier.found, likelier.fails_at) == ("never", 35.0)
