"""Constants of a design (Eqs 1 to 16, 24 to 28) against the oracle, and the designs that have none."""

from math import atan, cos, pi, sin, tan

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import (
    body_of_box,
    boulder_inertia,
    boulder_mass,
    compression_wedge_length,
    constants_of,
    design_at,
    element_depth,
    element_mass,
    is_computable,
    passive_pressure_coefficient,
    soil_mass,
    spring_per_depth,
    ultimate_pressure,
    wedge_slope,
    yield_displacement,
)
from tests import oracle
from tests.oracle.constants import element_depths, element_masses, impact_lever
from tests.oracle.restoring import gravity_couple, printed_limit
from tests.oracle.soil import spring_constants, ultimate_forces
from tests.oracle.soil import yield_displacement as oracle_yield_displacement

from .samples import ALL_READINGS, design_of, inputs_of, oracle_readings, random_designs, table_of

DESIGNS = [design_of(oracle.ABG), design_of(oracle.RWG), *random_designs(40, seed=11)]
ELEMENTS = [0, 1, 2, 7, 50, 5000]


def oracle_elements(elements: int) -> int | None:
    """The oracle calls the limit of infinitely many elements None, the kernels 0."""
    return elements or None


@pytest.mark.parametrize("elements", ELEMENTS)
@pytest.mark.parametrize("readings", ALL_READINGS)
def test_lumped_constants_are_those_of_the_oracle(readings: bk.Readings, elements: int) -> None:
    """Eqs 1 to 8 and 12 to 16, each reading, and what is precomputed from them."""
    for design in DESIGNS[:: 1 if elements < 100 else 10]:
        inputs = inputs_of(design)
        found = constants_of(design, readings, elements)
        known = oracle.constants(inputs, oracle_readings(readings), oracle_elements(elements))
        for name in ("m_eff", "J_eff", "c_x", "c_y", "l_n"):
            assert getattr(found, name) == pytest.approx(getattr(known, name), rel=1e-12)
        assert found.inverse_m_eff == pytest.approx(1.0 / known.m_eff, rel=1e-12)
        assert found.inverse_J_eff == pytest.approx(1.0 / known.J_eff, rel=1e-12)
        assert found.h == pytest.approx(known.h, rel=1e-12, abs=1e-12)
        assert found.z_0 == pytest.approx(inputs.d - known.c_y, rel=1e-12, abs=1e-12)
        # Eqs 7, 8: the lowest element lies at R_N (sin(gamma_N), cos(gamma_N)), down being -cos
        assert found.d_N == pytest.approx(-known.R_N * cos(known.gamma_N), rel=1e-12)
        assert found.l_n == pytest.approx(known.R_N * sin(known.gamma_N), rel=1e-12)
        assert (found.d, found.elements, found.k_v, found.v_0) == (
            inputs.d,
            elements,
            inputs.k_v,
            inputs.v_0,
        )
        assert found.k_m == pytest.approx(inputs.k_v / inputs.m_v, rel=1e-15)
        assert found.tau_v == pytest.approx(inputs.m_v / inputs.c_v, rel=1e-15)
        assert is_computable(found)


@pytest.mark.parametrize("readings", ALL_READINGS)
def test_weight_and_struck_face(readings: bk.Readings) -> None:
    """The couple and the lever of the blow, each written as a cosine and a sine part."""
    for design in DESIGNS[:10]:
        inputs = inputs_of(design)
        found = constants_of(design, readings, 0)
        known = oracle.constants(inputs, oracle_readings(readings))
        for theta in (-0.8, -0.1, 0.0, 0.2, 1.3):
            lever = found.h * cos(theta) + found.g_x * sin(theta)
            assert lever == pytest.approx(impact_lever(known, theta), rel=1e-12, abs=1e-12)
            couple = found.C_cos * cos(theta) + found.C_sin * sin(abs(theta))
            if readings.restoring_gravity:
                side = 1.0 if theta >= 0.0 else -1.0
                weight = -side * gravity_couple(inputs, known, theta, side)
                assert couple == pytest.approx(weight, rel=1e-12, abs=1e-9 * found.C_cos)
                assert found.theta_corner == np.inf
            else:
                signed = found.C_cos * cos(theta) + found.C_sin * sin(theta)
                assert abs(signed) == pytest.approx(printed_limit(known, theta), rel=1e-12)
                before, beyond = found.theta_corner - 1e-6, found.theta_corner + 1e-6
                assert sin(known.gamma_N + before) > 0.0 > sin(known.gamma_N + beyond)


@pytest.mark.parametrize("elements", [1, 3, 50])
def test_elements(elements: int) -> None:
    """Eqs 2 and 24, element by element."""
    for design in DESIGNS[:5]:
        inputs = inputs_of(design)
        depths = [element_depth(n, design.d, elements) for n in range(1, elements + 1)]
        masses = [element_mass(n, design, elements) for n in range(1, elements + 1)]
        assert depths == pytest.approx(element_depths(inputs.d, elements), rel=1e-13)
        assert masses == pytest.approx(element_masses(inputs, elements), rel=1e-12)
        assert soil_mass(design, elements).mass == pytest.approx(sum(masses), rel=1e-13)


