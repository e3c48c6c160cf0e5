"""Rows that are refused for their steps, or undecided for their error, are simulated again by finer steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boulder_kernels import Control, OutcomeTable, Status, corrected
from boulder_kernels.rules import AGREEING, FIRST_FACTOR
from boulder_sweep.columns import OUTCOME_COLUMNS, VERDICTS
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.judge.accuracy import FACTOR, LAST_RESORT_STEPS, MOST_STEPS, finer_controls, reported_step_s
from boulder_sweep.judge.evaluation import Evaluation, by_kernels
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.verdict import Limits
from tests.judge.plain import plain_designs

CONTROL = Control(0.012, 1.0, math.radians(20.0), 0, True, longest_horizon=10.0)
LIMITS = Limits(CONTROL.theta_limit, "P1")


def evaluation(control: Control = CONTROL, limits: Limits = LIMITS, simulate=by_kernels) -> Evaluation:
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
    once = by_kernels(stiff.table, corrected(), CONTROL)
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
    coarse = by_kernels(standing.table, corrected(), CONTROL)
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
    found = by_kernels(standing.table, corrected(), once)
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
    assert by_kernels(weak.table, corrected(), CONTROL).status[0] == Status.WEAK_DAMPER
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
        return by_kernels(table, readings, control)

    rows = evaluation(simulate=watched).judged(mixed())
    assert sizes[:2] == [8, 3]
    assert sizes[-1] == 1
    assert np.count_nonzero(rows.verdict == VERDICTS.index("error")) == 1
