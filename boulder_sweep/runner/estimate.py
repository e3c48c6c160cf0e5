"""What a run will take: rows by exact arithmetic; time, disk and memory from a timed sample."""

from __future__ import annotations

import resource
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.runner.collector import COMMIT_EVERY_S
from boulder_sweep.store.writer import ROWS_PER_PART

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

LARGEST_BLOCK = 32_768
"""Rows; more would gain nothing and keep memory busy."""
BLOCK_S = 0.1
"""Work of one block [s]: long against handing it out, short against the patience of who presses Ctrl-C."""
MOST_ROWS = 2**63 - 1
"""Rows that a design_id of 64 bits can number."""
_SAMPLE_S = 0.1
_FIRST_SIZES = (1, 8, 64, 64, 64, 64)
"""Rows, here and there in the table, that say about how long one takes."""
_PIECES, _LARGEST_PIECE = 24, 1024
"""Pieces of equal size all over the table that are computed then; many rows of each, for a short one takes more time
and more bytes a row than a table has on the whole."""
_SHARE = 0.05
"""Of a small table, a sample is no more than about this share: its rows are computed again by the run."""
_BYTES_UNDER_WAY = 400
"""Memory of a row between being handed out and being written, inputs, outcomes and encoding together."""
_WORKER_PROCESS_BYTES = 250_000_000
_GOLDEN = 0.618033988749895


class Sample(NamedTuple):
    """What a few rows took."""

    seconds_per_row: float
    """Of one worker."""
    bytes_per_row: float
    bytes_per_part: float
    """What a part takes beside its rows."""


_GUESS = Sample(seconds_per_row=1e-5, bytes_per_row=50.0, bytes_per_part=30_000.0)
"""For a sweep none of whose sampled rows can be computed."""


