"""Waiting for a state. How long that takes decides nothing: the one limit there is ends tests that hang."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

HANG_GUARD_S = 600.0  # hang guard
_LOOK_EVERY_S = 0.01


def wait_until(reached: Callable[[], bool], what: str) -> None:
    """Look again and again until a state is reached."""
    for _ in range(int(HANG_GUARD_S / _LOOK_EVERY_S)):  # hang guard
        if reached():
            return
        time.sleep(_LOOK_EVERY_S)
    raise AssertionError(f"waited in vain until {what}")


def is_running(pid: int) -> bool:
    """Whether a process exists that has not ended; one that nobody waits for is a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
