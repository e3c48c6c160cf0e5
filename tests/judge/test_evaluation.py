"""From a block of designs to judged rows, and rows put together and taken apart."""

from __future__ import annotations

import pickle
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boulder_kernels import Status, simulate_table
from boulder_sweep.columns import OUTCOME_COLUMNS, REASONS, VERDICTS
from boulder_sweep.judge.accuracy import accuracy_of, control_of, readings_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import ERROR, PASS, joined, not_computed, worst_of
from boulder_sweep.store.part import verdict_counts
from tests.runner.grids import grid, grid_of, partly_impossible, plausible, settled


def test_the_kernels_get_si_and_radians():
    sweep = grid()
    block = sweep.block(0, sweep.n_designs)
    table = designs_of(block).table
    assert table.phi == pytest.approx(np.radians(block.columns["friction_angle_deg"].to_numpy()))
    assert table.beta == pytest.approx(block.columns["subgrade_reaction_MN_m3"].to_numpy())
    assert table.e_bumper[0] == 0.5
    assert table.e == pytest.approx(0.5 * (np.minimum(table.H - table.d, 1.4) + 0.5))
    for column in table:
        assert column.dtype == np.float64
        assert column.flags["C_CONTIGUOUS"]
        assert len(column) == sweep.n_designs


def test_readings_and_control_are_those_of_the_settings():
    sweep = grid(soil="{elements: 50}", rotation="10 deg", step="2 ms")
    assert all(readings_of(sweep))
    control = control_of(sweep, accuracy_of(sweep))
    assert control.elements == 50
    assert control.h == 0.002
    longer = replace(sweep, solver=replace(sweep.solver, horizon_s=2.0, accuracy="balanced", step_s=None))
    assert (control.horizon, control_of(longer, accuracy_of(longer)).longest_horizon) == (1.0, 20.0)
    assert control.theta_limit == pytest.approx(np.radians(10.0))
    alone = replace(sweep, solver=replace(sweep.solver, horizon_s=2.0))  # of second opinions, which go on all the same
    assert evaluation_of(alone, accuracy_of(alone)).longest_s == 20.0


def test_impossible_rows_never_enter_the_kernels_and_keep_their_place():
    sweep = partly_impossible()
    seen = []

    def watching(table, readings, control):
        seen.append(table)
        return plausible(table, readings, control)

    block = sweep.block(0, sweep.n_designs)
    rows = evaluation_of(sweep, accuracy_of(sweep), watching)(block)
    impossible = block.reasons.codes != 0
    assert 0 < impossible.sum() < len(impossible)
    (table,) = seen
    assert len(table.L) == (~impossible).sum()
    assert (table.d < table.H).all()
    for row in range(0, sweep.n_designs, 7):
        alone = evaluation_of(sweep, accuracy_of(sweep), plausible)(sweep.block(row, row + 1))
        assert alone.row(0) == rows.row(row)
        assert (VERDICTS[alone.verdict[0]] == "error" and bool(block.reasons[row])) == impossible[row]


def test_a_pass_of_several_cases_stands_under_what_all_of_them_do():
    """The one with the least margin is the row; where one was not asked, what that row says is left."""
    sweep = grid_of(3)
    own = evaluation_of(sweep, accuracy_of(sweep), plausible)(sweep.block(0, 3))
    cases = []
    for margin, under in ((0.1, [3, 3, -1]), (0.5, [0, 1, 3])):
        given = {"verdict": PASS, "margin": margin, "robustness": 0, "stands_under": under}
        columns = {name: np.broadcast_to(value, 3).astype(own[name].dtype) for name, value in given.items()}
        cases.append(replace(own, columns=own.columns | columns))
    assert worst_of(cases)["stands_under"].tolist() == [0, 1, -1]


def test_a_margin_counts_where_the_boulder_stands_below_the_reduced_limit_too():
    """Where the subgrade is soft it turns further than was simulated until its verdict was proved."""
    sweep = grid()
    block = sweep.block(0, sweep.n_designs)

    def simulate(table, readings, control):
        found = settled(table, readings, control)
        if control.theta_limit < np.radians(19.0):
            found.status[table.beta < 50.0] = Status.LIMIT
        return found

    evaluation = evaluation_of(sweep, accuracy_of(sweep), simulate)
    plain, careful = evaluation(block), replace(evaluation, least_margin=0.4)(block)
    soft = (block.columns["subgrade_reaction_MN_m3"].to_numpy() < 50.0) & (plain.verdict == PASS)
    assert 0 < np.count_nonzero(soft) < np.count_nonzero(plain.verdict == PASS)
    assert np.array_equal(careful.verdict, plain.verdict)
    assert np.array_equal(careful["margin"], np.where(soft, np.nextafter(0.4, 0.0), plain["margin"]), equal_nan=True)


def test_a_block_of_impossible_rows_only():
    sweep = grid(height="[2 m, 3 m]", site="embedment_depth: 3.5 m")
    rows = evaluation_of(sweep, accuracy_of(sweep), _never)(sweep.block(0, sweep.n_designs))
    assert (rows.verdict == ERROR).all()
    assert all(rows.reasons[code] for code in rows.reason)


def _never(table, readings, control):
    raise AssertionError("nothing to simulate")


def test_an_evaluation_is_sent_by_name_not_as_source():
    evaluation = evaluation_of(grid(), accuracy_of(grid()))
    assert evaluation.simulate is simulate_table
    sent = pickle.dumps(evaluation)
    assert len(sent) < 2_000
    assert pickle.loads(sent) == evaluation


@pytest.fixture(scope="module")
def whole():
    sweep = partly_impossible()
    return evaluation_of(sweep, accuracy_of(sweep), plausible)(sweep.block(0, sweep.n_designs))


def equal(one, other) -> bool:
    return one.words == other.words and all(
        np.array_equal(one[name], other[name], equal_nan=one[name].dtype.kind == "f") for name in OUTCOME_COLUMNS
    )


@settings(max_examples=50, deadline=None)
@given(data=st.data())
def test_pieces_joined_are_the_whole_wherever_it_is_cut(whole, data):
    n = len(whole.verdict)
    cuts = sorted(data.draw(st.sets(st.integers(1, n - 1), max_size=6)))
    edges = [0, *cuts, n]
    pieces = [joined([whole.rows(slice(a, b))]) for a, b in pairwise(edges)]
    assert equal(joined(pieces), whole)


def test_words_are_sorted_whatever_the_order_of_the_rows():
    words = tuple(f"why {place}" for place in (5, 3, 9, 1, 7, 0, 2, 8, 6, 4))
    row = joined([not_computed(words, np.arange(10)), not_computed(words[::-1], np.arange(10))])
    assert row.reasons == (*REASONS, *sorted(words))
    assert [row.reasons[code] for code in row.reason] == [*words, *words[::-1]]


def test_words_that_no_row_uses_are_dropped():
    row = not_computed(("b", "a", "c"), np.array([1]))
    assert joined([row]).reasons == (*REASONS, "a")


def test_counts_add_up(whole):
    counts = verdict_counts(whole)
    assert sum(counts.values()) == len(whole.verdict)
    for verdict in VERDICTS:
        total = sum(count for key, count in counts.items() if key.split("/")[0] == verdict)
        assert total == np.count_nonzero(whole.verdict == VERDICTS.index(verdict))
    assert counts["fail/overturns"] == np.count_nonzero(whole.reason == REASONS.index("overturns"))
