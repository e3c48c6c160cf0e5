"""Many designs side by side: their way through the lanes.

All groups of lanes are stepped in turn (`boulder_kernels.lane_steps`). A lane whose step needs more than to be accepted
hands its design over to a group of events and goes on with another at once: one that returns from there, else the next
of the table, so that no lane waits. A group of events is worked out when it is full (`boulder_kernels.lane_events`);
there are two, because designs return from one while the other is being filled. The next of the table are started side
by side, too (`boulder_kernels.lane_steps`). What a lane computes does not depend on the others, only when and where it
does so.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .after_step import RUNNING, ending_of
from .control import MOST_STEPS, RETRY, Control
from .design import Readings
from .lane_events import conclude, start_steps, work_out
from .lane_steps import attempt_steps, start_designs, take_over_steps, write_lane
from .numerics import field, put
from .outcomes import STATUS, Status, empty_outcomes
from .workspace import (
    ATTENTION,
    EVENT_SIZE,
    EVENTS,
    GROUPS,
    LANES,
    SIZE,
    STARTS,
    STATUS_OF_LANE,
    STEP,
    STEP_FULL,
    WHOLE,
    copy_lane,
    part,
)

EMPTY = -1
"""Row of a lane that holds no design."""
STEPPED = GROUPS * LANES
"""Slots that are stepped: 0 ... STEPPED - 1. Behind them are those of the two groups of events, and behind
those the ones where designs are started."""
SLOTS = STEPPED + 3 * LANES
BUSY, PENDING, READY, IDLE, SIDE, HANDLED, STARTED = range(7)
"""Among the counts of a `Queue`: lanes with a design; designs in the group of events that is being filled, designs in
the other one that may return, lanes without a design, which of the groups is being filled, 0 or 1, how many steps have
been worked out there in all, and designs that have been started and wait for a lane."""


class Queue(NamedTuple):
    """Where the designs are: arrays of whole numbers."""

    rows: Any
    """Row of the design in each slot or EMPTY, and behind them the first row not yet started."""
    ready: np.ndarray
    """Slots of designs that may return into a lane."""
    started: np.ndarray
    """Slots of designs that may enter a lane."""
    idle: np.ndarray
    """Lanes without a design."""
    waiting: np.ndarray
    """Lanes whose step needs more than to be accepted."""
    counts: np.ndarray
    """How many of each, see BUSY."""


@inlined
def lane_of(slot: int) -> int:
    """Lane of the workspace that a slot stands for."""
    if slot < STEPPED:
        return (slot // LANES) * SIZE + slot % LANES
    if slot < SLOTS - LANES:
        return EVENTS + ((slot - STEPPED) // LANES) * EVENT_SIZE + slot % LANES
    return STARTS + slot % LANES


@kernel
def start_more(ws: Any, q: Queue, designs: np.ndarray, readings: Readings, control: Control, out: np.ndarray) -> None:
    """Start the next designs of the table, until there are some that need integration; write those that need none.

    Parameters
    ----------
    ws, q
        The workspace and the queue.
    designs, readings, control, out
        As of `simulate_lanes`, and its result; of the designs, at least as many as lanes.
    """
    while q.counts[STARTED] == 0 and q.rows[-1] < out.shape[1]:
        first = min(q.rows[-1], designs.shape[1] - LANES)
        start_designs(part(ws, STARTS), designs, first, readings, control, control.h)
        for row in range(q.rows[-1], min(first + LANES, out.shape[1])):
            slot = SLOTS - LANES + row - first
            status = int(field(part(ws, STARTS), STATUS_OF_LANE, row - first))
            if status == RUNNING:
                q.rows[slot] = row
                q.started[q.counts[STARTED]] = slot
                q.counts[STARTED] += 1
            else:
                out[STATUS, row] = status
        q.rows[-1] = first + LANES


@inlined
def let_return(ws: Any, q: Queue, other: int, slot: int) -> None:
    """Move a design from its slot in another group into a lane."""
    copy_lane(ws, lane_of(other), lane_of(slot), ATTENTION)
    q.rows[slot] = q.rows[other]


@inlined
def next_design(
    ws: Any,
    q: Queue,
    slot: int,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Put the next design that needs integration into the lane of a slot; other arguments: see `start_more`."""
    if q.counts[STARTED] == 0:
        start_more(ws, q, designs, readings, control, out)
    if q.counts[STARTED] > 0:
        q.counts[STARTED] -= 1
        let_return(ws, q, q.started[q.counts[STARTED]], slot)
        return
    # An empty lane stands still: its steps have no length, and their results are ignored.
    lane = lane_of(slot)
    q.rows[slot] = EMPTY
    put(ws, STEP, lane, 0.0)
    put(ws, STEP_FULL, lane, 0.0)


