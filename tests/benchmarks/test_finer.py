"""Passes of random designs against a finer solution."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import finer
from benchmarks.designs import sample
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.settings import load

pytestmark = pytest.mark.compiled


def test_passes_are_counted_and_those_that_overturn() -> None:
    """By a step of which one is known to overturn none, and by limits so wide that passes do."""
    sweep = load(finer.GRID)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    designs = Designs(sample(400, seed=9), bed_offset=np.full(400, 2.9))
    found = finer.count(evaluation, designs)
    assert found.designs == 400
    assert found.passes > 40
    assert found.overturned == found.refused == 0
    assert found.largest_deg < 0.05
    wide = replace(
        evaluation, simulate=lambda table, readings, how, *laws: evaluation.simulate(table, readings, stops(how), *laws)
    )
    assert finer.count(wide, designs).overturned > 5


def stops(how):
    """Return the control with half the limit for single solutions, as the finer one is."""
    return how if how.error_estimate else how._replace(theta_limit=0.5 * how.theta_limit)


def test_a_pass_that_overturns_is_an_exit_code(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(finer, "measure", lambda passes: finer.Count(10, 5, 1, 0, 0.1))
    monkeypatch.setattr(sys, "argv", ["finer"])
    with pytest.raises(SystemExit) as ended:
        finer.main()
    assert ended.value.code == 1
    assert "1 overturn" in capsys.readouterr().out
