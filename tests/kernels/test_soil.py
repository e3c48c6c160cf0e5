"""Reaction of the soil (Eqs 19 to 36) against the oracle: element sums, closed form, and the law of one element."""

from math import pi

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of, yield_displacement
from boulder_kernels.dynamics import State, soil_energy, soil_reaction
from boulder_kernels.soil import (
    Kinematics,
    Reaction,
    closed_form,
    drag_force,
    element_sums,
    soil_kinematics,
    spring_force,
)
from tests import oracle
from tests.oracle.soil import Motion, Soil, drag_forces, polar, spring_constants, stretch, ultimate_forces

from .samples import design_of, inputs_of, random_designs, random_state

DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(8, seed=21)]
READINGS = bk.corrected()


def lines(y: State, c: bk.Constants) -> Kinematics:
    """Lines of displacement, velocity and lever; sine and versine from the library, not from the kernels."""
    return soil_kinematics(y.x_b, y.v_b, y.omega_b, np.sin(y.theta_b), 1.0 - np.cos(y.theta_b), c)


def motion(y: State) -> Motion:
    return Motion(x_b=y.x_b, theta=y.theta_b, v_b=y.v_b, omega=y.omega_b)


def soil_of(design: bk.Design, elements: int | None) -> Soil:
    inputs = inputs_of(design)
    return Soil(inputs, oracle.constants(inputs, oracle.CORRECTED, elements))


def size_of(design: bk.Design, y: State) -> float:
    """Force the soil could give at most at these speeds [N]: what rounding errors are measured against."""
    c = constants_of(design, READINGS, 0)
    speed = abs(y.v_b) + abs(y.omega_b) * (c.d + abs(c.l_n) + abs(c.z_0))
    stretched = min(abs(y.x_b) + c.d + c.l_n, c.x_yield)
    return c.K_soil * stretched + c.R_soil * speed**2


def assert_close(found: Reaction, F: float, M: float, error: float, size: float, design: bk.Design) -> None:
    """Hold a reaction to an error relative to its size; moments have levers up to the boulder's own size."""
    assert abs(found.F - F) <= error * size
    assert abs(found.M - M) <= error * size * (design.d + design.L)


def special_states(design: bk.Design) -> dict[str, State]:
    """Where the formulas change their form: no slope, no spin, upside down, the cap reached exactly."""
    y = yield_displacement(design)
    c = constants_of(design, READINGS, 0)
    half_turn_for_cap = np.arctan2(y, c.d)
    return {
        "at rest": State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        "upright and pushed": State(0.3 * y, 1.0, 0.0, 2.0, 0.0, 0.0),
        "upright, beyond the cap": State(3.0 * y, 1.0, 0.0, 2.0, 0.0, 0.0),
        "upright, exactly at the cap": State(y, 1.0, 0.0, 0.0, 0.0, 0.0),
        "upright, exactly at the other cap": State(-y, -1.0, 0.0, -1.0, 0.0, 0.0),
        "turned and not turning": State(0.1, 2.0, 0.3, 0.0, 0.0, 0.0),
        "still": State(0.1, 0.0, 0.3, 0.0, 0.0, 0.0),
        "on its side": State(0.2, 1.0, pi / 2, 4.0, 0.0, 0.0),
        "on its other side": State(-0.2, 1.0, -pi / 2, 4.0, 0.0, 0.0),
        "beyond its side": State(0.2, 1.0, 2.2, -4.0, 0.0, 0.0),
        "upside down": State(0.2, 1.0, pi, 3.0, 0.0, 0.0),
        "the smallest turn": State(0.5 * y, 1.0, 1e-300, 1e-300, 0.0, 0.0),
        "a tiny turn": State(0.5 * y, 1.0, 1e-12, -1e-12, 0.0, 0.0),
        # the displacement at the soil line is y exactly, at depth it falls below
        "cap reached at the soil line": State(
            y - c.z_0 * np.sin(half_turn_for_cap) + c.l_n * (1 - np.cos(half_turn_for_cap)),
            0.5,
            half_turn_for_cap,
            0.1,
            0.0,
            0.0,
        ),
    }


def states(design: bk.Design, count: int, seed: int) -> list[State]:
    rng = np.random.default_rng(seed)
    return [*special_states(design).values(), *(random_state(rng, (-pi, pi)) for _ in range(count))]


