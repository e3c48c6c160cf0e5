"""Names of the backends, and how many workers this machine has."""

from __future__ import annotations

from boulder_sweep.errors import BackendError

THREADING, DASK = "threading", "dask"
BACKENDS = (THREADING, DASK)
"""Threads of this process: the kernels run without the interpreter's lock. Or a Dask cluster."""


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
