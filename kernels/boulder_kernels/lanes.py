"""Many designs side by side, one in each lane of the vector registers.

Every lane has its own clock. One attempt advances all of them by a step (`attempt_steps`), and a second loop looks at
what came out (`take_over_steps`): most steps meet no event and set no peak, and are accepted at once. The few that need
more are handled one by one with the functions of the single impact, and a lane whose simulation has ended gets the
next design. No lane waits for another.
"""

from __future__ import annotations

import numpy as np

from ._jit import inlined, kernel
from .after_step import RUNNING, SHORTEN, cross_event, keep_step, start_motion
from .dense_output import dense_output
from .design import Constants, DesignTable, constants_of, design_at, is_computable
from .dormand_prince import step
from .dynamics import Acceleration, State
from .gaps import GapFactors, gaps_of
from .impact import Control, attempt_budget, ending_of, first_step
from .modes import Modes, Switches
from .outcomes import Maxima, OutcomeTable, Status, compression_at, compression_of, highest, no_maxima
from .readings import Readings
from .restoring import signed_arm
from .settling import NO_PROOF, boulder_energy
from .soil import soil_kinematics
from .stability import ACCEPTED, MOST_STEPS, RETRY
from .trigonometry import sine_versine
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
    SIZE,
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
        sin, versin = sine_versine(y_end.theta_b)
        start = load(ws, COMPRESSION, lane)
        end = compression_of(y_end, sin, versin, s, c)
        k = soil_kinematics(y_end.x_b, y_end.v_b, y_end.omega_b, sin, versin, c)
        gaps = gaps_of(
            k.A,
            k.slope_x,
            y_end.theta_b,
            y_end.omega_b,
            end.u,
            k_end.M,
            signed_arm(sin, versin, c),
            load(ws, FACTORS, lane),
        )
        t, h, horizon = field(ws, TIME, lane), field(ws, STEP, lane), field(ws, HORIZON, lane)
        # A comparison with NaN is false, so a state that is not a number is marked, too.
        plain = (
            (gaps.contact >= 0.0)
            & (gaps.rotation >= 0.0)
            & (gaps.couple >= 0.0)
            & (gaps.corner >= 0.0)
            & (gaps.arm >= 0.0)
            & (gaps.top >= 0.0)
            & (gaps.base >= 0.0)
            & (gaps.limit >= 0.0)
            & (y.omega_b * y_end.omega_b >= 0.0)
            & ((y.v_b <= 0.0) | (y_end.v_b >= 0.0))
            & ((y.v_v <= 0.0) | (y_end.v_v >= 0.0))
            & (h < horizon - t)
            & ((y_end.v_v > 0.0) | (boulder_energy(y_end, c) >= field(ws, BARRIER, lane)))
        )
        u, _ = highest(start.u, start.rate, end.u, end.rate, h)
        deepest, _ = highest(start.crush, start.crush_rate, end.crush, end.crush_rate, h)
        t_next = t + h
        put(ws, ATTENTION, lane, 0.0 if plain else 1.0)
        put(ws, ATTEMPTS_LEFT, lane, field(ws, ATTEMPTS_LEFT, lane) - 1.0)
        if plain:
            store(ws, STATE, lane, y_end)
            store(ws, START, lane, k_end)
            store(ws, COMPRESSION, lane, end)
            put(ws, TIME, lane, t_next)
            put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), horizon - t_next))
            m = load(ws, MAXIMA, lane)
            theta, x_b, x_v = max(m.theta, abs(y_end.theta_b)), max(m.x_b, y_end.x_b), max(m.x_v, y_end.x_v)
            F_v, crush = max(m.F_v, s.k_contact * u), max(m.crush, deepest if y.v_v > 0.0 else 0.0)
            m = Maxima(theta, m.t_theta, x_b, m.t_x_b, x_v, m.t_x_v, F_v, m.t_F_v, crush, m.t_crush)
            store(ws, MAXIMA, lane, m)


@kernel
def start_lane(
    ws: np.ndarray,
    lane: int,
    table: DesignTable,
    row: int,
    readings: Readings,
    control: Control,
    longest: float = np.inf,
) -> int:
    """Put a design into a lane.

    Parameters
    ----------
    ws, lane
        The workspace and the lane.
    table, row
        The design.
    readings, control
        As of `simulate_lanes`.
    longest
        Longest step that has not failed yet [s]; infinite at first.

    Returns
    -------
    int
        RUNNING, or the status of a design that needs no integration or allows none.
    """
    design = design_at(table, row)
    if design.H - design.d <= design.e_bumper:
        return Status.NO_CONTACT.value
    c = constants_of(design, readings, 0)
    if not is_computable(c):
        return Status.INVALID.value
    h_full, status = first_step(control, control.theta_limit, c)
    if status != ACCEPTED:
        return status
    h_full = min(h_full, longest)
    y, modes, switches, factors, k1 = start_motion(readings, control.theta_limit, control.locate_yield, c)
    store(ws, CONSTANTS, lane, c)
    store(ws, MAXIMA, lane, no_maxima())
    put(ws, STEP_FULL, lane, h_full)
    put(ws, ATTEMPTS_LEFT, lane, attempt_budget(h_full, ending_of(control, readings, h_full).longest))
    put(ws, BARRIER, lane, NO_PROOF)
    put(ws, HORIZON, lane, control.horizon)
    set_modes(ws, lane, modes, switches, factors)
    set_motion(ws, lane, 0.0, y, k1, switches, c, control.horizon)
    return RUNNING


