"""The two functions that the page calls in its compiled kernels; their arguments are pointers to doubles.

`rows` judges designs as ``sweep run`` does, one after another instead of in lanes. `history` records one impact as
``sweep simulate`` does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import carray

from boulder_kernels import Control, Design, Outcome, Problem, Readings, Record
from boulder_kernels._jit import inlined, kernel
from boulder_kernels.control import STEP_RATIO, control_for, control_in
from boulder_kernels.design import design_in
from boulder_kernels.dynamics import constants_in
from boulder_kernels.ground import Ground, put_soil
from boulder_kernels.impact import simulate_alone, simulate_last_resort
from boulder_kernels.outcomes import (
    NONE_NEEDED,
    PAIR,
    SECOND,
    STEP,
    outcome_in,
    safety_of,
    sample_of,
    state_of,
    step_errors,
    take_second,
    write_outcome,
)
from boulder_kernels.pieces import ManyPieces, SoilProfile
from boulder_kernels.rules import (
    SLOWER_SPEEDS,
    Rows,
    VerdictLimits,
    consider,
    flags_of,
    rule_by_slower,
)
from boulder_sweep.report.page_records import (
    BELOW,
    COURSE,
    DESIGN_COUNT,
    ELEMENT_ROOM,
    FLAG_INPUTS,
    GROUND_COUNT,
    HISTORY_COUNT,
    LIMITS,
    OUTCOME_COUNT,
    PIECE_ROOM,
    READINGS_COUNT,
    SETTINGS_COUNT,
    SIZES,
    SUMS_ROOM,
    V_0,
    elements_from,
    readings_from,
    table_from,
)

RECORDS = {"s": SIZES, "f": FLAG_INPUTS, "l": LIMITS, "c": COURSE}
EXPORTS = {"rows": "pippipipipppisflppcp", "history": "pppipipipppipppppp"}
"""The functions that the page calls, and their arguments: p for a pointer to doubles, i for a whole number, and
a letter of `RECORDS` for a pointer to records."""


@kernel
def put_soils(
    designs: np.ndarray,
    ground_at: Any,
    below_at: Any,
    deeper: int,
    profile: np.ndarray,
    layers: np.ndarray,
    outlines: np.ndarray,
) -> None:
    """Write what the soil as it lies makes of designs, see `boulder_kernels.ground.put_soil`.

    Parameters
    ----------
    designs
        Inputs, shape (len(DESIGN), n).
    ground_at, below_at, deeper
        Numbers in the order of GROUND, deeper layers, shape (deeper, BELOW), and their number.
    profile, layers, outlines
        See `put_soil`.
    """
    g = carray(ground_at, (GROUND_COUNT,))
    ground = Ground(int(g[0]), g[1], g[2], g[3], carray(below_at, (deeper, BELOW)))
    put_soil(table_from(designs), ground, g[4] > 0.0, int(g[5]), profile, layers, outlines)


@inlined
def write_history(
    c: Any,
    design: Design,
    readings: Readings,
    record: Record,
    out: np.ndarray,
    centre: np.ndarray,
) -> None:
    """Evaluate motion, force and energies of a record."""
    centre[0], centre[1] = c.c_x, c.c_y
    for i in range(record.times.size):
        y = state_of(record, i)
        if np.isnan(y.x_b):
            break
        sample = sample_of(record, i, c, design.m_v, readings)
        stored, touching = sample.stored, record.touching[i] > 0.0
        drag, damper, restoring, pull = (
            record.exchanged[i, 0],
            record.exchanged[i, 1],
            record.exchanged[i, 2],
            record.exchanged[i, 3],
        )
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i] = y
        out[6, i] = record.touching[i]
        out[7, i] = -design.m_v * sample.rate.a_v if touching else 0.0
        out[8, i], out[9, i], out[10, i], out[11, i] = (
            stored.truck_kinetic,
            stored.boulder_kinetic,
            stored.boulder_rotational,
            stored.soil_elastic,
        )
        out[12, i] = stored.crush_elastic
        out[13, i] = stored.gravity if readings.restoring_gravity else restoring
        out[14, i], out[15, i], out[16, i] = drag, damper, -pull


@inlined
def simulate_recorded(
    profile: Any,
    design: Design,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
    centre: np.ndarray,
) -> Outcome:
    """Simulate one design in the profile of its soil, and where `centre` has room evaluate the record."""
    outcome = simulate_alone(Problem(design, profile), readings, control, record)
    if centre.size > 0:
        c = constants_in(design, readings, control.elements, profile)
        write_history(c, design, readings, record, out, centre)
    return outcome


@kernel
def simulate_in_soil(
    layers: np.ndarray,
    outline: np.ndarray,
    soil_at: Any,
    design: Design,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
    centre: np.ndarray,
) -> Outcome:
    """Simulate one design in its soil; layers, outline and room for the soil are `history`'s."""
    m, n = len(layers), control.elements
    if m == 0 and control.last_resort and control.stop_at_limit:
        return simulate_last_resort(design, readings, control, record)
    if m == 0:
        return simulate_recorded(None, design, readings, control, record, out, centre)
    if n > 0:
        by_elements = SoilProfile(layers, outline, elements_from(carray(soil_at, (ELEMENT_ROOM, n))))
        return simulate_recorded(by_elements, design, readings, control, record, out, centre)
    pieces = m + max(len(outline) - 2, 0)
    sums = carray(soil_at, (PIECE_ROOM * pieces + SUMS_ROOM,))[PIECE_ROOM * pieces :]
    soil = ManyPieces(sums, carray(soil_at, (pieces, PIECE_ROOM)))
    return simulate_recorded(SoilProfile(layers, outline, soil), design, readings, control, record, out, centre)


