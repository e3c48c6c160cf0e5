"""The motion within a step, by polynomials through both of its ends.

Displacement, velocity and acceleration are known at either end of a step, and together they fix a polynomial of degree
five in each degree of freedom. Its error is of the order h^6, as that of a step itself, one order better than the
continuous extension that goes with the pair, and no stage has to be kept for it.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import exact_inlined
from .dynamics import Acceleration, State


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


@exact_inlined
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


@exact_inlined
def displacement_at(q: Track, tau: float) -> float:
    """Displacement of a track at the fraction tau of its step."""
    return q.x0 + tau * (q.x1 + tau * (q.x2 + tau * (q.x3 + tau * (q.x4 + tau * q.x5))))


@exact_inlined
def slope_at(q: Track, tau: float) -> float:
    """Derivative of a track by tau: the velocity times the length of the step."""
    return q.x1 + tau * (2.0 * q.x2 + tau * (3.0 * q.x3 + tau * (4.0 * q.x4 + tau * (5.0 * q.x5))))


@exact_inlined
def curvature_at(q: Track, tau: float) -> float:
    """Second derivative of a track by tau: the acceleration times the square of the length of the step."""
    return 2.0 * q.x2 + tau * (6.0 * q.x3 + tau * (12.0 * q.x4 + tau * (20.0 * q.x5)))


@exact_inlined
def closer(q: Track, tau: float, tau_end: float) -> float:
    """One step of Newton's method to the zero of a velocity, within 0 ... tau_end."""
    curvature = curvature_at(q, tau)
    ahead = slope_at(q, tau) / curvature if curvature != 0.0 else 0.0
    return min(max(tau - ahead, 0.0), tau_end)


@exact_inlined
def turning_point(q: Track, tau_end: float) -> float:
    """Fraction of a step at which a velocity that changes its sign before tau_end is zero; tau_end for any other.

    Three steps from the chord: the velocity bends little within a step, and what is left counts by its square.
    """
    end = slope_at(q, tau_end)
    tau = tau_end * q.x1 / (q.x1 - end) if q.x1 != end else tau_end
    tau = closer(q, closer(q, closer(q, tau, tau_end), tau_end), tau_end)
    return tau if q.x1 * end < 0.0 else tau_end


@exact_inlined
def dense_output(y: State, k: Acceleration, y_end: State, k_end: Acceleration, h: float) -> DenseOutput:
    """Polynomials of a step of length h [s] from states and accelerations at its ends."""
    return DenseOutput(
        h,
        track(h, y.x_b, y.v_b, k.a_b, y_end.x_b, y_end.v_b, k_end.a_b),
        track(h, y.theta_b, y.omega_b, k.alpha_b, y_end.theta_b, y_end.omega_b, k_end.alpha_b),
        track(h, y.x_v, y.v_v, k.a_v, y_end.x_v, y_end.v_v, k_end.a_v),
    )


@exact_inlined
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
