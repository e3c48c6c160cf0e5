"""Passes of random designs against a finer solution of each: ``python -m benchmarks.finer``.

Designs are drawn and judged as `sweep run` judges them, by the default accuracy, until there are a million passes.
Every pass is then simulated once more by an eighth of the step, with steps that end where the soil yields. Exit code 1
if one overturns.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from boulder_kernels import SIMULATED, Status
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings import load

from .designs import sample
from .timing import machine, versions

GRID = "configs/m30_sizing.yaml"
PASSES = 1_000_000
BLOCK = 1 << 15
FINER = 0.125


class Count(NamedTuple):
    """What became of the passes of some designs."""

    designs: int
    passes: int
    overturned: int
    """Passes that reach the limit in the finer solution."""
    refused: int
    """Passes that it does not compute."""
    largest_deg: float
    """Largest difference of their rotation [deg]."""


def count(evaluation: Evaluation, designs: Designs) -> Count:
    """Judge some designs, and simulate those that pass again."""
    judged = evaluation.judged(designs)
    rows = np.flatnonzero(judged.verdict == PASS)
    how = evaluation.control
    finer = how._replace(h=FINER * how.h, refined=True, error_estimate=False, locate_yield=True)
    again = evaluation.simulate(designs.rows(rows).table, evaluation.readings, finer)
    computed = np.isin(again.status, list(SIMULATED))
    difference = np.abs(np.degrees(again.theta_max) - judged["max_rotation_deg"][rows])
    overturned = int(np.sum(again.status == Status.LIMIT))
    return Count(designs.size, len(rows), overturned, int(np.sum(~computed)), float(np.nanmax(difference, initial=0.0)))


def measure(passes: int, threads: int = 2) -> Count:
    """Draw designs until at least so many of them pass."""
    sweep = load(GRID)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    evaluation.warm_up()

    def block(seed: int) -> Count:
        table = sample(BLOCK, seed)
        return count(evaluation, Designs(table, bed_offset=np.full(BLOCK, 2.9)))

    found: list[Count] = []
    with ThreadPoolExecutor(threads) as pool:
        seed = 1000
        while sum(one.passes for one in found) < passes:
            found += pool.map(block, range(seed, seed + threads))
            seed += threads
    return Count(
        sum(one.designs for one in found),
        sum(one.passes for one in found),
        sum(one.overturned for one in found),
        sum(one.refused for one in found),
        max(one.largest_deg for one in found),
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.finer", description=__doc__)
    parser.add_argument("--passes", type=int, default=PASSES, help="least number of passes (default %(default)s)")
    found = measure(parser.parse_args().passes)
    print(f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}")
    print(
        f"{found.passes:,} passes of {found.designs:,} random designs: {found.overturned} overturn in the finer "
        f"solution, {found.refused} are refused by it; rotations differ by {found.largest_deg:.1e} deg at most"
    )
    sys.exit(1 if found.overturned else 0)


if __name__ == "__main__":
    main()
