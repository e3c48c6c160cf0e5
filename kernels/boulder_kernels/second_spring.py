"""A vehicle whose front stiffens: from a crush s_2 on its spring is k_2, at least as stiff as k_v, for good (Eq 111).

Up to there the force is that of Eqs 17, 18 and 41. With u* the compression of the spring at the first instant at which
the crush s = x_v - x_c is s_2,

    F_v = k_v u                 before
    F_v = k_2 (u - u_0)         from then on,   u_0 = u* (1 - k_v / k_2)

The force is continuous, and the damper goes on as before. What is crushed stays crushed, so of the energy in the
spring the part F^2/2 (1/k_v - 1/k_2) is spent at that instant (Eq 112). With k_2, k_2/m_v and u_0 among the constants
of the motion, everything made for one spring holds from then on: contact, release, maxima, energy, proofs.

Kernels take the second spring as their last argument, or None for a vehicle without. Numba compiles them for either,
so that a vehicle without has the code it would have if there were no such law.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_kernel, function_of, kernel, overload
from .after_step import Kept
from .design import Constants, Design
from .dormand_prince import DenseOutput, state_at
from .dynamics import Switches
from .numerics import ITERATIONS, Bracket, narrowed, next_guess
from .outcomes import Compression, Maxima, compression_at, highest

STIFFENS = 8
"""Event: the crush reaches the second spring. Numbered after those of `boulder_kernels.modes`."""
PRECISION = 1e-12
"""Precision of the instant as a fraction of the step. The offset u_0 stays for good, so its error is of first order
in that of the instant."""


class SecondSpring(NamedTuple):
    """The second spring of a vehicle."""

    k_2: float
    """Spring [N/m], at least k_v."""
    s_2: float
    """Crush from which it holds [m]."""


class SecondSprings(NamedTuple):
    """Many second springs: the fields of `SecondSpring`, each a contiguous float64 array of shape (n,)."""

    k_2: np.ndarray
    s_2: np.ndarray


@exact_kernel
def is_second_spring(c: Constants, second: SecondSpring | None) -> bool:
    """Whether a second spring is finite and no softer than the first, and begins at a positive crush."""
    if second is None:
        return True
    return c.k_v <= second.k_2 and second.s_2 > 0.0 and second.k_2 < np.inf


def on_second_spring(c: Constants, k_2: float, u_0: float) -> Constants:
    """Return the constants of a motion that goes on with another spring [N/m], offset by u_0 [m] (Eq 111)."""
    return c._replace(k_v=k_2, k_m=c.k_m * (k_2 / c.k_v), u_0=u_0)


@overload(on_second_spring)
def _on_second_spring(c: Any, k_2: Any, u_0: Any) -> Callable[..., Any]:
    """Write out every field, of `Constants` or of a record that has more."""
    changed = {"k_v": "k_2", "k_m": "c.k_m * (k_2 / c.k_v)", "u_0": "u_0"}
    values = ", ".join(changed.get(name, f"c.{name}") for name in c.fields)
    source = f"def on_second_spring(c, k_2, u_0):\n return Record({values})"
    return function_of(source, Record=c.instance_class)


@exact_kernel
def stiffest(c: Constants, second: SecondSpring | None) -> Constants:
    """Return the constants with the stiffest spring that the motion can meet: its rates bound those of both."""
    if second is None:
        return c
    return on_second_spring(c, second.k_2, 0.0)


@exact_kernel
def offset_of(u: float, k_v: float, k_2: float) -> float:
    """Offset u_0 of the second spring [m] that takes over at a compression u of the first (Eq 111)."""
    return u * (1.0 - k_v / k_2)


@exact_kernel
def spent_energy(u_0: float, k_v: float, k_2: float) -> float:
    """Energy that was spent when the second spring took over with an offset u_0 [J] (Eq 112).

    It is F^2/2 (1/k_v - 1/k_2) = k_v u*^2/2 (1 - k_v/k_2), and u* = u_0 / (1 - k_v/k_2).
    """
    return 0.5 * k_v * u_0 * u_0 / (1.0 - k_v / k_2) if k_2 > k_v else 0.0


@kernel
def with_spring(design: Design, factor: float) -> Design:
    """Return a design whose vehicle has its spring times a factor."""
    p = design
    k_v = factor * p.k_v
    return Design(
        p.L, p.W, p.H, p.rho_b, p.d, p.e, p.rho_s, p.phi, p.beta, p.K_epsilon, p.m_v, p.v_0, k_v, p.c_v, p.e_bumper
    )  # fmt: skip


@kernel
def times(second: SecondSpring | None, factor: float) -> SecondSpring | None:
    """Return a second spring times a factor."""
    if second is None:
        return None
    return SecondSpring(factor * second.k_2, second.s_2)


@kernel
def largest_crush(start: Compression, end: Compression, h: float) -> tuple[float, float]:
    """Largest crush within a step of length h [s], and the fraction of the step at which it is reached."""
    return highest(start.crush, start.crush_rate, end.crush, end.crush_rate, h)


@kernel
def reached(
    s_2: float, start: Compression, latest: float, dense: DenseOutput, switches: Switches, c: Constants
) -> float:
    """Fraction of a step at which the crush reaches s_2 [m]; beyond 1 where it does not.

    Parameters
    ----------
    s_2
        The crush looked for.
    start
        Compression at the start of the step.
    latest
        Fraction of the step before which it is reached.
    dense, switches, c
        The step.
    """
    low = s_2 - start.crush
    if low <= 0.0:
        return 0.0
    high = s_2 - compression_at(state_at(dense, latest), switches, c).crush
    if high > 0.0:
        return 2.0
    b, tau = Bracket(0.0, low, latest, high, 0.0), latest
    for _ in range(ITERATIONS):
        following = next_guess(b)
        closed = abs(following - tau) <= PRECISION
        tau = following
        if closed:
            break
        b = narrowed(b, tau, s_2 - compression_at(state_at(dense, tau), switches, c).crush)
    return tau


@kernel
def provable_so_far(kept: Kept, k_v: float, k_2: float) -> Kept:
    """Return what is kept of a step on the first spring, with the largest force that the proof of rest may count on.

    A force F that is reached again may be reached on the second spring, where it takes the energy F^2/(2 k_2) and not
    F^2/(2 k_v).
    """
    m = kept.m
    F_v = m.F_v * math.sqrt(k_v / k_2)
    less = Maxima(m.theta, m.t_theta, m.x_b, m.t_x_b, m.x_v, m.t_x_v, F_v, m.t_F_v, m.crush, m.t_crush)
    return Kept(kept.event, kept.tau, kept.y, less)
