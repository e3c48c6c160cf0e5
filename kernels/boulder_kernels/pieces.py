"""Soil in pieces over the depth (Eqs 105 to 108, 145 to 147), for every soil but a uniform one beside a box.

A piece has one soil and one linear width. Layers, water, cohesion and slope give the constants of its soil
(`boulder_kernels.ground`), and the outline of the boulder gives its width. A piece ends where a layer or a part of the
outline ends. Within a layer vertical stress grows linearly, above or below the water, so every soil model has an
ultimate pressure that is linear in the depth, p_0 + p_1 alpha.

Let r = alpha/d be the ratio of the depth. A slice of a piece presses with w(r) times the spring force K r x, but no
more than w(r) times P(r) = P_0 + P_1 r. Its drag is w(r) R v|v|. The width w(r) = w_0 + w_1 r is a ratio of the
design's width. Displacement x = A - s r and velocity are linear in the depth, as in `boulder_kernels.soil`. We take s
as positive; a negative s is the mirror image. Then

    clip(K r x, -P, P) = -P - max(K r x - P, 0) + max(K r x + P, 0)

Both excesses are quadratic in r, and positive only between their roots (Eq 146). Integrals over a whole piece do not
depend on the state and are computed once (`SoilSums`). The state decides two integrals of polynomials between roots,
and how far down the drag acts before the velocity changes its sign. None of this branches, because loops over lanes
must not (Eqs 108, 147).
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import by_types, exact_inlined, exact_kernel, inlined, kernel, through, type_of
from .design import (
    HEIGHT,
    WIDTH,
    Body,
    Constants,
    Design,
    DesignTable,
    G,
    Readings,
    SoilMass,
    body_with,
    constants_with,
    design_in,
    on_piece,
    piece_at,
    slope_of,
    spring_per_depth,
    ultimate_pressure,
    wedge_slope,
)
from .numerics import WIDTH as SUMS
from .numerics import add, field, partial_sums, total, write_numbers
from .soil import TINY, Kinematics, Potential, Reaction

TO, DENSITY, FRICTION, SUBGRADE, PRESSURE, PRESSURE_SLOPE = range(6)
"""Columns of the layers of a design, shape (M, 6), from the top down: depth of the lower boundary [m], density that has
inertia [kg/m^3], friction angle [rad], constant of subgrade reaction [MN/m^3], and ultimate pressure p_0 + p_1 alpha
without the effect of the strain rate [Pa], [Pa/m]. The last layer reaches down without end."""

LEAST_RATIO = 1e-30
"""Stands in for the depth of the soil line, where a soil with cohesion never yields."""


class GivenPiece(NamedTuple):
    """One piece of the soil of a design, before it is worked out."""

    to: float
    """Lower end as a ratio of the depth [-]."""
    density: float
    friction: float
    subgrade: float
    p_0: float
    p_1: float
    """Constants of its layer, in the units of `PRESSURE_SLOPE`."""
    w_0: float
    w_1: float
    """Width w_0 + w_1 r as a ratio of the design's width [-]."""


@inlined
def given_piece_in(a: np.ndarray, first: int, row: int) -> GivenPiece:
    """Return the piece that is given in a column of an array from an index on."""
    x = a[first:, row]
    return GivenPiece(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7])


class Piece(NamedTuple):
    """One piece of soil, worked out."""

    low: float
    to: float
    """Upper and lower end as ratios of the depth [-]."""
    K: float
    """Spring per ratio of the depth, squared [N/m] (Eqs 24, 25)."""
    inverse_K: float
    """Reciprocal of K [m/N]."""
    P_0: float
    P_1: float
    """Ultimate force per ratio of the depth [N] (Eqs 28, 105)."""
    R: float
    """Drag over the velocity squared, per ratio of the depth [kg/m] (Eq 36)."""
    w_0: float
    w_1: float
    """Width w_0 + w_1 r as a ratio of the design's width [-], for which K, P and R are given."""


@inlined
def piece_in(x: np.ndarray) -> Piece:
    """Return the piece that an array holds."""
    return Piece(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])


