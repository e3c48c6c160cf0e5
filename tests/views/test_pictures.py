"""Every picture is drawn, is the same when drawn again, and is refused in words where it cannot be."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from boulder_sweep.cli.main import execute
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.errors import PictureError
from boulder_sweep.impact.history import soil_profile
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.settings import load_text
from boulder_sweep.settings.model import Ground
from boulder_sweep.views import pictures, side_view
from boulder_sweep.views.side_view import SLICES, SceneItem, SideView, samples_shown
from boulder_sweep.views.time_curves import AFTER_PEAK, unreliable_from
from boulder_sweep.views.wording import ground_words

CONFIGS = Path(__file__).parents[2] / "configs"
Draw = Callable[[Trajectory, Path], None]

DRAWERS: dict[str, Draw] = {
    "history": lambda trajectory, path: trajectory.plot(path),
    "energy": lambda trajectory, path: trajectory.plot_energy(path),
    "side view": lambda trajectory, path: trajectory.plot_side_view(path, time_s=0.05),
}


def picture(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def has_colour(image: np.ndarray, colour: str, least: int = 30) -> bool:
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return int((np.abs(image - wanted).max(axis=2) <= 3).sum()) >= least


@pytest.mark.parametrize("name", DRAWERS)
def test_picture_is_drawn_and_is_the_same_again(held: Trajectory, tmp_path: Path, name: str) -> None:
    for file in ("one.png", "two.png"):
        DRAWERS[name](held, tmp_path / file)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    image = picture(tmp_path / "one.png")
    assert image.shape[0] > 300
    assert image.shape[1] > 700
    assert has_colour(image, "#D55E00")


def test_the_rebound_is_shaded(held: Trajectory, overturned: Trajectory, tmp_path: Path) -> None:
    """The springs of the soil have no memory: what they do after the peak is not to be relied on."""
    start, words = unreliable_from(held)
    assert start == max(held.decided.maxima.t_theta, held.decided.maxima.t_x_b)
    assert "rebound" in words
    held.plot(tmp_path / "held.png")
    assert has_colour(picture(tmp_path / "held.png"), AFTER_PEAK, least=20_000)
    overturned.plot(tmp_path / "overturned.png")
    assert not has_colour(picture(tmp_path / "held.png"), "#F3E7DF")
    assert has_colour(picture(tmp_path / "overturned.png"), "#F3E7DF", least=20_000)
    assert unreliable_from(overturned)[0] == overturned.row["time_to_limit_s"]
    assert "20°" in unreliable_from(overturned)[1]


def test_pictures_state_the_row_of_the_table(overturned: Trajectory, tmp_path: Path, drawn: list[Figure]) -> None:
    """The peaks are those up to the limit, though the curves go on to a turn of 158 deg."""
    overturned.plot(tmp_path / "overturned.png")
    (fig,) = drawn
    labels = [text.get_text() for axes in fig.axes for text in axes.texts]
    row = overturned.row
    assert "20.00°" in labels
    assert f"{row['max_displacement_m']:.3f} m" in labels
    assert f"{row['peak_force_kN']:.0f} kN" in labels
    assert max(math.degrees(angle) for angle in overturned.rotation_rad) > 150.0


def test_legends_cover_nothing(
    trajectories: dict[tuple[str, str], Trajectory], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked_at = []

    def look(fig: Figure, target: Path) -> None:
        FigureCanvasAgg(fig).draw()
        for axes in fig.axes:
            if axes.get_legend() is not None:
                legend = axes.get_legend().get_window_extent()
                looked_at.append(axes.get_title(loc="left"))
                assert legend.x1 <= axes.get_window_extent().x1 + 1.0
                for line in axes.lines:
                    points = line.get_transform().transform(np.column_stack(line.get_data()))
                    assert not any(legend.contains(x, y) for x, y in points)
                assert not any(legend.overlaps(text.get_window_extent()) for text in axes.texts)

    monkeypatch.setattr("boulder_sweep.views.pictures.save", look)
    for trajectory in trajectories.values():
        trajectory.plot(tmp_path / "history.png")
    assert looked_at == ["Horizontal forces", "Displacement of the centre of mass"] * 4


@pytest.mark.parametrize("name", DRAWERS)
def test_every_picture_says_that_it_is_a_simulation(
    held: Trajectory, drawn: list[Figure], tmp_path: Path, name: str
) -> None:
    DRAWERS[name](held, tmp_path / "picture.png")
    words = [text.get_text() for text in drawn[0].findobj(Text)]
    assert any("Simulation, not a rating by test" in text for text in words)


LAYERED = """\
name: north gate of the depot
boulder: {length: 1.65 m, width: 1.68 m, height: 3 m, density: 2600 kg/m^3}
site: {embedment_depth: 1.8 m}
soil:
  density: 1860 kg/m^3
  friction_angle: 38 deg
  subgrade_reaction: 60 MN/m^3
  cohesion: 5 kPa
  water_table: 1.2 m
  slope: 5 deg
  layers: [{from: 0.8 m, density: 1900 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 80 MN/m^3}]
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.mark.parametrize("name", ["history", "energy"])
def test_a_caption_tells_all_of_the_ground_within_the_picture(drawn: list[Figure], tmp_path: Path, name: str) -> None:
    sweep = load_text(LAYERED, tmp_path / "layered.yaml")
    object.__setattr__(sweep, "name", "W" * 80)
    DRAWERS[name](simulate(sweep), tmp_path / "picture.png")
    FigureCanvasAgg(drawn[0]).draw()
    title, caption = drawn[0].texts
    for text in (title, caption):
        extent = text.get_window_extent()
        assert drawn[0].bbox.x0 <= extent.x0 < extent.x1 <= drawn[0].bbox.x1
        assert drawn[0].bbox.y0 <= extent.y0 < extent.y1 <= drawn[0].bbox.y1
    words = " ".join(caption.get_text().split())
    ground = "readings corrected, 2 layers of soil, cohesion 5 / 0 kPa, water table 1.2 m down, ground falling by 5°"
    assert ground in words
    assert title.get_text().replace("\n", "").startswith("W" * 80)


