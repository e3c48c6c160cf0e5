"""Heave, a base that only pushes, and friction: forces, accelerations and energies against the oracle."""

from __future__ import annotations

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import State
from boulder_kernels.heave import (
    FINEST,
    GROUP,
    ROOM,
    SETS,
    Base,
    Forces,
    HeaveConstants,
    HeaveOptions,
    accelerations,
    forces,
    heave_constants,
    prepare,
)
from boulder_kernels.second_opinion import kinetic_energy, potential_energy
from tests import oracle
from tests.oracle.heave import Base as OracleBase
from tests.oracle.heave import Body, loads
from tests.oracle.heave import accelerations as known_accelerations
from tests.oracle.heave import energy as known_energy

from .samples import design_of, inputs_of, random_designs, random_state

FORMS = [HeaveOptions(True, True), HeaveOptions(True, False), HeaveOptions(False, True), HeaveOptions(False, False)]
NAMES = ["heave and friction", "heave", "friction", "neither"]
RISING = pytest.mark.parametrize("form", FORMS[:2], ids=NAMES[:2])
RWG = design_of(oracle.RWG)
BASE = Base()
NOTHING = State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def constants(
    design: bk.Design, form: HeaveOptions, base: Base = BASE, fineness: int = 1, **changes: float
) -> HeaveConstants:
    """Constants of the motion, with some of them changed."""
    return heave_constants(design, constants_of(design, bk.corrected(), 0), form, base, fineness)._replace(**changes)


def workspace(f: HeaveConstants, sets: np.ndarray | None = None) -> np.ndarray:
    work = np.full(ROOM, np.nan)
    prepare(work, f)
    if sets is not None:
        work[SETS : SETS + f.pieces] = sets
    return work


def random_sets(rng: np.random.Generator, pieces: int = GROUP) -> np.ndarray:
    """What strips of the foot are pressed in for good [m], some of them nothing."""
    return np.where(rng.random(pieces) < 0.4, rng.uniform(0.0, 0.01, pieces), 0.0)


def random_motion(rng: np.random.Generator, form: HeaveOptions) -> tuple[State, float, float]:
    """State, rise and its rate: every other one close to rest, where parts of the foot are on the base."""
    y = random_state(rng, (-1.2, 1.2))
    if rng.random() < 0.5:
        y = y._replace(theta_b=float(2e-3 * rng.normal()), x_b=float(0.05 * rng.normal()))
        rise = 1e-3 * rng.normal()
    else:
        rise = 0.3 * rng.normal()
    return y, *((float(rise), float(rng.normal())) if form.heave else (0.0, 0.0))


def forces_at(y: State, rise: float, rate: float, touching: bool, work: np.ndarray, f: HeaveConstants) -> Forces:
    return forces(y.x_b, y.v_b, y.theta_b, y.omega_b, rise, rate, y.x_v, y.v_v, touching, work, f)


