"""Designs that need more steps than are allowed, simulated all the same: as long as a stated number of steps lasts.

Three things make such designs affordable.

1. They are given a number of steps (`MOST_STEPS`), not a number up to the horizon: many are decided long before it.
2. The stiff truck asks for short steps only while it touches; released, it coasts.
3. A spring that relaxes against its damper faster than the steps can follow passes on the force of the damper, however
   stiff it is: F = c_v times the speed of crush, with an error of the order of the relaxation time c_v/k_v over that of
   the impact. So a softer spring stands for it, which relaxes within a step, and at least `DAMPED` times as fast as the
   damper slows the masses. A third of the step comes with a spring three times as stiff, so the estimated error covers
   the spring.
"""

from __future__ import annotations

from ._jit import kernel
from .design import Constants, Readings, constants_of, is_computable
from .impact import (
    STEP_RATIO,
    Control,
    Outcome,
    Problem,
    Record,
    failed,
    first_step,
    misses,
    simulate,
    simulate_by_steps,
)
from .outcomes import Status
from .second_spring import is_second_spring, stiffest, times, with_spring
from .stability import ACCEPTED, Rates, rates_of, stable_step

DAMPED = 16.0
"""Least rate of relaxation over that at which the damper slows the masses, of the spring that stands for a stiffer
one."""
RESOLVED = 0.5
"""Step while the truck touches, over the longest that is stable: a short blow is to be followed, not only survived."""
NO_SPRING = 1e-12
"""Factor on a spring that leaves nothing of its rates."""


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
def simulate_last_resort(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact; what cannot be decided within the steps allowed keeps the status it is refused with.

    Of two springs each is made softer only as far as it is too stiff to follow.

    Parameters
    ----------
    problem
        Design and vehicle; the soil is the uniform elastic soil of the design.
    readings, control, record
        As of `boulder_kernels.impact.simulate`; the record keeps nothing.
    """
    design, second = problem.design, problem.second
    c = constants_of(design, readings, control.elements)
    if misses(design) or not is_computable(c) or not is_second_spring(c, second):
        return simulate(problem, readings, control, record)
    _, status = first_step(control, control.theta_limit, stiffest(c, second))
    if status == ACCEPTED:
        return simulate(problem, readings, control, record)
    c = stiffest(c, second)
    factor = spring_to_follow(rates_of(control.theta_limit, c), control)
    softer = times(second, factor)
    c = constants_of(with_spring(design, min(1.0, factor * (c.k_v / design.k_v))), readings, control.elements)
    apart = constants_of(with_spring(design, NO_SPRING), readings, control.elements)
    ratio = STEP_RATIO if control.refined else 1.0
    h = min(control.h, RESOLVED * longest_step(control.theta_limit, stiffest(c, softer))) / ratio
    h_apart = min(control.h, longest_step(control.theta_limit, apart)) / ratio if readings.separation_released else h
    found = simulate_by_steps(h, h_apart, c, readings, control, control.theta_limit, record, softer)
    return failed(status) if found.status == Status.STEP_BUDGET.value else found
