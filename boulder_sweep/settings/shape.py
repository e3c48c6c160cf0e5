"""The shape of boulders: boxes, or a profile of width and length over the height."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

from boulder_sweep.stones.rock import is_flat


@dataclass(frozen=True, slots=True)
class ProfilePoint:
    """One point of a profile, as shares of the height, the width and the length of the boulder.

    Attributes
    ----------
    height : float
        Over the foot.
    width : float
        Width there.
    near, far : float
        How far the boulder reaches there towards the vehicle and away from it, from the middle of its foot.
    """

    height: float
    width: float
    near: float
    far: float


BOX = (ProfilePoint(0.0, 1.0, 0.5, 0.5), ProfilePoint(1.0, 1.0, 0.5, 0.5))


@dataclass(frozen=True, slots=True)
class Shape:
    """The shape of the boulders of a file; between its points it is linear.

    Attributes
    ----------
    points : tuple of ProfilePoint
        From the foot to the top; none for a box.
    """

    points: tuple[ProfilePoint, ...] = ()

    @property
    def is_box(self) -> bool:
        """Whether width and faces are the same at every height."""
        return len({(point.width, point.near, point.far) for point in self.points}) <= 1

    @property
    def taper(self) -> float | None:
        """Width and length of the top over width and length of the foot, if that says it all; 1 for a box."""
        if self.is_box:
            return 1.0
        both = all(point.near == point.far == 0.5 * point.width for point in self.points)
        return self.points[-1].width / self.points[0].width if both and len(self.points) == 2 else None

    @property
    def stands_flat(self) -> bool:
        """Whether the foot is at least half as wide and as long as the largest section."""
        if not self.points:
            return True
        foot, longest = self.points[0], max(point.near + point.far for point in self.points)
        return is_flat(foot.width, 1.0) and is_flat(foot.near + foot.far, longest)

    @property
    def filled(self) -> float:
        """Volume over the box's of height, width and length: the integral of w l, by Simpson's rule exactly."""
        return self._integral(lambda near, far: near + far)

    @property
    def centre(self) -> float:
        """Centre of mass before the middle of the foot, away from the vehicle, as a share of the length."""
        return self._integral(lambda near, far: 0.5 * (far * far - near * near)) / self.filled

    @property
    def stands_up(self) -> bool:
        """Whether the centre of mass lies over the foot."""
        foot = (self.points or BOX)[0]
        return -foot.near < self.centre < foot.far

    def _integral(self, of_length: Any) -> float:
        """Integral over the height of the width times something of the reaches, at most of second degree."""
        total = 0.0
        for low, high in pairwise(self.points or BOX):
            middle = (0.5 * (getattr(low, name) + getattr(high, name)) for name in ("width", "near", "far"))
            ends = ((one.width, one.near, one.far) for one in (low, high))
            values = [w * of_length(near, far) for w, near, far in (*ends, tuple(middle))]
            total += (high.height - low.height) / 6.0 * (values[0] + values[1] + 4.0 * values[2])
        return total

    def as_list(self) -> list[dict[str, float]]:
        """Return the points as plain data."""
        return [asdict(point) for point in self.points]

    @classmethod
    def of_list(cls, points: list[dict[str, float]]) -> Shape:
        """Return the shape that `as_list` returned; a box of no data."""
        return cls(tuple(ProfilePoint(**point) for point in points))

    @classmethod
    def of_model(cls, model: Mapping[str, Any]) -> Shape:
        """Return the shape in the part `model` of resolved settings."""
        return cls.of_list(model.get("profile", []))

    @property
    def words(self) -> str:
        """What it is; empty for a box."""
        if self.is_box:
            return ""
        foot, top = self.points[0], self.points[-1]
        if len(self.points) == 2 and foot.near == foot.far and top.near == top.far:
            return f"boulder tapered, its top {top.width / foot.width:.3g} times as wide as its foot"
        return f"boulder by a profile of {len(self.points)} points"


@dataclass(frozen=True, slots=True)
class Scan:
    """Where the shape of the boulder comes from.

    Attributes
    ----------
    file, sha256 : str
        The scan, as it is named in the settings, and the hash of its content.
    up, facing : str
        Ends of the stone that are up and that face the vehicle.
    cut_m : float
        What is cut off below for a flat foot [m].
    """

    file: str
    sha256: str
    up: str
    facing: str
    cut_m: float


def tapered(ratio: float) -> Shape:
    """Return the shape of a boulder whose top is `ratio` times as wide and as long as its foot."""
    if ratio == 1.0:
        return Shape()
    foot, top = (1.0, ratio) if ratio < 1.0 else (1.0 / ratio, 1.0)
    return Shape((ProfilePoint(0.0, foot, 0.5 * foot, 0.5 * foot), ProfilePoint(1.0, top, 0.5 * top, 0.5 * top)))
