"""Whether the boulder stays on the ground: both crash tests, and the designs of a grid that pass."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels.design import G, boulder_mass
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.impact.uplift import base_reaction
from boulder_sweep.judge.uplift import blow_lift
from boulder_sweep.settings import load

DESIGNS = 600
SEED = 1


def _lift(found: Trajectory) -> float:
    """Lift of the blow on the boulder of a time history."""
    table = DesignTable(*(np.array([value]) for value in found.motion.design))
    return float(blow_lift(np.array([found.motion.outcome.maxima.F_v]), table)[0])


def _share(found: Trajectory) -> np.ndarray:
    """Force of the ground over the boulder's weight, up to the limit of the rotation."""
    limit = found.motion.control.theta_limit
    beyond = np.abs(found.rotation_rad) >= limit
    end = int(np.argmax(beyond)) if beyond.any() else len(beyond)
    return base_reaction(found)[:end] / (boulder_mass(found.motion.design) * G)


def tests_table() -> Table:
    """Return for both crash tests whether the boulder stays on the ground, corrected readings."""
    table = Table(
        ("test", "lift of the blow", "least force of the ground over weight", "leaves the ground", "in the test")
    )
    seen = {"abg": '"flipped" up and out of the ground', "rwg": "translated and rotated slightly"}
    for name, title in NAMES.items():
        found = simulate(crash_test(name))
        share = _share(found)
        leaves = "never"
        if (share < 0.0).any():
            first = int(np.argmax(share < 0.0))
            leaves = f"{1e3 * found.time_s[first]:.0f} ms, at {math.degrees(found.rotation_rad[first]):.1f}°"
        table.add(title, number(_lift(found), 2), number(float(share.min()), 2), leaves, seen[name])
    return table


def grid_words(grid: Path) -> str:
    """Return how many passes of a sample of a grid would leave the ground."""
    sweep = load(grid)
    rows = np.random.default_rng(SEED).integers(0, sweep.n_designs, DESIGNS)
    lifted: dict[bool, list[int]] = {True: [0, 0], False: [0, 0]}
    for row in rows.tolist():
        found = simulate(sweep, design_id=row, sample_s=2e-3)
        if found.verdict == "pass":
            carries = "uplift" in str(found.summary()["validity"]).split(";")
            lifted[carries][0] += 1
            lifted[carries][1] += int((_share(found) < 0.0).any())
    (flagged, up), (others, up_too) = lifted[True], lifted[False]
    return (
        f"Of {flagged + others} passes among {DESIGNS} designs drawn from `{grid}`, {flagged} carry the flag, and in "
        f"{up} of these the force of the ground is negative at some instant; of the {others} without it, in {up_too}."
    )
