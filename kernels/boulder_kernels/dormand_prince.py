"""One step of Dormand and Prince's method, with coefficients that check themselves, and the motion within the step.

Source: J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980),
19-26, method RK5(4)7M.

Every motion here is of the form x' = v, v' = a(x, v). Stage displacements then need the stage accelerations only,

    v_i = v + h sum_j A_ij a_j
    x_i = x + h C_i v + h^2 sum_j AA_ij a_j      AA = A A

which is the same method on the same system with fewer numbers to keep.

**Within a step** the motion is given by polynomials through both of its ends. Displacement, velocity and acceleration
are known at either end of a step, and together they fix a polynomial of degree five in each degree of freedom. Its
error is of the order h^6, like the error of a step itself, one order better than the continuous extension that goes
with the pair, and no stage has to be kept for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from ._jit import inlined, kernel
from .design import Constants, error_arm
from .dynamics import Acceleration, State, Switches, acceleration
from .numerics import ITERATIONS


class Tableau(NamedTuple):
    """Coefficients of an explicit pair whose last stage is the first of the next step, s stages."""

    A: tuple[tuple[float, ...], ...]
    """Stage weights, shape (s, s); the last row is the solution."""
    C: tuple[float, ...]
    """Nodes of the stages, shape (s,)."""
    AA: tuple[tuple[float, ...], ...]
    """Weights of the accelerations in the stage displacements, A A, shape (s, s)."""
    ERROR: tuple[float, ...]
    """Weights of the accelerations in the difference of the solutions of higher and of lower order, shape (s,)."""


def tableau(nodes: str, rows: tuple[str, ...], lower: str, orders: tuple[int, int]) -> Tableau:
    """Return a method from its coefficients as written.

    ``nodes, rows, lower``: nodes, rows of stage weights below the diagonal, and weights of the solution of lower order,
    as fractions; ``orders``: orders of both solutions, up to the fourth, for the conditions of quadrature.

    Raises ``AssertionError``: a coefficient is mistyped: a row does not sum to its node, or a condition of quadrature
    is missed.
    """
    C, second = ([Fraction(number) for number in given.split()] for given in (nodes, lower))
    A = [[Fraction(number) for number in row.split()] + [Fraction(0)] * (len(C) - i) for i, row in enumerate(rows)]
    for row, node in zip(A, C, strict=True):
        assert sum(row) == node, f"the row of node {node} does not sum to it"
    for weights, order in zip((A[-1], second), orders, strict=True):
        for power in range(order):
            quadrature = sum(w * c**power for w, c in zip(weights, C, strict=True))
            assert quadrature == Fraction(1, power + 1), "the weights miss a quadrature condition"
    AA = [[sum(a * A[m][j] for m, a in enumerate(row)) for j in range(len(C))] for row in A]
    error = [a - b for a, b in zip(A[-1], second, strict=True)]
    return Tableau(tuple(map(_floats, A)), _floats(C), tuple(map(_floats, AA)), _floats(error))


def _floats(numbers: Iterable[Any]) -> tuple[float, ...]:
    return tuple(map(float, numbers))


METHOD = (
    "0 1/5 3/10 4/5 8/9 1 1",
    (
        "",
        "1/5",
        "3/40 9/40",
        "44/45 -56/15 32/9",
        "19372/6561 -25360/2187 64448/6561 -212/729",
        "9017/3168 -355/33 46732/5247 49/176 -5103/18656",
        "35/384 0 500/1113 125/192 -2187/6784 11/84",
    ),
    "5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40",
    (4, 4),
)
"""Dormand and Prince's coefficients; their orders are five and four."""
A, C, AA, ERROR = tableau(*METHOD)


def weighted(weights: Sequence[float]) -> Callable[[Any], float]:
    """Return a function that adds up the numbers of a tuple with these weights, in order, without those that are zero.

    Written out term by term: a loop would keep the one over lanes from being vectorised.
    """
    *_, last = (j for j, weight in enumerate(weights) if weight != 0.0)
    weight = weights[last]
    if not any(weights[:last]):
        return inlined(lambda a: weight * a[last])
    before = weighted(weights[:last])
    return inlined(lambda a: before(a) + weight * a[last])


def stage(i: int) -> Callable[..., Any]:
    """Return a function that gives displacement and velocity of one degree of freedom in stage i = 1 ... 6."""
    node, gained = C[i], weighted(A[i])
    if not any(AA[i]):
        return inlined(lambda x, v, h, a: (x + h * (node * v), v + h * gained(a)))
    moved = weighted(AA[i])
    return inlined(lambda x, v, h, a: (x + h * (node * v + h * moved(a)), v + h * gained(a)))


class Stages(NamedTuple):
    """The stages of a step up to one of them."""

    y: State
    """State of the last one."""
    k: Acceleration
    """Acceleration at that state."""
    a_b: tuple[float, ...]
    alpha_b: tuple[float, ...]
    a_v: tuple[float, ...]
    """Accelerations of all of them."""


def stages(i: int) -> Callable[..., Any]:
    """Return a function that gives the `Stages` of a step up to stage i = 0 ... 6."""
    if i == 0:
        return inlined(lambda y, k, h, s, c: Stages(y, k, (k.a_b,), (k.alpha_b,), (k.a_v,)))
    before, at = stages(i - 1), stage(i)

    @inlined
    def up_to(y: State, k1: Acceleration, h: float, s: Switches, c: Constants) -> Stages:
        """Add a stage to those before."""
        m = before(y, k1, h, s, c)
        x_b, v_b = at(y.x_b, y.v_b, h, m.a_b)
        theta_b, omega_b = at(y.theta_b, y.omega_b, h, m.alpha_b)
        x_v, v_v = at(y.x_v, y.v_v, h, m.a_v)
        y_i = State(x_b, v_b, theta_b, omega_b, x_v, v_v)
        k = acceleration(y_i, s, c)
        return Stages(y_i, k, (*m.a_b, k.a_b), (*m.alpha_b, k.alpha_b), (*m.a_v, k.a_v))

    return up_to


