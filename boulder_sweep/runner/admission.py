"""Limits the rows in progress, so that memory stays flat when writing is slower than computing."""

from __future__ import annotations

import threading


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
