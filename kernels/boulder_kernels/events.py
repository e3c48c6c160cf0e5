"""The instants at which a mode changes: where in a step they lie.

A gap (`boulder_kernels.modes`) that is negative at the end of a step puts its event inside it; there the step is cut.
The gaps that end below zero, each scaled to end at -1, have a least one, which passes zero where the first event is. A
search narrows a bracket around that point.
"""

from __future__ import annotations

import math

from ._jit import inlined, kernel
from .design import Constants
from .dormand_prince import DenseOutput, Track, curvature_at, displacement_at, slope_at, state_at, turning_point
from .dynamics import State, Switches, contact_displacement, rate_of, spring_compression
from .modes import (
    ARM,
    AT_END,
    CONTACT,
    CORNER,
    COUPLE,
    LIMIT,
    NEVER,
    ROTATION,
    YIELD_BASE,
    YIELD_TOP,
    GapFactors,
    Gaps,
    contact_gap,
    gaps_at,
    needs_moment,
)
from .numerics import ITERATIONS, Bracket, narrowed, next_guess, sine_versine

NONE = -1
"""In place of an event: there is none."""
SHORTEN = -2
"""In place of an event: retry the step with a shorter length."""
EDGE_TOLERANCE = 1e-5
"""Precision of the search as a fraction of the step as printed, where several events lie close together and a motion
may graze one of them."""
NEWTON_TOLERANCE = 1e-6
"""Last correction of a root by Newton's method, as a fraction of the step: its square is what is left."""
JUST_AFTER = 1e-3
"""Fraction of the step, and then its square, at which a search begins whose gap is not positive at the start."""
AT_ONCE = 1e-5
"""Fraction of a step before which a kink counts as passed."""
HARMLESS = 10.0
"""A kink that lies before the end of the step by less than so many times the precision does no harm."""
BEYOND = 2.0
"""A retried step ends so many times the precision behind the kink, so that the kink lies in it and not in the next."""


@inlined
def weight(end: float) -> float:
    """Factor that scales a gap to end at -1; 0 for one that does not end below zero."""
    return 1.0 / max(-end, 1e-250) if end < 0.0 else 0.0


@inlined
def lesser(least: float, event: int, gap: float, scale: float, other: int) -> tuple[float, int]:
    """Return the lesser of the least gap so far and another, with its event."""
    scaled = gap * scale if scale > 0.0 else NEVER
    return (scaled, other) if scaled < least else (least, event)


@inlined
def least_gap(gaps: Gaps, weights: Gaps) -> tuple[float, int]:
    """Least of the gaps that end below zero, scaled, and its event; NEVER and NONE where there is none."""
    least, event = lesser(NEVER, NONE, gaps.contact, weights.contact, CONTACT)
    least, event = lesser(least, event, gaps.rotation, weights.rotation, ROTATION)
    least, event = lesser(least, event, gaps.couple, weights.couple, COUPLE)
    least, event = lesser(least, event, gaps.corner, weights.corner, CORNER)
    least, event = lesser(least, event, gaps.arm, weights.arm, ARM)
    least, event = lesser(least, event, gaps.top, weights.top, YIELD_TOP)
    least, event = lesser(least, event, gaps.base, weights.base, YIELD_BASE)
    return lesser(least, event, gaps.limit, weights.limit, LIMIT)


@inlined
def least_within(
    tau: float, weights: Gaps, dense: DenseOutput, g: GapFactors, switches: Switches, c: Constants
) -> tuple[float, int]:
    """Least of the gaps that are looked for at the fraction tau of a step, scaled, and its event."""
    forces = (weights.rotation > 0.0 and needs_moment(g)) or weights.couple > 0.0
    if forces or weights.arm > 0.0 or weights.top > 0.0 or weights.base > 0.0:
        y = state_at(dense, tau)
        return least_gap(gaps_at(y, rate_of(y, switches, c).M if forces else 0.0, g, c), weights)
    least, event = NEVER, NONE
    theta_b = displacement_at(dense.rotation, tau)
    if weights.contact > 0.0:
        sin, versin = sine_versine(theta_b)
        x_c = contact_displacement(displacement_at(dense.boulder, tau), sin, versin, c)
        x_v, v_v = displacement_at(dense.truck, tau), slope_at(dense.truck, tau) / dense.h
        gap = contact_gap(spring_compression(x_v, v_v, x_c, c), g, c)
        least, event = lesser(least, event, gap, weights.contact, CONTACT)
    if weights.rotation > 0.0 or weights.corner > 0.0:
        omega_b = slope_at(dense.rotation, tau) / dense.h
        turned = g.rotation_0 + g.rotation_theta * theta_b + g.rotation_omega * omega_b
        least, event = lesser(least, event, turned, weights.rotation, ROTATION)
        least, event = lesser(least, event, g.corner_0 + g.corner_theta * theta_b, weights.corner, CORNER)
    return lesser(least, event, g.limit - abs(theta_b), weights.limit, LIMIT)


