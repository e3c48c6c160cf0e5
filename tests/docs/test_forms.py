"""How much the model's form decides: what is drawn, what is counted, and what the page concludes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from boulder_kernels.heave import Base
from boulder_kernels.second_opinion import USUAL_BASE
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import FREE_ROTATION_DEG, is_free
from docs.studies import forms, free_region

ROOT = Path(__file__).parents[2]
GRID = ROOT / "configs" / "m30_sizing.yaml"


BASES = {
    "as chosen": USUAL_BASE,
    "k_b 30 MN/m³": Base(stiffness=30e6),
    "k_b 300 MN/m³": Base(stiffness=300e6),
    "no damping of the base": Base(wave_speed=0.0),
    "v_s 0.002 m/s": Base(slip_speed=0.002),
    "v_s 0.05 m/s": Base(slip_speed=0.05),
}
"""Constants of the second opinion that nobody has measured for boulders."""


def evenly(rng: np.random.Generator) -> np.ndarray:
    """Draw places in the free region evenly."""
    return rng.random((free_region.AT_ONCE, len(free_region.RANGES)))


@pytest.mark.parametrize("base", BASES.values(), ids=BASES)
def test_crash_tests_come_out_as_they_did_by_every_law_and_constant(base: Base) -> None:
    for title, *cells in forms.crash_table(GRID, base).rows:
        overturned = [cell.startswith("20° after") for cell in cells]
        assert overturned == [title == "American Black Granite"] * 3
        if not any(overturned):
            turned = [float(cell[:-1]) for cell in cells]
            assert turned == sorted(turned)
            assert turned[-1] < 20.0


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


@pytest.mark.parametrize("draw", [evenly, free_region.cornered])
def test_what_is_drawn_of_the_free_region_is_what_the_judge_calls_free(
    draw: Callable[[np.random.Generator], np.ndarray],
) -> None:
    _, designs = free_region.drawn(GRID, draw, 50)
    assert designs.size >= 50
    assert is_free(designs.table).all()
    judged = forms.grid_evaluation(GRID).judged(designs)
    assert (judged.verdict == PASS).all()
    assert judged["max_rotation_deg"].max() <= FREE_ROTATION_DEG
    ends = np.isin(designs.table.W, (0.8, 2.5)).mean()
    assert ends == 0.0 if draw is evenly else 0.3 < ends < 0.7


def test_numbers_in_prose_are_those_of_the_study() -> None:
    page = " ".join((ROOT / "docs" / "confidence.md").read_text(encoding="utf-8").split())
    assert f"samples of {forms.DRAWN} passes" in page
    assert f"{forms.RANDOM:,} designs" in page


@pytest.mark.nightly
def test_nothing_is_lost_in_the_free_region() -> None:
    for draw in (evenly, free_region.cornered):
        _, designs = free_region.drawn(GRID, draw, free_region.LEAST)
        assert forms.robust(designs, forms.grid_evaluation(GRID)).all()
    for n in range(free_region.SEARCHES):
        assert free_region.worst_found(GRID, free_region.SEED + n) < 20.0
