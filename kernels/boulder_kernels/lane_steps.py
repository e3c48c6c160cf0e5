"""Steps of designs side by side, one in each lane of the vector registers, and how a design enters and leaves a lane.

Every lane has its own clock. One attempt advances all lanes of a group by a step (`attempt_steps`), and a second loop
looks at what came out (`take_over_steps`): most steps meet no event and set no peak, and are accepted at once.
"""

from __future__ import annotations

import numpy as np

from ._jit import kernel
from .after_step import passed_maxima, passes
from .dormand_prince import step
from .outcomes import (
    STATUS,
    Outcome,
    Status,
    write_outcome,
)
from .settling import boulder_energy
from .workspace import (
    ATTEMPTS_LEFT,
    ATTENTION,
    BARRIER,
    COMPRESSION,
    CONSTANTS,
    END,
    END_STATE,
    FACTORS,
    HORIZON,
    LANES,
    MAXIMA,
    START,
    STATE,
    STEP,
    STEP_FULL,
    SWITCHES,
    TIME,
    align_stack,
    field,
    load,
    put,
    store,
)


@kernel
def attempt_steps(ws: np.ndarray) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    align_stack()
    for lane in range(LANES):
        y_end, k_end = step(
            load(ws, STATE, lane),
            load(ws, START, lane),
            field(ws, STEP, lane),
            load(ws, SWITCHES, lane),
            load(ws, CONSTANTS, lane),
        )
        store(ws, END_STATE, lane, y_end)
        store(ws, END, lane, k_end)


@kernel
def take_over_steps(ws: np.ndarray) -> int:
    """Accept the steps that meet no event, turn nowhere and do not reach the horizon; mark and count the others."""
    align_stack()
    waiting = 0
    for lane in range(LANES):
        c = load(ws, CONSTANTS, lane)
        s = load(ws, SWITCHES, lane)
        y, y_end = load(ws, STATE, lane), load(ws, END_STATE, lane)
        k_end = load(ws, END, lane)
        start = load(ws, COMPRESSION, lane)
        passing, end = passes(y, y_end, k_end, load(ws, FACTORS, lane), s, c, 0.0)
        t, h, horizon = field(ws, TIME, lane), field(ws, STEP, lane), field(ws, HORIZON, lane)
        lively = (y_end.v_v > 0.0) | (boulder_energy(y_end, c) >= field(ws, BARRIER, lane))
        plain = passing & (h < horizon - t) & lively
        t_next = t + h
        put(ws, ATTENTION, lane, 0.0 if plain else 1.0)
        waiting += 0 if plain else 1
        if plain:
            put(ws, ATTEMPTS_LEFT, lane, field(ws, ATTEMPTS_LEFT, lane) - 1.0)
            store(ws, STATE, lane, y_end)
            store(ws, START, lane, k_end)
            store(ws, COMPRESSION, lane, end)
            put(ws, TIME, lane, t_next)
            put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), horizon - t_next))
            m = passed_maxima(load(ws, MAXIMA, lane), t, h, y, y_end, start, end, s)
            store(ws, MAXIMA, lane, m)
    return waiting


@kernel
def write_lane(ws: np.ndarray, lane: int, status: int, out: np.ndarray, row: int) -> None:
    """Write the outcome of a lane into its row; a design that failed leaves its row NaN."""
    mine = ws[lane:]
    t = field(mine, TIME, 0)
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        out[STATUS, row] = status
    else:
        t_limit = t if status == Status.LIMIT.value else np.nan
        write_outcome(out, row, Outcome(status, load(mine, MAXIMA, 0), t_limit, t, 0))
