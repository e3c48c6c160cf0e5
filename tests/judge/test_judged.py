"""Putting judged rows together and taking them apart."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boulder_sweep.columns import OUTCOME_COLUMNS, REASONS, VERDICTS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import joined, not_computed
from boulder_sweep.store.part import verdict_counts
from tests.runner.grids import partly_impossible, plausible


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
