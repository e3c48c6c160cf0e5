"""What the variance of an answer comes from: Sobol indices of the uncertain inputs, and three sources of doubt.

Of a design, first-order and total indices are estimated from samples of their own (`indices`), and a quick measure from
existing points (`drivers`).

In one table (`doubts`) stand the inputs, the reading of the paper, and the numerical error: every sampled design is
simulated with all 32 combinations of the five readings and with two laws for the ultimate resistance of the soil: the
paper's, K_p^2 times the vertical stress, and that of Broms (1964), 3 K_p times it. The variance of the margin is then
divided among these causes. The laws differ by the factor 3 / K_p, which acts where the strain rate factor does (Eq 27).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from boulder_sweep.answers.chance import SCRAMBLINGS, SMALLEST, Points
from boulder_sweep.answers.draws import Draws
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import every_reading, judges_of, uncertain_rows
from boulder_sweep.designs import block_of
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings.model import SWITCHES

if TYPE_CHECKING:
    from boulder_sweep.answers.trials import InputRows, Judges
    from boulder_sweep.settings import Sweep

BASE = 2048
"""Points of each of the two samples; the number of designs is this times (number of inputs + 2)."""
RESAMPLES = 400
STRATA = 8
"""Strata of each input whose means are compared by `drivers`."""
DRAWN = 512
"""Sampled designs, each simulated with every reading and law."""
COMPARED = ("kp_squared", "broms")
"""Laws of the resistance, whichever the settings name."""
INPUTS, READINGS, LAW, NUMERICAL = "uncertain inputs", "readings of the paper", "K_p² or 3 K_p", "numerical error"

Outputs = Callable[[np.ndarray], np.ndarray]
"""Maps standard normal numbers, shape (m, d), to outputs, shape (s, m)."""


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol indices of s outputs by d inputs, arrays of shape (s, d); NaN where an output does not vary.

    Attributes
    ----------
    first, first_low, first_high : ndarray
        Share of the variance that would vanish if this input alone were known, and its interval.
    total, total_low, total_high : ndarray
        Share that would remain if all other inputs were known, and its interval.
    """

    first: np.ndarray
    first_low: np.ndarray
    first_high: np.ndarray
    total: np.ndarray
    total_low: np.ndarray
    total_high: np.ndarray


def indices(
    outputs: Outputs, dimensions: int, *, seed: int, base: int = BASE, confidence: float = 0.95, uniform: bool = False
) -> Indices:
    """Estimate Sobol indices of independent standard normal numbers.

    Parameters
    ----------
    outputs
        The outputs.
    dimensions
        Dimensions of a point.
    seed
        The same seed gives the same points.
    base
        Points of each of the two samples, a power of two.
    confidence
        Confidence level of the intervals.
    uniform
        Whether `outputs` takes uniform numbers between 0 and 1 instead.

    Returns
    -------
    Indices
        From `estimators`, which are those of `scipy.stats.sobol_indices`; intervals by bootstrap with the same seed.

    Notes
    -----
    The indices refer to independent normals. If two inputs are correlated, the index of the second refers to the part
    that it does not share with the first.
    """
    rng = np.random.default_rng(seed)
    both = qmc.Sobol(2 * dimensions, scramble=True, seed=rng).random(base)
    points = both if uniform else ndtri(np.clip(both, SMALLEST, 1.0 - SMALLEST))
    A, B = points[:, :dimensions], points[:, dimensions:]
    mixed = np.repeat(A[None], dimensions, axis=0)
    for k in range(dimensions):
        mixed[k, :, k] = B[:, k]
    values = outputs(np.concatenate([A, B, mixed.reshape(-1, dimensions)]))
    f_A, f_B = values[:, :base], values[:, base : 2 * base]
    f_AB = values[:, 2 * base :].reshape(len(values), dimensions, base)
    estimates = {name: np.full((len(values), dimensions), np.nan) for name in Indices.__dataclass_fields__}
    ends = [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence]
    again = rng.integers(0, base, (RESAMPLES, base))
    for output, (a, b, ab) in enumerate(zip(f_A, f_B, f_AB, strict=True)):
        if np.concatenate([a, b]).var() == 0.0:
            continue
        estimates["first"][output], estimates["total"][output] = estimators(a, b, ab)
        resampled = [estimators(a[rows], b[rows], ab[:, rows]) for rows in again]
        for order, name in enumerate(("first", "total")):
            low, high = np.quantile([pair[order] for pair in resampled], ends, axis=0)
            estimates[f"{name}_low"][output], estimates[f"{name}_high"][output] = low, high
    return Indices(**estimates)


