"""The one decorator every kernel is compiled with, and the reasons for its flags.

``nogil``
    Blocks of designs run in threads of one process, which share the compiled code and the tables.
``error_model="numpy"``
    A division follows IEEE 754 instead of raising; a check before every division would keep the loops
    over lanes from being vectorised.
``fastmath={"contract", "nsz"}``
    Fused multiply-add, and the sign of zero does not matter. Nothing may assume that NaN or infinity never
    occur: a state that has become non-finite must be seen and reported. Nor may sums be reordered, so that a design
    gives the same bits wherever in a block, and with whatever vectors, it is computed (see `boulder_kernels.numerics`).
``no_cfunc_wrapper``, ``no_cpython_wrapper``
    Most kernels are called by kernels only. A wrapper takes the tuples among the arguments apart, number by number: it
    would be a third of the work of compiling them.

Numba keeps compiled code in a folder named by a hash of all kernel sources, because what it keeps of one function does
not notice that a function it calls has changed in another file. What is kept is compiled by another process
(`boulder_kernels.compiling`), so every process runs the code that it finds on the disk: code that was compiled in the
same process may fuse other products and differ in the last bits.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.extending import lower_builtin, type_callable

from . import _cache, compiling
from ._cache import source_hash

__all__ = [
    "Kernel",
    "exact_inlined",
    "exact_kernel",
    "function_of",
    "in_columns",
    "inlined",
    "kernel",
    "overload",
    "plain",
    "rows_of",
    "source_hash",
    "unless_none",
]

SETTINGS: Any = numba.config
"""Numba's settings, which it fills in at run time."""
IS_PLAIN = bool(SETTINGS.DISABLE_JIT)
"""Whether kernels stay plain Python: NUMBA_DISABLE_JIT is set."""
_LOCK = threading.RLock()
announce: Callable[[str], contextlib.AbstractContextManager[Any]] = contextlib.nullcontext
"""Called with the name of a kernel when it must be compiled, which is done within what it returns."""


def _ask_for_wide_vectors() -> None:
    """Let the compiler use 512-bit registers where the processor has them.

    For many of these processors LLVM prefers half the width, because ordinary code lowers their clock for little
    gain. The loops over lanes are dense in multiply-adds and gain a third. The choice is Numba's, for the whole
    process, made at its first compilation; one that the user has made (NUMBA_CPU_FEATURES) stands.
    """
    if SETTINGS.CPU_FEATURES is None and SETTINGS.CPU_NAME is None and SETTINGS.ENABLE_AVX:
        features = llvmlite.binding.get_host_cpu_features()
        if features.get("avx512f", False):
            SETTINGS.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"


_ask_for_wide_vectors()


class Kernel:
    """A kernel that is compiled when it is first called, by Python or by another kernel; see `kernel`.

    What is not defined here is that of Numba's dispatcher.

    Attributes
    ----------
    py_func : callable
        The function itself.
    options : dict
        What Numba is asked for.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func, self.options = function, options
        self._ready: dict[tuple[Any, ...], Any] = {}
        self._kept: Any = None
        self._fresh: Any = None
        functools.update_wrapper(self, function)

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What compiles the function for other kernels."""
        options: Any = {**self.options, "no_cpython_wrapper": True}
        return numba.njit(**options)(self.py_func)

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the compiled function."""
        if named:
            args = inspect.signature(self.py_func).bind(*args, **named).args
        kinds = tuple(map(numba.typeof, args))
        return (self._ready.get(kinds) or self._made_ready(kinds))(*args)

    def _made_ready(self, kinds: tuple[Any, ...]) -> Any:
        """Return what runs the code for arguments of some types: kept on the disk, or compiled for this process."""
        with _LOCK:
            folder = _cache.CACHE_FOLDER
            if kinds not in self._ready and folder and self.__module__.startswith(f"{__package__}."):
                with contextlib.suppress(Exception):  # what is kept may be damaged in any way, and the disk full
                    self._ready[kinds] = self._loaded(kinds, Path(folder))
            if kinds not in self._ready:
                with announce(self.__qualname__):
                    self._fresh = self._fresh or numba.njit(**self.options)(self.py_func)
                    self._fresh.compile(kinds)
                self._ready[kinds] = self._fresh
            return self._ready[kinds]

    def _loaded(self, kinds: tuple[Any, ...], folder: Path) -> Any:
        """Load what is kept for arguments of some types, and have it compiled first if there is nothing.

        Raises
        ------
        OSError
            It cannot be compiled by another process, or not be kept.
        Exception
            It is damaged.
        """
        if not self.mark(kinds, folder).exists():
            with announce(self.__qualname__):
                compiling.compile_elsewhere(self, kinds, folder)
        try:
            return self.keep(kinds, folder)
        except Exception:
            _cache.empty(folder)  # the next process makes it anew
            raise

    def mark(self, kinds: tuple[Any, ...], folder: Path) -> Path:
        """Return the path of a file that is there once the code for arguments of some types is kept in a folder."""
        source = Path(inspect.getfile(self.py_func))
        digest = hashlib.sha256(f"{source} {source.stat().st_mtime_ns} {kinds}".encode()).hexdigest()
        return folder / f"{source.stem}-{self.__qualname__}-{digest[:16]}"

    def keep(self, kinds: tuple[Any, ...], folder: Path) -> Any:
        """Load the code for arguments of some types from a folder, or compile it and keep it there."""
        if self._kept is None:
            before, SETTINGS.CACHE_DIR = SETTINGS.CACHE_DIR, str(folder)
            try:
                self._kept = numba.njit(cache=True, **self.options)(self.py_func)
            finally:
                SETTINGS.CACHE_DIR = before
        self._kept.compile(kinds)
        return self._kept

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in vars(type(self)):  # the latter: a property that has failed itself
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    def __reduce__(self) -> str:
        """Return the name by which other processes import it."""
        return self.py_func.__qualname__


def function_of(source: str, **names: Any) -> Callable[..., Any]:
    """Return the function that a source text defines, with the names it refers to: for what `overload` writes out."""
    exec(source, names)
    return names[source[len("def ") : source.index("(")]]


def overload(function: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate what returns the implementation of a function inside kernels, for arguments of some Numba types."""
    return numba.extending.overload(function, inline="always", strict=False)


