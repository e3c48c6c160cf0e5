"""The second opinion: a boulder that may rise, on a base that only pushes, held by friction (Eqs 131 to 137).

Written from `docs/model.md`. Every force acts at a point of the boulder, and generalised forces are the sum of
transposed Jacobians times forces. The masses, too, are points: the boulder's own centre, which also turns, and three
points of lumped soil, whose sums of m_n, m_n d_n and m_n d_n^2 are the integrals over the depth. The truck is
the jerk of Eq 45. In layers of soil its parts have values of their own (Eqs 148, 149), and each stretch between two
boundaries has three points. A boulder that is no box is given by its outline: rows of height over the foot, width,
reach towards the vehicle and reach away from it, both from the middle of the foot (Eqs 141 to 145, 150).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import atan2, cos, exp, hypot, pi, sin, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from .constants import Constants, constants, impact_lever, shear_wedge_angle
from .ground import ultimate_pressure, vertical_stress
from .inputs import CORRECTED, GRAVITY, Ground, Inputs, Layer, layer_at
from .soil import lateral_coefficient, spring_energies, spring_forces
from .vehicle import crush_force, jerk

Array = NDArray[np.float64]

GROUP = 16
"""Parts of the soil, strips of the foot, and points of the sides, for each square of the fineness."""
_GAUSS = np.polynomial.legendre.leggauss(4)
_LONGEST_STEP = 1e-3  # [s]: what is pressed in for good is noted after each
_ABSOLUTE = np.array([1e-11, 1e-11, 1e-11, 1e-10, 1e-10, 1e-10, 1e-11, 1e-10, 1e-8])
_SAMPLES = 8
RISE, FALL = 0.45, 0.25
"""How far a face rises and falls at most, over the length of the boulder (Eq 149)."""


@dataclass(frozen=True)
class Base:
    """Stiffness k_b [N/m^3] and speed of waves c_P [m/s] of the base, speed v_s [m/s] at which friction sets in."""

    stiffness: float = 100e6
    wave_speed: float = 150.0
    slip_speed: float = 0.02


@dataclass(frozen=True)
class Body:
    """One impact: what is pressed on and where, in the frame of the boulder at rest, from the common centre of mass.

    Points have the shape (n, 2): to the right and up.
    """

    inputs: Inputs
    heave: bool
    friction: bool
    base: Base
    fineness: int = 1
    as_it_lies: bool = False
    """Whether faces press on the soil at their present depth, as it lies there; by Eq 149 if not."""
    outline: Array | None = None
    both_ways: bool = False
    """Whether the inclination of the near face counts where it holds the boulder down, too."""
    constants: Constants = field(init=False)
    own: Array = field(init=False)
    """The boulder's own centre."""
    alpha: Array = field(init=False)
    """Depths of the middles of the parts of the soil [m]."""
    height: Array = field(init=False)
    """Their heights [m]."""
    d_n: Array = field(init=False)
    foot: Array = field(init=False)
    strips: Array = field(init=False)
    """Areas of the strips of the foot [m^2]."""
    sides: Array = field(init=False)
    side_depth: Array = field(init=False)
    side_area: Array = field(init=False)
    """Areas of one side that its points stand for [m^2]."""
    soil_masses: Array = field(init=False)
    soil_points: Array = field(init=False)
    springs: Array = field(init=False)
    """Stiffness of the parts of the soil per metre of depth [N/m^2]."""
    limits: Array = field(init=False)
    """Ultimate force of the parts per metre of depth [N/m]."""
    drags: Array = field(init=False)
    """Drag of the parts over the velocity squared [kg/m]."""
    frictions: Array = field(init=False)
    """Coefficients of friction of the parts."""
    widths: Array = field(init=False)
    """Mean widths of the boulder beside the parts [m]."""
    laws: Array = field(init=False)
    """Ultimate pressure there over the pressure beside a boulder of the whole width."""
    faces: Array = field(init=False)
    """Middles of the parts on the far and the near face, shape (2, n, 2)."""
    slopes: Array = field(init=False)
    """By how much faces move to the right per height [-], shape (2, n); 0 where the near one would be held down."""
    foot_area: float = field(init=False)
    own_inertia: float = field(init=False)
    """Moment of inertia of the boulder about its own centre [kg m^2]."""
    profile: Array = field(init=False)
    """Depths [m] with stiffness and ultimate pressure of the soil added up down to them, shape (3, n)."""
    side_pressure: Array = field(init=False)
    """Friction per area and metre of depth at the points of the sides [N/m^3]."""

    def __post_init__(self) -> None:
        inputs = self.inputs
        outline = box_outline(inputs) if self.outline is None else self.outline
        solid = solid_of(inputs, outline)
        c = constants_in(inputs, outline, solid)
        pieces = GROUP * self.fineness**2
        levels = edges_of(inputs, outline, pieces)
        alpha = (levels[1:] + levels[:-1]) / 2
        cells = np.arange(self.fineness)[:, None] + (_GAUSS[0] + 1) / 2
        share = np.tile(_GAUSS[1] / 2, self.fineness) / self.fineness
        depth, along = np.meshgrid(inputs.d / self.fineness * cells, cells / self.fineness, indexing="ij")
        depth, along = depth.ravel(), along.ravel()
        surface = inputs.d - c.c_y  # soil line over the centre of mass
        middle = solid.origin - c.c_x  # of the foot
        _, near, far = at(outline, inputs.d - depth)
        _, foot_near, foot_far = at(outline, 0.0)
        edges = (foot_near + foot_far) / 2 * (1 - np.cos(np.linspace(0, pi, pieces + 1)))
        strips = (edges[1:] + edges[:-1]) / 2 + middle - foot_near
        where, masses = lumped_points(inputs, outline)
        ground = ground_of(inputs)
        friction = np.array([tan(layer_at(ground, float(z)).phi * 2 / 3) for z in depth])
        pressure = [(1 - sin(layer_at(ground, float(z)).phi)) * vertical_stress(ground, float(z)) / z for z in depth]
        longest = outline[:, 2].max() + outline[:, 3].max()
        parts = parts_of(inputs, outline, levels, longest if self.heave else 0.0)
        ends = np.stack(at(outline, inputs.d - levels))
        mean, slope = (ends[:, 1:] + ends[:, :-1]) / 2, -np.diff(ends) / np.diff(levels)
        slopes = np.stack((slope[2], -slope[1]))
        if not self.both_ways:
            slopes = np.stack((slopes[0], np.minimum(slopes[1], 0.0)))
        widens = at(outline, inputs.d - depth + 1e-6)[0] - at(outline, inputs.d - depth - 1e-6)[0] > 1e-12
        lever = {"far": middle + mean[2], "near": middle - mean[1]}
        if self.outline is None:
            lever = {"far": np.full(pieces, c.l_n), "near": np.full(pieces, c.l_n - inputs.L)}
        for name, value in {
            "constants": c,
            "own": np.array([[solid.x - c.c_x, solid.y - c.c_y]]),
            "own_inertia": solid.J,
            "alpha": alpha,
            "height": np.diff(levels),
            "d_n": alpha - surface,
            "foot": np.column_stack((strips, np.full(pieces, -c.c_y))),
            "foot_area": float(outline[0, 1] * (foot_near + foot_far)),
            "strips": outline[0, 1] * np.diff(edges),
            "sides": np.column_stack((middle - near + (near + far) * along, surface - depth)),
            "side_depth": depth,
            "side_area": (near + far) * inputs.d * np.outer(share, share).ravel() * ~widens,
            "soil_masses": masses,
            "soil_points": np.column_stack((np.full(len(where), c.l_n), surface - where)),
            "springs": parts[0],
            "limits": parts[1],
            "drags": parts[2],
            "frictions": parts[3] if self.friction else np.zeros(pieces),
            "widths": mean[0],
            "laws": law_factors(inputs, mean[0]),
            "faces": np.stack([np.column_stack((lever[name], surface - alpha)) for name in ("far", "near")]),
            "slopes": slopes,
            "profile": profile_of(inputs, ground) if self.as_it_lies else np.zeros((3, 1)),
            "side_pressure": friction * pressure if self.friction else np.zeros(len(depth)),
        }.items():
            object.__setattr__(self, name, value)

    @property
    def weight(self) -> float:
        """Weight of the boulder [N]."""
        return self.constants.m_b * GRAVITY

    @property
    def settlement(self) -> float:
        """Settlement s_0 of the base at rest [m]."""
        return self.weight / (self.base.stiffness * self.foot_area)

    @property
    def sets_at_rest(self) -> Array:
        """How far the strips of the base lie low at rest, so that they carry the boulder below its centre [m]."""
        x = self.foot[:, 0] - (self.foot[0, 0] + self.foot[-1, 0]) / 2
        lean = (self.foot[0, 0] + self.foot[-1, 0]) / 2 - self.own[0, 0]
        return np.asarray(12 * self.settlement * lean * x / self.foot_length**2)

    @property
    def foot_length(self) -> float:
        """Length of the foot [m]."""
        width = self.inputs.W if self.outline is None else self.outline[0, 1]
        return float(self.foot_area / width)

    @property
    def bearing_capacity(self) -> float:
        """Bearing capacity q of the base [Pa]."""
        phi, ground = self.under.phi, ground_of(self.inputs)
        N_q = exp(pi * tan(phi)) * (1 + sin(phi)) / (1 - sin(phi))
        return vertical_stress(ground, self.inputs.d) * N_q * max(1 - tan(ground.slope), 0.0) ** 2

    @property
    def under(self) -> Layer:
        """The soil at the foot."""
        return layer_at(ground_of(self.inputs), self.inputs.d)

    @property
    def tan_delta(self) -> float:
        """Coefficient of friction of the foot."""
        return tan(self.under.phi * 2 / 3) if self.friction else 0.0


