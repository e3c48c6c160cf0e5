"""One impact from the first touch to its end: the reference that every faster path is held against.

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

from typing import Any, NamedTuple

from ._jit import inlined, kernel
from .control import (
    ACCEPTED,
    MOST_STEPS,
    RETRY,
    STEP_RATIO,
    Control,
    Rates,
    first_step,
    rates_of,
    stable_step,
)
from .design import Constants, Design, Readings, constants_of, is_computable
from .dormand_prince import step
from .following import (
    RUNNING,
    begin_to_turn,
    failed,
    first_touch,
    follow,
    go_on,
    nothing_watched,
    outcome_of,
    stop_of,
    watch,
)
from .outcomes import Outcome, Status
from .soil_laws import constants_in
from .time_history import Record


class Problem(NamedTuple):
    """One impact to be simulated."""

    design: Design
    """The design in SI units."""
    profile: Any
    """`SoilProfile` of its soil; None for the uniform soil of the design."""


@kernel
def simulate_uniform(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact in a uniform soil; see `simulate_alone`."""
    return simulate_alone(Problem(design, None), readings, control, record)


@kernel
def simulate_alone(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
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
    h, status = first_step(control, stop_of(control), c)
    if status != ACCEPTED:
        return failed(status)
    outcome = simulate_by_steps(h, h, c, readings, control, record)
    while outcome.status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
        h *= RETRY
        outcome = simulate_by_steps(h, h, c, readings, control, record)
    return outcome


@inlined
def misses(design: Design) -> bool:
    """Whether the truck passes over the boulder."""
    return design.H - design.d <= design.e_bumper


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
def simulate_last_resort(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact; what cannot be decided within the steps allowed keeps the status it is refused with.

    Parameters
    ----------
    design
        The design, in uniform soil.
    readings, control, record
        The same as in `simulate_alone`; the record keeps nothing.
    """
    c = constants_of(design, readings, control.elements)
    if misses(design) or not is_computable(c):
        return simulate_uniform(design, readings, control, record)
    _, status = first_step(control, control.theta_limit, c)
    if status == ACCEPTED:
        return simulate_uniform(design, readings, control, record)
    factor = spring_to_follow(rates_of(control.theta_limit, c), control)
    c = constants_of(with_spring(design, factor), readings, control.elements)
    apart = constants_of(with_spring(design, NO_SPRING), readings, control.elements)
    ratio = STEP_RATIO if control.refined else 1.0
    h = min(control.h, RESOLVED * longest_step(control.theta_limit, c)) / ratio
    h_apart = min(control.h, longest_step(control.theta_limit, apart)) / ratio if readings.separation_released else h
    outcome = simulate_by_steps(h, h_apart, c, readings, control, record)
    return failed(status) if outcome.status == Status.STEP_BUDGET.value else outcome
