"""Pass/fail maps: which plane of a table is shown, and that every design of it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.cli import execute
from boulder_sweep.views.figures import PictureError
from boulder_sweep.views.slices import label, plane, value_text
from boulder_sweep.views.verdict_map import CLASSES, classes_of, draw_verdict_map

GRID = """\
name: small grid
boulder: {length: 1.65 m, width: 1.68 m, height: [2.6, 3.0, 3.4] m, density: 2596 kg/m^3}
site: {embedment_ratio: [0.4, 0.5, 0.6]}
soil: {density: 1859.9 kg/m^3, friction_angle: [36, 42] deg, subgrade_reaction: [60, 95] MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


def test_axes_by_default(table: pd.DataFrame) -> None:
    found = plane(table)
    assert (found.across, found.up) == ("embedment_ratio", "boulder_height_m")
    assert (found.columns, found.rows_over) == ("subgrade_reaction_MN_m3", "friction_angle_deg")
    assert found.column_values == [20.0, 40.0, 80.0, 100.0]
    assert found.row_values == [36.0, 42.0]
    assert found.fixed == {"boulder_width_m": 1.5}
    assert found.left_out == {"subgrade_reaction_MN_m3": 5}
    assert len(found.rows) == 3 * 4 * 2 * 4


def test_other_axes_and_values(table: pd.DataFrame) -> None:
    found = plane(table, across="boulder_width_m", columns="friction_angle_deg", at={"embedment_ratio": 0.62})
    assert (found.across, found.up, found.columns) == ("boulder_width_m", "boulder_height_m", "friction_angle_deg")
    assert found.fixed["embedment_ratio"] == pytest.approx(0.6)
    assert found.rows_over == "subgrade_reaction_MN_m3"
    assert found.row_values == [20.0, 60.0, 100.0]
    assert set(np.round(found.rows.embedment_depth_m / found.rows.boulder_height_m, 9)) == {0.6}
    assert len(found.rows) == 3 * 3 * 2 * 3


def test_depth_is_the_axis_where_it_has_fewer_values(table: pd.DataFrame) -> None:
    by_depth = table.assign(embedment_depth_m=np.round(table.embedment_depth_m))
    assert plane(by_depth).across == "embedment_depth_m"


@pytest.mark.parametrize("wrong", [{"across": "weight"}, {"at": {"colour": 1.0}}])
def test_unknown_inputs_are_refused(table: pd.DataFrame, wrong: dict[str, object]) -> None:
    with pytest.raises(PictureError, match=r"is not an input column; there are boulder_length_m"):
        plane(table, **wrong)


def test_a_single_axis_is_no_map(table: pd.DataFrame) -> None:
    with pytest.raises(PictureError, match="needs two inputs that vary"):
        plane(table.iloc[:2])


def test_classes_of_all_verdicts() -> None:
    rows = pd.DataFrame(
        {
            "verdict": ["pass", "fail", "fail", "fail", "undecided", "undecided", "error"],
            "reason": ["", "overturns", "penetration", "no_contact", "horizon", "error", "d >= H"],
        }
    )
    names = [CLASSES[code][0] for code in classes_of(rows)]
    expected = ["pass", "fail/overturns", "fail/penetration", "fail/no_contact", "undecided", "undecided", "error"]
    assert names == expected


def test_map_is_drawn_as_cells_or_as_points(table: pd.DataFrame, tmp_path: Path) -> None:
    draw_verdict_map(table, tmp_path / "cells.png", title="made up")
    scattered = table.sample(60, random_state=1).assign(boulder_height_m=lambda t: t.boulder_height_m + t.index * 1e-4)
    draw_verdict_map(scattered, tmp_path / "points.png")
    for name in ("cells.png", "points.png"):
        assert (tmp_path / name).stat().st_size > 10_000


def test_words() -> None:
    assert label("boulder_height_m") == "boulder height [m]"
    assert label("subgrade_reaction_MN_m3") == "subgrade reaction β [MN/m³]"
    assert label("vehicle_damper_N_s_m") == "vehicle damper [N·s/m]"
    assert label("strain_rate_factor") == "strain rate factor"
    assert value_text("friction_angle_deg", 36.0) == "φ′ = 36°"
    assert value_text("bed_offset_m", 2.9) == "bed offset 2.9 m"


@pytest.fixture
def out(tmp_path: Path) -> Path:
    (tmp_path / "grid.yaml").write_text(GRID)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "grid.yaml"), tmp_path / "grid.sweep")
    return tmp_path / "grid.sweep"


def test_command_draws_a_map(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["plot", str(out), "--at", "subgrade_reaction_MN_m3=95"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(str(out.with_suffix(".png")))
    assert "18 of 36 designs" in printed
    assert out.with_suffix(".png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--at", "subgrade_reaction_MN_m3"], "lacks ="),
        (["--at", "subgrade_reaction_MN_m3=stiff"], "must be COLUMN=VALUE"),
        (["--across", "weight"], "is not an input column"),
        (["-o", "map.jpeg"], "must end in .png"),
    ],
)
def test_command_refuses_wrong_use(
    out: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    assert execute(["plot", str(out), *words]) == 2
    assert message in capsys.readouterr().err


def test_command_says_where_there_is_no_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["plot", str(tmp_path / "nothing.sweep")]) == 2
    assert "nothing.sweep" in capsys.readouterr().err
