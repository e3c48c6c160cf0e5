"""The chance of a robust pass: against cases of which it is known, and against designs drawn and graded one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.answers.chance import SCRAMBLINGS, Points
from boulder_sweep.answers.draws import Draws
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.printing import need_lines, uncertainty_lines
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.answers.uncertainty import uncertainty
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.designs import block_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.sweep import DesignList
from tests.answers.designs import DEPTH, bare_need, site

UNCERTAIN = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "{mean: 38 deg, sd: 3 deg}"}
LIKELY = 0.95
MM = 1e-3


def graded(sweep: Sweep, depth: float, points: np.ndarray, out: Path) -> np.ndarray:
    """Return which designs drawn with a depth stand as `run` grades each of them, bool, shape (n,)."""
    given = {name: np.repeat(values, len(points)) for name, values in sweep.plan.given_rows(0, 1).items()}
    given[DEPTH] = np.full(len(points), depth)
    columns = block_of(Spread(sweep).filled(given, points)).columns
    designs = DesignList("drawn", {name: columns[name].to_numpy() for name in INPUT_COLUMNS if name in columns})
    listed = replace(sweep, axes=(), constants={}, distributions={}, correlation=0.0, table=designs)
    boulder_sweep.run(listed, out)
    rows = boulder_sweep.read(out)
    assert rows["verdict"].nunique() > 1
    under = rows["stands_under"].astype("string").fillna("").str.contains("width_capped")
    settled = rows["robustness"] == "robust"
    return (settled | (under & (rows["robustness"] == "open"))).to_numpy()


@pytest.fixture(scope="module")
def answer() -> Need:
    return bare_need(load("configs/uncertain_site.yaml"), probability=LIKELY, robust=True)


@pytest.mark.parametrize("count", [128, pytest.param(1024, marks=pytest.mark.nightly)])
def test_so_many_of_the_designs_drawn_stand_as_each_is_graded_by_a_run(answer: Need, count: int, tmp_path) -> None:
    row, points = answer.frame.iloc[0], Points(len(Spread(answer.sweep).names), 0).upto(count // SCRAMBLINGS)
    points, depth = points.reshape(count, -1), float(row.least_embedment_depth_m)
    stand = graded(answer.sweep, depth, points, tmp_path / "drawn")
    judges, given = judges_of(answer.sweep, robust=True), answer.sweep.plan.given_rows(0, 1)
    draws = Draws(given, Spread(answer.sweep), judges, Pool(1))
    _, known = draws.drawn(np.zeros(count, dtype=np.int64), points, **{DEPTH: np.full(count, depth)})
    assert np.array_equal(known == 1, stand)
    noise = 3.0 * np.sqrt(LIKELY * (1.0 - LIKELY) / count)
    assert row.p_robust_low - noise <= stand.mean() <= row.p_robust_high + noise
    assert row.p_robust_low <= LIKELY <= row.p_robust_high


def test_a_millimetre_less_is_too_little(answer: Need) -> None:
    row = answer.frame.iloc[0]
    assert row.fails_at == pytest.approx(row.passes_at - MM)
    assert row.p_robust < row.p_pass
    bare = bare_need(answer.sweep, probability=LIKELY).frame.iloc[0]
    assert bare.least_embedment_depth_m < row.least_embedment_depth_m - 0.02
    assert "p_robust" not in bare
    lines = need_lines(answer)
    assert "passes under the weakest of three soil models with a probability of 95." in " ".join(
        map(str.strip, lines[:2])
    )
    assert any("P(pass)  P(robust)" in line for line in lines)


def test_without_second_opinions_nothing_is_said_of_them() -> None:
    sweep = site(**UNCERTAIN)
    sweep = replace(sweep, model=replace(sweep.model, second_opinion=()))
    found = uncertainty(sweep, half_width=0.2)
    assert "p_robust" not in found.arrow.column_names
    assert not any("robust" in line for line in uncertainty_lines(found))
    with pytest.raises(QuestionError, match="--robust needs second opinions"):
        bare_need(sweep, robust=True, probability=0.9)
    assert not judges_of(sweep).final.askable
