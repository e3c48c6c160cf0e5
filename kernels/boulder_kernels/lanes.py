"""Many designs side by side, one in each lane of the vector registers.

One loop advances all lanes by a step, each by its own clock (`attempt_steps`), and another accepts the steps that are
plain (`take_over_steps`). What follows from any other step is found for its lane alone, by the function that the single
impact uses (`boulder_kernels.following.follow`), and a lane whose design has ended goes on with the next of the table.
Designs are started side by side, in a group of their own. What a lane computes does not depend on the others.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._jit import inlined, kernel
from .control import ACCEPTED, MOST_STEPS, RETRY, Control, first_step
from .design import Readings, design_in, is_computable
from .dormand_prince import step
from .error_estimates import step_errors
from .events import NONE
from .following import (
    RUNNING,
    Clock,
    Impact,
    Pace,
    Watched,
    begin_to_turn,
    failed,
    first_touch,
    follow,
    go_on,
    nothing_watched,
    outcome_of,
    stop_of,
    watch,
)
from .outcomes import STATUS, Outcome, Status, write_outcome
from .time_history import Record
from .workspace import (
    ATTEMPT,
    CLOCK,
    CONSTANTS,
    DESIGN,
    END,
    END_STATE,
    FACTORS,
    FRONT,
    LANES,
    MAXIMA,
    MODES,
    PACE,
    START,
    STARTS,
    STATE,
    SWITCHES,
    Attempt,
    align_stack,
    constants_in_lane,
    copy_lane,
    load,
    part,
    room,
    store,
    store_given,
)

EMPTY = -1
"""Row of a lane that holds no design."""
NEXT = LANES
"""Behind the rows in the lanes: the next row of the table."""


@inlined
def load_impact(ws: Any, lane: int) -> Impact:
    """Return the impact in a lane."""
    return Impact(
        load(ws, PACE, lane),
        load(ws, STATE, lane),
        load(ws, START, lane),
        load(ws, FRONT, lane),
        load(ws, MAXIMA, lane),
        load(ws, CLOCK, lane),
        load(ws, MODES, lane),
        load(ws, SWITCHES, lane),
        load(ws, FACTORS, lane),
    )


@inlined
def store_motion(ws: Any, lane: int, i: Impact) -> None:
    """Write what changes with every step of an impact into its lane."""
    store(ws, STATE, lane, i.y)
    store(ws, START, lane, i.k)
    store(ws, FRONT, lane, i.front)
    store(ws, MAXIMA, lane, i.maxima)
    store(ws, CLOCK, lane, i.clock)


@inlined
def store_modes(ws: Any, lane: int, i: Impact) -> None:
    """Write what changes with the modes of an impact into its lane."""
    store(ws, MODES, lane, i.modes)
    store(ws, SWITCHES, lane, i.switches)
    store(ws, FACTORS, lane, i.factors)


@kernel
def attempt_steps(ws: Any) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    align_stack()
    for lane in range(LANES):
        y_end, k_end, error = step(
            load(ws, STATE, lane),
            load(ws, START, lane),
            load(ws, CLOCK, lane).h,
            load(ws, SWITCHES, lane),
            load(ws, CONSTANTS, lane),
        )
        store(ws, END_STATE, lane, y_end)
        store(ws, END, lane, k_end)
        store(ws, ATTEMPT, lane, Attempt(error, 0.0, load(ws, ATTEMPT, lane).status))


@kernel
def take_over_steps(ws: Any) -> int:
    """Accept the steps that are plain; mark and count the others."""
    align_stack()
    others = 0
    for lane in range(LANES):
        i, error = load_impact(ws, lane), load(ws, ATTEMPT, lane).error
        plain, after = go_on(i, load(ws, END_STATE, lane), load(ws, END, lane), error, load(ws, CONSTANTS, lane))
        store(ws, ATTEMPT, lane, Attempt(error, 1.0 if plain else 0.0, RUNNING))
        others += 0 if plain else 1
        if plain:
            store_motion(ws, lane, after)
    return others


@kernel
def compute_constants(ws: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Work out constants and steps of designs, and whether they can be simulated; arguments: see `start_designs`."""
    align_stack()
    # Loads from another array would keep the loop from being vectorised.
    for lane in range(LANES):
        store(ws, DESIGN, lane, design_in(designs, first + lane))
        store_given(ws, lane, designs, first + lane)
    for lane in range(LANES):
        design = load(ws, DESIGN, lane)
        c = constants_in_lane(ws, lane, design, readings)
        h, status = first_step(control, stop_of(control), c)
        status = RUNNING if status == ACCEPTED else status
        status = status if is_computable(c) else Status.INVALID.value
        status = Status.NO_CONTACT.value if design.H - design.d <= design.e_bumper else status
        store(ws, CONSTANTS, lane, c)
        store(ws, PACE, lane, Pace(h, h, 0.0))
        store(ws, ATTEMPT, lane, Attempt(0.0, 0.0, status))