class SoilSums(NamedTuple):
    """What is integrated over all pieces once for a design; zero before the first."""

    U_0: float
    U_1: float
    """Integrals of w P and w P r [N]."""
    S_1: float
    S_2: float
    S_3: float
    """Integrals of w K r^i, i = 1, 2, 3 [N/m]."""
    Z_0: float
    Z_1: float
    Z_2: float
    Z_3: float
    """Antiderivatives of w R r^i at both ends of the pieces, added up, i = 0 ... 3 [kg/m]."""


@inlined
def sums_in(x: np.ndarray) -> SoilSums:
    """Return the sums that an array holds."""
    return SoilSums(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8])


class FewPieces(NamedTuple):
    """The pieces of one design in a lane, number by number; its type says how many they are."""

    sums: SoilSums
    pieces: tuple[Piece, ...]


class ManyPieces(NamedTuple):
    """The pieces of one design as arrays."""

    sums: np.ndarray
    """The fields of `SoilSums`, shape (9,)."""
    pieces: np.ndarray
    """The fields of `Piece`, shape (M, 9)."""


class SoilElements(NamedTuple):
    """N soil elements of equal height from the soil line down, with values of their own; arrays of shape (N,)."""

    ratio: np.ndarray
    """Depth of the middle over the embedment depth [-]."""
    stiffness: np.ndarray
    """Spring k_n [N/m] (Eqs 24, 25)."""
    ultimate: np.ndarray
    """Ultimate force F_u,n [N] (Eqs 28, 105)."""
    drag: np.ndarray
    """Drag over the velocity squared [kg/m] (Eq 36)."""


class SoilProfile(NamedTuple):
    """The soil of one design that changes with depth or lies around a boulder that is no box."""

    layers: np.ndarray
    """Layers from the top down, shape (M, 6)."""
    outline: np.ndarray
    """Outline of the boulder, shape (P, 4), see `boulder_kernels.design`; P = 0 of a box."""
    soil: Any
    """`SoilElements` or `ManyPieces`, worked out by whoever computes the constants."""


_record: Any = namedtuple
SoilConstants = _record("SoilConstants", (*Constants._fields, "lean", "soil"))
"""The fields of `Constants`; ``lean``, the part D of the moment of the weight that a boulder has whose centre does not
lie over the middle of its foot, over the depth [N] (Eq 144); and ``soil``: `FewPieces`, `ManyPieces` or `SoilElements`.
Of the soil as a whole they hold bounds: K_soil and R_soil hold for the stiffest and the heaviest piece all the
way down, x_yield the last displacement at which one reaches its ultimate resistance."""
PiecewiseTable = _record("PiecewiseTable", (*DesignTable._fields, "layers", "outlines"))
"""Many designs whose soil is in pieces: the fields of `DesignTable`, ``layers`` of shape (n, M, 6), and ``outlines`` of
shape (n, P, 4), where P is 0 of boxes."""


def table_in_layers(table: DesignTable, layers: np.ndarray) -> Any:
    """Return boxes in layers of soil, shape (n, M, 6)."""
    return PiecewiseTable(*table, layers, np.empty((len(layers), 0, 4)))


class Bounds(NamedTuple):
    """Number of elements, and bounds of the soil as a whole, fields of `SoilConstants`."""

    elements: int
    K_soil: float
    R_soil: float
    x_yield: float


class LumpedSoil(NamedTuple):
    """What follows from the soil of a design, or from its pieces down to one of them."""

    mass: SoilMass
    """What the wedge of Eqs 1, 2 weighs."""
    bounds: Bounds
    sums: SoilSums
    """Integrals over whole pieces; zero for elements."""


@exact_inlined
def nothing_lumped() -> LumpedSoil:
    """Return what follows from no piece."""
    sums = SoilSums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return LumpedSoil(SoilMass(0.0, 0.0, 0.0), Bounds(0, 0.0, 0.0, 0.0), sums)


class Cursor(NamedTuple):
    """How far layers and outline have been cut into pieces: the next layer, and the next piece of the outline."""

    layer: int
    piece: int


@exact_inlined
def cursor_at_soil_line(design: Design, outline: np.ndarray) -> Cursor:
    """Return where the uppermost piece lies."""
    return Cursor(0, piece_at(outline, min(design.d, outline[-1, HEIGHT])) if len(outline) > 0 else 0)


