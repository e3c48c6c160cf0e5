"""From computed outcomes to pass, fail, undecided or error, with the reason.

``docs/model.md`` says what the rules mean; `boulder_kernels.rules` applies them, for tables and for the page of a
report: the worst first, and the first that applies decides the row. A boulder that overturns fails, however small the
penetration is.

Undecided for its horizon is a row of which the longer time, too, ended without proof. Where a reading lets forces feed
energy, as the printed ones do, nothing can be proved of later times: there every boulder that stands at the horizon is
undecided. Undecided for its validity is also a shallow boulder that slides: whether it stands changes with every
hundredth of the speed.

A peak beyond its limit is decided even where the error is larger than the excess: that is the safe side. But where only
one of the two solutions from which the error is estimated overturns, the error is infinite and nothing is decided.
Where errors are estimated from one solution, as by ``fast``, rows that are undecided for their error stay as they are,
and motion beyond the horizon is not simulated, since nothing would confirm it; else finer steps decide them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import boulder_kernels.rules as verdicts
from boulder_kernels import SIMULATED, Control, OutcomeTable, Status
from boulder_kernels.numerics import record_type, records_of
from boulder_kernels.outcomes import empty_outcomes, outcome_table
from boulder_kernels.rules import OF_CRITERION, RULES, Course, Rows, Sizes, VerdictLimits, consider_rows
from boulder_sweep.columns import OUTCOMES, RATINGS, REASONS, VERDICTS, RowKind
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import ERROR, NUMERICAL_ERROR, PASS, UNDECIDED, Judged
from boulder_sweep.judge.robustness import grades_without_asking, is_studied
from boulder_sweep.judge.validity import flagged, has_odd_layers, largest_tested_rotation
from boulder_sweep.settings.model import Criterion, Model

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

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
_VERDICTS = np.array([VERDICTS.index(verdict) for verdict, _ in RULES], dtype=np.int32)
_REASONS = np.array([REASONS.index(reason) for _, reason in RULES], dtype=np.int32)
NOT_FINITE = "the computed result is not a finite number"


class Limits(NamedTuple):
    """Limits of the criterion."""

    rotation: float
    """Largest rotation that passes [rad]."""
    rating: str
    """Required penetration rating, one of `RATINGS`."""
    criterion: Criterion = Criterion()
    """Further limits, under the names that they have in `boulder_kernels.rules.VerdictLimits`."""
    calibrated_crush: float = Model().calibrated_crush_m
    """Crush beyond which a row is flagged [m]."""
    tested_rotation: float = largest_tested_rotation("corrected")
    """Rotation beyond which a row is flagged [rad]."""
    odd_layers: bool = False
    """Whether a deeper layer of the soil is outside what is usual."""
    studied: bool = False
    """Whether the study of second opinions speaks for the model, see `boulder_sweep.judge.robustness`."""
    flat_foot: bool = True
    """Whether the boulders stand on a flat foot."""
    guarded: bool = True
    """Whether a row nearer to a limit than its error is undecided; not in a search whose results are judged again."""

    @property
    def penetration(self) -> float:
        """Largest penetration of the required rating [m]."""
        return PENETRATION_LIMITS_M[self.rating]

    @property
    def of_rules(self) -> VerdictLimits:
        """Limits that decide a verdict, as the kernels take them."""
        further = (getattr(self.criterion, name) for name in OF_CRITERION)
        return VerdictLimits(self.rotation, self.penetration, float(self.guarded), *further)


class Facts(NamedTuple):
    """What is known of n rows: what the columns of the table are computed from. Arrays have the shape (n,)."""

    outcomes: OutcomeTable
    """What the kernels computed; rad, m, N, s."""
    designs: Designs
    """Inputs of the same rows."""
    limits: Limits
    rows: dict[RowKind, np.ndarray]
    """Masks of the rows of each kind; `OutcomeColumn` explains the kinds."""
    overlap: np.ndarray
    """Height of the top of the boulder over the underside of the bumper [m]."""
    penetration: np.ndarray
    """How far the leading edge of the cargo bed came past the far face of the boulder [m]."""
    margin: np.ndarray
    """Least (limit - value) / limit over the criteria."""
    verdict: np.ndarray
    """Codes of the verdicts."""
    reason: np.ndarray
    """Codes of the reasons."""
    rating: np.ndarray
    """Codes of the ratings; -1 where there is none."""


def judge(outcomes: OutcomeTable, designs: Designs, limits: Limits, only: tuple[str, ...] = ()) -> Judged:
    """Apply the rules to what the kernels computed of n rows (rad, m, N, s); no row is dropped.

    The columns are those in `only`; all of the table where it is empty.
    """
    rows = rows_of(designs, limits)
    consider_rows(*rows, np.arange(designs.size), np.stack(outcomes), 0, UNCONFIRMED, limits.of_rules)
    return judged_rows(rows, designs, limits, only)


UNCONFIRMED = np.zeros((1, len(Control._fields)))
"""Control of a single solution for `consider_rows`, which confirms nothing."""


def rows_of(designs: Designs, limits: Limits) -> Rows:
    """Return rows of which no solution is known yet."""
    table, n = designs.table, designs.size
    flat, known = np.full(n, float(limits.flat_foot)), designs.has_known_shape.astype(float)
    sizes = (designs.length, table.H, table.d, table.e_bumper, designs.bed_offset, table.v_0, flat, known)
    return Rows(empty_outcomes(n), np.zeros(n, record_type(Course)), records_of(Sizes, sizes))


def judged_rows(rows: Rows, designs: Designs, limits: Limits, only: tuple[str, ...] = ()) -> Judged:
    """Return the columns of n rows as `boulder_kernels.rules.consider_rows` left their solutions and courses."""
    facts, reasons = facts_of(rows, designs, limits)
    columns, words = {}, {}
    for spec in OUTCOMES:
        if only and spec.name not in only:
            continue
        if spec.type == "dictionary":
            words[spec.name] = reasons if spec.name == "reason" else spec.words
        if spec.name == "validity":
            values, words[spec.name] = flagged(facts, rows.counted)
        else:
            values = spec.value(facts) if spec.value else grades_without_asking(facts)
        if spec.rows != "all":
            none = -1 if spec.type == "dictionary" else np.nan
            values = np.where(facts.rows[spec.rows], values, none).astype(values.dtype, copy=False)
        columns[spec.name] = values
    return Judged(columns, words)


def facts_of(rows: Rows, designs: Designs, limits: Limits) -> tuple[Facts, tuple[str, ...]]:
    """Return what is known of n rows, see `judged_rows`, and the words of their reasons."""
    outcomes, courses = outcome_table(rows.counted), rows.courses
    status, rule, penetration = outcomes.status, courses["rule"].astype(np.intp), courses["penetration"]
    verdict, reason = _VERDICTS.take(rule), _REASONS.take(rule)
    failed = rule == verdicts.NOT_COMPUTED
    reasons: tuple[str, ...] = REASONS
    if failed.any():
        reason[failed], reasons = _error_reasons(status[failed])
    standing, overturned = rule >= verdicts.PENETRATION, rule == verdicts.OVERTURNS
    computed = standing | overturned
    rated = standing & (rule != verdicts.SLOWER_TRUCK) & ~((verdict == UNDECIDED) & (reason != NUMERICAL_ERROR))
    facts = Facts(
        outcomes=outcomes,
        designs=designs,
        limits=limits,
        rows={
            "judged": verdict != ERROR,
            "computed": computed,
            "free": computed & ~(overturned & (status == Status.LIMIT)),
            "rated": rated,
            "overturned": overturned,
            "passing": verdict == PASS,
        },
        overlap=courses["overlap"],
        penetration=penetration,
        margin=courses["margin"],
        verdict=verdict,
        reason=reason,
        rating=_ratings(penetration),
    )
    return facts, reasons


def limits_of(sweep: Sweep) -> Limits:
    """Return the limits of a sweep."""
    return Limits(
        rotation=math.radians(sweep.criterion.max_rotation_deg),
        rating=sweep.criterion.rating,
        criterion=sweep.criterion,
        calibrated_crush=sweep.model.calibrated_crush_m,
        tested_rotation=largest_tested_rotation(sweep.model.preset),
        studied=is_studied(sweep),
        odd_layers=has_odd_layers(sweep.model.ground),
        flat_foot=sweep.model.stands_flat,
    )


def _ratings(penetration: np.ndarray) -> np.ndarray:
    """Code of the best rating that each penetration [m] achieves; -1 beyond the last and for NaN."""
    codes = np.zeros(penetration.shape, dtype=np.int32)
    for rating in RATINGS:
        codes += ~(penetration <= PENETRATION_LIMITS_M[rating])
    codes[codes == len(RATINGS)] = -1
    return codes


def _error_reasons(status: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Reason codes of rows that could not be computed, and the reasons they index."""
    # Many times as fast as `numpy.isin` for so few.
    not_finite = np.logical_or.reduce([status == kind for kind in SIMULATED])
    texts = {int(kind): text for kind, text in STATUS_REASONS.items()}
    rows = {
        texts.get(int(kind), f"the kernels ended with the unknown status {kind}"): status == kind
        for kind in np.unique(status[~not_finite])
    }
    if not_finite.any():
        rows[NOT_FINITE] = not_finite
    named = tuple(sorted(rows))
    reason = np.zeros(status.shape, dtype=np.int32)
    for k, text in enumerate(named):
        reason[rows[text]] = len(REASONS) + k
    return reason, (*REASONS, *named)
