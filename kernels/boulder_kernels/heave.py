"""The boulder free to rise and held by friction: constants, forces and energies of the second opinion (Eqs 131-137).

The paper's motion is planar and smooth: the boulder neither rises nor rubs. Here its common centre of mass may rise by
y_b, its foot rests on a base that pushes but does not pull, and everything that slips along the boulder rubs. The
boulder moves both ways, the lumped soil sideways only, and so the weight and the base stand in for the couple of
Eqs 37-39. Derivation, symbols and the choice of every constant: `docs/second_opinion.md`.

A point of the boulder at (a, b) from the common centre of mass, a to the right and b upwards, is at

    X = a cos(theta) + b sin(theta),   Y = y_b - a sin(theta) + b cos(theta)

Soil, base and sides are sums over `PIECES` pieces each, by `PARTS` partial sums, so that the bits are those of any
processor. Every force is either the slope of one potential or takes energy out of the motion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .design import Constants, Design, G, boulder_mass, passive_pressure_coefficient, soil_mass
from .dynamics import contact_displacement, contact_lever, spring_compression
from .numerics import WIDTH, field, put, sine_versine
from .soil import Kinematics, soil_kinematics

PIECES = WIDTH
"""Elements of the soil over the depth, strips of the foot, and points of the sides."""
PARTS = 8
"""Partial sums: as many as numbers in the widest registers. Piece j belongs to that of j modulo PARTS."""
EACH = PIECES // PARTS
SIDE_ROWS, SIDE_COLUMNS = 8, 4
"""Points of the sides over the depth and over the length."""
SETS, FOOT, SIDE_A, SIDE_B, SIDE_DEPTH, RATIO, SUMS = (PIECES * n for n in range(7))
"""Offsets in the workspace: sets of the strips and where they lie along the foot; points of the sides; middles of the
soil elements as shares of the depth; partial sums of five numbers."""
ROOM = SUMS + 5 * PARTS
"""Numbers in the workspace."""
FULL_DRAG = 0.5
"""A soil element drags in full where it is covered by this share of its height; the element at the soil line is."""


class Base(NamedTuple):
    """The ground under the foot, and how friction sets in."""

    stiffness: float = 100e6
    """Pressure per settlement k_b [N/m^3]."""
    wave_speed: float = 150.0
    """Speed c_P of a compression wave, whose impedance rho_s c_P damps the foot [m/s]."""
    slip_speed: float = 0.02
    """Speed of slip v_s at which friction has 0.71 of its full value [m/s]."""


class HeaveOptions(NamedTuple):
    """What is added to the planar motion."""

    heave: bool
    """Whether the boulder may rise; if not, the couple of its weight holds it as in the planar motion."""
    friction: bool
    """Whether faces, foot and sides rub."""


class HeaveConstants(NamedTuple):
    """What the motion of one design depends on."""

    c: Constants
    """Constants of the planar motion, with corrected readings and the soil in closed form."""
    heave: float
    """1 where the boulder may rise, else 0."""
    m_b: float
    """Mass of the boulder [kg]."""
    a_b: float
    """Centre of the boulder right of the common centre of mass [m]."""
    b_b: float
    """Centre of the boulder over the common centre of mass [m]."""
    J_b: float
    """Moment of inertia of the boulder about the common centre of mass [kg m^2]."""
    M_soil: float
    """Sum of m_n [kg]."""
    M_first: float
    """Sum of m_n d_n [kg m]."""
    M_second: float
    """Sum of m_n d_n^2 [kg m^2]."""
    L: float
    """Length of the boulder [m]."""
    k_strip: float
    """Stiffness of the base under one strip [N/m]."""
    c_strip: float
    """Its dashpot [N s/m]."""
    q_strip: float
    """Its bearing capacity [N]."""
    s_0: float
    """Settlement under the weight of the boulder [m]."""
    friction: float
    """Coefficient of friction tan(delta); 0 without friction."""
    side: float
    """Friction of both sides at one of their points per depth of it [N/m]."""
    v_s: float
    """Speed of slip at which friction has 0.71 of its full value [m/s]."""


class Forces(NamedTuple):
    """Generalised forces, and the compression of the vehicle's spring."""

    Q_x: float
    """Force along X [N]."""
    Q_y: float
    """Force upwards [N]."""
    Q_theta: float
    """Moment about the common centre of mass [N m]."""
    u: float
    """Compression of the vehicle's spring [m]; below zero the truck has come off."""


@kernel
def bearing_capacity_factor(phi: float) -> float:
    """Bearing capacity factor N_q of a friction angle [rad], by Prandtl and Reissner (Eq 133)."""
    return math.exp(math.pi * math.tan(phi)) * passive_pressure_coefficient(phi)


