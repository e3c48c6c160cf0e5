"""The equations of motion (Eqs 1 to 39, 45, 47, 52) in plain loops, and the Runge-Kutta method."""

from __future__ import annotations

from math import cos, pi, sin, sqrt, tan
from typing import NamedTuple

import numba
import numpy as np

GRAVITY = 9.80665
NODE = 0.5 / sqrt(3.0)
"""Gauss's rule with two points, 0.5 -+ NODE on 0 ... 1, is exact to the third degree, as integrands here need."""
CREEP = 1e-12
"""An angular velocity just over zero [rad/s]: what the literal equations arrive at when a turn back has ended."""

compiled = numba.njit(nogil=True, error_model="numpy")


class Body(NamedTuple):
    """What one impact is made of; SI, beta in MN/m^3."""

    m: float
    J: float
    W: float
    d: float
    l_n: float
    z_0: float
    h: float
    face: float
    c_y: float
    weight: float
    half_L: float
    half_H: float
    kappa: float
    x_yield: float
    drag: float
    m_v: float
    v_0: float
    k_v: float
    c_v: float
    gravity: bool
    released: bool


class Result(NamedTuple):
    """Largest values over the time followed, and when the rotation first reached the limit (infinite: never).

    The crush is x_v less the displacement of the contact point, as long as the truck drives forward.
    """

    theta: float
    x_b: float
    x_v: float
    crush: float
    t_limit: float


@compiled
def body_of(
    L: float,
    W: float,
    H: float,
    rho_b: float,
    d: float,
    e: float,
    rho_s: float,
    phi: float,
    beta: float,
    K_eps: float,
    m_v: float,
    v_0: float,
    k_v: float,
    c_v: float,
    box: bool,
    geometric: bool,
    left_face: bool,
    gravity: bool,
    released: bool,
) -> Body:
    """Masses, arms and springs of one impact."""
    m_b = rho_b * L * W * H
    m_s = rho_s * W * tan(pi / 4 + phi / 2) * d * d / 2
    m = m_b + m_s
    c_x = (m_b * L / 2 + m_s * L) / m
    c_y = (m_b * H / 2 + m_s * 2 * d / 3) / m
    own = m_b / 12 * (H * H + L * L) if box else m_b / 12 * ((H / 2) ** 2 + (L / 2) ** 2)
    J = own + m_b * ((c_y - H / 2) ** 2 + (c_x - L / 2) ** 2)
    J += m_s * ((2 * d / 3 - c_y) ** 2 + d * d / 18 + (L - c_x) ** 2)
    h = e + d - c_y if geometric else e + c_y - d
    K_p = tan(pi / 4 + phi / 2) ** 2
    stiffness = 1e6 * beta * tan(phi) / d
    return Body(
        m,
        J,
        W,
        d,
        L - c_x,
        d - c_y,
        h,
        c_x if left_face else -c_x,
        c_y,
        m_b * GRAVITY,
        L / 2,
        H / 2,
        stiffness * W,
        K_p * K_p * rho_s * GRAVITY * K_eps / stiffness,
        rho_s * W,
        m_v,
        v_0,
        k_v,
        c_v,
        gravity,
        released,
    )


