"""One impact from the first touch to its end: the reference that every faster path is held against."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .dense_output import DenseOutput, dense_output, state_at
from .design import Constants, Design, constants_of, is_computable
from .dormand_prince import step
from .dynamics import Acceleration, State, acceleration
from .energy import Exchanged, add_exchanged, nothing_exchanged
from .events import first_event, locate_limit
from .gaps import COUPLE, LIMIT, ROTATION, GapFactors, gap_factors, gaps_at
from .modes import Modes, Switches, switches_of
from .outcomes import (
    Maxima,
    Outcome,
    Status,
    no_maxima,
    undefined_maxima,
    updated_maxima,
)
from .readings import Readings
from .settling import (
    NO_PROOF,
    barrier_energy,
    boulder_energy,
    inside_maxima,
    proof_is_possible,
)
from .stability import ACCEPTED, MOST_STEPS, RETRY, rates_of, refusal, stable_step
from .transitions import change_mode, initial_modes

FULL_TURN = math.pi
"""Rotation at which a simulation without a stop ends all the same [rad]: the boulder lies upside down."""
AT_ONCE = 1e-5
"""Fraction of a step before which a kink counts as passed already."""
LANDED = 0.99
"""Fraction of a step behind which a kink may lie without spoiling it."""
BEYOND = 1.002
"""A step that is tried again ends so much behind the kink, which therefore lies in it and not in the next one."""
SHORTEN = -2
"""In place of an event: the step is to be tried again, shorter."""
ATTEMPTS_PER_STEP = 4
ATTEMPTS_SPARE = 10_000
"""A simulation gives up after so many attempts per nominal step, and these to spare for events."""


class Control(NamedTuple):
    """How a simulation is run."""

    h: float
    """Step [s]; shortened where a design needs it, see `boulder_kernels.stability`."""
    horizon: float
    """Longest simulated time [s]."""
    theta_limit: float
    """Limit of rotation [rad]."""
    elements: int
    """Number N of soil elements; 0 for the closed form."""
    error_estimate: bool
    """Whether the numerical error of each design is estimated."""
    stop_at_limit: bool = True
    """Whether the simulation ends where the rotation reaches its limit."""
    locate_yield: bool = False
    """Whether steps are also cut where the soil reaches its ultimate resistance. The force has a kink there. Steps that
    run across it leave the method at third order; located, it is of fifth, and pays from about 0.0001 deg on."""
    halved: bool = False
    """Whether the step of every design, shortened where it must be, is halved: the finer one of the two solutions that
    an error is estimated from."""


class Record(NamedTuple):
    """Where a simulation leaves its time history; empty arrays for none."""

    times: np.ndarray
    """Times asked for [s], ascending, shape (n,)."""
    states: np.ndarray
    """State at each, shape (n, 6), order of `State`; rows beyond the end of the simulation stay as they are."""
    turning: np.ndarray
    """Mode of rotation at each, int8, shape (n,)."""
    touching: np.ndarray
    """Whether the truck touched, bool, shape (n,)."""
    exchanged: np.ndarray
    """Energy exchanged up to each [J], shape (n, 4), order of `Exchanged`."""


@kernel
def no_record() -> Record:
    """Return a record that keeps nothing."""
    return Record(
        np.empty(0, np.float64),
        np.empty((0, 6), np.float64),
        np.empty(0, np.int8),
        np.empty(0, np.bool_),
        np.empty((0, 4), np.float64),
    )


@kernel
def write_samples(
    record: Record,
    written: int,
    t: float,
    h: float,
    tau_end: float,
    dense: DenseOutput,
    modes: Modes,
    switches: Switches,
    c: Constants,
    exchanged: Exchanged,
) -> int:
    """Write the samples that lie in a step, and return how many have been written in all."""
    t_end = t + tau_end * h
    while written < record.times.size and record.times[written] <= t_end:
        tau = (record.times[written] - t) / h
        y = state_at(dense, tau)
        states = record.states[written]
        states[0], states[1], states[2] = y.x_b, y.v_b, y.theta_b
        states[3], states[4], states[5] = y.omega_b, y.x_v, y.v_v
        record.turning[written] = modes.turning
        record.touching[written] = modes.touching
        so_far = add_exchanged(exchanged, dense, h, tau, modes, switches, c)
        sums = record.exchanged[written]
        sums[0], sums[1], sums[2], sums[3] = (
            so_far.drag,
            so_far.damper,
            so_far.restoring,
            so_far.pull,
        )
        written += 1
    return written


@kernel
def is_finite(y: State) -> bool:
    """Whether no component of a state is NaN or infinite."""
    return bool(np.isfinite(y.x_b + y.v_b + y.theta_b + y.omega_b + y.x_v + y.v_v))


@kernel
def horizon_status(y: State, m: Maxima) -> int:
    """Status of a design that reached the horizon: outward where a maximum is still being set there."""
    turning_out = y.theta_b * y.omega_b > 0.0 and abs(y.theta_b) >= m.theta
    driving_on = y.v_v > 0.0 and y.x_v >= m.x_v
    return Status.OUTWARD.value if turning_out or driving_on else Status.HORIZON.value


@kernel
def failed(status: int) -> Outcome:
    """Outcome of a design that was not simulated, or not to its end."""
    return Outcome(status, undefined_maxima(), np.nan, np.nan, 0)


@kernel
def rate_of(y: State, switches: Switches, c: Constants) -> Acceleration:
    """Acceleration at a state."""
    return acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c)


@kernel
def attempt_budget(h: float, horizon: float) -> float:
    """Steps after which a simulation gives up: those to the horizon [s] by steps h [s], and spare for events."""
    return ATTEMPTS_PER_STEP * horizon / h + ATTEMPTS_SPARE


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
        event is SHORTEN, nothing is kept, and the step is to be tried again with the fraction tau of its length.

    Notes
    -----
    The modes are frozen in the right-hand side, but the ultimate resistance of the soil is not: a step that ran across
    its kink is no better for the kink being located. So it is tried again, to end just behind the kink.
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
    """Go over into the modes that follow an event: state, modes, their factors, and the acceleration to start with."""
    M = rate_of(y, switches, c).M if event in (ROTATION, COUPLE) else np.nan
    y, modes = change_mode(event, y, M, modes, c)
    switches = switches_of(modes, readings, c)
    return (
        y,
        modes,
        switches,
        gap_factors(modes, c, theta_stop, locate_yield),
        rate_of(y, switches, c),
    )


@inlined
def turned_back(y: State, y_end: State) -> bool:
    """Whether a motion that is reported changed its direction in a step, so that its maximum may now be final."""
    return y.omega_b * y_end.omega_b < 0.0 or y.v_b > 0.0 >= y_end.v_b or y.v_v > 0.0 >= y_end.v_v


@kernel
def first_step(control: Control, theta_stop: float, c: Constants) -> tuple[float, int]:
    """Step of a design [s], and the status it is refused with or ACCEPTED."""
    rates = rates_of(theta_stop, c)
    h = min(control.h, stable_step(rates))
    status = refusal(h, control.h, control.horizon, rates)
    return 0.5 * h if control.halved else h, status


@kernel
def simulate_design(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact by fixed steps, each cut where a mode changes.

    Parameters
    ----------
    design
        The design, SI.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit, representation of the soil.
    record
        Filled with the time history at the times it names.

    Returns
    -------
    Outcome
        Maxima from the dense output; NaN where the status says that there is no result, see `Status`.

    Notes
    -----
    Within a step the modes are frozen and the right-hand side is smooth. Where a step passes an event, it is kept
    up to the event by its dense output, whose local error of order five adds once per event what every step
    adds to the solution, so the order of the method is kept. A motion that became non-finite is simulated again by
    shorter steps.
    """
    if design.H - design.d <= design.e_bumper:
        return failed(Status.NO_CONTACT.value)
    c = constants_of(design, readings, control.elements)
    if not is_computable(c):
        return failed(Status.INVALID.value)
    theta_stop = control.theta_limit if control.stop_at_limit else FULL_TURN
    h, status = first_step(control, theta_stop, c)
    if status != ACCEPTED:
        return failed(status)
    outcome = simulate_by_steps(h, c, readings, control, theta_stop, record)
    while outcome.status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
        h *= RETRY
        outcome = simulate_by_steps(h, c, readings, control, theta_stop, record)
    return outcome


