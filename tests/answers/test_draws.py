"""How far a design is from failing."""

import numpy as np

from boulder_sweep.answers.draws import WORST, Draws, _distance_of
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.judge.judged import ERROR, FAIL, OVERRIDE, PASS, UNDECIDED, not_computed
from boulder_sweep.runner.pool import Pool
from tests.answers.designs import site
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


def test_what_is_known_of_a_design_is_its_verdict_and_the_reason_of_an_undecided_one():
    uncertain = {"site": "embedment_depth: {mean: 2.5 m, sd: 0.5 m}", "height": "3.2 m", "friction": "44 deg"}
    sweep = site(**uncertain)
    draws = Draws(sweep.plan.given_rows(0, 1), Spread(sweep), judges_of(sweep), Pool(1))
    depths = np.array([1.5, 2.3, 2.6, 3.1])  # overturns, passes, hardly reaches the bumper, is passed over
    distance, known = draws.drawn(np.zeros(4, dtype=int), ((depths - 2.5) / 0.5)[:, None])
    assert known.tolist() == [0, 1, -OVERRIDE, 0]
    assert (distance > 0.0).tolist() == [False, True, False, False]
    assert distance[3] == WORST
