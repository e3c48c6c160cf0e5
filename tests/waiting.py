"""Waiting for a state. How long that takes decides nothing: the one limit there is ends tests that hang."""

from __future__ import annotations

import time
from collections.abc import Callable

HANG_GUARD_S = 600.0  # hang guard
_LOOK_EVERY_S = 0.01


def wait_until(reached: Callable[[], bool], what: str) -> None:
    """Look again and again until a state is reached."""
    for _ in range(int(HANG_GUARD_S / _LOOK_EVERY_S)):  # hang guard
        if reached():
            return
        time.sleep(_LOOK_EVERY_S)
    raise AssertionError(f"waited in vain until {what}")
