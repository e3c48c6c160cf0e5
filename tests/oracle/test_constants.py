"""Eqs 1 to 16 against figures known beforehand and against the geometry they stand for."""

from dataclasses import replace
from math import cos, pi, radians, sin, tan

import numpy as np
import pytest

from tests.oracle import ABG, AS_PRINTED, CORRECTED, RWG, Inputs, Readings, constants, problem
from tests.oracle.constants import element_depths, element_masses, impact_lever
from tests.oracle.dynamics import boulder_centre_displacement, contact_displacement
from tests.oracle.restoring import printed_sign


@pytest.mark.parametrize(
    ("name", "figure", "digits"),
    [
        ("m_b", 24754.6, 0.05),  # mass of the boulder [kg]
        ("M_soil", 14877.7, 0.05),  # mass of the lumped soil [kg]
        ("c_x", 1.1347, 5e-5),  # centre of mass from the left [m]
        ("c_y", 1.5824, 5e-5),  # and from below [m]
        ("J_eff", 18487.0, 0.5),  # moment of inertia, Eq 16 as printed [kg m^2]
    ],
)
def test_rockville_constants(name: str, figure: float, digits: float) -> None:
    assert getattr(constants(RWG, AS_PRINTED), name) == pytest.approx(figure, abs=digits)


@pytest.mark.parametrize("inputs", [ABG, RWG])
def test_limit_of_many_elements(inputs: Inputs) -> None:
    """The wedge is a triangle: its mass, the height of its centre and its inertia are known exactly."""
    lumped = constants(inputs, CORRECTED)
    M = inputs.rho_s * inputs.W * tan(lumped.theta_w) * inputs.d**2 / 2
    assert lumped.M_soil == pytest.approx(M, rel=1e-13)
    assert lumped.c_y == pytest.approx((M * 2 * inputs.d / 3 + lumped.m_b * inputs.H / 2) / lumped.m_eff, rel=1e-13)
    exact = M * ((2 * inputs.d / 3 - lumped.c_y) ** 2 + inputs.d**2 / 18 + lumped.l_n**2)
    assert lumped.J_soil == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("name", ["c_y", "J_soil"])
def test_element_sums_converge_with_second_order(name: str) -> None:
    limit = getattr(constants(RWG, CORRECTED), name)
    errors = [abs(getattr(constants(RWG, CORRECTED, n), name) - limit) for n in (50, 100, 200)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.02)


def test_lumped_inertia_is_the_literal_sum_of_eq_13() -> None:
    lumped = constants(RWG, CORRECTED, 37)
    d_n = element_depths(RWG.d, 37) - (RWG.d - lumped.c_y)
    literal = sum(m * (d**2 + lumped.l_n**2) for m, d in zip(element_masses(RWG, 37), d_n, strict=True))
    assert lumped.J_soil == pytest.approx(literal, rel=1e-13)


def test_box_inertia_is_that_of_a_solid() -> None:
    """Against the integral of rho (x^2 + y^2) over the box, by Gauss quadrature in both directions."""
    lumped = constants(RWG, CORRECTED)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = RWG.L / 2 * (1 + nodes)[:, None] - lumped.c_x
    y = RWG.H / 2 * (1 + nodes)[None, :] - lumped.c_y
    integral = np.sum(weights[:, None] * weights * (x**2 + y**2)) * RWG.L * RWG.H / 4
    assert lumped.J_b == pytest.approx(RWG.rho_b * RWG.W * integral, rel=1e-13)
    printed = constants(RWG, Readings(inertia="printed"))
    own = lumped.m_b / 12 * (RWG.L**2 + RWG.H**2)
    assert lumped.J_b - printed.J_b == pytest.approx(0.75 * own, rel=1e-12)


def test_impact_arm_readings() -> None:
    """As printed d_1 is negative above the centre of mass: the arm is off by twice that."""
    geometric, printed = (
        constants(RWG, CORRECTED, 40),
        constants(RWG, replace(CORRECTED, impact_arm="printed"), 40),
    )
    d_1 = element_depths(RWG.d, 40)[0] - (RWG.d - geometric.c_y)
    assert d_1 < 0
    assert printed.h == pytest.approx(RWG.e + d_1, rel=1e-13)
    assert geometric.h - printed.h == pytest.approx(-2 * d_1 + RWG.d / 80, rel=1e-12)


@pytest.mark.parametrize("arm", ["printed", "geometric"])
@pytest.mark.parametrize(("contact", "side"), [("printed", 1.0), ("left_face", -1.0)])
def test_impact_lever_in_every_quadrant(arm: str, contact: str, side: float) -> None:
    """R_v cos(gamma_v + theta) is h cos(theta) -+ c_x sin(theta), also where h is negative as printed."""
    low = replace(RWG, e=0.2)
    lumped = constants(low, Readings(impact_arm=arm, contact=contact))
    assert (lumped.h < 0) == (arm == "printed")
    for theta in np.linspace(-pi, pi, 17):
        expected = lumped.h * cos(theta) - side * lumped.c_x * sin(theta)
        assert impact_lever(lumped, theta) == pytest.approx(expected, abs=1e-14)


def test_lever_is_the_rate_of_the_contact_displacement() -> None:
    impact = problem(RWG, CORRECTED)
    y = np.zeros(7)
    for theta in (-0.4, 0.0, 0.9, 2.5):
        ends = []
        for step in (-1e-5, 1e-5):
            y[2] = theta + step
            ends.append(contact_displacement(impact, y))
        slope = (ends[1] - ends[0]) / 2e-5
        assert slope == pytest.approx(impact_lever(impact.constants, theta), abs=1e-9)


@pytest.mark.parametrize(("inputs", "degrees"), [(ABG, 13.6), (RWG, 18.0)])
def test_printed_restoring_moment_turns_round(inputs: Inputs, degrees: float) -> None:
    """Rotation past which Eqs 37 to 39 drive the boulder over."""
    lumped = constants(inputs, AS_PRINTED)
    assert printed_sign(lumped, radians(degrees - 0.06)) == 1.0
    assert printed_sign(lumped, radians(degrees + 0.06)) == -1.0


@pytest.mark.parametrize("theta", [-0.3, 0.2, 1.4, 2.6])
def test_displacement_of_the_boulders_own_centre(theta: float) -> None:
    """Eqs 53 to 55 put right, against turning the point itself about the common centre of mass."""
    impact = problem(RWG, CORRECTED)
    offset = complex(RWG.L / 2 - impact.constants.c_x, RWG.H / 2 - impact.constants.c_y)
    turned = offset * np.exp(-1j * theta)  # clockwise
    x = boulder_centre_displacement(impact, np.array([0.1]), np.array([theta]))
    assert x[0] == pytest.approx(0.1 + turned.real - offset.real, abs=1e-14)


def test_unknown_reading_is_refused() -> None:
    with pytest.raises(ValueError, match="contact"):
        Readings(contact="right_face")
