"""How far a design is from failing."""

import numpy as np

from boulder_sweep.answers.draws import WORST, _distance_of
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.judge.judged import ERROR, FAIL, PASS, UNDECIDED, not_computed
from tests.runner.grids import grid


def test_an_undecided_design_without_a_margin_is_as_good_as_at_its_limit():
    rows = not_computed(("why",), np.zeros(4, dtype=int))
    rows.columns["verdict"] = np.array([PASS, FAIL, UNDECIDED, ERROR], dtype=np.int32)
    rows.columns["margin"] = np.array([0.25, -0.5, np.nan, np.nan])
    found = _distance_of(rows, judges_of(grid()))
    assert found[0] == 0.25
    assert found[1] == -0.5
    assert -1e-300 < found[2] < 0.0
    assert found[3] == WORST
