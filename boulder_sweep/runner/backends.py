"""Where blocks are computed: threads of this process, or a Dask cluster.

Threads are the default: the kernels run without the interpreter's lock, and nothing has to be copied. A Dask
cluster reaches other processes and other machines.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from boulder_sweep.errors import BackendError

BACKENDS = ("threading", "dask")
_CONNECT_S = "10s"
_NOISY_LOGGERS = ("concurrent.futures", "distributed", "distributed.worker.state_machine")
"""Loggers that report cancelled work as an error."""


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
        Address of a Dask scheduler; None for workers in this process.

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
        self._levels: dict[str, int] = {}
        self._client = _dask_client(jobs, scheduler) if name == "dask" else None
        if self._client is not None and scheduler is not None:
            self.jobs = max(sum(self._client.nthreads().values()), 1)

    @contextmanager
    def pool(self) -> Iterator[Any]:
        """Give a `joblib.Parallel` that yields results in the order in which they are ready."""
        import joblib

        settings: dict[str, Any] = {
            "n_jobs": self.jobs,
            "return_as": "generator_unordered",
            "batch_size": 1,
            "pre_dispatch": "2*n_jobs",
        }
        if self._client is None:
            with joblib.Parallel(backend=self.name, **settings) as parallel:
                yield parallel
        else:
            with (
                joblib.parallel_config(backend="dask", client=self._client),
                joblib.Parallel(**settings) as parallel,
            ):
                yield parallel

    def silence(self) -> None:
        """Silence library warnings about work that is cancelled, until `close`."""
        for name in _NOISY_LOGGERS:
            logger = logging.getLogger(name)
            self._levels.setdefault(name, logger.level)
            logger.setLevel(logging.CRITICAL)

    def close(self) -> None:
        """Release all workers."""
        if self._client is not None:
            self._client.close()
            self._client = None
        for name, level in self._levels.items():
            logging.getLogger(name).setLevel(level)
        self._levels.clear()


def _dask_client(jobs: int, scheduler: str | None) -> Any:
    """Connect to a cluster, or start one of threads in this process."""
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
    # Rows of different kernels or versions must not be mixed, wherever they are computed.
    here = _fingerprint()
    different = [address for address, there in client.run(_fingerprint).items() if tuple(there) != here]
    if different:
        client.close()
        raise BackendError(
            f"the workers {', '.join(different)} have another version of boulder-sweep, Python or NumPy than "
            f"this machine; install the same versions everywhere"
        )
    return client


def _fingerprint() -> tuple[dict[str, str], str, str]:
    """Return versions and hashes of the code that computes here."""
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    return versions(), kernels_sha256(), rules_sha256()
