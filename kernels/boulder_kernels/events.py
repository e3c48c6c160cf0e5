"""Changes of the modes of a motion: how far it is from each of them, where in a step they lie, and what follows.

Each event has a gap, positive as long as the present mode holds. A gap that is negative at the end of a step puts
the event inside it; there the step is cut. Every gap is a sum of a few quantities of the state with factors that depend
on the mode only, so that a loop over lanes in different modes needs no branch.

The gaps that end below zero, each scaled to end at -1, have a least one, which passes zero where the first event is. A
search narrows a bracket around that point.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ._jit import inlined, kernel
from .design import Constants, Readings
from .dormand_prince import DenseOutput, curvature_at, displacement_at, newton, slope_at, state_at, turning_point
from .dynamics import (
    FREE,
    HELD,
    LAST_OF_GRAVITY,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_BACK,
    TURNING_FORWARD,
    Modes,
    State,
    Switches,
    acceleration,
    contact_displacement,
    holding_moment,
    signed_arm,
    spring_compression,
)
from .numerics import ITERATIONS, Bracket, narrowed, next_guess, sine_versine
from .soil import soil_kinematics

CONTACT = 0
"""Truck and boulder separate, or touch again."""
ROTATION = 1
"""The boulder leaves or finds its base, or (printed reading) turns back."""
COUPLE = 2
"""Printed reading: the net moment passes the limit of the restoring moment."""
CORNER = 3
"""Printed reading: the corner passes under the centre of mass, sin(gamma_N + theta_b) changes its sign."""
ARM = 4
"""Printed reading: the corner passes beside the centre of mass, cos(gamma_N + theta_b) changes its sign."""
YIELD_TOP = 5
"""The soil at the soil line reaches its ultimate resistance, or falls below it."""
YIELD_BASE = 6
"""The soil at the foot of the boulder reaches its ultimate resistance, or falls below it."""
LIMIT = 7
"""The rotation reaches the limit."""

NEVER = 1e300
"""Gap of an event that cannot happen in the present mode."""
UNSOUGHT = 2.0
"""In place of the sign of a displacement beyond the ultimate resistance, where its event is not looked for."""
TOLERANCE = 1e-3
"""Precision with which an event is located, as a fraction of the step. Forces are continuous at a kink, so the error
goes with its square; where they jump, Newton's method follows."""
AT_END = 0.3
"""An event that lies before the end of the step by less than this share of the precision is taken to be at the end."""
CONTACT_ROUNDING = 1e-15
"""Compressions below this share of the distance the truck would cover in a second are rounding, which would make a
truck and a boulder that move together separate and touch again and again."""


class GapFactors(NamedTuple):
    """What the gaps of a mode are made of; all of them are constant while the mode lasts."""

    contact: float
    """Factor of the compression u: 1 where the truck touches, -1 where it has come off."""
    rotation_0: float
    rotation_abs_M: float
    """Factor of the modulus of the net moment M."""
    rotation_theta: float
    rotation_omega: float
    couple_M: float
    """Factor of the net moment M."""
    couple_abs_M: float
    couple_limit: float
    """Factor of the limit of the restoring moment; 0 where the event cannot happen."""
    corner_0: float
    corner_theta: float
    arm: float
    """Factor of the signed arm of the weight; 0 where the event cannot happen."""
    top: float
    """Factor of the displacement at the soil line: 1 or -1 beyond the ultimate resistance, 0 below, or UNSOUGHT."""
    base: float
    """Factor of the displacement at the foot: 1 or -1 beyond the ultimate resistance, 0 below, or UNSOUGHT."""
    limit: float
    """Limit of rotation [rad]."""
    tolerance: float
    """Precision with which events are located, as a fraction of the step."""


class Gaps(NamedTuple):
    """Distance of the state from each event, positive while the mode holds; indexed by the constants above."""

    contact: float
    rotation: float
    couple: float
    corner: float
    arm: float
    top: float
    base: float
    limit: float