class DesignsInSoil(NamedTuple):
    """Designs, their layers and outlines, and room for the soil of one design."""

    designs: np.ndarray
    layers: np.ndarray
    outlines: np.ndarray
    soil_at: Any


@kernel
def solve(out: np.ndarray, row: int, given: DesignsInSoil, readings: Readings, control: Control) -> int:
    """Simulate one design, write its outcome with the error of its steps, and return which second one it needs."""
    design, soil_at = design_in(given.designs, row), given.soil_at
    nothing, nowhere = carray(soil_at, (HISTORY_COUNT, 0)), carray(soil_at, (0,))
    record = Record(nowhere, carray(soil_at, (0, 6)), nowhere, nowhere, carray(soil_at, (0, 4)))
    soil = given.layers[row], given.outlines[row], soil_at
    outcome = simulate_in_soil(*soil, design, readings, control, record, nothing, nowhere)
    out[:, row] = np.nan
    write_outcome(out, row, outcome, step_errors(outcome, design, control.theta_limit, control.horizon))
    second = int(out[SECOND, row])  # stands where the step is written
    out[STEP, row] = control.h / STEP_RATIO if control.refined else control.h
    return second


@kernel
def solve_with_error(
    out: np.ndarray, other: np.ndarray, row: int, given: DesignsInSoil, readings: Readings, control: Control
) -> None:
    """Simulate one design as `boulder_kernels.table.simulate_table` does; `other` has room for a second solution."""
    second = solve(out, row, given, readings, control_for(NONE_NEEDED, control))
    if not control.error_estimate:
        return
    if control.paired:
        second = PAIR
    while second != NONE_NEEDED:
        solve(other, row, given, readings, control_for(second, control))
        second = take_second(out, row, other, row, second, design_in(given.designs, row), safety_of(readings))


@kernel
def decide(
    rows: Rows, room: np.ndarray, row: int, given: DesignsInSoil, settings: np.ndarray, limits: VerdictLimits
) -> None:
    """Simulate one design until it is decided; `room` has room for two solutions, shape (2, len(OUTCOME), n)."""
    number, controls = 0, settings[:, READINGS_COUNT:]
    while number < len(settings):
        readings, control = readings_from(settings[number]), control_in(controls[number])
        solve_with_error(room[0], room[1], row, given, readings, control)
        consider(rows, row, room[0], row, number, controls, limits)
        number = int(rows.courses[row].wanted)


