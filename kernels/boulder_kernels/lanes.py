"""Many designs side by side, one in each lane of the vector registers.

Every lane has its own clock. One attempt advances all lanes of a group by a step (`attempt_steps`), and a second loop
looks at what came out (`take_over_steps`): most steps meet no event and set no peak, and are accepted at once. The few
that need more wait until they fill a group of their own (`boulder_kernels.lane_events`), and a lane whose simulation
has ended gets the next design. What a lane computes does not depend on the others, only when it does so.
"""

from __future__ import annotations

import numpy as np

from ._jit import array_kernel, inlined, kernel
from .after_step import RUNNING, enter_modes, initial_state, passed_maxima, passes, rate_of
from .design import constants_of, design_in, is_computable
from .dormand_prince import step
from .events import SHORTEN
from .impact import Control, attempt_budget, ending_of, first_step
from .lane_events import conclude, start_steps, work_out
from .outcomes import (
    STATUS,
    Outcome,
    Status,
    compression_at,
    empty_outcomes,
    no_maxima,
    write_outcome,
)
from .readings import Readings
from .settling import NO_PROOF, boulder_energy
from .stability import ACCEPTED, MOST_STEPS, RETRY
from .transitions import initial_modes
from .workspace import (
    ATTEMPTS_LEFT,
    ATTENTION,
    BARRIER,
    COMPRESSION,
    CONSTANTS,
    END,
    END_STATE,
    EVENT,
    EVENTS,
    FACTORS,
    GROUPS,
    HORIZON,
    LANES,
    MAXIMA,
    MODES,
    SIZE,
    START,
    STATE,
    STATUS_OF_LANE,
    STEP,
    STEP_FULL,
    SWITCHES,
    TAU,
    TIME,
    WHOLE,
    copy_lane,
    field,
    load,
    put,
    store,
)

EMPTY = -1
"""Row of a lane that holds no design."""


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
    store(ws, CONSTANTS, lane, c)
    store(ws, MODES, lane, modes)
    store(ws, SWITCHES, lane, switches)
    store(ws, FACTORS, lane, factors)
    store(ws, STATE, lane, y)
    store(ws, START, lane, rate_of(y, switches, c))
    store(ws, COMPRESSION, lane, compression_at(y, switches, c))
    store(ws, MAXIMA, lane, no_maxima())
    put(ws, TIME, lane, 0.0)
    put(ws, STEP, lane, min(h_full, control.horizon))
    put(ws, STEP_FULL, lane, h_full)
    put(ws, ATTEMPTS_LEFT, lane, attempt_budget(h_full, ending_of(control, readings, h_full).longest))
    put(ws, BARRIER, lane, NO_PROOF)
    put(ws, HORIZON, lane, control.horizon)
    return RUNNING


@kernel
def write_lane(ws: np.ndarray, lane: int, status: int, out: np.ndarray, row: int) -> None:
    """Write the outcome of a lane into its row; a design that failed leaves its row NaN."""
    t = field(ws, TIME, lane)
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        out[STATUS, row] = status
    else:
        t_limit = t if status == Status.LIMIT.value else np.nan
        write_outcome(out, row, Outcome(status, load(ws, MAXIMA, lane), t_limit, t, 0))


