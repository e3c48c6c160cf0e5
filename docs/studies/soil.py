"""What the soil models do to a grid, and other ground to the crash test that passed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.model import RESISTANCES, Ground, Layer

DESIGNS = 4096
TOP = ("soil_density_kg_m3", "friction_angle_deg", "subgrade_reaction_MN_m3")


def _by(law: str, sweep: Sweep) -> Sweep:
    return replace(sweep, model=replace(sweep.model, resistance=law))


LOOSE = {"density_kg_m3": 1700.0, "friction_angle_deg": 34.0, "subgrade_reaction_MN_m3": 20.0}
"""Constants of a loose sand."""
GROUNDS: dict[str, tuple[Ground, dict[str, float]]] = {
    "as given": (Ground(), {}),
    "water table 1 m down": (Ground(water_table_m=1.0), {}),
    "water table at the soil line": (Ground(water_table_m=0.0), {}),
    "cohesion 5 kPa": (Ground(cohesion_kPa=5.0), {}),
    "cohesion 10 kPa": (Ground(cohesion_kPa=10.0), {}),
    "ground falling by 10°": (Ground(slope_deg=10.0), {}),
    "ground falling by 26.57° (2H:1V)": (Ground(slope_deg=26.57), {}),
    "loose sand below 1 m": (Ground((Layer(1.0, **LOOSE),)), {}),
    "loose sand down to 0.5 m": (
        Ground((Layer(0.5, *(crash_test("rwg").constants[name] for name in TOP)),)),
        dict(zip(TOP, LOOSE.values(), strict=True)),
    ),
}
"""What is changed about the ground of the crash test: the ground, and inputs of the uppermost layer."""


def ground_table() -> Table:
    """Return the crash test that passed in other grounds, by the paper's soil model and corrected readings."""
    table = Table(("ground", "verdict", "max rotation [deg]", "max x_b [m]"))
    sweep = crash_test("rwg")
    for words, (ground, changed) in GROUNDS.items():
        model = replace(sweep.model, **ground.fields())
        found = simulate(replace(sweep, model=model, constants=sweep.constants | changed)).summary()
        rotation = number(found["max_rotation_deg"], 2)
        table.add(words, found["verdict"], rotation, number(found["max_displacement_m"], 3))
    return table


def grid_table(grid: Path) -> Table:
    """Return how many designs of a sample of a grid pass by every law."""
    sweep = load(grid)
    table = Table(("soil model", "passes", "share of the default's passes"))
    paper: np.ndarray | None = None
    for law in RESISTANCES:
        own = _by(law, sweep)
        passes = evaluation_of(own, accuracy_of(own)).judged(sampled_designs(own, DESIGNS)).verdict == PASS
        paper = passes if paper is None else paper
        table.add(f"`{law}`", f"{passes.mean():.1%}", f"{passes[paper].mean():.0%}")
    return table
