"""Questions about the probability of passing: the least value at which designs drawn with it pass often enough."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.chance import SCRAMBLINGS, Chances, Estimates, Points, chance
from boulder_sweep.answers.draws import WORST, Draws
from boulder_sweep.answers.keys import Ends, Key, range_of
from boulder_sweep.answers.questions import CHECKED_AT_ONCE, Question, Trial
from boulder_sweep.answers.search import BEYOND, FAILS, HOLDS, Search
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import DEPTH, InputRows, Judges, beyond_reach, ranges, rows_at, ungraded
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.judged import OVERRIDE
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

DRAWN = 4096
"""Samples at each value, in the search as at the answer: what is reported is what qualified."""
FEW = 256
"""Points by which depths are compared."""
AT_ONCE = 1 << 18
"""Designs drawn at once."""


class Sampling:
    """Designs drawn with some inputs set, of which enough must pass, or be robust if the judges ask for it.

    All rows and values use the same points, so that the share that passes depends on the inputs alone.
    """

    def __init__(self, spread: Spread, judges: Judges, probability: float, seed: int) -> None:
        self.spread, self.judges = spread, judges
        self.probability, self.seed = probability, seed
        points = Points(len(spread.names), seed).upto(DRAWN // SCRAMBLINGS)
        self.points = points.reshape(DRAWN, -1)
        self.few = points[:, : FEW // SCRAMBLINGS].reshape(FEW, -1)

    def draws(self, rows: InputRows) -> Draws:
        """Return what draws the designs of some rows."""
        return Draws(rows, self.spread, self.judges, Pool(1))

    def codes(self, draws: Draws, index: np.ndarray, inputs: InputRows, points: np.ndarray) -> np.ndarray:
        """Return the predicate of `search` for designs by some of the points, shape (m,).

        It holds where they pass often enough; where the truck goes over too many of them there is nothing to try.
        """
        codes = np.empty(len(index), dtype=np.int8)
        for start, stop in ranges(len(index), AT_ONCE // len(points)):
            repeated = np.repeat(np.arange(start, stop), len(points))
            drawn = draws.drawn(index[repeated], np.tile(points, (stop - start, 1)), **rows_at(inputs, repeated))
            distance, known = (values.reshape(-1, len(points)) for values in drawn)
            over = (known == -OVERRIDE) | ((known == 0) & (distance <= WORST))
            failing = np.where(over.mean(axis=1) > 1.0 - self.probability, BEYOND, FAILS)
            codes[start:stop] = np.where((known == 1).mean(axis=1) >= self.probability, HOLDS, failing)
        return codes

    def chances(self, draws: Draws, inputs: InputRows) -> Chances:
        """Return the probabilities of all rows with inputs set, from the points by which the search decides."""
        count, points = len(next(iter(inputs.values()))), Points(len(self.spread.names), self.seed)

        def sampled(draws: Draws) -> Estimates:
            def event(index: np.ndarray, z: np.ndarray) -> np.ndarray:
                return draws.drawn(index, z, **rows_at(inputs, index))[1]

            return chance(event, count, points, half_width=1.0, first=DRAWN // SCRAMBLINGS)

        if not self.judges.robust:
            return Chances(sampled(draws), None)
        return Chances(sampled(replace(draws, judges=self.judges.of_any_pass())), sampled(draws))


class ProbabilityQuestion(Question):
    """The smallest, or the largest, value of one input that passes with a given probability, when others are uncertain.

    A `QuestionError` refuses what `Question` does, no input with a distribution, or one that is asked for.
    """

    rows_at_once = 4
    cells = 6

    def __init__(self, sweep: Sweep, key: Key, between: Ends, judges: Judges, probability: float, seed: int) -> None:
        for name in EMBEDMENT if key.name in EMBEDMENT else (key.name,):
            if name in sweep.distributions:
                raise QuestionError(
                    f"{key.field.path} is asked for, and {BY_NAME[name].path} has a distribution: give it one value "
                    f"(--set {BY_NAME[name].path}=VALUE), in the place of which the answer is tried"
                )
        super().__init__(sweep, key, between, judges)
        self.sampling = Sampling(Spread(sweep), judges, probability, seed)

    def trial(self, rows: InputRows, *, roughly: bool = False) -> Trial:
        """Return the object that tries values in some rows, roughly by few points."""
        return ProbabilityTrial(self, rows, self.sampling.few if roughly else self.sampling.points)

    def graded(self, judged: Judged, block: DesignBlock, found: np.ndarray) -> Judged:
        """Return the outcomes at the means, without a grade."""
        return ungraded(judged)

    def undecided(self, judged: Judged, chances: Chances | None) -> np.ndarray:
        """Return where enough designs would pass if those that are undecided did, bool, shape (n,)."""
        assert chances is not None
        asked = chances.asked
        return (asked.unknown > 0.0) & (asked.estimate + asked.unknown >= self.sampling.probability)

    def values_to_try(self) -> int:
        """Return how many values are tried in all, if every row changes once from failing to passing."""
        rows = (self.open.rows(*ends) for ends in ranges(self.count, CHECKED_AT_ONCE))
        pieces = [self.lattice(*range_of(self.sweep, self.key, some, self.between)) for some in rows]
        widest = np.concatenate([np.abs(last - first) for first, last in pieces]) / self.cells
        return int(np.sum(self.cells + 1 + np.ceil(np.log2(np.maximum(widest, 1.0)))))


class ProbabilityTrial(Trial):
    """Tries values of the input in some rows: whether the designs sampled with them pass often enough."""

    def __init__(self, asked: ProbabilityQuestion, rows: InputRows, points: np.ndarray) -> None:
        super().__init__(asked.key, asked.judges, rows, asked.sweep.criterion.min_overlap_m)
        self.asked, self.draws, self.points = asked, asked.sampling.draws(rows), points

    def settled(self, result: Search, first: np.ndarray, last: np.ndarray) -> Search:
        """Return the search as it is."""
        return result

    def contradicted(self, result: Search) -> np.ndarray:
        """Return no rows: the designs drawn near a limit are judged with the accuracy of the sweep anyway."""
        return np.empty(0, dtype=np.int64)

    def chances(self, positions: np.ndarray) -> Chances:
        """Return the probabilities at some values, one for each row."""
        inputs = self._inputs(self.block(np.arange(len(positions)), positions), positions)
        chances = self.asked.sampling.chances(self.draws, inputs)
        self.simulated += chances.points
        return chances

    def _codes(
        self, index: np.ndarray, positions: np.ndarray, *, quick: bool, tolerance_m: float | None = None
    ) -> np.ndarray:
        block, judged = self.judged(index, positions, quick=True)
        sampling = self.asked.sampling
        codes = sampling.codes(self.draws, index, self._inputs(block, positions), self.points)
        self.simulated += len(self.points) * len(index)
        if self.asked.tried is not None and self.points is sampling.points:
            self.asked.tried(len(index))
        return np.where(beyond_reach(block, judged), BEYOND, codes)

    def _inputs(self, block: DesignBlock, positions: np.ndarray) -> InputRows:
        """Return what is tried of the designs of a block: the values, and the depths where they are searched, too."""
        depths = {DEPTH: block.columns[DEPTH].to_numpy()} if self.asked.seeks_depth else {}
        return {self.key.name: self.key.values(positions)} | depths
