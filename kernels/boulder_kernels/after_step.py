"""What is kept of a step, whether the simulation ends there, and what it goes on with.

The single impact and the lanes attempt steps in their own ways; what follows from a step is decided here for both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .dense_output import DenseOutput, state_at
from .design import Constants
from .dynamics import Acceleration, State, acceleration
from .events import first_event, locate_limit
from .gaps import COUPLE, LIMIT, ROTATION, GapFactors, gap_factors, gaps_at
from .modes import Modes, Switches, switches_of
from .outcomes import Maxima, Status, updated_maxima
from .readings import Readings
from .settling import barrier_energy, boulder_energy, inside_maxima, stays_below
from .transitions import change_mode, initial_modes

RUNNING = -1
"""Status of a simulation that has not ended."""
AT_ONCE = 1e-5
"""Fraction of a step before which a kink counts as passed."""
LANDED = 0.99
"""Fraction of a step behind which a kink does no harm."""
BEYOND = 1.002
"""A retried step ends this much behind the kink, so that the kink lies in it and not in the next one."""
SHORTEN = -2
"""In place of an event: retry the step with a shorter length."""


class Kept(NamedTuple):
    """What is kept of a step."""

    status: int
    """How the simulation ended with it, or RUNNING."""
    event: int
    """The event it was cut at, -1 where there was none; SHORTEN where nothing is kept."""
    tau: float
    """Fraction of the step that is kept; with SHORTEN, the fraction of its length to try next."""
    t: float
    """Time at its end [s]."""
    y: State
    """State there, before the event."""
    m: Maxima
    """Maxima up to there."""
    barrier: float
    """Energy below which the motion has settled from there on [J]."""
    horizon: float
    """Time at which the simulation ends from there on [s]."""


class Ending(NamedTuple):
    """What ends the simulation of a design, and what would prove that it may end."""

    theta_limit: float
    """Limit of rotation [rad]."""
    extension: float
    """A simulation that ends without a proof goes on for so long at a time [s]."""
    longest: float
    """Longest simulated time [s]."""
    stopping: bool
    """Whether it may end before the horizon, at the limit or settled."""
    provable: bool
    """Whether the energy argument of `boulder_kernels.settling` holds."""


@kernel
def is_finite(y: State) -> bool:
    """Whether no component of a state is NaN or infinite."""
    return bool(np.isfinite(y.x_b + y.v_b + y.theta_b + y.omega_b + y.x_v + y.v_v))


@kernel
def rate_of(y: State, switches: Switches, c: Constants) -> Acceleration:
    """Acceleration at a state."""
    return acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c)


@kernel
def is_growing(y: State, m: Maxima) -> bool:
    """Whether a maximum of rotation or truck is just being set."""
    turning_out = y.theta_b * y.omega_b > 0.0 and abs(y.theta_b) >= m.theta
    driving_on = y.v_v > 0.0 and y.x_v >= m.x_v
    return turning_out or driving_on


@kernel
def horizon_status(y: State, m: Maxima, ending: Ending, c: Constants) -> int:
    """Status of a design that reached a horizon, if it ends there."""
    if ending.provable and m.theta < ending.theta_limit and stays_below(ending.theta_limit, y, c):
        return Status.BELOW_LIMIT.value
    if is_growing(y, m):
        return Status.OUTWARD.value
    return Status.HORIZON.value if ending.provable else Status.UNPROVABLE.value


@inlined
def turned_back(y: State, y_end: State) -> bool:
    """Whether a motion that is reported changed its direction in a step, so that its maximum may now be final."""
    return y.omega_b * y_end.omega_b < 0.0 or y.v_b > 0.0 >= y_end.v_b or y.v_v > 0.0 >= y_end.v_v


@kernel
def keep_up_to_limit(
    t: float,
    h: float,
    y: State,
    dense: DenseOutput,
    factors: GapFactors,
    switches: Switches,
    m: Maxima,
    m_end: Maxima,
    c: Constants,
) -> tuple[float, State, Maxima]:
    """Keep a step that turns beyond the limit and back again up to the limit.

    Parameters
    ----------
    m, m_end
        Maxima before the step and after it.
    t, h, y, dense, factors, switches, c
        As of `keep_up_to_event`.

    Returns
    -------
    tau, y, m
        The fraction of the step that is kept, the state there, and the maxima up to there.
    """
    tau_top = (m_end.t_theta - t) / h
    gap, gap_top = factors.limit - abs(y.theta_b), factors.limit - m_end.theta
    tau = locate_limit(gap, gap_top, dense.rotation, factors.limit, tau_top)
    y_limit = state_at(dense, tau)
    return tau, y_limit, updated_maxima(m, t, h, tau, y, y_limit, dense, switches, c)


@kernel
def keep_up_to_event(
    t: float,
    h: float,
    y: State,
    M: float,
    y_end: State,
    M_end: float,
    dense: DenseOutput,
    factors: GapFactors,
    switches: Switches,
    m: Maxima,
    c: Constants,
) -> tuple[int, float, State, Maxima]:
    """Keep a step up to its first event.

    Parameters
    ----------
    t, h
        Start [s] and length [s] of the step.
    y, M
        State and net moment [N m] at its start.
    y_end, M_end
        The same at its end.
    dense, factors, switches, c
        The step.
    m
        Maxima before it.

    Returns
    -------
    event, tau, y, m
        The event or -1, the fraction of the step that is kept, the state there, and the maxima up to there. Where the
        event is SHORTEN, nothing is kept, and the step is to be retried with the fraction tau of its length.

    Notes
    -----
    The modes are frozen in the right-hand side, but the ultimate resistance of the soil is not: a step that ran across
    its kink gains nothing from locating it. So the step is retried, to end just behind the kink.
    """
    start, end = gaps_at(y, M, factors, c), gaps_at(y_end, M_end, factors, c)
    event, tau = first_event(start, end, dense, factors, switches, c, False)
    if min(end.top, end.base) < 0.0:
        kink, tau_kink = first_event(start, end, dense, factors, switches, c, True)
        # Where another event comes at once, next to nothing of the step is kept, and it need not be shorter.
        if min(tau, tau_kink) > AT_ONCE and min(tau, tau_kink) < LANDED:
            return SHORTEN, min(BEYOND * min(tau, tau_kink), 1.0), y, m
        if event < 0:
            event = kink
    if tau < 1.0:
        y_end = state_at(dense, tau)
    m_end = updated_maxima(m, t, h, tau, y, y_end, dense, switches, c)
    if m_end.theta >= factors.limit and event != LIMIT:
        event = LIMIT
        tau, y_end, m_end = keep_up_to_limit(t, h, y, dense, factors, switches, m, m_end, c)
    return event, tau, y_end, m_end


@kernel
def keep_step(
    t: float,
    h: float,
    y: State,
    k: Acceleration,
    y_end: State,
    k_end: Acceleration,
    dense: DenseOutput,
    factors: GapFactors,
    switches: Switches,
    m: Maxima,
    barrier: float,
    horizon: float,
    ending: Ending,
    c: Constants,
) -> Kept:
    """Keep a step up to its first event, and decide whether the simulation ends there.

    Parameters
    ----------
    t, h
        Start [s] and length [s] of the step.
    y, k, y_end, k_end
        States and accelerations at its ends.
    dense, factors, switches, c
        The step.
    m, barrier
        Maxima before it, and the energy below which the motion has settled [J].
    horizon
        Time at which the simulation ends [s], unless there is a reason to go on.
    ending
        What ends it.
    """
    if not is_finite(y_end):
        return Kept(Status.UNSTABLE.value, -1, 1.0, t, y, m, barrier, horizon)
    event, tau, y_kept, m = keep_up_to_event(t, h, y, k.M, y_end, k_end.M, dense, factors, switches, m, c)
    if event == SHORTEN:
        return Kept(RUNNING, event, tau, t, y, m, barrier, horizon)
    last = h >= horizon - t
    t = horizon if last and event < 0 else t + tau * h
    status = RUNNING
    if event == LIMIT:
        status = Status.LIMIT.value
        m = Maxima(factors.limit, t, m.x_b, m.t_x_b, m.x_v, m.t_x_v, m.F_v, m.t_F_v, m.crush, m.t_crush)
    elif ending.stopping and ending.provable and y_kept.v_v <= 0.0:
        if turned_back(y, y_kept):
            barrier = barrier_energy(m, c)
        if inside_maxima(y_kept, m) and boulder_energy(y_kept, c) < barrier:
            status = Status.SETTLED.value
    if status == RUNNING and t >= horizon:
        status = horizon_status(y_kept, m, ending, c)
        if t < ending.longest and (status != Status.BELOW_LIMIT.value or is_growing(y_kept, m)):
            status, horizon = RUNNING, min(horizon + ending.extension, ending.longest)
    return Kept(status, event, tau, t, y_kept, m, barrier, horizon)


@inlined
def go_on(
    y: State, modes: Modes, readings: Readings, theta_stop: float, locate_yield: bool, c: Constants
) -> tuple[State, Modes, Switches, GapFactors, Acceleration]:
    """State and modes, the factors of these modes, and the acceleration to start the next step with."""
    switches = switches_of(modes, readings, c)
    return y, modes, switches, gap_factors(modes, c, theta_stop, locate_yield), rate_of(y, switches, c)


@inlined
def start_motion(
    readings: Readings, theta_stop: float, locate_yield: bool, c: Constants
) -> tuple[State, Modes, Switches, GapFactors, Acceleration]:
    """What the first step starts with, as of `go_on`."""
    return go_on(
        State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0), initial_modes(readings, c), readings, theta_stop, locate_yield, c
    )


@inlined
def cross_event(
    event: int,
    y: State,
    modes: Modes,
    switches: Switches,
    readings: Readings,
    theta_stop: float,
    locate_yield: bool,
    c: Constants,
) -> tuple[State, Modes, Switches, GapFactors, Acceleration]:
    """Go over into the modes that follow an event, as of `go_on`."""
    M = rate_of(y, switches, c).M if event in (ROTATION, COUPLE) else np.nan
    y, modes = change_mode(event, y, M, modes, c)
    return go_on(y, modes, readings, theta_stop, locate_yield, c)
