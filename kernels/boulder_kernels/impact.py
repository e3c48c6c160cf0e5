"""An impact from the first touch to its end: what it carries from step to step, and what follows from a step.

Most steps are plain: they meet no event and pass no peak (`go_on`). What follows from any other, `follow` finds: its
first event, the peaks of what is reported, the modes behind it, or the end. The lanes and the impact that is simulated
alone both go by these functions.

**As a last resort** designs that need more steps than are allowed are simulated all the same, as long as a stated
number of steps lasts. Three things make such designs affordable.

1. They are given a number of steps (`MOST_STEPS`), not a number up to the horizon: many are decided long before it.
2. The stiff truck asks for short steps only while it touches; released, it coasts.
3. A spring that relaxes against its damper faster than the steps can follow passes on the force of the damper, however
   stiff it is: F = c_v times the speed of crush, with an error of the order of the relaxation time c_v/k_v over the
   time of the impact. So a softer spring stands for it, which relaxes within a step, and at least `DAMPED` times as
   fast as the damper slows the masses. A third of the step comes with a spring three times as stiff, so the estimated
   error covers the spring.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import by_types, inlined, is_none, kernel
from .control import (
    ACCEPTED,
    MOST_STEPS,
    RETRY,
    STEP_RATIO,
    VALID_ROTATION,
    Control,
    Rates,
    attempt_budget,
    first_length,
    first_step,
    rates_of,
    stable_step,
)
from .design import Constants, Design, Readings, constants_of, is_computable
from .dormand_prince import dense_output, state_at, step, time_of_limit
from .dynamics import (
    TURNING_FORWARD,
    Acceleration,
    Modes,
    State,
    Switches,
    acceleration,
    constants_in,
    switches_of,
)
from .events import (
    AT_END,
    COUPLE,
    LIMIT,
    NONE,
    ROTATION,
    SHORTEN,
    TOLERANCE,
    GapFactors,
    change_mode,
    changes_counted,
    first_event,
    gap_factors,
    gaps_at,
    gaps_of,
    initial_modes,
    length_after,
    needs_moment,
)
from .numerics import sine_versine
from .outcomes import (
    Compression,
    ExchangedEnergies,
    Maxima,
    Outcome,
    Record,
    Status,
    add_exchanged,
    all_maxima,
    compression_at,
    compression_of,
    error_time,
    grown,
    highest,
    nothing_exchanged,
    updated_maxima,
    write_samples,
)
from .settling import NO_PROOF, barrier_energy, boulder_energy, inside_maxima, proof_is_possible, stays_below

FULL_TURN = math.pi
"""Rotation at which a simulation that does not stop at the limit ends [rad]: the boulder is upside down."""
RUNNING = -1
"""Status of a simulation that has not ended."""


class Clock(NamedTuple):
    """How far the simulation of an impact has come."""

    t: float
    """Time since first touch [s]."""
    h: float
    """Length of the next step [s]."""
    h_full: float
    """Length of a step that nothing shortens [s]."""
    attempts: float
    """Number of steps tried."""
    barrier: float
    """Energy below which the motion has settled [J], see `boulder_kernels.settling`."""
    horizon: float
    """Time at which the simulation ends, unless there is a reason to go on [s]."""
    error: float
    """Sum of the errors of the steps [m/s], see `boulder_kernels.outcomes`."""
    rotation_changes: float
    """How often the mode of rotation has changed."""


class Pace(NamedTuple):
    """Which steps an impact is given."""

    h_touching: float
    """Length of a step that nothing shortens while the truck touches [s]."""
    h_apart: float
    """Length of a step that nothing shortens while truck and boulder are apart [s]."""
    budget: float
    """Steps that may be tried."""


class Impact(NamedTuple):
    """What a simulation carries from step to step."""

    pace: Pace
    y: State
    k: Acceleration
    """Acceleration at this state."""
    front: Compression
    """Compression of the vehicle there."""
    maxima: Maxima
    """Largest values so far."""
    clock: Clock
    modes: Modes
    switches: Switches
    factors: GapFactors
    """What follows from the modes."""


class StepResult(NamedTuple):
    """What follows from a step."""

    status: int
    """How the simulation ended, or RUNNING."""
    event: int
    """The event at which the step was cut, NONE, or SHORTEN where it is to be tried again."""
    impact: Impact


@inlined
def stop_of(control: Control) -> float:
    """Rotation at which a simulation ends [rad]."""
    return control.theta_limit if control.stop_at_limit else FULL_TURN


@kernel
def failed(status: int) -> Outcome:
    """Outcome of a design that was not simulated, or not to its end."""
    return Outcome(status, all_maxima(np.nan), np.nan, np.nan, 0, np.nan, np.nan, 0.0)


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
def horizon_status(y: State, m: Maxima, theta_limit: float, provable: bool, c: Constants) -> int:
    """Status of a design that reached a horizon, if it ends there; see `decide`.

    What the model is valid for is proved, too, unless it is passed already: then only the limit counts.
    """
    below = theta_limit if m.theta >= VALID_ROTATION else min(theta_limit, VALID_ROTATION)
    if provable and m.theta < below and stays_below(below, y, c):
        return Status.BELOW_LIMIT.value
    if is_growing(y, m):
        return Status.OUTWARD.value
    return Status.HORIZON.value if provable else Status.UNPROVABLE.value


@inlined
def turned_back(y: State, y_end: State) -> bool:
    """Whether a motion that is reported changed its direction in a step, so that its maximum may now be final."""
    return y.omega_b * y_end.omega_b < 0.0 or y.v_b > 0.0 >= y_end.v_b or y.v_v > 0.0 >= y_end.v_v


@inlined
def passes(i: Impact, y_end: State, k_end: Acceleration, beyond: float, c: Constants) -> tuple[bool, Compression]:
    """Whether a step meets no event and turns nowhere, so that it may be kept as it is; and the compression at its end.

    A comparison with NaN is false, so a step to a state that is not a number does not pass. The net moment may exceed
    the couple of the weight of a boulder that is seated by ``beyond`` [N m].
    """
    y = i.y
    sin, versin = sine_versine(y_end.theta_b)
    end = compression_of(y_end, sin, versin, i.switches, c)
    gaps = gaps_of(y_end, k_end.M, end.u, sin, versin, i.factors, c)
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

    ``m``: maxima before it; ``t, h``: its start and its length [s]; ``y, y_end, start, end``: states and compressions
    at its ends; ``switches``: factors of its modes.
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
def go_on(i: Impact, y_end: State, k_end: Acceleration, error: float, c: Constants) -> tuple[bool, Impact]:
    """Whether a step is plain, with no event, no peak and nothing to be decided; and what is carried on then.

    No branch, so that a loop over lanes stays vectorised. Arguments: see `follow`.
    """
    clock = i.clock
    passing, end = passes(i, y_end, k_end, 0.0, c)
    lively = (y_end.v_v > 0.0) | (boulder_energy(y_end, c) >= clock.barrier)
    plain = passing & lively & (clock.h < clock.horizon - clock.t) & (clock.attempts < i.pace.budget)
    m = passed_maxima(i.maxima, clock.t, clock.h, i.y, y_end, i.front, end, i.switches)
    t = clock.t + clock.h
    h = min(clock.h_full, clock.horizon - t)
    attempts, error = clock.attempts + 1.0, clock.error + error
    after = Clock(t, h, clock.h_full, attempts, clock.barrier, clock.horizon, error, clock.rotation_changes)
    return plain, Impact(i.pace, y_end, k_end, end, m, after, i.modes, i.switches, i.factors)


@inlined
def begin_to_turn(
    i: Impact, y_end: State, k_end: Acceleration, error: float, c: Constants, readings: Readings, control: Control
) -> tuple[bool, Impact]:
    """Whether the first step just ends where the boulder begins to turn, as it should; and what is carried on then.

    No branch, as in `go_on`; arguments: see `follow`.
    """
    clock, seated = i.clock, needs_moment(i.factors)
    beyond = AT_END * TOLERANCE * c.C_cos if seated else 0.0
    passing, _ = passes(i, y_end, k_end, beyond, c)
    turns = passing & seated & (c.C_cos < k_end.M) & (clock.h < clock.horizon) & (y_end.v_v > 0.0)
    modes = Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0)
    switches, g = enter_modes(modes, readings, i.factors.limit, control.locate_yield, control.event_tolerance, c)
    front = compression_at(y_end, switches, c)
    m = passed_maxima(i.maxima, 0.0, clock.h, i.y, y_end, i.front, front, i.switches)
    h = min(clock.h_full, clock.horizon - clock.h)
    after = Clock(clock.h, h, clock.h_full, 1.0, clock.barrier, clock.horizon, error, 0.0)
    return turns, Impact(i.pace, y_end, acceleration(y_end, switches, c), front, m, after, modes, switches, g)


@inlined
def decide(
    i: Impact, y: State, m: Maxima, t: float, c: Constants, readings: Readings, control: Control
) -> tuple[int, float, float]:
    """Decide whether a simulation ends with a step that does not reach the limit.

    ``i``: the impact at its start; ``y, m, t``: state, maxima and time [s] where it is cut; ``c, readings, control``:
    see `follow`.

    Returns ``status, barrier, horizon``: how it ended or RUNNING, and what `Clock` says of the others.
    """
    barrier, horizon, provable = i.clock.barrier, i.clock.horizon, proof_is_possible(readings)
    if control.stop_at_limit and provable and y.v_v <= 0.0:
        # At one of its maxima a motion has yet to turn back, and the barrier will be another then.
        inside = inside_maxima(y, m)
        if inside and turned_back(i.y, y):
            barrier = barrier_energy(m, c)
        if inside and boulder_energy(y, c) < barrier:
            return Status.SETTLED.value, barrier, horizon
    if t < horizon:
        return RUNNING, barrier, horizon
    status, longest = horizon_status(y, m, control.theta_limit, provable, c), longest_time(control, i.pace.h_apart)
    if t < longest and (status != Status.BELOW_LIMIT.value or is_growing(y, m)):
        return RUNNING, barrier, min(horizon + control.horizon, longest)
    return status, barrier, horizon


@inlined
def follow(
    i: Impact, y_end: State, k_end: Acceleration, error: float, c: Constants, readings: Readings, control: Control
) -> StepResult:
    """Find what follows from a step that is not plain: its first event, its peaks, the modes behind it, or the end.

    ``i``: the impact at the start of the step; ``y_end, k_end, error``: state and acceleration at its end, and its
    error, from `boulder_kernels.dormand_prince.step`.
    """
    clock, g, modes, switches = i.clock, i.factors, i.modes, i.switches
    if not is_finite(y_end):
        return StepResult(Status.UNSTABLE.value, NONE, i)
    if clock.attempts >= i.pace.budget:
        return StepResult(Status.STEP_BUDGET.value, NONE, i)
    h, attempts = clock.h, clock.attempts + 1.0
    dense = dense_output(i.y, i.k, y_end, k_end, h)
    event, tau = first_event(i.y, i.k.M, gaps_at(y_end, k_end.M, g, c), dense, g, switches, c)
    if event == SHORTEN:
        t, h = clock.t, tau * h
        again = Clock(t, h, clock.h_full, attempts, clock.barrier, clock.horizon, clock.error, clock.rotation_changes)
        return StepResult(RUNNING, event, Impact(i.pace, i.y, i.k, i.front, i.maxima, again, modes, switches, g))
    y = y_end if tau >= 1.0 else state_at(dense, tau)
    m, front = updated_maxima(i.maxima, clock.t, tau, i.front, y, dense, switches, c)
    t = clock.horizon if h >= clock.horizon - clock.t and tau >= 1.0 else clock.t + tau * h
    if event == LIMIT:
        status, barrier, horizon = Status.LIMIT.value, clock.barrier, clock.horizon
        m = at_limit(m, t, g.limit)
    else:
        status, barrier, horizon = decide(i, y, m, t, c, readings, control)
    k, h_full, changes = k_end, clock.h_full, clock.rotation_changes
    h = min(h_full, horizon - t)
    if event > NONE and status == RUNNING:
        changes += changes_counted(event, clock.t, modes)
        M = k_end.M
        if (event == ROTATION or event == COUPLE) and tau < 1.0:
            M = acceleration(y, switches, c).M
        y, modes = change_mode(event, y, M, modes, c)
        switches, g = enter_modes(modes, readings, g.limit, control.locate_yield, control.event_tolerance, c)
        k, front = acceleration(y, switches, c), compression_at(y, switches, c)
        h_full = i.pace.h_touching if modes.touching else i.pace.h_apart
        h = length_after(event, min(h_full, horizon - t), y.omega_b, k.alpha_b)
    after = Clock(t, h, h_full, attempts, barrier, horizon, clock.error + error, changes)
    return StepResult(status, event, Impact(i.pace, y, k, front, m, after, modes, switches, g))


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
def longest_time(control: Control, h_full: float) -> float:
    """Longest time for which a design is simulated by steps of a length [s]; none takes more than MOST_STEPS."""
    most = (STEP_RATIO if control.refined else 1.0) * MOST_STEPS * h_full
    longest = control.horizon
    if control.stop_at_limit:
        longest = max(longest, min(control.longest_horizon, most))
    return longest


@inlined
def first_touch(h_touching: float, h_apart: float, c: Constants, readings: Readings, control: Control) -> Impact:
    """Return an impact at the first touch.

    ``h_touching, h_apart``: steps [s] while the truck touches and while not.
    """
    y, modes = State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0), initial_modes(readings, c)
    switches, g = enter_modes(modes, readings, stop_of(control), control.locate_yield, control.event_tolerance, c)
    budget = attempt_budget(h_apart, longest_time(control, h_apart))
    pace = Pace(h_touching, h_apart, float(MOST_STEPS) if control.last_resort else budget)
    h = min(first_length(h_touching, g, c), control.horizon)
    clock = Clock(0.0, h, h_touching, 0.0, NO_PROOF, control.horizon, 0.0, 0.0)
    k, front = acceleration(y, switches, c), compression_at(y, switches, c)
    return Impact(pace, y, k, front, all_maxima(0.0), clock, modes, switches, g)


class ImpactNotes(NamedTuple):
    """What is noted of an impact while it goes on."""

    t_limit: float
    """When it reached a limit at which it does not stop [s]; NaN before."""
    written: int
    """Samples of its record that have been written."""
    exchanged: ExchangedEnergies
    """Energies exchanged so far."""


@inlined
def nothing_watched() -> ImpactNotes:
    """Return what is noted before the first step."""
    return ImpactNotes(np.nan, 0, nothing_exchanged())


@inlined
def watch(
    w: ImpactNotes,
    i: Impact,
    y_end: State,
    k_end: Acceleration,
    after: Impact,
    c: Constants,
    control: Control,
    record: Record,
) -> ImpactNotes:
    """Note what there is of a step, from an impact at its start and after it; other arguments: see `follow`."""
    t, h, t_end = i.clock.t, i.clock.h, after.clock.t
    dense = dense_output(i.y, i.k, y_end, k_end, h)
    t_limit, written, exchanged = w.t_limit, w.written, w.exchanged
    if np.isnan(t_limit) and after.maxima.theta >= control.theta_limit:
        t_limit = t + h * time_of_limit(dense.rotation, control.theta_limit, (after.maxima.t_theta - t) / h)
    if record.times.size > 0:
        written = write_samples(record, written, t, t_end, dense, i.modes, i.switches, c, exchanged)
        exchanged = add_exchanged(exchanged, dense, (t_end - t) / h, i.modes, i.switches, c)
    return ImpactNotes(t_limit, written, exchanged)


@inlined
def outcome_of(i: Impact, status: int, t_limit: float, control: Control) -> Outcome:
    """Return the outcome of an impact that has ended; t_limit is of `ImpactNotes`."""
    clock = i.clock
    if status == Status.LIMIT.value and control.stop_at_limit:
        t_limit = clock.t
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        return failed(status)
    moved = error_time(clock.h_full, control.locate_yield and control.elements == 0) * clock.error
    attempts = int(clock.attempts)
    return Outcome(status, i.maxima, t_limit, clock.t, attempts, moved, i.y.omega_b, clock.rotation_changes)


class Problem(NamedTuple):
    """One impact to be simulated."""

    design: Design
    """The design in SI units."""
    profile: Any
    """`SoilProfile` of its soil; None for the uniform soil of the design."""


@kernel
def simulate_alone(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact with a fixed time step, each step cut where a mode changes.

    ``problem``: design and soil. Kernels are compiled for each kind of soil; ``control``: step, horizon, limit,
    representation of the soil; ``record``: filled with the time history at the times it names.

    Returns maxima from the dense output; NaN where the status says that there is no result, see `Status`.

    Within a step the modes are frozen and the right-hand side is smooth. Where a step passes an event, it is kept up to
    the event by its dense output, whose local error of order five adds once per event what every step adds to the
    solution, so the order of the method is kept. A motion that became non-finite is retried with a shorter step.
    """
    if problem.design.H - problem.design.d <= problem.design.e_bumper:
        return failed(Status.NO_CONTACT.value)
    c = constants_in(problem.design, readings, control.elements, problem.profile)
    if not is_computable(c):
        return failed(Status.INVALID.value)
    h, status = first_step(control, stop_of(control), c)
    if status != ACCEPTED:
        return simulate_refused(problem, status, readings, control, record)
    outcome = simulate_by_steps(h, h, c, readings, control, record)
    while outcome.status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
        h *= RETRY
        outcome = simulate_by_steps(h, h, c, readings, control, record)
    return outcome


