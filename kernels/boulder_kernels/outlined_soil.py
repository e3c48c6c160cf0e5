"""The reaction of the soil beside a boulder whose width varies over its height (Eqs 146, 147).

Springs and ultimate resistance are both proportional to the width, so a slice yields at the same displacement as beside
a box, and the break points along the depth are the roots of the same quadratic equations. Where the width is linear
between two depths, and the soil that of one layer, the integrals of force and moment are those of polynomials of the
fourth degree between the break points: Gauss's rule of three points gives them exactly. Where the ultimate resistance
is proportional to depth there are two break points for all of it, and the closed form is that of uniform soil
(`boulder_kernels.soil`) with one more power of the depth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, overload, through
from .layered_soil import potential_of_elements, power_of_elements, reaction_of_elements
from .outlined import NODES, WEIGHTS, FewPieces, OutlinedElements, OutlinedPieces, Piece, TaperedSoil
from .soil import TINY, Kinematics, Potential, Reaction


class Breaks(NamedTuple):
    """Where slices of a piece begin or cease to yield, as ratios of the depth in ascending order, within the piece."""

    a: float
    b: float
    c: float
    d: float


class Roots(NamedTuple):
    """Both roots of a quadratic equation; where it has none, twice the lower end of the piece."""

    one: float
    other: float


@inlined
def roots_of(KS: float, n: float, P_0: float, piece: Piece) -> Roots:
    """Return the roots of KS r^2 - n r + P_0 = 0, clamped to a piece."""
    half = 0.5 * n
    squared = half * half - KS * P_0
    T = half + math.copysign(np.sqrt(max(squared, 0.0)) + TINY, n)
    one = T / math.copysign(max(abs(KS), TINY), KS)
    other = P_0 / T
    one = min(max(one if squared >= 0.0 else piece.low, piece.low), piece.to)
    other = min(max(other if squared >= 0.0 else piece.low, piece.low), piece.to)
    return Roots(one, other)


@inlined
def breaks_of(A: float, slope_x: float, piece: Piece) -> Breaks:
    """Return the break points of a piece, displaced by A - slope_x r (Eq 146).

    K r (A - s r) = +-(P_0 + P_1 r) are two quadratic equations. A network of five exchanges puts their roots in order.
    """
    K, KS = piece.K, piece.K * slope_x
    p = roots_of(KS, K * A - piece.P_1, piece.P_0, piece)
    q = roots_of(KS, K * A + piece.P_1, -piece.P_0, piece)
    a, b = min(p.one, p.other), max(p.one, p.other)
    c, d = min(q.one, q.other), max(q.one, q.other)
    a, c = min(a, c), max(a, c)
    b, d = min(b, d), max(b, d)
    b, c = min(b, c), max(b, c)
    return Breaks(a, b, c, d)


class Sums(NamedTuple):
    """Integrals over a part of the depth of something, and of the same times r."""

    zeroth: float
    first: float


@inlined
def springs_between(low: float, high: float, A: float, slope_x: float, piece: Piece, s: Sums) -> Sums:
    """Add what the springs press between two break points of a piece [N] (Eq 147)."""
    zeroth, first = s
    length = high - low
    for g in range(3):
        r = low + NODES[g] * length
        P = piece.P_0 + piece.P_1 * r
        pressed = min(max(piece.K * r * (A - slope_x * r), -P), P) * (piece.w_0 + piece.w_1 * r)
        zeroth += WEIGHTS[g] * length * pressed
        first += WEIGHTS[g] * length * pressed * r
    return Sums(zeroth, first)


@inlined
def springs_of(A: float, slope_x: float, piece: Piece, s: Sums) -> Sums:
    """Add what the springs of a piece press [N]."""
    at = breaks_of(A, slope_x, piece)
    s = springs_between(piece.low, at.a, A, slope_x, piece, s)
    s = springs_between(at.a, at.b, A, slope_x, piece, s)
    s = springs_between(at.b, at.c, A, slope_x, piece, s)
    s = springs_between(at.c, at.d, A, slope_x, piece, s)
    return springs_between(at.d, piece.to, A, slope_x, piece, s)


@inlined
def turn_of(B: float, slope_v: float, piece: Piece) -> float:
    """Return where the velocity B - slope_v r changes its sign, clamped to a piece."""
    return min(max(B / math.copysign(max(abs(slope_v), TINY), slope_v), piece.low), piece.to)


@inlined
def drag_between(low: float, high: float, B: float, slope_v: float, piece: Piece, s: Sums) -> Sums:
    """Add the drag where the velocity does not change its sign [N] (Eq 147)."""
    zeroth, first = s
    length = high - low
    for g in range(3):
        r = low + NODES[g] * length
        v = B - slope_v * r
        drag = piece.R * (piece.w_0 + piece.w_1 * r) * v * abs(v)
        zeroth += WEIGHTS[g] * length * drag
        first += WEIGHTS[g] * length * drag * r
    return Sums(zeroth, first)


@inlined
def piece_of(m: int, low: float, soil: OutlinedPieces) -> Piece:
    """Return one piece, which begins where the one above ends."""
    return Piece(low, soil.to[m], soil.K[m], soil.P_0[m], soil.P_1[m], soil.R[m], soil.w_0[m], soil.w_1[m])


def through_soil(add: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that passes what has been met on from piece to piece, and returns what has been met in all.

    Parameters
    ----------
    add
        Takes what has been met above a piece, the state, and the piece.

    Returns
    -------
    callable
        Takes what has been met before, the state, and `OutlinedPieces` or `FewPieces`.
    """

    def by_arrays(met: Any, state: Any, soil: OutlinedPieces) -> Any:
        """Go through arrays."""
        low = 0.0
        for m in range(soil.to.size):
            met = add(met, state, piece_of(m, low, soil))
            low = soil.to[m]
        return met

    few = through(add)

    def way(met: Any, state: Any, soil: Any) -> Any:
        """Go through them."""
        return few(met, state, soil.pieces) if isinstance(soil, FewPieces) else by_arrays(met, state, soil)

    def choose(met: Any, state: Any, soil: Any) -> Callable[..., Any]:
        """Return the way for arguments of these Numba types."""
        if soil.instance_class is FewPieces:
            return lambda met, state, soil: few(met, state, soil.pieces)
        return by_arrays

    overload(way)(choose)
    return way


