"""Compiled loops around single kernels, long enough to be timed."""

from __future__ import annotations

import numba
import numpy as np

from boulder_kernels import Constants, Control, Readings
from boulder_kernels.lane_steps import attempt_steps, take_over_steps
from boulder_kernels.lanes import BUSY, HANDLED, STEPPED, Queue, begin, empty_queue, empty_workspace, sweep
from boulder_kernels.outcomes import empty_outcomes
from boulder_kernels.soil import Kinematics, closed_form, element_sums

_compiled = numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})


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
    ws = empty_workspace()
    return ws, _count(designs, readings, control, sweeps, ws, empty_queue(), empty_outcomes(designs.shape[1]))


@_compiled
def _count(
    designs: np.ndarray, readings: Readings, control: Control, sweeps: int, ws: np.ndarray, q: Queue, out: np.ndarray
) -> tuple[int, int, int]:
    attempts, in_use = 0, 0
    begin(ws, q, designs, readings, control, out)
    going = q.counts[BUSY] > 0
    while going and attempts < sweeps * STEPPED:
        attempts += STEPPED
        in_use += q.counts[BUSY]
        going = sweep(ws, q, designs, readings, control, out)
    return attempts, in_use, q.counts[HANDLED]


@_compiled
def attempt_often(ws: np.ndarray, times: int) -> None:
    """Attempt the same step repeatedly; its time does not depend on the outcome."""
    for _ in range(times):
        attempt_steps(ws)


@_compiled
def look_often(ws: np.ndarray, times: int) -> None:
    """Check and accept the outcome of the same attempt repeatedly; no branch, so its time does not depend on it."""
    for _ in range(times):
        take_over_steps(ws)


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
