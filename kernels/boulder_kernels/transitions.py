"""What an event changes: the modes that follow it, and those at the instant of impact."""

from __future__ import annotations

from ._jit import inlined, kernel
from .design import Constants
from .dynamics import State
from .gaps import ARM, CONTACT, CORNER, COUPLE, ROTATION, YIELD_BASE, YIELD_TOP
from .modes import (
    FREE,
    HELD,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
)
from .readings import Readings
from .restoring import holding_moment
from .soil import soil_kinematics
from .trigonometry import sine_versine

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
