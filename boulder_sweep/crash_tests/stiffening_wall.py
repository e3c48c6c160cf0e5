"""A vehicle whose front stiffens against a rigid wall, exact in both stages (Eq 111 with a contact that stays).

Up to the crush s_2 the motion is that of `boulder_sweep.crash_tests.rigid_wall`. From then on it follows the same
equation with k_2 in place of k_v, ``v'' + (k_2/c) v' + (k_2/m) v = 0``, from the velocity v_2 and the acceleration a_2
that it has there, since the force is continuous. Integrated once,

    x = s_2 + (m/c) (v_2 - v) + (m/k_2) (a_2 - v')
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from boulder_sweep.crash_tests.rigid_wall import RigidWall


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