def test_limit_of_many_elements() -> None:
    """A wedge of mass rho_s W tan(theta_w) d^2/2 with its centre at 2d/3; sums approach it with the square of N."""
    for design in DESIGNS[:5]:
        limit = soil_mass(design, 0)
        wedge = design.rho_s * design.W * tan(pi / 4 + design.phi / 2) * design.d**2 / 2
        assert limit.mass == pytest.approx(wedge, rel=1e-14)
        assert limit.first == pytest.approx(wedge * 2 * design.d / 3, rel=1e-14)
        assert limit.second - limit.first**2 / limit.mass == pytest.approx(wedge * design.d**2 / 18, rel=1e-12)
        for name in ("mass", "first", "second"):
            gap = [getattr(soil_mass(design, n), name) / getattr(limit, name) - 1.0 for n in (100, 200)]
            if name == "mass":  # the mass of an element is linear in depth: its midpoint is exact
                assert gap == pytest.approx([0.0, 0.0], abs=1e-12)
            else:
                assert gap[0] / gap[1] == pytest.approx(4.0, abs=0.01)


def test_soil_parameters() -> None:
    """Eqs 1, 24 to 28, singly and as what remains of them: one stiffness, one drag, one yield displacement."""
    alpha, height = np.array([0.7]), np.array([0.01])
    for design in DESIGNS:
        inputs = inputs_of(design)
        assert wedge_slope(design.phi) == pytest.approx(tan(pi / 4 + design.phi / 2), rel=1e-12)
        K_p = (1 + sin(design.phi)) / (1 - sin(design.phi))
        assert passive_pressure_coefficient(design.phi) == pytest.approx(K_p, rel=1e-12)
        assert atan(design.d / compression_wedge_length(design.d, design.phi)) == pytest.approx(design.phi)
        k_n = spring_constants(inputs, alpha, height)[0]
        assert spring_per_depth(design, design.phi, design.beta) * alpha[0] * height[0] == pytest.approx(k_n, rel=1e-13)
        F_u = ultimate_forces(inputs, alpha, height)[0]
        pressure = ultimate_pressure(alpha[0], design.phi, design.rho_s, design.K_epsilon)
        assert pressure * design.W * height[0] == pytest.approx(F_u, rel=1e-13)
        assert yield_displacement(design) == pytest.approx(oracle_yield_displacement(inputs), rel=1e-13)
        c = constants_of(design, bk.corrected(), 0)
        assert c.K_soil == pytest.approx(1e6 * design.beta * design.W * tan(design.phi) * design.d, rel=1e-13)
        assert c.R_soil == pytest.approx(design.rho_s * design.W * design.d, rel=1e-15)
        assert c.x_yield == yield_displacement(design)


def test_boulder() -> None:
    """Eqs 15 and 16: a solid box, or a quarter of its own inertia as printed."""
    for design in DESIGNS[:5]:
        m_b = boulder_mass(design)
        assert m_b == pytest.approx(design.rho_b * design.L * design.W * design.H, rel=1e-15)
        own = m_b / 12 * (design.L**2 + design.H**2)
        middle = design.L / 2, design.H / 2
        assert boulder_inertia(body_of_box(design), *middle, True) == pytest.approx(own, rel=1e-14)
        assert boulder_inertia(body_of_box(design), *middle, False) == pytest.approx(own / 4, rel=1e-14)
        beside = boulder_inertia(body_of_box(design), design.L / 2 + 0.3, design.H / 2 - 0.4, True)
        assert beside == pytest.approx(own + m_b * 0.25, rel=1e-14)


def test_figures_of_the_crash_test() -> None:
    """The known constants of RWG: m_b, M_soil, c_x, c_y and J_eff as printed, to the digits they are known to."""
    c = constants_of(design_of(oracle.RWG), bk.as_printed(), 0)
    m_b = boulder_mass(design_of(oracle.RWG))
    assert m_b == pytest.approx(24754.6, abs=0.05)
    assert c.m_eff - m_b == pytest.approx(14877.7, abs=0.05)
    assert (c.c_x, c.c_y) == (pytest.approx(1.1347, abs=5e-5), pytest.approx(1.5824, abs=5e-5))
    assert c.J_eff == pytest.approx(18487, abs=0.5)


def test_a_row_of_a_table_is_its_design() -> None:
    table = table_of(DESIGNS)
    for row, design in enumerate(DESIGNS):
        assert tuple(design_at(table, row)) == tuple(design)


IMPOSSIBLE = {
    "no mass at all": {"rho_b": 0.0, "rho_s": 0.0},
    "negative width": {"W": -1.0},
    "no embedment": {"d": 0.0},
    "no friction": {"phi": 0.0},
    "steeper than a wall": {"phi": 0.6 * pi},
    "no subgrade reaction": {"beta": 0.0},
    "no soil": {"rho_s": 0.0},
    "no strain rate factor": {"K_epsilon": 0.0},
    "no truck": {"m_v": 0.0},
    "no spring": {"k_v": 0.0},
    "no damper": {"c_v": 0.0},
    "damper that drives": {"c_v": -1e5},
    "backwards": {"v_0": -1.0},
    "height unknown": {"e": np.nan},
    "too wide for a number": {"W": np.inf},
    "overflowing": {"rho_b": 1e308, "L": 1e8},
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("change", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_impossible_designs_are_not_computable(change: dict[str, float]) -> None:
    values = {name: np.float64(value) for name, value in change.items()}
    design = design_of(oracle.RWG)._replace(**values)
    for readings in (bk.as_printed(), bk.corrected()):
        assert not is_computable(constants_of(design, readings, 0))
