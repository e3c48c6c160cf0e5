"""heyoka with its terminal events: a step ends where a switch turns, so that only the tolerance limits the steps.

What is switched is held by parameters, the modes, which a callback sets at every event. The callbacks are Python, as
those of its users are.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from typing import Any

import heyoka as hy
import numpy as np

from boulder_kernels import Constants

from .heyoka_solvers import LANES, away_from_zero, soil_sums
from .problem import Problem, Solver

TOLERANCES = tuple(10.0 ** (-k) for k in range(7))
COOLDOWN_S = 1e-6
"""Time after an event in which the same one is not looked for [s]."""
CONSTANTS = len(Constants._fields)
CONTACT, RELEASED, SIDE, SLOPE_X, SLOPE_V, FIRST, GAIN_1, SECOND, GAIN_2, VELOCITY, GAIN_V = range(
    CONSTANTS, CONSTANTS + 11
)
"""Parameters: whether truck and boulder touch, and the boulder turns, to which side; signs of the slopes of the soil's
displacement and velocity over the depth; and each break point as a constant and a gain of where it would be.
"""
TRUCK, TILT, TURN, FORWARD, BACK = range(6, 11)
"""Events beside the six of the soil: contact, rotation, its rate, and the moments that set the boulder turning."""
HARDLY = 1e-300


def _motion(c: Constants) -> tuple[list[tuple[Any, Any]], list[Any]]:
    """Equations of motion, and what is zero at the events; c holds parameters, as do the modes."""
    x_b, v_b, theta, omega, x_v, v_v = names = hy.make_vars("x_b", "v_b", "theta", "omega", "x_v", "v_v")
    sine, cosine = hy.sin(theta), hy.cos(theta)
    versin = 1.0 - cosine
    lever_d, q = c.d * cosine, c.l_n * sine - c.z_0 * cosine
    A, B, s, p = x_b - c.l_n * versin + c.z_0 * sine, v_b - omega * q, c.d * sine, omega * lever_d
    y, mode = hy.par[SLOPE_X] * c.x_yield, hy.par
    r_1 = mode[FIRST] + mode[GAIN_1] * (A - y) / away_from_zero(s)
    r_2 = mode[SECOND] + mode[GAIN_2] * (A + y) / away_from_zero(s)
    r_0 = mode[VELOCITY] + mode[GAIN_V] * B / away_from_zero(p)
    pressed, pressed_r = soil_sums(c, A, B, s, p, y, mode[SLOPE_V] * c.R_soil, r_1, r_2, r_0)
    compression = x_v - x_b - c.h * sine - c.g_x * versin - c.tau_v * (c.v_0 - v_v)
    u = mode[CONTACT] * compression
    M = lever_d * pressed_r + q * pressed + c.k_v * u * (c.h * cosine + c.g_x * sine)
    net = mode[RELEASED] * (M - mode[SIDE] * c.C_cos * cosine - c.C_sin * sine)
    rates = (v_b, (c.k_v * u - pressed) * c.inverse_m_eff, omega, net * c.inverse_J_eff, v_v, -c.k_m * u)
    # A boulder that turns is not released again: its moments of release are moved away from zero.
    held = 1.0 - mode[RELEASED]
    forward, back = held * (M - c.C_cos) - mode[RELEASED], held * (M + c.C_cos) + mode[RELEASED]
    soil = [A - c.x_yield, A + c.x_yield, A - s - c.x_yield, A - s + c.x_yield, B, B - p]
    return list(zip(names, rates, strict=True)), [*soil, compression, theta, omega, forward, back]


def _set_modes(integrator: Any, lane: int, event: int, sign: float) -> None:
    """Set the modes of a lane from its state, and from the sign that one of the events has from now on."""
    x_b, v_b, theta, omega, x_v, v_v = integrator.state[:, lane].tolist()
    mode, c = integrator.pars, Constants(*integrator.pars[:CONSTANTS, lane].tolist())
    sine, cosine = sin(theta), cos(theta)
    A, s = x_b - c.l_n * (1.0 - cosine) + c.z_0 * sine, c.d * sine
    B, p = v_b - omega * (c.l_n * sine - c.z_0 * cosine), omega * c.d * cosine
    compression = x_v - x_b - c.h * sine - c.g_x * (1.0 - cosine) - c.tau_v * (c.v_0 - v_v)
    y = c.x_yield
    at = [A - y, A + y, A - s - y, A - s + y, B, B - p, compression, theta, omega]
    if event in (FORWARD, BACK):
        at[TILT] = at[TURN] = HARDLY * sign
        mode[RELEASED, lane], mode[SIDE, lane] = 1.0, sign
    else:
        at[event] = HARDLY * sign
    if event == TILT:
        mode[SIDE, lane] = sign
    slope_x = 1.0 if at[TILT] > 0.0 or (at[TILT] == 0.0 and at[TURN] >= 0.0) else -1.0
    slope_v = 1.0 if at[TURN] >= 0.0 else -1.0
    mode[CONTACT, lane], mode[SLOPE_X, lane], mode[SLOPE_V, lane] = float(at[TRUCK] > 0.0), slope_x, slope_v
    first, second = (0, 1) if slope_x > 0.0 else (1, 0)
    mode[FIRST, lane], mode[GAIN_1, lane] = _break_point(slope_x * at[first], slope_x * at[first + 2])
    mode[SECOND, lane], mode[GAIN_2, lane] = _break_point(slope_x * at[second], slope_x * at[second + 2])
    mode[VELOCITY, lane], mode[GAIN_V, lane] = _break_point(slope_v * at[4], slope_v * at[5])


def _break_point(above: float, below: float) -> tuple[float, float]:
    """Constant and gain of a break point: at the surface, at the base, or between."""
    return (0.0, 0.0) if above <= 0.0 else ((1.0, 0.0) if below >= 0.0 else (0.0, 1.0))


def _at_event(event: int) -> Callable[[Any, int, int], bool]:
    """Return what is called at an event; it lets the integration go on."""

    def call(integrator: Any, sign: int, lane: int) -> bool:
        if event in (FORWARD, BACK):
            sign = 1 if event == FORWARD else -1
        if sign:  # none: at the start, where the value only leaves zero
            _set_modes(integrator, lane, event, float(sign))
        return True

    return call


def _compiled(tolerance: float) -> Any:
    """Compile the series, in full, for one tolerance; the designs are its parameters."""
    motion, zeros = _motion(Constants(*(hy.par[i] for i in range(CONSTANTS))))
    events = [
        hy.t_event_batch(zero, callback=_at_event(event), cooldown=COOLDOWN_S) for event, zero in enumerate(zeros)
    ]
    parameters = np.zeros((GAIN_V + 1, LANES))
    return hy.taylor_adaptive_batch(
        motion, np.zeros((6, LANES)), tol=tolerance, compact_mode=False, t_events=events, pars=parameters
    )


def _prepare(problem: Problem) -> Callable[[float], np.ndarray]:
    rows = np.array([[float(value) for value in problem.constants(row)] for row in range(problem.size)])
    times = np.array([problem.times(row) for row in range(problem.size)])
    compiled = {tolerance: _compiled(tolerance) for tolerance in TOLERANCES}
    v_0 = Constants._fields.index("v_0")

    def solve_all(tolerance: float) -> np.ndarray:
        integrator = compiled[tolerance]
        states = np.full((problem.size, problem.outputs, 6), np.nan)
        for start in range(0, problem.size, LANES):
            part = np.arange(start, min(start + LANES, problem.size))
            lanes = np.resize(part, LANES)  # the last batch is padded with designs it has already
            integrator.set_time(np.zeros(LANES))
            integrator.reset_cooldowns()
            integrator.pars[:] = 0.0
            integrator.pars[:CONSTANTS] = rows[lanes].T
            integrator.state[:] = 0.0
            integrator.state[5] = rows[lanes, v_0]
            for lane in range(LANES):
                _set_modes(integrator, lane, TRUCK, 1.0)
            found = integrator.propagate_grid(np.ascontiguousarray(times[lanes].T))[1]
            states[part] = found[:, :, : len(part)].transpose(2, 0, 1)
        return states

    return solve_all


SOLVERS = [Solver("heyoka Taylor, batches of 8, events located, closed form", 256, _prepare, TOLERANCES)]
"""With events, which no other package has here."""
