"""Changes of the modes of a motion: how far it is from each of them, and the modes that follow.

Each event has a gap, positive as long as the present mode holds. A gap that is negative at the end of a step puts
the event inside it. Every gap is a sum of a few quantities of the state with factors that depend on the mode only, so
that a loop over lanes in different modes needs no branch.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined, kernel
from .design import Constants, Readings
from .dynamics import (
    FREE,
    HELD,
    LAST_OF_GRAVITY,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
    State,
    contact_displacement,
    holding_moment,
    signed_arm,
    spring_compression,
)
from .numerics import sine_versine
from .soil import soil_kinematics

CONTACT = 0
"""Truck and boulder separate, or touch again."""
ROTATION = 1
"""The boulder leaves or finds its base, or (printed reading) turns back."""
COUPLE = 2
"""Printed reading: the net moment passes the limit of the restoring moment."""
CORNER = 3
"""Printed reading: the corner passes under the centre of mass, sin(gamma_N + theta_b) changes its sign."""
ARM = 4
"""Printed reading: the corner passes beside the centre of mass, cos(gamma_N + theta_b) changes its sign."""
YIELD_TOP = 5
"""The soil at the soil line reaches its ultimate resistance, or falls below it."""
YIELD_BASE = 6
"""The soil at the foot of the boulder reaches its ultimate resistance, or falls below it."""
LIMIT = 7
"""The rotation reaches the limit."""

NEVER = 1e300
"""Gap of an event that cannot happen in the present mode."""
UNSOUGHT = 2.0
"""In place of the sign of a displacement beyond the ultimate resistance, where its event is not looked for."""
TOLERANCE = 1e-3
"""Precision with which an event is located, as a fraction of the step. Forces are continuous at a kink, so the error
goes with its square; where they jump, Newton's method follows."""
AT_END = 0.3
"""An event that lies before the end of the step by less than this share of the precision is taken to be at the end."""
CONTACT_ROUNDING = 1e-15
"""Compressions below this share of the distance the truck would cover in a second are rounding, which would make a
truck and a boulder that move together separate and touch again and again."""


class GapFactors(NamedTuple):
    """What the gaps of a mode are made of; all of them are constant while the mode lasts."""

    contact: float
    """Factor of the compression u: 1 where the truck touches, -1 where it has come off."""
    rotation_0: float
    rotation_abs_M: float
    """Factor of the modulus of the net moment M."""
    rotation_theta: float
    rotation_omega: float
    couple_M: float
    """Factor of the net moment M."""
    couple_abs_M: float
    couple_limit: float
    """Factor of the limit of the restoring moment; 0 where the event cannot happen."""
    corner_0: float
    corner_theta: float
    arm: float
    """Factor of the signed arm of the weight; 0 where the event cannot happen."""
    top: float
    """Factor of the displacement at the soil line: 1 or -1 beyond the ultimate resistance, 0 below, or UNSOUGHT."""
    base: float
    """Factor of the displacement at the foot: 1 or -1 beyond the ultimate resistance, 0 below, or UNSOUGHT."""
    limit: float
    """Limit of rotation [rad]."""
    tolerance: float
    """Precision with which events are located, as a fraction of the step."""


class Gaps(NamedTuple):
    """Distance of the state from each event, positive while the mode holds; indexed by the constants above."""

    contact: float
    rotation: float
    couple: float
    corner: float
    arm: float
    top: float
    base: float
    limit: float


@inlined
def gap_factors(modes: Modes, c: Constants, theta_stop: float, locate_yield: bool, tolerance: float) -> GapFactors:
    """Factors of the gaps in the present modes.

    Parameters
    ----------
    modes
        The present modes.
    c
        Constants of the design.
    theta_stop
        Rotation at which the simulation ends [rad].
    locate_yield
        Whether a step is cut where the soil at the top or the base reaches its ultimate resistance.
    tolerance
        Precision with which events are located, as a fraction of the step; as printed it is `TOLERANCE`.
    """
    rotation_0 = rotation_abs_M = rotation_theta = rotation_omega = 0.0
    couple_M = couple_abs_M = couple_limit = arm = 0.0
    corner_0, corner_theta = NEVER, 0.0
    contact = 1.0 if modes.touching else -1.0
    turning = modes.turning
    if turning == SEATED:
        rotation_0, rotation_abs_M = c.C_cos, -1.0
    elif turning == TURNING_FORWARD:
        rotation_theta = 1.0
    elif turning == TURNING_BACK:
        rotation_theta = -1.0
    else:
        tolerance = TOLERANCE
        corner_0, corner_theta = modes.corner * c.theta_corner, -modes.corner
        if turning == FREE:
            rotation_omega = -1.0
        else:
            rotation_omega = 1.0
            arm, couple_limit = modes.arm, -1.0
            if turning == HELD:
                couple_abs_M, couple_limit = -1.0, 1.0
            elif turning == LIMITED_FORWARD:
                couple_M = 1.0
            else:
                couple_M = -1.0
    top = float(modes.yielded_top) if locate_yield else UNSOUGHT
    base = float(modes.yielded_base) if locate_yield else UNSOUGHT
    return GapFactors(
        contact=contact,
        rotation_0=rotation_0,
        rotation_abs_M=rotation_abs_M,
        rotation_theta=rotation_theta,
        rotation_omega=rotation_omega,
        couple_M=couple_M,
        couple_abs_M=couple_abs_M,
        couple_limit=couple_limit,
        corner_0=corner_0,
        corner_theta=corner_theta,
        arm=arm,
        top=top,
        base=base,
        limit=theta_stop,
        tolerance=tolerance,
    )


