"""Questions about the probability of passing, when inputs of soil or vehicle are uncertain.

The least value at which designs drawn with it pass often enough, and the lightest boulder that does. The search for the
latter is that of `lightest`: shapes are compared by a few points, and the boulders between which the answer lies, and
those tried around it, by all of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.chance import SCRAMBLINGS, Chance, Points, chance
from boulder_sweep.answers.draws import Draws, threads
from boulder_sweep.answers.keys import Ends, Key
from boulder_sweep.answers.lightest import DEPTH, RATIO, SIDES, Boulders, LightestQuestion, Sides
from boulder_sweep.answers.questions import CHECKED_AT_ONCE, Answers, Question, Trial
from boulder_sweep.answers.search import BEYOND, FAILS, HOLDS, Search
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import Judges, Remembered, Rows, beyond_reach, ranges, uncertain_rows
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.fields import BY_NAME

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

DRAWN = 4096
"""Samples at each value."""
HALF_WIDTH = 0.005
"""Largest half-width of the interval of the probability reported at the answer."""
FEW = 256
"""Points by which shapes are compared."""
AT_ONCE = 1 << 18
"""Designs drawn at once."""


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


class LikelyLightestQuestion(LightestQuestion):
    """The least boulder mass that passes with a given probability.

    Parameters
    ----------
    sweep, key, judges
        As of `LightestQuestion`.
    probability, seed, variants
        As of `ProbabilityQuestion`.

    Raises
    ------
    QuestionError
        As of `LightestQuestion`, no input has a distribution, or one that is searched for has.
    """

    rows_at_once = 1
    neighbours = 256

    def __init__(
        self, sweep: Sweep, key: Key, judges: Judges, probability: float, seed: int, variants: tuple[Judges, ...] = ()
    ) -> None:
        super().__init__(sweep, key, judges)
        self.spread, self.probability, self.seed, self.variants = Spread(sweep), probability, seed, variants
        for name in (*SIDES, DEPTH, RATIO):
            if name in self.spread.names:
                path = BY_NAME[name].path
                raise QuestionError(f"--least mass searches for {path}, which has a distribution; give it values")
        points = Points(len(self.spread.names) + bool(variants), seed).upto(DRAWN // SCRAMBLINGS)
        self.points = points.reshape(DRAWN, -1)
        self.few = points[:, : FEW // SCRAMBLINGS].reshape(FEW, -1)

    def given(self, start: int, stop: int) -> Rows:
        """Return the other inputs of some rows, with the places of named sets that have distributions."""
        return uncertain_rows(self.open.sweep, super().given(start, stop), start, stop)

    def trial(self, rows: Rows, side: str, final: Remembered) -> Boulders:
        """Return the object that tries boulders in some rows."""
        return LikelyBoulders(self, rows, side, final)

    def draws(self, rows: Rows) -> Draws:
        """Return what draws the designs of some rows."""
        return Draws(rows, self.spread, self.judges, threads(1), self.variants)

    def answered(self, start: int, stop: int) -> Answers:
        """Answer the rows ``[start, stop)``, with the probability of passing of each answer."""
        found = super().answered(start, stop)
        draws = self.draws(self.given(start, stop))
        sizes = {name: found.block.columns[name].to_numpy() for name in (*SIDES, DEPTH)}

        def event(index: np.ndarray, z: np.ndarray) -> np.ndarray:
            return draws.passes(index, z, **{name: values[index] for name, values in sizes.items()})

        points = Points(draws.dimensions, self.seed)
        chances = chance(event, stop - start, points, half_width=HALF_WIDTH, first=DRAWN // SCRAMBLINGS)
        return replace(found, chances=chances, simulated=found.simulated + int(chances.points.sum()))


class LikelyBoulders(Boulders):
    """Tries boulders for some rows: whether designs drawn with them pass often enough."""

    def __init__(self, asked: LikelyLightestQuestion, rows: Rows, side: str, final: Remembered) -> None:
        super().__init__(asked, rows, side, final)
        self.likely, self.draws = asked, asked.draws(rows)

    def codes(self, index: np.ndarray, places: np.ndarray, others: Sides, *, quick: bool) -> np.ndarray:
        """Return the predicate of `search`."""
        block = self.block(index, places, others)
        reached = ~beyond_reach(block, self.judges.coarse(block))
        points = self.likely.few if quick else self.likely.points
        self.simulated += len(block) + len(points) * int(reached.sum())
        sizes = {name: block.columns[name].to_numpy()[reached] for name in (*SIDES, DEPTH)}
        rows, often = index[reached], np.empty(int(reached.sum()), dtype=bool)
        for start, stop in ranges(len(often), AT_ONCE // len(points)):
            own = np.repeat(np.arange(start, stop), len(points))
            z = np.tile(points, (stop - start, 1))
            passes = self.draws.passes(rows[own], z, **{name: values[own] for name, values in sizes.items()})
            often[start:stop] = passes.reshape(-1, len(points)).mean(axis=1) >= self.likely.probability
        codes = np.full(len(index), BEYOND, dtype=np.int8)
        codes[reached] = np.where(often, HOLDS, FAILS)
        return codes
