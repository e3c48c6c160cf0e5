"""Many designs side by side, one in each lane of the vector registers.

One loop advances all lanes by a step, each by its own clock (`attempt_steps`), and another accepts the steps that are
plain (`take_over_steps`). What follows from any other step is found for its lane alone, by the function that the single
impact uses (`boulder_kernels.following.follow`), and a lane whose design has ended goes on with the next of the table.
Designs are started side by side, in a group of their own. What a lane computes does not depend on the others.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._jit import align_stack, inlined, kernel
from .control import ACCEPTED, MOST_STEPS, RETRY, Control, first_step
from .design import Readings, design_in, is_computable
from .dormand_prince import step
from .error_estimates import step_errors
from .events import NONE
from .following import (
    RUNNING,
    Clock,
    ImpactNotes,
    Pace,
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
    LANES,
    constants_in_lane,
    copy_start,
    copy_step,
    empty_groups,
    load_acceleration,
    load_constants,
    load_design,
    load_impact,
    load_state,
    load_switches,
    store_acceleration,
    store_attempt,
    store_clock,
    store_constants,
    store_design,
    store_given,
    store_modes,
    store_motion,
    store_pace,
    store_state,
)

EMPTY = -1
"""Row of a lane that holds no design."""
NEXT = LANES
"""Behind the rows in the lanes: the next row of the table."""


@kernel
def attempt_steps(group: Any) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    align_stack()
    for lane in range(LANES):
        y_end, k_end, error = step(
            load_state(group.state, lane),
            load_acceleration(group.start, lane),
            group.clock.h[lane],
            load_switches(group, lane),
            load_constants(group, lane),
        )
        store_state(group.end_state, lane, y_end)
        store_acceleration(group.end, lane, k_end)
        store_attempt(group, lane, error, 0.0, group.attempt.status[lane])


@kernel
def take_over_steps(group: Any) -> int:
    """Accept the steps that are plain; mark and count the others."""
    align_stack()
    others = 0
    for lane in range(LANES):
        i, error, c = load_impact(group, lane), group.attempt.error[lane], load_constants(group, lane)
        y_end, k_end = load_state(group.end_state, lane), load_acceleration(group.end, lane)
        plain, after = go_on(i, y_end, k_end, error, c)
        store_attempt(group, lane, error, 1.0 if plain else 0.0, RUNNING)
        others += 0 if plain else 1
        if plain:
            store_motion(group, lane, after)
    return others


@kernel
def compute_constants(group: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Work out constants and steps of designs, and whether they can be simulated; arguments: see `start_designs`."""
    align_stack()
    # Loads from another array would keep the loop from being vectorised.
    for lane in range(LANES):
        store_design(group, lane, design_in(designs, first + lane))
        store_given(group, lane, designs, first + lane)
    for lane in range(LANES):
        design = load_design(group, lane)
        c = constants_in_lane(group, lane, design, readings)
        h, status = first_step(control, stop_of(control), c)
        status = RUNNING if status == ACCEPTED else status
        status = status if is_computable(c) else Status.INVALID.value
        status = Status.NO_CONTACT.value if design.H - design.d <= design.e_bumper else status
        store_constants(group, lane, c)
        store_pace(group, lane, Pace(h, h, 0.0))
        store_attempt(group, lane, 0.0, 0.0, status)


@kernel
def stand_still(group: Any, readings: Readings, control: Control) -> None:
    """Put every lane at the first touch."""
    align_stack()
    for lane in range(LANES):
        h = group.pace.h_touching[lane]
        i = first_touch(h, h, load_constants(group, lane), readings, control)
        store_pace(group, lane, i.pace)
        store_motion(group, lane, i)
    # In a loop of its own: with more stores in one the compiler vectorises neither.
    for lane in range(LANES):
        h = group.pace.h_touching[lane]
        store_modes(group, lane, first_touch(h, h, load_constants(group, lane), readings, control))


@kernel
def take_first_steps(group: Any, readings: Readings, control: Control) -> None:
    """Accept the first steps that end where the boulder begins to turn; leave the others undone."""
    align_stack()
    for lane in range(LANES):
        i, error, c = load_impact(group, lane), group.attempt.error[lane], load_constants(group, lane)
        turns, after = begin_to_turn(
            i, load_state(group.end_state, lane), load_acceleration(group.end, lane), error, c, readings, control
        )
        if turns:
            store_motion(group, lane, after)
            store_modes(group, lane, after)