@pytest.mark.parametrize("words", ["", "one", "one two three", "x" * 90, "one " + "y" * 70 + " two", "a\nb c"])
@pytest.mark.parametrize("inches", [0.01, 0.5, 2.0])
def test_a_broken_text_loses_nothing_but_spaces(words: str, inches: float) -> None:
    fig = Figure()
    found = pictures.break_lines(fig, words, inches)
    assert found.replace("\n", "").replace(" ", "") == words.replace("\n", "").replace(" ", "")
    lines = found.split("\n")
    for line in lines:
        text = fig.text(0.0, 0.0, line)
        assert len(line) <= 1 or text.get_window_extent().width <= inches * fig.dpi
    assert inches < 2.0 or "x" in words or "y" in words or lines == words.split("\n"), "what fits stays as it is"


def test_printed_readings_show_what_comes_out_of_nothing(held: Trajectory, tmp_path: Path) -> None:
    with matplotlib.rc_context({"svg.fonttype": "none"}):  # text as text
        simulate(crash_test("abg"), readings="as_printed").plot_energy(tmp_path / "printed.svg")
        held.plot_energy(tmp_path / "corrected.svg")
    assert "out of nothing" in (tmp_path / "printed.svg").read_text(encoding="utf-8")
    assert "out of nothing" not in (tmp_path / "corrected.svg").read_text(encoding="utf-8")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("speed", [0.0, 1e-3])
@pytest.mark.parametrize("name", DRAWERS)
def test_hardly_any_motion_is_drawn_too(tmp_path: Path, name: str, speed: float) -> None:
    DRAWERS[name](simulate(crash_test("rwg").constants | {"impact_speed_m_s": speed}), tmp_path / "still.png")
    assert (tmp_path / "still.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", DRAWERS)
