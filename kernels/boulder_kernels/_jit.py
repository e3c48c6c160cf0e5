"""The one decorator every kernel is compiled with, and the reasons for its flags.

``nogil``
    Blocks of designs run in threads of one process, which share the compiled code and the tables.
``error_model="numpy"``
    A division follows IEEE 754 instead of raising; a check before every division would keep the loops
    over lanes from being vectorised.
``fastmath={"contract", "nsz"}``
    Fused multiply-add, and the sign of zero does not matter. Nothing may assume that NaN or infinity never
    occur: a state that has become non-finite must be seen and reported. Sums are reordered in one place
    only (`summing_kernel`), so a design gives the same bits wherever in a block it is computed.
``_nrt``
    Off but for what makes arrays: kernels borrow those that they are given, and do not count references to them.
    The counters are atomic, and cost a fifth of the time of short simulations.
``no_cfunc_wrapper``, ``no_cpython_wrapper``
    Nothing calls a kernel from C, and few are called from Python: wrappers would have to be compiled, too.
``cache``
    Compiled code is kept in a folder named by a hash of all kernel sources, because a cached function does
    not notice that a function it calls has changed in another file. Only a folder that nobody else can write is used.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import functools
import hashlib
import os
import stat
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.runtime._nrt_python import c_helpers
from numba.extending import overload

NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "RewriteDynamicRaises",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "NopythonRewrites",
    "NoPythonSupportedFeatureValidation",
    "AnnotateTypes",
    "DumpParforDiagnostics",
}
"""Steps of Numba's compiler that kernels do without, by name."""
REPEATED = "DeadBranchPrune"
"""A step that Numba takes three times; the last one finds everything that the others do."""
ENVIRONMENT = "_ZN08NumbaEnv"
"""What the names begin with of the variables by which compiled functions find Python's objects."""


class KernelCompiler(Compiler):
    """Numba's compiler without the steps that kernels do not need."""

    def define_pipelines(self) -> list[Any]:
        """Return the steps, as Numba asks for them."""
        (steps,) = super().define_pipelines()
        kept = [(step, reason) for step, reason in steps.passes if step.__name__ not in NEEDLESS]
        repeated = [place for place, (step, _) in enumerate(kept) if step.__name__ == REPEATED]
        steps.passes = [entry for place, entry in enumerate(kept) if place not in repeated[:-1]]
        steps.finalize()
        return [steps]


