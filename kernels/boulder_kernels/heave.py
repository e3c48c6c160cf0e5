"""The boulder free to rise and held by friction: constants, forces and energies of the second opinion (Eqs 131-137).

The paper's motion is planar and smooth: the boulder neither rises nor rubs. Here its common centre of mass may rise by
y_b, its foot rests on a base that pushes but does not pull, and everything that slips along the boulder rubs. The
boulder moves both ways, the lumped soil sideways only, and so the weight and the base stand in for the couple of
Eqs 37-39. Derivation, symbols and the choice of every constant: `docs/model.md`.

A point of the boulder at (a, b) from the common centre of mass, a to the right and b upwards, is at

    X = a cos(theta) + b sin(theta),   Y = y_b - a sin(theta) + b cos(theta)

Soil, foot and sides are sums over as many pieces each, of which 16 are enough: parts of the soil, along which pressures
are averaged exactly, strips of the foot that are narrower at its ends, and Gauss's points of the sides. Pieces are
added up in one order, so that every processor gives the same bits. Every force is either the slope of one potential or
takes energy out of the motion.

Beside a box in uniform soil all parts have the same faces, stiffness, yield displacement and drag. Elsewhere each has
its own (`lay_soil`); the type of the constants of the planar motion says which (`part_of_soil`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import by_types, inlined, is_none, kernel, type_of
from .design import FAR as REACH_FAR
from .design import NEAR as REACH_NEAR
from .design import (
    WIDTH,
    Body,
    Constants,
    Design,
    G,
    SoilMass,
    at_height,
    body_of_box,
    passive_pressure_coefficient,
    piece_at,
    slope_of,
    soil_mass,
)
from .dynamics import contact_displacement, contact_lever, spring_compression
from .ground import WATER
from .numerics import field, put, sine_versine
from .pieces import DENSITY, FRICTION, TO, ManyPieces, SoilConstants, combined, powers_of, times
from .soil import TINY, Kinematics, soil_kinematics

GROUP, FINEST = 16, 4
"""Pieces of the coarsest solution: two of the widest registers; and what their number may be multiplied by, twice."""
MOST = GROUP * FINEST * FINEST
ROW = MOST + GROUP
"""Numbers between the parts of a workspace; a power of two would crowd the processor's cache."""
SETS, FOOT, STRIP, SIDE_A, SIDE_DEPTH, SIDE, ALONG_X, TURNING, LIFTING, FAR, NEAR = (ROW * n for n in range(11))
"""Offsets in the workspace: sets of the strips, where they lie along the foot, and their shares of it; points of the
sides, and their friction per depth; what all pieces have of five sums."""
RATIO, HEIGHT, INVERSE_HEIGHT, STIFFNESS, YIELD, DRAG, ROUGHNESS = (ROW * n for n in range(11, 18))
FACES, TURNING_FAR, TURNING_NEAR = ROW * 18, ROW * 22, ROW * 23
"""Offsets of what only the parts of a soil that is not uniform, or beside no box, keep there, see `lay_soil`; of these
the fields of `Faces` have a row each."""
ROOM = 24 * ROW
"""Numbers in the workspace."""
RISE, FALL = 0.45, 0.25
"""How far a face rises and falls at most while it presses on the soil, over the length of the boulder: 0.41 and 0.22 of
600 boulders that turn by up to 20 degrees."""
SIDE_POINTS = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
"""Gauss's four points of a length 1: the sides are four points by four."""
ROUNDING = 1e-9
"""Slope of a side that widens upwards by rounding alone."""
SIDE_WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)
"""Weights of Gauss's four points."""


class Base(NamedTuple):
    """The ground under the foot, and how friction sets in."""

    stiffness: float = 100e6
    """Pressure per settlement k_b [N/m^3]."""
    wave_speed: float = 150.0
    """Speed c_P of a compression wave, whose impedance rho_s c_P damps the foot [m/s]."""
    slip_speed: float = 0.02
    """Speed of slip v_s at which friction has 0.71 of its full value [m/s]."""
    water: float = math.inf
    """Depth of the water table [m], below which soil presses on foot and sides by its weight under water."""
    slope: float = 0.0
    """Angle at which the ground falls away behind the boulder [rad]."""
    varies: bool = True
    """Whether soil that a face meets at another depth may be weaker or softer for that depth."""


class HeaveOptions(NamedTuple):
    """What is added to the planar motion."""

    heave: bool
    """Whether the boulder may rise; if not, the couple of its weight holds it as in the planar motion."""
    friction: bool
    """Whether faces, foot and sides rub."""


