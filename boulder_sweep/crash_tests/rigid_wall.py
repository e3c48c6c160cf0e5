"""A vehicle against a rigid wall: the exact response (Eqs 40 to 51), over-damped case included.

With the wall in place of the boulder Eq 45 reads ``v'' + (k/c) v' + (k/m) v = 0`` from v = v_0, v' = 0. Its
characteristic numbers are a +- sqrt(a^2 - k/m) with a = -k/(2c): under-damped, a +- ib, for c > sqrt(k m)/2 (Eq 49),
over-damped below. Integrated once, it gives the displacement from velocity and acceleration in every case:

    x = (m/c) (v_0 - v) - (m/k) v'

The force ends where the acceleration returns to zero, at pi/b; from there the vehicle coasts backwards. An
over-damped one never separates.

Eq 49 as printed has its exponent around the whole bracket; with the exponent outside it,
x = -2a v_0/(a^2+b^2) + e^{at} {[(v_0 - 2a^2 v_0/(a^2+b^2))/b] sin bt + [2a v_0/(a^2+b^2)] cos bt}, it is the above.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RigidWall:
    """A vehicle of mass m_v that hits a rigid wall at v_0, with spring k_v and damper c_v of its Maxwell element."""

    mass_kg: float
    speed_m_s: float
    spring_N_m: float
    damper_N_s_m: float

    @property
    def a(self) -> float:
        """Rate of growth a = -k_v/(2 c_v) of Eqs 49 to 51 [1/s], negative."""
        return -self.spring_N_m / (2.0 * self.damper_N_s_m)

    @property
    def discriminant(self) -> float:
        """a^2 - k_v/m_v [1/s^2]: -b^2 where under-damped, positive where over-damped."""
        return self.a * self.a - self.spring_N_m / self.mass_kg

    @property
    def over_damped(self) -> bool:
        """Whether the vehicle creeps to a stop without separating: c_v <= sqrt(k_v m_v)/2."""
        return self.discriminant >= 0.0

    @property
    def b(self) -> float:
        """Angular frequency b of Eqs 49 to 51 [1/s]; NaN where over-damped."""
        return math.nan if self.over_damped else math.sqrt(-self.discriminant)

    @property
    def separation_time_s(self) -> float:
        """Time at which the force has returned to zero [s]; infinite where it never does."""
        return math.inf if self.over_damped else math.pi / self.b

    @property
    def max_displacement_time_s(self) -> float:
        """Time of the largest displacement [s]; infinite where the vehicle creeps to a stop."""
        return math.inf if self.over_damped else math.atan2(self.b, self.a) / self.b

    @property
    def peak_force_time_s(self) -> float:
        """Time of the largest force [s]."""
        if not self.over_damped:
            return math.atan2(self.b, -self.a) / self.b
        slow, fast = self._real_roots()
        if fast - slow == 0.0:
            return -1.0 / self.a
        return math.log(fast / slow) / (slow - fast)

    @property
    def max_displacement_m(self) -> float:
        """Largest displacement of the truck [m]."""
        if self.over_damped:  # v and v' both end at 0
            return self.mass_kg * self.speed_m_s / self.damper_N_s_m
        return float(self.response(np.array([self.max_displacement_time_s]))[0][0])

    @property
    def peak_force(self) -> float:
        """Largest force on the wall [N]."""
        return -self.mass_kg * float(self.response(np.array([self.peak_force_time_s]))[2][0])

    @property
    def rebound_speed_m_s(self) -> float:
        """Velocity after separation [m/s], zero or negative."""
        return 0.0 if self.over_damped else -self.speed_m_s * math.exp(self.a * math.pi / self.b)

    def response(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement [m], velocity [m/s] and acceleration [m/s^2] at times since first touch [s], shape (n,) each.

        Eq 49 corrected, with the release of Eq 47; before first touch the vehicle keeps its speed.
        """
        asked = np.asarray(time_s, dtype=float)
        t = np.clip(asked, 0.0, self.separation_time_s)
        even, odd = self._decaying(t)
        m, k, c, v_0 = self.mass_kg, self.spring_N_m, self.damper_N_s_m, self.speed_m_s
        v = v_0 * (even - self.a * odd)
        acceleration = np.where(asked < self.separation_time_s, -v_0 * k / m * odd, 0.0)  # odd is 0 before first touch
        x = m / c * (v_0 - v) + v_0 * odd
        return x + v * (asked - t), v, acceleration

    def _decaying(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """e^{at} cos bt and e^{at} sin(bt)/b, or what they become where over-damped."""
        if not self.over_damped:
            decay = np.exp(self.a * t)
            return decay * np.cos(self.b * t), decay * np.sin(self.b * t) / self.b
        slow, fast = self._real_roots()
        apart = slow - fast
        if apart == 0.0:
            return np.exp(self.a * t), t * np.exp(self.a * t)
        return 0.5 * (np.exp(slow * t) + np.exp(fast * t)), -np.exp(slow * t) * np.expm1(-apart * t) / apart

    def _real_roots(self) -> tuple[float, float]:
        """Both rates of decay, the slow one from the product k/m of the two, without cancellation [1/s]."""
        fast = self.a - math.sqrt(self.discriminant)
        return self.spring_N_m / self.mass_kg / fast, fast
