"""Which rule decides a row: the criterion on the maxima of a simulation, for tables and for the page of a report.

The rules are in order, the worst first; the first that applies decides the row. `boulder_sweep.judge.verdict` says what
each means.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel
from .outcomes import OutcomeTable, Status

RULES = (
    ("error", ""),  # which has a reason of its own
    ("fail", "no_contact"),
    ("fail", "overturns"),
    ("fail", "penetration"),
    ("undecided", "foot"),
    ("undecided", "shape"),
    ("undecided", "crush"),
    ("undecided", "override"),
    ("undecided", "horizon"),
    ("undecided", "error"),
    ("pass", ""),
)
"""Verdict and reason of every rule, the worst first."""
NOT_COMPUTED, NO_CONTACT, OVERTURNS, PENETRATION = range(4)
FOOT, SHAPE, CRUSH, OVERRIDE, UNPROVED, NUMERICAL_ERROR, PASSES = range(4, len(RULES))
"""The rules. A row is standing, computed and not overturned, from PENETRATION on."""


class VerdictLimits(NamedTuple):
    """Limits of the criterion."""

    rotation: float
    """Largest rotation [rad]."""
    penetration: float
    """Largest penetration [m]."""
    proved: float
    """1 where a pass must be proved also where the readings allow no proof, else 0."""
    min_overlap_m: float
    """Least overlap of boulder and bumper [m]. It and what follows have the names that they have among the settings."""


class Ruling(NamedTuple):
    """What the rules make of one row; NaN where it was not computed."""

    rule: int
    """The rule that decides it."""
    overlap: float
    """Height of the top of the boulder over the underside of the bumper [m]."""
    penetration: float
    """How far the leading edge of the cargo bed came past the far face of the boulder [m]."""
    margin: float
    """Least (limit - value) / limit of rotation and penetration [-]."""


OF_CRITERION = VerdictLimits._fields[VerdictLimits._fields.index("min_overlap_m") :]
"""Limits that are settings of the criterion as they are."""
RULINGS = Ruling._fields
"""Rows of the array of `write_rulings`."""
SIZES = ("L", "H", "d", "e_bumper", "bed_offset", "flat_foot", "known_shape")
"""Rows of the array of inputs that it takes; the last two are 1 or 0: whether the foot of the boulder is flat, and
whether what was simulated has its shape."""


@exact_inlined
def limits_in(values: np.ndarray) -> VerdictLimits:
    """Return the limits that an array holds, in the order of `VerdictLimits`."""
    return VerdictLimits(values[0], values[1], values[2], values[3])


@exact_inlined
def is_simulated(status: int) -> bool:
    """Whether a simulation ended with maxima to report, `boulder_kernels.outcomes.SIMULATED`."""
    return (
        status == Status.LIMIT.value
        or status == Status.SETTLED.value
        or status == Status.BELOW_LIMIT.value
        or status == Status.UNPROVABLE.value
        or status == Status.HORIZON.value
        or status == Status.OUTWARD.value
    )


@exact_inlined
def ruling_of(o: OutcomeTable, sizes: np.ndarray, row: int, limits: VerdictLimits) -> Ruling:
    """Apply the rules to one row; arguments: see `write_rulings`."""
    status, theta, x_v, crush = o.status[row], o.theta_max[row], o.x_v_max[row], o.crush_max[row]
    bed_offset = sizes[4, row]
    overlap = sizes[1, row] - sizes[2, row] - sizes[3, row]
    penetration = x_v - bed_offset - sizes[0, row]
    room = limits.penetration - penetration
    margin = min((limits.rotation - theta) / limits.rotation, room / limits.penetration)
    finite = (
        np.isfinite(theta)
        and np.isfinite(o.x_b_max[row])
        and np.isfinite(x_v)
        and np.isfinite(o.F_v_max[row])
        and np.isfinite(crush)
        and np.isfinite(o.t_end[row])
    )
    unproved = status == Status.HORIZON.value or status == Status.OUTWARD.value
    unproved = unproved or (limits.proved > 0.0 and status == Status.UNPROVABLE.value)
    # Where only one of two solutions overturns the error is infinite, and nothing is decided.
    reached = (status == Status.LIMIT.value or theta >= limits.rotation) and not np.isinf(o.theta_error[row])
    unsure = limits.rotation - theta < o.theta_error[row] or min(room, bed_offset - crush) < o.x_error[row]
    if status == Status.NO_CONTACT.value:
        rule = NO_CONTACT
    elif not (is_simulated(status) and finite):
        rule = NOT_COMPUTED
    elif reached:
        rule = OVERTURNS
    elif penetration > limits.penetration:
        rule = PENETRATION
    elif sizes[5, row] == 0.0:
        rule = FOOT
    elif sizes[6, row] == 0.0:
        rule = SHAPE
    elif crush > bed_offset:
        rule = CRUSH
    elif overlap < limits.min_overlap_m:
        rule = OVERRIDE
    elif unproved:
        rule = UNPROVED
    elif unsure:
        rule = NUMERICAL_ERROR
    else:
        rule = PASSES
    return Ruling(rule, overlap, penetration, margin)


@exact_kernel
def write_rulings(o: OutcomeTable, sizes: np.ndarray, limits: VerdictLimits, out: np.ndarray) -> None:
    """Apply the rules to n rows.

    Parameters
    ----------
    o
        What the simulations gave, arrays of shape (n,).
    sizes
        Inputs of the same rows, see `SIZES`, shape (len(SIZES), n).
    limits
        Limits of the criterion.
    out
        Where the rulings go, shape (len(RULINGS), n).
    """
    for row in range(out.shape[1]):
        ruling = ruling_of(o, sizes, row, limits)
        out[0, row] = ruling.rule
        out[1, row] = ruling.overlap
        out[2, row] = ruling.penetration
        out[3, row] = ruling.margin
