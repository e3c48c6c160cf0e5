"""The truck (Eqs 40 to 48) against the oracle: levers, contact point, and Eq 45 as an exact derivative."""

from math import pi
from typing import NamedTuple

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import (
    TURNING_FORWARD,
    Modes,
    State,
    acceleration,
    contact_displacement,
    contact_lever,
    spring_compression,
    switches_of,
)
from tests import oracle
from tests.oracle.constants import impact_lever
from tests.oracle.vehicle import crush_force, jerk

from .samples import (
    ALL_READINGS,
    compression,
    design_of,
    inputs_of,
    literal_state,
    oracle_readings,
    random_designs,
    random_state,
)

DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(8, seed=31)]
TURNS = np.linspace(-pi, pi, 41)


@pytest.mark.parametrize("readings", ALL_READINGS[::4])
def test_lever_of_the_blow(readings: bk.Readings) -> None:
    """R_v cos(gamma_v + theta) of Eqs 45 and 48, right in every quadrant."""
    for design in DESIGNS:
        c = constants_of(design, readings, 0)
        known = oracle.constants(inputs_of(design), oracle_readings(readings))
        for theta in TURNS:
            found = contact_lever(np.sin(theta), 1.0 - np.cos(theta), c)
            assert found == pytest.approx(impact_lever(known, theta), abs=1e-14)


@pytest.mark.parametrize("readings", ALL_READINGS[::4])
def test_contact_point_moves_by_the_integral_of_the_lever(readings: bk.Readings) -> None:
    for design in DESIGNS:
        c = constants_of(design, readings, 0)
        problem = oracle.problem(inputs_of(design), oracle_readings(readings))
        for theta in TURNS:
            found = contact_displacement(0.3, np.sin(theta), 1.0 - np.cos(theta), c)
            state = np.array([0.3, 0.0, theta, 0.0, 0.0, 0.0, 0.0])
            known = oracle.dynamics.contact_displacement(problem, state)
            assert found == pytest.approx(known, abs=1e-14)
        quadrature, weights = np.polynomial.legendre.leggauss(12)
        turn = 0.9 * (quadrature + 1.0) / 2.0
        lever = np.array([contact_lever(np.sin(a), 1.0 - np.cos(a), c) for a in turn])
        moved = contact_displacement(0.0, np.sin(0.9), 1.0 - np.cos(0.9), c)
        assert moved == pytest.approx(np.sum(weights * lever) * 0.45, abs=1e-12)


def test_force_is_mass_times_deceleration() -> None:
    """F_v = k_v u (Eqs 18, 41, 46) pushes the boulder as hard as it slows the truck, m_v x_v'' = -F_v (Eqs 17, 47)."""
    rng = np.random.default_rng(33)
    for design in DESIGNS:
        c = constants_of(design, bk.corrected(), 0)
        for _ in range(20):
            y = random_state(rng)
            known = crush_force(design.m_v, float(literal_state(y, c)[6]))
            s = switches_of(Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0), bk.corrected(), c)
            apart = s._replace(k_contact=0.0)
            found, without = acceleration(y, s, c), acceleration(y, apart, c)
            assert -design.m_v * found.a_v == pytest.approx(known, rel=1e-12)
            assert c.m_eff * (found.a_b - without.a_b) == pytest.approx(known, rel=1e-8, abs=1e-3)


class Nearby(NamedTuple):
    """A motion about a state, to second order in time: all that a first derivative of the acceleration needs."""

    y: State
    a_b: float
    alpha_b: float
    a_v: float
    constants: bk.Constants

    def truck_acceleration(self, t: float) -> float:
        """Acceleration of the truck by the integrated form at a small time t [s]."""
        y, c = self.y, self.constants
        x_b = y.x_b + y.v_b * t + self.a_b * t * t / 2
        theta = y.theta_b + y.omega_b * t + self.alpha_b * t * t / 2
        x_v, v_v = y.x_v + y.v_v * t + self.a_v * t * t / 2, y.v_v + self.a_v * t
        x_c = contact_displacement(x_b, np.sin(theta), 1.0 - np.cos(theta), c)
        return float(-c.k_m * spring_compression(x_v, v_v, x_c, c))


@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()])
def test_eq_45_is_the_derivative_of_the_integrated_form(readings: bk.Readings) -> None:
    """m_v x_v'' = -k_v u with u = x_v - x_c - (m_v/c_v)(v_0 - x_v'), differentiated in time, is Eq 45.

    Whatever the boulder does, with the truck following the integrated form a difference quotient of x_v'' equals
    the oracle's `jerk`; and at the first touch the spring is unloaded.
    """
    rng = np.random.default_rng(34)
    h = 1e-6
    for design in DESIGNS:
        c = constants_of(design, readings, 0)
        assert compression(State(0.0, 0.0, 0.0, 0.0, 0.0, design.v_0), c) == 0.0
        for _ in range(20):
            y = random_state(rng)
            a_v = -c.k_m * compression(y, c)
            nearby = Nearby(y, 30.0 * rng.normal(), 40.0 * rng.normal(), a_v, c)
            quotient = (nearby.truck_acceleration(h) - nearby.truck_acceleration(-h)) / (2 * h)
            v_c = y.v_b + y.omega_b * contact_lever(np.sin(y.theta_b), 1.0 - np.cos(y.theta_b), c)
            known = jerk(design.m_v, design.k_v, design.c_v, a_v, y.v_v, v_c)
            size = c.k_m * (abs(y.v_v) + abs(v_c) + c.tau_v * abs(a_v))
            assert quotient == pytest.approx(known, abs=1e-7 * size)
