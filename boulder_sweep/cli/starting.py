"""What the command line skips at start-up; programs that import the package keep all of it."""

from __future__ import annotations

import atexit
import ctypes
import gc
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec
from types import ModuleType

THREADS_OF_OPENBLAS = "OPENBLAS_NUM_THREADS"
ALLOCATOR_OF_ARROW = "ARROW_DEFAULT_MEMORY_POOL"
_ASKS_FOR_BLAS = "numba.np.arraymath"
"""The module of Numba that imports scipy.linalg to find out whether compiled code can multiply matrices."""
_OBJECTS_BETWEEN_COLLECTIONS = 250_000
"""How many new objects Python's search for unused circles of objects waits for; by default 700."""
_ALLOCATOR = {-8: 1, -3: 32 << 20, -1: 256 << 20}
"""M_ARENA_MAX, M_MMAP_THRESHOLD and M_TRIM_THRESHOLD of the GNU C library: one heap for all threads, also for arrays of
up to 32 MB, which gives memory back once there are 256 MB of it."""


class _NoMatrices:
    """Answers Numba's question for a BLAS with no when it is about to be asked; finds no module itself."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Note the import of the module that asks."""
        if name == _ASKS_FOR_BLAS:
            from numba.np import linalg

            linalg.ensure_blas = _no_blas
        return None


def _no_blas() -> None:
    """Refuse a BLAS, in the way that Numba expects."""
    raise ImportError("the command sweep starts without the linear algebra of SciPy")


def start_light() -> None:
    """Halve the time of a short command, before anything heavy is imported.

    No kernel multiplies matrices, but at its start Numba imports scipy.linalg to see whether one could. NumPy's own
    linear algebra starts a thread for each core, and the systems solved here have a few unknowns; a number of threads
    that the user has set stands. Imports make hundreds of thousands of objects that stay until the end. By default
    Python searches them for unused ones hundreds of times, and thrice more at the end, where the system takes all back.
    The arrays of one block are as large as those of the next. By default each thread and Arrow have a heap of their
    own, and the system gets freed arrays back and clears them anew: more memory by a fifth, and twice the page faults.
    """
    os.environ.setdefault(THREADS_OF_OPENBLAS, "1")
    os.environ.setdefault(ALLOCATOR_OF_ARROW, "system")
    with suppress(OSError, AttributeError, TypeError):  # another C library
        for parameter, value in _ALLOCATOR.items():
            ctypes.CDLL(None).mallopt(parameter, value)
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    atexit.register(gc.freeze)
    sys.meta_path.insert(0, _NoMatrices())
