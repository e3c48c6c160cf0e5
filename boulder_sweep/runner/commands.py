"""The commands that repeat or resume a run, for people to copy."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from boulder_sweep.locations import Location

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


def repeat_command(sweep: Sweep) -> str:
    """Return the command that computes the same table, the same on every machine."""
    if sweep.path is None:
        return "boulder_sweep.run(sweep, out)"
    return shlex.join(["sweep", "run", sweep.path.name, *_overrides(sweep)])


def resume_command(sweep: Sweep, out: Location, jobs: int | None, backend: str, scheduler: str | None) -> str:
    """Return the command that resumes a run with the given arguments."""
    if sweep.path is None:
        return f"boulder_sweep.run(sweep, {str(out)!r}, resume=True)"
    words = ["sweep", "run", str(sweep.path), "-o", str(out)]
    if jobs is not None:
        words += ["--jobs", str(jobs)]
    if backend != "threading":
        words += ["--backend", backend]
    if scheduler is not None:
        words += ["--scheduler", scheduler]
    return shlex.join([*words, *_overrides(sweep), "--resume"])


def _overrides(sweep: Sweep) -> list[str]:
    """Return the options that replace entries of the file, as they were given."""
    words = []
    for entry in sweep.overrides:
        words += entry.split("=", 1) if entry.startswith("--") else ["--set", entry]
    return words
