"""Limits before work: blocks, counts, estimates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.runner import run as running
from boulder_sweep.runner.progress import Progress, RowCost, take_sample, time_and_disk, too_large
from boulder_sweep.runner.ranges import WORK_S, planned, seconds_per_row
from boulder_sweep.runner.run import estimate
from boulder_sweep.settings.model import Layer
from boulder_sweep.store.failures import DoesNotFitError
from boulder_sweep.store.part import encode, part_table
from boulder_sweep.text import size_text
from tests.runner.grids import grid, grid_of, plausible

LAYERED = (Layer(from_m=1.0, density_kg_m3=2e3, friction_angle_deg=38.0, subgrade_reaction_MN_m3=60.0),)
HUGE = {
    "width": "{from: 1 m, to: 2.5 m, count: 10000}",
    "height": "{from: 1.6 m, to: 3.4 m, count: 10000}",
    "subgrade": "{from: 20 MN/m^3, to: 100 MN/m^3, count: 10000}",
    "site": "embedment_ratio: 0.5",
    "friction": "40 deg",
}


@pytest.mark.parametrize(
    ("changes", "model", "cost_us"),
    [
        ({}, {}, 3 * 5 + 10),
        ({"step": "1 ms"}, {}, 12 * 5 + 10),
        ({"step": "20 ms"}, {}, 5 + 10),
        ({"soil": "{elements: 160}"}, {}, 11 * 3 * 5 + 10),
        ({}, {"layers": LAYERED}, 3 * 20 + 10),
        ({}, {"layers": LAYERED, "taper": 0.8}, 3 * 30 + 10),
    ],
)
def test_costs_grow_with_the_work_by_a_fixed_table(changes, model, cost_us):
    sweep = grid(**changes)
    sweep = replace(sweep, model=replace(sweep.model, **model))
    evaluation = evaluation_of(sweep, accuracy_of(sweep), plausible)
    assert seconds_per_row(sweep, evaluation) == pytest.approx(1e-6 * cost_us)
    assert planned(sweep, evaluation).rows == 441


def test_a_row_whose_steps_end_at_the_yield_costs_three_times_as_much():
    sweep = grid()
    sweep = replace(sweep, solver=replace(sweep.solver, accuracy="fine", step_s=None))
    evaluation = evaluation_of(sweep, accuracy_of(sweep), plausible)
    assert seconds_per_row(sweep, evaluation) == pytest.approx(1e-6 * (3 * 5 + 10))


def test_a_range_takes_the_work_that_it_should():
    sweep = grid_of(10**6)
    evaluation = evaluation_of(sweep, accuracy_of(sweep), plausible)
    ranges = planned(sweep, evaluation)
    assert ranges.rows / ranges.count * seconds_per_row(sweep, evaluation) == pytest.approx(WORK_S, rel=0.1)


def test_sizes_for_people():
    assert size_text(512) == "512 bytes"
    assert size_text(60e12) == "60 TB"
    assert size_text(1.5e6) == "1.5 MB"
    assert size_text(2e18) == "2,000 PB"


def test_a_sample_sees_time_and_bytes():
    sweep = grid()
    sample = take_sample(evaluation_of(sweep, accuracy_of(sweep), plausible), sweep, {})
    assert sample.seconds_per_row > 0
    assert 10 < sample.bytes_per_row < 500
    assert sample.bytes_per_part > 1000


def test_a_sample_survives_rows_that_raise():
    sweep = grid()

    def broken(table, readings, control):
        raise ValueError("no")

    sample = take_sample(evaluation_of(sweep, accuracy_of(sweep), broken), sweep, {})
    assert sample.seconds_per_row > 0


@pytest.mark.parametrize("per_row", [5e-6, 1e-3])
def test_a_sample_measures_the_work_of_rows_all_over_the_table(per_row):
    """Half of the designs cost nothing; what the first call loads does not count, nor what a block costs beside."""
    now, loads = [0.0], [2.0]

    def simulate(table, readings, control):
        if not control.locate_yield:  # else open rows again by finer steps
            now[0] += (loads.pop() if loads else 0.0) + 1e-3 + per_row * np.count_nonzero(table.beta > 100.0)
        return plausible(table, readings, control)

    sweep = grid_of(1, subgrade="{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 1000000}")
    sample = take_sample(evaluation_of(sweep, accuracy_of(sweep), simulate), sweep, {}, lambda: now[0])
    assert 0.9 * per_row / 2 < sample.seconds_per_row < 1.1 * per_row / 2 + 2e-7


@pytest.mark.parametrize("wide", [False, True])
def test_a_sample_sees_the_bytes_of_a_whole_part(wide):
    sweep = grid(
        **({"width": "{from: 1 m, to: 2 m, count: 50}"} if wide else {"height": "{from: 2 m, to: 3 m, count: 80}"})
    )
    evaluation = evaluation_of(sweep, accuracy_of(sweep), plausible)
    sample = take_sample(evaluation, sweep, {})
    block = sweep.block(0, sweep.n_designs)
    written = len(encode(part_table(block, evaluation(block), {})))
    assert 0.75 < (sample.bytes_per_row * sweep.n_designs + sample.bytes_per_part) / written < 1.33


def test_an_estimate_is_in_proportion():
    cost = RowCost(1e-6, 50.0, 10_000.0)
    one, ten = (time_and_disk(cost, rows, rows // 25_000, 2) for rows in (10**6, 10**7))
    assert one == (pytest.approx(0.5), 50 * 10**6 + 40 * 10_000)
    assert ten == (pytest.approx(5.0), 50 * 10**7 + 400 * 10_000)


def test_a_rate_counts_the_rows_of_this_run():
    cases = ((30, 0.5), (30, 2.0), (0, 0.0))
    assert [Progress(400, rows, 441, seconds).rows_per_second for rows, seconds in cases] == [60.0, 15.0, 0.0]


def test_more_workers_than_cores_are_not_faster(monkeypatch):
    monkeypatch.setattr(running, "take_sample", lambda *_: RowCost(1e-3, 50.0, 10_000.0))
    monkeypatch.setattr(running, "available_cores", lambda: 2)
    one, two, eight = (estimate(grid(), jobs=jobs, simulate=plausible) for jobs in (1, 2, 8))
    assert one.seconds == pytest.approx(0.441)
    assert two.seconds == eight.seconds == pytest.approx(0.441 / 2)
    assert (one.jobs, eight.jobs, estimate(grid(), simulate=plausible).jobs) == (1, 8, 2)


def test_what_does_not_fit_is_said_with_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr("boulder_sweep.runner.progress._disk_free", lambda out: 1_000_000)
    assert too_large(10, "about", 1_000_000, tmp_path) == ""
    assert "needs about 3 GB of disk, and 1 MB are free" in too_large(10, "about", 3_000_000_000, tmp_path)
    monkeypatch.undo()
    assert too_large(10, "about", 100, tmp_path / "not" / "there") == ""
    assert too_large(10, "about", 10**18, tmp_path / "not" / "there")


def test_a_run_needs_room_for_what_is_missing(tmp_path, monkeypatch):
    out = tmp_path / "out"
    running.run(grid(), out, simulate=plausible)
    min(out.iterdir()).unlink()
    monkeypatch.setattr(running, "take_sample", lambda *_: RowCost(1e-3, 100.0, 0.0))
    monkeypatch.setattr("boulder_sweep.runner.progress._disk_free", lambda out: 20_000)
    with pytest.raises(DoesNotFitError, match=r"needs about 44\.1 kB"):
        running.run(grid(), tmp_path / "new", simulate=plausible)
    assert running.run(grid(), out, resume=True, simulate=plausible).rows_computed == 110


def test_an_estimate_writes_nothing_and_counts_what_is_there_only_to_resume(tmp_path):
    found = estimate(grid(), tmp_path / "out", simulate=plausible)
    assert found.rows == grid().n_designs
    assert list(tmp_path.iterdir()) == []
    assert running.run(grid(), tmp_path / "out", simulate=plausible).jobs == running.available_cores()
    assert running.run(grid_of(1, subgrade="60 MN/m^3"), tmp_path / "one", simulate=plausible).jobs == 1
    assert estimate(grid(), tmp_path / "out", simulate=plausible).rows_to_compute == found.rows
    assert estimate(grid(), tmp_path / "out", resume=True, simulate=plausible).rows_to_compute == 0


def test_an_estimate_of_ten_to_the_twelve_is_exact_in_rows():
    found = estimate(grid(**HUGE), simulate=plausible)
    assert found.rows == found.rows_to_compute == 10**12
