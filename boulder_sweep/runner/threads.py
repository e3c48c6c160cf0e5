"""Workers that are threads of this process: they share the kernels, the tables and the assembly of parts."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from boulder_sweep.runner.assembly import Admission, Assembly, ReadyPart
from boulder_sweep.runner.backends import start_failure
from boulder_sweep.runner.computing import Computation, Computed, Ended, Message
from boulder_sweep.runner.pool import Call, call
from boulder_sweep.store.writer import OutputFolder, StagedPart


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
    admission
        Limits the rows in progress.
    assembly
        Makes parts of blocks.
    folder
        Where parts are staged.
    """

    def __init__(
        self,
        jobs: int,
        computation: Computation,
        blocks: Iterator[tuple[int, int]],
        admission: Admission,
        assembly: Assembly,
        folder: OutputFolder,
    ):
        super().__init__(name="workers", daemon=True)
        self.messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._jobs = jobs
        self._computation = computation
        self._blocks = blocks
        self._next: tuple[int, int] | None = None
        self._admission = admission
        self._assembly = assembly
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
        part = self._computation.encoded(ready.first, ready.pieces)
        return self._folder.stage(part.first, part.content, part.rows, part.verdicts)