@kernel
def next_design(
    ws: np.ndarray,
    i: int,
    rows: np.ndarray,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Put the next design that needs integration into a lane, writing those that need none on the way.

    Parameters
    ----------
    ws, i
        The workspace and the number of the lane.
    rows
        The row in each lane or EMPTY, and in the last place the first row not yet started.
    designs, readings, control, out
        As of `simulate_lanes`.
    """
    lane = lane_of(i)
    rows[i] = EMPTY
    # An empty lane stands still: its steps have no length, and their results are ignored.
    put(ws, STEP, lane, 0.0)
    put(ws, STEP_FULL, lane, 0.0)
    while rows[i] == EMPTY and rows[-1] < designs.shape[1]:
        row = rows[-1]
        rows[-1] += 1
        status = start_lane(ws, lane, designs, row, readings, control, control.h)
        if status == RUNNING:
            rows[i] = row
        else:
            out[STATUS, row] = status


@inlined
def lane_of(i: int) -> int:
    """Place of lane i = 0 ... GROUPS * LANES - 1."""
    return (i // LANES) * SIZE + i % LANES


@inlined
def step_groups(first: np.ndarray, second: np.ndarray, third: np.ndarray, fourth: np.ndarray) -> None:
    """Attempt a step in all lanes of all groups, and accept those that need no more."""
    attempt_steps(first)
    take_over_steps(first)
    attempt_steps(second)
    take_over_steps(second)
    attempt_steps(third)
    take_over_steps(third)
    attempt_steps(fourth)
    take_over_steps(fourth)


@inlined
def find_waiting(ws: np.ndarray, rows: np.ndarray, waiting: np.ndarray) -> int:
    """List the lanes whose step needs more, and return how many there are."""
    count = 0
    for i in range(GROUPS * LANES):
        if field(ws, ATTENTION, lane_of(i)) != 0.0 and rows[i] != EMPTY:
            waiting[count] = i
            count += 1
    return count


@kernel
def handle(
    ws: np.ndarray, events: np.ndarray, waiting: np.ndarray, done: int, size: int, readings: Readings, control: Control
) -> None:
    """Work out in the group of events what follows from the steps of some of the lanes that wait.

    Parameters
    ----------
    ws, events
        The workspace, and the part of it that is the group of events.
    waiting, done, size
        The lanes that wait, where in their list to begin, and how many to handle.
    readings, control
        As of `simulate_lanes`.
    """
    for k in range(size):
        copy_lane(ws, lane_of(waiting[done + k]), EVENTS + k, 0, SIZE)
    work_out(events, size, control.locate_yield)
    for k in range(size):
        ending = ending_of(control, readings, field(events, STEP_FULL, k))
        put(events, STATUS_OF_LANE, k, float(conclude(events, k, readings, ending, control.locate_yield)))
    start_steps(events)


@kernel
def carry_on(
    ws: np.ndarray,
    i: int,
    other: int,
    rows: np.ndarray,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Let a lane go on with what the group of events has worked out for it, or with the next design.

    Parameters
    ----------
    ws, i, other
        The workspace, the number of the lane, and the place of its lane in the group of events.
    rows, designs, readings, control, out
        As of `next_design`.
    """
    lane, row = lane_of(i), rows[i]
    status = int(field(ws, STATUS_OF_LANE, other))
    if status == RUNNING and field(ws, EVENT, other) == SHORTEN:
        put(ws, STEP, lane, field(ws, TAU, other) * field(ws, STEP, lane))
        put(ws, ATTEMPTS_LEFT, lane, field(ws, ATTEMPTS_LEFT, other))
    elif status == RUNNING:
        copy_lane(ws, other, lane, SWITCHES, ATTENTION)
    else:
        h = field(ws, STEP_FULL, other)
        if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
            status = start_lane(ws, lane, designs, row, readings, control, RETRY * h)
        if status != RUNNING:
            write_lane(ws, other, status, out, row)
            next_design(ws, i, rows, designs, readings, control, out)


@kernel
def run_lanes(
    ws: np.ndarray,
    rows: np.ndarray,
    waiting: np.ndarray,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Simulate every design.

    Parameters
    ----------
    ws, rows, waiting
        The workspace, the row in each lane and the first not yet started, and room for a list of lanes; all zero.
    designs, readings, control, out
        As of `simulate_lanes`, and its result.
    """
    first, second, third, fourth = ws[:SIZE], ws[SIZE:], ws[2 * SIZE :], ws[3 * SIZE :]
    events = ws[EVENTS:]
    running = 0
    for i in range(GROUPS * LANES):
        next_design(ws, i, rows, designs, readings, control, out)
        running += rows[i] != EMPTY
    while running > 0:
        step_groups(first, second, third, fourth)
        count = find_waiting(ws, rows, waiting)
        # A lane that waits attempts the same step again meanwhile.
        together = min(LANES, max(running // GROUPS, 1))
        done = 0
        while count - done >= together:
            size = min(LANES, count - done)
            handle(ws, events, waiting, done, size, readings, control)
            for k in range(size):
                i = waiting[done + k]
                carry_on(ws, i, EVENTS + k, rows, designs, readings, control, out)
                running -= rows[i] == EMPTY
            done += size


@array_kernel
def simulate_lanes(designs: np.ndarray, readings: Readings, control: Control) -> np.ndarray:
    """Simulate every design of a table in lanes, by the closed form of the soil and stopping at the limit.

    Parameters
    ----------
    designs
        Designs, SI, shape (15, n), in the order of `DesignTable`.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit; its choice of soil and of stopping is ignored.

    Returns
    -------
    ndarray, shape (10, n)
        Outcomes in the order of the designs, with rows in the order of `OutcomeTable`; those of errors are NaN.
    """
    out = empty_outcomes(designs.shape[1])
    rows, waiting = np.zeros(GROUPS * LANES + 1, np.int64), np.zeros(GROUPS * LANES, np.int64)
    run_lanes(np.zeros(WHOLE), rows, waiting, designs, readings, control, out)
    return out
