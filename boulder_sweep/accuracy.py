"""From an accuracy asked for to the step that gives it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .settings import SolverSettings

STEPS_S = {"fast": 0.012, "balanced": 0.008, "fine": 0.002}
"""Step behind each named accuracy [s]; where errors are estimated, the solution reported has half of it."""


def step_for(solver: SolverSettings) -> float:
    """Return the step of the integrator [s].

    Parameters
    ----------
    solver
        Settings with an accuracy by name, or a step.

    Raises
    ------
    ValueError
        Where the accuracy is a number: the step is then chosen on the grid itself, not here.
    """
    if solver.step_s is not None:
        return solver.step_s
    if solver.accuracy not in STEPS_S:
        raise ValueError(f"no step belongs to the accuracy {solver.accuracy!r}")
    return STEPS_S[str(solver.accuracy)]
