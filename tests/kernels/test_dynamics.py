"""Modes, restoring moments (Eqs 37 to 39) and the right-hand side (Eqs 10, 11, 17, 52) against the oracle."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import (
    FREE,
    HELD,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
    State,
    acceleration,
    couple_moment,
    holding_moment,
    signed_arm,
    switches_of,
)
from boulder_kernels.events import initial_modes, mode_at_rest
from tests import oracle
from tests.oracle.dynamics import Contact, Rotation, loads, rate
from tests.oracle.events import first_modes, rest_modes
from tests.oracle.restoring import gravity_couple, gravity_hold, printed_forward, printed_limit, printed_sign

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

DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(4, seed=41)]


def sine_and_versine(theta: float) -> tuple[float, float]:
    return float(np.sin(theta)), float(1.0 - np.cos(theta))


def printed_range(c: bk.Constants) -> tuple[float, float]:
    """Rotations over which sin(gamma_N + theta) changes its sign once, at the corner: more than half a turn."""
    return c.theta_corner - 0.99 * np.pi, min(c.theta_corner + 0.99 * np.pi, np.pi)


def modes_in(turning: int, touching: bool, theta: float, readings: bk.Readings, c: bk.Constants) -> Modes:
    """Modes with the signs that go with a rotation."""
    if readings.restoring_gravity:
        return Modes(turning, touching, 1.0, 1.0, 0, 0)
    arm = 1.0 if signed_arm(*sine_and_versine(theta), c) >= 0.0 else -1.0
    return Modes(turning, touching, 1.0 if theta < c.theta_corner else -1.0, arm, 0, 0)


def forward_mode(M: float, theta: float, c: bk.Constants) -> int:
    """Mode of a boulder that turns forward under the printed rule: which way the net moment passes the limit."""
    limit = holding_moment(*sine_and_versine(theta), c)
    if abs(M) <= limit:
        return HELD
    return LIMITED_FORWARD if M > 0.0 else LIMITED_BACK


def net_moment(y: State, modes: Modes, readings: bk.Readings, c: bk.Constants) -> float:
    return acceleration(*y, switches_of(modes, readings, c), c).M


def check_rate(
    design: bk.Design,
    readings: bk.Readings,
    elements: int,
    y: State,
    turning: int,
    touching: bool,
    known: oracle.Modes,
) -> None:
    """Hold the right-hand side in one mode against Eq 52."""
    c = constants_of(design, readings, elements)
    problem = oracle.problem(inputs_of(design), oracle_readings(readings), elements or None)
    modes = modes_in(turning, touching, y.theta_b, readings, c)
    found = acceleration(*y, switches_of(modes, readings, c), c)
    literal = literal_state(y, c)
    if known.contact == "coasting":
        literal[6] = 0.0
    expected, load = rate(problem, literal, known), loads(problem, literal, known)
    force = abs(load.soil.F) + abs(load.F_v) + c.K_soil * c.x_yield
    lever = design.d + design.L + abs(c.h)
    assert found.a_b == pytest.approx(expected[1], abs=1e-11 * force / c.m_eff)
    assert found.alpha_b == pytest.approx(expected[3], abs=1e-11 * force * lever / c.J_eff)
    assert found.a_v == pytest.approx(literal[6], abs=1e-11 * (1.0 + abs(literal[6])))
    assert abs(found.M - load.net) <= 1e-11 * force * lever


def contact_cases(readings: bk.Readings, y: State, c: bk.Constants) -> list[tuple[bool, Contact]]:
    """Contact modes that this state may be in, in the words of both."""
    if readings.separation_released:
        return [(True, "touching"), (False, "coasting")]
    return [(True, "touching")] if compression(y, c) >= 0.0 else [(False, "clipped")]


@pytest.mark.parametrize("elements", [0, 30])
@pytest.mark.parametrize("readings", [r for r in ALL_READINGS if r.restoring_gravity])
def test_right_hand_side_under_gravity(readings: bk.Readings, elements: int) -> None:
    rng = np.random.default_rng(42)
    turnings: list[tuple[int, Rotation, tuple[float, float]]] = [
        (TURNING_FORWARD, "clockwise", (0.0, np.pi)),
        (TURNING_BACK, "anticlockwise", (-np.pi, 0.0)),
        (SEATED, "held", (0.0, 0.0)),
    ]
    for design in DESIGNS:
        c = constants_of(design, readings, elements)
        for turning, rotation, theta_range in turnings:
            for _ in range(6):
                y = random_state(rng, theta_range)
                if turning == SEATED:
                    y = y._replace(theta_b=0.0, omega_b=0.0)
                for touching, contact in contact_cases(readings, y, c):
                    known = oracle.Modes(rotation, contact)
                    check_rate(design, readings, elements, y, turning, touching, known)


@pytest.mark.parametrize("elements", [0, 30])
@pytest.mark.parametrize("readings", [r for r in ALL_READINGS if not r.restoring_gravity])
def test_right_hand_side_as_printed(readings: bk.Readings, elements: int) -> None:
    """Free, held, and limited either way; every one of them on both sides of corner and arm."""
    rng = np.random.default_rng(43)
    met = set()
    for design in DESIGNS:
        c = constants_of(design, readings, elements)
        for _ in range(40):
            y = random_state(rng, printed_range(c))
            for touching, contact in contact_cases(readings, y, c):
                free = modes_in(FREE, touching, y.theta_b, readings, c)
                sign = free.corner
                if y.omega_b <= 0.0:
                    turning, rotation = FREE, "backward"
                else:
                    M = net_moment(y, free, readings, c)
                    turning, rotation = forward_mode(M, y.theta_b, c), "forward"
                met.add((turning, sign, free.arm))
                known = oracle.Modes(rotation, contact, sign)
                check_rate(design, readings, elements, y, turning, touching, known)
    assert {turning for turning, _, _ in met} == {FREE, HELD, LIMITED_FORWARD, LIMITED_BACK}
    assert {(sign, arm) for _, sign, arm in met} >= {(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)}


def test_at_rest_as_printed() -> None:
    """Come to omega = 0, the mode to go on in is the one that the oracle finds, and a held boulder does not turn."""
    words = {(FREE, 1.0): "backward", (FREE, -1.0): "backward", (HELD, 1.0): "held", (HELD, -1.0): "forward"}
    words |= {(LIMITED_FORWARD, 1.0): "forward", (LIMITED_FORWARD, -1.0): "forward"}
    rng = np.random.default_rng(45)
    met = set()
    for readings in (r for r in ALL_READINGS if not r.restoring_gravity):
        for design in DESIGNS:
            c = constants_of(design, readings, 0)
            problem = oracle.problem(inputs_of(design), oracle_readings(readings))
            for _ in range(12):
                y = random_state(rng, printed_range(c))._replace(omega_b=0.0)
                touching, contact = contact_cases(readings, y, c)[0]
                here = modes_in(FREE, touching, y.theta_b, readings, c)
                M = net_moment(y, here, readings, c)
                found = mode_at_rest(M, here.corner, *sine_and_versine(y.theta_b), c)
                before = oracle.Modes("backward", contact, here.corner)
                known = rest_modes(problem, literal_state(y, c), before)
                assert (words[found, here.corner], here.corner) == (known.rotation, known.sign)
                met.add((found, here.corner, np.sign(M)))
                if known.rotation == "held":
                    check_rate(design, readings, 0, y, HELD, touching, known)
                    held = modes_in(HELD, touching, y.theta_b, readings, c)
                    assert acceleration(*y, switches_of(held, readings, c), c).alpha_b == 0.0
    assert {(mode, corner) for mode, corner, _ in met} == set(words)
    assert {(HELD, 1.0, 1.0), (HELD, 1.0, -1.0)} <= met


def test_modes_at_the_first_touch() -> None:
    """Held; as printed, a boulder struck below its centre is let go at once. The oracle says the same."""
    for readings in ALL_READINGS:
        for design in DESIGNS:
            c = constants_of(design, readings, 0)
            found = initial_modes(readings, c)
            first = SEATED if readings.restoring_gravity else HELD if c.h >= 0.0 else FREE
            assert found == Modes(first, True, 1.0, 1.0, 0, 0)
            known = first_modes(oracle.problem(inputs_of(design), oracle_readings(readings)))
            assert known.rotation == ("backward" if first == FREE else "held")


def test_couple_of_the_weight() -> None:
    """m_b g (L/2 cos - H/2 sin|theta|) against the turn, and what it holds when seated."""
    for design in DESIGNS:
        readings = bk.corrected()
        c = constants_of(design, readings, 0)
        inputs = inputs_of(design)
        known = oracle.constants(inputs, oracle.CORRECTED)
        for turning, side in ((TURNING_FORWARD, 1.0), (TURNING_BACK, -1.0)):
            s = switches_of(Modes(turning, True, 1.0, 1.0, 0, 0), readings, c)
            for tilt in np.linspace(0.0, np.pi, 15):
                theta = side * tilt
                expected = gravity_couple(inputs, known, theta, side)
                found = couple_moment(*sine_and_versine(theta), s, c)
                assert found == pytest.approx(expected, abs=1e-13 * c.C_cos * design.H / design.L)
        assert holding_moment(0.0, 0.0, c) == pytest.approx(gravity_hold(inputs, known), rel=1e-14)


def test_printed_restoring_moment_in_each_mode() -> None:
    """Eqs 37 to 39: the linear form of the modes is the oracle's formula at any net moment."""
    rng = np.random.default_rng(44)
    readings = bk.as_printed()
    for design in DESIGNS:
        c = constants_of(design, readings, 0)
        known = oracle.constants(inputs_of(design), oracle.AS_PRINTED)
        for theta in rng.uniform(*printed_range(c), 40):
            sin, versin = sine_and_versine(theta)
            limit = printed_limit(known, theta)
            assert holding_moment(sin, versin, c) == pytest.approx(limit, rel=1e-11, abs=1e-9 * c.C_cos)
            sign = printed_sign(known, theta)
            for M in np.array([-3.0, -1.01, -0.99, -0.3, 0.0, 0.3, 0.99, 1.01, 3.0]) * limit:
                expected = printed_forward(limit, sign, M)
                turning = forward_mode(M, theta, c)
                s = switches_of(modes_in(turning, True, theta, readings, c), readings, c)
                by_mode = (s.net - 1.0) * M + couple_moment(sin, versin, s, c)
                assert by_mode == pytest.approx(expected, abs=1e-11 * limit)
                s = switches_of(modes_in(FREE, True, theta, readings, c), readings, c)
                assert (s.net - 1.0) * M + couple_moment(sin, versin, s, c) == 0.0


def test_no_motion_without_a_blow() -> None:
    """A truck that stands at the boulder moves nothing: every mode at rest has no acceleration."""
    for design in DESIGNS:
        for readings, turning in ((bk.as_printed(), FREE), (bk.as_printed(), HELD), (bk.corrected(), SEATED)):
            c = constants_of(design._replace(v_0=0.0), readings, 0)
            s = switches_of(modes_in(turning, True, 0.0, readings, c), readings, c)
            found = acceleration(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, s, c)
            assert max(abs(found.a_b), abs(found.alpha_b), abs(found.a_v)) == 0.0
