"""Calls of a function on the cores of this machine or on a Dask cluster, for answers that are not rows of a sweep."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
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
"""Function, arguments and named arguments, as `joblib.delayed` gives them."""
_CALLS_PER_THREAD = 3
_LOOK_EVERY_S = 10.0
"""Time without a result after which is looked whether there are workers [s]."""


class Pool:
    """Yields the results of calls in their order, with a bounded number of calls in progress.

    What is sent to a worker together with a pool gets one that works in the calling thread.

    Parameters
    ----------
    jobs
        Threads; all cores by default. With one job everything runs in the calling thread.
    cluster
        Where to work instead.

    Raises
    ------
    TypeError, ValueError
        The number of threads is not a whole number, or out of range.
    """

    def __init__(self, jobs: int | None, cluster: Cluster | None = None):
        check_jobs(jobs)
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
        import joblib

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
        most = _CALLS_PER_THREAD * max(sum(cluster.threads().values()), 1)
        waiting: deque[Any] = deque()
        for function, arguments, options in calls:
            waiting.append(cluster.client.submit(function, *arguments, **options, pure=False))
            if len(waiting) >= most:
                yield self._result(cluster, waiting.popleft())
        while waiting:
            yield self._result(cluster, waiting.popleft())

    def _result(self, cluster: Cluster, future: Any) -> Any:
        """Wait for a result; a worker that dies is replaced by another as long as there is one."""
        without_s = 0.0
        while True:
            finished, patience_s = future.done(), self._fetch_s
            try:
                return future.result(timeout=patience_s)
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
            except BoulderSweepError:
                raise
            except Exception as problem:
                if cluster.client.status != "running":
                    raise ClusterLostError(cluster.lost_text()) from problem
                raise BackendError(f"the workers cannot answer this: {one_line(problem)}") from problem


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
