"""Records staged parts in the manifest, if possible in the order of the designs, while others are computed."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from boulder_sweep.store.errors import DamagedError
from boulder_sweep.store.writer import OutputFolder, StagedPart

if TYPE_CHECKING:
    from boulder_sweep.runner.computing import Computation

COMMIT_SHARE = 0.02
"""Share of one processor that writing manifests may take."""
GAP_S = 30.0
"""How long parts wait for the one before them, which may never come, before they are committed without it [s]."""


class Committer(threading.Thread):
    """Commits staged parts; merges small ones at the end.

    Parameters
    ----------
    folder
        Open for writing.
    computation
        Encodes merged parts.
    release
        Called with the number of rows that are staged, and so no longer in memory.
    flush
        Stages the rows that are ready when the run is stopped.
    clock, work_clock
        Give the time, and the processor time of the calling thread [s].
    """

    def __init__(
        self,
        folder: OutputFolder,
        computation: Computation,
        release: Callable[[int], object] = lambda rows: None,
        flush: Callable[[], Iterable[StagedPart]] = tuple,
        clock: Callable[[], float] = time.monotonic,
        work_clock: Callable[[], float] = time.thread_time,
    ):
        super().__init__(name="committer", daemon=True)
        self.problem: BaseException | None = None
        self._folder = folder
        self._computation = computation
        self._release = release
        self._flush = flush
        self._clock = clock
        self._work_clock = work_clock
        self._arrived: queue.SimpleQueue[StagedPart | None] = queue.SimpleQueue()
        self._waiting: dict[int, StagedPart] = {}
        self._early: dict[int, int] = {}
        """First row, and the row after the last, of parts committed before those in front of them."""
        self._gap_until = math.inf
        self._missing = folder.manifest.missing()
        self._next = self._end = -1
        self._open_next()
        self._stopped = threading.Event()
        self._rest_until = -math.inf

    def put(self, staged: StagedPart) -> None:
        """Hand over a staged part; never waits."""
        self._arrived.put(staged)

    def finish(self) -> None:
        """Commit everything that was handed over, merge small parts, and end."""
        self._arrived.put(None)

    def stop(self) -> None:
        """Commit what is there, and end."""
        self._stopped.set()
        self._arrived.put(None)

    def run(self) -> None:
        """Commit parts; called by `start`."""
        try:
            while (item := self._next_item()) is not None:
                self._waiting[item.part.first] = item
                self._release(item.part.rows)
            if self._stopped.is_set():
                self._waiting |= {item.part.first: item for item in self._flush()}
            self._commit(self._stopped.is_set())
            self._merge()
        except BaseException as problem:
            self.problem = problem

    def _next_item(self) -> StagedPart | None:
        """Wait for a staged part, None for the end; commit meanwhile what has arrived when it is time to.

        The manifest is written as a whole, and grows with the table. So after each commit there is a rest, long
        enough for the commits to take no more than `COMMIT_SHARE` of a processor; what arrives meanwhile shares the
        next manifest.
        """
        while True:
            due = self._rest_until - self._clock()
            if self._next in self._waiting:
                self._gap_until = math.inf
            elif self._waiting:
                self._gap_until = min(self._gap_until, self._clock() + GAP_S)
                due = self._gap_until - self._clock()
            try:
                return self._arrived.get(timeout=max(due, 0.0) if self._waiting else None)
            except queue.Empty:
                begun = self._work_clock()
                all_there = self._clock() >= self._gap_until
                self._commit(all_there)
                if all_there:
                    self._gap_until = math.inf
                self._rest_until = self._clock() + (self._work_clock() - begun) / COMMIT_SHARE

    def _commit(self, all_there: bool = False) -> None:
        """Commit the parts that continue the table, or all that are there."""
        ready = []
        while self._next in self._waiting or self._next in self._early:
            if self._next in self._early:
                self._next = self._early.pop(self._next)
            else:
                ready.append(self._waiting.pop(self._next))
                self._next = ready[-1].part.stop
            if self._next == self._end:
                self._open_next()
        if all_there:
            early = [self._waiting[first] for first in sorted(self._waiting)]
            self._early |= {staged.part.first: staged.part.stop for staged in early}
            self._waiting.clear()
            ready += early
        if ready:
            self._folder.commit(ready)

    def _open_next(self) -> None:
        """Continue with the next range of missing rows."""
        self._next, self._end = next(self._missing, (-1, -1))

    def _merge(self) -> None:
        """Replace small parts, once all rows are there, by those that a fast run writes directly."""
        import pyarrow as pa  # heavy, and only needed where there are small parts
        import pyarrow.parquet as pq

        from boulder_sweep.store.schema import judged_rows

        for names in self._folder.manifest.mergeable():
            if self._stopped.is_set():
                return
            try:
                contents = [(self._folder.path / name).read_bytes() for name in names]
                sources = [pa.BufferReader(content) for content in contents]
                tables = [pq.read_table(source, page_checksum_verification=True) for source in sources]
            except (OSError, pa.ArrowException) as problem:
                self._folder.check()
                raise DamagedError(f"{self._folder.path} was damaged during the run: {problem}") from problem
            first = self._folder.manifest.parts[names[0]].first
            merged = self._computation.encoded(first, [judged_rows(table) for table in tables])
            self._folder.merge(names, merged.content)
