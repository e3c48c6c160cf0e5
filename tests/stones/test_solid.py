"""Volume, centre and inertia of exact solids, and what is repaired."""

import numpy as np
import pytest

from boulder_sweep.errors import ScanError
from tests.stones.shapes import box, cylinder, frustum, rock, scan, solid, sphere

ASKEW = np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0
"""A rotation."""


def moved(surface):
    points, faces = surface
    return points @ ASKEW.T + (3.0, -40.0, 7.0), faces


def test_a_box():
    own = solid(moved(box(1.2, 1.6, 2.5)))
    assert own.repairs == ()
    assert own.volume == pytest.approx(4.8, rel=1e-12)
    np.testing.assert_allclose(own.centre, (3.0, -40.0, 7.0), atol=1e-9)
    wanted = 0.4 * np.diag([1.6**2 + 2.5**2, 1.2**2 + 2.5**2, 1.2**2 + 1.6**2])
    np.testing.assert_allclose(own.inertia, ASKEW @ wanted @ ASKEW.T, atol=1e-9)


@pytest.mark.parametrize("sides", [24, 48, 96])
def test_a_cylinder_in_the_limit_of_many_sides(sides):
    own = solid(cylinder(0.8, 2.0, sides))
    missing = (2.0 * np.pi / sides) ** 2 / 6.0  # of the area of a regular polygon, to second order
    assert own.volume == pytest.approx(np.pi * 0.64 * 2.0 * (1.0 - missing), rel=missing**2)
    mass = own.volume
    assert own.moment(np.array([0.0, 0.0, 1.0])) == pytest.approx(0.5 * mass * 0.64, rel=missing * 1.01)
    assert own.moment(np.array([1.0, 0.0, 0.0])) == pytest.approx(mass * (3.0 * 0.64 + 4.0) / 12.0, rel=missing)


def test_a_cone_frustum():
    own = solid(frustum(1.0, 0.5, 2.0, sides=400))
    assert own.volume == pytest.approx(np.pi * 2.0 / 3.0 * (1.0 + 0.5 + 0.25), rel=1e-4)
    height = 2.0 / 4.0 * (1.0 + 2.0 * 0.5 + 3.0 * 0.25) / (1.0 + 0.5 + 0.25)
    np.testing.assert_allclose(own.centre, (0.0, 0.0, height), atol=1e-9)


def test_a_sphere_converges_with_order_two():
    missing = [1.0 - solid(sphere(1.0, finer)).volume / (4.0 / 3.0 * np.pi) for finer in (2, 3, 4)]
    assert missing[0] / missing[1] == pytest.approx(4.0, abs=0.1)
    assert missing[1] / missing[2] == pytest.approx(4.0, abs=0.1)
    own = solid(sphere(1.0, 4))
    np.testing.assert_allclose(own.inertia, 0.4 * own.volume * np.eye(3), rtol=3e-3, atol=1e-12)


def test_points_may_be_given_for_every_face():
    points, faces = sphere(1.0, 2)
    soup = points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    own = solid(soup)
    assert (len(own.vertices), own.repairs) == (len(points), ())
    assert own.volume == pytest.approx(solid((points, faces)).volume, rel=1e-12)


def test_a_surface_turned_inside_out():
    points, faces = rock(1)
    right, wrong = solid((points, faces)), solid((points, faces[:, ::-1]))
    assert wrong.repairs == ("its inside was outside; turned",)
    assert wrong.volume == pytest.approx(right.volume, rel=1e-12)
    np.testing.assert_allclose(wrong.inertia, right.inertia, rtol=1e-9)


def test_faces_that_look_the_wrong_way():
    points, faces = rock(1)
    mixed = faces.copy()
    mixed[::7] = mixed[::7, ::-1]
    own = solid((points, mixed))
    assert own.repairs == (f"{len(mixed[::7])} faces turned to the side of the others",)
    assert own.volume == pytest.approx(solid((points, faces)).volume, rel=1e-12)


def test_holes_are_closed_and_said():
    points, faces = rock(1)
    whole = solid((points, faces))
    top, side = points[:, 2].max(), points[:, 0].max()
    middle = points[faces].mean(axis=1)
    kept = faces[(middle[:, 2] < top - 0.1) & (middle[:, 0] < side - 0.1)]
    own = solid((points, kept))
    assert len(own.repairs) == 1
    assert own.repairs[0].startswith("2 holes closed, ")
    assert 0.0 < own.closed < 0.1
    assert 0.95 * whole.volume < own.volume < whole.volume


def test_a_block_scanned_without_the_side_on_which_it_lies():
    points, faces = box(1.0, 1.0, 1.0)
    below = (points[faces][:, :, 2] < 0.0).all(axis=1)
    own = solid((points, faces[~below]))
    assert own.volume == pytest.approx(1.0, rel=1e-12)
    assert own.closed == pytest.approx(1.0 / 6.0)


def test_half_a_surface_is_refused():
    points, faces = sphere(1.0, 4)
    half = faces[points[faces].mean(axis=1)[:, 2] > 0.0]
    with pytest.raises(ScanError, match=r"is open: 3\d% of its surface would be added to close it, at most 25% is"):
        solid((points, half))


def test_crumbs_are_left_out():
    points, faces = rock(1)
    crumb = sphere(0.05, 1)
    both = np.concatenate([points, crumb[0] + 9.0]), np.concatenate([faces, crumb[1] + len(points)])
    own = solid(both)
    assert own.repairs == ("1 body beside the stone left out",)
    assert own.volume == pytest.approx(solid((points, faces)).volume, rel=1e-12)


def test_two_stones_are_refused():
    points, faces = rock(1)
    both = np.concatenate([points, points + 9.0]), np.concatenate([faces, faces + len(points)])
    with pytest.raises(ScanError, match=r"holds 2 bodies, and the others are 100% as large as the largest"):
        solid(both)


@pytest.mark.parametrize(
    "surface",
    [
        (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), np.array([[0, 1, 2], [1, 3, 2]])),
        (np.zeros((4, 3)) + np.array([[0.0], [1], [2], [3]]), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])),
        (np.random.default_rng(1).random((300, 3)), np.arange(300).reshape(-1, 3)),
    ],
    ids=["flat", "in a line", "triangles anywhere"],
)
def test_what_is_no_solid_is_refused(surface):
    with pytest.raises(ScanError, match=r"rock\.ply: "):
        solid(surface)


def test_the_same_scan_gives_the_same_bits():
    first, second = solid(rock(3)), solid(rock(3))
    assert scan(rock(3)).faces.tolist() == scan(rock(3)).faces.tolist()
    assert first.volume == second.volume
    assert first.inertia.tolist() == second.inertia.tolist()
