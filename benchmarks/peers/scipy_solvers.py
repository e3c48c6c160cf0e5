"""SciPy: the paper's way with NumPy sums over 5000 elements, the same with Numba, and others on the closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numba
import numpy as np
from scipy.integrate import solve_ivp

from boulder_kernels import Constants, DesignTable
from boulder_kernels.design import design_at, element_depth
from boulder_kernels.dynamics import State, contact_displacement, contact_lever, spring_compression

from ..designs import HORIZON, ROTATION_LIMIT
from .problem import READINGS, Problem, Solver, literal_acceleration, literal_net_moment

ELEMENTS = 5000
TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(4, 19))
ABSOLUTE = 0.1
"""Absolute over relative tolerance: states are metres, radians and their rates, about 0.1 to 10."""


class PaperForces:
    """Right-hand side as the paper has it: arrays over the elements, angles and radii (Eqs 7, 8, 19-36)."""

    def __init__(self, c: Constants, designs: DesignTable, row: int) -> None:
        design = design_at(designs, row)
        alpha = np.array([element_depth(i, c.d, c.elements) for i in range(1, c.elements + 1)])
        d_n = alpha - c.z_0
        self.c = c
        self.R = np.hypot(c.l_n, d_n)
        self.gamma = np.arctan2(c.l_n, -d_n)
        h_e = c.d / c.elements
        self.spring = c.K_soil / (c.d * c.d) * h_e * alpha
        self.ultimate = self.spring * c.x_yield
        self.drag = design.rho_s * design.W * h_e

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        """Rate of the six states."""
        c = self.c
        x_b, v_b, theta, omega, x_v, v_v = y
        angle = self.gamma + theta
        lever = self.R * np.cos(angle)
        displacement = x_b + self.R * np.sin(angle) - self.R * np.sin(self.gamma)
        velocity = v_b + omega * lever
        force = -np.clip(self.spring * displacement, -self.ultimate, self.ultimate)
        force -= self.drag * velocity * np.abs(velocity)
        sin, versin = np.sin(theta), 1.0 - np.cos(theta)
        u = max(spring_compression(x_v, v_v, contact_displacement(x_b, sin, versin, c), c), 0.0)
        M = np.sum(force * lever) + c.k_v * u * contact_lever(sin, versin, c)
        net = literal_net_moment(M, theta, omega, sin, versin, READINGS, c)
        a_b = (np.sum(force) + c.k_v * u) * c.inverse_m_eff
        return np.array((v_b, a_b, omega, net * c.inverse_J_eff, v_v, -c.k_m * u))


@numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def compiled_rates(t: float, y: np.ndarray, c: Constants) -> np.ndarray:
    """Rate of the six states, by the kernels' own functions."""
    k = literal_acceleration(State(y[0], y[1], y[2], y[3], y[4], y[5]), READINGS, c)
    return np.array((y[1], k.a_b, y[3], k.alpha_b, y[5], k.a_v))


def _solve(
    rates: Sequence[Callable[..., np.ndarray]],
    problem: Problem,
    method: str,
    tolerance: float,
    ends: np.ndarray | None = None,
) -> np.ndarray:
    """Solve design by design, as a user of SciPy would; up to other end times [s] than the problem's if given."""
    states = np.full((problem.size, problem.outputs, 6), np.nan)
    for row, rate in enumerate(rates):
        times = problem.times(row)
        span = (0.0, times[-1] if ends is None else ends[row])
        start = np.array((0.0, 0.0, 0.0, 0.0, 0.0, problem.constants(row).v_0))
        found = solve_ivp(rate, span, start, method=method, t_eval=times, rtol=tolerance, atol=ABSOLUTE * tolerance)
        if found.success:
            states[row] = found.y.T
    return states


def _paper(problem: Problem) -> Callable[[float], np.ndarray]:
    rates = [PaperForces(problem.constants(row, ELEMENTS), problem.designs, row) for row in range(problem.size)]
    return lambda tolerance: _solve(rates, problem, "RK45", tolerance)


def _paper_to_horizon(problem: Problem) -> Callable[[float], np.ndarray]:
    """Solve without a known end time: a design that does not overturn is simulated to the horizon."""
    rates = [PaperForces(problem.constants(row, ELEMENTS), problem.designs, row) for row in range(problem.size)]
    ends = np.where(problem.theta < 0.999 * ROTATION_LIMIT, HORIZON, problem.t_end)
    return lambda tolerance: _solve(rates, problem, "RK45", tolerance, ends)


def _compiled(elements: int, method: str, problem: Problem) -> Callable[[float], np.ndarray]:
    rates = [partial(compiled_rates, c=problem.constants(row, elements)) for row in range(problem.size)]
    return lambda tolerance: _solve(rates, problem, method, tolerance)


SOLVERS = [
    Solver("the paper's way: SciPy RK45, NumPy sums, N = 5000", 12, _paper, TOLERANCES),
    Solver("the same, not told the end: to the horizon of 1 s", 12, _paper_to_horizon, TOLERANCES),
    Solver("SciPy RK45, Numba sums, N = 5000", 16, partial(_compiled, ELEMENTS, "RK45"), TOLERANCES),
    Solver("SciPy DOP853, Numba closed form", 32, partial(_compiled, 0, "DOP853"), TOLERANCES),
    Solver("SciPy LSODA, Numba closed form", 32, partial(_compiled, 0, "LSODA"), TOLERANCES),
]
"""All that comes with SciPy."""
