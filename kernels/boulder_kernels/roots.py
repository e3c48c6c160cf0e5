"""Roots of a function in a bracket, by the Illinois method: regula falsi whose ends do not stall.

M. Dowell and P. Jarratt, A modified regula falsi method for computing the root of an equation, BIT 11 (1971), 168-174.
The functions here narrow a bracket; the caller evaluates its own function in between, because a function passed as an
argument could not be compiled ahead and kept.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined

ITERATIONS = 50
"""More than any root here needs: the bracket at least halves every third time."""


class Bracket(NamedTuple):
    """Two points between which a function changes its sign."""

    low: float
    f_low: float
    high: float
    f_high: float
    side: float
    """Which end was moved last: -1 the low one, 1 the high one, 0 none."""


@inlined
def next_guess(b: Bracket) -> float:
    """Where the chord meets zero, or the middle where rounding puts that outside the bracket."""
    tau = b.high - b.f_high * (b.high - b.low) / (b.f_high - b.f_low)
    inside = (b.low < tau) & (tau < b.high)
    return tau if inside else 0.5 * (b.low + b.high)


@inlined
def narrowed(b: Bracket, tau: float, f: float) -> Bracket:
    """Bracket with the point tau, at which the function is f, in place of one end.

    An end that stays twice running has its value halved, which pulls the next chord over to it.
    """
    from_below = (f > 0.0) == (b.f_low > 0.0)
    f_low = 0.5 * b.f_low if b.side > 0.0 else b.f_low
    f_high = 0.5 * b.f_high if b.side < 0.0 else b.f_high
    return Bracket(
        tau if from_below else b.low,
        f if from_below else f_low,
        b.high if from_below else tau,
        f_high if from_below else f,
        -1.0 if from_below else 1.0,
    )
