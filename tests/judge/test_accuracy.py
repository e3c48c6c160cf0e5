"""Which step an accuracy asks for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boulder_kernels.table import finer_step
from boulder_sweep.judge.accuracy import (
    STEPS,
    accuracy_of,
)
from boulder_sweep.judge.inputs import sampled_rows
from boulder_sweep.runner.run import run
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.store.reading import FinishedRows
from tests.runner.grids import DEFAULTS, GRID, grid, grid_of


def asked(accuracy: str, **changes: str) -> Sweep:
    text = GRID.format(**{**DEFAULTS, **changes}).replace(f"step: {DEFAULTS['step']}", f"accuracy: {accuracy}")
    return load_text(text, Path("grid.yaml"))


@pytest.mark.parametrize("name", ["fast", "balanced", "fine"])
def test_names_stand_for_steps(name: str) -> None:
    assert accuracy_of(asked(name)).steps == STEPS[name]
    text = GRID.format(**DEFAULTS).replace("step: 4 ms", f"accuracy: {name}").replace("corrected", "as_printed")
    # At half the step of each name, which alone locates the yield or not.
    assert accuracy_of(load_text(text, Path("grid.yaml"))).steps == (STEPS[name].step_s / 2, name == "fine")
    assert accuracy_of(asked(name)).error_estimate == (name != "fast")


def test_reported_steps_are_round_numbers() -> None:
    """In the table, too: a third of 18 ms in binary numbers is 5.999999999999999 ms."""
    shown = [finer_step(1e-3 * step) for step in (18, 12, 9, 6, 4.5, 0.5625)]
    assert shown == [0.006, 0.004, 0.003, 0.002, 0.0015, 0.0001875]


def test_it_stands_in_summary_and_metadata_and_survives_a_resume(tmp_path: Path) -> None:
    sweep, out = asked("fine"), tmp_path / "out"
    summary = run(sweep, out, jobs=1)
    told = accuracy_of(sweep).to_dict()
    assert summary.accuracy == told
    assert FinishedRows(out).identity["accuracy"] == told
    assert (told["asked"], told["reported_step_s"], told["yield_located"]) == ("fine", 0.002, True)
    again = run(asked("fine"), out, jobs=2, resume=True)
    assert (again.rows_computed, again.accuracy) == (0, told)


@pytest.mark.parametrize("count", [10, 100, 441, 5000])
def test_samples_hold_the_corners_and_no_row_twice(count: int) -> None:
    sweep = grid()
    found = sampled_rows(sweep, count)
    assert len(np.unique(found)) == len(found) <= min(count, sweep.n_designs)
    assert (np.diff(found) > 0).all()
    assert {0, sweep.n_designs - 1} <= set(found.tolist())
    assert np.array_equal(found, sampled_rows(grid(), count))


def test_samples_reach_every_value_of_every_axis() -> None:
    sweep = grid_of(100_000)
    rows = sampled_rows(sweep, 1000)
    assert len(np.unique(rows * 100 // sweep.n_designs)) == 100
    sweep = grid()
    rows = sampled_rows(sweep, 120)
    for stride, length in zip(sweep.plan.strides, sweep.plan.lengths, strict=True):
        assert len(np.unique(rows // stride % length)) == length
