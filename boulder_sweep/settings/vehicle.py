"""The street to the boulder, which stands for the speed of a vehicle.

The vehicle leaves the last curve, or passes the beginning of the run-up, and accelerates up to the boulder:
``v^2 = v_0^2 + 2 (a - g sin(atan(grade))) s``. A curve is left with at most ``sqrt(mu g r)``, the speed at which the
vehicle skids (MIL-HDBK-1013/14, Eq 6; UFC 4-022-02 supersedes it). Nothing else limits the speed, which is the safe
side: an acceleration falls as the speed grows, and a vehicle has a largest speed.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from boulder_sweep.settings.model import Bound, entries_of, setting
from boulder_sweep.settings.problems import Problems, wrong
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar
from boulder_sweep.settings.units import quantity_text
from boulder_sweep.settings.values import read_block

G = 9.80665
"""Acceleration of gravity [m/s^2]."""
FRICTION = 1.0
"""Coefficient of friction of tyres where none is known: MIL-HDBK-1013/14 takes 1 as the conservative value, and gives
0.6 as usual on a road."""
APPROACH = "approach"
SPEED = "speed"
NEEDS_ACCELERATION = (
    "lacks acceleration: the vehicle's at full throttle on level ground, averaged over the run-up, by its maker "
    "or a timed run from rest (2 s / t^2); no values for classes of vehicles are built in"
)


class NoApproachError(ValueError):
    """The vehicle does not reach the boulder."""


@dataclass(frozen=True, slots=True)
class Approach:
    """A run-up to a boulder; where the file gives no speed at its beginning, it is what the curve admits."""

    length_m: float = setting(
        "vehicle.approach.length",
        "length of the run-up: from its beginning, or the end of its last curve, to the boulder",
        unit="m",
        admitted=Bound(0.0, 1e5, "a length"),
    )
    acceleration_m_s2: float = setting(
        "vehicle.approach.acceleration",
        "acceleration of the vehicle at full throttle on level ground",
        unit="m/s^2",
        admitted=Bound(0.0, 20.0, "tyres transmit about 1 g at most"),
    )
    from_m_s: float | None = setting(
        "vehicle.approach.from",
        "speed at the beginning of the run-up",
        None,
        unit="m/s",
        admitted=Bound(0.0, 100.0, "up to 360 km/h"),
    )
    curve_radius_m: float | None = setting(
        "vehicle.approach.curve_radius",
        "radius of the curve that ends where the run-up begins",
        None,
        unit="m",
        admitted=Bound(1.0, 1e5, "no truck turns tighter"),
    )
    friction: float = setting(
        "vehicle.approach.friction",
        "coefficient of friction of the tyres in that curve; 1 if not given, the conservative value",
        FRICTION,
        unit="1",
        admitted=Bound(0.05, 2.0, "0.6 is usual on a road, 1 is conservative"),
    )
    grade: float = setting(
        "vehicle.approach.grade",
        "rise over run of the street in the direction of travel, negative downhill",
        0.0,
        unit="1",
        admitted=Bound(-0.5, 0.5, "no street is steeper"),
    )

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
        """Speed at the boulder [m/s]; raises NoApproachError where the vehicle stops before it, or never starts."""
        squared = self.start_speed_m_s**2 + 2.0 * self.net_acceleration_m_s2 * self.length_m
        if squared > 0.0:
            return math.sqrt(squared)
        stops = 0.0 if self.start_speed_m_s == 0.0 else -0.5 * self.start_speed_m_s**2 / self.net_acceleration_m_s2
        raise NoApproachError(f"the vehicle comes to rest after {stops:.3g} m and does not reach the boulder")


_DECLARED = {entry.key: entry for entry in entries_of(Approach)}
APPROACH_FIELDS = {key: _DECLARED[key] for key in ("length", "from", "acceleration", *list(_DECLARED)[3:])}
"""Entries of a run-up by key."""


def _read_approach(node: Node) -> Approach:
    """Read ``{length: 80 m, from: 0 mph, acceleration: 1.5 m/s^2, curve_radius: 25 m, friction: 0.8, grade: -4 %}``."""
    values = read_block(node, APPROACH_FIELDS, "an approach")
    given = node.entries if isinstance(node, Mapping) else {}
    problems = Problems()
    if "length" not in given:
        problems.add(node.position, "lacks length, the length of the run-up to the boulder")
    if "acceleration" not in given:
        problems.add(node.position, NEEDS_ACCELERATION)
    if not {"from", "curve_radius"} & set(given):
        problems.add(node.position, "lacks from (0 mph for a start from rest) or curve_radius")
    if "friction" in given and "curve_radius" not in given:
        problems.add(given["friction"].position, "friction limits the speed in a curve: give curve_radius")
    problems.raise_if_any()
    approach = Approach(**values)
    try:
        speed = approach.impact_speed_m_s
    except NoApproachError as error:
        raise wrong(node.position, str(error)) from None
    if speed > 100.0:
        raise wrong(node.position, f"reaches {speed:.4g} m/s; more than 100 m/s (360 km/h) is not admitted")
    return approach


def _kept_of(approach: Approach) -> dict[str, Any]:
    """Return what is kept of a run-up as plain data: what was given, and the speeds that follow."""
    given = {name: value for name, value in asdict(approach).items() if value is not None}
    if approach.curve_radius_m is None:
        del given["friction"]
    else:
        given["curve_speed_m_s"] = approach.curve_speed_m_s
    return {**given, "impact_speed_m_s": approach.impact_speed_m_s}


def approach_words(data: dict[str, Any], units: str = "si") -> str:
    """Return in one line how a speed follows from a run-up, by `Sweep.derived`."""
    start, curve = data.get("from_m_s", math.inf), data.get("curve_speed_m_s", math.inf)

    def shown(name: str, unit: str) -> str:
        return quantity_text(unit, units, data[name])

    first = "from rest" if start == 0.0 else f"from {_speed_text(min(start, curve), units)}"
    if curve < start:
        first += f", the most in a curve of {shown('curve_radius_m', 'm')} (sqrt({data['friction']:g} g r))"
    street = "" if data["grade"] == 0.0 else f", grade {100.0 * data['grade']:+g} %"
    run = f"over {shown('length_m', 'm')} with {shown('acceleration_m_s2', 'm/s^2')}{street}"
    return f"{_speed_text(data['impact_speed_m_s'], units)} is the most that reaches the boulder: {first}, {run}"


def _speed_text(speed: float, units: str) -> str:
    mph = f"{speed / 0.44704:.3g} mph"
    return f"{speed:.4g} m/s ({mph})" if units == "si" else mph


def unfold_approaches(root: Mapping, problems: Problems) -> list[dict[str, Any]]:
    """Replace the approach of every vehicle in the tree by its speed; return what is kept of each as plain data."""
    data: list[dict[str, Any]] = []
    for vehicle in root.blocks("vehicle"):
        entry = vehicle.entries.get(APPROACH)
        if entry is None:
            continue
        new: list[Entry] = []
        with problems.under():
            approach = _read_approach(entry.value)
            if SPEED in vehicle.entries:
                problems.add(entry.position, f"give {SPEED} or {APPROACH}, not both")
            data.append(vehicle.label | _kept_of(approach))
            new = [Entry(SPEED, entry.position, Scalar(entry.value.position, f"{approach.impact_speed_m_s!r} m/s"))]
        vehicle.replace(APPROACH, new)
    return data
