"""Tables of designs in, tables of outcomes out: many designs side by side, one in each lane of the vector registers.

One loop advances all lanes by a step, each by its own clock (`attempt_steps`), and another accepts the steps that are
plain (`take_over_steps`). What follows from any other step is found for its lane alone, by the function that the single
impact uses (`boulder_kernels.impact.follow`), and a lane whose design has ended goes on with the next of the table.
Designs are started side by side, in a group of their own. What a lane computes does not depend on the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import by_types, inlined, is_none, kernel, plain
from .control import ACCEPTED, MOST_STEPS, RETRY, STEP_RATIO, Control, control_for, first_step
from .design import Design, DesignTable, Readings, design_at, design_in, is_computable
from .dormand_prince import step
from .dynamics import empty_soil, profile_of
from .events import NONE
from .impact import (
    RUNNING,
    Clock,
    ImpactNotes,
    Pace,
    Problem,
    begin_to_turn,
    failed,
    first_touch,
    follow,
    go_on,
    nothing_watched,
    outcome_of,
    simulate_alone,
    stop_of,
    watch,
)
from .lanes import (
    BELOW,
    LANES,
    Attempt,
    constants_in_lane,
    copy_start,
    copy_step,
    empty_groups,
    load_acceleration,
    load_constants,
    load_impact,
    load_state,
    load_switches,
    store_acceleration,
    store_attempt,
    store_clock,
    store_constants,
    store_modes,
    store_motion,
    store_pace,
    store_state,
)
from .outcomes import (
    COARSER,
    FINER,
    NONE_NEEDED,
    PAIR,
    SECOND,
    STATUS,
    STEP,
    T_END,
    Outcome,
    OutcomeTable,
    Record,
    Status,
    empty_outcomes,
    no_record,
    outcome_table,
    safety_of,
    step_errors,
    take_seconds,
    write_outcome,
)
from .pieces import (
    PRESSURE,
    PiecewiseTable,
    SoilProfile,
    given_pieces,
    lanes_count,
    pieces_count,
)
from .settling import proof_is_possible

EMPTY = -1
"""Row of a lane that holds no design."""
NEXT = LANES
"""Behind the rows in the lanes: the next row of the table."""


@kernel
def attempt_steps(group: Any) -> None:
    """Advance every lane by its step, in one vectorised loop."""
    for lane in range(LANES):
        y_end, k_end, error = step(
            load_state(group.y, lane),
            load_acceleration(group.k, lane),
            group.clock.h[lane],
            load_switches(group.switches, lane),
            load_constants(group, lane),
        )
        store_state(group.y_end, lane, y_end)
        store_acceleration(group.k_end, lane, k_end)
        store_attempt(group.attempt, lane, Attempt(error, 0.0, group.attempt.status[lane]))


@kernel
def take_over_steps(group: Any) -> int:
    """Accept the steps that are plain; mark and count the others."""
    others = 0
    for lane in range(LANES):
        i, error, c = load_impact(group, lane), group.attempt.error[lane], load_constants(group, lane)
        y_end, k_end = load_state(group.y_end, lane), load_acceleration(group.k_end, lane)
        plain, after = go_on(i, y_end, k_end, error, c)
        store_attempt(group.attempt, lane, Attempt(error, 1.0 if plain else 0.0, RUNNING))
        others += 0 if plain else 1
        if plain:
            store_motion(group, lane, after)
    return others


@kernel
def compute_constants(group: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Work out constants and steps of designs, and whether they can be simulated; arguments: see `start_designs`."""
    # Loads from another array would keep the loop from being vectorised.
    for lane in range(LANES):
        for number in range(len(group.given)):
            group.given[number, lane] = designs[number, first + lane]
    for lane in range(LANES):
        design = design_in(group.given, lane)
        c = constants_in_lane(group, lane, design, readings)
        h, status = first_step(control, stop_of(control), c)
        status = RUNNING if status == ACCEPTED else status
        status = status if is_computable(c) else Status.INVALID.value
        status = Status.NO_CONTACT.value if design.H - design.d <= design.e_bumper else status
        store_constants(group, lane, c)
        store_pace(group.pace, lane, Pace(h, h, 0.0))
        store_attempt(group.attempt, lane, Attempt(0.0, 0.0, status))