@inlined
def leaning(reaction: Reaction, k: Kinematics, lean: Any) -> Reaction:
    """Add the moment -D cos(theta) of the weight (Eq 144)."""
    return Reaction(reaction.F, reaction.M - lean[0] * k.lever_d)


@kernel
def reaction_of_outlined_elements(k: Kinematics, soil: OutlinedElements) -> Reaction:
    """Sum force and moment over the elements beside an outline (Eqs 19-21, 26, 28, 36, 145)."""
    return leaning(reaction_of_elements(k, soil.elements), k, soil.lean)


@kernel
def potential_of_outlined_elements(A: float, slope_x: float, soil: OutlinedElements) -> Potential:
    """Elastic energy of the elements beside an outline."""
    return potential_of_elements(A, slope_x, soil.elements)


@kernel
def power_of_outlined_elements(k: Kinematics, soil: OutlinedElements) -> float:
    """Power that their drag takes out of the motion [W]."""
    return power_of_elements(k, soil.elements)


@inlined
def add_reaction(s: Sums, k: Kinematics, piece: Piece) -> Sums:
    """Add what a piece presses, springs and drag [N]."""
    turn = turn_of(k.B, k.slope_v, piece)
    s = springs_of(k.A, k.slope_x, piece, s)
    s = drag_between(piece.low, turn, k.B, k.slope_v, piece, s)
    return drag_between(turn, piece.to, k.B, k.slope_v, piece, s)


pressed_by = through_soil(add_reaction)


@inlined
def reaction_of_pieces(k: Kinematics, soil: Any) -> Reaction:
    """Force and moment of the soil beside an outline, integrated over the depth exactly (Eq 147)."""
    s = pressed_by(Sums(0.0, 0.0), k, soil)
    return leaning(Reaction(-s.zeroth, k.lever_d * s.first + k.q * s.zeroth), k, soil.lean)


@inlined
def energy_between(low: float, high: float, A: float, slope_x: float, piece: Piece, V: float, highest: float) -> Sums:
    """Add the elastic energy between two break points of a piece, exactly and by an upper bound [J] (Eq 147).

    A slice that yields holds P |x| - P^2/(2 K r) per unit of its width: polynomials, and P_0^2/(2 K r), whose integral
    is a logarithm. Bounds of that are 2 (b - a)/(a + b) <= ln(b/a) <= (b - a)/sqrt(a b).
    """
    length, middle = high - low, 0.5 * (low + high)
    yielding = abs(piece.K * middle * (A - slope_x * middle)) > piece.P_0 + piece.P_1 * middle
    total, share = 0.0, 0.5 / piece.K
    for g in range(3):
        r = low + NODES[g] * length
        x, P = A - slope_x * r, piece.P_0 + piece.P_1 * r
        elastic = 0.5 * piece.K * r * x * x
        yielded = P * abs(x) - share * (2.0 * piece.P_0 + piece.P_1 * r) * piece.P_1
        total += WEIGHTS[g] * length * (yielded if yielding else elastic) * (piece.w_0 + piece.w_1 * r)
    P_2 = piece.P_0 * piece.P_0 * share if yielding else 0.0
    linear = P_2 * piece.w_1 * length
    V += total - linear - P_2 * piece.w_0 * math.log(max(high, TINY) / max(low, TINY))
    # w_0 alone may be negative; the width never is.
    least, most = 2.0 * length / max(low + high, TINY), length / np.sqrt(max(low * high, TINY))
    return Sums(V, highest + total - linear - P_2 * piece.w_0 * (least if piece.w_0 > 0.0 else most))


