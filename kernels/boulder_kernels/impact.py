"""One impact from the first touch to its end: the reference that every faster path is held against."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .after_step import (
    RUNNING,
    Decided,
    Ending,
    Kept,
    at_limit,
    decide,
    enter_modes,
    initial_state,
    is_finite,
    keep_step,
    kept_up_to,
    passed_maxima,
    passes,
    rate_of,
)
from .dense_output import DenseOutput, dense_output, state_at
from .design import Constants, Design, Readings, is_computable
from .dormand_prince import step
from .energy import Exchanged, add_exchanged, nothing_exchanged
from .error_estimates import error_time
from .events import NONE, SHORTEN, change_mode, changes_counted, initial_modes, locate_limit
from .gaps import TOLERANCE
from .modes import Modes, Switches
from .onset import first_length
from .outcomes import Outcome, Status, compression_at, no_maxima, undefined_maxima
from .plastic import ELASTIC, memory_of
from .second_spring import (
    STIFFENS,
    SecondSpring,
    is_second_spring,
    largest_crush,
    offset_of,
    on_second_spring,
    provable_so_far,
    reached,
    stiffest,
)
from .settling import NO_PROOF, boulder_energy, proof_is_possible
from .soil_laws import constants_in
from .stability import ACCEPTED, MOST_STEPS, RETRY, rates_of, refusal, stable_step
from .unloading import forget, note, rate_after, remember, until_rest

FULL_TURN = math.pi
"""Rotation at which a simulation that does not stop at the limit ends [rad]: the boulder is upside down."""
ATTEMPTS_PER_STEP = 4
ATTEMPTS_SPARE = 10_000
"""A simulation gives up after ATTEMPTS_PER_STEP attempts per nominal step, plus this many for events."""


STEP_RATIO = 3.0
"""Step of the coarser of the two solutions that an error is estimated from, over that of the finer."""


class Control(NamedTuple):
    """How a simulation is run."""

    h: float
    """Step [s]; shortened where a design needs it, see `boulder_kernels.stability`."""
    horizon: float
    """Simulated time [s], unless a design ends before or has reason to go on."""
    theta_limit: float
    """Limit of rotation [rad]."""
    elements: int
    """Number N of soil elements; 0 for the closed form."""
    error_estimate: bool
    """Whether the estimated error of a design is confirmed by a second solution where one could be wrong, see
    `boulder_kernels.table.simulate_table`. Without, it is that of the steps of one solution."""
    stop_at_limit: bool = True
    """Whether the simulation ends where the rotation reaches its limit."""
    locate_yield: bool = False
    """Whether steps also end where the soil reaches its ultimate resistance. The force has a kink there: a step that
    runs across it is of third order only. Locating it restores the fifth, and pays for errors below about 1e-4 deg."""
    refined: bool = False
    """Whether the step of every design is divided by `STEP_RATIO`, after any shortening: the finer of the two
    solutions that the error is estimated from."""
    longest_horizon: float = 0.0
    """Simulated time [s] up to which a design goes on that reaches the horizon without proof that it stays below its
    limits; not beyond the horizon where it is shorter, or where nothing stops at the limit."""
    last_resort: bool = False
    """Whether a design that needs more steps than are allowed is simulated all the same, see
    `boulder_kernels.last_resort`."""
    unloading: int = ELASTIC
    """How the soil unloads: ELASTIC, or PLASTIC or PLASTIC_WITH_GAP by plastic elements, of which there must be
    some. Their simulations go on until the boulder is at rest, and are not ended by a proof before the horizon."""
    paired: bool = False
    """Where errors are estimated: whether every design is solved twice for it, and not only doubtful ones."""
    event_tolerance: float = TOLERANCE
    """Precision with which events are located, as a fraction of the step; `boulder_kernels.gaps.TOLERANCE` as
    printed."""
    side_by_side: bool = True
    """Whether designs that may go through lanes side by side do, or one after another. The two round differently."""


class Record(NamedTuple):
    """Where a simulation writes its time history; empty arrays for none."""

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
    offset: np.ndarray = np.empty(0)
    """Offset u_0 of the vehicle's spring at each [m], shape (n,), see `boulder_kernels.second_spring`; may be empty."""


