"""The largest speed with which a vehicle reaches a boulder, by the street that leads to it, in plain numbers.

The vehicle leaves the last curve, or passes the beginning of the run-up, and accelerates up to the boulder:
``v^2 = v_0^2 + 2 (a - g sin(atan(grade))) s``. A curve is left with at most ``sqrt(mu g r)``, the speed at which the
vehicle skids (MIL-HDBK-1013/14, Eq 6; UFC 4-022-02 supersedes it). Nothing else limits the speed, which is the safe
side: an acceleration falls as the speed grows, and a vehicle has a largest speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

G = 9.80665
"""Acceleration of gravity [m/s^2]."""
FRICTION = 1.0
"""Coefficient of friction of tyres where none is known: MIL-HDBK-1013/14 takes 1 as the conservative value, and gives
0.6 as usual on a road."""


class NoApproachError(ValueError):
    """The vehicle does not reach the boulder."""


@dataclass(frozen=True, slots=True)
class Approach:
    """A run-up to a boulder.

    Attributes
    ----------
    length_m : float
        Length s of the run-up, from its beginning or the end of its last curve to the boulder [m].
    acceleration_m_s2 : float
        Acceleration a of the vehicle on level ground, at full throttle [m/s^2].
    from_m_s : float or None
        Speed at the beginning of the run-up [m/s]; None for what the curve admits.
    curve_radius_m : float or None
        Radius r of the curve that ends where the run-up begins [m]; None for none.
    friction : float
        Coefficient of friction mu of the tyres in that curve [-].
    grade : float
        Rise over run of the street in the direction of travel, negative downhill [-].
    """

    length_m: float
    acceleration_m_s2: float
    from_m_s: float | None = None
    curve_radius_m: float | None = None
    friction: float = FRICTION
    grade: float = 0.0

    @property
    def curve_speed_m_s(self) -> float:
        """Largest speed in the curve, sqrt(mu g r) [m/s]; infinite where there is none."""
        return math.inf if self.curve_radius_m is None else math.sqrt(self.friction * G * self.curve_radius_m)

    @property
    def start_speed_m_s(self) -> float:
        """Speed v_0 at the beginning of the run-up: what is given, or what the curve admits if that is less [m/s]."""
        return min(self.curve_speed_m_s, math.inf if self.from_m_s is None else self.from_m_s)

    @property
    def net_acceleration_m_s2(self) -> float:
        """Acceleration less the part of gravity along the street, g sin(atan(grade)) [m/s^2]."""
        return self.acceleration_m_s2 - G * self.grade / math.sqrt(1.0 + self.grade * self.grade)

    @property
    def impact_speed_m_s(self) -> float:
        """Speed at the boulder [m/s].

        Raises
        ------
        NoApproachError
            The vehicle stops before the boulder, or never starts.
        """
        squared = self.start_speed_m_s**2 + 2.0 * self.net_acceleration_m_s2 * self.length_m
        if squared > 0.0:
            return math.sqrt(squared)
        stops = 0.0 if self.start_speed_m_s == 0.0 else -0.5 * self.start_speed_m_s**2 / self.net_acceleration_m_s2
        raise NoApproachError(f"the vehicle comes to rest after {stops:.3g} m and does not reach the boulder")
