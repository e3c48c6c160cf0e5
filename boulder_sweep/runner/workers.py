"""What workers do with rows: simulate and judge them, retry failures, encode parts; and workers that are threads.

A block that raises is tried again, then halved until the rows that raise are alone; those become rows of
verdict ``error``. Where thousands of tries fail, nothing more is computed.

Threads of this process share the kernels, the tables and the assembly of parts. Blocks that finish in any order become
parts in the order of the designs; how far threads run ahead is limited. Workers of a cluster: see `remote`.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np

from boulder_sweep.errors import ComputationError
from boulder_sweep.judge.judged import Judged, joined, not_computed
from boulder_sweep.runner.pool import Call, call, telling_start_failure
from boulder_sweep.store.writer import EncodedPart, OutputFolder, StagedPart
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

MakeBlock = Callable[[int, int], "DesignBlock"]
Evaluate = Callable[["DesignBlock"], Judged]
Item = TypeVar("Item")
COMMIT_EVERY_S = 5.0
"""How often a part is written before it is complete, so that a slow run shows progress and loses little [s]."""
LARGEST_BLOCK = 32_768
"""Rows; larger blocks gain nothing and use more memory."""
BLOCK_S = 0.2
"""Work of one block [s]: so long that its few rows that need finer steps fill lanes, and short enough for Ctrl-C to act
at once."""
TASK_S = 2.0
"""Work of one task of a cluster [s]: long compared with scheduling it, short enough to lose little with a worker."""
_TRIES = 2
_FAILURES_BUDGET = 5_000
"""Failed tries after which a run stops: something is then wrong with more than single designs."""


def rows_per_block(seconds_per_row: float, rows: int, jobs: int) -> int:
    """Return the rows per block: enough work each, and enough blocks for every worker."""
    by_time = int(BLOCK_S / max(seconds_per_row, 1e-9))
    by_share = -(-rows // (4 * jobs))
    return max(1, min(by_time, by_share, LARGEST_BLOCK))


def rows_per_task(seconds_per_row: float, rows: int, jobs: int, rows_per_part: int) -> int:
    """Return the rows of a task of a cluster: some whole parts, or less than a part where rows take long."""
    by_time = int(TASK_S / max(seconds_per_row, 1e-9))
    by_share = -(-rows // (4 * jobs))
    rows = max(1, min(by_time, by_share))
    return rows - rows % rows_per_part if rows > rows_per_part else rows


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
    """

    def __init__(
        self,
        evaluate: Evaluate,
        make_block: MakeBlock,
        metadata: Mapping[bytes, bytes],
        warm_up: Callable[[], None] = lambda: None,
    ):
        self._evaluate = evaluate
        self._make_block = make_block
        self._metadata = dict(metadata)
        self._warm_up = warm_up
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
        from boulder_sweep.store.schema import encode, part_table, verdict_counts  # imports pyarrow

        judged = joined(list(pieces))
        rows = len(judged.verdict)
        table = part_table(self._make_block(first, first + rows), judged, {**self._metadata, **cpu_metadata()})
        return EncodedPart(first, rows, encode(table), verdict_counts(judged))


def failed_rows(count: int, reason: str) -> Judged:
    """Return rows of verdict ``error`` that all have the same reason."""
    return not_computed((reason,), np.zeros(count, dtype=np.int32))


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


class Workers(threading.Thread):
    """Compute rows and put messages into a queue, at last `Ended`. These have nothing to compute.

    Attributes
    ----------
    messages
        What the run must know.
    """

    def __init__(self) -> None:
        super().__init__(name="workers", daemon=True)
        self.messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._stopped = threading.Event()

    def stop(self) -> None:
        """Hand out nothing more; what is in progress is dropped."""
        self._stopped.set()

    def release(self, rows: int) -> None:
        """Count rows as staged, and no longer in the memory of this process."""

    def flush(self) -> list[StagedPart]:
        """Stage what is ready in order, though its part is not complete."""
        return []

    def run(self) -> None:
        """Compute everything; called by `start`."""
        problem: BaseException | None = None
        try:
            self._compute_all()
        except BaseException as raised:
            problem = raised
        self.messages.put(Ended(None if self._stopped.is_set() else problem))

    def _compute_all(self) -> None:
        """Compute everything, or until `stop`."""


