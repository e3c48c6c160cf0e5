"""The connection to a Dask cluster: a scheduler, and workers of the same versions as this machine."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import partial
from importlib import import_module
from typing import Any

from boulder_sweep.errors import BackendError, ClusterLostError
from boulder_sweep.text import one_line

CONNECT_S = 10.0
"""How long to wait for a scheduler to answer [s]."""
FIRST_WORKER_S = 10.0
"""How long to wait for a first worker [s]."""
_LAG_S = 5.0
"""How far the last heartbeat of a worker that does not answer is behind those of others [s]."""
_LOOPBACK = "127.0.0.1:0"

Fingerprint = tuple[dict[str, str], str, str]


class Cluster:
    """A connection to a Dask scheduler.

    Parameters
    ----------
    jobs
        Threads of the worker to start where no scheduler is given.
    scheduler
        Address of a running scheduler; None to start one in this process, reachable from this machine only.

    Attributes
    ----------
    silent : set of str
        Workers that did not answer at the beginning, or were silent when they were last looked at.

    Raises
    ------
    BackendError
        Dask is not installed, the scheduler does not answer, it has no worker, or a worker has other versions.
    """

    def __init__(self, jobs: int, scheduler: str | None):
        self.address = scheduler
        self._levels: dict[str, int] = {}
        self._local: Any = None
        self.client: Any = None
        self.silent: set[str] = set()
        try:
            self.client = self._connected(jobs, scheduler)
        except BaseException:
            self.close()
            raise

    def _connected(self, jobs: int, scheduler: str | None) -> Any:
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
                    dashboard_address=_LOOPBACK,
                    worker_dashboard_address=_LOOPBACK,
                )
                return distributed.Client(self._local, set_as_default=False)
        try:
            client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as problem:
            raise BackendError(f"no Dask scheduler answers at {scheduler}: {one_line(problem)}") from problem
        try:
            _wait_for_a_worker(client, scheduler)
            fingerprints, self.silent = answers(client, fingerprint, CONNECT_S)
            check_fingerprints(fingerprints)
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
        return _seen(self._asked(self.client.scheduler.identity))

    def tasks_of(self, workers: Collection[str]) -> set[str]:
        """Return the keys of the tasks that workers have, and of the results that they hold; raises as `threads`."""
        tasks: set[str] = set()
        for question in (self.client.scheduler.processing, self.client.scheduler.has_what):
            for worker, keys in self._asked(question).items():
                tasks.update(keys if worker in workers else ())
        return tasks

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
        raise BackendError(no_worker_text(address)) from None


def no_worker_text(address: str | None) -> str:
    """Say that there is no worker and how to start one."""
    if address is None:
        return "the Dask worker of this process has ended"
    return f"the Dask scheduler at {address} has no worker; start one with: dask worker {address}"


def _silenced_loggers() -> dict[str, int]:
    """Silence the loggers of Dask, whose messages the notes of a run replace; return their levels."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = {}
    for name in (*names, "tornado.application", "asyncio"):
        logger = logging.getLogger(name)
        levels[name] = logger.level
        logger.setLevel(logging.CRITICAL + 1)
    return levels


def _seen(identity: Mapping[str, Any]) -> dict[str, float]:
    """Return when a scheduler last heard of every worker, from what it tells of itself [s]."""
    return {worker: float(record["last_seen"]) for worker, record in identity["workers"].items()}


def answers(client: Any, function: Callable[[], Any], limit_s: float) -> tuple[dict[str, Any], set[str]]:
    """Call a function on every worker.

    Returns
    -------
    dict
        The result or the exception of every worker that answers.
    set of str
        Workers that are silent.

    Raises
    ------
    BackendError
        No worker answers in time.
    TimeoutError
        The scheduler does not answer.
    """
    silent: set[str] = set()
    workers: list[str] | None = None
    while True:
        # What `client.run` does, but for the limit of time: the scheduler waits for every worker.
        ask = partial(client._run, function, workers=workers, on_error="return")
        try:
            return client.sync(ask, callback_timeout=limit_s), silent
        except TimeoutError:
            last_seen = _seen(client.sync(client.scheduler.identity, callback_timeout=limit_s))
        newest = max(last_seen.values(), default=0.0)
        workers = [worker for worker, moment in last_seen.items() if newest - moment <= _LAG_S]
        if silent >= last_seen.keys() - set(workers):
            raise BackendError("no worker of the Dask scheduler answers: look whether they hang, and start others")
        silent = last_seen.keys() - set(workers)


def fingerprint() -> Fingerprint:
    """Return versions and hashes of the code that computes here."""
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    return versions(), kernels_sha256(), rules_sha256()


def check_fingerprints(fingerprints: Mapping[str, Any]) -> None:
    """Refuse workers whose rows could differ from those of this machine; one that leaves meanwhile does not matter.

    Parameters
    ----------
    fingerprints
        What every worker has answered to `fingerprint`, or the exception.

    Raises
    ------
    BackendError
        Names them.
    """
    here, different = fingerprint(), []
    for address, there in fingerprints.items():
        if isinstance(there, Exception):
            if not isinstance(there, OSError):
                raise BackendError(f"the worker {address} cannot compute: {one_line(there)}")
        elif tuple(there) != here:
            different.append(address)
    if different:
        raise BackendError(other_versions_text(f"the workers {', '.join(different)}"))


def other_versions_text(who: str) -> str:
    """Say that versions differ."""
    return (
        f"{who} and this machine have different versions of boulder-sweep, Python or NumPy, or processors that differ "
        f"in the last bits (with and without fused multiply-add); install the same versions everywhere, on processors "
        f"of one kind"
    )
