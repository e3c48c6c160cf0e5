"""Blocks that finish in any order become parts in the order of the designs; how far workers may run ahead."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from boulder_sweep.judge.judged import Judged


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
