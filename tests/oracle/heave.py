"""The second opinion: a boulder that may rise, on a base that only pushes, held by friction (Eqs 131 to 137).

Written from `docs/second_opinion.md`. Every force acts at a point of the boulder, and generalised forces are the sum of
transposed Jacobians times forces. The masses, too, are points: the boulder's own centre, which also turns, and three
points of lumped soil, whose sums of m_n, m_n d_n and m_n d_n^2 are the integrals over the depth. The truck is
the jerk of Eq 45.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, exp, pi, sin, tan

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from .constants import Constants, constants, element_depths, impact_lever, shear_wedge_angle
from .inputs import CORRECTED, GRAVITY, Inputs
from .soil import drag_forces, spring_constants, spring_energies, spring_forces, ultimate_forces
from .vehicle import crush_force, jerk

Array = NDArray[np.float64]

PIECES = 32
"""Depths of the soil, strips of the foot, points of the sides."""
_SIDE_ROWS, _SIDE_COLUMNS = 8, 4
_LONGEST_STEP = 1e-3  # [s]: what is pressed in for good is noted after each
_ABSOLUTE = np.array([1e-11, 1e-11, 1e-11, 1e-10, 1e-10, 1e-10, 1e-11, 1e-10, 1e-8])
_SAMPLES = 8


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
    constants: Constants = field(init=False)
    own: Array = field(init=False)
    """The boulder's own centre."""
    alpha: Array = field(init=False)
    """Depths of the soil elements [m]."""
    height: Array = field(init=False)
    d_n: Array = field(init=False)
    foot: Array = field(init=False)
    sides: Array = field(init=False)
    side_depth: Array = field(init=False)
    soil_masses: Array = field(init=False)
    soil_points: Array = field(init=False)

    def __post_init__(self) -> None:
        inputs = self.inputs
        c = constants(inputs, CORRECTED)
        alpha = element_depths(inputs.d, PIECES)
        rows = inputs.d / _SIDE_ROWS * (np.arange(_SIDE_ROWS) + 0.5)
        columns = inputs.L / _SIDE_COLUMNS * (np.arange(_SIDE_COLUMNS) + 0.5)
        depth, along = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
        surface = inputs.d - c.c_y  # soil line over the centre of mass
        strips = inputs.L / PIECES * (np.arange(PIECES) + 0.5)
        nodes, weights = np.polynomial.legendre.leggauss(3)
        where = inputs.d * (nodes + 1) / 2
        wedge = inputs.rho_s * inputs.W * tan(shear_wedge_angle(inputs.phi)) * (inputs.d - where)  # Eq 2 per height
        for name, value in {
            "constants": c,
            "own": np.array([[inputs.L / 2 - c.c_x, inputs.H / 2 - c.c_y]]),
            "alpha": alpha,
            "height": np.full(PIECES, inputs.d / PIECES),
            "d_n": alpha - surface,
            "foot": np.column_stack((strips - c.c_x, np.full(PIECES, -c.c_y))),
            "sides": np.column_stack((along - c.c_x, surface - depth)),
            "side_depth": depth,
            "soil_masses": weights * inputs.d / 2 * wedge,
            "soil_points": np.column_stack((np.full(3, c.l_n), surface - where)),
        }.items():
            object.__setattr__(self, name, value)

    @property
    def weight(self) -> float:
        """Weight of the boulder [N]."""
        return self.constants.m_b * GRAVITY

    @property
    def settlement(self) -> float:
        """Settlement s_0 of the base at rest [m]."""
        return self.weight / (self.base.stiffness * self.inputs.L * self.inputs.W)

    @property
    def strip_area(self) -> float:
        """Area of a strip of the foot [m^2]."""
        return self.inputs.L * self.inputs.W / PIECES

    @property
    def bearing_capacity(self) -> float:
        """Bearing capacity q of the base [Pa]."""
        phi = self.inputs.phi
        N_q = exp(pi * tan(phi)) * (1 + sin(phi)) / (1 - sin(phi))
        return self.inputs.rho_s * GRAVITY * self.inputs.d * N_q

    @property
    def tan_delta(self) -> float:
        """Coefficient of friction."""
        return tan(self.inputs.phi * 2 / 3) if self.friction else 0.0


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


def pressed_faces(body: Body, q: Array) -> tuple[Array, Array, Array]:
    """Displacement of each soil element, the point of the face that it presses on, and its depth, Eq 132."""
    far = np.column_stack((np.full(PIECES, body.constants.l_n), -body.d_n))
    dx = q[0] + turned(far, q[1])[:, 0] - far[:, 0]  # Eq 22
    face = far.copy()
    face[dx <= 0, 0] -= body.inputs.L
    rise = rises(face, q) if body.heave else np.zeros(PIECES)
    return dx, face, np.maximum(body.alpha - rise, 0.0)


