"""Where compiled code is kept, and what it depends on: the sources of the kernels, the processor, the compiler."""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import importlib.util
import os
import platform
import shutil
import stat
import tempfile
import warnings
from pathlib import Path

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

    Returns
    -------
    Path
        Without symbolic links, which could be changed later.

    Raises
    ------
    OSError
        It cannot be made, others can change it or a folder above it, or a file in it is another user's.
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