@inlined
def landed(g: GapFactors) -> float:
    """Fraction of a step behind which a kink does no harm."""
    return 1.0 - HARMLESS * g.tolerance


@inlined
def weights_of(end: Gaps, dense: DenseOutput, g: GapFactors, c: Constants) -> Gaps:
    """Factors that scale the gaps to end at -1; 0 for those whose event is not looked for in this step.

    A step is retried that passes a kink between AT_ONCE and `landed`; one passed outside is not looked for.

    Parameters
    ----------
    end
        Gaps at the end of the step.
    dense, g, c
        The step.
    """
    top, base = 0.0, 0.0
    if end.top < 0.0 or end.base < 0.0:
        early = gaps_at(state_at(dense, AT_ONCE), 0.0, g, c)
        late = gaps_at(state_at(dense, landed(g)), 0.0, g, c)
        top = weight(end.top) if early.top > 0.0 > late.top else 0.0
        base = weight(end.base) if early.base > 0.0 > late.base else 0.0
    return Gaps(
        weight(end.contact),
        weight(end.rotation),
        weight(end.couple),
        weight(end.corner),
        weight(end.arm),
        top,
        base,
        weight(end.limit),
    )


@inlined
def newton(
    tau: float, low: float, high: float, a_0: float, a_theta: float, a_omega: float, dense: DenseOutput
) -> float:
    """Three steps of Newton's method for a_0 + a_theta theta + a_omega omega = 0, within low ... high."""
    per_second = 1.0 / dense.h
    for _ in range(3):
        slope = slope_at(dense.rotation, tau)
        value = a_0 + a_theta * displacement_at(dense.rotation, tau) + a_omega * per_second * slope
        change = a_theta * slope + a_omega * per_second * curvature_at(dense.rotation, tau)
        tau = min(max(tau - (value / change if change != 0.0 else 0.0), low), high)
    return tau


@inlined
def refined(event: int, tau: float, b: Bracket, g: GapFactors, dense: DenseOutput) -> float:
    """Fraction of a step at which the forces jump, or the limit is reached, by Newton's method on the rotation.

    Parameters
    ----------
    event, tau, b
        The event, where the search has put it, and its bracket.
    g, dense
        The step.
    """
    if b.f_low <= 0.0:
        return tau  # a search that has closed on its start stays there
    if event == CORNER:
        return newton(tau, b.low, b.high, g.corner_0, g.corner_theta, 0.0, dense)
    if event == LIMIT:
        side = 1.0 if displacement_at(dense.rotation, tau) > 0.0 else -1.0
        return newton(tau, b.low, b.high, g.limit, -side, 0.0, dense)
    if event == ROTATION and not needs_moment(g):
        return newton(tau, b.low, b.high, g.rotation_0, g.rotation_theta, g.rotation_omega, dense)
    return tau


@inlined
def number_of(weights: Gaps) -> int:
    """How many events are looked for."""
    number = 0
    for scale in weights:
        number += 1 if scale > 0.0 else 0
    return number


