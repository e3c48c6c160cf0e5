"""The one decorator every kernel is compiled with, and the reasons for its flags.

Numba is imported when the first kernel is called or compiled (`boulder_kernels._numba`), not before: where everything
that is called has been compiled ahead, a process does without it.

``nogil``
    Blocks of designs run in threads of one process, which share the compiled code and the tables.
``error_model="numpy"``
    A division follows IEEE 754 instead of raising; a check before every division would keep the loops
    over lanes from being vectorised.
``fastmath={"contract", "nsz"}``
    Fused multiply-add, and the sign of zero does not matter. Nothing may assume that NaN or infinity never
    occur: a state that has become non-finite must be seen and reported. Nor may sums be reordered, so that a design
    gives the same bits wherever in a block, and with whatever vectors, it is computed (see `boulder_kernels.numerics`).
``_nrt``
    Off but for what makes arrays: kernels borrow those that they are given, and do not count references to them.
    The counters are atomic, and cost a fifth of the time of short simulations.
``no_cfunc_wrapper``, ``no_cpython_wrapper``
    Nothing calls a kernel by Numba's wrappers, which would have to be compiled, too: from Python, kernels are called by
    libraries (`boulder_kernels._ahead`).

Compiled code is kept in a folder named by a hash of all kernel sources, because what is kept of one function does not
notice that a function it calls has changed in another file. Only a folder that nobody else can write is used.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import threading
from collections.abc import Callable
from types import ModuleType
from typing import Any

from . import _ahead
from ._ahead import UnsuitableError, function_of
from ._cache import source_hash

__all__ = [
    "Kernel",
    "array_kernel",
    "exact_inlined",
    "exact_kernel",
    "function_of",
    "in_columns",
    "inlined",
    "kernel",
    "overload",
    "plain",
    "source_hash",
    "unless_none",
    "when_compiling",
]


class Kernel:
    """A kernel that is compiled when it is first called, by Python or by another kernel; see `kernel`.

    What is not defined here is that of Numba's dispatcher.

    Attributes
    ----------
    py_func : callable
        The function itself.
    options : dict
        What Numba is asked for.
    natives : dict
        What it was compiled to ahead, by the types of its arguments, see `boulder_kernels._ahead`.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func, self.options = function, options
        self._dispatcher: Any = None
        self._for_python: Any = None
        self._is_of_the_package = function.__module__.startswith(f"{__package__}.")
        self.natives: dict[str, Any] = {}
        functools.update_wrapper(self, function)

    @property
    def compiler(self) -> Any:
        """The module `boulder_kernels._numba`."""
        return compiler()

    @property
    def dispatcher(self) -> Any:
        """What compiles the function for other kernels."""
        with _MAKING:
            if self._dispatcher is None:
                self._dispatcher = self.compiler.dispatcher_of(self.py_func, self.options)
        return self._dispatcher

    @property
    def is_compiled(self) -> bool:
        """Whether there is anything that other kernels were compiled with."""
        return self._dispatcher is not None

    @property
    def for_python(self) -> Any:
        """Numba's dispatcher of the function for calls from Python, for which it is compiled in every process."""
        with _MAKING:
            if self._for_python is None:
                self._for_python = self.compiler.dispatcher_for_python(self.py_func, self.options)
        return self._for_python

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the compiled function: its library, or by Numba where it has none."""
        if self._is_of_the_package and not named:
            with contextlib.suppress(UnsuitableError):
                return _ahead.call(self, args)
        return self.for_python(*args, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in vars(type(self)):  # the latter: a property that has failed itself
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    def __reduce__(self) -> str:
        """Return the name by which other processes import it."""
        return self.py_func.__qualname__


_MAKING = threading.RLock()
_REGISTRATIONS: list[Callable[[], None]] = []
"""What Numba must be told of before it compiles the first kernel."""


def when_compiling(register: Callable[[], None]) -> Callable[[], None]:
    """Call a function before the first kernel is compiled; it tells Numba of what is called and is no kernel."""
    _REGISTRATIONS.append(register)
    return register


def compiler() -> ModuleType:
    """Return the module that compiles, and tell Numba first of what is called and is no kernel."""
    from . import _numba

    with _MAKING:
        while _REGISTRATIONS:
            _REGISTRATIONS.pop(0)()
    return _numba


def overload(function: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate what returns the implementation of a function inside kernels, for arguments of some Numba types."""

    def registered(choose: Callable[..., Any]) -> Callable[..., Any]:
        """Register it when Numba is there."""

        def register() -> None:
            """Register it."""
            from numba import extending

            extending.overload(function, inline="always", strict=False)(choose)

        when_compiling(register)
        return choose

    return registered


def in_columns(record: Any) -> Callable[[Any, int], Any]:
    """Return a function that takes a record out of a column of an array, whose first rows are its fields."""

    def take(array: Any, row: int) -> Any:
        """Return the record, numbers in place of columns."""
        return record(*array[: len(record._fields), row])

    def lower() -> None:
        """Tell Numba of it."""
        from ._numba import lower_take

        lower_take(take, record)

    when_compiling(lower)
    return take


def is_plain() -> bool:
    """Whether kernels stay plain Python: NUMBA_DISABLE_JIT is set, or Numba, already imported, is configured so."""
    known: Any = sys.modules.get("numba")
    if known is not None:
        return bool(known.config.DISABLE_JIT)
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def _compiled(
    function: Callable[..., Any], fastmath: set[str], *, inline: bool = False, arrays: bool = False
) -> Callable[..., Any]:
    """Decorate one function."""
    options: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    options |= {"fastmath": fastmath, "forceinline": inline}
    options |= {} if arrays else {"_nrt": False}
    return function if is_plain() else Kernel(function, options)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function for the machine at its first call, keeping the result on disk.

    Parameters
    ----------
    function
        Plain Python on scalars, NamedTuples and NumPy arrays; it makes no array.

    Returns
    -------
    callable
        A `Kernel`; ``.py_func`` is the function itself.
    """
    return _compiled(function, {"contract", "nsz"})


def array_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `kernel` does what makes arrays or views of memory."""
    return _compiled(function, {"contract", "nsz"}, arrays=True)


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
        from numba import types

        return when_none if isinstance(given[-1], types.NoneType) else unless

    overload(call)(choose)
    return call
