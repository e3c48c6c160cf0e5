"""A design and the constants of its motion (Eqs 1-16, 24-28), and boulders that are no boxes (Eqs 141 to 144).

Symbols are the paper's. X points in the direction of travel, Y down, theta_b > 0 turns the top of the boulder
away from the truck; alpha is the depth below the soil line, 0 ... d.

**The outline** of a boulder gives width and length over the height, piecewise linear. At a height z over the foot it is
w(z) wide, and reaches near(z) towards the vehicle and far(z) away from it, counted from the middle of its foot. Volume,
centre and moment of inertia are integrals of polynomials over the pieces between the points of the outline. Gauss's
rule of three points is exact up to the fifth degree, which none of them exceeds. A box has an outline without points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel, inlined
from .numerics import direction, half_tangent


class Readings(NamedTuple):
    """Which formula is used wherever the printed one is wrong; False reads it as printed."""

    inertia_box: bool
    """Eq 16: moment of inertia of a box, m_b/12 (H^2 + L^2), in place of a quarter of it."""
    arm_geometric: bool
    """Eqs 5, 6: height of the blow over the centre of mass e + d - c_y, in place of e + d_1."""
    contact_left_face: bool
    """Eqs 45, 48: the struck face is the left one, lever h cos + c_x sin in place of h cos - c_x sin."""
    restoring_gravity: bool
    """Eqs 37-39: the couple of the weight at the corner, in place of a moment against the net moment."""
    separation_released: bool
    """Eq 47: the truck coasts once the contact force is used up, in place of being pulled forward."""


def as_printed() -> Readings:
    """Return the readings that reproduce the paper as it stands in print."""
    return Readings(False, False, False, False, False)


def corrected() -> Readings:
    """Return the readings with every known misprint put right: the default for design."""
    return Readings(True, True, True, True, True)


G = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


class Design(NamedTuple):
    """One boulder in one soil before one truck."""

    L: float
    """Boulder length, along the direction of travel [m]."""
    W: float
    """Width of the boulder [m]."""
    H: float
    """Height of the boulder [m]."""
    rho_b: float
    """Density of the boulder [kg/m^3]."""
    d: float
    """Embedment depth of the boulder [m]."""
    e: float
    """Height of the blow over the soil line [m] (Eq 9)."""
    rho_s: float
    """Density of the soil [kg/m^3]."""
    phi: float
    """Effective angle of internal friction of the soil [rad]."""
    beta: float
    """Constant of horizontal subgrade reaction [MN/m^3]."""
    K_epsilon: float
    """Effect of the strain rate on the ultimate resistance of the soil [-]."""
    m_v: float
    """Mass of the vehicle [kg]."""
    v_0: float
    """Speed of impact [m/s]."""
    k_v: float
    """Spring of the vehicle's Maxwell element [N/m]."""
    c_v: float
    """Damper of the vehicle's Maxwell element [N s/m]."""
    e_bumper: float
    """Height of the underside of the bumper over the soil line [m]."""


class DesignTable(NamedTuple):
    """Many designs: the fields of `Design`, each a contiguous float64 array of shape (n,)."""

    L: np.ndarray
    W: np.ndarray
    H: np.ndarray
    rho_b: np.ndarray
    d: np.ndarray
    e: np.ndarray
    rho_s: np.ndarray
    phi: np.ndarray
    beta: np.ndarray
    K_epsilon: np.ndarray
    m_v: np.ndarray
    v_0: np.ndarray
    k_v: np.ndarray
    c_v: np.ndarray
    e_bumper: np.ndarray


def design_at(table: DesignTable, row: int) -> Design:
    """Return one row of a table as a `Design`."""
    return Design(*(column[row] for column in table[: len(Design._fields)]))


@inlined
def design_in(a: np.ndarray, row: int) -> Design:
    """Return the design in a column of an array."""
    x = a[:, row]
    return Design(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12], x[13], x[14])