def test_nothing_to_draw_is_reported(tmp_path: Path, name: str) -> None:
    low = simulate(crash_test("rwg").constants | {"boulder_height_m": 2.5})
    with pytest.raises(PictureError, match="the truck passes over the boulder"):
        DRAWERS[name](low, tmp_path / "picture.png")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_way_is_reported(held: Trajectory, tmp_path: Path) -> None:
    (tmp_path / "picture.png").mkdir()
    with pytest.raises(PictureError, match="cannot be written"):
        held.plot(tmp_path / "picture.png")


def test_missing_matplotlib_is_reported(held: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "matplotlib" else found(name))
    with pytest.raises(PictureError, match=r"pip install '.\[plot\]'"):
        held.plot(tmp_path / "picture.png")


HOSTILE = "</text><script>alert(1)</script> $\\frac$ --> \x1b[31m \u202e & 'x'"


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_a_name_in_a_picture_is_only_text(tmp_path: Path, kind: str) -> None:
    sweep = crash_test("rwg")
    object.__setattr__(sweep, "name", HOSTILE)
    trajectory = simulate(sweep, horizon_s=0.02)
    trajectory.plot(tmp_path / f"picture.{kind}")
    if kind == "svg":
        drawn = ElementTree.parse(tmp_path / "picture.svg")
        assert {element.tag.rpartition("}")[2] for element in drawn.iter()}.isdisjoint({"script", "a", "foreignObject"})
        drawn_text = (tmp_path / "picture.svg").read_text()
        assert "$\\frac$" in drawn_text
        assert "\\x1b[31m \\u202e" in drawn_text
    assert "\\x1b[31m" in repr(trajectory)


def test_logarithmic_ticks_keep_their_powers(tmp_path: Path) -> None:
    with pictures.figure(tmp_path / "powers.svg", 3.0, 2.0) as fig:
        axes = fig.subplots()
        axes.loglog([1.0, 1e6], [1.0, 1e6])
        axes.set_title("$a$")
    assert all(label.get_parse_math() for label in [*axes.get_xticklabels(), *axes.get_yticklabels(minor=True)])
    assert not axes.title.get_parse_math()


def of_style(shapes: list[SceneItem], style: str) -> list[SceneItem]:
    return [shape for shape in shapes if shape.style == style]


def lengths(shapes: list[SceneItem]) -> np.ndarray:
    """Lengths of arrows along X, with their direction."""
    return np.array([shape.points[1][0] - shape.points[0][0] for shape in shapes])


def test_boulder_is_a_rigid_box_that_turns_clockwise(held: Trajectory) -> None:
    view, design = SideView(held), held.motion.design
    for sample in (0, 200, 608):
        (boulder,) = of_style(view.moving(sample), "boulder")
        corners = np.array(boulder.points)
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)
        assert sides == pytest.approx([design.L, design.H, design.L, design.H])
        along = corners[1] - corners[0]
        theta = held.rotation_rad[sample]
        assert math.atan2(-along[1], along[0]) == pytest.approx(theta, abs=1e-12)  # clockwise with Y up
        (centre,) = of_style(view.moving(sample), "centre")
        moved = held.boulder_centre_displacement_m[sample]
        assert centre.points[0][0] == pytest.approx(design.L / 2 + moved, abs=1e-12)
    (start,) = of_style(view.moving(0), "boulder")
    place = np.array(
        [(0.0, -design.d), (design.L, -design.d), (design.L, design.H - design.d), (0.0, design.H - design.d)]
    )
    assert np.array(start.points) == pytest.approx(place, abs=1e-12)


