"""How much the model's form decides: what is drawn, what is counted, and what the page concludes."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from boulder_sweep.investigation import off_families
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.judge.robustness import FREE_ROTATION_DEG, is_free
from docs.studies import forms, free_region

ROOT = Path(__file__).parents[2]
GRID = ROOT / "configs" / "m30_sizing.yaml"


def test_drawn_of_a_grid_are_passes_and_fails() -> None:
    evaluation, (passes, fails) = forms.grid_evaluation(GRID), forms.drawn_of_grid(GRID, "30 mph", 40)
    assert (passes.size, fails.size) == (40, 40)
    assert (evaluation.judged(passes).verdict == PASS).all()
    assert (evaluation.judged(fails).verdict == FAIL).all()
    assert len(np.unique(np.stack(passes.table), axis=1).T) == 40


def test_the_papers_form_changes_nothing_and_others_do() -> None:
    rows = {row[:2]: row[2:] for row in forms.grids_table(GRID, 40).rows}
    assert len(rows) == 8
    for speed in ("M30", "M40"):
        assert rows[speed, "`kp_squared`"][0] == "100% (0%)"
        kept = [[int(cell.split("%")[0]) for cell in rows[speed, f"`{law}`"]] for law in ("broms", "width_capped")]
        assert kept[0] >= kept[1], "width_capped resists less"
        assert all(planar < rubbing for planar, rubbing, _ in kept), "friction holds"
        assert kept[1][2] < kept[1][1], "vertical motion loosens"


def test_passes_that_turn_little_are_robust() -> None:
    """The words count what the table gives as kept by the weakest law."""
    words = forms.grids_words(GRID, 40)
    kept = [int(row[-1].split("%")[0]) for row in forms.grids_table(GRID, 40).rows if row[1] == "`width_capped`"]
    assert words.startswith(f"Robust are {kept[0]}% of the passes of M30 and {kept[1]}% of the passes of M40;")
    ((asked, standing),) = re.findall(r"the (\d+) that turn by at most 12°, (\d+) are", words)
    assert 0 < int(asked) == int(standing) < 80


def test_crash_tests_come_out_as_they_did_by_every_law_and_constant() -> None:
    for title, _, *cells in forms.tests_table(GRID).rows:
        overturned = [cell.startswith("20° after") for cell in cells]
        assert overturned == [title == "American Black Granite"] * 3
        if not any(overturned):
            turned = [float(cell[:-1]) for cell in cells]
            assert turned == sorted(turned)
            assert turned[-1] < 20.0


def test_random_designs_lie_in_their_ranges_and_are_hit() -> None:
    designs = forms.random_designs(500)
    table = designs.table
    assert designs.size == 500
    assert (table.H - table.d > forms.BUMPER_M).all()
    assert not off_families(np.degrees(table.phi), table.beta).any()
    for name, (low, high) in forms.VEHICLE.items():
        values = getattr(table, name)
        assert low <= values.min() < values.max() <= high
    assert np.std(np.log(table.beta / forms.api_curve(np.degrees(table.phi)))) == pytest.approx(forms.SCATTER, rel=0.1)


def test_lost_passes_are_counted_once_and_in_their_bin() -> None:
    *bins, (_, count, *together) = forms.random_table(GRID, 600).rows
    passes = np.array([int(row[1]) for row in bins])
    shares = np.array([[float(cell) for cell in row[2:]] for row in bins])
    assert passes.sum() == int(count) > 50
    assert passes @ shares / passes.sum() == pytest.approx([float(share) for share in together], abs=0.1)
    assert (shares[:, 0] >= shares[:, 1:].max(axis=1)).all()
    assert (shares[:, 0] <= shares[:, 1:].sum(axis=1) + 0.15).all()
    rotation, _, _ = forms.random_verdicts(GRID, 600)
    assert passes[0] == np.count_nonzero(rotation <= forms.BINS_DEG[1])


@pytest.mark.parametrize("draw", [free_region.even, free_region.cornered])
def test_what_is_drawn_of_the_free_region_is_what_the_judge_calls_free(draw: Callable[..., np.ndarray]) -> None:
    _, designs = free_region.drawn(GRID, draw, tuple(free_region.FREE_RANGES.items()), 50)
    assert designs.size >= 50
    assert is_free(designs.table).all()
    judged = forms.grid_evaluation(GRID).judged(designs)
    assert (judged.verdict == PASS).all()
    assert judged["max_rotation_deg"].max() <= FREE_ROTATION_DEG
    ends = np.isin(designs.table.W, (0.8, 2.5)).mean()
    assert ends == 0.0 if draw is free_region.even else 0.3 < ends < 0.7


def test_the_bound_of_a_share() -> None:
    """With none of n the bound p is where (1 - p)^n is five per cent, about 3/n."""
    assert (1.0 - free_region.most_lost(0, 3000)) ** 3000 == pytest.approx(0.05)
    assert free_region.most_lost(0, 3000) == pytest.approx(3.0 / 3000, rel=2e-3)
    assert free_region.most_lost(65, 5101) > 65 / 5101


def test_the_search_for_the_worst_climbs() -> None:
    start, found = (free_region.worst_found(GRID, 50, climbers=20, turns=turns) for turns in (0, 8))
    assert start < found


def test_numbers_in_prose_are_those_of_the_study() -> None:
    page = (ROOT / "docs" / "forms.md").read_text(encoding="utf-8")
    assert f"{forms.DRAWN} passes and {forms.DRAWN} fails" in page
    assert f"{forms.RANDOM:,} designs" in page


@pytest.mark.nightly
def test_nothing_is_lost_in_the_free_region() -> None:
    *free, _ = free_region.region_table(GRID).rows
    assert all(int(passes) >= 3000 and lost == "0" for _, passes, lost, *_ in free)
    for n in range(free_region.SEARCHES):
        assert free_region.worst_found(GRID, free_region.LEAST, free_region.SEED + n) < 20.0
