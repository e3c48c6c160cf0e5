"""The instants at which a mode changes: what tells them, where in a step they lie, what they change.

Each event has a gap, positive as long as the present mode holds. A gap that is negative at the end of a step puts
the event inside it; there the step is cut.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import kernel
from .design import Constants
from .dormand_prince import DenseOutput, state_at
from .dynamics import State, acceleration
from .modes import (
    FREE,
    HELD,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
    Switches,
)
from .readings import Readings
from .restoring import holding_moment, signed_arm
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
YIELD = 5
"""The soil at the soil line reaches its ultimate resistance, or falls below it."""
LIMIT = 6
"""The rotation reaches the limit."""
EVENTS = 7

NEVER = 1e300
"""Gap of an event that cannot happen in the present mode."""
SEATING_ANGLE = 1e-9
"""A boulder that would swing through less than this [rad] about its base is taken to have come to rest."""
ROOT_TOLERANCE = 1e-13
"""Width of the bracket of a located event, as a fraction of the step."""
ROOT_ITERATIONS = 60


class Gaps(NamedTuple):
    """Distance of the state from each event, positive while the mode holds; indexed by the constants above."""

    contact: float
    rotation: float
    couple: float
    corner: float
    arm: float
    yielding: float
    limit: float


@kernel
def gaps_of(y: State, M: float, modes: Modes, c: Constants, theta_limit: float) -> Gaps:
    """Gaps of all events at a state.

    Parameters
    ----------
    y
        The state.
    M
        Net moment of soil and truck there [N m].
    modes
        The present modes.
    c
        Constants of the design.
    theta_limit
        Limit of rotation [rad].
    """
    sin, versin = sine_versine(y.theta_b)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    A = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c).A
    turning = modes.turning
    rotation = couple = arm = NEVER
    if turning == SEATED:
        rotation = c.C_cos - abs(M)
    elif turning == TURNING_FORWARD:
        rotation = y.theta_b
    elif turning == TURNING_BACK:
        rotation = -y.theta_b
    elif turning == FREE:
        rotation = -y.omega_b
    else:
        rotation = y.omega_b
        limit = holding_moment(sin, versin, c)
        arm = modes.arm * signed_arm(sin, versin, c)
        if turning == HELD:
            couple = limit - abs(M)
        elif turning == LIMITED_FORWARD:
            couple = M - limit
        else:
            couple = -M - limit
    if modes.yielded == 0:
        yielding = c.x_yield - abs(A)
    else:
        yielding = modes.yielded * A - c.x_yield
    return Gaps(
        u if modes.touching else -u,
        rotation,
        couple,
        modes.corner * (c.theta_corner - y.theta_b),
        arm,
        yielding,
        theta_limit - abs(y.theta_b),
    )


@kernel
def gap_within(
    event: int,
    tau: float,
    dense: DenseOutput,
    modes: Modes,
    switches: Switches,
    c: Constants,
    theta_limit: float,
) -> float:
    """Gap of one event at the fraction tau of a step."""
    y = state_at(dense, tau)
    M = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c).M
    return gaps_of(y, M, modes, c, theta_limit)[event]


@kernel
def locate(
    event: int,
    gap_end: float,
    dense: DenseOutput,
    modes: Modes,
    switches: Switches,
    c: Constants,
    theta_limit: float,
) -> float:
    """Fraction of a step at which a gap that is negative at its end passes zero.

    Parameters
    ----------
    event
        Which gap.
    gap_end
        Its value at the end of the step, negative.
    dense, modes, switches, c, theta_limit
        The step.

    Returns
    -------
    float
        tau in (0, 1], from the side on which the event has happened. A gap that starts at zero and opens only by
        rounding counts as crossed at once: the step still moves on, and the mode that follows settles it.
    """
    low, high = 0.0, 1.0
    gap_low = gap_within(event, low, dense, modes, switches, c, theta_limit)
    if gap_low <= 0.0:
        for start in (1e-3, 1e-6):
            low = start
            gap_low = gap_within(event, low, dense, modes, switches, c, theta_limit)
            if gap_low > 0.0:
                break
        else:
            return low
    gap_high = gap_end
    # Illinois: regula falsi that halves the value at an end which stays, so that neither end stalls.
    for _ in range(ROOT_ITERATIONS):
        if high - low <= ROOT_TOLERANCE:
            break
        tau = high - gap_high * (high - low) / (gap_high - gap_low)
        if not low < tau < high:
            tau = 0.5 * (low + high)
        gap = gap_within(event, tau, dense, modes, switches, c, theta_limit)
        if gap == 0.0:
            return tau
        if gap > 0.0:
            low, gap_low = tau, gap
            gap_high *= 0.5
        else:
            high, gap_high = tau, gap
            gap_low *= 0.5
    return high


@kernel
def first_event(
    end: Gaps, dense: DenseOutput, modes: Modes, switches: Switches, c: Constants, theta_limit: float
) -> tuple[int, float]:
    """Earliest event of a step, and the fraction of the step at which it happens.

    Parameters
    ----------
    end
        Gaps at the end of the step.
    dense, modes, switches, c, theta_limit
        The step.

    Returns
    -------
    event, tau
        The event, or -1 and 1.0 where there is none.
    """
    first, earliest = -1, 1.0
    for event in range(EVENTS):
        if end[event] < 0.0:
            tau = locate(event, end[event], dense, modes, switches, c, theta_limit)
            if first < 0 or tau < earliest:
                first, earliest = event, tau
    return first, earliest


@kernel
def forward_mode(M: float, sin: float, versin: float, c: Constants) -> int:
    """Mode of a boulder that turns forward under the printed restoring moment."""
    limit = holding_moment(sin, versin, c)
    if M > limit:
        return LIMITED_FORWARD
    if M < -limit:
        return LIMITED_BACK
    return HELD


@kernel
def initial_modes(readings: Readings, c: Constants) -> Modes:
    """Modes at the instant of impact.

    The truck touches and the boulder is seated. Under the printed rule the first moment decides: the blow turns
    the boulder forward where it is over the centre of mass, else back.
    """
    if readings.restoring_gravity:
        turning = SEATED
    else:
        turning = HELD if c.h >= 0.0 else FREE
    return Modes(turning, True, 1.0, 1.0, 0)


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
        Net moment of soil and truck there [N m].
    modes
        Modes before.
    c
        Constants of the design.
    """
    turning, touching, yielded = modes.turning, modes.touching, modes.yielded
    corner, arm = modes.corner, modes.arm
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
            turning = forward_mode(M, sin, versin, c) if turning == FREE else FREE
    elif event == COUPLE:
        if turning == HELD:
            turning = LIMITED_FORWARD if M > 0.0 else LIMITED_BACK
        else:
            turning = HELD
    elif event == CORNER:
        corner = -corner
    elif event == ARM:
        arm = -arm
    elif event == YIELD:
        if yielded == 0:
            A = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c).A
            yielded = 1 if A > 0.0 else -1
        else:
            yielded = 0
    return State(y.x_b, y.v_b, theta_b, omega_b, y.x_v, y.v_v), Modes(turning, touching, corner, arm, yielded)
