"""Eqs 19 to 36 and the restoring moments, against cases that can be worked out by hand."""

from math import atan2, degrees, pi, tan

import numpy as np
import pytest

from tests.oracle import ABG, AS_PRINTED, CORRECTED, GRAVITY, RWG, constants, problem
from tests.oracle.restoring import (
    gravity_couple,
    gravity_energy,
    printed_forward,
    printed_limit,
)
from tests.oracle.soil import Motion, Soil, polar, stretch, velocity


def soil_of(elements: int | None = None) -> Soil:
    return Soil(RWG, constants(RWG, CORRECTED, elements))


def random_motions(count: int, seed: int) -> list[Motion]:
    rng = np.random.default_rng(seed)
    scale = np.array([0.3, 1.0, 5.0, 6.0])
    return [Motion(*(scale * rng.standard_normal(4))) for _ in range(count)]


def test_small_push_meets_springs_proportional_to_depth() -> None:
    soil = soil_of()
    push = 0.5 * soil.dx_yield
    found = soil.totals(Motion(push, 0.0, 0.0, 0.0))
    kappa = 1e6 * RWG.beta * RWG.W * tan(RWG.phi) / RWG.d  # spring per height and depth [N/m^3]
    force, moment = found.F, found.M
    assert force == pytest.approx(-kappa * push * RWG.d**2 / 2, rel=1e-12)
    # the resultant lies at 2/3 of the depth, below the centre of mass: it turns the boulder clockwise
    depth_below = 2 * RWG.d / 3 - (RWG.d - soil.constants.c_y)
    assert depth_below > 0
    assert moment == pytest.approx(-force * depth_below, rel=1e-12)
    assert soil.elastic_energy(Motion(push, 0, 0, 0)) == pytest.approx(-force * push / 2, rel=1e-12)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_large_push_meets_the_ultimate_pressure_both_ways(sign: float) -> None:
    soil = soil_of()
    motion = Motion(sign * 3 * soil.dx_yield, 0.0, 0.0, 0.0)
    K_p = (1 + np.sin(RWG.phi)) / (1 - np.sin(RWG.phi))
    ultimate = K_p**2 * RWG.rho_s * GRAVITY * RWG.W * RWG.d**2 / 2
    force = soil.totals(motion).F
    assert force == pytest.approx(-sign * ultimate, rel=1e-12)
    # a third of the way elastic, two thirds against the full force: (1/2 + 2) F_u dx_y
    assert soil.elastic_energy(motion) == pytest.approx(2.5 * ultimate * soil.dx_yield, rel=1e-12)


@pytest.mark.parametrize("v", [-4.0, 4.0])
def test_translation_meets_drag(v: float) -> None:
    found = soil_of().totals(Motion(0.0, 0.0, v, 0.0))
    force = found.F
    assert force == pytest.approx(-RWG.rho_s * RWG.W * RWG.d * v * abs(v), rel=1e-12)
    assert found.drag_power == pytest.approx(-force * v, rel=1e-12)


def test_elements_move_with_the_rigid_body() -> None:
    """Eqs 22 and 35 against turning the points themselves about the centre of mass."""
    soil = soil_of(9)
    alpha, _, R_n, gamma_n = soil.nodes(Motion(0, 0, 0, 0))
    depth_of_centre = RWG.d - soil.constants.c_y
    at_rest = soil.constants.l_n + 1j * (depth_of_centre - alpha)  # right + i up, from the centre of mass
    for theta in (-0.7, 0.3, 1.9):
        turned = at_rest * np.exp(-1j * theta)
        motion = Motion(0.2, theta, 1.5, -3.0)
        expected = 0.2 + (turned - at_rest).real
        assert stretch(R_n, gamma_n, motion) == pytest.approx(expected, abs=1e-14)
        # a clockwise turn moves a point right by its height
        assert velocity(R_n, gamma_n, motion) == pytest.approx(1.5 - 3.0 * turned.imag, abs=1e-14)


def test_displacement_and_velocity_are_linear_in_depth() -> None:
    """On this the break points of the integral rest."""
    alpha = np.linspace(0.0, RWG.d, 5)
    R, gamma = polar(constants(RWG, CORRECTED), RWG, alpha)
    for motion in random_motions(20, seed=3):
        assert np.diff(stretch(R, gamma, motion), 2) == pytest.approx(np.zeros(3), abs=1e-13)
        assert np.diff(velocity(R, gamma, motion), 2) == pytest.approx(np.zeros(3), abs=1e-12)