class Constants(NamedTuple):
    """What the motion of one design depends on; every field is constant during the impact."""

    m_eff: float
    """Mass of boulder and lumped soil [kg] (Eq 12)."""
    J_eff: float
    """Moment of inertia of boulder and lumped soil about their centre of mass [kg m^2] (Eq 13)."""
    inverse_m_eff: float
    """Reciprocal of m_eff [1/kg]."""
    inverse_J_eff: float
    """Reciprocal of J_eff [1/(kg m^2)]."""
    c_x: float
    """Centre of mass from the lower left corner, in X [m] (Eq 3)."""
    c_y: float
    """Centre of mass over the lower left corner [m] (Eq 4)."""
    l_n: float
    """Centre of mass to the soil elements, in X [m] (Eq 14)."""
    z_0: float
    """Depth of the centre of mass below the soil line, d - c_y [m]."""
    d: float
    """Embedment depth of the boulder [m]."""
    elements: int
    """Number N of soil elements; 0 stands for the limit N -> infinity in closed form."""
    K_soil: float
    """Spring of the whole soil per unit of depth ratio, 1e6 beta W tan(phi') d [N/m] (Eqs 24-26)."""
    R_soil: float
    """Drag of the whole soil, rho_s W d [kg/m] (Eq 36)."""
    x_yield: float
    """Displacement at which every element reaches its ultimate resistance [m] (Eqs 26-28)."""
    h: float
    """Height of the blow over the centre of mass [m] (Eqs 5, 6)."""
    g_x: float
    """Signed distance of the struck face in the lever h cos + g_x sin: +c_x or -c_x [m] (Eqs 45, 48)."""
    k_v: float
    """Spring of the vehicle [N/m]."""
    k_m: float
    """k_v / m_v [1/s^2]."""
    tau_v: float
    """m_v / c_v [s]: crush of the damper per unit of speed lost (Eq 45, integrated)."""
    v_0: float
    """Speed of impact [m/s]."""
    C_cos: float
    """Couple against turning, part that goes with cos(theta_b) [N m] (Eqs 37-39)."""
    C_sin: float
    """Couple against turning, part that goes with |sin(theta_b)| [N m]."""
    d_N: float
    """Depth of the lowest element below the centre of mass [m]."""
    theta_corner: float
    """Angle beyond which sin(gamma_N + theta_b) < 0 [rad]; infinite where no reading asks for it."""


@inlined
def error_arm(c: Constants) -> float:
    """Arm by which an angle is compared with a displacement in what is said of errors [m].

    The embedment depth, or the height of the centre of mass over the base where that is more.
    """
    return c.d - min(c.z_0, 0.0)


@exact_inlined
def wedge_slope(phi: float) -> float:
    """Tangent of the angle theta_w = pi/4 + phi/2 of the wedge of soil that moves with the boulder [-] (Eq 1)."""
    half = half_tangent(phi)
    return (1.0 + half) / (1.0 - half)


@exact_inlined
def element_depth(n: int, d: float, elements: int) -> float:
    """Depth alpha_n of the middle of element n = 1 ... N below the soil line [m] (Eq 24)."""
    return (n - 0.5) * d / elements


@exact_inlined
def element_mass(n: int, design: Design, elements: int) -> float:
    """Mass m_n of soil element n = 1 ... N [kg] (Eq 2)."""
    h_e = design.d / elements
    return design.rho_s * design.W * h_e * wedge_slope(design.phi) * (design.d - element_depth(n, design.d, elements))


@exact_inlined
def boulder_mass(design: Design) -> float:
    """Mass m_b of the boulder [kg] (Eq 15)."""
    return design.rho_b * design.L * design.W * design.H


class Body(NamedTuple):
    """The boulder as a rigid body. X counts from where the vehicle strikes it, heights from its base."""

    m_b: float
    """Mass [kg] (Eq 15)."""
    J: float
    """Moment of inertia about its own centre [kg m^2] (Eq 16, first term)."""
    x: float
    """X of the boulder's centre of mass [m]."""
    y: float
    """Height of its centre [m]."""
    line: float
    """Line of the soil elements, in X: the far face [m]."""
    foot: float
    """Half the length of its foot [m]."""
    lean: float
    """Distance of the boulder's centre from the middle of the foot, towards the vehicle [m]."""


