"""Rows whose motion goes on past the horizon pass or fail only where finer steps agree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, Status
from boulder_kernels.rules import AGREEING, FIRST_FACTOR
from boulder_sweep.columns import REASONS
from boulder_sweep.judge.accuracy import FACTOR, accuracy_of, control_of
from boulder_sweep.judge.evaluation import by_kernels, evaluation_of
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import ERROR, FAIL, NUMERICAL_ERROR, PASS, UNDECIDED

SHALLOW = Path(__file__).parent / "late_designs.csv"
"""Boulders that rock for seconds. An independent integration by steps of 0.1 ms (`benchmarks.late`) finds: the first
two overturn at 7.0313 s and 6.769 s, the third stands for 10 s and overturns later, the fourth stands, at most 16.034
deg. But slower trucks overturn the first, second and fourth."""


def sweep_file(folder: Path, accuracy: str = "balanced") -> Path:
    grid = folder / "grid.yaml"
    grid.write_text(f"name: shallow\ntable: {SHALLOW}\nsolver: {{accuracy: {accuracy}}}\n")
    return grid


def sweep_of(folder: Path, accuracy: str = "balanced") -> boulder_sweep.Sweep:
    return boulder_sweep.load(sweep_file(folder, accuracy))


def designs_in(sweep: boulder_sweep.Sweep) -> Designs:
    return designs_of(sweep.block(0, sweep.n_designs), None)


@pytest.mark.parametrize("accuracy", ["balanced", "fine"])
def test_shallow_boulders_end_as_an_independent_integration_says(tmp_path: Path, accuracy: str) -> None:
    sweep = sweep_of(tmp_path, accuracy)
    found = evaluation_of(sweep, accuracy_of(sweep)).judged(designs_in(sweep))
    rows = [found.row(place) for place in range(4)]
    assert [(row["verdict"], row["reason"]) for row in rows] == [
        ("fail", "overturns"),
        ("fail", "overturns"),
        ("undecided", "horizon"),
        ("fail", "slower_truck"),
    ]
    assert rows[0]["time_to_limit_s"] == pytest.approx(7.0313, abs=2e-4)
    assert rows[1]["time_to_limit_s"] == pytest.approx(6.769, abs=3e-3)
    assert rows[2]["max_rotation_deg"] == pytest.approx(3.4489, abs=1e-3)
    assert rows[3]["max_rotation_deg"] == pytest.approx(16.0344, abs=1e-3)


def test_an_overturned_row_has_an_error_of_its_time_and_none_of_its_rotation(tmp_path: Path) -> None:
    sweep = sweep_of(tmp_path)
    found = evaluation_of(sweep, accuracy_of(sweep)).judged(designs_in(sweep))
    overturned, standing = found.row(0), found.row(3)
    assert overturned["rotation_error_deg"] is None
    assert 0.0 < overturned["time_to_limit_error_s"] < 0.1
    assert standing["time_to_limit_error_s"] is None
    assert 0.0 < standing["rotation_error_deg"] < 0.1


def stand_in(ends: dict[int, tuple[Status, float]], asked: list[float], ways: dict[int, float] | None = None):
    """Kernels whose solutions at each refinement (0, 1, ...) end after 5 s in some way, at some rotation [rad].

    The way of the truck is 1 m, unless `ways` says otherwise [m].
    """

    def simulate(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
        asked.append(control.h)
        level = len(asked) - 1
        status, theta = ends.get(level, ends[max(ends)])
        out = by_kernels(table, readings, control._replace(h=0.001, horizon=0.01, longest_horizon=0.0))
        n = len(table.L)
        at_limit = status == Status.LIMIT
        return out._replace(
            status=np.full(n, status, np.int8),
            theta_max=np.full(n, theta),
            x_v_max=np.full(n, (ways or {}).get(level, 1.0)),
            t_limit=np.full(n, 5.0 if at_limit else np.nan),
            t_end=np.full(n, 5.0),
            theta_error=np.full(n, 0.0 if at_limit else 1e-4),
            x_error=np.full(n, 1e-3),
        )

    return simulate


def judged_by(
    folder: Path, ends: dict[int, tuple[Status, float]], asked: list[float], ways: dict[int, float] | None = None
):
    sweep = sweep_of(folder)
    evaluation = replace(evaluation_of(sweep, accuracy_of(sweep)), simulate=stand_in(ends, asked, ways))
    return evaluation.judged(designs_in(sweep).rows(slice(3, 4)))


FAR_M = 9.0
"""Way of a truck whose cargo bed passes the boulder by more than P1 allows [m]."""
SAME, REFUSED, OVERTURNED = (Status.SETTLED, 0.1), (Status.WEAK_DAMPER, 0.0), (Status.LIMIT, np.radians(20.0))
OPEN = (UNDECIDED, NUMERICAL_ERROR)
PASSES, OVERTURNS, PENETRATES = (
    (PASS if not why else FAIL, REASONS.index(why)) for why in ("", "overturns", "penetration")
)


@pytest.mark.parametrize(
    ("ends", "ways", "decided", "solutions"),
    [
        ({0: SAME}, {}, PASSES, 1 + AGREEING),
        (dict.fromkeys(range(AGREEING), SAME) | {AGREEING: OVERTURNED}, {}, OVERTURNS, 1 + 2 * AGREEING),
        ({0: SAME, 1: (Status.SETTLED, 0.1 + 2e-4)}, {}, PASSES, 2 + AGREEING),
        ({level: (Status.SETTLED, 0.1 + 1e-3 * level) for level in range(40)}, {}, OPEN, None),
        ({0: SAME}, dict.fromkeys(range(40), FAR_M), PENETRATES, 2),
        ({0: SAME}, {0: FAR_M} | dict.fromkeys(range(1, 40), FAR_M + 0.9e-3), PENETRATES, 2),  # each is off by 1 mm
        ({0: SAME}, {0: FAR_M} | dict.fromkeys(range(1, 40), FAR_M + 1.1e-3), PENETRATES, 3),
        ({0: SAME}, {level: FAR_M + 0.01 * level for level in range(40)}, OPEN, None),
        (dict.fromkeys(range(6), REFUSED) | {6: SAME}, {}, PASSES, 7 + AGREEING),
        ({0: REFUSED}, {}, (ERROR, None), 7),
    ],
    ids=[
        *("agree", "finer steps overturn", "the peak moves", "no two peaks agree", "penetrates", "ways agree"),
        *("ways do not", "no two ways agree", "last resort", "last resort refuses"),
    ],
)
def test_a_late_row_needs_finer_solutions_that_agree(tmp_path: Path, ends, ways, decided, solutions) -> None:
    asked: list[float] = []
    found = judged_by(tmp_path, ends, asked, ways)
    assert found.verdict[0] == decided[0]
    assert decided[1] in (None, found.reason[0])
    assert len(asked) == solutions if solutions else len(asked) > 3
    if decided == PASSES and ends == {0: SAME}:
        assert np.allclose(np.divide(asked[1:], asked[:-1]), FIRST_FACTOR)
    if REFUSED in ends.values() and decided == PASSES:
        assert np.allclose(np.divide(asked[7:], asked[6:-1]), FACTOR)
    if decided == OPEN:
        assert (found.row(0)["rotation_error_deg"], found.row(0)["displacement_error_m"]) == (None, None)


def test_there_are_finer_steps_however_many_soil_elements(tmp_path: Path) -> None:
    asked: list[float] = []
    sweep = boulder_sweep.load(sweep_file(tmp_path), ["model.soil.elements=5000"])
    evaluation = replace(evaluation_of(sweep, accuracy_of(sweep)), simulate=stand_in({0: (Status.SETTLED, 0.1)}, asked))
    found = evaluation.judged(designs_in(sweep).rows(slice(3, 4)))
    assert found.verdict[0] == PASS
    assert len(asked) == 1 + AGREEING


def test_a_last_resort_whose_steps_are_hardly_shorter_confirms_nothing(tmp_path: Path) -> None:
    asked: list[float] = []
    peaks = {0: 0.1, 1: 0.11, 2: 0.115, 3: 0.12, 6: 0.12}
    ends = {level: (Status.SETTLED, peak) for level, peak in peaks.items()} | dict.fromkeys((4, 5), REFUSED)
    found = judged_by(tmp_path, ends, asked)
    assert found.verdict[0] == PASS
    assert np.allclose(asked[3:], [7.5e-4, 7.5e-4 * FACTOR, 7.5e-4 * FACTOR**2, 5e-4 * FACTOR, 5e-4 * FACTOR**2])


def test_rows_without_an_estimate_of_their_error_are_not_repeated(tmp_path: Path) -> None:
    asked: list[float] = []
    sweep = sweep_of(tmp_path, "fast")
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    evaluation = replace(evaluation, simulate=stand_in({0: (Status.SETTLED, 0.1)}, asked))
    evaluation.judged(designs_in(sweep).rows(slice(3, 4)))
    assert len(asked) == 1
    assert not control_of(sweep, accuracy_of(sweep)).error_estimate


def test_where_one_solution_overturns_and_the_other_does_not_nothing_is_decided(tmp_path: Path) -> None:
    sweep = sweep_of(tmp_path)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))

    def disagree(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
        out = stand_in({0: (Status.LIMIT, np.radians(20.0))}, [])(table, readings, control)
        return out._replace(theta_error=np.full(len(table.L), np.inf), x_error=np.full(len(table.L), np.inf))

    found = replace(evaluation, simulate=disagree).judged(designs_in(sweep).rows(slice(0, 1)))
    assert (found.verdict[0], found.reason[0]) == (UNDECIDED, NUMERICAL_ERROR)
    assert np.isnan(found["time_to_limit_s"][0])


def test_the_pilot_counts_designs_that_overturn(tmp_path: Path) -> None:
    sweep = sweep_of(tmp_path, "1e-4 deg")
    assert accuracy_of(sweep).steps.step_s < 0.012
