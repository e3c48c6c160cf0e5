"""Boulders that are no boxes: their outline, the soil beside it (Eqs 141 to 145), and how their weight leans (Eq 144).

**The outline** gives width and length over the height, piecewise linear. At a height z over the foot the boulder is
w(z) wide, and reaches near(z) towards the vehicle and far(z) away from it, counted from the middle of its foot. Volume,
centre, moment of inertia and the soil beside it are integrals of polynomials over the pieces between the points of the
outline. Gauss's rule of three points is exact up to the fifth degree, which none of them exceeds.

**The soil.** At the ratio r = alpha/d of the depth a slice presses and brakes as one of a box, times its own width over
that of the design. The soil is N elements or, in their limit, pieces of one soil and of linear width: a layer, cut
where the outline has a point. They are arrays beside the constants of the design or, in lanes, numbers;
`boulder_kernels.outlined_soil` works out what they press.

Beside the width all keep what the weight of a boulder adds whose centre does not lie over the middle of its foot, the
moment -D cos(theta) (Eq 144): the restoring couple of a box has equal arms either way, and D is half of what differs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel, kernel, overload, through
from .design import Body, Constants, Design, G, Readings, SoilMass, body_of_box, constants_with, design_in, wedge_slope
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
    nothing_lumped,
    with_record,
)

HEIGHT, WIDTH, NEAR, FAR = range(4)
"""Columns of an outline, shape (P, 4), from the foot to the top: height over the foot, ascending from 0 to H, width,
and reach towards the vehicle and away from it [m]. Between its points it is linear."""

NODES = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three points on 0 ... 1."""


@exact_inlined
def piece_at(outline: np.ndarray, z: float) -> int:
    """Return the number of the piece of an outline that a height [m] lies in, at a point of the outline the lower."""
    i = 0
    while i < len(outline) - 2 and outline[i + 1, HEIGHT] < z:
        i += 1
    return i


@exact_inlined
def slope_of(outline: np.ndarray, i: int, column: int) -> float:
    """Return by how much a column of an outline grows with the height on its piece i [-]."""
    return (outline[i + 1, column] - outline[i, column]) / (outline[i + 1, HEIGHT] - outline[i, HEIGHT])


@exact_inlined
def on_piece(outline: np.ndarray, i: int, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m] on its piece i [m]."""
    return outline[i, column] + slope_of(outline, i, column) * (z - outline[i, HEIGHT])


@exact_inlined
def at_height(outline: np.ndarray, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m]; beyond its top that at the top [m]."""
    z = min(z, outline[-1, HEIGHT])
    return on_piece(outline, piece_at(outline, z), column, z)


@exact_kernel
def body_of_outline(design: Design, outline: np.ndarray) -> Body:
    """Mass, centre, moment of inertia and reach of a boulder with an outline (Eqs 141 to 144).

    Parameters
    ----------
    design
        The design, SI; its density is that of the volume within the outline.
    outline
        The outline, shape (P, 4).
    """
    d = design.d
    volume = x = z_c = xx = zz = line = 0.0
    for i in range(len(outline) - 1):
        low, high = outline[i, HEIGHT], outline[i + 1, HEIGHT]
        buried = min(high, d)
        for g in range(3):
            z = low + NODES[g] * (high - low)
            w, near, far = (on_piece(outline, i, WIDTH, z), on_piece(outline, i, NEAR, z), on_piece(outline, i, FAR, z))
            slice_ = WEIGHTS[g] * (high - low) * w
            area = slice_ * (near + far)
            volume += area
            z_c += area * z
            zz += area * z * z
            x += slice_ * 0.5 * (far * far - near * near)
            xx += slice_ * (far * far * far + near * near * near) / 3.0
            if low < buried:
                z = low + NODES[g] * (buried - low)
                line += WEIGHTS[g] * (buried - low) * (d - z) * on_piece(outline, i, FAR, z)
    x, z_c, line = x / volume, z_c / volume, line / (0.5 * d * d)
    m_b = design.rho_b * volume
    J = design.rho_b * (xx + zz) - m_b * (x * x + z_c * z_c)
    struck = at_height(outline, NEAR, d + design.e)
    foot_near, foot_far = outline[0, NEAR], outline[0, FAR]
    half = 0.5 * (foot_near + foot_far)
    return Body(m_b, J, struck + x, z_c, struck + line, half, 0.5 * (foot_far - foot_near) - x)