@kernel
def simulate_by_steps(
    h_full: float,
    c: Constants,
    readings: Readings,
    control: Control,
    theta_stop: float,
    record: Record,
) -> Outcome:
    """Simulate one impact by steps of a given length [s]; see `simulate_design`."""
    budget = attempt_budget(h_full, control.horizon)
    y = State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0)
    modes = initial_modes(readings, c)
    switches = switches_of(modes, readings, c)
    factors = gap_factors(modes, c, theta_stop, control.locate_yield)
    k1 = rate_of(y, switches, c)
    m = no_maxima()
    exchanged = nothing_exchanged()
    recording = record.times.size > 0
    written = 0
    t, t_limit = 0.0, np.nan
    attempts = 0
    h_next = h_full
    barrier = NO_PROOF
    seeking_proof = control.stop_at_limit and control.elements == 0 and proof_is_possible(readings)
    while t < control.horizon:
        attempts += 1
        if attempts > budget:
            return failed(Status.STEP_BUDGET.value)
        h = min(h_next, control.horizon - t)
        last = h >= control.horizon - t
        y_end, k_end = step(y, k1, h, switches, c)
        if not is_finite(y_end):
            return failed(Status.UNSTABLE.value)
        dense = dense_output(y, k1, y_end, k_end, h)
        event, tau, y_end, m = keep_up_to_event(t, h, y, k1.M, y_end, k_end.M, dense, factors, switches, m, c)
        if event == SHORTEN:
            h_next = tau * h
            continue
        h_next = h_full
        if np.isnan(t_limit) and m.theta >= control.theta_limit and not control.stop_at_limit:
            gap_start, gap = control.theta_limit - abs(y.theta_b), control.theta_limit - m.theta
            t_limit = t + h * locate_limit(gap_start, gap, dense.rotation, control.theta_limit, (m.t_theta - t) / h)
        if recording:
            written = write_samples(record, written, t, h, tau, dense, modes, switches, c, exchanged)
            exchanged = add_exchanged(exchanged, dense, h, tau, modes, switches, c)
        t = control.horizon if last and event < 0 else t + tau * h
        if event == LIMIT:
            if control.stop_at_limit:
                t_limit = t
            m = Maxima(theta_stop, t, m.x_b, m.t_x_b, m.x_v, m.t_x_v, m.F_v, m.t_F_v)
            return Outcome(Status.LIMIT.value, m, t_limit, t, attempts)
        if seeking_proof and y_end.v_v <= 0.0 and t < control.horizon:
            if turned_back(y, y_end):
                barrier = barrier_energy(m, c)
            if inside_maxima(y_end, m) and boulder_energy(y_end, c) < barrier:
                return Outcome(Status.SETTLED.value, m, t_limit, t, attempts)
        y = y_end
        if event >= 0:
            y, modes, switches, factors, k1 = cross_event(
                event, y, modes, switches, readings, theta_stop, control.locate_yield, c
            )
        else:
            k1 = k_end
    return Outcome(horizon_status(y, m), m, t_limit, t, attempts)
