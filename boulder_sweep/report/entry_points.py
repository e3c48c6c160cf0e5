"""What the page calls: the kernels behind three functions over pointers to doubles.

WebAssembly has no named tuples, so designs, soils and settings are passed as plain numbers in a fixed order, which only
this module knows. `outcomes` does the work of ``sweep run``, one design after another instead of in lanes, `rulings`
that of its verdicts, and `history` that of ``sweep simulate``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from boulder_kernels import (
    ELASTIC,
    Control,
    Design,
    DesignTable,
    OutcomeTable,
    Problem,
    Readings,
    Record,
    SecondSpring,
    simulate,
)
from boulder_kernels._jit import array_kernel, inlined, when_compiling
from boulder_kernels.control import STEP_RATIO
from boulder_kernels.design import design_in
from boulder_kernels.error_estimates import (
    SAFETY,
    SAFETY_CONFIRMED,
    SAFETY_PRINTED,
    confirm_error,
    estimate_error,
    step_errors,
)
from boulder_kernels.ground import Ground, put_soil
from boulder_kernels.layered import SoilElements, SoilLayers, SoilSums
from boulder_kernels.outcomes import COARSER, FINER, NONE_NEEDED, SECOND, STEP, THETA_MAX, write_outcome
from boulder_kernels.outlined import OutlinedElements, OutlinedPieces
from boulder_kernels.plastic import LAST, PLASTIC_WITH_GAP, Memory, memory_of
from boulder_kernels.rules import VerdictLimits, limits_in, write_rulings
from boulder_kernels.soil_laws import SoilProfile, constants_in
from boulder_kernels.time_history import sample_of, state_of
from boulder_kernels.unloading import plastic_work, recall

DESIGN = (*Design._fields, *SecondSpring._fields)
"""Inputs of a design, in this order; SI, phi in rad, beta in MN/m^3. A vehicle without a second spring has one like its
first, from a crush on that it never reaches: its results have the same bits."""
SETTINGS = (*Readings._fields, *Control._fields)
"""Settings of the simulation, in this order; booleans are 0 or 1."""
SETTINGS_COUNT = len(SETTINGS)
PAIRED_AT = SETTINGS.index("paired")
CHECKED, PAIRED, ONCE = range(3)
"""What the setting ``paired`` may be in the page, where errors are estimated: two solutions where they are needed, of
all designs, or of none."""
OUTCOME = OutcomeTable._fields
"""Results of a design, in this order; SI, rad."""
LIMITS = VerdictLimits._fields
"""Limits of the criterion, in this order; rad, m."""
LIMITS_COUNT = len(LIMITS)
HISTORY = (
    *("x_b", "v_b", "theta_b", "omega_b", "x_v", "v_v"),
    *("touching", "F_v"),
    *("vehicle_kinetic", "boulder_linear", "boulder_angular", "soil_elastic", "crush_spring"),
    *("gravity", "soil_drag", "crush_damper", "pull", "soil_plastic"),
)
"""Columns of a time history, in this order; m, rad, N, J. The parts of the energy as in `EnergyLedger`."""
ENERGY = HISTORY.index("vehicle_kinetic")
"""Index of the first energy."""
GROUND = (*Ground._fields[:-1], "layered", "slices")
"""What lies around the boulders, in this order, the deeper layers apart; SI, rad, kPa. The last two are arguments of
`boulder_kernels.ground.put_soil`."""
GROUND_COUNT = len(GROUND)
BELOW = 5
"""Numbers of a deeper layer."""
EXPORTS = {"outcomes": "pippipipippppp", "rulings": "ipppp", "history": "pppipipipppippppppp"}
"""The functions that the page calls, and their arguments: p for a pointer to doubles, i for a whole number."""
carray: Any = None
"""`numba.carray`, which is there when kernels are compiled: a report is written without Numba."""


@when_compiling
def _import_carray() -> None:
    """Import what the kernels below make arrays with."""
    global carray
    from numba import carray


@inlined
def readings_from(s: np.ndarray) -> Readings:
    """Return the readings, the first of the settings."""
    return Readings(s[0] > 0.0, s[1] > 0.0, s[2] > 0.0, s[3] > 0.0, s[4] > 0.0)


@inlined
def control_from(s: np.ndarray, refined: bool) -> Control:
    """Return the control, which follows the readings, with its step or a third of it."""
    # What yields in plastic soil depends on what it remembers.
    h, longest, unloading = s[5], s[13], int(s[15])
    estimated, stopping, located = s[9] > 0.0, s[10] > 0.0, s[11] > 0.0 and s[15] == ELASTIC
    elements, paired, last_resort, tolerance = int(s[8]), False, False, s[17]
    return Control(
        h,
        s[6],
        s[7],
        elements,
        estimated,
        stopping,
        located,
        refined,
        longest,
        last_resort,
        unloading,
        paired,
        tolerance,
    )


@inlined
def halved_control_from(s: np.ndarray) -> Control:
    """Return the control of a second solution, `boulder_kernels.table.halved`."""
    h, longest, stopping, tolerance = 0.5 * s[5], s[13], s[10] > 0.0, s[17]
    return Control(h, s[6], s[7], int(s[8]), True, stopping, True, True, longest, False, ELASTIC, False, tolerance)


@inlined
def table_from(t: np.ndarray) -> DesignTable:
    """Return the rows of an array as the columns of a table."""
    return DesignTable(t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], t[9], t[10], t[11], t[12], t[13], t[14])


@inlined
def outcomes_from(t: np.ndarray) -> OutcomeTable:
    """Return the rows of an array as the columns of a table."""
    return OutcomeTable(t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], t[9], t[10])


@array_kernel
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
        As of `put_soil`.
    """
    g = carray(ground_at, (GROUND_COUNT,))
    ground = Ground(int(g[0]), g[1], g[2], g[3], carray(below_at, (deeper, BELOW)))
    put_soil(table_from(designs), ground, g[4] > 0.0, int(g[5]), profile, layers, outlines)