def ground_of(inputs: Inputs) -> Ground:
    """Return the soil in layers; a uniform soil is one."""
    return inputs.ground or Ground((Layer(0.0, inputs.rho_s, inputs.phi, inputs.beta),))


def box_outline(inputs: Inputs) -> Array:
    """Return the outline of the box of the inputs."""
    return np.array([[z, inputs.W, inputs.L / 2, inputs.L / 2] for z in (0.0, inputs.H)])


def at(outline: Array, z: ArrayLike) -> tuple[Array, ...]:
    """Width and reaches at heights over the foot [m]."""
    return tuple(np.interp(z, outline[:, 0], outline[:, column]) for column in (1, 2, 3))


@dataclass(frozen=True)
class Solid:
    """A boulder by its outline, X from where it is struck: mass, own inertia, centre, mean far face, middle of foot."""

    m_b: float
    J: float
    x: float
    y: float
    line: float
    origin: float


def solid_of(inputs: Inputs, outline: Array) -> Solid:
    """Add up slices of the boulder, by five Gauss points between any two points of the outline (Eqs 141 to 145)."""
    nodes, weights = np.polynomial.legendre.leggauss(5)

    def slices(*levels: float) -> tuple[Array, Array]:
        cuts = np.unique(levels)
        halves, middles = np.diff(cuts) / 2, (cuts[1:] + cuts[:-1]) / 2
        return (middles[:, None] + halves[:, None] * nodes).ravel(), (halves[:, None] * weights).ravel()

    z, dz = slices(*outline[:, 0])
    w, near, far = at(outline, z)
    dm = inputs.rho_b * w * (near + far) * dz
    m_b, origin = dm.sum(), float(at(outline, inputs.d + inputs.e)[1])
    x, y = dm @ (far - near) / 2 / m_b, dm @ z / m_b
    J = dm @ ((near + far) ** 2 / 12 + ((far - near) / 2 - x) ** 2 + (z - y) ** 2)
    buried, db = slices(0.0, inputs.d, *(level for level in outline[:, 0] if level < inputs.d))
    line = ((inputs.d - buried) * at(outline, buried)[2]) @ db / (inputs.d**2 / 2)
    return Solid(float(m_b), float(J), float(origin + x), float(y), float(origin + line), origin)