@kernel
def rows(
    designs_at: Any,
    n: int,
    ground_at: Any,
    below_at: Any,
    deeper: int,
    profile_at: Any,
    points: int,
    layers_at: Any,
    m: int,
    outlines_at: Any,
    soil_at: Any,
    controls_at: Any,
    count: int,
    sizes_at: Any,
    flag_inputs_at: Any,
    limits_at: Any,
    outcomes_at: Any,
    room_at: Any,
    courses_at: Any,
    flags_at: Any,
) -> None:
    """Simulate n designs, apply the rules of the verdict, and simulate again what is open or late by finer steps.

    Parameters
    ----------
    designs_at
        Inputs, shape (len(DESIGN), n); K_epsilon is written over, see `put_soils`.
    n
        Number of designs.
    ground_at, below_at, deeper
        The soil as it lies, see `put_soils`.
    profile_at, points
        Profile of the boulders, shape (points, 4); no points for boxes.
    layers_at, m
        Room for the layers of their soil, shape (n, m, 6), see `boulder_kernels.pieces`; none for a uniform soil
        beside boxes.
    outlines_at
        Room for the outlines of the boulders, shape (n, points, 4), see `boulder_kernels.design`.
    soil_at
        Room for the soil of one design: SUMS_ROOM numbers and PIECE_ROOM for each of its pieces, or for N soil elements
        ELEMENT_ROOM N.
    controls_at, count
        Settings, shape (count, len(SETTINGS)): the first, and finer ones in the order of
        `boulder_sweep.judge.accuracy.finer_controls`.
    sizes_at, flag_inputs_at
        Inputs of the rules, n records of `Sizes`, and of the flags, n records of `FlagInputs`.
    limits_at
        Limits of the criterion, and what the model was tested on, a record of `LIMITS`.
    outcomes_at, room_at
        Where the results go, shape (len(OUTCOME), n), and room for three times as many.
    courses_at
        Where the rules write, n records of `Course`, and room for as many.
    flags_at
        Where the flags go, shape (n,).
    """
    settings, both = carray(controls_at, (count, SETTINGS_COUNT)), carray(limits_at, (1,))[0]
    limits, tested = both.criterion, both.tested
    designs, sizes, flag_inputs = (
        carray(designs_at, (DESIGN_COUNT, n)),
        carray(sizes_at, (n,)),
        carray(flag_inputs_at, (n,)),
    )
    layers, outlines = carray(layers_at, (n, m, 6)), carray(outlines_at, (n, points, 4))
    put_soils(designs, ground_at, below_at, deeper, carray(profile_at, (points, 4)), layers, outlines)
    given, room = DesignsInSoil(designs, layers, outlines, soil_at), carray(room_at, (3, OUTCOME_COUNT, n))
    courses, flags = carray(courses_at, (2, n)), carray(flags_at, (n,))
    own = Rows(carray(outcomes_at, (OUTCOME_COUNT, n)), courses[0], sizes)
    slower = Rows(room[2], courses[1], sizes)
    for row in range(n):
        decide(own, room, row, given, settings, limits)
        course, slow, of_rules, v_0 = own.courses[row], slower.courses[row], sizes[row], designs[V_0, row]
        if course.asked_slower > 0.0:
            for share in SLOWER_SPEEDS:
                designs[V_0, row] = of_rules.v_0 = share * v_0
                decide(slower, room, row, given, settings, limits)
                course.rule = min(course.rule, float(rule_by_slower(slow.rule)))
            designs[V_0, row] = of_rules.v_0 = v_0
        flags[row] = flags_of(outcome_in(own.counted, row), course.overlap, flag_inputs[row], tested)


@kernel
def history(
    design_from: Any,
    ground_at: Any,
    below_at: Any,
    deeper: int,
    profile_at: Any,
    points: int,
    layers_at: Any,
    m: int,
    outline_at: Any,
    soil_at: Any,
    settings_at: Any,
    n: int,
    times_at: Any,
    states_at: Any,
    modes_at: Any,
    exchanged_at: Any,
    history_at: Any,
    centre_at: Any,
) -> None:
    """Simulate one design, and evaluate its motion, force and energies at n times.

    Parameters
    ----------
    design_from
        Inputs, shape (len(DESIGN),); K_epsilon is written over.
    ground_at, below_at, deeper, profile_at, points, layers_at, m, outline_at, soil_at
        The soil as it lies and room for what follows from it, as `rows` takes them for one design.
    settings_at
        Settings, shape (len(SETTINGS),).
    n, times_at
        Times of the samples, ascending [s], shape (n,).
    states_at, modes_at, exchanged_at
        Room for the record, shapes (n, 6), (2, n) and (n, 4).
    history_at
        Where the results go, shape (len(HISTORY), n); NaN where the simulation does not get.
    centre_at
        Where c_x and c_y go, the common centre of mass of boulder and soil (Eqs 3, 4).
    """
    s = carray(settings_at, (SETTINGS_COUNT,))
    readings, control = readings_from(s), control_for(NONE_NEEDED, control_in(s[READINGS_COUNT:]))
    designs = carray(design_from, (DESIGN_COUNT, 1))
    layers, outlines = carray(layers_at, (1, m, 6)), carray(outline_at, (1, points, 4))
    put_soils(designs, ground_at, below_at, deeper, carray(profile_at, (points, 4)), layers, outlines)
    design = design_in(designs, 0)
    out, modes, exchanged = (
        carray(history_at, (HISTORY_COUNT, n)),
        carray(modes_at, (2, n)),
        carray(exchanged_at, (n, 4)),
    )
    record = Record(carray(times_at, (n,)), carray(states_at, (n, 6)), modes[0], modes[1], exchanged)
    out[:] = np.nan
    record.states[:] = np.nan
    centre = carray(centre_at, (2,))
    simulate_in_soil(layers[0], outlines[0], soil_at, design, readings, control, record, out, centre)