def estimators(f_A: np.ndarray, f_B: np.ndarray, f_AB: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Sobol indices of first order (Saltelli 2010) and total (Jansen 1999), shape (d,) each.

    Parameters
    ----------
    f_A, f_B
        An output at two samples, shape (n,).
    f_AB
        The output at the first sample with one input at a time taken from the second, shape (d, n).
    """
    both = np.concatenate([f_A, f_B])
    variance = both.var()
    if variance == 0.0:  # a resample may hold a single value
        return np.zeros(len(f_AB)), np.zeros(len(f_AB))
    first = ((f_B - both.mean()) * (f_AB - f_A)).mean(axis=1) / variance
    return first, 0.5 * ((f_A - f_AB) ** 2).mean(axis=1) / variance


def drivers(z: np.ndarray, output: np.ndarray) -> np.ndarray:
    """Return the most influential input of each row, from the means of an output over strata of each input.

    Parameters
    ----------
    z
        Standard normal numbers, shape (m, d), the same for all rows.
    output
        An output at these points, shape (n, m).

    Returns
    -------
    ndarray of int64, shape (n,)
        Index of the input; -1 where the output does not vary.
    """
    shares = np.empty((len(output), z.shape[1]))
    for k in range(z.shape[1]):
        order = np.argsort(z[:, k], kind="stable")
        strata = np.array_split(order, STRATA)
        means = np.stack([output[:, stratum].mean(axis=1) for stratum in strata], axis=1)
        shares[:, k] = means.var(axis=1)
    return np.where(output.var(axis=1) > 0.0, shares.argmax(axis=1), -1)


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
    for reading, variant in enumerate(every_reading(sweep)):
        for law, resistance in enumerate(COMPARED):
            judges = judges_of(replace(variant, model=replace(variant.model, resistance=resistance)))
            margins[reading, law] = Draws(rows, spread, judges, Pool(jobs)).distance(index, z)
    return [*parted(margins), Doubt(NUMERICAL, *(2 * [_numerical(sweep, spread, rows, z, judges_of(sweep), margins)]))]


def parted(margins: np.ndarray) -> list[Doubt]:
    """Divide the variance of values, shape (readings, laws, samples), among these three."""
    variance = margins.var()
    parts = []
    for cause, axis in ((INPUTS, 2), (READINGS, 0), (LAW, 1)):
        others = tuple(other for other in range(3) if other != axis)
        alone, total = margins.mean(axis=others).var(), margins.var(axis=axis).mean()
        parts.append(Doubt(cause, *(float(part / variance) if variance > 0.0 else 0.0 for part in (alone, total))))
    return parts


def _numerical(
    sweep: Sweep, spread: Spread, rows: InputRows, z: np.ndarray, judges: Judges, margins: np.ndarray
) -> float:
    """Return the mean square of the estimated error of the margin as a share of the variance."""
    given = spread.filled({name: np.repeat(values, len(z)) for name, values in rows.items()}, z)
    error = judges.final(block_of(given))["rotation_error_deg"] / sweep.criterion.max_rotation_deg
    error = error[np.isfinite(error)]
    return float((error**2).mean() / margins.var()) if len(error) and margins.var() > 0.0 else 0.0