class OutlinedElements(NamedTuple):
    """N soil elements beside a boulder with an outline."""

    elements: SoilElements
    lean: np.ndarray
    """D over the depth of embedment [N], shape (1,)."""
    outline: np.ndarray
    """Outline of the boulder, see `boulder_kernels.outlined`."""


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


class Lean(NamedTuple):
    """How the weight of a boulder in a lane leans."""

    moment: float
    """D over the depth of embedment [N]."""


class FewPieces(NamedTuple):
    """As many pieces as its type says, number by number: the soil of a design in a lane."""

    lean: Lean
    pieces: tuple[Piece, ...]


class TaperedPiece(NamedTuple):
    """Soil of one kind beside one linear width, whose ultimate resistance is proportional to depth."""

    K: float
    R: float
    x_yield: float
    """Displacement at which all of it yields [m]."""
    w_0: float
    w_1: float
    """These, K and R as of `OutlinedPieces`."""


class TaperedSoil(NamedTuple):
    """The soil of a tapered boulder in a lane."""

    lean: Lean
    pieces: tuple[TaperedPiece]


RECORDS = (OutlinedElements, OutlinedPieces, FewPieces, TaperedSoil)


class GivenPiece(NamedTuple):
    """One piece of the soil of a design, before it is worked out."""

    to: float
    """Lower end as a ratio of the depth [-]."""
    density: float
    friction: float
    subgrade: float
    p_0: float
    p_1: float
    """Its layer, as of `boulder_kernels.layered.GivenLayer`."""
    w_0: float
    w_1: float
    """As of `OutlinedPieces`."""


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


class Cursor(NamedTuple):
    """How far layers and outline have been cut into pieces: the next layer, and the next piece of the outline."""

    layer: int
    piece: int


@exact_inlined
def cursor_at_soil_line(design: Design, outline: np.ndarray) -> Cursor:
    """Return where the uppermost piece lies."""
    return Cursor(0, piece_at(outline, min(design.d, outline[-1, HEIGHT])))


@exact_inlined
def next_piece(
    design: Design, layers: np.ndarray, outline: np.ndarray, low: float, at: Cursor
) -> tuple[GivenPiece, Cursor]:
    """Return the piece that begins at a ratio of the depth, and where the next begins (Eq 145); the last is repeated.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of its soil are those of the layers.
    layers, outline
        Layers of its soil, shape (M, 6), and the outline of the boulder, shape (P, 4).
    low
        Where it begins.
    at
        What lies there.
    """
    d, last, m, i = design.d, len(layers) - 1, at.layer, at.piece
    layer_to = min(layers[m, TO] / d, 1.0) if m < last else 1.0
    piece_to = (d - outline[i, HEIGHT]) / d if i > 0 else 1.0
    to = max(min(layer_to, piece_to), low)
    piece = GivenPiece(
        to,
        layers[m, DENSITY],
        layers[m, FRICTION],
        layers[m, SUBGRADE],
        layers[m, PRESSURE],
        layers[m, PRESSURE_SLOPE],
        on_piece(outline, i, WIDTH, d) / design.W,
        -slope_of(outline, i, WIDTH) * d / design.W,
    )
    m += 1 if m < last and to >= layer_to else 0
    i -= 1 if i > 0 and to >= piece_to else 0
    return piece, Cursor(m, i)


@exact_inlined
def worked_out(design: Design, low: float, given: GivenPiece) -> Piece:
    """Return a piece of the soil of a design that begins at a ratio of the depth (Eq 145)."""
    p = given
    layer = layer_of(design, low, p.to, p.density, p.friction, p.subgrade, p.p_0, p.p_1)
    return Piece(low, p.to, layer.K, layer.P_0, layer.P_1, layer.R, p.w_0, p.w_1)


