"""Sections, profiles and boxes of exact solids, the foot that is cut, and the ways to stand."""

import dataclasses
from itertools import product

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from boulder_sweep.errors import ScanError
from boulder_sweep.stones.profiles import MOST_PIECES, doubled_share, fitted, sections_of, sides_of
from boulder_sweep.stones.rock import LEAST_FOOT
from boulder_sweep.stones.standing import MOST_CUT, Stone, has_foot, smallest_box
from tests.stones.shapes import box, cylinder, frustum, rock, solid, sphere, stone
from tests.stones.test_solid import moved

UPRIGHT = np.eye(3)


def test_sections_of_a_sphere():
    own = solid(sphere(1.0, 5))
    heights = np.linspace(0.05, 1.95, 20)
    found = sections_of(own, UPRIGHT, heights)
    squared = 1.0 - (heights - 1.0) ** 2
    np.testing.assert_allclose(found.area, np.pi * squared, rtol=5e-3)
    np.testing.assert_allclose(found.second, 0.25 * np.pi * squared[:, None] ** 2 * [1, 1], rtol=1e-2)
    np.testing.assert_allclose(found.middle, 0.0, atol=1e-3)
    np.testing.assert_allclose(found.high, np.sqrt(squared)[:, None] * [1, 1], rtol=1e-2)


def test_sections_add_up_to_the_solid():
    """Their integrals over the height, at 4000 planes, are volume, centre and moment of inertia of the triangles."""
    own = solid(rock(1))
    z = (own.vertices - own.centre)[:, 2]
    step = np.ptp(z) / 4000
    found = sections_of(own, UPRIGHT, (np.arange(4000) + 0.5) * step)
    height = found.height + z.min()
    assert step * found.area.sum() == pytest.approx(own.volume, rel=1e-6)
    np.testing.assert_allclose(step * (found.area[:, None] * found.middle).sum(axis=0), 0.0, atol=1e-5)
    assert step * (found.area * height).sum() == pytest.approx(0.0, abs=1e-5)
    moment = step * (found.second[:, 0] + found.area * height**2).sum()
    assert moment == pytest.approx(own.moment(UPRIGHT[1]), rel=1e-6)


def test_a_plane_through_points_cuts_like_one_just_below():
    own = solid(frustum(1.0, 0.5, 2.0))
    found = sections_of(own, UPRIGHT, np.array([1e-9, 2.0 - 1e-9, 2.0]))
    assert found.area[1] == pytest.approx(found.area[2], rel=1e-6)
    assert found.area[0] == pytest.approx(4.0 * found.area[1], rel=1e-6)


def test_turned_sections_are_those_of_turned_axes():
    own = solid(rock(1))
    heights = np.linspace(0.1, 1.0, 5)
    found = sections_of(own, UPRIGHT, heights)
    for quarters in range(1, 4):
        angle = 0.5 * np.pi * quarters
        axes = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        again = sections_of(own, axes, heights)
        for name in ("area", "middle", "low", "high", "second"):
            wanted = getattr(again, name)
            np.testing.assert_allclose(getattr(found.turned(quarters), name), wanted, atol=1e-9, err_msg=name)


def test_what_is_enclosed_twice():
    points, faces = box(1.0, 1.0, 1.0)
    apart = np.concatenate([points, points + np.array([0.5, 0.0, 0.0])]), np.concatenate([faces, faces + len(points)])
    own = solid((points, faces))
    crossing = dataclasses.replace(own, vertices=apart[0], faces=apart[1])
    assert doubled_share(own, UPRIGHT, np.array([0.3, 0.6])) == 0.0
    assert doubled_share(crossing, UPRIGHT, np.array([0.3, 0.6])) == pytest.approx(1.0 / 3.0)
    with pytest.raises(ScanError, match=r"rock\.ply: the surface crosses itself: 33% of the boulder"):
        Stone(crossing, "rock.ply")


def test_rectangles_are_no_larger_than_the_sections():
    own = solid(rock(1))
    found = sections_of(own, UPRIGHT, np.linspace(0.1, 1.5, 30))
    length, width = sides_of(found)
    np.testing.assert_allclose(length * width, found.area, rtol=1e-12)
    extent = found.high - found.low
    assert (length <= extent[:, 0]).all()
    assert (width <= extent[:, 1]).all()
    np.testing.assert_allclose(length / width, extent[:, 0] / extent[:, 1], rtol=1e-12)


