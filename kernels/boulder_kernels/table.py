"""Tables of designs in, tables of outcomes out."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._jit import array_kernel, kernel
from .design import DesignTable, design_at, design_in
from .impact import Control, Record, no_record, simulate_design, simulate_layered, simulate_on_springs
from .lanes import simulate_lanes
from .last_resort import last_resort_on_springs, simulate_last_resort
from .layered import LayeredTable, empty_soil
from .memory import ELASTIC
from .outcomes import Outcome, OutcomeTable, Status, empty_outcomes, write_outcome
from .plastic import add_rest_error, simulate_plastic_rows
from .readings import Readings
from .second_spring import SecondSpring, SecondSprings

SAFETY = 1.5
"""Factor from the difference of two solutions to the error that is reported: it makes the estimate hold for 99 % and
more of all designs, and for those that are not stopped at the limit of rotation alone."""
SAFETY_PRINTED = 5.0
"""The same where the restoring moment is read as printed: two of its jumps can come and go within a step of either
solution, and both then miss them alike."""
LEAST_ROTATION = 1e-4
"""Rotation that an error of the truck may stand for even where the boulder turns less [rad]."""


@array_kernel
def simulate_rows(designs: np.ndarray, readings: Readings, control: Control) -> np.ndarray:
    """Simulate designs one by one, with any representation of the soil; arguments: see `simulate_lanes`."""
    out = empty_outcomes(designs.shape[1])
    for row in range(designs.shape[1]):
        write_outcome(out, row, simulate_design(design_in(designs, row), readings, control, no_record()))
    return out


@array_kernel
def simulate_rows_last_resort(designs: np.ndarray, readings: Readings, control: Control) -> np.ndarray:
    """The same for designs that need more steps than are allowed, see `boulder_kernels.last_resort`."""
    out = empty_outcomes(designs.shape[1])
    for row in range(designs.shape[1]):
        write_outcome(out, row, simulate_last_resort(design_in(designs, row), readings, control, no_record()))
    return out


@array_kernel
def simulate_rows_on_springs(
    designs: np.ndarray, springs: np.ndarray, readings: Readings, control: Control
) -> np.ndarray:
    """Simulate designs one by one, whose vehicles have a second spring: rows of `springs` as of `SecondSprings`."""
    out = empty_outcomes(designs.shape[1])
    for row in range(designs.shape[1]):
        design, second = design_in(designs, row), SecondSpring(springs[0, row], springs[1, row])
        if control.last_resort:
            found = last_resort_on_springs(design, readings, control, no_record(), second)
        else:
            found = simulate_on_springs(design, readings, control, no_record(), second)
        write_outcome(out, row, found)
    return out


@array_kernel
def simulate_layered_rows(
    designs: np.ndarray,
    layers: np.ndarray,
    soil: Any,
    springs: np.ndarray | None,
    readings: Readings,
    control: Control,
) -> np.ndarray:
    """Simulate designs in soils of layers one by one.

    Parameters
    ----------
    designs
        As of `simulate_lanes`.
    layers
        Layers of every design, shape (n, M, 6), see `boulder_kernels.layered`.
    soil
        Elements or layers that every design fills anew.
    springs
        Rows as of `SecondSprings`, or None for vehicles without a second spring.
    readings, control
        As of `simulate_table`.
    """
    out = empty_outcomes(designs.shape[1])
    for row in range(designs.shape[1]):
        design = design_in(designs, row)
        if springs is None:
            found = simulate_layered(design, layers[row], soil, readings, control, no_record(), None)
        else:
            second = SecondSpring(springs[0, row], springs[1, row])
            found = simulate_layered(design, layers[row], soil, readings, control, no_record(), second)
        write_outcome(out, row, found)
    return out


def simulate_row(
    table: DesignTable,
    row: int,
    readings: Readings,
    control: Control,
    record: Record,
    second: SecondSpring | None = None,
) -> Outcome:
    """Simulate one row of a table with its time history; arguments: see `simulate_table` and `simulate_design`."""
    design = design_at(table, row)
    if isinstance(table, LayeredTable):
        layers = table.layers[row]
        soil = empty_soil(len(layers), control.elements)
        return simulate_layered(design, layers, soil, readings, control, record, second)
    if second is not None:
        return simulate_on_springs(design, readings, control, record, second)
    return simulate_design(design, readings, control, record)


def simulate_once(
    table: DesignTable, readings: Readings, control: Control, springs: SecondSprings | None = None
) -> OutcomeTable:
    """Simulate every design of a table once: in lanes where they can be, else one by one."""
    if control.unloading != ELASTIC:
        return simulate_plastic_rows(table, readings, control, springs)
    if isinstance(table, LayeredTable):
        soil = empty_soil(table.layers.shape[1], control.elements)
        stacked = None if springs is None else np.stack(springs)
        out = simulate_layered_rows(np.stack(table[:-1]), table.layers, soil, stacked, readings, control)
        return OutcomeTable(out[0].astype(np.int8), *out[1:])
    if springs is not None:
        out = simulate_rows_on_springs(np.stack(table), np.stack(springs), readings, control)
        return OutcomeTable(out[0].astype(np.int8), *out[1:])
    simulate = simulate_lanes if control.elements == 0 and control.stop_at_limit else simulate_rows
    if control.last_resort:
        simulate = simulate_rows_last_resort
    out = simulate(np.stack(table), readings, control)
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
        Arrays of shape (n,), in the order of the designs; `OutcomesAtRest` for soil that remembers.
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
