"""Many designs side by side, one in each lane of the vector registers.

Every lane has its own clock. One attempt advances all of them by a step (`attempt_steps`), and a second loop looks at
what came out (`take_over_steps`): most steps meet no event and set no peak, and are taken over at once. The few that
need more are attended to one by one with the functions of the single impact, and a lane whose design has come to its
end gets the next one. No lane waits for another.
"""

from __future__ import annotations

import numpy as np

from ._jit import inlined, kernel
from .dense_output import dense_output
from .design import Constants, DesignTable, constants_of, design_at, is_computable
from .dormand_prince import step
from .dynamics import Acceleration, State
from .gaps import LIMIT, GapFactors, gap_factors, gaps_of
from .impact import (
    SHORTEN,
    Control,
    attempt_budget,
    cross_event,
    first_step,
    horizon_status,
    is_finite,
    keep_up_to_event,
    rate_of,
    turned_back,
)
from .modes import Modes, Switches, switches_of
from .outcomes import (
    Compression,
    Maxima,
    OutcomeTable,
    Status,
    compression_at,
    compression_of,
    highest_compression,
    no_maxima,
)
from .readings import Readings
from .restoring import signed_arm
from .settling import (
    NO_PROOF,
    barrier_energy,
    boulder_energy,
    inside_maxima,
    proof_is_possible,
)
from .soil import soil_kinematics
from .stability import ACCEPTED, MOST_STEPS, RETRY
from .transitions import initial_modes
from .trigonometry import sine_versine
from .workspace import (
    ATTEMPTS_LEFT,
    ATTENTION,
    BARRIER,
    COMPRESSION,
    LANES,
    MAXIMA,
    SIZE,
    STEP,
    STEP_FULL,
    TIME,
    field,
    load_constants,
    load_end,
    load_end_state,
    load_factors,
    load_maxima,
    load_modes,
    load_start,
    load_state,
    load_switches,
    put,
    store_constants,
    store_end,
    store_end_state,
    store_factors,
    store_maxima,
    store_modes,
    store_start,
    store_state,
    store_switches,
)

EMPTY = -1
"""Row of a lane that holds no design."""
RUNNING = -1
"""Status of a design that has not come to its end."""


@kernel
def attempt_steps(ws: np.ndarray) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    for lane in range(LANES):
        y_end, k_end = step(
            load_state(ws, lane),
            load_start(ws, lane),
            field(ws, STEP, 0, lane),
            load_switches(ws, lane),
            load_constants(ws, lane),
        )
        store_end_state(ws, lane, y_end)
        store_end(ws, lane, k_end)


@kernel
def take_over_steps(ws: np.ndarray, horizon: float) -> None:
    """Take over the steps that meet no event, turn nowhere and do not reach the horizon [s]; mark the others."""
    for lane in range(LANES):
        c = load_constants(ws, lane)
        s = load_switches(ws, lane)
        y, y_end = load_state(ws, lane), load_end_state(ws, lane)
        k_end = load_end(ws, lane)
        sin, versin = sine_versine(y_end.theta_b)
        start = Compression(field(ws, COMPRESSION, 0, lane), field(ws, COMPRESSION, 1, lane))
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
            load_factors(ws, lane),
        )
        t, h = field(ws, TIME, 0, lane), field(ws, STEP, 0, lane)
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
            & ((y_end.v_v > 0.0) | (boulder_energy(y_end, c) >= field(ws, BARRIER, 0, lane)))
        )
        u, _ = highest_compression(start, end, h)
        t_next = t + h
        put(ws, ATTENTION, 0, lane, 0.0 if plain else 1.0)
        put(ws, ATTEMPTS_LEFT, 0, lane, field(ws, ATTEMPTS_LEFT, 0, lane) - 1.0)
        if plain:
            store_state(ws, lane, y_end)
            store_start(ws, lane, k_end)
            put(ws, COMPRESSION, 0, lane, end.u)
            put(ws, COMPRESSION, 1, lane, end.rate)
            put(ws, TIME, 0, lane, t_next)
            put(ws, STEP, 0, lane, min(field(ws, STEP_FULL, 0, lane), horizon - t_next))
            put(ws, MAXIMA, 0, lane, max(field(ws, MAXIMA, 0, lane), abs(y_end.theta_b)))
            put(ws, MAXIMA, 1, lane, max(field(ws, MAXIMA, 1, lane), y_end.x_b))
            put(ws, MAXIMA, 2, lane, max(field(ws, MAXIMA, 2, lane), y_end.x_v))
            put(ws, MAXIMA, 3, lane, max(field(ws, MAXIMA, 3, lane), s.k_contact * u))


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
        -1, or the status of a design that needs no integration or allows none.
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
    y = State(0.0, 0.0, 0.0, 0.0, 0.0, c.v_0)
    modes = initial_modes(readings, c)
    switches = switches_of(modes, readings, c)
    store_constants(ws, lane, c)
    store_maxima(ws, lane, no_maxima())
    put(ws, STEP_FULL, 0, lane, h_full)
    put(ws, ATTEMPTS_LEFT, 0, lane, attempt_budget(h_full, control.horizon))
    put(ws, BARRIER, 0, lane, NO_PROOF)
    factors = gap_factors(modes, c, control.theta_limit, control.locate_yield)
    set_modes(ws, lane, modes, switches, factors)
    set_motion(ws, lane, 0.0, y, rate_of(y, switches, c), switches, c, control.horizon)
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
    store_state(ws, lane, y)
    store_start(ws, lane, k1)
    put(ws, TIME, 0, lane, t)
    put(ws, STEP, 0, lane, min(field(ws, STEP_FULL, 0, lane), horizon - t))
    start = compression_at(y, switches, c)
    put(ws, COMPRESSION, 0, lane, start.u)
    put(ws, COMPRESSION, 1, lane, start.rate)


