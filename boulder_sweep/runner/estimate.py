"""What a run needs: rows by exact arithmetic; time and disk from a timed sample."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.runner.workers import COMMIT_EVERY_S
from boulder_sweep.store.failures import DoesNotFitError
from boulder_sweep.store.writer import ROWS_PER_PART
from boulder_sweep.text import size_text

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

LARGEST_BLOCK = 32_768
"""Rows; larger blocks gain nothing and use more memory."""
BLOCK_S = 0.2
"""Work of one block [s]: so long that its few rows that need finer steps fill lanes, and short enough for Ctrl-C to act
at once."""
TASK_S = 2.0
"""Work of one task of a cluster [s]: long compared with scheduling it, short enough to lose little with a worker."""
_SAMPLES = (1, 16, 128, 1024, 8192)
"""Rows of the samples, each computed if the one before lets expect no more than `_SAMPLE_S`; the last one counts."""
_SAMPLE_S = 0.2
_STRETCHES = 24
"""Positions all over the table from which a sample takes consecutive rows, equally many from each."""
_GOLDEN = 0.618033988749895


class RowCost(NamedTuple):
    """Cost of a few sampled rows."""

    seconds_per_row: float
    """On one worker."""
    bytes_per_row: float
    bytes_per_part: float
    """Size of a part without rows."""


_GUESS = RowCost(seconds_per_row=1e-5, bytes_per_row=50.0, bytes_per_part=30_000.0)
"""For a sweep none of whose sampled rows can be computed."""


@dataclass(frozen=True)
class Estimate:
    """What a run needs.

    Parameters
    ----------
    rows, rows_to_compute
        Rows of the whole table, and those still missing.
    seconds
        Time to compute them.
    disk_bytes, disk_free_bytes
        Size of what will be written, and free space on that disk; None where no folder on a disk was named.
    rows_per_second
        Of all workers together.
    rows_per_block
        Rows handed to a worker at once.
    jobs
        Workers.
    damaged
        What is wrong with parts that would be computed again, by file name.
    """

    rows: int
    rows_to_compute: int
    seconds: float
    disk_bytes: int
    disk_free_bytes: int | None
    rows_per_second: float
    rows_per_block: int
    jobs: int
    damaged: dict[str, str] = field(default_factory=dict)

    @property
    def objections(self) -> list[str]:
        """List what does not fit, with numbers; empty if everything fits."""
        if self.disk_free_bytes is None or self.disk_bytes <= self.disk_free_bytes:
            return []
        return [_too_large(self.rows, "about", self.disk_bytes, self.disk_free_bytes)]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return asdict(self)


def take_sample(
    evaluation: Evaluation,
    sweep: Sweep,
    metadata: Mapping[bytes, bytes],
    work_clock: Callable[[], float] = time.thread_time,
) -> RowCost:
    """Compute a few rows spread over the table and measure the time; the kernels must be warm.

    The largest sample counts: it is computed like a block of the run, so that what a block costs besides its rows, and
    lanes that are not full, weigh as little as they will. The time is the processor's: while other programs keep it
    busy, blocks must not become shorter.

    Parameters
    ----------
    evaluation
        How designs are simulated and judged.
    sweep
        The designs.
    metadata
        For the metadata of a part.
    work_clock
        Gives the processor time of the calling thread [s].
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


def estimated(
    sample: RowCost,
    *,
    rows: int,
    rows_to_compute: int,
    jobs: int,
    out: Location | None,
    rows_per_part: int = ROWS_PER_PART,
    cores: int | None = None,
    damaged: dict[str, str] | None = None,
) -> Estimate:
    """Estimate what a run needs from a sample.

    Parameters
    ----------
    sample
        Cost of a few sampled rows.
    rows, rows_to_compute
        Rows of the whole table; rows still missing.
    jobs
        Workers.
    out
        Output folder, for the free space on its disk.
    rows_per_part
        Rows of a part.
    cores
        Cores that the workers share; None where each has its own.
    damaged
        As of `Estimate`.
    """
    per_block = rows_per_block(sample.seconds_per_row, rows_to_compute, jobs)
    rows_per_second = min(jobs, cores or jobs) / sample.seconds_per_row
    seconds = rows_to_compute / rows_per_second
    parts = max(-(-rows_to_compute // rows_per_part), int(seconds / COMMIT_EVERY_S))
    return Estimate(
        rows=rows,
        rows_to_compute=rows_to_compute,
        seconds=seconds,
        disk_bytes=int(rows_to_compute * sample.bytes_per_row + parts * sample.bytes_per_part),
        disk_free_bytes=None if out is None else _disk_free(out),
        rows_per_second=rows_per_second,
        rows_per_block=per_block,
        jobs=jobs,
        damaged=damaged or {},
    )


def rows_per_block(seconds_per_row: float, rows: int, jobs: int) -> int:
    """Return the rows per block: enough work each, and enough blocks for every worker."""
    by_time = int(BLOCK_S / max(seconds_per_row, 1e-9))
    by_share = -(-rows // (4 * jobs))
    return max(1, min(by_time, by_share, LARGEST_BLOCK))


def rows_per_task(estimate: Estimate, rows_per_part: int) -> int:
    """Return the rows of a task of a cluster: some whole parts, or less than a part where rows take long."""
    by_time = int(TASK_S * estimate.rows_per_second / estimate.jobs)
    by_share = -(-estimate.rows_to_compute // (4 * estimate.jobs))
    rows = max(1, min(by_time, by_share))
    return rows - rows % rows_per_part if rows > rows_per_part else rows


def refuse_hopeless(sweep: Sweep, rows_to_compute: int, out: Location) -> None:
    """Refuse, without compiling or computing anything, a table that cannot fit on the disk: a row takes a byte or more.

    Raises
    ------
    DoesNotFitError
        Says how much is needed at least, and how much is free.
    """
    free = _disk_free(out)
    if free is not None and rows_to_compute > free:
        raise DoesNotFitError(_too_large(sweep.n_designs, "at least", rows_to_compute, free))


def _too_large(rows: int, about: str, needed: int, free: int) -> str:
    return (
        f"the table of {rows:,} rows needs {about} {size_text(needed)} of disk, and {size_text(free)} are free. "
        f"Free some space, or choose another folder (-o)"
    )


def rows_in_progress(block: int, jobs: int, rows_per_part: int) -> int:
    """Return the limit of rows in progress: two parts being filled, and blocks to keep workers busy."""
    return 2 * rows_per_part + 4 * jobs * block


def blocks(ranges: Iterator[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Cut ranges of rows [start, stop) into blocks of a size or less, lazily."""
    for start, stop in ranges:
        for first in range(start, stop, size):
            yield first, min(first + size, stop)


def tasks(ranges: Iterator[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Join neighbouring ranges of rows [start, stop) up to a size, and cut those that are longer, lazily."""
    first = last = -1
    for start, stop in blocks(ranges, size):
        if start != last or stop - first > size:
            if last > first:
                yield first, last
            first = start
        last = stop
    if last > first:
        yield first, last


def _disk_free(out: Location) -> int | None:
    """Free space on the disk where a folder is, or would be created; None for an object store."""
    if isinstance(out, RemotePath):
        return None
    folder = out
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return shutil.disk_usage(folder).free
