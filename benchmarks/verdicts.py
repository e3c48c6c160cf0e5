"""What firm verdicts cost: ``python -m benchmarks.verdicts``.

The same designs are simulated and judged with and without what makes a verdict firm, in turn within one process: going
on beyond the horizon for a proof, finer steps for the rows that need them, the columns on crush, overlap and validity,
and the sample of how firm the table is. What runs inside the loops of the kernels, the maximum of the crush and the
energy that is compared, cannot be switched off and is in both. A whole run also checks, encodes and writes the table.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from boulder_sweep import run
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.verdict import judge
from boulder_sweep.settings import Sweep, load

from .designs import sample
from .report import Table
from .timing import interleaved, machine, median_ratio, versions

GRID = "configs/m30_sizing.yaml"
RANDOM = 1_000_000
BLOCK = 16_384
ROUNDS = 5
ADDED = ("vehicle_crush_m", "overlap_m", "validity", "step_s")


def blocks(designs: Designs) -> list[Designs]:
    """Return designs in blocks as workers get them."""
    return [designs.rows(slice(start, start + BLOCK)) for start in range(0, designs.size, BLOCK)]


def plain(evaluation: Evaluation, parts: Sequence[Designs]) -> Callable[[], None]:
    """Return work that simulates and judges once, up to the horizon, without the columns added."""
    control = evaluation.control._replace(longest_horizon=0.0)
    columns = tuple(name for name in OUTCOME_COLUMNS if name not in ADDED)

    def work() -> None:
        for part in parts:
            outcomes = evaluation.simulate(part.table, evaluation.readings, control)
            judge(outcomes, part, evaluation.limits, columns)

    return work


def firm(evaluation: Evaluation, parts: Sequence[Designs]) -> Callable[[], None]:
    """Return work that does all of it."""

    def work() -> None:
        for part in parts:
            evaluation.judged(part)

    return work


def whole_run(sweep: Sweep) -> None:
    """Run a sweep by one worker into a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as folder:
        run(sweep, Path(folder) / "out", jobs=1)


def measure(rounds: int = ROUNDS, random: int = RANDOM) -> Table:
    """Measure both sets of designs."""
    table = Table(
        "verdicts",
        "What firm verdicts cost",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; accuracy `balanced`; CPU time of one thread",
        [
            "designs",
            "plain",
            "proofs, finer steps, columns",
            "sample of firmness",
            "together, over plain",
            "of a whole run",
        ],
    )
    grid = load(GRID)
    evaluation = evaluation_of(grid, accuracy_of(grid))
    block = grid.block(0, grid.n_designs)
    usual = designs_of(block, np.asarray(block.reasons.codes) == 0)
    drawn = sample(random)
    chance = Designs(drawn, bed_offset=np.full(random, 2.9))
    for name, designs, sweep in (("M30 grid", usual, grid), ("random", chance, _as_large(grid, random))):
        parts = blocks(designs)
        works: dict[str, Callable[[], object]] = {
            "plain": plain(evaluation, parts),
            "firm": firm(evaluation, parts),
            "sample": partial(firmness_of, sweep),
            "run": partial(whole_run, sweep),
        }
        times = interleaved(works, rounds)
        least = {work: min(seconds) for work, seconds in times.items()}
        both = [one + other for one, other in zip(times["firm"], times["sample"], strict=True)]
        per_design = {name: seconds / designs.size for name, seconds in least.items()}
        added = per_design["firm"] - per_design["plain"] + per_design["sample"]
        table.rows.append(
            [
                f"{name}, {designs.size:,}",
                f"{1e6 * least['plain'] / designs.size:.2f} us",
                f"{1e6 * (least['firm'] - least['plain']) / designs.size:+.2f} us",
                f"{1e6 * least['sample'] / designs.size:+.2f} us",
                f"{median_ratio(both, times['plain']):.3f}",
                f"{added / (least['run'] / sweep.n_designs - added):.1%}",
            ]
        )
    return table


def _as_large(sweep: Sweep, count: int) -> Sweep:
    """Return a sweep of at least so many designs: the grid, with more densities of the boulder."""
    times = -(-count // sweep.n_designs)
    return load(GRID, [f"boulder.density={{from: 2500 kg/m^3, to: 2700 kg/m^3, count: {times}}}"])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.verdicts", description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="rounds in turn (default %(default)s)")
    parser.add_argument("--random", type=int, default=RANDOM, help="random designs (default %(default)s)")
    arguments = parser.parse_args()
    print(measure(arguments.rounds, arguments.random).markdown())


if __name__ == "__main__":
    main()
