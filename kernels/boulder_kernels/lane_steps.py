"""Steps of designs side by side, one in each lane of the vector registers, and how a design enters and leaves a lane.

Every lane has its own clock. One attempt advances all lanes of a group by a step (`attempt_steps`), and a second loop
looks at what came out (`take_over_steps`): most steps meet no event and set no peak, and are accepted at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._jit import inlined, kernel
from .after_step import RUNNING, ending_of, enter_modes, initial_state, passed_maxima, passes
from .control import ACCEPTED, Control, attempt_budget, first_length, first_step
from .design import Readings, design_in, is_computable
from .dormand_prince import step
from .dynamics import TURNING_FORWARD, Modes, rate_of
from .error_estimates import error_time, step_errors
from .modes import AT_END, TOLERANCE, initial_modes, needs_moment
from .numerics import field, put
from .outcomes import (
    STATUS,
    Outcome,
    Status,
    compression_at,
    no_maxima,
    write_outcome,
)
from .settling import NO_PROOF, boulder_energy
from .workspace import (
    ATTEMPTS_LEFT,
    ATTENTION,
    BARRIER,
    COMPRESSION,
    CONSTANTS,
    DESIGN,
    END,
    END_STATE,
    ERROR,
    FACTORS,
    HORIZON,
    LANES,
    MAXIMA,
    MODES,
    ROTATION_CHANGES,
    START,
    STATE,
    STATUS_OF_LANE,
    STEP,
    STEP_ERROR,
    STEP_FULL,
    SWITCHES,
    TIME,
    align_stack,
    constants_in_lane,
    load,
    part,
    store,
    store_given,
)


@kernel
def attempt_steps(ws: Any) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    align_stack()
    for lane in range(LANES):
        y_end, k_end, error = step(
            load(ws, STATE, lane),
            load(ws, START, lane),
            field(ws, STEP, lane),
            load(ws, SWITCHES, lane),
            load(ws, CONSTANTS, lane),
        )
        store(ws, END_STATE, lane, y_end)
        store(ws, END, lane, k_end)
        put(ws, STEP_ERROR, lane, error)


@kernel
def take_over_steps(ws: Any) -> int:
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
            put(ws, ERROR, lane, field(ws, ERROR, lane) + field(ws, STEP_ERROR, lane))
            store(ws, STATE, lane, y_end)
            store(ws, START, lane, k_end)
            store(ws, COMPRESSION, lane, end)
            put(ws, TIME, lane, t_next)
            put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), horizon - t_next))
            m = passed_maxima(load(ws, MAXIMA, lane), t, h, y, y_end, start, end, s)
            store(ws, MAXIMA, lane, m)
    return waiting


@kernel
def write_lane(
    ws: Any, lane: int, status: int, designs: np.ndarray, control: Control, out: np.ndarray, row: int
) -> None:
    """Write the outcome of a lane into its row; a design that failed leaves its row NaN."""
    mine = part(ws, lane)
    t = field(mine, TIME, 0)
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        out[STATUS, row] = status
    else:
        t_limit = t if status == Status.LIMIT.value else np.nan
        moved = error_time(field(mine, STEP_FULL, 0), control.locate_yield) * field(mine, ERROR, 0)
        omega_b, changes = load(mine, END_STATE, 0).omega_b, field(mine, ROTATION_CHANGES, 0)
        o = Outcome(status, load(mine, MAXIMA, 0), t_limit, t, 0, moved, omega_b, changes)
        write_outcome(out, row, o, step_errors(o, design_in(designs, row), control.theta_limit, control.horizon))


@kernel
def compute_constants(
    ws: Any, designs: np.ndarray, first: int, readings: Readings, control: Control, longest: float
) -> None:
    """Work out constants and steps of designs, and whether they can be simulated; arguments: see `start_designs`."""
    align_stack()
    # Loads from another array would keep the loop from being vectorised.
    for lane in range(LANES):
        store(ws, DESIGN, lane, design_in(designs, first + lane))
        store_given(ws, lane, designs, first + lane)
    for lane in range(LANES):
        design = load(ws, DESIGN, lane)
        c = constants_in_lane(ws, lane, design, readings)
        h_full, status = first_step(control, control.theta_limit, c)
        status = RUNNING if status == ACCEPTED else status
        status = status if is_computable(c) else Status.INVALID.value
        status = Status.NO_CONTACT.value if design.H - design.d <= design.e_bumper else status
        store(ws, CONSTANTS, lane, c)
        put(ws, STEP_FULL, lane, min(h_full, longest))
        put(ws, STATUS_OF_LANE, lane, float(status))


@kernel
def stand_still(ws: Any, readings: Readings, control: Control) -> None:
    """Put every lane at the instant of impact."""
    align_stack()
    for lane in range(LANES):
        c, h_full = load(ws, CONSTANTS, lane), field(ws, STEP_FULL, lane)
        y, modes = initial_state(c), initial_modes(readings, c)
        switches, factors = enter_modes(
            modes, readings, control.theta_limit, control.locate_yield, control.event_tolerance, c
        )
        store(ws, MODES, lane, modes)
        store(ws, SWITCHES, lane, switches)
        store(ws, FACTORS, lane, factors)
        store(ws, STATE, lane, y)
        store(ws, START, lane, rate_of(y, switches, c))
        store(ws, COMPRESSION, lane, compression_at(y, switches, c))
        store(ws, MAXIMA, lane, no_maxima())
        put(ws, TIME, lane, 0.0)
        put(ws, ERROR, lane, 0.0)
        put(ws, ROTATION_CHANGES, lane, 0.0)
        put(ws, STEP, lane, min(first_length(h_full, factors, c), control.horizon))
        put(ws, ATTEMPTS_LEFT, lane, attempt_budget(h_full, ending_of(control, readings, h_full).longest))
        put(ws, BARRIER, lane, NO_PROOF)
        put(ws, HORIZON, lane, control.horizon)


@kernel
def take_over_first_steps(ws: Any, readings: Readings, control: Control) -> None:
    """Accept the steps that meet no event but that the boulder begins to turn at their end; leave the others undone."""
    align_stack()
    for lane in range(LANES):
        c, s, g = load(ws, CONSTANTS, lane), load(ws, SWITCHES, lane), load(ws, FACTORS, lane)
        y, y_end, k_end = load(ws, STATE, lane), load(ws, END_STATE, lane), load(ws, END, lane)
        start, h = load(ws, COMPRESSION, lane), field(ws, STEP, lane)
        beyond = AT_END * TOLERANCE * c.C_cos if needs_moment(g) & (k_end.M > 0.0) else 0.0
        passing, end = passes(y, y_end, k_end, g, s, c, beyond)
        turning = Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0)
        following, factors = enter_modes(
            turning, readings, control.theta_limit, control.locate_yield, control.event_tolerance, c
        )
        m = passed_maxima(load(ws, MAXIMA, lane), 0.0, h, y, y_end, start, end, s)
        fresh = rate_of(y_end, following, c)
        if passing & (h < control.horizon) & (y_end.v_v > 0.0):
            put(ws, ATTEMPTS_LEFT, lane, field(ws, ATTEMPTS_LEFT, lane) - 1.0)
            put(ws, ERROR, lane, field(ws, STEP_ERROR, lane))
            store(ws, STATE, lane, y_end)
            store(ws, COMPRESSION, lane, end)
            store(ws, MAXIMA, lane, m)
            put(ws, TIME, lane, h)
            put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), control.horizon - h))
            if needs_moment(g) & (c.C_cos < k_end.M):
                store(ws, MODES, lane, turning)
                store(ws, SWITCHES, lane, following)
                store(ws, FACTORS, lane, factors)
                store(ws, START, lane, fresh)
            else:
                store(ws, START, lane, k_end)


@inlined
def start_designs(
    ws: Any, designs: np.ndarray, first: int, readings: Readings, control: Control, longest: float
) -> None:
    """Put as many designs as there are lanes into a group.

    Parameters
    ----------
    ws
        The workspace, from the group on.
    designs, first
        Designs as of `simulate_lanes`, at least as many as lanes, and the row of that in the first lane.
    readings, control
        As of `simulate_lanes`.
    longest
        Longest step that has not failed yet [s]; the one asked for at first.

    Notes
    -----
    A lane is left with the status RUNNING, or with that of a design that needs no integration or allows none.
    """
    compute_constants(ws, designs, first, readings, control, longest)
    stand_still(ws, readings, control)
    attempt_steps(ws)
    take_over_first_steps(ws, readings, control)
