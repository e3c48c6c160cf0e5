"""What a simulation reports: maxima, times, and how it ended."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, taken
from .design import Constants
from .dormand_prince import DenseOutput, displacement_at, state_at, turning_point
from .dynamics import State, Switches, contact_displacement, contact_lever, spring_compression
from .numerics import sine_versine


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
    """Error of the displacements that the steps add up to [m], see `boulder_kernels.error_estimates`."""
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
    outcome: OutcomeTable = taken(a, 0, row, OutcomeTable)
    return outcome


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
def no_maxima() -> Maxima:
    """Maxima before the first step."""
    return Maxima(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def undefined_maxima() -> Maxima:
    """Maxima of a design that was not simulated."""
    return Maxima(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)


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

    Parameters
    ----------
    x, rate, x_end, rate_end
        Value [m] and rate [m/s] at its ends.

    Returns
    -------
    x, tau
        The value [m] and the fraction of the step at which it is reached: inside where the rate goes from positive to
        negative, else at the end. No branch, so that a loop over lanes stays vectorised.
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

    Parameters
    ----------
    m
        Maxima before the step.
    t
        Start of the step [s].
    tau_end
        Fraction of the step that was kept.
    start
        Compression at the start.
    y_end
        State where the step was cut.
    dense, s, c
        The step.
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
