"""Workers of a Dask cluster: each computes, encodes and writes its own parts; the scheduler sees short messages."""

from __future__ import annotations

import logging
import queue
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import Any

from boulder_sweep.errors import BackendError, BoulderSweepError, ClusterLostError
from boulder_sweep.runner.backends import FETCH_S
from boulder_sweep.runner.computing import Computation, Computed, Ended, Message, Note, failed_rows
from boulder_sweep.runner.remote import Done, Work, check_fingerprints, compute, fingerprint, parts_of, received
from boulder_sweep.runner.silence import Silence, answers, named, seen
from boulder_sweep.store.writer import OutputFolder, StagedPart
from boulder_sweep.text import one_line

CONNECT_S = 10.0
"""How long to wait for a scheduler to answer [s]."""
FIRST_WORKER_S = 10.0
"""How long to wait for a first worker [s]."""
NO_WORKER_S = 15.0
"""How long a run waits for a worker after the last one was lost [s]."""
_LOOK_EVERY_S = 1.0
_QUIET_S = 10.0
"""Time without any result after which the user is told [s]."""
_TASKS_PER_THREAD = 2
_TRIES = 3
_LOOPBACK = "127.0.0.1:0"


class Cluster:
    """A connection to a Dask scheduler.

    Parameters
    ----------
    jobs
        Threads of the worker to start where no scheduler is given.
    scheduler
        Address of a running scheduler; None to start one in this process, reachable from this machine only.
    dashboard
        Where the dashboard of a scheduler in this process listens, such as ``0.0.0.0:8787``; a free port of
        127.0.0.1 by default.

    Attributes
    ----------
    dashboard : str or None
        Address of the dashboard, if there is one.
    silent : set of str
        Workers that did not answer at the beginning.

    Raises
    ------
    BackendError
        Dask is not installed, the scheduler does not answer, it has no worker, or a worker has other versions.
    """

    def __init__(self, jobs: int, scheduler: str | None, dashboard: str | None = None):
        self.address = scheduler
        self._levels: dict[str, int] = {}
        self._local: Any = None
        self.client: Any = None
        self.silent: set[str] = set()
        try:
            self.client = self._connected(jobs, scheduler, dashboard or _LOOPBACK)
            port = self.client.scheduler_info()["services"].get("dashboard")
            link = f"http://127.0.0.1:{port}/status" if scheduler is None and dashboard is None else None
            self.dashboard: str | None = (link or self.client.dashboard_link) if port else None
        except BaseException:
            self.close()
            raise

    def _connected(self, jobs: int, scheduler: str | None, dashboard: str) -> Any:
        """Connect, or start a scheduler and a worker of threads in this process."""
        try:
            distributed = import_module("distributed")  # an extra: most users have no cluster
        except ImportError:
            raise BackendError("the backend dask needs a package: pip install 'boulder-sweep[dask]'") from None
        self._levels = _silenced_loggers()
        if scheduler is None:
            with warnings.catch_warnings():  # a machine without a network is no reason for a warning
                warnings.filterwarnings("ignore", "Couldn't detect a suitable IP address", RuntimeWarning)
                self._local = distributed.LocalCluster(
                    processes=False,
                    n_workers=1,
                    threads_per_worker=jobs,
                    dashboard_address=dashboard,
                    worker_dashboard_address=_LOOPBACK,
                )
                return distributed.Client(self._local, set_as_default=False)
        try:
            client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as problem:
            raise BackendError(f"no Dask scheduler answers at {scheduler}: {one_line(problem)}") from problem
        try:
            _wait_for_a_worker(client, scheduler)
            found, self.silent = answers(client, fingerprint, CONNECT_S)
            check_fingerprints(found)
        except TimeoutError as silence:
            client.close(timeout=2)
            raise ClusterLostError(f"the connection to the Dask scheduler at {scheduler} was lost") from silence
        except BaseException:
            client.close(timeout=2)
            raise
        return client

    def threads(self) -> dict[str, int]:
        """Return the threads of every worker, by its address.

        Raises
        ------
        ClusterLostError
            The scheduler does not answer.
        """
        return dict(self._asked(self.client.scheduler.ncores))

    def last_seen(self) -> dict[str, float]:
        """Return when the scheduler last heard of every worker, by its own clock [s]; raises as `threads`."""
        return seen(self._asked(self.client.scheduler.identity))

    def tasks_of(self, workers: Collection[str]) -> set[str]:
        """Return the keys of the tasks that workers have, and of the results that they hold; raises as `threads`."""
        found: set[str] = set()
        for question in (self.client.scheduler.processing, self.client.scheduler.has_what):
            for worker, keys in self._asked(question).items():
                found.update(keys if worker in workers else ())
        return found

    def _asked(self, question: Callable[[], Any]) -> Any:
        """Ask the scheduler."""
        try:
            return self.client.sync(question, callback_timeout=CONNECT_S)
        except (OSError, AttributeError, TimeoutError) as problem:
            raise ClusterLostError(self.lost_text()) from problem

    def lost_text(self) -> str:
        """Return what to say when the scheduler is gone."""
        return f"the connection to the Dask scheduler at {self.address or 'this process'} was lost"

    def close(self) -> None:
        """Disconnect; a cluster of this process ends, and does not wait for what its worker computes."""
        ends = [] if self.client is None else [partial(self.client.close, timeout=2)]
        if self._local is not None:
            wait = {"timeout": 2, "executor_wait": False, "callback_timeout": 2}
            ends += [partial(self._local.sync, worker.close, **wait) for worker in self._local.workers.values()]
            ends.append(partial(self._local.close, timeout=2))
        for end in ends:
            with suppress(Exception):  # a scheduler that died cannot be told
                end()
        for name, level in self._levels.items():
            logging.getLogger(name).setLevel(level)


