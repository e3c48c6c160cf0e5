"""Workers that are threads of this process: they share the kernels, the tables and the assembly of parts.

Blocks that finish in any order become parts in the order of the designs; how far threads run ahead is limited.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple

from boulder_sweep.judge.judged import Judged
from boulder_sweep.runner.computing import Computation, Computed, Ended, Message
from boulder_sweep.runner.pool import Call, call, start_failure
from boulder_sweep.store.writer import OutputFolder, StagedPart


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


COMMIT_EVERY_S = 5.0
"""How often a part is written before it is complete, so that a slow run shows progress and loses little [s]."""


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
        self._ranges = ranges
        self._clock = clock
        self._commit_every_s = commit_every_s
        self._lock = threading.Lock()
        self._waiting: dict[int, Judged] = {}
        self._pieces: list[Judged] = []
        self._issued_at = clock()
        self._from_row = self._to_row = self._last_row = -1
        self._open_next()

    def add(self, start: int, judged: Judged) -> list[ReadyPart]:
        """Add judged rows from `start` on; return the parts that are due to be written."""
        with self._lock:
            self._waiting[start] = judged
            ready = []
            while (piece := self._waiting.pop(self._to_row, None)) is not None:
                self._pieces.append(piece)
                self._to_row += len(piece.verdict)
                if self._to_row == self._last_row:
                    ready += self._issue()
                    self._open_next()
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
        part = ReadyPart(self._from_row, self._pieces)
        self._issued_at = self._clock()
        self._pieces = []
        self._from_row = self._to_row
        return [part]

    def _open_next(self) -> None:
        """Continue with the next range of missing rows."""
        self._from_row, self._last_row = next(self._ranges, (-1, -1))
        self._to_row = self._from_row


class ThreadWorkers(threading.Thread):
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
        super().__init__(name="workers", daemon=True)
        self.messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._jobs = jobs
        self._computation = computation
        self._blocks = blocks
        self._next: tuple[int, int] | None = None
        self._admission = Admission(most_rows)
        self._assembly = Assembly(folder.manifest.missing(), commit_every_s)
        self._folder = folder
        self._stopped = threading.Event()
        self._in_progress = 0
        self._changed = threading.Condition()

    def join(self, timeout: float | None = None) -> None:
        """Wait until everything has ended, blocks in progress included, but not longer than twice the timeout [s].

        joblib does not wait for its threads when one of them has raised.
        """
        super().join(timeout)
        with self._changed:
            self._changed.wait_for(lambda: self._in_progress == 0, timeout)

    def stop(self) -> None:
        """Hand out no more blocks; those in progress are dropped."""
        self._stopped.set()

    def release(self, rows: int) -> None:
        """Count rows as staged, and no longer in memory."""
        self._admission.release(rows)

    def flush(self) -> list[StagedPart]:
        """Stage what is ready in order, though its part is not complete."""
        return [self._staged(ready) for ready in self._assembly.flush()]

    def run(self) -> None:
        """Compute everything; called by `start`."""
        problem: BaseException | None = None
        try:
            with self._pool() as parallel:
                while not self._stopped.is_set() and self._peek() is not None:
                    for rows in parallel(self._calls()):
                        self.messages.put(Computed(rows))
                    self._admission.wait(0.05)
        except BaseException as raised:
            if not self._stopped.is_set():
                problem = start_failure(raised, self._jobs) or raised
        self.messages.put(Ended(problem))

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
