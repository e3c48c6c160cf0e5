"""How firm a table is: small changes against plain simulations of the changed designs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.firmness import CHANGES, firmness_of
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.runner.run import run
from boulder_sweep.settings.model import ReadingChoice
from boulder_sweep.store.reading import FinishedRows
from tests.runner.grids import grid


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
    assert found.designs == sweep.n_designs  # all of them: the sample is the grid
    own = passes(sweep)
    printed = replace(sweep, model=replace(sweep.model, readings=ReadingChoice.of_preset("as_printed")))
    assert found.lost["reading"] == pytest.approx(np.mean(fails(printed)[own]))
    speed = sweep.constants["impact_speed_m_s"] * 1.05
    faster = replace(sweep, constants=sweep.constants | {"impact_speed_m_s": speed})
    assert found.lost["speed"] == pytest.approx(np.mean(fails(faster)[own]))
    assert found.passes == own.sum()
    assert set(found.lost) == set(CHANGES) - {"kp_squared"}
    assert all(0.0 < found.lost[name] <= 1.0 for name in ("reading", "speed", "broms", "width_capped"))
    by_broms = firmness_of(replace(sweep, model=replace(sweep.model, resistance="broms")))
    assert set(by_broms.lost) == set(CHANGES) - {"broms"}


def test_less_resistance_is_what_it_says() -> None:
    """3 K_p in place of K_p^2: where K_p is 3 both are the same, and nothing changes."""
    found = firmness_of(
        grid(friction="30 deg", site="embedment_ratio: [0.7, 0.75]", height="[3.6, 4] m", width="2.5 m")
    )
    assert found.passes > 0
    assert found.lost["broms"] == 0.0


def test_stones_are_sampled_with_their_shape() -> None:
    """Not as boxes of their sides, to which changed stones would be compared."""
    box = grid()
    stone = replace(box, model=replace(box.model, taper=0.7))
    found, own = firmness_of(stone), passes(stone)
    assert found.passes == own.sum() < passes(box).sum()
    by_broms = replace(stone, model=replace(stone.model, resistance="broms"))
    assert found.lost["broms"] == pytest.approx(np.mean(fails(by_broms)[own]))


def test_it_stands_in_summary_and_metadata_and_repeats_itself(tmp_path: Path) -> None:
    sweep = grid()
    summary = run(sweep, tmp_path / "one", jobs=1)
    expected = firmness_of(sweep).to_dict()
    assert summary.firmness == expected == json.loads(json.dumps(expected))
    part = next((tmp_path / "one").glob("rows-*.parquet"))
    metadata = pq.read_schema(part).metadata
    assert json.loads(metadata[b"boulder_sweep.firmness"]) == expected
    again = run(grid(), tmp_path / "one", jobs=2, resume=True)
    assert again.firmness == expected
    assert FinishedRows(tmp_path / "one").rows_done == sweep.n_designs


def test_the_numerical_error_is_that_of_the_accuracy_asked_for() -> None:
    errors = []
    for accuracy in ("fast", "balanced", "fine"):
        sweep = grid()
        asked = replace(sweep, solver=replace(sweep.solver, accuracy=accuracy, step_s=None))
        errors.append(firmness_of(asked).numerical_error_deg)
    assert all(error is not None for error in errors)
    assert 0.0 < errors[2] < errors[1] < errors[0] < 1.0


def test_nothing_to_simulate() -> None:
    sweep = grid(height="[2 m, 3 m]", site="embedment_depth: 3.5 m")
    found = firmness_of(sweep)
    assert (found.designs, found.passes) == (0, 0)
    assert found.lost == {}
