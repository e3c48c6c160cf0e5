"""Rows that are simulated again: by finer steps, past the horizon, and before slower trucks."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, Status, corrected, simulate_table
from boulder_kernels.rules import AGREEING, FIRST_FACTOR, SLOWER_SPEEDS
from boulder_sweep.columns import OUTCOME_COLUMNS, REASONS, VERDICTS
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.judge.accuracy import (
    FACTOR,
    LAST_RESORT_STEPS,
    LONGEST_HORIZON,
    MOST_STEPS,
    STEPS,
    accuracy_of,
    control_of,
    finer_controls,
    reported_step_s,
)
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import ERROR, FAIL, NUMERICAL_ERROR, PASS, UNDECIDED
from boulder_sweep.judge.verdict import Limits
from tests.judge.plain import plain_designs

CONTROL = Control(0.012, 1.0, math.radians(20.0), 0, True, longest_horizon=10.0)
LIMITS = Limits(CONTROL.theta_limit, "P1")


def evaluation(control: Control = CONTROL, limits: Limits = LIMITS, simulate=simulate_table) -> Evaluation:
    return Evaluation(corrected(), control, limits, simulate)


def test_steps_get_shorter_down_to_the_budget() -> None:
    controls = list(finer_controls(CONTROL))
    finer, (last, *confirming) = controls[: -1 - AGREEING], controls[-1 - AGREEING :]
    steps = [control.h for control in finer]
    factors = [FIRST_FACTOR] * AGREEING + [FACTOR] * (len(steps) - AGREEING)
    assert np.allclose(np.divide(steps, [CONTROL.h, *steps[:-1]]), factors, rtol=1e-12), "late rows compare such steps"
    assert FACTOR < steps[-1] * MOST_STEPS / CONTROL.horizon <= 1.0
    assert all(control.locate_yield and not control.last_resort for control in finer)
    assert last.last_resort
    assert last.h == CONTROL.horizon / LAST_RESORT_STEPS
    assert confirming == [last._replace(h=last.h * FACTOR**n) for n in range(1, 1 + AGREEING)]
    alone = CONTROL._replace(h=1e-6, error_estimate=False)
    assert list(finer_controls(alone)) == [last._replace(h=1e-6, error_estimate=False)]
    assert len(list(finer_controls(CONTROL._replace(h=0.012, elements=100_000, error_estimate=True)))) == AGREEING
    sums = list(finer_controls(CONTROL._replace(elements=5000)))
    assert len(sums) < len(steps)
    assert not any(control.last_resort for control in sums)


def test_a_design_that_is_too_stiff_for_its_steps_is_decided_by_finer_ones() -> None:
    stiff = plain_designs(beta=1e6)
    once = simulate_table(stiff.table, corrected(), CONTROL)
    assert once.status[0] == Status.STIFF_SOIL
    row = evaluation().judged(stiff).row(0)
    assert row["verdict"] in ("pass", "fail")
    assert row["step_s"] < reported_step_s(CONTROL)


def test_a_row_says_by_which_step_it_was_decided() -> None:
    row = evaluation().judged(plain_designs()).row(0)
    assert row["step_s"] == reported_step_s(CONTROL) == 0.004
    unconfirmed = CONTROL._replace(error_estimate=False)
    assert evaluation(unconfirmed).judged(plain_designs()).row(0)["step_s"] == 0.012
    assert evaluation().judged(plain_designs(H=1.5)).row(0)["step_s"] is None  # no contact: nothing was simulated


def test_a_limit_within_the_error_of_the_peak_is_decided_by_finer_steps() -> None:
    standing = designs_of(crash_test("rwg").block(0, 1))
    coarse = simulate_table(standing.table, corrected(), CONTROL)
    assert coarse.status[0] == Status.SETTLED
    limit = float(coarse.theta_max[0] + 0.3 * coarse.theta_error[0])
    control = CONTROL._replace(theta_limit=limit)
    row = evaluation(control, Limits(limit, "P1")).judged(standing).row(0)
    assert row["verdict"] == "pass"
    assert row["step_s"] < reported_step_s(CONTROL)


def test_an_unconfirmed_row_within_its_error_of_a_limit_stays_undecided() -> None:
    """As by `fast` and a given step; the row of a confirmed accuracy is decided, see above."""
    standing = designs_of(crash_test("rwg").block(0, 1))
    once = CONTROL._replace(error_estimate=False)
    found = simulate_table(standing.table, corrected(), once)
    limit = float(found.theta_max[0] + 0.3 * found.theta_error[0])
    row = evaluation(once._replace(theta_limit=limit), Limits(limit, "P1")).judged(standing).row(0)
    assert (row["verdict"], row["reason"]) == ("undecided", "error")
    assert row["step_s"] == once.h


HARD = {"beta": 1e9, "rho_b": 1e-3, "rho_s": 1e-3, "L": 0.1}
"""What no step decides."""


def mixed() -> Designs:
    """Usual designs, stiff ones, and one that no step decides."""
    pieces = [plain_designs(3), plain_designs(2, beta=1e6), plain_designs(1, **HARD), plain_designs(2, H=1.5)]
    table = type(pieces[0].table)(*(np.concatenate(column) for column in zip(*(p.table for p in pieces), strict=True)))
    return Designs(table, np.concatenate([piece.bed_offset for piece in pieces]))


def test_a_row_is_the_same_whatever_stands_beside_it() -> None:
    designs = mixed()
    whole = evaluation().judged(designs)
    order = np.array([4, 0, 7, 3, 6, 2, 1, 5])
    shuffled = evaluation().judged(designs.rows(order))
    for place, row in enumerate(order.tolist()):
        assert shuffled.row(place) == whole.row(row) == evaluation().judged(designs.rows(slice(row, row + 1))).row(0)


def test_a_damper_that_is_too_weak_for_its_spring_is_decided_all_the_same() -> None:
    """Nothing holds the truck up: it drives on over the boulder, far beyond its rating."""
    weak = plain_designs(c_v=0.1)
    assert simulate_table(weak.table, corrected(), CONTROL).status[0] == Status.WEAK_DAMPER
    row = evaluation().judged(weak).row(0)
    assert (row["verdict"], row["reason"]) == ("fail", "penetration")
    assert row["max_vehicle_displacement_m"] == pytest.approx(weak.table.v_0[0] * row["end_time_s"], rel=1e-3)


def test_what_no_step_decides_keeps_its_reason() -> None:
    row = evaluation().judged(plain_designs(**HARD)).row(0)
    assert row["verdict"] == "error"
    assert "soil is too stiff" in row["reason"]
    values = [row[name] for name in OUTCOME_COLUMNS if name not in ("verdict", "reason")]
    assert values == [None] * len(values)


def test_only_open_rows_are_simulated_again() -> None:
    sizes = []

    def watched(table, readings, control) -> OutcomeTable:
        sizes.append(table.L.size)
        return simulate_table(table, readings, control)

    rows = evaluation(simulate=watched).judged(mixed())
    assert sizes[:2] == [8, 3]
    assert sizes[-1] == 1
    assert np.count_nonzero(rows.verdict == VERDICTS.index("error")) == 1


SHALLOW = Path(__file__).parent / "late_designs.csv"
"""Boulders that rock for seconds. An independent integration by steps of 0.1 ms (`tests.rk4`) finds: the first
two overturn at 7.0313 s and 6.769 s, the third stands for 10 s and overturns later, the fourth stands, at most 16.034
deg. But slower trucks overturn the first, second and fourth."""


def sweep_file(folder: Path, accuracy: str = "balanced") -> Path:
    grid = folder / "grid.yaml"
    grid.write_text(f"name: shallow\ntable: {SHALLOW}\nsolver: {{accuracy: {accuracy}}}\n")
    return grid


def sweep_of(folder: Path, accuracy: str = "balanced") -> boulder_sweep.Sweep:
    return boulder_sweep.load(sweep_file(folder, accuracy))


def designs_in(sweep: boulder_sweep.Sweep) -> Designs:
    return designs_of(sweep.block(0, sweep.n_designs), None)


@pytest.mark.parametrize("accuracy", ["balanced", "fine"])
def test_shallow_boulders_end_as_an_independent_integration_says(tmp_path: Path, accuracy: str) -> None:
    sweep = sweep_of(tmp_path, accuracy)
    found = evaluation_of(sweep, accuracy_of(sweep)).judged(designs_in(sweep))
    rows = [found.row(place) for place in range(4)]
    assert [(row["verdict"], row["reason"]) for row in rows] == [
        ("fail", "overturns"),
        ("fail", "overturns"),
        ("undecided", "horizon"),
        ("fail", "slower_truck"),
    ]
    assert rows[0]["time_to_limit_s"] == pytest.approx(7.0313, abs=2e-4)
    assert rows[1]["time_to_limit_s"] == pytest.approx(6.769, abs=3e-3)
    assert rows[2]["max_rotation_deg"] == pytest.approx(3.4489, abs=1e-3)
    assert rows[3]["max_rotation_deg"] == pytest.approx(16.0344, abs=1e-3)


def test_an_overturned_row_has_an_error_of_its_time_and_none_of_its_rotation(tmp_path: Path) -> None:
    sweep = sweep_of(tmp_path)
    found = evaluation_of(sweep, accuracy_of(sweep)).judged(designs_in(sweep))
    overturned, standing = found.row(0), found.row(3)
    assert overturned["rotation_error_deg"] is None
    assert 0.0 < overturned["time_to_limit_error_s"] < 0.1
    assert standing["time_to_limit_error_s"] is None
    assert 0.0 < standing["rotation_error_deg"] < 0.1


def stand_in(ends: dict[int, tuple[Status, float]], asked: list[float], ways: dict[int, float] | None = None):
    """Kernels whose solutions at each refinement (0, 1, ...) end after 5 s in some way, at some rotation [rad].

    The way of the truck is 1 m, unless `ways` says otherwise [m].
    """

    def simulate(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
        asked.append(control.h)
        level = len(asked) - 1
        status, theta = ends.get(level, ends[max(ends)])
        out = simulate_table(table, readings, control._replace(h=0.001, horizon=0.01, longest_horizon=0.0))
        n = len(table.L)
        at_limit = status == Status.LIMIT
        return out._replace(
            status=np.full(n, status, np.int8),
            theta_max=np.full(n, theta),
            x_v_max=np.full(n, (ways or {}).get(level, 1.0)),
            t_limit=np.full(n, 5.0 if at_limit else np.nan),
            t_end=np.full(n, 5.0),
            theta_error=np.full(n, 0.0 if at_limit else 1e-4),
            x_error=np.full(n, 1e-3),
        )

    return simulate


def judged_by(
    folder: Path, ends: dict[int, tuple[Status, float]], asked: list[float], ways: dict[int, float] | None = None
):
    sweep = sweep_of(folder)
    evaluation = replace(evaluation_of(sweep, accuracy_of(sweep)), simulate=stand_in(ends, asked, ways))
    return evaluation.judged(designs_in(sweep).rows(slice(3, 4)))


FAR_M = 9.0
"""Way of a truck whose cargo bed passes the boulder by more than P1 allows [m]."""
SAME, REFUSED, OVERTURNED = (Status.SETTLED, 0.1), (Status.WEAK_DAMPER, 0.0), (Status.LIMIT, np.radians(20.0))
OPEN = (UNDECIDED, NUMERICAL_ERROR)
PASSES, OVERTURNS, PENETRATES = (
    (PASS if not why else FAIL, REASONS.index(why)) for why in ("", "overturns", "penetration")
)


@pytest.mark.parametrize(
    ("ends", "ways", "decided", "solutions"),
    [
        ({0: SAME}, {}, PASSES, 1 + AGREEING),
        (dict.fromkeys(range(AGREEING), SAME) | {AGREEING: OVERTURNED}, {}, OVERTURNS, 1 + 2 * AGREEING),
        ({0: SAME, 1: (Status.SETTLED, 0.1 + 2e-4)}, {}, PASSES, 2 + AGREEING),
        ({level: (Status.SETTLED, 0.1 + 1e-3 * level) for level in range(40)}, {}, OPEN, None),
        ({0: SAME}, dict.fromkeys(range(40), FAR_M), PENETRATES, 2),
        ({0: SAME}, {0: FAR_M} | dict.fromkeys(range(1, 40), FAR_M + 0.9e-3), PENETRATES, 2),  # each is off by 1 mm
        ({0: SAME}, {0: FAR_M} | dict.fromkeys(range(1, 40), FAR_M + 1.1e-3), PENETRATES, 3),
        ({0: SAME}, {level: FAR_M + 0.01 * level for level in range(40)}, OPEN, None),
        (dict.fromkeys(range(6), REFUSED) | {6: SAME}, {}, PASSES, 7 + AGREEING),
        ({0: REFUSED}, {}, (ERROR, None), 7),
    ],
    ids=[
        *("agree", "finer steps overturn", "the peak moves", "no two peaks agree", "penetrates", "ways agree"),
        *("ways do not", "no two ways agree", "last resort", "last resort refuses"),
    ],
)
def test_a_late_row_needs_finer_solutions_that_agree(tmp_path: Path, ends, ways, decided, solutions) -> None:
    asked: list[float] = []
    found = judged_by(tmp_path, ends, asked, ways)
    assert found.verdict[0] == decided[0]
    assert decided[1] in (None, found.reason[0])
    assert len(asked) == solutions if solutions else len(asked) > 3
    if decided == PASSES and ends == {0: SAME}:
        assert np.allclose(np.divide(asked[1:], asked[:-1]), FIRST_FACTOR)
    if REFUSED in ends.values() and decided == PASSES:
        assert np.allclose(np.divide(asked[7:], asked[6:-1]), FACTOR)
    if decided == OPEN:
        assert (found.row(0)["rotation_error_deg"], found.row(0)["displacement_error_m"]) == (None, None)


def test_there_are_finer_steps_however_many_soil_elements(tmp_path: Path) -> None:
    asked: list[float] = []
    sweep = boulder_sweep.load(sweep_file(tmp_path), ["model.soil.elements=5000"])
    evaluation = replace(evaluation_of(sweep, accuracy_of(sweep)), simulate=stand_in({0: (Status.SETTLED, 0.1)}, asked))
    found = evaluation.judged(designs_in(sweep).rows(slice(3, 4)))
    assert found.verdict[0] == PASS
    assert len(asked) == 1 + AGREEING


def test_a_last_resort_whose_steps_are_hardly_shorter_confirms_nothing(tmp_path: Path) -> None:
    asked: list[float] = []
    peaks = {0: 0.1, 1: 0.11, 2: 0.115, 3: 0.12, 6: 0.12}
    ends = {level: (Status.SETTLED, peak) for level, peak in peaks.items()} | dict.fromkeys((4, 5), REFUSED)
    found = judged_by(tmp_path, ends, asked)
    assert found.verdict[0] == PASS
    assert np.allclose(asked[3:], [7.5e-4, 7.5e-4 * FACTOR, 7.5e-4 * FACTOR**2, 5e-4 * FACTOR, 5e-4 * FACTOR**2])


def test_rows_without_an_estimate_of_their_error_are_not_repeated(tmp_path: Path) -> None:
    asked: list[float] = []
    sweep = sweep_of(tmp_path, "fast")
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    evaluation = replace(evaluation, simulate=stand_in({0: (Status.SETTLED, 0.1)}, asked))
    evaluation.judged(designs_in(sweep).rows(slice(3, 4)))
    assert len(asked) == 1
    assert not control_of(sweep, accuracy_of(sweep)).error_estimate


def test_where_one_solution_overturns_and_the_other_does_not_nothing_is_decided(tmp_path: Path) -> None:
    sweep = sweep_of(tmp_path)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))

    def disagree(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
        out = stand_in({0: (Status.LIMIT, np.radians(20.0))}, [])(table, readings, control)
        return out._replace(theta_error=np.full(len(table.L), np.inf), x_error=np.full(len(table.L), np.inf))

    found = replace(evaluation, simulate=disagree).judged(designs_in(sweep).rows(slice(0, 1)))
    assert (found.verdict[0], found.reason[0]) == (UNDECIDED, NUMERICAL_ERROR)
    assert np.isnan(found["time_to_limit_s"][0])


LIMIT = math.radians(20.0)
SLOWER = Control(STEPS["balanced"].step_s, 1.0, LIMIT, 0, error_estimate=True, longest_horizon=LONGEST_HORIZON)
BALANCED = Evaluation(corrected(), SLOWER, Limits(LIMIT, "P1"))
ISLAND = {
    "L": 2.0, "W": 2.4, "H": 2.0, "rho_b": 2600.0, "d": 0.6, "rho_s": 1860.0, "phi": math.radians(32.0), "beta": 30.0,
    "m_v": 6803.8856, "v_0": 13.4112, "k_v": 3103.3e3, "c_v": 138.91e3, "e": 0.95,
}  # fmt: skip
"""It stops 15,000 lb at 30 mph, and 12.6 m/s overturn it."""


def test_a_boulder_that_a_slower_truck_overturns_fails() -> None:
    row = BALANCED.judged(plain_designs(**ISLAND)).row(0)
    assert (row["verdict"], row["reason"]) == ("fail", "slower_truck")
    # The motion reported is the one with its own truck, and nothing of it is a reserve.
    assert row["max_rotation_deg"] == pytest.approx(18.62, abs=0.01)
    assert row["margin"] is None
    assert row["rating"] is None
    assert row["time_to_limit_s"] is None
    assert row["robustness"] is None


def test_the_slower_truck_does_overturn_it() -> None:
    slower = BALANCED.judged(plain_designs(**ISLAND | {"v_0": 12.6})).row(0)
    assert (slower["verdict"], slower["reason"]) == ("fail", "overturns")
    assert slower["time_to_limit_s"] == pytest.approx(3.5563, abs=2e-3)


def shallow(n: int, seed: int) -> Designs:
    """Shallow, broad boulders in weak soil, many of which slide."""
    rng = np.random.default_rng(seed)
    ranges = {"L": (1.5, 2.5), "W": (1.8, 2.6), "H": (1.8, 3.0), "phi": (0.5, 0.7), "beta": (15.0, 60.0)}
    columns = {name: rng.uniform(*ends, n) for name, ends in ranges.items()}
    columns |= {"d": columns["H"] * rng.uniform(0.2, 0.45, n), "v_0": rng.uniform(6.0, 14.0, n)}
    designs = plain_designs(n)
    return designs._replace(table=designs.table._replace(**columns))


def test_a_pass_of_a_sample_stops_every_slower_truck_of_the_steps() -> None:
    designs = shallow(400, 3)
    judged = BALANCED.judged(designs)
    asked = (designs.table.d / designs.table.H < 0.45) & (judged["max_displacement_m"] > 0.3)
    assert np.count_nonzero(judged.verdict[asked] == FAIL) > 0
    passes = designs.rows(asked & (judged.verdict == PASS))
    assert passes.size > 5
    for share in SLOWER_SPEEDS[::4]:
        slower = passes._replace(table=passes.table._replace(v_0=share * passes.table.v_0))
        assert np.all(BALANCED.judged(slower).verdict == PASS)


def test_hardly_buried_boulders_that_slide_far_never_pass() -> None:
    designs = shallow(400, 5)
    judged = BALANCED.judged(designs)
    islands = (designs.table.d / designs.table.H < 0.35) & (judged["max_displacement_m"] > 0.5)
    assert islands.any()
    assert not np.any(judged.verdict[islands] == PASS)


def test_nothing_beyond_twenty_degrees_passes() -> None:
    """By a criterion that allows more: what passes is what passes by 20 degrees."""
    designs = shallow(200, 6)
    wide = math.radians(30.0)
    free = Evaluation(corrected(), SLOWER._replace(theta_limit=wide), Limits(wide, "P1")).judged(designs)
    beyond = free["max_rotation_deg"] > 20.0
    assert np.count_nonzero(beyond & (free["max_rotation_deg"] < 29.9)) > 0
    assert not np.any(free.verdict[beyond] == PASS)
    assert np.array_equal(free.verdict == PASS, BALANCED.judged(designs).verdict == PASS)


def test_under_fast_what_moves_on_past_the_horizon_is_undecided() -> None:
    """19.957 degrees by steps of 12 ms, of which nothing was confirmed; it overturns at 3.81 s."""
    design = plain_designs(
        L=1.5375571249499285, W=2.175198055331226, H=1.6808001011478457, rho_b=2819.522933061269,
        rho_s=1809.786771103301, phi=math.radians(34.73782132929777), beta=45.234031048714925,
        K_epsilon=1.0089494986948633, m_v=2747.2833740516544, v_0=10.074890724422222, k_v=3031631.8403099314,
        c_v=241883.0894786279, e_bumper=0.40685987701996207, d=0.46008425824746196,
        e=0.5 * (1.6808001011478457 - 0.46008425824746196 + 0.40685987701996207),
    )  # fmt: skip
    quick = SLOWER._replace(error_estimate=False, longest_horizon=0.0)
    row = Evaluation(corrected(), quick, Limits(LIMIT, "P1")).judged(design).row(0)
    assert (row["verdict"], row["reason"]) == ("undecided", "horizon")
    decided = BALANCED.judged(design).row(0)
    assert (decided["verdict"], decided["reason"]) == ("fail", "overturns")
    assert decided["time_to_limit_s"] == pytest.approx(3.8137, abs=2e-3)
