"""Calls of a function on the cores of this machine or on a Dask cluster, for answers that are not rows of a sweep."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from boulder_sweep.errors import BackendError, BoulderSweepError
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.runner.cluster import Cluster
    from boulder_sweep.runner.dispatch import Task

THREADING, DASK = "threading", "dask"
BACKENDS = (THREADING, DASK)
"""Threads of this process: the kernels run without the interpreter's lock. Or a Dask cluster."""
MOST_JOBS = 4096
"""Most workers that may be asked for, more than a machine has cores; starting a million would exhaust it."""
Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]
"""Function, arguments and named arguments, see `call`."""
_CALLS_PER_THREAD = 3
"""Calls on a cluster whose results were not yielded yet."""


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

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        """Make the calls.

        Raises
        ------
        BackendError
            The system cannot start as many threads, or the workers of a cluster cannot make a call.
        ClusterLostError
            The scheduler or the workers are gone.
        """
        if self._cluster is not None:
            return self._on_cluster(self._cluster, calls)
        calls = iter(calls)
        first = list(itertools.islice(calls, 2))
        calls = itertools.chain(first, calls)
        if self._jobs == 1 or len(first) < 2:
            return (function(*arguments, **named) for function, arguments, named in calls)
        import joblib  # a quarter of the time of a short question

        with telling_start_failure(self._jobs):
            return joblib.Parallel(n_jobs=self._jobs or -1, backend="threading", return_as="generator")(calls)

    def __reduce__(self) -> tuple[Any, ...]:
        return Pool, (1,)

    def _on_cluster(self, cluster: Cluster, calls: Iterable[Call]) -> Iterator[Any]:
        """Make the calls on a cluster."""
        from boulder_sweep.runner.dispatch import Dispatcher, Task

        dispatcher: Dispatcher[int] = Dispatcher(cluster, clock=self._clock)
        numbered = enumerate(calls)
        results: dict[int, Any] = {}
        first = submitted = 0

        def next_task() -> Task[int] | None:
            """Return the next call, unless there are results enough that wait for the one of an earlier call."""
            nonlocal submitted
            if submitted - first >= _CALLS_PER_THREAD * max(dispatcher.threads, 1):
                return None
            number, one = next(numbered, (-1, None))
            if one is None:
                return None
            submitted = number + 1
            return Task(number, *one)

        for number, result, problem in dispatcher.outcomes(next_task):
            if isinstance(problem, BoulderSweepError):
                raise problem
            if problem is not None:
                raise BackendError(f"the workers cannot answer this: {one_line(problem)}") from problem
            results[number] = result
            while first in results:
                yield results.pop(first)
                first += 1


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


def available_cores() -> int:
    """Return how many cores this process may use."""
    import joblib

    return joblib.cpu_count()


def check_backend(backend: str, scheduler: str | None) -> None:
    """Refuse backends that do not exist.

    Raises
    ------
    BackendError
        Unknown name, or the address of a scheduler without Dask.
    """
    if backend not in BACKENDS:
        raise BackendError(f"unknown backend {backend!r}: choose one of {', '.join(BACKENDS)}")
    if scheduler is not None and backend != DASK:
        raise BackendError(f"a scheduler address needs the backend dask, not {backend}")


def check_jobs(jobs: int | None) -> None:
    """Refuse a number of workers that is not a whole number, below one, or above `MOST_JOBS`.

    Raises
    ------
    TypeError, ValueError
        Says what is allowed.
    """
    check_count("jobs", 1 if jobs is None else jobs)
    if jobs is not None and jobs > MOST_JOBS:
        raise ValueError(f"jobs must be at most {MOST_JOBS:,}, not {jobs:,}")


def check_count(name: str, count: int) -> None:
    """Refuse a count that is not a whole number, or below one; raises as `check_jobs`."""
    if not isinstance(count, int) or isinstance(count, bool):
        raise TypeError(f"{name} must be a whole number, not {type(count).__name__}")
    if count < 1:
        raise ValueError(f"{name} must be at least 1, not {count}")


@contextmanager
def telling_start_failure(jobs: int | None) -> Iterator[None]:
    """Turn what fails because the system starts no more threads into an error for the user.

    `multiprocessing` then stumbles over the threads it has started, which cannot be terminated; the cause is the
    context of its error.

    Raises
    ------
    BackendError
        The system starts no more threads.
    """
    try:
        yield
    except BoulderSweepError:
        raise
    except Exception as problem:
        cause: BaseException | None = problem
        while cause is not None:
            if isinstance(cause, RuntimeError) and "can't start new thread" in str(cause):
                wanted = "a thread for every core" if jobs is None else f"{jobs:,} threads"
                text = f"the system cannot start {wanted}; give a smaller number of --jobs"
                raise BackendError(text) from problem
            cause = cause.__cause__ or cause.__context__
        raise
