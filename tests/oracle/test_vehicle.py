"""The Maxwell element and its impact on a rigid wall (Eqs 40 to 51)."""

from math import inf, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.oracle.vehicle import WallImpact, jerk, spring_and_damper

PAPER = WallImpact(m_v=6800.0, v_0=13.4, k_v=3103.3e3, c_v=138.91e3)
CRITICAL_DAMPER = sqrt(3103.3e3 * 6800.0) / 2


def test_figures_of_the_papers_truck() -> None:
    x, t_x = PAPER.largest_displacement()
    force, t_force = PAPER.peak_force()
    t_off, v_off = PAPER.separation()
    found = [PAPER.a, PAPER.b, x, t_x, force / 1e3, t_force, t_off, v_off]
    known = [-11.170, 18.210, 0.8267, 0.1165, 1040.8, 0.0560, 0.1725, -1.951]
    half_digit = [5e-4, 5e-4, 5e-5, 5e-5, 0.05, 5e-5, 5e-5, 5e-4]
    for value, figure, tolerance in zip(found, known, half_digit, strict=True):
        assert value == pytest.approx(figure, abs=1.02 * tolerance)


@pytest.mark.parametrize("c_v", [5 * CRITICAL_DAMPER, 138.91e3, CRITICAL_DAMPER, 0.5 * CRITICAL_DAMPER, 2e3])
def test_exact_response_solves_eq_45(c_v: float) -> None:
    """Under-, critically and over-damped, against integrating Eq 45 with a contact that does not move."""
    wall = WallImpact(6800.0, 13.4, 3103.3e3, c_v)
    t = np.linspace(0.0, 0.3, 61)
    solved = solve_ivp(
        lambda _t, y: [y[1], y[2], jerk(wall.m_v, wall.k_v, wall.c_v, y[2], y[1], 0.0)],
        (0.0, 0.3),
        [0.0, wall.v_0, 0.0],
        method="DOP853",
        t_eval=t,
        rtol=1e-11,
        atol=1e-11,
    )
    for exact, integrated, scale in zip(wall.response(t), solved.y, (1.0, 10.0, 200.0), strict=True):
        assert exact == pytest.approx(integrated, abs=1e-7 * scale)


@pytest.mark.parametrize("c_v", [138.91e3, CRITICAL_DAMPER, 0.5 * CRITICAL_DAMPER])
def test_extremes_are_those_of_the_response(c_v: float) -> None:
    wall = WallImpact(6800.0, 13.4, 3103.3e3, c_v)
    force, time = wall.peak_force()
    t = np.linspace(0.0, 3.0, 300_001)
    x, _, a = wall.response(t)
    assert force == pytest.approx(np.max(-wall.m_v * a), rel=1e-7)
    assert time == pytest.approx(t[np.argmin(a)], abs=2e-5)
    if wall.discriminant < 0:
        x = x[t <= wall.separation()[0]]
    assert wall.largest_displacement()[0] == pytest.approx(x.max(), rel=1e-7)


def test_an_over_damped_vehicle_never_rebounds() -> None:
    wall = WallImpact(6800.0, 13.4, 3103.3e3, 0.5 * CRITICAL_DAMPER)
    assert wall.separation() == (inf, 0.0)
    assert np.all(wall.response(np.linspace(0.0, 5.0, 1001))[2] <= 0.0)


def test_fitting_constants_give_spring_and_damper_back() -> None:
    k_v, c_v = spring_and_damper(PAPER.m_v, PAPER.a, PAPER.b)
    assert k_v == pytest.approx(PAPER.k_v, rel=1e-13)
    assert c_v == pytest.approx(PAPER.c_v, rel=1e-13)
