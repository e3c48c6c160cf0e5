"""The side view: shapes where the model has boulder, soil and truck; films that play."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from boulder_sweep.cli.main import execute
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.history import soil_profile
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.views import side_view
from boulder_sweep.views.scene import SLICES, STYLES, SceneItem, SideView, samples_shown

CONFIGS = Path(__file__).parents[2] / "configs"


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
    profile = soil_profile(held.motion, sample, SLICES)
    drawn = lengths(of_style(shapes, "soil_force"))
    strong = np.abs(profile.force_N * scale) > 0.03
    assert drawn == pytest.approx(profile.force_N[strong] * scale)
    (scale_line,) = of_style(view.ground(), "scale")[:1]
    (label,) = (shape for shape in of_style(view.ground(), "scale") if shape.text)
    newton = float(label.text.split()[0]) * 1e3
    assert lengths([scale_line]) == pytest.approx([newton * scale])


def test_soil_slices_add_up_to_the_force_of_the_soil(held: Trajectory, overturned: Trajectory) -> None:
    for trajectory in (held, overturned):
        for sample in (0, 50, 120, 300):
            profile = soil_profile(trajectory.motion, sample, 4000)
            total = trajectory.soil_force_N[sample]
            assert profile.force_N.sum() == pytest.approx(total, abs=1e-5 * (1e4 + np.abs(profile.force_N).sum()))


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


def test_every_shape_has_a_style(held: Trajectory) -> None:
    view = SideView(held)
    for shape in (*view.ground(), *view.moving(100)):
        assert shape.style in STYLES
        assert np.isfinite(np.array(shape.points)).all()


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
