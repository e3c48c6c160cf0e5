"""The rules of the verdict on single rows: each alone, the worst of several, and which rows need another solution."""

from itertools import product

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels._jit import plain
from boulder_kernels.rules import (
    AGREEING,
    CRUSH,
    FOOT,
    NO_CONTACT,
    NOT_COMPUTED,
    NUMERICAL_ERROR,
    OVERRIDE,
    OVERTURNS,
    PASSES,
    PENETRATION,
    RULES,
    RULINGS,
    SHAPE,
    SIZES,
    SLOWER_SPEEDS,
    SLOWER_TRUCK,
    UNPROVED,
    VALIDITY,
    Confirmation,
    VerdictLimits,
    after_finer,
    after_slower,
    agree,
    confirmations,
    is_asked_slower,
    is_simulated,
    is_wanted,
    write_rulings,
)

LIMITS = VerdictLimits(rotation=0.35, penetration=1.0, min_overlap_m=0.25)
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
        ({"theta_error": 0.3}, NUMERICAL_ERROR),
        ({"x_error": 4.0}, NUMERICAL_ERROR),
        ({"theta_error": np.nan, "x_error": np.nan}, PASSES),
        # The model does not hold beyond 20 degrees, nor for boulders hardly buried that slide.
        ({"theta_max": 0.3495, "rotation": 0.5}, VALIDITY),
        ({"theta_max": 0.3490, "rotation": 0.5}, PASSES),
        ({"d": 1.049, "x_b_max": 0.501}, VALIDITY),
        ({"d": 1.051, "x_b_max": 0.501}, PASSES),
        ({"d": 1.049, "x_b_max": 0.499}, PASSES),
        # One of two solutions overturns, or none confirms a late row: nothing is decided.
        ({"status": bk.Status.LIMIT, "theta_error": np.inf, "x_error": np.inf}, NUMERICAL_ERROR),
        ({"x_v_max": 5.5, "theta_error": np.inf, "x_error": np.inf}, NUMERICAL_ERROR),
    ],
)
def test_each_rule_alone(changed, rule):
    assert ruling(**changed)[0] == rule


def test_the_worst_rule_decides():
    worse = [
        {"H": 5.0, "x_b_max": 0.6},
        {"theta_error": 0.3},
        {"status": bk.Status.HORIZON},
        {"d": 2.3, "H": 3.0},
        {"crush_max": 3.0},
        {"known_shape": 0.0},
        {"flat_foot": 0.0},
        {"x_v_max": 5.5},
        {"theta_max": 0.4},
        {"t_end": np.inf},
    ]
    rules = (VALIDITY, NUMERICAL_ERROR, UNPROVED, OVERRIDE, CRUSH, SHAPE, FOOT, PENETRATION, OVERTURNS, NOT_COMPUTED)
    together = {}
    for changed, rule in zip(worse, rules, strict=True):
        together |= changed
        assert ruling(**together)[0] == rule
    assert ruling(**together | {"status": bk.Status.NO_CONTACT})[0] == NO_CONTACT


@pytest.mark.parametrize(
    ("rule", "ratio", "slide", "asked"),
    [
        (PASSES, 0.44, 0.31, True),
        (VALIDITY, 0.34, 0.6, True),
        (PASSES, 0.46, 0.31, False),
        (PASSES, 0.44, 0.29, False),
        (UNPROVED, 0.3, 1.0, False),
        (OVERTURNS, 0.3, 1.0, False),
    ],
)
def test_slower_trucks_are_asked_about_shallow_boulders_that_slide(rule, ratio, slide, asked):
    assert plain(is_asked_slower)(rule, ratio, slide) == asked
    assert plain(is_asked_slower)(np.array([rule]), np.array([ratio]), np.array([slide])).tolist() == [asked]


@pytest.mark.parametrize(
    ("rule", "slower", "after"),
    [
        (PASSES, PASSES, PASSES),
        (VALIDITY, PASSES, VALIDITY),
        (PASSES, OVERTURNS, SLOWER_TRUCK),
        (VALIDITY, OVERTURNS, SLOWER_TRUCK),
        (PASSES, PENETRATION, SLOWER_TRUCK),
        (SLOWER_TRUCK, PASSES, SLOWER_TRUCK),
        (SLOWER_TRUCK, UNPROVED, SLOWER_TRUCK),
        (PASSES, UNPROVED, UNPROVED),
        (UNPROVED, OVERTURNS, SLOWER_TRUCK),
        (PASSES, NOT_COMPUTED, NUMERICAL_ERROR),
        (PASSES, VALIDITY, VALIDITY),
    ],
)
def test_the_worst_of_the_slower_trucks_decides(rule, slower, after):
    assert plain(after_slower)(rule, slower) == after


