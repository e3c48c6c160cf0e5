"""Steps that need more than to be accepted, side by side in a group of lanes of their own.

Lanes whose steps met an event, set a peak or reached the end are copied into this group. The search for the first event
goes on until it has closed in all of them; a lane in which it has closed is left alone meanwhile, so that its result
does not depend on its neighbours.
"""

from __future__ import annotations

from typing import Any

from ._jit import inlined, kernel
from .after_step import RUNNING, Ending, Kept, at_limit, decide, enter_modes, is_finite, kept_up_to
from .design import Readings
from .dormand_prince import DenseOutput, dense_output
from .dynamics import rate_of
from .events import (
    NONE,
    SHORTEN,
    begin_search,
    first_event,
    gaps_within,
    go_on_searching,
    least_gap,
    limit_before,
    tolerance_of,
    turns_beyond,
    weights_of,
)
from .modes import LIMIT, change_mode, changes_counted, gaps_at, length_after
from .numerics import ITERATIONS, field, put
from .outcomes import Status, compression_at
from .workspace import (
    ATTEMPTS_LEFT,
    BARRIER,
    BOULDER,
    BRACKET,
    COMPRESSION,
    CONSTANTS,
    END,
    END_GAPS,
    END_STATE,
    ERROR,
    EVENT,
    FACTORS,
    HORIZON,
    LANES,
    MAXIMA,
    MODES,
    MOMENT,
    OPEN,
    ROTATION,
    ROTATION_CHANGES,
    START,
    STATE,
    STEP,
    STEP_ERROR,
    STEP_FULL,
    SWITCHES,
    TAU,
    TIME,
    TRUCK,
    WEIGHTS,
    align_stack,
    load,
    part,
    store,
)


@inlined
def motion_within(ws: Any, lane: int) -> DenseOutput:
    """Motion within the step of a lane."""
    return DenseOutput(field(ws, STEP, lane), load(ws, BOULDER, lane), load(ws, ROTATION, lane), load(ws, TRUCK, lane))


@kernel
def begin_searches(ws: Any, locate_yield: bool) -> None:
    """Work out the motion within every step, and begin the search for its first event."""
    align_stack()
    for lane in range(LANES):
        c, g = load(ws, CONSTANTS, lane), load(ws, FACTORS, lane)
        y, k = load(ws, STATE, lane), load(ws, START, lane)
        y_end, k_end = load(ws, END_STATE, lane), load(ws, END, lane)
        dense = dense_output(y, k, y_end, k_end, field(ws, STEP, lane))
        end = gaps_at(y_end, k_end.M, g, c)
        weights = weights_of(end, dense, g, locate_yield, c)
        b, tau, searching = begin_search(gaps_at(y, k.M, g, c), weights, tolerance_of(g))
        store(ws, BOULDER, lane, dense.boulder)
        store(ws, ROTATION, lane, dense.rotation)
        store(ws, TRUCK, lane, dense.truck)
        store(ws, END_GAPS, lane, end)
        store(ws, WEIGHTS, lane, weights)
        store(ws, BRACKET, lane, b)
        put(ws, TAU, lane, tau)
        put(ws, OPEN, lane, 1.0 if searching else 0.0)


@kernel
def search_on(ws: Any) -> None:
    """Narrow the bracket of every search that is open."""
    align_stack()
    for lane in range(LANES):
        c, s, g = load(ws, CONSTANTS, lane), load(ws, SWITCHES, lane), load(ws, FACTORS, lane)
        tau = field(ws, TAU, lane)
        weights = load(ws, WEIGHTS, lane)
        least, _ = least_gap(gaps_within(tau, motion_within(ws, lane), g, s, c), weights)
        b, following, searching = go_on_searching(load(ws, BRACKET, lane), tau, least, tolerance_of(g))
        if field(ws, OPEN, lane) != 0.0:
            store(ws, BRACKET, lane, b)
            put(ws, TAU, lane, following)
            put(ws, OPEN, lane, 1.0 if searching else 0.0)


@kernel
def is_open(ws: Any, count: int) -> bool:
    """Whether OPEN is set in one of the first lanes."""
    searches = 0.0
    for lane in range(count):
        searches += field(ws, OPEN, lane)
    return searches > 0.0


@kernel
def find_events(ws: Any) -> None:
    """Find the first event of every step; OPEN now says whether the rotation turns back beyond its limit before."""
    align_stack()
    for lane in range(LANES):
        c, s, g = load(ws, CONSTANTS, lane), load(ws, SWITCHES, lane), load(ws, FACTORS, lane)
        dense, end = motion_within(ws, lane), load(ws, END_GAPS, lane)
        b, weights = load(ws, BRACKET, lane), load(ws, WEIGHTS, lane)
        event, tau = first_event(b, field(ws, TAU, lane), weights, end, dense, g, s, c)
        put(ws, EVENT, lane, event)
        put(ws, TAU, lane, tau)
        put(ws, OPEN, lane, 1.0 if turns_beyond(tau, end, dense, g) else 0.0)


