"""The chance of an event by scrambled Sobol points, with an interval, stopped when the interval is narrow enough.

Several independent scramblings of the same sequence are drawn. Each gives one estimate, and the spread of the estimates
gives the interval (Student's t). Where hardly any point lies on the one side, the estimates say too little about
themselves, and the exact binomial interval of Clopper and Pearson is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv, ndtri, stdtrit
from scipy.stats import qmc

SCRAMBLINGS = 16
"""Independent estimates."""
FIRST = 32
"""Points of each at first; doubled until the interval is narrow enough."""
FEWEST = 2 * SCRAMBLINGS
"""Points on either side with fewer of which the binomial interval is taken."""
SMALLEST = 1e-12
"""Points are kept so far from the ends of the unit cube."""

Event = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Rows, shape (m,), and standard normal numbers, shape (m, d), to whether it happens, bool, shape (m,)."""


class Points:
    """Scrambled Sobol points as standard normal numbers, made as they are needed.

    Parameters
    ----------
    dimensions
        Numbers of a point.
    seed
        The same seed gives the same points.
    """

    def __init__(self, dimensions: int, seed: int) -> None:
        seeds = np.random.SeedSequence(seed).spawn(SCRAMBLINGS)
        self._engines = [qmc.Sobol(dimensions, scramble=True, seed=np.random.default_rng(own)) for own in seeds]
        self._points = np.empty((SCRAMBLINGS, 0, dimensions))

    def upto(self, count: int) -> np.ndarray:
        """Return the first points of every scrambling, shape (SCRAMBLINGS, count, dimensions)."""
        more = count - self._points.shape[1]
        if more > 0:
            new = np.stack([engine.random(more) for engine in self._engines])
            normal = ndtri(np.clip(new, SMALLEST, 1.0 - SMALLEST))
            self._points = np.concatenate([self._points, normal], axis=1)
        return self._points[:, :count]


@dataclass(frozen=True, eq=False)
class Chance:
    """Chances of n rows.

    Attributes
    ----------
    estimate, low, high : ndarray, shape (n,)
        The chance and its interval.
    points : ndarray of int64, shape (n,)
        Points that were tried.
    """

    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray
    points: np.ndarray


def chance(
    event: Event,
    rows: int,
    points: Points,
    *,
    half_width: float,
    confidence: float = 0.95,
    most: int = 1 << 16,
    first: int = FIRST,
) -> Chance:
    """Estimate the chance of an event in n rows.

    Parameters
    ----------
    event
        Tells whether it happens.
    rows
        How many rows; all of them see the same points, so that they can be compared.
    points
        The points.
    half_width
        Half of the widest interval that is accepted.
    confidence
        Share of intervals that hold the chance.
    most
        Points of a row at most.
    first
        Points of each scrambling at first.

    Returns
    -------
    Chance
        Where `most` points do not suffice, the interval is wider than asked for.
    """
    happened = np.zeros((rows, SCRAMBLINGS))
    count = np.zeros(rows, dtype=np.int64)
    open_ = np.arange(rows)
    done, target = 0, first
    while len(open_) and done < target:
        new = points.upto(target)[:, done:target]
        flat = new.reshape(-1, new.shape[2])
        index = np.repeat(open_, len(flat))
        found = event(index, np.tile(flat, (len(open_), 1))).reshape(len(open_), SCRAMBLINGS, -1)
        happened[open_] += found.sum(axis=2)
        count[open_] = target
        done = target
        low, high = interval(happened[open_], target, confidence)
        open_ = open_[high - low > 2.0 * half_width]
        target = min(2 * target, max(most // SCRAMBLINGS, first))
    low, high = interval(happened, count, confidence)
    return Chance(happened.sum(axis=1) / (SCRAMBLINGS * count), low, high, SCRAMBLINGS * count)


def interval(happened: np.ndarray, count: np.ndarray | int, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the interval of a chance from several scramblings.

    Parameters
    ----------
    happened
        How often it happened, shape (n, SCRAMBLINGS).
    count
        Of so many points of each scrambling, shape (n,) or one number.
    confidence
        Share of intervals that hold the chance.

    Returns
    -------
    low, high : ndarray, shape (n,)
        Its ends.
    """
    count = np.broadcast_to(np.asarray(count), happened.shape[:1])
    shares = happened / count[:, None]
    mean = shares.mean(axis=1)
    half = stdtrit(SCRAMBLINGS - 1, 0.5 + 0.5 * confidence) * shares.std(axis=1, ddof=1) / np.sqrt(SCRAMBLINGS)
    yes, all_ = happened.sum(axis=1), SCRAMBLINGS * count
    few = np.minimum(yes, all_ - yes) < FEWEST
    tail = 0.5 * (1.0 - confidence)
    with np.errstate(invalid="ignore"):
        exact_low = np.where(yes > 0, betaincinv(np.maximum(yes, 1), all_ - yes + 1, tail), 0.0)
        exact_high = np.where(yes < all_, betaincinv(yes + 1, np.maximum(all_ - yes, 1), 1.0 - tail), 1.0)
    low = np.where(few, exact_low, mean - half)
    high = np.where(few, exact_high, mean + half)
    return np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