@kernel
def stand_still(ws: Any, readings: Readings, control: Control) -> None:
    """Put every lane at the first touch."""
    align_stack()
    for lane in range(LANES):
        h = load(ws, PACE, lane).h_touching
        i = first_touch(h, h, load(ws, CONSTANTS, lane), readings, control)
        store(ws, PACE, lane, i.pace)
        store_motion(ws, lane, i)
    # In a loop of its own: with more stores in one the compiler vectorises neither.
    for lane in range(LANES):
        h = load(ws, PACE, lane).h_touching
        store_modes(ws, lane, first_touch(h, h, load(ws, CONSTANTS, lane), readings, control))


@kernel
def take_first_steps(ws: Any, readings: Readings, control: Control) -> None:
    """Accept the first steps that end where the boulder begins to turn; leave the others undone."""
    align_stack()
    for lane in range(LANES):
        i, error, c = load_impact(ws, lane), load(ws, ATTEMPT, lane).error, load(ws, CONSTANTS, lane)
        turns, after = begin_to_turn(i, load(ws, END_STATE, lane), load(ws, END, lane), error, c, readings, control)
        if turns:
            store_motion(ws, lane, after)
            store_modes(ws, lane, after)


@inlined
def start_designs(ws: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Put as many designs as there are lanes into a group, and take their first step where it ends as it should.

    Parameters
    ----------
    ws
        The workspace, from the group on.
    designs, first
        The designs of `simulate_lanes`, and the row of the design in the first lane.
    readings, control
        How they are simulated.

    Notes
    -----
    A lane is left with the status RUNNING, or with the status of a design that needs no integration or allows none.
    """
    compute_constants(ws, designs, first, readings, control)
    stand_still(ws, readings, control)
    attempt_steps(ws)
    take_first_steps(ws, readings, control)


@inlined
def next_design(
    ws: Any, rows: np.ndarray, lane: int, designs: np.ndarray, readings: Readings, control: Control, out: np.ndarray
) -> None:
    """Put the next design that needs integration into a lane; write those that need none."""
    while rows[NEXT] < out.shape[1]:
        row = rows[NEXT]
        rows[NEXT] += 1
        if row % LANES == 0:
            start_designs(part(ws, STARTS), designs, row, readings, control)
        status = int(load(part(ws, STARTS), ATTEMPT, row % LANES).status)
        if status == RUNNING:
            copy_lane(ws, STARTS + row % LANES, lane, END_STATE)
            rows[lane] = row
            return
        out[STATUS, row] = status
    rows[lane] = EMPTY
    # An empty lane stands still: its steps have no length, and their results are ignored.
    store(ws, CLOCK, lane, Clock(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@kernel
def follow_lane(ws: Any, lane: int, readings: Readings, control: Control) -> int:
    """Find what follows from the step of a lane, see `boulder_kernels.following.follow`; return its status."""
    mine = part(ws, lane)
    i, c = load_impact(mine, 0), load(mine, CONSTANTS, 0)
    error = load(mine, ATTEMPT, 0).error
    followed = follow(i, load(mine, END_STATE, 0), load(mine, END, 0), error, c, readings, control)
    status, after = followed.status, followed.impact
    if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * i.clock.h_full:
        h = RETRY * i.clock.h_full
        after = first_touch(h, h, c, readings, control)
        store(mine, PACE, 0, after.pace)
        status = RUNNING
    store_motion(mine, 0, after)
    if followed.event > NONE or after.clock.t == 0.0:
        store_modes(mine, 0, after)
    return status


@kernel
def write_lane(
    ws: Any, lane: int, status: int, t_limit: float, designs: np.ndarray, control: Control, out: np.ndarray, row: int
) -> Outcome:
    """Write the outcome of a lane into its row, and return it; a design that failed leaves its row NaN."""
    o = outcome_of(load_impact(part(ws, lane), 0), status, t_limit, control)
    if np.isnan(o.t_end):
        out[STATUS, row] = status
    else:
        write_outcome(out, row, o, step_errors(o, design_in(designs, row), control.theta_limit, control.horizon))
    return o


@kernel
def watch_lane(ws: Any, w: Watched, control: Control, record: Record) -> Watched:
    """Note what there is of a step of the first lane, whose impact at its start lies in the group of starts."""
    i, after = load_impact(part(ws, STARTS), 0), load_impact(ws, 0)
    if after.clock.t == 0.0:
        return nothing_watched()  # it starts again, by shorter steps
    if after.clock.t == i.clock.t:
        return w
    return watch(w, i, load(ws, END_STATE, 0), load(ws, END, 0), after, load(ws, CONSTANTS, 0), control, record)


@kernel
def run_lanes(
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    ws: Any,
    rows: np.ndarray,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Simulate every design of a table, and return the outcome of the last that has ended.

    Parameters
    ----------
    designs, readings, control, record, out
        The same as in `simulate_lanes`, with designs for whole groups.
    ws, rows
        The workspace; the rows of the designs in the lanes, EMPTY before they are filled, and behind them 0.
    """
    for lane in range(LANES):
        next_design(ws, rows, lane, designs, readings, control, out)
    o, w = failed(int(out[STATUS, -1])), nothing_watched()
    watching = out.shape[1] == 1 and (record.times.size > 0 or not control.stop_at_limit)
    if watching:
        copy_lane(ws, STARTS, 0, DESIGN)  # with the end of its first step
        stand_still(part(ws, STARTS), readings, control)
        w = watch_lane(ws, w, control, record)
    busy = rows[0] != EMPTY
    while busy:
        if watching:
            copy_lane(ws, 0, STARTS, DESIGN)
        attempt_steps(ws)
        busy = take_over_steps(ws) == 0
        for lane in range(LANES if watching or not busy else 0):
            if rows[lane] == EMPTY:
                continue
            busy, status = True, RUNNING
            if load(ws, ATTEMPT, lane).plain == 0.0:
                status = follow_lane(ws, lane, readings, control)
            if watching:
                w = watch_lane(ws, w, control, record)
            if status != RUNNING:
                o = write_lane(ws, lane, status, w.t_limit, designs, control, out, rows[lane])
                next_design(ws, rows, lane, designs, readings, control, out)
    return o


def empty_workspace(soil: type | None = None, parts: int = 0) -> Any:
    """Return the workspace before the first design has been started, its vectors on whole lines of the fast memory.

    Parameters
    ----------
    soil
        Type of the workspace, of `boulder_kernels.workspace.SOILS`; None for uniform soils.
    parts
        Number of parts of the soil of a design.
    """
    ws = np.zeros(room(soil, parts) + LANES)
    behind = ws.ctypes.data // ws.itemsize % LANES
    ws = ws[LANES - behind :]
    return ws if soil is None else soil(ws, (0,) * parts)


def filled_up(designs: np.ndarray) -> np.ndarray:
    """Return designs that fill whole groups of lanes, the last one repeated."""
    missing = -designs.shape[1] % LANES
    return np.pad(designs, ((0, 0), (0, missing)), "edge") if missing else designs


def simulate_lanes(
    designs: np.ndarray,
    soil: type | None,
    parts: int,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Simulate every design of a table in lanes, by a closed form of the soil.

    Parameters
    ----------
    designs
        Designs, SI, shape (15 + G, n): first the fields of `DesignTable`, then what is given of their soil, see
        `boulder_kernels.workspace.LaneSoil`.
    soil, parts
        The same as in `empty_workspace`; a number of parts in `boulder_kernels.layered.COUNTS`.
    readings
        Which formulas are read as printed.
    control
        How they are simulated, its choice of soil ignored. One that does not stop at the limit is for one design.
    record
        Filled with the time history of one design at the times it names; for several, one that keeps nothing.
    out
        Where the outcomes go in the order of the designs, an array of `boulder_kernels.outcomes.empty_outcomes`.

    Returns
    -------
    Outcome
        The outcome of the design that ended last.
    """
    rows = np.full(LANES + 1, EMPTY)
    rows[NEXT] = 0
    return run_lanes(filled_up(designs), readings, control, empty_workspace(soil, parts), rows, record, out)
