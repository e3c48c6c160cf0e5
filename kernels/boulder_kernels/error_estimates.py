"""Estimates of the numerical error: from the steps of one solution, or from the difference of two.

Dormand and Prince's method computes a fourth-order solution with its fifth-order one, at little cost, and so yields a
difference in every step. Summed over all steps, the differences give an error of the speed. Multiplied by the time for
which it acts, `error_time`, this gives the error of a displacement. We measured this time instead of deriving it, so
that the estimate covers the true error of 99.9 % of random designs, of usual ones and of families far from them.

The sum does not notice a motion that takes a wrong branch, as a rocking boulder may, nor the error in locating an
event. A design to which this may happen is *doubtful*, and is solved again with half the step. Near the limit, where
it is unlikely but would change the verdict, a coarser solution confirms the first. Beyond the horizon the sum would
grow without end, so the difference of two solutions is the error; `boulder_kernels.rules` compares further solutions
there anyway. The numbers below were chosen with one set of random designs and tested with others
(`docs/studies/wild.py`).
"""

from __future__ import annotations

import numpy as np

from ._jit import kernel
from .design import Design, Readings, design_in
from .outcomes import (
    COARSER,
    FINER,
    LEAST_ROTATION,
    NONE_NEEDED,
    PAIR,
    THETA_ERROR,
    X_ERROR,
    Outcome,
    OutcomeTable,
    Status,
    StepErrors,
    copy_outcome,
    outcome_in,
)

YIELD_PASSED = 1.2e-3
"""Error time, times the length of the steps, where steps pass the instant at which the soil yields [s^2]."""
YIELD_LOCATED = 0.08
"""Error time where steps end there [s]."""
AT_LIMIT, AT_LIMIT_AFTER_CHANGES = 2.0, 40.0
"""Factor on the error of a motion stopped at the limit of rotation, and the factor where the mode of rotation had
changed before."""
LASTING = 0.5
"""Simulated time from which the factor of a long motion counts [s]."""
LONG_MOTION = 5.0
"""Factor of a long motion on the error."""
LONG = 1.0
"""Simulated time from which the motion of a shallow or wide boulder is doubtful [s]."""
SHALLOW, VERY_SHALLOW = 0.42, 0.3
"""Ratio of depth to height below which a boulder may rock for long."""
WIDE = 0.7
"""Ratio of length to height above which a boulder is wide: it may slide for long, and set down while it slides."""
SLOW, VERY_SLOW = 256.0, 81.0
"""Ratio k_v/m_v below which a truck pushes for long [1/s^2]."""
ROCKING, CHATTERING = 8, 16
"""Number of changes of the mode of rotation above which a boulder rocks, and above which it may chatter: then nearly
every step ends with a change, and a finer solution has more of them."""
CHATTERING_THETA, CHATTERING_X, CHATTERING_T = 0.15, 0.05, 0.01
"""Least error of a boulder that may chatter, as a fraction of its rotation, its displacement, and of the way of the
truck until the limit is reached."""
CHATTERING_LEAST = 1.7453292519943296e-3
"""Least error of the rotation of a boulder that may chatter: 0.1 deg [rad]. The soil it stands on swings on, and builds
up a rotation from a thousandth of that, which two solutions do not follow alike. Of 5,031 boulders that the blow just
lifted the largest error was 0.091 deg; it was held to others, see `tests/accuracy/test_barely_lifted.py`."""
LEAST_IF_DOUBTFUL = 1e-7
"""Least error of the rotation where a boulder that stands may have taken a wrong branch [rad]: its many events add an
error of their location, which a second solution has in common with the first. This is the first of 1, 2, 3, 5 and 10
times 1e-8 by which `fine` covers 99.9 % of one half of 20,000 hardly buried boulders, and was held to the other."""
NEAR_LIMIT, MANY_ERRORS = 0.017453292519943295, 100.0
"""Distance from the limit of rotation below which a design is confirmed: one degree [rad], by a coarser solution, and
so many errors, by a finer one."""
GRAZING = 0.01
"""Below this share of the speed of impact, at an arm as long as the boulder is deep, the limit is just reached."""
SAFETY = 1.5
"""Factor from the difference of two solutions to the error that is reported: it makes the estimate hold for 99 % and
more of all designs, and for those that are not stopped at the limit of rotation alone."""
SAFETY_PRINTED = 5.0
"""Factor where the restoring moment is read as printed: two of its jumps can come and go within a step of either
solution, and both then miss them alike."""
SAFETY_CONFIRMED = 4.0
"""Factor for a doubtful design, which is solved again by half the step."""
LEAST_CONFIRMED_RAD, LEAST_CONFIRMED_M = 1e-8, 2e-7
"""Least error of a design that has a second solution."""
LEAST_LATE_M = 1e-4
"""Least error of the displacements of a boulder that stands after more than `LONG`. Two solutions that slide for
seconds can come as near to each other by chance."""