def in_columns(record: Any) -> Callable[[Any, int], Any]:
    """Return a function that takes a record out of a column of an array, whose first rows are its fields."""

    def take(array: Any, row: int) -> Any:
        """Return the record, numbers in place of columns."""
        return record(*array[: len(record._fields), row])

    lower_take(take, record)
    return take


def rows_of(context: Any, builder: Any, kinds: Any, values: Any, first: int, count: int) -> list[Any]:
    """Load the numbers of a column of an array from some of its rows."""
    array = context.make_array(kinds[0])(context, builder, values[0])
    columns = builder.extract_value(array.shape, 1)
    index, numbers = context.cast(builder, values[1], kinds[1], numba.types.intp), []
    if first:
        index = builder.add(index, builder.mul(columns, context.get_constant(numba.types.intp, first)))
    for _ in range(count):
        numbers.append(builder.load(builder.gep(array.data, [index], inbounds=True)))
        index = builder.add(index, columns)
    return numbers


def lower_take(take: Any, record: Any) -> None:
    """Tell Numba of a function of `boulder_kernels._jit.in_columns`.

    It is one load for every field: an index that need not be checked lets a loop over rows be vectorised.
    """

    def result(array: Any, row: Any) -> Any:
        """Return the type of the result, or None where a column is not one piece of memory."""
        return numba.types.NamedUniTuple(array.dtype, len(record._fields), record) if array.layout == "C" else None

    def loads(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        """Load its numbers."""
        numbers = rows_of(context, builder, sig.args, args, 0, len(record._fields))
        return context.make_tuple(builder, sig.return_type, numbers)

    type_callable(take)(lambda context: result)
    lower_builtin(take, numba.types.Array, numba.types.Any)(loads)


def _compiled(function: Callable[..., Any], fastmath: set[str], *, inline: bool = False) -> Callable[..., Any]:
    """Decorate one function."""
    options: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    return function if IS_PLAIN else Kernel(function, options | {"fastmath": fastmath, "forceinline": inline})


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function for the machine at its first call, keeping the result on disk.

    Parameters
    ----------
    function
        Plain Python on scalars, NamedTuples and NumPy arrays.

    Returns
    -------
    callable
        A `Kernel`; ``.py_func`` is the function itself.
    """
    return _compiled(function, {"contract", "nsz"})


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `kernel` does, and inline into every caller: a loop that still contains a call is not vectorised."""
    return _compiled(function, {"contract", "nsz"}, inline=True)


def exact_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `kernel` does, without fused multiply-add: every operation rounds by itself.

    For what is computed once per design. In a b + c d either product may be fused, and the compiler chooses anew
    wherever it inlines the code; with every operation rounded by itself, the bits are the same everywhere.
    """
    return _compiled(function, {"nsz"})


def exact_inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `inlined` does, without fused multiply-add, as `exact_kernel`.

    For what is inlined into both the lanes and the single impact and must round alike: whether a product that is used
    twice is fused depends on the code around it.
    """
    return _compiled(function, {"nsz"}, inline=True)


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function of a kernel, for calls that are not worth a library; what it calls is compiled."""
    return getattr(function, "py_func", function)


def unless_none(names: str, function: Callable[..., Any], otherwise: str, **known: Any) -> Callable[..., Any]:
    """Return a function that calls another unless its last argument is None; inside kernels chosen when compiled.

    What is not needed is not compiled, and the two may give results of different types: an ``if`` in a kernel allows
    neither.

    Parameters
    ----------
    names
        Names of the arguments, separated by blanks.
    function
        Called with them.
    otherwise
        Expression of them for None.
    known
        What else it refers to, by name.
    """
    arguments = ", ".join(names.split())
    when_none = function_of(f"def when_none({arguments}):\n return {otherwise}", **known)
    unless = function_of(f"def unless({arguments}):\n return function({arguments})", function=function)

    def call(*given: Any) -> Any:
        """Call the one for these arguments."""
        return (when_none if given[-1] is None else plain(function))(*given)  # what it calls is compiled

    def choose(*given: Any) -> Callable[..., Any]:
        """Return the one for arguments of these Numba types."""
        return when_none if isinstance(given[-1], numba.types.NoneType) else unless

    overload(call)(choose)
    return call
