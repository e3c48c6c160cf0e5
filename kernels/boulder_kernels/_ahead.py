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

import contextlib
import ctypes
import functools
import hashlib
import json
import tempfile
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import _cache

ENTRY = "entry"
"""Name of the function in a library."""
LIBRARY, OBJECT, RETURNS = ".so", ".o", ".json"
_COMPILING = threading.RLock()
announce: Callable[[str], contextlib.AbstractContextManager[Any]] = contextlib.nullcontext
"""Called with the name of a kernel's files when it must be compiled, which is done within what it returns."""


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


class Native(NamedTuple):
    """A compiled kernel."""

    call: Any
    """The function, of ctypes."""
    returns: Any
    """What comes back: a letter as of `flatten`, or the name of a record and what its fields are."""
    numbers: int
    """How many numbers that is."""
    library: Any
    """What must stay loaded."""


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
        native = kernel.natives[types] = _load_or_compile(kernel, types)
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


def _load_or_compile(kernel: Any, types: str) -> Any:
    """Return a compiled kernel, compiled now if it is not on the disk; `UNSUITABLE` where it cannot be."""
    with _COMPILING:
        name, kept_in = file_name(kernel, types), folder()
        for location in (_cache.shipped_folder(), kept_in):
            if location is not None:
                with contextlib.suppress(UnusableError):
                    return loaded(location / name)
        try:
            with announce(name):
                code, library, kept = kernel.compiler.compiled_ahead(kernel, types)
        except UnsuitableError:
            return UNSUITABLE
        if kept_in is not None:
            # There may be no room on the disk, and what was linked may be for another machine.
            with contextlib.suppress(OSError, UnusableError):
                kept_in.mkdir(mode=0o700, exist_ok=True)
                keep(kept_in / name, code, library, kept)
                return loaded(kept_in / name)
        return native_of(*object_loaded(code), kept)


class UnusableError(Exception):
    """Files of a compiled kernel that are not there, or not whole."""


def keep(file: Path, code: bytes, library: bytes | None, kept: dict[str, Any]) -> None:
    """Write what `boulder_kernels._numba.compiled_ahead` returns beside each other, under a name without ending."""
    ending, content = (OBJECT, code) if library is None else (LIBRARY, library)
    put(file.with_suffix(ending), content)
    put(file.with_suffix(RETURNS), json.dumps(kept).encode())


def put(file: Path, content: bytes) -> None:
    """Write a file whole, or not at all."""
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as part:
        try:
            part.write(content)
            part.flush()
            Path(part.name).replace(file)
        except OSError:
            Path(part.name).unlink()
            raise


def file_name(kernel: Any, types: str) -> str:
    """Name of the files of a compiled kernel, without their endings."""
    function = kernel.py_func
    digest = hashlib.sha256(types.encode()).hexdigest()
    return f"{function.__module__.rpartition('.')[2]}-{function.__qualname__}-{digest[:16]}"


def loaded(file: Path) -> Native:
    """Load a compiled kernel.

    Raises
    ------
    UnusableError
        One of its files is not there, or not whole.
    """
    library = file.with_suffix(LIBRARY)
    try:
        kept: dict[str, Any] = json.loads(file.with_suffix(RETURNS).read_text())
        if library.exists():
            opened = ctypes.CDLL(str(library))
            return native_of(opened[ENTRY], opened, kept)
        code = file.with_suffix(OBJECT).read_bytes()
    except (OSError, ValueError, AttributeError) as problem:  # the last is what a library without the function raises
        raise UnusableError(str(problem)) from problem
    return native_of(*object_loaded(code), kept)


def object_loaded(code: bytes) -> tuple[Any, Any]:
    """Load object code; return its function, as of ctypes, and what must stay loaded."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return ctypes.CFUNCTYPE(ctypes.c_int32)(engine.get_function_address(ENTRY)), engine


def native_of(function: Any, library: Any, kept: dict[str, Any]) -> Native:
    """Return the kernel whose function has been loaded with a library; `kept` is what was written beside it."""
    function.argtypes = [ctypes.c_void_p] * (5 + kept["arrays"])
    function.restype = ctypes.c_int32
    return Native(function, kept["returns"], kept["numbers"], library)


def folder() -> Path | None:
    """Return the folder for this processor and compiler; None where compiled code is not kept."""
    return None if _cache.CACHE_FOLDER is None else Path(_cache.CACHE_FOLDER)
