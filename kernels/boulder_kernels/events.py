"""The instants at which a mode changes: what tells them, where in a step they lie, what they change.

Each event has a gap, positive as long as the present mode holds. A gap that is negative at the end of a step puts
the event inside it; there the step is cut. Every gap is a sum of a few quantities of the state with factors that
depend on the mode only, so that a loop over lanes in different modes needs no branch.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined, kernel
from .dense_output import DenseOutput, Track, displacement_at, slope_at, state_at
from .design import Constants
from .dynamics import State, acceleration
from .modes import (
    FREE,
    HELD,
    LIMITED_BACK,
    LIMITED_FORWARD,
    RESTING,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
    Switches,
)
from .readings import Readings
from .restoring import holding_moment, signed_arm
from .roots import ITERATIONS, Bracket, narrowed, next_guess
from .soil import soil_kinematics
from .trigonometry import sine_versine
from .vehicle import contact_displacement, spring_compression

CONTACT = 0
"""Truck and boulder part, or touch again."""
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
"""The same at the base of the boulder."""
LIMIT = 7
"""The rotation reaches the limit."""
EVENTS = 8

NEVER = 1e300
"""Gap of an event that cannot happen in the present mode."""
SEATING_ANGLE = 1e-9
"""A boulder that would swing through less than this [rad] about its base is taken to have come to rest."""
JUMP_TOLERANCE = 1e-11
"""Precision of a located jump of the forces, or of the limit, as a fraction of the step."""
NEWTON_TOLERANCE = 1e-6
"""Last correction of a root by Newton's method, as a fraction of the step: its square is what is left."""
KINK_TOLERANCE = 1e-3
"""The same for a kink: forces are continuous there, so the error goes with its square."""


CONTACT_ROUNDING = 1e-15
"""Compressions below this share of the distance the truck would cover in a second are rounding: truck and boulder that
move on together would part and touch without end by it."""


class GapFactors(NamedTuple):
    """What the gaps of a mode are made of; all of them are constant while the mode lasts."""

    contact_0: float
    contact: float
    """Of the compression u."""
    rotation_0: float
    rotation_M: float
    """Of M."""
    rotation_abs_M: float
    rotation_theta: float
    rotation_omega: float
    couple_0: float
    couple_M: float
    couple_abs_M: float
    couple_limit: float
    """Of the limit of the restoring moment."""
    corner_0: float
    corner_theta: float
    arm_0: float
    arm: float
    """Of the signed arm of the weight."""
    top_0: float
    top_abs: float
    """Of the modulus of the displacement at the soil line."""
    top: float
    base_0: float
    base_abs: float
    base: float
    limit: float
    """Limit of rotation [rad]."""


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