@inlined
def gap_factors(modes: Modes, c: Constants, theta_stop: float, locate_yield: bool, tolerance: float) -> GapFactors:
    """Factors of the gaps in the present modes.

    ``modes``: the present modes; ``theta_stop``: rotation at which the simulation ends [rad]; ``locate_yield``: whether
    a step is cut where the soil at the top or the base reaches its ultimate resistance; ``tolerance``: precision with
    which events are located, as a fraction of the step; as printed it is `TOLERANCE`.
    """
    rotation_0 = rotation_abs_M = rotation_theta = rotation_omega = 0.0
    couple_M = couple_abs_M = couple_limit = arm = 0.0
    corner_0, corner_theta = NEVER, 0.0
    contact = 1.0 if modes.touching else -1.0
    turning = modes.turning
    if turning == SEATED:
        rotation_0, rotation_abs_M = c.C_cos, -1.0
    elif turning == TURNING_FORWARD:
        rotation_theta = 1.0
    elif turning == TURNING_BACK:
        rotation_theta = -1.0
    else:
        tolerance = TOLERANCE
        corner_0, corner_theta = modes.corner * c.theta_corner, -modes.corner
        if turning == FREE:
            rotation_omega = -1.0
        else:
            rotation_omega = 1.0
            arm, couple_limit = modes.arm, -1.0
            if turning == HELD:
                couple_abs_M, couple_limit = -1.0, 1.0
            elif turning == LIMITED_FORWARD:
                couple_M = 1.0
            else:
                couple_M = -1.0
    top = float(modes.yielded_top) if locate_yield else UNSOUGHT
    base = float(modes.yielded_base) if locate_yield else UNSOUGHT
    return GapFactors(
        contact, rotation_0, rotation_abs_M, rotation_theta, rotation_omega, couple_M, couple_abs_M, couple_limit,
        corner_0, corner_theta, arm, top, base, theta_stop, tolerance,
    )  # fmt: skip


@inlined
def yield_gap(displacement: float, sign: float, c: Constants) -> float:
    """Gap of the soil's ultimate resistance where it is displaced [m]; `GapFactors` gives the sign."""
    gap = c.x_yield - abs(displacement) if sign == 0.0 else sign * displacement - c.x_yield
    return NEVER if sign == UNSOUGHT else gap


@inlined
def contact_gap(u: float, g: GapFactors, c: Constants) -> float:
    """Gap of the contact at a compression of the vehicle's spring [m]."""
    return CONTACT_ROUNDING * c.v_0 * (1.0 + c.tau_v) + g.contact * u


@inlined
def gaps_of(y: State, M: float, u: float, sin: float, versin: float, g: GapFactors, c: Constants) -> Gaps:
    """Gaps of all events.

    ``M``: net moment of soil and truck [N m]; ``u``: compression of the vehicle's spring [m]; ``sin, versin``:
    sin(theta_b) and 1 - cos(theta_b); ``g, c``: factors of the present modes, and constants of the design.
    """
    k, arm = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), signed_arm(sin, versin, c)
    couple = g.couple_M * M + g.couple_abs_M * abs(M) + g.couple_limit * abs(arm)
    return Gaps(
        contact_gap(u, g, c),
        g.rotation_0 + g.rotation_abs_M * abs(M) + g.rotation_theta * y.theta_b + g.rotation_omega * y.omega_b,
        couple if g.couple_limit != 0.0 else NEVER,
        g.corner_0 + g.corner_theta * y.theta_b,
        g.arm * arm if g.arm != 0.0 else NEVER,
        yield_gap(k.A, g.top, c),
        yield_gap(k.A - k.slope_x, g.base, c),
        g.limit - abs(y.theta_b),
    )


@inlined
def gaps_at(y: State, M: float, g: GapFactors, c: Constants) -> Gaps:
    """Gaps of all events at a state with net moment M [N m]."""
    sin, versin = sine_versine(y.theta_b)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    return gaps_of(y, M, u, sin, versin, g, c)


