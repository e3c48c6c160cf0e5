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

from fractions import Fraction
from typing import NamedTuple

from ._jit import inlined
from .design import Constants, error_arm
from .dynamics import Acceleration, State, Switches, acceleration

_A = (
    (),
    (Fraction(1, 5),),
    (Fraction(3, 40), Fraction(9, 40)),
    (Fraction(44, 45), Fraction(-56, 15), Fraction(32, 9)),
    (Fraction(19372, 6561), Fraction(-25360, 2187), Fraction(64448, 6561), Fraction(-212, 729)),
    (Fraction(9017, 3168), Fraction(-355, 33), Fraction(46732, 5247), Fraction(49, 176), Fraction(-5103, 18656)),
    (Fraction(35, 384), Fraction(0), Fraction(500, 1113), Fraction(125, 192), Fraction(-2187, 6784), Fraction(11, 84)),
)
_C = (Fraction(0), Fraction(1, 5), Fraction(3, 10), Fraction(4, 5), Fraction(8, 9), Fraction(1), Fraction(1))
_B_FOURTH = (
    Fraction(5179, 57600),
    Fraction(0),
    Fraction(7571, 16695),
    Fraction(393, 640),
    Fraction(-92097, 339200),
    Fraction(187, 2100),
    Fraction(1, 40),
)
STAGES = 7


def _entry(i: int, j: int) -> Fraction:
    return _A[i][j] if j < len(_A[i]) else Fraction(0)


def _check() -> None:
    """Refuse to import with a mistyped coefficient: row sums and quadrature conditions."""
    for i in range(STAGES):
        assert sum(_A[i], Fraction(0)) == _C[i], f"row {i} of the tableau does not sum to its node"
    for weights in ((*_A[6], Fraction(0)), _B_FOURTH):
        for power in range(4):
            quadrature = sum(w * c**power for w, c in zip(weights, _C, strict=True))
            assert quadrature == Fraction(1, power + 1), "the weights miss a quadrature condition"


_check()

C = tuple(float(c) for c in _C)
"""Nodes of the stages, shape (7,)."""
A = tuple(tuple(float(_entry(i, j)) for j in range(STAGES)) for i in range(STAGES))
"""Stage weights, shape (7, 7); the last row is the fifth-order solution."""
ERROR = tuple(float(_entry(6, j) - _B_FOURTH[j]) for j in range(STAGES))
"""Weights of the accelerations in the difference of the solutions of fifth and of fourth order, shape (7,)."""
AA = tuple(
    tuple(float(sum((_entry(i, m) * _entry(m, j) for m in range(STAGES)), Fraction(0))) for j in range(STAGES))
    for i in range(STAGES)
)
"""Weights of the accelerations in the stage displacements, A A, shape (7, 7)."""


class DegreeOfFreedom(NamedTuple):
    """Displacement and velocity of one degree of freedom."""

    x: float
    v: float


@inlined
def stage_2(x: float, v: float, h: float, a1: float) -> DegreeOfFreedom:
    """Second stage of one degree of freedom."""
    return DegreeOfFreedom(x + h * (C[1] * v), v + h * (A[1][0] * a1))


@inlined
def stage_3(x: float, v: float, h: float, a1: float, a2: float) -> DegreeOfFreedom:
    """Third stage of one degree of freedom."""
    return DegreeOfFreedom(
        x + h * (C[2] * v + h * (AA[2][0] * a1)),
        v + h * (A[2][0] * a1 + A[2][1] * a2),
    )


@inlined
def stage_4(x: float, v: float, h: float, a1: float, a2: float, a3: float) -> DegreeOfFreedom:
    """Fourth stage of one degree of freedom."""
    return DegreeOfFreedom(
        x + h * (C[3] * v + h * (AA[3][0] * a1 + AA[3][1] * a2)),
        v + h * (A[3][0] * a1 + A[3][1] * a2 + A[3][2] * a3),
    )


@inlined
def stage_5(x: float, v: float, h: float, a1: float, a2: float, a3: float, a4: float) -> DegreeOfFreedom:
    """Fifth stage of one degree of freedom."""
    return DegreeOfFreedom(
        x + h * (C[4] * v + h * (AA[4][0] * a1 + AA[4][1] * a2 + AA[4][2] * a3)),
        v + h * (A[4][0] * a1 + A[4][1] * a2 + A[4][2] * a3 + A[4][3] * a4),
    )


@inlined
def stage_6(x: float, v: float, h: float, a1: float, a2: float, a3: float, a4: float, a5: float) -> DegreeOfFreedom:
    """Sixth stage of one degree of freedom."""
    return DegreeOfFreedom(
        x + h * (v + h * (AA[5][0] * a1 + AA[5][1] * a2 + AA[5][2] * a3 + AA[5][3] * a4)),
        v + h * (A[5][0] * a1 + A[5][1] * a2 + A[5][2] * a3 + A[5][3] * a4 + A[5][4] * a5),
    )


@inlined
def stage_7(x: float, v: float, h: float, a1: float, a3: float, a4: float, a5: float, a6: float) -> DegreeOfFreedom:
    """End of the step, of fifth order, for one degree of freedom."""
    return DegreeOfFreedom(
        x + h * (v + h * (AA[6][0] * a1 + AA[6][2] * a3 + AA[6][3] * a4 + AA[6][4] * a5)),
        v + h * (A[6][0] * a1 + A[6][2] * a3 + A[6][3] * a4 + A[6][4] * a5 + A[6][5] * a6),
    )


