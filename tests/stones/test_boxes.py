"""The smallest box around a stone: known ones, and the same in any order of points and any rotation."""

from itertools import product

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from boulder_sweep.stones.standing import smallest_box
from tests.stones.shapes import box, cylinder, rock, sphere, stone

TETRAHEDRON = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
ENDS = (("a", "b"), ("-a", "c"), ("b", "c"), ("-c", "a"))


def turned(points, seed):
    return points @ Rotation.random(random_state=seed).as_matrix().T


def shuffled(surface, seed):
    """The same surface with its points, its faces and the corners of each in another order."""
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
