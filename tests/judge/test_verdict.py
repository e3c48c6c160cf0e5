"""The rules of the verdict, one by one and against a plain reading of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import boulder_sweep
from boulder_kernels import SIMULATED, OutcomeTable, Status
from boulder_sweep.columns import OUTCOME_COLUMNS, RATINGS, REASONS, VERDICTS
from boulder_sweep.judge.judged import Judged
from boulder_sweep.judge.validity import TESTED_ROTATION_DEG
from boulder_sweep.judge.verdict import NOT_FINITE, PENETRATION_LIMITS_M, STATUS_REASONS, Limits, judge, limits_of
from boulder_sweep.settings.model import Criterion
from tests.judge.plain import plain_designs
from tests.runner.grids import grid

CONFIGS = Path(__file__).parents[2] / "configs"
LIMIT = math.radians(20.0)
NAN = math.nan
LENGTH, BED = 1.5, 2.9


def outcome(status: Status, **values: float) -> OutcomeTable:
    """One row that passes unless told otherwise."""
    row = {
        "theta_max": 0.1,
        "x_b_max": 0.2,
        "x_v_max": 1.0,
        "F_v_max": 1e6,
        "crush_max": 0.6,
        "t_limit": NAN,
        "t_end": 0.3,
        "theta_error": NAN,
        "x_error": NAN,
        "step": 0.004,
        **values,
    }
    arrays = {name: np.array([value]) for name, value in row.items()}
    return OutcomeTable(status=np.array([status], dtype=np.int8), **arrays)


def not_simulated(status: Status) -> OutcomeTable:
    """One row without values."""
    return OutcomeTable(np.array([status], dtype=np.int8), *(np.array([NAN]) for _ in OutcomeTable._fields[1:]))


def judged(outcomes: OutcomeTable, rating: str = "P1") -> Judged:
    n = len(outcomes.status)
    return judge(outcomes, plain_designs(n, L=LENGTH, bed_offset=BED), Limits(LIMIT, rating))


def only(row: Judged) -> tuple[str, str]:
    """Verdict and reason of the only row."""
    return VERDICTS[row.verdict[0]], row.reasons[row.reason[0]]


def test_outcome_columns_are_those_of_the_register():
    assert tuple(judged(outcome(Status.SETTLED)).columns) == OUTCOME_COLUMNS
    assert tuple(PENETRATION_LIMITS_M) == RATINGS


def test_what_cannot_be_proved_is_undecided():
    row = judged(outcome(Status.UNPROVABLE))
    assert only(row) == ("undecided", "horizon")
    assert np.isnan(row["margin"][0])


@pytest.mark.parametrize("status", [Status.SETTLED, Status.BELOW_LIMIT])
def test_pass(status):
    row = judged(outcome(status))
    assert only(row) == ("pass", "")
    assert row["margin"][0] == pytest.approx((LIMIT - 0.1) / LIMIT)
    assert row["max_rotation_deg"][0] == pytest.approx(math.degrees(0.1))
    assert row["peak_force_kN"][0] == 1000.0
    assert row["penetration_m"][0] == pytest.approx(1.0 - BED - LENGTH)
    assert RATINGS[row["rating"][0]] == "P1"
    assert np.isnan(row["time_to_limit_s"][0])


def test_no_contact_fails_without_any_value():
    row = judged(not_simulated(Status.NO_CONTACT))
    assert only(row) == ("fail", "no_contact")
    for name in ("rating", "shape", "robustness", "stands_under"):
        assert row[name][0] == -1
    for name in OUTCOME_COLUMNS[2:]:
        if name not in ("rating", "overlap_m", "solidity", "shape", "validity", "robustness", "stands_under"):
            assert np.isnan(row[name][0]), name


def test_overturned_fails_whatever_the_penetration():
    row = judged(outcome(Status.LIMIT, theta_max=LIMIT, t_limit=0.08))
    assert only(row) == ("fail", "overturns")
    assert np.isnan(row["margin"][0])
    assert row["rating"][0] == -1
    assert row["time_to_limit_s"][0] == 0.08
    assert row["penetration_m"][0] < 0  # reported, but it decides nothing


def test_a_design_exactly_on_the_rotation_limit_overturns():
    assert only(judged(outcome(Status.SETTLED, theta_max=LIMIT))) == ("fail", "overturns")
    below = np.nextafter(LIMIT, 0.0)
    assert only(judged(outcome(Status.SETTLED, theta_max=below))) == ("pass", "")


def x_v(penetration: float) -> float:
    return penetration + BED + LENGTH


@pytest.mark.parametrize(("required", "limit"), [("P1", 1.0), ("P2", 7.0), ("P3", 30.0)])
def test_penetration_beyond_the_required_rating_fails(required, limit):
    beyond = judged(outcome(Status.SETTLED, x_v_max=x_v(limit * 1.01)), required)
    assert only(beyond) == ("fail", "penetration")
    assert beyond["margin"][0] == pytest.approx(-0.01)
    within = judged(outcome(Status.SETTLED, x_v_max=x_v(limit * 0.99)), required)
    assert only(within) == ("pass", "")
    assert within["margin"][0] == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("penetration", "rating"), [(-3.0, "P1"), (0.99, "P1"), (1.01, "P2"), (6.9, "P2"), (29.0, "P3"), (31.0, None)]
)
def test_rating_is_the_best_that_is_kept(penetration, rating):
    code = judged(outcome(Status.SETTLED, x_v_max=x_v(penetration)), "P3")["rating"][0]
    assert (RATINGS[code] if code >= 0 else None) == rating


@pytest.mark.parametrize("status", [Status.HORIZON, Status.OUTWARD])
def test_without_proof_at_the_horizon_a_row_is_undecided_unless_something_worse_is_known(status):
    row = judged(outcome(status))
    assert only(row) == ("undecided", "horizon")
    assert np.isnan(row["margin"][0])
    assert row["rating"][0] == -1
    assert row["max_rotation_deg"][0] == pytest.approx(math.degrees(0.1))  # up to end_time_s
    assert only(judged(outcome(status, x_v_max=x_v(1.5)))) == ("fail", "penetration")


def test_more_crush_than_the_front_is_long_is_never_a_pass():
    assert only(judged(outcome(Status.SETTLED, crush_max=BED))) == ("pass", "")
    row = judged(outcome(Status.SETTLED, crush_max=1.001 * BED))
    assert only(row) == ("undecided", "crush")
    assert np.isnan(row["margin"][0])
    assert row["rating"][0] == -1
    assert only(judged(outcome(Status.SETTLED, crush_max=4.0, x_v_max=x_v(1.5)))) == ("fail", "penetration")
    assert only(judged(outcome(Status.LIMIT, crush_max=4.0))) == ("fail", "overturns")
    near = outcome(Status.SETTLED, crush_max=BED - 1e-4, x_error=2e-4)
    assert only(judged(near)) == ("undecided", "error")


@pytest.mark.parametrize(("overlap", "found"), [(0.26, ("pass", "")), (0.24, ("undecided", "override"))])
def test_a_boulder_that_barely_reaches_the_bumper_does_not_pass(overlap, found):
    designs = plain_designs(H=2.0 + overlap, d=1.5, e_bumper=0.5)
    row = judge(outcome(Status.SETTLED), designs, Limits(LIMIT, "P1"))
    assert only(row) == found
    assert row["overlap_m"][0] == pytest.approx(overlap)
    assert only(judge(outcome(Status.SETTLED), designs, Limits(LIMIT, "P1", Criterion(min_overlap_m=0.0)))) == (
        "pass",
        "",
    )
    overturned = judge(outcome(Status.LIMIT), designs, Limits(LIMIT, "P1"))
    assert only(overturned) == ("fail", "overturns")


def test_limits_are_those_of_the_settings():
    sweep = grid(rotation="15 deg")
    limits = limits_of(sweep)
    assert limits.rotation == pytest.approx(math.radians(15.0))
    assert (limits.criterion.min_overlap_m, limits.calibrated_crush) == (0.25, 1.0)
    changes = ["criterion.min_overlap=10 in", "vehicle.calibrated_crush=0.8 m", "model.readings=as_printed"]
    limits = limits_of(boulder_sweep.load(CONFIGS / "rwg.yaml", changes))
    assert limits.criterion.min_overlap_m == pytest.approx(0.254)
    assert limits.calibrated_crush == 0.8
    assert math.degrees(limits.tested_rotation) == pytest.approx(TESTED_ROTATION_DEG["as_printed"])


def test_a_peak_nearer_to_its_limit_than_its_error_is_undecided():
    near = LIMIT - 1e-4
    assert only(judged(outcome(Status.SETTLED, theta_max=near, theta_error=2e-4))) == ("undecided", "error")
    assert only(judged(outcome(Status.SETTLED, theta_max=near, theta_error=0.5e-4))) == ("pass", "")
    close = x_v(0.999)
    assert only(judged(outcome(Status.SETTLED, x_v_max=close, x_error=2e-3))) == ("undecided", "error")
    assert only(judged(outcome(Status.SETTLED, x_v_max=close, x_error=0.5e-3))) == ("pass", "")


def test_a_crossing_is_decided_whatever_its_error():
    crossed = outcome(Status.LIMIT, theta_max=LIMIT, t_limit=0.1, theta_error=1.0, x_error=10.0)
    assert only(judged(crossed)) == ("fail", "overturns")
    too_deep = outcome(Status.SETTLED, x_v_max=x_v(1.001), x_error=1.0)
    assert only(judged(too_deep)) == ("fail", "penetration")


def test_without_an_error_estimate_the_verdict_is_unguarded():
    row = judged(outcome(Status.SETTLED, theta_max=np.nextafter(LIMIT, 0.0)))
    assert only(row) == ("pass", "")
    assert np.isnan(row["rotation_error_deg"][0])


@pytest.mark.parametrize("status", list(STATUS_REASONS))
def test_designs_that_the_kernels_gave_up_are_errors_with_a_reason(status):
    row = judged(not_simulated(status))
    assert only(row) == ("error", STATUS_REASONS[status])
    assert row["rating"][0] == -1
    assert np.isnan(row["margin"][0])


def test_every_status_is_either_computed_or_has_its_reason():
    computed = {Status.NO_CONTACT, *SIMULATED}
    assert computed | set(STATUS_REASONS) == set(Status)


def test_a_result_that_is_not_finite_is_an_error_not_a_pass():
    row = judged(outcome(Status.SETTLED, theta_max=NAN))
    assert only(row) == ("error", NOT_FINITE)
    assert np.isnan(row["max_displacement_m"][0])


def test_an_unknown_status_is_an_error():
    unknown = outcome(Status.SETTLED)._replace(status=np.array([99], dtype=np.int8))
    verdict, reason = only(judged(unknown))
    assert verdict == "error"
    assert "99" in reason


def plain_reading(row: dict[str, float], status: Status, limit: float) -> tuple[str, str]:
    """The rules again, for one row, as one would say them."""
    penetration = row["x_v_max"] - BED - LENGTH
    if status in STATUS_REASONS:
        return "error", STATUS_REASONS[status]
    if status == Status.NO_CONTACT:
        return "fail", "no_contact"
    if status == Status.LIMIT or row["theta_max"] >= LIMIT:
        return "fail", "overturns"
    if penetration > limit:
        return "fail", "penetration"
    if row["crush_max"] > BED:
        return "undecided", "crush"
    if status in (Status.OUTWARD, Status.HORIZON, Status.UNPROVABLE):
        return "undecided", "horizon"
    distances = limit - penetration, BED - row["crush_max"]
    if LIMIT - row["theta_max"] < row["theta_error"] or min(distances) < row["x_error"]:
        return "undecided", "error"
    return "pass", ""


rows = st.fixed_dictionaries(
    {
        "theta_max": st.floats(0.0, 0.5),
        "x_b_max": st.floats(-0.1, 2.0),
        "x_v_max": st.floats(0.0, 50.0),
        "F_v_max": st.floats(0.0, 1e8),
        "crush_max": st.floats(0.0, 5.0),
        "t_end": st.floats(0.0, 1.0),
        "theta_error": st.one_of(st.just(NAN), st.floats(0.0, 0.5)),
        "x_error": st.one_of(st.just(NAN), st.floats(0.0, 50.0)),
        "step": st.just(0.004),
    }
)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(rows, st.sampled_from(Status)), min_size=1, max_size=20), st.sampled_from(RATINGS))
def test_vectorised_rules_are_the_plain_ones(table, rating):
    columns = {name: np.array([row[name] for row, _ in table]) for name in table[0][0]}
    status = np.array([kind for _, kind in table], dtype=np.int8)
    outcomes = OutcomeTable(status=status, t_limit=np.full(len(table), NAN), **columns)
    result = judged(outcomes, rating)
    found = [(VERDICTS[v], result.reasons[r]) for v, r in zip(result.verdict, result.reason, strict=True)]
    assert found == [plain_reading(row, kind, PENETRATION_LIMITS_M[rating]) for row, kind in table]
    named = result.reasons[len(REASONS) :]
    assert list(named) == sorted(set(named))
    errors = result.verdict == VERDICTS.index("error")
    assert np.isnan(result["max_rotation_deg"][errors]).all()
    unrated = ("overturns", "no_contact", "horizon", "crush", "override")
    overturned = np.isin(result.reason, [REASONS.index(reason) for reason in unrated])
    assert np.isnan(result["margin"][overturned]).all()
    assert (result["rating"][overturned] == -1).all()