@inlined
def difference(a1: float, a3: float, a4: float, a5: float, a6: float, a7: float) -> float:
    """Modulus by which the solutions of fifth and of fourth order differ in a velocity, per length of the step."""
    d = ERROR[0] * a1 + ERROR[2] * a3 + ERROR[3] * a4 + ERROR[4] * a5 + ERROR[5] * a6 + ERROR[6] * a7
    return abs(d)


@inlined
def step(y: State, k1: Acceleration, h: float, s: Switches, c: Constants) -> tuple[State, Acceleration, float]:
    """Advance the state by one step with the modes frozen.

    Parameters
    ----------
    y
        State at the start.
    k1
        Acceleration there (the last stage of the step before, or fresh after a change of mode).
    h
        Length of the step [s].
    s
        Factors of the modes of this step.
    c
        Constants of the design.

    Returns
    -------
    State
        State at the end, of fifth order.
    Acceleration
        Acceleration there, which the next step starts with.
    float
        Difference of the solutions of fifth and of fourth order: the sum over the velocities, the rotation counted
        at the arm of `boulder_kernels.design.error_arm` [m/s].
    """
    b = stage_2(y.x_b, y.v_b, h, k1.a_b)
    r = stage_2(y.theta_b, y.omega_b, h, k1.alpha_b)
    t = stage_2(y.x_v, y.v_v, h, k1.a_v)
    k2 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    b = stage_3(y.x_b, y.v_b, h, k1.a_b, k2.a_b)
    r = stage_3(y.theta_b, y.omega_b, h, k1.alpha_b, k2.alpha_b)
    t = stage_3(y.x_v, y.v_v, h, k1.a_v, k2.a_v)
    k3 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    b = stage_4(y.x_b, y.v_b, h, k1.a_b, k2.a_b, k3.a_b)
    r = stage_4(y.theta_b, y.omega_b, h, k1.alpha_b, k2.alpha_b, k3.alpha_b)
    t = stage_4(y.x_v, y.v_v, h, k1.a_v, k2.a_v, k3.a_v)
    k4 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    b = stage_5(y.x_b, y.v_b, h, k1.a_b, k2.a_b, k3.a_b, k4.a_b)
    r = stage_5(y.theta_b, y.omega_b, h, k1.alpha_b, k2.alpha_b, k3.alpha_b, k4.alpha_b)
    t = stage_5(y.x_v, y.v_v, h, k1.a_v, k2.a_v, k3.a_v, k4.a_v)
    k5 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    b = stage_6(y.x_b, y.v_b, h, k1.a_b, k2.a_b, k3.a_b, k4.a_b, k5.a_b)
    r = stage_6(y.theta_b, y.omega_b, h, k1.alpha_b, k2.alpha_b, k3.alpha_b, k4.alpha_b, k5.alpha_b)
    t = stage_6(y.x_v, y.v_v, h, k1.a_v, k2.a_v, k3.a_v, k4.a_v, k5.a_v)
    k6 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    b = stage_7(y.x_b, y.v_b, h, k1.a_b, k3.a_b, k4.a_b, k5.a_b, k6.a_b)
    r = stage_7(y.theta_b, y.omega_b, h, k1.alpha_b, k3.alpha_b, k4.alpha_b, k5.alpha_b, k6.alpha_b)
    t = stage_7(y.x_v, y.v_v, h, k1.a_v, k3.a_v, k4.a_v, k5.a_v, k6.a_v)
    k7 = acceleration(b.x, b.v, r.x, r.v, t.x, t.v, s, c)
    off = difference(k1.a_b, k3.a_b, k4.a_b, k5.a_b, k6.a_b, k7.a_b)
    off += difference(k1.a_v, k3.a_v, k4.a_v, k5.a_v, k6.a_v, k7.a_v)
    off += error_arm(c) * difference(k1.alpha_b, k3.alpha_b, k4.alpha_b, k5.alpha_b, k6.alpha_b, k7.alpha_b)
    return State(b.x, b.v, r.x, r.v, t.x, t.v), k7, h * off


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

    Parameters
    ----------
    h
        Length of the step [s].
    x, v, a
        Displacement, velocity and acceleration at the start.
    x_end, v_end, a_end
        The same at the end.
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
def closer(q: Track, tau: float, tau_end: float) -> float:
    """One step of Newton's method to the zero of a velocity, within 0 ... tau_end."""
    curvature = curvature_at(q, tau)
    ahead = slope_at(q, tau) / curvature if curvature != 0.0 else 0.0
    return min(max(tau - ahead, 0.0), tau_end)


@inlined
def turning_point(q: Track, tau_end: float) -> float:
    """Fraction of a step at which a velocity that changes its sign before tau_end is zero; tau_end for any other.

    Three steps from the chord: the velocity bends little within a step, and what is left counts by its square.
    """
    end = slope_at(q, tau_end)
    if not q.x1 * end < 0.0:
        return tau_end
    tau = tau_end * q.x1 / (q.x1 - end)
    return closer(q, closer(q, closer(q, tau, tau_end), tau_end), tau_end)


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