@by_types
def simulate_refused(
    problem: Problem, status: int, readings: Readings, control: Control, record: Record
) -> Callable[..., Outcome]:
    """Simulate one impact that is refused with some status; only in uniform soil there is a last resort."""
    if is_none(problem[-1]):
        return lambda problem, status, readings, control, record: simulate_last_resort(
            problem.design, status, readings, control, record
        )
    return lambda problem, status, readings, control, record: failed(status)


@kernel
def simulate_by_steps(
    h_touching: float, h_apart: float, c: Constants, readings: Readings, control: Control, record: Record
) -> Outcome:
    """Simulate one impact with given time steps [s] while the truck touches and while not; see `simulate_alone`."""
    watching = record.times.size > 0 or not control.stop_at_limit
    w = nothing_watched()
    i = first_touch(h_touching, h_apart, c, readings, control)
    y_end, k_end, error = step(i.y, i.k, i.clock.h, i.switches, c)
    turns, after = begin_to_turn(i, y_end, k_end, error, c, readings, control)
    if turns:
        w = watch(w, i, y_end, k_end, after, c, control, record) if watching else w
        i = after
    status = RUNNING
    while status == RUNNING:
        y_end, k_end, error = step(i.y, i.k, i.clock.h, i.switches, c)
        plain, after = go_on(i, y_end, k_end, error, c)
        if not plain:
            followed = follow(i, y_end, k_end, error, c, readings, control)
            status, after = followed.status, followed.impact
        if watching and after.clock.t > i.clock.t:
            w = watch(w, i, y_end, k_end, after, c, control, record)
        i = after
    return outcome_of(i, status, w.t_limit, control)


