"""Pieces that arrive in any order become parts that are written in order, beside the computing."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .admission import Admission
from .judged import VERDICTS, Judged, joined
from .store.writer import OutputFolder

if TYPE_CHECKING:
    from .designs import DesignBlock

COMMIT_EVERY_S = 5.0
"""How often a part that is still growing is written, so that a slow run can be watched and loses little."""
_COMMIT_SHARE = 0.05
"""Share of the time that writing growing parts may take."""


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
        self.rows_written = 0
        """Rows written by this run."""
        self._folder = folder
        self._make_block = make_block
        self._metadata = metadata
        self._admission = admission
        self._ranges: Iterator[tuple[int, int]] = folder.manifest.missing()
        self._arrived: queue.SimpleQueue[tuple[int, Judged] | None] = queue.SimpleQueue()
        self._waiting: dict[int, Judged] = {}
        self._growing: _Growing | None = None
        self._commit_every_s = commit_every_s
        self._written_at = time.monotonic()

    def put(self, start: int, judged: Judged) -> None:
        """Hand over judged rows from `start` on; never waits."""
        self._arrived.put((start, judged))

    def finish(self) -> None:
        """Say that no more will come; what is ready in order is written, then the thread ends."""
        self._arrived.put(None)

    def run(self) -> None:
        """Write everything; to be called by `start`."""
        try:
            self._open_next()
            while (piece := self._arrived.get()) is not None:
                start, judged = piece
                self._waiting[start] = judged
                self._append_ready()
                if self._growing and self._growing.fresh and time.monotonic() - self._written_at > self._pause:
                    self._write(self._growing)
            if self._growing and self._growing.fresh:
                self._write(self._growing)
        except BaseException as problem:
            self.problem = problem

    @property
    def _pause(self) -> float:
        """Time between two writings of a growing part [s]."""
        cost = self._growing.cost_s if self._growing else 0.0
        return max(self._commit_every_s, cost / _COMMIT_SHARE)

    def _append_ready(self) -> None:
        """Append what continues the growing part, and write parts that are complete."""
        while self._growing and (judged := self._waiting.pop(self._growing.stop, None)) is not None:
            self._growing.append(judged)
            if self._growing.stop == self._growing.end:
                self._write(self._growing)
                self._open_next()

    def _open_next(self) -> None:
        """Begin with the next part that lacks rows."""
        upcoming = next(self._ranges, None)
        if upcoming is None:
            self._growing = None
            return
        start, end = upcoming
        size = self._folder.manifest.rows_per_part
        first = start - start % size
        there = self._there(first) if start > first else []
        self._growing = _Growing(first, start, end, there)

    def _there(self, first: int) -> list[Judged]:
        """Read the rows that a part already has."""
        import pyarrow.parquet as pq  # heavy, and only needed when a run goes on

        from .store.schema import judged_rows

        path: Path = self._folder.path / self._folder.manifest.part_name(first)
        return [judged_rows(pq.read_table(path, page_checksum_verification=True))]

    def _write_growing(self) -> None:
        """Put what is ready of an incomplete part into the folder."""
        if self._growing and self._growing.fresh:
            self._write(self._growing)

    def _write(self, part: _Growing) -> None:
        """Put the part as it is now into the folder."""
        from .store.schema import encode, part_table

        begun = time.monotonic()
        judged = part.whole()
        block = self._make_block(part.first, part.stop)
        content = encode(part_table(block, judged, self._metadata))
        self._folder.commit(part.first, content, part.stop - part.first, verdict_counts(judged))
        self.rows_written += part.fresh
        self._admission.release(part.fresh)
        part.fresh = 0
        self._written_at = time.monotonic()
        part.cost_s = self._written_at - begun


class _Growing:
    """Rows [first, stop) of a part that will end at `end`."""

    def __init__(self, first: int, stop: int, end: int, pieces: list[Judged]):
        self.first, self.stop, self.end = first, stop, end
        self.fresh = 0
        """Rows that are not in the folder yet."""
        self.cost_s = 0.0
        """How long it took to write it the last time [s]."""
        self._pieces = pieces

    def append(self, judged: Judged) -> None:
        """Add the rows that follow."""
        rows = len(judged.verdict)
        self._pieces.append(judged)
        self.stop += rows
        self.fresh += rows

    def whole(self) -> Judged:
        """Return all rows so far."""
        self._pieces = [joined(self._pieces)]
        return self._pieces[0]


def verdict_counts(judged: Judged) -> dict[str, int]:
    """Count the rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` without one."""
    width = len(judged.reasons)
    counts = np.bincount(judged.verdict.astype(np.int64) * width + judged.reason)
    found = {}
    for code in np.flatnonzero(counts):
        verdict, reason = VERDICTS[code // width], judged.reasons[code % width]
        found[f"{verdict}/{reason}" if reason else verdict] = int(counts[code])
    return dict(sorted(found.items()))