@inlined
def sought(
    start: Gaps, weights: Gaps, dense: DenseOutput, g: GapFactors, switches: Switches, c: Constants
) -> tuple[int, float]:
    """First event of a step among those with a weight, and the fraction of the step at which it happens.

    Notes
    -----
    The search narrows a bracket around the point at which the least gap passes zero. A gap that starts at zero and
    opens only by rounding counts as crossed at once: the step still advances, and the next mode resolves it.
    """
    f_low, event = least_gap(start, weights)
    tolerance = EDGE_TOLERANCE if g.rotation_omega != 0.0 else g.tolerance  # only as printed a gap depends on omega
    b = Bracket(0.0, f_low, 1.0, -1.0, 0.0)
    tau = next_guess(b) if f_low > 0.0 else JUST_AFTER
    tau = 1.0 if tau > 1.0 - AT_END * tolerance else tau
    searching = 1.0 - tau > tolerance
    for _ in range(ITERATIONS):
        if not searching:
            break
        f, _ = least_within(tau, weights, dense, g, switches, c)
        b = narrowed(b, tau, f) if b.f_low > 0.0 else Bracket(tau, f, b.high, b.f_high, 0.0)
        if b.f_low > 0.0:
            following = next_guess(b)
            searching = abs(following - tau) > tolerance
        else:
            searching = tau >= JUST_AFTER
            following = JUST_AFTER * tau if searching else tau
        tau = following
    if number_of(weights) > 1:
        _, event = least_within(tau, weights, dense, g, switches, c)
    return event, refined(event, tau, b, g, dense)


@inlined
def first_event(
    y: State, M: float, end: Gaps, dense: DenseOutput, g: GapFactors, switches: Switches, c: Constants
) -> tuple[int, float]:
    """First event of a step.

    Parameters
    ----------
    y, M
        State and net moment [N m] at the start of the step.
    end
        Gaps at its end.
    dense, g, switches, c
        The step.

    Returns
    -------
    event, tau
        The event and the fraction of the step at which it happens; NONE and 1.0 where there is none. Where the event is
        SHORTEN, nothing is kept of the step, and it is retried with the fraction tau of its length.

    Notes
    -----
    The modes are frozen in the right-hand side, but the ultimate resistance of the soil is not: a step that ran across
    its kink gains nothing from locating it. So the step is retried, to end just behind the kink.
    """
    weights = weights_of(end, dense, g, c)
    event, tau = NONE, 1.0
    if number_of(weights) > 0:
        event, tau = sought(gaps_at(y, M, g, c), weights, dense, g, switches, c)
        if (weights.top > 0.0 or weights.base > 0.0) and AT_ONCE < tau < landed(g):
            return SHORTEN, min((1.0 + BEYOND * g.tolerance) * tau, 1.0)
    elif end.top < 0.0 or end.base < 0.0:
        event = YIELD_TOP
    if end.limit >= 0.0 and dense.rotation.x1 * slope_at(dense.rotation, 1.0) < 0.0:
        top = turning_point(dense.rotation, 1.0)
        # As printed the event is the turning point itself, found with another rounding.
        if abs(displacement_at(dense.rotation, top)) >= g.limit and top < tau + 1e-9:
            return LIMIT, limit_before(top, dense, g)
    return event, tau


@inlined
def limit_before(top: float, dense: DenseOutput, g: GapFactors) -> float:
    """Fraction of a step at which a rotation reaches its limit that turns back beyond it, at the fraction top."""
    theta = displacement_at(dense.rotation, top)
    side = 1.0 if theta > 0.0 else -1.0
    beyond, bend = abs(theta) - g.limit, abs(curvature_at(dense.rotation, top))
    tau = max(top - math.sqrt(max(2.0 * beyond / bend if bend > 0.0 else 0.0, 0.0)), 0.0)
    return newton(tau, 0.0, top, g.limit, -side, 0.0, dense)


@kernel
def locate_limit(gap_start: float, gap_end: float, rotation: Track, limit: float, tau_end: float) -> float:
    """Fraction of a step at which the rotation reaches a limit that does not end the simulation.

    Parameters
    ----------
    gap_start, gap_end
        Gaps at the start of the step, positive, and at tau_end, not positive [rad].
    rotation
        The rotation within the step.
    limit
        Limit of rotation [rad].
    tau_end
        Fraction of the step before which it is reached.
    """
    low, high = 0.0, tau_end
    tau = tau_end * gap_start / (gap_start - gap_end)
    for _ in range(ITERATIONS):
        theta = displacement_at(rotation, tau)
        gap = limit - abs(theta)
        if gap > 0.0:
            low = tau
        else:
            high = tau
        before = tau
        tau = before + gap / (slope_at(rotation, before) if theta > 0.0 else -slope_at(rotation, before))
        if not low <= tau <= high:
            tau = 0.5 * (low + high)
        if abs(tau - before) <= NEWTON_TOLERANCE:
            break
    return tau
