"""Designs of a sweep with some inputs left open, to be filled in during a search."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.designs import REASONS, SIDES, DesignBlock, Label, block_of, input_of, some
from boulder_sweep.judge.accuracy import Accuracy, accuracy_of, steps_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.judged import PASS, Judged, joined
from boulder_sweep.settings import fields
from boulder_sweep.settings.model import SetDistributions
from boulder_sweep.settings.sweep import DesignList

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

HEIGHT = SIDES[2]
RATIO, DEPTH = fields.EMBEDMENT
OUT_OF_REACH = ("no_contact", "override")
"""Reasons for which there is nothing to search at a value: the truck goes over the boulder."""
NO_FACE = (REASONS[1], REASONS[3])
"""Reasons of designs that cannot be computed for which there is nothing to search either: the boulder is buried, or
ends below the impact height of the file."""
ROUNDING_M = 1e-9
"""What sums of heights may be off by [m]."""
PLACEHOLDER = 0.5
SHARE = "share"
"""Depth between the shallowest (0) and the deepest (1) that a boulder may have, searched like a side."""
MILLIMETRES = 1000
"""Sides and depths are whole millimetres."""
LEAST_RATIO = 0.35
"""Smallest embedment tried where the file sets no range, as a share of the height. A boulder that is hardly embedded
may slide a metre instead of turning, and pass; buried deeper, it is held at its foot and overturns."""
USUALLY = (LEAST_RATIO, 0.75)
"""Embedments, as shares of the height, in which a depth is searched beside another input; the study of grades has the
same."""
SEARCHED = ("verdict", "reason", "margin", "time_to_limit_s", "max_displacement_m")
"""Outcomes that searches look at; others are not worked out for the many designs that are only tried."""
UNASKED_M = math.inf
"""Error of a step of second opinions that are not asked: what passes counts as standing."""
GRADED = ("robustness", "stands_under")

InputRows = dict[str, np.ndarray]
"""Inputs of n designs by column name (or ``embedment_ratio``), each of shape (n,), as given by a file."""


class Open:
    """A sweep with some inputs left open.

    Opening the embedment depth opens the embedment ratio too, and the reverse.
    """

    def __init__(self, sweep: Sweep, names: tuple[str, ...]) -> None:
        self.names = names
        self._left_out = set(names) | (set(fields.EMBEDMENT) if set(names) & set(fields.EMBEDMENT) else set())
        constants = {name: value for name, value in sweep.constants.items() if name not in self._left_out}
        constants |= dict.fromkeys(names, PLACEHOLDER)
        table = sweep.table
        if table is not None:
            kept = {name: values for name, values in table.columns.items() if name not in self._left_out}
            table = DesignList(table.file, kept, table.labels) if kept else None
        axes = tuple(axis for axis in sweep.axes if axis.name not in self._left_out)
        cases = tuple(Open(case, names).sweep for case in sweep.cases)
        sought = sweep.depth_sought and fields.EMBEDMENT[1] not in self._left_out
        self.sweep: Sweep = dataclasses.replace(
            sweep, axes=axes, constants=constants, table=table, cases=cases, depth_sought=sought
        )

    @property
    def count(self) -> int:
        """Number of combinations of the other inputs."""
        return self.sweep.n_designs

    def labels(self, start: int, stop: int) -> dict[str, Label]:
        """Return the labels of the combinations ``[start, stop)``."""
        return self.sweep.block(start, stop).labels

    def rows(self, start: int, stop: int) -> InputRows:
        """Return the other inputs of the combinations ``[start, stop)``."""
        given = self.sweep.plan.given_rows(start, stop)
        return {name: values for name, values in given.items() if input_of(name) not in self._left_out}


def rows_at(rows: InputRows, index: np.ndarray | slice) -> InputRows:
    """Return some of the rows, by their indices, a mask or a slice."""
    return {name: values[index] for name, values in rows.items()}


def block_at(rows: InputRows, index: np.ndarray, **inputs: np.ndarray) -> DesignBlock:
    """Return some of the designs as a block, with the open inputs filled in."""
    return block_of(rows_at(rows, index) | inputs)


@dataclasses.dataclass(frozen=True)
class Judges:
    """Two evaluations of designs: a coarse one to search, and the sweep's own to certify.

    Parameters
    ----------
    coarse, final
        A single solution without an error estimate; the accuracy of the sweep.
    accuracy
        The sweep's own accuracy.
    least_margin
        Margin that a design must have to count as passing. Both evaluations prove that it lasts.
    robust
        Whether only a pass that stands under the second opinion that decides counts: robust, or open outside the study.
    """

    coarse: Evaluation
    final: Evaluation
    accuracy: Accuracy
    least_margin: float = 0.0
    robust: bool = False

    def of_any_pass(self) -> Judges:
        """Return these judges, but counting every pass, robust or not."""
        return dataclasses.replace(self, robust=False)

    def holds(
        self, judged: Judged, block: DesignBlock, stand: Callable[[DesignBlock], np.ndarray] | None = None
    ) -> np.ndarray:
        """Return whether designs pass with the requested margin and robustness, bool, shape (n,).

        Parameters
        ----------
        judged, block
            The designs, judged by one of the evaluations, and themselves.
        stand
            Asks second opinions, as `Evaluation.stand` does, which it is by default.
        """
        passes = judged.verdict == PASS
        if self.least_margin > 0.0:
            passes &= judged["margin"] >= self.least_margin
        if self.robust:
            rows = np.flatnonzero(passes & ~self.final.robust_unasked(judged))
            if len(rows):
                passes[rows] = (stand or self.final.stand)(some(block, rows))
        return passes


def depth_within(
    low: np.ndarray | float,
    high: np.ndarray | float,
    share: np.ndarray,
    height: np.ndarray,
    bumper: np.ndarray,
    least_overlap_m: float,
) -> np.ndarray:
    """Return depths [m], whole millimetres, from shares between the shallowest (0) and the deepest (1), shape (n,).

    Parameters
    ----------
    low, high
        The least and the greatest depth [m] that may be tried. The deepest is less where the truck would go over the
        boulder.
    share
        The shares.
    height, bumper
        Heights of the boulders, and of the bumpers over the ground [m].
    least_overlap_m
        By how much the boulder must overlap the bumper [m].
    """
    deepest_mm = np.floor((height - bumper - least_overlap_m) * MILLIMETRES + 1e-6)
    # By the very sums of the verdict, which may fall short by a bit where they are equal in decimals.
    left = height - deepest_mm / MILLIMETRES - bumper
    deepest_mm -= (left < least_overlap_m) | (left <= 0.0)
    deepest = np.clip(deepest_mm / MILLIMETRES, low, high)
    ends = np.ceil(low * MILLIMETRES - 1e-6) / MILLIMETRES, np.floor(deepest * MILLIMETRES + 1e-6) / MILLIMETRES
    return np.clip(millimetres(low + (deepest - low) * share), *ends)


def millimetres(lengths: np.ndarray) -> np.ndarray:
    """Round lengths [m] to whole millimetres."""
    return np.rint(lengths * MILLIMETRES) / MILLIMETRES


class Remembered:
    """Judges designs by the accuracy of a sweep, each only once: searches ask often for the ends of brackets.

    It keeps what it has judged, so every block of rows has one of its own; `count` designs were judged so far.
    """

    def __init__(self, judges: Judges) -> None:
        self._judges, self.count = judges, 0
        self._indices: dict[bytes, int] = {}
        self._judged: list[Judged] = []
        self._stand: dict[bytes, bool] = {}

    def __call__(self, block: DesignBlock) -> Judged:
        """Return the judged rows of a block."""
        keys = _keys_of(block)
        new = {key: row for row, key in enumerate(keys) if key not in self._indices}
        if new or not self._judged:
            self._indices |= {key: len(self._indices) + count for count, key in enumerate(new)}
            self._judged.append(self._judges.final(some(block, np.fromiter(new.values(), np.int64, len(new)))))
            self._judged = [joined(self._judged)]
            self.count += len(new)
        indices = [self._indices[key] for key in keys]
        return joined([self._judged[0].rows(np.array(indices, dtype=np.int64))])

    def holds(self, judged: Judged, block: DesignBlock, tolerance_m: float | None = None) -> np.ndarray:
        """Return which designs pass, as `Judges.holds`; a second opinion of full accuracy runs once a design."""
        if tolerance_m == UNASKED_M:
            return self._judges.of_any_pass().holds(judged, block)
        final = self._judges.final
        stand = self._stands if tolerance_m is None else partial(final.stand, tolerance_m=tolerance_m)
        return self._judges.holds(judged, block, stand)

    def _stands(self, block: DesignBlock) -> np.ndarray:
        keys = _keys_of(block)
        new = {key: row for row, key in enumerate(keys) if key not in self._stand}
        if new:
            stand = self._judges.final.stand(some(block, np.fromiter(new.values(), np.int64, len(new))))
            self._stand |= zip(new, stand.tolist(), strict=True)
        return np.array([self._stand[key] for key in keys], dtype=bool)


def _keys_of(block: DesignBlock) -> list[bytes]:
    """Return the bits of the inputs of each design."""
    inputs = [column.to_numpy() for each in (block, *block.cases) for column in each.columns.values()]
    return [row.tobytes() for row in np.stack(inputs, axis=1)]


def judges_of(sweep: Sweep, least_margin: float = 0.0, *, robust: bool = False) -> Judges:
    """Return the evaluations of a sweep; arguments: see `Judges`."""
    accuracy = accuracy_of(sweep)
    final = dataclasses.replace(evaluation_of(sweep, accuracy), least_margin=least_margin)
    final = dataclasses.replace(final, askable=final.askable and bool(sweep.model.second_opinion))
    coarse = evaluation_of(sweep, Accuracy("fast", steps_of(sweep)["fast"], error_estimate=False))
    searched = coarse.limits._replace(guarded=False)
    # A late row is found by the quick solution, too, and confirmed by the other.
    control = coarse.control._replace(longest_horizon=final.control.longest_horizon)
    columns = (*SEARCHED, "robustness") if robust else SEARCHED
    coarse = dataclasses.replace(coarse, only=columns, least_margin=least_margin, limits=searched, control=control)
    # Second opinions are asked of the answers, and of what passes where only what is robust counts.
    final, coarse = (dataclasses.replace(each, second_opinion=()) for each in (final, coarse))
    if not accuracy.error_estimate and accuracy.steps.step_s >= coarse.control.h:
        coarse = final
    return Judges(coarse, final, accuracy, least_margin, robust)


def uncertain_rows(sweep: Sweep, given: InputRows, start: int, stop: int) -> InputRows:
    """Return the rows ``[start, stop)`` of a sweep with the indices of their named soils and vehicles.

    These are needed where named sets have distributions of their own; `boulder_sweep.designs.block_of` ignores them.
    """
    sets = {spread.section for spread in sweep.distributions.values() if isinstance(spread, SetDistributions)}
    if not sets:
        return given
    labels = sweep.block(start, stop).labels
    return given | {section: np.asarray(labels[section].codes, dtype=float) for section in sets}


def ungraded(judged: Judged) -> Judged:
    """Return outcomes without a grade: at the means of uncertain inputs it would speak for the mean soil alone."""
    none = np.full(len(judged), -1, dtype=np.int32)
    return dataclasses.replace(judged, columns=judged.columns | dict.fromkeys(GRADED, none))


def beyond_reach(block: DesignBlock, judged: Judged) -> np.ndarray:
    """Return whether the truck goes over the boulder or the row is not a valid design, bool, shape (n,)."""
    words = [code for code, word in enumerate(judged.reasons) if word in OUT_OF_REACH]
    return np.isin(judged.reason, words) | (np.asarray(block.reasons.codes) != 0)


def too_low(block: DesignBlock, least_overlap_m: float) -> np.ndarray:
    """Return whether boulders overlap the bumper by less than they must, or have no face for the truck, shape (n,)."""
    sizes = ("boulder_height_m", "embedment_depth_m", "bumper_height_m")
    height, depth, bumper = (block.columns[name].to_numpy() for name in sizes)
    overlap = height - depth - bumper
    no_face = np.isin(block.reasons.codes, [REASONS.index(word) for word in NO_FACE])
    return no_face | (overlap <= ROUNDING_M) | (overlap < least_overlap_m - ROUNDING_M)


def ranges(count: int, most: int) -> Iterator[tuple[int, int]]:
    """Yield ranges ``[start, stop)`` of about equal size, none larger than `most`."""
    pieces = max(math.ceil(count / most), 1)
    for piece in range(pieces):
        start, stop = count * piece // pieces, count * (piece + 1) // pieces
        if stop > start or count == 0:
            yield start, stop
