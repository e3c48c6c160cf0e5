"""Calls of a function on the cores of this machine, by joblib, or on a Dask cluster.

Dask cares for workers that are lost: it makes their calls again, on others. What it gives up ends here in words.
"""

from __future__ import annotations

import itertools
import logging
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from typing import Any

from boulder_sweep.errors import BackendError, BoulderSweepError, ClusterLostError
from boulder_sweep.text import install, one_line

THREADING, DASK = "threading", "dask"
BACKENDS = (THREADING, DASK)
"""Threads of this process: the kernels run without the interpreter's lock. Or a Dask cluster."""
MOST_JOBS = 4096
"""Most workers that may be asked for, more than a machine has cores; starting a million would exhaust it."""
CONNECT_S = 10.0
"""How long to wait for a scheduler, and for a first worker [s]."""
Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]
"""Function, arguments and named arguments, see `call`."""
Fingerprint = tuple[dict[str, str], str, str]
_LOOK_EVERY_S = 0.5
_AHEAD = 3
"""Calls for each thread of a cluster that are sent at once, so that none is without work meanwhile."""
_LOOPBACK = "127.0.0.1:0"


def call(function: Callable[..., Any], *arguments: Any, **named: Any) -> Call:
    """Return a call to be made by a `Pool` or a `Cluster`."""
    return function, arguments, named


class Pool:
    """Yields the results of calls, made by threads of this process, with a bounded number of calls in progress.

    All cores by default; with one job everything runs in the calling thread. See `check_jobs` for other numbers.
    """

    def __init__(self, jobs: int | None):
        check_jobs(jobs)
        self._jobs = jobs

    def __call__(self, calls: Iterable[Call], *, in_order: bool = True) -> Iterator[Any]:
        """Make the calls; results come in their order, or else as they are there."""
        calls = iter(calls)
        first = list(itertools.islice(calls, 2))
        calls = itertools.chain(first, calls)
        if self._jobs == 1 or len(first) < 2:
            return (function(*arguments, **named) for function, arguments, named in calls)
        import joblib  # a quarter of the time of a short question

        how = "generator" if in_order else "generator_unordered"
        threads = joblib.Parallel(n_jobs=self._jobs or -1, backend=THREADING, return_as=how, batch_size=1)
        results: Iterator[Any] = threads(calls)
        return results


class Cluster:
    """Yields the results of calls, made by the workers of a Dask cluster, as they are there.

    Some calls for each thread wait there, more where threads come. They go to Dask itself: by joblib's backend, a
    cluster that has one thread to begin with would get nothing to do, and calls that Dask has given up would be waited
    for without end.
    """

    def __init__(self, client: Any):
        self._client = client

    @property
    def jobs(self) -> int:
        """Threads that work side by side."""
        return max(sum(self._client.ncores().values()), 1)

    def __call__(self, calls: Iterable[Call], shared: Any = None) -> Iterator[Any]:
        """Make the calls; an argument that they share is sent once.

        Raise BackendError where the workers cannot make a call, ClusterLostError where they or the scheduler are gone.
        """
        try:
            yield from self._results(iter(calls), shared)
        except BoulderSweepError:
            raise
        except Exception as problem:  # what a call raises, or Dask instead
            if self._client.status != "running":
                raise ClusterLostError("the connection to the Dask scheduler was lost") from problem
            if type(problem).__module__.startswith("distributed"):
                said = f"its workers were lost ({type(problem).__name__})"
                raise ClusterLostError(f"Dask has given up a part of the work: {said}") from problem
            raise BackendError(f"the workers cannot compute this: {one_line(problem)}") from problem

    def _results(self, calls: Iterator[Call], shared: Any) -> Iterator[Any]:
        from distributed import wait

        client, waiting = self._client, list[Any]()
        sent = client.scatter(shared, broadcast=True, hash=False)
        while True:
            if len(waiting) < (threads := self.jobs):
                for function, arguments, named in itertools.islice(calls, _AHEAD * threads):
                    given = [sent if one is shared else one for one in arguments]
                    waiting.append(client.submit(function, *given, **named, pure=False))
            if not waiting:
                return
            with suppress(TimeoutError), client.as_current():
                wait(waiting, timeout=_LOOK_EVERY_S, return_when="FIRST_COMPLETED")
            ended = [one for one in waiting if one.done()]
            waiting = [one for one in waiting if one not in ended]
            for one in ended:
                yield one.result()