class HeaveConstants(NamedTuple):
    """What the motion of one design depends on."""

    c: Any
    """Constants of the planar motion, with corrected readings and the soil in closed form: `Constants` in uniform soil
    beside a box, `SoilConstants` where the workspace holds the parts of the soil, with a ``soil`` that is not None
    where it holds the faces beside them, too."""
    heave: float
    """1 where the boulder may rise, else 0."""
    m_b: float
    """Mass of the boulder [kg]."""
    a_b: float
    """Centre of the boulder right of the common centre of mass [m]."""
    b_b: float
    """Centre of the boulder over the common centre of mass [m]."""
    J_b: float
    """Moment of inertia of the boulder about the common centre of mass [kg m^2]."""
    M_soil: float
    """Sum of m_n [kg]."""
    M_first: float
    """Sum of m_n d_n [kg m]."""
    M_second: float
    """Sum of m_n d_n^2 [kg m^2]."""
    L: float
    """Length of the boulder, where it is longest [m]."""
    steepest: float
    """Horizontal over vertical of the face that is inclined most; 0 of a box [-]."""
    foot: float
    """Length of its foot [m]."""
    foot_a: float
    """Near end of its foot right of the common centre of mass [m]."""
    lean: float
    """Distance of the boulder's centre from the middle of the foot, towards the vehicle [m]."""
    pieces: int
    """Parts of the soil, strips of the foot, and points of the sides: 16, 64, 144 or 256."""
    k_foot: float
    """Stiffness of the base under the whole foot [N/m]."""
    c_foot: float
    """Dashpot under the whole foot [N s/m]."""
    q_foot: float
    """Bearing capacity of the whole foot [N]."""
    s_0: float
    """Settlement under the weight of the boulder [m]."""
    friction: float
    """Coefficient of friction tan(delta); 0 without friction."""
    side: float
    """Friction of both sides per mean depth of their points [N/m]."""
    v_s: float
    """Speed of slip at which friction has 0.71 of its full value [m/s]."""
    sunk: float
    """How far a far face that narrows upwards counts as sunk where the least energy is looked for; 0 in motion [m]."""


class Forces(NamedTuple):
    """Generalised forces, and the compression of the vehicle's spring."""

    Q_x: float
    """Force along X [N]."""
    Q_y: float
    """Force upwards, along Y [N]."""
    Q_theta: float
    """Moment about the common centre of mass [N m]."""
    u: float
    """Compression of the vehicle's spring [m]; below zero the truck has come off."""


@kernel
def bearing_capacity_factor(phi: float) -> float:
    """Bearing capacity factor N_q of a friction angle [rad], by Prandtl and Reissner (Eq 133)."""
    return math.exp(math.pi * math.tan(phi)) * passive_pressure_coefficient(phi)


@kernel
def falling_ground_factor(slope: float) -> float:
    """Bearing capacity where the ground falls by a slope [rad] over its value where it is level, by Vesic (Eq 148)."""
    return max(1.0 - math.tan(slope), 0.0) ** 2


class Bed(NamedTuple):
    """What a boulder stands on and in."""

    mass: SoilMass
    """The soil lumped on it."""
    density: float
    """Density of the soil at the foot [kg/m^3]."""
    phi: float
    """Friction angle of the soil at the foot [rad]."""
    stress: float
    """Effective vertical stress at the depth of the foot [Pa]."""
    side: float
    """Friction of both sides per mean depth of their points [N/m]; what `lay_soil` multiplies for it in other soil."""


@inlined
def friction_of(phi: float, form: HeaveOptions) -> float:
    """Coefficient of friction tan(2/3 phi) between boulder and soil (Eq 134), zero without friction."""
    return math.tan(2.0 / 3.0 * phi) if form.friction else 0.0


@kernel
def heave_constants(design: Design, c: Constants, form: HeaveOptions, base: Base, fineness: int) -> HeaveConstants:
    """Constants of the motion of a box in uniform soil with heave and friction (Eqs 131-134).

    ``design``: the design, SI; its ``K_epsilon`` carries the law of the resistance; ``c``: its
    `boulder_kernels.design.constants_of`, with corrected readings and the soil in closed form; ``fineness``: 1 for 16
    pieces, up to `FINEST`; their number grows by its square.
    """
    density = design.rho_s - (WATER if base.water <= 0.0 else 0.0)
    friction = friction_of(design.phi, form)
    side = 2.0 * friction * (1.0 - math.sin(design.phi)) * density * G * design.L * design.d
    bed = Bed(soil_mass(design, 0), design.rho_s, design.phi, density * G * design.d, side)
    reach = Reach(design.L, 0.0, design.W)
    return constants_on(bed, body_of_box(design), reach, c, form, base, fineness)


class Reach(NamedTuple):
    """What of an outline holds for the boulder as a whole."""

    L: float
    """Length where it is longest [m]."""
    steepest: float
    """Horizontal over vertical of the face that is inclined most; 0 of a box [-]."""
    foot_width: float
    """Width of its foot [m]."""


@inlined
def reach_of(design: Design, outline: np.ndarray) -> Reach:
    """Return the reach of a boulder with an outline, shape (P, 4), or of the box of the design."""
    if len(outline) == 0:
        return Reach(design.L, 0.0, design.W)
    near = far = steepest = 0.0
    for i in range(len(outline)):
        near, far = max(near, outline[i, REACH_NEAR]), max(far, outline[i, REACH_FAR])
        if i > 0:
            steepest = max(
                steepest, max(slope_of(outline, i - 1, REACH_NEAR), abs(slope_of(outline, i - 1, REACH_FAR)))
            )
    return Reach(near + far, steepest, outline[0, WIDTH])