@exact_inlined
def next_piece(
    design: Design, layers: np.ndarray, outline: np.ndarray, low: float, at: Cursor
) -> tuple[GivenPiece, Cursor]:
    """Return the piece that begins at a ratio of the depth, and where the next begins (Eq 145); the last is repeated.

    ``design``: the design, SI; the layers replace density, friction angle and subgrade reaction of its soil; ``layers,
    outline``: layers, shape (M, 6), and outline, shape (P, 4), of the design; ``low``: where it begins; ``at``: what
    lies there.
    """
    d, last, m, i = design.d, len(layers) - 1, at.layer, at.piece
    layer_to = min(layers[m, TO] / d, 1.0) if m < last else 1.0
    piece_to = (d - outline[i, HEIGHT]) / d if i > 0 else 1.0
    to = max(min(layer_to, piece_to), low)
    w_0, w_1 = 1.0, 0.0
    if len(outline) > 0:
        w_0, w_1 = on_piece(outline, i, WIDTH, d) / design.W, -slope_of(outline, i, WIDTH) * d / design.W
    piece = GivenPiece(
        to,
        layers[m, DENSITY],
        layers[m, FRICTION],
        layers[m, SUBGRADE],
        layers[m, PRESSURE],
        layers[m, PRESSURE_SLOPE],
        w_0,
        w_1,
    )
    m += 1 if m < last and to >= layer_to else 0
    i -= 1 if i > 0 and to >= piece_to else 0
    return piece, Cursor(m, i)


def pieces_count(layers: int, points: int) -> int:
    """Return how many pieces layers and an outline of so many points make: each point within may cut a layer in two."""
    return layers + max(points - 2, 0)


@exact_inlined
def worked_out(design: Design, low: float, given: GivenPiece) -> Piece:
    """Return a piece of the soil of a design that begins at a ratio of the depth (Eqs 105, 145)."""
    p = given
    ultimate = design.K_epsilon * design.W * design.d
    K = spring_per_depth(design, p.friction, p.subgrade) * design.d * design.d
    R = p.density * design.W * design.d
    return Piece(low, p.to, K, 1.0 / K, p.p_0 * ultimate, p.p_1 * design.d * ultimate, R, p.w_0, p.w_1)


class Powers(NamedTuple):
    """Antiderivatives of r^(i - 1), i = 1 ... 5: r^i/i, or their sums and differences."""

    one: float
    two: float
    three: float
    four: float
    five: float


@exact_inlined
def powers_of(r: float) -> Powers:
    """Return the antiderivatives at r."""
    square = r * r
    return Powers(r, square / 2.0, square * r / 3.0, square * square / 4.0, square * square * r / 5.0)


@exact_inlined
def combined(p: Powers, sign: float, q: Powers) -> Powers:
    """Return p + sign q."""
    return Powers(
        p.one + sign * q.one,
        p.two + sign * q.two,
        p.three + sign * q.three,
        p.four + sign * q.four,
        p.five + sign * q.five,
    )


