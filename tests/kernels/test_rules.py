"""The rules of the verdict on single rows: each alone, the worst of several, and which rows need another solution."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels._jit import plain
from boulder_kernels.numerics import record_type, records_of
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
    SHAPE,
    SLOWER_SPEEDS,
    SLOWER_TRUCK,
    UNPROVED,
    VALIDITY,
    Course,
    Rows,
    Sizes,
    VerdictLimits,
    agree,
    confirmations,
    consider,
    is_asked_slower,
    is_simulated,
    is_wanted,
    rule_by_slower,
)

LIMITS = VerdictLimits(rotation=0.35, penetration=1.0, guarded=True, min_overlap_m=0.25)
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
BOULDER = {
    "L": 1.5, "H": 3.0, "d": 1.5, "e_bumper": 0.5, "bed_offset": 2.9, "v_0": 10.0, "flat_foot": 1.0, "known_shape": 1.0,
}  # fmt: skip
CONTROL = bk.Control(0.012, 1.0, LIMITS.rotation, 0, error_estimate=True)


def column(record, **changed):
    """A row that stands, or its boulder, but for some numbers, as a column of an array."""
    return np.array([[float((STANDS | BOULDER | changed)[name])] for name in record._fields])


def considered(limits, controls, solutions, **changed):
    """Course of a row after each of its solutions, None for a control that is passed over, and what counts then."""
    rows = Rows(column(bk.OutcomeTable), np.zeros(1, record_type(Course)), records_of(Sizes, column(Sizes, **changed)))
    found = []
    for number, solution in enumerate(solutions):
        if solution is not None:
            every = np.array(controls, dtype=float)
            consider(rows, 0, column(bk.OutcomeTable, **solution), 0, number, every, limits)
        found.append(Course(*rows.courses[0]))
    return found, bk.OutcomeTable(*rows.counted[:, 0])


def ruling(**changed):
    """What the rules make of a row that stands but for some numbers."""
    limits = LIMITS._replace(**{name: value for name, value in changed.items() if name in LIMITS._fields})
    (found,), _ = considered(limits, [CONTROL._replace(error_estimate=False)], [changed], **changed)
    return found


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
        ({"theta_error": 0.3, "guarded": False}, PASSES),
        ({"status": bk.Status.LIMIT, "theta_error": np.inf, "guarded": False}, OVERTURNS),
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
    sizes = Sizes(**BOULDER | {"d": ratio * BOULDER["H"]})
    assert plain(is_asked_slower)(rule, solution(x_b_max=slide), sizes) == asked
    if rule == PASSES:
        assert ruling(d=ratio * BOULDER["H"], x_b_max=slide).asked_slower == asked


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
    assert min(rule, plain(rule_by_slower)(slower)) == after


def test_slower_trucks_go_down_by_two_percent_to_half_the_speed():
    assert np.allclose(np.diff(SLOWER_SPEEDS[:25]), -0.02)
    assert SLOWER_SPEEDS[0] == 0.98
    assert SLOWER_SPEEDS[24:] == (0.5, 0.4, 0.3)


def test_overlap_penetration_and_margin():
    found = ruling()
    assert (found.overlap, found.penetration) == pytest.approx((1.0, -2.4))
    assert found.margin == pytest.approx(min(0.25 / 0.35, 3.4))
    assert ruling(x_v_max=5.2).margin == pytest.approx(0.2)
    assert np.isnan(ruling(status=bk.Status.UNSTABLE, x_v_max=np.nan).penetration)


def test_a_simulation_has_maxima_where_the_table_says_so():
    assert [status for status in bk.Status if is_simulated(status)] == sorted(bk.SIMULATED)


LAST = CONTROL._replace(last_resort=True, h=0.001)
CONTROLS = (CONTROL, *(CONTROL._replace(h=0.012 / 2**n) for n in range(1, 4)), LAST, LAST._replace(h=0.00025))
STEPS = len(CONTROLS)


@pytest.mark.parametrize(
    ("row", "status", "control", "wanted"),
    [
        ({"rule": NOT_COMPUTED}, bk.Status.UNSTABLE, CONTROL, True),
        ({"rule": NOT_COMPUTED}, bk.Status.LITTLE_INERTIA, LAST, True),
        ({"rule": NOT_COMPUTED, "given_up": 1.0}, bk.Status.LITTLE_INERTIA, LAST, False),
        ({"rule": NOT_COMPUTED}, bk.Status.INVALID, CONTROL, False),
        ({"rule": NUMERICAL_ERROR}, bk.Status.SETTLED, CONTROL, True),
        ({"rule": NUMERICAL_ERROR}, bk.Status.SETTLED, CONTROL._replace(error_estimate=False), False),
        ({"rule": NUMERICAL_ERROR}, bk.Status.SETTLED, LAST, False),
        ({"rule": PASSES}, bk.Status.SETTLED, CONTROL, False),
        ({"rule": PASSES, "unconfirmed": 1.0, "compared_s": 0.024}, bk.Status.SETTLED, CONTROL, True),
        ({"rule": PASSES, "unconfirmed": 1.0, "compared_s": 0.023}, bk.Status.SETTLED, CONTROL, False),
    ],
)
def test_which_rows_are_solved_again(row, status, control, wanted):
    assert plain(is_wanted)(Course(*[0.0] * len(Course._fields))._replace(**row), status, control) == wanted


LATE = {"t_end": 1.5}
UNLIKE = LATE | {"theta_max": 0.2}
FALLS = LATE | {"status": bk.Status.LIMIT, "theta_max": 0.35, "t_limit": 1.4}
REFUSED = {"status": bk.Status.STIFF_SOIL, "theta_max": np.nan, "theta_error": np.nan, "x_error": np.nan}


@pytest.mark.parametrize(
    ("solutions", "wanted", "rule", "decided_by"),
    [
        # The first decides; late ones when as many others agree as are needed.
        ([{}], [STEPS], PASSES, 0),
        ([LATE, LATE, LATE], [1, 2, STEPS], PASSES, 0),
        ([FALLS, FALLS, FALLS], [1, 2, STEPS], OVERTURNS, 0),
        ([LATE | {"x_v_max": 5.5}] * 2, [1, STEPS], PENETRATION, 0),
        ([LATE | {"crush_max": 3.0}], [STEPS], CRUSH, 0),
        # One that differs takes the place of what counted so far.
        ([LATE, UNLIKE, UNLIKE, UNLIKE], [1, 2, 3, STEPS], PASSES, 1),
        ([LATE, LATE, FALLS, FALLS], [1, 2, 3, 5], OVERTURNS, 2),
        # Where too few agree in the end nothing is decided.
        ([LATE, UNLIKE, LATE, UNLIKE], [1, 2, 3, 5], PASSES, 3),
        ([LATE, UNLIKE, LATE, UNLIKE, None, LATE], [1, 2, 3, 5, 5, STEPS], NUMERICAL_ERROR, 5),
        # Refused ones are tried by each, and one that fails changes nothing.
        ([REFUSED, {}], [1, STEPS], PASSES, 1),
        ([REFUSED] * 5, [1, 2, 3, 4, STEPS], NOT_COMPUTED, 0),
        ([LATE, REFUSED, LATE, LATE], [1, 2, 3, STEPS], PASSES, 0),
        ([{"theta_error": 0.3}, {"theta_error": 0.3}, {}], [1, 2, STEPS], PASSES, 2),
    ],
)
def test_the_course_of_a_row(solutions, wanted, rule, decided_by):
    courses, counted = considered(LIMITS, CONTROLS, solutions)
    assert [course.wanted for course in courses] == wanted
    assert (courses[-1].rule, courses[-1].decided_by) == (rule, decided_by)
    assert np.isinf(counted.theta_error) == np.isinf(counted.x_error) == (rule == NUMERICAL_ERROR)


@pytest.mark.parametrize(
    ("rule", "t_end", "control", "expected"),
    [
        (PASSES, 1.5, CONTROL, AGREEING),
        (OVERTURNS, 1.5, CONTROL, AGREEING),
        (PASSES, 1.0, CONTROL, 0),
        (PENETRATION, 1.5, CONTROL, 1),
        (CRUSH, 1.5, CONTROL, 0),
        (UNPROVED, 10.0, CONTROL, 0),
        (PASSES, 1.5, CONTROL._replace(error_estimate=False), 0),
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
