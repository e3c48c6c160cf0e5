"""Three sources of uncertainty in one table: the inputs, the reading of the paper, and the numerical error.

Every sampled design is simulated with all 32 combinations of the five readings and with two laws for the ultimate
resistance of the soil: the paper's, K_p^2 times the vertical stress, and that of Broms (1964), 3 K_p times it. The
variance of the margin is then divided among these causes. The laws differ by the factor 3 / K_p, which acts where the
strain rate factor does (Eq 27).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.chance import SCRAMBLINGS, Points
from boulder_sweep.answers.draws import Draws, threads
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import Judges, Rows, every_reading, judges_of, uncertain_rows
from boulder_sweep.designs import block_of
from boulder_sweep.settings.model import SWITCHES

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

DRAWN = 512
"""Sampled designs, each simulated with every reading and law."""
COMPARED = ("kp_squared", "broms")
"""Laws of the resistance, whichever the settings name."""
INPUTS, READINGS, LAW, NUMERICAL = "uncertain inputs", "readings of the paper", "K_p² or 3 K_p", "numerical error"


@dataclass(frozen=True)
class Doubt:
    """One cause of doubt.

    Attributes
    ----------
    cause : str
        What is uncertain.
    alone : float
        Share of the variance of the margin that would vanish if this alone were known.
    total : float
        Share that would remain if everything else were known.
    """

    cause: str
    alone: float
    total: float


def doubts(sweep: Sweep, *, design: int = 0, seed: int = 0, jobs: int | None = None) -> list[Doubt]:
    """Divide the variance of the margin of one design among its causes.

    Parameters
    ----------
    sweep
        A sweep with uncertain inputs.
    design
        Number of the design.
    seed
        Seed of the sample.
    jobs
        Threads; all cores by default.

    Returns
    -------
    list of Doubt
        Uncertain inputs, readings (all combinations equally likely), law of resistance (both equally likely), and
        numerical error (the mean square of its estimate).

    Raises
    ------
    QuestionError
        No input has a distribution.
    IndexError
        There is no such design.
    """
    spread = Spread(sweep)
    z = Points(len(spread.names), seed).upto(DRAWN // SCRAMBLINGS).reshape(DRAWN, -1)
    rows = uncertain_rows(sweep, sweep.plan.given_rows(design, design + 1), design, design + 1)
    index = np.zeros(DRAWN, dtype=np.int64)
    margins = np.empty((2 ** len(SWITCHES), 2, DRAWN))
    for place, own in enumerate(every_reading(sweep)):
        for law, resistance in enumerate(COMPARED):
            judges = judges_of(replace(own, model=replace(own.model, resistance=resistance)), compared=True)
            margins[place, law] = Draws(rows, spread, judges, threads(jobs)).distance(index, z)
    return [*parted(margins), Doubt(NUMERICAL, *(2 * [_numerical(sweep, spread, rows, z, judges_of(sweep), margins)]))]


def parted(margins: np.ndarray) -> list[Doubt]:
    """Divide the variance of values, shape (readings, laws, samples), among these three."""
    variance = margins.var()
    found = []
    for cause, axis in ((INPUTS, 2), (READINGS, 0), (LAW, 1)):
        others = tuple(other for other in range(3) if other != axis)
        alone, total = margins.mean(axis=others).var(), margins.var(axis=axis).mean()
        found.append(Doubt(cause, *(float(own / variance) if variance > 0.0 else 0.0 for own in (alone, total))))
    return found


def _numerical(sweep: Sweep, spread: Spread, rows: Rows, z: np.ndarray, judges: Judges, margins: np.ndarray) -> float:
    """Return the mean square of the estimated error of the margin as a share of the variance."""
    given = spread.filled({name: np.repeat(values, len(z)) for name, values in rows.items()}, z)
    error = judges.final(block_of(given))["rotation_error_deg"] / sweep.criterion.max_rotation_deg
    error = error[np.isfinite(error)]
    return float((error**2).mean() / margins.var()) if len(error) and margins.var() > 0.0 else 0.0
