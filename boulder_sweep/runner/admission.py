"""How many rows may be under way at once, so that memory stays flat when writing is slower than computing."""

from __future__ import annotations

import threading


class Admission:
    """Counts rows between being handed out and being safe on the disk.

    Parameters
    ----------
    limit
        Rows that may be under way; must allow for a whole part, which is written only when complete.
    """

    def __init__(self, limit: int):
        self.limit = limit
        self._under_way = 0
        self._changed = threading.Condition()

    def admit(self, rows: int) -> bool:
        """Hand out rows if there is room; never waits."""
        with self._changed:
            if self._under_way and self._under_way + rows > self.limit:
                return False
            self._under_way += rows
            return True

    def release(self, rows: int) -> None:
        """Rows are safe."""
        with self._changed:
            self._under_way -= rows
            self._changed.notify_all()

    def wait(self, seconds: float) -> None:
        """Wait until rows are released, but not longer than this."""
        with self._changed:
            self._changed.wait(seconds)