@contextmanager
def cluster(jobs: int | None, scheduler: str | None) -> Iterator[Cluster]:
    """Connect to the cluster of a scheduler, or give one of so many threads within this process.

    Raise BackendError where the workers are not available.
    """
    try:
        distributed = import_module("distributed")  # an extra: most users have no cluster
    except ImportError:
        raise BackendError(f"the backend dask needs a package: {install('dask')}") from None
    with _silenced_loggers():
        ends: list[Callable[..., Any]] = []
        try:
            if scheduler is None:
                own = _local_cluster(distributed, jobs or available_cores())
                ends += [partial(_end_worker, own, worker) for worker in own.workers.values()]
                ends.append(own.close)
                client = distributed.Client(own, set_as_default=False)
            else:
                client = _connected(distributed, scheduler)
            ends.insert(0, client.close)
            if scheduler is not None:
                _wait_for_worker(client, scheduler)
            yield Cluster(client)
        finally:
            for end in ends:
                with suppress(Exception):  # a scheduler that died cannot be told
                    end(timeout=2)


def _local_cluster(distributed: Any, jobs: int) -> Any:
    """Start a scheduler and a worker in this process, reachable from this machine only."""
    with warnings.catch_warnings():  # a machine without a network is no reason for a warning
        warnings.filterwarnings("ignore", "Couldn't detect a suitable IP address", RuntimeWarning)
        return distributed.LocalCluster(
            processes=False,
            n_workers=1,
            threads_per_worker=jobs,
            dashboard_address=_LOOPBACK,
            worker_dashboard_address=_LOOPBACK,
        )


def _end_worker(cluster: Any, worker: Any, timeout: float) -> None:
    """End a worker of this process; wait for what its threads have in hand, so that no unfinished file is left."""
    cluster.sync(worker.close, timeout=timeout, callback_timeout=timeout)


def _connected(distributed: Any, scheduler: str) -> Any:
    """Connect to a scheduler."""
    try:
        return distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as problem:
        raise BackendError(f"no Dask scheduler answers at {scheduler}: {one_line(problem)}") from problem


def _wait_for_worker(client: Any, scheduler: str) -> None:
    """Wait for a worker; the scheduler of an adaptive cluster starts one when there is work."""
    work = client.submit(int, pure=False)
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        text = f"the Dask scheduler at {scheduler} has no worker; start one with: dask worker {scheduler}"
        raise BackendError(text) from None
    work.release()


def fingerprint() -> Fingerprint:
    """Return versions and hashes of the code that computes here."""
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    return versions(), kernels_sha256(), rules_sha256()


def refuse_other_versions(there: Fingerprint) -> None:
    """Refuse by BackendError to compute here, on a worker, for a machine with other versions."""
    if fingerprint() != there:
        raise BackendError(
            "a worker and this machine have different versions of boulder-sweep, Python or NumPy, or processors that "
            "differ in the last bits (with and without fused multiply-add); install the same versions everywhere, on "
            "processors of one kind"
        )


@contextmanager
def _silenced_loggers() -> Iterator[None]:
    """Silence the loggers of Dask, whose messages the errors of a run replace."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    loggers = [logging.getLogger(name) for name in (*names, "tornado.application", "asyncio")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def available_cores() -> int:
    """Return how many cores this process may use."""
    import joblib

    return joblib.cpu_count()


def check_backend(backend: str, scheduler: str | None) -> None:
    """Refuse an unknown backend, and the address of a scheduler without Dask, by BackendError."""
    if backend not in BACKENDS:
        raise BackendError(f"unknown backend {backend!r}: choose one of {', '.join(BACKENDS)}")
    if scheduler is not None and backend != DASK:
        raise BackendError(f"a scheduler address needs the backend dask, not {backend}")


def check_jobs(jobs: int | None) -> None:
    """Raise TypeError where a number of workers is not whole, ValueError where it is not from 1 to `MOST_JOBS`."""
    if jobs is None:
        return
    if not isinstance(jobs, int) or isinstance(jobs, bool):
        raise TypeError(f"jobs must be a whole number, not {type(jobs).__name__}")
    if not 1 <= jobs <= MOST_JOBS:
        raise ValueError(f"jobs must be at {'least 1' if jobs < 1 else f'most {MOST_JOBS:,}'}, not {jobs:,}")