class InOrder(Generic[Item]):
    """Gives what covers rows in the order of the table, in whatever order it comes.

    Parameters
    ----------
    ranges
        Ranges of missing rows [start, stop), in order.
    """

    def __init__(self, ranges: Iterator[tuple[int, int]]):
        self._ranges = ranges
        self._waiting: dict[int, tuple[int, Item]] = {}
        self._early: dict[int, int] = {}
        """First row, and the row after the last, of what was given before that in front of it."""
        self._next, self._end = next(ranges, (-1, -1))

    def __len__(self) -> int:
        """Return how much waits."""
        return len(self._waiting)

    def put(self, start: int, stop: int, item: Item) -> None:
        """Add what covers the rows [start, stop)."""
        self._waiting[start] = stop, item

    @property
    def is_next_there(self) -> bool:
        """Whether what continues the table has come."""
        return self._next in self._waiting

    @property
    def is_range_done(self) -> bool:
        """Whether what was given last ends a range."""
        return self._next == self._end

    def take(self) -> Iterator[Item]:
        """Give what continues the table."""
        while self._next in self._waiting or self._next in self._early:
            if self._next in self._early:
                self._next = self._early.pop(self._next)
            else:
                self._next, item = self._waiting.pop(self._next)
                yield item
            if self.is_range_done:
                self._next, self._end = next(self._ranges, (-1, -1))

    def take_early(self) -> list[Item]:
        """Give what waits, by its rows, though something in front of it has not come."""
        early = [(start, *self._waiting[start]) for start in sorted(self._waiting)]
        self._waiting.clear()
        self._early |= {start: stop for start, stop, _ in early}
        return [item for _, _, item in early]


class Admission:
    """Counts rows between being handed out and being staged on disk.

    Parameters
    ----------
    limit
        Most rows in progress; must exceed a full part, which is written only when complete.
    """

    def __init__(self, limit: int):
        self.limit = limit
        self._in_progress = 0
        self._changed = threading.Condition()

    def admit(self, rows: int) -> bool:
        """Hand out rows if the limit allows; never waits."""
        with self._changed:
            if self._in_progress and self._in_progress + rows > self.limit:
                return False
            self._in_progress += rows
            return True

    def release(self, rows: int) -> None:
        """Count rows as staged."""
        with self._changed:
            self._in_progress -= rows
            self._changed.notify_all()

    def wait(self, seconds: float) -> None:
        """Wait until rows are released, at most this long."""
        with self._changed:
            self._changed.wait(seconds)


class ReadyPart(NamedTuple):
    """Consecutive rows, ready to be encoded."""

    first: int
    pieces: list[Judged]


class Assembly:
    """Collects judged blocks from many threads; whoever completes a part gets it and writes it.

    Parameters
    ----------
    ranges
        Ranges of missing rows [start, stop), none across two parts.
    commit_every_s
        See `COMMIT_EVERY_S`.
    clock
        Gives the time [s].
    """

    def __init__(
        self,
        ranges: Iterator[tuple[int, int]],
        commit_every_s: float = COMMIT_EVERY_S,
        clock: Callable[[], float] = time.monotonic,
    ):
        self._order: InOrder[tuple[int, Judged]] = InOrder(ranges)
        self._clock = clock
        self._commit_every_s = commit_every_s
        self._lock = threading.Lock()
        self._pieces: list[tuple[int, Judged]] = []
        """First row and outcomes of the blocks of the next part."""
        self._issued_at = clock()

    def add(self, start: int, judged: Judged) -> list[ReadyPart]:
        """Add judged rows from `start` on; return the parts that are due to be written."""
        with self._lock:
            self._order.put(start, start + len(judged.verdict), (start, judged))
            ready = []
            for piece in self._order.take():
                self._pieces.append(piece)
                if self._order.is_range_done:
                    ready += self._issue()
            if self._clock() - self._issued_at > self._commit_every_s:
                ready += self._issue()
            return ready

    def flush(self) -> list[ReadyPart]:
        """Return what is ready in order, though its part is not complete."""
        with self._lock:
            return self._issue()

    def _issue(self) -> list[ReadyPart]:
        """Take the rows that are ready."""
        if not self._pieces:
            return []
        part = ReadyPart(self._pieces[0][0], [judged for _, judged in self._pieces])
        self._issued_at = self._clock()
        self._pieces = []
        return [part]


