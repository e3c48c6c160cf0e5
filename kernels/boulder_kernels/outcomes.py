"""What a simulation reports: maxima and how it ended, their numerical error, and the time history.

**Errors** are estimated from the steps of one solution, or from the difference of two. Dormand and Prince's method
computes a fourth-order solution with its fifth-order one, at little cost, and so yields a difference in every step.
Summed over all steps, the differences give an error of the speed. Multiplied by the time for which it acts,
`error_time`, this gives the error of a displacement. We measured this time instead of deriving it, so that the estimate
covers the true error of 99.9 % of random designs, of usual ones and of families far from them.

The sum does not notice a motion that takes a wrong branch, as a rocking boulder may, nor the error in locating an
event. A design to which this may happen is *doubtful*, and is solved again with half the step. Near the limit, where
it is unlikely but would change the verdict, a coarser solution confirms the first. Beyond the horizon the sum would
grow without end, so the difference of two solutions is the error; `boulder_kernels.rules` compares further solutions
there anyway. The numbers below were chosen with one set of random designs and tested with others
(`docs/studies/wild.py`).

**The time history** of one impact is its record, the forces at a sample, and where the energy of the truck goes. Energy
is stored at a state, and exchanged along the motion by quadrature. Every entry comes from its own law: stored
energies are potentials, exchanged ones integrals of their own power, and none is what the others leave over. So the sum
of all of them stays at the truck's initial energy only if the forces of the motion are the ones these laws describe.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .design import Constants, Design, Readings, design_in
from .dormand_prince import DenseOutput, displacement_at, state_at, turning_point
from .dynamics import (
    Acceleration,
    Modes,
    State,
    Switches,
    acceleration,
    contact_displacement,
    contact_lever,
    couple_moment,
    drag_power,
    lift_of,
    soil_energy,
    spring_compression,
    switches_of,
)
from .numerics import sine_versine, write_numbers
from .soil import soil_kinematics


class Status(IntEnum):
    """How the simulation of a design ended."""

    NO_CONTACT = 0
    """The truck passes over the boulder: nothing was integrated."""
    LIMIT = 1
    """The rotation reached its limit."""
    SETTLED = 2
    """Proved: nothing that is reported can still grow."""
    HORIZON = 3
    """The longest horizon was reached, and nothing is proved of later times."""
    OUTWARD = 4
    """The longest horizon was reached with rotation or truck at its maximum and still growing."""
    UNSTABLE = 5
    """The state became non-finite."""
    STEP_BUDGET = 6
    """More steps are needed than are allowed: the time step is too short, or the contact modes keep switching."""
    INVALID = 7
    """A constant of the design is not finite, or not positive."""
    STIFF_SOIL = 8
    """The design needs more steps than are allowed: the soil springs back too fast for the boulder's mass."""
    STIFF_VEHICLE = 9
    """The design needs too many steps: the vehicle's spring is too stiff for the masses on either side."""
    WEAK_DAMPER = 10
    """The design needs too many steps: the vehicle's spring relaxes too fast against its damper."""
    THICK_SOIL = 11
    """The design needs too many steps: the drag of the soil slows the boulder too fast."""
    LITTLE_INERTIA = 12
    """The design needs too many steps: the boulder has too little inertia for the forces that turn it."""
    BELOW_LIMIT = 13
    """A horizon was reached, and it is proved that the rotation can never reach its limit, and that truck and crush are
    what they will ever be. Rotation, displacement and force are the largest up to then: they may still grow."""
    UNPROVABLE = 14
    """The longest horizon was reached below the limit. The restoring moment or the separation is read as printed: such
    forces feed energy, and nothing can be proved of later times."""


SIMULATED = (
    Status.LIMIT,
    Status.SETTLED,
    Status.BELOW_LIMIT,
    Status.UNPROVABLE,
    Status.HORIZON,
    Status.OUTWARD,
)
"""How a simulation ends that has maxima to report."""


