"""Finer steps for the rows that need them: those refused for their time steps, or undecided for their error.

What is still refused by the finest of them is simulated a last time by `boulder_kernels.last_resort`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from boulder_kernels import Control
from boulder_sweep.columns import REASONS
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST, finer_step_s
from boulder_sweep.judge.judged import NUMERICAL_ERROR, Judged
from boulder_sweep.judge.verdict import STEP_REASONS

FACTOR = 0.25
"""Each time the step is shortened by this factor."""
LAST_RESORT_STEPS = 2_000
"""Steps to the horizon of the last attempt, where nothing asks for shorter ones."""
MOST_STEPS = 20_000
"""Steps to the horizon at which it ends, with the soil in closed form; fewer with many soil elements."""


def finer_controls(control: Control) -> Iterator[Control]:
    """Yield the controls by which open rows are simulated again, each finer than the one before.

    Parameters
    ----------
    control
        How they were simulated first.

    Notes
    -----
    The budget of a row is the last of these controls; sums over soil elements are too slow for it. It
    depends on the settings alone, so a row is the same whatever rows are simulated beside it.
    """
    finest = control.horizon / MOST_STEPS * max(1.0, control.elements / ELEMENTS_AS_FAST)
    h = control.h
    while h > finest:
        h = max(FACTOR * h, finest)
        yield control._replace(h=h, locate_yield=True)
    if control.elements == 0:
        h = min(control.h, control.horizon / LAST_RESORT_STEPS)
        yield control._replace(h=h, locate_yield=True, last_resort=True)


def reported_step_s(control: Control) -> float:
    """Return the step of the solution that is reported [s]."""
    return finer_step_s(control.h) if control.error_estimate else control.h


def is_open(judged: Judged, control: Control) -> np.ndarray:
    """Return which rows finer steps, those of a control, may decide (bool, shape (n,))."""
    refused = [code for code, reason in enumerate(judged.reasons) if code >= len(REASONS) and reason in STEP_REASONS]
    return np.isin(judged.reason, refused if control.last_resort else [NUMERICAL_ERROR, *refused])