@kernel
def gap_factors(modes: Modes, c: Constants, theta_stop: float, locate_yield: bool) -> GapFactors:
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
    """
    rotation_0 = rotation_M = rotation_abs_M = rotation_theta = rotation_omega = 0.0
    couple_0, couple_M, couple_abs_M, couple_limit = NEVER, 0.0, 0.0, 0.0
    corner_0, corner_theta = NEVER, 0.0
    arm_0, arm = NEVER, 0.0
    turning = modes.turning
    if turning == SEATED:
        rotation_0, rotation_abs_M = c.C_cos, -1.0
    elif turning == TURNING_FORWARD:
        rotation_theta = 1.0
    elif turning == TURNING_BACK:
        rotation_theta = -1.0
    else:
        corner_0, corner_theta = modes.corner * c.theta_corner, -modes.corner
        if turning == FREE:
            rotation_omega = -1.0
        else:
            if turning == RESTING:
                rotation_M = 1.0
            else:
                rotation_omega = 1.0
            arm_0, arm = 0.0, modes.arm
            couple_0, couple_limit = 0.0, -1.0
            if turning == HELD or turning == RESTING:
                couple_abs_M, couple_limit = -1.0, 1.0
            elif turning == LIMITED_FORWARD:
                couple_M = 1.0
            else:
                couple_M = -1.0
    top_0, top_abs, top = NEVER, 0.0, 0.0
    base_0, base_abs, base = NEVER, 0.0, 0.0
    if locate_yield:
        top = float(modes.yielded_top)
        top_0, top_abs = (c.x_yield, -1.0) if modes.yielded_top == 0 else (-c.x_yield, 0.0)
        base = float(modes.yielded_base)
        base_0, base_abs = (c.x_yield, -1.0) if modes.yielded_base == 0 else (-c.x_yield, 0.0)
    return GapFactors(
        CONTACT_ROUNDING * c.v_0 * (1.0 + c.tau_v),
        1.0 if modes.touching else -1.0,
        rotation_0,
        rotation_M,
        rotation_abs_M,
        rotation_theta,
        rotation_omega,
        couple_0,
        couple_M,
        couple_abs_M,
        couple_limit,
        corner_0,
        corner_theta,
        arm_0,
        arm,
        top_0,
        top_abs,
        top,
        base_0,
        base_abs,
        base,
        theta_stop,
    )


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
        Signed arm of the weight, as of `signed_arm` [N m].
    g
        Factors of the present modes.
    """
    base = A - slope_x
    return Gaps(
        g.contact_0 + g.contact * u,
        g.rotation_0
        + g.rotation_M * M
        + g.rotation_abs_M * abs(M)
        + g.rotation_theta * theta_b
        + g.rotation_omega * omega_b,
        g.couple_0 + g.couple_M * M + g.couple_abs_M * abs(M) + g.couple_limit * abs(arm),
        g.corner_0 + g.corner_theta * theta_b,
        g.arm_0 + g.arm * arm,
        g.top_0 + g.top_abs * abs(A) + g.top * A,
        g.base_0 + g.base_abs * abs(base) + g.base * base,
        g.limit - abs(theta_b),
    )


@inlined
def gaps_at(y: State, M: float, g: GapFactors, c: Constants) -> Gaps:
    """Gaps of all events at a state with net moment M [N m]."""
    sin, versin = sine_versine(y.theta_b)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    return gaps_of(k.A, k.slope_x, y.theta_b, y.omega_b, u, M, signed_arm(sin, versin, c), g)


@inlined
def needs_moment(g: GapFactors) -> bool:
    """Whether the gap of the event ROTATION depends on the net moment."""
    return g.rotation_M != 0.0 or g.rotation_abs_M != 0.0


@inlined
def gap_within(
    event: int,
    tau: float,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
) -> float:
    """Gap of one event at the fraction tau of a step."""
    if event == LIMIT:
        return g.limit - abs(displacement_at(dense.rotation, tau))
    y = state_at(dense, tau)
    if event == CONTACT:
        sin, versin = sine_versine(y.theta_b)
        u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
        return g.contact_0 + g.contact * u
    M = 0.0
    if event == COUPLE or (event == ROTATION and needs_moment(g)):
        M = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c).M
    return gaps_at(y, M, g, c)[event]


@kernel
def locate(
    event: int,
    gap_start: float,
    gap_end: float,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
) -> float:
    """Fraction of a step at which a gap that is negative at its end passes zero.

    Parameters
    ----------
    event
        Which gap.
    gap_start, gap_end
        Its values at the start of the step and at the end, where it is negative.
    dense, g, switches, c
        The step.

    Returns
    -------
    float
        tau in (0, 1]. A gap that starts at zero and opens only by rounding counts as crossed at once: the step still
        moves on, and the mode that follows settles it.
    """
    low, gap_low = 0.0, gap_start
    if gap_low <= 0.0:
        for start in (1e-3, 1e-6):
            low = start
            gap_low = gap_within(event, low, dense, g, switches, c)
            if gap_low > 0.0:
                break
        if gap_low <= 0.0:
            return low
    exact = event == LIMIT or event == CORNER or (event == ROTATION and not needs_moment(g))
    tolerance = JUMP_TOLERANCE if exact else KINK_TOLERANCE
    bracket = Bracket(low, gap_low, 1.0, gap_end, 0)
    tau = 1.0
    for _ in range(ITERATIONS):
        before = tau
        tau = next_guess(bracket)
        if abs(tau - before) <= tolerance:
            break
        bracket = narrowed(bracket, tau, gap_within(event, tau, dense, g, switches, c))
    return tau


