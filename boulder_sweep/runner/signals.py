"""SIGINT and SIGTERM: noted when they arrive, acted on between units of work; the second one ends the process at once.

A handler that raised would be swallowed where the interpreter was called from compiled code, as Numba's compiler
does. So the handler only notes the signal. Long work that cannot look for it, such as compiling, runs in a thread of
its own while the caller waits and looks.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, TypeVar

from boulder_sweep.errors import Interrupted
from boulder_sweep.locations import remove_unfinished

Returned = TypeVar("Returned")
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_LOOK_EVERY_S = 0.05


class Signals:
    """Signals noted so far.

    Attributes
    ----------
    caught : int or None
        The first signal that arrived.
    answered : bool
        Whether the user was told what it ended, so that nobody else need act on it.
    """

    def __init__(self) -> None:
        self.caught: int | None = None
        self.answered = False
        self._deferred = 0
        self._abandoned: list[threading.Thread] = []

    def check(self) -> None:
        """Raise `Interrupted` if a signal has arrived."""
        if self.caught is not None:
            raise Interrupted(self.caught)

    def call(self, function: Callable[[], Returned], undo: Callable[[Returned], Any] = lambda result: None) -> Returned:
        """Call a function in a thread of its own, and return what it returns or raise what it raises.

        Parameters
        ----------
        function
            What to call.
        undo
            What to do with a result that comes after a signal.

        Raises
        ------
        Interrupted
            A signal arrived. The function goes on until the process ends, and its result is undone.
        """
        outcome: list[Returned] = []
        problem: list[BaseException] = []
        deciding = [None]

        def is_first() -> bool:
            try:
                deciding.pop()  # in one step: either the result is handed over, or the call is abandoned
            except IndexError:
                return False
            return True

        def work() -> None:
            try:
                result = function()
                outcome.append(result)
                if not is_first():
                    undo(result)
            except BaseException as raised:
                problem.append(raised)

        self.check()
        depth = self._deferred
        thread = threading.Thread(target=work, name="interruptible work", daemon=True)
        thread.start()
        while thread.is_alive():
            thread.join(_LOOK_EVERY_S)
            waits = self.answered or self._deferred > depth
            if self.caught is not None and not waits and thread.is_alive():
                if not is_first():
                    break
                self.abandon(thread)
                raise Interrupted(self.caught)
        thread.join()
        if problem:
            raise problem[0]
        return outcome[0]

    def abandon(self, thread: threading.Thread) -> None:
        """Leave a thread to the end of the process, which does not wait for it."""
        self._abandoned.append(thread)

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Leave it to the code within to act on signals; `call` further out waits for it."""
        self._deferred += 1
        try:
            yield
        finally:
            self._deferred -= 1

    def note(self, signum: int, frame: FrameType | None) -> None:
        """Note the first signal, and let the second one end the process at once. A signal handler."""
        self.caught = signum
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_DFL)

    def end_abandoned(self) -> None:
        """End the process now if abandoned work is still running: it could crash while the interpreter shuts down."""
        if self.caught is not None and any(thread.is_alive() for thread in self._abandoned):
            remove_unfinished()
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):
                    stream.flush()
            os._exit(128 + self.caught)


_installed: Signals | None = None


@contextmanager
def noted_signals() -> Iterator[Signals]:
    """Note SIGINT and SIGTERM instead of letting them end the process.

    Within a call of this function, another gives the same signals. Outside the main thread, where Python allows no
    handlers, nothing is noted and signals do what they did.
    """
    global _installed
    if _installed is not None:
        yield _installed
        return
    signals = Signals()
    if threading.current_thread() is not threading.main_thread():
        yield signals
        return
    before: dict[int, Any] = {signum: signal.signal(signum, signals.note) for signum in _SIGNALS}
    atexit.register(signals.end_abandoned)
    _installed = signals
    try:
        yield signals
    finally:
        _installed = None
        for signum, handler in before.items():
            signal.signal(signum, handler)
        if not signals.caught:
            atexit.unregister(signals.end_abandoned)