class Stretch(NamedTuple):
    """Displacement along the depth."""

    A: float
    slope_x: float


class Stored(NamedTuple):
    """What has been met on the way down: what the springs hold and press."""

    V: float
    highest: float
    """As of `boulder_kernels.soil.Potential` [J]."""
    pressed: Sums
    """[N]."""


@inlined
def add_energy(met: Stored, x: Stretch, piece: Piece) -> Stored:
    """Add what the springs of a piece hold and press."""
    at = breaks_of(x.A, x.slope_x, piece)
    V = energy_between(piece.low, at.a, x.A, x.slope_x, piece, met.V, met.highest)
    V = energy_between(at.a, at.b, x.A, x.slope_x, piece, V.zeroth, V.first)
    V = energy_between(at.b, at.c, x.A, x.slope_x, piece, V.zeroth, V.first)
    V = energy_between(at.c, at.d, x.A, x.slope_x, piece, V.zeroth, V.first)
    V = energy_between(at.d, piece.to, x.A, x.slope_x, piece, V.zeroth, V.first)
    return Stored(V.zeroth, V.first, springs_of(x.A, x.slope_x, piece, met.pressed))


stored_in = through_soil(add_energy)


@inlined
def potential_of_pieces(A: float, slope_x: float, soil: Any) -> Potential:
    """Elastic energy of the soil beside an outline and its slopes, exactly (Eq 147)."""
    s = stored_in(Stored(0.0, 0.0, Sums(0.0, 0.0)), Stretch(A, slope_x), soil)
    return Potential(s.V, s.pressed.zeroth, -s.pressed.first, s.highest)


@inlined
def add_power(power: float, k: Kinematics, piece: Piece) -> float:
    """Add the power of the drag of a piece [W]."""
    turn = turn_of(k.B, k.slope_v, piece)
    s = drag_between(piece.low, turn, k.B, k.slope_v, piece, Sums(0.0, 0.0))
    s = drag_between(turn, piece.to, k.B, k.slope_v, piece, s)
    return power + k.B * s.zeroth - k.slope_v * s.first


braked_by = through_soil(add_power)


@inlined
def power_of_pieces(k: Kinematics, soil: Any) -> float:
    """Power that the drag beside an outline takes out of the motion [W], integrated exactly."""
    power: float = braked_by(0.0, k, soil)
    return power


class Clipped(NamedTuple):
    """Integrals of r^i clip(A - s r, -y, y) over the depth, i = 1, 2, 3 [m], and where the clipped line has bends."""

    S_1: float
    S_2: float
    S_3: float
    r_1: float
    r_2: float
    y: float
    """With the sign of the slope [m]."""


@inlined
def clipped(A: float, slope_x: float, x_yield: float) -> Clipped:
    """Integrate the displacement that presses, as `boulder_kernels.soil.closed_form` does, with one more power."""
    s = math.copysign(max(abs(slope_x), TINY), slope_x)
    y = math.copysign(x_yield, s)
    inverse_s = 1.0 / s
    below, above = y - A, y + A
    r_1 = min(max(-below * inverse_s, 0.0), 1.0)
    r_2 = min(max(above * inverse_s, 0.0), 1.0)
    s = slope_x
    a_1, a_2 = r_1 * r_1, r_2 * r_2
    b_1, b_2 = a_1 * r_1, a_2 * r_2
    c_1, c_2 = a_1 * a_1, a_2 * a_2
    return Clipped(
        0.5 * (below * a_1 + above * a_2 - y) + (1.0 / 3.0) * s * (b_1 - b_2),
        (1.0 / 3.0) * (below * b_1 + above * b_2 - y) + 0.25 * s * (c_1 - c_2),
        0.25 * (below * c_1 + above * c_2 - y) + 0.2 * s * (c_1 * r_1 - c_2 * r_2),
        r_1,
        r_2,
        y,
    )