@inlined
def body_in(a: np.ndarray, first: int, row: int) -> Body:
    """Return the body in a column of an array from an index on."""
    x = a[first:, row]
    return Body(x[0], x[1], x[2], x[3], x[4], x[5], x[6])


@exact_inlined
def body_of_box(design: Design) -> Body:
    """Return the box of the paper as a rigid body (Eqs 3, 4, 15, 16)."""
    m_b, H, L = boulder_mass(design), design.H, design.L
    return Body(m_b, m_b / 12.0 * (H * H + L * L), 0.5 * L, 0.5 * H, L, 0.5 * L, 0.0)


@exact_inlined
def boulder_inertia(body: Body, c_x: float, c_y: float, box: bool) -> float:
    """Moment of inertia J_b of the boulder about the common centre of mass [kg m^2] (Eq 16).

    Departs from print where ``box``: the first term is the inertia of a box, m_b/12 (H^2 + L^2), or of the actual
    boulder; printed, it has the half lengths and so a quarter of it.
    """
    J = body.J
    if not box:
        J *= 0.25
    return J + body.m_b * ((c_y - body.y) ** 2 + (c_x - body.x) ** 2)


class SoilMass(NamedTuple):
    """The soil lumped on the boulder: sums over the elements."""

    mass: float
    """Sum of m_n [kg]."""
    first: float
    """Sum of m_n times height over the base [kg m] (Eq 4)."""
    second: float
    """Sum of m_n times height over the base, squared [kg m^2] (for Eq 13)."""


@exact_inlined
def soil_mass(design: Design, elements: int) -> SoilMass:
    """Sums of Eqs 3, 4 and 13 over the soil elements, or their limits for N -> infinity.

    ``design``: the design, SI; ``elements``: N, or 0 for the limit: a wedge of mass rho_s W tan(theta_w) d^2/2 with its
    centre at 2d/3 over the base.
    """
    if elements == 0:
        d = design.d
        mass = design.rho_s * design.W * wedge_slope(design.phi) * 0.5 * d * d
        return SoilMass(mass, mass * (2.0 / 3.0) * d, mass * 0.5 * d * d)
    mass = first = second = 0.0
    for n in range(1, elements + 1):
        m_n = element_mass(n, design, elements)
        height = design.d - element_depth(n, design.d, elements)
        mass += m_n
        first += m_n * height
        second += m_n * height * height
    return SoilMass(mass, first, second)


@exact_inlined
def passive_pressure_coefficient(phi: float) -> float:
    """Rankine coefficient of passive earth pressure K_p, the square of tan(pi/4 + phi/2) [-] (with Eq 27)."""
    return wedge_slope(phi) ** 2


@exact_inlined
def ultimate_pressure(alpha: float, phi: float, rho_s: float, K_epsilon: float) -> float:
    """Ultimate lateral pressure sigma of the soil at depth alpha [Pa] (Eq 27)."""
    return passive_pressure_coefficient(phi) ** 2 * rho_s * G * alpha * K_epsilon


@exact_inlined
def compression_wedge_length(d: float, phi: float) -> float:
    """Length L_soil,c of the wedge of soil that is compressed [m] (Eq 25)."""
    half = half_tangent(phi)
    return d * (1.0 - half * half) / (2.0 * half)


@exact_inlined
def spring_per_depth(design: Design, phi: float, beta: float) -> float:
    """Spring of a soil element of unit height per metre of its depth [N/m^3] (Eqs 24, 25).

    Friction angle [rad] and constant of subgrade reaction [MN/m^3] are of the soil at that depth.

    A slice of unit height at depth alpha has the stiffness of a rod (Eq 23), 1e6 beta W alpha / L_soil,c.
    """
    return 1e6 * beta * design.W / compression_wedge_length(design.d, phi)


