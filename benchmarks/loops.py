"""Compiled loops around single kernels, long enough to be timed."""

from __future__ import annotations

import numba
import numpy as np

from boulder_kernels import Constants, Control, Readings
from boulder_kernels.lanes import (
    EMPTY,
    attempt_steps,
    carry_on,
    find_waiting,
    handle,
    next_design,
    step_groups,
    take_over_steps,
)
from boulder_kernels.outcomes import empty_outcomes
from boulder_kernels.soil import Kinematics, closed_form, element_sums
from boulder_kernels.workspace import EVENTS, GROUPS, LANES, SIZE, WHOLE

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})


@_compiled
def simulate_and_count(
    designs: np.ndarray, readings: Readings, control: Control, sweeps: int
) -> tuple[np.ndarray, tuple[int, int, int]]:
    """Simulate in lanes as `boulder_kernels.lanes.simulate_lanes` does, and count; stop after so many sweeps.

    Returns
    -------
    ws
        The workspace as it was left.
    counts
        Steps attempted by all lanes; those by lanes that held a design; those that needed more than to be accepted.
    """
    out = empty_outcomes(designs.shape[1])
    ws = np.zeros(WHOLE)
    first, second, third, fourth = ws[:SIZE], ws[SIZE:], ws[2 * SIZE :], ws[3 * SIZE :]
    events = ws[EVENTS:]
    rows, waiting = np.zeros(GROUPS * LANES + 1, np.int64), np.zeros(GROUPS * LANES, np.int64)
    running = 0
    attempts, in_use, attended = 0, 0, 0
    for i in range(GROUPS * LANES):
        next_design(ws, i, rows, designs, readings, control, out)
        running += rows[i] != EMPTY
    while running > 0 and attempts < sweeps * GROUPS * LANES:
        attempts += GROUPS * LANES
        in_use += running
        step_groups(first, second, third, fourth)
        count = find_waiting(ws, rows, waiting)
        together = min(LANES, max(running // GROUPS, 1))
        done = 0
        while count - done >= together:
            size = min(LANES, count - done)
            attended += size
            handle(ws, events, waiting, done, size, readings, control)
            for k in range(size):
                i = waiting[done + k]
                carry_on(ws, i, EVENTS + k, rows, designs, readings, control, out)
                running -= rows[i] == EMPTY
            done += size
    return ws, (attempts, in_use, attended)


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
