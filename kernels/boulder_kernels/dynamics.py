"""The state of an impact and its rate (Eqs 10, 11, 52), with the forces of soil, truck and weight.

**Laws of the soil** stand in one table, `LAWS`. A law is one `SoilLaw`. Which one holds follows from the type of the
constants of a design: plain `Constants` stand for a uniform soil beside a box, `SoilConstants` carry the record of
their soil. Inside kernels the function is chosen when they are compiled, so a uniform soil has the code it would have
if there were no other.

To add a law: write its record and functions next to `boulder_kernels.pieces`, and a line in `LAWS`.

**The truck** is a Maxwell element, a spring and a damper in series (Eqs 17, 18, 40-48). Eq 45,
x_v''' + (k_v/c_v) x_v'' + (k_v/m_v) x_v' = (k_v/m_v) x_c' with x_c the contact point on the boulder, is an exact
derivative. Integrated once from the state at impact (x_v = x_c = x_v'' = 0, x_v' = v_0) it reads

    m_v x_v'' = -F_v,   F_v = k_v u,   u = x_v - x_c - (m_v/c_v) (v_0 - x_v')        (Eqs 17, 18, 41, 46)

where u is the compression of the spring and the last term the crush of the damper, which takes up the momentum
the truck has lost. So the acceleration of the truck is not a state of its own, the crush is permanent by
itself, and after a separation contact resumes from zero force exactly when u returns to zero.

**The weight** gives the restoring moment of Eqs 37-39, or the couple that stands in its place.

**Modes** are what is held fixed during a step and changes only where a step ends. The forces are smooth but for a few
switches: the truck touches or has come off; the boulder is seated on its base, or turns one way or the other, and the
couple of its weight jumps with it. Switched inside the right-hand side, a jump makes the integrator first order,
because the negative stage weights of Dormand and Prince push the state over it and back. So the switches are modes:
frozen within a step, the right-hand side is smooth, and the step is cut at the instant at which the mode changes.

One linear form serves every reading. With M the moment of soil and truck, the restoring moment is

    M_R = a M + b (C_cos cos(theta) + w sin(theta))

and only a, b and w change with the mode.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import by_types, inlined, is_none, kernel, type_of
from .design import Constants, Design, Readings, body_with, constants_of
from .numerics import sine_versine
from .pieces import (
    FewPieces,
    LumpedSoil,
    ManyPieces,
    Piece,
    SoilConstants,
    SoilElements,
    SoilProfile,
    SoilSums,
    constants_in_soil,
    fill_elements,
    fill_pieces,
    pieces_count,
    potential_of_elements,
    potential_of_pieces,
    power_of_elements,
    power_of_pieces,
    reaction_of_elements,
    reaction_of_pieces,
    times,
)
from .soil import (
    Kinematics,
    Potential,
    Reaction,
    soil_kinematics,
    uniform_drag_power,
    uniform_potential,
    uniform_reaction,
)


class SoilLaw(NamedTuple):
    """A law of the soil; its functions take the record of the soil, and in a uniform soil its `Constants`."""

    reaction: Callable[..., Reaction]
    """Force and moment, of `Kinematics`."""
    potential: Callable[..., Potential]
    """Elastic energy and its slopes, convex in the displacement at the soil line and its decrease over the depth."""
    drag_power: Callable[..., float]
    """Power that the drag takes out of the motion [W], of `Kinematics`."""
    fill: Callable[[Design, np.ndarray, np.ndarray, Any], LumpedSoil] | None = None
    """Works out the record from layers and outline of a design, and returns what follows from them."""


UNIFORM = SoilLaw(uniform_reaction, uniform_potential, uniform_drag_power)
LAWS: dict[type, SoilLaw] = {
    FewPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces),
    ManyPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces, fill_pieces),
    SoilElements: SoilLaw(reaction_of_elements, potential_of_elements, power_of_elements, fill_elements),
}
"""The law of each record of a soil."""


def soil_of(c: Any) -> Any:
    """Return the record of the soil of `SoilConstants`, their last field, or its Numba type; anything else itself."""
    return c[-1] if type_of(c) is SoilConstants else c


def law_of(c: Any) -> SoilLaw:
    """Return the law of the soil of constants, or of the record of a soil."""
    return LAWS.get(type_of(soil_of(c)), UNIFORM)


@by_types
def soil_reaction(k: Kinematics, c: Any) -> Callable[..., Reaction]:
    """Force and moment of soil and leaning weight at lines ``k`` of displacement, velocity and lever (Eqs 19, 20, 144).

    A boulder whose centre does not lie over the middle of its foot has the moment -D cos(theta) of its weight with it:
    the restoring couple of a box has equal arms either way, and D is half of what differs.
    """
    reaction = law_of(c).reaction
    if type_of(c) is SoilConstants:
        return lambda k, c: leaning(reaction(k, c.soil), k, c.lean)
    return lambda k, c: reaction(k, c)


@inlined
def leaning(reaction: Reaction, k: Kinematics, lean: float) -> Reaction:
    """Add the moment -D cos(theta) of the weight (Eq 144)."""
    return Reaction(reaction.F, reaction.M - times(lean, k.lever_d))


@by_types
def soil_potential(A: float, slope_x: float, c: Any) -> Callable[..., Potential]:
    """Elastic energy of the soil by the same representation as the forces, a convex function of both lengths [m]."""
    potential = law_of(c).potential
    if type_of(c) is SoilConstants:
        return lambda A, slope_x, c: potential(A, slope_x, c.soil)
    return lambda A, slope_x, c: potential(A, slope_x, c)


@by_types
def drag_power(k: Kinematics, c: Any) -> Callable[..., float]:
    """Power that the drag takes out of the motion [W], by the same representation as the forces (Eqs 34-36)."""
    power = law_of(c).drag_power
    return (lambda k, c: power(k, c.soil)) if type_of(c) is SoilConstants else (lambda k, c: power(k, c))


@kernel
def soil_energy(k: Kinematics, c: Constants) -> float:
    """Elastic energy stored in the springs of the soil [J], by the same representation as the forces."""
    V: float = soil_potential(k.A, k.slope_x, c).V
    return V


@by_types
def constants_in(design: Design, readings: Readings, elements: int, profile: Any) -> Callable[..., Any]:
    """Constants of the motion of one design in its soil.

    ``design``: the design, SI; layers replace density, friction angle and subgrade reaction of its soil; ``elements``:
    number N of elements of a uniform soil, or 0 for the closed form; ``profile``: its `SoilProfile`, whose record the
    constants keep; None for the uniform soil of a box.

    They are non-finite or non-positive where the design is impossible, see `boulder_kernels.design.is_computable`.
    """
    if is_none(profile):
        return lambda design, readings, elements, profile: constants_of(design, readings, elements)
    fill: Any = law_of(profile[-1]).fill
    return lambda design, readings, elements, profile: constants_in_soil(
        design,
        readings,
        body_with(design, profile.outline),
        fill(design, profile.layers, profile.outline, profile.soil),
        profile.soil,
    )


def empty_soil(layers: int, points: int, elements: int) -> Any:
    """Return a soil to fill: N elements, or where N is 0 the pieces of so many layers and points of an outline."""
    if elements > 0:
        return SoilElements(*np.empty((len(SoilElements._fields), elements)))
    pieces = np.empty((pieces_count(layers, points), len(Piece._fields)))
    return ManyPieces(np.empty(len(SoilSums._fields)), pieces)


BOX = np.empty((0, 4))
"""The outline of a box: no points."""


def profile_of(layers: np.ndarray, elements: int, outline: np.ndarray = BOX) -> SoilProfile:
    """Return a soil in layers beside an outline, by N elements or, where N is 0, exactly."""
    return SoilProfile(layers, outline, empty_soil(len(layers), len(outline), elements))


SEATED = 0
"""Gravity reading: theta_b = 0 and at rest; the weight balances the other moments."""
TURNING_FORWARD = 1
"""Gravity reading: theta_b > 0."""
TURNING_BACK = 2
"""Gravity reading: theta_b < 0."""
LAST_OF_GRAVITY = TURNING_BACK
"""Modes up to this one are of the gravity reading."""
HELD = 3
"""Printed reading, omega > 0, or come to rest: the restoring moment equals the net moment (Eq 39)."""
LIMITED_FORWARD = 4
"""Printed reading, omega > 0: net moment over the limit, restoring moment at it (Eq 37)."""
LIMITED_BACK = 5
"""Printed reading, omega > 0: net moment below minus the limit."""
FREE = 6
"""Printed reading, omega < 0: no restoring moment (Eq 38)."""


class Modes(NamedTuple):
    """The switches of one step."""

    turning: int
    """One of the modes of rotation above."""
    touching: bool
    """Whether truck and boulder touch."""
    corner: float
    """Printed reading: sign of sin(gamma_N + theta_b) (Eqs 37, 39); 1 otherwise."""
    arm: float
    """Printed reading: sign of -cos(gamma_N + theta_b), whose modulus Eq 37 is limited by; 1 otherwise."""
    yielded_top: int
    """Soil at the soil line: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""
    yielded_base: int
    """Soil at the foot of the boulder: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""


class Switches(NamedTuple):
    """The modes as factors of the right-hand side."""

    net: float
    """1 + a: share of the net moment of soil and truck that accelerates the boulder."""
    couple: float
    """b: sign of the couple."""
    couple_sin: float
    """w: coefficient of sin(theta_b) in the couple [N m]."""
    k_contact: float
    """Spring of the contact, k_v or 0 [N/m]."""
    k_truck: float
    """Spring over mass that decelerates the truck, k_v/m_v or 0 [1/s^2]."""


@inlined
def switches_of(modes: Modes, readings: Readings, c: Constants) -> Switches:
    """Factors of the right-hand side for the modes of a step (Eqs 37-39, 47)."""
    net, couple, couple_sin = 1.0, 0.0, 0.0
    turning = modes.turning
    if turning == SEATED:
        net = 0.0
    elif turning == TURNING_FORWARD:
        couple, couple_sin = -1.0, c.C_sin
    elif turning == TURNING_BACK:
        couple, couple_sin = 1.0, -c.C_sin
    elif turning == HELD:
        net = 1.0 - modes.corner
    elif turning == LIMITED_FORWARD:
        couple, couple_sin = -modes.corner * modes.arm, c.C_sin
    elif turning == LIMITED_BACK:
        couple, couple_sin = modes.corner * modes.arm, c.C_sin
    k_contact = c.k_v if modes.touching else 0.0
    k_truck = c.k_m if modes.touching or not readings.separation_released else 0.0
    return Switches(net, couple, couple_sin, k_contact, k_truck)


@inlined
def contact_lever(sin: float, versin: float, c: Constants) -> float:
    """Lever of the contact force about the centre of mass, R_v cos(gamma_v + theta) [m] (Eqs 5, 6, 48).

    In Cartesian form h cos(theta) + g_x sin(theta), right in every quadrant. Printed, the struck face lies on the
    right of the centre of mass (g_x = -c_x); truly it is the left face (g_x = c_x).
    """
    return c.h - c.h * versin + c.g_x * sin


@inlined
def contact_displacement(x_b: float, sin: float, versin: float, c: Constants) -> float:
    """Displacement x_c of the contact point on the boulder [m]: x_b plus the integral of the lever over theta."""
    return x_b + c.h * sin + c.g_x * versin


@inlined
def spring_compression(x_v: float, v_v: float, x_c: float, c: Constants) -> float:
    """Compression u of the vehicle's spring [m]; below zero the truck has come off (Eq 45, integrated)."""
    return x_v - x_c - c.tau_v * (c.v_0 - v_v)


