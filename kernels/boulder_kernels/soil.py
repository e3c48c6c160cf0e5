"""Reaction of the soil on the boulder (Eqs 19-36): element sums, and their limit in closed form.

With theta_b = theta and d_n = alpha_n - z_0 the polar coordinates of Eqs 7, 8 are

    R_n sin(gamma_n + theta) = l_n cos(theta) - d_n sin(theta)
    R_n cos(gamma_n + theta) = -(d_n cos(theta) + l_n sin(theta))

so displacement (Eq 22), velocity (Eq 35) and lever (Eq 20) of an element are linear in its depth alpha:

    Delta x(alpha) = A - sin(theta) alpha         A = x_b - l_n (1 - cos(theta)) + z_0 sin(theta)
    v(alpha)       = B - omega cos(theta) alpha   B = v_b - omega q,   q = l_n sin(theta) - z_0 cos(theta)
    lever(alpha)   = -(alpha cos(theta) + q)

No element needs a sine or an arctangent of its own, and the limit N -> infinity is a piecewise polynomial:
all elements reach their ultimate resistance at the same displacement, so the springs have at most two break
points along the depth, and the drag one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .design import Constants
from .numerics import WIDTH, add, partial_sums, total

TINY = 1e-30
"""Stands in for a slope of zero, so that a break point at infinity is clamped and not 0/0."""


class Reaction(NamedTuple):
    """Force and moment of the soil on the boulder."""

    F: float
    """Sum of F_n [N] (Eq 19)."""
    M: float
    """Sum of M_n about the common centre of mass [N m] (Eq 20)."""


class Kinematics(NamedTuple):
    """Displacement and velocity of the soil along the depth, as lines."""

    A: float
    """Displacement at the soil line [m]."""
    slope_x: float
    """Decrease of displacement over the whole depth, sin(theta) d [m]."""
    B: float
    """Velocity at the soil line [m/s]."""
    slope_v: float
    """Decrease of velocity over the whole depth, omega cos(theta) d [m/s]."""
    q: float
    """Depth of the centre of mass relative to the soil line as a lever, l_n sin - z_0 cos [m]."""
    lever_d: float
    """Increase of the lever over the whole depth, cos(theta) d [m]."""


class Potential(NamedTuple):
    """Elastic energy of the soil and its slopes."""

    V: float
    """Energy stored in the springs [J]."""
    V_A: float
    """Derivative of V by the displacement at the soil line [N]."""
    V_X: float
    """Derivative of V by the decrease of displacement over the depth [N]."""
    highest: float
    """Upper bound of V, nearly V itself, that loops over lanes can work out [J]."""


@inlined
def soil_kinematics(x_b: float, v_b: float, omega_b: float, sin: float, versin: float, c: Constants) -> Kinematics:
    """Lines of displacement (Eq 22), velocity (Eq 35) and lever (Eqs 7, 8, 20) along the depth.

    ``x_b, v_b, omega_b``: displacement [m] and velocity [m/s] of the centre of mass, angular velocity [rad/s]; ``sin,
    versin``: sin(theta_b) and 1 - cos(theta_b).
    """
    cos = 1.0 - versin
    lever_d = c.d * cos
    q = c.l_n * sin - c.z_0 * cos
    return Kinematics(x_b - c.l_n * versin + c.z_0 * sin, c.d * sin, v_b - omega_b * q, omega_b * lever_d, q, lever_d)


@inlined
def spring_force(displacement: float, alpha: float, h_e: float, c: Constants) -> float:
    """Spring force F_k,n of an element of height h_e, limited to its ultimate resistance [N] (Eqs 21-28)."""
    limited = min(max(displacement, -c.x_yield), c.x_yield)
    return c.K_soil / (c.d * c.d) * h_e * alpha * limited


@inlined
def drag_force(velocity: float, h_e: float, c: Constants) -> float:
    """Drag F_c,n of an element of height h_e [N] (Eqs 34, 36; c_n of Eq 33 is rho_s W h_e)."""
    return c.R_soil / c.d * h_e * velocity * abs(velocity)


@inlined
def add_element(sums: np.ndarray, j: int, n: int, k: Kinematics, c: Constants) -> None:
    """Add force and moment of element n = 0 ... N - 1 to the partial sums j."""
    h_e = c.d / c.elements
    ratio = (n + 0.5) * (1.0 / c.elements)
    F_n = -(spring_force(k.A - k.slope_x * ratio, ratio * c.d, h_e, c) + drag_force(k.B - k.slope_v * ratio, h_e, c))
    add(sums, j, F_n, -F_n * (k.lever_d * ratio + k.q))


@kernel
def element_sums(k: Kinematics, c: Constants) -> Reaction:
    """Sum force and moment over the N elements: the paper's own method (Eqs 19-21, 26, 28, 36).

    ``k``: lines of displacement, velocity and lever along the depth; ``c``: constants of the design; ``c.elements``
    must be positive.
    """
    sums = partial_sums()
    whole = c.elements - c.elements % WIDTH
    for first in range(0, whole, WIDTH):
        for j in range(WIDTH):
            add_element(sums, j, first + j, k, c)
    for j in range(c.elements - whole):
        add_element(sums, j, whole + j, k, c)
    return Reaction(total(sums, 0), total(sums, WIDTH))


@inlined
def closed_form(k: Kinematics, c: Constants) -> Reaction:
    """Integrate force and moment over the depth exactly: the limit N -> infinity of `element_sums`.

    With r = alpha/d in 0 ... 1 the integrands are r clip(A - s r, -y, y) and v|v|, each times 1 and r. The clipped line
    takes the values +-y up to r_1 and from r_2 on; v changes sign at r_0. All three are clamped to 0 ... 1, so that no
    case needs a branch.

    ``k``: lines of displacement, velocity and lever along the depth.
    """
    s = math.copysign(max(abs(k.slope_x), TINY), k.slope_x)
    p = math.copysign(max(abs(k.slope_v), TINY), k.slope_v)
    y = math.copysign(c.x_yield, s)
    A, B = k.A, k.B
    # One division for the three break points.
    inverse = 1.0 / (s * p)
    inverse_s, inverse_p = inverse * p, inverse * s
    below, above = y - A, y + A
    r_1 = min(max(-below * inverse_s, 0.0), 1.0)
    r_2 = min(max(above * inverse_s, 0.0), 1.0)
    r_0 = min(max(B * inverse_p, 0.0), 1.0)
    s, p = k.slope_x, k.slope_v  # zero again where they are: without displacement there is no force at all

    a_1, a_2 = r_1 * r_1, r_2 * r_2
    b_1, b_2 = a_1 * r_1, a_2 * r_2
    third_s = (1.0 / 3.0) * s
    spring = 0.5 * (below * a_1 + above * a_2 - y) + third_s * (b_1 - b_2)
    spring_r = (1.0 / 3.0) * (below * b_1 + above * b_2 - y) + 0.25 * s * (a_1 * a_1 - a_2 * a_2)

    # Q(r) = integral of (B - p r)^2; v|v| integrates to sign(p) (2 Q(r_0) - Q(1)).
    a_0 = r_0 * r_0
    b_0 = a_0 * r_0
    BB, Bp, pp = B * B, B * p, p * p
    drag = BB * (2.0 * r_0 - 1.0) - Bp * (2.0 * a_0 - 1.0) + (1.0 / 3.0) * pp * (2.0 * b_0 - 1.0)
    drag_r = 0.5 * BB * (2.0 * a_0 - 1.0) - (2.0 / 3.0) * Bp * (2.0 * b_0 - 1.0) + 0.25 * pp * (2.0 * a_0 * a_0 - 1.0)
    R = math.copysign(c.R_soil, p)
    pressed = c.K_soil * spring + R * drag
    pressed_r = c.K_soil * spring_r + R * drag_r
    return Reaction(-pressed, k.lever_d * pressed_r + k.q * pressed)


@inlined
def uniform_reaction(k: Kinematics, c: Constants) -> Reaction:
    """Force and moment of a uniform soil: element sums where the design asks for N, else the closed form."""
    if c.elements > 0:
        return element_sums(k, c)
    return closed_form(k, c)


@inlined
def closed_potential(A: float, slope_x: float, c: Constants) -> Potential:
    """Elastic energy of the soil for N -> infinity, a convex function of the two numbers that fix its displacement.

    The springs are elastic also beyond their limit: a spring holds u^2/2 up to the yield displacement y and y |u| -
    y^2/2 beyond, times its stiffness.

    ``A, slope_x``: displacement at the soil line, and its decrease over the whole depth [m].
    """
    s = math.copysign(max(abs(slope_x), TINY), slope_x)
    y = math.copysign(c.x_yield, s)
    inverse_s = 1.0 / s
    below, above = y - A, y + A
    r_1 = min(max(-below * inverse_s, 0.0), 1.0)
    r_2 = min(max(above * inverse_s, 0.0), 1.0)
    s = slope_x
    a_1, a_2 = r_1 * r_1, r_2 * r_2
    b_1, b_2 = a_1 * r_1, a_2 * r_2
    spring = 0.5 * (below * a_1 + above * a_2 - y) + (1.0 / 3.0) * s * (b_1 - b_2)
    spring_r = (1.0 / 3.0) * (below * b_1 + above * b_2 - y) + 0.25 * s * (a_1 * a_1 - a_2 * a_2)
    # u^2/2 on r_1 ... r_2; before and after it the tangents +-y u - y^2/2.
    middle = 0.25 * A * A * (a_2 - a_1) - (1.0 / 3.0) * A * s * (b_2 - b_1) + 0.125 * s * s * (a_2 * a_2 - a_1 * a_1)
    before = y * (0.5 * A * a_1 - (1.0 / 3.0) * s * b_1) - 0.25 * y * y * a_1
    after = -y * (0.5 * A * (1.0 - a_2) - (1.0 / 3.0) * s * (1.0 - b_2)) - 0.25 * y * y * (1.0 - a_2)
    V = c.K_soil * (before + middle + after)
    return Potential(V, c.K_soil * spring, -c.K_soil * spring_r, V)


@kernel
def summed_potential(A: float, slope_x: float, c: Constants) -> Potential:
    """Elastic energy of N soil elements, convex like its limit N -> infinity (`closed_potential`)."""
    V = V_A = V_X = 0.0
    for n in range(c.elements):
        ratio = (n + 0.5) / c.elements
        displacement = A - slope_x * ratio
        over = max(abs(displacement) - c.x_yield, 0.0)
        pressed = ratio * min(max(displacement, -c.x_yield), c.x_yield)
        V += ratio * 0.5 * (displacement * displacement - over * over)
        V_A += pressed
        V_X -= ratio * pressed
    share = c.K_soil / c.elements
    return Potential(share * V, share * V_A, share * V_X, share * V)


@inlined
def uniform_potential(A: float, slope_x: float, c: Constants) -> Potential:
    """Elastic energy of a uniform soil by the same representation as the forces."""
    if c.elements > 0:
        return summed_potential(A, slope_x, c)
    return closed_potential(A, slope_x, c)


@kernel
def uniform_drag_power(k: Kinematics, c: Constants) -> float:
    """Power that the drag of a uniform soil takes out of the motion [W] (Eqs 34-36)."""
    if c.elements > 0:
        h_e = c.d / c.elements
        total = 0.0
        for n in range(c.elements):
            velocity = k.B - k.slope_v * ((n + 0.5) / c.elements)
            total += drag_force(velocity, h_e, c) * velocity
        return total
    # Integral of |B - p r|^3 over r = 0 ... 1, a line that may change its sign.
    top, base = abs(k.B), abs(k.B - k.slope_v)
    if k.B * (k.B - k.slope_v) >= 0.0:
        return c.R_soil * 0.25 * (top + base) * (top * top + base * base)
    return c.R_soil * 0.25 * (top**4 + base**4) / (top + base)
