"""What kernels are called with and return, as numbers and arrays; and functions written out for it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

KINDS = {np.dtype(code): code for code in ("f8", "i8", "i1", "b1")}
"""Numbers that an array may hold."""
REAL, WHOLE, TRUTH, NOTHING = "f", "i", "b", "n"
_SCALARS = {float: REAL, np.float64: REAL, int: WHOLE, np.int64: WHOLE, bool: TRUTH, np.bool_: TRUTH}


class UnsuitableError(Exception):
    """A call, or a kernel, that is left to Numba's dispatcher."""


def flatten(value: Any, reals: list[float], wholes: list[int], arrays: list[np.ndarray]) -> str:
    """Append the numbers and arrays of an argument to lists, and return its type as text.

    Raises
    ------
    UnsuitableError
        It is, or holds, something else.
    """
    kind = type(value)
    letter = _SCALARS.get(kind)
    if letter is not None:
        (reals if letter == REAL else wholes).append(value)
        return letter
    if value is None:
        return NOTHING
    if kind is np.ndarray:
        code = KINDS.get(value.dtype)
        if code is None or value.ndim == 0 or not value.flags.c_contiguous:
            raise UnsuitableError
        wholes.extend(value.shape)
        arrays.append(value)
        return f"{code}{value.ndim}"
    if isinstance(value, tuple):
        record: Any = kind
        return f"{name_of(record)}({','.join([flatten(one, reals, wholes, arrays) for one in value])})"
    raise UnsuitableError


@functools.cache
def name_of(kind: Any) -> str:
    """Name by which a type of records is imported; empty for plain tuples."""
    return f"{kind.__module__}:{kind.__qualname__}" if hasattr(kind, "_fields") else ""


def build(returns: Any, numbers: Any) -> Any:
    """Return the value that a kernel returned, from its numbers one after another."""
    if returns == REAL:
        return next(numbers)
    if returns == WHOLE:
        return int(next(numbers))
    if returns == TRUTH:
        return next(numbers) != 0.0
    if returns == NOTHING:
        return None
    name, fields = returns
    values = [build(field, numbers) for field in fields]
    return record_of(name)(*values) if name else tuple(values)


@functools.cache
def record_of(name: str) -> Any:
    """Return a type of records by its name."""
    module, _, inside = name.partition(":")
    return getattr(import_module(module), inside)


def function_of(source: str, **names: Any) -> Callable[..., Any]:
    """Return the function that a source text defines, with the names it refers to: for what `overload` writes out."""
    exec(source, names)
    return names[source[len("def ") : source.index("(")]]
