"""diffrax on JAX: all designs of a batch at once by `vmap`, compiled by XLA for the CPU, with the closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from boulder_kernels import Constants

from .problem import Problem, Solver

jax.config.update("jax_enable_x64", True)

TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(4, 17))
ABSOLUTE = 0.1
"""Absolute over relative tolerance: states are metres, radians and their rates, about 0.1 to 10."""
BATCH = 128
"""Designs solved together; all wait for the slowest, so more is not faster."""
MOST_STEPS = 20_000
TINY = 1e-30


def _soil(x_b: Any, v_b: Any, omega: Any, sin: Any, versin: Any, c: Constants) -> tuple[Any, Any]:
    """Force and moment of the soil, as `boulder_kernels.soil.closed_form` has them."""
    cos = 1.0 - versin
    lever_d, q = c.d * cos, c.l_n * sin - c.z_0 * cos
    A, slope_x = x_b - c.l_n * versin + c.z_0 * sin, c.d * sin
    B, slope_v = v_b - omega * q, omega * lever_d
    s = jnp.copysign(jnp.maximum(jnp.abs(slope_x), TINY), slope_x)
    p = jnp.copysign(jnp.maximum(jnp.abs(slope_v), TINY), slope_v)
    y = jnp.copysign(c.x_yield, s)
    below, above = y - A, y + A
    r_1 = jnp.clip(-below / s, 0.0, 1.0)
    r_2 = jnp.clip(above / s, 0.0, 1.0)
    r_0 = jnp.clip(B / p, 0.0, 1.0)
    spring = 0.5 * (below * r_1**2 + above * r_2**2 - y) + s / 3.0 * (r_1**3 - r_2**3)
    spring_r = (below * r_1**3 + above * r_2**3 - y) / 3.0 + 0.25 * s * (r_1**4 - r_2**4)
    BB, Bp, pp = B * B, B * p, p * p
    one, two, three, four = 2 * r_0 - 1, 2 * r_0**2 - 1, 2 * r_0**3 - 1, 2 * r_0**4 - 1
    drag = BB * one - Bp * two + pp * three / 3.0
    drag_r = 0.5 * BB * two - 2.0 / 3.0 * Bp * three + 0.25 * pp * four
    R = jnp.copysign(c.R_soil, p)
    pressed, pressed_r = c.K_soil * spring + R * drag, c.K_soil * spring_r + R * drag_r
    return -pressed, lever_d * pressed_r + q * pressed


def _rates(t: Any, state: Any, c: Constants) -> Any:
    """Rate of the six states, switches inside (see `literal_acceleration`)."""
    x_b, v_b, theta, omega, x_v, v_v = state
    sin = jnp.sin(theta)
    versin = 2.0 * jnp.sin(0.5 * theta) ** 2
    F, M = _soil(x_b, v_b, omega, sin, versin, c)
    u = jnp.maximum(x_v - x_b - c.h * sin - c.g_x * versin - c.tau_v * (c.v_0 - v_v), 0.0)
    F_v = c.k_v * u
    M = M + F_v * (c.h - c.h * versin + c.g_x * sin)
    direction = jnp.copysign(1.0, jnp.where(theta != 0.0, theta, omega))
    turning = M - direction * (c.C_cos - c.C_cos * versin + c.C_sin * jnp.abs(sin))
    seated = M - jnp.clip(M, -c.C_cos, c.C_cos)
    net = jnp.where((theta == 0.0) & (omega == 0.0), seated, turning)
    return v_b, (F + F_v) * c.inverse_m_eff, omega, net * c.inverse_J_eff, v_v, -c.k_m * u


def _solve_one(times: Any, c: Constants, tolerance: Any) -> Any:
    """Solve one design; the states at the output times, six arrays."""
    start = (0.0, 0.0, 0.0, 0.0, 0.0, c.v_0)
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(_rates),
        diffrax.Tsit5(),
        t0=0.0,
        t1=times[-1],
        dt0=1e-4,
        y0=tuple(jnp.asarray(value, dtype=float) for value in start),
        args=c,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=ABSOLUTE * tolerance),
        max_steps=MOST_STEPS,
        throw=False,
    )
    return jnp.stack(found.ys, axis=-1)


def _prepare(problem: Problem) -> Callable[[float], np.ndarray]:
    """Compile for batches of one size."""
    rows = [problem.constants(row) for row in range(problem.size)]
    columns = [np.array(values, dtype=float) for values in zip(*rows, strict=True)]
    times = np.array([problem.times(row) for row in range(problem.size)])
    solve = jax.jit(jax.vmap(_solve_one, in_axes=(0, 0, None)))
    parts = [slice(i, i + BATCH) for i in range(0, problem.size, BATCH)]
    batches = [(jnp.asarray(times[part]), Constants(*(jnp.asarray(v[part]) for v in columns))) for part in parts]

    def solve_all(tolerance: float) -> np.ndarray:
        return np.concatenate([np.asarray(solve(*batch, tolerance)) for batch in batches])

    solve_all(1e-2)
    return solve_all


SOLVERS = [Solver("diffrax Tsit5, vmap on CPU, closed form", 512, _prepare, TOLERANCES)]
"""The method that its documentation recommends."""