@inlined
def couple_moment(sin: float, versin: float, switches: Switches, c: Constants) -> float:
    """Moment of the couple of the weight in the present mode, b (C_cos cos + w sin) [N m].

    Corrected reading: m_b g (L/2 cos(theta) - H/2 sin|theta|) towards theta = 0, the weight at the boulder's own
    centre against the corner it turns about; it vanishes at the classical tipping angle, tan(theta) = L/H.
    Printed reading: the limit m_b g R_N |cos(gamma_N + theta)| of Eq 37.
    """
    return switches.couple * (c.C_cos - c.C_cos * versin + switches.couple_sin * sin)


@inlined
def signed_arm(sin: float, versin: float, c: Constants) -> float:
    """Printed reading: m_b g (d_N cos(theta) + l_n sin(theta)), the moment of Eq 37 before its modulus [N m]."""
    return c.C_cos - c.C_cos * versin + c.C_sin * sin


@inlined
def holding_moment(sin: float, versin: float, c: Constants) -> float:
    """Largest moment that the restoring moment can balance [N m] (Eq 37; seated: m_b g L/2).

    Printed, m_b g R_N |cos(gamma_N + theta)| = m_b g |d_N cos(theta) + l_n sin(theta)|. Corrected, it is asked for
    only at theta = 0.
    """
    return abs(signed_arm(sin, versin, c))


