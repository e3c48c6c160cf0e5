"""Other solvers on the same impacts, at the same accuracy, timed in one process: ``python -m benchmarks.peers``.

The other solvers get the model as a plain reading of the equations suggests, with its switches inside the right-hand
side: contact, seat and the direction of the weight's couple are decided in every evaluation. The kernels do not do
this (see `boulder_kernels.events`). The others get an advantage over the kernels: each design ends at the time at which
the kernels stopped, so that no solver simulates more than it needs to, and the peak is taken from the states at some
output times afterwards, untimed. Plain C needs gcc or the package ziglang.
"""

from __future__ import annotations

import argparse
import ctypes
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path

import numba
import numpy as np
from scipy.integrate import solve_ivp

import boulder_kernels as bk
from boulder_kernels import Constants, DesignTable
from boulder_kernels.design import constants_of, design_at, element_depth
from boulder_kernels.dynamics import (
    Acceleration,
    State,
    contact_displacement,
    contact_lever,
    soil_reaction,
    spring_compression,
)
from boulder_kernels.numerics import sine_versine
from boulder_kernels.soil import soil_kinematics
from boulder_sweep.crash_tests.tables import Table

from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, first, sample
from .report import described, significant, write
from .timing import here, timed

READINGS = bk.corrected()
ACCURACY_DEG = 0.01
"""Largest error of the largest rotation at which all are compared."""
OUTPUTS = (65, 49, 33, 25, 17, 13, 9, 5)
"""Times at which a solver gives its state, from 0 to the end: the first until the tolerance is found, then fewer."""
REFERENCE_STEP_S = 5e-5
KERNEL_STEPS_S = (0.016, 0.014, 0.012, 0.010, 0.008, 0.006, 0.004, 0.002, 0.001)
C_STEPS_S = tuple(2e-3 * 2.0 ** (-0.5 * k) for k in range(16))
TOLERANCES = tuple(10.0 ** (-0.5 * k) for k in range(4, 19))
ABSOLUTE = 0.1
"""Absolute over relative tolerance: states are metres, radians and their rates, about 0.1 to 10."""
LONGEST_S = 20.0
"""A solver that takes longer than this for one tolerance is not tried at a finer one."""
ELEMENTS = 5000
PLAIN_C = Path(__file__).with_name("plain.c")
LANES = 8
C_OPTIONS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
"""The options that make the fastest code; none of the results depends on what fast-math takes for granted."""

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})


@_compiled
def net_moment(M: float, theta_b: float, omega_b: float, sin: float, versin: float, c: Constants) -> float:
    """Moment of soil and truck, and the couple of the weight [N m]."""
    if theta_b == 0.0 and omega_b == 0.0:
        return M - min(max(M, -c.C_cos), c.C_cos)
    direction = math.copysign(1.0, theta_b if theta_b != 0.0 else omega_b)
    return M - direction * (c.C_cos - c.C_cos * versin + c.C_sin * abs(sin))


@_compiled
def literal_acceleration(y: State, c: Constants) -> Acceleration:
    """Right-hand side of Eq 52, corrected, with every switch inside."""
    sin, versin = sine_versine(y.theta_b)
    soil = soil_reaction(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = max(spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c), 0.0)
    F_v = c.k_v * u
    M = soil.M + F_v * contact_lever(sin, versin, c)
    net = net_moment(M, y.theta_b, y.omega_b, sin, versin, c)
    return Acceleration((soil.F + F_v) * c.inverse_m_eff, net * c.inverse_J_eff, -c.k_m * u, M)


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
    outputs: int = OUTPUTS[0]

    @property
    def size(self) -> int:
        """Number of designs in the problem."""
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
            rate = literal_acceleration(State(y[0], y[1], y[2], y[3], y[4], y[5]), c)
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
        net = net_moment(M, theta, omega, sin, versin, c)
        a_b = (np.sum(force) + c.k_v * u) * c.inverse_m_eff
        return np.array((v_b, a_b, omega, net * c.inverse_J_eff, v_v, -c.k_m * u))


@_compiled
def compiled_rates(t: float, y: np.ndarray, c: Constants) -> np.ndarray:
    """Rate of the six states, by the kernels' own functions."""
    k = literal_acceleration(State(y[0], y[1], y[2], y[3], y[4], y[5]), c)
    return np.array((y[1], k.a_b, y[3], k.alpha_b, y[5], k.a_v))


