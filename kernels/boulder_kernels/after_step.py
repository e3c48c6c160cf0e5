"""What is kept of a step, whether the simulation ends there, and what it goes on with.

The single impact and the lanes attempt steps in their own ways; what follows from a step is decided here for both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .control import MOST_STEPS, STEP_RATIO, VALID_ROTATION, Control
from .design import Constants, Readings
from .dormand_prince import DenseOutput, state_at
from .dynamics import Acceleration, Modes, State, Switches, signed_arm, switches_of
from .events import (
    begin_search,
    first_event,
    gaps_within,
    go_on_searching,
    least_gap,
    limit_before,
    tolerance_of,
    turns_beyond,
    weights_of,
)
from .modes import LIMIT, GapFactors, gap_factors, gaps_at, gaps_of
from .numerics import ITERATIONS, sine_versine
from .outcomes import Compression, Maxima, Status, compression_of, grown, highest, updated_maxima
from .settling import barrier_energy, boulder_energy, inside_maxima, proof_is_possible, stays_below
from .soil import soil_kinematics

RUNNING = -1
"""Status of a simulation that has not ended."""


class Kept(NamedTuple):
    """What is kept of a step."""

    event: float
    """The event it was cut at or NONE; SHORTEN where nothing is kept."""
    tau: float
    """Fraction of the step that is kept; with SHORTEN, the fraction of its length to try next."""
    y: State
    """State there, before the event."""
    m: Maxima
    """Maxima up to there."""


class Decided(NamedTuple):
    """How a simulation stands after a step."""

    status: int
    """How it ended, or RUNNING."""
    t: float
    """Time [s]."""
    barrier: float
    """Energy below which the motion has settled [J]."""
    horizon: float
    """Time at which the simulation ends [s], unless there is a reason to go on."""


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


@inlined
def is_finite(y: State) -> bool:
    """Whether no component of a state is NaN or infinite."""
    return bool(np.isfinite(y.x_b + y.v_b + y.theta_b + y.omega_b + y.x_v + y.v_v))


@inlined
def is_growing(y: State, m: Maxima) -> bool:
    """Whether a maximum of rotation or truck is just being set."""
    turning_out = y.theta_b * y.omega_b > 0.0 and abs(y.theta_b) >= m.theta
    driving_on = y.v_v > 0.0 and y.x_v >= m.x_v
    return turning_out or driving_on


@kernel
def horizon_status(y: State, m: Maxima, ending: Ending, c: Constants) -> int:
    """Status of a design that reached a horizon, if it ends there.

    What the model is valid for is proved, too, unless it is passed already: then only the limit counts.
    """
    below = ending.theta_limit if m.theta >= VALID_ROTATION else min(ending.theta_limit, VALID_ROTATION)
    if ending.provable and m.theta < below and stays_below(below, y, c):
        return Status.BELOW_LIMIT.value
    if is_growing(y, m):
        return Status.OUTWARD.value
    return Status.HORIZON.value if ending.provable else Status.UNPROVABLE.value


@inlined
def turned_back(y: State, y_end: State) -> bool:
    """Whether a motion that is reported changed its direction in a step, so that its maximum may now be final."""
    return y.omega_b * y_end.omega_b < 0.0 or y.v_b > 0.0 >= y_end.v_b or y.v_v > 0.0 >= y_end.v_v


@inlined
def passes(
    y: State,
    y_end: State,
    k_end: Acceleration,
    g: GapFactors,
    switches: Switches,
    c: Constants,
    beyond: float,
) -> tuple[bool, Compression]:
    """Whether a step meets no event and turns nowhere, so that it may be kept as it is; and the compression at its end.

    Parameters
    ----------
    y, y_end, k_end
        States at its ends, and the acceleration at its end. A comparison with NaN is false, so a step to a state that
        is not a number does not pass.
    g, switches, c
        The step.
    beyond
        By how much the net moment may exceed the couple of the weight of a boulder that is seated [N m]; else 0.
    """
    sin, versin = sine_versine(y_end.theta_b)
    end = compression_of(y_end, sin, versin, switches, c)
    k = soil_kinematics(y_end.x_b, y_end.v_b, y_end.omega_b, sin, versin, c)
    arm = signed_arm(sin, versin, c)
    gaps = gaps_of(k.A, k.slope_x, y_end.theta_b, y_end.omega_b, end.u, k_end.M, arm, g, c)
    plain = (
        (gaps.contact >= 0.0)
        & (gaps.rotation >= -beyond)
        & (gaps.couple >= 0.0)
        & (gaps.corner >= 0.0)
        & (gaps.arm >= 0.0)
        & (gaps.top >= 0.0)
        & (gaps.base >= 0.0)
        & (gaps.limit >= 0.0)
        & (y.omega_b * y_end.omega_b >= 0.0)
        & ((y.v_b <= 0.0) | (y_end.v_b >= 0.0))
        & ((y.v_v <= 0.0) | (y_end.v_v >= 0.0))
    )
    return plain, end


@inlined
def passed_maxima(
    m: Maxima, t: float, h: float, y: State, y_end: State, start: Compression, end: Compression, switches: Switches
) -> Maxima:
    """Maxima after a step that passes: what is reported grows or falls all through it, but for force and crush.

    Parameters
    ----------
    m
        Maxima before it.
    t, h
        Its start and its length [s].
    y, y_end, start, end
        States and compressions at its ends.
    switches
        Factors of its modes.
    """
    t_end = t + h
    theta, t_theta = grown(m.theta, m.t_theta, abs(y_end.theta_b), t_end)
    x_b, t_x_b = grown(m.x_b, m.t_x_b, y_end.x_b, t_end)
    x_v, t_x_v = grown(m.x_v, m.t_x_v, y_end.x_v, t_end)
    u, share = highest(start.u, start.rate, end.u, end.rate, h)
    F_v, t_F_v = grown(m.F_v, m.t_F_v, switches.k_contact * u, t + share * h)
    deepest, share = highest(start.crush, start.crush_rate, end.crush, end.crush_rate, h)
    crush, t_crush = grown(m.crush, m.t_crush, deepest if y.v_v > 0.0 else 0.0, t + share * h)
    return Maxima(theta, t_theta, x_b, t_x_b, x_v, t_x_v, F_v, t_F_v, crush, t_crush)


@inlined
def kept_up_to(
    event: float,
    tau: float,
    t: float,
    y_end: State,
    start: Compression,
    m: Maxima,
    dense: DenseOutput,
    switches: Switches,
    c: Constants,
) -> Kept:
    """Keep a step up to an event.

    Parameters
    ----------
    event, tau
        As of `boulder_kernels.events.first_event`.
    t
        Start of the step [s].
    y_end
        State at the end of the step.
    start
        Compression at its start.
    m
        Maxima before it.
    dense, switches, c
        The step.
    """
    cut, whole = state_at(dense, tau), tau >= 1.0
    y = State(
        y_end.x_b if whole else cut.x_b,
        y_end.v_b if whole else cut.v_b,
        y_end.theta_b if whole else cut.theta_b,
        y_end.omega_b if whole else cut.omega_b,
        y_end.x_v if whole else cut.x_v,
        y_end.v_v if whole else cut.v_v,
    )
    m = updated_maxima(m, t, tau, start, y, dense, switches, c)
    return Kept(event, tau, y, m)


@kernel
def keep_step(
    t: float,
    y: State,
    M: float,
    y_end: State,
    M_end: float,
    start: Compression,
    m: Maxima,
    dense: DenseOutput,
    factors: GapFactors,
    switches: Switches,
    locate_yield: bool,
    c: Constants,
) -> Kept:
    """Keep a step up to its first event.

    Parameters
    ----------
    t
        Start of the step [s].
    y, M, y_end, M_end
        States and net moments [N m] at its ends.
    start
        Compression at its start.
    m
        Maxima before it.
    dense, factors, switches, c
        The step.
    locate_yield
        Whether a step is cut where the soil reaches its ultimate resistance.
    """
    end = gaps_at(y_end, M_end, factors, c)
    weights = weights_of(end, dense, factors, locate_yield, c)
    tolerance = tolerance_of(factors)
    b, tau, searching = begin_search(gaps_at(y, M, factors, c), weights, tolerance)
    for _ in range(ITERATIONS):
        if not searching:
            break
        least, _ = least_gap(gaps_within(tau, dense, factors, switches, c), weights)
        b, tau, searching = go_on_searching(b, tau, least, tolerance)
    event, tau = first_event(b, tau, weights, end, dense, factors, switches, c)
    if turns_beyond(tau, end, dense, factors):
        event, tau = float(LIMIT), limit_before(dense, factors)
    return kept_up_to(event, tau, t, y_end, start, m, dense, switches, c)


@inlined
def decide(
    t: float, h: float, y_start: State, kept: Kept, barrier: float, horizon: float, ending: Ending, c: Constants
) -> Decided:
    """Decide whether a simulation ends with a step.

    Parameters
    ----------
    t, h
        Start [s] and length [s] of the step.
    y_start
        State at its start.
    kept
        What is kept of it.
    barrier
        Energy below which the motion has settled [J].
    horizon
        Time at which the simulation ends [s], unless there is a reason to go on.
    ending
        What ends it.
    """
    y, m = kept.y, kept.m
    last = h >= horizon - t
    t = horizon if last and kept.tau >= 1.0 else t + kept.tau * h
    status = RUNNING
    if kept.event == LIMIT:
        status = Status.LIMIT.value
    elif ending.stopping and ending.provable and y.v_v <= 0.0:
        # At one of its maxima a motion has yet to turn back, and the barrier will be another then.
        inside = inside_maxima(y, m)
        if inside and turned_back(y_start, y):
            barrier = barrier_energy(m, c)
        if inside and boulder_energy(y, c) < barrier:
            status = Status.SETTLED.value
    if status == RUNNING and t >= horizon:
        status = horizon_status(y, m, ending, c)
        if t < ending.longest and (status != Status.BELOW_LIMIT.value or is_growing(y, m)):
            status, horizon = RUNNING, min(horizon + ending.extension, ending.longest)
    return Decided(status, t, barrier, horizon)


@inlined
def at_limit(m: Maxima, t: float, limit: float) -> Maxima:
    """Maxima of a motion that has reached its limit of rotation [rad] at a time [s]."""
    return Maxima(limit, t, m.x_b, m.t_x_b, m.x_v, m.t_x_v, m.F_v, m.t_F_v, m.crush, m.t_crush)


@inlined
def enter_modes(
    modes: Modes, readings: Readings, theta_stop: float, locate_yield: bool, tolerance: float, c: Constants
) -> tuple[Switches, GapFactors]:
    """Factors of the right-hand side and of the gaps in new modes."""
    return switches_of(modes, readings, c), gap_factors(modes, c, theta_stop, locate_yield, tolerance)


@kernel
def initial_state(c: Constants) -> State:
    """State at the first touch."""
    return State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0)


@kernel
def ending_of(control: Control, readings: Readings, h_full: float) -> Ending:
    """What ends the simulation of a design by steps of a given length [s]; no design takes more than MOST_STEPS."""
    most = (STEP_RATIO if control.refined else 1.0) * MOST_STEPS * h_full
    longest = control.horizon
    if control.stop_at_limit:
        longest = max(longest, min(control.longest_horizon, most))
    return Ending(control.theta_limit, control.horizon, longest, control.stop_at_limit, proof_is_possible(readings))
