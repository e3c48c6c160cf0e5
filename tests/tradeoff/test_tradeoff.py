"""Speed against accuracy: what is measured, what is drawn, what is recommended."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from boulder_sweep.cli.main import cli, execute
from boulder_sweep.settings import load
from boulder_sweep.tradeoff.points import Method, Point, mark_front
from boulder_sweep.tradeoff.study import Tradeoff, measure
from tests.runner.grids import grid

GRID = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"


@pytest.fixture(scope="module", autouse=True)
def timed_once() -> Iterator[None]:
    """Time every method by one simulation: no test depends on how long it takes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("boulder_sweep.tradeoff.points._SHORTEST_TIMING_S", 1e-9)
        yield


@pytest.fixture(scope="module")
def found(timed_once: None) -> Tradeoff:
    return measure(grid(), designs=30, seconds=math.inf)


def made(
    method: Method,
    cpu_us: float,
    error_deg: float,
    estimated_deg: float = math.nan,
    *,
    accuracy: str = "",
    flips: int = 0,
) -> Point:
    """Return a point with a cost and an error that nobody measured."""
    errors = (error_deg,) * 3, (0.0,) * 3
    return Point(method, accuracy, 30, cpu_us, *errors[0], *errors[1], flips, 0, 0, estimated_deg, math.nan)


def plain(step_ms: float, elements: int = 0) -> Method:
    return Method("corrected", elements, step_ms, False, False)


def guarded(step_ms: float) -> Method:
    return Method("corrected", 0, step_ms, False, True)


def test_every_representation_step_and_reading_is_there(found: Tradeoff) -> None:
    methods = {point.method for point in found.points}
    assert {method.readings for method in methods} == {"corrected", "as_printed"}
    assert {method.soil_elements for method in methods} == {0, 50, 200, 1000, 5000}
    assert not found.left_out
    assert all(0.0 <= point.cpu_us < math.inf for point in found.points)
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


@pytest.mark.nightly
def test_errors_depend_on_the_sweep_alone() -> None:
    one, other = (measure(grid(), designs=40, seconds=math.inf) for _ in range(2))
    for a, b in zip(one.points, other.points, strict=True):
        assert replace(a, cpu_us=0.0, pareto=False) == pytest.approx(replace(b, cpu_us=0.0, pareto=False), nan_ok=True)


def test_the_best_way_keeps_to_what_is_wanted(found: Tradeoff) -> None:
    for wanted in (1e-2, 1e-4, 1e-6):
        best = found.best(wanted, error_estimate=True)
        assert best is not None
        assert best.rotation_max_deg <= wanted
    assert found.best(0.0, error_estimate=True) is None


def test_steps_whose_error_is_not_known_cannot_be_asked_for_by_a_number() -> None:
    """By a name they can."""
    unknown, named = made(guarded(6.0), 1.0, 1e-4), made(guarded(12.0), 6.0, 4e-4, accuracy="balanced")
    found = Tradeoff(grid(), (unknown, named), {}, ())
    assert found.best(1e-2, error_estimate=True) == named
    assert found.best(2e-4, error_estimate=True) is None


MADE = [
    made(plain(8.0), 2.0, 5e-3),
    made(plain(2.0), 8.0, 5e-5),
    made(plain(4.0), 1.0, 5e-5, flips=1),
    made(plain(4.0)._replace(readings="as_printed"), 1.0, 1e-9),
    made(guarded(12.0), 6.0, 4e-4, 2e-3, accuracy="balanced"),
    made(guarded(6.0), 7.0, 3e-4, 1e-3),
    made(guarded(3.0), 20.0, 5e-6, 3.2e-5),
    made(plain(2.0, 5000), 8000.0, 4e-5),
]
ASKED = {
    12.0: "use solver: {accuracy: balanced} (steps of 12 + 4 ms): 6 us a design, 0.0026 s for this grid on one core, "
    "with confirmed errors; unconfirmed, solver: {step: 8 ms} takes 2 us.",
    3.0: "use solver: {accuracy: 4e-05 deg} (steps of 3 + 1 ms): 20 us a design, 0.0088 s for this grid on one core, "
    "with confirmed errors",
}
SUMS = (
    "Sums over 5000 soil elements cost 1,000 times the closed form, which is their limit, and are 4e-05 deg off it at "
    "most: for comparison only."
)
LARGER = "An accuracy given as a number bounds the estimated errors, which are larger than the true ones."


def recommended(points: list[Point]) -> list[str]:
    return Tradeoff(grid(), tuple(points), {}, ()).recommendation()


