"""The two functions that the page calls in its compiled kernels, each with one record of numbers and addresses.

`rows` judges designs as ``sweep run`` does, one after another instead of in lanes. `history` records one impact as
``sweep simulate`` does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from boulder_kernels import Control, Design, Outcome, Problem, Readings, Record
from boulder_kernels._jit import inlined, kernel
from boulder_kernels.control import STEP_RATIO, control_for, control_in
from boulder_kernels.design import design_in
from boulder_kernels.dynamics import constants_in
from boulder_kernels.ground import Ground, put_soil
from boulder_kernels.impact import simulate_alone
from boulder_kernels.numerics import write_numbers
from boulder_kernels.outcomes import (
    NONE_NEEDED,
    PAIR,
    SECOND,
    STEP,
    ExchangedEnergies,
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
    ENERGY,
    EXCHANGED,
    FLAG_INPUTS,
    GRAVITY,
    GROUND_COUNT,
    HISTORY_CALL,
    HISTORY_COUNT,
    LAYER,
    LIMITS,
    OUTCOME_COUNT,
    OUTLINE,
    PIECE_ROOM,
    READINGS_COUNT,
    ROWS_CALL,
    SETTINGS_COUNT,
    SIZES,
    STATE,
    SUMS_ROOM,
    TOUCHING,
    V_0,
    elements_from,
    readings_from,
    table_from,
)

EXPORTS = {"rows": ROWS_CALL, "history": HISTORY_CALL}
"""The functions that the page calls, and the record that each of them takes."""


def _to_pointer(typing: Any, address: Any) -> Any:
    """Return the pointer to an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Convert it, a double as every number of the page."""
        whole = builder.fptosi(arguments[0], context.get_value_type(types.intp))
        return builder.inttoptr(whole, context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


pointer: Any = intrinsic(_to_pointer)


@inlined
def doubles(address: float, shape: Any) -> np.ndarray:
    """Return the doubles at an address as an array."""
    return carray(pointer(address), shape, np.float64)


class DesignsInSoil(NamedTuple):
    """Designs, their layers and outlines, and the address of room for the soil of one design."""

    designs: np.ndarray
    layers: np.ndarray
    outlines: np.ndarray
    soil_at: float


@inlined
def in_soil(call: Any, designs: np.ndarray) -> DesignsInSoil:
    """Write what the soil of a call, a `SoilCall`, makes of designs, see `boulder_kernels.ground.put_soil`."""
    m, points, n = int(call.m), int(call.points), designs.shape[1]
    g = doubles(call.ground, (GROUND_COUNT,))
    ground = Ground(int(g[0]), g[1], g[2], g[3], doubles(call.below, (int(call.deeper), BELOW)))
    layers, outlines = doubles(call.layers, (n, m, LAYER)), doubles(call.outlines, (n, points, OUTLINE))
    profile = doubles(call.profile, (points, OUTLINE))
    put_soil(table_from(designs), ground, g[4] > 0.0, int(g[5]), profile, layers, outlines)
    return DesignsInSoil(designs, layers, outlines, call.soil)


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
        e = record.exchanged[i]
        exchanged = ExchangedEnergies(e[0], e[1], e[2], e[3])
        write_numbers(out[:, i], y)
        out[TOUCHING, i] = record.touching[i]
        out[TOUCHING + 1, i] = -design.m_v * sample.rate.a_v if touching else 0.0
        write_numbers(out[ENERGY:, i], stored)
        if not readings.restoring_gravity:
            out[GRAVITY, i] = exchanged.restoring
        write_numbers(out[GRAVITY + 1 :, i], (exchanged.drag, exchanged.damper, -exchanged.pull))


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
    """Simulate one design in the profile of its soil, and where `centre` has room evaluate the record.

    As a last resort a softer spring may stand for the vehicle's, and energies of the latter would be wrong.
    """
    outcome = simulate_alone(Problem(design, profile), readings, control, record)
    if centre.size > 0 and not (control.last_resort and profile is None):
        c = constants_in(design, readings, control.elements, profile)
        write_history(c, design, readings, record, out, centre)
    return outcome


@kernel
def simulate_in_soil(
    given: DesignsInSoil,
    row: int,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
    centre: np.ndarray,
) -> Outcome:
    """Simulate one design in its soil."""
    design, layers, outline = design_in(given.designs, row), given.layers[row], given.outlines[row]
    m, n = len(layers), control.elements
    if m == 0:
        return simulate_recorded(None, design, readings, control, record, out, centre)
    if n > 0:
        by_elements = SoilProfile(layers, outline, elements_from(doubles(given.soil_at, (ELEMENT_ROOM, n))))
        return simulate_recorded(by_elements, design, readings, control, record, out, centre)
    pieces = m + max(len(outline) - 2, 0)
    sums = doubles(given.soil_at, (PIECE_ROOM * pieces + SUMS_ROOM,))[PIECE_ROOM * pieces :]
    soil = ManyPieces(sums, doubles(given.soil_at, (pieces, PIECE_ROOM)))
    return simulate_recorded(SoilProfile(layers, outline, soil), design, readings, control, record, out, centre)


@kernel
def solve(out: np.ndarray, row: int, given: DesignsInSoil, readings: Readings, control: Control) -> int:
    """Simulate one design, write its outcome with the error of its steps, and return which second one it needs."""
    design, soil_at = design_in(given.designs, row), given.soil_at
    nothing, nowhere = doubles(soil_at, (HISTORY_COUNT, 0)), doubles(soil_at, (0,))
    record = Record(nowhere, doubles(soil_at, (0, STATE)), nowhere, nowhere, doubles(soil_at, (0, EXCHANGED)))
    outcome = simulate_in_soil(given, row, readings, control, record, nothing, nowhere)
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
def rows(call_at: Any) -> None:
    """Simulate designs, apply the rules of the verdict, and simulate again what is open or late by finer steps.

    Parameters
    ----------
    call_at
        A record of `RowsCall`.
    """
    call = carray(call_at, (1,))[0]
    n = int(call.n)
    settings = doubles(call.controls, (int(call.solutions), SETTINGS_COUNT))
    both = carray(pointer(call.limits), (1,), LIMITS)[0]
    limits, tested = both.criterion, both.tested
    designs, sizes = doubles(call.designs, (DESIGN_COUNT, n)), carray(pointer(call.sizes), (n,), SIZES)
    inputs, courses = carray(pointer(call.inputs), (n,), FLAG_INPUTS), carray(pointer(call.courses), (2, n), COURSE)
    given = in_soil(call.soil, designs)
    room = doubles(call.room, (3, OUTCOME_COUNT, n))
    own = Rows(doubles(call.outcomes, (OUTCOME_COUNT, n)), courses[0], sizes)
    slower, flags = Rows(room[2], courses[1], sizes), doubles(call.flags, (n,))
    for row in range(n):
        decide(own, room, row, given, settings, limits)
        course, slow, of_rules, v_0 = own.courses[row], slower.courses[row], sizes[row], designs[V_0, row]
        if course.asked_slower > 0.0:
            for share in SLOWER_SPEEDS:
                designs[V_0, row] = of_rules.v_0 = share * v_0
                decide(slower, room, row, given, settings, limits)
                course.rule = min(course.rule, float(rule_by_slower(slow.rule)))
            designs[V_0, row] = of_rules.v_0 = v_0
        flags[row] = flags_of(outcome_in(own.counted, row), course.overlap, inputs[row], tested)


@kernel
def history(call_at: Any) -> None:
    """Simulate one design, and evaluate its motion, force and energies.

    Parameters
    ----------
    call_at
        A record of `HistoryCall`.
    """
    call = carray(call_at, (1,))[0]
    n, s = int(call.n), doubles(call.settings, (SETTINGS_COUNT,))
    readings, control = readings_from(s), control_for(NONE_NEEDED, control_in(s[READINGS_COUNT:]))
    given = in_soil(call.soil, doubles(call.design, (DESIGN_COUNT, 1)))
    times, modes = doubles(call.times, (n,)), doubles(call.modes, (2, n))
    states, exchanged = doubles(call.states, (n, STATE)), doubles(call.exchanged, (n, EXCHANGED))
    out, centre = doubles(call.history, (HISTORY_COUNT, n)), doubles(call.centre, (2,))
    out[:] = np.nan
    states[:] = np.nan
    record = Record(times, states, modes[0], modes[1], exchanged)
    simulate_in_soil(given, 0, readings, control, record, out, centre)
