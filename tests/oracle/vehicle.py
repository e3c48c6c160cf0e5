"""The vehicle: the Maxwell element of Eqs 40 to 48, and its impact on a rigid wall, Eqs 49 to 51."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, exp, inf, nan, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def jerk(m_v: float, k_v: float, c_v: float, a_v: float, v_v: float, v_contact: float) -> float:
    """Third derivative of x_v [m/s^3], Eq 45 (last line of Eq 52).

    Eq 45 lost derivative dots; it follows from Eqs 42 to 44 as x_v''' + k/c x_v'' + k/m x_v' = k/m v_contact,
    with `v_contact` = x_b' + theta_b' R_v cos(gamma_v + theta_b).
    """
    return -k_v / c_v * a_v - k_v / m_v * v_v + k_v / m_v * v_contact


def crush_force(m_v: float, a_v: float) -> float:
    """Force F_v [N] of the Maxwell element, Eq 47, before the rule that the vehicle cannot pull."""
    return -m_v * a_v


@dataclass(frozen=True)
class WallImpact:
    """Impact on a rigid wall: Eq 45 with a contact that does not move, solved exactly.

    Attributes
    ----------
    m_v, v_0, k_v, c_v : float
        Mass [kg], impact speed [m/s], spring [N/m], damper [N s/m].
    """

    m_v: float
    v_0: float
    k_v: float
    c_v: float

    @property
    def a(self) -> float:
        """The fitting constant a [1/s] of Eqs 49 to 51: -k_v/(2 c_v)."""
        return -self.k_v / (2 * self.c_v)

    @property
    def discriminant(self) -> float:
        """a^2 - k_v/m_v [1/s^2]: negative under-damped (c_v > sqrt(k_v m_v)/2), positive over-damped."""
        return self.a**2 - self.k_v / self.m_v

    @property
    def b(self) -> float:
        """The fitting constant b [1/s] of Eqs 49 to 51; NaN where over-damped."""
        return sqrt(-self.discriminant) if self.discriminant < 0 else nan

    def response(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Displacement [m], velocity [m/s], acceleration [m/s^2] at times `t` [s], as if never released."""
        t = np.asarray(t, dtype=float)
        if self.discriminant < 0:
            return self._under_damped(t)
        if self.discriminant > 0:
            return self._over_damped(t)
        return self._critically_damped(t)

    def _under_damped(self, t: Array) -> tuple[Array, Array, Array]:
        a, b, v_0 = self.a, self.b, self.v_0
        # Eq 49 with its exponent put right: e^{at} multiplies the bracket.
        P = (v_0 - 2 * a**2 * v_0 / (a**2 + b**2)) / b
        Q = 2 * a * v_0 / (a**2 + b**2)
        decay, s, c = np.exp(a * t), np.sin(b * t), np.cos(b * t)
        x = -Q + decay * (P * s + Q * c)
        v = decay * ((a * P - b * Q) * s + (a * Q + b * P) * c)
        P_v, Q_v = a * P - b * Q, a * Q + b * P
        return x, v, decay * ((a * P_v - b * Q_v) * s + (a * Q_v + b * P_v) * c)

    def _over_damped(self, t: Array) -> tuple[Array, Array, Array]:
        # v = A e^{pt} + B e^{qt} with v(0) = v_0 and, the spring being unloaded, v'(0) = 0
        p, q = self._real_roots()
        A, B = -q * self.v_0 / (p - q), p * self.v_0 / (p - q)
        e_p, e_q = np.exp(p * t), np.exp(q * t)
        return A * np.expm1(p * t) / p + B * np.expm1(q * t) / q, A * e_p + B * e_q, A * p * e_p + B * q * e_q

    def _critically_damped(self, t: Array) -> tuple[Array, Array, Array]:
        a, v_0 = self.a, self.v_0
        decay = np.exp(a * t)  # v = v_0 (1 - a t) e^{at}
        return v_0 * (2 * (decay - 1) / a - t * decay), v_0 * (1 - a * t) * decay, -v_0 * a**2 * t * decay

    def _real_roots(self) -> tuple[float, float]:
        fast = self.a - sqrt(self.discriminant)
        return self.k_v / self.m_v / fast, fast  # product of the roots: k_v/m_v, without cancellation

    def largest_displacement(self) -> tuple[float, float]:
        """Largest x_v [m] and its time [s]; infinite time where the vehicle only creeps to a stop."""
        if self.discriminant >= 0:
            return 2 * self.v_0 * -self.a / (self.k_v / self.m_v), inf
        # v = v_0 e^{at} (cos(bt) - a/b sin(bt)) vanishes where tan(bt) = b/a, in the second quadrant
        time = atan2(self.b, self.a) / self.b
        return float(self.response(time)[0]), time

    def peak_force(self) -> tuple[float, float]:
        """Largest F_v [N] and its time [s], where the jerk vanishes."""
        if self.discriminant < 0:
            time = atan2(self.b, -self.a) / self.b  # x_v'' = -(v_0/b)(k/m) e^{at} sin(bt)
        elif self.discriminant > 0:
            p, q = self._real_roots()
            time = np.log(q / p) / (p - q)
        else:
            time = -1 / self.a
        return -self.m_v * float(self.response(time)[2]), float(time)

    def separation(self) -> tuple[float, float]:
        """Time [s] at which F_v returns to zero and the velocity [m/s] then; (inf, 0) where it never does."""
        if self.discriminant >= 0:
            return inf, 0.0
        return pi / self.b, -self.v_0 * exp(self.a * pi / self.b)


def spring_and_damper(m_v: float, a: float, b: float) -> tuple[float, float]:
    """Spring k_v [N/m] and damper c_v [N s/m] from the fitting constants a and b [1/s], Eqs 50 and 51."""
    c_v = m_v * (a**2 + b**2) / (-2 * a)
    return -2 * a * c_v, c_v
