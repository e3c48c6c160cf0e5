"""Limits before work: blocks, counts, estimates."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.runner import run as running
from boulder_sweep.runner.progress import RowCost, take_sample, time_and_disk, too_large
from boulder_sweep.runner.ranges import planned, seconds_per_row
from boulder_sweep.runner.run import estimate, run
from boulder_sweep.store.failures import DoesNotFitError
from boulder_sweep.store.part import encode, part_table
from boulder_sweep.text import size_text
from tests.runner.grids import grid, grid_of, plausible

HUGE = {
    "width": "{from: 1 m, to: 2.5 m, count: 10000}",
    "height": "{from: 1.6 m, to: 3.4 m, count: 10000}",
    "subgrade": "{from: 20 MN/m^3, to: 100 MN/m^3, count: 10000}",
    "site": "embedment_ratio: 0.5",
    "friction": "40 deg",
}


@pytest.mark.parametrize(
    ("changes", "least", "most"),
    [
        ({}, 1e-5, 5e-5),
        ({"step": "1 ms"}, 5e-5, 2e-4),
        ({"soil": "{elements: 160}"}, 5e-5, 4e-4),
    ],
)
def test_costs_grow_with_the_work_by_a_fixed_table(changes, least, most):
    sweep = grid(**changes)
    evaluation = evaluation_of(sweep, accuracy_of(sweep), plausible)
    assert least < seconds_per_row(sweep, evaluation) < most
    assert seconds_per_row(sweep, evaluation) == seconds_per_row(sweep, evaluation)
    assert planned(sweep, evaluation).rows == 441


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


class Clock:
    """A clock that stands still but for the work that is done."""

    def __init__(self, free_up_to: float, seconds_per_row: float, seconds_per_block: float, seconds_at_first=0.0):
        self.now = 0.0
        self._at_first = seconds_at_first
        self._free_up_to, self._per_row, self._per_block = free_up_to, seconds_per_row, seconds_per_block

    def simulate(self, table, readings, control):
        """Let soils up to some stiffness cost nothing, as designs that are not touched do."""
        if control.locate_yield:
            return plausible(table, readings, control)  # open rows again by finer steps
        self.now += self._at_first
        self._at_first = 0.0
        self.now += self._per_block + self._per_row * int(np.count_nonzero(table.beta > self._free_up_to))
        return plausible(table, readings, control)

    def sample(self, sweep):
        """Take a sample by this clock."""
        evaluation = evaluation_of(sweep, accuracy_of(sweep), self.simulate)
        return take_sample(evaluation, sweep, {}, lambda: self.now)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("slow_axis", [False, True])
def test_a_sample_sees_how_many_designs_cost_nothing(share, slow_axis):
    """Whether those are the first of the table or spread all over it."""
    stiffness = "{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 200}"
    width = "{from: 1 m, to: 2 m, count: 5000}"
    finely = "{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 1000000}"
    sweep = grid_of(1, subgrade=finely) if slow_axis else grid_of(1, subgrade=stiffness, width=width)
    clock = Clock(200 * share, seconds_per_row=8e-6, seconds_per_block=2e-4)
    sample = clock.sample(sweep)
    truth = 8e-6 * (1.0 - share)
    assert truth / 1.3 < sample.seconds_per_row < 1.3 * truth + 5e-7
    assert clock.now < 0.35


def test_what_the_first_block_loads_does_not_count():
    sweep = grid_of(1, subgrade="{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 1000000}")
    clock = Clock(0.0, seconds_per_row=5e-6, seconds_per_block=2e-4, seconds_at_first=2.0)
    assert 5e-6 <= clock.sample(sweep).seconds_per_row < 6e-6
    assert clock.now < 2.2


@pytest.mark.parametrize("per_row", [5e-6, 1e-3])
def test_what_a_block_costs_besides_its_rows_hardly_counts(per_row):
    """Samples of some hundred quick rows would take them for five times as slow, and make blocks as short."""
    sweep = grid_of(1, subgrade="{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 1000000}")
    clock = Clock(0.0, seconds_per_row=per_row, seconds_per_block=3e-3)
    assert per_row <= clock.sample(sweep).seconds_per_row < 1.1 * per_row
    assert clock.now < 0.7


def test_a_sample_of_slow_designs_behind_quick_ones_stays_short():
    sweep = grid_of(1, subgrade="{from: 0.5 MN/m^3, to: 199.5 MN/m^3, count: 100000}")
    for seconds in (1e-3, 0.05):
        clock = Clock(40.0, seconds_per_row=seconds, seconds_per_block=2e-4)
        sample = clock.sample(sweep)
        assert 0.8 * seconds / 2 < sample.seconds_per_row < 2 * 0.8 * seconds
        assert clock.now < 0.5 + 64 * seconds


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
    assert one[0] == pytest.approx(0.5)
    assert ten[0] == pytest.approx(10 * one[0])
    assert ten[1] == pytest.approx(10 * one[1], rel=0.05)


def test_more_workers_than_cores_are_not_faster(monkeypatch):
    monkeypatch.setattr(running, "take_sample", lambda *_: RowCost(1e-3, 50.0, 10_000.0))
    monkeypatch.setattr(running, "available_cores", lambda: 2)
    one, two, eight = (estimate(grid(), jobs=jobs, simulate=plausible) for jobs in (1, 2, 8))
    assert one.seconds == pytest.approx(0.441)
    assert two.seconds == eight.seconds == pytest.approx(0.441 / 2)


def test_what_does_not_fit_is_said_with_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr("boulder_sweep.runner.progress._disk_free", lambda out: 1_000_000)
    assert too_large(10, "about", 1_000_000, tmp_path) == ""
    assert "needs about 3 GB of disk, and 1 MB are free" in too_large(10, "about", 3_000_000_000, tmp_path)
    monkeypatch.undo()
    assert too_large(10, "about", 100, tmp_path / "not" / "there") == ""
    assert too_large(10, "about", 10**18, tmp_path / "not" / "there")


def test_an_estimate_writes_nothing(tmp_path):
    found = estimate(grid(), tmp_path / "out", simulate=plausible)
    assert found.rows == grid().n_designs
    assert list(tmp_path.iterdir()) == []


def test_a_grid_of_ten_to_the_twelve_is_refused_before_memory_grows(tmp_path):
    sweep = grid(**HUGE)
    assert sweep.n_designs == 10**12
    estimate(grid_of(10), simulate=plausible)  # what is imported counts for nothing here
    tracemalloc.start()
    try:
        with pytest.raises(DoesNotFitError, match=r"1,000,000,000,000 rows.*TB.*free.*another folder"):
            run(sweep, tmp_path / "out", simulate=plausible)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 50e6
    assert list(tmp_path.iterdir()) == []


def test_an_estimate_of_ten_to_the_twelve_is_exact_in_rows():
    found = estimate(grid(**HUGE), simulate=plausible)
    assert found.rows == found.rows_to_compute == 10**12
