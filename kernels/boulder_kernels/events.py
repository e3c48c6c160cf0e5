"""The instants at which a mode changes: where in a step they lie.

A gap (`boulder_kernels.modes`) that is negative at the end of a step puts its event inside it; there the step is cut.
The gaps that end below zero, each scaled to end at -1, have a least one, which passes zero where the first event is. A
search narrows a bracket around that point. Nothing here branches, so that searches run side by side in lanes; the
caller repeats them, one evaluation of the gaps at a time.
"""

from __future__ import annotations

import math

from ._jit import inlined, kernel
from .design import Constants
from .dormand_prince import DenseOutput, Track, curvature_at, displacement_at, slope_at, state_at, turning_point
from .dynamics import (
    Switches,
    acceleration,
)
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
    gaps_at,
    needs_moment,
)
from .numerics import ITERATIONS, Bracket, narrowed, next_guess

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
def gaps_within(tau: float, dense: DenseOutput, g: GapFactors, switches: Switches, c: Constants) -> Gaps:
    """Gaps at the fraction tau of a step."""
    y = state_at(dense, tau)
    return gaps_at(y, acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c).M, g, c)


@inlined
def weight(end: float) -> float:
    """Factor that scales a gap to end at -1; 0 for one that does not end below zero."""
    return 1.0 / max(-end, 1e-250) if end < 0.0 else 0.0


@inlined
def lesser(least: float, event: float, gap: float, scale: float, other: float) -> tuple[float, float]:
    """Return the lesser of the least gap so far and another, with its event."""
    scaled = gap * scale if scale > 0.0 else NEVER
    closer = scaled < least
    return scaled if closer else least, other if closer else event


@inlined
def least_gap(gaps: Gaps, weights: Gaps) -> tuple[float, float]:
    """Least of the gaps that end below zero, scaled, and its event; NEVER and NONE where there is none."""
    least, event = lesser(NEVER, float(NONE), gaps.contact, weights.contact, float(CONTACT))
    least, event = lesser(least, event, gaps.rotation, weights.rotation, float(ROTATION))
    least, event = lesser(least, event, gaps.couple, weights.couple, float(COUPLE))
    least, event = lesser(least, event, gaps.corner, weights.corner, float(CORNER))
    least, event = lesser(least, event, gaps.arm, weights.arm, float(ARM))
    least, event = lesser(least, event, gaps.top, weights.top, float(YIELD_TOP))
    least, event = lesser(least, event, gaps.base, weights.base, float(YIELD_BASE))
    return lesser(least, event, gaps.limit, weights.limit, float(LIMIT))


@inlined
def landed(g: GapFactors) -> float:
    """Fraction of a step behind which a kink does no harm."""
    return 1.0 - HARMLESS * g.tolerance


@inlined
def lies_inside(early: float, late: float) -> bool:
    """Whether a kink is passed between AT_ONCE and `landed`, by its gaps at either: the step is then retried."""
    return (early > 0.0) & (late < 0.0)


@inlined
def weights_of(end: Gaps, dense: DenseOutput, g: GapFactors, locate_yield: bool, c: Constants) -> Gaps:
    """Factors that scale the gaps to end at -1; 0 for those whose event is not looked for in this step.

    Parameters
    ----------
    end
        Gaps at the end of the step.
    dense, g, c
        The step.
    locate_yield
        Whether a step is cut where the soil reaches its ultimate resistance.
    """
    top, base = 0.0, 0.0
    if locate_yield:
        early = gaps_at(state_at(dense, AT_ONCE), 0.0, g, c)
        late = gaps_at(state_at(dense, landed(g)), 0.0, g, c)
        top = weight(end.top) if lies_inside(early.top, late.top) else 0.0
        base = weight(end.base) if lies_inside(early.base, late.base) else 0.0
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
def tolerance_of(g: GapFactors) -> float:
    """Precision that the search for the first event needs; only as printed a gap depends on omega."""
    return EDGE_TOLERANCE if g.rotation_omega != 0.0 else g.tolerance


@inlined
def begin_search(start: Gaps, weights: Gaps, tolerance: float) -> tuple[Bracket, float, bool]:
    """Bracket of the first event, where to look first, and whether there is anything to look for.

    Parameters
    ----------
    start
        Gaps at the start of the step.
    weights, tolerance
        Factors of the gaps, and the precision asked for.
    """
    f_low, _ = least_gap(start, weights)
    b = Bracket(0.0, f_low, 1.0, -1.0, 0.0)
    tau = next_guess(b) if f_low > 0.0 else JUST_AFTER
    tau = 1.0 if tau > 1.0 - AT_END * tolerance else tau
    return b, tau, (f_low < NEVER) & (1.0 - tau > tolerance)


