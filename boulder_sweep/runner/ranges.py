"""How many rows a part and a block have, and what is done with them; the same on every machine.

The numbers follow from the class of the designs by a fixed table of costs, never from a clock. A block that raises is
halved until the rows that raise are alone; those become rows of verdict ``error``. Where thousands of calls fail,
nothing more is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from boulder_sweep.errors import ComputationError
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST
from boulder_sweep.judge.judged import Judged, joined, not_computed
from boulder_sweep.locations import location_of
from boulder_sweep.runner.pool import Fingerprint, refuse_other_versions
from boulder_sweep.soils import is_layered
from boulder_sweep.store.folder import Ranges, put_part, ranges_of
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.evaluation import Evaluation
    from boulder_sweep.settings import Sweep

WORK_S, BLOCK_S = 0.4, 0.125
"""Work of a range, and most of a block [s]: so long that the few rows of a block that need finer steps fill lanes, and
short enough for Ctrl-C to act at once, also where threads share a core."""
_PLAIN_S, _LAYERED_S, _OUTLINED_S = 5e-6, 2e-5, 3e-5
"""Cost of a row on one core [s]: of a box in uniform soil, in layers, and of a boulder of several pieces in them."""
_STEP_S, _LOCATED_STEP_S, _LOCATED = 0.012, 0.006, 3.0
"""Steps at which these hold; where steps end at the yield, rows take three times as long at half the step."""
_OPINION_S = 1e-5
"""Cost of a second opinion [s] per design, of which a third pass."""
_FAILURES_BUDGET = 5_000
"""Failed calls after which a run stops: something is then wrong with more than single designs."""


def seconds_per_row(sweep: Sweep, evaluation: Evaluation) -> float:
    """Return about what a row costs on one core [s], by the table of costs."""
    model, control = sweep.model, evaluation.control
    layered = is_layered(model.resistance, model.ground, model.shape)
    base = _PLAIN_S if not layered else _LAYERED_S if model.shape.is_box else _OUTLINED_S
    step, times = (_LOCATED_STEP_S, _LOCATED) if control.locate_yield else (_STEP_S, 1.0)
    base *= times * max(step / control.h, 1.0) * (1.0 + control.elements / ELEMENTS_AS_FAST)
    cases = 1 + len(sweep.block(0, 1).cases)
    return cases * (base + len(evaluation.second_opinion) * _OPINION_S)


def planned(sweep: Sweep, evaluation: Evaluation) -> Ranges:
    """Return the ranges of a table."""
    return ranges_of(sweep.n_designs, WORK_S / seconds_per_row(sweep, evaluation))


class PartReport(NamedTuple):
    """What a worker says of a part that it has written."""

    name: str
    rows: int
    bytes: int
    verdicts: dict[str, int]


class StoppedError(Exception):
    """The run was stopped before the range was finished."""


@dataclass
class Work:
    """How the rows of one sweep are computed and written; the same for every worker, and picklable."""

    evaluate: Callable[[DesignBlock], Judged]
    """Simulates and judges a block."""
    make_block: Callable[[int, int], DesignBlock]
    """Gives the inputs of some rows."""
    metadata: Mapping[bytes, bytes]
    """What the files of all parts have in common."""
    out: str
    """The folder, by path or URL."""
    rows_per_block: int
    """Rows that are computed at once."""
    made_by: Fingerprint | None = None
    """What a worker elsewhere must have."""
    _failures: int = field(default=0, init=False)

    def write(self, first: int, stop: int, tick: Callable[[int], None] = lambda rows: None) -> PartReport:
        """Compute a range and write its part; `tick` is called with the rows of each block, and may raise to stop.

        Raise ComputationError as `judged` does, WriteError where the part cannot be written, and BackendError where
        this worker has other versions.
        """
        if self.made_by is not None:
            refuse_other_versions(self.made_by)
        from boulder_sweep.store.part import encoded_part  # imports pyarrow

        pieces = []
        for start, end in Ranges(stop - first, -(-(stop - first) // self.rows_per_block)):
            pieces.append(self.judged(first + start, first + end))
            tick(end - start)
        content, verdicts = encoded_part(self.make_block(first, stop), joined(pieces), self.metadata)
        part = put_part(location_of(self.out), first, stop, content)
        return PartReport(part.name, stop - first, len(content), verdicts)

    def judged(self, start: int, stop: int) -> Judged:
        """Compute the rows [start, stop); those that raise alone are rows of verdict ``error``.

        Raise ComputationError where so many calls have failed that something must be wrong with all rows.
        """
        try:
            return self.evaluate(self.make_block(start, stop))
        except Exception as problem:
            self._failures += 1
            reason = one_line(problem)
        if self._failures >= _FAILURES_BUDGET:
            raise ComputationError(f"{self._failures:,} attempts to compute designs failed, the last with: {reason}")
        if stop - start > 1:
            middle = (start + stop) // 2
            return joined([self.judged(start, middle), self.judged(middle, stop)])
        return not_computed((f"the computation of this design failed: {reason}",), np.zeros(1, dtype=np.int32))