@kernel
def error_time(h: float, yield_located: bool) -> float:
    """Time for which an error of the speed counts, by steps of a length h [s]."""
    return YIELD_LOCATED if yield_located else YIELD_PASSED / h


@kernel
def step_errors(o: Outcome, design: Design, theta_limit: float, horizon: float) -> StepErrors:
    """Estimate the error of one solution.

    Parameters
    ----------
    o
        What it gave.
    design
        The design.
    theta_limit, horizon
        Limit of rotation [rad] and horizon [s].
    """
    m, t_end = o.maxima, o.t_end
    depth, pushing = design.d / design.H, design.k_v / design.m_v
    loose = depth < SHALLOW or design.L / design.H > WIDE
    stopped, changed = o.status == Status.LIMIT.value, o.rotation_changes > 0.0
    long = (t_end >= LONG) and not stopped
    if stopped:
        factor = AT_LIMIT_AFTER_CHANGES if changed else AT_LIMIT
    elif t_end >= LASTING or (pushing < SLOW and changed):
        factor = LONG_MOTION
    else:
        factor = 1.0
    arm = max(design.d, 0.5 * design.H)
    x = factor * o.moved
    if stopped:
        # An error of the rotation is one of the time at which it reaches the limit, too.
        x *= 1.0 + design.v_0 / (arm * abs(o.omega_b))
    # A boulder that hardly turns owes its rotation no more than that itself to an error of the truck.
    theta = 0.0 if stopped else min(x / arm, max(m.theta, LEAST_ROTATION))
    if o.rotation_changes > CHATTERING:
        x = max(x, CHATTERING_X * m.x_b)
        if stopped:
            x = max(x, CHATTERING_T * design.v_0 * t_end)
        else:
            theta = max(theta, CHATTERING_THETA * m.theta, CHATTERING_LEAST)
    doubtful = o.rotation_changes > ROCKING
    doubtful = doubtful or (long and loose) or (stopped and depth < VERY_SHALLOW)
    doubtful = doubtful or (changed and not stopped and (loose or pushing < SLOW))
    doubtful = doubtful or (pushing < VERY_SLOW and (changed or not stopped))
    if doubtful and not stopped:
        theta = max(theta, LEAST_IF_DOUBTFUL)
    room = theta_limit - m.theta
    if stopped:
        doubtful = doubtful or abs(o.omega_b) * arm < GRAZING * design.v_0
    else:
        doubtful = doubtful or room < MANY_ERRORS * theta
    if t_end > horizon:
        second = PAIR
    elif doubtful:
        second = FINER
    else:
        second = COARSER if not stopped and room < NEAR_LIMIT else NONE_NEEDED
    return StepErrors(theta, x, second)


@kernel
def safety_of(readings: Readings) -> float:
    """Factor from the difference of two solutions to the error that is reported."""
    return SAFETY if readings.restoring_gravity else SAFETY_PRINTED