def no_record() -> Record:
    """Return a record that keeps nothing."""
    return Record(
        np.empty(0, np.float64),
        np.empty((0, 6), np.float64),
        np.empty(0, np.int8),
        np.empty(0, np.bool_),
        np.empty((0, 4), np.float64),
        np.empty(0, np.float64),
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
        note(written, memory_of(c))
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
        if record.offset.size > 0:
            record.offset[written] = c.u_0
        written += 1
    return written


@kernel
def failed(status: int) -> Outcome:
    """Outcome of a design that was not simulated, or not to its end."""
    return Outcome(status, undefined_maxima(), np.nan, np.nan, 0, np.nan, np.nan, 0.0)


@kernel
def attempt_budget(h: float, horizon: float) -> float:
    """Attempts after which a simulation with time step h [s] gives up before its horizon [s]."""
    return ATTEMPTS_PER_STEP * horizon / h + ATTEMPTS_SPARE


@inlined
def first_step(control: Control, theta_stop: float, c: Constants) -> tuple[float, int]:
    """Step of a design [s], and the status it is refused with or ACCEPTED."""
    rates = rates_of(theta_stop, c)
    h = min(control.h, stable_step(rates))
    status = refusal(h, control.h, control.horizon, rates)
    return h / STEP_RATIO if control.refined else h, status


@kernel
def ending_of(control: Control, readings: Readings, h_full: float) -> Ending:
    """What ends the simulation of a design by steps of a given length [s]; no design takes more than MOST_STEPS."""
    most = (STEP_RATIO if control.refined else 1.0) * MOST_STEPS * h_full
    longest = control.horizon
    if control.stop_at_limit:
        longest = max(longest, min(control.longest_horizon, most))
    stopping = control.stop_at_limit and control.unloading == ELASTIC
    return Ending(control.theta_limit, control.horizon, longest, stopping, proof_is_possible(readings))


class Problem(NamedTuple):
    """One impact to be simulated."""

    design: Design
    """The design, SI."""
    profile: Any
    """`SoilProfile` of its soil; None for the uniform elastic soil of the design."""
    second: Any
    """`SecondSpring` of its vehicle; None for a vehicle without."""


@kernel
def simulate_design(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact of a vehicle with one spring in a uniform elastic soil; see `simulate`."""
    return simulate(Problem(design, None, None), readings, control, record)


@kernel
def simulate(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact with a fixed time step, each step cut where a mode changes.

    Parameters
    ----------
    problem
        Design, soil and vehicle. Kernels are compiled for each kind of soil and vehicle.
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
    adds to the solution, so the order of the method is kept. A motion that became non-finite is retried with a
    shorter step.
    """
    if misses(problem.design):
        return failed(Status.NO_CONTACT.value)
    c = constants_in(problem.design, readings, control.elements, problem.profile)
    return simulate_motion(c, readings, control, record, problem.second)


@inlined
def misses(design: Design) -> bool:
    """Whether the truck passes over the boulder."""
    return design.H - design.d <= design.e_bumper


@kernel
def simulate_motion(
    c: Constants, readings: Readings, control: Control, record: Record, second: SecondSpring | None
) -> Outcome:
    """Simulate one impact of known constants; see `simulate`, which also asks whether the truck hits at all."""
    if not is_computable(c) or not is_second_spring(c, second):
        return failed(Status.INVALID.value)
    theta_stop = control.theta_limit if control.stop_at_limit else FULL_TURN
    h, status = first_step(control, theta_stop, stiffest(c, second))
    if status != ACCEPTED:
        return failed(status)
    outcome = simulate_by_steps(h, h, c, readings, control, theta_stop, record, second)
    while outcome.status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
        h *= RETRY
        outcome = simulate_by_steps(h, h, c, readings, control, theta_stop, record, second)
    return outcome


@kernel
def simulate_by_steps(
    h_touching: float,
    h_apart: float,
    c: Constants,
    readings: Readings,
    control: Control,
    theta_stop: float,
    record: Record,
    second: SecondSpring | None,
) -> Outcome:
    """Simulate one impact with given time steps [s] while the truck touches and while not; see `simulate`.

    A step in which the crush reaches a second spring is cut there, as at an event.
    """
    memory = memory_of(c)
    forget(memory)
    ending = ending_of(control, readings, h_apart)
    budget = float(MOST_STEPS) if control.last_resort else attempt_budget(h_apart, ending.longest)
    h_full = h_touching
    y, modes = initial_state(c), initial_modes(readings, c)
    switches, factors = enter_modes(modes, readings, theta_stop, control.locate_yield, control.event_tolerance, c)
    k1, start = rate_of(y, switches, c), compression_at(y, switches, c)
    m = no_maxima()
    exchanged = nothing_exchanged()
    recording = record.times.size > 0
    written = 0
    t, t_limit = 0.0, np.nan
    attempts = 0
    h_next = first_length(h_full, factors, c)
    barrier, horizon = NO_PROOF, control.horizon
    latest, stiffening = 1.0, True
    error = rotation_changes = 0.0
    while attempts < budget:
        attempts += 1
        h = min(h_next, horizon - t)
        y_end, k_end, step_error = step(y, k1, h, switches, c)
        passing, end = passes(y, y_end, k_end, factors, switches, c, 0.0)
        if second is not None and stiffening:
            crush, latest = largest_crush(start, end, h)
            passing = passing and crush < second.s_2
        # Where nothing proves that the motion may end, there is no energy to compare.
        provable = barrier > NO_PROOF and y_end.v_v <= 0.0
        if passing and h < horizon - t and not (provable and not boulder_energy(y_end, c) >= barrier):
            kept = Kept(float(NONE), 1.0, y_end, passed_maxima(m, t, h, y, y_end, start, end, switches))
            decided = Decided(RUNNING, t + h, barrier, horizon)
        elif not is_finite(y_end):
            return failed(Status.UNSTABLE.value)
        else:
            dense = dense_output(y, k1, y_end, k_end, h)
            kept = keep_step(t, y, k1.M, y_end, k_end.M, start, m, dense, factors, switches, control.locate_yield, c)
            if kept.event == SHORTEN:
                h_next = kept.tau * h
                continue
            provable_kept = kept
            if second is not None and stiffening:
                tau = reached(second.s_2, start, latest, dense, switches, c)
                if tau < kept.tau:
                    kept = kept_up_to(float(STIFFENS), tau, t, y_end, start, m, dense, switches, c)
                provable_kept = provable_so_far(kept, c.k_v, second.k_2)
            decided = decide(t, h, y, provable_kept, barrier, horizon, ending, c)
            decided = until_rest(decided, kept.y, ending, c, memory)
            end = compression_at(kept.y, switches, c)
        h_next, m, barrier, horizon = h_full, kept.m, decided.barrier, decided.horizon
        error += step_error
        if recording or not control.stop_at_limit:
            dense = dense_output(y, k1, y_end, k_end, h)
            if np.isnan(t_limit) and m.theta >= control.theta_limit and not control.stop_at_limit:
                gap_start, gap = control.theta_limit - abs(y.theta_b), control.theta_limit - m.theta
                tau = (m.t_theta - t) / h
                t_limit = t + h * locate_limit(gap_start, gap, dense.rotation, control.theta_limit, tau)
            if recording:
                written = write_samples(record, written, t, h, kept.tau, dense, modes, switches, c, exchanged)
                exchanged = add_exchanged(exchanged, dense, h, kept.tau, modes, switches, c)
        remember(y, kept.y, kept.tau * h, c, memory)
        begun, t = t, decided.t
        if decided.status != RUNNING:
            if decided.status == Status.LIMIT.value:
                m = at_limit(m, t, theta_stop)
                t_limit = t if control.stop_at_limit else t_limit
            yield_located = control.locate_yield and control.elements == 0
            moved = error_time(h_full, yield_located) * error
            return Outcome(decided.status, m, t_limit, t, attempts, moved, kept.y.omega_b, rotation_changes)
        y, k1, start = kept.y, rate_after(k_end, kept.y, switches, c, memory), end
        if kept.event > NONE:
            if second is not None and kept.event == STIFFENS:
                c = on_second_spring(c, second.k_2, offset_of(start.u, c.k_v, second.k_2))
                stiffening = False
            rotation_changes += changes_counted(kept.event, begun, modes)
            y, modes = change_mode(int(kept.event), y, rate_of(y, switches, c).M, modes, c)
            switches, factors = enter_modes(
                modes, readings, theta_stop, control.locate_yield, control.event_tolerance, c
            )
            k1, start = rate_of(y, switches, c), compression_at(y, switches, c)
            h_next = h_full = h_touching if modes.touching else h_apart
    return failed(Status.STEP_BUDGET.value)
