"""SIGINT and SIGTERM during a run: stop soon and properly at the first, at once at the second."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

from boulder_sweep.errors import Interrupted

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Signals:
    """While entered, notes SIGINT and SIGTERM instead of letting them end the process.

    As long as `prompt` is set, the first signal raises `Interrupted` on the spot: right while nothing has
    been begun that would have to be ended properly. Outside the main thread, where Python allows no handlers,
    nothing is noted and signals do what they did.

    Attributes
    ----------
    caught : int or None
        The first signal that came.
    prompt : bool
        See above.
    """

    def __init__(self) -> None:
        self.caught: int | None = None
        self.prompt = True
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for signum in _SIGNALS:
                self._before[signum] = signal.signal(signum, self._handle)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for signum, handler in self._before.items():
            signal.signal(signum, handler)

    def _handle(self, signum: int, frame: FrameType | None) -> None:
        """Note the first signal; die of the second."""
        if self.caught is not None:
            signal.signal(signum, signal.SIG_DFL)
            os.kill(os.getpid(), signum)
            return
        self.caught = signum
        if self.prompt:
            raise Interrupted(signum)
