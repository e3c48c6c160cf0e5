"""Where blocks are computed: threads of this process, processes of this machine, or a Dask cluster.

Threads are the default: the kernels run without the interpreter's lock, and nothing has to be copied.
Processes (loky) survive the death of a worker. A Dask cluster reaches other machines. Whatever happens to
this process, no worker outlives it.
"""

from __future__ import annotations

import logging
import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

from boulder_sweep.errors import BackendError
from boulder_sweep.runner.processes import Work, begin_worker, new_exchange

BACKENDS = ("threading", "loky", "dask")
_CONNECT_S = "10s"
_PATIENCE_S = 1.0
_COMPLAINERS = ("concurrent.futures", "distributed", "distributed.worker.state_machine")
"""Loggers that report cancelled work as if it were a mistake."""


def available_cores() -> int:
    """Return how many cores this process may use."""
    import joblib

    return joblib.cpu_count()


class Backend:
    """One way of computing blocks in parallel, by joblib.

    Parameters
    ----------
    name
        One of `BACKENDS`.
    jobs
        How many blocks are computed at once.
    scheduler
        Address of a Dask scheduler; None for workers of this process' own.

    Raises
    ------
    BackendError
        Unknown name, Dask not installed, or the scheduler cannot be reached.
    """

    def __init__(self, name: str, jobs: int, scheduler: str | None = None):
        if name not in BACKENDS:
            raise BackendError(f"unknown backend {name!r}: choose one of {', '.join(BACKENDS)}")
        if scheduler is not None and name != "dask":
            raise BackendError(f"a scheduler address needs the backend dask, not {name}")
        self.name = name
        self.jobs = jobs
        self.in_processes = name == "loky" and jobs > 1
        """Whether blocks are computed by other processes of this machine; a single one would be this one."""
        self.exchange = new_exchange() if self.in_processes else None
        """Folder through which those hand over their results."""
        self._levels: dict[str, int] = {}
        self._client = _dask_client(jobs, scheduler) if name == "dask" else None
        if self._client is not None and scheduler is not None:
            self.jobs = max(sum(self._client.nthreads().values()), 1)

    @contextmanager
    def pool(self, work: Work, jobs: int | None = None) -> Iterator[Any]:
        """Give a `joblib.Parallel` that yields results in the order in which they are ready.

        Parameters
        ----------
        work
            What worker processes are told once, when they begin.
        jobs
            How many workers; as many as the backend has by default.
        """
        import joblib

        settings: dict[str, Any] = {
            "n_jobs": jobs or self.jobs,
            "return_as": "generator_unordered",
            "batch_size": 1,
            "pre_dispatch": "2*n_jobs",
        }
        if self.in_processes:
            settings |= {"max_nbytes": None, "initializer": begin_worker, "initargs": (os.getpid(), work)}
        if self._client is None:
            settings["backend"] = self.name
            with joblib.Parallel(**settings) as parallel:
                yield parallel
        else:
            with (
                joblib.parallel_config(backend="dask", client=self._client),
                joblib.Parallel(**settings) as parallel,
            ):
                yield parallel

    def kill_workers(self, patience_s: float) -> None:
        """End worker processes of this machine, whatever they are doing.

        Parameters
        ----------
        patience_s
            How long to wait for that; it goes on without waiting afterwards [s].
        """
        if self.in_processes:
            # Beside this thread, because new workers may just be starting, which cannot be hurried.
            killing = threading.Thread(target=_kill_processes, name="killing workers", daemon=True)
            killing.start()
            killing.join(patience_s)

    def abandon(self) -> None:
        """End the workers in the middle of their work, and let nobody complain about that."""
        for name in _COMPLAINERS:
            logger = logging.getLogger(name)
            self._levels.setdefault(name, logger.level)
            logger.setLevel(logging.CRITICAL)
        self.kill_workers(patience_s=0.0)

    def remove_exchange(self) -> None:
        """Remove the folder through which worker processes hand over their results."""
        if self.exchange is not None:
            shutil.rmtree(self.exchange, ignore_errors=True)

    def close(self) -> None:
        """Let all workers go."""
        self.kill_workers(_PATIENCE_S)
        if self._client is not None:
            self._client.close()
            self._client = None
        self.remove_exchange()
        for name, level in self._levels.items():
            logging.getLogger(name).setLevel(level)
        self._levels.clear()


def _kill_processes() -> None:
    """End the worker processes that joblib keeps."""
    from joblib.externals.loky import get_reusable_executor

    with suppress(Exception):  # they may be dying already
        get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=True)


def _dask_client(jobs: int, scheduler: str | None) -> Any:
    """Connect to a cluster, or make one of threads in this process."""
    try:
        Client = import_module("distributed").Client  # an extra: most users have no cluster
    except ImportError:
        raise BackendError("the backend dask needs a package: pip install 'dask[distributed]'") from None
    if scheduler is None:
        return Client(processes=False, n_workers=1, threads_per_worker=jobs, dashboard_address=None)
    try:
        client = Client(scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError) as problem:
        raise BackendError(f"no Dask scheduler answers at {scheduler}: {problem}") from problem
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    # Rows of different kernels or versions must not be mixed, wherever they are computed.
    here = (versions(), kernels_sha256(), rules_sha256())
    there = client.run(_what_computes)
    different = [address for address, what in there.items() if tuple(what) != here]
    if different:
        client.close()
        raise BackendError(
            f"the workers {', '.join(different)} have another version of boulder-sweep, Python or NumPy than "
            f"this machine; install the same everywhere"
        )
    return client


def _what_computes() -> tuple[dict[str, str], str, str]:
    """Return versions and hashes of the code on a worker."""
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    return versions(), kernels_sha256(), rules_sha256()
