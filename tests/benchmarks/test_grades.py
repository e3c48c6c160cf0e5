"""Grades against a fine solution: what is counted, on a few passes of each set."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import grades
from boulder_sweep.judge import robustness
from boulder_sweep.judge.inputs import Designs

FEW = 12


def test_no_pass_that_stands_is_overturned_by_a_fine_solution() -> None:
    found = grades.grades(count=FEW)
    assert len(found) == 7
    for name, one in found.items():
        assert one.passes == FEW, name
        assert one.unsafe == 0, name
        assert one.cautious <= 1, name
        assert 0 < one.stand <= FEW, name
        assert one.cpu_s > 0.0
    assert "CPU" not in grades.grades_table(found).markdown()
    assert "CPU" in grades.grades_table(found, cpu=True).text()


def test_grades_that_always_let_stand_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def blind(designs: Designs, *_: object) -> np.ndarray:
        return np.ones(designs.size, dtype=bool)

    monkeypatch.setattr(robustness, "stands", blind)
    name, evaluation, passes = next(grades.sets(grades.GRID, 4 * FEW))
    found = grades.held(evaluation, passes)
    assert name == "M30"
    assert found.stand == found.passes
    assert found.unsafe >= 5