@kernel
def heave_constants(design: Design, c: Constants, form: HeaveOptions, base: Base) -> HeaveConstants:
    """Constants of the motion with heave and friction (Eqs 131-134).

    Parameters
    ----------
    design
        The design, SI; its ``K_epsilon`` carries the law of the resistance.
    c
        Its `boulder_kernels.design.constants_of`, with corrected readings and the soil in closed form.
    form
        What is added to the planar motion.
    base
        The ground under the foot.
    """
    m_b = boulder_mass(design)
    soil = soil_mass(design, 0)
    a_b, b_b = 0.5 * design.L - c.c_x, 0.5 * design.H - c.c_y
    J_box = m_b / 12.0 * (design.H * design.H + design.L * design.L)
    strip = design.W * design.L / PIECES
    capacity = bearing_capacity_factor(design.phi)
    friction = math.tan(2.0 / 3.0 * design.phi) if form.friction else 0.0
    at_rest = 1.0 - math.sin(design.phi)
    area = design.L * design.d / (SIDE_ROWS * SIDE_COLUMNS)
    return HeaveConstants(
        c,
        1.0 if form.heave else 0.0,
        m_b,
        a_b,
        b_b,
        J_box + m_b * (a_b * a_b + b_b * b_b),
        soil.mass,
        c.c_y * soil.mass - soil.first,
        c.c_y * c.c_y * soil.mass - 2.0 * c.c_y * soil.first + soil.second,
        design.L,
        base.stiffness * strip,
        design.rho_s * base.wave_speed * strip,
        design.rho_s * G * design.d * capacity * strip,
        m_b * G / (base.stiffness * design.L * design.W),
        friction,
        2.0 * friction * at_rest * design.rho_s * G * area,
        base.slip_speed,
    )


@kernel
def prepare(work: np.ndarray, f: HeaveConstants) -> None:
    """Fill a workspace, shape (ROOM,), for a design at rest."""
    c = f.c
    for j in range(PIECES):
        row, column = j // SIDE_COLUMNS, j % SIDE_COLUMNS
        depth = (row + 0.5) * (c.d / SIDE_ROWS)
        put(work, SETS, j, 0.0)
        put(work, FOOT, j, (j + 0.5) * (f.L / PIECES) - c.c_x)
        put(work, SIDE_A, j, (column + 0.5) * (f.L / SIDE_COLUMNS) - c.c_x)
        put(work, SIDE_B, j, c.z_0 - depth)
        put(work, SIDE_DEPTH, j, depth)
        put(work, RATIO, j, (j + 0.5) * (1.0 / PIECES))


@inlined
def summed(work: np.ndarray, n: int) -> float:
    """Add up the partial sums of the number n, by halves."""
    first = SUMS + n * PARTS
    left = (field(work, first, 0) + field(work, first, 4)) + (field(work, first, 2) + field(work, first, 6))
    right = (field(work, first, 1) + field(work, first, 5)) + (field(work, first, 3) + field(work, first, 7))
    return left + right


@inlined
def add_to(work: np.ndarray, j: int, along_x: float, turning: float, lifting: float) -> None:
    """Add to the partial sums j of the first three numbers: force along X, moment, force upwards."""
    put(work, SUMS, j, field(work, SUMS, j) + along_x)
    put(work, SUMS + PARTS, j, field(work, SUMS + PARTS, j) + turning)
    put(work, SUMS + 2 * PARTS, j, field(work, SUMS + 2 * PARTS, j) + lifting)


@inlined
def slipping(v: float, f: HeaveConstants) -> float:
    """Share of the full friction that opposes a slip of speed v, with its sign: v / sqrt(v^2 + v_s^2) (Eq 134)."""
    return v / math.sqrt(v * v + f.v_s * f.v_s)


class Element(NamedTuple):
    """One soil element (Eq 132)."""

    spring: float
    """Force of its spring on the boulder [N]."""
    drag: float
    """Its drag [N]."""
    lever: float
    """Their lever below the common centre of mass [m]."""
    lift: float
    """Vertical force: what its energy loses per rise of the face [N]."""
    lift_lever: float
    """Lever of that force [m]."""
    energy: float
    """Energy in its spring [J]."""