@kernel
def locate_limit(gap_start: float, gap_end: float, rotation: Track, limit: float, tau_end: float) -> float:
    """Fraction of a step at which the rotation reaches its limit: `locate` for LIMIT, by Newton's method in a bracket.

    Parameters
    ----------
    gap_start, gap_end
        Gaps at the start of the step, positive, and at tau_end, not positive [rad].
    rotation
        The rotation within the step.
    limit
        Limit of rotation [rad].
    tau_end
        Fraction of the step before which it is reached.
    """
    low, high = 0.0, tau_end
    tau = tau_end * gap_start / (gap_start - gap_end)
    for _ in range(ITERATIONS):
        theta = displacement_at(rotation, tau)
        gap = limit - abs(theta)
        if gap > 0.0:
            low = tau
        else:
            high = tau
        before = tau
        tau = before + gap / (slope_at(rotation, before) if theta > 0.0 else -slope_at(rotation, before))
        if not low <= tau <= high:
            tau = 0.5 * (low + high)
        if abs(tau - before) <= NEWTON_TOLERANCE:
            break
    return tau


@inlined
def first_event(
    start: Gaps,
    end: Gaps,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
    yielding: bool,
) -> tuple[int, float]:
    """Earliest event of a step, and the fraction of the step at which it happens.

    Parameters
    ----------
    start, end
        Gaps at the start and at the end of the step.
    dense, g, switches, c
        The step.
    yielding
        Whether to look for YIELD_TOP and YIELD_BASE, or for all others.

    Returns
    -------
    event, tau
        The event, or -1 and 1.0 where there is none.
    """
    first, earliest = -1, 1.0
    for event in range(EVENTS):
        if end[event] < 0.0 and (event in (YIELD_TOP, YIELD_BASE)) == yielding:
            if event == LIMIT and start[event] > 0.0:
                tau = locate_limit(start[event], end[event], dense.rotation, g.limit, 1.0)
            else:
                tau = locate(event, start[event], end[event], dense, g, switches, c)
            if first < 0 or tau < earliest:
                first, earliest = event, tau
    return first, earliest


@kernel
def mode_at_rest(M: float, corner: float, sin: float, versin: float, c: Constants) -> int:
    """Printed reading: mode of a boulder whose angular velocity is zero and about to change (Eqs 37-39)."""
    limit = holding_moment(sin, versin, c)
    if M < 0.0:
        return FREE
    if limit < M:
        return LIMITED_FORWARD
    return RESTING if corner > 0.0 else HELD


@kernel
def initial_modes(readings: Readings, c: Constants) -> Modes:
    """Modes at the instant of impact.

    The truck touches and the boulder is seated. Under the printed rule the first moment decides: the blow turns
    the boulder forward where it is over the centre of mass, else back.
    """
    if readings.restoring_gravity:
        turning = SEATED
    else:
        turning = RESTING if c.h >= 0.0 else FREE
    return Modes(turning, True, 1.0, 1.0, 0, 0)


@kernel
def yield_mode(displacement: float, c: Constants) -> int:
    """Mode of the soil at a displacement [m]: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""
    if abs(displacement) <= c.x_yield:
        return 0
    return 1 if displacement > 0.0 else -1


@kernel
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
            turning = FREE if turning == RESTING else mode_at_rest(M, corner, sin, versin, c)
    elif event == COUPLE:
        if turning == HELD or turning == RESTING:
            turning = LIMITED_FORWARD if M > 0.0 else LIMITED_BACK
        else:
            turning = HELD
    elif event == CORNER:
        corner = -corner
        if turning == RESTING:
            turning = HELD
    elif event == ARM:
        arm = -arm
    elif event == YIELD_TOP or event == YIELD_BASE:
        # Both, since all of the soil yields at once under a boulder that has not turned.
        k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
        top, base = yield_mode(k.A, c), yield_mode(k.A - k.slope_x, c)
    return State(y.x_b, y.v_b, theta_b, omega_b, y.x_v, y.v_v), Modes(turning, touching, corner, arm, top, base)