SEATING_ANGLE = 1e-9
"""A boulder that would swing through less than this [rad] about its base is taken to have come to rest."""


@kernel
def mode_at_rest(M: float, corner: float, sin: float, versin: float, c: Constants) -> int:
    """Printed reading: mode of a boulder whose angular velocity has come to zero (Eqs 37-39).

    ``M``: net moment of soil and truck [N m]; ``corner``: sign of sin(gamma_N + theta_b); ``sin, versin``: sin(theta_b)
    and 1 - cos(theta_b).

    At omega = 0 the printed moment jumps, and the equations have no solution in the classical sense while the net
    moment is within the limit. Integrated literally, the boulder arrives at an omega just over zero, where Eq 39
    cancels every other moment up to the limit of Eq 37, whichever way it points. So it stays until the net moment is
    over the limit, forwards or back. Where the corner has passed under the centre of mass, Eq 39 drives the boulder on
    instead of holding it: it moves the way the net moment points.
    """
    limit = holding_moment(sin, versin, c)
    if limit < M:
        return LIMITED_FORWARD
    if -limit > M or (corner < 0.0 and M < 0.0):
        return FREE
    return HELD


@kernel
def initial_modes(readings: Readings, c: Constants) -> Modes:
    """Modes at the instant of impact.

    The truck touches and the boulder is seated. Under the printed rule the first moment decides: a blow over the
    centre of mass turns the boulder forward, and Eq 39 holds it; one below turns it back, and Eq 38 lets it go.
    """
    if readings.restoring_gravity:
        turning = SEATED
    else:
        turning = HELD if c.h >= 0.0 else FREE
    return Modes(turning, True, 1.0, 1.0, 0, 0)