@inlined
def reaction_of_taper(k: Kinematics, soil: TaperedSoil) -> Reaction:
    """Force and moment of uniform soil beside a tapered boulder: Eq 147 where there are two break points in all."""
    piece = soil.pieces[0]
    x = clipped(k.A, k.slope_x, piece.x_yield)
    p = math.copysign(max(abs(k.slope_v), TINY), k.slope_v)
    r_0 = min(max(k.B / p, 0.0), 1.0)
    a_0 = r_0 * r_0
    b_0 = a_0 * r_0
    # With Z_i = 2 r_0^i - 1 the integral of r^(i - 1) is Z_i/i, whose sign changes with that of the velocity.
    Z_1, Z_2, Z_3 = 2.0 * r_0 - 1.0, 0.5 * (2.0 * a_0 - 1.0), (1.0 / 3.0) * (2.0 * b_0 - 1.0)
    Z_4, Z_5 = 0.25 * (2.0 * a_0 * a_0 - 1.0), 0.2 * (2.0 * b_0 * a_0 - 1.0)
    BB, Bp, pp = k.B * k.B, 2.0 * (k.B * k.slope_v), k.slope_v * k.slope_v
    D_0, D_1, D_2 = BB * Z_1 - Bp * Z_2 + pp * Z_3, BB * Z_2 - Bp * Z_3 + pp * Z_4, BB * Z_3 - Bp * Z_4 + pp * Z_5
    R = math.copysign(piece.R, p)
    pressed = piece.K * (piece.w_0 * x.S_1 + piece.w_1 * x.S_2) + R * (piece.w_0 * D_0 + piece.w_1 * D_1)
    pressed_r = piece.K * (piece.w_0 * x.S_2 + piece.w_1 * x.S_3) + R * (piece.w_0 * D_1 + piece.w_1 * D_2)
    return leaning(Reaction(-pressed, k.lever_d * pressed_r + k.q * pressed), k, soil.lean)


class Powers(NamedTuple):
    """Integrals of r^(i - 1) over a part of the depth, i = 2 ... 5."""

    two: float
    three: float
    four: float
    five: float


@inlined
def powers_up_to(r: float) -> Powers:
    """Return the integrals from the soil line down to a ratio of the depth."""
    square = r * r
    return Powers(0.5 * square, (1.0 / 3.0) * (square * r), 0.25 * (square * square), 0.2 * (square * square * r))


@inlined
def held(A: float, s: float, y: float, first: Powers, last: Powers, shift: int) -> float:
    """Integral of r^(1 + shift) times what springs of unit stiffness hold, whose displacement is clipped [m^2].

    Parameters
    ----------
    A, s
        Displacement A - s r along the depth [m].
    y
        Displacement at which they yield, with the sign of s [m].
    first, last
        Integrals up to where they cease to yield, and to where they yield again.
    shift
        0 or 1.
    """
    u_1, u_2, u_3 = (first.two, first.three, first.four) if shift == 0 else (first.three, first.four, first.five)
    v_1, v_2, v_3 = (last.two, last.three, last.four) if shift == 0 else (last.three, last.four, last.five)
    w_1, w_2 = (0.5, 1.0 / 3.0) if shift == 0 else (1.0 / 3.0, 0.25)
    middle = 0.5 * A * A * (v_1 - u_1) - A * s * (v_2 - u_2) + 0.5 * s * s * (v_3 - u_3)
    before = y * (A * u_1 - s * u_2) - 0.5 * y * y * u_1
    after = -y * (A * (w_1 - v_1) - s * (w_2 - v_2)) - 0.5 * y * y * (w_1 - v_1)
    return before + middle + after


@inlined
def potential_of_taper(A: float, slope_x: float, soil: TaperedSoil) -> Potential:
    """Elastic energy of uniform soil beside a tapered boulder; see `boulder_kernels.soil.closed_potential`."""
    piece = soil.pieces[0]
    x = clipped(A, slope_x, piece.x_yield)
    first, last = powers_up_to(x.r_1), powers_up_to(x.r_2)
    V = piece.w_0 * held(A, slope_x, x.y, first, last, 0) + piece.w_1 * held(A, slope_x, x.y, first, last, 1)
    pressed = piece.K * (piece.w_0 * x.S_1 + piece.w_1 * x.S_2)
    pressed_r = piece.K * (piece.w_0 * x.S_2 + piece.w_1 * x.S_3)
    return Potential(piece.K * V, pressed, -pressed_r, piece.K * V)


@inlined
def power_of_taper(k: Kinematics, soil: TaperedSoil) -> float:
    """Power that the drag beside a tapered boulder takes out of the motion [W]."""
    p = soil.pieces[0]
    return add_power(0.0, k, Piece(0.0, 1.0, p.K, 0.0, p.K * p.x_yield, p.R, p.w_0, p.w_1))