@exact_inlined
def lumped_with(so_far: LumpedSoil, piece: Piece, given: GivenPiece, design: Design) -> LumpedSoil:
    """Add a piece to what follows from those above it."""
    low, to, K, R, P_0, P_1 = piece.low, piece.to, piece.K, piece.R, piece.P_0, piece.P_1
    w_0, w_1, d, s, b = piece.w_0, piece.w_1, design.d, so_far.sums, so_far.bounds
    # The wedge at a height over the base is that height times tan(theta_w) long.
    u = combined(powers_of(1.0 - low), -1.0, powers_of(1.0 - to))
    foot, wedge = w_0 + w_1, given.density * design.W * wedge_slope(given.friction) * d * d
    mass = SoilMass(
        so_far.mass.mass + wedge * (foot * u.two - w_1 * u.three),
        so_far.mass.first + wedge * d * (foot * u.three - w_1 * u.four),
        so_far.mass.second + wedge * d * d * (foot * u.four - w_1 * u.five),
    )
    i, z = combined(powers_of(to), -1.0, powers_of(low)), combined(powers_of(to), 1.0, powers_of(low))
    sums = SoilSums(
        s.U_0 + (w_0 * (P_0 * i.one + P_1 * i.two) + w_1 * (P_0 * i.two + P_1 * i.three)),
        s.U_1 + (w_0 * (P_0 * i.two + P_1 * i.three) + w_1 * (P_0 * i.three + P_1 * i.four)),
        s.S_1 + K * (w_0 * i.two + w_1 * i.three),
        s.S_2 + K * (w_0 * i.three + w_1 * i.four),
        s.S_3 + K * (w_0 * i.four + w_1 * i.five),
        s.Z_0 + R * (w_0 * z.one + w_1 * z.two),
        s.Z_1 + R * (w_0 * z.two + w_1 * z.three),
        s.Z_2 + R * (w_0 * z.three + w_1 * z.four),
        s.Z_3 + R * (w_0 * z.four + w_1 * z.five),
    )
    # (P_0 + P_1 r) / (K r) changes one way along a piece; where the soil line has strength, it never yields there.
    at_low, at_to = (P_0 / max(low, LEAST_RATIO) + P_1) / K, (P_0 / max(to, LEAST_RATIO) + P_1) / K
    widest, within = max(w_0 + w_1 * low, w_0 + w_1 * to), low < to
    bounds = Bounds(
        0,
        max(b.K_soil, K * widest if within else 0.0),
        max(b.R_soil, R * widest if within else 0.0),
        max(b.x_yield, max(at_low, at_to) if within else 0.0),
    )
    return LumpedSoil(mass, bounds, sums)


@exact_kernel
def fill_pieces(design: Design, layers: np.ndarray, outline: np.ndarray, soil: ManyPieces) -> LumpedSoil:
    """Cut layers and outline into pieces (Eq 145), and return what follows from them.

    ``design``: the design, SI; the layers replace density, friction angle and subgrade reaction of its soil; ``layers,
    outline``: layers, shape (M, 6), and outline, shape (P, 4), of the design; ``soil``: pieces to fill.
    """
    so_far, low, at, to = nothing_lumped(), 0.0, cursor_at_soil_line(design, outline), soil.pieces
    for n in range(len(to)):
        given, at = next_piece(design, layers, outline, low, at)
        p = worked_out(design, low, given)
        so_far = lumped_with(so_far, p, given, design)
        write_numbers(to[n], p)
        low = p.to
    write_numbers(soil.sums, so_far.sums)
    return so_far


@exact_kernel
def fill_elements(design: Design, layers: np.ndarray, outline: np.ndarray, soil: SoilElements) -> LumpedSoil:
    """Give N elements the values of the pieces that their middles lie in (Eqs 105, 145); see `fill_pieces`."""
    elements, d = soil.ratio.size, design.d
    h_e = d / elements
    mass = first = second = K_soil = R_soil = x_yield = 0.0
    given, at = next_piece(design, layers, outline, 0.0, cursor_at_soil_line(design, outline))
    left = len(layers) + len(outline)  # at least as many as there are pieces
    for n in range(elements):
        ratio = (n + 0.5) / elements
        while given.to <= ratio and left > 0:
            given, at = next_piece(design, layers, outline, given.to, at)
            left -= 1
        alpha, width = ratio * d, (given.w_0 + given.w_1 * ratio) * design.W
        share = (given.w_0 + given.w_1 * ratio) * h_e
        pressure = (given.p_0 + given.p_1 * alpha) * design.K_epsilon
        soil.ratio[n] = ratio
        soil.stiffness[n] = spring_per_depth(design, given.friction, given.subgrade) * alpha * share
        soil.ultimate[n] = pressure * design.W * share
        soil.drag[n] = given.density * design.W * share
        m_n, height = given.density * width * h_e * wedge_slope(given.friction) * (d - alpha), d - alpha
        mass += m_n
        first += m_n * height
        second += m_n * height * height
        K_soil = max(K_soil, soil.stiffness[n] / ratio * elements)
        R_soil = max(R_soil, soil.drag[n] * elements)
        x_yield = max(x_yield, soil.ultimate[n] / soil.stiffness[n])
    bounds = Bounds(elements, K_soil, R_soil, x_yield)
    return LumpedSoil(SoilMass(mass, first, second), bounds, nothing_lumped().sums)