@inlined
def soil_element(
    work: np.ndarray, j: int, y_b: float, sin: float, versin: float, k: Kinematics, f: HeaveConstants
) -> Element:
    """Forces and energy of soil element j; its depth follows the rise of the face that it presses on (Eq 132)."""
    c = f.c
    ratio = field(work, RATIO, j)
    u = k.A - k.slope_x * ratio
    v = k.B - k.slope_v * ratio
    alpha = c.d * ratio
    d_n = alpha - c.z_0
    edge = c.l_n if u > 0.0 else c.l_n - f.L
    depth = max(alpha - f.heave * (y_b - edge * sin + d_n * versin), 0.0)
    stiffness = c.K_soil * (1.0 / PIECES) / c.d
    limited = min(max(u, -c.x_yield), c.x_yield)
    stored = stiffness * (0.5 * limited * limited + c.x_yield * (abs(u) - abs(limited)))
    covered = min(depth * (PIECES / (FULL_DRAG * c.d)), 1.0)
    drag = -c.R_soil * (1.0 / PIECES) * covered * v * abs(v)
    lift = f.heave * stored if depth > 0.0 else 0.0
    lift_lever = d_n * sin - edge * (1.0 - versin)
    return Element(-stiffness * depth * limited, drag, k.lever_d * ratio + k.q, lift, lift_lever, stored * depth)


class Strip(NamedTuple):
    """One strip of the foot (Eq 133)."""

    elastic: float
    """Force of the base's spring [N]."""
    total: float
    """With its dashpot: what the base pushes up with [N]."""
    X: float
    """Position of the strip right of the common centre of mass [m]."""
    Y: float
    """Position of the strip over the common centre of mass [m]."""


@inlined
def strip_depth(work: np.ndarray, j: int, y_b: float, sin: float, versin: float, f: HeaveConstants) -> float:
    """Depth of strip j of the foot below the unloaded base, over its set [m]."""
    return f.s_0 - y_b + field(work, FOOT, j) * sin - f.c.c_y * versin - field(work, SETS, j)


@inlined
def foot_strip(
    work: np.ndarray, j: int, y_b: float, w_b: float, omega_b: float, sin: float, versin: float, f: HeaveConstants
) -> Strip:
    """Forces under strip j of the foot.

    The dashpot grows with the pressure up to that of the boulder at rest, so that a strip that touches down meets no
    jump, and base and dashpot together neither pull nor push more than the bearing capacity.
    """
    a, cos = field(work, FOOT, j), 1.0 - versin
    X, Y = a * cos - f.c.c_y * sin, -a * sin - f.c.c_y * cos
    elastic = min(max(f.k_strip * strip_depth(work, j, y_b, sin, versin, f), 0.0), f.q_strip)
    on = min(elastic * (1.0 / (f.k_strip * f.s_0)), 1.0)
    total = min(max(elastic - on * f.c_strip * (w_b - omega_b * X), 0.0), f.q_strip)
    return Strip(elastic, total, X, Y)