def test_panels_equal_adaptive_quadrature() -> None:
    soil = soil_of()
    special = [
        Motion(0.1, 0.0, 1.0, 2.0),
        Motion(0.1, 0.2, 1.0, 0.0),
        Motion(0.0, pi, 0.0, 3.0),
        Motion(soil.dx_yield, 0.0, 0.0, 0.0),
        Motion(0.2, pi / 2, 1.0, 4.0),
    ]
    for motion in special + random_motions(40, seed=1):
        F, M = soil.totals_by_quad(motion)
        found = soil.totals(motion)
        size = abs(F) + abs(M) + 1.0
        assert np.hypot(found.F - F, found.M - M) <= 1e-10 * size


def orders_of_convergence(motions: list[Motion]) -> list[float]:
    """Order in 1/N of the error of force and moment, fitted to its geometric mean over the motions."""
    counts = np.array([2**k for k in range(4, 13)])
    limits = [soil_of().totals(motion) for motion in motions]
    logs = []
    for n in counts:
        soil = soil_of(int(n))
        sums = [soil.totals(motion) for motion in motions]
        pairs = list(zip(sums, limits, strict=True))
        logs.append([np.mean([np.log(abs(getattr(s, q) - getattr(x, q))) for s, x in pairs]) for q in "FM"])
    return [-float(slope) for slope in np.polyfit(np.log(counts), np.array(logs), 1)[0]]


def test_element_sums_converge_to_the_integral_with_second_order() -> None:
    elastic_and_forward = Motion(0.005, 0.003, 3.0, 0.5)
    soil = soil_of()
    assert np.all(np.abs(soil.end_stretch(elastic_and_forward)) < soil.dx_yield)
    assert np.all(soil.end_velocity(elastic_and_forward) > 0)
    assert orders_of_convergence([elastic_and_forward]) == pytest.approx([2.0, 2.0], abs=0.01)


def test_element_sums_converge_across_break_points_too() -> None:
    """Where in an element a break point falls moves the error about: only the mean has an order."""
    motions = random_motions(60, seed=5)
    soil = soil_of()
    broken = [m for m in motions if np.any((soil.break_points(m) > 0) & (soil.break_points(m) < RWG.d))]
    assert len(broken) > 40
    assert orders_of_convergence(broken) == pytest.approx([2.0, 2.0], abs=0.1)


def test_force_is_the_slope_of_the_stored_energy() -> None:
    """Without motion the soil's force and moment derive from its elastic energy."""
    soil = soil_of()
    for still in random_motions(20, seed=7):
        x, theta = still.x_b, still.theta

        def stored(dx: float, dtheta: float, x: float = x, theta: float = theta) -> float:
            return soil.elastic_energy(Motion(x + dx, theta + dtheta, 0.0, 0.0))

        found = soil.totals(Motion(x, theta, 0.0, 0.0))
        step = 1e-6
        size = abs(found.F) + abs(found.M)
        assert -(stored(step, 0) - stored(-step, 0)) / (2 * step) == pytest.approx(found.F, abs=1e-6 * size)
        assert -(stored(0, step) - stored(0, -step)) / (2 * step) == pytest.approx(found.M, abs=1e-6 * size)


@pytest.mark.parametrize(("inputs", "tipping"), [(ABG, 19.1), (RWG, 25.6)])
def test_gravity_couple(inputs, tipping: float) -> None:
    """It is the slope of the weight's energy, restores up to the tipping angle and drives beyond it."""
    lumped = constants(inputs, CORRECTED)
    tip = atan2(inputs.L, inputs.H)
    assert degrees(tip) == pytest.approx(tipping, abs=0.05)
    assert gravity_couple(inputs, lumped, tip, 1.0) == pytest.approx(0.0, abs=1e-8)
    assert gravity_couple(inputs, lumped, 0.9 * tip, 1.0) < 0 < gravity_couple(inputs, lumped, 1.1 * tip, 1.0)
    for theta in (-0.9, -0.1, 0.1, 0.5, 1.5):
        side = np.sign(theta)
        slope = (gravity_energy(inputs, lumped, theta + 1e-6) - gravity_energy(inputs, lumped, theta - 1e-6)) / 2e-6
        assert gravity_couple(inputs, lumped, theta, side) == pytest.approx(-slope, rel=1e-6)


def test_printed_restoring_moment() -> None:
    lumped = constants(RWG, AS_PRINTED)
    limit = printed_limit(lumped, 0.0)
    assert limit == pytest.approx(lumped.m_b * GRAVITY * lumped.c_y, rel=1e-12)  # a vertical arm, as it stands
    assert printed_forward(limit, 1.0, 0.5 * limit) == -0.5 * limit
    assert printed_forward(limit, 1.0, 2 * limit) == -limit
    assert printed_forward(limit, 1.0, -0.5 * limit) == 0.5 * limit
    assert printed_forward(limit, -1.0, 2 * limit) == limit


def test_mass_and_rates_of_a_problem_at_the_first_touch() -> None:
    impact = problem(RWG, CORRECTED)
    assert impact.start.tolist() == [0, 0, 0, 0, 0, RWG.v_0, 0]