@kernel
def find_limits(ws: Any) -> None:
    """Put the limit in place of the first event where the rotation turns back beyond it before."""
    align_stack()
    for lane in range(LANES):
        g, dense = load(ws, FACTORS, lane), motion_within(ws, lane)
        event, tau = field(ws, EVENT, lane), field(ws, TAU, lane)
        over = field(ws, OPEN, lane) != 0.0
        put(ws, EVENT, lane, float(LIMIT) if over else event)
        put(ws, TAU, lane, limit_before(dense, g) if over else tau)


@kernel
def keep_steps(ws: Any) -> None:
    """Keep every step up to its first event; the state kept takes the place of that at the end of the step."""
    align_stack()
    for lane in range(LANES):
        c, s = load(ws, CONSTANTS, lane), load(ws, SWITCHES, lane)
        dense, start = motion_within(ws, lane), load(ws, COMPRESSION, lane)
        event, tau = field(ws, EVENT, lane), field(ws, TAU, lane)
        y_end, m = load(ws, END_STATE, lane), load(ws, MAXIMA, lane)
        kept = kept_up_to(event, tau, field(ws, TIME, lane), y_end, start, m, dense, s, c)
        put(ws, EVENT, lane, kept.event)
        put(ws, TAU, lane, kept.tau)
        put(ws, MOMENT, lane, rate_of(kept.y, s, c).M)
        store(ws, END_STATE, lane, kept.y)
        if kept.event != SHORTEN:
            store(ws, MAXIMA, lane, kept.m)


@inlined
def conclude(ws: Any, lane: int, readings: Readings, ending: Ending, locate_yield: bool) -> int:
    """Decide what follows from the step of a lane, and go over into the modes that follow its event.

    Returns
    -------
    int
        RUNNING, or the status with which the simulation ended; time and maxima are left in the lane.
    """
    mine = part(ws, lane)
    y = load(mine, END_STATE, 0)
    if not is_finite(y):
        return Status.UNSTABLE.value
    if field(mine, ATTEMPTS_LEFT, 0) <= 0.0:
        return Status.STEP_BUDGET.value
    put(mine, ATTEMPTS_LEFT, 0, field(mine, ATTEMPTS_LEFT, 0) - 1.0)
    event, tau, h = field(mine, EVENT, 0), field(mine, TAU, 0), field(mine, STEP, 0)
    if event == SHORTEN:
        put(mine, STEP, 0, tau * h)
        return RUNNING
    put(mine, ERROR, 0, field(mine, ERROR, 0) + field(mine, STEP_ERROR, 0))
    c, g, m = load(mine, CONSTANTS, 0), load(mine, FACTORS, 0), load(mine, MAXIMA, 0)
    kept = Kept(event, tau, y, m)
    begun = field(mine, TIME, 0)
    decided = decide(
        begun,
        h,
        load(mine, STATE, 0),
        kept,
        field(mine, BARRIER, 0),
        field(mine, HORIZON, 0),
        ending,
        c,
    )
    put(mine, TIME, 0, decided.t)
    put(mine, BARRIER, 0, decided.barrier)
    put(mine, HORIZON, 0, decided.horizon)
    put(mine, STEP, 0, min(field(mine, STEP_FULL, 0), decided.horizon - decided.t))
    if decided.status == Status.LIMIT.value:
        store(mine, MAXIMA, 0, at_limit(m, decided.t, g.limit))
    if event > NONE and decided.status == RUNNING:
        modes = load(mine, MODES, 0)
        changes = field(mine, ROTATION_CHANGES, 0) + changes_counted(event, begun, modes)
        put(mine, ROTATION_CHANGES, 0, changes)
        y, modes = change_mode(int(event), y, field(mine, MOMENT, 0), modes, c)
        switches, factors = enter_modes(modes, readings, g.limit, locate_yield, g.tolerance, c)
        store(mine, MODES, 0, modes)
        store(mine, SWITCHES, 0, switches)
        store(mine, FACTORS, 0, factors)
    store(mine, STATE, 0, y)
    return decided.status


@kernel
def start_steps(ws: Any) -> None:
    """Work out what every next step starts with: its acceleration, anew after an event, its compression and length."""
    align_stack()
    for lane in range(LANES):
        c, s = load(ws, CONSTANTS, lane), load(ws, SWITCHES, lane)
        y, k_end = load(ws, STATE, lane), load(ws, END, lane)
        fresh = rate_of(y, s, c)
        event = field(ws, EVENT, lane)
        k = fresh if event > NONE else k_end
        start = compression_at(y, s, c)
        h = length_after(event, field(ws, STEP, lane), y.omega_b, fresh.alpha_b)
        if event != SHORTEN:
            put(ws, STEP, lane, h)
            store(ws, START, lane, k)
            store(ws, COMPRESSION, lane, start)


@kernel
def work_out(ws: Any, count: int, locate_yield: bool) -> None:
    """Find what is kept of the steps in the first lanes of the group."""
    begin_searches(ws, locate_yield)
    for _ in range(ITERATIONS):
        if not is_open(ws, count):
            break
        search_on(ws)
    find_events(ws)
    if is_open(ws, count):
        find_limits(ws)
    keep_steps(ws)
