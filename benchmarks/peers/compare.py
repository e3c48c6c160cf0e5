"""Bring every solver to the same accuracy and time it."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

import boulder_kernels as bk

from ..designs import HORIZON, ROTATION_LIMIT
from ..timing import timed
from .problem import READINGS, Problem, Solver, peaks

ACCURACY_DEG = 0.01
"""Largest error of the largest rotation at which all are compared."""
KERNEL_STEPS_S = (0.016, 0.014, 0.012, 0.010, 0.008, 0.006, 0.004, 0.002, 0.001)
FEWER_OUTPUTS = (49, 33, 25, 17, 13, 9, 5)
"""Numbers of output times that are tried once the tolerance is found; giving fewer is less work for a solver."""
LONGEST_S = 20.0
"""A solver that takes longer than this for one tolerance is not tried at a finer one."""
MODULES = {
    "c_solver": "a C compiler",
    "scipy_solvers": "scipy",
    "numbalsoda_solvers": "numbalsoda",
    "diffrax_solvers": "diffrax",
    "heyoka_solvers": "heyoka",
    "heyoka_events": "heyoka",
}
"""Modules of solvers, with the package each needs."""


@dataclass
class Measured:
    """One solver at several tolerances.

    Parameters
    ----------
    name
        Of the solver.
    designs
        How many designs it solved.
    points
        Tolerance, CPU time per design [s], largest error [deg]; in the order tried.
    problem
        Why there are no more points; empty if there is no problem.
    in_steps
        Whether the tolerances are steps [s].
    outputs
        Output times; None if the solver finds the peaks itself.
    with_fewest
        The chosen point again with no more output times than the accuracy needs; None where it is not known.
    """

    name: str
    designs: int
    points: list[tuple[float, float, float]] = field(default_factory=list)
    problem: str = ""
    in_steps: bool = False
    outputs: int | None = None
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


def measure_kernels(problem: Problem, *, in_lanes: bool = True) -> Measured:
    """Measure this project in lanes, or one design after the other; on the whole problem."""
    name = "boulder-sweep, lanes" if in_lanes else "boulder-sweep, single impact, events located"
    measured = Measured(name, problem.size, in_steps=True)

    def simulate(control: bk.Control) -> bk.OutcomeTable:
        return bk.simulate_table(problem.designs, READINGS, control._replace(side_by_side=in_lanes))

    simulate(bk.Control(0.01, HORIZON, ROTATION_LIMIT, 0, False))
    for step in KERNEL_STEPS_S:
        out, seconds = timed(partial(simulate, bk.Control(step, HORIZON, ROTATION_LIMIT, 0, False)), 5)
        # If only one of two solutions stops at the limit, the error is the distance of the other to the limit.
        measured.points.append((step, seconds / problem.size, problem.largest_error_deg(out.theta_max)))
    return measured


def measure_solver(solver: Solver, problem: Problem, finer: int = 1) -> Measured:
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
    measured = Measured(solver.name, own.size, in_steps=solver.in_steps)
    solve = solver.prepare(own)
    enough, states = 0, solve(solver.tolerances[0]).ndim > 1
    for tolerance in solver.tolerances:
        point = _point(solve, tolerance, own)
        measured.points.append(point)
        enough = enough + 1 if point[2] <= ACCURACY_DEG else 0
        if enough > finer:
            break
        if (seconds := point[1] * own.size) > LONGEST_S:
            measured.problem = f"finer tolerances were not tried: this one took {seconds:.0f} s"
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


def _try_fewer_outputs(measured: Measured, solver: Solver, problem: Problem) -> None:
    """Give fewer output times as long as the chosen tolerance stays accurate enough."""
    if measured.chosen is None:
        return
    for outputs in FEWER_OUTPUTS:
        fewer = replace(problem, outputs=outputs)
        solve = solver.prepare(fewer)
        solve(measured.chosen[0])
        point = _point(solve, measured.chosen[0], fewer)
        if point[2] > ACCURACY_DEG:
            return
        measured.outputs, measured.with_fewest = outputs, point


def measure_all(problem: Problem) -> tuple[list[Measured], list[str]]:
    """Measure the kernels and every solver that is installed.

    Returns
    -------
    measured, missing
        The solvers, this project's lanes first; packages that could not be imported, with the reason.
    """
    measured, missing = [measure_kernels(problem), measure_kernels(problem, in_lanes=False)], []
    for module, package in MODULES.items():
        try:
            solvers = importlib.import_module(f"benchmarks.peers.{module}").SOLVERS
        except (ImportError, OSError) as reason:
            missing.append(f"{package} is missing here and was not measured ({reason})")
            continue
        measured += [measure_solver(solver, problem) for solver in solvers]
    return measured, list(dict.fromkeys(missing))


def finite(points: list[tuple[float, float, float]]) -> list[tuple[float, float]]:
    """CPU time [us] and error [deg] of the points that can be drawn."""
    return [(1e6 * cost, error) for _, cost, error in points if np.isfinite(error) and error > 0.0]
