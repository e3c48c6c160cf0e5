"""The instants at which a mode changes: where in a step they lie.

A gap (`boulder_kernels.gaps`) that is negative at the end of a step puts its event inside it; there the step is cut.
"""

from __future__ import annotations

from ._jit import inlined, kernel
from .dense_output import DenseOutput, Track, displacement_at, slope_at, state_at
from .design import Constants
from .dynamics import acceleration
from .gaps import CONTACT, CORNER, COUPLE, EVENTS, LIMIT, ROTATION, YIELD_BASE, YIELD_TOP, GapFactors, Gaps, gaps_at
from .modes import Switches
from .roots import ITERATIONS, Bracket, narrowed, next_guess
from .trigonometry import sine_versine
from .vehicle import contact_displacement, spring_compression

JUMP_TOLERANCE = 1e-11
"""Precision of a located jump of the forces, or of the limit, as a fraction of the step."""
NEWTON_TOLERANCE = 1e-6
"""Last correction of a root by Newton's method, as a fraction of the step: its square is what is left."""
KINK_TOLERANCE = 1e-3
"""The same for a kink: forces are continuous there, so the error goes with its square."""


@inlined
def needs_moment(g: GapFactors) -> bool:
    """Whether the gap of the event ROTATION depends on the net moment."""
    return g.rotation_abs_M != 0.0


@inlined
def gap_within(
    event: int,
    tau: float,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
) -> float:
    """Gap of one event but LIMIT at the fraction tau of a step."""
    y = state_at(dense, tau)
    if event == CONTACT:
        sin, versin = sine_versine(y.theta_b)
        u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
        return g.contact_0 + g.contact * u
    M = 0.0
    if event == COUPLE or (event == ROTATION and needs_moment(g)):
        M = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches, c).M
    return gaps_at(y, M, g, c)[event]


@kernel
def locate(
    event: int,
    gap_start: float,
    gap_end: float,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
) -> float:
    """Fraction of a step at which a gap that is negative at its end passes zero.

    Parameters
    ----------
    event
        Which gap, but for LIMIT: see `locate_limit`.
    gap_start, gap_end
        Its values at the start of the step and at the end, where it is negative.
    dense, g, switches, c
        The step.

    Returns
    -------
    float
        tau in (0, 1]. A gap that starts at zero and opens only by rounding counts as crossed at once: the step still
        advances, and the next mode resolves it.
    """
    low, gap_low = 0.0, gap_start
    if gap_low <= 0.0:
        for start in (1e-3, 1e-6):
            low = start
            gap_low = gap_within(event, low, dense, g, switches, c)
            if gap_low > 0.0:
                break
        if gap_low <= 0.0:
            return low
    exact = event == CORNER or (event == ROTATION and not needs_moment(g))
    tolerance = JUMP_TOLERANCE if exact else KINK_TOLERANCE
    bracket = Bracket(low, gap_low, 1.0, gap_end, 0)
    tau = 1.0
    for _ in range(ITERATIONS):
        before = tau
        tau = next_guess(bracket)
        if abs(tau - before) <= tolerance:
            break
        bracket = narrowed(bracket, tau, gap_within(event, tau, dense, g, switches, c))
    return tau


@kernel
def locate_limit(gap_start: float, gap_end: float, rotation: Track, limit: float, tau_end: float) -> float:
    """Fraction of a step at which the rotation reaches its limit: `locate` for LIMIT, by Newton's method in a bracket.

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


@inlined
def first_event(
    start: Gaps,
    end: Gaps,
    dense: DenseOutput,
    g: GapFactors,
    switches: Switches,
    c: Constants,
    yielding: bool,
) -> tuple[int, float]:
    """Earliest event of a step, and the fraction of the step at which it happens.

    Parameters
    ----------
    start, end
        Gaps at the start and at the end of the step.
    dense, g, switches, c
        The step.
    yielding
        Whether to look for YIELD_TOP and YIELD_BASE, or for all others.

    Returns
    -------
    event, tau
        The event, or -1 and 1.0 where there is none.
    """
    first, earliest = -1, 1.0
    for event in range(EVENTS):
        if end[event] < 0.0 and (event in (YIELD_TOP, YIELD_BASE)) == yielding:
            if event == LIMIT:
                tau = locate_limit(start[event], end[event], dense.rotation, g.limit, 1.0)
            else:
                tau = locate(event, start[event], end[event], dense, g, switches, c)
            if first < 0 or tau < earliest:
                first, earliest = event, tau
    return first, earliest
