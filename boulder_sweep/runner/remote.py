"""A run on a cluster: each worker computes, encodes and stages its own parts; the scheduler sees short messages.

`compute` is what a worker does with some rows; `ClusterWorkers` hands out rows and passes on what comes of them.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from boulder_sweep.errors import BackendError, BoulderSweepError
from boulder_sweep.locations import location_of
from boulder_sweep.runner.cluster import Cluster, Fingerprint, fingerprint, other_versions_text
from boulder_sweep.runner.dispatch import Dispatcher, Task
from boulder_sweep.runner.workers import Computation, Computed, Note, Workers, blocks, failed_rows
from boulder_sweep.store.files import LOCK_NAME
from boulder_sweep.store.manifest import parts_of
from boulder_sweep.store.storage import storage_of
from boulder_sweep.store.writer import EncodedPart, OutputFolder, StagedPart, stage
from boulder_sweep.text import one_line

_TRIES = 3
_prepared: set[str] = set()
_preparing = threading.Lock()
"""Which runs this process, a worker, is ready for."""


@dataclass(frozen=True)
class Work:
    """What every task of a run has in common; sent to the cluster once."""

    name: str
    """The token of the run, see `OutputFolder`."""
    computation: Computation
    rows_per_block: int
    rows_per_part: int
    folder: str
    table_rows: int
    fingerprint: Fingerprint


class Done(NamedTuple):
    """What a worker returns."""

    staged: list[StagedPart]
    relayed: list[EncodedPart]


def compute(work: Work, start: int, stop: int, relayed: bool) -> Done:
    """Compute, encode and stage some rows on a worker, part by part."""
    prepare(work)
    folder = location_of(work.folder)
    done = Done([], [])
    if not relayed and not (folder / LOCK_NAME).exists():
        return done
    storage = storage_of(folder)
    for begin, end in parts_of(start, stop, work.rows_per_part):
        pieces = [work.computation.judged(*rows) for rows in blocks(iter([(begin, end)]), work.rows_per_block)]
        part = work.computation.encoded(begin, pieces)
        if relayed:
            done.relayed.append(part._replace(content=bytes(part.content)))
        elif not (folder / LOCK_NAME).exists():  # this worker hung, and the run has ended without it
            break
        else:
            done.staged.append(stage(storage, work.name, work.table_rows, part))
    return done


def prepare(work: Work) -> None:
    """Compare versions and load or compile the kernels, once in the process of a worker.

    Raises
    ------
    BackendError
        Rows computed here could differ from those of the others.
    """
    with _preparing:
        if work.name not in _prepared:
            if fingerprint() != work.fingerprint:
                raise BackendError(other_versions_text("a worker"))
            work.computation.warm_up()
            _prepared.add(work.name)


@dataclass(frozen=True)
class _RowRange:
    """Rows [start, stop) to be computed, and how often that has failed."""

    start: int
    stop: int
    tries: int = 0
    alone: bool = False
    """Whether no other task is in flight with it, so that it is the one that ends its worker."""
    relayed: bool = False
    """Whether the bytes come back through the scheduler, because the worker cannot write into the folder."""


class ClusterWorkers(Workers):
    """Computes ranges of rows on a cluster and puts messages into a queue, at last `Ended`.

    Parameters
    ----------
    cluster
        Where to compute.
    computation
        What to do with rows.
    tasks
        Ranges of rows [start, stop).
    rows_per_block
        Rows that a worker computes at once.
    folder
        Where parts are staged, by the workers if they share it.
    clock
        Gives the time [s].
    """

    def __init__(
        self,
        cluster: Cluster,
        computation: Computation,
        tasks: Iterator[tuple[int, int]],
        rows_per_block: int,
        folder: OutputFolder,
        clock: Callable[[], float] = time.monotonic,
    ):
        super().__init__()
        self._computation = computation
        self._ranges = (_RowRange(*rows) for rows in tasks)
        self._folder = folder
        manifest = folder.manifest
        work = Work(
            folder.token,
            computation,
            rows_per_block,
            manifest.rows_per_part,
            str(folder.path.resolve()),
            manifest.rows,
            fingerprint(),
        )
        self._dispatcher: Dispatcher[_RowRange] = Dispatcher(cluster, work, self._note, clock)
        self._again: deque[_RowRange] = deque()
        self._suspects: deque[_RowRange] = deque()
        """Rows whose workers died; computed one task after the other."""

    def stop(self) -> None:
        """Hand out no more tasks; those in progress are dropped."""
        super().stop()
        self._dispatcher.stop()

    def _compute_all(self) -> None:
        for rows, done, failure in self._dispatcher.outcomes(self._next_task):
            if failure is None:
                self._accept(rows, done)
            else:
                self._retry(rows, failure)

    def _note(self, text: str) -> None:
        """Tell the user something."""
        self.messages.put(Note(text))

    def _next_task(self) -> Task[_RowRange] | None:
        """Return rows to be computed next; suspects wait until nothing else is under way, and others for them."""
        under_way = self._dispatcher.under_way
        if self._suspects:
            rows = None if under_way else self._suspects.popleft()
        elif any(others.alone for others in under_way):
            rows = None
        else:
            rows = self._again.popleft() if self._again else next(self._ranges, None)
        return None if rows is None else Task(rows, compute, (rows.start, rows.stop, rows.relayed))

    def _accept(self, rows: _RowRange, done: Done) -> None:
        """Pass on the parts that a worker has written, or write those that it sent."""
        for part in done.relayed:
            done.staged.append(self._folder.stage(part))
        here = [staged for staged in done.staged if self._folder.is_staged(staged)]
        for staged in here:
            self.messages.put(Computed(staged.part.rows))
            self.messages.put(staged)
        expected = list(parts_of(rows.start, rows.stop, self._folder.manifest.rows_per_part))
        if len(here) < len(expected):
            if not rows.relayed:
                self._note("a worker does not share the output folder: its rows go through the scheduler")
            there = {staged.part.first for staged in here}
            self._again += [
                _RowRange(start, stop, rows.tries + 1, relayed=True) for start, stop in expected if start not in there
            ]

    def _retry(self, rows: _RowRange, problem: BaseException) -> None:
        """Submit a failed task again; halve one that ends its workers, until the row that does so is alone."""
        if isinstance(problem, OSError) and problem.errno is not None:
            raise self._folder.write_error(problem) from problem
        if type(problem).__name__ != "KilledWorker":
            if isinstance(problem, BoulderSweepError):
                raise problem
            if rows.tries + 1 >= _TRIES:
                raise BackendError(f"the workers cannot compute this sweep: {one_line(problem)}") from problem
            self._again.append(replace(rows, tries=rows.tries + 1))
        elif not rows.alone:
            self._suspects.append(replace(rows, alone=True))
        elif rows.stop - rows.start > 1:
            middle = (rows.start + rows.stop) // 2
            self._suspects += [replace(rows, stop=middle), replace(rows, start=middle)]
        else:
            reason = "every worker that computed this design died"
            part = self._computation.encoded(rows.start, [failed_rows(1, reason)])
            self._accept(rows, Done([], [part]))
