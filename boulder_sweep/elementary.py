"""Elementary functions of arrays that have the same bits on every processor of one architecture.

NumPy computes tan, arctan, exp and log of many numbers at once by other formulas where vectors are wider, and
these differ in the last bits. Tables must not: here every number is worked out by itself, by the C library, which takes
some 70 ns. Only what ends in a table needs it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np


def _one_by_one(function: Callable[[float], float]) -> Callable[[Any], Any]:
    """Return a function of arrays from one of numbers; NaN gives NaN."""
    of_all = np.frompyfunc(function, 1, 1)

    def of_arrays(values: Any) -> Any:
        return np.asarray(of_all(values), dtype=np.float64)[()]

    return of_arrays


tan, arctan, exp, log = (_one_by_one(function) for function in (math.tan, math.atan, math.exp, math.log))