def test_lines_are_displacement_velocity_and_lever() -> None:
    """Eqs 7, 8, 20, 22, 35 are linear in depth; the oracle has them in polar coordinates."""
    for design in DESIGNS:
        inputs, c = inputs_of(design), constants_of(design, READINGS, 0)
        known = oracle.constants(inputs, oracle.CORRECTED)
        ratio = np.linspace(0.0, 1.0, 5)
        R, gamma = polar(known, inputs, ratio * design.d)
        for y in states(design, 20, seed=22):
            k = lines(y, c)
            size = 1.0 + abs(y.x_b) + abs(y.v_b) + 10 * abs(y.omega_b)
            expected = stretch(R, gamma, motion(y))
            assert k.A - k.slope_x * ratio == pytest.approx(expected, abs=1e-14 * size)
            expected = y.v_b + y.omega_b * R * np.cos(gamma + y.theta_b)
            assert k.B - k.slope_v * ratio == pytest.approx(expected, abs=1e-14 * size)
            expected = R * np.cos(gamma + y.theta_b - pi)
            assert k.lever_d * ratio + k.q == pytest.approx(expected, abs=1e-14 * size)


@pytest.mark.parametrize("elements", [1, 2, 50, 333])
def test_element_sums_are_those_of_the_oracle(elements: int) -> None:
    for design in DESIGNS:
        c = constants_of(design, READINGS, elements)
        soil = soil_of(design, elements)
        for y in states(design, 40, seed=23):
            found, known = element_sums(lines(y, c), c), soil.totals(motion(y))
            # The sum may be cut otherwise where it is compiled into what calls it.
            assert soil_reaction(lines(y, c), c) == pytest.approx(found, rel=1e-13)
            size = size_of(design, y)
            assert_close(found, known.F, known.M, 1e-12, size, design)


def test_closed_form_is_the_integral_of_the_oracle() -> None:
    """By panels between the break points, Gauss quadrature within each, which is exact; at many states."""
    for design in DESIGNS:
        c = constants_of(design, READINGS, 0)
        soil = soil_of(design, None)
        for y in states(design, 200, seed=24):
            found, known = closed_form(lines(y, c), c), soil.totals(motion(y))
            assert soil_reaction(lines(y, c), c) == found
            size = size_of(design, y)
            assert_close(found, known.F, known.M, 2e-12, size, design)


def test_closed_form_is_the_integral_by_adaptive_quadrature() -> None:
    design = design_of(oracle.RWG)
    c, soil = constants_of(design, READINGS, 0), soil_of(design, None)
    for y in states(design, 10, seed=25)[1:]:
        found, (F, M) = closed_form(lines(y, c), c), soil.totals_by_quad(motion(y))
        size = size_of(design, y)
        assert_close(found, F, M, 1e-10, size, design)


def sums_on_lines(k: Kinematics, design: bk.Design, elements: int) -> Reaction:
    """Element sums along the lines of the closed form, so that only the sum and not the centre of mass differs."""
    return element_sums(k, constants_of(design, READINGS, elements))


def test_element_sums_approach_the_closed_form_with_second_order() -> None:
    """From N = 50 to 50 000, by the root mean square over random states.

    At a single state the error jumps about with the place of the break points within their elements. The mean over the
    states falls with the square of N, by a factor of a million over this range.
    """
    counts = [50, 158, 500, 1581, 5000, 15_811, 50_000]
    squares = np.zeros((len(counts), 2))
    for design in DESIGNS:
        c = constants_of(design, READINGS, 0)
        for y in states(design, 10, seed=26)[1:]:
            k, size = lines(y, c), size_of(design, y)
            limit = closed_form(k, c)
            for i, n in enumerate(counts):
                found = sums_on_lines(k, design, n)
                gaps = np.array([found.F - limit.F, (found.M - limit.M) / (design.d + design.L)])
                squares[i] += (gaps / size) ** 2
    errors = np.sqrt(squares)
    slopes = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slopes == pytest.approx([-2.0, -2.0], abs=0.1)
    assert np.all(errors[-1] < 1e-8 * np.sqrt(len(DESIGNS) * 24))


@pytest.mark.parametrize("name", special_states(DESIGNS[0]))
def test_special_states_are_reached_from_either_side(name: str) -> None:
    """The closed form is finite and continuous where it divides by a slope that vanishes."""
    for design in DESIGNS:
        c = constants_of(design, READINGS, 0)
        y = special_states(design)[name]
        size = size_of(design, y) + size_of(design, State(0.01, 0.0, 0.1, 0.0, 0.0, 0.0))
        here = closed_form(lines(y, c), c)
        assert np.isfinite(here.F + here.M)
        for nudge in (1e-13, -1e-13):
            beside = closed_form(lines(State(*(value + nudge for value in y)), c), c)
            assert_close(beside, *here, 1e-9, size, design)
        found = sums_on_lines(lines(y, c), design, 20_000)
        assert_close(found, *here, 1e-7, size, design)