DAMPED = 16.0
"""Least rate of relaxation over that at which the damper slows the masses, of the spring that stands for a stiffer
one."""
RESOLVED = 0.5
"""Step while the truck touches, over the longest that is stable: a short blow is to be followed, not only survived."""
NO_SPRING = 1e-12
"""Factor on a spring that leaves nothing of its rates."""


@kernel
def with_spring(design: Design, factor: float) -> Design:
    """Return a design whose vehicle has its spring times a factor."""
    p = design
    k_v = factor * p.k_v
    return Design(
        p.L, p.W, p.H, p.rho_b, p.d, p.e, p.rho_s, p.phi, p.beta, p.K_epsilon, p.m_v, p.v_0, k_v, p.c_v, p.e_bumper
    )  # fmt: skip


@kernel
def spring_to_follow(r: Rates, control: Control) -> float:
    """Factor on a spring that leaves it no faster than the steps can follow."""
    slowing = r.truck / r.relaxation  # c_v over the masses
    fastest = (STEP_RATIO if control.refined else 1.0) * max(1.0 / control.h, DAMPED * slowing)
    return min(1.0, fastest / r.relaxation)


@kernel
def longest_step(theta_limit: float, c: Constants) -> float:
    """Longest step that is stable up to a rotation [s]."""
    return stable_step(rates_of(theta_limit, c))


@kernel
def simulate_last_resort(design: Design, status: int, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact; what cannot be decided within the steps allowed keeps the status it is refused with.

    ``design, status``: the design, in uniform soil, and that status; ``readings, control, record``: the same as in
    `simulate_alone`; the record keeps nothing.
    """
    if not (control.last_resort and control.stop_at_limit):
        return failed(status)
    c = constants_of(design, readings, control.elements)
    factor = spring_to_follow(rates_of(control.theta_limit, c), control)
    c = constants_of(with_spring(design, factor), readings, control.elements)
    apart = constants_of(with_spring(design, NO_SPRING), readings, control.elements)
    ratio = STEP_RATIO if control.refined else 1.0
    h = min(control.h, RESOLVED * longest_step(control.theta_limit, c)) / ratio
    h_apart = min(control.h, longest_step(control.theta_limit, apart)) / ratio if readings.separation_released else h
    outcome = simulate_by_steps(h, h_apart, c, readings, control, record)
    return failed(status) if outcome.status == Status.STEP_BUDGET.value else outcome
