"""A process that compiles kernels for others: ``python -m boulder_kernels.compiling``.

It takes requests from its standard input, keeps the code on the disk, and answers each with a byte. So every process
that runs kernels loads them, the first one as well, and all run the same code. It ends with the process that started
it, or when nothing was asked for a while.
"""

from __future__ import annotations

import contextlib
import fcntl
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

DONE, FAILED = b"+", b"-"
IDLE_S = 20.0
"""How long the process waits for a request: what it has compiled for one kernel it need not compile for the next."""
_process: subprocess.Popen[bytes] | None = None
_owner = 0
"""The process that started it: another one may have been forked from that."""


def compile_elsewhere(kernel: Any, kinds: tuple[Any, ...], folder: Path) -> None:
    """Have another process compile a kernel, and keep the code in a folder.

    Parameters
    ----------
    kernel
        The `boulder_kernels._jit.Kernel`.
    kinds
        Numba types of its arguments.
    folder
        Where the code is kept.

    Raises
    ------
    OSError
        There is no such process, or it could not do it.
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
            [sys.executable, "-P", "-m", "boulder_kernels.compiling"],
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


if __name__ == "__main__":
    main()
