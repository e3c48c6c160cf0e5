"""What a run needs: rows by exact arithmetic; time, disk and memory from a timed sample."""

from __future__ import annotations

import resource
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
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
_SAMPLE_S = (0.1, 0.5)
"""Time of the largest sample [s]: up to the first, or `_SHARE` of the whole table's time up to the second."""
_SHARE = 0.05
"""Share of a table that is sampled, within the next limits: the run computes these rows again."""
_SAMPLE_ROWS = (1536, 8192)
"""Rows of the largest sample: fewer take more time and more bytes per row than the whole table."""
_STRETCHES = 24
"""Positions all over the table from which a sample takes consecutive rows, equally many from each."""
_GROWTH = 8
"""Each sample has up to so many times the rows of the one before, as far as their time allows."""
_BYTES_IN_PROGRESS = 400
"""Memory per row between being handed out and being written: inputs, outcomes and encoding."""
_LEAST_BYTES, _LEAST_BYTES_OF_CONTACT = 1, 24
"""What a row takes at least, and what it takes besides where the truck meets the boulder: then it holds outcomes, which
hardly compress. Tables of such rows take 37 bytes a row and more."""
_MOST_LOOKED_AT = 1000
"""Rows all over the table whose contact is looked at before anything is compiled."""
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
_ROOM = "Free some space, or choose another folder (-o)"


@dataclass(frozen=True)
class Estimate:
    """What a run needs.

    Parameters
    ----------
    rows
        Rows of the whole table.
    rows_to_compute
        Rows still missing.
    seconds
        Time to compute them.
    disk_bytes, disk_free_bytes
        Size of what will be written, and free space on that disk; None where no output was named.
    memory_bytes, memory_free_bytes
        Peak memory, and memory available; None where the system does not report it.
    rows_per_second
        Of all workers together.
    rows_per_block
        Rows handed to a worker at once.
    jobs
        Workers.
    """

    rows: int
    rows_to_compute: int
    seconds: float
    disk_bytes: int
    disk_free_bytes: int | None
    memory_bytes: int
    memory_free_bytes: int | None
    rows_per_second: float
    rows_per_block: int
    jobs: int

    @property
    def objections(self) -> list[str]:
        """List what does not fit, with numbers; empty if everything fits."""
        objections = []
        if self.disk_free_bytes is not None and self.disk_bytes > self.disk_free_bytes:
            objections.append(
                f"the table of {self.rows:,} rows needs about {size_text(self.disk_bytes)} of disk, "
                f"and {size_text(self.disk_free_bytes)} are free. {_ROOM}"
            )
        if self.memory_free_bytes is not None and self.memory_bytes > self.memory_free_bytes:
            objections.append(
                f"{self.jobs} workers need about {size_text(self.memory_bytes)} of memory, "
                f"and {size_text(self.memory_free_bytes)} are available. Free some memory, or use fewer --jobs"
            )
        return objections

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

    Samples grow from one row to the largest that is affordable, and that one counts: it is computed like a block of
    the run, so that what a block costs besides its rows, and lanes that are not full, weigh as little as they will.
    The time is that of the processor: while other programs keep it busy, blocks must not become shorter.

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

    with suppress(Exception):  # what is computed first also loads what it needs, which takes time of its own
        evaluation(sweep.plan.selection(_spread_rows(sweep.n_designs, 1)))
    seconds_per_row, table, size = 0.0, None, 1
    while size:
        begun = work_clock()
        try:
            block = sweep.plan.selection(_spread_rows(sweep.n_designs, size))
            judged = evaluation(block)
        except Exception:  # the run itself will retry and name the rows; the sample before counts
            break
        seconds_per_row = (work_clock() - begun) / len(block)
        table = part_table(block, judged, metadata)
        size = _larger_sample(size, seconds_per_row, sweep.n_designs)
    if table is None:
        return _GUESS
    beside_rows = len(encode(pa.Table.from_batches([], table_schema(metadata))))
    written = max(len(encode(table)) - beside_rows, 0)
    return RowCost(seconds_per_row, written / len(table), beside_rows)


def _larger_sample(size: int, seconds_per_row: float, rows: int) -> int:
    """Return the rows of the sample after one of some size; 0 where not even twice as many are affordable."""
    (fewest, most), (least, longest) = _SAMPLE_ROWS, _SAMPLE_S
    largest = min(rows, max(fewest, min(int(_SHARE * rows), most)))
    affordable = max(least, min(_SHARE * rows * seconds_per_row, longest)) / max(seconds_per_row, 1e-9)
    larger = int(min(_GROWTH * size, affordable, largest))
    return larger if larger >= min(2 * size, largest) and larger > size else 0


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
    """
    per_block = rows_per_block(sample.seconds_per_row, rows_to_compute, jobs)
    rows_per_second = min(jobs, cores or jobs) / sample.seconds_per_row
    seconds = rows_to_compute / rows_per_second
    parts = max(-(-rows_to_compute // rows_per_part), int(seconds / COMMIT_EVERY_S))
    memory = _BYTES_IN_PROGRESS * rows_in_progress(per_block, jobs, rows_per_part) + peak_memory()
    return Estimate(
        rows=rows,
        rows_to_compute=rows_to_compute,
        seconds=seconds,
        disk_bytes=int(rows_to_compute * sample.bytes_per_row + parts * sample.bytes_per_part),
        disk_free_bytes=None if out is None else _disk_free(out),
        memory_bytes=memory,
        memory_free_bytes=_memory_free(),
        rows_per_second=rows_per_second,
        rows_per_block=per_block,
        jobs=jobs,
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
    """Refuse, without compiling or computing anything, a table that cannot fit on the disk.

    Raises
    ------
    DoesNotFitError
        Says how much is needed at least, and how much is free.
    """
    rows, free = sweep.n_designs, _disk_free(out)
    if free is None:
        return
    least = rows_to_compute * _LEAST_BYTES
    if least <= free < rows_to_compute * (_LEAST_BYTES + _LEAST_BYTES_OF_CONTACT):
        least += int(rows_to_compute * _share_in_contact(sweep) * _LEAST_BYTES_OF_CONTACT)
    if least > free:
        raise DoesNotFitError(
            f"the table of {rows:,} rows needs at least {size_text(least)} of disk, and {size_text(free)} are free. "
            f"{_ROOM}"
        )


def _share_in_contact(sweep: Sweep) -> float:
    """Share of some rows all over a table in which the truck meets the boulder."""
    count = min(sweep.n_designs, _MOST_LOOKED_AT)
    met = 0
    for k in range(count):
        row = k * sweep.n_designs // count
        columns = sweep.block(row, row + 1).columns
        height, depth, bumper = (
            columns[name].to_numpy()[0] for name in ("boulder_height_m", "embedment_depth_m", "bumper_height_m")
        )
        met += bool(height - depth > bumper)
    return met / count


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


def peak_memory() -> int:
    """Return the peak memory of this process so far [bytes].

    Linux reports it in ``/proc``; the value of `getrusage` includes the process that started this one, such as a
    notebook with large tables.
    """
    peak = _process_memory("VmHWM")
    if peak is None:
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else most * 1024
    return peak


def _process_memory(which: str) -> int | None:
    """Return an entry of Linux on the memory of this process [bytes]; None on other systems."""
    try:
        return int(Path("/proc/self/status").read_text().split(f"{which}:")[1].split()[0]) * 1024
    except (OSError, IndexError):
        return None


def _memory_free() -> int | None:
    """Memory available to this process, its own included: the system's, or less if its control group is limited."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError):
        return None
    free += _process_memory("VmRSS") or 0
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            free = min(free, int(Path(name).read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return free
