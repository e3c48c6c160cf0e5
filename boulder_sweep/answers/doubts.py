"""Sobol indices of a design (`indices`), and a quick measure of what decides (`drivers`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from boulder_sweep.answers.chance import SMALLEST

BASE = 2048
"""Points of each of the two samples; the number of designs is this times (number of inputs + 2)."""
RESAMPLES = 400
STRATA = 8
"""Strata of each input whose means are compared by `drivers`."""

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
