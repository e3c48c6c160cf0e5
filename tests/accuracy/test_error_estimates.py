"""What a row says of its own error."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from boulder_kernels import DesignTable, OutcomeTable, Status, simulate_table
from boulder_kernels.outcomes import NONE_NEEDED, PAIR, THETA_ERROR, X_ERROR, take_seconds
from boulder_sweep.columns import OUTCOMES
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Steps
from boulder_sweep.judge.inputs import Designs, sampled_designs
from boulder_sweep.judge.judged import UNDECIDED
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.settings import load
from docs.studies.random_designs import random_table
from docs.studies.wild import ROUNDING_M, ROUNDING_RAD, FamilyScore, compared, reference, solved, wild_families
from tests.accuracy.box import LIMIT, PRESETS, box_table, how
from tests.judge.plain import plain_designs

GRID = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"
OTHERS = (Steps(0.018), *(Steps(1e-3 * step, locate_yield=True) for step in (9, 1.5, 0.375)))
"""Steps of no named accuracy."""


def grid_table(count: int) -> DesignTable:
    return sampled_designs(load(GRID), count).table


def scores(table: DesignTable, preset: str) -> Iterator[tuple[str, FamilyScore]]:
    """Yield the scores of the named accuracies, and of other steps."""
    readings = PRESETS[preset]
    known, printed = reference(table, readings), preset == "as_printed"
    named = STEPS_PRINTED if printed else STEPS
    for name, steps in (*named.items(), *(("other", steps) for steps in OTHERS)):
        paired = printed or name == "other"
        yield name, compared(solved(table, steps, readings, estimate=name != "fast", paired=paired), known)


@pytest.mark.parametrize("preset", PRESETS)
def test_estimates_cover_99_per_cent_and_no_verdict_is_wrong(preset: str) -> None:
    """A small edition of the table in the documentation; one solution as printed is confirmed by no second one."""
    for table in (random_table(1500, 21), grid_table(1000)):
        for name, found in scores(table, preset):
            least = 0.98 if (name, preset) == ("fast", "as_printed") else 0.99
            assert min(found.rotation, found.displacement) >= least, (name, found)
            assert found.wrong == 0, (name, found)


def test_named_accuracies_keep_their_promises_on_the_grid() -> None:
    """2000 rows: 0.01 deg and 0.1 mm for balanced, 1e-5 deg for fine."""
    found = dict(scores(grid_table(2000), "corrected"))
    assert found["balanced"].largest_deg <= 0.01
    assert found["balanced"].largest_m <= 1e-4
    assert found["fine"].largest_deg <= 1e-5


def test_estimates_cover_families_far_from_usual_designs() -> None:
    """A small edition of the table of `docs.studies.wild`: at most one in a thousand of all is missed."""
    missed, compared = np.zeros(2), np.zeros(2)
    for table in wild_families(400, 41).values():
        found = simulate_table(table, PRESETS["corrected"], how(0.012, estimate=True))
        known = simulate_table(table, PRESETS["corrected"], how(1e-4)._replace(locate_yield=True))
        alike = (found.status == Status.LIMIT) == (known.status == Status.LIMIT)
        standing = alike & (known.status != Status.LIMIT)
        moved = np.maximum(np.abs(found.x_b_max - known.x_b_max), np.abs(found.x_v_max - known.x_v_max))
        wrong = np.abs(found.theta_max - known.theta_max) > found.theta_error + ROUNDING_RAD
        missed += np.sum(wrong & standing), np.sum((moved > found.x_error + ROUNDING_M) & alike)
        compared += standing.sum(), alike.sum()
    assert (compared > 1000).all()
    assert (missed <= 1e-3 * compared).all()


def test_few_usual_designs_have_a_second_solution() -> None:
    for table in (random_table(4000, 42), grid_table(4000)):
        found = simulate_table(table, PRESETS["corrected"], how(0.012, estimate=True))
        assert np.mean(found.step < 0.004) < 0.05


@pytest.mark.parametrize("preset", PRESETS)
def test_no_error_in_a_table_is_infinite(preset: str) -> None:
    """Of extreme designs some have an error that is not known: null in every column, and the row is undecided."""
    table = box_table(10_000, 2025)
    out = simulate_table(table, PRESETS[preset], how(0.012, estimate=True)._replace(paired=True))
    judged = judge(out, Designs(table, np.full(table.L.size, 2.9)), Limits(LIMIT, "P1"))
    errors = [spec.name for spec in OUTCOMES if "_error_" in spec.name]
    assert len(errors) == 3
    assert not any(np.isinf(judged[name]).any() for name in errors)
    unknown = np.isinf(out.theta_error)
    assert unknown.any()
    assert (judged.verdict[unknown] == UNDECIDED).all()


def outcomes(status: list[int], theta: list[float]) -> OutcomeTable:
    n = len(status)
    out = OutcomeTable(np.array(status, np.int8), *(np.full(n, np.nan) for _ in OutcomeTable._fields[1:]))
    for column in (out.theta_max, out.x_b_max, out.x_v_max, out.F_v_max, out.crush_max, out.t_limit, out.t_end):
        column[:] = theta
    return out


def test_where_only_one_solution_reached_the_limit_the_error_is_infinite() -> None:
    limit, settled = Status.LIMIT.value, Status.SETTLED.value
    coarse = np.stack(outcomes([limit, settled, limit, settled], [0.35, 0.2, 0.35, np.nan]))
    fine = np.stack(outcomes([settled, limit, limit, settled], [0.34, 0.35, 0.35, 0.3]))
    needed = np.full(4, float(PAIR))
    take_seconds(fine, np.arange(4), coarse, needed, np.stack(box_table(4, 0)), 3.0)
    assert np.isinf(fine[np.ix_([THETA_ERROR, X_ERROR], [0, 1, 3])]).all()
    assert fine[THETA_ERROR, 2] == 0.0
    assert (needed == NONE_NEEDED).all()


@pytest.mark.parametrize(("error", "verdict"), [(0.001, 0), (0.01, 2), (np.inf, 2), (np.nan, 0)])
def test_nearer_to_the_limit_than_the_error_is_undecided(error: float, verdict: int) -> None:
    out = outcomes([Status.SETTLED.value], [LIMIT - 0.005])
    out.x_v_max[:], out.theta_error[:], out.x_error[:] = 0.5, error, 0.0
    assert judge(out, plain_designs(L=1.65), Limits(LIMIT, "P1")).verdict[0] == verdict


def test_one_solution_has_the_error_of_its_steps() -> None:
    """Which covers 99 % of the true ones on usual designs."""
    table = random_table(2000, 1)
    out = simulate_table(table, PRESETS["corrected"], how(0.012))
    known = simulate_table(table, PRESETS["corrected"], how(2e-4))
    standing = (out.status != Status.LIMIT) & (known.status != Status.LIMIT) & np.isfinite(out.theta_max)
    assert (out.theta_error[standing] > 0.0).all()
    assert np.mean(np.abs(out.theta_max - known.theta_max)[standing] <= out.theta_error[standing]) >= 0.99
    assert np.mean(np.abs(out.x_b_max - known.x_b_max) <= out.x_error) >= 0.99
