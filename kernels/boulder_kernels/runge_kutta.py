"""One step of a second opinion by the pair of Bogacki and Shampine, and the instants within it at which it is cut.

Source: P. Bogacki and L. F. Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989), 321-325.

Forces that bend at the pieces of soil, foot and sides gain nothing by a higher order. As in
`boulder_kernels.dormand_prince`, stage displacements need the stage accelerations only, and within a step the motion is
given by the polynomials of degree five through both of its ends. A step is cut where the truck comes off or touches
again, where the rotation reaches its limit, and where a strip of the foot that is being pressed in comes back. What a
step needs lies in one workspace, behind what `boulder_kernels.heave` keeps there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .design import Constants, error_arm
from .dormand_prince import Track, displacement_at, slope_at, tableau, track
from .dynamics import contact_displacement, spring_compression
from .heave import FOOT, ROOM, SETS, HeaveConstants, accelerations, forces, strip_depth
from .numerics import ITERATIONS, Bracket, field, narrowed, next_guess, put, sine_versine

METHOD = ("0 1/2 3/4 1", ("", "1/2", "0 3/4", "2/9 1/3 4/9"), "7/24 1/4 1/3 1/8", (3, 2))
"""Bogacki and Shampine's coefficients."""
A, C, AA, ERROR = tableau(*METHOD)
STAGES = len(C)
LEAST_SINKING = 1e-9
"""Velocity below which a strip has come to rest, so that no step is cut twice where one turns back [m/s]."""
AXES = 4
"""Displacements: x_b, theta_b, y_b, x_v."""
START, TRIAL, RATES = ROOM, ROOM + 2 * AXES, ROOM + 4 * AXES
"""Offsets in the workspace: displacements and velocities at the start of a step and within it; rates of all stages."""
WORKSPACE = RATES + STAGES * AXES
"""Numbers in the workspace of one impact."""


@inlined
def write_rate(work: np.ndarray, at: int, stage: int, touching: bool, f: HeaveConstants) -> float:
    """Write the accelerations at a state into a stage, and return the compression of the vehicle's spring."""
    x, theta, y, x_v = field(work, at, 0), field(work, at, 1), field(work, at, 2), field(work, at, 3)
    v, omega, w, v_v = field(work, at, 4), field(work, at, 5), field(work, at, 6), field(work, at, 7)
    Q = forces(x, v, theta, omega, y, w, x_v, v_v, touching, work, f)
    a = accelerations(theta, omega, Q, touching, f)
    for axis in range(AXES):
        put(work, RATES + AXES * stage, axis, a[axis])
    return Q.u


@kernel
def first_rate(work: np.ndarray, touching: bool, f: HeaveConstants) -> float:
    """Write the accelerations at the start of a step; return the compression of the vehicle's spring there [m]."""
    return write_rate(work, START, 0, touching, f)


@inlined
def step(work: np.ndarray, h: float, touching: bool, f: HeaveConstants) -> tuple[float, float]:
    """Try a step of length h [s] into `TRIAL`; return its error [m] and the compression at its end [m]."""
    u = 0.0
    for stage in range(1, STAGES):
        for axis in range(AXES):
            x, v = field(work, START, axis), field(work, START, AXES + axis)
            moved, gained = C[stage] * v, 0.0
            for j in range(stage):
                a = field(work, RATES + AXES * j, axis)
                moved += h * AA[stage][j] * a
                gained += A[stage][j] * a
            put(work, TRIAL, axis, x + h * moved)
            put(work, TRIAL, AXES + axis, v + h * gained)
        u = write_rate(work, TRIAL, stage, touching, f)
    error = 0.0
    for axis in range(AXES):
        off = 0.0
        for j in range(STAGES):
            off += ERROR[j] * field(work, RATES + AXES * j, axis)
        error += abs(off) * (error_arm(f.c) if axis == 1 else 1.0)
    return h * h * error, u


class Tracks(NamedTuple):
    """The motion within a step."""

    x_b: Track
    theta_b: Track
    y_b: Track
    x_v: Track


@inlined
def track_of(work: np.ndarray, axis: int, h: float) -> Track:
    """Motion along one axis within the step that was tried last."""
    return track(
        h,
        field(work, START, axis),
        field(work, START, AXES + axis),
        field(work, RATES, axis),
        field(work, TRIAL, axis),
        field(work, TRIAL, AXES + axis),
        field(work, RATES + AXES * (STAGES - 1), axis),
    )


@inlined
def keep(work: np.ndarray, q: Tracks, tau: float, h: float) -> None:
    """Go on from the fraction tau of the step that was tried last."""
    for axis in range(AXES):
        if tau >= 1.0:
            x, v = field(work, TRIAL, axis), field(work, TRIAL, AXES + axis)
        else:
            x, v = displacement_at(q[axis], tau), slope_at(q[axis], tau) / h
        put(work, START, axis, x)
        put(work, START, AXES + axis, v)


