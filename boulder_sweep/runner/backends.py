"""Names of the backends, and how many workers this machine has."""

from __future__ import annotations

from boulder_sweep.errors import BackendError

THREADING, DASK = "threading", "dask"
BACKENDS = (THREADING, DASK)
"""Threads of this process: the kernels run without the interpreter's lock. Or a Dask cluster."""
MOST_JOBS = 4096
"""Most workers that may be asked for, more than a machine has cores; starting a million would exhaust it."""
FETCH_S = 2.0
"""How long to wait for a result that a worker of a cluster has finished; twice as long after each time that this was
too short [s].

If a worker dies between finishing a task and handing over the result, the scheduler may try to reach it for 30 s,
Dask's limit for a connection. Asked again, it gives the result of the worker that has computed the task anew.
"""


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


def start_failure(problem: BaseException, jobs: int | None) -> BackendError | None:
    """Return the error to raise if a pool failed because the system starts no more threads, None otherwise.

    `multiprocessing` then stumbles over the threads it has started, which cannot be terminated; the cause is the
    context of its error.
    """
    cause: BaseException | None = problem
    while cause is not None:
        if isinstance(cause, RuntimeError) and "can't start new thread" in str(cause):
            wanted = "a thread for every core" if jobs is None else f"{jobs:,} threads"
            return BackendError(f"the system cannot start {wanted}; give a smaller number of --jobs")
        cause = cause.__cause__ or cause.__context__
    return None
