"""Plain C: fixed steps, eight designs side by side, vectorised by the C compiler for this processor."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from boulder_kernels import Constants

from .problem import Problem, Solver

SOURCE = Path(__file__).with_name("plain.c")
LANES = 8
STEPS_S = tuple(2e-3 * 2.0 ** (-0.5 * k) for k in range(16))
OPTIONS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
"""The options that make the fastest code; none of the results depends on what fast-math takes for granted."""


def compiler() -> list[str]:
    """Return the command of a C compiler: gcc, or the one that the package ziglang brings.

    Raises
    ------
    ImportError
        There is neither.
    """
    if found := shutil.which("gcc"):
        return [found, "-mprefer-vector-width=512"]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise ImportError("neither gcc nor ziglang is here")


@cache
def _library() -> ctypes.CDLL:
    """Compile once."""
    folder = Path(tempfile.mkdtemp(prefix="sweep-plain-c-"))
    try:
        names = ", ".join(Constants._fields)
        (folder / "constants.h").write_text(f"enum {{ {names}, CONSTANTS }};\n")
        target = folder / "plain.so"
        command = [*compiler(), *OPTIONS, f"-I{folder}", str(SOURCE), "-o", str(target), "-lm"]
        subprocess.run(command, check=True)
        return ctypes.CDLL(str(target))
    finally:
        shutil.rmtree(folder)


def _prepare(problem: Problem) -> Callable[[float], np.ndarray]:
    count = -(-problem.size // LANES) * LANES
    rows = np.resize(np.arange(problem.size), count)  # the last lanes are filled with designs there are already
    constants = np.array([[float(value) for value in problem.constants(int(row))] for row in rows]).T.copy()
    t_end = problem.t_end[rows]
    solve = _library().solve
    solve.restype = None
    double = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    solve.argtypes = [ctypes.c_long, double, double, ctypes.c_double, double]

    def solve_all(longest_step: float) -> np.ndarray:
        theta = np.empty(count)
        solve(count, constants, t_end, longest_step, theta)
        return theta[: problem.size]

    return solve_all


compiler()
SOLVERS = [Solver("plain C, RK4, 8 designs side by side, closed form", 1024, _prepare, STEPS_S, in_steps=True)]
"""It takes peaks from its steps."""