def test_the_profile_of_a_box_is_the_box():
    own = stone(moved(box(1.2, 1.6, 2.5))).standing("a", "b")
    np.testing.assert_allclose(own.profile.height, [0.0, 2.5], atol=1e-9)
    np.testing.assert_allclose(own.profile.width, 1.2, atol=1e-9)
    np.testing.assert_allclose([own.profile.near, own.profile.far], 0.8, atol=1e-9)
    assert (own.cut_m, own.cut_share, own.stands) == (0.0, 0.0, True)
    assert own.rests == pytest.approx(1.0)
    assert own.profile.error < 1e-9


def test_the_profile_of_a_cone_frustum():
    """Its sections are circles, whose squares of the same area have sides of sqrt(pi)/2 diameters."""
    found = stone(frustum(1.0, 0.6, 3.0, sides=400))
    own = found.standing("z", "x")
    side = np.sqrt(np.pi) * np.array([1.0, 0.6])
    np.testing.assert_allclose(own.profile.height, [0.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(own.profile.width, side, rtol=1e-4)
    np.testing.assert_allclose(own.profile.near, 0.5 * side, rtol=1e-4)
    assert own.profile.volume == pytest.approx(found.solid.volume, rel=1e-12)
    height = 3.0 / 4.0 * (1.0 + 2.0 * 0.6 + 3.0 * 0.36) / (1.0 + 0.6 + 0.36)
    np.testing.assert_allclose(own.profile.centre, (0.0, height), atol=1e-4)
    np.testing.assert_allclose(own.centre, (0.0, height), atol=1e-4)


def test_moments_of_a_profile_are_those_of_its_solid():
    """A leaning frustum of rectangular sections, as triangles and as a profile."""
    points, faces = box(1.0, 1.4, 2.0)
    up = points[:, 2] > 0.0
    points = points * np.where(up[:, None], (0.7, 0.8, 1.0), 1.0) + np.where(up[:, None], (0.2, 0.0, 0.0), 0.0)
    found = stone((points, faces))
    own = found.standing("z", "-x")
    np.testing.assert_allclose(own.profile.near, [0.5, 0.15], atol=1e-9)
    np.testing.assert_allclose(own.profile.far, [0.5, 0.55], atol=1e-9)
    assert own.profile.volume == pytest.approx(own.volume, rel=1e-12)
    np.testing.assert_allclose(own.profile.centre, own.centre, atol=1e-9)
    assert own.profile.moment == pytest.approx(own.moment, rel=1e-9)


def test_a_sphere_gets_a_foot():
    own = stone(sphere(1.0, 5)).standing("a", "b")
    assert own.has_foot
    # At this height a section is half as wide as the largest one.
    assert own.cut_m == pytest.approx(1.0 - np.sqrt(0.75), abs=0.011)
    cap = own.cut_m**2 * (3.0 - own.cut_m) / 4.0  # of the volume of the sphere
    assert own.cut_share == pytest.approx(cap, rel=0.02)
    assert len(own.profile.height) <= MOST_PIECES + 1
    assert own.profile.error < 0.01
    np.testing.assert_allclose(own.profile.centre, own.centre, atol=1e-3)
    assert own.profile.moment == pytest.approx(own.moment, rel=0.03)
    assert (own.outline[:, 0] < 0.0).any(), "the outline shows what is cut off"


def test_a_foot_is_under_the_centre_of_mass():
    """A box whose underside slants by 0.2 m: cut by 0.1 m, half of it would stand, with its centre over an edge."""
    points, faces = box(1.0, 1.0, 2.0)
    below = points[:, 2:] < 0.0
    points = points + np.where(below, (0.5 - points[:, :1]) * (0.0, 0.0, 0.2), 0.0)
    own = stone((points, faces)).standing("z", "x")
    assert own.cut_m == pytest.approx(0.15, abs=0.03)
    reach = own.profile.near[0] + own.centre[0], own.profile.far[0] - own.centre[0]
    assert min(reach) >= 0.25 * own.profile.length.max() - 0.005
    assert not own.stands


def test_a_point_that_no_cut_makes_a_foot():
    own = stone(frustum(0.02, 1.0, 3.0)).standing("z", "x")
    assert not own.has_foot
    assert own.cut_m == 0.0
    assert LEAST_FOOT > MOST_CUT, "a cone has half its width at half its height"


@pytest.mark.parametrize(("foot", "enough"), [(1.0020, True), (1.0008, False), (0.9990, False)])
def test_a_foot_is_judged_as_it_is_printed_too(foot, enough):
    """Just half of the largest section, and not so any more in whole millimetres."""
    profile = dataclasses.replace(
        stone(box(2.0, 2.0, 2.0)).standing("z", "x").profile,
        near=np.array([0.5 * foot, 1.0006]),
        far=np.array([0.5 * foot, 1.0006]),
    )
    assert has_foot(profile) is enough


@pytest.mark.parametrize("seed", range(3))
def test_rocks(seed):
    """Volume is kept to the bit, the rest nearly; near and far change places with the face to the road."""
    found = stone(rock(seed))
    ways = {(own.up, own.facing): own for own in found.standings()}
    assert len(ways) == 24
    for (up, facing), own in ways.items():
        profile = own.profile
        assert len(profile.height) <= MOST_PIECES + 1
        assert profile.volume == pytest.approx(own.volume, rel=1e-12)
        assert profile.width.min() > 0.0
        assert profile.length.min() > 0.0
        np.testing.assert_allclose(profile.centre, own.centre, atol=0.01)
        assert profile.moment == pytest.approx(own.moment, rel=0.03)
        assert profile.error < 0.03
        assert own.axes @ own.axes.T == pytest.approx(np.eye(3), abs=1e-9)
        assert np.linalg.det(own.axes) == pytest.approx(1.0)
        opposite = ways[up, facing[1:] if facing.startswith("-") else f"-{facing}"].profile
        np.testing.assert_allclose(opposite.near, profile.far, atol=1e-6)
        np.testing.assert_allclose(opposite.width, profile.width, atol=1e-6)
    assert {own.cut_m for own in ways.values() if own.up == "a"} == {ways["a", "b"].cut_m}


def test_a_tilted_rock_is_the_same_rock():
    here, there = stone(rock(1)), stone(moved(rock(1)))
    np.testing.assert_allclose(there.sides_m, here.sides_m, rtol=1e-9)
    for up, facing in (("a", "b"), ("-b", "c"), ("c", "-a")):
        one, other = here.standing(up, facing), there.standing(up, facing)
        assert other.cut_m == one.cut_m
        np.testing.assert_allclose(other.profile.width, one.profile.width, atol=1e-6)
        np.testing.assert_allclose(other.profile.near, one.profile.near, atol=1e-6)


def test_a_stone_stands_on_the_flattest_part():
    """A box with a slightly slanting top: turned over, it stands on that, level."""
    points, faces = box(1.0, 1.0, 2.0)
    points = points + np.where(points[:, 2:] > 0.0, points[:, :1] * (0.0, 0.0, 0.1), 0.0)
    found = stone((points, faces))
    feet = [found.standing(up, "b") for up in ("a", "-a")]
    for own in feet:
        assert own.stands
        assert own.rests > 0.95
    below = sorted(round(float(-own.axes[2] @ [0.0, 0.0, 1.0]), 6) for own in feet)
    assert below == [-1.0, round(1.0 / np.hypot(1.0, 0.1), 6)]


def test_as_it_was_scanned():
    own = stone(cylinder(0.5, 2.0)).standing("z", "-x")
    np.testing.assert_allclose(own.axes, np.eye(3), atol=1e-12)
    assert own.stands
    lying = stone(cylinder(0.5, 2.0)).standing("x", "z")
    np.testing.assert_allclose(lying.axes[2], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(lying.axes[0], [0.0, 0.0, -1.0], atol=1e-12)


@pytest.mark.parametrize(("up", "facing"), [("a", "-a"), ("a", "x"), ("z", "b")])
def test_directions_that_do_not_go_together(up, facing):
    with pytest.raises(ScanError, match=f"up: {up} and facing: {facing} do not go together"):
        stone(box(1.0, 1.2, 2.0)).standing(up, facing)


def test_more_pieces_fit_better():
    own = solid(rock(2))
    heights = (np.arange(128) + 0.5) / 128 * np.ptp((own.vertices - own.centre)[:, 2])
    found = sections_of(own, UPRIGHT, heights)
    top = heights[-1] + heights[0]
    errors = []
    for pieces in (1, 2, 4, 8):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("boulder_sweep.stones.profiles.MOST_PIECES", pieces)
            errors.append(fitted(found, 0.0, top, own.volume).error)
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.3 * errors[0]


TETRAHEDRON = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
ENDS = (("a", "b"), ("-a", "c"), ("b", "c"), ("-c", "a"))


def turned(points, seed):
    return points @ Rotation.random(random_state=seed).as_matrix().T


def shuffled(surface, seed):
    """Return a surface with its points, its faces and the corners of each in another order."""
    points, faces = surface
    random = np.random.default_rng(seed)
    order = random.permutation(len(points))
    faces = np.argsort(order)[faces][random.permutation(len(faces))]
    first = random.integers(3, size=(len(faces), 1))
    return points[order], np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("points", "sides"),
    [
        (box(1.0, 1.2, 2.0)[0], (1.0, 1.2, 2.0)),
        (box(0.2, 3.0, 3.0)[0], (0.2, 3.0, 3.0)),
        (TETRAHEDRON, (2.0, 2.0, 2.0)),
        (TETRAHEDRON * (1.0, 1.0, 0.2), (0.4, 2.0, 2.0)),
        (np.array([*product((0.0, 1.0), repeat=3)])[1:], (1.0, 1.0, 1.0)),
        (cylinder(0.5, 2.0, 48)[0], (1.0 * np.cos(np.pi / 48), 1.0 * np.cos(np.pi / 48), 2.0)),
    ],
    ids=["block", "slab", "tetrahedron", "flat tetrahedron", "block without a corner", "cylinder"],
)
def test_known_boxes(points, sides, seed):
    """The least box of a tetrahedron touches it with edges only: half of the best that has a face of it."""
    points = turned(points - points.mean(axis=0), seed)
    axes, found = smallest_box(points)
    np.testing.assert_allclose(np.sort(found), sides, rtol=1e-8)
    np.testing.assert_allclose(np.ptp(points @ axes.T, axis=0), found, rtol=1e-12)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(8))
def test_no_box_on_a_face_is_smaller(seed):
    """Few random points, whose box has many local minima."""
    points = np.random.default_rng(seed).standard_normal((24, 3)) * (1.3, 1.0, 0.9)
    own = smallest_box(points)[1].prod()
    assert own <= np.prod(trimesh.bounds.oriented_bounds(points, angle_digits=6)[1]) * (1.0 + 1e-9)
    for turn in range(3):
        assert smallest_box(turned(points, turn))[1].prod() == pytest.approx(own, rel=1e-6)


@pytest.fixture(scope="module")
def known():
    return stone(rock(2))


@pytest.mark.parametrize("seed", range(12))
def test_the_order_of_points_changes_no_bit(known, seed):
    own = stone(shuffled(rock(2), seed))
    assert own.sides_m.tolist() == known.sides_m.tolist()
    assert own.axes.tolist() == known.axes.tolist()
    assert own.solid.inertia.tolist() == known.solid.inertia.tolist()
    one, other = own.standing("a", "b"), known.standing("a", "b")
    assert (one.cut_m, one.volume, one.profile.near.tolist()) == (
        other.cut_m,
        other.volume,
        other.profile.near.tolist(),
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_turned_scan_is_the_same_stone(known, seed):
    """Turned, and in the single precision of most formats."""
    points, faces = shuffled(rock(2), seed)
    own = stone((turned(points, seed).astype(np.float32).astype(float), faces))
    np.testing.assert_allclose(own.sides_m, known.sides_m, rtol=1e-5)
    for end in ENDS:
        one, other = own.standing(*end), known.standing(*end)
        assert (one.cut_m, one.stands) == (other.cut_m, other.stands)
        for name in ("height", "width", "near", "far"):
            np.testing.assert_allclose(getattr(one.profile, name), getattr(other.profile, name), atol=1e-4)


def test_a_sphere_has_a_box_in_any_direction():
    assert stone(sphere(1.0, 4)).sides_m == pytest.approx([2.0, 2.0, 2.0], rel=3e-3)