def law_factors(inputs: Inputs, widths: Array) -> Array:
    """Return the coefficient of the resistance by local widths over that by the whole width."""
    whole = lateral_coefficient(inputs)
    return np.array([lateral_coefficient(replace(inputs, W=float(w))) / whole for w in widths])


def stretched(inputs: Inputs, low: float, high: float, outline: Array) -> tuple[Array, Array]:
    """Gauss points between two depths, three between boundaries of soil, water or outline, and their weights [m]."""
    ground = ground_of(inputs)
    changes = (*(layer.top for layer in ground.layers), ground.water, *(inputs.d - outline[:, 0]))
    within = [z for z in changes if low < z < high]
    edges = np.array(sorted({low, high, *within}))
    nodes, weights = np.polynomial.legendre.leggauss(3)
    halves, middles = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    return (middles[:, None] + halves[:, None] * nodes).ravel(), (halves[:, None] * weights).ravel()


def lumped_points(inputs: Inputs, outline: Array) -> tuple[Array, Array]:
    """Depths [m] and masses [kg] of points of lumped soil, by Eq 2 per height."""
    depths, weights = stretched(inputs, 0.0, inputs.d, outline)
    layers = [layer_at(ground_of(inputs), float(z)) for z in depths]
    wedge = np.array([layer.rho_s * tan(shear_wedge_angle(layer.phi)) for layer in layers])
    return depths, weights * at(outline, inputs.d - depths)[0] * wedge * (inputs.d - depths)


