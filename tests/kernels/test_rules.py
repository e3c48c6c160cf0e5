"""The rules of the verdict on single rows: each alone, and the worst of several."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.rules import (
    CRUSH,
    FOOT,
    NO_CONTACT,
    NOT_COMPUTED,
    NUMERICAL_ERROR,
    OVERRIDE,
    OVERTURNS,
    PASSES,
    PENETRATION,
    RULINGS,
    SHAPE,
    SIZES,
    UNPROVED,
    VerdictLimits,
    is_simulated,
    write_rulings,
)

LIMITS = VerdictLimits(rotation=0.35, penetration=1.0, proved=1.0, min_overlap_m=0.25)
STANDS = {
    "status": bk.Status.SETTLED,
    "theta_max": 0.1,
    "x_b_max": 0.2,
    "x_v_max": 2.0,
    "F_v_max": 1e6,
    "crush_max": 0.8,
    "t_limit": np.nan,
    "t_end": 0.6,
    "theta_error": 1e-5,
    "x_error": 1e-5,
    "step": 4e-3,
}
BOULDER = {"L": 1.5, "H": 3.0, "d": 1.5, "e_bumper": 0.5, "bed_offset": 2.9, "flat_foot": 1.0, "known_shape": 1.0}


def ruling(**changed):
    """Rule of a row that stands but for some numbers, and what was computed with it."""
    row = STANDS | {name: value for name, value in changed.items() if name in STANDS}
    sizes = BOULDER | {name: value for name, value in changed.items() if name in BOULDER}
    limits = LIMITS._replace(**{name: value for name, value in changed.items() if name in LIMITS._fields})
    outcomes = bk.OutcomeTable(
        np.array([row["status"]], np.int8), *(np.array([row[name]]) for name in list(STANDS)[1:])
    )
    out = np.empty((len(RULINGS), 1))
    write_rulings(outcomes, np.array([[sizes[name]] for name in SIZES]), limits, out)
    return tuple(out[:, 0])


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({}, PASSES),
        ({"status": bk.Status.NO_CONTACT}, NO_CONTACT),
        ({"status": bk.Status.UNSTABLE}, NOT_COMPUTED),
        *(
            ({name: np.nan}, NOT_COMPUTED)
            for name in ("theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max", "t_end")
        ),
        ({"status": bk.Status.LIMIT}, OVERTURNS),
        ({"theta_max": 0.35}, OVERTURNS),
        ({"x_v_max": 5.5}, PENETRATION),
        ({"flat_foot": 0.0}, FOOT),
        ({"known_shape": 0.0}, SHAPE),
        ({"crush_max": 3.0}, CRUSH),
        ({"d": 2.3}, OVERRIDE),
        ({"d": 2.3, "min_overlap_m": 0.1}, PASSES),
        ({"status": bk.Status.HORIZON}, UNPROVED),
        ({"status": bk.Status.OUTWARD}, UNPROVED),
        ({"status": bk.Status.UNPROVABLE}, UNPROVED),
        ({"status": bk.Status.UNPROVABLE, "proved": 0.0}, PASSES),
        ({"theta_error": 0.3}, NUMERICAL_ERROR),
        ({"x_error": 4.0}, NUMERICAL_ERROR),
        ({"theta_error": np.nan, "x_error": np.nan}, PASSES),
        # One of two solutions overturns: nothing is decided.
        ({"status": bk.Status.LIMIT, "theta_error": np.inf, "x_error": np.inf}, NUMERICAL_ERROR),
    ],
)
def test_each_rule_alone(changed, rule):
    assert ruling(**changed)[0] == rule


def test_the_worst_rule_decides():
    worse = [
        {"theta_error": 0.3},
        {"status": bk.Status.HORIZON},
        {"d": 2.3},
        {"crush_max": 3.0},
        {"known_shape": 0.0},
        {"flat_foot": 0.0},
        {"x_v_max": 5.5},
        {"theta_max": 0.4},
        {"t_end": np.inf},
    ]
    rules = (NUMERICAL_ERROR, UNPROVED, OVERRIDE, CRUSH, SHAPE, FOOT, PENETRATION, OVERTURNS, NOT_COMPUTED)
    together = {}
    for changed, rule in zip(worse, rules, strict=True):
        together |= changed
        assert ruling(**together)[0] == rule
    assert ruling(**together | {"status": bk.Status.NO_CONTACT})[0] == NO_CONTACT


def test_overlap_penetration_and_margin():
    _, overlap, penetration, margin = ruling()
    assert (overlap, penetration) == pytest.approx((1.0, -2.4))
    assert margin == pytest.approx(min(0.25 / 0.35, 3.4))
    assert ruling(x_v_max=5.2)[3] == pytest.approx(0.2)


def test_a_simulation_has_maxima_where_the_table_says_so():
    assert [status for status in bk.Status if is_simulated(status)] == sorted(bk.SIMULATED)
