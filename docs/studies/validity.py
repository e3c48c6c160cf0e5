"""The flags of the column ``validity`` as a table, made from their register, and how often they are raised."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from boulder_kernels import Control, Design, Record, corrected, simulate_design
from boulder_kernels.design import constants_of, design_at
from boulder_kernels.dynamics import State
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.judge.pilot import accuracy_of, sampled_designs
from boulder_sweep.judge.validity import FLAGS
from boulder_sweep.settings import load


def flags_table() -> Table:
    """Return every flag: where it is raised, and why."""
    table = Table(("flag", "passes with", "raised where", "why"))
    for flag in FLAGS:
        table.add(f"`{flag.name}`", flag.meaning, flag.raised_where, flag.why)
    return table


def flags_of_grids(grid: Path) -> Table:
    """Return how many passes of a sample of a grid carry each flag, at two speeds and in both readings."""
    cases = {
        "30 mph, corrected": (),
        "40 mph, corrected": ("vehicle.speed=40 mph",),
        "30 mph, as printed": ("model.readings=as_printed",),
    }
    table = Table(("passes of a sample", *(f"`{flag.name}`" for flag in FLAGS), "none"))
    for name, changes in cases.items():
        found = firmness_of(load(grid, changes))
        shares = [found.flags.get(flag, 0) / max(found.passes, 1) for flag in (*(flag.name for flag in FLAGS), "")]
        table.add(f"{name}: {found.passes}", *(f"{share:.0%}" for share in shares))
    return table


SAMPLE = 1200
"""Designs of a grid whose crush is looked at."""
INSTANTS = 1001
"""At which the crush is looked at, from the impact to the horizon."""


def crush_words(grid: Path) -> str:
    """Return how far the vehicles drive on and are crushed, over the designs of a grid that stand."""
    sweep = load(grid)
    evaluation, limit = evaluation_of(sweep, accuracy_of(sweep)), sweep.model.calibrated_crush_m
    control, sample = evaluation.control, sampled_designs(sweep, SAMPLE)
    found = evaluation.simulate(sample.table, corrected(), control)
    standing = np.flatnonzero(found.theta_max < control.theta_limit)
    further, crush = (found.x_v_max - found.x_b_max)[standing], found.crush_max[standing]
    later = max(largest_crush(design_at(sample.table, row), control) for row in standing.tolist())
    low, high = crush.min(), crush.max()
    return (
        f"Of {standing.size} designs of a sample of `configs/{grid.name}` that stand, {np.mean(further > limit):.0%} "
        f"have a vehicle that drives on by more than {limit:g} m further than the centre of the boulder moves. The "
        "boulder also turns, so that the point of contact recedes further than that centre: measured there "
        f"(`vehicle_crush_m`), the front is crushed by {low:.2f} to {high:.2f} m when the vehicle stops. After that "
        f"the boulder swings back, in elastic soil, and presses the front in by up to {later:.2f} m "
        f"within {control.horizon:g} s; this is not counted, nor is it final when the verdict is."
    )


def largest_crush(design: Design, control: Control) -> float:
    """Return the largest crush of the vehicle's front at the point of contact, up to the horizon [m]."""
    times = np.linspace(0.0, control.horizon, INSTANTS)
    states = np.full((INSTANTS, len(State._fields)), np.nan)
    record = Record(times, states, np.zeros(INSTANTS, np.int8), np.zeros(INSTANTS, bool), np.zeros((INSTANTS, 4)))
    simulate_design(design, corrected(), control._replace(error_estimate=False, stop_at_limit=False), record)
    y, c = State(*states.T), constants_of(design, corrected(), 0)
    x_c = y.x_b + c.h * np.sin(y.theta_b) + c.g_x * (1.0 - np.cos(y.theta_b))
    return float(np.max(y.x_v - x_c))
