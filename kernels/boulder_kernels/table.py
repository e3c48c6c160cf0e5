"""Tables of designs in, tables of outcomes out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ._jit import array_kernel, kernel, plain, unless_none
from .design import DesignTable, Readings, design_at, design_in
from .dynamics import State
from .impact import Control, Problem, Record, failed, misses, no_record, simulate, simulate_motion
from .lanes import simulate_lanes
from .last_resort import simulate_last_resort
from .layered import LayeredTable
from .outcomes import (
    SIMULATED,
    Outcome,
    OutcomesAtRest,
    OutcomeTable,
    Status,
    empty_outcomes,
    write_outcome,
)
from .plastic import ELASTIC, LAST, PLASTIC_WITH_GAP, SWING, empty_memory, memory_of
from .second_spring import SecondSpring, SecondSprings
from .settling import proof_is_possible
from .soil_laws import SoilProfile, constants_in, empty_soil, profile_of
from .unloading import rest_of

SAFETY = 1.5
"""Factor from the difference of two solutions to the error that is reported: it makes the estimate hold for 99 % and
more of all designs, and for those that are not stopped at the limit of rotation alone."""
SAFETY_PRINTED = 5.0
"""The same where the restoring moment is read as printed: two of its jumps can come and go within a step of either
solution, and both then miss them alike."""
LEAST_ROTATION = 1e-4
"""Rotation that an error of the truck may stand for even where the boulder turns less [rad]."""


@array_kernel
def take_profile(row: int, soil: Any, layers: np.ndarray) -> SoilProfile:
    """Return the soil of one design of a table in layers, shape (n, M, 6)."""
    return SoilProfile(layers[row], soil, None)


@kernel
def take_second_spring(row: int, springs: np.ndarray) -> SecondSpring:
    """Return the second spring of one vehicle, from rows as of `SecondSprings`."""
    return SecondSpring(springs[0, row], springs[1, row])


profile_in = unless_none("row soil layers", take_profile, "None")
"""The soil of one design of a table; None for the uniform soil of the design."""
second_spring_in = unless_none("row springs", take_second_spring, "None")
"""The second spring of one vehicle; None for a vehicle without."""


@array_kernel
def run_rows(
    designs: np.ndarray,
    layers: np.ndarray | None,
    soil: Any,
    springs: np.ndarray | None,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> None:
    """Simulate designs one by one; arguments: see `simulate_rows`, a record that keeps nothing, and its result."""
    for row in range(designs.shape[1]):
        profile, second = profile_in(row, soil, layers), second_spring_in(row, springs)
        write_outcome(out, row, simulate(Problem(design_in(designs, row), profile, second), readings, control, record))


@kernel
def run_last_resort(
    designs: np.ndarray,
    springs: np.ndarray | None,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> None:
    """The same for designs that need more steps than are allowed, see `boulder_kernels.last_resort`."""
    for row in range(designs.shape[1]):
        problem = Problem(design_in(designs, row), None, second_spring_in(row, springs))
        write_outcome(out, row, simulate_last_resort(problem, readings, control, record))


def simulate_rows(
    designs: np.ndarray,
    layers: np.ndarray | None,
    soil: Any,
    springs: np.ndarray | None,
    readings: Readings,
    control: Control,
) -> np.ndarray:
    """Simulate designs one by one, in any elastic soil.

    Parameters
    ----------
    designs
        As of `simulate_lanes`.
    layers
        Layers of every design, shape (n, M, 6), see `boulder_kernels.layered`; None for uniform soils.
    soil
        Elements or layers that every design fills anew; None for uniform soils.
    springs
        Rows as of `SecondSprings`, or None for vehicles without a second spring.
    readings, control
        As of `simulate_table`.
    """
    out = empty_outcomes(designs.shape[1])
    run_rows(designs, layers, soil, springs, readings, control, no_record(), out)
    return out


class Impact(NamedTuple):
    """One impact of a table; of a boulder in plastic soil also where it comes to rest, else NaN."""

    outcome: Outcome
    constants: Any
    """Constants of the design, with what plastic soil remembers in the end and remembered at every sample."""
    theta_rest: float
    """Rotation in which the boulder comes to rest [rad]; NaN where nothing is known of it."""
    doubt: float
    """By how much it may be another, by the energy that is left [rad]."""
    swing_back: float
    """How far the boulder has swung back from its largest rotation [rad]."""


def problem_at(
    table: DesignTable, row: int, control: Control, springs: SecondSprings | None = None, samples: int = 0
) -> Problem:
    """Return one row of a table as a problem, with room for as many samples as a record has."""
    design = design_at(table, row)
    second = None if springs is None else SecondSpring(springs.k_2[row], springs.s_2[row])
    layers = table.layers[row] if isinstance(table, LayeredTable) else None
    memory = None
    if control.unloading != ELASTIC:
        memory = empty_memory(control.elements, control.unloading == PLASTIC_WITH_GAP, samples)
    return Problem(design, profile_of(design, layers, control.elements, memory), second)


def simulate_impact(problem: Problem, readings: Readings, control: Control, record: Record) -> Impact:
    """Simulate one impact, and find where a boulder in plastic soil comes to rest; arguments: see `simulate`.

    In plastic soil no step is cut where the soil yields, because what yields depends on what it remembers.
    """
    c = constants_in(problem.design, readings, control.elements, problem.profile)
    if memory_of(c) is None:
        return Impact(simulate(problem, readings, control, record), c, np.nan, np.nan, np.nan)
    if misses(problem.design):
        return Impact(failed(Status.NO_CONTACT.value), c, np.nan, np.nan, np.nan)
    outcome = simulate_motion(c, readings, control._replace(locate_yield=False), record, problem.second)
    y = State(*c.memory.so_far[LAST:])
    if outcome.status not in SIMULATED or outcome.status == Status.LIMIT:
        return Impact(outcome, c, np.nan, np.nan, np.nan)
    swing_back = float(c.memory.so_far[SWING])
    if y.v_v > 0.0 or not plain(proof_is_possible)(readings):
        return Impact(outcome, c, np.nan, np.nan, swing_back)
    rest = rest_of(y, control.theta_limit, c)
    return Impact(outcome, c, rest.theta, rest.doubt, swing_back)


def simulate_plastic_rows(
    table: DesignTable, readings: Readings, control: Control, springs: SecondSprings | None
) -> Any:
    """Simulate every design of a table once in plastic soil; ``rest_error`` is without a numerical error."""
    n = len(table.L)
    out, rest = empty_outcomes(n), np.full((3, n), np.nan)
    for row in range(n):
        impact = simulate_impact(problem_at(table, row, control, springs), readings, control, no_record())
        write_outcome(out, row, impact.outcome)
        rest[:, row] = impact.theta_rest, impact.swing_back, impact.doubt
    return OutcomesAtRest(out[0].astype(np.int8), *out[1:], *rest)


def simulate_once(
    table: DesignTable, readings: Readings, control: Control, springs: SecondSprings | None = None
) -> OutcomeTable:
    """Simulate every design of a table once: in lanes where they can be, else one by one."""
    if control.unloading != ELASTIC:
        outcomes: OutcomeTable = simulate_plastic_rows(table, readings, control, springs)
        return outcomes
    designs = np.stack(table[: len(DesignTable._fields)])
    stacked = None if springs is None else np.stack(springs)
    if isinstance(table, LayeredTable):
        soil = empty_soil(table.layers.shape[1], control.elements)
        out = simulate_rows(designs, table.layers, soil, stacked, readings, control)
    elif control.last_resort:
        out = empty_outcomes(designs.shape[1])
        run_last_resort(designs, stacked, readings, control, no_record(), out)
    elif springs is None and control.elements == 0 and control.stop_at_limit:
        out = simulate_lanes(designs, readings, control)
    else:
        out = simulate_rows(designs, None, None, stacked, readings, control)
    return OutcomeTable(out[0].astype(np.int8), *out[1:])


@kernel
def estimate_errors(coarse: OutcomeTable, fine: OutcomeTable, table: DesignTable, safety: float) -> None:
    """Estimate the numerical errors of a table from a coarser solution of it.

    Parameters
    ----------
    coarse, fine
        Solutions with a step and with a third of it; the estimates go into the finer.
    table
        The designs.
    safety
        Factor from the difference of the two to the estimate.

    Notes
    -----
    The difference of two solutions is nearly the error of the coarser, many times that of the finer. It can be small
    by chance, where two errors cross zero, but hardly in all that is reported at once. So the largest difference
    counts: displacements and angles compared over the embedment depth, or half the height of the boulder where that is
    more, and times over the speed of impact. A boulder that hardly turns owes its rotation no more than that rotation
    itself to an error of the truck (LEAST_ROTATION where it is less), however small the boulder: beyond it only the
    difference of the rotations counts.
    Where only one of the two reached the limit of rotation, or failed, no estimate could be trusted: the error is
    infinite. Where both did, the rotation is the limit itself.
    """
    limit = Status.LIMIT.value
    for row in range(fine.status.size):
        if np.isnan(fine.theta_max[row]):
            continue
        if np.isnan(coarse.theta_max[row]) or (coarse.status[row] == limit) != (fine.status[row] == limit):
            fine.theta_error[row] = fine.x_error[row] = np.inf
            continue
        arm = max(table.d[row], 0.5 * table.H[row])
        turn = abs(coarse.theta_max[row] - fine.theta_max[row])
        x = max(abs(coarse.x_b_max[row] - fine.x_b_max[row]), abs(coarse.x_v_max[row] - fine.x_v_max[row]))
        x = max(x, arm * turn)
        if fine.status[row] == limit:
            x = max(x, table.v_0[row] * abs(coarse.t_limit[row] - fine.t_limit[row]))
            fine.theta_error[row] = 0.0
        else:
            fine.theta_error[row] = safety * max(turn, min(x / arm, max(fine.theta_max[row], LEAST_ROTATION)))
        x = max(x, abs(coarse.crush_max[row] - fine.crush_max[row]))
        fine.x_error[row] = safety * x


def add_rest_error(coarse: Any, fine: Any, safety: float) -> None:
    """Add the numerical error to the doubt of where boulders come to rest.

    Parameters
    ----------
    coarse, fine
        `OutcomesAtRest` by a step and by a third of it; the error goes into the finer.
    safety
        Factor from the difference of the two to the error.
    """
    differing = np.maximum(abs(coarse.theta_rest - fine.theta_rest), abs(coarse.swing_back - fine.swing_back))
    fine.rest_error[:] += safety * differing


def simulate_table(
    table: DesignTable, readings: Readings, control: Control, springs: SecondSprings | None = None
) -> OutcomeTable:
    """Simulate every design of a table.

    Parameters
    ----------
    table
        Designs, SI, arrays of shape (n,); or a `LayeredTable`, whose designs have no last resort.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit, soil. With ``error_estimate`` every design is simulated with the step and
        with a third of it, and the finer result is reported.
    springs
        Second springs of the vehicles, where they have any; such designs are simulated one by one.

    Returns
    -------
    OutcomeTable
        Arrays of shape (n,), in the order of the designs; `OutcomesAtRest` for plastic soil.
    """
    out = simulate_once(table, readings, control, springs)
    if not control.error_estimate:
        return out
    fine = simulate_once(table, readings, control._replace(refined=True), springs)
    safety = SAFETY if readings.restoring_gravity else SAFETY_PRINTED
    estimate_errors(out, fine, DesignTable(*table[: len(DesignTable._fields)]), safety)
    if control.unloading != ELASTIC:
        add_rest_error(out, fine, safety)
    return fine
