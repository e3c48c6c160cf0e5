"""Answers under second opinions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boulder_sweep.answers.printing import need_lines, uncertainty_lines
from boulder_sweep.answers.uncertainty import uncertainty
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import ROBUST
from boulder_sweep.settings.model import SECOND_OPINIONS
from tests.answers.designs import bare_need, site


def test_the_least_robust_depth_is_robust_and_the_next_one_is_not() -> None:
    sweep = site(height="[2.8, 3] m", width="2.4 m")
    found = bare_need(sweep, robust=True)
    evaluation = evaluation_of(sweep, accuracy_of(sweep)).asked()
    rows = [row for row in found.arrow.to_pylist() if row["passes_at"] is not None]
    assert len(rows) >= 3
    for row in rows:
        assert row["robustness"] == "robust"
        assert row["stands_under"] in ("paper;width_capped", None)  # none is asked in the free region
        at = [row["passes_at"], row["fails_at"]]
        given = sweep.constants | {name: row[name] for name in ("boulder_height_m", "friction_angle_deg")}
        given.pop("embedment_ratio", None)
        grades = []
        for depth in at:
            one = replace(sweep, axes=(), constants=given | {"embedment_depth_m": depth}, table=None)
            judged = evaluation(one.block(0, 1))
            grades.append(judged.verdict[0] == PASS and judged["robustness"][0] == ROBUST)
        assert grades == [True, False]


def test_robust_costs_depth_and_answers_are_graded_without_asking() -> None:
    sweep = site(height="[3, 3.4] m")
    least, robust = (bare_need(sweep, robust=asked) for asked in (False, True))
    depths = [np.array(found.arrow["passes_at"].to_pylist(), dtype=float) for found in (least, robust)]
    both = np.isfinite(depths[0]) & np.isfinite(depths[1])
    assert (depths[1][both] > depths[0][both]).all()
    grades = [grade for grade, depth in zip(least.arrow["robustness"].to_pylist(), depths[0], strict=True) if depth > 0]
    assert set(grades) == {"sensitive"}
    assert any(line.startswith("sensitive: a second opinion overturns it") for line in need_lines(least, notes=True))
    assert any(line.startswith("robust: stands with friction") for line in need_lines(robust, notes=True))


def test_what_second_opinions_do_not_know_is_refused_in_words() -> None:
    wet = site()
    wet = replace(wet, model=replace(wet.model, water_table_m=0.5))
    with pytest.raises(QuestionError, match="dry, level, uniform soil"):
        bare_need(wet, robust=True)
    assert set(bare_need(wet).arrow["robustness"].to_pylist()) <= {"open", None}
    uncertain = site(friction="{mean: 38 deg, sd: 2 deg}")
    with pytest.raises(QuestionError, match="cannot be used together"):
        bare_need(uncertain, robust=True, probability=0.95)


def test_no_grade_stands_beside_a_probability() -> None:
    """It would be that of the mean soil, and says nothing of the designs drawn."""
    sweep = site(friction="{mean: 40 deg, sd: 1 deg}", height="3.4 m")
    asked = replace(sweep, model=replace(sweep.model, second_opinion=SECOND_OPINIONS))
    found, likely = uncertainty(asked, half_width=0.2), bare_need(asked, probability=0.9)
    assert likely.counts() == {"found": 1}
    for answers, lines in ((found, uncertainty_lines(found)), (likely, need_lines(likely, notes=True))):
        assert answers.arrow["robustness"].to_pylist() == [None]
        assert answers.arrow["stands_under"].to_pylist() == [None]
        assert not any(word in "\n".join(lines) for word in ("robust", "sensitive", "opinion"))
