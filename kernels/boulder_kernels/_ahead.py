"""Calls of kernels from Python without Numba: each is compiled once on a machine, to a library of its own.

What a kernel is called with decides what is compiled: the types of numbers and arrays, and of records the fields. All
numbers of a call are passed in two arrays, one of reals and one of whole numbers, and arrays by address; a record that
is returned comes back in a third. A library is found by the name of the kernel and these types, in a folder that is
named by the sources of all kernels, the processor and the version of the compiler, so that it is never out of date. It
is linked by the C compiler of the machine; where there is none, LLVM loads the code as it is.

What cannot be called so, such as a kernel that returns an array, is left to Numba's own dispatcher. The bits are the
same: the code is the same.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib
import importlib.util
import json
import os
import platform
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import _jit

KINDS = {np.dtype(np.float64): "f8", np.dtype(np.int64): "i8", np.dtype(np.int8): "i1", np.dtype(np.bool_): "b1"}
"""Numbers that an array may hold."""
REAL, WHOLE, TRUTH, NOTHING = "f", "i", "b", "n"
_SCALARS = {float: REAL, np.float64: REAL, int: WHOLE, np.int64: WHOLE, bool: TRUTH, np.bool_: TRUTH}
ENTRY = "entry"
"""Name of the function in a library."""
LIBRARY, OBJECT, RETURNS = ".so", ".o", ".json"
_COMPILING = threading.RLock()


class UnsuitableError(Exception):
    """A call, or a kernel, that is left to Numba's dispatcher."""


class Native(NamedTuple):
    """A compiled kernel."""

    call: Any
    """The function, of ctypes."""
    returns: Any
    """What comes back: one of the letters above, or the name of a record and what its fields are."""
    numbers: int
    """How many numbers that is."""
    library: Any
    """What must stay loaded."""


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
    return getattr(importlib.import_module(module), inside)


def call(kernel: Any, arguments: tuple[Any, ...]) -> Any:
    """Call a kernel of this package.

    Parameters
    ----------
    kernel
        The `boulder_kernels._jit.Kernel`.
    arguments
        Numbers, arrays and records of these.

    Raises
    ------
    UnsuitableError
        It is left to Numba's dispatcher.
    """
    reals: list[float] = []
    wholes: list[int] = []
    arrays: list[np.ndarray] = []
    types = ",".join([flatten(value, reals, wholes, arrays) for value in arguments])
    native = kernel.natives.get(types)
    if native is None:
        native = kernel.natives[types] = _found(kernel, types, arguments)
    if native is UNSUITABLE:
        raise UnsuitableError
    out = (ctypes.c_double * native.numbers)()
    status = native.call(
        ctypes.byref(ctypes.c_void_p()),
        ctypes.byref(ctypes.c_void_p()),
        (ctypes.c_double * len(reals))(*reals),
        (ctypes.c_int64 * len(wholes))(*wholes),
        *[array.__array_interface__["data"][0] for array in arrays],
        out,
    )
    if status:
        raise RuntimeError(f"the kernel {kernel.py_func.__qualname__} ended with the status {status}")
    return build(native.returns, iter(out))


UNSUITABLE: Any = object()


def _found(kernel: Any, types: str, arguments: tuple[Any, ...]) -> Any:
    """Return a compiled kernel, compiled now if it is not on the disk; `UNSUITABLE` where it cannot be."""
    with _COMPILING:
        place = folder()
        file = None if place is None else place / file_name(kernel, types)
        if file is not None and file.with_suffix(RETURNS).exists():
            try:
                return loaded(file)
            except OSError:  # the other half is missing, or cannot be loaded: compiled again
                pass
        from . import _numba

        try:
            return _numba.compiled_ahead(kernel, arguments, types, file)
        except UnsuitableError:
            return UNSUITABLE


def file_name(kernel: Any, types: str) -> str:
    """Name of the files of a compiled kernel, without their endings."""
    function = kernel.py_func
    digest = hashlib.sha256(types.encode()).hexdigest()
    return f"{function.__module__.rpartition('.')[2]}-{function.__qualname__}-{digest[:16]}"


def loaded(file: Path) -> Native:
    """Load a compiled kernel.

    Raises
    ------
    OSError
        It is not there.
    """
    kept = json.loads(file.with_suffix(RETURNS).read_text())
    library = file.with_suffix(LIBRARY)
    if library.exists():
        return native_of(ctypes.CDLL(str(library)), kept)
    from . import _llvm

    return native_of(_llvm.loaded(file.with_suffix(OBJECT).read_bytes()), kept)


def native_of(library: Any, kept: dict[str, Any]) -> Native:
    """Return the kernel of a library that has been loaded; `kept` is what was written beside it."""
    function = library[ENTRY]
    pointer = ctypes.c_void_p
    function.argtypes = [pointer] * (5 + kept["arrays"])
    function.restype = ctypes.c_int32
    return Native(function, kept["returns"], kept["numbers"], library)


def folder() -> Path | None:
    """Return the folder for this processor and compiler; None where compiled code is not kept."""
    if _jit.CACHE_FOLDER is None:
        return None
    return Path(_jit.CACHE_FOLDER) / f"native-{machine_hash()[:16]}"


def target() -> str:
    """Return what the bits of results depend on beside the sources.

    Processors of one architecture give the same bits if both have fused multiply-add, or neither: wider registers only
    take more designs at once.
    """
    fused = any(line.startswith("flags") and "fma" in line.split() for line in processor())
    named = [os.environ[name] for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES") if os.environ.get(name)]
    return " ".join([f"{platform.machine()}{'+fma' if fused else ''}", *named])


@functools.cache
def processor() -> tuple[str, ...]:
    """Return what tells the kind of processor and its features, line by line."""
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8", errors="replace") as described:
            first = described.read(16_384).partition("\n\n")[0]
    except OSError:
        return (platform.processor(),)
    return tuple(line for line in first.splitlines() if line.startswith(("model name", "flags", "Features", "CPU ")))


@functools.cache
def machine_hash() -> str:
    """Hash of what code depends on beside the sources: processor, compiler and its settings."""
    parts = [platform.machine(), platform.system(), *processor()]
    parts += [f"{name}={value}" for name, value in sorted(os.environ.items()) if name.startswith("NUMBA_")]
    for package in ("numba", "llvmlite"):
        found = importlib.util.find_spec(package)
        if found is not None and found.origin is not None:
            version = Path(found.origin).with_name("_version.py").stat()
            parts.append(f"{package} {version.st_size} {version.st_mtime_ns}")
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def is_compiled(kernel: str, types: str = "") -> bool:
    """Whether a kernel, such as ``lanes.run_lanes``, has been compiled on this machine for some types.

    Parameters
    ----------
    kernel
        Its module and its name.
    types
        Part of the types that it was compiled for, as `flatten` gives them.
    """
    place = folder()
    if place is None:
        return False
    return any(
        types in json.loads(file.read_text())["types"] for file in place.glob(f"{kernel.replace('.', '-')}-*{RETURNS}")
    )
