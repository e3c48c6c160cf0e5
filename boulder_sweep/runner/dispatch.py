"""Calls on the workers of a cluster, for runs and for answers: what a worker that dies or hangs had is given to others.

Dask makes the calls of a worker that died again by itself. A worker that hangs stays connected: Dask drops it after
minutes, and until then waits for it. So who is silent is found out here, their calls are submitted again under new
names, and the first ones are given up: what such a worker does when it comes back goes nowhere.
"""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

from boulder_sweep.errors import BoulderSweepError, ClusterLostError
from boulder_sweep.runner.cluster import Cluster, no_worker_text
from boulder_sweep.text import counted

FETCH_S = 2.0
"""How long to wait for a result that a worker of a cluster has finished; twice as long as any time that was too short
[s].

If a worker dies between finishing a task and handing over the result, the scheduler may try to reach it for 30 s,
Dask's limit for a connection. Asked again, it gives the result of the worker that has computed the task anew.
"""
NO_WORKER_S = 15.0
"""How long to wait for a worker after the last one was lost [s]."""
SILENT_S = 30.0
"""Time without a heartbeat after which a worker gets no more tasks, and others get those that it has [s]."""
_LOOK_EVERY_S = 1.0
_QUIET_S = 10.0
"""Time without any result after which the user is told [s]."""
_TASKS_PER_THREAD = 2
_LOOK_FOR_SILENCE_EVERY_S = 5.0
_LOOKS = round(SILENT_S / _LOOK_FOR_SILENCE_EVERY_S)
_DOUBT_S = 10.0
"""How long a task that may wait for something on a silent worker has to end, before it is given to others, too [s]."""

Item = TypeVar("Item")


class Task(NamedTuple, Generic[Item]):
    """A call to be made on a worker."""

    item: Item
    """What it stands for; given back with the outcome."""
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    options: Mapping[str, Any] = {}


class TaskResult(NamedTuple, Generic[Item]):
    """What came of a task."""

    item: Item
    result: Any
    problem: Exception | None
    """What the call raised, or Dask in its place, such as ``KilledWorker``."""


@dataclass(frozen=True)
class _Submitted(Generic[Item]):
    """A task in flight."""

    task: Task[Item]
    only: frozenset[str]
    """The workers that it was given to; empty for any."""


def received(common: Any) -> Any:
    """Hold on a worker what all calls have in common; others fetch it there, and it is repeated if that one is lost."""
    return common


