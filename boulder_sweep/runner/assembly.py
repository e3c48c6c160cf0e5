"""Blocks that finish in any order become parts in the order of the designs."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from boulder_sweep.judge.judged import Judged

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