def constants_in(inputs: Inputs, outline: Array, solid: Solid) -> Constants:
    """Constants of one impact, with the centre of mass that the points of lumped soil have (Eqs 3 to 16)."""
    c = constants(inputs, CORRECTED)
    depths, masses = lumped_points(inputs, outline)
    M, height = masses.sum(), inputs.d - depths
    m_eff = M + solid.m_b
    c_x = (M * solid.line + solid.m_b * solid.x) / m_eff
    c_y = (masses @ height + solid.m_b * solid.y) / m_eff
    l_n, h = solid.line - c_x, inputs.e + inputs.d - c_y
    J_b = solid.J + solid.m_b * ((c_y - solid.y) ** 2 + (c_x - solid.x) ** 2)
    J_soil = masses @ ((height - c_y) ** 2 + l_n**2)
    changed = {"m_b": solid.m_b, "M_soil": M, "m_eff": m_eff, "c_x": c_x, "c_y": c_y, "l_n": l_n, "h": h, "J_b": J_b}
    changed |= {"J_soil": J_soil, "J_eff": J_b + J_soil, "R_v": hypot(h, c_x), "gamma_v": -atan2(c_x, h)}
    return replace(c, **changed)


def edges_of(inputs: Inputs, outline: Array, pieces: int) -> Array:
    """Depths between which parts of the soil lie [m]: even ones, some moved to boundaries of soil, water or outline."""
    edges, moved = np.linspace(0.0, inputs.d, pieces + 1), set[int]()
    ground = ground_of(inputs)
    kinks = (z for z in inputs.d - outline[1:-1, 0] if z > 0.0)
    for z in sorted((*(layer.top for layer in ground.layers), ground.water, *kinks)):
        nearest = round(z / inputs.d * pieces) if z < inputs.d else pieces
        if 0 < nearest < pieces and nearest not in moved:
            edges[nearest] = z
            moved.add(nearest)
    return edges


def parts_of(inputs: Inputs, outline: Array, edges: Array, length: float) -> Array:
    """Stiffness and ultimate force per metre of depth, drag, and friction of the parts, (4, n), Eq 149."""
    height, middles = np.diff(edges), (edges[1:] + edges[:-1]) / 2
    parts = zip(middles, height, strict=True)
    ground, length = ground_of(inputs), 0.0 if inputs.ground is None else length
    return np.stack([_part_in(inputs, ground, outline, z, high, length) for z, high in parts], axis=1)


def soil_at(inputs: Inputs, ground: Ground, z: float) -> Array:
    """Stiffness per area [N/m^3] and ultimate pressure [Pa] of the soil at a depth."""
    layer = layer_at(ground, z)
    return np.array([1e6 * layer.beta * tan(layer.phi) / inputs.d * z, ultimate_pressure(inputs, ground, z)])


def profile_of(inputs: Inputs, ground: Ground) -> Array:
    """See `Body.profile`; to twice the depth of the foot, by the midpoints of millimetres or so."""
    z = np.linspace(0.0, 2 * inputs.d, 4001)
    of = [soil_at(inputs, ground, float(middle)) for middle in (z[1:] + z[:-1]) / 2]
    return np.vstack((z, np.cumsum([np.zeros(2), *of], axis=0).T * z[1]))


def _part_in(inputs: Inputs, ground: Ground, outline: Array, alpha: float, height: float, length: float) -> Array:
    """One part of layers of soil, about the depth `alpha`: see `parts_of`."""
    depths, weights = stretched(inputs, alpha - height / 2, alpha + height / 2, outline)
    layers = [layer_at(ground, float(z)) for z in depths]
    area = weights * at(outline, inputs.d - depths)[0]
    top = max(alpha - height / 2 - RISE * length, 1e-9)
    bottom = min(alpha + height / 2 + FALL * length, inputs.d)
    changes = [z for z in (*(layer.top for layer in ground.layers), ground.water) if top < z < bottom]
    near = (top, bottom, *changes, *(z - 1e-12 for z in changes)) if length else ()
    mean = area @ [soil_at(inputs, ground, float(z)) for z in depths] / area.sum() / alpha
    k, p = np.min([mean, *(soil_at(inputs, ground, z) / z for z in near)], axis=0)
    return np.array(
        [
            k * area.sum(),
            p * area.sum() * law_factors(inputs, np.array([area.sum() / height]))[0],
            area @ [layer.rho_s for layer in layers],
            weights @ [tan(layer.phi * 2 / 3) for layer in layers] / height,
        ]
    )