@inlined
def compression_in(q: Tracks, tau: float, h: float, c: Constants) -> float:
    """Compression of the vehicle's spring at the fraction tau of a step [m]."""
    sin, versin = sine_versine(displacement_at(q.theta_b, tau))
    x_c = contact_displacement(displacement_at(q.x_b, tau), sin, versin, c)
    return spring_compression(displacement_at(q.x_v, tau), slope_at(q.x_v, tau) / h, x_c, c)


@kernel
def contact_change(q: Tracks, u: float, u_end: float, h: float, c: Constants) -> float:
    """Fraction of a step at which the compression changes its sign."""
    b = Bracket(0.0, u, 1.0, u_end, 0.0)
    for _ in range(ITERATIONS):
        tau = next_guess(b)
        u_tau = compression_in(q, tau, h, c)
        if abs(u_tau) < 1e-12 or b.high - b.low < 1e-12:
            return tau
        b = narrowed(b, tau, u_tau)
    return 0.5 * (b.low + b.high)


@kernel
def time_of_limit(q: Track, limit: float, tau_end: float) -> float:
    """Fraction of a step at which the rotation reaches a limit that it has passed at tau_end [rad]."""
    low, high = 0.0, tau_end
    for _ in range(ITERATIONS):
        middle = 0.5 * (low + high)
        beyond = abs(displacement_at(q, middle)) >= limit
        low, high = (low, middle) if beyond else (middle, high)
    return high


@inlined
def foot_rises(work: np.ndarray, q: Tracks, tau_end: float, h: float, f: HeaveConstants) -> float:
    """Fraction of a step at which the first strip that is pressed in comes back; tau_end if none does.

    What is pressed in is kept at the end of a step (`press_in`), so no step may go on from where a strip is deepest.
    """
    tau, capacity = tau_end, f.q_foot / f.k_foot
    start, end = foot_at(q, 0.0), foot_at(q, tau)
    coming_back = 0
    for j in range(f.pieces):
        sinking, at_end = sinking_in(work, j, start, f), sinking_in(work, j, end, f)
        coming_back += int((sinking > LEAST_SINKING * h) & (at_end < 0.0))
    if coming_back == 0:
        return tau
    for j in range(f.pieces):
        sinking, at_end = sinking_in(work, j, start, f), sinking_in(work, j, end, f)
        # A strip that slows down gets no deeper than it would at the speed that it has.
        reach = strip_depth(work, j, start.y, start.sin, start.versin, f) + sinking * tau
        if sinking > LEAST_SINKING * h and at_end < 0.0 and reach > capacity:
            b, at, middle = Bracket(0.0, sinking, tau, at_end, 0.0), tau, end
            for _ in range(ITERATIONS):
                at = next_guess(b)
                middle = foot_at(q, at)
                there = sinking_in(work, j, middle, f)
                if abs(there) < 0.1 * LEAST_SINKING * h or b.high - b.low < 1e-12:
                    break
                b = narrowed(b, at, there)
            if strip_depth(work, j, middle.y, middle.sin, middle.versin, f) > capacity:
                tau, end = at, middle
    return tau


class FootMotion(NamedTuple):
    """Rotation and rise at an instant within a step, and how fast they change, times its length."""

    sin: float
    versin: float
    turning: float
    """Change of the rotation [rad]."""
    y: float
    rising: float
    """Change of the rise [m]."""


@inlined
def foot_at(q: Tracks, tau: float) -> FootMotion:
    """Rotation and rise at the fraction tau of a step."""
    sin, versin = sine_versine(displacement_at(q.theta_b, tau))
    return FootMotion(sin, versin, slope_at(q.theta_b, tau), displacement_at(q.y_b, tau), slope_at(q.y_b, tau))


@inlined
def sinking_in(work: np.ndarray, j: int, m: FootMotion, f: HeaveConstants) -> float:
    """Velocity at which strip j of the foot sinks, times the length of the step [m]."""
    return (field(work, FOOT, j) * (1.0 - m.versin) - f.c.c_y * m.sin) * m.turning - m.rising


@inlined
def press_in(work: np.ndarray, f: HeaveConstants) -> bool:
    """Keep what a strip of the foot is pressed in beyond its bearing capacity as its set; whether any was."""
    sin, versin = sine_versine(field(work, START, 1))
    any_pressed = False
    for j in range(f.pieces):
        over = strip_depth(work, j, field(work, START, 2), sin, versin, f) - f.q_foot / f.k_foot
        if over > 0.0 and f.heave > 0.0:
            put(work, SETS, j, field(work, SETS, j) + over)
            any_pressed = True
    return any_pressed