def _solve(rates: Sequence[Callable[..., np.ndarray]], problem: Problem, method: str, tolerance: float) -> np.ndarray:
    """Solve design by design, as a user of SciPy would."""
    states = np.full((problem.size, problem.outputs, 6), np.nan)
    for row, rate in enumerate(rates):
        times = problem.times(row)
        start = np.array((0.0, 0.0, 0.0, 0.0, 0.0, problem.constants(row).v_0))
        found = solve_ivp(
            rate, (0.0, times[-1]), start, method=method, t_eval=times, rtol=tolerance, atol=ABSOLUTE * tolerance
        )
        if found.success:
            states[row] = found.y.T
    return states


def _paper(problem: Problem) -> Callable[[float], np.ndarray]:
    rates = [PaperForces(problem.constants(row, ELEMENTS), problem.designs, row) for row in range(problem.size)]
    return lambda tolerance: _solve(rates, problem, "RK45", tolerance)


def _by_scipy(method: str, problem: Problem) -> Callable[[float], np.ndarray]:
    rates = [partial(compiled_rates, c=problem.constants(row)) for row in range(problem.size)]
    return lambda tolerance: _solve(rates, problem, method, tolerance)


def compiler() -> list[str]:
    """Return the command of a C compiler: gcc, or the one that the package ziglang brings.

    Raises
    ------
    FileNotFoundError
        There is neither.
    """
    if found := shutil.which("gcc"):
        return [found, "-mprefer-vector-width=512"]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise FileNotFoundError("neither gcc nor ziglang is here")


@cache
def _library() -> ctypes.CDLL:
    """Compile the library once, and load it."""
    folder = Path(tempfile.mkdtemp(prefix="sweep-plain-c-"))
    try:
        names = ", ".join(Constants._fields)
        (folder / "constants.h").write_text(f"enum {{ {names}, CONSTANTS }};\n")
        target = folder / "plain.so"
        command = [*compiler(), *C_OPTIONS, f"-I{folder}", str(PLAIN_C), "-o", str(target), "-lm"]
        subprocess.run(command, check=True)
        return ctypes.CDLL(str(target))
    finally:
        shutil.rmtree(folder)


def plain_c(problem: Problem) -> Callable[[float], np.ndarray]:
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


SOLVERS = [
    Solver("plain C, RK4, 8 designs side by side, closed form", 1024, plain_c, C_STEPS_S, True),
    Solver("the paper's way: SciPy RK45, NumPy sums, N = 5000", 12, _paper, TOLERANCES),
    Solver("SciPy DOP853, Numba closed form", 32, partial(_by_scipy, "DOP853"), TOLERANCES),
    Solver("SciPy LSODA, Numba closed form", 32, partial(_by_scipy, "LSODA"), TOLERANCES),
]
"""With SciPy design by design, as its users would."""


@dataclass
class Measurement:
    """One solver at several tolerances.

    Parameters
    ----------
    name
        Of the solver.
    designs
        How many designs it solved.
    points
        Tolerance, CPU time per design [s], largest error [deg]; in the order tried.
    in_steps
        Whether the tolerances are steps [s].
    outputs
        Output times; 0 if the solver finds the peaks itself.
    with_fewest
        The chosen point again with no more output times than the accuracy needs.
    """

    name: str
    designs: int
    points: list[tuple[float, float, float]] = field(default_factory=list)
    in_steps: bool = True
    outputs: int = 0
    with_fewest: tuple[float, float, float] | None = None

    @property
    def chosen(self) -> tuple[float, float, float] | None:
        """The loosest tolerance for which all finer ones tried are accurate enough, too."""
        best = None
        for point in reversed(self.points):
            if point[2] > ACCURACY_DEG:
                break
            best = point
        return self.with_fewest or best

    def row(self, lanes_s: float) -> list[str]:
        """Return its row of the table; the lanes take `lanes_s` a design."""
        if self.chosen is None:
            best = min(error for *_, error in self.points)
            return [self.name, str(self.designs), "none", "", f"{significant(best)} deg at best", "", "not comparable"]
        tolerance, cost, error = self.chosen
        return [
            *(self.name, str(self.designs), f"{1e3 * tolerance:.2g} ms" if self.in_steps else f"{tolerance:.0e}"),
            *(str(self.outputs or "none"), f"{significant(error)} deg"),
            *(f"{1e6 * cost:.3g} us" if cost < 1e-2 else f"{1e3 * cost:.3g} ms", f"{cost / lanes_s:,.0f}"),
        ]