@dataclass(frozen=True)
class _Task:
    """Rows [start, stop), and how often computing them has failed."""

    start: int
    stop: int
    tries: int = 0
    alone: bool = False
    """Whether no other task is in flight with it, so that it is the one that ends its worker."""
    relayed: bool = False
    """Whether the bytes come back through the scheduler, because the worker cannot write into the folder."""
    only: frozenset[str] = frozenset()
    """The workers that it was given to; empty for any."""


class ClusterWorkers(threading.Thread):
    """Computes ranges of rows on a cluster and puts messages into a queue, at last `Ended`.

    Parameters
    ----------
    cluster
        Where to compute.
    computation
        What to do with rows.
    tasks
        Ranges of rows [start, stop).
    rows_per_block
        Rows that a worker computes at once.
    folder
        Where parts are staged, by the workers if they share it.
    clock
        Gives the time [s].
    """

    def __init__(
        self,
        cluster: Cluster,
        computation: Computation,
        tasks: Iterator[tuple[int, int]],
        rows_per_block: int,
        folder: OutputFolder,
        clock: Callable[[], float] = time.monotonic,
    ):
        super().__init__(name="workers", daemon=True)
        self.messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._cluster = cluster
        self._computation = computation
        self._tasks = (_Task(*rows) for rows in tasks)
        self._rows_per_block = rows_per_block
        self._folder = folder
        self._again: deque[_Task] = deque()
        self._suspects: deque[_Task] = deque()
        """Tasks whose workers died; computed one by one."""
        self._in_flight: dict[Any, _Task] = {}
        self._arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._lost: list[Any] = []
        """Futures in flight whose result was lost with its worker before it was received."""
        self._fetch_s = FETCH_S
        self._late: dict[Any, Done | Exception] = {}
        """What came of futures whose results did not come at once."""
        self._stopped = threading.Event()
        self._clock = clock
        self._there: dict[str, int] = {}
        self._workers: dict[str, int] = {}
        """Those of `_there` that are not silent."""
        self._silence = Silence(cluster)
        self._share: Callable[[], Any] = lambda: None
        """Sends what all tasks have in common to a worker."""
        self._shared: Any = None
        self._shared_with: frozenset[str] | None = None
        """The workers that it was given to; empty for any, None where it must be sent again."""
        self._without_worker_since: float | None = None

    def stop(self) -> None:
        """Hand out no more tasks; those in progress are dropped."""
        self._stopped.set()

    def flush(self) -> list[StagedPart]:
        """Stage what is not written yet: nothing, for workers write what they compute."""
        return []

    def run(self) -> None:
        """Compute everything; called by `start`."""
        problem: BaseException | None = None
        try:
            self._work()
        except BaseException as raised:
            problem = raised
            if not isinstance(raised, BoulderSweepError) and self._cluster.client.status != "running":
                problem = ClusterLostError(self._cluster.lost_text())
        self.messages.put(Ended(None if self._stopped.is_set() else problem))

    def _work(self) -> None:
        """Keep some tasks in flight until all are done."""
        manifest = self._folder.manifest
        work = Work(
            self._folder.token,
            self._computation,
            self._rows_per_block,
            manifest.rows_per_part,
            str(self._folder.path.resolve()),
            manifest.rows,
            fingerprint(),
        )
        self._share = lambda: self._cluster.client.submit(received, work, workers=self._only(), pure=False)
        looked = result = self._clock()
        self._look_at_workers()
        if self._silence.silent:
            self.messages.put(Note(f"{named(self._silence.silent)} silent, and not given any tasks"))
        more = True
        while (more or self._in_flight) and not self._stopped.is_set():
            if self._suspects:
                if not self._in_flight and self._workers:
                    self._submit(self._suspects.popleft())
            elif not any(task.alone for task in self._in_flight.values()):
                more = self._submit_some()
            with suppress(queue.Empty):
                if self._receive(self._arrived.get(timeout=_LOOK_EVERY_S / 4)):
                    result = self._clock()
            now = self._clock()
            if now - looked > _LOOK_EVERY_S:
                looked = now
                self._look_at_workers()
                self._expect_lost()
                if now - result > _QUIET_S and self._workers:
                    result = now
                    quiet = f"no result for {_QUIET_S:.0f} s from {len(self._workers)} workers; waiting"
                    self.messages.put(Note(quiet))
            more = more or bool(self._again) or bool(self._suspects)

    def _only(self) -> list[str] | None:
        """Return the workers that may get a task; None for all."""
        return sorted(self._workers) if self._silence.silent else None

    def _submit_some(self) -> bool:
        """Submit tasks until every thread has some; False if there are no more."""
        while len(self._in_flight) < _TASKS_PER_THREAD * sum(self._workers.values()):
            task = self._again.popleft() if self._again else next(self._tasks, None)
            if task is None:
                return False
            self._submit(task)
        return True

    def _submit(self, task: _Task) -> None:
        """Hand a task to the scheduler."""
        only = self._only()
        future = self._cluster.client.submit(
            compute, self._shared, task.start, task.stop, task.relayed, workers=only, pure=False
        )
        self._in_flight[future] = replace(task, only=frozenset(only or ()))
        future.add_done_callback(self._arrived.put)

    def _expect_lost(self) -> None:
        """Wait again for lost results; Dask calls back at once for those that are still lost."""
        lost, self._lost = self._lost, []
        for future in self._in_flight.keys() & lost:
            future.add_done_callback(self._arrived.put)

    def _receive(self, future: Any) -> bool:
        """Pass a result on, or retry; False where the result has not come, and is still waited for."""
        if future not in self._in_flight:  # submitted again meanwhile
            return False
        if future.cancelled():  # as all are when the connection breaks
            raise ClusterLostError(self._cluster.lost_text())
        if not future.done():
            self._lost.append(future)
            return False
        if self._fetch_s > FETCH_S and future not in self._late and future.status == "finished":
            # It may lie on a worker that is silent: others go on meanwhile.
            threading.Thread(target=self._fetch, args=(future, self._fetch_s), daemon=True).start()
            return False
        try:
            done = self._late.pop(future, None) or future.result(timeout=FETCH_S)
            if isinstance(done, Exception):
                raise done
        except Exception as problem:
            if future.cancelled():
                raise ClusterLostError(self._cluster.lost_text()) from problem
            if future.status == "error":
                self._retry(self._in_flight.pop(future), problem)
            elif isinstance(problem, TimeoutError):
                self._fetch_s *= 2.0
                future.add_done_callback(self._arrived.put)
                return False
            else:
                raise
        else:
            self._accept(self._in_flight.pop(future), done)
        return True

    def _fetch(self, future: Any, limit_s: float) -> None:
        """Wait longer for a result."""
        try:
            self._late[future] = future.result(timeout=limit_s)
        except Exception as problem:
            self._late[future] = problem
        self._arrived.put(future)

    def _accept(self, task: _Task, done: Done) -> None:
        """Pass on the parts that a worker has written, or write those that it sent."""
        for part in done.relayed:
            done.staged.append(self._folder.stage(part.first, part.content, part.rows, part.verdicts))
        here = [staged for staged in done.staged if self._folder.is_staged(staged)]
        for staged in here:
            self.messages.put(Computed(staged.part.rows))
            self.messages.put(staged)
        if len(here) < len(parts_of(task.start, task.stop, self._folder.manifest.rows_per_part)):
            if not task.relayed:
                self.messages.put(Note("a worker does not share the output folder: its rows go through the scheduler"))
            there = {staged.part.first for staged in here}
            self._again += [
                _Task(start, stop, task.tries + 1, relayed=True)
                for start, stop in parts_of(task.start, task.stop, self._folder.manifest.rows_per_part)
                if start not in there
            ]

    def _retry(self, task: _Task, problem: BaseException) -> None:
        """Submit a failed task again; halve one that ends its workers, until the row that does so is alone."""
        if isinstance(problem, OSError) and problem.errno is not None:
            raise self._folder.write_error(problem) from problem
        if type(problem).__name__ != "KilledWorker":
            if isinstance(problem, BoulderSweepError):
                raise problem
            if task.tries + 1 >= _TRIES:
                raise BackendError(f"the workers cannot compute this sweep: {one_line(problem)}") from problem
            self._again.append(replace(task, tries=task.tries + 1))
        elif not task.alone:
            self._suspects.append(replace(task, alone=True))
        elif task.stop - task.start > 1:
            middle = (task.start + task.stop) // 2
            self._suspects += [replace(task, stop=middle), replace(task, start=middle)]
        else:
            part = self._computation.encoded(
                task.start, [failed_rows(1, "every worker that computed this design died")]
            )
            self._accept(task, Done([], [part]))

    def _look_at_workers(self) -> None:
        """Notice workers that came and went, and those that are silent."""
        before, self._there = self._there, self._cluster.threads()
        now = self._clock()
        silent = self._silence.silent
        again = self._silence.look(now, {future: task.only for future, task in self._in_flight.items()})
        self._workers = {worker: n for worker, n in self._there.items() if worker not in self._silence.silent}
        lost = before.keys() - self._there.keys()
        if lost:
            self.messages.put(
                Note(f"lost worker {', '.join(sorted(lost))}; its tasks are computed again, {len(self._workers)} left")
            )
        for note in self._silence.notes:
            self.messages.put(Note(note))
        if self._silence.silent != silent:
            self._shared_with = None  # it may lie on a silent worker, or be bound to the others
        elif self._shared_with and self._workers and not self._shared_with & self._workers.keys():
            self._shared_with, again = None, list(self._in_flight)  # all that it is bound to are gone
        if self._shared_with is None and (self._workers or not self._silence.silent):
            self._shared, self._shared_with = self._share(), frozenset(self._only() or ())
            self._fetch_s = FETCH_S
        for future in again:
            task = self._in_flight.pop(future)
            (self._suspects if task.alone else self._again).append(task)
            future.release()
        if self._workers:
            self._without_worker_since = None
        elif self._without_worker_since is None:
            self._without_worker_since = now
            self.messages.put(Note(f"no worker left; waiting {NO_WORKER_S:.0f} s for another"))
        elif now - self._without_worker_since > NO_WORKER_S:
            if self._there:
                raise ClusterLostError(f"{named(self._there)} silent, and there is no other")
            raise ClusterLostError(_no_worker_text(self._cluster.address))


def _wait_for_a_worker(client: Any, address: str) -> None:
    """Wait until a worker is connected; the scheduler of an adaptive cluster starts one when there is work.

    Raises
    ------
    BackendError
        None has come.
    """
    work = client.submit(int, pure=False)
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
        work.release()
    except TimeoutError:
        raise BackendError(_no_worker_text(address)) from None


def _no_worker_text(address: str | None) -> str:
    """Say that there is no worker and how to start one."""
    if address is None:
        return "the Dask worker of this process has ended"
    return f"the Dask scheduler at {address} has no worker; start one with: dask worker {address}"


def _silenced_loggers() -> dict[str, int]:
    """Silence the loggers of Dask, whose messages the notes of a run replace; return their levels."""
    own = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = {}
    for name in (*own, "tornado.application", "asyncio"):
        logger = logging.getLogger(name)
        levels[name] = logger.level
        logger.setLevel(logging.CRITICAL + 1)
    return levels