class Maxima(NamedTuple):
    """Largest values so far, and their times [s]."""

    theta: float
    """Largest modulus of theta_b [rad]."""
    t_theta: float
    x_b: float
    """Largest displacement x_b [m]."""
    t_x_b: float
    x_v: float
    """Largest displacement x_v [m]."""
    t_x_v: float
    F_v: float
    """Largest contact force [N]."""
    t_F_v: float
    crush: float
    """Largest crush of the truck's front while it drives forward, x_v less the displacement of the contact point [m]:
    final once the truck has stopped. What the boulder may add as it swings back is not counted."""
    t_crush: float


class Outcome(NamedTuple):
    """Result of one simulation; NaN where not computed."""

    status: int
    maxima: Maxima
    t_limit: float
    """Time at which the rotation reached its limit [s]."""
    t_end: float
    """Simulated time at the end [s]."""
    attempts: int
    """Number of steps tried."""
    moved: float
    """Error of the displacements that the steps add up to [m], see `boulder_kernels.outcomes`."""
    omega_b: float
    """Rate of rotation in the end [rad/s]."""
    rotation_changes: float
    """How often the mode of rotation changed after the first step, in which a boulder begins to turn."""


LEAST_ROTATION = 1e-4
"""Rotation that an error of the truck may stand for even where the boulder turns less [rad]."""


NONE_NEEDED, FINER, COARSER, PAIR = range(4)
"""Second solutions of a design: none; by half the step, which is reported; by three times the step, which confirms that
the error is no larger; by three times the step, where the two solutions alone give the error."""


class StepErrors(NamedTuple):
    """What is known of the error of one solution."""

    theta: float
    """Estimated error of the largest rotation [rad]; 0 where that is the limit."""
    x: float
    """Estimated error of the largest displacements; at the limit, also of the truck's way up to it [m]."""
    second: int
    """Which second solution is needed, `NONE_NEEDED` to `PAIR`."""


class OutcomeTable(NamedTuple):
    """Results of many designs, arrays of shape (n,), or of one, numbers; NaN where not computed."""

    status: Any
    """Codes of `Status`, int8."""
    theta_max: Any
    """Largest modulus of theta_b [rad]."""
    x_b_max: Any
    """Largest displacement x_b [m]."""
    x_v_max: Any
    """Largest displacement x_v [m]."""
    F_v_max: Any
    """Largest contact force [N]."""
    crush_max: Any
    """Largest crush of the truck's front while it drives forward [m]."""
    t_limit: Any
    """Time at which the rotation reached its limit [s]."""
    t_end: Any
    """Simulated time at the end [s]."""
    theta_error: Any
    """Estimated numerical error of theta_max [rad]."""
    x_error: Any
    """Estimated numerical error of x_b_max, x_v_max and crush_max, the largest [m]."""
    step: Any
    """Step asked for of the solution that is reported [s]; NaN where there is none."""


OUTCOME_FIELDS = OutcomeTable._fields
ROWS = len(OUTCOME_FIELDS)
STATUS, THETA_MAX, X_B_MAX, X_V_MAX, F_V_MAX, CRUSH_MAX, T_LIMIT, T_END, THETA_ERROR, X_ERROR, STEP = range(ROWS)
SECOND = STEP
"""Row of the array of `empty_outcomes` in place of the step, see `write_outcome`."""


def empty_outcomes(n: int) -> np.ndarray:
    """Return an array for n outcomes, shape (len(OUTCOME_FIELDS), n): INVALID and NaN until written."""
    out = np.full((ROWS, n), np.nan)
    out[STATUS] = Status.INVALID.value
    return out


def outcome_table(out: np.ndarray) -> OutcomeTable:
    """Return an array of outcomes as a table."""
    return OutcomeTable(out[STATUS].astype(np.int8), *out[THETA_MAX:])


@inlined
def outcome_in(a: np.ndarray, row: int) -> OutcomeTable:
    """Return the outcome in a column of an array."""
    x = a[:, row]
    return OutcomeTable(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10])


