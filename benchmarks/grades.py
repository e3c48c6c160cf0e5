"""Grades of passes against a fine solution of each: ``python -m benchmarks.grades``.

Passes of the M30 grid at 30 and at 40 mph, of random designs, of shallow boulders and of soil of 30 degrees are graded
as `sweep run --second-opinion` grades them. Each is then simulated under every law of a second opinion with 256 parts
of the soil, strips of the foot and points of the sides, and errors of a step of 1e-8 m. Exit code 1 if a pass that
stands overturns in one of these.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_kernels import Status
from boulder_kernels.heave import FINEST
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import impact_height_of_face
from boulder_sweep.investigation import api_curve
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import DECISIVE, standing, with_second_opinions
from boulder_sweep.settings.model import SECOND_OPINIONS
from boulder_sweep.soils import with_law
from docs.studies.forms import BUMPER_M, HOOD_M, SPEEDS, drawn_of_grid, grid_evaluation, random_designs

from .timing import machine, versions

GRID = Path("configs/m30_sizing.yaml")
PASSES = 500
"""Passes of each set."""
DRAWN = 40
"""Random designs for each pass that is wanted, more than are needed."""
TOLERANCE_M = 1e-8
SHALLOW = (0.15, 0.35)
"""Embedment over height of shallow boulders, and"""
SLOW_M_S = (4.0, 13.0)
"""speeds that they stop."""
LOOSE_DEG = 30.0
SEED = 55


class GradeCounts(NamedTuple):
    """How many passes of a set stand."""

    passes: int
    stand: int
    """Passes that stand as they are graded."""
    unsafe: int
    """Passes that overturn in a fine solution."""
    cautious: int
    """Passes that do not stand, though no fine solution overturns them."""
    cpu_s: float
    """CPU time of the grades [s]."""


def sets(grid: Path, count: int) -> Iterator[tuple[str, Evaluation, Designs]]:
    """Yield the names of the sets, how their designs are judged, and passes of them, `count` at most."""
    for name, speed in SPEEDS.items():
        yield name, grid_evaluation(grid, speed), drawn_of_grid(grid, speed, count)[0]
    evaluation = grid_evaluation(grid)
    drawn = random_designs(DRAWN * count, SEED)
    table, rng = drawn.table, np.random.default_rng(SEED)
    d = table.H * rng.uniform(*SHALLOW, drawn.size)
    e = impact_height_of_face(table.H, d, BUMPER_M, HOOD_M)
    angle = np.full(drawn.size, LOOSE_DEG)
    for name, changed in {
        "random": table,
        "shallow": table._replace(d=d, e=e, v_0=rng.uniform(*SLOW_M_S, drawn.size)),
        f"soil of {LOOSE_DEG:g}°": table._replace(
            phi=np.full(drawn.size, math.radians(LOOSE_DEG)), beta=api_curve(angle)
        ),
    }.items():
        designs = drawn._replace(table=changed)
        yield name, evaluation, designs.rows(np.flatnonzero(evaluation.judged(designs).verdict == PASS)[:count])


def overturned(passes: Designs, evaluation: Evaluation) -> np.ndarray:
    """Return which passes a fine solution under one of the laws overturns, bool, shape (n,)."""
    control = HeaveControl(evaluation.limits.rotation, evaluation.longest_s, TOLERANCE_M, FINEST)
    found = np.zeros(passes.size, dtype=bool)
    for law in SECOND_OPINIONS:
        outcome = second_opinions(with_law(passes.table, law), control)
        penetration = outcome.x_v_max - passes.bed_offset - passes.table.L
        found |= (outcome.status == Status.LIMIT.value) | ~(penetration <= evaluation.limits.penetration)
    return found


def held(evaluation: Evaluation, passes: Designs) -> GradeCounts:
    """Grade passes, and hold the grades to fine solutions."""
    judged = evaluation.judged(passes)
    begun = time.process_time()
    graded = with_second_opinions(
        judged, passes, (DECISIVE,), evaluation.model, evaluation.limits, evaluation.longest_s
    )
    cpu_s = time.process_time() - begun
    stand, lost = standing(graded), overturned(passes, evaluation)
    unsafe, cautious = (int(np.count_nonzero(which)) for which in (stand & lost, ~stand & ~lost))
    return GradeCounts(passes.size, int(np.count_nonzero(stand)), unsafe, cautious, cpu_s)


def grades(grid: Path = GRID, count: int = PASSES) -> dict[str, GradeCounts]:
    """Hold the grades of all sets to fine solutions."""
    return {name: held(evaluation, passes) for name, evaluation, passes in sets(grid, count)}


def grades_table(found: dict[str, GradeCounts], *, cpu: bool = False) -> Table:
    """Return the grades of the sets as a table, with the CPU time of a pass if asked."""
    table = Table(("passes of", "passes", "stand", "unsafe", "over-cautious", *(["CPU [µs]"] if cpu else [])))
    for name, one in found.items():
        time_us = [f"{1e6 * one.cpu_s / one.passes:.0f}"] if cpu else []
        table.add(name, *(str(count) for count in one[:4]), *time_us)
    return table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.grades", description=__doc__)
    parser.add_argument("--passes", type=int, default=PASSES, help="passes of each set (default %(default)s)")
    count = parser.parse_args().passes
    grid_evaluation(GRID).asked().warm_up()
    found = grades(count=count)
    print(f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}")
    print(grades_table(found, cpu=True).text())
    return 1 if any(one.unsafe for one in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
