"""Soils that are not the same at every depth: elements with values of their own, held against uniform soils."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.impact import simulate_with
from boulder_kernels.layered import layered_constants, uniform_layers
from boulder_kernels.soil import drag_power, soil_energy, soil_potential, soil_reaction
from tests import oracle

from .samples import control, design_of, random_designs, random_state
from .test_soil import lines

READINGS = bk.corrected()
DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(4, seed=31)]
N = 40


def as_layers(design: bk.Design, layers: np.ndarray | None = None, elements: int = N):
    """Constants of a design in layers; in the uniform soil of its own if none are given."""
    return layered_constants(design, uniform_layers(design) if layers is None else layers, READINGS, elements)


def test_one_layer_is_the_uniform_soil() -> None:
    """Masses, forces, moments, energy with its slopes and the power of the drag are those of the sums of the paper."""
    rng = np.random.default_rng(5)
    for design in DESIGNS:
        c, uniform = as_layers(design), constants_of(design, READINGS, N)
        np.testing.assert_allclose(c[: len(uniform)], uniform, rtol=1e-14)
        for _ in range(20):
            y = random_state(rng)
            k = lines(y, uniform)
            np.testing.assert_allclose(soil_reaction(k, c), soil_reaction(k, uniform), rtol=1e-11)
            of_layers, of_uniform = soil_potential(k.A, k.slope_x, c), soil_potential(k.A, k.slope_x, uniform)
            np.testing.assert_allclose(of_layers, of_uniform, rtol=1e-11)
            assert soil_energy(k, c) == of_layers.V
            assert drag_power(k, c) == pytest.approx(drag_power(k, uniform), rel=1e-12)


def test_same_soil_twice_is_one_soil() -> None:
    """A boundary between two layers of the same soil changes nothing."""
    for design in DESIGNS:
        twice = np.repeat(uniform_layers(design), 2, axis=0)
        twice[0, 0] = 0.4 * design.d
        once, again = as_layers(design), as_layers(design, twice)
        assert once[:-1] == again[:-1]
        for one, other in zip(once.soil, again.soil, strict=True):
            np.testing.assert_array_equal(one, other)


def test_whole_impact_in_one_layer() -> None:
    """The same motion, to the rounding of sums, as in the uniform soil with as many elements."""
    for design in DESIGNS:
        how = control(h=2e-3, elements=N)
        found = simulate_with(as_layers(design), READINGS, how, bk.no_record())
        known = bk.simulate_design(design, READINGS, how, bk.no_record())
        assert found.status == known.status
        assert found.maxima.theta == pytest.approx(known.maxima.theta, rel=1e-9)
        assert found.maxima.x_v == pytest.approx(known.maxima.x_v, rel=1e-9)
