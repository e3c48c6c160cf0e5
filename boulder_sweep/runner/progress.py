"""What a run reports: its cost before, from a timed sample; progress on the way; a summary at the end."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.errors import EXIT_DONE, EXIT_SOME_ROWS_FAILED
from boulder_sweep.locations import Location
from boulder_sweep.runner.ranges import seconds_per_row
from boulder_sweep.text import size_text

if TYPE_CHECKING:
    from boulder_sweep.judge.evaluation import Evaluation
    from boulder_sweep.settings import Sweep

_SAMPLE_S, _MOST_SAMPLED = 0.1, 8192
"""Work of a sample, by the table of costs [s], and most of its rows: about as many as a block of the run has."""
_STRETCHES = 24
"""Positions all over the table from which a sample takes consecutive rows, equally many from each."""
_GOLDEN = 0.618033988749895
_USUAL_BYTES = 50.0
"""Of a row on the disk."""


class RowCost(NamedTuple):
    """Cost of a few sampled rows: time on one worker, bytes, and bytes of a part without rows."""

    seconds_per_row: float
    bytes_per_row: float
    bytes_per_part: float


@dataclass(frozen=True)
class Estimate:
    """What a run needs: the rows of the table, those it computes, their time and disk, and damaged parts by name."""

    rows: int
    rows_to_compute: int
    seconds: float
    disk_bytes: int
    jobs: int
    damaged: dict[str, str] = field(default_factory=dict)


def take_sample(
    evaluation: Evaluation,
    sweep: Sweep,
    metadata: Mapping[bytes, bytes],
    work_clock: Callable[[], float] = time.thread_time,
) -> RowCost:
    """Compute rows spread over the table and measure the time; the kernels must be warm.

    They are computed like a block of the run, so that what a block costs besides its rows weighs as little as it will.
    The time is the processor's, by `work_clock` [s], whatever else keeps it busy.
    """
    import pyarrow as pa  # heavy, and only runs need it

    from boulder_sweep.store.part import encode, part_table, table_schema

    guess = seconds_per_row(sweep, evaluation)
    beside_rows = len(encode(pa.Table.from_batches([], table_schema(metadata))))
    seconds, table = 0.0, pa.table({})
    try:
        for size in (1, min(max(int(_SAMPLE_S / guess), 1), _MOST_SAMPLED)):  # the first loads what it needs
            begun = work_clock()
            block = sweep.plan.selection(_spread_rows(sweep.n_designs, size))
            table = part_table(block, evaluation(block), metadata)
            seconds = work_clock() - begun
    except Exception:  # the run itself will name the rows
        return RowCost(guess, _USUAL_BYTES, beside_rows)
    return RowCost(seconds / len(table), max(len(encode(table)) - beside_rows, 0) / len(table), beside_rows)


def _spread_rows(rows: int, count: int) -> np.ndarray:
    """Return numbers of about so many rows, ascending, int64: short stretches from all over a table."""
    if count >= rows:
        return np.arange(rows, dtype=np.int64)
    stretch = -(-count // _STRETCHES)
    positions = (0.5 + _GOLDEN * np.arange(-(-count // stretch))) % 1.0
    starts = (positions * (rows - stretch)).astype(np.int64)
    return np.unique(starts[:, np.newaxis] + np.arange(stretch))


def time_and_disk(cost: RowCost, rows: int, parts: int, workers: int) -> tuple[float, int]:
    """Return how long so many rows take [s], and how many bytes, from the cost of a sample."""
    return rows * cost.seconds_per_row / workers, int(rows * cost.bytes_per_row + parts * cost.bytes_per_part)


def too_large(rows: int, about: str, needed_bytes: int, out: Location) -> str:
    """Say that a table does not fit on its disk; empty where it does, and of an object store."""
    free = _disk_free(out)
    if free is None or needed_bytes <= free:
        return ""
    return (
        f"the table of {rows:,} rows needs {about} {size_text(needed_bytes)} of disk, and {size_text(free)} are free. "
        f"Free some space, or choose another folder (-o)"
    )


def _disk_free(out: Location) -> int | None:
    """Free space on the disk where a folder is, or would be created; None for an object store."""
    if not isinstance(out, Path):
        return None
    while not out.exists() and out != out.parent:
        out = out.parent
    return shutil.disk_usage(out).free


@dataclass(frozen=True)
class Progress:
    """How far a run got; passed to the `progress` function of `run` up to ten times a second.

    Parameters
    ----------
    rows_before, rows_computed, rows
        Rows that were there when the run began, rows computed since, and rows of the whole table.
    seconds
        Since the computing began.
    """

    rows_before: int
    rows_computed: int
    rows: int
    seconds: float

    @property
    def rows_done(self) -> int:
        """Rows that are there now."""
        return self.rows_before + self.rows_computed

    @property
    def rows_per_second(self) -> float:
        """Rows computed by this run in a second."""
        return self.rows_computed / self.seconds if self.seconds > 0 else 0.0


@dataclass(frozen=True)
class Summary:
    """What a finished run did.

    Parameters
    ----------
    out
        Folder of the table.
    rows
        Rows of the table.
    rows_computed
        Rows computed by this run; the others existed before.
    reasons
        Rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` where there is none.
    seconds
        From the call to the finished table.
    started, host
        When the run began, in ISO 8601, and on which machine.
    jobs, backend
        Workers.
    parts, bytes
        Files of the table and their size.
    accuracy
        The accuracy requested, and its steps.
    notes
        What the user should know: damaged parts that were computed again, a heading that stays.
    boulder
        What is assumed of the boulders: their ``foot``, and whether the density of the rock is (``rock_assumed``).
    """

    out: Location
    rows: int
    rows_computed: int
    reasons: dict[str, int]
    seconds: float
    started: str
    host: str
    jobs: int
    backend: str
    parts: int
    bytes: int
    accuracy: dict[str, Any]
    notes: Sequence[str]
    boulder: dict[str, Any]

    @property
    def verdicts(self) -> dict[str, int]:
        """Rows of each verdict."""
        verdicts: Counter[str] = Counter()
        for key, number in self.reasons.items():
            verdicts[key.partition("/")[0]] += number
        return dict(sorted(verdicts.items()))

    @property
    def rows_per_second(self) -> float:
        """Rows computed by this run in a second, everything included."""
        return self.rows_computed / self.seconds if self.seconds > 0 else 0.0

    @property
    def errors(self) -> int:
        """Rows that could not be computed."""
        return self.verdicts.get("error", 0)

    @property
    def exit_code(self) -> int:
        """0, or 3 where some rows could not be computed."""
        return EXIT_SOME_ROWS_FAILED if self.errors else EXIT_DONE

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        computed = ("verdicts", "rows_per_second", "errors", "exit_code")
        return {**asdict(self), "out": str(self.out), **{name: getattr(self, name) for name in computed}}
