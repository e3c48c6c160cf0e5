"""Shallow boulders that slide: a barrier must hold every truck up to its speed, slower ones, too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boulder_kernels import Control, corrected
from boulder_kernels.rules import SLOWER_SPEEDS
from boulder_sweep.judge.accuracy import LONGEST_HORIZON, STEPS
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.judge.verdict import Limits
from tests.judge.plain import plain_designs

LIMIT = math.radians(20.0)
CONTROL = Control(STEPS["balanced"].step_s, 1.0, LIMIT, 0, error_estimate=True, longest_horizon=LONGEST_HORIZON)
BALANCED = Evaluation(corrected(), CONTROL, Limits(LIMIT, "P1"))
ISLAND = {
    "L": 2.0, "W": 2.4, "H": 2.0, "rho_b": 2600.0, "d": 0.6, "rho_s": 1860.0, "phi": math.radians(32.0), "beta": 30.0,
    "m_v": 6803.8856, "v_0": 13.4112, "k_v": 3103.3e3, "c_v": 138.91e3, "e": 0.95,
}  # fmt: skip
"""It stops 15,000 lb at 30 mph, and 12.6 m/s overturn it."""


def test_a_boulder_that_a_slower_truck_overturns_fails() -> None:
    row = BALANCED.judged(plain_designs(**ISLAND)).row(0)
    assert (row["verdict"], row["reason"]) == ("fail", "slower_truck")
    # What is reported of the motion is that of its own truck, and nothing of it is a reserve.
    assert row["max_rotation_deg"] == pytest.approx(18.62, abs=0.01)
    assert row["margin"] is None
    assert row["rating"] is None
    assert row["time_to_limit_s"] is None
    assert row["robustness"] is None


def test_the_slower_truck_does_overturn_it() -> None:
    slower = BALANCED.judged(plain_designs(**ISLAND | {"v_0": 12.6})).row(0)
    assert (slower["verdict"], slower["reason"]) == ("fail", "overturns")
    assert slower["time_to_limit_s"] == pytest.approx(3.5563, abs=2e-3)


def shallow(n: int, seed: int) -> Designs:
    """Shallow, broad boulders in weak soil, many of which slide."""
    rng = np.random.default_rng(seed)
    ranges = {"L": (1.5, 2.5), "W": (1.8, 2.6), "H": (1.8, 3.0), "phi": (0.5, 0.7), "beta": (15.0, 60.0)}
    columns = {name: rng.uniform(*ends, n) for name, ends in ranges.items()}
    columns |= {"d": columns["H"] * rng.uniform(0.2, 0.45, n), "v_0": rng.uniform(6.0, 14.0, n)}
    designs = plain_designs(n)
    return designs._replace(table=designs.table._replace(**columns))


def test_a_pass_of_a_sample_stops_every_slower_truck_of_the_steps() -> None:
    designs = shallow(400, 3)
    judged = BALANCED.judged(designs)
    asked = (designs.table.d / designs.table.H < 0.45) & (judged["max_displacement_m"] > 0.3)
    assert np.count_nonzero(judged.verdict[asked] == FAIL) > 0
    passes = designs.rows(asked & (judged.verdict == PASS))
    assert passes.size > 5
    for share in SLOWER_SPEEDS[::4]:
        slower = passes._replace(table=passes.table._replace(v_0=share * passes.table.v_0))
        assert np.all(BALANCED.judged(slower).verdict == PASS)


def test_hardly_buried_boulders_that_slide_far_never_pass() -> None:
    designs = shallow(400, 5)
    judged = BALANCED.judged(designs)
    islands = (designs.table.d / designs.table.H < 0.35) & (judged["max_displacement_m"] > 0.5)
    assert islands.any()
    assert not np.any(judged.verdict[islands] == PASS)


def test_nothing_beyond_twenty_degrees_passes() -> None:
    """By a criterion that allows more: what passes is what passes by 20 degrees."""
    designs = shallow(200, 6)
    wide = math.radians(30.0)
    free = Evaluation(corrected(), CONTROL._replace(theta_limit=wide), Limits(wide, "P1")).judged(designs)
    beyond = free["max_rotation_deg"] > 20.0
    assert np.count_nonzero(beyond & (free["max_rotation_deg"] < 29.9)) > 0
    assert not np.any(free.verdict[beyond] == PASS)
    assert np.array_equal(free.verdict == PASS, BALANCED.judged(designs).verdict == PASS)


def test_under_fast_what_moves_on_past_the_horizon_is_undecided() -> None:
    """19.957 degrees by steps of 12 ms, of which nothing was confirmed; it overturns at 3.81 s."""
    design = plain_designs(
        L=1.5375571249499285, W=2.175198055331226, H=1.6808001011478457, rho_b=2819.522933061269,
        rho_s=1809.786771103301, phi=math.radians(34.73782132929777), beta=45.234031048714925,
        K_epsilon=1.0089494986948633, m_v=2747.2833740516544, v_0=10.074890724422222, k_v=3031631.8403099314,
        c_v=241883.0894786279, e_bumper=0.40685987701996207, d=0.46008425824746196,
        e=0.5 * (1.6808001011478457 - 0.46008425824746196 + 0.40685987701996207),
    )  # fmt: skip
    quick = CONTROL._replace(error_estimate=False, longest_horizon=0.0)
    row = Evaluation(corrected(), quick, Limits(LIMIT, "P1")).judged(design).row(0)
    assert (row["verdict"], row["reason"]) == ("undecided", "horizon")
    decided = BALANCED.judged(design).row(0)
    assert (decided["verdict"], decided["reason"]) == ("fail", "overturns")
    assert decided["time_to_limit_s"] == pytest.approx(3.8137, abs=2e-3)