@exact_inlined
def lumped_beside(so_far: Lumped, piece: Piece, given: GivenPiece, design: Design) -> Lumped:
    """Add a piece to what follows from those above it; see `boulder_kernels.layered.lumped_with`."""
    low, to, d = piece.low, piece.to, design.d
    mass, first, second = so_far.mass.mass, so_far.mass.first, so_far.mass.second
    wedge = given.density * design.W * wedge_slope(given.friction)
    for g in range(3):
        r = low + NODES[g] * (to - low)
        z = d * (1.0 - r)
        slice_ = WEIGHTS[g] * d * (to - low) * wedge * (piece.w_0 + piece.w_1 * r) * z
        mass += slice_
        first += slice_ * z
        second += slice_ * z * z
    widest = max(piece.w_0 + piece.w_1 * low, piece.w_0 + piece.w_1 * to)
    at_low = (piece.P_0 / max(low, LEAST_RATIO) + piece.P_1) / piece.K
    at_to = (piece.P_0 / max(to, LEAST_RATIO) + piece.P_1) / piece.K
    within, b = low < to, so_far.bounds
    bounds = Bounds(
        0,
        max(b.K_soil, piece.K * widest if within else 0.0),
        max(b.R_soil, piece.R * widest if within else 0.0),
        max(b.x_yield, max(at_low, at_to) if within else 0.0),
    )
    return Lumped(SoilMass(mass, first, second), bounds, NO_SUMS)


@exact_kernel
def fill_outlined_pieces(design: Design, layers: np.ndarray, soil: OutlinedPieces) -> Lumped:
    """Cut layers and outline into pieces (Eq 145), and return what follows from them; see `fill_layers`."""
    so_far, low, at = nothing_lumped(), 0.0, cursor_at_soil_line(design, soil.outline)
    for n in range(soil.to.size):
        given, at = next_piece(design, layers, soil.outline, low, at)
        piece = worked_out(design, low, given)
        so_far = lumped_beside(so_far, piece, given, design)
        soil.to[n], soil.K[n], soil.R[n] = piece.to, piece.K, piece.R
        soil.P_0[n], soil.P_1[n], soil.w_0[n], soil.w_1[n] = piece.P_0, piece.P_1, piece.w_0, piece.w_1
        low = piece.to
    return so_far


