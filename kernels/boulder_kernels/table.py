"""Tables of designs in, tables of outcomes out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import is_none, kernel, overload, plain
from .control import STEP_RATIO, Control, control_for
from .design import Design, DesignTable, Readings, design_at, design_in
from .error_estimates import safety_of, step_errors, take_seconds
from .following import failed
from .impact import Problem, simulate_alone, simulate_last_resort
from .lanes import simulate_lanes
from .outcomes import (
    COARSER,
    FINER,
    NONE_NEEDED,
    PAIR,
    SECOND,
    STEP,
    T_END,
    Outcome,
    OutcomeTable,
    Status,
    empty_outcomes,
    outcome_table,
    write_outcome,
)
from .pieces import PRESSURE, PiecewiseTable, SoilProfile, given_pieces, lanes_count, pieces_count
from .settling import proof_is_possible
from .soil_laws import empty_soil, profile_of
from .time_history import Record, no_record


@kernel
def take_profile(row: int, soil: Any, layers: np.ndarray, outlines: np.ndarray) -> SoilProfile:
    """Return the soil of one design of a `PiecewiseTable`."""
    return SoilProfile(layers[row], outlines[row], soil)


def profile_in(row: int, soil: Any, layers: np.ndarray | None, outlines: np.ndarray | None) -> SoilProfile | None:
    """Return the soil of one design of a table; None for the uniform soil of a box."""
    return None if layers is None else plain(take_profile)(row, soil, layers, outlines)


@overload(profile_in)
def _profile_in(row: Any, soil: Any, layers: Any, outlines: Any) -> Callable[..., Any]:
    if is_none(layers):
        return lambda row, soil, layers, outlines: None
    return lambda row, soil, layers, outlines: take_profile(row, soil, layers, outlines)


@kernel
def run_rows(
    designs: np.ndarray,
    layers: np.ndarray | None,
    outlines: np.ndarray | None,
    soil: Any,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Simulate designs one by one, in any soil, and return the last outcome.

    Parameters
    ----------
    designs
        Shape (15, n), at least one.
    layers, outlines
        Of `PiecewiseTable`; None for boxes in uniform soils.
    soil
        Elements or pieces that every design fills anew; None for boxes in uniform soils.
    readings
        Which formulas are read as printed.
    control
        How the simulation is run.
    record
        Filled with the time history of one design at the times it names; for several, one that keeps nothing.
    out
        Where the outcomes go, an array of `empty_outcomes`.
    """
    outcome = failed(Status.INVALID.value)
    for row in range(designs.shape[1]):
        profile = profile_in(row, soil, layers, outlines)
        design = design_in(designs, row)
        outcome = simulate_alone(Problem(design, profile), readings, control, record)
        write_outcome(out, row, outcome, step_errors(outcome, design, control.theta_limit, control.horizon))
    return outcome


@kernel
def run_last_resort(
    designs: np.ndarray, readings: Readings, control: Control, record: Record, out: np.ndarray
) -> Outcome:
    """Simulate designs one by one by `simulate_last_resort`, which takes those that need too many steps."""
    outcome = failed(Status.INVALID.value)
    for row in range(designs.shape[1]):
        design = design_in(designs, row)
        outcome = simulate_last_resort(design, readings, control, record)
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


class LaneDesigns(NamedTuple):
    """Designs as lanes take them, arguments of `simulate_lanes`."""

    designs: np.ndarray
    pieces: int = 0
    has_strength: bool = False
    has_outline: bool = False


def given_to_lanes(designs: np.ndarray, layers: np.ndarray | None, outlines: np.ndarray | None) -> LaneDesigns | None:
    """Return designs as lanes take them, or None of those that they do not take.

    Parameters
    ----------
    designs
        Shape (15, n).
    layers, outlines
        Of `PiecewiseTable`; None for boxes in uniform soils.
    """
    if layers is None or outlines is None:
        return LaneDesigns(designs)
    points = outlines.shape[1]
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
    designs: np.ndarray,
    layers: np.ndarray | None,
    outlines: np.ndarray | None,
    soil: Any,
    readings: Readings,
    control: Control,
    record: Record,
    out: np.ndarray,
) -> Outcome:
    """Solve designs once: in lanes where they can be, else one by one; see `run_rows` for arguments and result."""
    given = given_to_lanes(designs, layers, outlines) if control.side_by_side and control.elements == 0 else None
    if control.last_resort and control.stop_at_limit and layers is None:
        return run_last_resort(designs, readings, control, record, out)
    if given is not None and (control.stop_at_limit or designs.shape[1] == 1):
        return simulate_lanes(*given, readings, control, record, out)
    return run_rows(designs, layers, outlines, soil, readings, control, record, out)


def solve(table: DesignTable, readings: Readings, control: Control) -> tuple[np.ndarray, np.ndarray]:
    """Solve every design of a table once.

    Returns
    -------
    out : ndarray, shape (11, n)
        Rows in the order of `OutcomeTable`, with the errors of the steps of one solution.
    second : ndarray, shape (n,)
        Which second solution each of them needs, see `boulder_kernels.outcomes.StepErrors`.
    """
    n = len(table.L)
    layers: np.ndarray | None = getattr(table, "layers", None)
    outlines: np.ndarray | None = getattr(table, "outlines", None)
    out = empty_outcomes(n)
    if n:
        soil = None
        if layers is not None and outlines is not None:
            soil = empty_soil(layers.shape[1], outlines.shape[1], control.elements)
        designs = np.stack(table[: len(DesignTable._fields)])
        solve_rows(designs, layers, outlines, soil, readings, control, no_record(), out)
    second = out[SECOND].copy()
    out[STEP] = np.where(np.isnan(out[T_END]), np.nan, step_of_solution(control))
    return out, second


def simulate(problem: Problem, readings: Readings, control: Control, record: Record) -> Outcome:
    """Simulate one impact: a table of one design, by the very code that computes larger ones.

    Parameters
    ----------
    problem
        Design and soil.
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit, representation of the soil; nothing is estimated of errors.
    record
        Filled with the time history at the times it names.

    Returns
    -------
    Outcome
        Maxima from the dense output; NaN where the status says that there is no result, see `Status`.
    """
    designs = np.array(problem.design, dtype=float)[:, None]
    if problem.profile is None:
        return solve_rows(designs, None, None, None, readings, control, record, empty_outcomes(1))
    layers, outline, soil = problem.profile
    return solve_rows(designs, layers[None], outline[None], soil, readings, control, record, empty_outcomes(1))


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
        Step, horizon, limit, soil. Every outcome has the error of its steps (`boulder_kernels.error_estimates`). With
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
        designs = np.stack(some[: len(DesignTable._fields)])
        take_seconds(out, rows, found, needed, designs, plain(safety_of)(readings))
    return outcome_table(out)
