"""heyoka: Taylor's method compiled by LLVM, eight designs in the lanes of the vectors, on the closed form.

A Taylor step evaluates every switch at its start and misses changes within, so the accuracy is decided by the
longest step allowed; the tolerance of the series is fixed well below.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from boulder_kernels import Constants

from .problem import Problem, Solver

LONGEST_STEPS_S = tuple(4e-3 * 2.0 ** (-0.5 * k) for k in range(14))
SERIES_TOLERANCE = 1e-7
LANES = 8
TINY = 1e-6
"""Slope of the soil's motion over the depth below which it counts as this [m], [m/s]. Smaller, and the series of a
break point that passes through the soil at once has no radius of convergence left."""


def _clipped(x: Any, low: Any, high: Any) -> Any:
    return hy.select(hy.lt(x, low), low, hy.select(hy.gt(x, high), high, x))


def away_from_zero(x: Any) -> Any:
    """Return a slope, or another one where it is so small that no series could divide by it."""
    size = hy.select(hy.lt(x, 0.0), -x, x)
    return hy.select(hy.lt(size, TINY), hy.expression(TINY), x)


def soil_sums(
    c: Constants, A: Any, B: Any, s: Any, p: Any, y: Any, R: Any, r_1: Any, r_2: Any, r_0: Any
) -> tuple[Any, Any]:
    """Force of the soil and its moment over the depth, by the break points r, as the kernels' closed form has them.

    Products, because the series of a power divides by its base.
    """
    below, above = y - A, y + A
    a_1, a_2, a_0 = r_1 * r_1, r_2 * r_2, r_0 * r_0
    spring = 0.5 * (below * a_1 + above * a_2 - y) + s * (a_1 * r_1 - a_2 * r_2) / 3.0
    spring_r = (below * a_1 * r_1 + above * a_2 * r_2 - y) / 3.0 + 0.25 * s * (a_1 * a_1 - a_2 * a_2)
    first, second, third, fourth = 2 * r_0 - 1, 2 * a_0 - 1, 2 * a_0 * r_0 - 1, 2 * a_0 * a_0 - 1
    drag = B * B * first - B * p * second + p * p * third / 3.0
    drag_r = 0.5 * B * B * second - B * p * third * (2.0 / 3.0) + 0.25 * p * p * fourth
    return c.K_soil * spring + R * drag, c.K_soil * spring_r + R * drag_r


def _motion(c: Constants) -> list[tuple[Any, Any]]:
    """Equations of motion, switches inside (see `literal_acceleration`); c holds parameters."""
    x_b, v_b, theta, omega, x_v, v_v = names = hy.make_vars("x_b", "v_b", "theta", "omega", "x_v", "v_v")
    zero, one = hy.expression(0.0), hy.expression(1.0)
    sin, cos = hy.sin(theta), hy.cos(theta)
    versin = 1.0 - cos
    lever_d, q = c.d * cos, c.l_n * sin - c.z_0 * cos
    A, B = x_b - c.l_n * versin + c.z_0 * sin, v_b - omega * q
    s, p = away_from_zero(c.d * sin), away_from_zero(omega * lever_d)
    y = hy.select(hy.lt(s, 0.0), -c.x_yield, c.x_yield)
    below, above = y - A, y + A
    r_1, r_2, r_0 = _clipped(-below / s, zero, one), _clipped(above / s, zero, one), _clipped(B / p, zero, one)
    R = hy.select(hy.lt(p, 0.0), -c.R_soil, c.R_soil)
    pressed, pressed_r = soil_sums(c, A, B, s, p, y, R, r_1, r_2, r_0)
    compressed = x_v - x_b - c.h * sin - c.g_x * versin - c.tau_v * (c.v_0 - v_v)
    u = hy.select(hy.gt(compressed, 0.0), compressed, zero)
    F_v = c.k_v * u
    M = lever_d * pressed_r + q * pressed + F_v * (c.h * cos + c.g_x * sin)
    seated = M - _clipped(M, -c.C_cos, c.C_cos)
    forward = M - c.C_cos * cos - c.C_sin * sin
    back = M + c.C_cos * cos - c.C_sin * sin
    at_zero = hy.select(hy.gt(omega, 0.0), forward, hy.select(hy.lt(omega, 0.0), back, seated))
    net = hy.select(hy.gt(theta, 0.0), forward, hy.select(hy.lt(theta, 0.0), back, at_zero))
    rates = (v_b, (F_v - pressed) * c.inverse_m_eff, omega, net * c.inverse_J_eff, v_v, -c.k_m * u)
    return list(zip(names, rates, strict=True))


def _prepare(problem: Problem) -> Callable[[float], np.ndarray]:
    """Compile the series once, in full: half of the time of the compact form. The designs are its parameters."""
    rows = np.array([[float(value) for value in problem.constants(row)] for row in range(problem.size)])
    times = np.array([problem.times(row) for row in range(problem.size)])
    integrator = hy.taylor_adaptive_batch(
        _motion(Constants(*(hy.par[i] for i in range(rows.shape[1])))),
        np.zeros((6, LANES)),
        tol=SERIES_TOLERANCE,
        compact_mode=False,
    )
    v_0 = Constants._fields.index("v_0")

    def solve_all(longest_step: float) -> np.ndarray:
        states = np.full((problem.size, problem.outputs, 6), np.nan)
        for start in range(0, problem.size, LANES):
            part = np.arange(start, min(start + LANES, problem.size))
            lanes = np.resize(part, LANES)  # the last batch is padded with designs it has already
            integrator.set_time(np.zeros(LANES))
            integrator.pars[:] = rows[lanes, : len(integrator.pars)].T  # the last constants do not occur
            integrator.state[:] = 0.0
            integrator.state[5] = rows[lanes, v_0]
            found = integrator.propagate_grid(
                np.ascontiguousarray(times[lanes].T), max_delta_t=np.full(LANES, longest_step)
            )[1]
            states[part] = found[:, :, : len(part)].transpose(2, 0, 1)
        return states

    return solve_all


SOLVERS = [Solver("heyoka Taylor, batches of 8, closed form", 256, _prepare, LONGEST_STEPS_S, in_steps=True)]
"""Without events, as most of the others have none."""