def coordinates(y: State, rise: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    return np.array([y.x_b, y.theta_b, rise]), np.array([y.v_b, y.omega_b, rate])


def as_vector(Q: Forces, form: HeaveOptions) -> np.ndarray:
    """Generalised forces by x, theta, y; what would lift a boulder that may not rise counts for nothing."""
    return np.array([Q.Q_x, Q.Q_theta, Q.Q_y if form.heave else 0.0])


@pytest.mark.parametrize("fineness", [1, 2, FINEST])
@pytest.mark.parametrize("form", FORMS, ids=NAMES)
def test_forces_and_accelerations_are_those_of_the_oracle(form: HeaveOptions, fineness: int) -> None:
    rng = np.random.default_rng(251)
    for design in random_designs(4, seed=252):
        f = constants(design, form, fineness=fineness)
        body = Body(inputs_of(design), *form, OracleBase(), fineness)
        for number in range(12):
            sets, (y, rise, rate) = random_sets(rng, f.pieces), random_motion(rng, form)
            touching = number % 3 > 0
            found = forces_at(y, rise, rate, touching, workspace(f, sets), f)
            q, rates = coordinates(y, rise, rate)
            known = loads(body, q, rates, -f.c.k_m * found.u, touching, sets) * [1.0, 1.0, form.heave]
            assert as_vector(found, form) == pytest.approx(known, rel=1e-10, abs=1e-12 * np.abs(known).max())
            a_b, alpha_b, a_y, a_v = accelerations(y.theta_b, y.omega_b, found, touching, f)
            expected = known_accelerations(body, q, rates, known)
            assert [a_b, alpha_b, a_y] == pytest.approx(expected, rel=1e-10, abs=1e-12 * np.abs(expected).max())
            assert a_v == (-f.c.k_m * found.u if touching else 0.0)


@pytest.mark.parametrize("form", FORMS[1::2], ids=NAMES[1::2])
def test_energies_are_those_of_the_oracle(form: HeaveOptions) -> None:
    rng = np.random.default_rng(253)
    for design in random_designs(4, seed=254):
        f = constants(design, form)
        body = Body(inputs_of(design), *form, OracleBase())
        for _ in range(8):
            sets, (y, rise, rate) = random_sets(rng), random_motion(rng, form)
            q, rates = coordinates(y, rise, rate)
            held = potential_energy(y.x_b, y.theta_b, rise, workspace(f, sets), f).u
            moving = kinetic_energy(y.v_b, y.theta_b, y.omega_b, rate, f)
            still = known_energy(body, q, np.zeros(3), sets)
            assert held == pytest.approx(still, rel=1e-10)
            assert moving == pytest.approx(known_energy(body, q, rates, sets) - still, rel=1e-9, abs=1e-10 * still)


@pytest.mark.parametrize("form", FORMS[1::2], ids=NAMES[1::2])
def test_forces_at_rest_are_the_slopes_of_the_energy(form: HeaveOptions) -> None:
    """Soil, base and weight, the couple of a boulder that may not rise included: minus central differences."""
    rng = np.random.default_rng(255)
    for design in random_designs(4, seed=256):
        f = constants(design, form)
        for _ in range(10):
            work, (y, rise, _) = workspace(f, random_sets(rng)), random_motion(rng, form)
            y = State(y.x_b, 0.0, y.theta_b, 0.0, 0.0, 0.0)
            found = as_vector(forces_at(y, rise, 0.0, False, work, f), form)
            q, slopes, step = np.array([y.x_b, y.theta_b, rise]), np.zeros(3), 1e-7
            for axis in range(3 if form.heave else 2):
                ends = [potential_energy(*(q + side * step * np.eye(3)[axis]), work, f).u for side in (-1.0, 1.0)]
                slopes[axis] = (ends[1] - ends[0]) / (2.0 * step)
            size = np.abs(found).max() + f.m_b * bk.design.G
            assert found == pytest.approx(-slopes, abs=2e-5 * size)
            given = potential_energy(*q, work, f)
            assert [given.Q_x, given.Q_y * form.heave] == pytest.approx(found[[0, 2]], abs=1e-10 * size)


@pytest.mark.parametrize("form", FORMS, ids=NAMES)
def test_what_depends_on_velocities_takes_energy(form: HeaveOptions) -> None:
    """Drag, dashpot and friction, wherever the boulder is and however it moves."""
    rng = np.random.default_rng(257)
    for design in random_designs(4, seed=258):
        f = constants(design, form)
        for _ in range(20):
            work, (y, rise, rate) = workspace(f, random_sets(rng)), random_motion(rng, form)
            still = y._replace(v_b=0.0, omega_b=0.0)
            moved = as_vector(forces_at(y, rise, rate, False, work, f), form)
            held = as_vector(forces_at(still, rise, 0.0, False, work, f), form)
            power = (moved - held) @ coordinates(y, rise, rate)[1]
            assert power < 1e-12 * np.abs(held).max()


@pytest.mark.parametrize("form", FORMS, ids=NAMES)
def test_a_boulder_at_rest_stays_at_rest(form: HeaveOptions) -> None:
    for design in [RWG, *random_designs(4, seed=259)]:
        f = constants(design, form)
        Q = forces_at(NOTHING._replace(v_v=design.v_0), 0.0, 0.0, True, workspace(f), f)
        assert as_vector(Q, form) == pytest.approx(np.zeros(3), abs=1e-9 * f.m_b * bk.design.G)
        assert accelerations(0.0, 0.0, Q, True, f) == pytest.approx(np.zeros(4), abs=1e-9)


def test_rotation_alone_turns_less_soil_than_the_planar_motion() -> None:
    """Upright, the two inertias differ by the sum of m_n l_n^2: the soil in front does not move up and down."""
    f = constants(RWG, FORMS[1])
    planar = constants(RWG, FORMS[3])
    difference = kinetic_energy(0.0, 0.0, 1.0, 0.0, planar) - kinetic_energy(0.0, 0.0, 1.0, 0.0, f)
    assert difference == pytest.approx(0.5 * f.M_soil * f.c.l_n**2, rel=1e-9)


def base_force(f: HeaveConstants, rise: float, rate: float, theta: float = 0.0, omega: float = 0.0) -> Forces:
    """Forces of base and weight: x_b = 0, so that no spring lifts; without soil that drags."""
    y = NOTHING._replace(theta_b=theta, omega_b=omega)
    return forces_at(y, rise, rate, False, workspace(f), f)


def no_drag(f: HeaveConstants) -> HeaveConstants:
    return f._replace(c=f.c._replace(R_soil=0.0))


def test_base_pushes_with_spring_and_dashpot_and_never_pulls() -> None:
    """k_b p + rho_s c_P dp/dt over the foot; nothing once it has left, and never more than it can bear (Eq 133)."""
    base = Base()
    f = no_drag(constants(RWG, FORMS[1], base))
    area, weight = RWG.L * RWG.W, f.m_b * bk.design.G
    settlement = weight / (base.stiffness * area)
    phi = RWG.phi
    capacity = RWG.rho_s * bk.design.G * RWG.d * np.exp(np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2) ** 2

    def push(rise: float, rate: float) -> float:
        return base_force(f, rise, rate).Q_y + weight

    assert push(0.0, 0.0) == pytest.approx(weight, rel=1e-12)
    assert push(-settlement, 0.0) == pytest.approx(2.0 * weight, rel=1e-12)
    assert push(-settlement, -0.1) == pytest.approx(2.0 * weight + RWG.rho_s * base.wave_speed * 0.1 * area, rel=1e-12)
    assert push(0.5 * settlement, -0.1) == pytest.approx(
        0.5 * (weight + RWG.rho_s * base.wave_speed * 0.1 * area), rel=1e-12
    )
    assert push(-settlement, 50.0) == 0.0
    assert push(1.001 * settlement, -1.0) == 0.0
    assert push(-1.0, 0.0) == pytest.approx(capacity * area, rel=1e-12)
    assert push(-1.0, -1.0) == pytest.approx(capacity * area, rel=1e-12)


def test_base_carries_on_the_side_that_is_pressed_in() -> None:
    """Turned clockwise, the right half of the foot carries, and turns the boulder back."""
    f = constants(RWG, FORMS[1])
    for theta, side in ((0.01, 1.0), (-0.01, -1.0)):
        rise = side * theta * (f.L / 2) + side * f.a_b * theta
        assert side * base_force(f, rise, 0.0, theta).Q_theta < 0.0


def test_a_set_strip_carries_less() -> None:
    f = constants(RWG, FORMS[1])
    sets = np.zeros(GROUP)
    sets[5] = 0.25 * f.s_0
    work = workspace(f, sets)
    held = f.m_b * bk.design.G * 0.5 * (np.cos(np.pi * 5 / 16) - np.cos(np.pi * 6 / 16))
    assert forces_at(NOTHING, 0.0, 0.0, False, work, f).Q_y == pytest.approx(-0.25 * held, rel=1e-9)
    sets[5] = 7.0 * f.s_0
    assert forces_at(NOTHING, 0.0, 0.0, False, workspace(f, sets), f).Q_y == pytest.approx(-held, rel=1e-9)


def test_friction_by_hand() -> None:
    """Everything slips at v_s upwards: 0.71 of tan(2/3 phi') times the pressure; the foot is off (Eq 134)."""
    f = no_drag(constants(RWG, FORMS[0]))
    without = no_drag(constants(RWG, FORMS[1]))
    mu = np.tan(2.0 / 3.0 * RWG.phi)
    up = 2.0 * f.s_0
    mean = RWG.d / 2.0 - up
    # a row of points less deep than the boulder has risen would count for nothing; here all are deeper
    sides = 2.0 * mu * (1.0 - np.sin(RWG.phi)) * RWG.rho_s * bk.design.G * mean * RWG.L * RWG.d
    found = base_force(f, up, f.v_s).Q_y - base_force(without, up, f.v_s).Q_y
    assert found == pytest.approx(-sides / np.sqrt(2.0), rel=1e-12)
    # pushed forward by x_b, the far face carries the springs; pushed back, the near face
    for x_b in (0.02, -0.02):
        y = NOTHING._replace(x_b=x_b)
        at_rest = forces_at(y, up, 0.0, False, workspace(f), f)
        slipping = forces_at(y, up, f.v_s, False, workspace(f), f)
        face = slipping.Q_y - at_rest.Q_y + sides / np.sqrt(2.0)
        assert face == pytest.approx(-mu * abs(at_rest.Q_x) / np.sqrt(2.0), rel=1e-9)
        arm = f.c.l_n if x_b > 0.0 else f.c.l_n - f.L
        column_mean = np.mean([(n + 0.5) / 4 * RWG.L - f.c.c_x for n in range(4)])
        turning = slipping.Q_theta - at_rest.Q_theta - sides / np.sqrt(2.0) * column_mean
        assert turning == pytest.approx(-face * arm, rel=1e-9)


def test_foot_rubs_with_what_it_carries() -> None:
    f, without = (no_drag(constants(RWG, form)) for form in FORMS[:2])
    sliding = NOTHING._replace(v_b=f.v_s)
    found = forces_at(sliding, 0.0, 0.0, False, workspace(f), f)
    smooth = forces_at(sliding, 0.0, 0.0, False, workspace(without), without)
    mu, weight = np.tan(2.0 / 3.0 * RWG.phi), f.m_b * bk.design.G
    sides = 2.0 * mu * (1.0 - np.sin(RWG.phi)) * RWG.rho_s * bk.design.G * RWG.d / 2.0 * RWG.L * RWG.d
    assert found.Q_x - smooth.Q_x == pytest.approx(-(mu * weight + sides) / np.sqrt(2.0), rel=1e-12)


@pytest.mark.parametrize("form", FORMS[2:], ids=NAMES[2:])
def test_without_rise_the_weight_is_the_couple_of_the_planar_motion(form: HeaveOptions) -> None:
    """Once the foot has tilted by more than 6 s_0/L; before, a share of it (Eq 135)."""
    f = constants(RWG, form, Base(stiffness=1e9))
    weight = f.m_b * bk.design.G
    seated = 6.0 * f.s_0 / f.L
    work, weightless = workspace(f), f._replace(m_b=0.0)
    for theta in (-0.5, -2.0 * seated, -0.3 * seated, 0.5 * seated, 2.0 * seated, 0.3, 1.0):
        soil = [potential_energy(0.0, theta + step, 0.0, work, weightless).u for step in (-1e-7, 1e-7)]
        share = min(abs(np.sin(theta)) / seated, 1.0)
        couple = -np.sign(theta) * weight * (share * f.L / 2 * np.cos(theta) - RWG.H / 2 * np.sin(abs(theta)))
        found = forces_at(NOTHING._replace(theta_b=theta), 0.0, 0.0, False, work, f).Q_theta
        assert found + (soil[1] - soil[0]) / 2e-7 == pytest.approx(couple, rel=1e-6)


@RISING
def test_a_spring_lifts_by_its_energy_per_depth(form: HeaveOptions) -> None:
    """Pushed forward while upright: elements press on the far face and lift it by v_n each (Eq 132)."""
    f = constants(RWG, form)
    x_b = 0.5 * f.c.x_yield
    y = NOTHING._replace(x_b=x_b)
    lifted = forces_at(y, 0.0, 0.0, False, workspace(f), f)
    per_depth = f.c.K_soil / RWG.d * 0.5 * x_b**2  # sum over all elements
    assert lifted.Q_y == pytest.approx(per_depth, rel=1e-9)
    assert lifted.Q_x == pytest.approx(-0.5 * f.c.K_soil * x_b, rel=1e-9)
    higher = forces_at(y, RWG.d + 0.1, 0.0, False, workspace(f), f)  # pulled out of the soil
    assert [higher.Q_x, higher.Q_y] == pytest.approx([0.0, -f.m_b * bk.design.G], abs=1e-6)