@compiled
def soil(b: Body, x: float, v: float, s: float, c: float, omega: float) -> tuple[float, float]:
    """Force and moment of the soil: the pressure over the depth, split where it has a kink."""
    A, S = x + b.l_n * (c - 1) + b.z_0 * s, s
    B, P = v - omega * (b.l_n * s - b.z_0 * c), omega * c
    q = b.l_n * s - b.z_0 * c
    cut_1 = min(max((A - b.x_yield) / S, 0.0), b.d) if S != 0.0 else 0.0
    cut_2 = min(max((A + b.x_yield) / S, 0.0), b.d) if S != 0.0 else 0.0
    cut_3 = min(max(B / P, 0.0), b.d) if P != 0.0 else 0.0
    cut_1, cut_2 = min(cut_1, cut_2), max(cut_1, cut_2)
    cut_2, cut_3 = min(cut_2, cut_3), max(cut_2, cut_3)
    cut_1, cut_2 = min(cut_1, cut_2), max(cut_1, cut_2)
    F = M = 0.0
    start = 0.0
    for end in (cut_1, cut_2, cut_3, b.d):
        width = end - start
        if width > 0.0:
            for side in (-NODE, NODE):
                depth = start + width * (0.5 + side)
                moved = min(max(A - S * depth, -b.x_yield), b.x_yield)
                speed = B - P * depth
                pressure = b.kappa * depth * moved + b.drag * speed * abs(speed)
                F -= 0.5 * width * pressure
                M += 0.5 * width * pressure * (depth * c + q)
        start = end
    return F, M


@compiled
def restoring(b: Body, theta: float, omega: float, s: float, c: float, M: float) -> float:
    """Restoring moment, read literally: Eqs 37 to 39, or the couple of the weight about the corner."""
    if b.gravity:
        if theta == 0.0 and omega == 0.0:
            return -min(max(M, -b.weight * b.half_L), b.weight * b.half_L)
        side = 1.0 if theta > 0.0 or (theta == 0.0 and omega > 0.0) else -1.0
        return -side * b.weight * (b.half_L * c - b.half_H * abs(s))
    if omega <= 0.0:
        return 0.0
    largest = b.weight * abs(b.c_y * c + b.l_n * s)
    sign = 1.0 if b.l_n * c - b.c_y * s > 0.0 else -1.0
    return -sign * min(max(M, -largest), largest)


@compiled
def rate(
    b: Body, coasting: bool, y: tuple[float, float, float, float, float, float, float]
) -> tuple[float, float, float, float, float, float, float]:
    """Eq 52. The states are x_b, its rate, theta_b, its rate, x_v, its rate and its second derivative."""
    x, v, theta, omega, _, v_v, a_v = y
    s, c = sin(theta), cos(theta)
    F, M = soil(b, x, v, s, c, omega)
    lever = b.h * c + b.face * s
    jerk = 0.0
    if coasting:
        a_v = 0.0
    else:
        blow = max(-b.m_v * a_v, 0.0)
        F += blow
        M += blow * lever
        jerk = -b.k_v / b.c_v * a_v - b.k_v / b.m_v * (v_v - v - omega * lever)
    return v, F / b.m, omega, (M + restoring(b, theta, omega, s, c, M)) / b.J, v_v, a_v, jerk


@compiled
def moved(
    y: tuple[float, float, float, float, float, float, float],
    k: tuple[float, float, float, float, float, float, float],
    h: float,
) -> tuple[float, float, float, float, float, float, float]:
    """States y + h k."""
    return (
        y[0] + h * k[0],
        y[1] + h * k[1],
        y[2] + h * k[2],
        y[3] + h * k[3],
        y[4] + h * k[4],
        y[5] + h * k[5],
        y[6] + h * k[6],
    )


@compiled
def runge_kutta(
    b: Body, coasting: bool, y: tuple[float, float, float, float, float, float, float], h: float
) -> tuple[float, float, float, float, float, float, float]:
    """One step of the classical method of order four."""
    k_1 = rate(b, coasting, y)
    k_2 = rate(b, coasting, moved(y, k_1, h / 2))
    k_3 = rate(b, coasting, moved(y, k_2, h / 2))
    k_4 = rate(b, coasting, moved(y, k_3, h))
    y = moved(moved(y, k_1, h / 6), k_2, h / 3)
    return moved(moved(y, k_3, h / 3), k_4, h / 6)


