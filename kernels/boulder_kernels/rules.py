"""Which rule decides a row, which flags it has, and whether another solution has to decide it: for tables and pages.

The rules are in order, the worst first; the first that applies decides the row. docs/model.md says what each means, and
`boulder_sweep.judge.validity` what the flags mean. Every function here answers one question about one row; `consider`
puts them together, and is called after each solution of a row.

**Finer steps** decide rows that were refused for their time steps or are undecided for their error, and confirm late
ones. A row is *late* if its motion goes on past the horizon. A shallow boulder may rock for seconds, and rocking
amplifies every error: both solutions from which the error is estimated can follow the same wrong branch, where the
estimate does not see it. So a late row passes or overturns only if `AGREEING` others agree with it, and fails by how
far the truck gets only if one does, each with steps at most half as long as those before over the whole motion; until
they do it is simulated again by finer steps, and is undecided where even the finest differ.

What is still refused by the finest steps is simulated by `boulder_kernels.impact.simulate_last_resort`, whose late rows
need finer solutions of the same kind.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel
from .control import VALID_ROTATION, Control, control_in
from .outcomes import LEAST_LATE_M, SIMULATED, THETA_ERROR, X_ERROR, OutcomeTable, Status, copy_outcome, outcome_in

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
    """Largest rotation that passes [rad]."""
    penetration: float
    """Largest penetration that passes [m]."""
    guarded: float
    """1 where a row nearer to a limit than its error is undecided, or 0."""
    min_overlap_m: float
    """Least overlap of boulder and bumper [m]. It and what follows have the names that they have among the settings."""


class Sizes(NamedTuple):
    """Inputs of a row that the rules take."""

    L: float
    """Distance from where the vehicle strikes the boulder to its far face [m]."""
    H: float
    """Height of the boulder [m]."""
    d: float
    """Embedment depth of the boulder [m]."""
    e_bumper: float
    """Height of the underside of the bumper [m]."""
    bed_offset: float
    """Distance from the front bumper to the leading edge of the cargo bed [m]."""
    v_0: float
    """Speed of impact [m/s]."""
    flat_foot: float
    """1 or 0: whether the foot of the boulder is flat."""
    known_shape: float
    """1 or 0: whether the simulated boulder has its shape."""


class Course(NamedTuple):
    """What the rules make of one row, and how far it is decided while it is solved again by finer steps."""

    rule: float
    """The rule that decides it by the solution that counts so far."""
    overlap: float
    """Height of the top of the boulder over the underside of the bumper [m]."""
    penetration: float
    """How far the leading edge of the cargo bed came past the far face of the boulder [m]; NaN where not computed."""
    margin: float
    """Least (limit - value) / limit of rotation and penetration [-]; NaN where not computed."""
    decided_by: float
    """Number of the control by which it was solved."""
    unconfirmed: float
    """Number of further solutions that must agree with it."""
    compared_s: float
    """Step of the last solution compared or taken over [s]."""
    given_up: float
    """1 where the last resort has refused it, or 0."""
    wanted: float
    """Number of the control by which it is to be solved next; where it is decided, how many there are."""
    asked_slower: float
    """1 where slower trucks decide it, too, or 0."""


OF_CRITERION = VerdictLimits._fields[VerdictLimits._fields.index("min_overlap_m") :]
"""Limits that are settings of the criterion as they are."""
SHALLOW_RATIO, SHALLOW_SLIDE = 0.45, 0.3
"""A boulder with less depth over height that slides by more [m] may stop a truck and be overturned by a slower one,
which does not push it aside as far: among the passes of the realistic ranges every such boulder is one of these."""
SLOWER_SPEEDS = (*(k / 50.0 for k in range(49, 24, -1)), 0.4, 0.3)
"""Speeds of the slower trucks that such a boulder must stop, as fractions of its own: steps of 2 % down to half."""
ISLAND_RATIO, ISLAND_SLIDE = 0.35, 0.5
"""With still less depth over height, and a longer slide [m], the speeds at which it stands can be 1 % wide: finer than
these steps. Such a boulder is not a pass."""


ENDS = tuple(status.value for status in SIMULATED)


@exact_inlined
def is_simulated(status: int) -> bool:
    """Whether a simulation ended with maxima to report, `boulder_kernels.outcomes.SIMULATED`."""
    return status in ENDS


@exact_kernel
def is_known(o: OutcomeTable) -> bool:
    """Whether a solution of a row has all that is reported of it."""
    finite = np.isfinite(o.theta_max) and np.isfinite(o.x_b_max) and np.isfinite(o.x_v_max)
    finite = finite and np.isfinite(o.F_v_max) and np.isfinite(o.crush_max) and np.isfinite(o.t_end)
    return is_simulated(o.status) and finite


@exact_inlined
def penetration_of(o: OutcomeTable, sizes: Sizes) -> float:
    """How far the leading edge of the cargo bed comes past the far face of the boulder [m]."""
    return o.x_v_max - sizes.bed_offset - sizes.L


@exact_inlined
def overlap_of(sizes: Sizes) -> float:
    """Height of the top of the boulder over the underside of the bumper [m]."""
    return sizes.H - sizes.d - sizes.e_bumper


@exact_inlined
def margin_of(o: OutcomeTable, sizes: Sizes, limits: VerdictLimits) -> float:
    """Least (limit - value) / limit of rotation and penetration [-]."""
    room = limits.penetration - penetration_of(o, sizes)
    return min((limits.rotation - o.theta_max) / limits.rotation, room / limits.penetration)


@exact_kernel
def rule_of(o: OutcomeTable, sizes: Sizes, limits: VerdictLimits) -> int:
    """Return the rule that decides a row.

    ``o``: a solution of it, numbers in place of columns; ``sizes, limits``: its inputs, and the limits of the
    criterion.
    """
    penetration = penetration_of(o, sizes)
    if o.status == Status.NO_CONTACT.value:
        return NO_CONTACT
    if not is_known(o):
        return NOT_COMPUTED
    # Where only one of two solutions overturns, or no others confirm a late row, the error is infinite, and nothing is
    # decided.
    if not (limits.guarded > 0.0 and np.isinf(o.theta_error)):
        if o.status == Status.LIMIT.value or o.theta_max >= limits.rotation:
            return OVERTURNS
        if penetration > limits.penetration:
            return PENETRATION
    if sizes.flat_foot == 0.0:
        return FOOT
    if sizes.known_shape == 0.0:
        return SHAPE
    if o.crush_max > sizes.bed_offset:
        return CRUSH
    if overlap_of(sizes) < limits.min_overlap_m:
        return OVERRIDE
    if o.status == Status.HORIZON.value or o.status == Status.OUTWARD.value or o.status == Status.UNPROVABLE.value:
        return UNPROVED
    room = min(limits.penetration - penetration, sizes.bed_offset - o.crush_max)
    if limits.guarded > 0.0 and (limits.rotation - o.theta_max < o.theta_error or room < o.x_error):
        return NUMERICAL_ERROR
    if o.theta_max > VALID_ROTATION or (sizes.d / sizes.H < ISLAND_RATIO and o.x_b_max > ISLAND_SLIDE):
        return VALIDITY
    return PASSES


@exact_inlined
def is_asked_slower(rule: int, o: OutcomeTable, sizes: Sizes) -> bool:
    """Whether slower trucks decide a row, too: one that would pass, shallow, and slides."""
    shallow, slides = sizes.d / sizes.H < SHALLOW_RATIO, o.x_b_max > SHALLOW_SLIDE
    return (rule == PASSES or rule == VALIDITY) and shallow and slides


@exact_inlined
def rule_by_slower(slower: int) -> int:
    """Return the worst rule that may decide a row of which a slower truck is decided by the rule `slower`.

    A truck that a slower one would fail against fails; where a slower one is undecided, so is the row, for that reason.
    """
    if slower == NOT_COMPUTED:
        return NUMERICAL_ERROR
    return SLOWER_TRUCK if slower <= SLOWER_TRUCK else slower


FLAGS = ("crush", "rotation", "size", "embedment", "rock_density", "soil_pair", "overlap", "slides", "vehicle", "soil")
"""Names of the flags of a row, from the lowest bit of `flags_of` on; `boulder_sweep.judge.validity` says what each
means. They decide no verdict, but a pass with one of `UNSTUDIED` is not graded robust."""
UNSTUDIED = ("size", "embedment", "rock_density", "soil_pair", "vehicle", "soil")
"""Flags of designs outside the ranges from which the study of second opinions draws."""


class FlagRange(NamedTuple):
    """Least or largest values without a flag."""

    L: float
    W: float
    H: float
    """Sides of a boulder [m]."""
    ratio: float
    """Depth over height [-]."""
    rock: float
    """Density of rock [kg/m^3]."""
    m_v: float
    """Mass of the vehicle [kg]."""
    rate: float
    """Angular frequency sqrt(k_v/m_v) of the vehicle [1/s]."""
    damping: float
    """Damper of the vehicle over sqrt(k_v m_v) [-]."""
    v_0: float
    """Speed of the vehicle [m/s]."""
    phi_deg: float
    """Friction angle of the soil [deg]."""
    rho_s: float
    """Density of the soil [kg/m^3]."""
    K_epsilon: float
    """Strain rate factor [-]."""


class TestedRange(NamedTuple):
    """What the model was tested on, and what is usual."""

    crush: float
    """Largest crush without a flag [m]."""
    rotation: float
    """Largest rotation without a flag [rad]."""
    overlap: float
    """Least overlap of boulder and bumper [m]."""
    least: FlagRange
    most: FlagRange


class FlagInputs(NamedTuple):
    """Inputs of a row that its flags depend on."""

    L: float
    W: float
    H: float
    """Sides of the boulder [m]."""
    d: float
    """Embedment depth of the boulder [m]."""
    rock: float
    """Density of its rock [kg/m^3]."""
    beta: float
    least_beta: float
    most_beta: float
    """Constant of subgrade reaction, and between which the friction angle has it [MN/m^3]."""
    m_v: float
    v_0: float
    k_v: float
    c_v: float
    """Mass, speed, spring and damper of the vehicle, SI."""
    phi_deg: float
    rho_s: float
    K_epsilon: float
    """Friction angle [deg], density [kg/m^3] and strain rate factor of the soil, as they were given."""


@exact_inlined
def is_outside(value: float, least: float, most: float) -> bool:
    """Whether a value lies outside a range."""
    return value < least or value > most


@exact_inlined
def flags_of(o: OutcomeTable, overlap: float, r: FlagInputs, t: TestedRange) -> int:
    """Flags of a row, bits of a whole number in the order of `FLAGS`.

    ``o, overlap``: what counts of it, numbers in place of columns, and its overlap [m]; ``r, t``: its inputs, and what
    the model was tested on.
    """
    least, most = t.least, t.most
    rate, damping = np.sqrt(r.k_v / r.m_v), r.c_v / np.sqrt(r.k_v * r.m_v)
    flags = 0
    if o.crush_max > t.crush:
        flags |= 1
    if o.theta_max > t.rotation:
        flags |= 2
    sides = is_outside(r.L, least.L, most.L) or is_outside(r.W, least.W, most.W)
    if sides or is_outside(r.H, least.H, most.H):
        flags |= 4
    if is_outside(r.d / r.H, least.ratio, most.ratio):
        flags |= 8
    if is_outside(r.rock, least.rock, most.rock):
        flags |= 16
    if is_outside(r.beta, r.least_beta, r.most_beta):
        flags |= 32
    if overlap < t.overlap:
        flags |= 64
    if o.x_b_max > ISLAND_SLIDE:
        flags |= 128
    vehicle = is_outside(r.m_v, least.m_v, most.m_v) or is_outside(r.v_0, least.v_0, most.v_0)
    if vehicle or is_outside(rate, least.rate, most.rate) or is_outside(damping, least.damping, most.damping):
        flags |= 256
    soil = is_outside(r.phi_deg, least.phi_deg, most.phi_deg) or is_outside(r.rho_s, least.rho_s, most.rho_s)
    if soil or is_outside(r.K_epsilon, least.K_epsilon, most.K_epsilon):
        flags |= 512
    return flags


@exact_kernel
def write_flags(
    counted: np.ndarray, overlap: np.ndarray, inputs: np.ndarray, tested: TestedRange, out: np.ndarray
) -> None:
    """Raise the flags of n rows.

    ``counted, overlap``: the solutions that count, shape (11, n), and the overlap with the bumper, shape (n,) [m];
    ``inputs``: records of `FlagInputs`, shape (n,); ``tested``: what the model was tested on; ``out``: where the flags
    go, whole numbers, shape (n,).
    """
    for row in range(out.size):
        out[row] = flags_of(outcome_in(counted, row), overlap[row], inputs[row], tested)


FIRST_FACTOR = 0.5
"""A solution confirms another only if its steps are shorter by this factor."""
AGREEING = 2
"""Finer solutions that confirm a late row. By an independent integration of 30,000 shallow boulders one was
enough for all but two: one step missed that a moment for an instant exceeds what holds the boulder, and one estimate
was so large that everything agreed with it."""
SAME_ANGLE, SAME_WAY = 1e-6, LEAST_LATE_M
"""Solutions of a late row agree if what they reach differs by no more than the error estimated for the coarser, or by
less than this [rad], [m]: with the shortest steps the estimate falls below the rounding that late motion amplifies."""


@exact_inlined
def confirmations(rule: int, t_end: float, control: Control) -> int:
    """Return how many others must agree with a solution of a row before it passes or fails.

    `AGREEING` must for what rocking decides, passes with or without `VALIDITY` among it. One is enough for how far the
    truck gets: nothing amplifies its error. None where the row is not late, nor where errors are not confirmed, as by
    ``fast``.
    """
    if not (control.error_estimate and t_end > control.horizon):
        return 0
    if rule == PASSES or rule == VALIDITY or rule == OVERTURNS:
        return AGREEING
    return 1 if rule == PENETRATION else 0


@exact_inlined
def is_wanted(row: Course, status: int, control: Control) -> bool:
    """Whether a solution by a control may decide or confirm a row.

    Where errors are not confirmed, as by ``fast``, rows nearer to a limit than their error stay undecided.
    """
    if row.given_up == 0.0:
        refused = Status.UNSTABLE.value <= status <= Status.LITTLE_INERTIA.value and status != Status.INVALID.value
        unsure = row.rule == NUMERICAL_ERROR and control.error_estimate and not control.last_resort
        if refused or unsure:
            return True
    # The last resort begins with longer steps than the usual ones end with.
    return row.unconfirmed > 0.0 and control.h <= FIRST_FACTOR * row.compared_s


@exact_kernel
def agree(coarse: OutcomeTable, fine: OutcomeTable, v_0: float) -> bool:
    """Whether two solutions of a row end alike.

    ``coarse, fine``: solutions whose steps differ by a factor of two or more, each with its estimated errors; numbers
    in place of columns; ``v_0``: speed of impact [m/s]: an error of the displacement is one of the time, too, see
    `boulder_kernels.outcomes.estimate_error`.
    """
    limit = coarse.status == Status.LIMIT.value
    if limit != (fine.status == Status.LIMIT.value) or not np.isfinite(fine.x_error):
        return False
    way = max(coarse.x_error, SAME_WAY)
    if limit:
        return v_0 * abs(coarse.t_limit - fine.t_limit) <= way
    in_place = abs(coarse.x_b_max - fine.x_b_max) <= way and abs(coarse.x_v_max - fine.x_v_max) <= way
    return in_place and abs(coarse.theta_max - fine.theta_max) <= max(coarse.theta_error, SAME_ANGLE)


@exact_inlined
def confirms(row: Course, rule: int, counted: OutcomeTable, found: OutcomeTable, v_0: float) -> bool:
    """Whether a finer solution of a row, by which `rule` decides it, confirms the one that counts so far."""
    same = (row.rule == PASSES) == (rule == PASSES) and (row.rule <= PENETRATION) == (rule <= PENETRATION)
    return row.unconfirmed > 0.0 and same and agree(counted, found, v_0)


class Rows(NamedTuple):
    """Many rows on their way to a verdict."""

    counted: np.ndarray
    """The solutions that count so far, shape (11, n), see `boulder_kernels.outcomes.empty_outcomes`."""
    courses: np.ndarray
    """How far they are decided, records of `Course`, shape (n,)."""
    sizes: np.ndarray
    """Their inputs, records of `Sizes`, shape (n,)."""


@exact_inlined
def next_wanted(row: Course, status: int, number: int, controls: np.ndarray) -> int:
    """Return the number of the first control from one on by which a row is to be solved; how many there are if none."""
    while number < len(controls) and not is_wanted(row, status, control_in(controls[number])):
        number += 1
    return number


@exact_kernel
def consider(
    rows: Rows, row: int, found: np.ndarray, at: int, number: int, controls: np.ndarray, limits: VerdictLimits
) -> None:
    """Take one more solution of a row into account: it confirms what counts so far, or takes its place.

    ``rows, row``: the rows, and the number of the one that was solved. Its course says which solution it needs next;
    ``found, at``: the solution, in an array of `boulder_kernels.outcomes.empty_outcomes`. One that cannot be computed
    changes nothing but the first time; the last resort is not tried again; ``number, controls``: by which control it
    was solved, and all that there are, shape (count, 13), see `control_in`: each finer than the one before. A row is
    decided where no further one is wanted; it has an unknown error where there are not enough of them to confirm it;
    ``limits``: limits of the criterion.
    """
    sizes, control, solution = rows.sizes[row], control_in(controls[number]), outcome_in(found, at)
    course, counted = rows.courses[row], outcome_in(rows.counted, row)
    rule = float(rule_of(solution, sizes, limits))
    failed = number > 0 and rule == NOT_COMPUTED
    if failed:
        solution, rule = counted, course.rule
    elif number > 0 and confirms(course, rule, counted, solution, sizes.v_0):
        solution, rule = counted, course.rule
        course.unconfirmed = course.unconfirmed - 1.0
    else:
        copy_outcome(found, at, rows.counted, row)
        course.decided_by = float(number)
        course.unconfirmed = float(confirmations(rule, solution.t_end, control))
    if not failed:
        course.compared_s = control.h
    course.given_up = 1.0 if failed and control.last_resort else 0.0
    course.rule, course.overlap = rule, overlap_of(sizes)
    course.penetration, course.margin = penetration_of(solution, sizes), margin_of(solution, sizes, limits)
    course.wanted = float(next_wanted(course, solution.status, number + 1, controls))
    if course.wanted == len(controls) and course.unconfirmed > 0.0:
        rows.counted[THETA_ERROR, row] = rows.counted[X_ERROR, row] = np.inf
        course.rule = float(rule_of(outcome_in(rows.counted, row), sizes, limits))
    course.asked_slower = 1.0 if is_asked_slower(course.rule, solution, sizes) else 0.0


@exact_kernel
def consider_rows(
    counted: np.ndarray,
    courses: np.ndarray,
    sizes: np.ndarray,
    some: np.ndarray,
    found: np.ndarray,
    number: int,
    controls: np.ndarray,
    limits: VerdictLimits,
) -> None:
    """Take one more solution of some rows into account, whose numbers are given, shape (m,); see `consider`.

    The first three are the fields of `Rows`: an array of records in a tuple takes Numba long to recognize.
    """
    rows = Rows(counted, courses, sizes)
    for at in range(some.size):
        consider(rows, some[at], found, at, number, controls, limits)