@dataclass(frozen=True)
class Estimate:
    """What a run will take.

    Parameters
    ----------
    rows
        Rows of the whole table.
    rows_to_compute
        Those that are not there yet.
    seconds
        Time to compute them.
    disk_bytes, disk_free_bytes
        Size of what will be written, and room on that disk; room is None where no output was named.
    memory_bytes, memory_free_bytes
        Most memory in use, and memory available; None where the system does not tell.
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

    def objections(self) -> list[str]:
        """Say what does not fit, with the numbers; empty where all does."""
        found = []
        if self.disk_free_bytes is not None and self.disk_bytes > self.disk_free_bytes:
            found.append(
                f"the table of {self.rows:,} rows needs about {size_text(self.disk_bytes)} of disk, "
                f"and {size_text(self.disk_free_bytes)} are free"
            )
        if self.memory_free_bytes is not None and self.memory_bytes > self.memory_free_bytes:
            found.append(
                f"{self.jobs} workers need about {size_text(self.memory_bytes)} of memory, "
                f"and {size_text(self.memory_free_bytes)} are available"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return asdict(self)


def take_sample(
    evaluation: Evaluation,
    make_block: Callable[[int, int], DesignBlock],
    rows: int,
    metadata: Mapping[bytes, bytes],
) -> Sample:
    """Compute a few rows spread over the table and take the time; the kernels must be warm.

    Parameters
    ----------
    evaluation
        How designs are simulated and judged.
    make_block
        Gives the inputs of some rows.
    rows
        Rows of the whole table.
    metadata
        For the metadata of a part.
    """
    import pyarrow as pa  # heavy, and only runs need it

    from boulder_sweep.store.schema import encode, part_table, table_schema

    beside_rows = len(encode(pa.Table.from_batches([], table_schema(metadata))))

    def computed(place: float, size: int) -> tuple[float, pa.Table | None]:
        """Compute some rows at a place between 0 and 1 of the table; what they took, and what would be written."""
        start = int(place * (rows - size))
        begun = time.perf_counter()
        try:
            block = make_block(start, start + size)
            judged = evaluation(block)
        except Exception:  # the run itself will meet it, try again and name the rows
            return 0.0, None
        return time.perf_counter() - begun, part_table(block, judged, metadata)

    tried = 0.0
    per_row: dict[int, float] = {}
    for number, wanted in enumerate(_FIRST_SIZES):
        size = min(wanted, rows)
        seconds, _ = computed(number * _GOLDEN % 1.0, size)
        tried += seconds
        # Where single rows take long, few are enough; else the largest say it best, for a block takes time itself.
        per_row[size] = max(seconds / size, per_row.get(size, 0.0))
        if tried > _SAMPLE_S:
            break
    by_time = int(_SAMPLE_S / _PIECES / max(per_row[max(per_row)], 1e-9))
    by_share = max(_FIRST_SIZES[-1], int(_SHARE * rows / _PIECES))
    size = max(1, min(by_time, by_share, _LARGEST_PIECE, rows))
    spent, tables = 0.0, []
    for number in range(_PIECES):
        seconds, table = computed((0.5 + number * _GOLDEN) % 1.0, size)
        if table is not None:
            spent += seconds
            tables.append(table)
        if spent > 2 * _SAMPLE_S or len(tables) * size >= rows:
            break
    if not tables:
        return _GUESS
    together = pa.concat_tables(tables).unify_dictionaries().combine_chunks()
    written = max(len(encode(together)) - beside_rows, 0)
    return Sample(spent / len(together), written / len(together), beside_rows)


def estimated(
    sample: Sample,
    *,
    rows: int,
    rows_to_compute: int,
    jobs: int,
    out: Path | None,
    rows_per_part: int = ROWS_PER_PART,
    worker_processes: bool = False,
) -> Estimate:
    """Work out what a run will take from a sample.

    Parameters
    ----------
    sample
        What a few rows took.
    rows, rows_to_compute
        Of the whole table; not there yet.
    jobs
        Workers.
    out
        Output folder, for the room on its disk.
    rows_per_part
        Rows of a part.
    worker_processes
        Whether workers are processes of their own.
    """
    per_block = rows_per_block(sample.seconds_per_row, rows_to_compute, jobs)
    seconds = rows_to_compute * sample.seconds_per_row / jobs
    parts = max(-(-rows_to_compute // rows_per_part), int(seconds / COMMIT_EVERY_S))
    memory = _BYTES_UNDER_WAY * rows_under_way(per_block, jobs, rows_per_part) + peak_memory()
    if worker_processes:
        memory += jobs * _WORKER_PROCESS_BYTES
    return Estimate(
        rows=rows,
        rows_to_compute=rows_to_compute,
        seconds=seconds,
        disk_bytes=int(rows_to_compute * sample.bytes_per_row + parts * sample.bytes_per_part),
        disk_free_bytes=None if out is None else _disk_free(out),
        memory_bytes=memory,
        memory_free_bytes=_memory_free(),
        rows_per_second=jobs / sample.seconds_per_row,
        rows_per_block=per_block,
        jobs=jobs,
    )


def rows_per_block(seconds_per_row: float, rows: int, jobs: int) -> int:
    """Return how many rows to hand out at once: some work each, and enough blocks for every worker."""
    by_time = int(BLOCK_S / max(seconds_per_row, 1e-9))
    by_share = -(-rows // (4 * jobs))
    return max(1, min(by_time, by_share, LARGEST_BLOCK))


def rows_under_way(block: int, jobs: int, rows_per_part: int) -> int:
    """Return how many rows may be under way: two parts being filled, and blocks to keep workers busy."""
    return 2 * rows_per_part + 4 * jobs * block


def blocks(ranges: Iterator[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Cut ranges of rows [start, stop) into blocks of a size or less, lazily."""
    for start, stop in ranges:
        for first in range(start, stop, size):
            yield first, min(first + size, stop)


def size_text(size: float) -> str:
    """Write a number of bytes for people."""
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if size < 1000:
            return f"{size:.0f} bytes" if unit == "bytes" else f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:,.0f} PB"


def _disk_free(out: Path) -> int:
    """Room on the disk where a folder is, or would be made."""
    place = out
    while not place.exists() and place != place.parent:
        place = place.parent
    return shutil.disk_usage(place).free


def peak_memory() -> int:
    """Return the memory that this process has used at most so far [bytes].

    Where Linux tells it of this program alone, that is taken: what `getrusage` gives is never less than the process had
    that started this one, a notebook with large tables for instance.
    """
    try:
        status = Path("/proc/self/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) * 1024
    except (OSError, IndexError):
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else most * 1024


def _memory_free() -> int | None:
    """Memory this process may still take, its own included: the system's, or less if its group is limited."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError):
        return None
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            free = min(free, int(Path(name).read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return free + peak_memory()