@kernel
def constants_on(
    bed: Bed, body: Body, reach: Reach, c: Any, form: HeaveOptions, base: Base, fineness: int
) -> HeaveConstants:
    """Constants of the motion of a body with heave and friction (Eqs 131-134) on a bed; see `heave_constants`."""
    m_b = body.m_b
    soil = bed.mass
    a_b, b_b = body.x - c.c_x, body.y - c.c_y
    length = 2.0 * body.foot
    foot = reach.foot_width * length
    return HeaveConstants(
        c,
        1.0 if form.heave else 0.0,
        m_b,
        a_b,
        b_b,
        body.J + m_b * (a_b * a_b + b_b * b_b),
        soil.mass,
        c.c_y * soil.mass - soil.first,
        c.c_y * c.c_y * soil.mass - 2.0 * c.c_y * soil.first + soil.second,
        reach.L,
        reach.steepest,
        length,
        body.x + body.lean - body.foot - c.c_x,
        body.lean,
        GROUP * fineness * fineness,
        base.stiffness * foot,
        bed.density * base.wave_speed * foot,
        bed.stress * bearing_capacity_factor(bed.phi) * falling_ground_factor(base.slope) * foot,
        m_b * G / (base.stiffness * foot),
        friction_of(bed.phi, form),
        bed.side,
        base.slip_speed,
        0.0,
    )