LAYER_ROOM = len(SoilLayers._fields) - 1 + len(SoilSums._fields)
"""Numbers for each layer of the soil of a design: enough for the layers, and once for their sums."""


PIECE_ROOM = len(OutlinedPieces._fields) - 1
"""The same for each piece of the soil beside a boulder with an outline: of M layers and P points M + P - 2."""
ELEMENT_ROOM, MEMORY_ROOM = 6, LAST + 6
"""The same for each of N soil elements with what it remembers, and once for all; before them, where a record is kept,
2 N + 1 for each of its samples."""


@inlined
def layers_from(t: np.ndarray, sums: np.ndarray) -> SoilLayers:
    """Return the rows of an array, and the numbers of another, as the layers of one design."""
    return SoilLayers(t[0], t[1], t[2], t[3], t[4], t[5], sums)


@inlined
def elements_from(room: np.ndarray, n: int) -> SoilElements:
    """Return the first numbers of an array as n soil elements of one design."""
    return SoilElements(room[:n], room[n : 2 * n], room[2 * n : 3 * n], room[3 * n : 4 * n])


@inlined
def pieces_from(t: np.ndarray, lean: np.ndarray, outline: np.ndarray) -> OutlinedPieces:
    """Return the rows of an array, and a number of another, as the soil of one design beside an outline."""
    return OutlinedPieces(t[0], t[1], t[2], t[3], t[4], t[5], t[6], lean, outline)


@inlined
def outlined_elements_from(room: np.ndarray, n: int, outline: np.ndarray) -> OutlinedElements:
    """Return the first numbers of an array as n soil elements of one design beside an outline."""
    return OutlinedElements(elements_from(room, n), room[4 * n : 4 * n + 1], outline)


@inlined
def memory_from(room: np.ndarray, n: int, gap: bool, samples: np.ndarray) -> Memory:
    """Return the numbers behind n soil elements as what they remember."""
    return Memory(room[4 * n : 5 * n], room[5 * n : 6 * n], gap, room[6 * n :], samples)


