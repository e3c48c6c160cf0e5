"""Blocks handed out to workers, their results collected, failures retried.

A block that raises is tried again, then halved until the rows that raise are alone; those become rows of
verdict ``error``.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.judge.judged import Judged, not_computed
from boulder_sweep.runner.admission import Admission
from boulder_sweep.runner.backends import Backend
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

MakeBlock = Callable[[int, int], "DesignBlock"]
Evaluate = Callable[["DesignBlock"], Judged]
_TRIES = 2
_FAILURES_BUDGET = 5_000
"""Failed tries after which blocks are no longer halved: then something is wrong with all of them."""


class Piece(NamedTuple):
    """Judged rows from `start` on, in the order of the designs."""

    start: int
    judged: Judged


class Ended(NamedTuple):
    """There will be no more pieces."""

    problem: BaseException | None
    """What went wrong, if anything did."""


class Failure(NamedTuple):
    """A block raised."""

    text: str


Outcome = Judged | Failure | None
"""What becomes of a block; None where the run was stopped before."""


@dataclass(frozen=True)
class _Task:
    """Rows [start, stop) to compute, and how often that has failed."""

    start: int
    stop: int
    failed: int = 0

    def halves(self) -> list[_Task]:
        """Return two tasks of half the rows, with one try each."""
        middle = (self.start + self.stop) // 2
        return [_Task(self.start, middle, _TRIES - 1), _Task(middle, self.stop, _TRIES - 1)]


class Workers(threading.Thread):
    """Computes ranges of rows with a backend and puts a `Piece` for each into a queue, then `Ended`.

    Parameters
    ----------
    backend
        Where to compute.
    evaluate
        What to do with a block; must be picklable unless the backend shares memory.
    make_block
        Gives the block of some rows.
    ranges
        Ranges of rows [start, stop), consumed one by one as workers become free.
    admission
        Bounds the rows in progress.
    """

    def __init__(
        self,
        backend: Backend,
        evaluate: Evaluate,
        make_block: MakeBlock,
        ranges: Iterator[tuple[int, int]],
        admission: Admission,
    ):
        super().__init__(name="workers", daemon=True)
        self.results: queue.SimpleQueue[Piece | Ended] = queue.SimpleQueue()
        self._backend = backend
        self._evaluate = evaluate
        self._make_block = make_block
        self._ranges = ranges
        self._next: tuple[int, int] | None = None
        self._admission = admission
        self._again: deque[_Task] = deque()
        self._stopped = threading.Event()
        self._failures = 0

    def stop(self) -> None:
        """Hand out no more blocks; those in progress are dropped."""
        self._stopped.set()
        self._backend.silence()

    def run(self) -> None:
        """Compute everything; called by `start`."""
        problem: BaseException | None = None
        try:
            with self._backend.pool() as parallel:
                while not self._stopped.is_set() and (self._again or self._peek() is not None):
                    for task, outcome in parallel(self._calls()):
                        self._receive(task, outcome)
                    if not self._again:
                        self._admission.wait(0.05)
        except BaseException as raised:
            if not self._stopped.is_set():
                problem = raised
        self.results.put(Ended(problem))

    def _peek(self) -> tuple[int, int] | None:
        """Look at the next range."""
        if self._next is None:
            self._next = next(self._ranges, None)
        return self._next

    def _calls(self) -> Iterator[Any]:
        """Yield calls for joblib until no more may be handed out; runs in its threads, one at a time."""
        while not self._stopped.is_set():
            if self._again:
                task = self._again.popleft()
            else:
                upcoming = self._peek()
                if upcoming is None or not self._admission.admit(upcoming[1] - upcoming[0]):
                    return
                task, self._next = _Task(*upcoming), None
            yield self._call(task)

    def _call(self, task: _Task) -> Any:
        """Return a call that computes a task."""
        import joblib

        if self._backend.name != "dask":
            return joblib.delayed(_in_a_thread)(self._stopped, self._evaluate, self._make_block, task)
        try:
            block = self._make_block(task.start, task.stop)
        except Exception as problem:
            return joblib.delayed(_passed_on)(task, Failure(one_line(problem)))
        return joblib.delayed(_elsewhere)(self._evaluate, block, task)

    def _receive(self, task: _Task, outcome: Outcome) -> None:
        """Pass a result on, or retry after a failure."""
        if outcome is None:
            return
        if isinstance(outcome, Judged):
            self.results.put(Piece(task.start, outcome))
            return
        self._failures += 1
        if task.failed + 1 < _TRIES:
            self._again.append(replace(task, failed=task.failed + 1))
        elif task.stop - task.start > 1 and self._failures < _FAILURES_BUDGET:
            self._again.extend(task.halves())
        else:
            reason = f"the computation of this design failed: {outcome.text}"
            codes = np.zeros(task.stop - task.start, dtype=np.int32)
            self.results.put(Piece(task.start, not_computed((reason,), codes)))


def _in_a_thread(
    stopped: threading.Event, evaluate: Evaluate, make_block: MakeBlock, task: _Task
) -> tuple[_Task, Outcome]:
    """Compute a task in a thread of this process."""
    return task, None if stopped.is_set() else _outcome(evaluate, lambda: make_block(task.start, task.stop))


def _elsewhere(evaluate: Evaluate, block: DesignBlock, task: _Task) -> tuple[_Task, Outcome]:
    """Compute a task on another machine, which gets the block itself."""
    return task, _outcome(evaluate, lambda: block)


def _passed_on(task: _Task, outcome: Outcome) -> tuple[_Task, Outcome]:
    """Pass what is known already through the pool."""
    return task, outcome


def _outcome(evaluate: Evaluate, block: Callable[[], DesignBlock]) -> Judged | Failure:
    """Compute a block; an exception is returned, not raised."""
    try:
        return evaluate(block())
    except Exception as problem:
        return Failure(one_line(problem))
