"""Calls of a function on the cores of this machine or on a Dask cluster, for answers that are not rows of a sweep."""

from __future__ import annotations

import itertools
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from boulder_sweep.errors import BackendError, BoulderSweepError, ClusterLostError
from boulder_sweep.runner.backends import (
    DASK,
    FETCH_S,
    THREADING,
    available_cores,
    check_backend,
    check_jobs,
    start_failure,
)
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.runner.cluster import Cluster

Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]
"""Function, arguments and named arguments, see `call`."""
_CALLS_PER_THREAD = 3
_LOOK_EVERY_S = 10.0
"""Time without a result after which is looked whether there are workers [s]."""


@dataclass(frozen=True, slots=True)
class _Asked:
    """A call on a cluster."""

    call: Call
    future: Any
    only: frozenset[str]
    """The workers that it was given to; empty for any."""


def call(function: Callable[..., Any], *arguments: Any, **named: Any) -> Call:
    """Return a call to be made by a `Pool`."""
    return function, arguments, named


class Pool:
    """Yields the results of calls in their order, with a bounded number of calls in progress.

    What is sent to a worker together with a pool gets one that works in the calling thread.

    Parameters
    ----------
    jobs
        Threads; all cores by default. With one job everything runs in the calling thread.
    cluster
        Where to work instead.
    clock
        Gives the time [s].

    Raises
    ------
    TypeError, ValueError
        The number of threads is not a whole number, or out of range.
    """

    def __init__(self, jobs: int | None, cluster: Cluster | None = None, clock: Callable[[], float] = time.monotonic):
        check_jobs(jobs)
        self._clock = clock
        self._jobs, self._cluster = jobs, cluster
        self._fetch_s = FETCH_S

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        """Make the calls.

        Raises
        ------
        BackendError
            The system cannot start as many threads.
        """
        if self._cluster is not None:
            return self._on_cluster(self._cluster, calls)
        calls = iter(calls)
        first = list(itertools.islice(calls, 2))
        calls = itertools.chain(first, calls)
        if self._jobs == 1 or len(first) < 2:
            return (function(*arguments, **named) for function, arguments, named in calls)
        import joblib  # a quarter of the time of a short question

        try:
            return joblib.Parallel(n_jobs=self._jobs or -1, backend="threading", return_as="generator")(calls)
        except Exception as problem:
            if failure := start_failure(problem, self._jobs):
                raise failure from problem
            raise

    def __reduce__(self) -> tuple[Any, ...]:
        return Pool, (1,)

    def _on_cluster(self, cluster: Cluster, calls: Iterable[Call]) -> Iterator[Any]:
        """Make the calls on a cluster.

        Raises
        ------
        ClusterLostError
            The scheduler or the workers are gone.
        """
        from boulder_sweep.runner.silence import Silence

        silence = Silence(cluster)
        most = _CALLS_PER_THREAD * max(sum(cluster.threads().values()), 1)
        waiting: deque[_Asked] = deque()

        def submitted(call: Call) -> _Asked:
            """Hand a call to the workers that are not silent."""
            only = sorted(cluster.threads().keys() - silence.silent) if silence.silent else None
            function, arguments, options = call
            future = cluster.client.submit(function, *arguments, **options, workers=only, pure=False)
            return _Asked(call, future, frozenset(only or ()))

        def first_of() -> Any:
            """Look for silent workers, give their calls to others, and return the future of the first call."""
            in_flight = {asked.future: asked.only for asked in waiting}
            for hung in silence.look(self._clock(), in_flight):
                place = next(k for k, asked in enumerate(waiting) if asked.future is hung)
                hung.release()
                waiting[place] = submitted(waiting[place].call)
            return waiting[0].future

        for call in calls:
            waiting.append(submitted(call))
            if len(waiting) >= most:
                yield self._result(cluster, waiting[0].future, first_of)
                waiting.popleft()
        while waiting:
            yield self._result(cluster, waiting[0].future, first_of)
            waiting.popleft()

    def _result(self, cluster: Cluster, future: Any, renewed: Callable[[], Any] | None = None) -> Any:
        """Wait for a result; a worker that dies or hangs is replaced by another as long as there is one.

        Parameters
        ----------
        cluster, future
            What is waited for.
        renewed
            Called while it does not come; returns the future that stands for the same call then.
        """
        without_s = 0.0
        while True:
            finished = future.done()
            # Only a result that is there is worth waiting for longer: its worker may be far away.
            patience_s = self._fetch_s if finished else min(self._fetch_s, FETCH_S)
            try:
                if patience_s <= FETCH_S:
                    return future.result(timeout=patience_s)
                return _fetched(future, patience_s, renewed)
            except TimeoutError as late:
                if future.status == "error":  # the call itself ran out of time
                    raise BackendError(f"the workers cannot answer this: {one_line(late)}") from late
                if finished:
                    self._fetch_s *= 2.0
                without_s += patience_s
                if without_s >= _LOOK_EVERY_S:
                    without_s = 0.0
                    if not cluster.threads():
                        raise ClusterLostError(f"{cluster.lost_text()}: no worker is left") from None
                future = future if renewed is None else renewed()
            except BoulderSweepError:
                raise
            except Exception as problem:
                if cluster.client.status != "running":
                    raise ClusterLostError(cluster.lost_text()) from problem
                raise BackendError(f"the workers cannot answer this: {one_line(problem)}") from problem


def _fetched(future: Any, limit_s: float, renewed: Callable[[], Any] | None) -> Any:
    """Fetch a result that may take long, and look meanwhile whether another future stands for the call.

    Raises
    ------
    TimeoutError
        It did not come in time, or is no longer wanted.
    """
    came: queue.SimpleQueue[tuple[Any, Exception | None]] = queue.SimpleQueue()

    def fetch() -> None:
        try:
            came.put((future.result(timeout=limit_s), None))
        except Exception as problem:
            came.put((None, problem))

    threading.Thread(target=fetch, daemon=True).start()
    while True:
        try:
            result, problem = came.get(timeout=FETCH_S)
        except queue.Empty:
            if renewed is not None and renewed() is not future:
                raise TimeoutError from None
            continue
        if problem is not None:
            raise problem
        return result


@contextmanager
def pool(jobs: int | None, backend: str = THREADING, scheduler: str | None = None) -> Iterator[Pool]:
    """Give a pool on a backend; arguments: see `boulder_sweep.run`.

    Raises
    ------
    BackendError
        The workers are not available.
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    """
    check_backend(backend, scheduler)
    if backend != DASK:
        yield Pool(jobs)
        return
    from boulder_sweep.runner.cluster import Cluster

    cluster = Cluster(jobs or available_cores(), scheduler)
    try:
        yield Pool(jobs, cluster)
    finally:
        cluster.close()
