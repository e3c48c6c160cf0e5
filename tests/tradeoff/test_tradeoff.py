"""Speed against accuracy: what is measured, what is drawn, what is recommended."""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from boulder_sweep.cli.main import cli, execute
from boulder_sweep.settings import load
from boulder_sweep.tradeoff.study import Method, Point, Tradeoff, mark_front, measure
from tests.runner.grids import grid

GRID = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"


@pytest.fixture(scope="module", autouse=True)
def timed_once() -> Iterator[None]:
    """Time every method by one simulation: no test depends on how long it takes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("boulder_sweep.tradeoff.study._SHORTEST_TIMING_S", 1e-9)
        yield


@pytest.fixture(scope="module")
def found(timed_once: None) -> Tradeoff:
    return measure(grid(), designs=30, seconds=math.inf)


def test_every_representation_step_and_reading_is_there(found: Tradeoff) -> None:
    methods = {point.method for point in found.points}
    assert {method.readings for method in methods} == {"corrected", "as_printed"}
    assert {method.soil_elements for method in methods} == {0, 50, 200, 1000, 5000}
    assert not found.left_out
    assert all(0.0 <= point.cpu_us < math.inf for point in found.points)
    assert {point.accuracy for point in found.points} == {"", "fast", "balanced", "fine"}


def test_errors_are_ordered_and_fall_with_the_step(found: Tradeoff) -> None:
    for point in found.points:
        assert 0.0 <= point.rotation_p99_deg <= point.rotation_max_deg
        assert point.displacement_p99_m <= point.displacement_max_m
    plain = [p for p in found.points if p.method[:2] == ("corrected", 0) and not any(p.method[3:])]
    assert plain[0].rotation_max_deg > 100 * plain[-1].rotation_max_deg
    sums = [
        p
        for p in found.points
        if p.method.readings == "corrected" and p.method.step_ms == 2.0 and p.method.soil_elements
    ]
    assert [p.rotation_p99_deg for p in sums] == sorted((p.rotation_p99_deg for p in sums), reverse=True)


@pytest.mark.nightly
def test_errors_depend_on_the_sweep_alone() -> None:
    one, other = (measure(grid(), designs=40, seconds=math.inf) for _ in range(2))
    for a, b in zip(one.points, other.points, strict=True):
        assert replace(a, cpu_us=0.0, pareto=False) == pytest.approx(replace(b, cpu_us=0.0, pareto=False), nan_ok=True)


def test_an_estimate_covers_the_errors_and_can_be_asked_for(found: Tradeoff) -> None:
    estimating = [p for p in found.points if p.method.error_estimate and p.method.readings == "corrected"]
    assert estimating
    for point in estimating:
        assert point.estimated_p99_9_deg is not None
        assert point.estimated_p99_9_deg + 1e-9 >= point.rotation_max_deg
    assert {p.estimated_p99_9_deg for p in found.points if not p.method.error_estimate} == {None}


def test_front_holds_what_nothing_beats() -> None:
    method = Method("corrected", 0, 1.0, False, False)
    points = [
        Point(of, "", 30, cost, error, error, 0.0, 0.0, 0, 0, None)
        for of, cost, error in (
            (method, 1.0, 1e-2),
            (method, 2.0, 1e-3),
            (method, 3.0, 2e-3),
            (method._replace(readings="as_printed"), 3.0, 1e-9),
        )
    ]
    mark_front(points)
    assert [p.pareto for p in points] == [True, True, False, True]


def test_table_and_picture_are_written(found: Tradeoff, tmp_path: Path) -> None:
    files = found.write(tmp_path)
    assert [file.name for file in files] == ["tradeoff.parquet", "tradeoff.png"]
    table = pq.read_table(files[0])
    assert table.num_rows == len(found.points)
    assert table.column_names == [*Method._fields, *(field.name for field in fields(Point)[1:])]
    assert files[1].read_bytes().startswith(b"\x89PNG")


def test_command_prints_a_row_for_every_method_or_one_object(found: Tradeoff) -> None:
    words = ["tradeoff", str(GRID), "--designs", "8", "--seconds", "1e9", "-q"]
    lines = CliRunner().invoke(cli, words).output.splitlines()
    assert len([line for line in lines if re.match(r"  \d", line)]) == len(found.points)
    assert {line.split()[-1] for line in lines if line[-1:].isalpha()} >= {"fast", "balanced", "fine"}
    content = json.loads(CliRunner().invoke(cli, [*words, "--json"]).stdout)
    assert (content["designs"], content["left_out"]) == (107008, 0)
    assert len(content["points"]) == len(found.points)


def test_what_there_was_no_time_for_is_counted(found: Tradeoff, tmp_path: Path) -> None:
    words = ["tradeoff", str(GRID), "--designs", "8", "--seconds", "0", "-q", "-o", str(tmp_path)]
    ways = len(found.points)
    assert CliRunner().invoke(cli, words).output == f"left out for time: {ways} of {ways} methods\n"
    assert list(tmp_path.iterdir()) == []


def test_one_design_that_does_not_move_is_drawn_too(tmp_path: Path) -> None:
    still = load(GRID.with_name("rwg.yaml"), ["vehicle.speed=0 m/s"])
    found = measure(still, seconds=math.inf)
    assert found.points
    assert all(point.rotation_max_deg == 0.0 for point in found.points)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.write(tmp_path)[1].stat().st_size > 10_000


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