def test_forces_share_one_scale(held: Trajectory) -> None:
    view = SideView(held)
    sample = int(np.argmax(held.contact_force_N))
    shapes = view.moving(sample)
    scale = view.metres_per_newton
    assert lengths(of_style(shapes, "contact_force")) == pytest.approx([held.contact_force_N[sample] * scale])
    (weight,) = of_style(shapes, "weight")
    assert weight.points[0][1] - weight.points[1][1] == pytest.approx(24754.6 * 9.80665 * scale, rel=1e-5)
    _, forces = soil_profile(held.motion, sample, SLICES)
    drawn = lengths(of_style(shapes, "soil_force"))
    strong = np.abs(forces * scale) > 0.03
    assert drawn == pytest.approx(forces[strong] * scale)
    (scale_line,) = of_style(view.ground(), "scale")[:1]
    (label,) = (shape for shape in of_style(view.ground(), "scale") if shape.text)
    newton = float(label.text.split()[0]) * 1e3
    assert lengths([scale_line]) == pytest.approx([newton * scale])


def test_soil_slices_add_up_to_the_force_of_the_soil(held: Trajectory, overturned: Trajectory) -> None:
    for trajectory in (held, overturned):
        for sample in (0, 50, 120, 300):
            _, forces = soil_profile(trajectory.motion, sample, 4000)
            total = trajectory.soil_force_N[sample]
            assert forces.sum() == pytest.approx(total, abs=1e-5 * (1e4 + np.abs(forces).sum()))


def test_truck_is_crushed_as_the_model_has_it(held: Trajectory) -> None:
    view = SideView(held)
    design = held.motion.design
    for sample in (0, 60, 200, 400):
        truck = of_style(view.moving(sample), "truck")
        front = max(x for shape in truck for x, _ in shape.points)
        contact = held.boulder_displacement_m[sample]
        c, theta = held.motion.constants, held.rotation_rad[sample]
        contact += c.h * math.sin(theta) + c.g_x * (1.0 - math.cos(theta))
        if held.in_contact[sample] == "touching":
            assert front == pytest.approx(contact, abs=1e-6)
        else:
            assert front < contact
        (bed,) = of_style(view.moving(sample), "bed_edge")
        assert bed.points[0][0] == pytest.approx(held.vehicle_displacement_m[sample] - 2.9)
    assert view.rating_line == pytest.approx(design.L + 1.0)


def test_samples_of_a_film(held: Trajectory) -> None:
    chosen = samples_shown(held, 120, 0.005)
    assert (chosen[0], chosen[-1], len(chosen)) == (0, 1000, 101)
    assert len(samples_shown(held, 10, 0.005)) == 10


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Trajectory:
    """A film of four frames."""
    monkeypatch.setattr(side_view, "MOST_FRAMES", 4)
    return simulate(crash_test("rwg"), horizon_s=0.12)


def test_gif_plays(short: Trajectory, tmp_path: Path) -> None:
    short.animate(tmp_path / "film.gif")
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 4
        assert film.info["loop"] == 0
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(3)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert np.abs(first - last).max() > 100
    assert first.shape == last.shape


def test_command_makes_energy_and_film(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = {"--energy": "e.png", "--animate": "film.gif", "--trajectory": "t.parquet"}
    words = [word for option, name in names.items() for word in (option, str(tmp_path / name))]
    assert execute(["simulate", str(CONFIGS / "rwg.yaml"), "-q", *words]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names.values())
    assert "rwg: PASS" in capsys.readouterr().out
    assert execute(["simulate", str(CONFIGS / "rwg.yaml"), "--animate", str(tmp_path / "film.avi")]) == 2


@pytest.mark.parametrize(
    ("units", "words"),
    [("si", "cohesion 5 kPa, water table 0.9144 m down"), ("us", "cohesion 104.4 psf, water table 3 ft down")],
)
def test_the_ground_is_in_the_units_of_the_picture(units: str, words: str) -> None:
    settings = {"model": {"ground": asdict(Ground(cohesion_kPa=5.0, water_table_m=0.9144))}}
    assert ground_words(settings, units) == words
