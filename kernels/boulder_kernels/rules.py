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
from .control import VALID_ROTATION, Control
from .error_estimates import LEAST_LATE_M
from .outcomes import OutcomeTable, Status

RULES = (
    ("error", ""),  # which has a reason of its own
    ("fail", "no_contact"),
    ("fail", "overturns"),
    ("fail", "penetration"),
    ("fail", "slower_truck"),  # by `fails_slower`: it takes other simulations
    ("undecided", "foot"),
    ("undecided", "shape"),
    ("undecided", "crush"),
    ("undecided", "override"),
    ("undecided", "horizon"),
    ("undecided", "error"),
    ("undecided", "validity"),
    ("pass", ""),
)
"""Verdict and reason of every rule, the worst first."""
NOT_COMPUTED, NO_CONTACT, OVERTURNS, PENETRATION, SLOWER_TRUCK = range(5)
FOOT, SHAPE, CRUSH, OVERRIDE, UNPROVED, NUMERICAL_ERROR, VALIDITY, PASSES = range(5, len(RULES))
"""The rules. A row is standing, computed and not overturned, from PENETRATION on."""


class VerdictLimits(NamedTuple):
    """Limits of the criterion."""

    rotation: float
    """Largest rotation [rad]."""
    penetration: float
    """Largest penetration [m]."""
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
SHALLOW_RATIO, SHALLOW_SLIDE = 0.45, 0.3
"""A boulder with less depth over height that slides by more [m] may stop a truck and be overturned by a slower one,
which does not push it aside as far: among the passes of the realistic ranges every such boulder is one of these."""
SLOWER_SPEEDS = (*(k / 50.0 for k in range(49, 24, -1)), 0.4, 0.3)
"""Speeds of the slower trucks that such a boulder must stop, as fractions of its own: steps of 2 % down to half."""
ISLAND_RATIO, ISLAND_SLIDE = 0.35, 0.5
"""With still less depth over height, and a longer slide [m], the speeds at which it stands can be 1 % wide: finer than
these steps. Such a boulder is not a pass."""
SIZES = ("L", "H", "d", "e_bumper", "bed_offset", "flat_foot", "known_shape")
"""Rows of the array of inputs that it takes; the last two are 1 or 0: whether the foot of the boulder is flat, and
whether what was simulated has its shape."""


@exact_inlined
def limits_in(values: np.ndarray) -> VerdictLimits:
    """Return the limits that an array holds, in the order of `VerdictLimits`."""
    return VerdictLimits(values[0], values[1], values[2])


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
    unproved = status == Status.HORIZON.value or status == Status.OUTWARD.value or status == Status.UNPROVABLE.value
    ratio, slide = sizes[2, row] / sizes[1, row], o.x_b_max[row]
    outside = theta > VALID_ROTATION or (ratio < ISLAND_RATIO and slide > ISLAND_SLIDE)
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
    elif outside:
        rule = VALIDITY
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


@exact_inlined
def is_asked_slower(rule: Any, ratio: Any, slide: Any) -> Any:
    """Whether slower trucks decide a row: one that would pass, shallow, and slides.

    Parameters
    ----------
    rule
        The rule that decides it so far; a number, or an array of shape (n,) as what follows.
    ratio
        Embedment depth over height [-].
    slide
        Largest displacement [m].
    """
    return ((rule == PASSES) | (rule == VALIDITY)) & (ratio < SHALLOW_RATIO) & (slide > SHALLOW_SLIDE)


@exact_inlined
def after_slower(rule: Any, slower: Any) -> Any:
    """Return the rule that decides a row after one more slower truck, itself decided by the rule `slower`.

    A truck that a slower one would fail against fails; where a slower one is undecided, so is the row, for that reason.
    """
    fails = (slower >= NO_CONTACT) & (slower <= SLOWER_TRUCK)
    unknown = slower == NOT_COMPUTED
    reason = fails * SLOWER_TRUCK + unknown * NUMERICAL_ERROR + (1 - fails - unknown) * slower
    return np.minimum(rule, reason)