def soil_loads(body: Body, q: Array, rates: Array) -> Array:
    """Generalised forces of springs, drag, and the friction of both faces, Eqs 132 and 134."""
    inputs = body.inputs
    dx, face, depth = pressed_faces(body, q)
    far = np.column_stack((np.full(PIECES, body.constants.l_n), -body.d_n))
    v_n = velocities(far, q, rates)[:, 0]
    spring = spring_forces(
        spring_constants(inputs, depth, body.height), ultimate_forces(inputs, depth, body.height), dx
    )
    covered = np.minimum(depth / (body.height / 2), 1.0)
    F_n = -spring - drag_forces(inputs, body.height, v_n) * covered
    found = generalised(far, np.column_stack((F_n, np.zeros(PIECES))), q[1])
    if body.heave:  # energy of an element per depth, as vertical force on the face that it presses on
        unit = np.ones(PIECES)
        lift = spring_energies(
            spring_constants(inputs, unit, body.height), ultimate_forces(inputs, unit, body.height), dx
        )
        found += generalised(face, np.column_stack((np.zeros(PIECES), np.where(depth > 0, lift, 0.0))), q[1])
    along = turned(np.array([[0.0, 1.0]]), q[1])
    for a, pressed in (
        (body.constants.l_n, -np.minimum(F_n, 0).sum()),
        (body.constants.l_n - inputs.L, np.maximum(F_n, 0).sum()),
    ):
        point = np.array([[a, 0.0]])
        slip = velocities(point, q, rates) @ along[0]
        found += generalised(point, body.tan_delta * pressed * opposing(body, slip)[:, None] * along, q[1])
    return found


def side_loads(body: Body, q: Array, rates: Array) -> Array:
    """Generalised forces of the friction of both sides, Eq 134."""
    inputs = body.inputs
    v = velocities(body.sides, q, rates)
    depth = np.maximum(body.side_depth - (q[2] if body.heave else 0.0), 0.0)
    pressure = (1 - sin(inputs.phi)) * inputs.rho_s * GRAVITY * depth
    full = 2 * body.tan_delta * pressure * inputs.L * inputs.d / PIECES
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
        share = np.minimum(spring / (body.weight / (body.inputs.L * body.inputs.W)), 1.0)
        v = velocities(foot, q, rates)
        dashpot = -body.inputs.rho_s * body.base.wave_speed * v[:, 1] * share
        push = np.clip(spring + dashpot, 0.0, q_u) * body.strip_area
    else:
        s = 6 * body.settlement / body.inputs.L
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
    sets : ndarray, shape (32,)
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
    M[1, 1] = c.m_b / 12 * (body.inputs.L**2 + body.inputs.H**2)
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
    dx, _, depth = pressed_faces(body, q)
    covered = depth > 0
    k_n = spring_constants(body.inputs, depth, body.height)[covered]
    F_u = ultimate_forces(body.inputs, depth, body.height)[covered]
    found = float(moving @ M @ moving / 2 + spring_energies(k_n, F_u, dx[covered]).sum())
    if body.heave:
        found += body.weight * float(rises(body.own, q)[0])
        deepest = body.bearing_capacity / body.base.stiffness
        p = np.maximum(pressed_in(body, q, sets), 0.0)
        elastic = np.minimum(p, deepest)
        pressed = body.base.stiffness * elastic**2 / 2 + body.bearing_capacity * (p - elastic)
        return found + float(pressed.sum() * body.strip_area)
    s = 6 * body.settlement / body.inputs.L
    lean = abs(sin(q[1]))
    lift = lean**2 / (2 * s) if lean < s else lean - s / 2
    return found + body.weight * (body.inputs.L / 2 * lift - body.inputs.H / 2 * (1 - cos(q[1])))


@dataclass(frozen=True)
class HeaveImpact:
    """What became of an impact: largest rotation [rad], displacement, rise and way of the truck [m], when the rotation
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
    horizon: float = 0.4,
    limit: float = pi,
    rtol: float = 1e-8,
) -> HeaveImpact:
    """Simulate one impact to the horizon [s], or to the limit of rotation [rad], whichever comes first."""
    return _Run(Body(inputs, heave, friction, base), horizon, limit, rtol).run()


class _Run:
    """One integration: states are x, theta, y and their rates, then x_v, its rate and its second derivative."""

    def __init__(self, body: Body, horizon: float, limit: float, rtol: float) -> None:
        self.body, self.horizon, self.limit, self.rtol = body, horizon, limit, rtol
        self.sets = np.zeros(PIECES)
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
        """Way of the truck less that of the point struck [m]."""
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
