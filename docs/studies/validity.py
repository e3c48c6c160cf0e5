"""The flags of the column ``validity`` as a table, made from their register, and how often they are raised."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.judge.validity import FLAGS
from boulder_sweep.settings import load


def flags_table() -> Table:
    """Return every flag: where it is raised, and why."""
    table = Table(("flag", "passes with", "raised where", "why"))
    for flag in FLAGS:
        table.add(f"`{flag.name}`", flag.meaning, flag.raised_where, flag.why)
    return table


def flags_of_grids(grid: Path) -> Table:
    """Return how many passes of a sample of a grid carry each flag, at two speeds."""
    cases = {
        "30 mph, corrected": (),
        "40 mph, corrected": ("vehicle.speed=40 mph",),
    }
    table = Table(("passes of a sample", *(f"`{flag.name}`" for flag in FLAGS), "none"))
    for name, changes in cases.items():
        found = firmness_of(load(grid, changes))
        shares = [found.flags.get(flag, 0) / max(found.passes, 1) for flag in (*(flag.name for flag in FLAGS), "")]
        table.add(f"{name}: {found.passes}", *(f"{share:.0%}" for share in shares))
    return table