@kernel
def forces(
    x_b: float,
    v_b: float,
    theta_b: float,
    omega_b: float,
    y_b: float,
    w_b: float,
    x_v: float,
    v_v: float,
    touching: bool,
    work: np.ndarray,
    f: HeaveConstants,
) -> Forces:
    """Generalised forces at a state (Eqs 132-135).

    Parameters
    ----------
    x_b, v_b, theta_b, omega_b
        As of `boulder_kernels.dynamics.State`.
    y_b, w_b
        Rise of the common centre of mass [m] and its velocity [m/s].
    x_v, v_v
        The truck.
    touching
        Whether truck and boulder touch.
    work
        The workspace of the design.
    f
        Constants of the design.
    """
    c = f.c
    sin, versin = sine_versine(theta_b)
    cos = 1.0 - versin
    k = soil_kinematics(x_b, v_b, omega_b, sin, versin, c)
    for j in range(PARTS):
        along_x = turning = lifting = far = near = 0.0
        for part in range(EACH):
            e = soil_element(work, j + part * PARTS, y_b, sin, versin, k, f)
            F = e.spring + e.drag
            along_x += F
            turning += e.lift * e.lift_lever - F * e.lever
            lifting += e.lift
            far += max(-F, 0.0)
            near += max(F, 0.0)
        put(work, SUMS, j, along_x)
        put(work, SUMS + PARTS, j, turning)
        put(work, SUMS + 2 * PARTS, j, lifting)
        put(work, SUMS + 3 * PARTS, j, far)
        put(work, SUMS + 4 * PARTS, j, near)
    far, near = summed(work, 3), summed(work, 4)
    # The faces slip along themselves, each with one speed all over.
    along = v_b * sin + w_b * cos
    F_far = -f.friction * far * slipping(along - omega_b * c.l_n, f)
    F_near = -f.friction * near * slipping(along + omega_b * (f.L - c.l_n), f)
    Q_x = (F_far + F_near) * sin
    Q_y = (F_far + F_near) * cos
    Q_theta = F_near * (f.L - c.l_n) - F_far * c.l_n

    for j in range(PARTS):
        along_x = turning = lifting = 0.0
        for part in range(EACH):
            piece = j + part * PARTS
            a, b = field(work, SIDE_A, piece), field(work, SIDE_B, piece)
            X, Y = a * cos + b * sin, b * cos - a * sin
            v_x, v_y = v_b + omega_b * Y, w_b - omega_b * X
            pressed = f.side * max(field(work, SIDE_DEPTH, piece) - f.heave * y_b, 0.0)
            share = -pressed / math.sqrt(v_x * v_x + v_y * v_y + f.v_s * f.v_s)
            along_x += share * v_x
            turning += share * (v_x * Y - v_y * X)
            lifting += share * v_y
        add_to(work, j, along_x, turning, lifting)

    weight = f.m_b * G
    if f.heave > 0.0:
        for j in range(PARTS):
            along_x = turning = lifting = 0.0
            for part in range(EACH):
                s = foot_strip(work, j + part * PARTS, y_b, w_b, omega_b, sin, versin, f)
                rub = -f.friction * s.total * slipping(v_b + omega_b * s.Y, f)
                along_x += rub
                turning += rub * s.Y - s.total * s.X
                lifting += s.total
            add_to(work, j, along_x, turning, lifting)
        Q_theta += weight * (f.a_b * cos + f.b_b * sin)
        Q_y -= weight
    else:
        # The whole weight, on the corner that the boulder turns about (Eq 135).
        a = f.a_b + 0.5 * f.L * min(max(sin / seated_sine(f), -1.0), 1.0)
        X, Y = a * cos - c.c_y * sin, -a * sin - c.c_y * cos
        rub = -f.friction * weight * slipping(v_b + omega_b * Y, f)
        Q_x += rub
        Q_theta += rub * Y + weight * (f.a_b * cos + f.b_b * sin - X)

    Q_x += summed(work, 0)
    Q_theta += summed(work, 1)
    Q_y += summed(work, 2)
    u = spring_compression(x_v, v_v, contact_displacement(x_b, sin, versin, c), c)
    F_v = c.k_v * u if touching else 0.0
    return Forces(Q_x + F_v, Q_y, Q_theta + F_v * contact_lever(sin, versin, c), u)


@inlined
def seated_sine(f: HeaveConstants) -> float:
    """Sine of the rotation at which the weight is on the end of the foot, when the boulder may not rise (Eq 135)."""
    return 6.0 * f.s_0 / f.L


class Inertia(NamedTuple):
    """What resists a rotation (Eq 131)."""

    A: float
    """Moment of inertia [kg m^2]."""
    S: float
    """Half its derivative by the rotation [kg m^2]."""
    X: float
    """Centre of the boulder right of the common centre of mass [m]."""
    Y: float
    """Centre of the boulder over the common centre of mass [m]."""


@inlined
def inertia_at(sin: float, cos: float, f: HeaveConstants) -> Inertia:
    """Inertia at a rotation: the lumped soil moves sideways only where the boulder may rise (Eq 131)."""
    l_n = f.c.l_n
    X, Y = f.a_b * cos + f.b_b * sin, f.b_b * cos - f.a_b * sin
    turned = l_n * l_n * sin * sin * f.M_soil + 2.0 * l_n * sin * cos * f.M_first + cos * cos * f.M_second
    slope = l_n * l_n * sin * cos * f.M_soil + l_n * (cos * cos - sin * sin) * f.M_first - sin * cos * f.M_second
    A = f.J_b + turned if f.heave > 0.0 else f.c.J_eff
    return Inertia(A, f.heave * slope, X, Y)


@inlined
def accelerations(theta_b: float, omega_b: float, Q: Forces, touching: bool, f: HeaveConstants) -> tuple[float, ...]:
    """Accelerations of x_b, theta_b, y_b and x_v (Eq 131)."""
    sin, versin = sine_versine(theta_b)
    i = inertia_at(sin, 1.0 - versin, f)
    turning = Q.Q_theta - i.S * omega_b * omega_b
    rising = f.heave * (Q.Q_y / f.m_b + i.Y * omega_b * omega_b)
    coupled = f.heave * i.X
    alpha_b = (turning + f.m_b * coupled * rising) / (i.A - f.m_b * coupled * coupled)
    a_v = -f.c.k_m * Q.u if touching else 0.0
    return Q.Q_x * f.c.inverse_m_eff, alpha_b, rising + coupled * alpha_b, a_v
