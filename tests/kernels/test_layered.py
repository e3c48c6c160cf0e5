"""Soils that are not the same at every depth: against uniform soils, the oracle, and as elements grow many."""

from dataclasses import replace
from math import inf, radians

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import drag_power, soil_energy, soil_potential, soil_reaction
from boulder_kernels.pieces import table_in_layers, uniform_layers
from boulder_kernels.soil import closed_form, uniform_drag_power, uniform_potential
from boulder_kernels.table import problem_at, simulate_table
from tests import oracle
from tests.kernels.samples import layered_constants
from tests.oracle.ground import ultimate_pressure
from tests.oracle.inputs import Ground, Layer
from tests.oracle.records import recorded_impact

from .samples import control, design_of, random_designs, random_state, table_of
from .test_soil import lines, motion

READINGS = bk.corrected()
DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(4, seed=31)]
N = 40
LAYERS = (
    Layer(0.0, 1700.0, radians(34.0), 20.0, 4e3),
    Layer(0.45, 2000.0, radians(41.0), 70.0),
    Layer(0.9, 2100.0, radians(38.0), 40.0, 2e3),
)
GROUND = Ground(LAYERS, water=0.9, slope=radians(10.0))
LAYERED = replace(oracle.RWG, d=1.8, ground=GROUND, K_epsilon=1.1)


def layers_of(inputs: oracle.Inputs) -> np.ndarray:
    """Layers as the kernels take them; their pressures are lines through two values of the oracle's."""
    assert inputs.ground is not None
    tops = [layer.top for layer in inputs.ground.layers]
    rows = []
    for layer, bottom in zip(inputs.ground.layers, [*tops[1:], inf], strict=True):
        ends = layer.top + 1e-3, min(bottom, layer.top + 2.0) - 1e-3
        p, q = (ultimate_pressure(inputs, inputs.ground, depth) / inputs.K_epsilon for depth in ends)
        slope = (q - p) / (ends[1] - ends[0])
        rows.append([bottom, layer.rho_s, layer.phi, layer.beta, p - slope * ends[0], slope])
    return np.array(rows)


def in_layers(design: bk.Design, elements: int, layers: np.ndarray | None = None):
    """Constants of a design in layers; in the uniform soil of its own if none are given."""
    return layered_constants(design, uniform_layers(design) if layers is None else layers, READINGS, elements)


@pytest.mark.parametrize("elements", [0, N])
def test_one_layer_is_the_uniform_soil(elements: int) -> None:
    """Masses, forces, moments, energy with its slopes and the power of the drag equal the paper's soil."""
    rng = np.random.default_rng(5)
    for design in DESIGNS:
        c, uniform = in_layers(design, elements), constants_of(design, READINGS, elements)
        np.testing.assert_allclose(c[: len(uniform)], uniform, rtol=1e-14)
        for _ in range(20):
            k = lines(random_state(rng), uniform)
            np.testing.assert_allclose(soil_reaction(k, c), soil_reaction(k, uniform), rtol=1e-10)
            of_layers, of_uniform = soil_potential(k.A, k.slope_x, c), uniform_potential(k.A, k.slope_x, uniform)
            np.testing.assert_allclose(of_layers, of_uniform, rtol=1e-10)
            assert soil_energy(k, c) == pytest.approx(of_layers.V, rel=1e-13)
            assert drag_power(k, c) == pytest.approx(uniform_drag_power(k, uniform), rel=1e-12)


@pytest.mark.parametrize("elements", [0, N])
def test_same_soil_twice_is_one_soil(elements: int) -> None:
    """A boundary between two layers of the same soil changes nothing."""
    rng = np.random.default_rng(6)
    for design in DESIGNS:
        twice = np.repeat(uniform_layers(design), 2, axis=0)
        twice[0, 0] = 0.4 * design.d
        once, again = in_layers(design, elements), in_layers(design, elements, twice)
        np.testing.assert_allclose(once[:-1], again[:-1], rtol=1e-12)
        k = lines(random_state(rng), constants_of(design, READINGS, 0))
        np.testing.assert_allclose(soil_reaction(k, once), soil_reaction(k, again), rtol=1e-10)