@inlined
def yield_mode(displacement: float, c: Constants) -> int:
    """Mode of the soil at a displacement [m]: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""
    if abs(displacement) <= c.x_yield:
        return 0
    return 1 if displacement > 0.0 else -1


@inlined
def changes_counted(event: float, begun: float, modes: Modes) -> float:
    """Return 1.0 if an event changes how a boulder rocks, else 0.0.

    ``event``: the event a step was cut at; ``begun``: start of the step [s]. That a boulder begins to turn in the first
    step does not count; ``modes``: modes before; modes of printed readings do not count.
    """
    return 1.0 if event == ROTATION and begun > 0.0 and modes.turning <= LAST_OF_GRAVITY else 0.0


@inlined
def change_mode(event: int, y: State, M: float, modes: Modes, c: Constants) -> tuple[State, Modes]:
    """Cross an event: the modes that follow, and the state with its crossing made exact.

    ``event``: which event was reached; ``y``: state there; ``M``: net moment of soil and truck there [N m]; asked for
    by the events ROTATION and COUPLE only; ``modes``: modes before.
    """
    turning, touching = modes.turning, modes.touching
    corner, arm = modes.corner, modes.arm
    top, base = modes.yielded_top, modes.yielded_base
    theta_b, omega_b = y.theta_b, y.omega_b
    sin, versin = sine_versine(theta_b)
    if event == CONTACT:
        touching = not touching
    elif event == ROTATION:
        if turning == SEATED:
            turning = TURNING_FORWARD if M > 0.0 else TURNING_BACK
        elif turning == TURNING_FORWARD or turning == TURNING_BACK:
            theta_b = 0.0
            if 0.5 * c.J_eff * omega_b * omega_b < (c.C_cos - abs(M)) * SEATING_ANGLE:
                turning, omega_b = SEATED, 0.0
            else:
                turning = TURNING_FORWARD if omega_b > 0.0 else TURNING_BACK
        else:
            omega_b = 0.0
            turning = mode_at_rest(M, corner, sin, versin, c)
    elif event == COUPLE:
        if turning == HELD:
            # Pushed back from rest it does not brake, it turns back: Eq 38 lets it go.
            turning = LIMITED_FORWARD if M > 0.0 else LIMITED_BACK if omega_b > 0.0 else FREE
        else:
            turning = HELD
    elif event == CORNER:
        corner = -corner
    elif event == ARM:
        arm = -arm
    elif event == YIELD_TOP or event == YIELD_BASE:
        # Both, since all of the soil yields at once under a boulder that has not turned.
        k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
        top, base = yield_mode(k.A, c), yield_mode(k.A - k.slope_x, c)
    return State(y.x_b, y.v_b, theta_b, omega_b, y.x_v, y.v_v), Modes(turning, touching, corner, arm, top, base)


RETURNS_WITHIN = 1.5
"""The step after a boulder has passed its base is at most so many times as long as it takes to return to it."""


@inlined
def length_after(event: float, h: float, omega_b: float, alpha_b: float) -> float:
    """Length of the step that follows an event [s].

    ``event``: the event; ``h``: length of the steps [s]; ``omega_b, alpha_b``: angular velocity [rad/s] and
    acceleration [rad/s^2] in the modes that follow.

    A boulder that has passed its base returns to it after 2 |omega/alpha|. Where the net moment nearly balances the
    weight on one side, the swing to the other side lasts less than a hundredth of a step. As a part of a whole step it
    would be smaller than the precision of the search for its end, and the energy of the boulder would be lost there.
    """
    returns = (event == ROTATION) & (omega_b * alpha_b < 0.0)
    return min(h, -2.0 * RETURNS_WITHIN * omega_b / alpha_b) if returns else h


@inlined
def needs_moment(g: GapFactors) -> bool:
    """Whether the gap of the event ROTATION depends on the net moment."""
    return g.rotation_abs_M != 0.0


NONE = -1
"""In place of an event: there is none."""
SHORTEN = -2
"""In place of an event: retry the step with a shorter length."""
EDGE_TOLERANCE = 1e-5
"""Precision of the search as a fraction of the step as printed, where several events lie close together and a motion
may graze one of them."""
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
    least, event = NEVER, NONE
    for other in range(len(gaps)):
        least, event = lesser(least, event, gaps[other], weights[other], other)
    return least, event


@inlined
def least_within(
    tau: float, weights: Gaps, dense: DenseOutput, g: GapFactors, switches: Switches, c: Constants
) -> tuple[float, int]:
    """Least of the gaps that are looked for at the fraction tau of a step, scaled, and its event."""
    forces = (weights.rotation > 0.0 and needs_moment(g)) or weights.couple > 0.0
    if forces or weights.arm > 0.0 or weights.top > 0.0 or weights.base > 0.0:
        y = state_at(dense, tau)
        return least_gap(gaps_at(y, acceleration(y, switches, c).M if forces else 0.0, g, c), weights)
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

    ``end``: gaps at the end of the step.
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
def refined(event: int, tau: float, b: Bracket, g: GapFactors, dense: DenseOutput) -> float:
    """Fraction of a step at which the forces jump, or the limit is reached, by Newton's method on the rotation.

    ``event, tau, b``: the event, where the search has put it, and its bracket.
    """
    if b.f_low <= 0.0:
        return tau  # a search that has closed on its start stays there
    if event == CORNER:
        return newton(dense.rotation, tau, b.low, b.high, g.corner_0, g.corner_theta, 0.0)
    if event == LIMIT:
        side = 1.0 if displacement_at(dense.rotation, tau) > 0.0 else -1.0
        return newton(dense.rotation, tau, b.low, b.high, g.limit, -side, 0.0)
    if event == ROTATION and not needs_moment(g):
        per_tau = g.rotation_omega * (1.0 / dense.h)
        return newton(dense.rotation, tau, b.low, b.high, g.rotation_0, g.rotation_theta, per_tau)
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

    ``y, M``: state and net moment [N m] at the start of the step; ``end``: gaps at its end.

    Returns ``event, tau``: the event and the fraction of the step at which it happens; NONE and 1.0 where there is
    none. Where the event is SHORTEN, nothing is kept of the step, and it is retried with the fraction tau of its
    length.

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
    return newton(dense.rotation, tau, 0.0, top, g.limit, -side, 0.0)
