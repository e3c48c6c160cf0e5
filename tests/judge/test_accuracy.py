"""Which step an accuracy asks for, and how firm the table is that it gives."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_kernels.table import finer_step
from boulder_sweep.cli.console import accuracy_lines
from boulder_sweep.judge.accuracy import (
    LADDER,
    STEPS,
    Accuracy,
    accuracy_of,
    control_of,
    pilot,
    pilot_size,
)
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.firmness import CHANGES, firmness_of
from boulder_sweep.judge.inputs import sampled_rows
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.runner.run import run
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.model import ReadingChoice
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


def verdicts(sweep: boulder_sweep.Sweep) -> np.ndarray:
    """Verdicts of a small sweep, by the fast steps."""
    fast = replace(sweep, solver=replace(sweep.solver, accuracy="fast", step_s=None))
    evaluation = evaluation_of(fast, accuracy_of(fast))
    control = evaluation.control._replace(longest_horizon=0.0)
    return replace(evaluation, control=control)(fast.block(0, fast.n_designs)).verdict


def passes(sweep: boulder_sweep.Sweep) -> np.ndarray:
    """Which designs of a small sweep pass."""
    return verdicts(sweep) == PASS


def fails(sweep: boulder_sweep.Sweep) -> np.ndarray:
    """Which designs of a small sweep fail."""
    return verdicts(sweep) == FAIL


def test_shares_are_those_of_the_changed_sweeps() -> None:
    sweep = grid()
    found = firmness_of(sweep)
    assert found["designs"] == sweep.n_designs  # all of them: the sample is the grid
    own = passes(sweep)
    printed = replace(sweep, model=replace(sweep.model, readings=ReadingChoice.of_preset("as_printed")))
    assert found["lost"]["reading"] == pytest.approx(np.mean(fails(printed)[own]))
    speed = sweep.constants["impact_speed_m_s"] * 1.05
    faster = replace(sweep, constants=sweep.constants | {"impact_speed_m_s": speed})
    assert found["lost"]["speed"] == pytest.approx(np.mean(fails(faster)[own]))
    assert found["passes"] == own.sum()
    assert set(found["lost"]) == set(CHANGES) - {"kp_squared"}
    assert all(0.0 < found["lost"][name] <= 1.0 for name in ("reading", "speed", "broms", "width_capped"))
    by_broms = firmness_of(replace(sweep, model=replace(sweep.model, resistance="broms")))
    assert set(by_broms["lost"]) == set(CHANGES) - {"broms"}


def test_less_resistance_is_what_it_says() -> None:
    """3 K_p in place of K_p^2: where K_p is 3 both are the same, and nothing changes."""
    found = firmness_of(
        grid(friction="30 deg", site="embedment_ratio: [0.7, 0.75]", height="[3.6, 4] m", width="2.5 m")
    )
    assert found["passes"] > 0
    assert found["lost"]["broms"] == 0.0


def test_stones_are_sampled_with_their_shape() -> None:
    """Not as boxes of their sides, to which changed stones would be compared."""
    box = grid()
    stone = replace(box, model=replace(box.model, taper=0.7))
    found, own = firmness_of(stone), passes(stone)
    assert found["passes"] == own.sum() < passes(box).sum()
    by_broms = replace(stone, model=replace(stone.model, resistance="broms"))
    assert found["lost"]["broms"] == pytest.approx(np.mean(fails(by_broms)[own]))


def test_it_stands_in_summary_and_metadata_and_repeats_itself(tmp_path: Path) -> None:
    sweep = grid()
    summary = run(sweep, tmp_path / "one", jobs=1)
    expected = firmness_of(sweep)
    assert summary.firmness == expected == json.loads(json.dumps(expected))
    part = next((tmp_path / "one").glob("rows-*.parquet"))
    metadata = pq.read_schema(part).metadata
    assert json.loads(metadata[b"boulder_sweep.firmness"]) == expected
    again = run(grid(), tmp_path / "one", jobs=2, resume=True)
    assert again.firmness == expected
    assert FinishedRows(tmp_path / "one").rows_done == sweep.n_designs


def test_nothing_to_simulate() -> None:
    sweep = grid(height="[2 m, 3 m]", site="embedment_depth: 3.5 m")
    found = firmness_of(sweep)
    assert (found["designs"], found["passes"]) == (0, 0)
    assert found["lost"] == {}