class Dispatcher(Generic[Item]):
    """Keeps some tasks in flight on a cluster, and cares for lost, late and silent workers.

    Parameters
    ----------
    cluster
        Where to work.
    common
        First argument of every call, sent to the cluster once; None for none.
    note
        Called with what the user should know, such as a lost worker.
    clock
        Gives the time [s].
    """

    def __init__(
        self,
        cluster: Cluster,
        common: Any = None,
        note: Callable[[str], None] = lambda text: None,
        clock: Callable[[], float] = time.monotonic,
    ):
        self._cluster = cluster
        self._common = common
        self._note = note
        self._clock = clock
        self._in_flight: dict[Any, _Submitted[Item]] = {}
        self._again: deque[Task[Item]] = deque()
        self._arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._lost: list[Any] = []
        """Futures in flight whose result was lost with its worker before it was received."""
        self._fetch_s = FETCH_S
        self._late: dict[Any, _Fetched] = {}
        """What came of futures whose results did not come at once."""
        self._stopped = threading.Event()
        self._there: dict[str, int] = {}
        self._workers: dict[str, int] = {}
        """Those of `_there` that are not silent."""
        self._silence = Silence(cluster)
        self._shared: tuple[Any, ...] = ()
        """The future of `common`, as the first argument."""
        self._shared_with: frozenset[str] | None = None
        """The workers that it was given to; empty for any, None where it must be sent again."""
        self._without_worker_since: float | None = None

    def stop(self) -> None:
        """Submit nothing more, and wait for nothing; any thread may call this."""
        self._stopped.set()

    @property
    def threads(self) -> int:
        """Threads of all workers that are not silent."""
        return sum(self._workers.values())

    @property
    def under_way(self) -> list[Item]:
        """What the tasks that are not done stand for."""
        return [*(submitted.task.item for submitted in self._in_flight.values()), *(task.item for task in self._again)]

    def outcomes(self, next_task: Callable[[], Task[Item] | None]) -> Iterator[TaskResult[Item]]:
        """Yield what comes of tasks, in the order in which they end.

        Parameters
        ----------
        next_task
            Asked for another task while workers have room; None for none now. It ends when there is none and nothing
            is under way.

        Raises
        ------
        ClusterLostError
            The scheduler or all workers are lost, or all workers are silent.
        """
        try:
            yield from self._outcomes(next_task)
        except BoulderSweepError:
            raise
        except Exception as problem:
            if self._cluster.client.status != "running":
                raise ClusterLostError(self._cluster.lost_text()) from problem
            raise

    def _outcomes(self, next_task: Callable[[], Task[Item] | None]) -> Iterator[TaskResult[Item]]:
        looked = result = self._clock()
        self._look_at_workers()
        if self._silence.silent:
            self._note(f"{named(self._silence.silent)} silent, and not given any tasks")
        while not self._stopped.is_set():
            if self._submit_some(next_task) and not self._in_flight:
                return
            with suppress(queue.Empty):
                outcome = self._received(self._arrived.get(timeout=_LOOK_EVERY_S / 4))
                if outcome is not None:
                    result = self._clock()
                    yield outcome
            now = self._clock()
            if now - looked > _LOOK_EVERY_S:
                looked = now
                self._look_at_workers()
                self._expect_lost()
                if now - result > _QUIET_S and self._workers:
                    result = now
                    self._note(f"no result for {_QUIET_S:.0f} s from {len(self._workers)} workers; waiting")

    def _only(self) -> list[str] | None:
        """Return the workers that may get a task; None for all."""
        return sorted(self._workers) if self._silence.silent else None

    def _submit_some(self, next_task: Callable[[], Task[Item] | None]) -> bool:
        """Submit tasks until every thread has some; False where there may be more."""
        while True:
            is_room = len(self._in_flight) < _TASKS_PER_THREAD * self.threads
            if not is_room and (self._in_flight or self._again):
                return False
            task = self._again.popleft() if self._again else next_task()
            if task is None:
                return True
            if not is_room:  # no worker is left; without another task it would not matter
                self._again.append(task)
                return False
            only = self._only()
            arguments = (*self._shared, *task.arguments)
            future = self._cluster.client.submit(task.function, *arguments, **task.options, workers=only, pure=False)
            self._in_flight[future] = _Submitted(task, frozenset(only or ()))
            future.add_done_callback(self._arrived.put)

    def _expect_lost(self) -> None:
        """Wait again for lost results; Dask calls back at once for those that are still lost."""
        lost, self._lost = self._lost, []
        for future in self._in_flight.keys() & lost:
            future.add_done_callback(self._arrived.put)

    def _received(self, future: Any) -> TaskResult[Item] | None:
        """Return what came of a task; None where the result has not come, and is still waited for."""
        if future not in self._in_flight:  # submitted again meanwhile
            return None
        if future.cancelled():  # as all are when the connection breaks
            raise ClusterLostError(self._cluster.lost_text())
        if not future.done():
            self._lost.append(future)
            return None
        if self._fetch_s > FETCH_S and future not in self._late and future.status == "finished":
            # It may lie on a worker that is silent: others go on meanwhile.
            threading.Thread(target=self._fetch, args=(future, self._fetch_s), daemon=True).start()
            return None
        limit_s, result, problem = self._late.pop(future) if future in self._late else _fetched(future, FETCH_S)
        if problem is not None:
            if future.cancelled() or self._cluster.client.status != "running":
                raise ClusterLostError(self._cluster.lost_text()) from problem
            if isinstance(problem, TimeoutError) and future.status != "error":
                self._fetch_s = max(self._fetch_s, 2.0 * limit_s)  # several may have waited as long at once
                future.add_done_callback(self._arrived.put)
                return None
        return TaskResult(self._in_flight.pop(future).task.item, result, problem)

    def _fetch(self, future: Any, limit_s: float) -> None:
        """Wait longer for a result."""
        self._late[future] = _fetched(future, limit_s)
        self._arrived.put(future)

    def _look_at_workers(self) -> None:
        """Notice workers that came and went, and those that are silent."""
        before, self._there = self._there, self._cluster.threads()
        now = self._clock()
        silent = self._silence.silent
        again = self._silence.look(now, {future: submitted.only for future, submitted in self._in_flight.items()})
        self._cluster.silent = self._silence.silent  # the next calls on this cluster need not find it out again
        self._workers = {worker: n for worker, n in self._there.items() if worker not in self._silence.silent}
        lost = before.keys() - self._there.keys()
        if lost:
            left = len(self._workers)
            self._note(f"lost worker {', '.join(sorted(lost))}; its tasks are computed again, {left} left")
        for text in self._silence.notes:
            self._note(text)
        if self._silence.silent != silent:
            self._shared_with = None  # it may lie on a silent worker, or be bound to the others
        elif self._shared_with and self._workers and not self._shared_with & self._workers.keys():
            self._shared_with, again = None, list(self._in_flight)  # all that it is bound to are gone
        if self._shared_with is None and (self._workers or not self._silence.silent):
            self._share()
        for future in again:
            self._again.append(self._in_flight.pop(future).task)
            future.release()
        if self._workers:
            self._without_worker_since = None
        elif self._without_worker_since is None:
            self._without_worker_since = now
            self._note(f"no worker left; waiting {NO_WORKER_S:.0f} s for another")
        elif now - self._without_worker_since > NO_WORKER_S:
            if self._there:
                raise ClusterLostError(f"{named(self._there)} silent, and there is no other")
            raise ClusterLostError(no_worker_text(self._cluster.address))

    def _share(self) -> None:
        """Send what all calls have in common to a worker that is not silent."""
        only = self._only()
        if self._common is not None:
            self._shared = (self._cluster.client.submit(received, self._common, workers=only, pure=False),)
        self._shared_with = frozenset(only or ())
        self._fetch_s = FETCH_S


