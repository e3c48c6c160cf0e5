"""The equations of motion, Eq 52: seven states and their rates, with the modes given from outside.

The model jumps: the restoring moment at omega = 0 (printed) or theta = 0 (gravity), and the contact. Which
branch holds is a `Modes` value that stays fixed while the equations are integrated and changes at located
events only; `state_modes` gives the branch that the formulas, read literally, take at a single state.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .constants import Constants, constants, impact_lever
from .ground import LayeredSoil
from .inputs import Inputs, Readings
from .restoring import gravity_couple, gravity_hold, printed_forward, printed_limit, printed_sign
from .soil import Motion, Soil, SoilTotals
from .vehicle import crush_force, jerk

Array = NDArray[np.float64]

Rotation = Literal["held", "forward", "backward", "clockwise", "anticlockwise"]
Contact = Literal["touching", "clipped", "coasting"]


@dataclass(frozen=True)
class Modes:
    """Which branch of the model holds.

    Attributes
    ----------
    rotation : str
        Gravity reading: 'held' (upright at rest, the weight balances the other moments), 'clockwise' or
        'anticlockwise' (the side to which the boulder has turned). Printed reading: 'backward'
        (omega < 0, no restoring moment), 'forward' (omega > 0) or 'held' (come to rest: at an omega just over
        zero the restoring moment cancels every other moment up to its maximum, so that nothing moves).
    contact : str
        'touching'; 'coasting' (released reading: the vehicle moves freely until it returns); 'clipped'
        (printed reading: the boulder feels no force while the vehicle still obeys Eq 45).
    sign : float
        sign(sin(gamma_N + theta)) of Eqs 37 and 39, used by the printed 'forward' mode alone.
    """

    rotation: Rotation
    contact: Contact
    sign: float = 1.0


@dataclass(frozen=True)
class Problem:
    """One impact ready to be integrated."""

    inputs: Inputs
    readings: Readings
    constants: Constants
    soil: Soil | LayeredSoil

    @property
    def start(self) -> Array:
        """The seven states of Eq 52 at the first touch: all zero but the speed of the vehicle."""
        return np.array([0.0, 0.0, 0.0, 0.0, 0.0, self.inputs.v_0, 0.0])


@dataclass(frozen=True)
class Loads:
    """Forces [N] and moments [N m] at a state.

    `net` is the bracket of Eq 39: the moment of soil and vehicle together. `lever` [m] is that of the blow,
    `v_contact` [m/s] the velocity of the point struck.
    """

    soil: SoilTotals
    F_v: float
    M_v: float
    M_R: float
    net: float
    lever: float
    v_contact: float


def problem(inputs: Inputs, readings: Readings, elements: int | None = None) -> Problem:
    """Prepare an impact, with N soil elements or in the limit N -> infinity."""
    lumped = constants(inputs, readings, elements)
    soil = Soil(inputs, lumped) if inputs.ground is None else LayeredSoil(inputs, lumped)
    return Problem(inputs, readings, lumped, soil)


def motion_of(y: Array) -> Motion:
    """Motion of the boulder out of the states of Eq 52: x_1, x_3, x_2, x_4."""
    return Motion(x_b=float(y[0]), theta=float(y[2]), v_b=float(y[1]), omega=float(y[3]))


def loads(impact: Problem, y: Array, modes: Modes) -> Loads:
    """Forces and moments at a state, in the given modes."""
    motion = motion_of(y)
    soil = impact.soil.totals(motion)
    lever = impact_lever(impact.constants, motion.theta)
    # Eq 47. While touching the force is positive but for the last bit: the mode ends where it would turn.
    F_v = crush_force(impact.inputs.m_v, float(y[6])) if modes.contact == "touching" else 0.0
    M_v = F_v * lever  # Eq 48
    net = soil.M + M_v
    M_R = restoring_moment(impact, motion, modes, net)
    return Loads(soil, F_v, M_v, M_R, net, lever, motion.v_b + motion.omega * lever)


def restoring_moment(impact: Problem, motion: Motion, modes: Modes, net: float) -> float:
    """Restoring moment M_R [N m] in the given modes."""
    if modes.rotation == "held":
        return -net
    if modes.rotation == "backward":
        return 0.0  # Eq 38
    if modes.rotation == "forward":
        return printed_forward(printed_limit(impact.constants, motion.theta), modes.sign, net)
    side = 1.0 if modes.rotation == "clockwise" else -1.0
    return gravity_couple(impact.inputs, impact.constants, motion.theta, side)


def rate(impact: Problem, y: Array, modes: Modes) -> Array:
    """Rates of the seven states, Eq 52.

    Parameters
    ----------
    impact : Problem
        The impact.
    y : ndarray, shape (7,) or longer
        x_b [m], its rate, theta_b [rad], its rate, x_v [m], its rate, its second derivative.
    modes : Modes
        The branches that hold.

    Returns
    -------
    ndarray, shape (7,)
    """
    return rate_under(impact, y, modes, loads(impact, y, modes))


def rate_under(impact: Problem, y: Array, modes: Modes, load: Loads) -> Array:
    """Rates of the seven states, Eq 52, the loads being known."""
    inputs = impact.inputs
    if modes.contact == "coasting":
        a_v = x_v_3 = 0.0
    else:
        a_v = y[6]
        x_v_3 = jerk(inputs.m_v, inputs.k_v, inputs.c_v, y[6], y[5], load.v_contact)
    v_b_1 = (load.soil.F + load.F_v) / impact.constants.m_eff
    # held: exactly no rotation, not just up to rounding
    omega_1 = 0.0 if modes.rotation == "held" else (load.net + load.M_R) / impact.constants.J_eff
    return np.array([y[1], v_b_1, y[3], omega_1, y[5], a_v, x_v_3])


def contact_displacement(impact: Problem, y: Array) -> float:
    """Displacement [m] of the point struck: the integral of its velocity, x_b + integral of the lever.

    The point lies at R_v sin(gamma_v + theta) right of the centre of mass.
    """
    R_v, gamma_v = impact.constants.R_v, impact.constants.gamma_v
    return float(y[0] + R_v * (sin(gamma_v + y[2]) - sin(gamma_v)))


def boulder_centre_displacement(impact: Problem, x_b: Array, theta: Array) -> Array:
    """Displacement x'_b [m] of the boulder's own centre, what the crash tests measured (Eqs 53 to 55).

    As printed, Eq 55 has a bracket out of place and a wrong sign, and Eq 53 lacks its value at theta = 0.
    The centre lies at polar coordinates R'_b (Eq 54, right as printed) and gamma'_b from the common centre
    of mass; gamma'_b is measured clockwise from upright here, with arctan2 for every quadrant.
    """
    right = impact.inputs.L / 2 - impact.constants.c_x
    up = impact.inputs.H / 2 - impact.constants.c_y
    R_b = np.hypot(right, up)
    gamma_b = np.arctan2(right, up)
    return np.asarray(x_b + R_b * (np.sin(gamma_b + theta) - np.sin(gamma_b)))


def state_modes(impact: Problem, y: Array, contact: Contact | None = None) -> Modes:
    """Branches the formulas take at a single state, read literally (Eqs 37 to 39, 47).

    The contact cannot be told from a state alone under the released reading: there `contact` says it, and
    'touching' is taken without it.
    """
    motion = motion_of(y)
    if impact.readings.separation == "printed":
        contact = "clipped" if y[6] > 0 else "touching"
    contact = contact or "touching"
    sign = printed_sign(impact.constants, motion.theta)
    if impact.readings.restoring == "printed":
        return Modes("forward" if motion.omega > 0 else "backward", contact, sign)
    if motion.theta != 0 or motion.omega != 0:
        clockwise = motion.theta > 0 or (motion.theta == 0 and motion.omega > 0)
        return Modes("clockwise" if clockwise else "anticlockwise", contact, sign)
    net = loads(impact, y, Modes("held", contact)).net
    if abs(net) <= gravity_hold(impact.inputs, impact.constants):
        return Modes("held", contact, sign)
    return Modes("clockwise" if net > 0 else "anticlockwise", contact, sign)
