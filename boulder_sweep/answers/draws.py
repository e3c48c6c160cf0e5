"""Designs drawn from their distributions, simulated and judged in pieces on several threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import joblib
import numpy as np
from scipy.special import ndtr

from boulder_sweep.answers.trials import Judges, Rows
from boulder_sweep.designs import block_of
from boulder_sweep.judge.judged import UNDECIDED

if TYPE_CHECKING:
    from boulder_sweep.answers.spread import Spread
    from boulder_sweep.judge.judged import Judged

AT_ONCE = 16_384
"""Designs simulated at once by a thread."""
NEAR = 0.01
"""Designs whose quick solution keeps to the limits by less than this share of them are judged again with the accuracy
of the sweep. The quick solution is off by far less."""
WORST = -10.0
"""Distance of designs that the truck passes over, or that cannot be computed."""
FAST_OVERTURN_S = 0.05
"""Scale of the distance of designs that overturn: -1 where they reach the limit after this time, nearer to 0 later."""


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws designs of some rows.

    Parameters
    ----------
    rows
        Inputs of n rows with the means of the uncertain ones.
    spread
        The uncertain inputs.
    judges
        How designs are judged.
    parallel
        Threads.
    variants
        Judges of which the last number of each point chooses one, all alike probable; without any, `judges` judges all.
    """

    rows: Rows
    spread: Spread
    judges: Judges
    parallel: joblib.Parallel
    variants: tuple[Judges, ...] = ()

    @property
    def dimensions(self) -> int:
        """Numbers of a point."""
        return len(self.spread.names) + bool(self.variants)

    def distance(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> np.ndarray:
        """Return how far designs are from failing: positive where they pass, shape (m,).

        Parameters
        ----------
        index
            Row of each design, shape (m,).
        z
            Standard normal numbers, shape (m, d).
        **inputs
            Inputs that are set, shape (m,) each; of uncertain ones these are the means.

        Notes
        -----
        Where a design stands, it is the margin beyond the one asked for; where it overturns, the sooner the farther.
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
        """Return whether designs pass; otherwise as `distance`."""
        return self.distance(index, z, **inputs) > 0.0

    def given(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> Rows:
        """Return the inputs of drawn designs."""
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
    # On a limit, or undecided: neither on the side of passing. An undecided row may have no margin.
    found = np.where(np.isnan(margin) & (judged.verdict == UNDECIDED), 0.0, found)
    smallest = np.finfo(float).tiny
    return np.where(judges.holds(judged), np.maximum(found, smallest), np.minimum(found, -smallest))


def threads(jobs: int | None) -> joblib.Parallel:
    """Return threads that give their results in order; one thread is none beside the caller."""
    return joblib.Parallel(n_jobs=jobs or -1, backend="threading", return_as="generator")
