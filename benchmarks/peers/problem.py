"""The problem that all solvers get, and how their answers are compared.

The other solvers get the model as a plain reading of the equations suggests, with its switches inside the right-hand
side: contact, seat and the direction of the weight's couple are decided in every evaluation. The kernels do not do
this (see `boulder_kernels.modes`). The others get an advantage over the kernels: each design ends at the time at which
the kernels stopped, so that no solver simulates more than it needs to, and the peak is taken from the states at some
output times afterwards, untimed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels import Constants, DesignTable, Readings
from boulder_kernels.design import constants_of, design_at
from boulder_kernels.dynamics import (
    Acceleration,
    State,
    contact_displacement,
    contact_lever,
    holding_moment,
    spring_compression,
)
from boulder_kernels.numerics import sine_versine
from boulder_kernels.soil import soil_kinematics
from boulder_kernels.soil_laws import soil_reaction

from ..designs import HORIZON, ROTATION_LIMIT, first

READINGS = bk.corrected()
OUTPUTS = 65
"""Times at which a solver gives its state, from 0 to the end, unless fewer do."""
REFERENCE_STEP_S = 5e-5

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})


@_compiled
def printed_restoring_moment(
    M: float, theta_b: float, omega_b: float, sin: float, versin: float, c: Constants
) -> float:
    """Restoring moment M_R exactly as printed [N m] (Eqs 37-39), with its switches inside.

    Parameters
    ----------
    M
        Net moment of soil and truck [N m].
    theta_b, omega_b
        Rotation [rad] and angular velocity [rad/s].
    sin, versin
        sin(theta_b) and 1 - cos(theta_b).
    c
        Constants of a design whose restoring moment is read as printed.
    """
    if omega_b <= 0.0:
        return 0.0
    limit = holding_moment(sin, versin, c)
    corner = math.copysign(1.0, c.theta_corner - theta_b)
    return -corner * min(max(M, -limit), limit)


@_compiled
def literal_net_moment(
    M: float, theta_b: float, omega_b: float, sin: float, versin: float, readings: Readings, c: Constants
) -> float:
    """Moment of soil, truck and weight [N m] (Eqs 37-39, or the couple of the weight)."""
    if not readings.restoring_gravity:
        return M + printed_restoring_moment(M, theta_b, omega_b, sin, versin, c)
    if theta_b == 0.0 and omega_b == 0.0:
        return M - min(max(M, -c.C_cos), c.C_cos)
    direction = math.copysign(1.0, theta_b if theta_b != 0.0 else omega_b)
    return M - direction * (c.C_cos - c.C_cos * versin + c.C_sin * abs(sin))


@_compiled
def literal_acceleration(y: State, readings: Readings, c: Constants) -> Acceleration:
    """Right-hand side of Eq 52 with every switch inside."""
    sin, versin = sine_versine(y.theta_b)
    soil = soil_reaction(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    F_v = c.k_v * max(u, 0.0)
    M = soil.M + F_v * contact_lever(sin, versin, c)
    net = literal_net_moment(M, y.theta_b, y.omega_b, sin, versin, readings, c)
    pressed = max(u, 0.0) if readings.separation_released else u
    return Acceleration((soil.F + F_v) * c.inverse_m_eff, net * c.inverse_J_eff, -c.k_m * pressed, M)


@dataclass(frozen=True)
class Problem:
    """Designs with the times at which they end.

    Parameters
    ----------
    designs
        SI, n rows.
    t_end
        End of each [s], shape (n,).
    theta
        Largest rotation of each in the reference [rad], shape (n,).
    outputs
        Times at which a solver gives its state, from 0 to the end: k of them.
    """

    designs: DesignTable
    t_end: np.ndarray
    theta: np.ndarray
    outputs: int = OUTPUTS

    @property
    def size(self) -> int:
        """How many designs."""
        return len(self.t_end)

    def first(self, count: int) -> Problem:
        """Return the problem of the first designs only."""
        return replace(
            self, designs=first(self.designs, count), t_end=self.t_end[:count].copy(), theta=self.theta[:count].copy()
        )

    def times(self, row: int) -> np.ndarray:
        """Output times of a design [s], shape (k,)."""
        return np.linspace(0.0, self.t_end[row], self.outputs)

    def constants(self, row: int, elements: int = 0) -> Constants:
        """Constants of the motion of a design."""
        return constants_of(design_at(self.designs, row), READINGS, elements)

    def largest_error_deg(self, theta: np.ndarray) -> float:
        """Largest error of the largest rotations [deg]; infinite where one is not a number."""
        errors = np.degrees(np.abs(theta - self.theta))
        return float(errors.max()) if np.isfinite(errors).all() else float("inf")


@dataclass(frozen=True)
class Solver:
    """One of the solvers.

    Parameters
    ----------
    name
        What a table calls it.
    designs
        Number of designs it gets; slow solvers get fewer.
    prepare
        Returns, for the problem, the function that solves it at a tolerance, compiled if need be. The function
        returns the states, shape (n, k, 6), or the largest rotations [rad], shape (n,).
    tolerances
        Relative tolerances (or steps) to try, the loosest first.
    in_steps
        Whether they are longest steps [s].
    """

    name: str
    designs: int
    prepare: Callable[[Problem], Callable[[float], np.ndarray]]
    tolerances: tuple[float, ...]
    in_steps: bool = False


def problem_of(designs: DesignTable) -> Problem:
    """Return the problem of some designs, by the kernels with a very small step."""
    control = bk.Control(REFERENCE_STEP_S, HORIZON, ROTATION_LIMIT, 0, False, True, True)
    known = bk.simulate_table(designs, READINGS, control)
    return Problem(designs, known.t_end, known.theta_max)


def peaks(problem: Problem, states: np.ndarray) -> np.ndarray:
    """Largest rotation of each design [rad], from states at the output times, shape (n, k, 6)."""
    return np.array([_peak(problem.constants(row), problem.times(row), states[row]) for row in range(problem.size)])


@_compiled
def _peak(c: Constants, times: np.ndarray, states: np.ndarray) -> float:
    """Largest |theta| of quintic polynomials through rotation, its rate and acceleration at the output times."""
    best = abs(states[0, 2])
    tau = np.linspace(0.0, 1.0, 41)
    for i in range(len(times) - 1):
        best = max(best, abs(states[i + 1, 2]))
        if states[i, 3] * states[i + 1, 3] >= 0.0:
            continue
        h = times[i + 1] - times[i]
        theta, omega, alpha = np.empty(2), np.empty(2), np.empty(2)
        for side in range(2):
            y = states[i + side]
            theta[side], omega[side] = y[2], h * y[3]
            rate = literal_acceleration(State(y[0], y[1], y[2], y[3], y[4], y[5]), READINGS, c)
            alpha[side] = 0.5 * h * h * rate.alpha_b
        left = theta[1] - theta[0] - omega[0] - alpha[0]
        left_v = omega[1] - omega[0] - 2.0 * alpha[0]
        left_a = alpha[1] - alpha[0]
        a3 = 10.0 * left - 4.0 * left_v + left_a
        a4 = -15.0 * left + 7.0 * left_v - 2.0 * left_a
        a5 = 6.0 * left - 3.0 * left_v + left_a
        for s in tau:
            value = theta[0] + s * (omega[0] + s * (alpha[0] + s * (a3 + s * (a4 + s * a5))))
            best = max(best, abs(value))
    return best