def uniform_layers(design: Design) -> np.ndarray:
    """Return the soil of a design as the only one of its layers, shape (1, 6)."""
    slope = ultimate_pressure(1.0, design.phi, design.rho_s, 1.0)
    return np.array([[np.inf, design.rho_s, design.phi, design.beta, 0.0, slope]])


@exact_inlined
def constants_in_soil(design: Design, readings: Readings, body: Body, lumped: LumpedSoil, soil: Any) -> Any:
    """Return the constants of a design together with the record of its soil, from which `lumped` follows."""
    b = lumped.bounds
    c = constants_with(design, body, readings, b.elements, lumped.mass, b.K_soil, b.R_soil, b.x_yield)
    lean = body.m_b * G * body.lean / design.d if readings.restoring_gravity else 0.0
    return with_soil(c, lean, soil)


@exact_inlined
def with_soil(c: Constants, lean: float, soil: Any) -> Any:
    """Return constants together with the other fields of `SoilConstants`."""
    return SoilConstants(*c[0:], lean, soil)


@exact_inlined
def add_given(met: Any, design: Design, given: GivenPiece) -> Any:
    """Work out a piece below others: what follows from them, their lower end, and they."""
    so_far, low, above = met
    piece = worked_out(design, low, given)
    return lumped_with(so_far, piece, given, design), piece.to, (*above, piece)


add_all_given = through(add_given)


@exact_inlined
def constants_of_few(design: Design, readings: Readings, body: Body, given: tuple[GivenPiece, ...]) -> Any:
    """Return the constants of a design in as many pieces as given."""
    so_far, _, pieces = add_all_given((nothing_lumped(), 0.0, ()), design, given)
    return constants_in_soil(design, readings, body, so_far, FewPieces(so_far.sums, pieces))


BELOW = len(Design._fields)
"""Rows of a table of designs above what is given of the soil."""
BODY_SIZE, PIECE_SIZE = len(Body._fields), len(GivenPiece._fields)
"""How many numbers are given of a body, and of each piece."""
COUNTS = (1, 2, 4, 8)
"""Numbers of pieces for which lanes are compiled; another number is filled up by pieces without height."""


def lanes_count(pieces: int) -> int:
    """Return the number of pieces that lanes are compiled for, at least as many as given; 0 if there are too many."""
    return next((count for count in COUNTS if count >= pieces), 0)


@kernel
def write_given(designs: np.ndarray, layers: np.ndarray, outlines: np.ndarray, out: np.ndarray) -> None:
    """Write what lanes are given of designs beside `Design`: the body, and the pieces one after another.

    ``designs``: the designs, SI, shape (15, n); ``layers, outlines``: layers, shape (n, M, 6), and outlines, shape (n,
    P, 4); ``out``: shape (BODY_SIZE + C PIECE_SIZE, n), of C pieces.
    """
    for row in range(out.shape[1]):
        design, outline = design_in(designs, row), outlines[row]
        write_numbers(out[:, row], body_with(design, outline))
        low, at = 0.0, cursor_at_soil_line(design, outline)
        for first in range(BODY_SIZE, len(out), PIECE_SIZE):
            p, at = next_piece(design, layers[row], outline, low, at)
            write_numbers(out[first:, row], p)
            low = p.to


def given_pieces(designs: np.ndarray, layers: np.ndarray, outlines: np.ndarray, count: int) -> np.ndarray:
    """Return designs as rows of a table for lanes, and below them what is given, see `write_given`."""
    out = np.empty((BODY_SIZE + PIECE_SIZE * count, designs.shape[1]))
    write_given(np.ascontiguousarray(designs), layers, outlines, out)
    return np.concatenate([designs, out])


class Line(NamedTuple):
    """Displacement and velocity along the depth, mirrored so that the displacement decreases."""

    side: float
    """-1.0 where they have been mirrored, or else 1.0."""
    alpha: float
    """Displacement at the soil line [m]."""
    S: float
    """Decrease of displacement over the depth, positive [m]."""
    inverse_S: float
    """Reciprocal of S [1/m]."""
    turn: float
    """Ratio of the depth at which the velocity changes its sign."""


@inlined
def side_of(slope: float) -> float:
    """Return the sign of a slope; zero counts as positive, whatever sign it has."""
    return 1.0 if slope >= 0.0 else -1.0