class State(NamedTuple):
    """State of the motion; the acceleration of the truck follows from it (see `boulder_kernels.dynamics`)."""

    x_b: float
    """Displacement of the common centre of mass of boulder and soil [m]."""
    v_b: float
    """Velocity of that centre of mass [m/s]."""
    theta_b: float
    """Rotation of the boulder [rad]."""
    omega_b: float
    """Angular velocity of the boulder [rad/s]."""
    x_v: float
    """Displacement of the truck [m]."""
    v_v: float
    """Velocity of the truck [m/s]."""


class Acceleration(NamedTuple):
    """Second derivatives of the three displacements, and the net moment they came from."""

    a_b: float
    """Acceleration of the centre of mass [m/s^2] (Eq 10)."""
    alpha_b: float
    """Angular acceleration [rad/s^2] (Eq 11)."""
    a_v: float
    """Acceleration of the truck [m/s^2] (Eq 17)."""
    M: float
    """Moment of soil and truck without the restoring moment [N m]."""


@inlined
def acceleration(y: State, s: Switches, c: Constants) -> Acceleration:
    """Right-hand side of Eq 52 in the present modes.

    ``s``: factors of the present modes.
    """
    sin, versin = sine_versine(y.theta_b)
    soil = soil_reaction(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    F_v = s.k_contact * u  # Eqs 18, 41, 46
    M = soil.M + F_v * contact_lever(sin, versin, c)
    return Acceleration(
        (soil.F + F_v) * c.inverse_m_eff,
        (s.net * M + couple_moment(sin, versin, s, c)) * c.inverse_J_eff,
        -s.k_truck * u,
        M,
    )


@by_types
def lift_of(sin: float, versin: float, c: Any) -> Callable[..., float]:
    """Return the energy of the weight, lifted by a rotation with this sine and versine [J] (Eqs 37-39, 144)."""
    if type_of(c) is SoilConstants:
        return lambda sin, versin, c: c.C_cos * abs(sin) + c.C_sin * versin + c.lean * c.d * sin
    return lambda sin, versin, c: c.C_cos * abs(sin) + c.C_sin * versin


@by_types
def least_couple(c: Any) -> Callable[..., float]:
    """Return the lesser of the moments of the weight about the ends of the foot [N m]; they differ by 2 D (Eq 144)."""
    return (lambda c: c.C_cos - abs(c.lean) * c.d) if type_of(c) is SoilConstants else (lambda c: c.C_cos)
