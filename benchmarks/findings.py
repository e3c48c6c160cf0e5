"""What a gate finds: a figure over what it is compared with, and whether it passes."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from .report import FOLDER

LIMITS = FOLDER / "gate.toml"


class Finding(NamedTuple):
    """One figure over what it is compared with."""

    name: str
    ratio: float
    most: float = float("inf")
    """Largest ratio that passes."""
    least: float = 0.0
    """Smallest ratio that passes."""
    of: str = "the record"
    """What it is a ratio to."""

    @property
    def passes(self) -> bool:
        """Whether the ratio is within its bounds; NaN is not."""
        return self.least <= self.ratio <= self.most

    @property
    def bounds(self) -> str:
        """The ratios that pass."""
        most = f"at most {self.most:.3f}" if self.most < float("inf") else ""
        return " and ".join(filter(None, [f"at least {self.least:.3f}" if self.least > 0.0 else "", most]))

    def __str__(self) -> str:
        """One line: the figure, its ratio, its bounds, and whether it passes."""
        verdict = "ok" if self.passes else "FAILS"
        return f"{self.name:<44} {self.ratio:8.3f} of {self.of}, {self.bounds}   {verdict}"


def limits_of(section: str, path: Path = LIMITS) -> dict[str, Any]:
    """Read a section of the committed bounds and records."""
    with path.open("rb") as stream:
        return dict(tomllib.load(stream)[section])


def complaint(findings: Sequence[Finding]) -> str:
    """Return a message about what does not pass and what to do; empty if everything does."""
    bad = [f"{each.name} ({each.ratio:.3f} of {each.of}, {each.bounds})" for each in findings if not each.passes]
    if not bad:
        return ""
    return (
        f"benchmark gate: {', '.join(bad)}. Counts that are meant to change are renewed by python -m benchmarks.gate "
        f"--record; where time is lost, python -m benchmarks.kernel shows, and bounds are in benchmarks/{LIMITS.name}. "
        "Say in the commit why."
    )