@array_kernel
def solve(
    out: np.ndarray,
    row: int,
    designs: np.ndarray,
    layers: np.ndarray,
    outlines: np.ndarray,
    soil_at: Any,
    readings: Readings,
    control: Control,
    record: Record,
) -> int:
    """Simulate one design, write its outcome with the error of its steps, and return which second one it needs."""
    design, spring = design_in(designs, row), SecondSpring(designs[15, row], designs[16, row])
    m, points, n = layers.shape[1], outlines.shape[1], control.elements
    room = carray(soil_at, (max(LAYER_ROOM * m, ELEMENT_ROOM * n + MEMORY_ROOM),))
    if m == 0:
        outcome = simulate(Problem(design, None, spring), readings, control, record)
    elif points > 0 and n == 0:
        k = m + points - 2
        pieces = pieces_from(carray(soil_at, (7, k)), carray(soil_at, (PIECE_ROOM * k,))[7 * k :], outlines[row])
        outcome = simulate(Problem(design, SoilProfile(layers[row], pieces, None), spring), readings, control, record)
    elif points > 0:
        beside = SoilProfile(layers[row], outlined_elements_from(room, n, outlines[row]), None)
        outcome = simulate(Problem(design, beside, spring), readings, control, record)
    elif n == 0:
        profile = SoilProfile(layers[row], layers_from(carray(soil_at, (6, m)), room[6 * m :]), None)
        outcome = simulate(Problem(design, profile, spring), readings, control, record)
    elif control.unloading == ELASTIC:
        by_elements = SoilProfile(layers[row], elements_from(room, n), None)
        outcome = simulate(Problem(design, by_elements, spring), readings, control, record)
    else:
        nothing = carray(soil_at, (0, 2 * n + 1))
        memory = memory_from(room, n, control.unloading == PLASTIC_WITH_GAP, nothing)
        plastic = SoilProfile(layers[row], elements_from(room, n), memory)
        outcome = simulate(Problem(design, plastic, spring), readings, control, record)
    out[:, row] = np.nan
    write_outcome(out, row, outcome, step_errors(outcome, design, control.theta_limit, control.horizon))
    second = int(out[SECOND, row])
    out[STEP, row] = control.h / STEP_RATIO if control.refined else control.h
    return second


