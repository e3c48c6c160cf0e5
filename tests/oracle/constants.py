"""Masses, centre of mass and moments of inertia of boulder and lumped soil: Eqs 1 to 16."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, tan

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from .inputs import Inputs, Readings, layer_at


@dataclass(frozen=True)
class Constants:
    """The constants of one impact; symbols as in the paper, SI units.

    Attributes
    ----------
    elements : int or None
        Number N of soil elements; None stands for the limit N -> infinity.
    theta_w : float
        Angle of the shear wedge [rad], Eq 1.
    m_b, M_soil, m_eff : float
        Mass of boulder (Eq 15), of all soil elements (sum of Eq 2), of both (Eq 12) [kg].
    c_x, c_y : float
        Common centre of mass from the lower left corner, right and up [m], Eqs 3 and 4.
    J_b, J_soil, J_eff : float
        Moments of inertia about the common centre of mass [kg m^2]: Eq 16, the sum in Eq 13, Eq 13.
    l_n : float
        Distance from the centre of mass to the right face [m], Eq 14.
    h : float
        Height of the blow over the centre of mass [m]: e + d_1 of Eqs 5 and 6, or e + d - c_y.
    R_v, gamma_v : float
        Polar coordinates of the blow [m], [rad], Eqs 5 and 6; gamma_v has the sign of the contact reading.
    R_N, gamma_N : float
        Polar coordinates of the lowest element [m], [rad], Eqs 7 and 8.
    """

    elements: int | None
    theta_w: float
    m_b: float
    M_soil: float
    m_eff: float
    c_x: float
    c_y: float
    J_b: float
    J_soil: float
    J_eff: float
    l_n: float
    h: float
    R_v: float
    gamma_v: float
    R_N: float
    gamma_N: float


def shear_wedge_angle(phi: float) -> float:
    """Angle theta_w of the shear wedge [rad], Eq 1."""
    return pi / 4 + phi / 2


def element_depths(d: float, elements: int) -> NDArray[np.float64]:
    """Depths alpha_n [m] of the element centres, d/(2N) ... d (1 - 1/(2N)), given with Eq 24."""
    n = np.arange(1.0, elements + 1)
    return np.asarray(d / elements * (n - 0.5))


def element_masses(inputs: Inputs, elements: int) -> NDArray[np.float64]:
    """Masses m_n [kg] of the soil elements, n = 1 at the top, Eq 2."""
    n = np.arange(1.0, elements + 1)
    h_e = inputs.d / elements
    if inputs.ground is not None:
        layers = [layer_at(inputs.ground, float(alpha)) for alpha in element_depths(inputs.d, elements)]
        length = np.array([layer.rho_s * tan(shear_wedge_angle(layer.phi)) for layer in layers])
        return np.asarray(length * inputs.W * h_e * (inputs.d - h_e * (n - 0.5)))
    theta_w = shear_wedge_angle(inputs.phi)
    return np.asarray(inputs.rho_s * inputs.W * h_e * tan(theta_w) * (inputs.d - h_e * (n - 0.5)))


def soil_moment(inputs: Inputs, elements: int | None, power: int, about: float = 0.0) -> float:
    """Sum over the soil of mass times (height over the base less `about`) to the given power (Eqs 3, 4, 13).

    For N -> infinity (`elements` None) an integral: at depth alpha the wedge of Eq 2 is
    (d - alpha) tan(theta_w) long, and lies d - alpha over the base.
    """
    if elements is not None:
        n = np.arange(1.0, elements + 1)
        height_n = inputs.d * -(n - elements - 0.5) / elements  # as in Eq 4
        return float((element_masses(inputs, elements) * (height_n - about) ** power).sum())
    d = inputs.d
    # over a unit depth, so that the tolerance of the quadrature does not depend on the size of the boulder
    unit, _ = quad(lambda s: (1 - s) * ((1 - s) - about / d) ** power, 0.0, 1.0, epsabs=1e-15, epsrel=1e-12)
    return inputs.rho_s * inputs.W * tan(shear_wedge_angle(inputs.phi)) * d ** (2 + power) * unit


def constants(inputs: Inputs, readings: Readings, elements: int | None = None) -> Constants:
    """Work out the constants of one impact, Eqs 1 to 8 and 12 to 16.

    Parameters
    ----------
    inputs : Inputs
        The impact.
    readings : Readings
        Uses `inertia`, `impact_arm` and `contact`.
    elements : int, optional
        Number N of soil elements; without it, N -> infinity.

    Returns
    -------
    Constants
    """
    L, H, d = inputs.L, inputs.H, inputs.d
    m_b = inputs.rho_b * L * inputs.W * H  # Eq 15
    M_soil = soil_moment(inputs, elements, 0)
    m_eff = m_b + M_soil  # Eq 12
    c_x = (M_soil * L + m_b * L / 2) / m_eff  # Eq 3
    c_y = (soil_moment(inputs, elements, 1) + m_b * H / 2) / m_eff  # Eq 4
    l_n = L - c_x  # Eq 14

    if readings.inertia == "printed":
        own = m_b / 12 * ((H / 2) ** 2 + (L / 2) ** 2)  # Eq 16, first term as printed
    else:
        own = m_b / 12 * (H**2 + L**2)  # a solid box about its own centre
    J_b = own + m_b * ((c_y - H / 2) ** 2 + (c_x - L / 2) ** 2)  # Eq 16, second term
    J_soil = soil_moment(inputs, elements, 2, about=c_y) + M_soil * l_n**2  # the sum in Eq 13; d_n = c_y - height

    h_e = 0.0 if elements is None else d / elements
    d_1 = h_e / 2 - (d - c_y)  # depth of the first (top) element below the centre of mass; negative above it
    d_N = (d - h_e / 2) - (d - c_y)  # the same of the last element
    # Eqs 5 and 6 have e + d_1; the height of the blow over the centre of mass is e + d - c_y
    h = inputs.e + d_1 if readings.impact_arm == "printed" else inputs.e + d - c_y
    gamma_v = atan2(c_x, h)  # Eq 5; arctan(c_x/h) fails for h < 0, arctan2 keeps the quadrant
    if readings.contact == "left_face":
        gamma_v = -gamma_v  # the struck face is on the left of the centre of mass
    return Constants(
        elements=elements,
        theta_w=shear_wedge_angle(inputs.phi),
        m_b=m_b,
        M_soil=M_soil,
        m_eff=m_eff,
        c_x=c_x,
        c_y=c_y,
        J_b=J_b,
        J_soil=J_soil,
        J_eff=J_b + J_soil,
        l_n=l_n,
        h=h,
        R_v=hypot(h, c_x),  # Eq 6
        gamma_v=gamma_v,
        R_N=hypot(d_N, l_n),  # Eq 8
        gamma_N=atan2(d_N, l_n) + pi / 2,  # Eq 7
    )


def impact_lever(constants: Constants, theta: float) -> float:
    """Height R_v cos(gamma_v + theta) [m] of the blow over the centre of mass, in Eqs 45, 48 and 52."""
    return constants.R_v * cos(constants.gamma_v + theta)