@kernel
def stand_still(group: Any, readings: Readings, control: Control) -> None:
    """Put every lane at the first touch."""
    for lane in range(LANES):
        h = group.pace.h_touching[lane]
        i = first_touch(h, h, load_constants(group, lane), readings, control)
        store_pace(group.pace, lane, i.pace)
        store_motion(group, lane, i)
    # In a loop of its own: with more stores in one the compiler vectorises neither.
    for lane in range(LANES):
        h = group.pace.h_touching[lane]
        store_modes(group, lane, first_touch(h, h, load_constants(group, lane), readings, control))


@kernel
def take_first_steps(group: Any, readings: Readings, control: Control) -> None:
    """Accept the first steps that end where the boulder begins to turn; leave the others undone."""
    for lane in range(LANES):
        i, error, c = load_impact(group, lane), group.attempt.error[lane], load_constants(group, lane)
        turns, after = begin_to_turn(
            i, load_state(group.y_end, lane), load_acceleration(group.k_end, lane), error, c, readings, control
        )
        if turns:
            store_motion(group, lane, after)
            store_modes(group, lane, after)


@inlined
def start_designs(group: Any, designs: np.ndarray, first: int, readings: Readings, control: Control) -> None:
    """Put as many designs as there are lanes into a group, and take their first step where it ends as it should.

    ``designs, first``: the designs of `LaneDesigns`, and the row of the design in the first lane.

    A lane is left with the status RUNNING, or with the status of a design that needs no integration or allows none.
    """
    compute_constants(group, designs, first, readings, control)
    stand_still(group, readings, control)
    attempt_steps(group)
    take_first_steps(group, readings, control)