@inlined
def yield_gap(displacement: float, sign: float, c: Constants) -> float:
    """Gap of the soil's ultimate resistance where it is displaced [m]; `GapFactors` gives the sign."""
    gap = c.x_yield - abs(displacement) if sign == 0.0 else sign * displacement - c.x_yield
    return NEVER if sign == UNSOUGHT else gap


@inlined
def contact_gap(u: float, g: GapFactors, c: Constants) -> float:
    """Gap of the contact at a compression of the vehicle's spring [m]."""
    return CONTACT_ROUNDING * c.v_0 * (1.0 + c.tau_v) + g.contact * u


@inlined
def gaps_of(
    A: float,
    slope_x: float,
    theta_b: float,
    omega_b: float,
    u: float,
    M: float,
    arm: float,
    g: GapFactors,
    c: Constants,
) -> Gaps:
    """Gaps of all events.

    Parameters
    ----------
    A, slope_x
        Displacement of the soil at the soil line and its decrease down to the base [m].
    theta_b, omega_b
        Rotation [rad] and angular velocity [rad/s].
    u
        Compression of the vehicle's spring [m].
    M
        Net moment of soil and truck [N m].
    arm
        Signed arm of the weight [N m], from `signed_arm`.
    g, c
        Factors of the present modes, and constants of the design.
    """
    couple = g.couple_M * M + g.couple_abs_M * abs(M) + g.couple_limit * abs(arm)
    return Gaps(
        contact_gap(u, g, c),
        g.rotation_0 + g.rotation_abs_M * abs(M) + g.rotation_theta * theta_b + g.rotation_omega * omega_b,
        couple if g.couple_limit != 0.0 else NEVER,
        g.corner_0 + g.corner_theta * theta_b,
        g.arm * arm if g.arm != 0.0 else NEVER,
        yield_gap(A, g.top, c),
        yield_gap(A - slope_x, g.base, c),
        g.limit - abs(theta_b),
    )


@inlined
def gaps_at(y: State, M: float, g: GapFactors, c: Constants) -> Gaps:
    """Gaps of all events at a state with net moment M [N m]."""
    sin, versin = sine_versine(y.theta_b)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    return gaps_of(k.A, k.slope_x, y.theta_b, y.omega_b, u, M, signed_arm(sin, versin, c), g, c)


SEATING_ANGLE = 1e-9
"""A boulder that would swing through less than this [rad] about its base is taken to have come to rest."""


@kernel
def mode_at_rest(M: float, corner: float, sin: float, versin: float, c: Constants) -> int:
    """Printed reading: mode of a boulder whose angular velocity has come to zero (Eqs 37-39).

    Parameters
    ----------
    M
        Net moment of soil and truck [N m].
    corner
        Sign of sin(gamma_N + theta_b).
    sin, versin
        sin(theta_b) and 1 - cos(theta_b).
    c
        Constants of the design.

    Notes
    -----
    At omega = 0 the printed moment jumps, and the equations have no solution in the classical sense while the net
    moment is within the limit. Integrated literally, the boulder arrives at an omega just over zero, where Eq 39
    cancels every other moment up to the limit of Eq 37, whichever way it points. So it stays until the net moment is
    over the limit, forwards or back. Where the corner has passed under the centre of mass, Eq 39 drives the boulder on
    instead of holding it: it moves the way the net moment points.
    """
    limit = holding_moment(sin, versin, c)
    if limit < M:
        return LIMITED_FORWARD
    if -limit > M or (corner < 0.0 and M < 0.0):
        return FREE
    return HELD