def test_elements_are_those_of_the_oracle() -> None:
    """Layers, water, cohesion and a slope: masses, forces, moments and energy of the same N elements."""
    lumped = oracle.constants(LAYERED, oracle.CORRECTED, N)
    soil = oracle.problem(LAYERED, oracle.CORRECTED, N).soil
    c = in_layers(design_of(LAYERED), N, layers_of(LAYERED))
    for name in ("m_eff", "J_eff", "c_x", "c_y", "l_n", "h"):
        assert getattr(c, name) == pytest.approx(getattr(lumped, name), rel=1e-13)
    rng = np.random.default_rng(7)
    for _ in range(50):
        y = random_state(rng)
        k, known = lines(y, c), soil.totals(motion(y))
        np.testing.assert_allclose(soil_reaction(k, c), (known.F, known.M), rtol=1e-8, atol=1e-3)
        assert soil_energy(k, c) == pytest.approx(soil.elastic_energy(motion(y)), rel=1e-9)
        assert drag_power(k, c) == pytest.approx(known.drag_power, rel=1e-9)


def test_layers_are_the_limit_of_many_elements() -> None:
    """Everything that N elements give tends to what the layers give exactly, with the square of N.

    The boundaries of the layers lie between elements; else it is with N.
    """
    design, layers = design_of(LAYERED), layers_of(LAYERED)
    exact = in_layers(design, 0, layers)
    assert exact.x_yield > 1e9  # cohesion at the soil line
    rng = np.random.default_rng(8)
    found = {n: in_layers(design, n, layers) for n in (400, 4000)}
    errors = {n: [abs(c.m_eff / exact.m_eff - 1.0), abs(c.J_eff / exact.J_eff - 1.0)] for n, c in found.items()}
    for _ in range(40):
        k = lines(random_state(rng), exact)
        values = [*soil_reaction(k, exact), *soil_potential(k.A, k.slope_x, exact)[:3], drag_power(k, exact)]
        size = abs(values[0]) * design.d
        for n, c in found.items():
            again = [*soil_reaction(k, c), *soil_potential(k.A, k.slope_x, c)[:3], drag_power(k, c)]
            errors[n] += [abs(a - b) / (abs(b) + size) for a, b in zip(again, values, strict=True)]
    assert np.max(errors[4000]) < 3e-6
    assert np.mean(errors[4000]) < 0.03 * np.mean(errors[400])


def test_slopes_of_the_energy_are_the_forces() -> None:
    """Of elements and of layers: the derivatives of the energy, and the force of a soil that does not move."""
    design, layers = design_of(LAYERED), layers_of(LAYERED)
    for elements in (0, N):
        c = in_layers(design, elements, layers)
        for A, X in ((0.01, 0.05), (0.2, 0.3), (-0.1, 0.2), (0.3, -0.4), (1e-4, 0.0)):
            h = 1e-6
            p = soil_potential(A, X, c)
            along_A = (soil_potential(A + h, X, c).V - soil_potential(A - h, X, c).V) / (2 * h)
            along_X = (soil_potential(A, X + h, c).V - soil_potential(A, X - h, c).V) / (2 * h)
            assert pytest.approx(along_A, rel=1e-4) == p.V_A
            assert pytest.approx(along_X, rel=1e-4) == p.V_X
            k = lines(random_state(np.random.default_rng(1)), c)._replace(A=A, slope_x=X, B=0.0, slope_v=0.0)
            assert pytest.approx(-p.V_A, rel=1e-12) == soil_reaction(k, c).F


@pytest.mark.compiled
def test_whole_impacts_in_one_layer() -> None:
    """As in the uniform soil, and settled or at the limit as it is there."""
    table = table_in_layers(table_of(DESIGNS), np.stack([uniform_layers(one) for one in DESIGNS]))
    how = control(h=2e-3, horizon=1.0, theta_limit=radians(20.0), stop_at_limit=True)
    found, known = simulate_table(table, READINGS, how), simulate_table(table_of(DESIGNS), READINGS, how)
    np.testing.assert_array_equal(found.status, known.status)
    for one, other in zip(found[1:6], known[1:6], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.compiled
def test_whole_impact_is_that_of_the_oracle() -> None:
    design = design_of(LAYERED)
    layered = table_in_layers(table_of([design]), layers_of(LAYERED)[None])
    how = control(h=1e-3, horizon=0.4)
    limit = bk.simulate(problem_at(layered, 0, how), READINGS, how, bk.no_record())
    exact = recorded_impact(LAYERED, oracle.CORRECTED, elements=500, horizon=0.4, land_on_kinks=False, rtol=1e-8)
    assert limit.maxima.theta == pytest.approx(exact.max_rotation.value, rel=2e-4)
    assert limit.maxima.x_b == pytest.approx(exact.max_displacement.value, rel=2e-4)


def test_closed_form_is_left_alone() -> None:
    """The uniform soil has no arrays, and is what it was."""
    c = constants_of(DESIGNS[0], READINGS, 0)
    k = lines(random_state(np.random.default_rng(2)), c)
    assert soil_reaction(k, c) == closed_form(k, c)
