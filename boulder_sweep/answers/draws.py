"""Designs sampled from their distributions, simulated and judged in batches on several threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import joblib
import numpy as np
from scipy.special import ndtr

from boulder_sweep.answers.trials import Judges, Rows
from boulder_sweep.designs import block_of
from boulder_sweep.judge.judged import UNDECIDED
from boulder_sweep.runner.pool import Pool

if TYPE_CHECKING:
    from boulder_sweep.answers.spread import Spread
    from boulder_sweep.judge.judged import Judged

AT_ONCE = 16_384
"""Designs simulated at once by a thread."""
NEAR = 0.01
"""Designs whose quick solution is closer to a limit than this share of it are judged again with the accuracy of the
sweep. The error of the quick solution is far smaller."""
WORST = -10.0
"""Distance assigned to designs that the truck goes over, or that cannot be computed."""
FAST_OVERTURN_S = 0.05
"""Time scale of the distance of designs that overturn: -1 if they reach the limit at this time, closer to 0 later."""


@dataclass(frozen=True, eq=False)
class Draws:
    """Samples designs of some rows.

    Parameters
    ----------
    rows
        Inputs of n rows, with means for the uncertain ones.
    spread
        The uncertain inputs.
    judges
        How designs are judged.
    parallel
        Threads or workers.
    variants
        Equally likely judges, one of which is chosen by the last coordinate of each point; if empty, `judges` is used.
    """

    rows: Rows
    spread: Spread
    judges: Judges
    parallel: Pool
    variants: tuple[Judges, ...] = ()

    @property
    def dimensions(self) -> int:
        """Dimensions of a point."""
        return len(self.spread.names) + bool(self.variants)

    def distance(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> np.ndarray:
        """Return the distance of designs from failing, positive where they pass, shape (m,).

        Parameters
        ----------
        index
            Row of each design, shape (m,).
        z
            Standard normal numbers, shape (m, d).
        **inputs
            Inputs to set, shape (m,) each; for uncertain ones, their means.

        Notes
        -----
        For a design that stands, the distance is its margin beyond the requested one; for one that overturns, the
        earlier, the more negative.
        """
        ends = range(0, len(index), AT_ONCE)
        pieces = self.parallel(
            joblib.delayed(self._piece)(
                index[at : at + AT_ONCE],
                z[at : at + AT_ONCE],
                {name: values[at : at + AT_ONCE] for name, values in inputs.items()},
            )
            for at in ends
        )
        return np.concatenate(list(pieces)) if len(ends) else np.empty(0)

    def passes(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> np.ndarray:
        """Return whether designs pass; arguments as of `distance`."""
        return self.distance(index, z, **inputs) > 0.0

    def given(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> Rows:
        """Return the inputs of sampled designs."""
        return self.spread.filled({name: values[index] for name, values in self.rows.items()} | inputs, z)

    def _piece(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> np.ndarray:
        given = self.given(index, z, inputs)
        if not self.variants:
            return self._distances(given, self.judges)
        count = len(self.variants)
        chosen = np.minimum((ndtr(z[:, -1]) * count).astype(np.int64), count - 1)
        found = np.empty(len(index))
        for place, judges in enumerate(self.variants):
            own = np.flatnonzero(chosen == place)
            if len(own):
                found[own] = self._distances({name: values[own] for name, values in given.items()}, judges)
        return found

    def _distances(self, given: Rows, judges: Judges) -> np.ndarray:
        judged = judges.quick(block_of(given))
        found = _distance_of(judged, judges)
        if judges.quick is not judges.own:
            near = np.flatnonzero(np.abs(judged["margin"] - judges.least_margin) < NEAR)
            if len(near):
                again = judges.own(block_of({name: values[near] for name, values in given.items()}))
                found[near] = _distance_of(again, judges)
        return found


def _distance_of(judged: Judged, judges: Judges) -> np.ndarray:
    margin, time = judged["margin"] - judges.least_margin, judged["time_to_limit_s"]
    found = np.where(np.isnan(margin), np.where(np.isnan(time), WORST, -FAST_OVERTURN_S / time), margin)
    # On a limit or undecided: neither counts as passing. An undecided row may have no margin.
    found = np.where(np.isnan(margin) & (judged.verdict == UNDECIDED), 0.0, found)
    smallest = np.finfo(float).tiny
    return np.where(judges.holds(judged), np.maximum(found, smallest), np.minimum(found, -smallest))


def threads(jobs: int | None) -> Pool:
    """Return a pool that yields results in order; with one job everything runs in the calling thread."""
    return Pool(jobs)
