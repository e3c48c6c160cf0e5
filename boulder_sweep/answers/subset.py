"""Small probabilities by subset simulation (Au and Beck 2001), many populations side by side.

The rare event is reached in levels, each a tenth as probable as the one before. Within a level the points move by x' =
a x + sqrt(1 - a^2) w, which preserves the standard normal distribution; a move that would leave the level is rejected.
Several populations give the interval.

This works if the distance says how far a point is from the event. Where it is the same for most points of a level, the
next level is no nearer to the event, and there is no result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

POPULATIONS = 16
POINTS = 1000
"""Points of a population at each level; a multiple of ten."""
SHARE = 0.1
"""Probability of a level within the one before."""
KEPT = 0.8
"""Correlation a between a point and its move."""
MOST_LEVELS = 12
"""Levels after which an event counts as impossible: less probable than 1e-12."""

Distance = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Maps rows, shape (m,), and standard normals, shape (m, d), to the distance from the event, shape (m,), which occurs
where the distance is 0 or less."""


@dataclass(frozen=True, eq=False)
class Rare:
    """Probabilities of n rows.

    Attributes
    ----------
    estimate, low, high : ndarray, shape (n,)
        The probability and its interval, symmetric on a logarithmic scale; NaN where a level came no nearer to the
        event than the one before.
    """

    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray


FAILING = ("drawn", "subset", "no_progress", "contradicts")
"""How a probability of failing was found, or, the last two, why there is none."""


@dataclass(frozen=True, eq=False)
class Failing:
    """Probabilities of failing of n rows.

    Attributes
    ----------
    estimate, low, high : ndarray, shape (n,)
        The probability and its confidence interval; NaN where there is none.
    by : ndarray of int32, shape (n,)
        Index in `FAILING`.
    """

    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray
    by: np.ndarray


def subset_simulation(
    distance: Distance,
    rows: int,
    dimensions: int,
    *,
    seed: int,
    points: int = POINTS,
    confidence: float = 0.95,
) -> Rare:
    """Estimate small probabilities of n rows.

    Parameters
    ----------
    distance
        Distance of a point from the event.
    rows
        Number of rows.
    dimensions
        Dimensions of a point.
    seed
        The same seed gives the same result.
    points
        Points of a population at each level.
    confidence
        Confidence level of the interval.

    Returns
    -------
    Rare
        Zero, with an upper end of 1e-12, where the event was not reached although every level came nearer to it.
    """
    if rows == 0:
        return Rare(*(np.empty(0) for _ in range(3)))
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((rows, POPULATIONS, points, dimensions))
    g = _distances(distance, np.arange(rows), x)
    probability = np.ones((rows, POPULATIONS))
    open_ = np.arange(rows)
    last = g.reshape(rows, -1).max(axis=1)
    for level in range(MOST_LEVELS):
        # One threshold for all populations of a row: it hardly depends on any single one, so the estimates of the
        # populations are free of the bias that thresholds of their own would cause.
        edge = np.quantile(g[open_].reshape(len(open_), -1), SHARE, axis=1)
        edge = np.where(edge <= 0.0, 0.0, edge)
        inside = g[open_] <= edge[:, None, None]
        probability[open_] *= inside.mean(axis=2)
        stuck = (edge > 0.0) & (edge >= last[open_])
        probability[open_[stuck]] = np.nan
        going = (edge > 0.0) & ~stuck
        last[open_] = edge
        if level == MOST_LEVELS - 1:
            probability[open_[going]] = 0.0
        open_, edge, inside = open_[going], edge[going], inside[going]
        if not len(open_):
            break
        x[open_], g[open_] = _moved(distance, open_, rng, x[open_], g[open_], inside, edge)
    return _combined(probability, confidence)


def _distances(distance: Distance, rows: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the distances of points of shape (rows, ..., d), shape (rows, ...)."""
    each = x[0, ..., 0].size
    return distance(np.repeat(rows, each), x.reshape(-1, x.shape[-1])).reshape(x.shape[:-1])


def _moved(
    distance: Distance,
    rows: np.ndarray,
    rng: np.random.Generator,
    x: np.ndarray,
    g: np.ndarray,
    inside: np.ndarray,
    edge: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Refill the populations with chains that start at points within the level and stay there."""
    points = x.shape[2]
    chains = round(SHARE * points)
    # Points within the level in random order; if there are fewer points than chains, some start several.
    order = np.argsort(np.where(inside, rng.random(inside.shape), 2.0), axis=2)
    begin = np.arange(chains) % np.maximum(inside.sum(axis=2), 1)[:, :, None]
    seeds = np.take_along_axis(order, begin, axis=2)
    now = np.take_along_axis(x, seeds[..., None], axis=2)
    value = np.take_along_axis(g, seeds, axis=2)
    chain_x, chain_g = [now], [value]
    for _ in range(points // chains - 1):
        tried = KEPT * now + math.sqrt(1.0 - KEPT**2) * rng.standard_normal(now.shape)
        found = _distances(distance, rows, tried)
        taken = found <= edge[:, None, None]
        now, value = np.where(taken[..., None], tried, now), np.where(taken, found, value)
        chain_x.append(now)
        chain_g.append(value)
    return np.concatenate(chain_x, axis=2), np.concatenate(chain_g, axis=2)


def _combined(probability: np.ndarray, confidence: float) -> Rare:
    """Return the mean over populations, and an interval from their spread by the delta method on the logarithm."""
    mean = probability.mean(axis=1)
    error = probability.std(axis=1, ddof=1) / math.sqrt(POPULATIONS)
    ratio = np.divide(error, mean, out=np.zeros_like(mean), where=mean > 0.0)
    factor = np.exp(stdtrit(POPULATIONS - 1, 0.5 + 0.5 * confidence) * ratio)
    least = SHARE**MOST_LEVELS
    return Rare(mean, mean / factor, np.where(mean == 0.0, least, np.minimum(mean * factor, 1.0)))
