"""SIGINT and SIGTERM are noted, and acted on between units of work; what must not outlive the process is undone.

A handler that raised would be swallowed where the interpreter was called from compiled code, as Numba's compiler
does. So the handler only notes the first signal. Long work that cannot look for it, such as compiling, runs in a thread
of its own while the caller waits and looks. The second signal ends the process at once, and that, too, leaves nothing
behind.
"""

from __future__ import annotations

# The command line imports this first, and no more than it needs: until then, signals do what they did.
import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeVar

from boulder_sweep.errors import Interrupted

if TYPE_CHECKING:
    import subprocess
    from types import FrameType

Returned = TypeVar("Returned")
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_LOOK_EVERY_S = 0.05
_PATIENCE_S = 1.0
"""How long the end of the process waits for another thread that is making something."""
_making = threading.RLock()
_undo: dict[object, Callable[[], object]] = {}


def until_end(make: Callable[[], Returned], undo: Callable[[Returned], object]) -> tuple[Returned, object]:
    """Make something in short time, and undo it when the process ends, whatever ends that but SIGKILL.

    Return what was made, and its key for `undo_now`. What undoes it may be called again, and while it is running.
    """
    key = object()
    with _making:
        made = make()
        _undo[key] = lambda: undo(made)
    return made, key


def undo_now(key: object) -> None:
    """Undo one of the things that are undone when the process ends."""
    if undo := _undo.get(key):
        undo()
        _undo.pop(key, None)


@contextmanager
def undone(make: Callable[[], Returned], undo: Callable[[Returned], object]) -> Iterator[Returned]:
    """Make something as `until_end`, and undo it at the end of the block."""
    made, key = until_end(make, undo)
    try:
        yield made
    finally:
        undo_now(key)


def undo_all() -> None:
    """Undo what this process must not leave, the latest first, in the main thread of a process that ends.

    Threads that would make more wait until it has ended, and further signals change nothing.
    """
    for number in _SIGNALS:
        signal.signal(number, lambda *_: None)
    _making.acquire(timeout=_PATIENCE_S)
    for key in reversed(list(_undo)):
        with suppress(Exception):
            undo_now(key)


def _forget() -> None:
    """Leave what was made before a fork to the process that made it."""
    global _making
    _making = threading.RLock()
    _undo.clear()


os.register_at_fork(after_in_child=_forget)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process that leads a group, and all that it started in it."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


class Signals:
    """Signals noted so far: `caught` is the first that arrived, or None."""

    def __init__(self) -> None:
        self.caught: int | None = None
        self._deferred = 0
        self._abandoned: list[threading.Thread] = []

    def check(self) -> None:
        """Raise `Interrupted` if a signal has arrived."""
        if self.caught is not None:
            raise Interrupted(self.caught)

    def call(self, function: Callable[[], Returned]) -> Returned:
        """Call a function in a thread of its own, and return what it returns or raise what it raises.

        Raise `Interrupted` where a signal arrived; the function goes on until the process ends.
        """
        outcome: list[Returned] = []
        problem: list[BaseException] = []

        def work() -> None:
            try:
                outcome.append(function())
            except BaseException as raised:
                problem.append(raised)

        self.check()
        depth = self._deferred
        thread = threading.Thread(target=work, name="interruptible work", daemon=True)
        thread.start()
        while thread.is_alive():
            thread.join(_LOOK_EVERY_S)
            if self.caught is not None and self._deferred == depth and thread.is_alive():
                self.abandon(thread)
                raise Interrupted(self.caught)
        if problem:
            raise problem[0]
        return outcome[0]

    def abandon(self, thread: threading.Thread) -> None:
        """Leave a thread to the end of the process, which does not wait for it."""
        self._abandoned.append(thread)

    def defer(self) -> None:
        """Leave it to the code that calls this to act on signals; `call` further out waits for it to return."""
        self._deferred += 1

    def note(self, signum: int, frame: FrameType | None) -> None:
        """Note the first signal, and end the process with the second. A signal handler."""
        if self.caught is None:
            self.caught = signum
            return
        undo_all()
        os._exit(128 + self.caught)

    def at_exit(self) -> None:
        """Leave nothing behind; end at once if abandoned work could crash while the interpreter shuts down."""
        undo_all()
        if self.caught is not None and any(thread.is_alive() for thread in self._abandoned):
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):
                    stream.flush()
            os._exit(128 + self.caught)


_installed: Signals | None = None


def install() -> Signals:
    """Note SIGINT and SIGTERM from now on instead of letting them end the process."""
    global _installed
    if _installed is None:
        _installed = Signals()
        for signum in _SIGNALS:
            signal.signal(signum, _installed.note)
        atexit.register(_installed.at_exit)
    return _installed


@contextmanager
def noted_signals() -> Iterator[Signals]:
    """Note signals meanwhile, see `install`.

    Where they are noted already, this gives the same. Outside the main thread, where Python allows no handlers, nothing
    is noted and signals do what they did.
    """
    global _installed
    if _installed is not None or threading.current_thread() is not threading.main_thread():
        yield _installed or Signals()
        return
    before: dict[int, Any] = {signum: signal.getsignal(signum) for signum in _SIGNALS}
    signals = install()
    try:
        yield signals
    finally:
        _installed = None
        for signum, handler in before.items():
            signal.signal(signum, handler)
        if not signals.caught:
            atexit.unregister(signals.at_exit)
