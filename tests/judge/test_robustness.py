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
from boulder_sweep.designs import some
from boulder_sweep.judge import robustness
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.judge.robustness import (
    DECISIVE,
    ERROR_DEG,
    ERROR_M,
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
    studied = are_studied(designs, evaluation.limits)
    best = np.where(studied, "robust", "open")
    assert words == [str(grade) if bits == 3 else "sensitive" for bits, grade in zip(under, best, strict=True)]
    assert set(words) == {"robust", "sensitive", "open"}
    assert set(judged["stands_under"][judged.verdict != PASS].tolist()) <= {-1}


@pytest.mark.parametrize(
    "changes",
    [
        {"m_v": 2300.0, "v_0": 22.35},
        {"m_v": 300.0, "v_0": 60.0},
        {"k_v": 1e8, "phi": math.radians(45.0)},
        {"v_0": 8.0, "c_v": 1e6},
        {"phi": math.radians(60.0), "d": 1.4},
        {"K_epsilon": 10.0, "phi": math.radians(34.0), "beta": 40.0, "d": 1.7},
        {"d": 0.3 * 3.4, "v_0": 11.5},
    ],
)
def test_outside_its_study_nothing_is_robust(changes: dict[str, float]) -> None:
    """Whatever the second opinions say: a car on the spring of a truck, soils that nobody has seen, hardly buried."""
    usual = {"L": 1.65, "W": 1.68, "H": 3.4, "rho_b": 2600.0, "d": 2.4, "phi": math.radians(40.0), "beta": 80.0}
    usual |= {"rho_s": 1860.0, "m_v": 6804.0, "v_0": 13.41, "k_v": 3103.3e3, "c_v": 138.91e3, "e": 0.75}
    evaluation = evaluation_of(grid(), accuracy_of(grid())).asked()
    inside = evaluation.judged(plain_designs(**usual)).row(0)
    assert (inside["verdict"], inside["robustness"]) == ("pass", "robust")
    outside = evaluation.judged(plain_designs(**usual | changes)).row(0)
    assert outside["robustness"] != "robust"
    if outside["verdict"] == "pass" and outside["stands_under"] == "paper;width_capped":
        assert outside["robustness"] == "open"
        assert robustness.meaning_of(outside) == robustness.UNSTUDIED_IN_WORDS


def test_near_the_limit_a_fine_solution_decides_with_its_error_taken_off() -> None:
    """By the rotation of the finest solution: a limit that is higher by less than the error does not let it stand."""
    sweep = grid()
    evaluation, judged = evaluated(sweep, DECISIVE)
    passes = designs_of(sweep.block(0, sweep.n_designs)).rows(judged["robustness"] == SENSITIVE)
    table = with_law(passes.table, DECISIVE)
    watched = second_opinions(table, HeaveControl(1.2, 1.0, 1e-8, FINEST, stop=False)).theta_max
    turned = np.flatnonzero((watched > math.radians(20.0)) & (watched < 1.1))
    assert turned.size >= 3
    for row in turned:
        above = {}
        for more_deg in (-0.2, 0.5 * ERROR_DEG, 0.2):
            limits = evaluation.limits._replace(rotation=watched[row] + math.radians(more_deg))
            one = passes.rows(slice(row, row + 1))
            above[more_deg] = bool(robustness.stands(one, DECISIVE, Model(), limits, evaluation.longest_s)[0])
        assert above == {-0.2: False, 0.5 * ERROR_DEG: False, 0.2: True}


def test_near_the_limit_of_penetration_the_error_is_taken_off() -> None:
    sweep = grid()
    evaluation, judged = evaluated(sweep, DECISIVE)
    block = sweep.block(0, sweep.n_designs)
    passing = np.flatnonzero(judged.verdict == PASS)
    one = designs_of(block).rows(passing[standing(judged)[passing]][:1])
    watched = second_opinions(with_law(one.table, DECISIVE), HeaveControl(1.2, 1.0, 1e-8, FINEST, stop=False)).x_v_max
    stands = {}
    for beyond_m in (-2.0 * ERROR_M, -0.5 * ERROR_M, 0.5 * ERROR_M):
        offset = watched - one.table.L - evaluation.limits.penetration - beyond_m
        near = one._replace(bed_offset=offset)
        stands[beyond_m] = robustness.stands(near, DECISIVE, Model(), evaluation.limits, evaluation.longest_s)[0]
    assert list(stands.values()) == [True, False, False]


def test_the_weakest_law_decides_and_others_are_asked_where_it_overturns() -> None:
    sweep = grid()
    _, both = evaluated(sweep, *SECOND_OPINIONS)
    evaluation, decided = evaluated(sweep, DECISIVE)
    assert evaluation.asked() == evaluation
    assert np.array_equal(decided["robustness"], both["robustness"])
    known = np.where(both["robustness"] == SENSITIVE, both["stands_under"], 1 << SECOND_OPINIONS.index(DECISIVE))
    assert np.array_equal(decided["stands_under"][both.verdict == PASS], known[both.verdict == PASS])
    passing = both.verdict == PASS
    assert np.array_equal(standing(decided)[passing], both["robustness"][passing] != SENSITIVE)
    assert set(decided["stands_under"][passing].tolist()) == {1, 2}
    _, broms = evaluated(sweep, "broms")
    assert {STANDINGS[code] for code in broms["stands_under"][passing]} <= {"paper", "paper;broms"}
    assert ROBUST not in broms["robustness"]
    assert np.array_equal(both["stands_under"][passing] & 1, broms["stands_under"][passing])


def test_where_broms_resists_less_it_is_asked_too() -> None:
    """A slender boulder deep in dense soil, which `broms` turns further than `width_capped`, beyond 20 degrees."""
    slender = {"L": 0.96, "W": 0.816, "H": 3.893, "rho_b": 2933.6, "d": 2.857, "e": 0.768, "rho_s": 1654.0}
    slender |= {"phi": 0.827, "beta": 174.4, "m_v": 5948.9, "v_0": 17.0, "k_v": 2764732.8, "c_v": 146707.2}
    evaluation = evaluation_of(grid(), accuracy_of(grid())).asked()
    row = evaluation.judged(plain_designs(**slender)).row(0)
    assert (row["verdict"], row["stands_under"], row["robustness"]) == ("pass", "paper;width_capped", "sensitive")
    assert not standing(evaluation.judged(plain_designs(**slender)))[0]
    how = Model(), evaluation.limits, evaluation.longest_s
    assert robustness.stands(plain_designs(**slender), DECISIVE, *how).all()
    assert not robustness.stands_under_the_weakest(plain_designs(**slender), *how).any()


def test_an_open_design_stands_where_the_law_that_decides_lets_it() -> None:
    bit = 1 << SECOND_OPINIONS.index(DECISIVE)
    grades, under = [ROBUST, OPEN, OPEN, OPEN, OPEN, SENSITIVE], [-1, bit, 3 - bit, 0, -1, 3]
    columns = {"robustness": np.array(grades), "stands_under": np.array(under)}
    assert standing(Judged(columns, {})).tolist() == [True, True, False, False, False, False]


def test_what_is_robust_without_asking_is_not_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the law that decides is asked, by the whole limit; nothing is so by a reduced one."""
    sweep = load("configs/m30_sizing.yaml", ["boulder.width=2.4 m", "boulder.height=[3.2, 3.4] m"])
    evaluation, without = evaluated(sweep)
    free = without["robustness"] == ROBUST
    assert free.sum() >= 10
    asked: list[int] = []
    real = robustness.stands
    monkeypatch.setattr(robustness, "stands", lambda designs, *how: asked.append(designs.size) or real(designs, *how))
    block = sweep.block(0, sweep.n_designs)
    decided = evaluation.asked()(block)
    assert asked[0] == np.count_nonzero(without.verdict == PASS) - free.sum()
    assert np.all(decided["robustness"][free] == ROBUST)
    assert np.all(decided["stands_under"][free] == -1)
    assert np.all(standing(decided)[free])
    assert np.array_equal(evaluation.robust_unasked(without), free)
    assert not replace(evaluation, least_margin=0.1).robust_unasked(without).any()
    monkeypatch.undo()
    assert np.all(evaluated(sweep, *SECOND_OPINIONS)[1]["stands_under"][free] == 3)


def test_other_outcomes_do_not_change() -> None:
    _, without = evaluated(grid())
    _, asked = evaluated(grid(), *SECOND_OPINIONS)
    for name, values in without.columns.items():
        if name not in ("robustness", "stands_under"):
            assert np.array_equal(values, asked[name], equal_nan=values.dtype.kind == "f"), name


def test_where_second_opinions_know_nothing_a_pass_is_open() -> None:
    how = ["model.second_opinion=[broms, width_capped]", "model.readings=as_printed"]
    sweep = load("configs/rwg.yaml", how)
    assert not robustness.can_be_asked(sweep)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    assert evaluation.second_opinion == ()
    assert not evaluation.limits.studied


@pytest.mark.parametrize(
    "override",
    [
        "soil.water_table=1.2 m",
        "soil.water_table=0 m",
        "soil.cohesion=2 kPa",
        "soil.slope=5 deg",
        "boulder.taper=0.9",
        "boulder.taper=1.1",
    ],
)
def test_passes_in_other_soil_and_of_other_shapes_have_grades(override: str) -> None:
    """As second opinions of the kernels say, with water and slope under the foot, too."""
    sweep = load("configs/m30_sizing.yaml", [override, "boulder.width=1.8 m"])
    _, judged = evaluated(sweep, *SECOND_OPINIONS)
    evaluation, decided = evaluated(sweep, DECISIVE)
    passing = np.flatnonzero(judged.verdict == PASS)
    ground = sweep.model.ground
    base = Base(water=ground.water_table_m if ground.water_table_m is not None else math.inf)
    base = base._replace(slope=math.radians(ground.slope_deg), varies=not ground.is_proportional)
    how = HeaveControl(evaluation.limits.rotation, evaluation.longest_s, 1e-6, 2)
    under = np.zeros(len(passing), dtype=int)
    for bit, law in enumerate(SECOND_OPINIONS):
        model = replace(sweep.model, resistance=law)
        table = designs_of(sweep.block(0, sweep.n_designs), model=model).rows(passing).table
        under += (second_opinions(table, how, base=base).status == Status.BELOW_LIMIT) << bit
    assert np.mean(judged["stands_under"][passing] == under) > 0.98  # but for those next to the limit
    passes = designs_of(sweep.block(0, sweep.n_designs), model=sweep.model).rows(passing)
    grades, stand = judged["robustness"][passing], judged["stands_under"][passing] == 3
    known = np.where(are_studied(passes, evaluation.limits), ROBUST, OPEN)
    assert np.array_equal(grades, np.where(stand, known, SENSITIVE))
    assert {ROBUST, SENSITIVE} <= set(grades)
    assert np.array_equal(judged["robustness"], decided["robustness"])
    assert np.array_equal(standing(decided)[passing], stand)


@pytest.mark.parametrize(("law", "taper"), [("broms", 1.0), ("broms", 0.85), ("width_capped", 0.97)])
def test_another_law_of_the_file_keeps_its_second_opinions(law: str, taper: float) -> None:
    """The soil model asked for gives the factor on the resistance, whatever the file says."""
    sweep = grid()
    sweep = replace(sweep, model=replace(sweep.model, taper=taper))
    weaker = replace(sweep, model=replace(sweep.model, resistance=law))
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
    """With it they have to stand below the reduced limit, in every case; the grade of an answer knows no margin."""
    sweep = grid()
    evaluation, judged = evaluated(sweep, DECISIVE)
    block = sweep.block(0, sweep.n_designs)
    careful = replace(evaluation, least_margin=0.4)
    limits = evaluation.limits._replace(rotation=0.6 * evaluation.limits.rotation)
    known = robustness.stands(designs_of(block), DECISIVE, Model(), limits, evaluation.longest_s)
    assert np.array_equal(careful.stand(block), known)
    assert not np.array_equal(known[judged.verdict == PASS], standing(judged)[judged.verdict == PASS])
    assert np.array_equal(careful(block)["robustness"], judged["robustness"])
    backwards = some(block, np.arange(len(block))[::-1])
    assert np.array_equal(careful.stand(replace(block, cases=(backwards,))), known & known[::-1])


def test_one_solution_tells_roughly_what_stands() -> None:
    sweep = grid()
    evaluation, _ = evaluated(sweep, DECISIVE)
    block = sweep.block(0, sweep.n_designs)
    stand = evaluation.stand(block)
    for tolerance_m, differ in ((2e-3, 0.05), (2e-4, 0.02)):
        assert 0 < np.count_nonzero(stand) < len(stand)
        assert np.mean(evaluation.stand(block, tolerance_m) != stand) < differ


def test_a_penetration_beyond_the_rating_overturns_a_pass() -> None:
    sweep = grid()
    evaluation, judged = evaluated(sweep, *SECOND_OPINIONS)
    passing = designs_of(sweep.block(0, sweep.n_designs)).rows(judged.verdict == PASS)
    near = passing._replace(bed_offset=np.full(passing.size, -30.0))
    stands = robustness.stands(near, "broms", Model(), evaluation.limits, 10.0)
    assert not stands.any()
    assert GRADES.index("sensitive") == SENSITIVE
