"""Speed against accuracy: what is measured, what is drawn, what is recommended."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from boulder_sweep.cli.main import cli, execute
from boulder_sweep.settings import load
from boulder_sweep.tradeoff.points import Method, Point, mark_front
from boulder_sweep.tradeoff.study import TARGETS_DEG, Tradeoff, measure
from tests.runner.grids import grid

GRID = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"


@pytest.fixture(scope="module")
def found() -> Tradeoff:
    return measure(grid(), designs=30)


def test_every_representation_step_and_reading_is_there(found: Tradeoff) -> None:
    methods = {point.method for point in found.points}
    assert {method.readings for method in methods} == {"corrected", "as_printed"}
    assert {method.soil_elements for method in methods} == {0, 50, 200, 1000, 5000}
    assert not found.left_out
    assert all(point.cpu_us > 0.0 for point in found.points)
    assert {point.accuracy for point in found.points} == {"", "fast", "balanced", "fine"}


def test_errors_are_ordered_and_fall_with_the_step(found: Tradeoff) -> None:
    for point in found.points:
        assert 0.0 <= point.rotation_rms_deg <= point.rotation_max_deg
        assert point.rotation_p99_deg <= point.rotation_max_deg
        assert point.displacement_p99_m <= point.displacement_max_m
    plain = [p for p in found.points if p.method.is_plain and p.method.readings == "corrected"]
    assert plain[0].rotation_max_deg > 100 * plain[-1].rotation_max_deg
    sums = [
        p
        for p in found.points
        if p.method.readings == "corrected" and p.method.step_ms == 2.0 and p.method.soil_elements
    ]
    assert [p.rotation_rms_deg for p in sums] == sorted((p.rotation_rms_deg for p in sums), reverse=True)


@pytest.mark.slow
def test_errors_depend_on_the_sweep_alone() -> None:
    one, other = (measure(grid(), designs=40, seconds=60.0) for _ in range(2))
    for a, b in zip(one.points, other.points, strict=True):
        assert replace(a, cpu_us=0.0, pareto=False) == pytest.approx(replace(b, cpu_us=0.0, pareto=False), nan_ok=True)


def test_the_best_way_keeps_to_what_is_wanted(found: Tradeoff) -> None:
    for wanted in (1e-2, 1e-4, 1e-6):
        best = found.best(wanted, error_estimate=True)
        assert best is not None
        assert best.rotation_max_deg <= wanted
    assert found.best(0.0, error_estimate=True) is None
    text = " ".join(found.recommendation())
    assert "0.01 deg" in text
    assert "us a design" in text
    named = all((best := found.best(wanted, error_estimate=True)) and best.accuracy for wanted in TARGETS_DEG)
    assert named != ("bounds the estimated errors" in text)


def test_front_holds_what_nothing_beats() -> None:
    def point(cost: float, error: float, readings: str = "corrected") -> Point:
        method = Method(readings, 0, 1.0, False, False)
        return Point(method, "", 1, cost, error, error, error, 0.0, 0.0, 0.0, 0, 0, 0, 0.0, 1.0)

    points = [point(1, 1e-2), point(2, 1e-3), point(3, 2e-3), point(3, 1e-9, "as_printed")]
    mark_front(points)
    assert [p.pareto for p in points] == [True, True, False, True]


def test_table_and_picture_are_written(found: Tradeoff, tmp_path: Path) -> None:
    files = found.write(tmp_path / "out")
    assert [file.suffix for file in files] == [".parquet", ".csv", ".png"]
    assert pq.read_table(files[0]).num_rows == len(found.points)
    assert files[2].read_bytes().startswith(b"\x89PNG")


def test_command_prints_a_table_or_one_object() -> None:
    words = ["tradeoff", str(GRID), "--designs", "40", "--seconds", "1", "-q"]
    shown = CliRunner().invoke(cli, words)
    assert "us per" in shown.output
    assert "Sums over" in shown.output or "left out for time" in shown.output
    content = json.loads(CliRunner().invoke(cli, [*words, "--json"]).stdout)
    assert content["designs"] == 107008
    assert content["points"]


def test_time_runs_out_gracefully(tmp_path: Path) -> None:
    found = measure(grid(), designs=40, seconds=0.0)
    assert not found.points
    assert found.left_out
    assert found.recommendation() == ["Nothing was measured: the time limit was too short."]
    assert found.write(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_one_design_that_does_not_move_is_drawn_too(tmp_path: Path) -> None:
    still = load(GRID.with_name("rwg.yaml"), ["vehicle.speed=0 m/s"])
    found = measure(still, seconds=1.0)
    assert all(point.rotation_max_deg == 0.0 for point in found.points)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.write(tmp_path)[2].stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "words_of_error"),
    [
        (["-o", "{file}"], "error: the folder {file} cannot be made: File exists"),
        (["--seconds", "nan"], "--seconds nan: give a number of seconds"),
        (["--set", "site.embedment_depth=5 m"], "error: rwg: none of the designs can be computed"),
    ],
)
def test_wrong_use_of_the_command(
    words: list[str], words_of_error: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("here already", encoding="utf-8")
    code = execute(["tradeoff", str(GRID.with_name("rwg.yaml")), "-q", *(word.format(file=file) for word in words)])
    assert code == 2
    assert words_of_error.format(file=file) in capsys.readouterr().err