@kernel
def estimate_error(coarse: OutcomeTable, fine: OutcomeTable, design: Design, safety: float) -> tuple[float, float]:
    """Estimate the numerical errors of a solution of one design from a coarser one.

    Parameters
    ----------
    coarse, fine
        Solutions with a step and with a third of it, or half: numbers in place of columns.
    design
        The design.
    safety
        Factor from the difference of the two to the estimate.

    Returns
    -------
    theta, x
        Errors of the rotation [rad] and of the displacements [m] of the finer solution; its own where it failed.

    Notes
    -----
    The difference of two solutions is nearly the error of the coarser, many times the finer one's. It can be small
    by chance, where two errors cross zero, but hardly in all that is reported at once. So the largest difference
    counts: displacements and angles compared over the embedment depth, or half the height of the boulder where that is
    more, and times over the speed of impact. A boulder that hardly turns owes its rotation no more than that rotation
    itself to an error of the truck (LEAST_ROTATION where it is less), however small the boulder: beyond it only the
    difference of the rotations counts.
    Where only one of the two reached the limit of rotation, or failed, no estimate could be trusted: the error is
    infinite. Where both did, the rotation is the limit itself.
    """
    if np.isnan(fine.theta_max):
        return fine.theta_error, fine.x_error
    stopped = fine.status == Status.LIMIT.value
    if np.isnan(coarse.theta_max) or (coarse.status == Status.LIMIT.value) != stopped:
        return np.inf, np.inf
    arm = max(design.d, 0.5 * design.H)
    turn = abs(coarse.theta_max - fine.theta_max)
    x = max(abs(coarse.x_b_max - fine.x_b_max), abs(coarse.x_v_max - fine.x_v_max))
    x = max(x, arm * turn)
    theta, least = 0.0, 0.0
    if stopped:
        x = max(x, design.v_0 * abs(coarse.t_limit - fine.t_limit))
    else:
        theta = safety * max(turn, min(x / arm, max(fine.theta_max, LEAST_ROTATION)))
        if fine.t_end > LONG:
            least = LEAST_LATE_M
    x = max(x, abs(coarse.crush_max - fine.crush_max))
    return theta, max(safety * x, least)


@kernel
def take_second(
    out: np.ndarray, row: int, found: np.ndarray, at: int, solution: int, design: Design, safety: float
) -> int:
    """Take a second solution of one design into account, and return which further one is needed.

    Parameters
    ----------
    out, row
        The solution that counts so far, with the errors of its steps, in an array of `empty_outcomes`. A finer one
        takes its place. The errors become the larger of the finer solution's own and the difference of the two; of a
        pair, the difference alone.
    found, at
        The second solution, the same way.
    solution
        Which one it is, `FINER` to `PAIR`.
    design, safety
        The design, and the factor from the difference to the estimate, see `safety_of`.
    """
    first, second = outcome_in(out, row), outcome_in(found, at)
    finer = solution == FINER
    if finer and np.isnan(second.theta_max):
        return PAIR
    if finer:
        copy_outcome(found, at, out, row)
    coarse, fine = (first, second) if finer else (second, first)
    theta, x = estimate_error(coarse, fine, design, SAFETY_CONFIRMED if finer else safety)
    if solution != PAIR and not np.isnan(fine.theta_max):
        theta = max(theta, fine.theta_error, LEAST_CONFIRMED_RAD)
        x = max(x, fine.x_error, LEAST_CONFIRMED_M)
    out[THETA_ERROR, row], out[X_ERROR, row] = theta, x
    return NONE_NEEDED


@kernel
def take_seconds(
    out: np.ndarray, rows: np.ndarray, found: np.ndarray, needed: np.ndarray, designs: np.ndarray, safety: float
) -> None:
    """Take second solutions of some rows of a table into account.

    Parameters
    ----------
    out, needed
        Solutions of n designs, and which second one each needs, shapes (11, n) and (n,); both are written over.
    rows
        Numbers of m rows.
    found, designs
        Their second solutions and designs, shapes (11, m) and (15, m).
    safety
        Factor from the difference to the estimate, see `safety_of`.
    """
    for at in range(rows.size):
        row = rows[at]
        needed[row] = take_second(out, row, found, at, int(needed[row]), design_in(designs, at), safety)
