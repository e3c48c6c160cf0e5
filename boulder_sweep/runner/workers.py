"""Blocks handed out to workers, their results collected, failures mended.

A block that raises is tried again, then halved until the rows that raise are alone; those become rows of
verdict ``error``. When a worker process dies, the blocks under way are computed again one at a time, each
with a worker of its own, so that one that kills its worker is found and halved alike. Nothing else is lost.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.judge.judged import Judged, not_computed
from boulder_sweep.runner.admission import Admission
from boulder_sweep.runner.backends import Backend
from boulder_sweep.runner.processes import (
    Evaluate,
    Failure,
    MakeBlock,
    NoRoom,
    Outcome,
    Parcel,
    Work,
    compute,
    compute_here,
    one_line,
    opened,
)
from boulder_sweep.store.errors import WriteError

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

_TRIES = 2
_RAISES_BUDGET = 5_000
"""Failed tries after which blocks are no longer halved: then something is wrong with all of them."""
_DEATHS_BUDGET = 50
"""Dead workers after which blocks are no longer halved, since each costs a second."""
_DEATHS_AT_FIRST = 10
"""Dead workers after which the run ends if none has ever computed a block."""


class Piece(NamedTuple):
    """Judged rows from `start` on, in the order of the designs."""

    start: int
    judged: Judged


class Ended(NamedTuple):
    """There will be no more pieces."""

    problem: BaseException | None
    """What went wrong, if anything did."""


@dataclass(frozen=True)
class _Task:
    """Rows [start, stop) to compute, and how often that has failed."""

    start: int
    stop: int
    failed: int = 0

    def halves(self) -> list[_Task]:
        """Return two tasks of half the rows, which may fail once less."""
        middle = (self.start + self.stop) // 2
        return [_Task(self.start, middle, _TRIES - 1), _Task(middle, self.stop, _TRIES - 1)]


class Workers(threading.Thread):
    """Computes ranges of rows with a backend and puts a `Piece` for each into a queue, at last `Ended`.

    Parameters
    ----------
    backend
        Where to compute.
    evaluate
        What to do with a block; must be picklable unless the backend shares memory.
    make_block
        Gives the block of some rows.
    ranges
        Ranges of rows [start, stop), consumed one by one as workers get free.
    admission
        Bounds the rows under way.
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
        self.notes: list[str] = []
        self._backend = backend
        self._work = Work(evaluate, make_block, backend.exchange)
        self._ranges = ranges
        self._next: tuple[int, int] | None = None
        self._admission = admission
        self._again: deque[_Task] = deque()
        self._under_way: dict[int, _Task] = {}
        self._stopped = threading.Event()
        self._raises = self._deaths = 0
        self._succeeded = False

    def stop(self) -> None:
        """Hand out no more blocks; those under way are dropped."""
        self._stopped.set()
        self._backend.abandon()

    def run(self) -> None:
        """Compute everything; to be called by `start`."""
        problem: BaseException | None = None
        try:
            while not self._stopped.is_set() and not self._done():
                self._run_pool()
        except BaseException as raised:
            if not self._stopped.is_set():
                problem = raised
        self.results.put(Ended(problem))

    def _run_pool(self) -> None:
        """Compute with one pool until all is done or the pool breaks."""
        try:
            with self._backend.pool(self._work) as parallel:
                while not self._stopped.is_set() and not self._done():
                    for task, outcome in parallel(self._calls()):
                        self._receive(task, outcome)
                    if not self._again:
                        self._admission.wait(0.05)
        except WriteError:
            raise
        except Exception as problem:
            if self._stopped.is_set() or not self._under_way:
                raise
            self._mend(problem)

    def _done(self) -> bool:
        """Whether nothing is left to hand out or to wait for."""
        return not self._again and not self._under_way and self._peek() is None

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
            self._under_way[task.start] = task
            yield self._call(task)

    def _call(self, task: _Task) -> Any:
        """Return a call that computes a task."""
        import joblib

        if self._backend.in_processes:
            return joblib.delayed(_in_a_process)(task)
        if self._backend.name != "dask":
            return joblib.delayed(_in_a_thread)(self._stopped, self._work, task)
        try:
            block = self._work.make_block(task.start, task.stop)
        except Exception as problem:
            return joblib.delayed(_passed_on)(task, Failure(one_line(problem)))
        return joblib.delayed(_elsewhere)(self._work.evaluate, block, task)

    def _receive(self, task: _Task, outcome: Outcome) -> None:
        """Pass a result on, or see to a failure."""
        if self._under_way.pop(task.start, None) is None or outcome is None:
            return
        if isinstance(outcome, NoRoom):
            raise WriteError(f"a worker cannot hand over its result: {outcome.text}")
        if isinstance(outcome, Parcel):
            outcome = opened(outcome)
        if isinstance(outcome, Judged):
            self._succeeded = True
            self.results.put(Piece(task.start, outcome))
            return
        self._raises += 1
        if task.failed + 1 < _TRIES:
            self._again.append(replace(task, failed=task.failed + 1))
        elif task.stop - task.start > 1 and self._raises < _RAISES_BUDGET:
            self._again.extend(task.halves())
        else:
            self._give_up(task, f"the computation of this design failed: {outcome.text}")

    def _mend(self, problem: Exception) -> None:
        """Compute what was under way when a worker died, every block with a worker of its own."""
        self.notes.append(f"a worker ended unexpectedly ({one_line(problem)}); its rows were computed again")
        self._deaths += 1
        suspects = sorted(self._under_way.values(), key=lambda task: task.start, reverse=True)
        self._under_way.clear()
        while suspects and not self._stopped.is_set():
            task = suspects.pop()
            try:
                # Two workers, because one would be this very process.
                with self._backend.pool(self._work, jobs=2) as parallel:
                    self._under_way[task.start] = task
                    for done, outcome in parallel([self._call(task)]):
                        self._receive(done, outcome)
            except WriteError:
                raise
            except Exception as again:
                if self._stopped.is_set():
                    raise
                self._deaths += 1
                self._under_way.pop(task.start, None)
                if self._deaths >= _DEATHS_AT_FIRST and not self._succeeded:
                    raise RuntimeError("no worker survives its first block") from again
                if task.stop - task.start > 1 and self._deaths < _DEATHS_BUDGET:
                    suspects.extend(reversed(task.halves()))
                else:
                    self._give_up(task, f"the worker that computed this design ended: {one_line(again)}")

    def _give_up(self, task: _Task, reason: str) -> None:
        """Let the rows of a task be errors."""
        codes = np.zeros(task.stop - task.start, dtype=np.int32)
        self.results.put(Piece(task.start, not_computed((reason,), codes)))


def _in_a_thread(stopped: threading.Event, work: Work, task: _Task) -> tuple[_Task, Outcome]:
    """Compute a task in a thread of this process."""
    if stopped.is_set():
        return task, None
    return task, compute(work.evaluate, work.make_block, task.start, task.stop)


def _in_a_process(task: _Task) -> tuple[_Task, Outcome]:
    """Compute a task in a process that knows its work."""
    return task, compute_here(task.start, task.stop)


def _elsewhere(evaluate: Evaluate, block: DesignBlock, task: _Task) -> tuple[_Task, Outcome]:
    """Compute a task on another machine, which gets the block itself."""
    return task, compute(evaluate, lambda start, stop: block, task.start, task.stop)


def _passed_on(task: _Task, outcome: Outcome) -> tuple[_Task, Outcome]:
    """Pass what is known already through the pool."""
    return task, outcome
