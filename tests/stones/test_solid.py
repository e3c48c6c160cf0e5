"""Volume, centre and inertia of exact solids, and what is repaired."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boulder_sweep.errors import ScanError
from tests.stones.shapes import box, cylinder, frustum, rock, solid, sphere

ASKEW = np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0
"""A rotation."""


def turns(seed):
    """Return a rotation, none for 0."""
    return Rotation.random(random_state=seed).as_matrix() if seed else np.eye(3)


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


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize(
    ("sides", "base"), [((1.0, 1.0, 1.0), 1.0 / 6.0), ((3.0, 2.2, 0.6), 0.340), ((3.0, 3.0, 0.2), 0.441)]
)
def test_a_block_scanned_where_it_lies(sides, base, turn):
    """Any of its sides may be below; the wide ones are more than any other hole may be."""
    points, faces = box(*sides)
    below = (points[faces][:, :, 2] < 0.0).all(axis=1)
    own = solid((points @ turns(turn).T, faces[~below]))
    assert own.volume == pytest.approx(np.prod(sides), rel=1e-12)
    assert (own.closed, own.base) == (0.0, pytest.approx(base, abs=5e-4))
    assert own.over == pytest.approx(1.0 / 6.0)
    assert (
        own.repairs[0]
        == f"underside closed by a flat lid, {100 * own.base:.2g} % of the surface, over 17 % of the volume"
    )


def cut(triangles, up, height):
    """Return the part of a surface above a plane, open there."""
    kept = []
    for triangle in triangles:
        z = triangle @ up - height
        part = []
        for k in range(3):
            (p, q), (low, high) = (triangle[k], triangle[k - 2]), (z[k], z[k - 2])
            part += [p] if low >= 0.0 else []
            part += [p + low / (low - high) * (q - p)] if (low >= 0.0) != (high >= 0.0) else []
        kept += [(part[0], *pair) for pair in pairwise(part[1:])]
    return np.reshape(kept, (-1, 3)), np.arange(3 * len(kept)).reshape(-1, 3)


@pytest.mark.parametrize("share", [0.5, 0.7])
@pytest.mark.parametrize("turn", range(12))
def test_a_rock_cut_by_a_plane(share, turn):
    """The volume of a surface about a point of the plane in which it is open needs no lid."""
    points, faces = rock(2, finer=4)
    up = turns(turn)[0]
    heights = points @ up
    height = heights.max() - share * np.ptp(heights)
    left, rest = cut(points[faces], up, height), cut(points[faces], -up, -height)
    corners = left[0][left[1]] - height * up
    wanted = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    own = solid(left)
    assert own.volume == pytest.approx(wanted, rel=1e-6)
    assert own.closed == 0.0
    assert 0.1 < own.base < 0.4
    assert own.volume + solid(rest).volume == pytest.approx(solid((points, faces)).volume, rel=1e-6)


def dome(jagged, below=0.0):
    """A frustum without a base: its rim up and down by a share of its size, its shoulder drawn out and down past it."""
    points, faces = frustum(1.0, 0.8, 0.7, sides=48)
    faces = faces[(faces != 96).all(axis=1)]
    points = points.copy()
    points[:48, 2] += 2.0 * jagged * (-1.0) ** np.arange(48)
    points[48:96, :2] *= 1.0 + below
    points[48:96, 2] -= 4.0 * below
    return points, faces


@pytest.mark.parametrize(
    ("surface", "is_base"),
    [(dome(0.0), True), (dome(0.018), True), (dome(0.022), False), (dome(0.0, below=0.25), False)],
    ids=["plane", "nearly plane", "jagged", "with a part of the stone below its rim"],
)
def test_which_hole_is_a_base(surface, is_base):
    """What is no base may be a quarter of the surface only, and this is more."""
    if is_base:
        own = solid(surface)
        assert own.base > 0.25
        assert own.volume == pytest.approx(solid(dome(0.0)).volume, rel=0.02)
        return
    with pytest.raises(
        ScanError, match=r"is open: \d+% of its surface would be added to close it; at most 25% is, or 45%"
    ):
        solid(surface)


def test_holes_beside_a_base_are_counted_by_themselves():
    points, faces = frustum(1.0, 0.6, 1.5)
    own, whole = solid((points, faces[(faces < 192).all(axis=1)])), solid((points, faces))
    assert own.volume == pytest.approx(whole.volume, rel=1e-12)
    assert own.closed == pytest.approx(0.36 * own.base, rel=1e-9)
    assert [words.split(",")[0] for words in own.repairs] == ["underside closed by a flat lid", "1 hole closed"]


def test_a_missing_triangle_is_no_base():
    points, faces = sphere(1.0, 3)
    own = solid((points, faces[1:]))
    assert own.base == 0.0
    assert own.repairs[0].startswith("1 hole closed, ")


@pytest.mark.parametrize("far", [0.0, 1e3, 1e7])
def test_a_stone_in_map_coordinates(far):
    points, faces = rock(1)
    moved_by = np.array([0.1 * far, far, 0.0])
    here, there = solid((points, faces)), solid((points + moved_by, faces))
    np.testing.assert_allclose(there.centre - moved_by, here.centre, atol=1e-7)
    np.testing.assert_allclose(there.inertia, here.inertia, rtol=1e-6, atol=1e-6)


def test_crumbs_are_left_out():
    points, faces = rock(1)
    crumb = sphere(0.05, 1)
    both = np.concatenate([points, crumb[0] + 9.0]), np.concatenate([faces, crumb[1] + len(points)])
    own = solid(both)
    assert own.repairs == ("1 body beside the boulder left out",)
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