@exact_inlined
def ultimate_per_depth(design: Design) -> float:
    """Ultimate resistance of a soil element of unit height per metre of its depth [N/m^2] (Eqs 26, 27)."""
    return ultimate_pressure(1.0, design.phi, design.rho_s, design.K_epsilon) * design.W


@exact_inlined
def yield_displacement(design: Design) -> float:
    """Displacement at which a soil element reaches its ultimate resistance [m] (Eqs 26-28).

    Spring and ultimate resistance both grow in proportion to depth, so it is the same for all elements.
    """
    return ultimate_per_depth(design) / spring_per_depth(design, design.phi, design.beta)


@exact_inlined
def constants_with(
    design: Design,
    body: Body,
    readings: Readings,
    elements: int,
    soil: SoilMass,
    K_soil: float,
    R_soil: float,
    x_yield: float,
) -> Constants:
    """Constants of the motion of one design in a soil of which mass, spring, drag and yield are known.

    ``design``: the design, SI; ``elements``: number N of soil elements; 0 for the closed form; ``body``: the boulder;
    ``soil``: the soil lumped on the boulder; ``K_soil, R_soil, x_yield``: spring [N/m], drag [kg/m] and yield
    displacement [m] of the soil, see `Constants`.
    """
    d = design.d
    m_b = body.m_b
    m_eff = m_b + soil.mass
    c_x = (soil.mass * body.line + m_b * body.x) / m_eff
    c_y = (soil.first + m_b * body.y) / m_eff
    l_n = body.line - c_x
    z_0 = d - c_y
    # Eq 13 with d_n = c_y - height: the sum of m_n (d_n^2 + l_n^2) from the sums over heights.
    J_soil = soil.second - 2.0 * c_y * soil.first + (c_y * c_y + l_n * l_n) * soil.mass
    J_eff = boulder_inertia(body, c_x, c_y, readings.inertia_box) + J_soil
    half_element = 0.5 * d / elements if elements > 0 else 0.0
    h = design.e + z_0 if readings.arm_geometric else design.e + half_element - z_0
    d_N = c_y - half_element
    if readings.restoring_gravity:
        C_cos, C_sin = m_b * G * body.foot, -(m_b * G * body.y)
        theta_corner = np.inf
    else:
        C_cos, C_sin = m_b * G * d_N, m_b * G * l_n
        theta_corner = direction(d_N, l_n)
    return Constants(
        m_eff,
        J_eff,
        1.0 / m_eff,
        1.0 / J_eff,
        c_x,
        c_y,
        l_n,
        z_0,
        d,
        elements,
        K_soil,
        R_soil,
        x_yield,
        h,
        c_x if readings.contact_left_face else -c_x,
        design.k_v,
        design.k_v / design.m_v,
        design.m_v / design.c_v,
        design.v_0,
        C_cos,
        C_sin,
        d_N,
        theta_corner,
    )


@exact_inlined
def constants_of(design: Design, readings: Readings, elements: int) -> Constants:
    """Constants of the motion of one design (Eqs 1-16, 24-28).

    Parameters
    ----------
    design
        The design, SI.
    readings
        Which formulas are read as printed.
    elements
        Number N of soil elements, or 0 for the closed form.

    Returns
    -------
    Constants
        Non-finite or non-positive where the design is impossible: see `is_computable`.
    """
    d = design.d
    return constants_with(
        design,
        body_of_box(design),
        readings,
        elements,
        soil_mass(design, elements),
        spring_per_depth(design, design.phi, design.beta) * d * d,
        design.rho_s * design.W * d,
        yield_displacement(design),
    )