class _Fetched(NamedTuple):
    """What came of waiting for the result of a future."""

    limit_s: float
    """How long it was waited for at most [s]."""
    result: Any
    problem: Exception | None


def _fetched(future: Any, limit_s: float) -> _Fetched:
    """Return the result of a future, or what went wrong."""
    try:
        return _Fetched(limit_s, future.result(timeout=limit_s), None)
    except Exception as problem:
        return _Fetched(limit_s, None, problem)


class Silence:
    """Finds out which workers are silent, and which tasks others must get.

    It counts looks at which there was no new heartbeat. Times are not compared: the clocks of two machines differ, and
    a machine may have been suspended.

    Parameters
    ----------
    cluster
        Where the workers are; says which are silent at the beginning.

    Attributes
    ----------
    silent : set of str
        Addresses of workers.
    notes : list of str
        What has changed at the last look, for the user.
    """

    def __init__(self, cluster: Cluster):
        self._cluster = cluster
        self.silent = set(cluster.silent)
        self.notes: list[str] = []
        self._seen: dict[str, float] = {}
        self._looks = dict.fromkeys(self.silent, _LOOKS)
        self._looked = -math.inf
        self._doubtful: list[Any] = []
        """Futures that may wait for something that a silent worker holds."""
        self._doubtful_until = math.inf

    def look(self, now: float, in_flight: Mapping[Any, Collection[str]]) -> list[Any]:
        """Look for silent workers if it is time to.

        Parameters
        ----------
        now
            Time [s].
        in_flight
            Futures, and the workers that each was given to; empty for all.

        Returns
        -------
        list
            Futures whose tasks others must get.
        """
        self.notes = []
        if now - self._looked < _LOOK_FOR_SILENCE_EVERY_S:
            return []
        self._looked = now
        before, last_seen = self.silent, self._cluster.last_seen()
        looks = {}
        for worker, moment in last_seen.items():
            known = self._seen.get(worker, moment if worker in before else None)
            looks[worker] = self._looks.get(worker, 0) + 1 if moment == known else 0
        self._looks = looks
        self._seen = last_seen
        self.silent = {worker for worker, count in looks.items() if count >= _LOOKS}
        again: list[Any] = []
        fallen, back = self.silent - before, (before - self.silent) & last_seen.keys()
        if fallen:
            theirs = self._cluster.tasks_of(fallen)
            again = [future for future in in_flight if future.key in theirs]
            self._doubtful, self._doubtful_until = [one for one in in_flight if one not in again], now + _DOUBT_S
            self.notes.append(f"{named(fallen)} silent for {SILENT_S:.0f} s; others get {counted(len(again), 'task')}")
        elif now >= self._doubtful_until:
            again, self._doubtful_until = [future for future in self._doubtful if future in in_flight], math.inf
            self._doubtful = []
        if back:
            self.notes.append(f"heard again of worker {', '.join(sorted(back))}")
        bound = (future for future, workers in in_flight.items() if workers and not last_seen.keys() & set(workers))
        return again + [future for future in bound if future not in again]


def named(workers: Collection[str]) -> str:
    """Begin a sentence on workers."""
    return f"worker{'s' if len(workers) > 1 else ''} {', '.join(sorted(workers))} {'are' if len(workers) > 1 else 'is'}"