class InsideCompiler(KernelCompiler):
    """The same for kernels that other kernels call."""

    def define_pipelines(self) -> list[Any]:
        """Return the steps, and let the result be kept without machine code."""
        state = self.state
        state.library = _Taken(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


class _Taken(JITCodeLibrary):
    """Optimised code that is taken into that of others.

    In place of its machine code there are only the variables that Numba sets wherever it has compiled a function or
    loaded it from the disk.
    """

    def _finalize_final_module(self) -> None:
        code = self._final_module
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        variables = [str(known) for known in code.global_variables if known.name.startswith(ENVIRONMENT)]
        head = str(self._codegen._create_empty_module(self.name))
        self._final_module = llvmlite.binding.parse_assembly("\n".join([head, *variables]))
        self._final_module.name = code.name
        super()._finalize_final_module()
        self._final_module = code


SETTINGS: Any = numba.config
"""Numba's settings, which it fills in at run time."""
CACHE_VARIABLE = "BOULDER_SWEEP_CACHE_DIR"
"""Environment variable that names another folder for compiled kernels."""


def source_hash() -> str:
    """Hash of all kernel sources: which code computed a table.

    Returns
    -------
    str
        64 hexadecimal digits (SHA-256 over names and contents, in order of name).
    """
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _cache_folder() -> str | None:
    """Return a folder for this version of the kernels that only this user can write, or None with a warning.

    Compiled kernels are loaded from pickles, which run as the user who loads them.
    """
    named = os.environ.get(CACHE_VARIABLE)
    user_caches = os.environ.get("XDG_CACHE_HOME")
    candidates = [Path(named)] if named else []
    with contextlib.suppress(RuntimeError):  # no home folder, as for some service accounts
        candidates.append((Path(user_caches) if user_caches else Path.home() / ".cache") / "boulder-sweep")
    candidates.append(Path(tempfile.gettempdir()) / f"boulder-sweep-{os.getuid()}")
    refused = []
    for candidate in candidates:
        try:
            folder = _own_folder(candidate / f"kernels-{source_hash()[:16]}")
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as problem:
            refused.append(f"{candidate}: {problem.strerror}")
            continue
        if named and refused:
            warnings.warn(f"compiled kernels are kept in {folder} ({refused[0]})", stacklevel=2)
        return str(folder)
    warnings.warn(
        f"compiled kernels are not kept, so every start takes up to half a minute ({'; '.join(refused)}). Set "
        f"{CACHE_VARIABLE} to a folder that only you can write",
        stacklevel=2,
    )
    return None


def _own_folder(folder: Path) -> Path:
    """Make a folder with access for this user only, and check that nobody else can put files into it.

    Returns
    -------
    Path
        Without symbolic links, which could be changed later.

    Raises
    ------
    OSError
        It cannot be made, or others can change it or a folder above it.
    """
    folder = Path(os.path.realpath(folder))
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    for place in reversed(missing):
        if not place.parent.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{place.parent} is not a folder")
        place.mkdir(mode=0o700, exist_ok=True)
    for place in (folder, *folder.parents):
        found = place.lstat()
        if not stat.S_ISDIR(found.st_mode):
            raise NotADirectoryError(errno.ENOTDIR, f"{place} is not a folder")
        if found.st_uid not in (os.getuid(), 0):
            raise PermissionError(errno.EPERM, f"{place} belongs to another user")
        # Where the sticky bit is set, as for /tmp, others cannot replace what lies in the folder.
        open_to_others = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
        if open_to_others and (place == folder or not found.st_mode & stat.S_ISVTX):
            raise PermissionError(errno.EPERM, f"other users can write into {place}")
    return folder


CACHE_FOLDER = _cache_folder()
INSIDE = "inside"
"""Folder within it for kernels as other kernels call them, without what a call from Python needs."""
_LOOKING = threading.Lock()


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


def _compiled(
    function: Callable[..., Any], fastmath: set[str], *, inline: bool = False, arrays: bool = False
) -> Callable[..., Any]:
    """Decorate one function, its cache in this package's folder."""
    options: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    options |= {"fastmath": fastmath, "forceinline": inline}
    options |= {} if arrays else {"_nrt": False}
    if SETTINGS.DISABLE_JIT:
        return function
    return _compiled_in_two_ways(function, options)


class _Files:
    """The compiled code of one function on disk, in place of Numba's cache, of which it makes one when it is asked.

    Numba looks for the folder of every function that is decorated, and makes its compiler ready before it loads
    anything. Of a start that compiles nothing that is a third.
    """

    def __init__(self, function: Callable[..., Any], folder: str):
        self._function, self._folder = function, folder

    @functools.cached_property
    def _cache(self) -> Any:
        with _LOOKING:  # set only meanwhile: other users of Numba in this process keep their own cache folder
            before = SETTINGS.CACHE_DIR
            SETTINGS.CACHE_DIR = self._folder
            try:
                return FunctionCache(self._function)
            finally:
                SETTINGS.CACHE_DIR = before

    @property
    def cache_path(self) -> str:
        """Folder of the files, for Numba's statistics."""
        return self._cache.cache_path

    def load_overload(self, types: Any, context: Any) -> Any:
        """Return the code for arguments of some types; None where there is none: the compiler makes itself ready."""
        for name, address in c_helpers.items():  # what makes arrays
            llvmlite.binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        return self._cache._load_overload(types, context)

    def save_overload(self, types: Any, compiled: Any) -> None:
        """Keep the code for arguments of some types.

        One process at a time: Numba looks for a free number, and of two that do so at once, each for other types, both
        would take the same. One of the two would then find the other's code under its own types at every later start.
        """
        with _alone(Path(CACHE_FOLDER or "") / "lock"):
            self._cache.save_overload(types, compiled)


@contextlib.contextmanager
def _alone(file: Path) -> Iterator[None]:
    """Keep other processes waiting that ask for the same file, where the file system has locks."""
    with contextlib.ExitStack() as kept:
        with contextlib.suppress(OSError):
            lock = kept.enter_context(file.open("a"))
            fcntl.flock(lock, fcntl.LOCK_EX)
            # A process forked meanwhile has the file open, too, and would keep the lock beyond its closing here.
            kept.callback(fcntl.flock, lock, fcntl.LOCK_UN)
        yield


def _decorated(function: Callable[..., Any], options: dict[str, Any], folder: str, compiler: type[Any]) -> Any:
    """Decorate a function, its compiled code in a folder."""
    decorated = numba.njit(pipeline_class=compiler, **options)(function)
    if CACHE_FOLDER is not None:
        decorated._cache = _Files(function, folder)
        decorated._compilation_chain_init_hook = lambda: None  # looks for extensions, as the compiler does itself
    return decorated


def _compiled_in_two_ways(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Return a dispatcher that compiles a wrapper only for calls from Python, not for those of other kernels.

    A wrapper takes the tuples among the arguments apart, number by number. Most kernels are called by kernels only, and
    their wrappers would be a third of the work. What Python calls is left to a second dispatcher of the same function.
    """
    folder = Path(CACHE_FOLDER or "")
    inside = _decorated(function, options | {"no_cpython_wrapper": True}, str(folder / INSIDE), InsideCompiler)
    inside.targetoptions = options
    called = functools.cache(lambda: _decorated(function, options, str(folder), KernelCompiler))
    take_over = inside.add_overload

    def keep(compiled: Any) -> None:
        """Let kernels alone find it: a call from Python would find nothing that it could run."""
        inside.overloads[tuple(compiled.signature.args)] = compiled

    def compile_for_python(*args: Any, **named: Any) -> Any:
        """Compile for the first call from Python with arguments of these types."""
        entry = called()._compile_for_args(*args, **named)
        for types, compiled in called().overloads.items():
            if inside.overloads.get(types) is not compiled:
                take_over(compiled)
        inside._cache_hits, inside._cache_misses = called()._cache_hits, called()._cache_misses
        return entry

    inside.add_overload, inside._compile_for_args = keep, compile_for_python
    return inside


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function for the machine at its first call, keeping the result on disk.

    Parameters
    ----------
    function
        Plain Python on scalars, NamedTuples and NumPy arrays; it makes no array.

    Returns
    -------
    callable
        The compiled dispatcher; ``.py_func`` is the function itself.
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


def summing_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `kernel` does, and let sums be reordered so that one long sum is vectorised.

    For sums over thousands of soil elements only; a function compiled so must not test for NaN.
    """
    return _compiled(function, {"contract", "nsz", "reassoc"})


def function_of(source: str, **names: Any) -> Callable[..., Any]:
    """Return the function that a source text defines, with the names it refers to: for what `overload` writes out."""
    exec(source, names)
    return names[source[len("def ") : source.index("(")]]


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
        return (when_none if given[-1] is None else function)(*given)

    def choose(*given: Any) -> Callable[..., Any]:
        """Return the one for arguments of these Numba types."""
        return when_none if isinstance(given[-1], numba.types.NoneType) else unless

    overload(call, inline="always", strict=False)(choose)
    return call
