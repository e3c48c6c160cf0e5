"""Which way up, and with which face to the vehicle, a scanned stone passes at a site in the least depth.

Every way is asked as ``sweep need`` asks: a depth is an answer only if all greater depths pass too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from boulder_sweep.answers.keys import Key, key_of
from boulder_sweep.answers.need import Need, need
from boulder_sweep.answers.search import ALWAYS, BLOCKED, FAULTY, NEVER, NOT_MONOTONE, UNKNOWN, WORDS
from boulder_sweep.answers.trials import ROUNDING_M
from boulder_sweep.drawing import draw
from boulder_sweep.settings import Sweep
from boulder_sweep.stones.standing import Standing
from boulder_sweep.stones.weighing import ScannedStone
from boulder_sweep.text import ProgressCallback

SIGNS = {
    WORDS[ALWAYS]: "≤: passes from the least depth tried on; a lesser one may do",
    WORDS[NOT_MONOTONE]: "*: passes less deep as well, but fails in between: no depth to build",
}
"""What the signs beside depths mean."""
NOTHING = {
    WORDS[NEVER]: "it fails at every depth",
    WORDS[BLOCKED]: "it fails down to where the truck would pass or ride over it",
    WORDS[NOT_MONOTONE]: "it passes at some depths, and fails at greater ones",
    WORDS[FAULTY]: "it cannot be computed",
}
"""Why there is no depth."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to stand, at the site.

    Attributes
    ----------
    standing : Standing
        The way.
    row : dict
        Row of `boulder_sweep.need` that asks for the largest depth, or has no depth at which the stone passes.
    depth_m : float or None
        Depth from which on it passes in every soil and before every vehicle of the site [m].
    """

    standing: Standing
    row: dict[str, Any]
    depth_m: float | None

    @property
    def why_not(self) -> str:
        """Why there is no depth, where there is none."""
        if self.row["found"] == WORDS[UNKNOWN]:
            return f"it is undecided ({self.row['reason']})"
        return NOTHING.get(self.row["found"], "one vehicle would ride over it at the depth that another asks for")


@dataclass(frozen=True, eq=False)
class Placing:
    """A stone at a site. Made by `placed`.

    Attributes
    ----------
    found : ScannedStone
        The stone.
    ways : tuple of Way
        Ways to stand on a flat foot, the one of least depth first.
    rounded : int
        Ways without a flat foot, which are not modelled.
    cases : int
        Soils and vehicles of the site, combined.
    """

    found: ScannedStone
    ways: tuple[Way, ...]
    rounded: int
    cases: int

    shown = 3
    """Ways that are drawn, at most."""
    key: ClassVar[Key] = key_of("embedment_depth")
    """What is asked for."""

    @property
    def passing(self) -> list[Way]:
        """Ways that pass at some depth."""
        return [way for way in self.ways if way.depth_m is not None]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        standings = self.found.to_dict([way.standing for way in self.ways])
        placed = zip(standings.pop("standings"), self.ways, strict=True)
        ways = [entry | {"least_embedment_depth_m": way.depth_m, "answer": way.row} for entry, way in placed]
        return standings | {"rounded": self.rounded, "cases": self.cases, "ways": ways}

    def plot(self, path: str | Path) -> None:
        """Draw the best ways, from the side and to scale, in the ground.

        Raises
        ------
        PictureError
            It cannot be drawn.
        """
        draw("scanned_stone", "draw_placing", self, path)


def boulder_block(stone: ScannedStone, standing: Standing) -> str:
    """Return a stone on one of its feet as an entry that replaces the boulder of a settings file."""
    profile = standing.profile
    points = zip(*(side.tolist() for side in (profile.height, profile.width, profile.near, profile.far)), strict=True)
    listed = ", ".join(f"{{height: {z!r} m, width: {w!r} m, near: {n!r} m, far: {f!r} m}}" for z, w, n, f in points)
    return f"boulder={{density: {stone.density_kg_m3!r} kg/m^3, profile: [{listed}]}}"


def _common(answers: Need) -> tuple[dict[str, Any], float | None]:
    """Return the row that decides, and the depth from which on all rows pass; None where there is none."""
    rows, name = answers.arrow.to_pylist(), answers.key.answer
    none = next((row for row in rows if row[name] is None), None)
    if none is not None:
        return none, None
    worst = max(rows, key=lambda row: row[name])
    depth: float = worst[name]
    # A truck with a high bumper may go over the stone at the depth that one with a low bumper asks for.
    least = answers.sweep.criterion.min_overlap_m - ROUNDING_M
    met = all(row["overlap_m"] + row[name] - depth >= least for row in rows)
    return worst, depth if met else None


def placed(
    stone: ScannedStone,
    site: Callable[[str], Sweep],
    standings: tuple[Standing, ...] | None = None,
    *,
    margin: str | float = 0.0,
    progress: ProgressCallback | None = None,
) -> Placing:
    """Find the least depth of every way in which a boulder can stand.

    Parameters
    ----------
    site
        Gives the settings of the site with a boulder, which it takes as `boulder_block` returns it.
    standings
        Ways to stand; all by default.
    margin
        Least margin of a pass that counts.
    progress
        Called with the ways done and their number.

    Raises
    ------
    SettingsError, QuestionError
        The site cannot be asked.
    """
    asked = stone.standings if standings is None else standings
    flat = [standing for standing in asked if standing.has_foot]
    ways, cases = [], 0
    for done, standing in enumerate(flat):
        if progress is not None:
            progress(done, len(flat))
        answers = need(site(boulder_block(stone, standing)), Placing.key.name, margin=margin, robust=False, prefer=None)
        cases = len(answers)
        ways.append(Way(standing, *_common(answers)))
    if progress is not None:
        progress(len(flat), len(flat))
    ways.sort(key=lambda way: (way.depth_m is None, way.depth_m or 0.0))
    return Placing(stone, tuple(ways), len(asked) - len(flat), cases)
