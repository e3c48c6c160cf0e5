"""Boulders with an outline: masses and soil against the oracle and against boxes, and as elements grow many."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import FAR, NEAR, WIDTH, G, at_height, body_of_box, body_of_outline, constants_of
from boulder_kernels.dynamics import (
    constants_in,
    drag_power,
    least_couple,
    lift_of,
    profile_of,
    soil_potential,
    soil_reaction,
)
from boulder_kernels.table import simulate_table
from tests import oracle
from tests.kernels.samples import design_of, random_designs, random_state
from tests.kernels.test_layered import LAYERED, layers_of
from tests.kernels.test_soil import lines
from tests.outlines import oracle as outlined_oracle
from tests.outlines.stones import SHAPES, box, constants, crooked, outlined, stone_of, taper

READINGS = bk.corrected()
RWG = design_of(oracle.RWG)
DESIGNS = [design_of(oracle.ABG), RWG, *random_designs(3, seed=12)]


def reactions(k, c) -> np.ndarray:
    """Force, moment, energy with its slopes, and power of the drag."""
    return np.array([*soil_reaction(k, c), *soil_potential(k.A, k.slope_x, c)[:3], drag_power(k, c)])


@pytest.mark.parametrize("elements", [0, 40])
def test_the_outline_of_a_box_is_the_box(elements):
    rng = np.random.default_rng(3)
    for design in DESIGNS:
        uniform, c = constants_of(design, READINGS, elements), constants(design, box(design), elements)
        np.testing.assert_allclose(c[: len(uniform)], uniform, rtol=1e-12)
        np.testing.assert_allclose(body_of_outline(design, box(design)), body_of_box(design), rtol=1e-12, atol=1e-15)
        for _ in range(20):
            k = lines(random_state(rng), uniform)
            np.testing.assert_allclose(reactions(k, c), reactions(k, uniform), rtol=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_mass_centre_and_inertia_are_those_of_the_slices(shape):
    for inputs in (oracle.ABG, oracle.RWG):
        design = design_of(inputs)
        outline = SHAPES[shape](design)
        found, known = body_of_outline(design, outline), outlined_oracle.body(stone_of(outline), inputs)
        struck = at_height(outline, NEAR, design.d + design.e)
        half = 0.5 * (outline[0, FAR] + outline[0, NEAR])
        assert found[:2] == pytest.approx((known.m_b, known.J), rel=1e-11)
        assert (found.x, found.y, found.line) == pytest.approx(
            (struck + known.x, known.z, struck + known.far), rel=1e-11
        )
        assert (found.foot, found.lean) == pytest.approx(
            (half, 0.5 * (outline[0, FAR] - outline[0, NEAR]) - known.x), rel=1e-11, abs=1e-14
        )


def test_simple_bodies():
    """A frustum by its formulas, and a wedge whose centre is a third of the way."""
    design = RWG._replace(W=1.5, L=1.5, H=3.0, rho_b=1.0)
    a, b, h = 1.5 * 1.3, 1.5 * 0.7, 3.0
    body = body_of_outline(design, taper(design))
    assert body.m_b == pytest.approx(h / 3 * (a * a + a * b + b * b), rel=1e-14)
    assert body.y == pytest.approx(h / 4 * (a * a + 2 * a * b + 3 * b * b) / (a * a + a * b + b * b), rel=1e-14)
    wedge = np.array([[0.0, 2.0, 0.0, 3.0], [1.5, 2.0, 0.0, 0.0]])
    found = body_of_outline(design._replace(d=0.5, e=0.1), wedge)
    assert (found.m_b, found.x, found.y) == pytest.approx((4.5, 1.0, 0.5), rel=1e-14)
    assert pytest.approx(4.5 / 18.0 * (9.0 + 2.25), rel=1e-14) == found.J
    assert (found.foot, found.lean) == pytest.approx((1.5, 0.5))
    assert at_height(wedge, WIDTH, 9.0) == 2.0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("layered", [False, True])
def test_pieces_are_sums_of_many_elements(shape, layered):
    """To what a thousand of them can tell; boundaries of layers lie between two."""
    design, layers = (design_of(LAYERED), layers_of(LAYERED)) if layered else (RWG, None)
    outline = SHAPES[shape](design)
    pieces, sums = (constants(design, outline, elements, layers=layers) for elements in (0, 1000))
    assert (pieces.m_eff, pieces.J_eff) == pytest.approx((sums.m_eff, sums.J_eff), rel=1e-5)
    rng = np.random.default_rng(4)
    states = [lines(random_state(rng), pieces) for _ in range(8)]
    known, found = (np.array([reactions(k, c) for k in states]) for c in (sums, pieces))
    assert np.abs((found - known) / np.abs(known).max(axis=0)).max() < 1e-4


@pytest.mark.compiled
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("layered", [False, True])
def test_pieces_are_the_limit_of_elements(shape, layered):
    """Of second order in their number, and to 1e-8 at 50 000.

    Where in an element a break point lies changes its error, so several numbers of elements are taken together. The
    boundary of a layer is a jump: there they are of first order, unless it lies between two elements, as it does here.
    """
    design, layers = (design_of(LAYERED), layers_of(LAYERED)) if layered else (RWG, None)
    outline = SHAPES[shape](design)
    limit = constants(design, outline, 0, layers=layers)
    rng = np.random.default_rng(4)
    states = [lines(random_state(rng), limit) for _ in range(40)]
    known = np.array([reactions(k, limit) for k in states])

    def errors_of(elements: int) -> tuple[float, float]:
        """Of force, moment, energy and power over their largest values, and of mass and inertia."""
        c = constants(design, outline, elements, layers=layers)
        found = np.array([reactions(k, c) for k in states])
        off = np.sqrt(np.mean(((found - known) / np.abs(known).max(axis=0)) ** 2))
        return float(off), max(abs(c.m_eff / limit.m_eff - 1.0), abs(c.J_eff / limit.J_eff - 1.0))

    assert max(errors_of(50_000)) < 1e-8
    if layered:
        return
    counts = np.geomspace(500, 16_000, 6)
    together = [[errors_of(round(count * share)) for share in np.linspace(0.85, 1.15, 16)] for count in counts]
    errors = np.sqrt(np.mean(np.square(together), axis=1))
    orders = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert orders == pytest.approx((2.0, 2.0), abs=0.1)


def test_layers_beside_a_box_outline_are_layers():
    design, layers = design_of(LAYERED), layers_of(LAYERED)
    plain = constants_in(design, READINGS, 0, profile_of(layers, 0))
    c = constants(design, box(design), 0, layers=layers)
    rng = np.random.default_rng(8)
    for _ in range(100):
        k = lines(random_state(rng), plain)
        np.testing.assert_allclose(soil_reaction(k, c), soil_reaction(k, plain), rtol=1e-9)
        mine, theirs = (soil_potential(k.A, k.slope_x, one) for one in (c, plain))
        np.testing.assert_allclose(mine[:3], theirs[:3], rtol=1e-9)
        assert mine.V * (1.0 - 1e-12) <= mine.highest <= theirs.highest * (1.0 + 0.1)


@pytest.mark.parametrize("shape", SHAPES)
def test_forces_are_the_slopes_of_the_energy(shape):
    design, layers = design_of(LAYERED), layers_of(LAYERED)
    for c in (constants(RWG, SHAPES[shape](RWG), 0), constants(design, SHAPES[shape](design), 0, layers=layers)):
        rng, step = np.random.default_rng(9), 1e-6
        for A, X in rng.uniform(-0.6, 0.6, (40, 2)):
            p = soil_potential(A, X, c)
            by_A = (soil_potential(A + step, X, c).V - soil_potential(A - step, X, c).V) / (2 * step)
            by_X = (soil_potential(A, X + step, c).V - soil_potential(A, X - step, c).V) / (2 * step)
            size = 1e-4 * c.K_soil * step + 1e-7 * p.V / step
            assert pytest.approx((by_A, by_X), rel=1e-6, abs=size) == (p.V_A, p.V_X)
            assert p.highest >= p.V * (1.0 - 1e-12)


def test_the_weight_of_a_crooked_boulder_turns_about_the_ends_of_its_foot():
    """Lift, least couple and moment follow from the arms of the weight about either end (Eq 144)."""
    outline = crooked(RWG)
    c, known = constants(RWG, outline, 0), outlined_oracle.body(stone_of(outline), oracle.RWG)
    weight = known.m_b * G
    ahead, behind = outline[0, FAR] - known.x, outline[0, NEAR] + known.x
    assert ahead > behind + 0.05
    assert least_couple(c) == pytest.approx(weight * behind, rel=1e-12)
    theta = 0.2
    for side, arm in ((1.0, ahead), (-1.0, behind)):
        sin, versin = side * np.sin(theta), 1.0 - np.cos(theta)
        assert lift_of(sin, versin, c) == pytest.approx(weight * (arm * np.sin(theta) - known.z * versin), rel=1e-12)


@pytest.mark.parametrize("elements", [60, pytest.param(300, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("shape", SHAPES)
def test_whole_impacts_are_those_of_the_oracle(shape, elements):
    outline = SHAPES[shape](RWG)
    known = outlined_oracle.simulate(stone_of(outline), oracle.RWG, 0.45, elements)
    assert known.imbalance < 1e-7
    control = bk.Control(5e-4, 0.45, np.radians(60.0), elements, False, locate_yield=True)
    found = simulate_table(outlined(RWG, outline), READINGS, control)
    assert found.theta_max[0] == pytest.approx(known.rotation, rel=2e-6)
    assert found.x_b_max[0] == pytest.approx(known.displacement, rel=2e-6)
    assert found.x_v_max[0] == pytest.approx(known.vehicle, rel=2e-6)
    assert found.F_v_max[0] == pytest.approx(known.force, rel=1e-5)


@pytest.mark.parametrize("shape", SHAPES)
def test_impacts_by_pieces_are_the_limit_of_those_by_elements(shape):
    outline, control = SHAPES[shape](RWG), bk.Control(1e-3, 1.0, np.radians(60.0), 0, False)

    def maxima_of(elements: int) -> np.ndarray:
        """Rotation, and the displacements of boulder and truck."""
        found = simulate_table(outlined(RWG, outline), READINGS, control._replace(elements=elements))
        return np.array([found.theta_max[0], found.x_b_max[0], found.x_v_max[0]])

    def error_of(elements: int) -> float:
        """Relative to the limit, over several numbers of elements."""
        some = [maxima_of(round(elements * share)) for share in np.linspace(0.85, 1.15, 16)]
        return float(np.sqrt(np.mean((np.array(some) / maxima_of(0) - 1.0) ** 2)))

    errors = error_of(1200), error_of(9600)
    assert errors[1] < 1e-6
    assert np.log2(errors[0] / errors[1]) / 3 == pytest.approx(2.0, abs=0.2)


def test_a_superellipsoid_is_a_box_as_its_exponent_grows():
    """Here of the same mass; the last sections, which are rounded all the same, count for little."""
    control = bk.Control(2e-3, 1.0, np.radians(60.0), 0, False)
    square = simulate_table(outlined(RWG, box(RWG)), READINGS, control).theta_max[0]
    found = []
    for n in (4.0, 16.0, 64.0):
        z = 1.0 - np.geomspace(1.0, 1e-6, 40)
        heights = np.unique(np.concatenate([0.5 * (1.0 - z), 0.5 * (1.0 + z), [0.0, 1.0]])) * 2.0 - 1.0
        share = (1.0 - np.abs(heights) ** n) ** (1.0 / n)
        half = 0.5 * RWG.L * share
        outline = np.stack([0.5 * RWG.H * (1.0 + heights), RWG.W * share, half, half], axis=1)
        outline[[0, -1], 1:] = outline[[1, -2], 1:]
        dense = RWG._replace(rho_b=RWG.rho_b * RWG.L * RWG.W * RWG.H / (body_of_outline(RWG, outline).m_b / RWG.rho_b))
        found.append(simulate_table(outlined(dense, outline), READINGS, control).theta_max[0])
    off = np.abs(np.array(found) - square)
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.2 * off[0]
