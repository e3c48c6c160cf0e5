"""Every design of the admitted box ends in numbers, or in a refusal that says why."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boulder_kernels import SIMULATED, OutcomeTable, Readings, Status, no_record, simulate_design, simulate_table
from boulder_kernels.design import design_at
from boulder_sweep.judge.verdict import STATUS_REASONS
from tests.accuracy.box import PRESETS, box_table, how

REPORTED = ("theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max", "t_end")


def check(out: OutcomeTable) -> None:
    """Numbers where computed and none where not; every other status has its words, and none is UNSTABLE."""
    computed = np.isin(out.status, SIMULATED)
    for name in REPORTED:
        column = getattr(out, name)
        assert np.isfinite(column[computed]).all(), name
        assert np.isnan(column[~computed]).all(), name
    others = {Status(kind) for kind in np.unique(out.status[~computed])}
    assert others <= {Status.NO_CONTACT, *STATUS_REASONS}
    assert Status.UNSTABLE not in others
    assert Status.INVALID not in others


anything = given(seed=st.integers(0, 2**32 - 1), readings=st.tuples(*[st.booleans()] * 5), estimate=st.booleans())


@settings(max_examples=60, deadline=None)
@anything
def test_every_design_ends_in_numbers_or_words(seed: int, readings: tuple[bool, ...], estimate: bool) -> None:
    check(simulate_table(box_table(8, seed), Readings(*readings), how(estimate=estimate)))


@pytest.mark.parametrize("preset", PRESETS)
def test_ten_thousand_designs(preset: str) -> None:
    """None without status, none NaN, none slower than a hundred times the median, counted in steps."""
    table = box_table(10_000, 2024)
    check(simulate_table(table, PRESETS[preset], how(estimate=True)))
    attempts = []
    for row in range(table.L.size):
        found = simulate_design(design_at(table, row), PRESETS[preset], how(), no_record())
        if found.status in SIMULATED:
            attempts.append(found.attempts)
    assert len(attempts) > 2000
    assert max(attempts) <= 100 * np.median(attempts)
