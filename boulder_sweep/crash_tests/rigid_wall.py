"""A vehicle against a rigid wall: the exact response (Eqs 40 to 51), over-damped case and second spring included.

With the wall in place of the boulder Eq 45 reads ``v'' + (k/c) v' + (k/m) v = 0`` from v = v_0, v' = 0. Its
characteristic numbers are a +- sqrt(a^2 - k/m) with a = -k/(2c): under-damped, a +- ib, for c > sqrt(k m)/2 (Eq 49),
over-damped below. Integrated once, it gives the displacement from velocity and acceleration in every case:

    x = (m/c) (v_0 - v) - (m/k) v'

The force ends where the acceleration returns to zero, at pi/b; from there the vehicle coasts backwards. An
over-damped one never separates.

Eq 49 as printed has its exponent around the whole bracket; with the exponent outside it,
x = -2a v_0/(a^2+b^2) + e^{at} {[(v_0 - 2a^2 v_0/(a^2+b^2))/b] sin bt + [2a v_0/(a^2+b^2)] cos bt}, it is the above.

A front that stiffens (Eq 111 with a contact that stays) moves like this up to the crush s_2. From then on it follows
the same equation with k_2 in place of k_v, ``v'' + (k_2/c) v' + (k_2/m) v = 0``, from the velocity v_2 and the
acceleration a_2 that it has there, since the force is continuous. Integrated once,

    x = s_2 + (m/c) (v_2 - v) + (m/k_2) (a_2 - v')
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class RigidWall:
    """A vehicle that hits a rigid wall.

    Parameters
    ----------
    mass_kg : float
        Mass m_v of the vehicle.
    speed_m_s : float
        Speed v_0 of impact.
    spring_N_m, damper_N_s_m : float
        Spring k_v and damper c_v of its Maxwell element.
    """

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
        """Largest displacement [m]."""
        if self.over_damped:  # v and v' both end at 0
            return self.mass_kg * self.speed_m_s / self.damper_N_s_m
        return float(self.displacement(np.array([self.max_displacement_time_s]))[0])

    @property
    def peak_force(self) -> float:
        """Largest force on the wall [N]."""
        return -self.mass_kg * float(self.acceleration(np.array([self.peak_force_time_s]))[0])

    @property
    def rebound_speed_m_s(self) -> float:
        """Velocity after separation [m/s], zero or negative."""
        return 0.0 if self.over_damped else -self.speed_m_s * math.exp(self.a * math.pi / self.b)

    def velocity(self, time_s: np.ndarray) -> np.ndarray:
        """Velocity [m/s] at times [s], shape (n,)."""
        return self.response(time_s)[1]

    def acceleration(self, time_s: np.ndarray) -> np.ndarray:
        """Acceleration [m/s^2] at times [s], shape (n,)."""
        return self.response(time_s)[2]

    def displacement(self, time_s: np.ndarray) -> np.ndarray:
        """Displacement [m] at times [s], shape (n,)."""
        return self.response(time_s)[0]

    def response(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement [m], velocity [m/s] and acceleration [m/s^2] (Eq 49 corrected, with the release of Eq 47).

        Parameters
        ----------
        time_s : ndarray, shape (n,)
            Times since first touch [s], not negative.

        Returns
        -------
        tuple of three ndarrays, shape (n,)
        """
        asked = np.asarray(time_s, dtype=float)
        t = np.minimum(asked, self.separation_time_s)
        even, odd = self.decaying(t)
        m, k, c, v_0 = self.mass_kg, self.spring_N_m, self.damper_N_s_m, self.speed_m_s
        v = v_0 * (even - self.a * odd)
        acceleration = np.where(asked < self.separation_time_s, -v_0 * k / m * odd, 0.0)
        x = m / c * (v_0 - v) + v_0 * odd
        return x + v * (asked - t), v, acceleration

    def decaying(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """e^{at} cos bt and e^{at} sin(bt)/b, or what they become where over-damped."""
        if not self.over_damped:
            decay = np.exp(self.a * t)
            return decay * np.cos(self.b * t), decay * np.sin(self.b * t) / self.b
        slow, fast = self._real_roots()
        apart = slow - fast
        if apart == 0.0:
            return np.exp(self.a * t), t * np.exp(self.a * t)
        return 0.5 * (np.exp(slow * t) + np.exp(fast * t)), -np.exp(slow * t) * np.expm1(-apart * t) / apart

    def first_zero(self, even: float, odd: float) -> float:
        """First time after 0 at which even e^{at} cos(bt) + odd e^{at} sin(bt)/b is zero [s]; infinite where never."""
        if even < 0.0:
            even, odd = -even, -odd
        if not self.over_damped:
            return math.atan2(even * self.b, -odd) / self.b
        if odd >= 0.0:
            return math.inf
        width = math.sqrt(self.discriminant)
        share = -even * width / odd
        if width == 0.0:
            return -even / odd
        return math.atanh(share) / width if share < 1.0 else math.inf

    def _real_roots(self) -> tuple[float, float]:
        """Both rates of decay, the slow one from the product k/m of the two, without cancellation [1/s]."""
        fast = self.a - math.sqrt(self.discriminant)
        return self.spring_N_m / self.mass_kg / fast, fast


class Stage(NamedTuple):
    """Where the second spring takes over."""

    time_s: float
    velocity_m_s: float
    acceleration_m_s2: float


@dataclass(frozen=True)
class StiffeningWall(RigidWall):
    """A vehicle with a second spring that hits a rigid wall.

    Parameters
    ----------
    second_spring_N_m : float
        Spring k_2 from a crush on, at least the first.
    second_spring_from_m : float
        That crush, s_2.
    """

    second_spring_N_m: float
    second_spring_from_m: float

    @cached_property
    def first(self) -> RigidWall:
        """The vehicle without its second spring."""
        return RigidWall(self.mass_kg, self.speed_m_s, self.spring_N_m, self.damper_N_s_m)

    @cached_property
    def second(self) -> RigidWall:
        """The vehicle with its second spring only."""
        return RigidWall(self.mass_kg, self.speed_m_s, self.second_spring_N_m, self.damper_N_s_m)

    @cached_property
    def stage(self) -> Stage | None:
        """Where the second spring takes over; None where the vehicle stops before."""
        s_2, last = self.second_spring_from_m, self.first.max_displacement_time_s
        if s_2 >= self.first.max_displacement_m:
            return None
        early, late = 0.0, min(last, 2.0 * s_2 / self.speed_m_s)
        while late < last and self.first.displacement(np.array([late]))[0] < s_2:
            late = min(2.0 * late, last)
        for _ in range(200):
            middle = 0.5 * (early + late)
            if not early < middle < late:
                break
            beyond = self.first.displacement(np.array([middle]))[0] >= s_2
            early, late = (early, middle) if beyond else (middle, late)
        _, v, a = self.first.response(np.array([late]))
        return Stage(late, float(v[0]), float(a[0]))

    @property
    def separation_time_s(self) -> float:
        """Time at which the force has returned to zero [s]; infinite where it never does."""
        if self.stage is None:
            return self.first.separation_time_s
        v_2, a_2 = self.stage[1:]
        w = self.second
        return self.stage.time_s + w.first_zero(a_2, w.a * a_2 - w.spring_N_m / w.mass_kg * v_2)

    @property
    def max_displacement_time_s(self) -> float:
        """Time of the largest displacement [s]; infinite where the vehicle creeps to a stop."""
        if self.stage is None:
            return self.first.max_displacement_time_s
        v_2, a_2 = self.stage[1:]
        return self.stage.time_s + self.second.first_zero(v_2, a_2 - self.second.a * v_2)

    @property
    def peak_force_time_s(self) -> float:
        """Time of the largest force [s]: whether it still grows does not depend on the spring."""
        if self.stage is None or self.first.peak_force_time_s <= self.stage.time_s:
            return self.first.peak_force_time_s
        v_2, a_2 = self.stage[1:]
        w = self.second
        rate = w.spring_N_m / w.mass_kg
        jerk = 2.0 * w.a * a_2 - rate * v_2
        return self.stage.time_s + w.first_zero(jerk, w.a * jerk - rate * a_2)

    @property
    def max_displacement_m(self) -> float:
        """Largest displacement [m]."""
        if self.stage is None:
            return self.first.max_displacement_m
        last = self.max_displacement_time_s
        if math.isfinite(last):
            return float(self.displacement(np.array([last]))[0])
        m, c, (_, v_2, a_2) = self.mass_kg, self.damper_N_s_m, self.stage
        return self.second_spring_from_m + m / c * v_2 + m / self.second_spring_N_m * a_2

    @property
    def rebound_speed_m_s(self) -> float:
        """Velocity after separation [m/s], zero or negative."""
        last = self.separation_time_s
        return float(self.velocity(np.array([last]))[0]) if math.isfinite(last) else 0.0

    def response(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement [m], velocity [m/s] and acceleration [m/s^2]; see `RigidWall.response`."""
        before = self.first.response(time_s)
        if self.stage is None:
            return before
        asked = np.asarray(time_s, dtype=float)
        end, (t_2, v_2, a_2) = self.separation_time_s, self.stage
        t = np.clip(asked, t_2, end) - t_2
        w = self.second
        rate = w.spring_N_m / w.mass_kg
        even, odd = w.decaying(t)
        v = v_2 * even + (a_2 - w.a * v_2) * odd
        a = a_2 * even + (w.a * a_2 - rate * v_2) * odd
        x = self.second_spring_from_m + w.mass_kg / w.damper_N_s_m * (v_2 - v) + (a_2 - a) / rate
        after = (x + v * np.maximum(asked - end, 0.0), v, np.where(asked < end, a, 0.0))
        x, v, a = (np.where(asked < t_2, one, other) for one, other in zip(before, after, strict=True))
        return x, v, a
