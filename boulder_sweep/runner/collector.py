"""Pieces that arrive in any order become parts that are written in order, beside the computing."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.columns import VERDICTS
from boulder_sweep.judge.judged import Judged, joined
from boulder_sweep.runner.admission import Admission
from boulder_sweep.store.writer import OutputFolder

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

COMMIT_EVERY_S = 5.0
"""How often a part is written before it is complete, so that a slow run can be watched and loses little [s]."""


class Collector(threading.Thread):
    """Writes judged rows into an output folder as parts get complete, in the order of the designs.

    Parameters
    ----------
    folder
        Open for writing.
    make_block
        Gives the inputs of some rows.
    metadata
        For the metadata of the parts.
    admission
        Told of the rows that are safe.
    commit_every_s
        See `COMMIT_EVERY_S`.
    """

    def __init__(
        self,
        folder: OutputFolder,
        make_block: Callable[[int, int], DesignBlock],
        metadata: Mapping[bytes, bytes],
        admission: Admission,
        commit_every_s: float = COMMIT_EVERY_S,
    ):
        super().__init__(name="collector", daemon=True)
        self.problem: BaseException | None = None
        self._folder = folder
        self._make_block = make_block
        self._metadata = metadata
        self._admission = admission
        self._ranges: Iterator[tuple[int, int]] = folder.manifest.missing()
        self._arrived: queue.SimpleQueue[tuple[int, Judged] | None] = queue.SimpleQueue()
        self._stopped = threading.Event()
        self._waiting: dict[int, Judged] = {}
        self._ready: list[Judged] = []
        self._from_row = self._to_row = self._last_row = 0
        """Rows [from, to) are ready, and are written with those up to the last if nothing hurries."""
        self._commit_every_s = commit_every_s
        self._written_at = time.monotonic()

    def put(self, start: int, judged: Judged) -> None:
        """Hand over judged rows from `start` on; never waits."""
        self._arrived.put((start, judged))

    def finish(self) -> None:
        """Say that no more will come; what is ready in order is written, small parts are merged, that is all."""
        self._arrived.put(None)

    def stop(self) -> None:
        """Say that there is no time left; what is ready in order is written, and the thread ends."""
        self._stopped.set()
        self._arrived.put(None)

    def run(self) -> None:
        """Write everything; to be called by `start`."""
        try:
            self._open_next()
            while (piece := self._arrived.get()) is not None:
                start, judged = piece
                self._waiting[start] = judged
                self._take_ready()
                if time.monotonic() - self._written_at > self._commit_every_s:
                    self._write()
            self._write()
            self._merge()
        except BaseException as problem:
            self.problem = problem

    def _take_ready(self) -> None:
        """Take what continues the rows that are ready, and write parts that are complete."""
        while (judged := self._waiting.pop(self._to_row, None)) is not None:
            self._ready.append(judged)
            self._to_row += len(judged.verdict)
            if self._to_row == self._last_row:
                self._write()
                self._open_next()

    def _open_next(self) -> None:
        """Begin with the next range of rows that is not there."""
        self._from_row, self._last_row = next(self._ranges, (-1, -1))
        self._to_row = self._from_row

    def _write(self) -> None:
        """Put what is ready into the folder."""
        rows = self._to_row - self._from_row
        if rows == 0:
            return
        judged = joined(self._ready)
        self._folder.commit(self._from_row, self._encoded(self._from_row, judged), rows, verdict_counts(judged))
        self._admission.release(rows)
        self._ready.clear()
        self._from_row = self._to_row
        self._written_at = time.monotonic()

    def _merge(self) -> None:
        """Replace small parts, once all are there, by those that a fast run writes at once."""
        import pyarrow as pa  # heavy, and only needed where there are small parts
        import pyarrow.parquet as pq

        from boulder_sweep.store.errors import DamagedError
        from boulder_sweep.store.schema import judged_rows

        for names in self._folder.manifest.mergeable():
            if self._stopped.is_set():
                return
            try:
                paths = [self._folder.path / name for name in names]
                tables = [pq.read_table(path, page_checksum_verification=True) for path in paths]
            except (OSError, pa.ArrowException) as problem:
                raise DamagedError(f"{self._folder.path} was damaged during the run: {problem}") from problem
            judged = joined([judged_rows(table) for table in tables])
            first = self._folder.manifest.parts[names[0]].first
            self._folder.merge(names, self._encoded(first, judged))

    def _encoded(self, first: int, judged: Judged) -> memoryview:
        """Return the bytes of a part from its first row and its outcomes."""
        from boulder_sweep.store.schema import encode, part_table

        block = self._make_block(first, first + len(judged.verdict))
        return encode(part_table(block, judged, self._metadata))


def verdict_counts(judged: Judged) -> dict[str, int]:
    """Count the rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` without one."""
    width = len(judged.reasons)
    counts = np.bincount(judged.verdict.astype(np.int64) * width + judged.reason)
    found = {}
    for code in np.flatnonzero(counts):
        verdict, reason = VERDICTS[code // width], judged.reasons[code % width]
        found[f"{verdict}/{reason}" if reason else verdict] = int(counts[code])
    return dict(sorted(found.items()))
