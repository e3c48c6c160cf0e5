"""numbalsoda: LSODA and DOP853 without any Python, called from a compiled loop, on the closed form."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numba
import numbalsoda
import numpy as np

from boulder_kernels import Constants
from boulder_kernels.dynamics import State

from .problem import READINGS, Problem, Solver, literal_acceleration

TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(4, 19))
ABSOLUTE = 0.1
"""Absolute over relative tolerance: states are metres, radians and their rates, about 0.1 to 10."""
MOST_STEPS = 100_000
_FIELDS = len(Constants._fields)


@numba.cfunc(numbalsoda.lsoda_sig, error_model="numpy", fastmath={"contract", "nsz"})
def _rates(t, y, rate, p):  # type of the arguments: numbalsoda.lsoda_sig
    """Rate of the six states; p holds the constants of the design in their order."""
    c = Constants(
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], 0, p[10], p[11], p[12], p[13], p[14], p[15], p[16],
        p[17], p[18], p[19], p[20], p[21], p[22],
    )  # fmt: skip
    k = literal_acceleration(State(y[0], y[1], y[2], y[3], y[4], y[5]), READINGS, c)
    rate[0], rate[1], rate[2] = y[1], k.a_b, y[3]
    rate[3], rate[4], rate[5] = k.alpha_b, y[5], k.a_v


def _loop(solve: Callable[..., tuple[np.ndarray, bool]]) -> Callable[..., np.ndarray]:
    """Compile the loop over designs around one of the solvers."""

    @numba.njit(nogil=True)
    def solve_all(address, constants, v_0, t_end, outputs, tolerance):
        states = np.full((len(t_end), outputs, 6), np.nan)
        for row in range(len(t_end)):
            start = np.array((0.0, 0.0, 0.0, 0.0, 0.0, v_0[row]))
            times = np.linspace(0.0, t_end[row], outputs)
            found, success = solve(address, start, times, constants[row], tolerance, ABSOLUTE * tolerance, MOST_STEPS)
            if success:
                states[row] = found
        return states

    return solve_all


_LOOPS = {"LSODA": _loop(numbalsoda.lsoda), "DOP853": _loop(numbalsoda.dop853)}


def _prepare(method: str, problem: Problem) -> Callable[[float], np.ndarray]:
    rows = [problem.constants(row) for row in range(problem.size)]
    constants = np.array([[float(value) for value in c] for c in rows])
    v_0 = np.array([c.v_0 for c in rows])
    solve, address = _LOOPS[method], _rates.address
    solve(address, constants[:1], v_0[:1], problem.t_end[:1], problem.outputs, 1e-3)  # compiles
    return lambda tolerance: solve(address, constants, v_0, problem.t_end, problem.outputs, tolerance)


SOLVERS = [
    Solver(f"numbalsoda {method}, closed form", 1024, partial(_prepare, method), TOLERANCES) for method in _LOOPS
]
"""Both of its solvers."""
