"""Which rule decides a row, which flags it has, and whether another solution has to decide it: for tables and pages.

The rules are in order, the worst first; the first that applies decides the row. `boulder_sweep.judge.verdict` says what
each means, `boulder_sweep.judge.validity` what the flags mean, and `boulder_sweep.judge.refinement` which rows are
simulated again, and why. What tells flags and such rows takes arrays of shape (n,) in a table, which calls it as plain
Python, and numbers of one row in the page of a report, into which it is compiled.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel
from .control import Control
from .error_estimates import LEAST_LATE_M
from .outcomes import OutcomeTable, Status
from .plastic import is_plastic

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
    # Where only one of two solutions overturns, or no others confirm a late row, the error is infinite, and nothing is
    # decided.
    known = not np.isinf(o.theta_error[row])
    reached = status == Status.LIMIT.value or theta >= limits.rotation
    unsure = limits.rotation - theta < o.theta_error[row] or min(room, bed_offset - crush) < o.x_error[row]
    if status == Status.NO_CONTACT.value:
        rule = NO_CONTACT
    elif not (is_simulated(status) and finite):
        rule = NOT_COMPUTED
    elif reached and known:
        rule = OVERTURNS
    elif penetration > limits.penetration and known:
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


@exact_inlined
def put_ruling(ruling: Ruling, out: np.ndarray, row: int) -> None:
    """Write what the rules make of one row into a column of an array, see `RULINGS`."""
    out[0, row] = ruling.rule
    out[1, row] = ruling.overlap
    out[2, row] = ruling.penetration
    out[3, row] = ruling.margin


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
        put_ruling(ruling_of(o, sizes, row, limits), out, row)


FLAGS = ("crush", "rotation", "size", "embedment", "rock_density", "soil_pair", "overlap", "unproved")
"""Names of the flags of a row, from the lowest bit of `flags_of` on; `boulder_sweep.judge.validity` says what each
means. They decide nothing."""


class Tested(NamedTuple):
    """What the model was tested on, and what is usual."""

    crush: float
    """Largest crush [m]."""
    rotation: float
    """Largest rotation [rad]."""
    overlap: float
    """Least overlap of boulder and bumper [m]."""
    least_L: float
    most_L: float
    least_W: float
    most_W: float
    least_H: float
    most_H: float
    """Sides of a boulder [m]."""
    least_ratio: float
    most_ratio: float
    """Depth over height [-]."""
    least_rock: float
    most_rock: float
    """Density of rock [kg/m^3]."""


class FlagInputs(NamedTuple):
    """What the flags of a row depend on; numbers of one row, or arrays."""

    status: Any
    crush: Any
    """Largest crush [m]."""
    theta: Any
    """Largest rotation [rad]."""
    overlap: Any
    """As of `Ruling` [m]."""
    L: Any
    W: Any
    H: Any
    """Sides of the boulder [m]."""
    d: Any
    """Embedment depth [m]."""
    rock: Any
    """Density of its rock [kg/m^3]."""
    beta: Any
    least_beta: Any
    most_beta: Any
    """Constant of subgrade reaction, and between which the friction angle has it [MN/m^3]."""


@exact_inlined
def flags_of(r: FlagInputs, t: Tested) -> Any:
    """Flags of a row, bits of a whole number in the order of `FLAGS`."""
    length, width, height, ratio = r.L, r.W, r.H, r.d / r.H
    size = (length < t.least_L) | (length > t.most_L) | (width < t.least_W) | (width > t.most_W)
    size = size | (height < t.least_H) | (height > t.most_H)
    return (
        1 * (r.crush > t.crush)
        + 2 * (r.theta > t.rotation)
        + 4 * size
        + 8 * ((ratio < t.least_ratio) | (ratio > t.most_ratio))
        + 16 * ((r.rock < t.least_rock) | (r.rock > t.most_rock))
        + 32 * ((r.beta < r.least_beta) | (r.beta > r.most_beta))
        + 64 * (r.overlap < t.overlap)
        + 128 * (r.status == Status.UNPROVABLE.value)
    )


FIRST_FACTOR = 0.5
"""A solution confirms another only if its steps are shorter by this factor."""
AGREEING = 2
"""Finer solutions that confirm a late row. Among 30,000 shallow boulders one was enough for all but two
(`benchmarks.late`): one step missed that a moment for an instant exceeds what holds the boulder, and one estimate was
so large that everything agreed with it."""
SAME_ANGLE, SAME_WAY = 1e-6, LEAST_LATE_M
"""Solutions of a late row agree if what they reach differs by no more than the error estimated for the coarser, or by
less than this [rad], [m]: with the shortest steps the estimate falls below the rounding that late motion amplifies."""


class Confirmation(NamedTuple):
    """How far a row is decided while it is simulated again by finer steps; numbers of one row, or arrays."""

    unconfirmed: Any
    """Number of further solutions that must agree with what counts so far."""
    compared_s: Any
    """Step of the last solution compared or taken over [s]."""
    given_up: Any
    """Whether the last resort has refused it."""


@exact_inlined
def confirmations(rule: Any, t_end: Any, control: Control) -> Any:
    """Return how many other solutions must agree with a late row before it passes or fails; 0 of other rows.

    One is enough for how far the truck gets: nothing amplifies its error. `AGREEING` must for what rocking decides.
    Never where errors are not confirmed, as by ``fast``. Nor in plastic soil, where every motion goes on until it
    rests, and loses its energy to the soil instead of rocking.
    """
    counted = control.error_estimate and not is_plastic(control.unloading)
    late = counted & (t_end > control.horizon)
    return late * (AGREEING * ((rule == PASSES) | (rule == OVERTURNS)) + (rule == PENETRATION))


@exact_inlined
def is_wanted(row: Confirmation, rule: Any, status: Any, control: Control) -> Any:
    """Whether a solution by a control may decide or confirm a row.

    Where errors are not confirmed, as by ``fast``, rows nearer to a limit than their error stay undecided.
    """
    refused = (status >= Status.UNSTABLE.value) & (status <= Status.LITTLE_INERTIA.value)
    refused = refused & (status != Status.INVALID.value)
    asks = control.error_estimate and not control.last_resort
    may_decide = (refused | (asks & (rule == NUMERICAL_ERROR))) & np.logical_not(row.given_up)
    # The last resort begins with longer steps than the usual ones end with.
    is_finer = control.h <= FIRST_FACTOR * row.compared_s
    return may_decide | ((row.unconfirmed > 0) & is_finer)


@exact_inlined
def agree(coarse: OutcomeTable, fine: OutcomeTable, v_0: Any) -> Any:
    """Whether two solutions of a row end alike.

    Parameters
    ----------
    coarse, fine
        Solutions whose steps differ by a factor of two or more, each with its estimated errors; tables, or the numbers
        of one row.
    v_0
        Speed of impact [m/s]: an error of the displacement is one of the time, too, see
        `boulder_kernels.error_estimates.estimate_errors`.
    """
    way = np.maximum(coarse.x_error, SAME_WAY)
    limit = coarse.status == Status.LIMIT.value
    alike = limit == (fine.status == Status.LIMIT.value)
    in_time = v_0 * np.abs(coarse.t_limit - fine.t_limit) <= way
    in_angle = np.abs(coarse.theta_max - fine.theta_max) <= np.maximum(coarse.theta_error, SAME_ANGLE)
    in_place = (np.abs(coarse.x_b_max - fine.x_b_max) <= way) & (np.abs(coarse.x_v_max - fine.x_v_max) <= way)
    stands_alike = np.logical_not(limit) & in_angle & in_place
    return alike & np.isfinite(fine.x_error) & ((limit & in_time) | stands_alike)


@exact_inlined
def after_finer(
    row: Confirmation, before: Any, after: Any, alike: Any, needed: Any, control: Control
) -> tuple[Confirmation, Any]:
    """Return how far a row is decided after one more solution, and whether that takes the place of what counts so far.

    Parameters
    ----------
    row
        How far it was decided.
    before, after
        The rule that decides what counts so far, and that of the new solution. One that cannot be computed changes
        nothing, but the last resort is not tried again.
    alike
        Whether the two agree, see `agree`.
    needed, control
        How many others must agree with the new solution, see `confirmations`, and how it was simulated.
    """
    failed = after == NOT_COMPUTED
    same = ((before == PASSES) == (after == PASSES)) & ((before <= PENETRATION) == (after <= PENETRATION))
    confirmed = same & alike & (row.unconfirmed > 0)
    replaces = np.logical_not(failed | confirmed)
    unconfirmed = (row.unconfirmed - confirmed) * np.logical_not(replaces) + needed * replaces
    compared_s = failed * row.compared_s + np.logical_not(failed) * control.h
    return Confirmation(unconfirmed, compared_s, control.last_resort & failed), replaces
