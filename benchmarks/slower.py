"""Do passes hold in other soils, and against slower trucks? ``python -m benchmarks.slower [--designs N] [--seed S]``.

Random shallow boulders in soils whose friction angle is uncertain are judged as a user's file would be. Every pass is
then simulated again by other steps (``fine``): with the friction angle at its 5 % quantile, at its mean and at its 95 %
quantile, and in each of the three with trucks at random lower speeds. A barrier must hold them all.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from boulder_sweep import at_values, load
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import FAIL, PASS

from .flips import RANGES

MEANS_DEG = (30.0, 34.0, 38.0, 42.0, 46.0)
"""Mean friction angles, a file each."""
SPREAD_DEG = 3.0
RATIOS = (0.1, 0.45)
"""Depth over height."""
SPEEDS = 9
"""Lower speeds at which each pass is tried."""
LOWEST = 0.05
"""Lowest of them, over the speed of the design."""


class Found(NamedTuple):
    """What came out for the designs of one file."""

    designs: int
    passes: int
    lost_in_soil: int
    """Passes that fail at one of the three friction angles."""
    lost_by_slower: int
    """Passes that fail at one of the lower speeds."""


def table_of(designs: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draw designs, all inputs but the friction angle."""
    ranges = RANGES | {"embedment_ratio": RATIOS}
    return pd.DataFrame(
        {name: rng.uniform(*ends, designs) for name, ends in ranges.items() if name != "friction_angle_deg"}
    )


def tried(folder: Path, mean_deg: float, designs: int, seed: int) -> Found:
    """Judge the designs of one mean friction angle, and try their passes again."""
    rng = np.random.default_rng([seed, round(mean_deg)])
    table_of(designs, rng).to_parquet(folder / "designs.parquet")
    angle = f"{{mean: {mean_deg:g} deg, sd: {SPREAD_DEG:g} deg}}"
    (folder / "site.yaml").write_text(f"name: slower\ntable: designs.parquet\nsoil: {{friction_angle: {angle}}}\n")
    sweep = at_values(load(folder / "site.yaml"))
    judged = evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, designs))
    passes = np.flatnonzero(judged.verdict == PASS)
    fine = dataclasses.replace(sweep, solver=dataclasses.replace(sweep.solver, accuracy="fine"))
    evaluation = evaluation_of(fine, accuracy_of(fine))
    lost, slower = np.zeros(len(passes), dtype=bool), np.zeros(len(passes), dtype=bool)
    shares = rng.uniform(LOWEST, 1.0, (SPEEDS, len(passes)))
    for case in (dataclasses.replace(sweep, cases=()), *sweep.cases) if len(passes) else ():
        block = case.plan.selection(passes)
        lost |= fails(evaluation, designs_of(block, None, sweep.model))
        for share in shares:
            trucks = designs_of(block, None, sweep.model)
            slower |= fails(evaluation, trucks._replace(table=trucks.table._replace(v_0=share * trucks.table.v_0)))
    return Found(designs, len(passes), int(lost.sum()), int(slower.sum()))


def fails(evaluation: Evaluation, designs: Designs) -> np.ndarray:
    """Return which designs fail, bool, shape (n,)."""
    return evaluation.judged(designs).verdict == FAIL


def main() -> None:
    """Print a row for each mean friction angle."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.slower", description=__doc__)
    parser.add_argument("--designs", type=int, default=10_000, help="how many, over all friction angles (%(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    print(f"{'mean angle':>12} {'designs':>8} {'passes':>8} {'fail in a soil':>15} {'fail slower':>12}")
    rows = []
    for mean_deg in MEANS_DEG:
        with tempfile.TemporaryDirectory(prefix="sweep-slower-") as folder:
            rows.append(tried(Path(folder), mean_deg, asked.designs // len(MEANS_DEG), asked.seed))
        print(f"{mean_deg:>9g} deg" + "{:>9,}{:>9,}{:>16,}{:>13,}".format(*rows[-1]), flush=True)
    print(f"{'together':>12}" + "{:>9,}{:>9,}{:>16,}{:>13,}".format(*np.sum(rows, axis=0)))


if __name__ == "__main__":
    main()
