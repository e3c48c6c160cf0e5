"""Pass/fail maps: which plane of a table is shown, that every design of it is, and names of any length."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

import boulder_sweep
from boulder_sweep.cli.main import execute
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.errors import PictureError
from boulder_sweep.settings import load_text
from boulder_sweep.views import pictures
from boulder_sweep.views.verdict_map import (
    CLASSES,
    Pieces,
    Slice,
    _caption,
    classes_of,
    draw_verdict_map,
    pieces_of,
    plane,
)
from tests.answers.designs import bare_need

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


@pytest.fixture
def by_depth() -> pd.DataFrame:
    """A grid of 27 heights and 19 depths, whose ratios all differ, and 4 densities."""
    axes = (np.linspace(1.6, 3.4, 27), np.linspace(0.8, 1.55, 19), (1.0, 1.5, 2.0, 2.5))
    height, depth, density = (each.ravel() for each in np.meshgrid(*axes, indexing="ij"))
    inputs = {name: np.ones(len(height)) for name in INPUT_COLUMNS}
    inputs |= {"boulder_height_m": height, "embedment_depth_m": depth, "boulder_density_kg_m3": density}
    return pd.DataFrame(inputs).assign(verdict="pass", reason="", impact_height_m=0.5 * (height - depth + 0.5))


@pytest.mark.parametrize(
    "axes",
    [
        {},
        {"across": "embedment_ratio"},
        {"up": "embedment_ratio", "across": "boulder_height_m"},
        {"up": "embedment_ratio", "across": "embedment_depth_m"},
    ],
)
def test_of_height_depth_and_ratio_two_give_the_third(by_depth, axes):
    """The third is not held at a value too, which would leave a line of the plane."""
    found = plane(by_depth, **axes)
    assert found.fixed == {"boulder_density_kg_m3": 1.5}
    assert (found.count, found.total) == (27 * 19, 27 * 19 * 4)


def test_depth_across_a_grid_of_ratios_holds_no_ratio(table: pd.DataFrame) -> None:
    found = plane(table, across="embedment_depth_m")
    assert "embedment_ratio" not in found.fixed
    assert found.count == 3 * 4 * 2 * 4


def test_a_value_held_for_one_of_the_three_is_held(by_depth: pd.DataFrame) -> None:
    found = plane(by_depth, up="boulder_density_kg_m3", at={"boulder_height_m": 2.5})
    assert (found.across, found.count) == ("embedment_depth_m", 19 * 4)
    assert set(found.rows.boulder_height_m) == {by_depth.boulder_height_m.unique()[13]}


def test_impact_height_is_held_on_request(by_depth: pd.DataFrame) -> None:
    assert "impact_height_m" not in plane(by_depth).fixed
    assert "impact_height_m" in plane(by_depth, at={"impact_height_m": 1.0}).fixed


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"at": {"boulder_length_m": 2.0}}, "boulder_length_m cannot be held at 2: it is 1 in every design"),
        ({"across": "boulder_height_m", "at": {"boulder_height_m": 2.0}}, "boulder_height_m is used twice"),
        ({"across": "boulder_height_m", "up": "boulder_height_m"}, "boulder_height_m is used twice"),
    ],
)
def test_a_value_that_would_change_nothing_is_refused(by_depth: pd.DataFrame, wrong, message: str) -> None:
    with pytest.raises(PictureError, match=message):
        plane(by_depth, **wrong)
    assert plane(by_depth, at={"boulder_length_m": 1.0}).count == 27 * 19, "what holds anyway is no mistake"


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


def drawn(table, monkeypatch: pytest.MonkeyPatch, path: Path, **options: Any) -> tuple[Slice, list[Any]]:
    """Draw a map; what it is of, and the numbers that are drawn in each of its panels."""
    numbers: list[Any] = []

    def noted(axes, *arguments, **style):
        numbers.append([np.ma.filled(np.ma.asarray(each, dtype=float), -99) for each in arguments])
        numbers.append(np.asarray(style.get("c", ())))

    with monkeypatch.context() as patch:
        patch.setattr(Axes, "pcolormesh", noted)
        patch.setattr(Axes, "scatter", noted)
        patch.setattr("boulder_sweep.views.pictures.save", lambda fig, target: None)
        return draw_verdict_map(table, path, **options), numbers


def test_a_reason_of_another_version_is_left_blank_not_drawn_as_a_pass(table, tmp_path, monkeypatch) -> None:
    scattered = table.sample(60, random_state=1).assign(boulder_height_m=lambda t: t.boulder_height_m + t.index * 1e-4)
    scattered = scattered.assign(verdict="fail", reason=["melts", "overturns"] * 30)
    codes: list[np.ndarray] = []
    monkeypatch.setattr(Axes, "scatter", lambda self, *_, c, **__: codes.append(c))
    draw_verdict_map(scattered, tmp_path / "points.png")
    assert set(np.concatenate(codes)) == {[key for key, _, _ in CLASSES].index("fail/overturns")}


def in_pieces(table: pd.DataFrame, size: int) -> Pieces:
    whole = pieces_of(table)

    def pieces(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        (frame,) = whole(columns)
        for first in range(0, len(frame), size):
            yield frame[[name for name in columns if name in frame]][first : first + size]

    return pieces


@pytest.mark.parametrize("size", [pytest.param(1, marks=pytest.mark.nightly), 7, 100])
@pytest.mark.parametrize("cells", [True, False])
def test_a_table_in_pieces_gives_the_same_picture(table, tmp_path, monkeypatch, size, cells):
    if not cells:
        table = table.sample(150, random_state=1).assign(boulder_height_m=lambda t: t.boulder_height_m + t.index * 1e-4)
    whole, expected = drawn(table, monkeypatch, tmp_path / "whole.png")
    parts, found = drawn(in_pieces(table, size), monkeypatch, tmp_path / "parts.png")
    np.testing.assert_equal(found, expected)
    assert expected
    for name in ("across", "up", "columns", "rows_over", "column_values", "row_values", "fixed", "total", "left_out"):
        assert getattr(parts, name) == getattr(whole, name), name
    assert parts.count == len(whole.rows)
    assert parts.total == len(table)
    assert parts.passing == (whole.rows.verdict == "pass").sum()


@pytest.fixture
def out(tmp_path: Path) -> Path:
    (tmp_path / "grid.yaml").write_text(GRID)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "grid.yaml"), tmp_path / "grid.sweep")
    return tmp_path / "grid.sweep"


def test_command_draws_a_map(out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the whole table in memory."""
    monkeypatch.setattr("boulder_sweep.store.read", None)
    assert execute(["plot", str(out), "--at", "subgrade_reaction_MN_m3=95"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(str(out.with_suffix(".png")))
    assert "18 of 36 designs" in printed
    assert out.with_suffix(".png").stat().st_size > 10_000


def test_command_says_which_value_it_took(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["plot", str(out), "--at", "subgrade_reaction_MN_m3=120"]) == 0
    assert "subgrade_reaction_MN_m3 is 95 in this map, the value nearest to 120" in capsys.readouterr().err
    assert execute(["plot", str(out), "--at", "subgrade_reaction_MN_m3=60"]) == 0
    assert not capsys.readouterr().err


def test_a_list_of_designs_without_a_common_plane_is_refused(table: pd.DataFrame, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    one_by_one = table.iloc[:6].assign(
        **{name: rng.uniform(1.0, 2.0, 6) for name in ("boulder_length_m", "boulder_width_m", "boulder_height_m")},
        vehicle_mass_kg=rng.uniform(5000.0, 9000.0, 6),
    )
    with pytest.raises(PictureError, match=r"none of the 6 designs lies at .*a list of designs rather than a grid"):
        draw_verdict_map(one_by_one, tmp_path / "map.png")
    assert not (tmp_path / "map.png").exists()


NAMED = """\
name: three soils
boulder: {length: 1.65 m, width: 1.68 m, height: [2.6, 3.0, 3.4] m, density: 2596 kg/m^3}
site: {embedment_ratio: [0.4, 0.5, 0.6]}
soil:
  - {name: loose, density: 1700 kg/m^3, friction_angle: 30 deg, subgrade_reaction: 10 MN/m^3}
  - {name: dense, density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
  - {name: gravel, density: 2000 kg/m^3, friction_angle: 44 deg, subgrade_reaction: 95 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.fixture
def named_soils(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A result with three named soils."""
    monkeypatch.chdir(tmp_path)
    Path("named.yaml").write_text(NAMED)
    assert execute(["run", "named.yaml", "-q", "-o", "named.sweep"]) == 0
    return "named.sweep"


def test_every_named_soil_has_its_map(named_soils: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["plot", named_soils, "-o", "map.svg"]) == 0
    assert "map.svg: 27 of 27 designs" in capsys.readouterr().out
    drawn = Path("map.svg").read_text()
    assert all(f"<!-- soil: {name} -->" in drawn for name in ("loose", "dense", "gravel"))
    assert execute(["plot", named_soils, "-o", "one.svg", "--at", "soil=dense"]) == 0
    assert "one.svg: 9 of 27 designs" in capsys.readouterr().out
    assert "soil:" in Path("one.svg").read_text()
    assert execute(["plot", named_soils, "-o", "one.svg", "--at", "soil=mud"]) == 2
    assert "there are loose, dense, gravel" in capsys.readouterr().err


def test_a_design_chart_has_a_curve_for_every_named_soil_in_which_something_passes(tmp_path: Path) -> None:
    sweep = load_text(NAMED, tmp_path / "named.yaml")
    found = bare_need(sweep)
    found.plot(tmp_path / "chart.svg", units="us")
    drawn = (tmp_path / "chart.svg").read_text()
    assert [f"<!-- {name} -->" in drawn for name in ("loose", "dense", "gravel")] == [False, True, True]
    assert "<!-- embedment depth [ft] -->" in drawn


def test_the_caption_says_in_what_respect_passes_lie_outside_what_was_tested(table: pd.DataFrame) -> None:
    flags = np.resize(np.array(["", "width", "width;soil_pair", "width"]), len(table))
    found = plane(table.assign(validity=pd.Categorical(flags)))
    shown = found.rows[found.rows.verdict == "pass"].validity.astype(str)
    assert found.passing == len(shown) > 20
    assert found.flags == {
        "": (shown == "").sum(),
        "width": shown.str.contains("width").sum(),
        "soil_pair": shown.str.contains("soil_pair").sum(),
    }
    caption = _caption(found, "terms", 400, "si").replace("\N{NO-BREAK SPACE}", " ")
    share = f"{(shown != '').mean():.0%}"
    assert f"Of the passes {share} lie outside what the model was tested on: width {share}, soil pair " in caption
    assert "No pass lies outside what the model was tested on" in _caption(plane(table), "terms", 400, "si")
    assert "tested on" not in _caption(plane(table.drop(columns="validity")), "terms", 400, "si")


LONG = ("compacted limestone gravel 2A modified", "砂礫 of the river", "W" * 80)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("soils", "title", "kind"),
    [
        (LONG, "gate", "svg"),
        (LONG, "gate", "pdf"),
        (LONG[:2], "gate", "png"),
        (LONG, "north gate of the depot, phase 2 revision C", "png"),
    ],
)
def test_long_names_leave_the_maps_their_room(table, tmp_path, monkeypatch, soils, title, kind):
    trucks = ("medium-duty truck 15000 lb at 30 mph", "car")
    rows = table.query("friction_angle_deg == 36 and subgrade_reaction_MN_m3 == 40 and boulder_width_m == 1.5")
    frames = [rows.assign(soil=soil, vehicle=truck) for soil in soils for truck in trucks]
    finished = []
    plain = pictures.save
    monkeypatch.setattr(pictures, "save", lambda fig, target: finished.append(fig) or plain(fig, target))
    words = {"title": title, "sets": {"soil": soils, "vehicle": trucks}, "columns": "soil", "rows": "vehicle"}
    draw_verdict_map(pd.concat(frames, ignore_index=True), tmp_path / f"map.{kind}", **words)
    (fig,) = finished
    if kind != "png":
        return
    names = {axes: axes._left_title for axes in fig.axes}
    legend, headline = fig.legends[0].get_window_extent(), fig._suptitle.get_window_extent()
    extents = [name.get_window_extent() for name in names.values()]
    for one, other in itertools.combinations([*extents, headline, legend], 2):
        assert not one.overlaps(other)
    for axes, name in names.items():
        assert axes.get_window_extent().width > 2.2 * fig.dpi
        assert name.get_window_extent().width <= axes.get_window_extent().width + 1.0
        assert not any(name.get_window_extent().overlaps(other.get_window_extent()) for other in fig.axes)
    together = "".join(name.get_text().replace("\n", "").replace(" ", "") for name in names.values())
    assert all(name.replace(" ", "") in together for name in (*soils, *trucks))
    assert headline.x1 <= fig.bbox.x1
