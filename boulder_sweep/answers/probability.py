"""A question about the probability of passing: the least value at which designs drawn with it pass often enough."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.chance import SCRAMBLINGS, Chance, Points, chance
from boulder_sweep.answers.draws import Draws, threads
from boulder_sweep.answers.keys import Ends, Key
from boulder_sweep.answers.questions import CHECKED_AT_ONCE, Question, Trial
from boulder_sweep.answers.search import BEYOND, FAILS, HOLDS, Search
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import Judges, Rows, beyond_reach, ranges

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

DRAWN = 4096
"""Samples at each value."""
HALF_WIDTH = 0.005
"""Largest half-width of the interval of the probability reported at the answer."""


class ProbabilityQuestion(Question):
    """The smallest, or the largest, value of one input that passes with a given probability, when others are uncertain.

    Parameters
    ----------
    sweep, key, between, judges
        As of `Question`.
    probability
        The required probability of passing.
    seed
        Seed of the points.
    variants
        Readings of which every sampled design uses one.

    Raises
    ------
    QuestionError
        As of `Question`, no input has a distribution, or that of the input asked for cannot move with its mean.
    """

    rows_at_once = 4
    cells = 6

    def __init__(
        self,
        sweep: Sweep,
        key: Key,
        between: Ends,
        judges: Judges,
        probability: float,
        seed: int,
        variants: tuple[Judges, ...] = (),
    ) -> None:
        super().__init__(sweep, key, between, judges)
        self.spread, self.probability, self.seed = Spread(sweep, key.name), probability, seed
        self.variants = variants
        points = Points(len(self.spread.names) + bool(variants), seed).upto(DRAWN // SCRAMBLINGS)
        self.points = points.reshape(DRAWN, -1)

    def trial(self, rows: Rows) -> Trial:
        """Return the object that tries values in some rows."""
        return ProbabilityTrial(self, rows)

    def values_to_try(self) -> int:
        """Return how many values are tried in all, if every row changes once from failing to passing."""
        pieces = [self.lattice(self.open.rows(*ends)) for ends in ranges(self.count, CHECKED_AT_ONCE)]
        widest = np.concatenate([np.abs(last - first) for first, last in pieces]) / self.cells
        return int(np.sum(self.cells + 1 + np.ceil(np.log2(np.maximum(widest, 1.0)))))


class ProbabilityTrial(Trial):
    """Tries values of the input in some rows: whether the designs sampled with them pass often enough.

    All rows and values use the same points, so that the share that passes depends on the value alone.
    """

    def __init__(self, asked: ProbabilityQuestion, rows: Rows) -> None:
        super().__init__(asked.key, asked.judges, rows)
        self.asked = asked
        self.draws = Draws(rows, asked.spread, asked.judges, threads(1), asked.variants)

    def contradicted(self, found: Search) -> np.ndarray:
        """Return no rows: the designs drawn near a limit are judged with the accuracy of the sweep anyway."""
        return np.empty(0, dtype=np.int64)

    def chances(self, places: np.ndarray) -> Chance:
        """Return the probabilities of passing at some values, from the points of the search and more where needed."""
        values = self.key.values(places)

        def event(index: np.ndarray, z: np.ndarray) -> np.ndarray:
            self.simulated += len(index)
            return self.draws.passes(index, z, **{self.key.name: values[index]})

        points = Points(self.draws.dimensions, self.asked.seed)
        return chance(event, len(places), points, half_width=HALF_WIDTH, first=DRAWN // SCRAMBLINGS)

    def _codes(self, index: np.ndarray, places: np.ndarray, *, quick: bool) -> np.ndarray:
        block, judged = self.judged(index, places, quick=True)
        values = self.key.values(places)
        z = np.tile(self.asked.points, (len(index), 1))
        drawn = {self.key.name: np.repeat(values, DRAWN)}
        passes = self.draws.passes(np.repeat(index, DRAWN), z, **drawn)
        self.simulated += len(z)
        if self.asked.tried is not None:
            self.asked.tried(len(index))
        often = passes.reshape(-1, DRAWN).mean(axis=1) >= self.asked.probability
        return np.where(beyond_reach(block, judged), BEYOND, np.where(often, HOLDS, FAILS))