@kernel
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
    store_clock(running.clock, lane, Clock(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@kernel
def follow_lane(group: Any, lane: int, readings: Readings, control: Control) -> int:
    """Find what follows from the step of a lane, see `boulder_kernels.impact.follow`; return its status."""
    i, c, error = load_impact(group, lane), load_constants(group, lane), group.attempt.error[lane]
    y_end, k_end = load_state(group.y_end, lane), load_acceleration(group.k_end, lane)
    followed = follow(i, y_end, k_end, error, c, readings, control)
    status, after = followed.status, followed.impact
    if status == Status.UNSTABLE.value and control.horizon <= MOST_STEPS * i.clock.h_full:
        h = RETRY * i.clock.h_full
        after = first_touch(h, h, c, readings, control)
        store_pace(group.pace, lane, after.pace)
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
    y_end, k_end = load_state(running.y_end, 0), load_acceleration(running.k_end, 0)
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

    ``designs, readings, control, record, out``: the same as in `simulate_lanes`, with designs for whole groups;
    ``groups, rows``: the lanes, see `empty_groups`; the rows of the designs in them, EMPTY before they are filled, and
    behind them 0.
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


class LaneDesigns(NamedTuple):
    """Designs as lanes take them."""

    designs: np.ndarray
    """Designs, SI, shape (15 + G, n): the fields of `DesignTable`, and below them what is given where the soil is in
    pieces: the body and the pieces (`Body`, `GivenPiece`) one after another."""
    pieces: int = 0
    has_strength: bool = False
    has_outline: bool = False
    """The same as in `group_type`."""


def simulate_lanes(
    given: LaneDesigns, readings: Readings, control: Control, record: Record, out: np.ndarray
) -> Outcome:
    """Simulate every design of a table in lanes, by a closed form of the soil.

    ``control``: how they are simulated, its choice of soil ignored. One that does not stop at the limit is for one
    design; ``record``: filled with the time history of one design at the times it names; for several, one that keeps
    nothing; ``out``: where the outcomes go in the order of the designs, an array of
    `boulder_kernels.outcomes.empty_outcomes`.

    Returns the outcome of the design that ended last.
    """
    rows = np.full(LANES + 1, EMPTY)
    rows[NEXT] = 0
    groups = empty_groups(given.pieces, has_strength=given.has_strength, has_outline=given.has_outline)
    return run_lanes(filled_up(given.designs), readings, control, groups, rows, record, out)


class Soils(NamedTuple):
    """The soils of designs that are no boxes in uniform soil."""

    layers: np.ndarray
    outlines: np.ndarray
    """Fields of a `PiecewiseTable`."""
    soil: Any
    """Elements or pieces that every design fills anew."""


def soils_of(layers: np.ndarray, outlines: np.ndarray, elements: int) -> Soils:
    """Return the soils of designs, with room for the soil of one: N elements, or pieces where N is 0."""
    return Soils(layers, outlines, empty_soil(layers.shape[1], outlines.shape[1], elements))


@by_types
def profile_in(row: int, soils: Any) -> Callable[..., SoilProfile | None]:
    """Return the soil of one design of a table; None for the uniform soil of a box."""
    if is_none(soils):
        return lambda row, soils: None
    return lambda row, soils: SoilProfile(soils.layers[row], soils.outlines[row], soils.soil)


@kernel
def run_rows(
    designs: np.ndarray, soils: Soils | None, readings: Readings, control: Control, record: Record, out: np.ndarray
) -> Outcome:
    """Simulate designs one by one, in any soil, and return the last outcome.

    ``designs``: shape (15, n), at least one; ``soils``: their soils; None for boxes in uniform soils; ``readings,
    control, record, out``: see `simulate_lanes`.
    """
    outcome = failed(Status.INVALID.value)
    for row in range(designs.shape[1]):
        design = design_in(designs, row)
        outcome = simulate_alone(Problem(design, profile_in(row, soils)), readings, control, record)
        write_outcome(out, row, outcome, step_errors(outcome, design, control.theta_limit, control.horizon))
    return outcome


def problem_at(table: DesignTable, row: int, control: Control) -> Problem:
    """Return one row of a table as a problem."""
    design = design_at(table, row)
    if not isinstance(table, PiecewiseTable):
        return Problem(design, None)
    return Problem(design, profile_of(table.layers[row], control.elements, table.outlines[row]))


def finer_step(step: float) -> float:
    """Return the step of the solution that is reported where errors are estimated [s].

    Rounded to twelve digits: a third of 18 ms in binary numbers is not quite 6 ms.
    """
    return float(f"{step / STEP_RATIO:.12g}")


def step_of_solution(control: Control) -> float:
    """Return the step of a solution [s]: of the finer of two, or of the only one."""
    return finer_step(control.h) if control.refined else control.h


def given_to_lanes(designs: np.ndarray, soils: Soils | None) -> LaneDesigns | None:
    """Return designs as lanes take them, or None of those that they do not take; arguments: see `run_rows`."""
    if soils is None:
        return LaneDesigns(designs)
    layers, outlines, points = soils.layers, soils.outlines, soils.outlines.shape[1]
    count = lanes_count(pieces_count(layers.shape[1], points))
    if count == 0:
        return None
    return LaneDesigns(given_pieces(designs, layers, outlines, count), count, has_strength(layers), points > 0)


def has_strength(layers: np.ndarray) -> bool:
    """Return whether the ultimate resistance of designs may be other than proportional to the depth.

    Layers of another density may happen not to make it so: all designs of a file are to be computed by the same code.
    """
    return layers.shape[1] > 1 or bool(layers[:, :, PRESSURE].any())


def solve_rows(
    designs: np.ndarray, soils: Soils | None, readings: Readings, control: Control, record: Record, out: np.ndarray
) -> Outcome:
    """Solve designs once: in lanes where they can be, else one by one; see `run_rows` for arguments and result."""
    resort = control.last_resort and control.stop_at_limit and soils is None
    if control.side_by_side and control.elements == 0 and not resort:
        given = given_to_lanes(designs, soils)
        if given is not None and (control.stop_at_limit or designs.shape[1] == 1):
            return simulate_lanes(given, readings, control, record, out)
    return run_rows(designs, soils, readings, control, record, out)


def solve(table: DesignTable, readings: Readings, control: Control) -> tuple[np.ndarray, np.ndarray]:
    """Solve every design of a table once.

    Returns ``out``, shape (11, n): rows in the order of `OutcomeTable`, with the errors of the steps of one
    solution; ``second``, shape (n,): which second solution each of them needs, see
    `boulder_kernels.outcomes.StepErrors`.
    """
    out, soils = empty_outcomes(len(table.L)), None
    if isinstance(table, PiecewiseTable):
        soils = soils_of(table.layers, table.outlines, control.elements)
    if len(table.L):
        solve_rows(np.stack(table[:BELOW]), soils, readings, control, no_record(), out)
    second = out[SECOND].copy()
    out[STEP] = np.where(np.isnan(out[T_END]), np.nan, step_of_solution(control))
    return out, second


def simulate(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact: a table of one design, by the very code that computes larger ones.

    Parameters
    ----------
    problem
        Design and soil.
    readings, control, record
        See `boulder_kernels.impact.simulate_alone`; nothing is estimated of errors.

    Returns
    -------
    Outcome
        Maxima from the dense output; NaN where the status says that there is no result, see `Status`.
    """
    designs, soils = np.array(problem.design, dtype=float)[:, None], None
    if problem.profile is not None:
        layers, outline, soil = problem.profile
        soils = Soils(layers[None], outline[None], soil)
    return solve_rows(designs, soils, readings, control, record, empty_outcomes(1))


def simulate_design(design: Design, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact in a uniform soil; see `simulate`."""
    return simulate(Problem(design, None), readings, control, record)


def is_layered(table: Any) -> bool:
    """Return whether the soil of a table may yield at one depth after another, other than in uniform soil."""
    if not isinstance(table, PiecewiseTable):
        return False
    return pieces_count(table.layers.shape[1], table.outlines.shape[1]) > 1 or has_strength(table.layers)


def is_paired(readings: Readings, control: Control, *, layered: bool) -> bool:
    """Return whether every design is solved twice for its error, where errors are estimated.

    What is read as printed may jump within a step, unseen by the error of the steps, and a soil in layers yields at
    many instants. The error time of element sums has not been measured.
    """
    measured = control.elements == 0 and not (layered or control.last_resort)
    return control.paired or not measured or not plain(proof_is_possible)(readings)


def some_rows(table: Any, rows: np.ndarray) -> Any:
    """Return some rows of a named tuple of columns."""
    return type(table)(*(np.ascontiguousarray(column[rows]) for column in table))


def simulate_table(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Simulate every design of a table.

    Parameters
    ----------
    table
        Designs, SI, arrays of shape (n,); or a `PiecewiseTable`, whose designs have no last resort.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit, soil. Every outcome has the error of its steps (`boulder_kernels.outcomes`). With
        ``error_estimate`` some designs, or all where `is_paired` says so, have a second solution, see
        `boulder_kernels.control.control_for`; the finest is reported.

    Returns
    -------
    OutcomeTable
        Arrays of shape (n,), in the order of the designs.
    """
    out, needed = solve(table, readings, plain(control_for)(NONE_NEEDED, control))
    if not control.error_estimate:
        return outcome_table(out)
    if is_paired(readings, control, layered=is_layered(table)):
        needed[:] = PAIR
    for solution in (FINER, COARSER, PAIR):
        rows = np.flatnonzero(needed == solution)
        if not len(rows):
            continue
        some = some_rows(table, rows)
        found, _ = solve(some, readings, plain(control_for)(solution, control))
        take_seconds(out, rows, found, needed, np.stack(some[:BELOW]), plain(safety_of)(readings))
    return outcome_table(out)