@kernel
def initial_modes(readings: Readings, c: Constants) -> Modes:
    """Modes at the instant of impact.

    The truck touches and the boulder is seated. Under the printed rule the first moment decides: a blow over the
    centre of mass turns the boulder forward, and Eq 39 holds it; one below turns it back, and Eq 38 lets it go.
    """
    if readings.restoring_gravity:
        turning = SEATED
    else:
        turning = HELD if c.h >= 0.0 else FREE
    return Modes(turning, True, 1.0, 1.0, 0, 0)


@inlined
def yield_mode(displacement: float, c: Constants) -> int:
    """Mode of the soil at a displacement [m]: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""
    if abs(displacement) <= c.x_yield:
        return 0
    return 1 if displacement > 0.0 else -1


@inlined
def changes_counted(event: float, begun: float, modes: Modes) -> float:
    """Return 1.0 if an event changes how a boulder rocks, else 0.0.

    Parameters
    ----------
    event
        The event a step was cut at.
    begun
        Start of the step [s]. That a boulder begins to turn in the first step does not count.
    modes
        Modes before; modes of printed readings do not count.
    """
    return 1.0 if event == ROTATION and begun > 0.0 and modes.turning <= LAST_OF_GRAVITY else 0.0


@inlined
def change_mode(event: int, y: State, M: float, modes: Modes, c: Constants) -> tuple[State, Modes]:
    """Cross an event: the modes that follow, and the state with its crossing made exact.

    Parameters
    ----------
    event
        Which event was reached.
    y
        State there.
    M
        Net moment of soil and truck there [N m]; asked for by the events ROTATION and COUPLE only.
    modes
        Modes before.
    c
        Constants of the design.
    """
    turning, touching = modes.turning, modes.touching
    corner, arm = modes.corner, modes.arm
    top, base = modes.yielded_top, modes.yielded_base
    theta_b, omega_b = y.theta_b, y.omega_b
    sin, versin = sine_versine(theta_b)
    if event == CONTACT:
        touching = not touching
    elif event == ROTATION:
        if turning == SEATED:
            turning = TURNING_FORWARD if M > 0.0 else TURNING_BACK
        elif turning == TURNING_FORWARD or turning == TURNING_BACK:
            theta_b = 0.0
            if 0.5 * c.J_eff * omega_b * omega_b < (c.C_cos - abs(M)) * SEATING_ANGLE:
                turning, omega_b = SEATED, 0.0
            else:
                turning = TURNING_FORWARD if omega_b > 0.0 else TURNING_BACK
        else:
            omega_b = 0.0
            turning = mode_at_rest(M, corner, sin, versin, c)
    elif event == COUPLE:
        if turning == HELD:
            # Pushed back from rest it does not brake, it turns back: Eq 38 lets it go.
            turning = LIMITED_FORWARD if M > 0.0 else LIMITED_BACK if omega_b > 0.0 else FREE
        else:
            turning = HELD
    elif event == CORNER:
        corner = -corner
    elif event == ARM:
        arm = -arm
    elif event == YIELD_TOP or event == YIELD_BASE:
        # Both, since all of the soil yields at once under a boulder that has not turned.
        k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
        top, base = yield_mode(k.A, c), yield_mode(k.A - k.slope_x, c)
    return State(y.x_b, y.v_b, theta_b, omega_b, y.x_v, y.v_v), Modes(turning, touching, corner, arm, top, base)


RETURNS_WITHIN = 1.5
"""The step after a boulder has passed its base is at most so many times as long as it takes to return to it."""


@inlined
def length_after(event: float, h: float, omega_b: float, alpha_b: float) -> float:
    """Length of the step that follows an event [s].

    Parameters
    ----------
    event
        The event.
    h
        Length of the steps [s].
    omega_b, alpha_b
        Angular velocity [rad/s] and acceleration [rad/s^2] in the modes that follow.

    Notes
    -----
    A boulder that has passed its base returns to it after 2 |omega/alpha|. Where the net moment nearly balances the
    weight on one side, the swing to the other side lasts less than a hundredth of a step. As a part of a whole step it
    would be smaller than the precision of the search for its end, and the energy of the boulder would be lost there.
    """
    returns = (event == ROTATION) & (omega_b * alpha_b < 0.0)
    return min(h, -2.0 * RETURNS_WITHIN * omega_b / alpha_b) if returns else h


@inlined
def needs_moment(g: GapFactors) -> bool:
    """Whether the gap of the event ROTATION depends on the net moment."""
    return g.rotation_abs_M != 0.0
