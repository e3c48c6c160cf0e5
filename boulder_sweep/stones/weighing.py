"""What a scanned stone is: its mass and the figures that a file and a drawing ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from boulder_sweep.drawing import draw
from boulder_sweep.errors import ScanError
from boulder_sweep.stones.reading import read_scan
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.stones.solid import solid_of
from boulder_sweep.stones.standing import Standing, Stone

POINT = ("height_m", "width_m", "near_m", "far_m")
"""Entries of a point of a profile."""
USUAL_ROCK_KG_M3 = (2000.0, 3300.0)
MUCH_CLOSED = 0.02
"""Part of the surface in holes from which the file may have been misread."""
MUCH_OVER = 0.1
"""Part of the volume over what was added from which this is said."""
COARSE_M = 1e-3
"""Spacing of coordinates from which their rounding is said [m]."""
NEARER = "subtract a point near the boulder from all coordinates before you export them"


@dataclass(frozen=True, eq=False)
class ScannedStone:
    """A stone from a scan, with its mass. Made by `scanned`."""

    file: str
    sha256: str
    """The scan, and the hash of its content."""
    stone: Stone
    density_kg_m3: float
    density_from: str
    """Where that comes from: ``mass``, ``density`` or ``assumed``."""
    step_m: float
    """Spacing of the coordinates in the scan [m]."""

    @property
    def mass_kg(self) -> float:
        """Mass of the whole stone, before anything is cut off."""
        return self.density_kg_m3 * self.stone.solid.volume

    @cached_property
    def standings(self) -> tuple[Standing, ...]:
        """The 24 ways to stand."""
        return tuple(self.stone.standings())

    @property
    def cautions(self) -> list[str]:
        """What makes one doubt the figures."""
        low, high = USUAL_ROCK_KG_M3
        cautions = []
        if not low <= self.density_kg_m3 <= high:
            cautions.append(
                f"its density is {self.density_kg_m3:,.0f} kg/m³, and rock has {low:,.0f} to {high:,.0f}: the mass, "
                "the scale of the scan or its unit is wrong"
            )
        return cautions + self.surface_cautions

    @property
    def surface_cautions(self) -> list[str]:
        """What makes one doubt the surface, whatever the stone weighs."""
        cautions = []
        solid = self.stone.solid
        if solid.closed > MUCH_CLOSED:
            cautions.append(
                f"{solid.closed:.0%} of its surface was added to close holes: if the scan has no such "
                "holes, its file may have been misread; export it as binary PLY and compare the volumes"
            )
        if solid.over > MUCH_OVER:
            cautions.append(
                f"{solid.over:.0%} of its volume lies over what was added to close it: what the boulder has beyond, in "
                "the ground for example, is missing from volume and sides"
            )
        if self.step_m > COARSE_M:
            cautions.append(f"{_coarse(self.step_m)}: volume and sides are rounded; {NEARER}")
        return cautions

    def plot(self, path: str | Path) -> None:
        """Draw the stone with each of its six ends up, from the side and to scale, with its profile."""
        draw("scanned_stone", "draw_stone", self, path)

    def to_dict(self, standings: Sequence[Standing] | None = None) -> dict[str, Any]:
        """Return everything as plain data, with some ways to stand; with all of them by default."""
        stone, solid = self.stone, self.stone.solid
        axes = stone.axes
        return {
            "file": self.file,
            "sha256": self.sha256,
            "faces": len(solid.faces),
            "repairs": list(solid.repairs),
            "closed_share": solid.closed,
            "base_share": solid.base,
            "volume_m3": solid.volume,
            "mass_kg": self.mass_kg,
            "density_kg_m3": self.density_kg_m3,
            "density_from": self.density_from,
            "sides_m": stone.sides_m.tolist(),
            "axes": axes.tolist(),
            "solidity": stone.solidity,
            "hull_share": stone.hull_share,
            "centre_m": solid.centre.tolist(),
            "inertia_kg_m2": (self.density_kg_m3 * axes @ solid.inertia @ axes.T).tolist(),
            "standings": [self._standing(one) for one in (self.standings if standings is None else standings)],
        }

    def _standing(self, standing: Standing) -> dict[str, Any]:
        """Return one way to stand as plain data."""
        profile = standing.profile
        points = zip(profile.height, profile.width, profile.near, profile.far, strict=True)
        return {
            "up": standing.up,
            "facing": standing.facing,
            "stands": standing.stands,
            "cut_m": standing.cut_m,
            "cut_share": standing.cut_share,
            "rests_share": standing.rests,
            "has_foot": standing.has_foot,
            "mass_kg": self.density_kg_m3 * standing.volume,
            "centre_m": list(standing.centre),
            "moment_kg_m2": self.density_kg_m3 * standing.moment,
            "profile_error_m": profile.error,
            "profile_moment_kg_m2": self.density_kg_m3 * profile.moment,
            "profile": [dict(zip(POINT, map(float, point), strict=True)) for point in points],
        }


def scanned(
    path: str | Path, *, metres: float = 1.0, mass_kg: float | None = None, density_kg_m3: float | None = None
) -> ScannedStone:
    """Read and weigh a stone; see `read_scan`.

    The density follows from the mass of the whole stone; it is the one given where no mass is, and `ROCK_KG_M3` where
    neither is. Raise `ScanError` where the scan cannot be used.
    """
    scan = read_scan(path, metres)
    try:
        solid = solid_of(scan)
    except ScanError:
        if scan.step_m > COARSE_M:  # which makes holes and flat faces
            raise ScanError(f"{scan.file}: {_coarse(scan.step_m)}, too far for a boulder; {NEARER}") from None
        raise
    stone = Stone(solid, scan.file)
    if mass_kg is not None:
        density, density_from = mass_kg / solid.volume, "mass"
    elif density_kg_m3 is not None:
        density, density_from = density_kg_m3, "density"
    else:
        density, density_from = ROCK_KG_M3, "assumed"
    return ScannedStone(scan.file, scan.sha256, stone, density, density_from, scan.step_m)


def _coarse(step_m: float) -> str:
    return f"the numbers in which it keeps its coordinates lie {1e3 * step_m:,.3g} mm apart, so far from the origin"