@compiled
def follow(b: Body, h: float, horizon: float, limit: float) -> Result:
    """Follow one impact by steps h [s] for a time [s], or until the rotation has reached the limit [rad]."""
    y = (0.0, 0.0, 0.0, 0.0, 0.0, b.v_0, 0.0)
    coasting = False
    gap_at_release = 0.0
    theta = x_b = x_v = crush = 0.0
    for n in range(1, round(horizon / h) + 1):
        end = runge_kutta(b, coasting, y, h)
        if not b.gravity and y[3] < 0.0 < end[3]:
            # A turn back ends inside: land on it, so that the boulder goes on from just over zero.
            part = y[3] / (y[3] - end[3])
            at = runge_kutta(b, coasting, y, part * h)
            end = runge_kutta(b, coasting, (at[0], at[1], at[2], CREEP, at[4], at[5], at[6]), (1.0 - part) * h)
        y = end
        gap = y[4] - y[0] - b.h * sin(y[2]) - b.face * (1.0 - cos(y[2]))
        if b.released:
            if not coasting and y[6] > 0.0:
                coasting, gap_at_release = True, gap
            elif coasting and gap > gap_at_release:
                coasting = False
            if coasting:
                y = (y[0], y[1], y[2], y[3], y[4], y[5], 0.0)
        theta, x_b, x_v, crush = (
            max(theta, abs(y[2])),
            max(x_b, y[0]),
            max(x_v, y[4]),
            max(crush, gap if y[5] > 0.0 else 0.0),
        )
        if not abs(y[2]) < limit:
            return Result(theta, x_b, x_v, crush, n * h)
    return Result(theta, x_b, x_v, crush, np.inf)


@compiled
def follow_rows(columns: np.ndarray, switches: np.ndarray, h: np.ndarray, horizon: float, limit: float) -> np.ndarray:
    """Follow the impacts of the rows of `columns`, each with its own step."""
    found = np.empty((columns.shape[0], 5))
    for row in range(columns.shape[0]):
        p = columns[row]
        b = body_of(
            p[0],
            p[1],
            p[2],
            p[3],
            p[4],
            p[5],
            p[6],
            p[7],
            p[8],
            p[9],
            p[10],
            p[11],
            p[12],
            p[13],
            switches[0],
            switches[1],
            switches[2],
            switches[3],
            switches[4],
        )
        # A twelfth of the shortest time in which anything here can answer.
        fastest = sqrt(
            b.kappa * b.d * b.d * (1.0 / b.m + b.d * b.d / b.J)
            + b.k_v * (1.0 / b.m_v + 1.0 / b.m + (b.h * b.h + b.face * b.face) / b.J)
        )
        shortest = min(h[row], 1.0 / (12.0 * max(fastest, b.k_v / b.c_v)))
        r = follow(b, shortest, horizon, limit)
        found[row, 0], found[row, 1], found[row, 2], found[row, 3], found[row, 4] = r
    return found


NAMES = ("L", "W", "H", "rho_b", "d", "e", "rho_s", "phi", "beta", "K_epsilon", "m_v", "v_0", "k_v", "c_v")


def follow_table(
    table: dict[str, np.ndarray],
    switches: tuple[bool, bool, bool, bool, bool],
    step: float,
    horizon: float,
    limit: float,
) -> Result:
    """Follow many impacts.

    Parameters
    ----------
    table : dict
        Columns of shape (n,) by the paper's symbols, as in `NAMES`; SI, phi in rad, beta in MN/m^3.
    switches : tuple of bool
        Whether inertia, impact_arm, contact, restoring and separation are corrected.
    step : float
        Longest step [s]; designs that answer faster get a shorter one.
    horizon : float
        Time to follow [s].
    limit : float
        Rotation [rad] at which a design is given up.

    Returns
    -------
    Result
        Arrays of shape (n,); rad, m, s.
    """
    columns = np.column_stack([np.asarray(table[name], dtype=float) for name in NAMES])
    found = follow_rows(columns, np.array(switches), np.full(len(columns), step), horizon, limit)
    return Result(*found.T)