def test_slower_trucks_go_down_by_two_percent_to_half_the_speed():
    assert np.allclose(np.diff(SLOWER_SPEEDS[:25]), -0.02)
    assert SLOWER_SPEEDS[0] == 0.98
    assert SLOWER_SPEEDS[24:] == (0.5, 0.4, 0.3)


def test_overlap_penetration_and_margin():
    _, overlap, penetration, margin = ruling()
    assert (overlap, penetration) == pytest.approx((1.0, -2.4))
    assert margin == pytest.approx(min(0.25 / 0.35, 3.4))
    assert ruling(x_v_max=5.2)[3] == pytest.approx(0.2)


def test_a_simulation_has_maxima_where_the_table_says_so():
    assert [status for status in bk.Status if is_simulated(status)] == sorted(bk.SIMULATED)


CONTROL = bk.Control(0.012, 1.0, LIMITS.rotation, 0, error_estimate=True)
CONTROLS = [CONTROL, CONTROL._replace(error_estimate=False), CONTROL._replace(last_resort=True, h=0.004)]
COMBINATIONS = list(
    product(
        range(len(RULES)),
        (NOT_COMPUTED, OVERTURNS, PENETRATION, UNPROVED, PASSES),
        bk.Status,
        (0.6, 1.5),
        range(AGREEING + 1),
        (True, False),
    )
)


@pytest.mark.parametrize("control", CONTROLS)
def test_what_is_asked_of_one_row_in_the_page_is_asked_of_many_in_a_table(control):
    """The same functions take numbers there, and arrays here."""
    columns = [np.array(values) for values in zip(*COMBINATIONS, strict=True)]

    def answers(before, after, status, t_end, unconfirmed, flag):
        row = Confirmation(unconfirmed, 0.006 + 0.004 * flag, flag)
        needed = plain(confirmations)(after, t_end, control)
        known, replaces = plain(after_finer)(row, before, after, np.logical_not(flag), needed, control)
        return (needed, plain(is_wanted)(row, before, status, control), replaces, *known)

    together = answers(*columns)
    alone = [answers(*combination) for combination in COMBINATIONS]
    for many, one_by_one in zip(together, zip(*alone, strict=True), strict=True):
        assert np.array_equal(many, np.array(one_by_one))


@pytest.mark.parametrize(
    ("rule", "t_end", "control", "expected"),
    [
        (PASSES, 1.5, CONTROL, AGREEING),
        (OVERTURNS, 1.5, CONTROL, AGREEING),
        (PASSES, 1.0, CONTROL, 0),
        (PENETRATION, 1.5, CONTROL, 1),
        (CRUSH, 1.5, CONTROL, 0),
        (UNPROVED, 10.0, CONTROL, 0),
        (PASSES, 1.5, CONTROLS[1], 0),
    ],
)
def test_a_row_that_passes_or_fails_past_the_horizon_needs_others_that_agree(rule, t_end, control, expected):
    assert plain(confirmations)(rule, t_end, control) == expected


def solution(**changed):
    return bk.OutcomeTable(**(STANDS | changed))


@pytest.mark.parametrize(
    ("coarse", "fine", "expected"),
    [
        ({}, {}, True),
        ({}, {"theta_max": 0.1 + 0.9e-5}, True),
        ({}, {"theta_max": 0.1 + 1.1e-5}, False),
        ({"theta_error": 0.0}, {"theta_max": 0.1 + 0.9e-6}, True),
        ({}, {"x_b_max": 0.2 + 0.9e-4, "x_v_max": 2.0 + 0.9e-4}, True),
        ({}, {"x_b_max": 0.2 + 1.1e-4}, False),
        ({}, {"x_v_max": 2.0 + 1.1e-4}, False),
        ({"x_error": 1e-3}, {"x_v_max": 2.0 + 0.9e-3}, True),
        ({}, {"x_error": np.inf}, False),
        ({}, {"status": bk.Status.LIMIT, "t_limit": 1.2}, False),
        ({"status": bk.Status.LIMIT, "t_limit": 1.2}, {"status": bk.Status.LIMIT, "t_limit": 1.2 + 0.9e-5}, True),
        ({"status": bk.Status.LIMIT, "t_limit": 1.2}, {"status": bk.Status.LIMIT, "t_limit": 1.2 + 1.1e-5}, False),
    ],
)
def test_solutions_agree_within_the_error_of_the_coarser(coarse, fine, expected):
    """At 10 m/s 1e-5 s are 1e-4 m, the least by which two ways may differ."""
    assert plain(agree)(solution(**coarse), solution(**fine), 10.0) == expected
