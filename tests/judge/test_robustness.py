"""Grades of passes, and second opinions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import boulder_sweep
from boulder_kernels import Status
from boulder_kernels.heave import FINEST, Base
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_sweep.columns import GRADES, STANDINGS
from boulder_sweep.judge import robustness
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.judge.robustness import (
    DECISIVE,
    ERROR_DEG,
    FINENESS,
    FREE,
    NEAR_DEG,
    OPEN,
    ROBUST,
    SENSITIVE,
    TOLERANCE_M,
    is_free,
    standing,
)
from boulder_sweep.judge.validity import are_studied
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.settings import load
from boulder_sweep.settings.model import SECOND_OPINIONS, Model
from boulder_sweep.soils import with_law
from tests.judge.plain import plain_designs
from tests.judge.test_verdict import outcome
from tests.runner.grids import grid

LIMITS = Limits(math.radians(20.0), "P1", studied=True)


def grade(theta_deg: float, limits: Limits = LIMITS, error_deg: float = 0.0, **changes: float) -> str | None:
    """Grade of a pass that turns by so much, without a second opinion."""
    turned = outcome(Status.SETTLED, theta_max=math.radians(theta_deg), theta_error=math.radians(error_deg))
    found: str | None = judge(turned, plain_designs(**changes), limits).row(0)["robustness"]
    return found


def evaluated(sweep: boulder_sweep.Sweep, *laws: str) -> tuple[Evaluation, Judged]:
    """Rows of a small sweep with second opinions."""
    sweep = replace(sweep, model=replace(sweep.model, second_opinion=laws))
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    return evaluation, evaluation(sweep.block(0, sweep.n_designs))


def test_only_what_the_study_has_drawn_is_robust_without_asking() -> None:
    assert grade(7.9) == "robust"
    assert grade(8.1) == "open"
    assert grade(7.9, error_deg=0.2) == "open"
    assert grade(7.9, LIMITS._replace(studied=False)) == "open"
    assert grade(7.9, LIMITS._replace(rotation=math.radians(15.0))) == "open"
    assert grade(7.9, phi=math.radians(35.0)) == "open"
    assert grade(7.9, H=3.4, d=2.6) == "open"  # embedded by 0.76 of its height
    assert grade(7.9, beta=5.0) == "open"  # does not belong to 40 degrees


@pytest.mark.parametrize("name", FREE)
def test_every_range_of_the_study_counts(name: str) -> None:
    low, high = FREE[name]
    assert bool(is_free(plain_designs(**{name: 1.01 * high}).table)[0]) is False
    assert bool(is_free(plain_designs(**{name: 0.99 * low}).table)[0]) is False


def test_second_opinions_are_those_of_the_kernels() -> None:
    """Row by row, whatever else is in the block."""
    sweep = grid()
    evaluation, judged = evaluated(sweep, *SECOND_OPINIONS)
    passing = np.flatnonzero(judged.verdict == PASS)
    designs = designs_of(sweep.block(0, sweep.n_designs)).rows(passing)
    limit, near = evaluation.limits.rotation, math.radians(NEAR_DEG)
    usual = HeaveControl(limit, evaluation.longest_s, margin=near)
    fine = HeaveControl(limit - math.radians(ERROR_DEG), evaluation.longest_s, TOLERANCE_M, FINENESS)
    under = np.zeros(len(passing), dtype=int)
    for bit, law in enumerate(SECOND_OPINIONS):
        for row in range(len(passing)):
            table = with_law(designs.rows(slice(row, row + 1)).table, law)
            one = second_opinions(table, usual)
            if one.status[0] == Status.BELOW_LIMIT and one.theta_max[0] >= limit - near:
                one = second_opinions(table, fine)
            under[row] += (one.status[0] == Status.BELOW_LIMIT) << bit
    assert judged["stands_under"][passing].tolist() == under.tolist()
    words = [GRADES[code] for code in judged["robustness"][passing]]
    passes = designs_of(sweep.block(0, sweep.n_designs), model=sweep.model).rows(passing)
    grades, stand = judged["robustness"][passing], judged["stands_under"][passing] == 3
    known = np.where(are_studied(passes, evaluation.limits), ROBUST, OPEN)
    assert np.array_equal(grades, np.where(stand, known, SENSITIVE))
    assert {ROBUST, SENSITIVE} <= set(grades)
    assert np.array_equal(judged["robustness"], decided["robustness"])
    assert np.array_equal(standing(decided)[passing], stand)


def test_another_law_of_the_file_keeps_its_second_opinions() -> None:
    """The soil model asked for gives the factor on the resistance, whatever the file says."""
    sweep = grid()
    weaker = replace(sweep, model=replace(sweep.model, resistance="broms"))
    _, ours = evaluated(sweep, *SECOND_OPINIONS)
    _, theirs = evaluated(weaker, *SECOND_OPINIONS)
    both = (ours.verdict == PASS) & (theirs.verdict == PASS)
    assert both.any()
    assert np.array_equal(ours["stands_under"][both], theirs["stands_under"][both])


def test_a_boulder_that_the_ground_cannot_carry_is_told_in_words_of_its_own() -> None:
    """Where no second opinion begins from rest, and not where one overturns the pass."""
    row = {
        "robustness": "sensitive",
        "boulder_density_kg_m3": 2600.0,
        "boulder_height_m": 3.0,
        "soil_density_kg_m3": 1600.0,
        "embedment_depth_m": 0.5,
        "friction_angle_deg": 25.0,
    }
    for depth, words in ((0.45, robustness.GIVES_WAY), (0.46, robustness.SENSITIVE_IN_WORDS)):  # N_q = 10.66
        assert robustness.meaning_of(row | {"embedment_depth_m": depth}) == words
        table = plain_designs(rho_b=2600.0, H=3.0, d=depth, e=0.95, rho_s=1600.0, phi=math.radians(25.0)).table
        status = second_opinions(table, HeaveControl(LIMITS.rotation, 1e-3)).status[0]
        assert (status == Status.INVALID) == (words == robustness.GIVES_WAY)
    assert robustness.meaning_of(row | {"robustness": "robust"}) == robustness.IN_WORDS
    assert robustness.meaning_of(row | {"robustness": None}) is None


def test_a_margin_is_asked_of_second_opinions_too() -> None:
    """With it they have to stand below the reduced limit; the grade of an answer is that without it."""
    sweep = grid()
    evaluation, judged = evaluated(sweep, *SECOND_OPINIONS)
    block = sweep.block(0, sweep.n_designs)
    careful = replace(evaluation, least_margin=0.4)
    reduced = careful(block)
    passing = designs_of(block).rows(judged.verdict == PASS)
    limits = evaluation.limits._replace(rotation=0.6 * evaluation.limits.rotation)
    known = [robustness.stands(passing, law, Model(), limits, evaluation.longest_s) for law in SECOND_OPINIONS]
    found = reduced["stands_under"][judged.verdict == PASS]
    assert np.array_equal(found, known[0] + 2 * known[1])
    assert not np.array_equal(found, judged["stands_under"][judged.verdict == PASS])
    assert np.array_equal(careful.graded(reduced, block)["robustness"], judged["robustness"])


def test_a_penetration_beyond_the_rating_overturns_a_pass() -> None:
    sweep = grid()
    evaluation, judged = evaluated(sweep, *SECOND_OPINIONS)
    passing = designs_of(sweep.block(0, sweep.n_designs)).rows(judged.verdict == PASS)
    near = passing._replace(bed_offset=np.full(passing.size, -30.0))
    stands = robustness.stands(near, "broms", Model(), evaluation.limits, 10.0)
    assert not stands.any()
    assert GRADES.index("sensitive") == SENSITIVE
