"""What a run needs: rows by exact arithmetic; time and disk from a timed sample."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.runner.workers import COMMIT_EVERY_S
from boulder_sweep.text import size_text

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

_SAMPLES = (1, 16, 128, 1024, 8192)
"""Rows of the samples, each computed if the one before lets expect no more than `_SAMPLE_S`; the last one counts."""
_SAMPLE_S = 0.2
_STRETCHES = 24
"""Positions all over the table from which a sample takes consecutive rows, equally many from each."""
_GOLDEN = 0.618033988749895


class RowCost(NamedTuple):
    """Cost of a few sampled rows: time on one worker, bytes, and bytes of a part without rows."""

    seconds_per_row: float
    bytes_per_row: float
    bytes_per_part: float


_GUESS = RowCost(seconds_per_row=1e-5, bytes_per_row=50.0, bytes_per_part=30_000.0)
"""For a sweep none of whose sampled rows can be computed."""


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
    """Compute a few rows spread over the table and measure the time; the kernels must be warm.

    The largest sample counts: it is computed like a block of the run, so that what a block costs besides its rows, and
    lanes that are not full, weigh as little as they will. The time is the processor's, by `work_clock` [s]: while other
    programs keep it busy, blocks must not become shorter.
    """
    import pyarrow as pa  # heavy, and only runs need it

    from boulder_sweep.store.schema import encode, part_table, table_schema

    seconds_per_row, table = 0.0, None
    for size in (1, *_SAMPLES):  # the first loads what it needs, which takes time of its own
        if size > 1 and (table is None or size * seconds_per_row > _SAMPLE_S or len(table) == sweep.n_designs):
            break
        begun = work_clock()
        try:
            block = sweep.plan.selection(_spread_rows(sweep.n_designs, size))
            table = part_table(block, evaluation(block), metadata)
        except Exception:  # the run itself will retry and name the rows; the sample before counts
            break
        seconds_per_row = (work_clock() - begun) / len(block)
    if table is None:
        return _GUESS
    beside_rows = len(encode(pa.Table.from_batches([], table_schema(metadata))))
    return RowCost(seconds_per_row, max(len(encode(table)) - beside_rows, 0) / len(table), beside_rows)


def _spread_rows(rows: int, count: int) -> np.ndarray:
    """Return numbers of about so many rows, ascending, int64: short stretches from all over a table."""
    if count >= rows:
        return np.arange(rows, dtype=np.int64)
    stretch = -(-count // _STRETCHES)
    positions = (0.5 + _GOLDEN * np.arange(-(-count // stretch))) % 1.0
    starts = (positions * (rows - stretch)).astype(np.int64)
    return np.unique(starts[:, np.newaxis] + np.arange(stretch))


def time_and_disk(cost: RowCost, rows: int, workers: int, rows_per_part: int) -> tuple[float, int]:
    """Return how long so many rows take [s], and how many bytes, from the cost of a sample."""
    seconds = rows * cost.seconds_per_row / workers
    parts = max(-(-rows // rows_per_part), int(seconds / COMMIT_EVERY_S))
    return seconds, int(rows * cost.bytes_per_row + parts * cost.bytes_per_part)


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
    if isinstance(out, RemotePath):
        return None
    while not out.exists() and out != out.parent:
        out = out.parent
    return shutil.disk_usage(out).free
