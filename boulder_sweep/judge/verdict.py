"""From computed outcomes to pass, fail, undecided or error, with the reason.

The rules, worst first; the first that applies decides the row:

1. ``error``: the row could not be computed; the reason says why.
2. ``fail / no_contact``: the truck passes over the boulder, H - d <= bumper height.
3. ``fail / overturns``: the rotation reached its limit. A small penetration does not change that.
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

from boulder_kernels import SIMULATED, OutcomeTable, Status
from boulder_sweep.columns import OUTCOMES, RATINGS, REASONS, Rows
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import (
    ERROR,
    FAIL,
    HORIZON,
    NO_CONTACT,
    NUMERICAL_ERROR,
    OVERTURNS,
    PASS,
    PENETRATION,
    UNDECIDED,
    Judged,
)

PENETRATION_LIMITS_M = {"P1": 1.0, "P2": 7.0, "P3": 30.0}
"""Largest penetration of each rating [m] (ASTM F2656)."""

_TOO_FAST = "(more time steps than allowed; a shorter solver.step allows more)"
STATUS_REASONS = {
    Status.UNSTABLE: "the motion grew without bound at this time step: use a finer accuracy",
    Status.STEP_BUDGET: "the requested time step is too short for the horizon, or the contact modes keep switching",
    Status.STIFF_SOIL: f"the soil is too stiff for the mass of the boulder {_TOO_FAST}",
    Status.STIFF_VEHICLE: f"the vehicle's spring is too stiff for the mass of vehicle or boulder {_TOO_FAST}",
    Status.WEAK_DAMPER: f"the vehicle's damper is too weak for its spring {_TOO_FAST}",
    Status.THICK_SOIL: f"the drag of the soil is too large for the mass of the boulder {_TOO_FAST}",
    Status.LITTLE_INERTIA: f"the boulder is too light or too thin for the forces that turn it {_TOO_FAST}",
    Status.INVALID: "a constant of the design (mass, inertia or stiffness) is zero, negative or not finite",
}
"""Reason of a row that the kernels could not compute."""
NOT_FINITE = "the computed result is not a finite number"


class Limits(NamedTuple):
    """Limits of the criterion."""

    rotation: float
    """Largest rotation [rad]."""
    rating: str
    """Required penetration rating, one of `RATINGS`."""

    @property
    def penetration(self) -> float:
        """Largest penetration of the required rating [m]."""
        return PENETRATION_LIMITS_M[self.rating]


class Facts(NamedTuple):
    """What is known of n rows: what the columns of the table are computed from. Arrays have the shape (n,)."""

    outcomes: OutcomeTable
    """What the kernels computed; rad, m, N, s."""
    designs: Designs
    """Inputs of the same rows."""
    limits: Limits
    rows: dict[Rows, np.ndarray]
    """Masks: which rows were computed, stand, overturned."""
    penetration: np.ndarray
    """How far the leading edge of the cargo bed came past the far face of the boulder [m]."""
    margin: np.ndarray
    """Least (limit - value) / limit over the criteria."""
    verdict: np.ndarray
    """Codes of the verdicts."""
    reason: np.ndarray
    """Codes of the reasons."""
    reasons: tuple[str, ...]
    """What the codes of the reasons stand for."""
    rating: np.ndarray
    """Codes of the ratings; -1 where there is none."""


def judge(outcomes: OutcomeTable, designs: Designs, limits: Limits) -> Judged:
    """Apply the rules of this module to n rows.

    Parameters
    ----------
    outcomes
        What the kernels computed, arrays of shape (n,); rad, m, N, s.
    designs
        Inputs of the same rows.
    limits
        Largest rotation and required rating.

    Returns
    -------
    Judged
        One verdict a row; no row is dropped.
    """
    facts = facts_of(outcomes, designs, limits)
    columns, words = {}, {}
    for spec in OUTCOMES:
        values = spec.value(facts)
        if spec.type == "dictionary":
            columns[spec.name] = values
            words[spec.name] = facts.reasons if spec.name == "reason" else spec.words
        else:
            columns[spec.name] = _kept(values, facts.rows[spec.rows])
    return Judged(columns, words)


def facts_of(outcomes: OutcomeTable, designs: Designs, limits: Limits) -> Facts:
    """Apply the rules; see `judge`."""
    status = np.asarray(outcomes.status)
    no_contact = status == Status.NO_CONTACT
    simulated = np.isin(status, SIMULATED)
    finite = np.ones(status.shape, dtype=bool)
    for maximum in (outcomes.theta_max, outcomes.x_b_max, outcomes.x_v_max, outcomes.F_v_max, outcomes.t_end):
        finite &= np.isfinite(maximum)
    computed = simulated & finite

    overturned = computed & ((status == Status.LIMIT) | (outcomes.theta_max >= limits.rotation))
    standing = computed & ~overturned
    penetration = outcomes.x_v_max - designs.bed_offset - designs.table.L
    too_deep = standing & (penetration > limits.penetration)
    outward = standing & (status == Status.OUTWARD)
    unsure = (limits.rotation - outcomes.theta_max < outcomes.theta_error) | (
        limits.penetration - penetration < outcomes.x_error
    )

    reason, reasons = _error_reasons(status, simulated & ~finite)
    verdict = np.where(reason >= len(REASONS), ERROR, PASS).astype(np.int32)
    # Mildest rule first, so that the worst one stays.
    for rows, kind, why in (
        (standing & unsure, UNDECIDED, NUMERICAL_ERROR),
        (outward, UNDECIDED, HORIZON),
        (too_deep, FAIL, PENETRATION),
        (overturned, FAIL, OVERTURNS),
        (no_contact, FAIL, NO_CONTACT),
    ):
        verdict[rows] = kind
        reason[rows] = why
    return Facts(
        outcomes=outcomes,
        designs=designs,
        limits=limits,
        rows={"computed": computed, "standing": standing, "overturned": overturned},
        penetration=penetration,
        margin=np.minimum(
            (limits.rotation - outcomes.theta_max) / limits.rotation,
            (limits.penetration - penetration) / limits.penetration,
        ),
        verdict=verdict,
        reason=reason,
        reasons=reasons,
        rating=_ratings(penetration, standing),
    )


def _kept(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Values where `rows` holds, NaN elsewhere."""
    return np.where(rows, values, np.nan)


def _ratings(penetration: np.ndarray, standing: np.ndarray) -> np.ndarray:
    """Code of the best rating each penetration [m] keeps to; -1 beyond the last and where nothing stands."""
    bounds = np.array([PENETRATION_LIMITS_M[rating] for rating in RATINGS])
    codes = np.searchsorted(bounds, np.where(standing, penetration, np.inf), side="left")
    return np.where(codes < len(RATINGS), codes, -1).astype(np.int32)


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
