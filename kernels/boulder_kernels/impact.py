"""One impact from the first touch to its end: the reference that every faster path is held against.

**As a last resort** designs that need more steps than are allowed are simulated all the same, as long as a stated
number of steps lasts. Three things make such designs affordable.

1. They are given a number of steps (`MOST_STEPS`), not a number up to the horizon: many are decided long before it.
2. The stiff truck asks for short steps only while it touches; released, it coasts.
3. A spring that relaxes against its damper faster than the steps can follow passes on the force of the damper, however
   stiff it is: F = c_v times the speed of crush, with an error of the order of the relaxation time c_v/k_v over that of
   the impact. So a softer spring stands for it, which relaxes within a step, and at least `DAMPED` times as fast as the
   damper slows the masses. A third of the step comes with a spring three times as stiff, so the estimated error covers
   the spring.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .after_step import (
    RUNNING,
    Decided,
    Kept,
    at_limit,
    decide,
    ending_of,
    enter_modes,
    initial_state,
    is_finite,
    keep_step,
    passed_maxima,
    passes,
)
from .control import (
    ACCEPTED,
    MOST_STEPS,
    RETRY,
    STEP_RATIO,
    Control,
    Rates,
    attempt_budget,
    first_length,
    first_step,
    rates_of,
    stable_step,
)
from .design import Constants, Design, Readings, constants_of, is_computable
from .dormand_prince import dense_output, step
from .dynamics import rate_of
from .error_estimates import error_time
from .events import NONE, SHORTEN, locate_limit
from .modes import change_mode, changes_counted, initial_modes, length_after
from .outcomes import Outcome, Status, compression_at, no_maxima, undefined_maxima
from .settling import NO_PROOF, boulder_energy
from .soil_laws import constants_in
from .time_history import Record, add_exchanged, nothing_exchanged, write_samples

FULL_TURN = math.pi
"""Rotation at which a simulation that does not stop at the limit ends [rad]: the boulder is upside down."""


@kernel
def failed(status: int) -> Outcome:
    """Outcome of a design that was not simulated, or not to its end."""
    return Outcome(status, undefined_maxima(), np.nan, np.nan, 0, np.nan, np.nan, 0.0)


class Problem(NamedTuple):
    """One impact to be simulated."""

    design: Design
    """The design, SI."""
    profile: Any
    """`SoilProfile` of its soil; None for the uniform soil of the design."""


@kernel
def simulate_design(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact in a uniform soil; see `simulate`."""
    return simulate(Problem(design, None), readings, control, record)


@kernel
def simulate(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact with a fixed time step, each step cut where a mode changes.

    Parameters
    ----------
    problem
        Design and soil. Kernels are compiled for each kind of soil.
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
    if not is_computable(c):
        return failed(Status.INVALID.value)
    theta_stop = control.theta_limit if control.stop_at_limit else FULL_TURN
    h, status = first_step(control, theta_stop, c)
    if status != ACCEPTED:
        return failed(status)
    outcome = simulate_by_steps(h, h, c, readings, control, theta_stop, record)
    while outcome.status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
        h *= RETRY
        outcome = simulate_by_steps(h, h, c, readings, control, theta_stop, record)
    return outcome


@inlined
def misses(design: Design) -> bool:
    """Whether the truck passes over the boulder."""
    return design.H - design.d <= design.e_bumper


@kernel
def simulate_by_steps(
    h_touching: float,
    h_apart: float,
    c: Constants,
    readings: Readings,
    control: Control,
    theta_stop: float,
    record: Record,
) -> Outcome:
    """Simulate one impact with given time steps [s] while the truck touches and while not; see `simulate`."""
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
    error = rotation_changes = 0.0
    while attempts < budget:
        attempts += 1
        h = min(h_next, horizon - t)
        y_end, k_end, step_error = step(y, k1, h, switches, c)
        passing, end = passes(y, y_end, k_end, factors, switches, c, 0.0)
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
            decided = decide(t, h, y, kept, barrier, horizon, ending, c)
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
        begun, t = t, decided.t
        if decided.status != RUNNING:
            if decided.status == Status.LIMIT.value:
                m = at_limit(m, t, theta_stop)
                t_limit = t if control.stop_at_limit else t_limit
            yield_located = control.locate_yield and control.elements == 0
            moved = error_time(h_full, yield_located) * error
            return Outcome(decided.status, m, t_limit, t, attempts, moved, kept.y.omega_b, rotation_changes)
        y, k1, start = kept.y, k_end, end
        if kept.event > NONE:
            rotation_changes += changes_counted(kept.event, begun, modes)
            y, modes = change_mode(int(kept.event), y, rate_of(y, switches, c).M, modes, c)
            switches, factors = enter_modes(
                modes, readings, theta_stop, control.locate_yield, control.event_tolerance, c
            )
            k1, start = rate_of(y, switches, c), compression_at(y, switches, c)
            h_full = h_touching if modes.touching else h_apart
            h_next = length_after(kept.event, h_full, y.omega_b, k1.alpha_b)
    return failed(Status.STEP_BUDGET.value)


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
def simulate_last_resort(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact; what cannot be decided within the steps allowed keeps the status it is refused with.

    Parameters
    ----------
    design
        The design, in uniform soil.
    readings, control, record
        As of `boulder_kernels.impact.simulate`; the record keeps nothing.
    """
    c = constants_of(design, readings, control.elements)
    if misses(design) or not is_computable(c):
        return simulate_design(design, readings, control, record)
    _, status = first_step(control, control.theta_limit, c)
    if status == ACCEPTED:
        return simulate_design(design, readings, control, record)
    factor = spring_to_follow(rates_of(control.theta_limit, c), control)
    c = constants_of(with_spring(design, factor), readings, control.elements)
    apart = constants_of(with_spring(design, NO_SPRING), readings, control.elements)
    ratio = STEP_RATIO if control.refined else 1.0
    h = min(control.h, RESOLVED * longest_step(control.theta_limit, c)) / ratio
    h_apart = min(control.h, longest_step(control.theta_limit, apart)) / ratio if readings.separation_released else h
    outcome = simulate_by_steps(h, h_apart, c, readings, control, control.theta_limit, record)
    return failed(status) if outcome.status == Status.STEP_BUDGET.value else outcome
