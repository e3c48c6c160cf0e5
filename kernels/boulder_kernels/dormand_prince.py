"""One step of Dormand and Prince's method, and its dense output."""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined
from .design import Constants
from .dynamics import Acceleration, State, acceleration
from .modes import Switches
from .tableau import AA, A, C, P, PA


class Stages(NamedTuple):
    """The accelerations of the seven stages; the last belongs to the end of the step."""

    k1: Acceleration
    k2: Acceleration
    k3: Acceleration
    k4: Acceleration
    k5: Acceleration
    k6: Acceleration
    k7: Acceleration


class Point(NamedTuple):
    """Displacement and velocity of one degree of freedom."""

    x: float
    v: float


@inlined
def stage_2(x: float, v: float, h: float, a1: float) -> Point:
    """Second stage of one degree of freedom."""
    return Point(x + h * (C[1] * v), v + h * (A[1][0] * a1))


@inlined
def stage_3(x: float, v: float, h: float, a1: float, a2: float) -> Point:
    """Third stage of one degree of freedom."""
    return Point(
        x + h * (C[2] * v + h * (AA[2][0] * a1)),
        v + h * (A[2][0] * a1 + A[2][1] * a2),
    )


@inlined
def stage_4(x: float, v: float, h: float, a1: float, a2: float, a3: float) -> Point:
    """Fourth stage of one degree of freedom."""
    return Point(
        x + h * (C[3] * v + h * (AA[3][0] * a1 + AA[3][1] * a2)),
        v + h * (A[3][0] * a1 + A[3][1] * a2 + A[3][2] * a3),
    )


@inlined
def stage_5(x: float, v: float, h: float, a1: float, a2: float, a3: float, a4: float) -> Point:
    """Fifth stage of one degree of freedom."""
    return Point(
        x + h * (C[4] * v + h * (AA[4][0] * a1 + AA[4][1] * a2 + AA[4][2] * a3)),
        v + h * (A[4][0] * a1 + A[4][1] * a2 + A[4][2] * a3 + A[4][3] * a4),
    )


@inlined
def stage_6(x: float, v: float, h: float, a1: float, a2: float, a3: float, a4: float, a5: float) -> Point:
    """Sixth stage of one degree of freedom."""
    return Point(
        x + h * (v + h * (AA[5][0] * a1 + AA[5][1] * a2 + AA[5][2] * a3 + AA[5][3] * a4)),
        v + h * (A[5][0] * a1 + A[5][1] * a2 + A[5][2] * a3 + A[5][3] * a4 + A[5][4] * a5),
    )


@inlined
def stage_7(x: float, v: float, h: float, a1: float, a3: float, a4: float, a5: float, a6: float) -> Point:
    """End of the step, of fifth order, for one degree of freedom."""
    return Point(
        x + h * (v + h * (AA[6][0] * a1 + AA[6][2] * a3 + AA[6][3] * a4 + AA[6][4] * a5)),
        v + h * (A[6][0] * a1 + A[6][2] * a3 + A[6][3] * a4 + A[6][4] * a5 + A[6][5] * a6),
    )


@inlined
def step(y: State, k1: Acceleration, h: float, s: Switches, c: Constants) -> tuple[State, Stages]:
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
    Stages
        Accelerations of the stages, for `dense_output`; the last is that at the end.
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
    return State(b.x, b.v, r.x, r.v, t.x, t.v), Stages(k1, k2, k3, k4, k5, k6, k7)


class Track(NamedTuple):
    """One degree of freedom within a step, as polynomials of tau = 0 ... 1."""

    x: float
    """Displacement at the start."""
    hv: float
    """Step times velocity at the start."""
    x2: float
    x3: float
    x4: float
    v: float
    """Velocity at the start."""
    v1: float
    v2: float
    v3: float
    v4: float


@inlined
def track(
    x: float, v: float, h: float, a1: float, a3: float, a4: float, a5: float, a6: float, a7: float
) -> Track:
    """Coefficients of the dense output of one degree of freedom from its accelerations.

    Displacement and velocity have the continuous extension of order four, which meets the step at both ends.
    """
    hh = h * h
    return Track(
        x,
        h * v,
        hh * (PA[0][1] * a1 + PA[2][1] * a3 + PA[3][1] * a4 + PA[4][1] * a5 + PA[5][1] * a6),
        hh * (PA[0][2] * a1 + PA[2][2] * a3 + PA[3][2] * a4 + PA[4][2] * a5 + PA[5][2] * a6),
        hh * (PA[0][3] * a1 + PA[2][3] * a3 + PA[3][3] * a4 + PA[4][3] * a5 + PA[5][3] * a6),
        v,
        h * a1,
        h * (P[0][1] * a1 + P[2][1] * a3 + P[3][1] * a4 + P[4][1] * a5 + P[5][1] * a6 + P[6][1] * a7),
        h * (P[0][2] * a1 + P[2][2] * a3 + P[3][2] * a4 + P[4][2] * a5 + P[5][2] * a6 + P[6][2] * a7),
        h * (P[0][3] * a1 + P[2][3] * a3 + P[3][3] * a4 + P[4][3] * a5 + P[5][3] * a6 + P[6][3] * a7),
    )


@inlined
def displacement_at(q: Track, tau: float) -> float:
    """Displacement of a track at the fraction tau of its step."""
    return q.x + tau * (q.hv + tau * (q.x2 + tau * (q.x3 + tau * q.x4)))


@inlined
def velocity_at(q: Track, tau: float) -> float:
    """Velocity of a track at the fraction tau of its step."""
    return q.v + tau * (q.v1 + tau * (q.v2 + tau * (q.v3 + tau * q.v4)))


class DenseOutput(NamedTuple):
    """The three degrees of freedom within a step."""

    boulder: Track
    rotation: Track
    truck: Track


@inlined
def dense_output(y: State, h: float, k: Stages) -> DenseOutput:
    """Dense output of a step from its start, its length [s] and the accelerations of its stages."""
    return DenseOutput(
        track(y.x_b, y.v_b, h, k.k1.a_b, k.k3.a_b, k.k4.a_b, k.k5.a_b, k.k6.a_b, k.k7.a_b),
        track(
            y.theta_b,
            y.omega_b,
            h,
            k.k1.alpha_b,
            k.k3.alpha_b,
            k.k4.alpha_b,
            k.k5.alpha_b,
            k.k6.alpha_b,
            k.k7.alpha_b,
        ),
        track(y.x_v, y.v_v, h, k.k1.a_v, k.k3.a_v, k.k4.a_v, k.k5.a_v, k.k6.a_v, k.k7.a_v),
    )


@inlined
def state_at(dense: DenseOutput, tau: float) -> State:
    """State at the fraction tau of a step, of order four."""
    return State(
        displacement_at(dense.boulder, tau),
        velocity_at(dense.boulder, tau),
        displacement_at(dense.rotation, tau),
        velocity_at(dense.rotation, tau),
        displacement_at(dense.truck, tau),
        velocity_at(dense.truck, tau),
    )