def turned(points: Array, theta: float) -> Array:
    """Points of the boulder after a rotation: clockwise, by a matrix."""
    clockwise = np.array([[cos(theta), sin(theta)], [-sin(theta), cos(theta)]])
    return np.asarray(points @ clockwise.T)


def jacobians(points: Array, theta: float) -> Array:
    """Derivatives of (X, Y) of points by (x, theta, y), shape (n, 2, 3)."""
    place = turned(points, theta)
    found = np.zeros((len(points), 2, 3))
    found[:, 0, 0] = found[:, 1, 2] = 1.0
    found[:, 0, 1] = place[:, 1]
    found[:, 1, 1] = -place[:, 0]
    return found


def generalised(points: Array, forces: Array, theta: float) -> Array:
    """Generalised forces by (x, theta, y) of forces (n, 2) at points."""
    return np.asarray(np.einsum("nij,ni->j", jacobians(points, theta), forces))


def velocities(points: Array, q: Array, rates: Array) -> Array:
    """Velocities of points [m/s], shape (n, 2)."""
    return np.asarray(jacobians(points, q[1]) @ rates)


def rises(points: Array, q: Array) -> Array:
    """How far points have risen [m]."""
    return np.asarray(q[2] + turned(points, q[1])[:, 1] - points[:, 1])


def opposing(body: Body, speed: Array) -> Array:
    """Share of the full friction that opposes a slip, Eq 134."""
    return np.asarray(-speed / np.sqrt(speed**2 + body.base.slip_speed**2))


@dataclass(frozen=True)
class Stretches:
    """The soil along each part, cut where it changes the face and where it yields, as points with weights: exact.

    Arrays have the shape (2, parts, points), for the far and the near face, but where said.
    """

    points: Array
    """Points of the far face, shape (2, parts, points, 2)."""
    weights: Array
    """Shares of the part; 0 where the face does not press on it."""
    dx: Array
    """Displacement, Eq 22, less what the rise of an inclined face takes off, Eq 150 [m]."""
    depth: Array
    """Depths of the soil there [m], shape (2, parts), Eq 132."""
    springs: Array
    """Stiffness [N/m] and ultimate force [N] of the soil there, shape (2, 2, parts)."""


def springs_at(body: Body, depth: Array) -> Array:
    """Stiffness [N/m] and ultimate force [N] of the parts where faces are at some depths, shape (..., parts), first."""
    if not body.as_it_lies:
        return np.stack((depth * body.springs, depth * body.limits))
    z, *sums = body.profile
    ends = np.maximum(depth[..., None] + body.height[:, None] / 2 * np.array([-1.0, 1.0]), 0.0)
    stiff, strong = (np.diff(np.interp(ends, z, of))[..., 0] for of in sums)
    return np.stack((body.widths * stiff, body.widths * body.laws * strong))


def stretches(body: Body, q: Array) -> Stretches:
    """Cut the parts of the soil, and put three Gauss points between the cuts."""
    l_n = body.constants.l_n
    surface = body.d_n[0] - body.alpha[0]

    def displacement(alpha: Array) -> Array:
        points = np.stack((np.full_like(alpha, l_n), -(alpha + surface)), axis=-1)
        return np.asarray(q[0] + turned(points, q[1])[..., 0] - l_n)

    risen = np.stack([rises(face, q) for face in body.faces]) if body.heave else np.zeros((2, len(body.alpha)))
    depth = np.maximum(body.alpha - risen, 0.0)
    springs = springs_at(body, depth)
    yields = springs[1] / np.maximum(springs[0], 1e-9)
    top = displacement(np.zeros(1))[0]
    slope = displacement(np.ones(1))[0] - top
    ends = body.alpha[:, None] + body.height[:, None] / 2 * np.array([-1.0, 1.0])
    nodes, weights = np.polynomial.legendre.leggauss(3)
    found: list[tuple[Array, Array, Array]] = []
    for side, sign in enumerate((1, -1)):
        moved = body.slopes[side] * risen[side]
        with np.errstate(divide="ignore", invalid="ignore"):
            cuts = (np.stack((0 * moved, sign * yields[side]), axis=1) + moved[:, None] - top) / slope
        cuts = np.sort(np.clip(np.nan_to_num(cuts), ends[:, :1], ends[:, 1:]), axis=1)
        cuts = np.hstack((ends[:, :1], cuts, ends[:, 1:]))
        middles, halves = (cuts[:, 1:] + cuts[:, :-1]) / 2, np.diff(cuts, axis=1) / 2
        alpha = (middles[..., None] + halves[..., None] * nodes).reshape(len(cuts), -1)
        points = np.stack((np.full_like(alpha, l_n), -(alpha + surface)), axis=-1)
        share = (halves[..., None] * weights / body.height[:, None, None]).reshape(len(cuts), -1)
        dx = displacement(alpha) - moved[:, None]
        found.append((points, np.where(sign * dx > 0, share, 0.0), dx))
    return Stretches(*(np.stack(each) for each in zip(*found, strict=True)), depth, springs)