@kernel
def copy_outcome(found: np.ndarray, at: int, out: np.ndarray, row: int) -> None:
    """Copy one outcome of an array into another."""
    for k in range(ROWS):
        out[k, row] = found[k, at]


@kernel
def write_outcome(out: np.ndarray, row: int, o: Outcome, errors: StepErrors) -> None:
    """Write one outcome into an array whose rows are the columns of an `OutcomeTable`, but for its step.

    In place of the step it says which second solution is needed, see `StepErrors`.
    """
    out[STATUS, row] = o.status
    out[THETA_MAX, row] = o.maxima.theta
    out[X_B_MAX, row] = o.maxima.x_b
    out[X_V_MAX, row] = o.maxima.x_v
    out[F_V_MAX, row] = o.maxima.F_v
    out[CRUSH_MAX, row] = o.maxima.crush
    out[T_LIMIT, row] = o.t_limit
    out[T_END, row] = o.t_end
    out[THETA_ERROR, row] = errors.theta
    out[X_ERROR, row] = errors.x
    out[SECOND, row] = errors.second


@kernel
def all_maxima(x: float) -> Maxima:
    """Maxima that all are one number: zero before the first step, or NaN where nothing was simulated."""
    return Maxima(x, x, x, x, x, x, x, x, x, x)


class Compression(NamedTuple):
    """Compression of the vehicle's spring, and of its whole front."""

    u: float
    """Compression of the spring [m]."""
    rate: float
    """Rate of u [m/s]; the contact force peaks where it is zero."""
    crush: float
    """Crush of the front: spring and damper together [m]."""
    crush_rate: float
    """Rate of the crush [m/s]."""


@inlined
def compression_of(y: State, sin: float, versin: float, s: Switches, c: Constants) -> Compression:
    """Compression of the vehicle's front at a state with these sine and versine."""
    x_c = contact_displacement(y.x_b, sin, versin, c)
    u = spring_compression(y.x_v, y.v_v, x_c, c)
    crush_rate = y.v_v - y.v_b - y.omega_b * contact_lever(sin, versin, c)
    return Compression(u, crush_rate - c.tau_v * s.k_truck * u, y.x_v - x_c, crush_rate)


@inlined
def compression_at(y: State, s: Switches, c: Constants) -> Compression:
    """Compression of the vehicle's front at a state."""
    sin, versin = sine_versine(y.theta_b)
    return compression_of(y, sin, versin, s, c)


@inlined
def highest(x: float, rate: float, x_end: float, rate_end: float, h: float) -> tuple[float, float]:
    """Largest value in a step of length h [s], by the cubic through both of its ends.

    ``x, rate, x_end, rate_end``: value [m] and rate [m/s] at its ends.

    Returns ``x, tau``: the value [m] and the fraction of the step at which it is reached: inside where the rate goes
    from positive to negative, else at the end. No branch, so that a loop over lanes stays vectorised.
    """
    c_1, slope_end = h * rate, h * rate_end
    rise = x_end - x
    c_2 = 3.0 * rise - 2.0 * c_1 - slope_end
    c_3 = c_1 + slope_end - 2.0 * rise
    peaks = (rate > 0.0) & (rate_end < 0.0)
    # The root of c_1 + 2 c_2 tau + 3 c_3 tau^2 at which the slope changes from plus to minus.
    tau = c_1 / (math.sqrt(max(c_2 * c_2 - 3.0 * c_3 * c_1, 0.0)) - c_2) if peaks else 1.0
    return (x + tau * (c_1 + tau * (c_2 + tau * c_3)) if peaks else x_end), tau


@inlined
def grown(best: float, t_best: float, value: float, t: float) -> tuple[float, float]:
    """Return the larger of the best so far and a value, with its time."""
    better = value > best
    return value if better else best, t if better else t_best


