"""Probabilities of events, sampled until their confidence interval is narrow enough.

An event is sampled at scrambled Sobol points (`chance`). Several independent scramblings of the sequence give one
estimate each; their spread gives the interval (Student's t), and a share of one point is added. Where hardly any point
lies on one side, their spread is not reliable and the exact binomial interval of Clopper and Pearson is used.

The share: if one input decides, every scrambling of N points counts N p points of the event, rounded down or up, and
rounded up with a chance equal to the fraction f of N p. All S scramblings may then agree, and have no spread, however
far N p is from a whole number. They agree on the lower one with the chance (1 - f)^S, which is less than 1 - confidence
if f is more than 1 - (1 - confidence)^(1/S).

The sample grows until the interval is narrow enough, and intervals that are too narrow by chance end it. Nearly all
rows end at one of two looks, so that the interval of each look is allowed half of the misses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import betaincinv, ndtri, stdtrit
from scipy.stats import qmc

from boulder_sweep.runner.pool import Pool, call

SCRAMBLINGS = 16
"""Independent scramblings of the points; their spread tells how uncertain the estimate is."""
FIRST = 32
"""Initial points of each; doubled until the interval is narrow enough."""
FEWEST = 2 * SCRAMBLINGS
"""With fewer points than this on either side, the binomial interval is used."""
SMALLEST = 1e-12
"""Distance kept from the faces of the unit cube."""
MANY = 4096
"""New points of each scrambling from which on several threads generate them."""

Event = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Maps row numbers, shape (m,), and standard normals, shape (m, d), to whether the event occurs, shape (m,): 1 or True,
0 or False, or minus the number of the cause where that is not known."""
MOST_CAUSES = 16
"""Numbers of causes are less than this."""


class Points:
    """Scrambled Sobol points as standard normal numbers, made as needed; the same seed gives the same points."""

    def __init__(self, dimensions: int, seed: int) -> None:
        seeds = np.random.SeedSequence(seed).spawn(SCRAMBLINGS)
        self._engines = [qmc.Sobol(dimensions, scramble=True, seed=np.random.default_rng(one)) for one in seeds]
        self._points = np.empty((SCRAMBLINGS, 0, dimensions))

    def upto(self, count: int) -> np.ndarray:
        """Return the first points of every scrambling, shape (SCRAMBLINGS, count, dimensions)."""
        more = count - self._points.shape[1]
        if more > 0:
            parallel = Pool(None if more >= MANY else 1)
            new = list(parallel(call(_normal, engine, more) for engine in self._engines))
            self._points = np.concatenate([self._points, np.stack(new)], axis=1)
        return self._points[:, :count]


def _normal(engine: qmc.Sobol, count: int) -> np.ndarray:
    """Return the next points of one scrambling, shape (count, dimensions)."""
    return ndtri(np.clip(engine.random(count), SMALLEST, 1.0 - SMALLEST))


@dataclass(frozen=True, eq=False)
class Estimates:
    """Probabilities of n rows from sampled points, with their confidence intervals; arrays of shape (n,)."""

    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray
    points: np.ndarray
    """How many points were used, int64."""
    unknown: np.ndarray
    """Share of the points at which it is not known whether the event occurs. The interval reaches from the lower end
    without them to the upper end with all of them."""
    cause: np.ndarray
    """Number of the commonest cause of that, int64; 0 where there is none."""


class Chances(NamedTuple):
    """Chances of n rows of passing, and of a pass that stands under the second opinion that decides."""

    passing: Estimates
    robust: Estimates | None
    """None where second opinions are not asked."""

    @property
    def asked(self) -> Estimates:
        """The chance that a question about a probability is about."""
        return self.passing if self.robust is None else self.robust

    @property
    def points(self) -> int:
        """Designs drawn for all of them."""
        return sum(int(one.points.sum()) for one in self if one is not None)


def chance(
    event: Event,
    rows: int,
    points: Points,
    *,
    half_width: float,
    confidence: float = 0.95,
    most: int = 1 << 16,
    first: int = FIRST,
) -> Estimates:
    """Estimate the probability of an event in n rows, which all use the same points so that they can be compared.

    The interval is wider than twice the half-width only where `most` points of a row are not enough; `first` are the
    initial points of each scrambling.
    """
    happened, possible = np.zeros((2, rows, SCRAMBLINGS))
    causes = np.zeros((rows, MOST_CAUSES), dtype=np.int64)
    count = np.zeros(rows, dtype=np.int64)
    open_ = np.arange(rows)
    done, target = 0, first
    sure = 0.5 + 0.5 * confidence  # half of the misses for each of two looks
    while len(open_) and done < target:
        new = points.upto(target)[:, done:target]
        flat = new.reshape(-1, new.shape[2])
        index = np.repeat(open_, len(flat))
        occurred = event(index, np.tile(flat, (len(open_), 1))).reshape(len(open_), SCRAMBLINGS, -1)
        happened[open_] += (occurred > 0).sum(axis=2)
        possible[open_] += (occurred != 0).sum(axis=2)
        for code in np.unique(occurred[occurred < 0]):
            causes[open_, -code] += (occurred == code).sum(axis=(1, 2))
        count[open_] = target
        done = target
        ends = (interval(counted[open_], target, sure) for counted in (happened, possible))
        widths = [high - low for low, high in ends]
        open_ = open_[np.maximum(*widths) > 2.0 * half_width]
        target = min(2 * target, max(most // SCRAMBLINGS, first))
    low, high = interval(happened, count, sure)[0], interval(possible, count, sure)[1]
    drawn = SCRAMBLINGS * count
    return Estimates(happened.sum(axis=1) / drawn, low, high, drawn, causes.sum(axis=1) / drawn, causes.argmax(axis=1))


def interval(happened: np.ndarray, count: np.ndarray | int, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the confidence interval (low, high) of a probability, shape (n,), as the module explains.

    `happened` has the occurrences, shape (n, SCRAMBLINGS), `count` the points of each scrambling, shape (n,) or one
    number. The share of a point is 0.17 with 16 scramblings and a confidence of 95 %.
    """
    count = np.broadcast_to(np.asarray(count), happened.shape[:1])
    shares = happened / count[:, None]
    mean = shares.mean(axis=1)
    half = stdtrit(SCRAMBLINGS - 1, 0.5 + 0.5 * confidence) * shares.std(axis=1, ddof=1) / np.sqrt(SCRAMBLINGS)
    half += (1.0 - (1.0 - confidence) ** (1.0 / SCRAMBLINGS)) / count
    yes, all_ = happened.sum(axis=1), SCRAMBLINGS * count
    few = np.minimum(yes, all_ - yes) < FEWEST
    tail = 0.5 * (1.0 - confidence)
    with np.errstate(invalid="ignore"):
        exact_low = np.where(yes > 0, betaincinv(np.maximum(yes, 1), all_ - yes + 1, tail), 0.0)
        exact_high = np.where(yes < all_, betaincinv(yes + 1, np.maximum(all_ - yes, 1), 1.0 - tail), 1.0)
    low = np.where(few, exact_low, mean - half)
    high = np.where(few, exact_high, mean + half)
    return np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
