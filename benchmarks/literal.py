"""The model with its switches inside the right-hand side, as a plain reading of the equations suggests.

This is what integrators without events get: contact, seat and the direction of the weight's couple are decided in
every evaluation. The kernels do not do this (see `boulder_kernels.modes`); this module shows what that gains, and
is the model that the other solvers get.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from boulder_kernels import Constants, DesignTable, Readings
from boulder_kernels.design import constants_of, design_in
from boulder_kernels.dormand_prince import STAGES, A, Track, displacement_at, slope_at, track
from boulder_kernels.dynamics import (
    Acceleration,
    State,
    contact_displacement,
    contact_lever,
    holding_moment,
    spring_compression,
)
from boulder_kernels.numerics import sine_versine
from boulder_kernels.soil import soil_kinematics
from boulder_kernels.soil_laws import soil_reaction

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
_A = np.array(A)


@_compiled
def printed_restoring_moment(
    M: float, theta_b: float, omega_b: float, sin: float, versin: float, c: Constants
) -> float:
    """Restoring moment M_R exactly as printed [N m] (Eqs 37-39), with its switches inside.

    Parameters
    ----------
    M
        Net moment of soil and truck [N m].
    theta_b, omega_b
        Rotation [rad] and angular velocity [rad/s].
    sin, versin
        sin(theta_b) and 1 - cos(theta_b).
    c
        Constants of a design whose restoring moment is read as printed.
    """
    if omega_b <= 0.0:
        return 0.0
    limit = holding_moment(sin, versin, c)
    corner = math.copysign(1.0, c.theta_corner - theta_b)
    return -corner * min(max(M, -limit), limit)


@_compiled
def literal_net_moment(
    M: float, theta_b: float, omega_b: float, sin: float, versin: float, readings: Readings, c: Constants
) -> float:
    """Moment of soil, truck and weight [N m] (Eqs 37-39, or the couple of the weight)."""
    if not readings.restoring_gravity:
        return M + printed_restoring_moment(M, theta_b, omega_b, sin, versin, c)
    if theta_b == 0.0 and omega_b == 0.0:
        return M - min(max(M, -c.C_cos), c.C_cos)
    direction = math.copysign(1.0, theta_b if theta_b != 0.0 else omega_b)
    return M - direction * (c.C_cos - c.C_cos * versin + c.C_sin * abs(sin))


@_compiled
def literal_acceleration(y: State, readings: Readings, c: Constants) -> Acceleration:
    """Right-hand side of Eq 52 with every switch inside."""
    sin, versin = sine_versine(y.theta_b)
    soil = soil_reaction(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    F_v = c.k_v * max(u, 0.0)
    M = soil.M + F_v * contact_lever(sin, versin, c)
    net = literal_net_moment(M, y.theta_b, y.omega_b, sin, versin, readings, c)
    pressed = max(u, 0.0) if readings.separation_released else u
    return Acceleration((soil.F + F_v) * c.inverse_m_eff, net * c.inverse_J_eff, -c.k_m * pressed, M)


@_compiled
def literal_step(y: State, k1: Acceleration, h: float, readings: Readings, c: Constants) -> tuple[State, Acceleration]:
    """One step of Dormand and Prince with the switches inside."""
    v = np.empty((STAGES, 3))
    a = np.empty((STAGES, 3))
    v[0, 0], v[0, 1], v[0, 2] = y.v_b, y.omega_b, y.v_v
    a[0, 0], a[0, 1], a[0, 2] = k1.a_b, k1.alpha_b, k1.a_v
    end, k = y, k1
    for i in range(1, STAGES):
        x = np.array((y.x_b, y.theta_b, y.x_v))
        v[i] = v[0]
        for j in range(i):
            x += h * _A[i, j] * v[j]
            v[i] += h * _A[i, j] * a[j]
        end = State(x[0], v[i, 0], x[1], v[i, 1], x[2], v[i, 2])
        k = literal_acceleration(end, readings, c)
        a[i, 0], a[i, 1], a[i, 2] = k.a_b, k.alpha_b, k.a_v
    return end, k


@_compiled
def highest(q: Track) -> float:
    """Largest displacement within a step: at its ends, or at a maximum between them."""
    end = displacement_at(q, 1.0)
    slope_end = slope_at(q, 1.0)
    if not q.x1 > 0.0 > slope_end:
        return max(q.x0, end)
    tau = q.x1 / (q.x1 - slope_end)
    for _ in range(4):  # Newton's method from the chord
        bend = 2.0 * q.x2 + tau * (6.0 * q.x3 + tau * (12.0 * q.x4 + tau * 20.0 * q.x5))
        tau = min(max(tau - slope_at(q, tau) / bend, 0.0), 1.0)
    return max(displacement_at(q, tau), max(q.x0, end))


@_compiled
def literal_maxima(
    c: Constants, readings: Readings, h_full: float, t_end: float, theta_limit: float
) -> tuple[float, float, float]:
    """Simulate one impact by fixed steps [s] up to a time [s] or to the limit of rotation [rad].

    Returns
    -------
    theta, x_b, x_v
        Largest |rotation| [rad], displacement of the boulder and of the truck [m].
    """
    y = State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0)
    k = literal_acceleration(y, readings, c)
    theta, x_b, x_v = 0.0, 0.0, 0.0
    t = 0.0
    while t < t_end and theta < theta_limit:
        h = min(h_full, t_end - t)
        y_end, k_end = literal_step(y, k, h, readings, c)
        forward = track(h, y.theta_b, y.omega_b, k.alpha_b, y_end.theta_b, y_end.omega_b, k_end.alpha_b)
        back = Track(-forward.x0, -forward.x1, -forward.x2, -forward.x3, -forward.x4, -forward.x5)
        theta = max(theta, highest(forward), highest(back))
        x_b = max(x_b, highest(track(h, y.x_b, y.v_b, k.a_b, y_end.x_b, y_end.v_b, k_end.a_b)))
        x_v = max(x_v, highest(track(h, y.x_v, y.v_v, k.a_v, y_end.x_v, y_end.v_v, k_end.a_v)))
        t = t + h if h == h_full else t_end
        y, k = y_end, k_end
    return theta, x_b, x_v


@_compiled
def _literal_maxima(
    designs: np.ndarray, readings: Readings, h: float, t_end: np.ndarray, theta_limit: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Do the work of `literal_table` on an array, shape (15, n)."""
    n = designs.shape[1]
    theta, x_b, x_v = np.zeros(n), np.zeros(n), np.zeros(n)
    for row in range(n):
        c = constants_of(design_in(designs, row), readings, 0)
        theta[row], x_b[row], x_v[row] = literal_maxima(c, readings, h, t_end[row], theta_limit)
    return theta, x_b, x_v


def literal_table(
    table: DesignTable, readings: Readings, h: float, t_end: np.ndarray, theta_limit: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Largest rotation [rad], displacement of the boulder and of the truck [m] of every design.

    Parameters
    ----------
    table
        Designs, SI, arrays of shape (n,).
    readings
        Which formulas are read as printed.
    h
        Step [s].
    t_end
        End time of each design [s], known beforehand, shape (n,).
    theta_limit
        Rotation at which a simulation ends [rad].
    """
    return _literal_maxima(np.stack(table), readings, h, t_end, theta_limit)
