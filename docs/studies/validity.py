"""The flags of the column ``validity`` as a table, made from their register, and how often they are raised."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from boulder_kernels import Control, Design, Record, corrected, simulate_design
from boulder_kernels.design import constants_of, design_at
from boulder_kernels.dynamics import State
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.judge.inputs import sampled_designs
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


SAMPLE = 1200
"""Designs of a grid whose crush is looked at."""
INSTANTS = 1001
"""At which the crush is looked at, from the impact to the horizon."""


def crush_words(grid: Path) -> str:
    """Return how far the front of the vehicle is crushed in the test that passed, and by designs that stand."""
    in_test = simulate(crash_test("rwg")).summary()["vehicle_crush_m"]
    found = {}
    for speed in ("30 mph", "40 mph"):
        sweep = load(grid, (f"vehicle.speed={speed}",))
        evaluation, sample = evaluation_of(sweep, accuracy_of(sweep)), sampled_designs(sweep, SAMPLE)
        outcomes = evaluation.simulate(sample.table, corrected(), evaluation.control)
        standing = np.flatnonzero(outcomes.theta_max < evaluation.control.theta_limit)
        later = max(largest_crush(design_at(sample.table, row), evaluation.control) for row in standing.tolist())
        crush = outcomes.crush_max[standing]
        found[speed] = (
            f"at {speed} {standing.size} designs that stand crush it by {crush.min():.2f} to {crush.max():.2f} m, "
            f"and by up to {later:.2f} m as the boulder swings back"
        )
    return (
        f"The test that passed crushes the front by {in_test:.2f} m at the point of contact, by the model. Of a "
        f"sample of `configs/{grid.name}`, {'; '.join(found.values())}. "
        "The last is not counted, nor is the motion over at the verdict."
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
