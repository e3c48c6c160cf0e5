"""A boulder that turns about the far end of its foot: two degrees of freedom in place of three (Eqs 131 to 134)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracle.constants import impact_lever
from tests.oracle.heave import Body, generalised, inertia, soil_loads, turned
from tests.oracle.vehicle import jerk


def rolling(body: Body, times: np.ndarray) -> np.ndarray:
    """Motion of a boulder that turns about the outermost strip of its foot, which neither rises nor sinks.

    The oracle's forces and masses without its base, by x and theta alone: the rise follows from the rotation. First the
    boulder stands, until what turns it exceeds its weight. Returns x, theta and the rise until the truck comes off.
    """
    inputs, strip = body.inputs, body.foot[-1:]

    def reduced(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        theta, omega = state[1], state[3]
        X, Y = turned(strip, theta)[0]
        to_all = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, X]])
        q, rates = np.array([state[0], theta, -Y + strip[0, 1]]), to_all @ state[2:4]
        M, needed = inertia(body, q, rates)
        F = soil_loads(body, q, rates) + generalised(body.own, np.array([[0.0, -body.weight]]), theta)
        F += -inputs.m_v * state[6] * np.array([1.0, impact_lever(body.constants, theta), 0.0])
        F -= needed + M @ np.array([0.0, 0.0, Y * omega**2])
        return to_all.T @ M @ to_all, to_all.T @ F

    def rate(_t: float, state: np.ndarray, turns: bool) -> np.ndarray:
        M, F = reduced(state)
        a = np.linalg.solve(M, F) if turns else np.array([F[0] / M[0, 0], 0.0])
        struck = state[2] + state[3] * impact_lever(body.constants, state[1])
        third = jerk(inputs.m_v, inputs.k_v, inputs.c_v, state[6], state[5], struck)
        return np.array([*state[2:4], *a, state[5], state[6], third])

    def tips(_t: float, state: np.ndarray, turns: bool) -> float:
        return reduced(state)[1][1] if not turns else 1.0

    event: Any = tips
    event.terminal = True
    how = {"rtol": 1e-9, "atol": 1e-11, "dense_output": True, "max_step": 2e-3}
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, inputs.v_0, 0.0])
    stands = solve_ivp(rate, (0.0, times[-1]), start, args=(False,), events=tips, **how)
    assert stands.status == 1
    turns = solve_ivp(rate, (stands.t[-1], times[-1]), stands.y[:, -1], args=(True,), **how)
    states = np.array([(stands if t < stands.t[-1] else turns).sol(t) for t in times])
    rise = strip[0, 1] - np.array([turned(strip, theta)[0, 1] for theta in states[:, 1]])
    touching = np.logical_and.accumulate(states[:, 6] <= 0.0)
    return np.column_stack((states[:, :2], rise))[touching]
