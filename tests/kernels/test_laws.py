"""Laws that hold whatever the numbers, and those that one would expect and that do not quite hold."""

from collections.abc import Callable

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Design, Status
from tests import oracle
from tests.oracle.records import recorded_impact

from .samples import (
    ALL_READINGS,
    BUMPER,
    control,
    design_of,
    inputs_of,
    oracle_readings,
    random_designs,
    table_of,
)

LIMIT = np.radians(60.0)
NOISE = np.radians(1e-4)


def largest_rotations(designs: list[Design], readings: bk.Readings) -> np.ndarray:
    """Largest rotations of many designs [rad]."""
    how = control(1e-3, 1.0, LIMIT, stop_at_limit=True)
    return bk.simulate_table(table_of(designs), readings, how).theta_max


# units


def in_other_units(design: Design, length: float, density: float) -> Design:
    """Return the design scaled so that it is the same motion in other units of length, time and mass.

    Gravity stays 9.80665, so times go with the square root of lengths (Froude); beta is a force per volume.
    """
    time = np.sqrt(length)
    mass = density * length**3
    return Design(
        L=design.L * length,
        W=design.W * length,
        H=design.H * length,
        rho_b=design.rho_b * density,
        d=design.d * length,
        e=design.e * length,
        rho_s=design.rho_s * density,
        phi=design.phi,
        beta=design.beta * density,
        K_epsilon=design.K_epsilon,
        m_v=design.m_v * mass,
        v_0=design.v_0 * length / time,
        k_v=design.k_v * mass / time**2,
        c_v=design.c_v * mass / time,
        e_bumper=design.e_bumper * length,
    )


@pytest.mark.parametrize(("length", "density"), [(4.0, 1.0), (1.0, 1e3), (0.01, 7.0), (1 / 0.3048, 0.0624)])
@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()], ids=["as_printed", "corrected"])
def test_other_units_give_the_same_motion(readings: bk.Readings, length: float, density: float) -> None:
    """Expect equal rotation and status; displacements, times and force in the new units."""
    time, force = np.sqrt(length), density * length**3 * length / length
    for design in random_designs(10, seed=101):
        here = bk.simulate_design(design, readings, control(1e-3, 0.5, LIMIT, stop_at_limit=True), bk.no_record())
        there = bk.simulate_design(
            in_other_units(design, length, density),
            readings,
            control(1e-3 * time, 0.5 * time, LIMIT, stop_at_limit=True),
            bk.no_record(),
        )
        assert there.status == here.status
        a, b = here.maxima, there.maxima
        assert b.theta == pytest.approx(a.theta, rel=1e-6, abs=1e-12)
        assert (b.x_b / length, b.x_v / length) == pytest.approx((a.x_b, a.x_v), rel=1e-6)
        assert b.F_v / force == pytest.approx(a.F_v, rel=1e-6)
        assert there.t_end / time == pytest.approx(here.t_end, rel=1e-6)


# more of one thing


def changed(design: Design, **factors: float) -> Design:
    """Return the design with some values multiplied, hit where Eq 9 says."""
    other = design._replace(**{name: getattr(design, name) * factor for name, factor in factors.items()})
    if "d" in factors:
        other = other._replace(e=0.5 * (min(other.H - other.d, 1.4) + BUMPER))
    return other


def turns_further(designs: list[Design], readings: bk.Readings, change: Callable[[Design], Design]) -> np.ndarray:
    """Which designs turn further after a change."""
    before = largest_rotations(designs, readings)
    after = largest_rotations([change(design) for design in designs], readings)
    return after > before + NOISE


MANY = random_designs(400, seed=102)
CHANGES = {
    "slower truck": lambda design: changed(design, v_0=0.98),
    "heavier boulder": lambda design: changed(design, rho_b=1.05),
    "deeper embedment": lambda design: changed(design, d=1.02),
    "wider boulder": lambda design: changed(design, W=1.02),
    "lighter truck": lambda design: changed(design, m_v=0.98),
    "stiffer soil": lambda design: changed(design, beta=1.05),
}