@array_kernel
def outcomes(
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
    settings_at: Any,
    fine_at: Any,
    coarse_at: Any,
) -> None:
    """Simulate n designs, and estimate their errors as the settings ask for it.

    Parameters
    ----------
    designs_at
        Inputs, shape (len(DESIGN), n); K_epsilon is written over, see `put_soils`.
    n
        Number of designs.
    ground_at, below_at, deeper
        The soil as it lies, as of `put_soils`.
    profile_at
        Profile of the boulders, shape (points, 4).
    points
        Number of its points; 0 for boxes.
    layers_at
        Room for the layers of their soil, shape (n, m, 6), see `boulder_kernels.layered`.
    m
        Number of layers; 0 for a uniform elastic soil beside boxes.
    outlines_at
        Room for the outlines of the boulders, shape (n, points, 4), see `boulder_kernels.outlined`.
    soil_at
        Room for the soil of one design: for its layers, LAYER_ROOM m numbers, for its pieces beside an outline,
        PIECE_ROOM (m + points - 2), or for N soil elements ELEMENT_ROOM N + MEMORY_ROOM.
    settings_at
        Settings, shape (len(SETTINGS),).
    fine_at
        Where the results go, shape (len(OUTCOME), n).
    coarse_at
        Room for as many again, the coarser solutions.
    """
    s = carray(settings_at, (SETTINGS_COUNT,))
    readings, estimated, way = readings_from(s), s[9] > 0.0, int(s[PAIRED_AT])
    designs, finer, coarser = carray(designs_at, (17, n)), carray(fine_at, (11, n)), carray(coarse_at, (11, n))
    layers, outlines = carray(layers_at, (n, m, 6)), carray(outlines_at, (n, points, 4))
    put_soils(designs, ground_at, below_at, deeper, carray(profile_at, (points, 4)), layers, outlines)
    nothing = carray(coarse_at, (0,))
    record = Record(nothing, carray(coarse_at, (0, 6)), nothing, nothing, carray(coarse_at, (0, 4)), nothing)
    table, fine, coarse = table_from(designs), outcomes_from(finer), outcomes_from(coarser)
    safety = SAFETY if readings.restoring_gravity else SAFETY_PRINTED
    for row in range(n):
        second = solve(finer, row, designs, layers, outlines, soil_at, readings, control_from(s, estimated), record)
        if not estimated or way == ONCE:
            continue
        if way == CHECKED and second == NONE_NEEDED:
            continue
        if way == CHECKED and second == FINER:
            solve(coarser, row, designs, layers, outlines, soil_at, readings, halved_control_from(s), record)
            if not np.isnan(coarser[THETA_MAX, row]):
                confirm_error(fine, coarse, table, SAFETY_CONFIRMED, row)
                for column in range(11):
                    finer[column, row] = coarser[column, row]
                continue
        solve(coarser, row, designs, layers, outlines, soil_at, readings, control_from(s, False), record)
        if way == CHECKED and second == COARSER:
            confirm_error(coarse, fine, table, safety, row)
        else:
            estimate_error(coarse, fine, table, safety, row)
        # The status of a simulation that continues beyond the limit does not say that it reached it.
        if np.isnan(coarse.t_limit[row]) != np.isnan(fine.t_limit[row]):
            fine.theta_error[row] = fine.x_error[row] = np.inf


@array_kernel
def rulings(n: int, outcomes_at: Any, sizes_at: Any, limits_at: Any, rulings_at: Any) -> None:
    """Apply the rules of the verdict to n designs.

    Parameters
    ----------
    n
        Number of designs.
    outcomes_at
        Results of `outcomes`, shape (len(OUTCOME), n).
    sizes_at
        Inputs, shape (len(SIZES), n).
    limits_at
        Limits of the criterion, shape (len(LIMITS),).
    rulings_at
        Where the rulings go, shape (len(RULINGS), n).
    """
    limits = limits_in(carray(limits_at, (LIMITS_COUNT,)))
    table = outcomes_from(carray(outcomes_at, (11, n)))
    write_rulings(table, carray(sizes_at, (7, n)), limits, carray(rulings_at, (4, n)))


@inlined
def write_history(
    first: Any,
    design: Design,
    second: SecondSpring,
    readings: Readings,
    record: Record,
    out: np.ndarray,
    centre: np.ndarray,
) -> None:
    """Evaluate motion, force and energies of a record whose constants are `first` until a second spring takes over."""
    centre[0], centre[1] = first.c_x, first.c_y
    memory = memory_of(first)
    for i in range(record.times.size):
        y = state_of(record, i)
        if np.isnan(y.x_b):
            break
        recall(i, memory)
        sample = sample_of(record, i, first, second, design.m_v, readings)
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
        before, since = plastic_work(y, first, memory)
        out[8, i], out[9, i], out[10, i], out[11, i] = (
            stored.truck_kinetic,
            stored.boulder_kinetic,
            stored.boulder_rotational,
            stored.soil_elastic - since,
        )
        out[17, i] = before + since
        out[12, i] = stored.crush_elastic
        out[13, i] = stored.gravity if readings.restoring_gravity else restoring
        # What is spent where the second spring takes over is lasting crush, as what the damper takes up.
        out[14, i], out[15, i], out[16, i] = drag, damper + sample.spent, -pull