@inlined
def start_designs(group: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Put as many designs as there are lanes into a group, and take their first step where it ends as it should.

    Parameters
    ----------
    group
        The group.
    designs, first
        The designs of `simulate_lanes`, and the row of the design in the first lane.
    readings, control
        How they are simulated.

    Notes
    -----
    A lane is left with the status RUNNING, or with the status of a design that needs no integration or allows none.
    """
    compute_constants(group, designs, first, readings, control)
    stand_still(group, readings, control)
    attempt_steps(group)
    take_first_steps(group, readings, control)


@inlined
def next_design(
    groups: Any, rows: np.ndarray, lane: int, designs: np.ndarray, readings: Readings, control: Control, out: np.ndarray
) -> None:
    """Put the next design that needs integration into a lane; write those that need none."""
    running, starting = groups[0], groups[1]
    while rows[NEXT] < out.shape[1]:
        row = rows[NEXT]
        rows[NEXT] += 1
        if row % LANES == 0:
            start_designs(starting, designs, row, readings, control)
        status = int(starting.attempt.status[row % LANES])
        if status == RUNNING:
            copy_start(running, lane, starting, row % LANES)
            rows[lane] = row
            return
        out[STATUS, row] = status
    rows[lane] = EMPTY
    # An empty lane stands still: its steps have no length, and their results are ignored.
    store_clock(running, lane, Clock(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@kernel
def follow_lane(group: Any, lane: int, readings: Readings, control: Control) -> int:
    """Find what follows from the step of a lane, see `boulder_kernels.following.follow`; return its status."""
    i, c, error = load_impact(group, lane), load_constants(group, lane), group.attempt.error[lane]
    y_end, k_end = load_state(group.end_state, lane), load_acceleration(group.end, lane)
    followed = follow(i, y_end, k_end, error, c, readings, control)
    status, after = followed.status, followed.impact
    if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * i.clock.h_full:
        h = RETRY * i.clock.h_full
        after = first_touch(h, h, c, readings, control)
        store_pace(group, lane, after.pace)
        status = RUNNING
    store_motion(group, lane, after)
    if followed.event > NONE or after.clock.t == 0.0:
        store_modes(group, lane, after)
    return status


@kernel
def write_lane(
    group: Any, lane: int, status: int, t_limit: float, designs: np.ndarray, control: Control, out: np.ndarray, row: int
) -> Outcome:
    """Write the outcome of a lane into its row, and return it; a design that failed leaves its row NaN."""
    o = outcome_of(load_impact(group, lane), status, t_limit, control)
    if np.isnan(o.t_end):
        out[STATUS, row] = status
    else:
        write_outcome(out, row, o, step_errors(o, design_in(designs, row), control.theta_limit, control.horizon))
    return o


@kernel
def watch_lane(groups: Any, w: ImpactNotes, control: Control, record: Record) -> ImpactNotes:
    """Note what there is of a step of the first lane, whose impact at its start lies in the group of starts."""
    running, before = groups[0], groups[1]
    i, after = load_impact(before, 0), load_impact(running, 0)
    if after.clock.t == 0.0:
        return nothing_watched()  # it starts again, by shorter steps
    if after.clock.t == i.clock.t:
        return w
    y_end, k_end = load_state(running.end_state, 0), load_acceleration(running.end, 0)
    return watch(w, i, y_end, k_end, after, load_constants(running, 0), control, record)


@kernel
def run_lanes(
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    groups: Any,
    rows: np.ndarray,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Simulate every design of a table, and return the outcome of the last that has ended.

    Parameters
    ----------
    designs, readings, control, record, out
        The same as in `simulate_lanes`, with designs for whole groups.
    groups, rows
        The lanes, see `boulder_kernels.workspace.empty_groups`; the rows of the designs in them, EMPTY before they are
        filled, and behind them 0.
    """
    for lane in range(LANES):
        next_design(groups, rows, lane, designs, readings, control, out)
    running, starting = groups[0], groups[1]
    o, w = failed(int(out[STATUS, -1])), nothing_watched()
    watching = out.shape[1] == 1 and (record.times.size > 0 or not control.stop_at_limit)
    if watching:
        copy_step(running, 0, starting, 0)  # with the end of its first step
        stand_still(starting, readings, control)
        w = watch_lane(groups, w, control, record)
    busy = rows[0] != EMPTY
    while busy:
        if watching:
            copy_step(starting, 0, running, 0)
        attempt_steps(running)
        busy = take_over_steps(running) == 0
        for lane in range(LANES if watching or not busy else 0):
            if rows[lane] == EMPTY:
                continue
            busy, status = True, RUNNING
            if running.attempt.plain[lane] == 0.0:
                status = follow_lane(running, lane, readings, control)
            if watching:
                w = watch_lane(groups, w, control, record)
            if status != RUNNING:
                o = write_lane(running, lane, status, w.t_limit, designs, control, out, rows[lane])
                next_design(groups, rows, lane, designs, readings, control, out)
    return o


def filled_up(designs: np.ndarray) -> np.ndarray:
    """Return designs that fill whole groups of lanes, the last one repeated."""
    missing = -designs.shape[1] % LANES
    return np.pad(designs, ((0, 0), (0, missing)), "edge") if missing else designs


def simulate_lanes(
    designs: np.ndarray,
    pieces: int,
    has_strength: bool,
    has_outline: bool,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Simulate every design of a table in lanes, by a closed form of the soil.

    Parameters
    ----------
    designs
        Designs, SI, shape (15 + G, n): first the fields of `DesignTable`, then what is given where the soil is in
        pieces: the body and the pieces (`Body`, `GivenPiece`) one after another.
    pieces, has_strength, has_outline
        The same as in `boulder_kernels.workspace.group_type`.
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
    groups = empty_groups(pieces, has_strength=has_strength, has_outline=has_outline)
    return run_lanes(filled_up(designs), readings, control, groups, rows, record, out)