def test_energy_of_the_springs() -> None:
    """Against the oracle in both representations, and as the potential of the force."""
    for design in DESIGNS:
        for elements in (0, 60):
            c, soil = constants_of(design, READINGS, elements), soil_of(design, elements or None)
            for y in states(design, 40, seed=27):
                size = c.K_soil * c.x_yield * (1.0 + abs(y.x_b) + c.d + c.l_n)
                found = soil_energy(lines(y, c), c)
                assert found == pytest.approx(soil.elastic_energy(motion(y)), abs=1e-13 * size)
                assert found >= -1e-13 * size
        still = State(0.02, 0.0, 0.05, 0.0, 0.0, 0.0)
        step, size = 1e-6, size_of(design, still)
        x_beside = [soil_energy(lines(still._replace(x_b=0.02 + s), c), c) for s in (-step, step)]
        a_beside = [soil_energy(lines(still._replace(theta_b=0.05 + s), c), c) for s in (-step, step)]
        reaction = soil_reaction(lines(still, c), c)
        assert (x_beside[0] - x_beside[1]) / (2 * step) == pytest.approx(reaction.F, abs=1e-6 * size)
        assert (a_beside[0] - a_beside[1]) / (2 * step) == pytest.approx(reaction.M, abs=3e-6 * size)


# the law of a single element


def test_spring_of_an_element() -> None:
    """No force at rest, k_n at first, F_u,n at and beyond the cap, never falling, the same both ways."""
    for design in DESIGNS:
        c, inputs = constants_of(design, READINGS, 50), inputs_of(design)
        h_e = design.d / 50
        for alpha in (0.5 * h_e, 0.4 * design.d, design.d - 0.5 * h_e):
            depth, height = np.array([alpha]), np.array([h_e])
            k_n = spring_constants(inputs, depth, height)[0]
            F_u = ultimate_forces(inputs, depth, height)[0]
            cap = c.x_yield
            u = np.linspace(-3.0 * cap, 3.0 * cap, 601)
            F = np.array([spring_force(x, alpha, h_e, c) for x in u])
            assert spring_force(0.0, alpha, h_e, c) == 0.0
            assert spring_force(1e-6 * cap, alpha, h_e, c) == pytest.approx(k_n * 1e-6 * cap, rel=1e-12)
            assert spring_force(cap, alpha, h_e, c) == pytest.approx(F_u, rel=1e-12)
            assert spring_force(1e3 * cap, alpha, h_e, c) == pytest.approx(F_u, rel=1e-12)
            assert np.max(np.abs(F)) <= F_u * (1 + 1e-12)
            assert np.all(np.diff(F) >= 0.0)
            assert np.all(np.diff(F[np.abs(u) < 0.99 * cap]) > 0.0)
            mirrored = np.array([-spring_force(-x, alpha, h_e, c) for x in u])
            assert np.all(mirrored == F)


def test_drag_of_an_element() -> None:
    """No drag at rest, the square of the velocity, against it, the same both ways."""
    for design in DESIGNS:
        c, inputs = constants_of(design, READINGS, 50), inputs_of(design)
        h_e = design.d / 50
        v = np.linspace(-30.0, 30.0, 301)
        F = np.array([drag_force(x, h_e, c) for x in v])
        assert pytest.approx(drag_forces(inputs, np.array([h_e]), v), rel=1e-12) == F
        assert drag_force(0.0, h_e, c) == 0.0
        assert np.all(np.diff(F) >= 0.0)
        assert np.all(np.array([drag_force(-x, h_e, c) for x in v]) == -F)


def test_reaction_is_odd() -> None:
    """Displacement and velocity the other way round give the same reaction the other way round, bit for bit."""
    for design in DESIGNS:
        for elements in (0, 7):
            c = constants_of(design, READINGS, elements)
            for y in states(design, 20, seed=28):
                k = lines(y, c)
                back = Kinematics(-k.A, -k.slope_x, -k.B, -k.slope_v, k.q, k.lever_d)
                there, here = soil_reaction(k, c), soil_reaction(back, c)
                assert (there.F, there.M) == (-here.F, -here.M)


def test_no_force_without_motion() -> None:
    for design in DESIGNS:
        for elements in (0, 1, 50):
            c = constants_of(design, READINGS, elements)
            k = lines(State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), c)
            assert soil_reaction(k, c) == Reaction(0.0, 0.0)
            assert soil_energy(k, c) == 0.0