def lifts(body: Body, dx: Array, weights: Array, depth: Array) -> Array:
    """What the energy of the parts loses per rise of a face at some depths, shape (parts,): force upwards [N]."""
    step = 1e-4
    k_n, F_u = np.maximum(springs_at(body, np.stack((depth - step, depth + step))), 1e-9)[..., None]
    return np.diff((weights * spring_energies(k_n, F_u, dx)).sum(axis=-1), axis=0)[0] / (2 * step) * (depth > 0)


def soil_loads(body: Body, q: Array, rates: Array) -> Array:
    """Generalised forces of springs, drag, and the friction of both faces, Eqs 132, 134 and 150."""
    l_n, soil = body.constants.l_n, stretches(body, q)
    middles = np.column_stack((np.full_like(body.d_n, l_n), -body.d_n))
    found, pressed = np.zeros(3), np.zeros((2, len(body.alpha)))
    for side, slope in enumerate(body.slopes):
        weights, depth, faces = soil.weights[side], soil.depth[side], body.faces[side]
        v = velocities(middles, q, rates)[:, 0]
        if body.heave:
            v = v - slope * velocities(faces, q, rates)[:, 1]
        drag = body.drags * v * np.abs(v)
        spring = weights * spring_forces(*soil.springs[:, side, :, None], soil.dx[side])
        along_x = np.stack((-spring, np.zeros_like(spring)), axis=-1)
        found += generalised(soil.points[side].reshape(-1, 2), along_x.reshape(-1, 2), q[1])
        resisted = -weights.sum(axis=1) * drag * np.minimum(depth / (body.height / 2), 1.0)
        found += generalised(middles, np.column_stack((resisted, np.zeros_like(resisted))), q[1])
        F_n = resisted - spring.sum(axis=1)
        pressed += [-np.minimum(F_n, 0) * body.frictions, np.maximum(F_n, 0) * body.frictions]
        if body.heave:  # energy of a part per depth, as vertical force on the face that presses on it, and the wedge
            lift = lifts(body, soil.dx[side], weights, depth) - slope * F_n
            found += generalised(faces, np.column_stack((np.zeros_like(lift), lift)), q[1])
    along = turned(np.array([[0.0, 1.0]]), q[1])
    for faces, normal in zip(body.faces, pressed, strict=True):
        point = np.array([[normal @ faces[:, 0] / max(normal.sum(), 1e-12), 0.0]])
        slip = velocities(point, q, rates) @ along[0]
        found += generalised(point, normal.sum() * opposing(body, slip)[:, None] * along, q[1])
    return found


def side_loads(body: Body, q: Array, rates: Array) -> Array:
    """Generalised forces of the friction of both sides, Eq 134."""
    v = velocities(body.sides, q, rates)
    depth = np.maximum(body.side_depth - (q[2] if body.heave else 0.0), 0.0)
    full = 2 * body.side_pressure * depth * body.side_area
    share = full / np.sqrt((v**2).sum(axis=1) + body.base.slip_speed**2)
    return generalised(body.sides, -share[:, None] * v, q[1])


def pressed_in(body: Body, q: Array, sets: Array) -> Array:
    """How far each strip is pressed into the base, over its set [m], Eq 133."""
    return np.asarray(body.settlement - rises(body.foot, q) - sets)