@array_kernel
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
    offset_at: Any,
    history_at: Any,
    centre_at: Any,
) -> None:
    """Simulate one design, and evaluate its motion, force and energies at n times.

    Parameters
    ----------
    design_from
        Inputs, shape (len(DESIGN),); K_epsilon is written over.
    ground_at, below_at, deeper, profile_at, points, layers_at, m, outline_at, soil_at
        The soil as it lies and room for what follows from it, as of `outcomes` for one design; with soil elements the
        last is room for n samples, too.
    settings_at
        Settings, shape (len(SETTINGS),).
    n
        Number of samples.
    times_at
        Their times, ascending [s], shape (n,).
    states_at, modes_at, exchanged_at, offset_at
        Room for the record, shapes (n, 6), (2, n), (n, 4) and (n,).
    history_at
        Where the results go, shape (len(HISTORY), n); NaN where the simulation does not get.
    centre_at
        Where c_x and c_y go, the common centre of mass of boulder and soil (Eqs 3, 4).
    """
    s = carray(settings_at, (SETTINGS_COUNT,))
    readings, control = readings_from(s), control_from(s, s[9] > 0.0)
    given = carray(design_from, (17, 1))
    all_layers, outlines = carray(layers_at, (1, m, 6)), carray(outline_at, (1, points, 4))
    put_soils(given, ground_at, below_at, deeper, carray(profile_at, (points, 4)), all_layers, outlines)
    design, second = design_in(given, 0), SecondSpring(given[15, 0], given[16, 0])
    out, modes = carray(history_at, (18, n)), carray(modes_at, (2, n))
    exchanged, offset = carray(exchanged_at, (n, 4)), carray(offset_at, (n,))
    record = Record(carray(times_at, (n,)), carray(states_at, (n, 6)), modes[0], modes[1], exchanged, offset)
    out[:] = np.nan
    record.states[:] = np.nan
    layers, outline = all_layers[0], outlines[0]
    centre, elements = carray(centre_at, (2,)), control.elements
    samples, kept = carray(soil_at, (n, 2 * elements + 1)), n * (2 * elements + 1)
    room = carray(soil_at, (kept + ELEMENT_ROOM * elements + MEMORY_ROOM,))[kept:]
    if m == 0:
        simulate(Problem(design, None, second), readings, control, record)
        uniform = constants_in(design, readings, elements, None)
        write_history(uniform, design, second, readings, record, out, centre)
    elif points > 0 and elements == 0:
        k = m + points - 2
        pieces = pieces_from(carray(soil_at, (7, k)), carray(soil_at, (PIECE_ROOM * k,))[7 * k :], outline)
        in_pieces = SoilProfile(layers, pieces, None)
        simulate(Problem(design, in_pieces, second), readings, control, record)
        of_pieces = constants_in(design, readings, 0, in_pieces)
        write_history(of_pieces, design, second, readings, record, out, centre)
    elif points > 0:
        beside = SoilProfile(layers, outlined_elements_from(room, elements, outline), None)
        simulate(Problem(design, beside, second), readings, control, record)
        of_outlined = constants_in(design, readings, elements, beside)
        write_history(of_outlined, design, second, readings, record, out, centre)
    elif elements == 0:
        profile = SoilProfile(
            layers, layers_from(carray(soil_at, (6, m)), carray(soil_at, (LAYER_ROOM * m,))[6 * m :]), None
        )
        simulate(Problem(design, profile, second), readings, control, record)
        c = constants_in(design, readings, 0, profile)
        write_history(c, design, second, readings, record, out, centre)
    elif control.unloading == ELASTIC:
        by_elements = SoilProfile(layers, elements_from(room, elements), None)
        simulate(Problem(design, by_elements, second), readings, control, record)
        of_elements = constants_in(design, readings, elements, by_elements)
        write_history(of_elements, design, second, readings, record, out, centre)
    else:
        memory = memory_from(room, elements, control.unloading == PLASTIC_WITH_GAP, samples)
        plastic = SoilProfile(layers, elements_from(room, elements), memory)
        simulate(Problem(design, plastic, second), readings, control, record)
        of_plastic = constants_in(design, readings, elements, plastic)
        write_history(of_plastic, design, second, readings, record, out, centre)
