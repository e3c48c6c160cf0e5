"""Which step an accuracy asks for."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from boulder_kernels.table import finer_step
from boulder_sweep.cli.console import accuracy_lines
from boulder_sweep.judge.accuracy import (
    LADDER,
    STEPS,
    STEPS_PRINTED,
    Accuracy,
    accuracy_of,
    control_of,
    pilot,
    pilot_size,
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
    assert accuracy_of(load_text(text, Path("grid.yaml"))).steps == STEPS_PRINTED[name]
    assert accuracy_of(asked(name)).error_estimate == (name != "fast")


def test_reported_steps_are_round_numbers() -> None:
    """In the table, too: a third of 18 ms in binary numbers is 5.999999999999999 ms."""
    shown = [finer_step(steps.step_s) for steps in LADDER]
    assert shown[:5] == [0.006, 0.004, 0.004, 0.003, 0.002]
    assert all(len(repr(step)) <= len("0.0001875") for step in shown)


def test_smaller_numbers_get_shorter_steps_that_meet_them() -> None:
    rungs = []
    for wanted in (1.0, 1e-2, 1e-4, 1e-6):
        found = accuracy_of(asked(f"{wanted} deg"))
        assert found.met
        assert found.achieved_deg is not None
        assert found.achieved_deg <= wanted
        rungs.append(LADDER.index(found.steps))
    assert rungs == sorted(rungs)
    assert rungs[-1] > rungs[0]


def test_what_cannot_be_met_is_said() -> None:
    found = accuracy_of(asked("1e-9 deg", subgrade="[25, 95] MN/m^3", friction="40 deg"))
    assert found.met == (found.achieved_deg is not None and found.achieved_deg <= 1e-9)
    assert found.to_dict()["met"] == found.met


def test_an_error_that_a_pilot_does_not_know_is_null_and_unknown_in_words() -> None:
    """The error of more than one design in a thousand is infinite."""
    told = Accuracy("0.01 deg", STEPS["balanced"], True, math.inf, 4096, met=False, paired=True).to_dict()
    assert told["estimated_error_p99_9_deg"] is None
    expected = "estimated error unknown for more than 0.1 % of a pilot of 4,096 designs: no step does better"
    assert accuracy_lines(told)[1].strip() == expected


def test_a_pilot_repeats_itself_to_the_bit() -> None:
    one, other = asked("0.001 deg"), asked("0.001 deg")
    assert pilot(one, 1e-3) == pilot(other, 1e-3)
    assert control_of(one, accuracy_of(one)) == control_of(other, accuracy_of(other))


def test_chosen_and_achieved_stand_in_summary_and_metadata_and_survive_a_resume(tmp_path: Path) -> None:
    sweep, out = asked("0.001 deg"), tmp_path / "out"
    summary = run(sweep, out, jobs=1)
    told = accuracy_of(sweep).to_dict()
    assert summary.accuracy == told
    assert FinishedRows(out).identity["accuracy"] == told
    assert told["asked"] == "0.001 deg"
    assert told["estimated_error_p99_9_deg"] <= 1e-3
    again = run(asked("0.001 deg"), out, jobs=2, resume=True)
    assert (again.rows_computed, again.accuracy) == (0, told)


def test_pilots_of_element_sums_are_smaller() -> None:
    assert pilot_size(0) == pilot_size(16) > pilot_size(50) > pilot_size(5000) == 256


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
