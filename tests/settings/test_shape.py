"""Boulders that are no boxes: as a file gives them, or by their scan."""

from __future__ import annotations

import hashlib
import re
import shutil
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from boulder_sweep.settings import SettingsError, load, load_text
from boulder_sweep.settings.model import ProfilePoint, Shape, tapered
from boulder_sweep.stones.weighing import scanned
from tests.stones.files import ply, prism, regular

SIDES = "  length: 1.65\n  width: 1.68\n  height: 3.44\n"
POINTS = (
    "[{height: 0 m, width: 1.2 m, length: 1.1 m}, {height: 40 in, width: 1.7 m, near: 0.9 m, far: 0.7 m}, "
    "{height: 3 m, width: 1.4 m, length: 1.2 m}]"
)


def with_profile(minimal: str, points: str, more: str = "") -> str:
    return minimal.replace(SIDES, f"  profile: {points}\n{more}")


def test_a_profile_stands_for_the_sides_of_the_box_around_it(load_it, minimal):
    sweep = load_it(with_profile(minimal, POINTS))
    sides = [sweep.constants[f"boulder_{side}_m"] for side in ("length", "width", "height")]
    assert sides == pytest.approx([0.9 + 0.7, 1.7, 3.0])
    foot, middle, top = sweep.model.shape.points
    assert (foot.height, top.height) == (0.0, 1.0)
    assert (middle.height * 3.0, middle.width * 1.7) == pytest.approx((1.016, 1.7))
    assert (middle.near * 1.6, middle.far * 1.6) == pytest.approx((0.9, 0.7))
    assert (foot.near, foot.far) == pytest.approx((0.55 / 1.6, 0.55 / 1.6))


def test_volume_and_centre_are_those_of_the_slices(load_it, minimal):
    shape = load_it(with_profile(minimal, POINTS)).model.shape
    heights = [point.height for point in shape.points]

    def at(name: str, z: float) -> float:
        return float(np.interp(z, heights, [getattr(point, name) for point in shape.points]))

    def integral(of) -> float:
        return sum(quad(of, low, high)[0] for low, high in pairwise(heights))

    volume = integral(lambda z: at("width", z) * (at("near", z) + at("far", z)))
    first = integral(lambda z: at("width", z) * (at("far", z) ** 2 - at("near", z) ** 2) / 2)
    assert shape.filled == pytest.approx(volume, rel=1e-12)
    assert shape.centre == pytest.approx(first / volume, rel=1e-10)


@pytest.mark.parametrize("ratio", [0.5, 0.8, 1.25, 2.0])
def test_a_taper_is_a_profile_of_two_points(ratio):
    foot, top = tapered(ratio).points
    assert top.width / foot.width == pytest.approx(ratio)
    assert max(foot.width, top.width) == max(foot.near + foot.far, top.near + top.far) == 1.0
    assert tapered(ratio).filled == pytest.approx((1 + ratio + ratio**2) / 3 / max(1, ratio) ** 2)
    assert tapered(ratio).taper == pytest.approx(ratio)


def test_only_a_taper_is_said_by_one_number():
    assert Shape().taper == 1.0
    foot, top = tapered(0.8).points
    for other in (replace(top, width=0.9), replace(top, near=0.3), replace(foot, far=0.45)):
        assert Shape((foot, replace(other, height=1.0))).taper is None
    assert Shape((foot, replace(top, height=0.5), top)).taper is None


def test_a_taper_goes_with_axes_of_the_sides(load_it, minimal):
    sweep = load_it(minimal.replace("  height: 3.44\n", "  height: [3, 3.44]\n  taper: 0.8\n"))
    assert sweep.n_designs == 2
    assert sweep.model.shape == tapered(0.8)
    assert sweep.resolved()["model"]["profile"] == [asdict(point) for point in tapered(0.8).points]


def test_a_constant_profile_and_a_taper_of_one_are_boxes(load_it, minimal):
    same = f"[{', '.join(f'{{height: {height}, width: 1.68, length: 1.65}}' for height in (0, 2, 3.44))}]"
    sweep = load_it(with_profile(minimal, same))
    box = load_it(minimal)
    assert sweep.model.shape.is_box
    assert sweep.constants == box.constants
    assert "profile" not in sweep.resolved()["model"]
    assert load_it(minimal.replace(SIDES, SIDES + "  taper: 1\n")).resolved() == box.resolved()


