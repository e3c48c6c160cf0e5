"""Compiled loops around single kernels, long enough to be timed."""

from __future__ import annotations

import numba
import numpy as np

from boulder_kernels import Constants, Control, DesignTable, Readings
from boulder_kernels.lanes import (
    EMPTY,
    RUNNING,
    attempt_steps,
    attend,
    next_design,
    start_lane,
    take_over_steps,
    write_lane,
)
from boulder_kernels.outcomes import OutcomeTable
from boulder_kernels.soil import Kinematics, closed_form, element_sums
from boulder_kernels.workspace import ATTENTION, LANES, SIZE, field

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})


@_compiled
def filled_workspace(table: DesignTable, readings: Readings, control: Control, steps: int) -> np.ndarray:
    """Return a workspace whose lanes hold the first designs of a table during their motion."""
    ws = np.zeros(SIZE)
    for lane in range(LANES):
        start_lane(ws, lane, table, lane, readings, control)
    for _ in range(steps):
        attempt_steps(ws)
        take_over_steps(ws)
        for lane in range(LANES):
            if field(ws, ATTENTION, lane) != 0.0:
                attend(ws, lane, readings, control)
    return ws


@_compiled
def attempt_often(ws: np.ndarray, times: int) -> None:
    """Attempt the same step repeatedly; its time does not depend on the outcome."""
    for _ in range(times):
        attempt_steps(ws)


@_compiled
def look_often(ws: np.ndarray, before: np.ndarray, times: int) -> None:
    """Check the outcome of the same attempt repeatedly; copying the workspace back costs little in comparison."""
    for _ in range(times):
        ws[:] = before
        take_over_steps(ws)


@_compiled
def copy_often(ws: np.ndarray, before: np.ndarray, times: int) -> None:
    """Do what `look_often` does, without the check."""
    for _ in range(times):
        ws[:] = before


@_compiled
def sum_elements_often(k: Kinematics, c: Constants, times: int) -> float:
    """Sum over the elements repeatedly, at slightly different states."""
    total = 0.0
    for i in range(times):
        total += element_sums(Kinematics(k.A + 1e-6 * i, k.slope_x, k.B, k.slope_v, k.q, k.lever_d), c).M
    return total


@_compiled
def integrate_often(k: Kinematics, c: Constants, times: int) -> float:
    """Evaluate the closed form repeatedly, each time at a state that depends on the previous result."""
    total = 0.0
    for _ in range(times):
        total += closed_form(Kinematics(k.A + 1e-12 * total, k.slope_x, k.B, k.slope_v, k.q, k.lever_d), c).M
    return total


@_compiled
def count_attempts(table: DesignTable, readings: Readings, control: Control, out: OutcomeTable) -> tuple[int, int, int]:
    """Simulate in lanes as `boulder_kernels.lanes.simulate_lanes` does, and count.

    Returns
    -------
    attempts, in_use, attended
        Steps attempted by all lanes; those by lanes that held a design; those handled one by one.
    """
    ws = np.zeros(SIZE)
    rows = np.full(LANES, EMPTY)
    row, running = 0, 0
    attempts, in_use, attended = 0, 0, 0
    for lane in range(LANES):
        rows[lane], row = next_design(ws, lane, row, table, readings, control, out)
        running += rows[lane] != EMPTY
    while running > 0:
        attempts += LANES
        in_use += running
        attempt_steps(ws)
        take_over_steps(ws)
        for lane in range(LANES):
            if field(ws, ATTENTION, lane) != 0.0 and rows[lane] != EMPTY:
                attended += 1
                status = attend(ws, lane, readings, control)
                if status != RUNNING:
                    write_lane(ws, lane, status, out, rows[lane])
                    rows[lane], row = next_design(ws, lane, row, table, readings, control, out)
                    running -= rows[lane] == EMPTY
    return attempts, in_use, attended