@inlined
def updated_maxima(
    m: Maxima,
    t: float,
    tau_end: float,
    start: Compression,
    y_end: State,
    dense: DenseOutput,
    s: Switches,
    c: Constants,
) -> tuple[Maxima, Compression]:
    """Maxima after a step, from its end and from the turning points inside, and the compression at its end.

    ``m``: maxima before the step; ``t``: start of the step [s]; ``tau_end``: fraction of the step that was kept;
    ``start``: compression at the start; ``y_end``: state where the step was cut.
    """
    h = dense.h
    t_end = t + tau_end * h
    theta, t_theta = grown(m.theta, m.t_theta, abs(y_end.theta_b), t_end)
    tau = turning_point(dense.rotation, tau_end)
    if tau < tau_end:
        theta, t_theta = grown(theta, t_theta, abs(displacement_at(dense.rotation, tau)), t + tau * h)
    x_b, t_x_b = grown(m.x_b, m.t_x_b, y_end.x_b, t_end)
    tau = turning_point(dense.boulder, tau_end)
    if tau < tau_end:
        x_b, t_x_b = grown(x_b, t_x_b, displacement_at(dense.boulder, tau), t + tau * h)
    x_v, t_x_v = grown(m.x_v, m.t_x_v, y_end.x_v, t_end)
    end = compression_at(y_end, s, c)
    tau = turning_point(dense.truck, tau_end)
    stop = end
    if tau < tau_end:
        x_v, t_x_v = grown(x_v, t_x_v, displacement_at(dense.truck, tau), t + tau * h)
        stop = compression_at(state_at(dense, tau), s, c)
    crush, t_crush = m.crush, m.t_crush
    if dense.truck.x1 > 0.0:
        deepest, share = highest(start.crush, start.crush_rate, stop.crush, stop.crush_rate, tau * h)
        crush, t_crush = grown(m.crush, m.t_crush, deepest, t + share * tau * h)
    u, share = highest(start.u, start.rate, end.u, end.rate, tau_end * h)
    F_v, t_F_v = grown(m.F_v, m.t_F_v, s.k_contact * u, t + share * tau_end * h)
    return Maxima(theta, t_theta, x_b, t_x_b, x_v, t_x_v, F_v, t_F_v, crush, t_crush), end


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

    ``o``: what it gave; ``theta_limit, horizon``: limit of rotation [rad] and horizon [s].
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

    ``coarse, fine``: solutions with a step and with a third of it, or half: numbers in place of columns; ``safety``:
    factor from the difference of the two to the estimate.

    Returns ``theta, x``: errors of the rotation [rad] and of the displacements [m] of the finer solution; its own where
    it failed.

    The difference of two solutions is nearly the error of the coarser, many times the finer one's. It can be small by
    chance, where two errors cross zero, but hardly in all that is reported at once. So the largest difference counts:
    displacements and angles compared over the embedment depth, or half the height of the boulder where that is more,
    and times over the speed of impact. A boulder that hardly turns owes its rotation no more than that rotation itself
    to an error of the truck (LEAST_ROTATION where it is less), however small the boulder: beyond it only the difference
    of the rotations counts. Where only one of the two reached the limit of rotation, or failed, no estimate could be
    trusted: the error is infinite. Where both did, the rotation is the limit itself.
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

    ``out, row``: the solution that counts so far, with the errors of its steps, in an array of `empty_outcomes`. A
    finer one takes its place. The errors become the larger of the finer solution's own and the difference of the two;
    of a pair, the difference alone; ``found, at``: the second solution, the same way; ``solution``: which one it is,
    `FINER` to `PAIR`; ``design, safety``: the design, and the factor from the difference to the estimate, see
    `safety_of`.
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

    ``out, needed``: solutions of n designs, and which second one each needs, shapes (11, n) and (n,); both are written
    over; ``rows``: numbers of m rows; ``found, designs``: their second solutions and designs, shapes (11, m) and (15,
    m); ``safety``: factor from the difference to the estimate, see `safety_of`.
    """
    for at in range(rows.size):
        row = rows[at]
        needed[row] = take_second(out, row, found, at, int(needed[row]), design_in(designs, at), safety)


GAUSS_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
GAUSS_WEIGHTS = (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692)
"""Nodes and weights of the four-point Gauss-Legendre rule on 0 ... 1."""


class StoredEnergies(NamedTuple):
    """Energies that follow from the state [J]."""

    truck_kinetic: float
    boulder_kinetic: float
    """Translation of boulder and lumped soil, m_eff v_b^2/2."""
    boulder_rotational: float
    """Rotation of boulder and lumped soil, J_eff omega_b^2/2."""
    soil_elastic: float
    crush_elastic: float
    """In the spring of the vehicle."""
    gravity: float
    """Corrected reading: m_b g times the rise of the boulder's centre over its corner; as printed 0, where the
    restoring moment has no potential and counts among the exchanged energies."""


class ExchangedEnergies(NamedTuple):
    """Energies exchanged since the impact [J]."""

    drag: float
    """Dissipated by the drag of the soil (Eq 36)."""
    damper: float
    """Dissipated by the damper of the vehicle."""
    restoring: float
    """Taken up by the restoring moment, minus the integral of M_R omega_b."""
    pull: float
    """Printed separation only: given to the truck by the air that pulls it, which no force on the boulder answers."""


@kernel
def nothing_exchanged() -> ExchangedEnergies:
    """Exchanged energies at the impact."""
    return ExchangedEnergies(0.0, 0.0, 0.0, 0.0)


@kernel
def stored_energies(y: State, m_v: float, touching: bool, gravity_couple: bool, c: Constants) -> StoredEnergies:
    """Stored energies at a state [J].

    ``m_v``: mass of the truck [kg]; ``touching``: whether truck and boulder touch; ``gravity_couple``: whether the
    restoring moment is the couple of the weight.
    """
    sin, versin = sine_versine(y.theta_b)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    return StoredEnergies(
        0.5 * m_v * y.v_v * y.v_v,
        0.5 * c.m_eff * y.v_b * y.v_b,
        0.5 * c.J_eff * y.omega_b * y.omega_b,
        soil_energy(k, c),
        0.5 * c.k_v * u * u if touching else 0.0,
        lift_of(sin, versin, c) if gravity_couple else 0.0,
    )


@kernel
def exchange_rates(y: State, modes: Modes, s: Switches, c: Constants) -> ExchangedEnergies:
    """Powers at a state [W], in the fields of the energies they add up to."""
    sin, versin = sine_versine(y.theta_b)
    drag = drag_power(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    F_truck = s.k_truck * u / c.k_m * c.k_v
    # tau_v = m_v/c_v and k_v/k_m = m_v, so 1/c_v = tau_v k_m / k_v.
    damper = F_truck * F_truck * c.tau_v * c.k_m / c.k_v
    M = acceleration(y, s, c).M
    M_R = (s.net - 1.0) * M + couple_moment(sin, versin, s, c)
    pull = 0.0
    if not modes.touching:
        v_c = y.v_b + y.omega_b * contact_lever(sin, versin, c)
        pull = -F_truck * v_c
    return ExchangedEnergies(drag, damper, -M_R * y.omega_b, pull)


@kernel
def add_exchanged(
    before: ExchangedEnergies,
    dense: DenseOutput,
    tau: float,
    modes: Modes,
    switches: Switches,
    c: Constants,
) -> ExchangedEnergies:
    """Add the energies exchanged in the part 0 ... tau of a step by Gauss-Legendre quadrature."""
    drag, damper, restoring, pull = before.drag, before.damper, before.restoring, before.pull
    for node in range(4):
        rates = exchange_rates(state_at(dense, GAUSS_NODES[node] * tau), modes, switches, c)
        weight = GAUSS_WEIGHTS[node] * tau * dense.h
        drag += weight * rates.drag
        damper += weight * rates.damper
        restoring += weight * rates.restoring
        pull += weight * rates.pull
    return ExchangedEnergies(drag, damper, restoring, pull)


class Record(NamedTuple):
    """Where a simulation writes its time history; empty arrays for none."""

    times: np.ndarray
    """Times asked for [s], ascending, shape (n,)."""
    states: np.ndarray
    """State at each, shape (n, 6), order of `State`; rows beyond the end of the simulation stay as they are."""
    turning: np.ndarray
    """Mode of rotation at each, int8, shape (n,)."""
    touching: np.ndarray
    """Whether the truck touched, bool, shape (n,)."""
    exchanged: np.ndarray
    """Energy exchanged up to each [J], shape (n, 4), order of `ExchangedEnergies`."""


def no_record() -> Record:
    """Return a record that keeps nothing."""
    return Record(
        np.empty(0, np.float64),
        np.empty((0, 6), np.float64),
        np.empty(0, np.int8),
        np.empty(0, np.bool_),
        np.empty((0, 4), np.float64),
    )


@kernel
def write_samples(
    record: Record,
    written: int,
    t: float,
    t_end: float,
    dense: DenseOutput,
    modes: Modes,
    switches: Switches,
    c: Constants,
    exchanged: ExchangedEnergies,
) -> int:
    """Write the samples that lie in a step from t to t_end [s], and return how many have been written in all."""
    while written < record.times.size and record.times[written] <= t_end:
        tau = (record.times[written] - t) / dense.h
        y = state_at(dense, tau)
        write_numbers(record.states[written], y)
        record.turning[written] = modes.turning
        record.touching[written] = modes.touching
        write_numbers(record.exchanged[written], add_exchanged(exchanged, dense, tau, modes, switches, c))
        written += 1
    return written


class Sample(NamedTuple):
    """What follows from the state at one sample."""

    rate: Acceleration
    """Accelerations, and the moment of soil and truck without the restoring moment."""
    stored: StoredEnergies
    """Energies stored at this instant [J]."""


@inlined
def modes_of(y: State, turning: int, touching: bool, c: Any) -> Modes:
    """Return the modes of a sample; the signs of Eq 37 follow from the rotation itself."""
    corner = math.copysign(1.0, c.theta_corner - y.theta_b)
    arm = math.copysign(1.0, c.C_cos * math.cos(y.theta_b) + c.C_sin * math.sin(y.theta_b))
    return Modes(turning, touching, corner, arm, 0, 0)


@inlined
def state_of(record: Record, sample: int) -> State:
    """Return the state at a sample."""
    y = record.states[sample]
    return State(y[0], y[1], y[2], y[3], y[4], y[5])


@inlined
def sample_of(record: Record, sample: int, c: Any, m_v: float, readings: Readings) -> Sample:
    """Evaluate one sample; arguments: see `evaluate_samples`."""
    y = state_of(record, sample)
    touching = record.touching[sample] > 0
    modes = modes_of(y, int(record.turning[sample]), touching, c)
    rate = acceleration(y, switches_of(modes, readings, c), c)
    # Printed separation: the spring goes on pulling the truck after release, so it holds energy all along.
    holds = touching or not readings.separation_released
    return Sample(rate, stored_energies(y, m_v, holds, readings.restoring_gravity, c))


@kernel
def evaluate_samples(
    record: Record,
    c: Any,
    m_v: float,
    readings: Readings,
    rates: np.ndarray,
    stored: np.ndarray,
) -> None:
    """Evaluate the samples of a record.

    ``record``: the record, with n samples; ``c``: constants of the motion; ``m_v``: mass of the vehicle [kg];
    ``rates``: where the fields of `Acceleration` go, shape (4, n); ``stored``: where the fields of `StoredEnergies` go,
    shape (6, n) [J].
    """
    for i in range(record.times.size):
        s = sample_of(record, i, c, m_v, readings)
        write_numbers(rates[:, i], s.rate)
        write_numbers(stored[:, i], s.stored)
