"""Designs sampled from their distributions, simulated and judged in batches on several threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.trials import InputRows, Judges, rows_at
from boulder_sweep.designs import block_of
from boulder_sweep.judge.judged import UNDECIDED
from boulder_sweep.runner.pool import Pool, call

if TYPE_CHECKING:
    from boulder_sweep.answers.spread import Spread
    from boulder_sweep.judge.evaluation import Evaluation
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
    """Samples designs of some rows."""

    rows: InputRows
    """Inputs of n rows, with means for the uncertain ones."""
    spread: Spread
    judges: Judges
    parallel: Pool

    def drawn(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances of designs from failing and what is known of each, int64, shape (m,).

        Each is of a row, shape (m,), by standard normals, shape (m, d), with some inputs set, shape (m,) each. If it
        stands, its distance is its margin beyond the requested one; if it overturns, the earlier, the more negative.
        Known is 1 where it passes, 0 where it does not, and minus the code of its reason where it is undecided.
        """
        parts = [slice(at, at + AT_ONCE) for at in range(0, len(index), AT_ONCE)]
        calls = (call(self._piece, index[part], z[part], rows_at(inputs, part)) for part in parts)
        distance, known = np.concatenate([np.empty((2, 0)), *self.parallel(calls)], axis=1)
        return distance, known.astype(np.int64)

    def given(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> InputRows:
        """Return the inputs of sampled designs."""
        return self.spread.filled(rows_at(self.rows, index) | inputs, z)

    def _piece(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> np.ndarray:
        given, judges = self.given(index, z, inputs), self.judges

        def judged_by(evaluation: Evaluation, rows: InputRows) -> tuple[Judged, np.ndarray]:
            block = block_of(rows)
            judged = evaluation(block)
            holds = judges.holds(judged, block)
            known = np.where(judged.verdict == UNDECIDED, -judged.reason, holds.astype(np.int64))
            return judged, np.stack([_distance_of(judged, holds, judges.least_margin), known])

        judged, measures = judged_by(judges.coarse, given)
        if judges.coarse is not judges.final:
            near = np.flatnonzero(np.abs(judged["margin"] - judges.least_margin) < NEAR)
            if len(near):
                measures[:, near] = judged_by(judges.final, rows_at(given, near))[1]
        return measures


def _distance_of(judged: Judged, holds: np.ndarray, least_margin: float) -> np.ndarray:
    """Return the distance of designs from failing; see `Draws.drawn`."""
    margin, time = judged["margin"] - least_margin, judged["time_to_limit_s"]
    distance = np.where(np.isnan(margin), np.where(np.isnan(time), WORST, -FAST_OVERTURN_S / time), margin)
    # On a limit or undecided: neither counts as passing. An undecided row may have no margin.
    distance = np.where(np.isnan(margin) & (judged.verdict == UNDECIDED), 0.0, distance)
    smallest = np.finfo(float).tiny
    return np.where(holds, np.maximum(distance, smallest), np.minimum(distance, -smallest))
