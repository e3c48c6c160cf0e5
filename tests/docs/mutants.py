"""A copy of the sources that may be broken, and its tests, run in a process of their own at little cost.

What starts a Python process for a test are imports, nearly all of them of other people's packages. A server imports
those once and forks for every run; nothing of this project is in it, so that a run imports what the copy has now.
"""

from __future__ import annotations

import compileall
import contextlib
import gc
import multiprocessing
import os
import py_compile
import shutil
import sys
import traceback
from collections.abc import Iterator, Sequence
from multiprocessing import forkserver
from pathlib import Path
from typing import NamedTuple

import numba
import pytest

from tests.docs.mutations import Mutation

ROOT = Path(__file__).parents[2]
OWN = ("boulder_kernels", "boulder_sweep", "tests")
COPIED = ("kernels", "boulder_sweep", "tests", "configs")
PRELOADED = [
    "_pytest.debugging",
    "_pytest.faulthandler",
    "_pytest.junitxml",
    "_pytest.logging",
    "_pytest.unittest",
    "asyncio",
    "click",
    "hypothesis.strategies",
    "joblib",
    "numba",
    "numpy.testing",
    "pandas",
    "pdb",
    "pyarrow.parquet",
    "pytest",
    "rich.console",
    "ruamel.yaml",
    "scipy.integrate",
    "scipy.optimize",
    "scipy.stats",
]
"""What pytest and the tests of the register import. A name that is missing here, or no longer exists, costs time only.

Threads do not survive a fork. None of these starts one, but for the allocator of pyarrow, which does so anew.
"""
OPTIONS = ("-x", "-v", "-p", "no:cacheprovider", "--strict-markers", "--import-mode=importlib", "-m", "not nightly")
"""Options of the runs; the options in ``pyproject.toml`` do not count, and no plugin is loaded."""
BROKEN_RUN = 70
"""Exit code of a run that pytest did not bring to an end, which none of its own codes is."""


class Outcome(NamedTuple):
    """Outcome of one run of the tests."""

    code: int
    """Exit code of pytest, `BROKEN_RUN`, or minus the number of the signal that ended the process."""
    output: str


def copy_sources(folder: Path) -> None:
    """Copy what tests of the register need.

    Bytecode is kept for the runs, and is valid by a hash of its source: by time and size it would also pass for a
    source in which a sign was changed within the same second.
    """
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    for name in ("kernels", "boulder_sweep"):
        compileall.compile_dir(folder / name, quiet=1, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)


@contextlib.contextmanager
def broken(folder: Path, mutation: Mutation) -> Iterator[None]:
    """Break one place of a copy, and put it right again."""
    file = folder / mutation.file
    sound = file.read_text(encoding="utf-8")
    file.write_text(sound.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        yield
    finally:
        file.write_text(sound, encoding="utf-8")


def run_tests(folder: Path, tests: Sequence[str], *, compiled: bool) -> Outcome:
    """Run tests of a copy: with the compiled kernels of the original, or with its own kernels and no compiler.

    To compile them anew takes longer than the tests do.
    """
    _start_server()
    output = folder / "output.txt"
    output.unlink(missing_ok=True)
    process = multiprocessing.get_context("forkserver").Process(target=_run, args=(folder, tests, compiled, output))
    process.start()
    process.join(600)  # hang guard
    if process.is_alive():
        process.kill()
        process.join()
    assert process.exitcode is not None
    return Outcome(process.exitcode, output.read_text(encoding="utf-8"))


def _start_server() -> None:
    """Start the server that forks, unless it runs already; it ends with this process."""
    forkserver.set_forkserver_preload(PRELOADED)
    with pytest.MonkeyPatch.context() as patch:
        for name in os.environ:
            if name.startswith("PYTEST_"):  # of the run that this one is part of
                patch.delenv(name)
        patch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
        patch.setenv("OPENBLAS_NUM_THREADS", "1")  # no threads that a fork would lose
        patch.setenv("NUMBA_DISABLE_JIT", "0")  # each run says whether
        forkserver.ensure_running()


def _run(folder: Path, tests: Sequence[str], compiled: bool, output: Path) -> None:
    """Run tests in this process, which then ends."""
    with output.open("w", encoding="utf-8") as file:
        os.dup2(file.fileno(), sys.stdout.fileno())
        os.dup2(file.fileno(), sys.stderr.fileno())
    try:
        _enter(folder, compiled)
        code = int(pytest.main([*OPTIONS, "-o", "addopts=", f"--basetemp={folder / 'temporary'}", *tests]))
    except BaseException:  # let through, it would end the process with the code of failed tests
        traceback.print_exc()
        code = BROKEN_RUN
    sys.exit(code)


def _enter(folder: Path, compiled: bool) -> None:
    """Make this process import from a copy, and Numba compile or not."""
    os.chdir(folder)
    os.environ["NUMBA_DISABLE_JIT"] = "0" if compiled else "1"
    numba.config.reload_config()
    assert bool(numba.config.DISABLE_JIT) != compiled
    for name in list(sys.modules):
        if name.partition(".")[0] in OWN:  # this module, and those it needs itself
            assert name.startswith("tests"), f"{name} was imported before the copy could be"
            del sys.modules[name]
    sys.path[:0] = [str(folder), str((ROOT if compiled else folder) / "kernels")]
    sys.dont_write_bytecode = False  # into the copy; pytest rewrites the tests at the first run only
    gc.freeze()  # pytest collects garbage at its end, for which all that was imported need not be searched
