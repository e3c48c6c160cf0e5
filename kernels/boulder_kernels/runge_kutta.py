"""One step of a second opinion by the pair of Bogacki and Shampine, with coefficients that check themselves.

Source: P. Bogacki and L. F. Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989), 321-325.

Forces that bend at the pieces of soil, foot and sides gain nothing by a higher order. As in
`boulder_kernels.dormand_prince`, stage displacements need the stage accelerations only, and within a step the motion is
given by the polynomials of degree five through both of its ends. What a step needs lies in one workspace, behind what
`boulder_kernels.heave` keeps there.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .design import Constants, error_arm
from .dormand_prince import Track, displacement_at, slope_at, track
from .dynamics import contact_displacement, spring_compression
from .heave import ROOM, HeaveConstants, accelerations, forces
from .numerics import ITERATIONS, Bracket, field, narrowed, next_guess, put, sine_versine

_A = (
    (),
    (Fraction(1, 2),),
    (Fraction(0), Fraction(3, 4)),
    (Fraction(2, 9), Fraction(1, 3), Fraction(4, 9)),
)
_C = (Fraction(0), Fraction(1, 2), Fraction(3, 4), Fraction(1))
_B_SECOND = (Fraction(7, 24), Fraction(1, 4), Fraction(1, 3), Fraction(1, 8))
STAGES = 4


def _entry(i: int, j: int) -> Fraction:
    return _A[i][j] if j < len(_A[i]) else Fraction(0)


def _check() -> None:
    """Refuse to import with a mistyped coefficient: row sums and quadrature conditions."""
    for i in range(STAGES):
        assert sum(_A[i], Fraction(0)) == _C[i], f"row {i} of the tableau does not sum to its node"
    for weights, order in (((*_A[3], Fraction(0)), 3), (_B_SECOND, 2)):
        for power in range(order):
            quadrature = sum(w * c**power for w, c in zip(weights, _C, strict=True))
            assert quadrature == Fraction(1, power + 1), "the weights miss a quadrature condition"


_check()

C = tuple(float(c) for c in _C)
"""Nodes, shape (4,)."""
A = tuple(tuple(float(_entry(i, j)) for j in range(STAGES)) for i in range(STAGES))
"""Stage weights, shape (4, 4); the last row is the third-order solution."""
ERROR = tuple(float(_entry(3, j) - _B_SECOND[j]) for j in range(STAGES))
"""Weights of the accelerations in the difference of the solutions of third and of second order, shape (4,)."""
AA = tuple(
    tuple(float(sum((_entry(i, m) * _entry(m, j) for m in range(STAGES)), Fraction(0))) for j in range(STAGES))
    for i in range(STAGES)
)
"""Weights of the accelerations in the stage displacements, A A, shape (4, 4)."""
AXES = 4
"""Displacements: x_b, theta_b, y_b, x_v."""
START, TRIAL, RATES = ROOM, ROOM + 2 * AXES, ROOM + 4 * AXES
"""Offsets in the workspace: displacements and velocities at the start of a step and within it; rates of all stages."""
WORKSPACE = RATES + STAGES * AXES
"""Numbers in the workspace of one impact."""


@inlined
def write_rate(work: np.ndarray, at: int, stage: int, touching: bool, f: HeaveConstants) -> float:
    """Write the accelerations at a state as those of a stage, and return the compression of the vehicle's spring."""
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


@kernel
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


@kernel
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