def measure_kernels(problem: Problem, *, in_lanes: bool = True) -> Measurement:
    """Measure this project in lanes, or one design after the other; on the whole problem."""
    name = "boulder-sweep, lanes" if in_lanes else "boulder-sweep, single impact, events located"
    measured = Measurement(name, problem.size)

    def simulate(control: bk.Control) -> bk.OutcomeTable:
        return bk.simulate_table(problem.designs, READINGS, control._replace(side_by_side=in_lanes))

    simulate(bk.Control(0.01, HORIZON, ROTATION_LIMIT, 0, False))
    for step in KERNEL_STEPS_S:
        out, seconds = timed(partial(simulate, bk.Control(step, HORIZON, ROTATION_LIMIT, 0, False)), 5)
        # If only one of two solutions stops at the limit, the error is the distance of the other to the limit.
        measured.points.append((step, seconds / problem.size, problem.largest_error_deg(out.theta_max)))
    return measured


def measure_solver(solver: Solver, problem: Problem, finer: int = 1) -> Measurement:
    """Tighten the tolerance until the solver is accurate enough, and a little further.

    Parameters
    ----------
    solver
        Which.
    problem
        At least as many designs as it wants.
    finer
        How many further tolerances to try, to confirm that the accuracy holds.
    """
    own = problem.first(min(solver.designs, problem.size))
    measured = Measurement(solver.name, own.size, in_steps=solver.in_steps)
    solve = solver.prepare(own)
    enough, states = 0, solve(solver.tolerances[0]).ndim > 1
    for tolerance in solver.tolerances:
        point = _point(solve, tolerance, own)
        measured.points.append(point)
        enough = enough + 1 if point[2] <= ACCURACY_DEG else 0
        if enough > finer:
            break
        if point[1] * own.size > LONGEST_S:
            break
    if states:
        measured.outputs = own.outputs
        _try_fewer_outputs(measured, solver, own)
    return measured


def _point(solve: Callable[[float], np.ndarray], tolerance: float, problem: Problem) -> tuple[float, float, float]:
    """Tolerance, CPU time per design [s] and largest error [deg] of one solution."""
    begun = time.process_time()
    found = solve(tolerance)
    seconds = time.process_time() - begun
    error = problem.largest_error_deg(found if found.ndim == 1 else peaks(problem, found))
    return tolerance, seconds / problem.size, error


def _try_fewer_outputs(measured: Measurement, solver: Solver, problem: Problem) -> None:
    """Give fewer output times as long as the chosen tolerance stays accurate enough."""
    if measured.chosen is None:
        return
    for outputs in OUTPUTS[1:]:
        fewer = replace(problem, outputs=outputs)
        solve = solver.prepare(fewer)
        solve(measured.chosen[0])
        point = _point(solve, measured.chosen[0], fewer)
        if point[2] > ACCURACY_DEG:
            return
        measured.outputs, measured.with_fewest = outputs, point


def peers_table() -> str:
    """Measure the kernels and every other solver."""
    problem = problem_of(sample(DESIGNS))
    measured = [measure_kernels(problem), measure_kernels(problem, in_lanes=False)]
    measured += [measure_solver(solver, problem) for solver in SOLVERS]
    lanes = measured[0].chosen
    assert lanes is not None, "the kernels reach the accuracy"
    head = ("solver", "designs", "tolerance (step)", "output times", "error", "CPU time per design", "over the lanes")
    table = Table(head)
    for each in measured:
        table.add(*each.row(lanes[1]))
    return described(
        f"Other solvers at the same accuracy: largest error of the largest rotation at most {ACCURACY_DEG:g} deg",
        f"{here()}; corrected readings; CPU time of all threads; each solver has the first designs of the same sample, "
        "its loosest tolerance that is accurate enough on them, and then the fewest output times that are",
        table,
        "The others get the end time of each design; the lanes find it themselves. Peaks of the others are taken from "
        "the states at their output times by quintic polynomials, uncounted.",
        "The accuracy is easier to reach with fewer designs, which favours solvers with a small sample.",
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the table into benchmarks/README.md")
    asked = parser.parse_args()
    table = peers_table()
    print(table)
    if asked.write:
        write({"peers": table})


if __name__ == "__main__":
    main()
