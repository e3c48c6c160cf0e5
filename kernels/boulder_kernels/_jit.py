"""The one decorator of every kernel, where compiled code is kept and by whom it is compiled; tuples inside kernels.

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
not notice that a function it calls has changed in another file. Another process compiles it: it takes requests from its
standard input, keeps the code on the disk, and answers each with a byte. So every process that runs kernels loads them,
the first one as well, and all run the same code: code that was compiled in the same process may fuse other products and
differ in the last bits. That process ends with the one that started it, or when nothing was asked for a while.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import functools
import hashlib
import importlib
import importlib.util
import inspect
import os
import pickle
import platform
import queue
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np

CACHE_VARIABLE = "BOULDER_SWEEP_CACHE_DIR"
"""Environment variable that names another folder for compiled kernels."""


def source_hash() -> str:
    """Return which code computed a table: SHA-256 over names and contents of all kernel sources, 64 hex digits."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()


def _cache_folder() -> str | None:
    """Return a folder for these kernels on this processor that only this user can write, or None with a warning.

    Compiled code runs as the user who loads it.
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
            folder = _make_private_folder(candidate / f"kernels-{source_hash()[:16]}" / f"native-{machine_hash()[:16]}")
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


def _make_private_folder(folder: Path) -> Path:
    """Make a folder with access for this user only, and check that nobody else can put files into it, or has.

    The path that is returned has no symbolic links, which could be changed later.

    Raises ``OSError``: it cannot be made, others can change it or a folder above it, or a file in it is another user's.
    """
    folder = Path(os.path.realpath(folder))
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        if not path.parent.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{path.parent} is not a folder")
        path.mkdir(mode=0o700, exist_ok=True)
    for path in (folder, *folder.parents):
        status = path.lstat()
        if not stat.S_ISDIR(status.st_mode):
            raise NotADirectoryError(errno.ENOTDIR, f"{path} is not a folder")
        if status.st_uid not in (os.getuid(), 0):
            raise PermissionError(errno.EPERM, f"{path} belongs to another user")
        # Where the sticky bit is set, as for /tmp, others cannot replace what lies in the folder.
        open_to_others = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
        if open_to_others and (path == folder or not status.st_mode & stat.S_ISVTX):
            raise PermissionError(errno.EPERM, f"other users can write into {path}")
    for path in folder.iterdir():
        status = path.lstat()
        if status.st_uid not in (os.getuid(), 0) or status.st_mode & stat.S_IWOTH:
            raise PermissionError(errno.EPERM, f"{path} is another user's, or open to others")
    return folder


def empty(folder: Path) -> None:
    """Remove what is in a folder of compiled kernels."""
    for path in folder.iterdir():
        shutil.rmtree(path, ignore_errors=True)
        path.unlink(missing_ok=True)


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
        spec = importlib.util.find_spec(package)
        if spec is not None and spec.origin is not None:
            version = Path(spec.origin).with_name("_version.py").stat()
            parts.append(f"{package} {version.st_size} {version.st_mtime_ns}")
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


CACHE_FOLDER = _cache_folder()


DONE, FAILED = b"+", b"-"
IDLE_S = 20.0
"""How long the process waits for a request: what it has compiled for one kernel it need not compile for the next."""
_process: subprocess.Popen[bytes] | None = None
_owner = 0
"""The process that started it: another one may have been forked from that."""


def compile_elsewhere(kernel: Any, kinds: tuple[Any, ...], folder: Path) -> None:
    """Have another process compile a kernel, and keep the code in a folder.

    ``kernel``: the `Kernel`; ``kinds``: Numba types of its arguments; ``folder``: where the code is kept.

    Raises ``OSError``: there is no such process, or it could not do it.
    """
    request = pickle.dumps((kernel.__module__, kernel.__qualname__, kinds, folder))
    for _ in range(2):  # it may just have ended, since nothing was asked for a while
        process, answer = _running(), b""
        assert process.stdin is not None
        assert process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(request)
            answer = process.stdout.read(1)
        if answer == DONE:
            return
        if answer == FAILED:
            break
        process.kill()
        process.wait()
    raise OSError(f"{kernel.__qualname__} was not compiled")


def _running() -> subprocess.Popen[bytes]:
    global _process, _owner
    if _process is None or _owner != os.getpid() or _process.poll() is not None:
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        _process = subprocess.Popen(
            [sys.executable, "-P", "-c", "from boulder_kernels import _jit; _jit.main()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env={**os.environ, "PYTHONPATH": path},
        )
        _owner = os.getpid()
    return _process


def main() -> None:
    """Compile what is asked for."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    os.umask(0o077)
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def read() -> None:
        """Take requests; end at once when nobody can ask any more."""
        while True:
            try:
                requests.put(pickle.load(sys.stdin.buffer))
            except EOFError:
                os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    with contextlib.suppress(queue.Empty):
        while True:
            os.write(1, DONE if _is_compiled(*requests.get(timeout=IDLE_S)) else FAILED)
    os._exit(0)  # the thread above still reads


def _is_compiled(module: str, name: str, kinds: tuple[Any, ...], folder: Path) -> bool:
    """Compile a kernel, one process at a time, and keep the code; False where that cannot be done."""
    try:
        kernel = getattr(importlib.import_module(module), name)
        mark = kernel.mark(kinds, folder)
        with (folder / f"{module}-{name}.lock").open("w") as lock:
            with contextlib.suppress(OSError):  # a file system without locks: the same may be compiled twice
                fcntl.flock(lock, fcntl.LOCK_EX)
            if not mark.exists():
                kernel.keep(kinds, folder)
                mark.touch()
        return True
    except Exception:  # the process that asks tries it, and raises what is wrong
        return False