all_stages, difference = stages(len(C) - 1), weighted(ERROR)


@inlined
def step(y: State, k1: Acceleration, h: float, s: Switches, c: Constants) -> tuple[State, Acceleration, float]:
    """Advance the state by one step with the modes frozen.

    ``y``: state at the start; ``k1``: acceleration there (the last stage of the step before, or fresh after a change of
    mode); ``h``: length of the step [s]; ``s``: factors of the modes of this step.

    Returns the state at the end, of fifth order; the acceleration there, which the next step starts with; and the
    difference of the solutions of fifth and of fourth order: the sum over the velocities, the rotation counted at the
    arm of `boulder_kernels.design.error_arm` [m/s].
    """
    m = all_stages(y, k1, h, s, c)
    off = abs(difference(m.a_b)) + abs(difference(m.a_v)) + error_arm(c) * abs(difference(m.alpha_b))
    return m.y, m.k, h * off


class Track(NamedTuple):
    """One degree of freedom within a step: coefficients of the powers of tau = 0 ... 1."""

    x0: float
    """Displacement at the start."""
    x1: float
    """Step times velocity at the start."""
    x2: float
    x3: float
    x4: float
    x5: float


class DenseOutput(NamedTuple):
    """The three degrees of freedom within a step."""

    h: float
    """Length of the step [s]."""
    boulder: Track
    rotation: Track
    truck: Track


@inlined
def track(h: float, x: float, v: float, a: float, x_end: float, v_end: float, a_end: float) -> Track:
    """Quintic Hermite polynomial of one degree of freedom.

    ``h``: length of the step [s]; ``x, v, a``: displacement, velocity and acceleration at the start; ``x_end, v_end,
    a_end``: the same at the end.
    """
    hv, ha = h * v, 0.5 * h * h * a
    # What is left at the end of displacement, slope and half the curvature of the parabola from the start.
    left_x = x_end - x - hv - ha
    left_v = h * v_end - hv - 2.0 * ha
    left_a = 0.5 * h * h * a_end - ha
    return Track(
        x,
        hv,
        ha,
        10.0 * left_x - 4.0 * left_v + left_a,
        -15.0 * left_x + 7.0 * left_v - 2.0 * left_a,
        6.0 * left_x - 3.0 * left_v + left_a,
    )


@inlined
def displacement_at(q: Track, tau: float) -> float:
    """Displacement of a track at the fraction tau of its step."""
    return q.x0 + tau * (q.x1 + tau * (q.x2 + tau * (q.x3 + tau * (q.x4 + tau * q.x5))))


@inlined
def slope_at(q: Track, tau: float) -> float:
    """Derivative of a track by tau: the velocity times the length of the step."""
    return q.x1 + tau * (2.0 * q.x2 + tau * (3.0 * q.x3 + tau * (4.0 * q.x4 + tau * (5.0 * q.x5))))


@inlined
def curvature_at(q: Track, tau: float) -> float:
    """Second derivative of a track by tau: the acceleration times the square of the length of the step."""
    return 2.0 * q.x2 + tau * (6.0 * q.x3 + tau * (12.0 * q.x4 + tau * (20.0 * q.x5)))


@inlined
def newton(q: Track, tau: float, low: float, high: float, a_0: float, a_x: float, a_v: float) -> float:
    """Three steps of Newton's method for a_0 + a_x x + a_v x' = 0 on a track, within low ... high; x' is `slope_at`."""
    for _ in range(3):
        slope = slope_at(q, tau)
        value = a_0 + a_x * displacement_at(q, tau) + a_v * slope
        change = a_x * slope + a_v * curvature_at(q, tau)
        tau = min(max(tau - (value / change if change != 0.0 else 0.0), low), high)
    return tau


@inlined
def turning_point(q: Track, tau_end: float) -> float:
    """Fraction of a step at which a velocity that changes its sign before tau_end is zero; tau_end for any other.

    Three steps from the chord: the velocity bends little within a step, and what is left counts by its square.
    """
    end = slope_at(q, tau_end)
    if not q.x1 * end < 0.0:
        return tau_end
    return newton(q, tau_end * q.x1 / (q.x1 - end), 0.0, tau_end, 0.0, 0.0, 1.0)


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
def dense_output(y: State, k: Acceleration, y_end: State, k_end: Acceleration, h: float) -> DenseOutput:
    """Polynomials of a step of length h [s] from states and accelerations at its ends."""
    return DenseOutput(
        h,
        track(h, y.x_b, y.v_b, k.a_b, y_end.x_b, y_end.v_b, k_end.a_b),
        track(h, y.theta_b, y.omega_b, k.alpha_b, y_end.theta_b, y_end.omega_b, k_end.alpha_b),
        track(h, y.x_v, y.v_v, k.a_v, y_end.x_v, y_end.v_v, k_end.a_v),
    )


@inlined
def state_at(dense: DenseOutput, tau: float) -> State:
    """State at the fraction tau of a step."""
    per_second = 1.0 / dense.h
    return State(
        displacement_at(dense.boulder, tau),
        per_second * slope_at(dense.boulder, tau),
        displacement_at(dense.rotation, tau),
        per_second * slope_at(dense.rotation, tau),
        displacement_at(dense.truck, tau),
        per_second * slope_at(dense.truck, tau),
    )
