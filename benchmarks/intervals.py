"""How often the stated interval of a probability holds it: ``python -m benchmarks.intervals``; takes two minutes.

Intervals of many seeds are compared with the probability itself. That is known exactly for a linear limit state, which
stands in for the simulation; that of simulated designs, at depths chosen to pass with these probabilities, comes from
many more designs drawn. Exit code 1 if an interval holds too rarely at any of the probabilities, or has no width.
"""

from __future__ import annotations

import argparse
import sys
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from boulder_sweep.answers.chance import SCRAMBLINGS, Event, Points, chance
from boulder_sweep.answers.draws import Draws
from boulder_sweep.answers.need import need
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings import load

from .report import Table

SEEDS = 200
LEAST = 0.93
"""Share of the intervals that must hold, at a stated confidence of 95 %."""
PROBABILITIES = (0.5, 0.6, 0.6619, 0.6931, 0.7, 0.8, 0.9, 0.93927, 0.95, 0.98, 0.99, 0.995, 0.999)
"""Two of them are where the spread of a single input's scramblings tells least."""
INPUTS = (1, 2, 4)
HALF_WIDTHS = (0.01, 0.003)
SIMULATED = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.995, 0.999)
"""Probabilities for which depths are sought; what the designs there have is close to that."""
REFERENCE = 1 << 18
"""Designs drawn of each for the probability they are compared with."""
SITE = "configs/uncertain_site.yaml"
CERTAIN = ("soil.density=1860 kg/m^3", "vehicle.speed=30 mph", "soil.subgrade_reaction=60 MN/m^3")
"""What makes the inputs of the file certain, one after the other; the friction angle remains."""


class Held(NamedTuple):
    """How intervals of many seeds did, for n probabilities."""

    exact: np.ndarray
    coverage: np.ndarray
    """Share of the intervals that hold the probability, shape (n,)."""
    narrowest: float
    """Least width of any."""
    drawn: float
    """Designs drawn for one, on average."""


def held(event: Event, dimensions: int, exact: np.ndarray, seeds: int, half_width: float) -> Held:
    """Compare the intervals of so many seeds with the probabilities of rows."""
    holds, narrowest, drawn = np.zeros(len(exact)), np.inf, 0.0
    for seed in range(seeds):
        found = chance(event, len(exact), Points(dimensions, seed), half_width=half_width)
        holds += (found.low <= exact) & (exact <= found.high)
        narrowest = min(narrowest, float((found.high - found.low).min()))
        drawn += float(found.points.mean())
    return Held(exact, holds / seeds, narrowest, drawn / seeds)


def linear(dimensions: int, seeds: int, half_width: float, probabilities: tuple[float, ...] = PROBABILITIES) -> Held:
    """Compare for a linear limit state, on which all inputs have the same influence."""
    exact = np.array(probabilities)
    edges = ndtri(exact) * np.sqrt(dimensions)
    return held(lambda row, z: z.sum(axis=1) <= edges[row], dimensions, exact, seeds, half_width)


def simulated(inputs: int, seeds: int, probabilities: tuple[float, ...] = SIMULATED) -> Held:
    """Compare for the uncertain site, so many of its inputs uncertain, at depths that pass with these probabilities."""
    sweep = load(SITE, CERTAIN[: len(CERTAIN) + 1 - inputs])
    found = [need(sweep, probability=each).frame.passes_at[0] for each in probabilities]
    depths = np.array(found, dtype=float)
    given = sweep.plan.given_rows(0, 1)
    rows = {name: np.repeat(values, len(depths)) for name, values in given.items()} | {"embedment_depth_m": depths}
    draws = Draws(rows, Spread(sweep), judges_of(sweep), Pool(None))
    dimensions = len(draws.spread.names)
    many = Points(dimensions, seeds)
    first = REFERENCE // SCRAMBLINGS

    def passes(index: np.ndarray, z: np.ndarray) -> np.ndarray:
        return draws.distance(index, z) > 0.0

    exact = chance(passes, len(depths), many, half_width=0.0, most=REFERENCE, first=first).estimate
    return held(passes, dimensions, exact, seeds, HALF_WIDTHS[0])


def measure(seeds: int = SEEDS) -> tuple[Table, bool]:
    """Measure; also return whether all intervals hold as often as they must and none is without width."""
    table = Table(
        "intervals",
        "How often the interval of a probability holds it",
        f"{seeds} seeds each; stated confidence 95 %; {PROBABILITIES[0]:g} to {PROBABILITIES[-1]:g} are the chances "
        "of passing",
        ["of", "uncertain inputs", "half-width asked for", "held, least", "at a chance of", "held, mean"],
    )
    table.header += ["narrowest", "designs drawn, mean"]
    good = True
    for inputs in INPUTS:
        cases = [("a linear limit state", width, linear(inputs, seeds, width)) for width in HALF_WIDTHS]
        cases.append(("designs of the uncertain site", HALF_WIDTHS[0], simulated(inputs, seeds)))
        for what, width, found in cases:
            worst = int(found.coverage.argmin())
            least = float(found.coverage[worst])
            good &= least >= LEAST and found.narrowest > 0.0
            shown = [f"{least:.1%}", f"{found.exact[worst]:.4f}", f"{found.coverage.mean():.1%}"]
            table.rows.append(
                [what, str(inputs), f"{width:g}", *shown, f"{found.narrowest:.4f}", f"{found.drawn:,.0f}"]
            )
    return table, good


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.intervals", description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS, help="(default %(default)s)")
    table, good = measure(parser.parse_args().seeds)
    print(table.markdown())
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