class ThreadWorkers(Workers):
    """Computes ranges of rows in threads of joblib and puts messages into a queue, at last `Ended`.

    The thread that completes a part also encodes and stages it.

    Parameters
    ----------
    jobs
        Number of threads.
    computation
        What to do with rows.
    blocks
        Ranges of rows [start, stop), consumed one by one as threads become free.
    most_rows
        Limit of the rows in progress, see `Admission`.
    folder
        Where parts are staged.
    commit_every_s
        See `COMMIT_EVERY_S`.
    """

    def __init__(
        self,
        jobs: int,
        computation: Computation,
        blocks: Iterator[tuple[int, int]],
        most_rows: int,
        folder: OutputFolder,
        commit_every_s: float = COMMIT_EVERY_S,
    ):
        super().__init__()
        self._jobs = jobs
        self._computation = computation
        self._blocks = blocks
        self._next: tuple[int, int] | None = None
        self._admission = Admission(most_rows)
        self._assembly = Assembly(folder.manifest.missing(), commit_every_s)
        self._folder = folder
        self._in_progress = 0
        self._changed = threading.Condition()

    def join(self, timeout: float | None = None) -> None:
        """Wait until everything has ended, blocks in progress included, but not longer than twice the timeout [s].

        joblib does not wait for its threads when one of them has raised.
        """
        super().join(timeout)
        with self._changed:
            self._changed.wait_for(lambda: self._in_progress == 0, timeout)

    def release(self, rows: int) -> None:
        """Count rows as staged, and no longer in the memory of this process."""
        self._admission.release(rows)

    def flush(self) -> list[StagedPart]:
        """Stage what is ready in order, though its part is not complete."""
        return [self._staged(ready) for ready in self._assembly.flush()]

    def _compute_all(self) -> None:
        with telling_start_failure(self._jobs), self._pool() as parallel:
            while not self._stopped.is_set() and self._peek() is not None:
                for rows in parallel(self._calls()):
                    self.messages.put(Computed(rows))
                self._admission.wait(0.05)

    def _pool(self) -> AbstractContextManager[Callable[[Iterator[Call]], Iterator[int]]]:
        """Return what makes calls, side by side if there are several threads."""
        if self._jobs == 1:
            return nullcontext(lambda calls: (function(*given, **named) for function, given, named in calls))
        import joblib  # a tenth of the time of a run of one design

        pool = {"return_as": "generator_unordered", "batch_size": 1, "pre_dispatch": 2 * self._jobs}
        parallel: AbstractContextManager[Any] = joblib.Parallel(n_jobs=self._jobs, backend="threading", **pool)
        return parallel

    def _peek(self) -> tuple[int, int] | None:
        """Look at the next block."""
        if self._next is None:
            self._next = next(self._blocks, None)
        return self._next

    def _calls(self) -> Iterator[Call]:
        """Yield calls until no more may be handed out; runs in the threads of the pool, one at a time."""
        while not self._stopped.is_set():
            block = self._peek()
            if block is None or not self._admission.admit(block[1] - block[0]):
                return
            self._next = None
            yield call(self._compute, *block)

    def _compute(self, start: int, stop: int) -> int:
        """Compute a block, and write the parts it completes; return the number of rows."""
        with self._changed:
            self._in_progress += 1
        try:
            return self._computed(start, stop)
        finally:
            with self._changed:
                self._in_progress -= 1
                self._changed.notify_all()

    def _computed(self, start: int, stop: int) -> int:
        if self._stopped.is_set():
            return 0
        judged = self._computation.judged(start, stop)
        if self._stopped.is_set():
            return 0
        for ready in self._assembly.add(start, judged):
            self.messages.put(self._staged(ready))
        return stop - start

    def _staged(self, ready: ReadyPart) -> StagedPart:
        """Encode and stage a part."""
        return self._folder.stage(self._computation.encoded(ready.first, ready.pieces))