@inlined
def set_motion(
    ws: np.ndarray,
    lane: int,
    t: float,
    y: State,
    k1: Acceleration,
    switches: Switches,
    c: Constants,
    horizon: float,
) -> None:
    """Put the start of the next step into a lane."""
    store(ws, STATE, lane, y)
    store(ws, START, lane, k1)
    put(ws, TIME, lane, t)
    put(ws, STEP, lane, min(field(ws, STEP_FULL, lane), horizon - t))
    store(ws, COMPRESSION, lane, compression_at(y, switches, c))


@inlined
def set_modes(ws: np.ndarray, lane: int, modes: Modes, switches: Switches, factors: GapFactors) -> None:
    """Put the modes of the next step into a lane, and what follows from them."""
    store(ws, MODES, lane, modes)
    store(ws, SWITCHES, lane, switches)
    store(ws, FACTORS, lane, factors)


@kernel
def attend(ws: np.ndarray, lane: int, readings: Readings, control: Control) -> int:
    """Handle a step that meets an event, sets a peak or reaches the end.

    Returns
    -------
    int
        RUNNING, or the status with which the simulation ended; time and maxima are left in the lane.
    """
    t, h = field(ws, TIME, lane), field(ws, STEP, lane)
    c = load(ws, CONSTANTS, lane)
    switches = load(ws, SWITCHES, lane)
    factors = load(ws, FACTORS, lane)
    if field(ws, ATTEMPTS_LEFT, lane) < 0.0:
        return Status.STEP_BUDGET.value
    y, k1 = load(ws, STATE, lane), load(ws, START, lane)
    y_end, k_end = load(ws, END_STATE, lane), load(ws, END, lane)
    kept = keep_step(
        t,
        h,
        y,
        k1,
        y_end,
        k_end,
        dense_output(y, k1, y_end, k_end, h),
        factors,
        switches,
        load(ws, MAXIMA, lane),
        field(ws, BARRIER, lane),
        field(ws, HORIZON, lane),
        ending_of(control, readings, field(ws, STEP_FULL, lane)),
        c,
    )
    if kept.event == SHORTEN:
        put(ws, STEP, lane, kept.tau * h)
        return RUNNING
    put(ws, TIME, lane, kept.t)
    put(ws, BARRIER, lane, kept.barrier)
    put(ws, HORIZON, lane, kept.horizon)
    store(ws, MAXIMA, lane, kept.m)
    if kept.status != RUNNING:
        return kept.status
    y, k1 = kept.y, k_end
    if kept.event >= 0:
        y, modes, switches, factors, k1 = cross_event(
            kept.event,
            y,
            load(ws, MODES, lane),
            switches,
            readings,
            control.theta_limit,
            control.locate_yield,
            c,
        )
        set_modes(ws, lane, modes, switches, factors)
    set_motion(ws, lane, kept.t, y, k1, switches, c, kept.horizon)
    return RUNNING


@kernel
def write_lane(ws: np.ndarray, lane: int, status: int, out: OutcomeTable, row: int) -> None:
    """Write the outcome of a lane into its row; a design that failed leaves its row NaN."""
    out.status[row] = status
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        return
    m = load(ws, MAXIMA, lane)
    t = field(ws, TIME, lane)
    out.theta_max[row], out.x_b_max[row] = m.theta, m.x_b
    out.x_v_max[row], out.F_v_max[row], out.crush_max[row] = m.x_v, m.F_v, m.crush
    out.t_end[row] = t
    if status == Status.LIMIT.value:
        out.t_limit[row] = t


@kernel
def next_design(
    ws: np.ndarray,
    lane: int,
    row: int,
    table: DesignTable,
    readings: Readings,
    control: Control,
    out: OutcomeTable,
) -> tuple[int, int]:
    """Put the next design that needs integration into a lane, writing those that need none on the way.

    Returns
    -------
    row_in_lane, row
        The row now in the lane, or EMPTY, and the first row not yet started.
    """
    n = table.L.size
    while row < n:
        status = start_lane(ws, lane, table, row, readings, control)
        row += 1
        if status == RUNNING:
            return row - 1, row
        out.status[row - 1] = status
    # An empty lane stands still: its steps have no length, and their results are ignored.
    put(ws, STEP, lane, 0.0)
    put(ws, STEP_FULL, lane, 0.0)
    return EMPTY, row


@kernel
def simulate_lanes(table: DesignTable, readings: Readings, control: Control, out: OutcomeTable) -> None:
    """Simulate every design of a table in lanes, by the closed form of the soil and stopping at the limit.

    Parameters
    ----------
    table
        Designs, SI, arrays of shape (n,).
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit; its choice of soil and of stopping is ignored.
    out
        Where the outcomes go, in the order of the designs; its error columns are left alone.
    """
    ws = np.zeros(SIZE)
    rows = np.full(LANES, EMPTY)
    row, running = 0, 0
    for lane in range(LANES):
        rows[lane], row = next_design(ws, lane, row, table, readings, control, out)
        running += rows[lane] != EMPTY
    while running > 0:
        attempt_steps(ws)
        take_over_steps(ws)
        for lane in range(LANES):
            if field(ws, ATTENTION, lane) != 0.0 and rows[lane] != EMPTY:
                status = attend(ws, lane, readings, control)
                h = field(ws, STEP_FULL, lane)
                if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
                    status = start_lane(ws, lane, table, rows[lane], readings, control, RETRY * h)
                if status != RUNNING:
                    write_lane(ws, lane, status, out, rows[lane])
                    rows[lane], row = next_design(ws, lane, row, table, readings, control, out)
                    running -= rows[lane] == EMPTY