@kernel
def prepare(work: np.ndarray, f: HeaveConstants) -> None:
    """Fill a workspace, shape (ROOM,), for a design at rest."""
    c = f.c
    fineness = round(math.sqrt(f.pieces // GROUP))
    edge, tilt = 0.0, 12.0 * f.s_0 * f.lean / f.foot
    for n in range(f.pieces):
        # Strips between the feet of evenly spread points of a half circle. They carry the boulder at rest, below its
        # centre more than elsewhere.
        next_edge = 0.5 * sine_versine(math.pi * (n + 1.0) / f.pieces).versin
        middle = 0.5 * (edge + next_edge)
        put(work, SETS, n, tilt * (middle - 0.5))
        put(work, FOOT, n, f.foot * middle + f.foot_a)
        put(work, STRIP, n, next_edge - edge)
        edge = next_edge
        square, point = n // GROUP, n % GROUP
        row, column = point // 4, point % 4
        put(work, SIDE_A, n, f.L * ((square % fineness + SIDE_POINTS[column]) / fineness) - c.c_x)
        put(work, SIDE_DEPTH, n, c.d * ((square // fineness + SIDE_POINTS[row]) / fineness))
        put(work, SIDE, n, f.side * SIDE_WEIGHTS[row] * SIDE_WEIGHTS[column] * GROUP / f.pieces)


@inlined
def vertical_stress(depth: float, layers: np.ndarray, water: float) -> float:
    """Effective vertical stress at a depth [Pa] (Eq 106); the last layer reaches down without end."""
    stress = top = 0.0
    for m in range(len(layers)):
        low = max(min(layers[m, TO], depth), top)
        stress += G * (layers[m, DENSITY] * (low - top) - WATER * max(low - max(top, water), 0.0))
        top = low
    return stress


@inlined
def layer_under(depth: float, layers: np.ndarray) -> int:
    """Return the number of the layer that lies under a depth [m]."""
    m = 0
    while m < len(layers) - 1 and layers[m, TO] <= depth:
        m += 1
    return m


@kernel
def bed_of(design: Design, length: float, mass: SoilMass, layers: np.ndarray, form: HeaveOptions, base: Base) -> Bed:
    """Return what a boulder of a length in layers of soil, shape (M, 6), stands on (Eq 148)."""
    under = layer_under(design.d, layers)
    phi, stress = layers[under, FRICTION], vertical_stress(design.d, layers, base.water)
    side = 2.0 * friction_of(phi, form) * length * design.d
    return Bed(mass, layers[under, DENSITY], phi, stress, side)


@inlined
def edge_of(n: int, count: int, parts: np.ndarray) -> float:
    """Return the ratio of the depth at which part n of so many begins: a boundary of pieces, (M, 9), if one is nearest.

    A part that a boundary cuts would yield as a whole, and not one side of it after the other.
    """
    for m in range(len(parts) - 1):
        if 0 < n < count and int(parts[m, 1] * count + 0.5) == n:
            edge: float = parts[m, 1]
            return edge
    return n / count


class Faces(NamedTuple):
    """Where the faces of a boulder press on a part of the soil."""

    far: float
    near: float
    """Far and near face right of the common centre of mass [m]."""
    far_slope: float
    near_slope: float
    """What these grow by per height, but 0 where the near face narrows upwards [-] (Eq 150)."""


@inlined
def faces_of_box(f: HeaveConstants) -> Faces:
    """Return the faces of a box."""
    return Faces(f.c.l_n, f.c.l_n - f.L, 0.0, 0.0)


@inlined
def faces_between(low: float, high: float, outline: np.ndarray, f: HeaveConstants) -> Faces:
    """Return the faces of a boulder with an outline, shape (P, 4), between two heights over its foot [m]."""
    if len(outline) == 0:
        return faces_of_box(f)
    middle, inverse = f.foot_a + outline[0, REACH_NEAR], 1.0 / (high - low)
    far, far_to = at_height(outline, REACH_FAR, low), at_height(outline, REACH_FAR, high)
    near, near_to = at_height(outline, REACH_NEAR, low), at_height(outline, REACH_NEAR, high)
    return Faces(
        middle + 0.5 * (far + far_to),
        middle - 0.5 * (near + near_to),
        (far_to - far) * inverse,
        min(near - near_to, 0.0) * inverse,
    )


@kernel
def lay_soil(
    work: np.ndarray, layers: np.ndarray, outline: np.ndarray, base: Base, soil: ManyPieces, f: HeaveConstants
) -> None:
    """Write the parts of a soil and the faces beside them into a workspace that `prepare` has filled (Eqs 149, 150).

    As a face rises or falls, its parts press on the soil of another depth. Strength and stiffness of a part grow in
    proportion to its depth, as in uniform soil, and nowhere exceed the soil from `FALL` below its lower end to `RISE`
    above its upper end: for its depth, it is as weak and as soft as the weakest and the softest there. So coarse parts
    err on the safe side. The width is the boulder's beside the part. Sides that widen upwards lose the soil as they
    rise and do not rub. Cohesion gives no friction. The boulder's buoyancy and the soil below the foot are left out.

    ``work``: the workspace; ``layers, outline``: layers, shape (M, 6), and outline, shape (P, 4), of the design;
    ``base``: the ground under the foot, with its water; ``soil``: pieces of the soil beside the boulder, filled.
    """
    d, parts, reach = f.c.d, soil.pieces, f.heave if base.varies else 0.0
    foot = math.tan(2.0 / 3.0 * layers[layer_under(d, layers), FRICTION])
    for n in range(f.pieces):
        low, to = edge_of(n, f.pieces, parts), edge_of(n + 1, f.pieces, parts)
        r, inverse = 0.5 * (low + to), 1.0 / (to - low)
        spring = ultimate = drag = width = 0.0
        for m in range(len(parts)):
            start, end = max(parts[m, 0], low), min(parts[m, 1], to)
            if start < end:
                i, w_0, w_1 = combined(powers_of(end), -1.0, powers_of(start)), parts[m, 7], parts[m, 8]
                spring += parts[m, 2] * (w_0 * i.two + w_1 * i.three)
                ultimate += parts[m, 4] * (w_0 * i.one + w_1 * i.two) + parts[m, 5] * (w_0 * i.two + w_1 * i.three)
                drag += parts[m, 6] * (w_0 * i.one + w_1 * i.two)
                width += w_0 * i.one + w_1 * i.two
        soft, weak, half = spring / (width * r), ultimate / (width * r), 0.5 * (to - low)
        top, bottom = r - reach * (RISE * f.L / d + half), r + reach * (FALL * f.L / d + half)
        for m in range(len(parts)):
            K, P_0, P_1 = parts[m, 2], parts[m, 4], parts[m, 5]
            start, end = max(parts[m, 0], top), min(parts[m, 1], bottom)
            if start < end:
                soft, weak = min(soft, K), min(weak, P_0 / (start if P_0 < 0.0 else end) + P_1)
        put(work, RATIO, n, r)
        put(work, HEIGHT, n, (to - low) * f.pieces)
        put(work, INVERSE_HEIGHT, n, inverse / f.pieces)
        put(work, STIFFNESS, n, soft * width / d)
        put(work, YIELD, n, weak / soft)
        put(work, DRAG, n, drag)
        faces = faces_between(d - to * d, d - low * d, outline, f)
        for side in range(4):
            put(work, FACES + ROW * side, n, faces[side])
        above = rough = 0.0
        for m in range(len(layers)):
            below = layers[m, TO] / d if m < len(layers) - 1 else 1.0
            length = max(min(below, to) - max(above, low), 0.0)
            rough += length * inverse * math.tan(2.0 / 3.0 * layers[m, FRICTION])
            above = below
        put(work, ROUGHNESS, n, rough / foot)
        depth = field(work, SIDE_DEPTH, n)
        phi = layers[layer_under(depth, layers), FRICTION]
        pressure = (1.0 - math.sin(phi)) * vertical_stress(depth, layers, base.water) / depth
        put(work, SIDE, n, field(work, SIDE, n) * pressure * math.tan(2.0 / 3.0 * phi) / foot)
        if len(outline) > 0:
            near, far = at_height(outline, REACH_NEAR, d - depth), at_height(outline, REACH_FAR, d - depth)
            share, middle = (field(work, SIDE_A, n) + f.c.c_x) / f.L, f.foot_a + outline[0, REACH_NEAR]
            put(work, SIDE_A, n, middle - near + (near + far) * share)
            rubs = slope_of(outline, piece_at(outline, min(d - depth, outline[-1, 0])), WIDTH) <= ROUNDING
            put(work, SIDE, n, field(work, SIDE, n) * (near + far) / f.L if rubs else 0.0)


@inlined
def summed(work: np.ndarray, offset: int, pieces: int) -> float:
    """Add up what the pieces have of a sum, sixteen at a time by halves."""
    result = 0.0
    for n in range(offset, offset + pieces, GROUP):
        one = (field(work, n, 0) + field(work, n, 8)) + (field(work, n, 4) + field(work, n, 12))
        two = (field(work, n, 2) + field(work, n, 10)) + (field(work, n, 6) + field(work, n, 14))
        three = (field(work, n, 1) + field(work, n, 9)) + (field(work, n, 5) + field(work, n, 13))
        four = (field(work, n, 3) + field(work, n, 11)) + (field(work, n, 7) + field(work, n, 15))
        result += (one + two) + (three + four)
    return result


@inlined
def slipping(v: float, f: HeaveConstants) -> float:
    """Share of the full friction that opposes a slip of speed v, with its sign: v / sqrt(v^2 + v_s^2) (Eq 134)."""
    return v / math.sqrt(v * v + f.v_s * f.v_s)


class Parts(NamedTuple):
    """What the parts of the soil have in common at a state."""

    share: float
    """Height of each as a share of the depth."""
    w: float
    """Difference of the displacements at its ends [m]."""
    inverse_w: float
    """Reciprocal of w [1/m]."""
    slope_w: float
    """Slope of w by the rotation [m]."""
    stiffness: float
    """Stiffness of its springs per depth [N/m^2]."""
    drag: float
    """Drag of the part at a velocity of 1 m/s [N s^2/m^2]."""
    inverse_cover: float
    """What its depth is multiplied by for the share of its drag: it drags in full where half of it is covered [1/m]."""


@inlined
def parts_of_soil(sin: float, k: Kinematics, f: HeaveConstants) -> Parts:
    """Return what the parts of the soil have in common."""
    share = 1.0 / f.pieces
    w = max(abs(k.slope_x) * share, TINY)
    slope_w = math.copysign(k.lever_d * share, sin)
    inverse_d = 1.0 / f.c.d
    return Parts(
        share, w, 1.0 / w, slope_w, f.c.K_soil * share * inverse_d, f.c.R_soil * share, 2.0 * f.pieces * inverse_d
    )


class Part(NamedTuple):
    """What one part of the soil is like at a state."""

    ratio: float
    """Depth of its middle over the embedment depth [-]."""
    w: float
    inverse_w: float
    slope_w: float
    """What `Parts` says of the parts of a uniform soil, for this one."""
    stiffness: float
    """Stiffness of its springs per depth [N/m^2]."""
    x_yield: float
    """Displacement at which it reaches its ultimate resistance [m]."""
    drag: float
    """Its drag at a velocity of 1 m/s [N s^2/m^2]."""
    inverse_cover: float
    """What its depth is multiplied by for the share of its drag, see `Parts` [1/m]."""
    roughness: float
    """Coefficient of its friction over the foot's [-]."""
    faces: Faces
    """Where the boulder presses on it."""


@by_types
def part_of_soil(n: Any, work: Any, p: Any, f: Any) -> Callable[..., Part]:
    """Return what gives part n of the soil: from the workspace, but beside a box in uniform soil, all are alike."""
    if has_outline(f):
        return lambda n, work, p, f: laid_part(n, work, p, laid_faces(n, work))
    if type_of(f[0]) is SoilConstants:
        return lambda n, work, p, f: laid_part(n, work, p, faces_of_box(f))
    return lambda n, work, p, f: uniform_part(n, p, f)


def has_outline(f: Any) -> bool:
    """Return whether faces lie in the workspace, by the type of the constants."""
    return type_of(f[0]) is SoilConstants and not is_none(f[0][-1])


@inlined
def uniform_part(n: int, p: Parts, f: HeaveConstants) -> Part:
    """Return part n of a uniform soil."""
    ratio = (n + 0.5) * p.share
    faces = faces_of_box(f)
    return Part(ratio, p.w, p.inverse_w, p.slope_w, p.stiffness, f.c.x_yield, p.drag, p.inverse_cover, 1.0, faces)


@inlined
def laid_faces(n: int, work: np.ndarray) -> Faces:
    """Return the faces beside part n of the soil that `lay_soil` has written."""
    a = FACES + ROW
    return Faces(field(work, FACES, n), field(work, a, n), field(work, a + ROW, n), field(work, a + 2 * ROW, n))


@inlined
def laid_part(n: int, work: np.ndarray, p: Parts, faces: Faces) -> Part:
    """Return part n of the soil that `lay_soil` has written."""
    height, inverse = field(work, HEIGHT, n), field(work, INVERSE_HEIGHT, n)
    return Part(
        field(work, RATIO, n),
        p.w * height,
        p.inverse_w * inverse,
        p.slope_w * height,
        field(work, STIFFNESS, n),
        field(work, YIELD, n),
        field(work, DRAG, n),
        p.inverse_cover * inverse,
        field(work, ROUGHNESS, n),
        faces,
    )


class Beyond(NamedTuple):
    """Averages along a part of the soil in which u goes in a line from u - w/2 to u + w/2 (Eq 132)."""

    share: float
    """Share of the part where u > q."""
    energy: float
    """(u - q)^2/2 where u > q, and 0 elsewhere [m^2]."""
    slope: float
    """Slope of that average by u at the middle [m]: u - q where u > q."""
    widening: float
    """Slope of that average by w [m]."""


@inlined
def beyond(u: float, q: float, p: Part) -> Beyond:
    """Return the averages beyond q, exactly, without a branch and without a difference of large numbers."""
    over = max(u - q + 0.5 * p.w, 0.0)
    length = min(over, p.w)
    share, mean = length * p.inverse_w, over - 0.5 * length
    energy = share * (0.5 * mean * mean + (1.0 / 24.0) * length * length)
    return Beyond(share, energy, share * mean, share * length * (0.25 - (1.0 / 6.0) * share))


class FaceForces(NamedTuple):
    """What one part of the soil does to one face."""

    spring: float
    """Force of its springs [N]."""
    drag: float
    """Drag on that face, along X [N]."""
    widening: float
    """Slope of the energy by the difference of the displacements at its ends [N]."""
    lift: float
    """Vertical force: what its energy loses per rise of the face [N]."""
    energy: float
    """Energy in its springs [J]."""
    stiffness: float
    """What the force of its springs grows by, per displacement [N/m]."""


@inlined
def pressed(u: float, drag: float, z: float, part: Part, f: HeaveConstants) -> FaceForces:
    """Return what a part does to a face that presses on it where u > 0 and is in soil z deep, by its middle."""
    all_of_it, yielded = beyond(u, 0.0, part), beyond(u, part.x_yield, part)
    depth = max(z, 0.0)
    energy = part.stiffness * (all_of_it.energy - yielded.energy)
    covered = min(depth * part.inverse_cover, 1.0)
    return FaceForces(
        part.stiffness * depth * (all_of_it.slope - yielded.slope),
        all_of_it.share * covered * drag,
        part.stiffness * depth * (all_of_it.widening - yielded.widening),
        f.heave * energy if z > 0.0 else 0.0,
        energy * depth,
        part.stiffness * depth * (all_of_it.share - yielded.share),
    )


class Element(NamedTuple):
    """One part of the soil (Eq 132)."""

    spring: float
    """Force of its springs on the boulder [N]."""
    far: float
    """Force of springs and drag where it is pushed forward [N]."""
    near: float
    """Force of springs and drag where it is pushed back [N]."""
    turning: float
    """Moment of these and of the lift about the common centre of mass [N m]."""
    lift: float
    """Vertical force on the boulder [N]."""
    energy: float
    """Energy in its springs [J]."""
    roughness: float
    """Coefficient of its friction over the foot's [-]."""
    faces: Faces
    """Where the boulder presses on it."""
    stiffness: float
    """What the force of its springs grows by, per displacement [N/m]."""


@inlined
def soil_element(
    n: int,
    y_b: float,
    w_b: float,
    omega_b: float,
    sin: float,
    versin: float,
    k: Kinematics,
    p: Parts,
    work: np.ndarray,
    f: HeaveConstants,
) -> Element:
    """Forces and energy of part n of the soil (Eqs 132, 150).

    Its depth follows the rise of the faces that press on it. A face that widens upwards leaves the soil as it rises,
    and what it is pressed in with lifts it. A far face that narrows upwards leaves it as it sinks, and is held down.
    """
    c, part = f.c, part_of_soil(n, work, p, f)
    ratio, a = part.ratio, part.faces
    u, v = k.A - k.slope_x * ratio, k.B - k.slope_v * ratio
    alpha, cos = c.d * ratio, 1.0 - versin
    d_n = alpha - c.z_0
    z = alpha - f.heave * (y_b + d_n * versin)
    z_far, z_near = z + f.heave * a.far * sin, z + f.heave * a.near * sin
    rising = f.heave * (w_b + omega_b * d_n * sin)
    sunk = (a.far_slope < 0.0) & (f.sunk > 0.0)
    far_rise, far_slope = -f.sunk if sunk else alpha - z_far, 0.0 if sunk else a.far_slope
    v_far = v - times(a.far_slope, rising - f.heave * omega_b * a.far * cos)
    v_near = v - times(a.near_slope, rising - f.heave * omega_b * a.near * cos)
    far = pressed(u - times(a.far_slope, far_rise), -part.drag * v_far * abs(v_far), z_far, part, f)
    near = pressed(times(a.near_slope, alpha - z_near) - u, -part.drag * v_near * abs(v_near), z_near, part, f)
    F_far, F_near = far.drag - far.spring, near.drag + near.spring
    lift_far = far.lift - times(f.heave * far_slope, F_far)
    lift_near = near.lift - times(f.heave * a.near_slope, F_near)
    lift = lift_far + lift_near
    turning = lift * d_n * sin - (lift_far * a.far + lift_near * a.near) * cos
    turning -= (F_far + F_near) * (k.lever_d * ratio + k.q) + (far.widening + near.widening) * part.slope_w
    spring, energy, stiffness = near.spring - far.spring, far.energy + near.energy, far.stiffness + near.stiffness
    return Element(spring, F_far, F_near, turning, lift, energy, part.roughness, a, stiffness)


class Levers(NamedTuple):
    """Where the friction of the faces acts, right of the common centre of mass."""

    far: float
    near: float


@by_types
def put_levers(n: Any, a: Any, far: Any, near: Any, work: Any, f: Any) -> Callable[..., None]:
    """Return what notes what presses on the faces of a part times their levers, where these differ."""
    if has_outline(f):
        return lambda n, a, far, near, work, f: put_turnings(n, a, far, near, work)
    return lambda n, a, far, near, work, f: None


@inlined
def put_turnings(n: int, a: Faces, far: float, near: float, work: np.ndarray) -> None:
    """Write what presses on the faces of part n of the soil times their levers."""
    put(work, TURNING_FAR, n, far * a.far)
    put(work, TURNING_NEAR, n, near * a.near)


@by_types
def levers_of(far: Any, near: Any, work: Any, f: Any) -> Callable[..., Levers]:
    """Return what gives the levers of the faces by what presses on them as a whole."""
    if has_outline(f):
        return lambda far, near, work, f: Levers(
            summed(work, TURNING_FAR, f.pieces) / max(far, TINY), summed(work, TURNING_NEAR, f.pieces) / max(near, TINY)
        )
    return lambda far, near, work, f: Levers(f.c.l_n, f.c.l_n - f.L)


class Strip(NamedTuple):
    """One strip of the foot (Eq 133)."""

    push: float
    """What the base pushes up with, spring and dashpot [N]."""
    X: float
    """Position of the strip right of the common centre of mass [m]."""
    Y: float
    """Position of the strip over the common centre of mass [m]."""


@inlined
def strip_depth(work: np.ndarray, j: int, y_b: float, sin: float, versin: float, f: HeaveConstants) -> float:
    """Depth of strip j of the foot below the unloaded base, over its set [m]."""
    return f.s_0 - y_b + field(work, FOOT, j) * sin - f.c.c_y * versin - field(work, SETS, j)


@inlined
def foot_strip(
    work: np.ndarray, j: int, y_b: float, w_b: float, omega_b: float, sin: float, versin: float, f: HeaveConstants
) -> Strip:
    """Forces under strip j of the foot.

    The dashpot grows with the pressure up to the pressure at rest, so that a strip that touches down meets no jump,
    and spring and dashpot together neither pull nor push more than the bearing capacity.
    """
    a, cos, share = field(work, FOOT, j), 1.0 - versin, field(work, STRIP, j)
    X, Y = a * cos - f.c.c_y * sin, -a * sin - f.c.c_y * cos
    elastic = min(max(f.k_foot * strip_depth(work, j, y_b, sin, versin, f), 0.0), f.q_foot)
    on = min(elastic * (1.0 / (f.k_foot * f.s_0)), 1.0)
    total = min(max(elastic - on * f.c_foot * (w_b - omega_b * X), 0.0), f.q_foot)
    return Strip(share * total, X, Y)


@inlined
def forces(
    x_b: float,
    v_b: float,
    theta_b: float,
    omega_b: float,
    y_b: float,
    w_b: float,
    x_v: float,
    v_v: float,
    touching: bool,
    work: np.ndarray,
    f: HeaveConstants,
) -> Forces:
    """Generalised forces at a state (Eqs 132-135).

    ``x_b, v_b``: displacement of the common centre of mass [m] and its velocity [m/s]; ``theta_b, omega_b``: rotation
    [rad] and angular velocity [rad/s]; ``y_b, w_b``: rise of the common centre of mass [m] and its velocity [m/s];
    ``x_v, v_v``: the truck; ``touching``: whether truck and boulder touch; ``work``: the workspace of the design.
    """
    c = f.c
    sin, versin = sine_versine(theta_b)
    cos = 1.0 - versin
    k = soil_kinematics(x_b, v_b, omega_b, sin, versin, c)
    p = parts_of_soil(sin, k, f)
    for n in range(f.pieces):
        e = soil_element(n, y_b, w_b, omega_b, sin, versin, k, p, work, f)
        a, depth = field(work, SIDE_A, n), field(work, SIDE_DEPTH, n)
        b = c.z_0 - depth
        X, Y = a * cos + b * sin, b * cos - a * sin
        v_x, v_y = v_b + omega_b * Y, w_b - omega_b * X
        held = field(work, SIDE, n) * max(depth - f.heave * y_b, 0.0)
        side_slip = math.sqrt(v_x * v_x + v_y * v_y + f.v_s * f.v_s)
        s = foot_strip(work, n, y_b, w_b, omega_b, sin, versin, f)
        slip = v_b + omega_b * s.Y
        foot_slip = math.sqrt(slip * slip + f.v_s * f.v_s)
        # One division for both shares of the full friction (Eq 134).
        inverse = 1.0 / (side_slip * foot_slip)
        share, push = -held * foot_slip * inverse, f.heave * s.push
        rub = -f.friction * push * slip * side_slip * inverse
        put(work, ALONG_X, n, e.far + e.near + share * v_x + rub)
        put(work, TURNING, n, e.turning + share * (v_x * Y - v_y * X) + rub * s.Y - push * s.X)
        put(work, LIFTING, n, e.lift + share * v_y + push)
        on_far = e.roughness * (max(-e.far, 0.0) + max(-e.near, 0.0))
        on_near = e.roughness * (max(e.far, 0.0) + max(e.near, 0.0))
        put(work, FAR, n, on_far)
        put(work, NEAR, n, on_near)
        put_levers(n, e.faces, on_far, on_near, work, f)
    far, near = summed(work, FAR, f.pieces), summed(work, NEAR, f.pieces)
    # The faces slip along themselves, each with the speed of the point where it is pressed on.
    along, at = v_b * sin + w_b * cos, levers_of(far, near, work, f)
    F_far = -f.friction * far * slipping(along - omega_b * at.far, f)
    F_near = -f.friction * near * slipping(along - omega_b * at.near, f)
    Q_x = summed(work, ALONG_X, f.pieces) + (F_far + F_near) * sin
    Q_y = summed(work, LIFTING, f.pieces) + (F_far + F_near) * cos
    Q_theta = summed(work, TURNING, f.pieces) - F_near * at.near - F_far * at.far
    weight = f.m_b * G
    if f.heave > 0.0:
        Q_theta += weight * (f.a_b * cos + f.b_b * sin)
        Q_y -= weight
    else:
        # The whole weight, on the corner that the boulder turns about (Eq 135).
        on_end = min(max(sin / seated_sine(f), -1.0), 1.0)
        a = f.a_b + 0.5 * f.foot * on_end + f.lean * abs(on_end)
        X, Y = a * cos - c.c_y * sin, -a * sin - c.c_y * cos
        rub = -f.friction * weight * slipping(v_b + omega_b * Y, f)
        Q_x += rub
        Q_theta += rub * Y + weight * (f.a_b * cos + f.b_b * sin - X)

    u = spring_compression(x_v, v_v, contact_displacement(x_b, sin, versin, c), c)
    F_v = c.k_v * u if touching else 0.0
    return Forces(Q_x + F_v, Q_y, Q_theta + F_v * contact_lever(sin, versin, c), u)


@inlined
def seated_sine(f: HeaveConstants) -> float:
    """Sine of the rotation at which the weight is on the end of the foot, when the boulder may not rise (Eq 135)."""
    return 6.0 * f.s_0 / f.foot


class Inertia(NamedTuple):
    """What resists a rotation (Eq 131)."""

    A: float
    """Moment of inertia [kg m^2]."""
    S: float
    """Half its derivative by the rotation [kg m^2]."""
    X: float
    """Centre of the boulder right of the common centre of mass [m]."""
    Y: float
    """Centre of the boulder over the common centre of mass [m]."""


@inlined
def inertia_at(sin: float, cos: float, f: HeaveConstants) -> Inertia:
    """Inertia at a rotation: the lumped soil moves sideways only where the boulder may rise (Eq 131)."""
    l_n = f.c.l_n
    X, Y = f.a_b * cos + f.b_b * sin, f.b_b * cos - f.a_b * sin
    turned = l_n * l_n * sin * sin * f.M_soil + 2.0 * l_n * sin * cos * f.M_first + cos * cos * f.M_second
    slope = l_n * l_n * sin * cos * f.M_soil + l_n * (cos * cos - sin * sin) * f.M_first - sin * cos * f.M_second
    A = f.J_b + turned if f.heave > 0.0 else f.c.J_eff
    return Inertia(A, f.heave * slope, X, Y)


@inlined
def accelerations(theta_b: float, omega_b: float, Q: Forces, touching: bool, f: HeaveConstants) -> tuple[float, ...]:
    """Accelerations of x_b, theta_b, y_b and x_v (Eq 131)."""
    sin, versin = sine_versine(theta_b)
    i = inertia_at(sin, 1.0 - versin, f)
    turning = Q.Q_theta - i.S * omega_b * omega_b
    rising = f.heave * (Q.Q_y / f.m_b + i.Y * omega_b * omega_b)
    coupled = f.heave * i.X
    alpha_b = (turning + f.m_b * coupled * rising) / (i.A - f.m_b * coupled * coupled)
    a_v = -f.c.k_m * Q.u if touching else 0.0
    return Q.Q_x * f.c.inverse_m_eff, alpha_b, rising + coupled * alpha_b, a_v