FLAGS = ("crush", "rotation", "size", "embedment", "rock_density", "soil_pair", "overlap", "slides", "vehicle", "soil")
"""Names of the flags of a row, from the lowest bit of `flags_of` on; `boulder_sweep.judge.validity` says what each
means. They decide no verdict, but a pass with one of `UNSTUDIED` is not graded robust."""
UNSTUDIED = ("size", "embedment", "rock_density", "soil_pair", "vehicle", "soil")
"""Flags of designs outside the ranges from which the study of second opinions draws."""


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
    least_m_v: float
    most_m_v: float
    """Mass of the vehicle [kg]."""
    least_rate: float
    most_rate: float
    """Its angular frequency sqrt(k_v/m_v) [1/s]."""
    least_damping: float
    most_damping: float
    """Its damper over sqrt(k_v m_v) [-]."""
    least_v_0: float
    most_v_0: float
    """Its speed [m/s]."""
    least_phi_deg: float
    most_phi_deg: float
    """Friction angle [deg]."""
    least_rho_s: float
    most_rho_s: float
    """Density of the soil [kg/m^3]."""
    least_K_epsilon: float
    most_K_epsilon: float
    """Strain rate factor [-]."""


class FlagInputs(NamedTuple):
    """What the flags of a row depend on; numbers of one row, or arrays."""

    slide: Any
    """Largest displacement [m]."""
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
    m_v: Any
    v_0: Any
    k_v: Any
    c_v: Any
    """Mass, speed, spring and damper of the vehicle, SI."""
    phi_deg: Any
    rho_s: Any
    K_epsilon: Any
    """Friction angle [deg], density [kg/m^3] and strain rate factor of the soil, as they were given."""


@exact_inlined
def flags_of(r: FlagInputs, t: Tested) -> Any:
    """Flags of a row, bits of a whole number in the order of `FLAGS`."""
    length, width, height, ratio = r.L, r.W, r.H, r.d / r.H
    size = (length < t.least_L) | (length > t.most_L) | (width < t.least_W) | (width > t.most_W)
    size = size | (height < t.least_H) | (height > t.most_H)
    rate, damping = np.sqrt(r.k_v / r.m_v), r.c_v / np.sqrt(r.k_v * r.m_v)
    vehicle = (r.m_v < t.least_m_v) | (r.m_v > t.most_m_v) | (r.v_0 < t.least_v_0) | (r.v_0 > t.most_v_0)
    vehicle = vehicle | (rate < t.least_rate) | (rate > t.most_rate)
    vehicle = vehicle | (damping < t.least_damping) | (damping > t.most_damping)
    soil = (r.phi_deg < t.least_phi_deg) | (r.phi_deg > t.most_phi_deg)
    soil = soil | (r.rho_s < t.least_rho_s) | (r.rho_s > t.most_rho_s)
    soil = soil | (r.K_epsilon < t.least_K_epsilon) | (r.K_epsilon > t.most_K_epsilon)
    return (
        1 * (r.crush > t.crush)
        + 2 * (r.theta > t.rotation)
        + 4 * size
        + 8 * ((ratio < t.least_ratio) | (ratio > t.most_ratio))
        + 16 * ((r.rock < t.least_rock) | (r.rock > t.most_rock))
        + 32 * ((r.beta < r.least_beta) | (r.beta > r.most_beta))
        + 64 * (r.overlap < t.overlap)
        + 128 * (r.slide > ISLAND_SLIDE)
        + 256 * vehicle
        + 512 * soil
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
    """Return how many others must agree with a late row before it passes, with or without `VALIDITY`, or fails.

    One is enough for how far the truck gets: nothing amplifies its error. `AGREEING` must for what rocking decides.
    Never where errors are not confirmed, as by ``fast``.
    """
    late = control.error_estimate & (t_end > control.horizon)
    rocking = (rule == PASSES) | (rule == VALIDITY) | (rule == OVERTURNS)
    return late * (AGREEING * rocking + (rule == PENETRATION))


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
