"""What a worker does with rows: simulate and judge them, retry failures, encode parts.

A block that raises is tried again, then halved until the rows that raise are alone; those become rows of
verdict ``error``. Where thousands of tries fail, nothing more is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from boulder_sweep.columns import GRADES, OUTCOMES, STANDINGS, VERDICTS, OutcomeColumn
from boulder_sweep.errors import ComputationError
from boulder_sweep.judge.judged import PASS, Judged, joined, not_computed
from boulder_sweep.store.writer import EncodedPart, StagedPart
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

MakeBlock = Callable[[int, int], "DesignBlock"]
Evaluate = Callable[["DesignBlock"], Judged]
_TRIES = 2
_FAILURES_BUDGET = 5_000
"""Failed tries after which a run stops: something is then wrong with more than single designs."""


class Computation:
    """How the rows of one sweep are computed and encoded; the same for every worker, and picklable.

    Parameters
    ----------
    evaluate
        Simulates and judges a block.
    make_block
        Gives the inputs of some rows.
    metadata
        Metadata of the files of parts.
    warm_up
        Loads or compiles what `evaluate` calls.
    specs
        Outcome columns that `evaluate` gives.
    """

    def __init__(
        self,
        evaluate: Evaluate,
        make_block: MakeBlock,
        metadata: Mapping[bytes, bytes],
        warm_up: Callable[[], None] = lambda: None,
        specs: Sequence[OutcomeColumn] = OUTCOMES,
    ):
        self._evaluate = evaluate
        self._make_block = make_block
        self._metadata = dict(metadata)
        self._warm_up = warm_up
        self._columns = tuple(spec.name for spec in specs)
        self._failures = 0

    def warm_up(self) -> None:
        """Load or compile the kernels."""
        self._warm_up()

    def judged(self, start: int, stop: int, tries: int = _TRIES) -> Judged:
        """Compute the rows [start, stop); those that fail every time are rows of verdict ``error``.

        Raises
        ------
        ComputationError
            So many tries have failed, of these rows or others, that something must be wrong with all of them.
        """
        reason = ""
        for _ in range(tries):
            try:
                return self._evaluate(self._make_block(start, stop))
            except Exception as problem:
                self._failures += 1
                reason = one_line(problem)
        if self._failures >= _FAILURES_BUDGET:
            raise ComputationError(f"{self._failures:,} attempts to compute designs failed, the last with: {reason}")
        if stop - start > 1:
            middle = (start + stop) // 2
            return joined([self.judged(start, middle, 1), self.judged(middle, stop, 1)])
        return failed_rows(stop - start, f"the computation of this design failed: {reason}")

    def encoded(self, first: int, pieces: Sequence[Judged]) -> EncodedPart:
        """Encode consecutive judged rows from `first` on as one part."""
        from boulder_sweep.store.provenance import cpu_metadata
        from boulder_sweep.store.schema import encode, part_table  # imports pyarrow

        judged = joined(list(pieces)).only(self._columns)
        rows = len(judged.verdict)
        table = part_table(self._make_block(first, first + rows), judged, {**self._metadata, **cpu_metadata()})
        return EncodedPart(first, rows, encode(table), verdict_counts(judged))


def failed_rows(count: int, reason: str) -> Judged:
    """Return rows of verdict ``error`` that all have the same reason."""
    return not_computed((reason,), np.zeros(count, dtype=np.int32))


def verdict_counts(judged: Judged) -> dict[str, int]:
    """Count the rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` without one.

    Passes are counted by their robustness, sensitive ones by what they stand under, too.
    """
    width = len(judged.reasons)
    counts = np.bincount(judged.verdict.astype(np.int64) * width + judged.reason)
    found = {}
    for code in np.flatnonzero(counts):
        verdict, reason = VERDICTS[code // width], judged.reasons[code % width]
        found[f"{verdict}/{reason}" if reason else verdict] = int(counts[code])
    passing = judged.verdict == PASS
    grade, standing = judged["robustness"][passing], judged["stands_under"][passing]
    found.pop("pass", None)
    pairs = np.bincount((grade.astype(np.int64) + 1) * (len(STANDINGS) + 1) + standing + 1)  # -1 is none
    for code in np.flatnonzero(pairs):
        place, under = divmod(int(code), len(STANDINGS) + 1)
        word = GRADES[place - 1]
        laws = STANDINGS[under - 1].split(";")[1:] if word == "sensitive" and under else []
        key = f"pass/{word}" + (f" (stands under {' and '.join(laws)})" if laws else "")
        found[key] = found.get(key, 0) + int(pairs[code])
    return dict(sorted((key, count) for key, count in found.items() if count))


class Computed(NamedTuple):
    """Some rows are computed."""

    rows: int


class Note(NamedTuple):
    """Something the user should know, such as a lost worker."""

    text: str


class Ended(NamedTuple):
    """There will be no more messages."""

    problem: BaseException | None
    """What went wrong, if anything did."""


Message = Computed | StagedPart | Note | Ended
"""A `StagedPart` is a part that is written and waits to be committed."""