def test_recommendation_names_the_cheapest_that_keeps_to_every_target() -> None:
    assert recommended(MADE) == [
        f"For 0.1 or 0.01 deg {ASKED[12.0]}",
        f"For 0.001 deg {ASKED[12.0].replace('{step: 8 ms} takes 2 us', '{step: 2 ms} takes 8 us')}",
        f"For 0.0001 deg {ASKED[3.0]}; unconfirmed, solver: {{step: 2 ms}} takes 8 us.",
        f"For 1e-05 deg {ASKED[3.0]}.",
        LARGER,
        SUMS,
    ]


def test_recommendation_says_once_what_holds_for_several_targets() -> None:
    cheap = [replace(MADE[0], rotation_max_deg=1e-6), replace(MADE[4], rotation_max_deg=2e-5)]
    assert recommended(cheap) == [
        f"For 0.1 or 0.01 or 0.001 or 0.0001 deg {ASKED[12.0]}",
        "For 1e-05 deg no step with confirmed errors is short enough; unconfirmed, solver: {step: 8 ms} takes 2 us.",
    ]


def test_recommendation_tells_a_lack_of_time_from_a_lack_of_accuracy() -> None:
    """Plain steps of 8 and 2 ms keep to 1e-3 and 1e-4 deg; what estimates errors was not measured, or in part."""
    late = "no method with confirmed errors was measured in the time; allow more --seconds"
    steps = [replace(MADE[0], rotation_max_deg=1e-3), replace(MADE[1], rotation_max_deg=1e-4)]
    step, shorter = (f"; unconfirmed, solver: {{step: {p.method.step_ms:g} ms}} takes {p.cpu_us:g} us" for p in steps)
    left = (guarded(12.0), guarded(3.0))
    none = Tradeoff(grid(), tuple(steps), {}, left).recommendation()
    assert none == [
        f"For 0.1 or 0.01 or 0.001 deg {late}{step}.",
        f"For 0.0001 deg {late}{shorter}.",
        f"For 1e-05 deg {late}.",
    ]
    coarse = made(guarded(12.0), 3.0, 1.0, 1.0)
    some = Tradeoff(grid(), (*steps, coarse), {}, left[1:]).recommendation()
    assert some[0] == f"For 0.1 or 0.01 or 0.001 deg {late.replace('was', 'accurate enough was')}{step}."
    every = Tradeoff(grid(), (*steps, coarse), {}, ()).recommendation()
    assert every[0] == f"For 0.1 or 0.01 or 0.001 deg no step with confirmed errors is short enough{step}."
    assert every[2] == "For 1e-05 deg no measured step is short enough."


def test_front_holds_what_nothing_beats() -> None:
    points = [made(plain(1.0), cost, error) for cost, error in ((1, 1e-2), (2, 1e-3), (3, 2e-3))]
    points.append(made(plain(1.0)._replace(readings="as_printed"), 3, 1e-9))
    mark_front(points)
    assert [p.pareto for p in points] == [True, True, False, True]


def test_table_and_picture_are_written(found: Tradeoff, tmp_path: Path) -> None:
    files = found.write(tmp_path / "out")
    assert [file.suffix for file in files] == [".parquet", ".csv", ".png"]
    assert pq.read_table(files[0]).num_rows == len(found.points)
    assert files[2].read_bytes().startswith(b"\x89PNG")


def test_command_prints_a_table_or_one_object() -> None:
    words = ["tradeoff", str(GRID), "--designs", "8", "--seconds", "1e9", "-q"]
    shown = CliRunner().invoke(cli, words)
    assert "us per" in shown.output
    assert "Sums over" in shown.output
    assert "left out" not in shown.output
    content = json.loads(CliRunner().invoke(cli, [*words, "--json"]).stdout)
    assert content["designs"] == 107008
    assert content["points"]
    assert content["left_out"] == []


def test_what_was_left_out_is_counted_and_listed_only_in_the_object(found: Tradeoff) -> None:
    words = ["tradeoff", str(GRID), "--designs", "8", "--seconds", "0", "-q"]
    shown = CliRunner().invoke(cli, words).output.splitlines()
    ways = len(found.points)
    assert shown == [
        "Nothing was measured: the time limit was too short.",
        f"left out for time: {ways} of {ways} methods (--json lists them)",
    ]
    content = json.loads(CliRunner().invoke(cli, [*words, "--json"]).stdout)
    assert len(content["left_out"]) == ways
    assert set(content["left_out"][0]) == set(Method._fields)


def test_time_runs_out_gracefully(tmp_path: Path) -> None:
    found = measure(grid(), designs=40, seconds=0.0)
    assert not found.points
    assert found.left_out
    assert found.recommendation() == ["Nothing was measured: the time limit was too short."]
    assert found.write(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_one_design_that_does_not_move_is_drawn_too(tmp_path: Path) -> None:
    still = load(GRID.with_name("rwg.yaml"), ["vehicle.speed=0 m/s"])
    found = measure(still, seconds=math.inf)
    assert found.points
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