@inlined
def set_modes(ws: np.ndarray, lane: int, modes: Modes, switches: Switches, factors: GapFactors) -> None:
    """Put the modes of the next step into a lane, and what follows from them."""
    store_modes(ws, lane, modes)
    store_switches(ws, lane, switches)
    store_factors(ws, lane, factors)


@kernel
def attend(ws: np.ndarray, lane: int, readings: Readings, control: Control) -> int:
    """Take over a step that meets an event, sets a peak or reaches the end.

    Returns
    -------
    int
        -1, or the status with which the design has come to its end; time and maxima are left in the lane.
    """
    t, h = field(ws, TIME, 0, lane), field(ws, STEP, 0, lane)
    c = load_constants(ws, lane)
    switches = load_switches(ws, lane)
    factors = load_factors(ws, lane)
    y_end = load_end_state(ws, lane)
    if not is_finite(y_end):
        return Status.UNSTABLE.value
    if field(ws, ATTEMPTS_LEFT, 0, lane) < 0.0:
        return Status.STEP_BUDGET.value
    y_start, k_start, k_end = (
        load_state(ws, lane),
        load_start(ws, lane),
        load_end(ws, lane),
    )
    dense = dense_output(y_start, k_start, y_end, k_end, h)
    event, tau, y, m = keep_up_to_event(
        t,
        h,
        y_start,
        k_start.M,
        y_end,
        k_end.M,
        dense,
        factors,
        switches,
        load_maxima(ws, lane),
        c,
    )
    if event == SHORTEN:
        put(ws, STEP, 0, lane, tau * h)
        return RUNNING
    last = h >= control.horizon - t
    t = control.horizon if last and event < 0 else t + tau * h
    put(ws, TIME, 0, lane, t)
    if event == LIMIT:
        m = Maxima(control.theta_limit, t, m.x_b, m.t_x_b, m.x_v, m.t_x_v, m.F_v, m.t_F_v)
    store_maxima(ws, lane, m)
    if event == LIMIT:
        return Status.LIMIT.value
    if t >= control.horizon:
        return horizon_status(y, m)
    if proof_is_possible(readings) and y.v_v <= 0.0:
        if turned_back(y_start, y):
            put(ws, BARRIER, 0, lane, barrier_energy(m, c))
        if inside_maxima(y, m) and boulder_energy(y, c) < field(ws, BARRIER, 0, lane):
            return Status.SETTLED.value
    k1 = k_end
    if event >= 0:
        y, modes, switches, factors, k1 = cross_event(
            event,
            y,
            load_modes(ws, lane),
            switches,
            readings,
            control.theta_limit,
            control.locate_yield,
            c,
        )
        set_modes(ws, lane, modes, switches, factors)
    set_motion(ws, lane, t, y, k1, switches, c, control.horizon)
    return RUNNING


@kernel
def write_lane(ws: np.ndarray, lane: int, status: int, out: OutcomeTable, row: int) -> None:
    """Write the outcome of a lane into its row; a design that failed leaves its row NaN."""
    out.status[row] = status
    if status == Status.UNSTABLE.value or status == Status.STEP_BUDGET.value:
        return
    m = load_maxima(ws, lane)
    t = field(ws, TIME, 0, lane)
    out.theta_max[row], out.x_b_max[row] = m.theta, m.x_b
    out.x_v_max[row], out.F_v_max[row] = m.x_v, m.F_v
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
        The row now in the lane, or EMPTY, and the first row not yet looked at.
    """
    n = table.L.size
    while row < n:
        status = start_lane(ws, lane, table, row, readings, control)
        row += 1
        if status == RUNNING:
            return row - 1, row
        out.status[row - 1] = status
    # An empty lane stands still: its steps have no length, and no one looks at them.
    put(ws, STEP, 0, lane, 0.0)
    put(ws, STEP_FULL, 0, lane, 0.0)
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
        Step, horizon, limit; its choice of soil and of stopping is not looked at.
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
        take_over_steps(ws, control.horizon)
        for lane in range(LANES):
            if field(ws, ATTENTION, 0, lane) != 0.0 and rows[lane] != EMPTY:
                status = attend(ws, lane, readings, control)
                h = field(ws, STEP_FULL, 0, lane)
                if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * h:
                    status = start_lane(ws, lane, table, rows[lane], readings, control, RETRY * h)
                if status != RUNNING:
                    write_lane(ws, lane, status, out, rows[lane])
                    rows[lane], row = next_design(ws, lane, row, table, readings, control, out)
                    running -= rows[lane] == EMPTY
