"""The rules of the verdict and its flags, one by one and against a plain reading of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import boulder_sweep
from boulder_kernels import SIMULATED, Control, OutcomeTable, Status, as_printed, corrected, rules, simulate_table
from boulder_sweep.columns import OUTCOME_COLUMNS, RATINGS, REASONS, VERDICTS
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge import validity
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import CHANGES_SIDE, HORIZON, PASS, UNDECIDED, Judged, joined
from boulder_sweep.judge.validity import FLAGS, TESTED_ROTATION_DEG, flag_counts, has_odd_layers, meanings
from boulder_sweep.judge.verdict import NOT_FINITE, PENETRATION_LIMITS_M, STATUS_REASONS, Limits, judge, limits_of
from boulder_sweep.settings import load
from boulder_sweep.settings.model import PRESETS, Criterion, Ground, Layer
from docs.studies.extremes import box_designs
from docs.studies.random_designs import random_table
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
    assert only(judged(outcome(Status.SETTLED, crush_max=1.001 * BED))) == ("undecided", "crush")


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


LIMITS = Limits(math.radians(20.0), "P1")
INSIDE = {"W": 1.2, "H": 2.7, "d": 1.5, "rho_b": 2600.0, "phi": math.radians(40.0), "beta": 60.0}


def flags_of(row: Judged) -> str:
    """Return the flags of the only row."""
    return str(row.row(0)["validity"])


def one_row(status: Status = Status.SETTLED, changes: dict[str, float] | None = None, **outcomes: float) -> Judged:
    """One row inside what the model was tested on unless told otherwise."""
    return judge(outcome(status, **{"F_v_max": 1e3} | outcomes), plain_designs(**INSIDE | (changes or {})), LIMITS)


def test_inside_there_are_none() -> None:
    assert flags_of(one_row()) == ""


@pytest.mark.parametrize(
    ("flag", "changes", "outcomes"),
    [
        ("crush", {}, {"crush_max": 1.01}),
        ("rotation", {}, {"theta_max": math.radians(13.9)}),
        ("size", {"L": 0.05}, {}),
        ("size", {"W": 0.5}, {}),
        ("embedment", {"d": 1.1, "W": 0.9, "H": 3.3}, {}),
        ("embedment", {"H": 4.0, "d": 3.005}, {}),
        ("rock_density", {"rho_b": 1.0}, {}),
        ("rock_density", {"rho_b": 3100.0}, {}),
        ("soil_pair", {"phi": math.radians(28.0), "beta": 110.0}, {}),
        ("soil_pair", {"beta": 5.0}, {}),
        ("overlap", {"H": 2.4}, {}),
        ("slides", {}, {"x_b_max": 0.51}),
        ("vehicle", {"m_v": 4990.0}, {}),
        ("vehicle", {"m_v": 9010.0}, {}),
        ("vehicle", {"v_0": 10.9}, {}),
        ("vehicle", {"v_0": 18.1}, {}),
        ("vehicle", {"k_v": 1.7e6}, {}),  # mass and speed of a truck, the spring of a softer one
        ("vehicle", {"k_v": 1e8}, {}),
        ("vehicle", {"c_v": 3e5}, {}),
        ("soil", {"phi": math.radians(50.0), "beta": 200.0}, {}),
        ("soil", {"rho_s": 1500.0}, {}),
        ("soil", {"rho_s": 2260.0}, {}),
        ("soil", {"K_epsilon": 1.3}, {}),
        ("soil", {"K_epsilon": 0.9}, {}),
    ],
)
def test_each_flag_is_raised_alone(flag: str, changes: dict[str, float], outcomes: dict[str, float]) -> None:
    row = one_row(changes=changes, **outcomes)
    assert flags_of(row) == flag
    assert row.row(0)["verdict"] == "pass"  # a flag does not change it


@pytest.mark.parametrize(
    ("below", "flag"), [({"friction_angle_deg": 55.0}, "soil"), ({"density_kg_m3": 2300.0}, "soil"), ({}, "")]
)
def test_deeper_layers_count_as_soil(below: dict[str, float], flag: str) -> None:
    usual = {"from_m": 1.0, "density_kg_m3": 2000.0, "friction_angle_deg": 38.0, "subgrade_reaction_MN_m3": 60.0}
    odd = has_odd_layers(Ground((Layer(**usual | below),)))
    row = judge(outcome(Status.SETTLED, F_v_max=1e3), plain_designs(**INSIDE), LIMITS._replace(odd_layers=odd))
    assert flags_of(row) == flag


def test_a_law_of_the_resistance_is_no_strain_rate() -> None:
    """A law is a factor on the strain rate factor in the kernels; the flag looks at what was given."""
    sweep = load(CONFIGS / "rwg.yaml", ["model.resistance=width_capped"])
    designs = designs_of(sweep.block(0, 1), None, sweep.model)
    assert designs.table.K_epsilon[0] < 0.9
    assert flags_of(judge(outcome(Status.SETTLED, F_v_max=1e3), designs, limits_of(sweep))) == ""


def test_several_flags_stand_in_the_order_of_the_register() -> None:
    both = one_row(changes={"rho_b": 1.0}, crush_max=2.0)
    assert flags_of(both) == "crush;rock_density"
    assert meanings(flags_of(both))[1] == "rock lighter or heavier than the study's"
    assert meanings("") == []


def test_words_are_the_same_however_the_rows_are_cut() -> None:
    rows = [
        one_row(),
        one_row(changes={"rho_b": 1.0}),
        one_row(crush_max=2.0),
        one_row(),
    ]
    whole = joined(rows)
    assert whole.words["validity"] == ("", "crush", "rock_density")
    halves = joined([joined(rows[:1]), joined(rows[1:])])
    assert halves.words == whole.words
    assert np.array_equal(halves["validity"], whole["validity"])


def test_counts_by_flag() -> None:
    assert flag_counts([("", 3), ("crush;size", 2), ("size", 1)]) == {"": 3, "crush": 2, "size": 3}
    assert flag_counts([]) == {"": 0}


def test_the_crash_tests_are_inside() -> None:
    """What the thresholds are taken from: the tests lie just inside."""
    rwg, abg = (crash_test(name).constants for name in ("rwg", "abg"))
    for preset in PRESETS:
        found = simulate(crash_test("rwg"), readings=preset)
        assert found.summary()["validity"] == ""
        rotation = found.summary()["max_rotation_deg"]
        assert TESTED_ROTATION_DEG[preset] == pytest.approx(rotation, abs=0.05)
        assert TESTED_ROTATION_DEG[preset] > rotation
    overlap = min(c["boulder_height_m"] - c["embedment_depth_m"] - c["bumper_height_m"] for c in (rwg, abg))
    assert validity.TESTED_OVERLAP_M <= overlap < validity.TESTED_OVERLAP_M + 0.01


def test_a_truck_inside_the_boulder_is_never_a_pass() -> None:
    """65,000 lb at 40 mph before a boulder that stands: it drives 4.6 m, and its cab is 2.9 m long."""
    heavy = plain_designs(
        L=2.0, W=2.5, H=4.0, rho_b=2600.0, d=3.0, e=0.75, rho_s=1860.0, phi=math.radians(42.0), beta=60.0,
        m_v=29483.5, v_0=17.8816, k_v=3103.3e3, c_v=138.91e3,
    )  # fmt: skip
    control = Control(0.008, 1.0, LIMITS.rotation, 0, True, longest_horizon=10.0)
    row = Evaluation(corrected(), control, LIMITS).judged(heavy).row(0)
    assert (row["verdict"], row["reason"]) == ("undecided", "crush")
    assert row["max_rotation_deg"] < 20.0
    assert row["max_vehicle_displacement_m"] == pytest.approx(4.6, abs=0.2)
    assert row["vehicle_crush_m"] > 2.9
    assert str(row["validity"]).startswith("crush")
    assert row["margin"] is None
    assert row["rating"] is None


def test_the_kernels_raise_the_flags_of_the_register() -> None:
    """All but one, which takes several judgements of a design."""
    assert tuple(flag.name for flag in FLAGS) == (*rules.FLAGS, CHANGES_SIDE)
    assert set(rules.UNSTUDIED) < set(rules.FLAGS)


CONTROL = Control(0.008, 1.0, math.radians(20.0), 0, True, longest_horizon=10.0)
WHOLE = Limits(CONTROL.theta_limit, "P1")


def test_as_printed_nothing_passes_and_what_stands_is_undecided() -> None:
    table = random_table(150, 7)
    designs = Designs(table, bed_offset=np.full(table.L.size, 2.9))
    found = Evaluation(as_printed(), CONTROL._replace(h=0.004), WHOLE).judged(designs)
    stands = found.reason == HORIZON
    assert np.count_nonzero(stands) > 10
    assert not np.any(found.verdict == PASS)
    assert np.all(found.verdict[stands] == UNDECIDED)
    assert np.all(found["end_time_s"][stands] == 10.0)
    assert np.all(np.isnan(found["margin"][stands]))


def test_a_boulder_that_does_not_turn_states_no_error_of_degrees() -> None:
    """However small it is, so that an error of the truck over its size would be an angle of many degrees."""
    found = simulate_table(box_designs(1500, 3).table, corrected(), CONTROL)
    still = np.isfinite(found.theta_max) & (found.theta_max < 1e-6)
    assert np.count_nonzero(still) > 20
    assert np.degrees(np.max(found.theta_error[still])) < 0.1