SETTINGS: Any = numba.config
"""Numba's settings, which it fills in at run time."""
IS_PLAIN = bool(SETTINGS.DISABLE_JIT)
"""Whether kernels stay plain Python: NUMBA_DISABLE_JIT is set."""
LINE = 64
"""Bytes of a line of the fast memory."""


def on_lines(size: int) -> np.ndarray:
    """Return so many bytes, all zero, that begin on a whole line of the fast memory, uint8, shape (size,).

    A vector that lies across two lines takes twice as long to load.
    """
    room = np.zeros(size + LINE, np.uint8)
    first = -room.ctypes.data % LINE
    return room[first : first + size]


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


_TYPES: dict[Any, Any] = {}
"""Numba types of arguments: it takes Numba as long to work out one of an array as to simulate ten designs."""


def _key_of(value: Any) -> Any:
    """Return what the Numba type of an argument depends on: a number, None, an array, a record, or a named tuple."""
    if isinstance(value, np.ndarray):
        flags = value.flags
        return type(value), value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.writeable
    if isinstance(value, np.void):
        return type(value), value.dtype
    return (type(value), *map(_key_of, value)) if isinstance(value, tuple) else type(value)


def _type_of(value: Any) -> Any:
    """Return the Numba type of an argument."""
    key = _key_of(value)
    if key not in _TYPES:
        _TYPES[key] = numba.typeof(value)
    return _TYPES[key]


class Kernel:
    """A kernel that is compiled when it is first called, by Python or by another kernel; see `kernel`.

    ``py_func`` is the function itself. Numba's dispatcher supplies every attribute that is not defined here.
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
        kinds = tuple(map(_type_of, args))
        return (self._ready.get(kinds) or self._made_ready(kinds))(*args)

    def _made_ready(self, kinds: tuple[Any, ...]) -> Any:
        """Return what runs the code for arguments of some types: kept on the disk, or compiled for this process."""
        with _LOCK:
            folder = CACHE_FOLDER
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

        Raises ``OSError``: it cannot be compiled by another process, or not be kept. Raises ``Exception``: it is
        damaged.
        """
        if not self.mark(kinds, folder).exists():
            with announce(self.__qualname__):
                compile_elsewhere(self, kinds, folder)
        try:
            return self.keep(kinds, folder)
        except Exception:
            empty(folder)  # the next process makes it anew
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


def overload(function: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate what returns the implementation of a function inside kernels, for arguments of some Numba types."""
    return numba.extending.overload(function, inline="always", strict=False)


def by_types(choose: Callable[..., Callable[..., Any]]) -> Callable[..., Any]:
    """Decorate what returns the implementation of a function for its arguments: values, or in kernels their types.

    Kernels inline what it returns, a function of Python with arguments of the same names.
    """

    @functools.wraps(choose)
    def call(*arguments: Any) -> Any:
        """Call what is chosen."""
        return choose(*arguments)(*arguments)

    overload(call)(choose)
    return call


def type_of(value: Any) -> type:
    """Return the type of a named tuple, which may be a value or, inside kernels, its Numba type."""
    kind: type = getattr(value, "instance_class", type(value))
    return kind


def is_none(value: Any) -> bool:
    """Return whether a value, or what a Numba type stands for, is None."""
    return value is None or isinstance(value, numba.types.NoneType)


def through(add: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that passes what has been met on from item to item of a tuple, and returns what was met in all.

    Inside kernels every item is a call of its own: a loop would keep the one over lanes from being vectorised, and what
    has been met could not change its type.

    ``add`` takes what has been met before an item, a state, and the item.
    """

    @by_types
    def pass_on(met: Any, state: Any, items: Any) -> Callable[..., Any]:
        """Return the way through as many items as there are."""
        if len(items) == 1:
            return lambda met, state, items: add(met, state, items[0])
        return lambda met, state, items: pass_on(add(met, state, items[0]), state, items[1:])

    return pass_on


@numba.extending.intrinsic
def _alignment(typing: Any) -> Any:
    """Align the stack of the function that this is inlined into."""

    def align(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Set what LLVM is told of the function."""
        builder.function.attributes.add("nounwind")  # as it is anyway: llvmlite writes no alignment of the stack alone
        builder.function.attributes.alignstack = LINE
        return context.get_dummy_value()

    return numba.types.void(), align


def align_stack() -> None:
    """Let the function that calls this keep its stack on whole lines of the fast memory.

    What finds no room in the registers of a second opinion goes to the stack, a vector as long as a line. By default a
    vector may lie across two lines there, and a second opinion takes 15 % longer.
    """


@overload(align_stack)
def _align_stack() -> Callable[..., None]:
    alignment: Any = _alignment
    return lambda: alignment()


def _compiled(function: Callable[..., Any], fastmath: set[str], *, inline: bool = False) -> Callable[..., Any]:
    """Decorate one function as a kernel."""
    options: dict[str, Any] = {"nogil": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    return function if IS_PLAIN else Kernel(function, options | {"fastmath": fastmath, "forceinline": inline})


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function on numbers, named tuples and arrays at its first call, and keep the code; see `Kernel`."""
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