def base_loads(body: Body, q: Array, rates: Array, sets: Array) -> Array:
    """Generalised forces of base and weight, and of the friction of the foot, Eqs 133 to 135."""
    weight = np.array([[0.0, -body.weight]])
    found = generalised(body.own, weight, q[1])
    if body.heave:
        foot, q_u = body.foot, body.bearing_capacity
        spring = np.clip(body.base.stiffness * pressed_in(body, q, sets), 0.0, q_u)
        share = np.minimum(spring / (body.weight / body.foot_area), 1.0)
        v = velocities(foot, q, rates)
        dashpot = -body.under.rho_s * body.base.wave_speed * v[:, 1] * share
        push = np.clip(spring + dashpot, 0.0, q_u) * body.strips
    else:
        s = 6 * body.settlement / body.foot_length
        a = body.own[0, 0] + body.inputs.L / 2 * np.clip(sin(q[1]) / s, -1, 1)
        foot = np.array([[a, -body.constants.c_y]])
        v = velocities(foot, q, rates)
        push = np.array([body.weight])
    rub = body.tan_delta * push * opposing(body, v[:, 0])
    return found + generalised(foot, np.column_stack((rub, push)), q[1])


def loads(body: Body, q: Array, rates: Array, a_v: float, touching: bool, sets: Array) -> Array:
    """All generalised forces [N], [N m], [N] by x, theta, y.

    Parameters
    ----------
    body : Body
        The impact.
    q, rates : ndarray, shape (3,)
        x_b [m], theta_b [rad], y_b [m], and their rates.
    a_v : float
        Acceleration of the truck [m/s^2] while it touches.
    touching : bool
        Whether it does.
    sets : ndarray, shape (n,)
        What each strip of the base is pressed in for good [m].
    """
    found = soil_loads(body, q, rates) + base_loads(body, q, rates, sets)
    if body.friction:
        found += side_loads(body, q, rates)
    F_v = crush_force(body.inputs.m_v, a_v) if touching else 0.0
    return found + F_v * np.array([1.0, impact_lever(body.constants, q[1]), 0.0])


def inertia(body: Body, q: Array, rates: Array) -> tuple[Array, Array]:
    """Mass matrix by x, theta, y, and the forces that the masses need to go on turning, Eq 131.

    Where the boulder may rise, the lumped soil moves sideways only; if not, the soil moves with it as in Eq 13.
    """
    c = body.constants
    M, needed = np.zeros((3, 3)), np.zeros(3)
    M[1, 1] = body.own_inertia
    ways = np.array([1.0, 0.0]) if body.heave else np.ones(2)
    for masses, points, moves in (
        (np.array([c.m_b]), body.own, np.ones(2)),
        (body.soil_masses, body.soil_points, ways),
    ):
        J = jacobians(points, q[1])
        M += np.einsum("n,i,nij,nik->jk", masses, moves, J, J)
        towards_centre = -(rates[1] ** 2) * turned(points, q[1])
        needed += np.einsum("n,i,nij,ni->j", masses, moves, J, towards_centre)
    return M, needed


def accelerations(body: Body, q: Array, rates: Array, forces: Array) -> Array:
    """Second derivatives of x, theta, y."""
    M, needed = inertia(body, q, rates)
    free = slice(None) if body.heave else slice(2)
    found = np.zeros(3)
    found[free] = np.linalg.solve(M[free, free], (forces - needed)[free])
    return found


def energy(body: Body, q: Array, rates: Array, sets: Array) -> float:
    """Kinetic energy of boulder and soil, and what soil, base and weight hold [J], Eqs 131 and 136."""
    M, _ = inertia(body, q, rates)
    moving = np.where([True, True, body.heave], rates, 0.0)
    soil = stretches(body, q)
    k_n, F_u = soil.springs[..., None]
    held = soil.weights * spring_energies(np.maximum(k_n, 1e-9), F_u, soil.dx)
    found = float(moving @ M @ moving / 2 + held.sum())
    if body.heave:
        found += body.weight * float(rises(body.own, q)[0])
        deepest = body.bearing_capacity / body.base.stiffness
        p = np.maximum(pressed_in(body, q, sets), 0.0)
        elastic = np.minimum(p, deepest)
        pressed = body.base.stiffness * elastic**2 / 2 + body.bearing_capacity * (p - elastic)
        return found + float(pressed @ body.strips)
    s = 6 * body.settlement / body.inputs.L
    lean = abs(sin(q[1]))
    lift = lean**2 / (2 * s) if lean < s else lean - s / 2
    return found + body.weight * (body.inputs.L / 2 * lift - body.inputs.H / 2 * (1 - cos(q[1])))


@dataclass(frozen=True)
class HeaveImpact:
    """Outcome of an impact: largest rotation [rad], displacement, rise and way of the truck [m], when the rotation
    reached its limit [s] (infinity for never), the last state, what the base is pressed in for good [m], and how often
    the truck came off or touched again."""

    theta_max: float
    x_b_max: float
    y_b_max: float
    x_v_max: float
    t_limit: float
    state: Array
    sets: Array
    changes: int