@inlined
def go_on_searching(b: Bracket, tau: float, f: float, tolerance: float) -> tuple[Bracket, float, bool]:
    """Narrow the bracket of the first event by the least gap f at tau.

    Returns
    -------
    b, tau, open
        The bracket, where to look next, and whether to look. A gap that starts at zero and opens only by rounding
        counts as crossed at once: the step still advances, and the next mode resolves it.
    """
    beginning = b.f_low <= 0.0
    n = narrowed(b, tau, f)
    b = Bracket(
        tau if beginning else n.low,
        f if beginning else n.f_low,
        b.high if beginning else n.high,
        b.f_high if beginning else n.f_high,
        0.0 if beginning else n.side,
    )
    guess = next_guess(b)
    early = tau >= JUST_AFTER
    following = guess if b.f_low > 0.0 else (JUST_AFTER * tau if early else tau)
    return b, following, (abs(guess - tau) > tolerance) if b.f_low > 0.0 else early


@inlined
def newton(
    tau: float, low: float, high: float, a_0: float, a_theta: float, a_omega: float, dense: DenseOutput
) -> float:
    """One step of Newton's method for a_0 + a_theta theta + a_omega omega = 0, within low ... high."""
    per_second = 1.0 / dense.h
    slope = slope_at(dense.rotation, tau)
    value = a_0 + a_theta * displacement_at(dense.rotation, tau) + a_omega * per_second * slope
    change = a_theta * slope + a_omega * per_second * curvature_at(dense.rotation, tau)
    return min(max(tau - (value / change if change != 0.0 else 0.0), low), high)


@inlined
def refined(event: float, tau: float, b: Bracket, g: GapFactors, dense: DenseOutput) -> float:
    """Fraction of a step at which the forces jump, or the limit is reached, by Newton's method on the rotation.

    Parameters
    ----------
    event, tau, b
        The event, where the search has put it, and its bracket.
    g, dense
        The step.
    """
    corner, limit = event == CORNER, event == LIMIT
    rotation = (event == ROTATION) & (not needs_moment(g))
    side = 1.0 if displacement_at(dense.rotation, tau) > 0.0 else -1.0
    a_0 = g.corner_0 if corner else (g.limit if limit else g.rotation_0)
    a_theta = g.corner_theta if corner else (-side if limit else g.rotation_theta)
    a_omega = g.rotation_omega if rotation else 0.0
    exact = newton(tau, b.low, b.high, a_0, a_theta, a_omega, dense)
    exact = newton(exact, b.low, b.high, a_0, a_theta, a_omega, dense)
    exact = newton(exact, b.low, b.high, a_0, a_theta, a_omega, dense)
    # A search that has closed on its start stays there.
    return exact if (corner | limit | rotation) & (b.f_low > 0.0) else tau


@inlined
def turns_beyond(tau: float, end: Gaps, dense: DenseOutput, g: GapFactors) -> bool:
    """Whether the rotation turns back beyond its limit before the fraction tau of a step, at whose end it is within."""
    top = turning_point(dense.rotation, 1.0)
    # As printed the event is the turning point itself, found with another rounding.
    return (abs(displacement_at(dense.rotation, top)) >= g.limit) & (end.limit >= 0.0) & (top < tau + 1e-9)


@inlined
def limit_before(dense: DenseOutput, g: GapFactors) -> float:
    """Fraction of a step at which a rotation that turns back beyond its limit reaches it."""
    top = turning_point(dense.rotation, 1.0)
    theta = displacement_at(dense.rotation, top)
    side = 1.0 if theta > 0.0 else -1.0
    beyond, bend = abs(theta) - g.limit, abs(curvature_at(dense.rotation, top))
    tau = max(top - math.sqrt(max(2.0 * beyond / bend if bend > 0.0 else 0.0, 0.0)), 0.0)
    tau = newton(tau, 0.0, top, g.limit, -side, 0.0, dense)
    tau = newton(tau, 0.0, top, g.limit, -side, 0.0, dense)
    return newton(tau, 0.0, top, g.limit, -side, 0.0, dense)


@inlined
def first_event(
    b: Bracket,
    tau: float,
    weights: Gaps,
    end: Gaps,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
) -> tuple[float, float]:
    """First event of a step, once its search has closed; a limit from which it turns back is for `turns_beyond`.

    Parameters
    ----------
    b, tau, weights
        The search.
    end
        Gaps at the end of the step.
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
    _, event = least_gap(gaps_within(tau, dense, g, switches, c), weights)
    tau = refined(event, tau, b, g, dense) if event >= 0.0 else 1.0
    kink = ((weights.top > 0.0) | (weights.base > 0.0)) & (tau > AT_ONCE) & (tau < landed(g))
    yields = (event < 0.0) & ((end.top < 0.0) | (end.base < 0.0))
    event = float(SHORTEN) if kink else (float(YIELD_TOP) if yields else event)
    return event, min((1.0 + BEYOND * g.tolerance) * tau, 1.0) if kink else tau


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