@inlined
def start_again(
    ws: Any, lane: int, designs: np.ndarray, row: int, readings: Readings, control: Control, longest: float
) -> int:
    """Start a design in a lane of the workspace by steps no longer than given [s]; return its status."""
    first = min(row, designs.shape[1] - LANES)
    again = STARTS + EVENT_SIZE
    start_designs(part(ws, again), designs, first, readings, control, longest)
    copy_lane(ws, again + row - first, lane, ATTENTION)
    return int(field(part(ws, again), STATUS_OF_LANE, row - first))


@inlined
def hand_over(
    ws: Any,
    q: Queue,
    slot: int,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Move a design into the group of events, and let another into its lane; arguments: see `start_more`."""
    counts = q.counts
    other = STEPPED + counts[SIDE] * LANES + counts[PENDING]
    copy_lane(ws, lane_of(slot), lane_of(other), SIZE)
    q.rows[other] = q.rows[slot]
    counts[PENDING] += 1
    if counts[READY] > 0:
        counts[READY] -= 1
        let_return(ws, q, q.ready[counts[READY]], slot)
        return
    next_design(ws, q, slot, designs, readings, control, out)
    if q.rows[slot] == EMPTY:
        q.idle[counts[IDLE]] = slot
        counts[IDLE] += 1
        counts[BUSY] -= 1


@kernel
def handle(
    ws: Any,
    q: Queue,
    designs: np.ndarray,
    readings: Readings,
    control: Control,
    out: np.ndarray,
) -> None:
    """Work out what follows from the steps in the group of events; arguments: see `start_more`.

    As many designs as lanes have left since this was last done, so all that were ready then have returned.
    """
    counts = q.counts
    side, size = counts[SIDE], counts[PENDING]
    events = part(ws, EVENTS + side * EVENT_SIZE)
    work_out(events, size, control.locate_yield)
    for k in range(size):
        ending = ending_of(control, readings, field(events, STEP_FULL, k))
        put(events, STATUS_OF_LANE, k, float(conclude(events, k, readings, ending, control.locate_yield)))
    start_steps(events)
    for k in range(size):
        other = STEPPED + side * LANES + k
        row, h = q.rows[other], field(events, STEP_FULL, k)
        status = int(field(events, STATUS_OF_LANE, k))
        if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
            lane = EVENTS + side * EVENT_SIZE + k
            status = start_again(ws, lane, designs, row, readings, control, RETRY * h)
        if status != RUNNING:
            write_lane(events, k, status, designs, control, out, row)
        elif counts[IDLE] > 0:
            counts[IDLE] -= 1
            counts[BUSY] += 1
            let_return(ws, q, other, q.idle[counts[IDLE]])
        else:
            q.ready[counts[READY]] = other
            counts[READY] += 1
    counts[HANDLED] += size
    counts[PENDING] = 0
    counts[SIDE] = 1 - side


@kernel
def is_empty(q: Queue, group: int) -> bool:
    """Whether all lanes of a group are empty."""
    empty = True
    for slot in range(group * LANES, (group + 1) * LANES):
        empty &= q.rows[slot] == EMPTY
    return empty


@kernel
def step_groups(ws: Any, q: Queue) -> int:
    """Attempt a step in all lanes of all groups, accept those that need no more, and list and count the others."""
    count = 0
    for group in range(GROUPS):
        # The last rows of a table, or the few that need the finest steps, leave a group empty for long.
        if q.counts[IDLE] >= LANES and is_empty(q, group):
            continue
        lanes = part(ws, group * SIZE)
        attempt_steps(lanes)
        if take_over_steps(lanes) > 0:
            for lane in range(LANES):
                slot = group * LANES + lane
                q.waiting[count] = slot
                count += int((field(lanes, ATTENTION, lane) != 0.0) & (q.rows[slot] != EMPTY))
    return count


@kernel
def begin(ws: Any, q: Queue, designs: np.ndarray, readings: Readings, control: Control, out: np.ndarray) -> None:
    """Put the first designs into the lanes of an empty workspace; arguments: see `start_more`."""
    for slot in range(STEPPED):
        next_design(ws, q, slot, designs, readings, control, out)
        if q.rows[slot] == EMPTY:
            q.idle[q.counts[IDLE]] = slot
            q.counts[IDLE] += 1
        else:
            q.counts[BUSY] += 1


@kernel
def sweep(ws: Any, q: Queue, designs: np.ndarray, readings: Readings, control: Control, out: np.ndarray) -> bool:
    """Step all lanes once; return whether any design is left. Arguments: see `start_more`."""
    for k in range(step_groups(ws, q)):
        hand_over(ws, q, q.waiting[k], designs, readings, control, out)
        if q.counts[PENDING] == LANES:
            handle(ws, q, designs, readings, control, out)
    # Towards the end, when lanes are empty, fewer need to come together.
    if q.counts[PENDING] >= max(q.counts[BUSY] // GROUPS, 1):
        handle(ws, q, designs, readings, control, out)
    return q.counts[BUSY] > 0 or q.counts[PENDING] > 0


def empty_workspace(soil: type | None = None, parts: int = 0) -> Any:
    """Return the workspace before the first design has been started, its vectors on whole lines of the fast memory.

    Parameters
    ----------
    soil
        Type of the workspace, of `boulder_kernels.workspace.SOILS`; None for uniform soils.
    parts
        Number of parts of the soil of a design.
    """
    ws = np.zeros((1 if soil is None else 2) * WHOLE + LANES)
    behind = ws.ctypes.data // ws.itemsize % LANES
    ws = ws[LANES - behind :]
    return ws if soil is None else soil(ws, (0,) * parts)


def empty_queue() -> Queue:
    """Return the queue before the first design has been started."""
    return Queue(
        np.zeros(SLOTS + 1, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(STEPPED, np.int64),
        np.zeros(STEPPED, np.int64),
        np.zeros(STARTED + 1, np.int64),
    )


def filled_up(designs: np.ndarray) -> np.ndarray:
    """Return designs that are at least as many as lanes, the last one repeated where they are fewer."""
    missing = LANES - designs.shape[1]
    return designs if missing <= 0 else np.pad(designs, ((0, 0), (0, missing)), "edge")


@kernel
def run_lanes(designs: np.ndarray, readings: Readings, control: Control, ws: Any, q: Queue, out: np.ndarray) -> None:
    """Simulate every design of a table; arguments: see `simulate_lanes` and `start_more`."""
    begin(ws, q, designs, readings, control, out)
    while sweep(ws, q, designs, readings, control, out):
        pass


def simulate_lanes(
    designs: np.ndarray, readings: Readings, control: Control, soil: type | None = None, parts: int = 0
) -> np.ndarray:
    """Simulate every design of a table in lanes, by a closed form of the soil and stopping at the limit.

    Parameters
    ----------
    designs
        Designs, SI, shape (15 + G, n): first the fields of `DesignTable`, then what is given of their soil, see
        `boulder_kernels.workspace.LaneSoil`.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit; its choice of soil and of stopping is ignored.
    soil, parts
        As of `empty_workspace`; the parts of `boulder_kernels.layered.COUNTS`.

    Returns
    -------
    ndarray, shape (11, n)
        Outcomes in the order of the designs, with rows in the order of `OutcomeTable`; those of errors are NaN.
    """
    out = empty_outcomes(designs.shape[1])
    if designs.shape[1] > 0:
        run_lanes(filled_up(designs), readings, control, empty_workspace(soil, parts), empty_queue(), out)
    return out
