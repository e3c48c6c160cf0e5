"""Tables of designs in, tables of outcomes out."""

from __future__ import annotations

import numpy as np

from ._jit import kernel
from .design import Design, DesignTable, design_at
from .impact import Control, no_record, simulate_design
from .outcomes import Outcome, OutcomeTable, Status
from .readings import Readings


@kernel
def empty_outcomes(n: int) -> OutcomeTable:
    """Return a table for n outcomes, all of them NaN and INVALID until they are written."""
    return OutcomeTable(
        np.full(n, Status.INVALID.value, np.int8),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
    )


@kernel
def write_outcome(out: OutcomeTable, row: int, o: Outcome) -> None:
    """Write one outcome into its row; the error columns are left alone."""
    out.status[row] = o.status
    out.theta_max[row] = o.maxima.theta
    out.x_b_max[row] = o.maxima.x_b
    out.x_v_max[row] = o.maxima.x_v
    out.F_v_max[row] = o.maxima.F_v
    out.t_limit[row] = o.t_limit
    out.t_end[row] = o.t_end


@kernel
def write_error(out: OutcomeTable, row: int, coarse: Outcome, fine: Outcome) -> None:
    """Estimate the numerical error of a row from two solutions, the finer of which is reported.

    The difference of the two is nearly the error of the coarser, many times that of the finer. Where only one of them
    reached the limit of rotation, or failed, there is no estimate that could be trusted: the error is infinite.
    """
    if coarse.status != fine.status and Status.LIMIT.value in (coarse.status, fine.status):
        out.theta_error[row] = np.inf
        out.x_error[row] = np.inf
        return
    a, b = coarse.maxima, fine.maxima
    out.theta_error[row] = abs(a.theta - b.theta)
    out.x_error[row] = max(abs(a.x_b - b.x_b), abs(a.x_v - b.x_v))


@kernel
def simulate_one(design: Design, readings: Readings, control: Control) -> Outcome:
    """Simulate one design without a time history."""
    return simulate_design(design, readings, control, no_record())


@kernel
def simulate_table(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Simulate every design of a table.

    Parameters
    ----------
    table
        Designs, SI, arrays of shape (n,).
    readings
        Which formulas are read as printed.
    control
        Step, horizon, limit, soil. With ``error_estimate`` every design is simulated with the step and
        with half of it, and the finer result is reported.

    Returns
    -------
    OutcomeTable
        Arrays of shape (n,), in the order of the designs.
    """
    n = table.L.size
    out = empty_outcomes(n)
    half = Control(
        0.5 * control.h,
        control.horizon,
        control.theta_limit,
        control.elements,
        control.error_estimate,
        control.stop_at_limit,
    )
    for row in range(n):
        design = design_at(table, row)
        outcome = simulate_one(design, readings, control)
        if control.error_estimate and outcome.maxima.theta >= 0.0:
            fine = simulate_one(design, readings, half)
            write_error(out, row, outcome, fine)
            outcome = fine
        write_outcome(out, row, outcome)
    return out