@inlined
def line_of(A: float, slope_x: float, B: float, slope_v: float) -> Line:
    """Return the lines of displacement and velocity, of `boulder_kernels.soil.Kinematics`."""
    side, S, P = side_of(slope_x), max(abs(slope_x), TINY), max(abs(slope_v), TINY)
    return Line(side, side * A, S, 1.0 / S, side_of(slope_v) * B / P)


@inlined
def times(factor: float, value: float) -> float:
    """Return a product, which the compiler leaves out where it knows the factor to be zero, whatever the value is."""
    return factor * value if factor != 0.0 else 0.0


class Section(NamedTuple):
    """A part of a piece."""

    low: float
    high: float


@inlined
def excess_of(KS: float, inverse_S: float, n: float, p: float, piece: Piece) -> Section:
    """Return the section of a piece where -KS r^2 + n r + p is positive: between its roots (Eq 146).

    Without p one of them is at the soil line; lanes where this is known need neither root nor quotient.
    """
    half = 0.5 * n
    squared = half * half + KS * p
    T = half + math.copysign(np.sqrt(max(squared, 0.0)) + TINY, n)
    one, other = (T if p != 0.0 else n) * piece.inverse_K * inverse_S, -p / T
    low, high = (min(one, other), max(one, other)) if p != 0.0 else (piece.low, one)
    low, high = min(max(low, piece.low), piece.to), min(max(high, piece.low), piece.to)
    return Section(low, high if (squared >= 0.0) | (p == 0.0) else low)


@inlined
def powers_over(s: Section) -> Powers:
    """Return the integrals of r^i over a section, i = 0 ... 4."""
    low_2, high_2 = s.low * s.low, s.high * s.high
    low_4, high_4 = low_2 * low_2, high_2 * high_2
    return Powers(
        s.high - s.low,
        0.5 * (high_2 - low_2),
        (1.0 / 3.0) * (high_2 * s.high - low_2 * s.low),
        0.25 * (high_4 - low_4),
        0.2 * (high_4 * s.high - low_4 * s.low),
    )


class Sums(NamedTuple):
    """Integrals of something, and of the same times r and r^2."""

    zeroth: float
    first: float
    second: float


@inlined
def integrated(KS: float, n: float, p: float, r: Powers) -> Sums:
    """Integrate -KS r^2 + n r + p over a section."""
    return Sums(
        n * r.two - KS * r.three + times(p, r.one),
        n * r.three - KS * r.four + times(p, r.two),
        n * r.four - KS * r.five + times(p, r.three),
    )


@inlined
def released(KS: float, n: float, p: float, r: Powers, piece: Piece) -> float:
    """Half the integral of (-KS r^2 + n r + p)^2 w/(K r) over where the soil yields, but for p^2/r [J]."""
    cubic, square, linear, constant = KS * KS, -2.0 * KS * n, n * n - times(p, 2.0 * KS), 2.0 * n
    zeroth = cubic * r.four + square * r.three + linear * r.two + times(p, constant * r.one)
    first = cubic * r.five + square * r.four + linear * r.three + times(p, constant * r.two)
    return 0.5 * piece.inverse_K * (piece.w_0 * zeroth + times(piece.w_1, first))


class ReleasedEnergy(NamedTuple):
    """What springs hold less for their yielding [J], and a bound from below."""

    energy: float
    least: float


@inlined
def released_by_strength(s: Section, piece: Piece) -> ReleasedEnergy:
    """Half the integral of P_0^2 w/(K r) over a section: a logarithm, and for the bound the tangent to 1/r, without."""
    length, middle = s.high - s.low, 0.5 * (s.low + s.high)
    logarithm = piece.w_0 * math.log(max(s.high, TINY) / max(s.low, TINY)) + times(piece.w_1, length)
    inverse = 1.0 / max(middle, TINY)
    ratio = length * inverse
    tangent = ratio * (piece.w_0 + times(piece.w_1, middle)) - times(piece.w_1, (1.0 / 12.0) * ratio * ratio * length)
    share = 0.5 * piece.inverse_K * piece.P_0 * piece.P_0
    return ReleasedEnergy(times(share, logarithm), times(share, tangent))