def test_a_slower_truck_never_turns_a_boulder_further() -> None:
    """No exception among 20 000 random designs either (corrected readings)."""
    assert not np.any(turns_further(MANY, bk.corrected(), CHANGES["slower truck"]))


@pytest.mark.parametrize("name", CHANGES)
def test_what_strengthens_a_barrier_hardly_ever_weakens_it(name: str) -> None:
    """Under 2 % of random designs turn further for it (corrected readings; of 20 000 at most 0.7 % did)."""
    assert np.mean(turns_further(MANY, bk.corrected(), CHANGES[name])) < 0.02


HEAVIER_TURNS_FURTHER = Design(
    L=0.745,
    W=1.457,
    H=2.959,
    rho_b=2897.0,
    d=1.839,
    e=0.81,
    rho_s=1976.0,
    phi=0.6735,
    beta=3.939,
    K_epsilon=1.119,
    m_v=5999.0,
    v_0=10.15,
    k_v=3.605e6,
    c_v=2.216e5,
    e_bumper=0.5,
)
"""Turned to 57 degrees, far beyond its tipping angle of 14, it is driven on by its weight."""

DEEPER_TURNS_FURTHER = Design(
    L=1.862,
    W=2.028,
    H=2.152,
    rho_b=2884.0,
    d=0.9422,
    e=0.8549,
    rho_s=1630.0,
    phi=0.4956,
    beta=30.48,
    K_epsilon=1.012,
    m_v=5241.0,
    v_0=8.646,
    k_v=4.211e6,
    c_v=1.834e5,
    e_bumper=0.5,
)
"""Long, low and shallow: 44 % of its height in the ground it turns by 12.7 degrees, 45 % in the ground by 14.3."""


@pytest.mark.parametrize(
    ("design", "name", "least"),
    [(HEAVIER_TURNS_FURTHER, "heavier boulder", 0.5), (DEEPER_TURNS_FURTHER, "deeper embedment", 1.0)],
    ids=["heavier", "deeper"],
)
def test_counterexamples(design: Design, name: str, least: float) -> None:
    """More weight and deeper embedment are no laws: these two turn further for it, by the oracle too."""
    known = oracle_readings(bk.corrected())
    turned = [
        np.degrees(recorded_impact(inputs_of(d), known, horizon=1.0, rotation_limit=LIMIT).max_rotation.value)
        for d in (design, CHANGES[name](design))
    ]
    assert turned[1] > turned[0] + least
    found = np.degrees(largest_rotations([design, CHANGES[name](design)], bk.corrected()))
    assert found == pytest.approx(turned, abs=1e-3)


# nothing from nothing


@pytest.mark.parametrize("readings", ALL_READINGS)
def test_a_truck_that_stands_moves_nothing(readings: bk.Readings) -> None:
    design = design_of(oracle.RWG)._replace(v_0=np.float64(0.0))
    found = bk.simulate_design(design, readings, control(1e-2, 0.2, stop_at_limit=True), bk.no_record())
    assert found.status in (Status.BELOW_LIMIT, Status.UNPROVABLE)
    assert (found.maxima.theta, found.maxima.x_b, found.maxima.x_v, found.maxima.F_v) == (0.0, 0.0, 0.0, 0.0)


def test_a_boulder_that_is_held_does_not_turn() -> None:
    """A push that the weight can hold moves the boulder sideways and leaves it upright, exactly."""
    design = design_of(oracle.RWG)._replace(v_0=np.float64(0.2))
    found = bk.simulate_design(design, bk.corrected(), control(1e-3, 0.2), bk.no_record())
    assert found.maxima.theta == 0.0
    assert found.maxima.x_b > 0.0


def test_a_truck_that_passes_over_is_not_integrated() -> None:
    design = design_of(oracle.RWG, e_bumper=1.42)
    assert design.H - design.d <= design.e_bumper
    found = bk.simulate_design(design, bk.corrected(), control(), bk.no_record())
    assert found.status == Status.NO_CONTACT
    assert found.attempts == 0
    assert np.all(np.isnan([*found.maxima, found.t_end, found.t_limit]))