@exact_inlined
def is_computable(c: Constants) -> bool:
    """Whether every constant is finite and every mass, stiffness and length that divides is positive."""
    positive = (
        c.m_eff > 0.0
        and c.J_eff > 0.0
        and c.d > 0.0
        and c.K_soil > 0.0
        and c.R_soil > 0.0
        and c.x_yield > 0.0
        and c.k_v > 0.0
        and c.k_m > 0.0
        and c.tau_v >= 0.0
        and c.v_0 >= 0.0
    )
    total = c.m_eff + c.J_eff + c.inverse_m_eff + c.inverse_J_eff + c.K_soil + c.R_soil + c.x_yield
    total += abs(c.h) + abs(c.g_x) + c.k_v + c.k_m + c.tau_v + c.v_0 + abs(c.C_cos) + abs(c.C_sin)
    return positive and np.isfinite(total)


HEIGHT, WIDTH, NEAR, FAR = range(4)
"""Columns of an outline, shape (P, 4), from the foot to the top: height over the foot, ascending from 0 to H, width,
and reach towards the vehicle and away from it [m]. Between its points it is linear."""

NODES = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three points on 0 ... 1."""


@exact_inlined
def piece_at(outline: np.ndarray, z: float) -> int:
    """Return the number of the piece of an outline that a height [m] lies in, at a point of the outline the lower."""
    i = 0
    while i < len(outline) - 2 and outline[i + 1, HEIGHT] < z:
        i += 1
    return i


@exact_inlined
def slope_of(outline: np.ndarray, i: int, column: int) -> float:
    """Return by how much a column of an outline grows with the height on its piece i [-]."""
    return (outline[i + 1, column] - outline[i, column]) / (outline[i + 1, HEIGHT] - outline[i, HEIGHT])


@exact_inlined
def on_piece(outline: np.ndarray, i: int, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m] on its piece i [m]."""
    return outline[i, column] + slope_of(outline, i, column) * (z - outline[i, HEIGHT])


@exact_inlined
def at_height(outline: np.ndarray, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m]; beyond its top that at the top [m]."""
    z = min(z, outline[-1, HEIGHT])
    return on_piece(outline, piece_at(outline, z), column, z)


@exact_kernel
def body_of_outline(design: Design, outline: np.ndarray) -> Body:
    """Mass, centre, moment of inertia and reach of a boulder with an outline (Eqs 141 to 144).

    ``design``: the design, SI; its density is the mass over the volume within the outline; ``outline``: the outline,
    shape (P, 4).
    """
    d = design.d
    volume = x = z_c = xx = zz = line = 0.0
    for i in range(len(outline) - 1):
        low, high = outline[i, HEIGHT], outline[i + 1, HEIGHT]
        buried = min(high, d)
        for g in range(3):
            z = low + NODES[g] * (high - low)
            w, near, far = (on_piece(outline, i, WIDTH, z), on_piece(outline, i, NEAR, z), on_piece(outline, i, FAR, z))
            slice_ = WEIGHTS[g] * (high - low) * w
            area = slice_ * (near + far)
            volume += area
            z_c += area * z
            zz += area * z * z
            x += slice_ * 0.5 * (far * far - near * near)
            xx += slice_ * (far * far * far + near * near * near) / 3.0
            if low < buried:
                z = low + NODES[g] * (buried - low)
                line += WEIGHTS[g] * (buried - low) * (d - z) * on_piece(outline, i, FAR, z)
    x, z_c, line = x / volume, z_c / volume, line / (0.5 * d * d)
    m_b = design.rho_b * volume
    J = design.rho_b * (xx + zz) - m_b * (x * x + z_c * z_c)
    struck = at_height(outline, NEAR, d + design.e)
    foot_near, foot_far = outline[0, NEAR], outline[0, FAR]
    half = 0.5 * (foot_near + foot_far)
    return Body(m_b, J, struck + x, z_c, struck + line, half, 0.5 * (foot_far - foot_near) - x)


@exact_kernel
def body_with(design: Design, outline: np.ndarray) -> Body:
    """Return the boulder with an outline, shape (P, 4), or the box of the design where it has no points."""
    return body_of_outline(design, outline) if len(outline) > 0 else body_of_box(design)
