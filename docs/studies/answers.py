"""Answers shown in the documentation."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep import load, need
from boulder_sweep.answers.printing import need_lines

SITE = Path("configs/site.yaml")
GRID = Path("configs/m30_sizing.yaml")
ONE_STIFFNESS = ("soil.subgrade_reaction=63 MN/m^3",)


def need_of_site(root: Path) -> str:
    """Return the depths of the site as a terminal shows them."""
    return _fenced(need_lines(need(load(root / SITE))))


def lightest_of_grid(root: Path) -> str:
    """Return the lightest boulders of the M30 grid as a terminal shows them, at one stiffness of the soil."""
    return _fenced(need_lines(need(load(root / GRID, ONE_STIFFNESS), "mass")))


def _fenced(lines: list[str]) -> str:
    return "\n".join(["```text", *lines, "```"])
