"""The soil beside a boulder whose width varies over its height (Eqs 145 to 147).

At the ratio r = alpha/d of the depth a slice presses and brakes as one of a box, times its own width over that of the
design. Springs and ultimate resistance are both proportional to the width, so a slice yields at the same displacement
as beside a box, and the break points along the depth are the roots of the same quadratic equations. Where the width is
linear between two depths, and the soil that of one layer, the integrals of force and moment are those of polynomials of
the fourth degree between the break points: Gauss's rule of three points gives them exactly.

The soil is N elements or, in their limit, such pieces. Beside the width both keep what the weight of a boulder adds
whose centre does not lie over the middle of its foot, the moment -D cos(theta) (Eq 144): the restoring couple of a box
has equal arms either way, and D is half of what differs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_kernel, function_of, inlined, kernel, overload
from .design import Body, Constants, Design, G, SoilMass, body_of_box, wedge_slope
from .layered import (
    DENSITY,
    FRICTION,
    LEAST_RATIO,
    NO_SUMS,
    PRESSURE,
    PRESSURE_SLOPE,
    SUBGRADE,
    TO,
    Bounds,
    Lumped,
    SoilElements,
    fill_elements,
    layer_of,
)
from .layered_soil import potential_of_elements, power_of_elements, reaction_of_elements
from .outline import HEIGHT, NODES, WEIGHTS, WIDTH, at_height, body_of_outline, on_piece, piece_at, slope_of
from .soil import TINY, Kinematics, Potential, Reaction


class OutlinedElements(NamedTuple):
    """N soil elements beside a boulder with an outline."""

    elements: SoilElements
    lean: np.ndarray
    """D over the depth of embedment [N], shape (1,)."""
    outline: np.ndarray
    """Outline of the boulder, see `boulder_kernels.outline`."""


class OutlinedPieces(NamedTuple):
    """Pieces of one soil and of linear width, from the soil line down; arrays of shape (M,) as of `SoilLayers`."""

    to: np.ndarray
    K: np.ndarray
    P_0: np.ndarray
    P_1: np.ndarray
    R: np.ndarray
    w_0: np.ndarray
    w_1: np.ndarray
    """Width w_0 + w_1 r over that of the design [-]."""
    lean: np.ndarray
    outline: np.ndarray
    """As of `OutlinedElements`."""


RECORDS = (OutlinedElements, OutlinedPieces)


class Piece(NamedTuple):
    """One piece, with the fields of `OutlinedPieces`."""

    low: float
    to: float
    K: float
    P_0: float
    P_1: float
    R: float
    w_0: float
    w_1: float


@exact_kernel
def fill_outlined_elements(design: Design, layers: np.ndarray, soil: OutlinedElements) -> Lumped:
    """Give N elements the values of the layers and the width that they lie beside (Eq 145); see `fill_elements`."""
    elements, outline, d = soil.elements, soil.outline, design.d
    lumped = fill_elements(design, layers, elements)
    mass = first = second = K_soil = R_soil = 0.0
    N = elements.ratio.size
    m = 0
    for n in range(N):
        alpha = elements.ratio[n] * d
        while m < len(layers) - 1 and (n + 0.5) * d / N >= layers[m, TO]:
            m += 1
        width = at_height(outline, WIDTH, d - alpha)
        share = width / design.W
        elements.stiffness[n] *= share
        elements.ultimate[n] *= share
        elements.drag[n] *= share
        m_n = layers[m, DENSITY] * width * (d / N) * wedge_slope(layers[m, FRICTION]) * (d - alpha)
        mass += m_n
        first += m_n * (d - alpha)
        second += m_n * (d - alpha) * (d - alpha)
        K_soil = max(K_soil, elements.stiffness[n] / elements.ratio[n] * N)
        R_soil = max(R_soil, elements.drag[n] * N)
    bounds = Bounds(N, K_soil, R_soil, lumped.bounds.x_yield)
    return Lumped(SoilMass(mass, first, second), bounds, NO_SUMS)


@exact_kernel
def fill_outlined_pieces(design: Design, layers: np.ndarray, soil: OutlinedPieces) -> Lumped:
    """Cut layers and outline into pieces (Eq 145), and return what follows from them; see `fill_layers`."""
    d, outline, last = design.d, soil.outline, len(layers) - 1
    mass = first = second = K_soil = R_soil = x_yield = 0.0
    m, i, low = 0, piece_at(outline, min(d, outline[-1, HEIGHT])), 0.0
    for n in range(soil.to.size):
        layer_to = min(layers[m, TO] / d, 1.0) if m < last else 1.0
        piece_to = (d - outline[i, HEIGHT]) / d if i > 0 else 1.0
        to = max(min(layer_to, piece_to), low)
        density, friction = layers[m, DENSITY], layers[m, FRICTION]
        layer = layer_of(
            design, low, to, density, friction, layers[m, SUBGRADE], layers[m, PRESSURE], layers[m, PRESSURE_SLOPE]
        )
        w_0 = on_piece(outline, i, WIDTH, d) / design.W
        w_1 = -slope_of(outline, i, WIDTH) * d / design.W
        soil.to[n], soil.K[n], soil.R[n] = to, layer.K, layer.R
        soil.P_0[n], soil.P_1[n], soil.w_0[n], soil.w_1[n] = layer.P_0, layer.P_1, w_0, w_1
        if low < to:
            for g in range(3):
                z = d * (1.0 - low - NODES[g] * (to - low))
                across = density * wedge_slope(friction) * on_piece(outline, i, WIDTH, z)
                slice_ = WEIGHTS[g] * d * (to - low) * across * z
                mass += slice_
                first += slice_ * z
                second += slice_ * z * z
            widest = max(w_0 + w_1 * low, w_0 + w_1 * to)
            K_soil, R_soil = max(K_soil, layer.K * widest), max(R_soil, layer.R * widest)
            at_low = (layer.P_0 / max(low, LEAST_RATIO) + layer.P_1) / layer.K
            at_to = (layer.P_0 / max(to, LEAST_RATIO) + layer.P_1) / layer.K
            x_yield = max(x_yield, max(at_low, at_to))
        low = to
        if m < last and to >= layer_to:
            m += 1
        if i > 0 and to >= piece_to:
            i -= 1
    return Lumped(SoilMass(mass, first, second), Bounds(0, K_soil, R_soil, x_yield), NO_SUMS)


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


@inlined
def leaning(reaction: Reaction, k: Kinematics, lean: np.ndarray) -> Reaction:
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


@kernel
def reaction_of_pieces(k: Kinematics, soil: OutlinedPieces) -> Reaction:
    """Force and moment of the soil beside an outline, integrated over the depth exactly (Eq 147)."""
    s, low = Sums(0.0, 0.0), 0.0
    for m in range(soil.to.size):
        piece = piece_of(m, low, soil)
        turn = turn_of(k.B, k.slope_v, piece)
        s = springs_of(k.A, k.slope_x, piece, s)
        s = drag_between(low, turn, k.B, k.slope_v, piece, s)
        s = drag_between(turn, piece.to, k.B, k.slope_v, piece, s)
        low = piece.to
    return leaning(Reaction(-s.zeroth, k.lever_d * s.first + k.q * s.zeroth), k, soil.lean)


@inlined
def energy_between(low: float, high: float, A: float, slope_x: float, piece: Piece, V: float, highest: float) -> Sums:
    """Add the elastic energy between two break points of a piece, exactly and by an upper bound [J] (Eq 147).

    A slice that yields holds P |x| - P^2/(2 K r) per unit of its width: polynomials, and P_0^2/(2 K r), whose integral
    is a logarithm. A lower bound of that is ln(b/a) >= 2 (b - a)/(a + b).
    """
    length, middle = high - low, 0.5 * (low + high)
    yielding = abs(piece.K * middle * (A - slope_x * middle)) > piece.P_0 + piece.P_1 * middle
    total, share = 0.0, 0.5 / piece.K
    for g in range(3):
        r = low + NODES[g] * length
        x, P = A - slope_x * r, piece.P_0 + piece.P_1 * r
        elastic = 0.5 * piece.K * r * x * x
        plastic = P * abs(x) - share * (2.0 * piece.P_0 + piece.P_1 * r) * piece.P_1
        total += WEIGHTS[g] * length * (plastic if yielding else elastic) * (piece.w_0 + piece.w_1 * r)
    P_2 = piece.P_0 * piece.P_0 * share if yielding else 0.0
    logarithm = math.log(max(high, TINY) / max(low, TINY))
    linear = P_2 * piece.w_1 * length
    V += total - linear - P_2 * piece.w_0 * logarithm
    # w_0 alone may be negative; the width never is.
    bound = 2.0 * length / max(low + high, TINY) if piece.w_0 > 0.0 else logarithm
    return Sums(V, highest + total - linear - P_2 * piece.w_0 * bound)


@kernel
def potential_of_pieces(A: float, slope_x: float, soil: OutlinedPieces) -> Potential:
    """Elastic energy of the soil beside an outline and its slopes, exactly (Eq 147)."""
    s, V, low = Sums(0.0, 0.0), Sums(0.0, 0.0), 0.0
    for m in range(soil.to.size):
        piece = piece_of(m, low, soil)
        s = springs_of(A, slope_x, piece, s)
        at = breaks_of(A, slope_x, piece)
        V = energy_between(low, at.a, A, slope_x, piece, V.zeroth, V.first)
        V = energy_between(at.a, at.b, A, slope_x, piece, V.zeroth, V.first)
        V = energy_between(at.b, at.c, A, slope_x, piece, V.zeroth, V.first)
        V = energy_between(at.c, at.d, A, slope_x, piece, V.zeroth, V.first)
        V = energy_between(at.d, piece.to, A, slope_x, piece, V.zeroth, V.first)
        low = piece.to
    return Potential(V.zeroth, s.zeroth, -s.first, V.first)


@kernel
def power_of_pieces(k: Kinematics, soil: OutlinedPieces) -> float:
    """Power that the drag beside an outline takes out of the motion [W], integrated exactly."""
    power, low = 0.0, 0.0
    for m in range(soil.to.size):
        piece = piece_of(m, low, soil)
        turn = turn_of(k.B, k.slope_v, piece)
        s = drag_between(low, turn, k.B, k.slope_v, piece, Sums(0.0, 0.0))
        s = drag_between(turn, piece.to, k.B, k.slope_v, piece, s)
        power += k.B * s.zeroth - k.slope_v * s.first
        low = piece.to
    return power


def is_outlined(soil: Any) -> bool:
    """Whether a record of the soil, or its Numba type, is that beside an outline."""
    return getattr(soil, "instance_class", type(soil)) in RECORDS


def with_outline(soil: Any, outline: np.ndarray) -> Any:
    """Return a record of the soil, to be filled anew, beside another outline."""
    return soil._replace(outline=outline)


@overload(with_outline)
def _with_outline(soil: Any, outline: Any) -> Callable[..., Any]:
    values = ", ".join(f"soil.{name}" for name in soil.instance_class._fields[:-1])
    return function_of(
        f"def with_outline(soil, outline):\n return Record({values}, outline)", Record=soil.instance_class
    )


def body_beside(design: Design, soil: Any) -> Body:
    """Return the boulder beside a record of the soil: of its outline, or the box of the design."""
    return body_of_outline(design, soil.outline) if is_outlined(soil) else body_of_box(design)


@overload(body_beside)
def _body_beside(design: Any, soil: Any) -> Callable[..., Body]:
    if is_outlined(soil):
        return lambda design, soil: body_of_outline(design, soil.outline)
    return lambda design, soil: body_of_box(design)


def keep_lean(body: Body, design: Design, gravity: bool, soil: Any) -> None:
    """Keep what the weight adds beside the soil (Eq 144), where the restoring moment is the couple of the weight."""
    if is_outlined(soil):
        soil.lean[0] = body.m_b * G * body.lean / design.d if gravity else 0.0


@overload(keep_lean)
def _keep_lean(body: Any, design: Any, gravity: Any, soil: Any) -> Callable[..., None]:
    if not is_outlined(soil):
        return lambda body, design, gravity, soil: None

    def keep(body: Body, design: Design, gravity: bool, soil: Any) -> None:
        """Keep it."""
        soil.lean[0] = body.m_b * G * body.lean / design.d if gravity else 0.0

    return keep


def _soil_in(c: Any) -> Any:
    """Return the record of the soil of constants or of their Numba type; None of uniform soil."""
    if hasattr(c, "instance_class"):
        names = c.instance_class._fields
        return c[names.index("soil")] if "soil" in names else None
    return getattr(c, "soil", None)


LIFT = "c.C_cos * abs(sin) + c.C_sin * versin"


def lift_of(sin: float, versin: float, c: Constants) -> float:
    """Return the energy of the weight, lifted by a rotation with this sine and versine [J] (Eqs 37-39, 144)."""
    lift = c.C_cos * abs(sin) + c.C_sin * versin
    soil = _soil_in(c)
    return float(lift + soil.lean[0] * c.d * sin if is_outlined(soil) else lift)


@overload(lift_of)
def _lift_of(sin: Any, versin: Any, c: Any) -> Callable[..., float]:
    more = " + c.soil.lean[0] * c.d * sin" if is_outlined(_soil_in(c)) else ""
    return function_of(f"def lift_of(sin, versin, c):\n return {LIFT}{more}")


def least_couple(c: Constants) -> float:
    """Return the lesser of the moments of the weight about the ends of the foot [N m]; they differ by 2 D (Eq 144)."""
    soil = _soil_in(c)
    return float(c.C_cos - abs(soil.lean[0]) * c.d if is_outlined(soil) else c.C_cos)


@overload(least_couple)
def _least_couple(c: Any) -> Callable[..., float]:
    less = " - abs(c.soil.lean[0]) * c.d" if is_outlined(_soil_in(c)) else ""
    return function_of(f"def least_couple(c):\n return c.C_cos{less}")


def empty_outlined(pieces: int, elements: int, outline: np.ndarray) -> OutlinedPieces | OutlinedElements:
    """Return a soil to fill beside an outline: N elements, or where N is 0 as many pieces as given."""
    if elements > 0:
        return OutlinedElements(SoilElements(*np.empty((4, elements))), np.zeros(1), outline)
    to, K, P_0, P_1, R, w_0, w_1 = np.empty((7, pieces))
    return OutlinedPieces(to, K, P_0, P_1, R, w_0, w_1, np.zeros(1), outline)
