"""Records staged parts in the manifest, in the order of the designs, while others are computed."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from boulder_sweep.runner.admission import Admission
from boulder_sweep.store.errors import DamagedError
from boulder_sweep.store.writer import OutputFolder, StagedPart

if TYPE_CHECKING:
    from boulder_sweep.runner.computing import Computation


class Committer(threading.Thread):
    """Commits staged parts; merges small ones at the end.

    Parameters
    ----------
    folder
        Open for writing.
    computation
        Encodes merged parts.
    admission
        Is told which rows are safe.
    flush
        Stages the rows that are ready when the run is stopped.
    """

    def __init__(
        self,
        folder: OutputFolder,
        computation: Computation,
        admission: Admission,
        flush: Callable[[], Iterable[StagedPart]],
    ):
        super().__init__(name="committer", daemon=True)
        self.problem: BaseException | None = None
        self._folder = folder
        self._computation = computation
        self._admission = admission
        self._flush = flush
        self._arrived: queue.SimpleQueue[StagedPart | None] = queue.SimpleQueue()
        self._waiting: dict[int, StagedPart] = {}
        self._missing = folder.manifest.missing()
        self._next = self._end = -1
        self._open_next()
        self._stopped = threading.Event()

    def put(self, staged: StagedPart) -> None:
        """Hand over a staged part; never waits."""
        self._arrived.put(staged)

    def finish(self) -> None:
        """Commit everything that was handed over, merge small parts, and end."""
        self._arrived.put(None)

    def stop(self) -> None:
        """Commit what is ready in order, and end."""
        self._stopped.set()
        self._arrived.put(None)

    def run(self) -> None:
        """Commit parts; called by `start`."""
        try:
            while (item := self._arrived.get()) is not None:
                self._waiting[item.part.first] = item
                if self._arrived.empty():  # one manifest for all that have arrived
                    self._commit()
            if self._stopped.is_set():
                self._waiting |= {item.part.first: item for item in self._flush()}
            self._commit()
            self._merge()
        except BaseException as problem:
            self.problem = problem

    def _commit(self) -> None:
        """Commit the parts that continue the table."""
        ready = []
        while (staged := self._waiting.pop(self._next, None)) is not None:
            ready.append(staged)
            self._next = staged.part.stop
            if self._next == self._end:
                self._open_next()
        if ready:
            self._folder.commit(ready)
            self._admission.release(sum(staged.part.rows for staged in ready))

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
                raise DamagedError(f"{self._folder.path} was damaged during the run: {problem}") from problem
            first = self._folder.manifest.parts[names[0]].first
            merged = self._computation.encoded(first, [judged_rows(table) for table in tables])
            self._folder.merge(names, merged.content)
