"""What the laws of the soil's ultimate resistance do: to both crash tests, and to the verdicts of a grid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.pilot import accuracy_of, sampled_designs
from boulder_sweep.judge.resistance import LAWS
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.model import RESISTANCES

DESIGNS = 4096


def _by(law: str, sweep: Sweep) -> Sweep:
    return replace(sweep, model=replace(sweep.model, resistance=law))


def tests_table() -> Table:
    """Return the crash tests by every law, corrected readings."""
    table = Table(("test", "law", "pressure over vertical stress", "verdict", "max rotation [deg]", "max x_b [m]"))
    for name, title in NAMES.items():
        sweep = crash_test(name)
        given = sampled_designs(sweep, 1).table
        for law in RESISTANCES:
            found = simulate(_by(law, sweep)).summary()
            coefficient = number(float(LAWS[law](given)[0]), 1)
            rotation = number(found["max_rotation_deg"], 2)
            table.add(
                title, f"`{law}`", coefficient, found["verdict"], rotation, number(found["max_displacement_m"], 3)
            )
    return table


def grid_table(grid: Path) -> Table:
    """Return how many designs of a sample of a grid pass by every law."""
    sweep = load(grid)
    table = Table(("law", "passes", "of those that pass by the paper's law"))
    paper: np.ndarray | None = None
    for law in RESISTANCES:
        own = _by(law, sweep)
        passes = (
            evaluation_of(own, accuracy_of(own), proved=False).judged(sampled_designs(own, DESIGNS)).verdict == PASS
        )
        paper = passes if paper is None else paper
        table.add(f"`{law}`", f"{passes.mean():.1%}", f"{passes[paper].mean():.0%}")
    return table