class Walk(NamedTuple):
    """What has been met on the way down through the pieces."""

    pressed: float
    pressed_r: float
    """What the springs press if soil not met yet is at its limit backwards, mirrored, and the same times r [N]."""
    energy: float
    least_energy: float
    """Energy of the springs less what yielding released, and a bound from below [J]."""
    D_0: float
    D_1: float
    D_2: float
    D_3: float
    """Antiderivatives of w R r^i at where the velocity changes its sign, or at the end of a piece next to it."""


@inlined
def pass_piece(w: Walk, line: Line, piece: Piece) -> Walk:
    """Add a piece to what has been met."""
    KS, inverse_S, Ka = piece.K * line.S, line.inverse_S, piece.K * line.alpha
    n, m, p = Ka - piece.P_1, Ka + piece.P_1, piece.P_0
    ahead, back = excess_of(KS, inverse_S, n, -p, piece), excess_of(KS, inverse_S, m, p, piece)
    upper, lower = Section(piece.low, back.low), Section(back.high, piece.to)
    r = powers_over(ahead)
    over, under = integrated(KS, n, -p, r), integrated(KS, m, p, powers_over(back))
    first = under.first - over.first
    energy = released(KS, n, -p, r, piece)
    energy += released(KS, m, p, combined(powers_over(upper), 1.0, powers_over(lower)), piece)
    x, y, z = (
        released_by_strength(ahead, piece),
        released_by_strength(upper, piece),
        released_by_strength(lower, piece),
    )
    turn = min(max(line.turn, piece.low), piece.to)
    turn_2 = turn * turn
    turn_3, turn_4 = turn_2 * turn, turn_2 * turn_2
    R_0, R_1 = piece.R * piece.w_0, times(piece.w_1, piece.R)
    return Walk(
        w.pressed + piece.w_0 * (under.zeroth - over.zeroth) + times(piece.w_1, first),
        w.pressed_r + piece.w_0 * first + times(piece.w_1, under.second - over.second),
        w.energy + energy + (x.energy + y.energy + z.energy),
        w.least_energy + energy + (x.least + y.least + z.least),
        w.D_0 + R_0 * turn + times(0.5 * R_1, turn_2),
        w.D_1 + 0.5 * R_0 * turn_2 + times((1.0 / 3.0) * R_1, turn_3),
        w.D_2 + (1.0 / 3.0) * R_0 * turn_3 + times(0.25 * R_1, turn_4),
        w.D_3 + 0.25 * R_0 * turn_4 + times(0.2 * R_1, turn_4 * turn),
    )


pass_few = through(pass_piece)