def simulate_heave(
    inputs: Inputs,
    *,
    heave: bool = True,
    friction: bool = True,
    base: Base = Base(),
    fineness: int = 1,
    as_it_lies: bool = False,
    outline: Array | None = None,
    both_ways: bool = False,
    horizon: float = 0.4,
    limit: float = pi,
    rtol: float = 1e-8,
) -> HeaveImpact:
    """Simulate one impact to the horizon [s], or to the limit of rotation [rad], whichever comes first."""
    body = Body(inputs, heave, friction, base, fineness, as_it_lies, outline, both_ways)
    return _Run(body, horizon, limit, rtol).run()


class _Run:
    """One integration: states are x, theta, y and their rates, then x_v, its rate and its second derivative."""

    def __init__(self, body: Body, horizon: float, limit: float, rtol: float) -> None:
        self.body, self.horizon, self.limit, self.rtol = body, horizon, limit, rtol
        self.sets = body.sets_at_rest
        self.touching, self.gap_at_release, self.changes = True, 0.0, 0

    def rate(self, _t: float, state: Array) -> Array:
        inputs, q, rates = self.body.inputs, state[:3], state[3:6]
        forces = loads(self.body, q, rates, float(state[8]), self.touching, self.sets)
        a_v = third = 0.0
        if self.touching:
            a_v = float(state[8])
            struck = rates[0] + rates[1] * impact_lever(self.body.constants, q[1])
            third = jerk(inputs.m_v, inputs.k_v, inputs.c_v, a_v, float(state[7]), struck)
        return np.concatenate((rates, accelerations(self.body, q, rates, forces), [state[7], a_v, third]))

    def gap(self, state: Array) -> float:
        """Way of the truck less the way of the point struck [m]."""
        c = self.body.constants
        return float(state[6] - state[0] - c.R_v * (sin(c.gamma_v + state[1]) - sin(c.gamma_v)))

    def until_change(self, state: Array) -> float:
        """Positive until the truck comes off or touches again."""
        return -float(state[8]) if self.touching else self.gap_at_release - self.gap(state)

    def run(self) -> HeaveImpact:
        state = np.zeros(9)
        state[7] = self.body.inputs.v_0
        t, largest, t_limit = 0.0, np.zeros(4), np.inf
        solver = self.solver(t, state)
        while t < self.horizon:
            message = solver.step()
            if solver.status == "failed":
                raise RuntimeError(f"the integrator failed at {solver.t} s: {message}")
            dense, end, changes = solver.dense_output(), solver.t, False
            for before, after in pairwise(np.linspace(solver.t_old, solver.t, _SAMPLES + 1)):
                # at the very start of a phase the force is zero and only grows
                if self.until_change(dense(after)) < 0 and self.until_change(dense(before)) > 0:
                    end = brentq(lambda s, dense=dense: self.until_change(dense(s)), before, after, xtol=1e-14)
                    changes = True
                    break
            times = np.linspace(solver.t_old, end, _SAMPLES + 1)
            path = np.array([dense(s) for s in times])
            beyond = np.flatnonzero(np.abs(path[:, 1]) >= self.limit)
            if beyond.size:
                first = int(beyond[0])
                t_limit = brentq(
                    lambda s, dense=dense: abs(dense(s)[1]) - self.limit, times[first - 1], times[first], xtol=1e-14
                )
                path[first:] = dense(t_limit)
            reported = np.column_stack((np.abs(path[:, 1]), path[:, [0, 2, 6]]))
            largest = np.maximum(largest, reported.max(axis=0))
            t, state = end, path[-1]
            if self.body.heave:
                deepest = self.body.bearing_capacity / self.body.base.stiffness
                self.sets += np.maximum(pressed_in(self.body, state[:3], self.sets) - deepest, 0.0)
            if beyond.size:
                break
            if changes:
                self.gap_at_release = self.gap(state) if self.touching else self.gap_at_release
                state[8] = 0.0
                self.touching = not self.touching
                self.changes += 1
                solver = self.solver(t, state)
        theta, x_b, y_b, x_v = map(float, largest)
        return HeaveImpact(theta, x_b, y_b, x_v, float(t_limit), state, self.sets, self.changes)

    def solver(self, t: float, state: Array) -> DOP853:
        return DOP853(
            self.rate,
            t,
            state,
            self.horizon,
            rtol=self.rtol,
            atol=_ABSOLUTE * (self.rtol / 1e-9),
            max_step=_LONGEST_STEP,
        )