def test_settings_are_read_back(load_it, minimal):
    shape = load_it(with_profile(minimal, POINTS)).model.shape
    assert Shape.of_model({"profile": asdict(shape)["points"]}) == shape


@pytest.mark.parametrize(
    ("points", "flat"),
    [
        ("[{height: 0, width: 0.9, length: 1}, {height: 3, width: 1.7, length: 1}]", True),
        ("[{height: 0, width: 0.8, length: 1}, {height: 3, width: 1.7, length: 1}]", False),
        ("[{height: 0, width: 1, length: 0.6}, {height: 3, width: 1, length: 1.3}]", False),
    ],
)
def test_a_small_foot_counts_as_rounded(load_it, minimal, points, flat):
    sweep = load_it(with_profile(minimal, points))
    assert sweep.model.stands_flat == flat
    assert any("undecided (foot)" in note.message for note in sweep.notes) != flat


def test_a_leaning_boulder_may_end_before_the_middle_of_its_foot(load_it, minimal):
    leaning = "[{height: 0, width: 1, near: 0.8, far: 0.8}, {height: 3, width: 0.4, near: 0.6, far: -0.2}]"
    assert load_it(with_profile(minimal, leaning)).model.shape.points[1].far < 0.0
    assert Shape((ProfilePoint(0.0, 1.0, 0.5, 0.5), ProfilePoint(1.0, 0.5, 0.9, -0.4))).stands_up


FOOT, TOP = (f"{{height: {height}, width: 1, length: 1}}" for height in (0, 2))


@pytest.mark.parametrize(
    ("points", "where", "words"),
    [
        ("wide", "2:12", "must be a list of 2 to 100 points from the foot up"),
        (f"[{FOOT}]", "2:12", "must be a list of 2 to 100 points"),
        (f"[1, {TOP}]", "2:13", "a point must be a block of keys: height, width, length, near, far"),
        (f"[{FOOT.replace('0', '0.1')}, {TOP}]", "2:13", "the first point is the foot"),
        (f"[{FOOT}, {TOP}, {TOP}]", "2:81", "not above the point before it"),
        (f"[{FOOT}, {TOP.replace(', length: 1', '')}]", "2:47", "the point lacks length"),
        (f"[{FOOT}, {TOP.replace('length', 'near')}]", "2:47", "the point lacks far"),
        (f"[{FOOT.replace('}', ', far: 1}')}, {TOP}]", "2:13", "length, or near and far"),
        (f"[{FOOT}, {TOP.replace('length: 1', 'near: 1, far: -2')}]", "2:47", "cannot be negative"),
        (f"[{FOOT.replace('width', 'widht')}, {TOP}]", "2:25", "did you mean width?"),
        (f"[{FOOT.replace('width: 1', 'width: 1 kg')}, {TOP}]", "2:32", "a length is needed"),
        (f"[{FOOT}, {TOP}]".replace("width: 1", "width: 0"), "2:12", "has neither width nor length"),
        (
            "[{height: 0, width: 1, near: 1, far: 0}, {height: 2, width: 1, near: -1, far: 3}]",
            "2:12",
            "fall over by itself",
        ),
    ],
)
def test_mistakes_in_a_profile(problems_of, minimal, points, where, words):
    (problem,) = problems_of(with_profile(minimal, points))
    assert problem.key == "boulder.profile"
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == where


@pytest.mark.parametrize(("more", "key"), [("  height: 3\n", "boulder.height"), ("  taper: 0.8\n", "boulder.taper")])
def test_a_profile_beside_what_it_stands_for_is_refused(load_it, minimal, more, key):
    with pytest.raises(SettingsError, match=rf"{key}: is part of boulder\.profile"):
        load_it(with_profile(minimal, POINTS, more))


def test_a_mass_beside_a_profile_is_compared_with_its_volume(load_it, minimal):
    weighed = load_it(with_profile(minimal, POINTS, "  mass: 12 t\n"))
    assert weighed.constants["boulder_mass_kg"] == 12000
    with pytest.raises(SettingsError, match="solid rock of this profile"):
        load_it(with_profile(minimal, POINTS, "  mass: 19 t\n"))


ROCK = Path(__file__).parents[2] / "docs" / "examples" / "rock.ply"
SCAN = "{file: rock.ply, up: a, facing: b}"
BOULDER = f"  scan: {SCAN}\n  mass: 23.5 t\n"