@inlined
def start_walk(s: SoilSums) -> Walk:
    """Return what is known before the first piece."""
    return Walk(-s.U_0, -s.U_1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@by_types
def walk_through(line: Line, soil: Any) -> Callable[..., Walk]:
    """Return what is met on the way down through all pieces, `ManyPieces` or `FewPieces`."""
    if type_of(soil) is FewPieces:
        return lambda line, soil: pass_few(start_walk(soil.sums), line, soil.pieces)
    return walk_by_arrays


def walk_by_arrays(line: Line, soil: ManyPieces) -> Walk:
    """Return what is met on the way down through `ManyPieces`."""
    w = start_walk(sums_of(soil))
    for m in range(len(soil.pieces)):
        w = pass_piece(w, line, piece_in(soil.pieces[m]))
    return w


@by_types
def sums_of(soil: Any) -> Callable[..., SoilSums]:
    """Return the sums of pieces."""
    return (lambda soil: soil.sums) if type_of(soil) is FewPieces else (lambda soil: sums_in(soil.sums))


@inlined
def reaction_of_pieces(k: Kinematics, soil: Any) -> Reaction:
    """Force and moment of pieces, integrated over the depth exactly (Eqs 108, 147, the limit of 19, 20, 26, 28, 36).

    The drag is v|v| integrated up to where v changes its sign, and from there on.
    """
    line, s = line_of(k.A, k.slope_x, k.B, k.slope_v), sums_of(soil)
    w = walk_through(line, soil)
    N_0, N_1, N_2, N_3 = 2.0 * w.D_0 - s.Z_0, 2.0 * w.D_1 - s.Z_1, 2.0 * w.D_2 - s.Z_2, 2.0 * w.D_3 - s.Z_3
    B, p, drag = k.B, k.slope_v, side_of(k.slope_v)
    BB, Bp, pp = B * B, 2.0 * (B * p), p * p
    pressed = line.side * w.pressed + drag * (BB * N_0 - Bp * N_1 + pp * N_2)
    pressed_r = line.side * w.pressed_r + drag * (BB * N_1 - Bp * N_2 + pp * N_3)
    return Reaction(-pressed, k.lever_d * pressed_r + k.q * pressed)


@inlined
def potential_of_pieces(A: float, slope_x: float, soil: Any) -> Potential:
    """Elastic energy of pieces and its slopes, exactly (Eqs 108, 147); see `boulder_kernels.soil.closed_potential`.

    A slice that presses K r x - P too much, were it not limited, holds w (K r x - P)^2/(2 K r) too much.
    """
    line, s = line_of(A, slope_x, 0.0, 0.0), sums_of(soil)
    w = walk_through(line, soil)
    V = 0.5 * (A * (A * s.S_1 - slope_x * s.S_2) - slope_x * (A * s.S_2 - slope_x * s.S_3))
    pressed, pressed_r = line.side * w.pressed, line.side * w.pressed_r
    return Potential(V - w.energy, pressed, -pressed_r, V - w.least_energy)


@inlined
def power_of_pieces(k: Kinematics, soil: Any) -> float:
    """Power that the drag of pieces takes out of the motion [W], integrated exactly (Eqs 34-36)."""
    line, s = line_of(k.A, k.slope_x, k.B, k.slope_v), sums_of(soil)
    w, B, p = walk_through(line, soil), k.B, k.slope_v
    N_0, N_1, N_2, N_3 = 2.0 * w.D_0 - s.Z_0, 2.0 * w.D_1 - s.Z_1, 2.0 * w.D_2 - s.Z_2, 2.0 * w.D_3 - s.Z_3
    return side_of(p) * (B**3 * N_0 - 3.0 * B * p * (B * N_1 - p * N_2) - p**3 * N_3)


@inlined
def add_element(sums: np.ndarray, j: int, first: int, k: Kinematics, soil: SoilElements) -> None:
    """Add force and moment of element first + j to the partial sums j."""
    ratio, ultimate = field(soil.ratio, first, j), field(soil.ultimate, first, j)
    spring = field(soil.stiffness, first, j) * (k.A - k.slope_x * ratio)
    v = k.B - k.slope_v * ratio
    pressed = min(max(spring, -ultimate), ultimate) + field(soil.drag, first, j) * v * abs(v)
    add(sums, j, -pressed, pressed * (k.lever_d * ratio + k.q))


@kernel
def reaction_of_elements(k: Kinematics, soil: SoilElements) -> Reaction:
    """Sum force and moment over elements with values of their own (Eqs 19-21, 26, 28, 36, 145)."""
    sums = partial_sums()
    whole = soil.ratio.size - soil.ratio.size % SUMS
    for first in range(0, whole, SUMS):
        for j in range(SUMS):
            add_element(sums, j, first, k, soil)
    for j in range(soil.ratio.size - whole):
        add_element(sums, j, whole, k, soil)
    return Reaction(total(sums, 0), total(sums, SUMS))


@kernel
def potential_of_elements(A: float, slope_x: float, soil: SoilElements) -> Potential:
    """Elastic energy of elements with values of their own; a sum of convex energies is convex."""
    V = V_A = V_X = 0.0
    for n in range(soil.ratio.size):
        ratio = soil.ratio[n]
        displacement = A - slope_x * ratio
        stiffness, ultimate = soil.stiffness[n], soil.ultimate[n]
        over = max(abs(displacement) - ultimate / stiffness, 0.0)
        pressed = min(max(stiffness * displacement, -ultimate), ultimate)
        V += 0.5 * stiffness * (displacement * displacement - over * over)
        V_A += pressed
        V_X -= ratio * pressed
    return Potential(V, V_A, V_X, V)


@kernel
def power_of_elements(k: Kinematics, soil: SoilElements) -> float:
    """Power that the drag of elements with values of their own takes out of the motion [W]."""
    total = 0.0
    for n in range(soil.ratio.size):
        total += soil.drag[n] * abs(k.B - k.slope_v * soil.ratio[n]) ** 3
    return total
