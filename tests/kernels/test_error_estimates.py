"""The error of one solution, and which designs have a second one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import RK45

import boulder_kernels as bk
from boulder_kernels import Status
from boulder_kernels._jit import plain
from boulder_kernels.control import control_for
from boulder_kernels.design import error_arm
from boulder_kernels.dormand_prince import ERROR
from boulder_kernels.outcomes import (
    AT_LIMIT,
    AT_LIMIT_AFTER_CHANGES,
    CHATTERING,
    CHATTERING_T,
    CHATTERING_THETA,
    CHATTERING_X,
    COARSER,
    FINER,
    LEAST_CONFIRMED_M,
    LEAST_IF_DOUBTFUL,
    LEAST_ROTATION,
    LONG_MOTION,
    NONE_NEEDED,
    PAIR,
    ROCKING,
    SAFETY,
    SAFETY_CONFIRMED,
    THETA_MAX,
    YIELD_LOCATED,
    YIELD_PASSED,
    error_time,
    no_maxima,
    outcome_table,
    step_errors,
)
from boulder_kernels.table import is_paired, solve, step_of_solution
from tests import oracle

from .samples import control, design_of, random_designs, table_of

LIMIT = np.radians(20.0)
CORRECTED = bk.corrected()


def test_the_weights_are_those_of_scipy() -> None:
    """SciPy has the fourth-order weights less the fifth-order weights."""
    assert np.allclose(ERROR, -RK45.E, rtol=1e-15, atol=0.0)


@dataclass(frozen=True)
class EndOfMotion:
    """How a motion ended, where it does not matter more."""

    status: Status = Status.SETTLED
    theta: float = 0.1
    t_end: float = 0.4
    moved: float = 1e-6
    omega_b: float = 1.0
    changes: float = 0.0


DESIGN = design_of(oracle.RWG)._replace(L=1.0, H=3.0, d=1.6, m_v=6800.0, k_v=3e6, v_0=13.0)
ARM = 1.6


def errors(ended: EndOfMotion, **changed: float) -> tuple[float, float, int]:
    m = no_maxima()._replace(theta=ended.theta, x_b=0.2)
    o = bk.Outcome(ended.status, m, np.nan, ended.t_end, 100, ended.moved, ended.omega_b, ended.changes)
    return step_errors(o, DESIGN._replace(**changed), LIMIT, 2.0)


@pytest.mark.parametrize(
    ("ended", "changed", "factor"),
    [
        (EndOfMotion(), {}, 1.0),
        (EndOfMotion(changes=3.0), {}, 1.0),
        (EndOfMotion(t_end=1.0), {}, LONG_MOTION),
        (EndOfMotion(t_end=0.6), {}, LONG_MOTION),
        (EndOfMotion(t_end=0.49), {"H": 4.0}, 1.0),
        (EndOfMotion(), {"m_v": 15e3}, 1.0),
        (EndOfMotion(changes=1.0), {"m_v": 15e3}, LONG_MOTION),
    ],
)
def test_a_long_motion_has_a_larger_error(ended: EndOfMotion, changed: dict[str, float], factor: float) -> None:
    theta, x, _ = errors(ended, **changed)
    assert x == pytest.approx(factor * 1e-6)
    assert theta == pytest.approx(factor * 1e-6 / max(ARM, 0.5 * changed.get("H", 3.0)))


@pytest.mark.parametrize(("changes", "factor"), [(0.0, AT_LIMIT), (1.0, AT_LIMIT_AFTER_CHANGES)])
def test_at_the_limit_the_time_is_uncertain_too(changes: float, factor: float) -> None:
    theta, x, _ = errors(EndOfMotion(Status.LIMIT, theta=LIMIT, omega_b=-2.0, changes=changes))
    assert theta == 0.0
    assert x == pytest.approx(factor * 1e-6 * (1.0 + 13.0 / (2.0 * ARM)))


def test_a_boulder_that_hardly_turns_has_no_large_error_of_its_rotation() -> None:
    assert errors(EndOfMotion(theta=1e-9, moved=1.0))[0] == LEAST_ROTATION


def test_a_boulder_that_rocks_has_a_least_error_of_its_rotation() -> None:
    """However short the steps; at the limit it has none."""
    for status, changes, expected in (
        (Status.SETTLED, ROCKING + 1.0, LEAST_IF_DOUBTFUL),
        (Status.SETTLED, float(ROCKING), 1e-12 / ARM),
        (Status.LIMIT, ROCKING + 1.0, 0.0),
    ):
        assert errors(EndOfMotion(status, moved=1e-12, changes=changes))[0] == pytest.approx(expected, rel=1e-12)


def test_a_boulder_that_chatters_has_an_error_of_a_fraction() -> None:
    theta, x, _ = errors(EndOfMotion(changes=CHATTERING + 1.0))
    assert (theta, x) == (pytest.approx(CHATTERING_THETA * 0.1), pytest.approx(CHATTERING_X * 0.2))
    theta, x, _ = errors(EndOfMotion(Status.LIMIT, t_end=1.5, changes=CHATTERING + 1.0))
    assert (theta, x) == (0.0, pytest.approx(CHATTERING_T * 13.0 * 1.5))


@pytest.mark.parametrize(
    ("ended", "changed"),
    [
        (EndOfMotion(changes=ROCKING + 1.0), {}),
        (EndOfMotion(t_end=1.1), {"H": 3.9}),
        (EndOfMotion(changes=1.0), {"H": 3.9}),
        (EndOfMotion(t_end=1.1), {"L": 2.2}),
        (EndOfMotion(changes=1.0), {"L": 2.2}),
        (EndOfMotion(changes=1.0), {"m_v": 15e3}),
        (EndOfMotion(Status.LIMIT), {"H": 5.5}),
        (EndOfMotion(), {"m_v": 40e3}),
        (EndOfMotion(Status.LIMIT, changes=1.0), {"m_v": 40e3}),
        (EndOfMotion(theta=np.radians(15.0), moved=2e-3), {}),
        (EndOfMotion(Status.LIMIT, omega_b=0.05), {}),
    ],
)
def test_what_needs_a_finer_solution(ended: EndOfMotion, changed: dict[str, float]) -> None:
    assert errors(ended, **changed)[2] == FINER


def test_what_needs_a_coarser_one() -> None:
    assert errors(EndOfMotion(theta=np.radians(19.1)))[2] == COARSER
    assert errors(EndOfMotion(t_end=2.1, changes=ROCKING + 1.0))[2] == PAIR


@pytest.mark.parametrize(
    ("ended", "changed"),
    [
        (EndOfMotion(), {}),
        (EndOfMotion(changes=float(ROCKING)), {}),
        (EndOfMotion(t_end=1.1), {}),
        (EndOfMotion(t_end=0.9), {"H": 3.9}),
        (EndOfMotion(t_end=0.9), {"L": 2.2}),
        (EndOfMotion(t_end=1.1), {"L": 2.0}),
        (EndOfMotion(changes=1.0), {"L": 2.0}),
        (EndOfMotion(t_end=0.9), {"m_v": 15e3}),
        (EndOfMotion(Status.LIMIT), {}),
        (EndOfMotion(Status.LIMIT, changes=1.0), {"L": 2.2}),
        (EndOfMotion(Status.LIMIT, changes=1.0), {"m_v": 15e3}),
        (EndOfMotion(Status.LIMIT), {"m_v": 40e3}),
        (EndOfMotion(theta=np.radians(18.9)), {}),
    ],
)
def test_what_needs_none(ended: EndOfMotion, changed: dict[str, float]) -> None:
    assert errors(ended, **changed)[2] == NONE_NEEDED


def test_the_error_of_the_steps_is_of_fourth_order() -> None:
    design = design_of(oracle.RWG)._replace(v_0=3.0)
    hows = [control(h, 0.1)._replace(locate_yield=True) for h in (8e-3, 4e-3, 2e-3, 1e-3)]
    moved = [bk.simulate_design(design, CORRECTED, how, bk.no_record()).moved for how in hows]
    assert np.allclose(np.log2(np.divide(moved[:-1], moved[1:])), 4.0, atol=0.2)


def test_some_designs_are_solved_twice() -> None:
    """Doubtful ones are reported by the second solution; of all, the difference from the first is within the error."""
    table = table_of(random_designs(3000, seed=171))
    how = control(0.012, 1.0, LIMIT, stop_at_limit=True, error_estimate=True)
    hows = [plain(control_for)(solution, how) for solution in (NONE_NEEDED, FINER, COARSER)]
    (first, needed), *others = [solve(table, CORRECTED, one) for one in hows]
    first, finer, coarser = (outcome_table(out) for out in (first, *(out for out, _ in others)))
    found = bk.simulate_table(table, CORRECTED, how)
    assert set(needed) == {NONE_NEEDED, FINER, COARSER}
    assert np.mean(needed != NONE_NEEDED) < 0.05
    for name in ("status", "theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max", "t_limit", "t_end", "step"):
        expected = np.where(needed == FINER, getattr(finer, name), getattr(first, name))
        assert np.array_equal(getattr(found, name), expected, equal_nan=True), name
    once = needed == NONE_NEEDED
    assert np.array_equal(found.x_error[once], first.x_error[once], equal_nan=True)
    for kind, one, other, safety in ((FINER, first, finer, SAFETY_CONFIRMED), (COARSER, coarser, first, SAFETY)):
        rows = needed == kind
        apart = np.abs(one.x_v_max - other.x_v_max)[rows]
        assert (found.x_error[rows] >= np.maximum(safety * apart, LEAST_CONFIRMED_M)).all()
        assert (found.x_error[rows] >= other.x_error[rows]).all()
    assert [step_of_solution(one) for one in hows] == [0.004, 0.002, 0.012]


def test_a_second_solution_that_cannot_be_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Then a coarser one gives the error, and the first is reported."""
    table = table_of([design_of(oracle.RWG)])
    how = control(0.012, 1.0, LIMIT, stop_at_limit=True, error_estimate=True)
    first, _ = solve(table, CORRECTED, plain(control_for)(NONE_NEEDED, how))

    def failing(table: bk.DesignTable, readings: bk.Readings, how: bk.Control) -> object:
        out, _ = solve(table, readings, how)
        if how.h < 0.012:
            out[THETA_MAX:] = np.nan
        return out, np.full(1, float(FINER))

    monkeypatch.setattr("boulder_kernels.table.solve", failing)
    found = bk.simulate_table(table, CORRECTED, how)
    assert found.theta_max == first[THETA_MAX]
    assert found.step == 0.004
    assert 0.0 < found.x_error < 1e-3


def test_where_all_designs_are_solved_twice() -> None:
    how = control(0.012, 1.0, LIMIT, error_estimate=True)
    assert not is_paired(CORRECTED, how, layered=False)
    assert is_paired(CORRECTED, how, layered=True)
    assert not is_paired(CORRECTED._replace(inertia_box=False), how, layered=False)
    assert is_paired(CORRECTED._replace(restoring_gravity=False), how, layered=False)
    assert is_paired(CORRECTED._replace(separation_released=False), how, layered=False)
    for changed in ({"elements": 50}, {"paired": True}, {"last_resort": True}):
        assert is_paired(CORRECTED, how._replace(**changed), layered=False)


def test_the_time_of_an_error() -> None:
    assert error_time(0.012, False) == pytest.approx(0.1)
    assert error_time(0.004, False) == pytest.approx(YIELD_PASSED / 0.004)
    assert error_time(0.004, True) == YIELD_LOCATED
    c = bk.constants_of(DESIGN, CORRECTED, 0)
    assert error_arm(c) == max(c.d, c.c_y)