@pytest.fixture
def site(tmp_path, minimal):
    """Write a file whose boulder is a scan beside it, with some words replaced; return its path."""
    shutil.copy(ROCK, tmp_path / "rock.ply")
    sides = minimal[minimal.index("boulder:\n") : minimal.index("site:")]

    def write(*replaced: tuple[str, str]) -> Path:
        boulder = BOULDER
        for old, new in replaced:
            assert old in boulder
            boulder = boulder.replace(old, new)
        path = tmp_path / "grid.yaml"
        path.write_text(minimal.replace(sides, f"boulder:\n{boulder}\n"), encoding="utf-8")
        return path

    return write


def test_a_scan_is_its_profile_and_density(site):
    sweep = load(site())
    found = scanned(ROCK, mass_kg=23_500.0)
    own = found.stone.standing("a", "b")
    inputs = sweep.resolved()["inputs"]
    assert inputs["boulder_density_kg_m3"] == pytest.approx(found.density_kg_m3, rel=1e-15)
    assert inputs["boulder_height_m"] == pytest.approx(own.profile.height[-1], rel=1e-15)
    assert inputs["boulder_width_m"] == pytest.approx(own.profile.width.max(), rel=1e-15)
    volume = sweep.model.shape.filled
    for side in ("length", "width", "height"):
        volume *= inputs[f"boulder_{side}_m"]
    assert volume * inputs["boulder_density_kg_m3"] == pytest.approx(found.density_kg_m3 * own.volume, rel=1e-12)


def test_the_metadata_hold_the_scan(site):
    given = load(site()).resolved()["model"]["scan"]
    assert given["file"] == "rock.ply"
    assert given["sha256"] == hashlib.sha256(ROCK.read_bytes()).hexdigest()
    assert (given["up"], given["facing"]) == ("a", "b")
    assert given["cut_m"] == pytest.approx(0.25)


def test_a_density_in_place_of_the_mass_may_be_an_axis(site):
    assert load(site(("mass: 23.5 t", "density: [2500, 2600] kg/m^3"))).n_designs == 2


def test_what_makes_one_doubt_a_scan_is_a_note(site, tmp_path):
    """Coordinates that count from far away, in single precision: steps of 2 mm."""
    path = site()
    points, polygons = prism(regular(8, 0.8), 2.0)
    (tmp_path / "rock.ply").write_bytes(ply(points + 20_000.0, polygons, real="f4"))
    (note,) = [note for note in load(path).notes if note.key == "boulder.scan"]
    assert (note.line, "subtract a point near the boulder" in note.message) == (2, True), note
    (tmp_path / "rock.ply").write_bytes(ply(points, polygons, real="f4"))
    assert not [note for note in load(path).notes if note.key == "boulder.scan"]


def test_a_unit(site, tmp_path):
    in_feet = load(site(("facing: b", "facing: b, unit: ft"), ("23.5 t", "0.66 t")))
    assert in_feet.resolved()["inputs"]["boulder_height_m"] < 1.2


@pytest.mark.parametrize(
    ("old", "new", "column", "words"),
    [
        (SCAN, "rock.ply", 9, r"must be a block, as in \{file: rock.ply, up: a, facing: b\}"),
        ("up: a, ", "", 9, "the scan lacks up"),
        ("up: a", "upp: a", 26, "'upp' is not a key of a scan .*; did you mean up"),
        ("facing: b", "facing: a", 9, "do not go together"),
        ("facing: b", "facing: q", 9, "'q' is no end of a boulder"),
        ("rock.ply", "none.ply", 9, "none.ply: there is no such file"),
        ("facing: b", "facing: b, unit: kg", 9, "kg"),
        ("  mass: 23.5 t\n", "", 3, "give the mass of the whole boulder, or its density: one of them"),
        ("mass: 23.5 t", "mass: 23.5 t\n  density: 2600 kg/m^3", 3, "one of them"),
        ("mass: 23.5 t", "mass: 23.5 t\n  height: 3 m", 3, "height follows from the scan; remove one of them"),
        ("mass: 23.5 t", "mass: [20 t, 23 t]", 9, "takes one value"),
    ],
)
def test_mistakes(site, old, new, column, words):
    path = site((old, new))
    with pytest.raises(SettingsError, match=words) as refused:
        load_text(path.read_text(encoding="utf-8"), path)
    assert all(problem.key == "boulder.scan" for problem in refused.value.problems)
    assert [p.column for p in refused.value.problems if re.search(words, str(p))] == [column]