@kernel
def write_given(designs: np.ndarray, layers: np.ndarray, outlines: np.ndarray, out: np.ndarray) -> None:
    """Write what lanes are given of designs beside outlines: the body, and the pieces one after another.

    Parameters
    ----------
    designs
        The designs, SI, shape (15, n).
    layers, outlines
        Shape (n, M, 6) and (n, P, 4).
    out
        Shape (7 + 8 C, n), of C pieces.
    """
    body_size, size = 7, 8
    for row in range(out.shape[1]):
        design, outline = design_in(designs, row), outlines[row]
        body = body_of_outline(design, outline)
        out[0, row], out[1, row], out[2, row], out[3, row] = body.m_b, body.J, body.x, body.y
        out[4, row], out[5, row], out[6, row] = body.line, body.foot, body.lean
        low, at = 0.0, cursor_at_soil_line(design, outline)
        for n in range((len(out) - body_size) // size):
            p, at = next_piece(design, layers[row], outline, low, at)
            first = body_size + n * size
            out[first, row], out[first + 1, row], out[first + 2, row] = p.to, p.density, p.friction
            out[first + 3, row], out[first + 4, row], out[first + 5, row] = p.subgrade, p.p_0, p.p_1
            out[first + 6, row], out[first + 7, row] = p.w_0, p.w_1
            low = p.to


def given_beside(designs: np.ndarray, layers: np.ndarray, outlines: np.ndarray, count: int) -> np.ndarray:
    """Return designs as rows of a table for lanes, and below them what is given, shape (22 + 8 count, n).

    Arguments: see `write_given`.
    """
    out = np.empty((len(Body._fields) + len(GivenPiece._fields) * count, designs.shape[1]))
    write_given(np.ascontiguousarray(designs), layers, outlines, out)
    return np.concatenate([designs, out])


@exact_inlined
def add_given_piece(met: Any, design: Design, given: GivenPiece) -> Any:
    """Work out a piece below others: what follows from them, their lower end, and they."""
    so_far, low, above = met
    piece = worked_out(design, low, given)
    return lumped_beside(so_far, piece, given, design), piece.to, (*above, piece)


add_given_pieces = through(add_given_piece)


@exact_inlined
def constants_and_pieces(
    design: Design, readings: Readings, body: Body, given: tuple[GivenPiece, ...]
) -> tuple[Constants, Lean, tuple[Piece, ...]]:
    """Return the constants of a design beside as many pieces as given, how it leans, and the pieces."""
    so_far, _, pieces = add_given_pieces((nothing_lumped(), 0.0, ()), design, given)
    b = so_far.bounds
    c = constants_with(design, body, readings, 0, so_far.mass, b.K_soil, b.R_soil, b.x_yield)
    return c, Lean(lean_with(body, design, readings.restoring_gravity)), pieces


@exact_inlined
def constants_beside_pieces(design: Design, readings: Readings, body: Body, given: tuple[GivenPiece, ...]) -> Any:
    """Return the constants of a design in `FewPieces`."""
    c, lean, pieces = constants_and_pieces(design, readings, body, given)
    return with_record(c, FewPieces(lean, pieces))


@exact_inlined
def constants_beside_taper(design: Design, readings: Readings, body: Body, given: tuple[GivenPiece]) -> Any:
    """Return the constants of a design in `TaperedSoil`."""
    c, lean, pieces = constants_and_pieces(design, readings, body, given)
    p = pieces[0]
    return with_record(c, TaperedSoil(lean, (TaperedPiece(p.K, p.R, p.P_1 / p.K, p.w_0, p.w_1),)))


def is_outlined(soil: Any) -> bool:
    """Whether a record of the soil, or its Numba type, is that beside an outline."""
    return getattr(soil, "instance_class", type(soil)) in RECORDS


def with_outline(soil: Any, outline: np.ndarray) -> Any:
    """Return a record of the soil, to be filled anew, beside another outline."""
    return soil._replace(outline=outline)


@overload(with_outline)
def _with_outline(soil: Any, outline: Any) -> Callable[..., Any]:
    if soil.instance_class is OutlinedElements:
        return lambda soil, outline: OutlinedElements(soil.elements, soil.lean, outline)
    return _with_outline_of_pieces


def _with_outline_of_pieces(soil: OutlinedPieces, outline: np.ndarray) -> OutlinedPieces:
    s = soil
    return OutlinedPieces(s.to, s.K, s.P_0, s.P_1, s.R, s.w_0, s.w_1, s.lean, outline)


def body_beside(design: Design, soil: Any) -> Body:
    """Return the boulder beside a record of the soil: of its outline, or the box of the design."""
    return body_of_outline(design, soil.outline) if is_outlined(soil) else body_of_box(design)


@overload(body_beside)
def _body_beside(design: Any, soil: Any) -> Callable[..., Body]:
    if is_outlined(soil):
        return lambda design, soil: body_of_outline(design, soil.outline)
    return lambda design, soil: body_of_box(design)


@exact_inlined
def lean_with(body: Body, design: Design, gravity: bool) -> float:
    """Return D over the depth [N] (Eq 144), where the restoring moment is the couple of the weight, or else 0."""
    return body.m_b * G * body.lean / design.d if gravity else 0.0


def empty_outlined(pieces: int, elements: int, outline: np.ndarray) -> OutlinedPieces | OutlinedElements:
    """Return a soil to fill beside an outline: N elements, or where N is 0 as many pieces as given."""
    if elements > 0:
        return OutlinedElements(SoilElements(*np.empty((4, elements))), np.zeros(1), outline)
    to, K, P_0, P_1, R, w_0, w_1 = np.empty((7, pieces))
    return OutlinedPieces(to, K, P_0, P_1, R, w_0, w_1, np.zeros(1), outline)
