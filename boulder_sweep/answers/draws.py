"""Designs sampled from their distributions, simulated and judged in batches on several threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.trials import InputRows, Judges, rows_at
from boulder_sweep.designs import block_of
from boulder_sweep.judge.judged import ERROR, NO_CONTACT, UNDECIDED
from boulder_sweep.runner.pool import Pool, call

if TYPE_CHECKING:
    from boulder_sweep.answers.spread import Spread
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.evaluation import Evaluation
    from boulder_sweep.judge.judged import Judged

AT_ONCE = 16_384
"""Designs simulated at once by a thread."""
NEAR = 0.01
"""Designs whose quick solution is closer to a limit than this share of it are judged again with the accuracy of the
sweep. The error of the quick solution is far smaller."""
WORST = -10.0
"""Distance assigned to designs that the truck goes over, or that cannot be computed."""
_SIZES = ("boulder_height_m", "embedment_depth_m", "bumper_height_m", "bed_offset_m")
OVERLAP_M = 0.25
"""Overlap beyond the required one that counts as a reserve of 1."""
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
    """

    rows: InputRows
    spread: Spread
    judges: Judges
    parallel: Pool

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
        return self.drawn(index, z, **inputs)[0]

    def drawn(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances of designs and what is known of each; arguments: see `distance`.

        Returns
        -------
        distance : ndarray, shape (m,)
            See `distance`.
        known : ndarray of int64, shape (m,)
            1 where the design passes, 0 where it does not, and less the code of its reason where it is undecided.
        """
        distance, known = self._measured(index, z, inputs)
        return distance, known.astype(np.int64)

    def reserve(self, index: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the reserve of designs, positive where they pass, shape (m,); arguments: see `distance`.

        Notes
        -----
        Unlike the distance it shrinks towards whatever ends passing, also towards too little overlap with the bumper
        and towards too much crush, so that rare cases of these are found step by step. For a design that passes it is
        the product of three reserves, which does not change its order where one of them is the same for all; for
        others, minus the sum of all that is wrong.
        """
        return self._measured(index, z, {}, reserve=True)[0]

    def _measured(
        self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray], *, reserve: bool = False
    ) -> np.ndarray:
        parts = [slice(at, at + AT_ONCE) for at in range(0, len(index), AT_ONCE)]
        calls = (call(self._piece, index[part], z[part], rows_at(inputs, part), reserve) for part in parts)
        return np.concatenate(list(self.parallel(calls)), axis=1) if parts else np.empty((2, 0))

    def passes(self, index: np.ndarray, z: np.ndarray, **inputs: np.ndarray) -> np.ndarray:
        """Return whether designs pass; arguments: see `distance`."""
        return self.distance(index, z, **inputs) > 0.0

    def given(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray]) -> InputRows:
        """Return the inputs of sampled designs."""
        return self.spread.filled(rows_at(self.rows, index) | inputs, z)

    def _piece(self, index: np.ndarray, z: np.ndarray, inputs: dict[str, np.ndarray], reserve: bool) -> np.ndarray:
        given, judges = self.given(index, z, inputs), self.judges

        def judged_by(evaluation: Evaluation, rows: InputRows) -> tuple[Judged, np.ndarray]:
            block = block_of(rows)
            judged = evaluation(block)
            measure = _reserve_of(judged, judges, block) if reserve else _distance_of(judged, judges)
            return judged, np.stack([measure, _known(judged, judges)])

        judged, measures = judged_by(judges.coarse, given)
        if judges.coarse is not judges.final:
            near = np.flatnonzero(np.abs(judged["margin"] - judges.least_margin) < NEAR)
            if len(near):
                measures[:, near] = judged_by(judges.final, rows_at(given, near))[1]
        return measures


def _known(judged: Judged, judges: Judges) -> np.ndarray:
    """Return what is known of designs; see `Draws.drawn`."""
    return np.where(judged.verdict == UNDECIDED, -judged.reason, judges.holds(judged).astype(np.int64))


def _distance_of(judged: Judged, judges: Judges) -> np.ndarray:
    """Return the distance of designs from failing; see `Draws.distance`."""
    margin, time = judged["margin"] - judges.least_margin, judged["time_to_limit_s"]
    distance = np.where(np.isnan(margin), np.where(np.isnan(time), WORST, -FAST_OVERTURN_S / time), margin)
    # On a limit or undecided: neither counts as passing. An undecided row may have no margin.
    distance = np.where(np.isnan(margin) & (judged.verdict == UNDECIDED), 0.0, distance)
    return _sign_measure(distance, judged, judges)


def _reserve_of(judged: Judged, judges: Judges, block: DesignBlock) -> np.ndarray:
    """Return the reserve of designs; see `Draws.reserve`."""
    height, depth, bumper, bed = (block.columns[name].to_numpy() for name in _SIZES)
    margin, time = judged["margin"] - judges.least_margin, judged["time_to_limit_s"]
    parts = (
        np.where(np.isnan(margin), -FAST_OVERTURN_S / time, margin),
        (height - depth - bumper - judges.final.limits.criterion.min_overlap_m) / OVERLAP_M,
        1.0 - judged["vehicle_crush_m"] / np.maximum(bed, np.finfo(float).tiny),
    )
    # What is not known of a design neither helps nor harms it.
    inside = np.prod([np.nan_to_num(np.maximum(part, 0.0), nan=1.0) for part in parts], axis=0)
    beyond = np.sum([np.nan_to_num(np.minimum(part, 0.0), nan=0.0) for part in parts], axis=0)
    # A design that the truck goes over is worse than any that overturns, and one that cannot be computed the worst.
    beyond += np.where(judged.verdict == ERROR, WORST, np.where(judged.reason == NO_CONTACT, -1.0, 0.0))
    return _sign_measure(np.where(judges.holds(judged), inside, beyond), judged, judges)


def _sign_measure(measure: np.ndarray, judged: Judged, judges: Judges) -> np.ndarray:
    """Return a measure that is positive where designs pass, and negative where they do not."""
    smallest = np.finfo(float).tiny
    return np.where(judges.holds(judged), np.maximum(measure, smallest), np.minimum(measure, -smallest))
