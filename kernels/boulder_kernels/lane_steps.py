"""Steps of designs side by side, one in each lane of the vector registers, and how a design enters and leaves a lane.

Every lane has its own clock. One attempt advances all lanes of a group by a step (`attempt_steps`), and a second loop
looks at what came out (`take_over_steps`): most steps meet no event and set no peak, and are accepted at once.
"""

from __future__ import annotations

import numpy as np

from ._jit import kernel
from .after_step import RUNNING, enter_modes, initial_state, passed_maxima, passes, rate_of
from .design import constants_of, design_in, is_computable
from .dormand_prince import step
from .impact import Control, attempt_budget, ending_of, first_step
from .outcomes import (
    STATUS,
    Outcome,
    Status,
    compression_at,
    no_maxima,
    write_outcome,
)
from .readings import Readings
from .settling import NO_PROOF, boulder_energy
from .stability import ACCEPTED
from .transitions import initial_modes
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
    MODES,
    START,
    STATE,
    STEP,
    STEP_FULL,
    SWITCHES,
    TIME,
    field,
    load,
    put,
    store,
)


@kernel
def attempt_steps(ws: np.ndarray) -> None:
    """Advance every lane by its step, in one vectorised loop."""
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
def take_over_steps(ws: np.ndarray) -> None:
    """Accept the steps that meet no event, turn nowhere and do not reach the horizon; mark the others."""
    for lane in range(LANES):
        c = load(ws, CONSTANTS, lane)
        s = load(ws, SWITCHES, lane)
        y, y_end = load(ws, STATE, lane), load(ws, END_STATE, lane)
        k_end = load(ws, END, lane)
        start = load(ws, COMPRESSION, lane)
        passing, end = passes(y, y_end, k_end, load(ws, FACTORS, lane), s, c)
        t, h, horizon = field(ws, TIME, lane), field(ws, STEP, lane), field(ws, HORIZON, lane)
        lively = (y_end.v_v > 0.0) | (boulder_energy(y_end, c) >= field(ws, BARRIER, lane))
        plain = passing & (h < horizon - t) & lively
        t_next = t + h
        put(ws, ATTENTION, lane, 0.0 if plain else 1.0)
        if plain:
            put(ws, ATTEMPTS_LEFT, lane, field(ws, ATTEMPTS_LEFT, lane) - 1.0)
            store(ws, STATE, lane, y_end)
            store(ws, START, lane, k_end)
            store(ws, COMPRESSION, lane, end)
            put(ws, TIME, lane, t_next)
            put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), horizon - t_next))
            m = passed_maxima(load(ws, MAXIMA, lane), t, h, y, y_end, start, end, s)
            store(ws, MAXIMA, lane, m)


@kernel
def start_lane(
    ws: np.ndarray,
    lane: int,
    designs: np.ndarray,
    row: int,
    readings: Readings,
    control: Control,
    longest: float,
) -> int:
    """Put a design into a lane.

    Parameters
    ----------
    ws, lane
        The workspace and the lane.
    designs, row
        The design, as of `simulate_lanes`.
    readings, control
        As of `simulate_lanes`.
    longest
        Longest step that has not failed yet [s]; the one asked for at first.

    Returns
    -------
    int
        RUNNING, or the status of a design that needs no integration or allows none.
    """
    mine = ws[lane:]
    design = design_in(designs, row)
    if design.H - design.d <= design.e_bumper:
        return Status.NO_CONTACT.value
    c = constants_of(design, readings, 0)
    if not is_computable(c):
        return Status.INVALID.value
    h_full, status = first_step(control, control.theta_limit, c)
    if status != ACCEPTED:
        return status
    h_full = min(h_full, longest)
    y, modes = initial_state(c), initial_modes(readings, c)
    switches, factors = enter_modes(modes, readings, control.theta_limit, control.locate_yield, c)
    store(mine, CONSTANTS, 0, c)
    store(mine, MODES, 0, modes)
    store(mine, SWITCHES, 0, switches)
    store(mine, FACTORS, 0, factors)
    store(mine, STATE, 0, y)
    store(mine, START, 0, rate_of(y, switches, c))
    store(mine, COMPRESSION, 0, compression_at(y, switches, c))
    store(mine, MAXIMA, 0, no_maxima())
    put(mine, TIME, 0, 0.0)
    put(mine, STEP, 0, min(h_full, control.horizon))
    put(mine, STEP_FULL, 0, h_full)
    put(mine, ATTEMPTS_LEFT, 0, attempt_budget(h_full, ending_of(control, readings, h_full).longest))
    put(mine, BARRIER, 0, NO_PROOF)
    put(mine, HORIZON, 0, control.horizon)
    return RUNNING


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
