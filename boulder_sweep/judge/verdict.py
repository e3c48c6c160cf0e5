"""From what the kernels computed to pass, fail, undecided or error, with the reason.

The rules, worst reason first; the first that holds for a row decides it:

1. ``error``: the row could not be computed; the reason says why.
2. ``fail / no_contact``: the truck passes over the boulder, H - d <= bumper height.
3. ``fail / overturns``: the rotation reached its limit. Never outvoted by the penetration, which such a
   boulder may well keep small.
4. ``fail / penetration``: the truck's cargo bed ends further behind the boulder than its rating allows.
5. ``undecided / horizon``: at the end of the simulated time something was still growing.
6. ``undecided / error``: a peak below its limit lies nearer to it than the estimated numerical error.
7. ``pass``.

A peak beyond its limit is decided even where the error is larger than the excess: that is the safe side.
Where no error was estimated (NaN), rule 6 cannot hold and the verdict is unguarded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from boulder_kernels import OutcomeTable, Status
from boulder_sweep.judge.judged import (
    ERROR,
    FAIL,
    HORIZON,
    NO_CONTACT,
    NUMERICAL_ERROR,
    OVERTURNS,
    PASS,
    PENETRATION,
    RATINGS,
    REASONS,
    UNDECIDED,
    Judged,
)

PENETRATION_LIMITS_M = {"P1": 1.0, "P2": 7.0, "P3": 30.0}
"""Largest penetration of each rating [m] (ASTM F2656)."""

NEWTON_PER_KILONEWTON = 1000.0
_TOO_FAST = "(more time steps than allowed; a shorter solver.step allows more)"
STATUS_REASONS = {
    Status.UNSTABLE: "the motion grew without bound in the time step used: ask for a finer accuracy",
    Status.STEP_BUDGET: "the time step asked for is too short for the horizon, or the modes change without end",
    Status.STIFF_SOIL: f"the soil is too stiff for the mass of the boulder {_TOO_FAST}",
    Status.STIFF_VEHICLE: f"the vehicle's spring is too stiff for the mass of vehicle or boulder {_TOO_FAST}",
    Status.WEAK_DAMPER: f"the vehicle's damper is too weak for its spring {_TOO_FAST}",
    Status.THICK_SOIL: f"the drag of the soil is too large for the mass of the boulder {_TOO_FAST}",
    Status.LITTLE_INERTIA: f"the boulder is too light or too thin for the forces that turn it {_TOO_FAST}",
    Status.INVALID: "a constant of the design (mass, inertia or stiffness) is zero, negative or not finite",
}
"""Why a row that the kernels gave up has no result."""
NOT_FINITE = "the computed result is not a finite number"


class Limits(NamedTuple):
    """What a design must keep to."""

    rotation: float
    """Largest rotation [rad]."""
    rating: str
    """Required penetration rating, one of `RATINGS`."""

    @property
    def penetration(self) -> float:
        """Largest penetration of the required rating [m]."""
        return PENETRATION_LIMITS_M[self.rating]


def judge(outcomes: OutcomeTable, boulder_length: np.ndarray, bed_offset: np.ndarray, limits: Limits) -> Judged:
    """Apply the rules of this module to n rows.

    Parameters
    ----------
    outcomes
        What the kernels computed, arrays of shape (n,); rad, m, N, s.
    boulder_length
        Length of the boulder along the direction of travel [m], shape (n,).
    bed_offset
        Distance from the front bumper to the leading edge of the cargo bed [m], shape (n,).
    limits
        Largest rotation and required rating.

    Returns
    -------
    Judged
        One verdict a row; no row is dropped.
    """
    status = np.asarray(outcomes.status)
    no_contact = status == Status.NO_CONTACT
    simulated = np.isin(status, (Status.LIMIT, Status.SETTLED, Status.HORIZON, Status.OUTWARD))
    finite = np.ones(status.shape, dtype=bool)
    for maximum in (outcomes.theta_max, outcomes.x_b_max, outcomes.x_v_max, outcomes.F_v_max, outcomes.t_end):
        finite &= np.isfinite(maximum)
    valid = simulated & finite

    overturned = valid & ((status == Status.LIMIT) | (outcomes.theta_max >= limits.rotation))
    standing = valid & ~overturned
    penetration = _kept(outcomes.x_v_max - bed_offset - boulder_length, valid)
    too_deep = standing & (penetration > limits.penetration)
    outward = standing & (status == Status.OUTWARD)
    unsure = (limits.rotation - outcomes.theta_max < outcomes.theta_error) | (
        limits.penetration - penetration < outcomes.x_error
    )

    reason, reasons = _error_reasons(status, simulated & ~finite)
    verdict = np.where(reason >= len(REASONS), ERROR, PASS).astype(np.int8)
    # From the mildest rule to the worst, so that the worst is the one that stays.
    for rows, kind, why in (
        (standing & unsure, UNDECIDED, NUMERICAL_ERROR),
        (outward, UNDECIDED, HORIZON),
        (too_deep, FAIL, PENETRATION),
        (overturned, FAIL, OVERTURNS),
        (no_contact, FAIL, NO_CONTACT),
    ):
        verdict[rows] = kind
        reason[rows] = why

    margin = np.minimum(
        (limits.rotation - outcomes.theta_max) / limits.rotation,
        (limits.penetration - penetration) / limits.penetration,
    )
    return Judged(
        verdict=verdict,
        reason=reason,
        margin=_kept(margin, standing),
        max_rotation_deg=_kept(np.degrees(outcomes.theta_max), valid),
        max_displacement_m=_kept(outcomes.x_b_max, valid),
        max_vehicle_displacement_m=_kept(outcomes.x_v_max, valid),
        peak_force_kN=_kept(outcomes.F_v_max / NEWTON_PER_KILONEWTON, valid),
        penetration_m=penetration,
        rating=_ratings(penetration, standing),
        time_to_limit_s=_kept(outcomes.t_limit, overturned),
        end_time_s=_kept(outcomes.t_end, valid),
        rotation_error_deg=_kept(np.degrees(outcomes.theta_error), valid),
        displacement_error_m=_kept(outcomes.x_error, valid),
        reasons=reasons,
    )


def _kept(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Values where `rows` holds, NaN elsewhere."""
    return np.where(rows, values, np.nan)


def _ratings(penetration: np.ndarray, standing: np.ndarray) -> np.ndarray:
    """Code of the best rating each penetration [m] keeps to; -1 beyond the last and where nothing stands."""
    bounds = np.array([PENETRATION_LIMITS_M[rating] for rating in RATINGS])
    codes = np.searchsorted(bounds, np.where(standing, penetration, np.inf), side="left")
    return np.where(codes < len(RATINGS), codes, -1).astype(np.int8)


def _error_reasons(status: np.ndarray, not_finite: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Reason codes with the rows that could not be computed filled in, and the reasons they index."""
    texts = {int(kind): text for kind, text in STATUS_REASONS.items()}
    computed = {int(kind) for kind in Status} - set(texts)
    rows = {
        texts.get(int(kind), f"the kernels ended with the unknown status {kind}"): status == kind
        for kind in np.unique(status)
        if int(kind) not in computed
    }
    if not_finite.any():
        rows[NOT_FINITE] = not_finite
    named = tuple(sorted(rows))
    reason = np.zeros(status.shape, dtype=np.int32)
    for place, text in enumerate(named):
        reason[rows[text]] = len(REASONS) + place
    return reason, (*REASONS, *named)
