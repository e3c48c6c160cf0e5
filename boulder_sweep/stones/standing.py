"""How a stone can stand: which way up, on which part of its surface, and with which face to the road.

The axes a, b and c of a stone are the long, the middle and the short side of the smallest box around it, as for
particles of sediment. The end a is the one farther from the centre of mass, the slimmer one; -a is the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.stones.profiles import Profile, Sections, doubled_share, fitted, sections_of, sides_of
from boulder_sweep.stones.rock import LEAST_FOOT, is_flat

if TYPE_CHECKING:
    from boulder_sweep.stones.solid import Solid

OF_STONE, OF_SCAN = "abc", "xyz"
DIRECTIONS = tuple(f"{sign}{axis}" for axes in (OF_STONE, OF_SCAN) for axis in axes for sign in ("", "-"))
"""Ends of a stone by name: of its own axes, and of the axes of the scan."""
TILT_DEG = 10.0
"""How far a stone is tilted to stand on a flat part near an end."""
CANDIDATES = 8
"""Parts of the surface near an end that are tried, the largest first."""
RESTS_WITHIN = 0.02
"""What is this near to the plane below the stone rests on it, as a share of the height."""
SECTIONS = 128
"""Sections over the height to which a profile is fitted."""
MOST_CUT = 0.25
"""Largest part of the height that is cut off to get a foot."""
CUT_STEP_M = 0.01
NEARLY = 0.8
"""Share of a foot that a section must have to be tried as one."""
MOST_DOUBLED = 0.01
"""Largest share of the volume that a surface may enclose twice."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A stone on its foot, with one face to the road."""

    up: str
    facing: str
    """Which end is up, and which faces the vehicle: names of `DIRECTIONS`."""
    axes: np.ndarray
    """Direction of travel, across it to the left, and up, in the axes of the scan, shape (3, 3)."""
    stands: bool
    """Whether the stone stands by itself before it is cut, its centre of mass over what it rests on."""
    cut_m: float
    """What is cut off at the foot [m]."""
    cut_share: float
    """What is cut off, as a share of the volume."""
    rests: float
    """Section of the uncut stone just above what it lies on, as a share of its largest section."""
    profile: Profile
    """The stone above the cut."""
    centre: tuple[float, float]
    """Centre of mass of the cut stone: beyond the middle of the foot of the profile, and above the cut [m]."""
    moment: float
    """Its moment of inertia about the axis across the travel through the centre, for 1 kg/m^3 [m^5]."""
    volume: float
    """Volume of the cut stone [m^3]."""
    outline: np.ndarray
    """The stone as it is, cut or not: height above the foot, distances of its sides before and behind the middle of the
    foot [m], shape (m, 3)."""

    @property
    def has_foot(self) -> bool:
        """Whether its foot is long and wide enough to count as flat."""
        return has_foot(self.profile)


def is_firm(profile: Profile) -> bool:
    """Return whether a foot reaches far enough out before and behind the centre of mass."""
    x = profile.centre[0]
    reach = min(profile.near[0] + x, profile.far[0] - x)
    return is_flat(2.0 * float(reach), float(profile.length.max()))


def has_foot(profile: Profile) -> bool:
    """Return whether the foot of a profile is long and wide enough to count as flat, also as printed in millimetres."""
    printed = np.round(profile.near, 3) + np.round(profile.far, 3), np.round(profile.width, 3)
    return all(is_flat(side[0], side.max()) for side in (profile.length, profile.width, *printed))


class Stone:
    """A stone that can be set up; its scan is named in messages.

    Raise `ScanError` where its surface crosses itself.
    """

    def __init__(self, solid: Solid, file: str) -> None:
        import trimesh

        self.solid = solid
        self._hull: Any = trimesh.Trimesh(solid.vertices, solid.faces, process=False).convex_hull
        self.axes, self.sides_m = _named_box(self._hull.vertices - solid.centre)
        """Directions of a, b and c in the axes of the scan, shape (3, 3), and sides of the smallest box along them."""
        self._ups: dict[str, _Up] = {}
        doubled = self._whole_doubled()
        if doubled > MOST_DOUBLED:
            raise ScanError(
                f"{file}: the surface crosses itself: {doubled:.0%} of the boulder lies inside it twice or inside out; "
                "repair the scan first, for example in MeshLab"
            )

    @property
    def solidity(self) -> float:
        """Volume over the volume of the smallest box."""
        return self.solid.volume / float(np.prod(self.sides_m))

    @property
    def hull_share(self) -> float:
        """Volume over the volume of the convex hull."""
        return self.solid.volume / float(self._hull.volume)

    def standings(self) -> Iterator[Standing]:
        """Yield the 24 ways to stand: six ends up, four to the road."""
        for up in DIRECTIONS[:6]:
            for facing in DIRECTIONS[:6]:
                if facing[-1] != up[-1]:
                    yield self.standing(up, facing)

    def standing(self, up: str, facing: str) -> Standing:
        """Return the stone with one end up and another to the road.

        With an end of its own axes up the stone may be tilted to a part of its surface on which it stands firmly; with
        an axis of the scan up it stands as it was scanned. Raise `ScanError` where up or facing is no end, or they are
        ends of one axis, or of two kinds of axes.
        """
        for key, end in (("up", up), ("facing", facing)):
            if end not in DIRECTIONS:
                raise ScanError(f"{key}: '{end}' is no end of a boulder; there are {', '.join(DIRECTIONS)}")
        if up[-1] == facing[-1] or (up[-1] in OF_STONE) != (facing[-1] in OF_STONE):
            kinds = "one of a, b, c or one of x, y, z each"
            raise ScanError(f"up: {up} and facing: {facing} do not go together: give two different axes, {kinds}")
        if up not in self._ups:
            self._ups[up] = self._set_up(up)
        upright = self._ups[up]
        frame, cut = upright.frame, upright.cut
        # The frame is turned by quarters until x points away from the road.
        towards = self._direction(facing) @ frame.T
        quarters = next(k for k, (x, y) in enumerate(((-1, 0), (0, -1), (1, 0), (0, 1))) if _is_nearest(towards, x, y))
        for _ in range(quarters):
            frame = np.stack([frame[1], -frame[0], frame[2]])
        sections, left = upright.sections.turned(quarters), self._left(frame, cut)
        profile = fitted(sections, cut, self._height(frame[2]), left.volume)
        low, high = sections.low[:, 0], sections.high[:, 0]
        foot = float(((self.solid.vertices - self.solid.centre) @ frame[2]).min())
        return Standing(
            up,
            facing,
            frame,
            upright.stands,
            cut,
            1.0 - left.volume / self.solid.volume,
            upright.rests,
            profile,
            (left.x - profile.foot_x, left.z - foot - cut),
            left.moment,
            left.volume,
            np.stack([sections.height - cut, profile.foot_x - low, high - profile.foot_x], axis=1),
        )

    def _direction(self, end: str) -> np.ndarray:
        """Return an end as a unit vector in the axes of the scan."""
        axes, names = (self.axes, OF_STONE) if end[-1] in OF_STONE else (np.eye(3), OF_SCAN)
        return (-1.0 if end[0] == "-" else 1.0) * axes[names.index(end[-1])]

    def _set_up(self, up: str) -> _Up:
        """Return the stone with one end up."""
        frame, stands = self._steadiest(up)
        height = self._height(frame[2])
        shares = (np.arange(SECTIONS) + 0.5) / SECTIONS
        sections = sections_of(self.solid, frame, shares * height)
        rests = float(self._resting(frame).area[0] / sections.area.max())
        return _Up(frame, sections, stands, min(rests, 1.0), self._cut(frame, sections))

    def _height(self, upwards: np.ndarray) -> float:
        return float(np.ptp(self._hull.vertices @ upwards))

    def _resting(self, frame: np.ndarray) -> Sections:
        """Return the one section just above what the stone lies on."""
        return sections_of(self.solid, frame, np.array([RESTS_WITHIN * self._height(frame[2])]))

    def _steadiest(self, up: str) -> tuple[np.ndarray, bool]:
        """Return the axes in which the stone stands with one end up, and whether it does so without a cut.

        Of the flat parts near the other end on which it stands, and of the end itself, the one is taken from whose
        edges the centre of mass is farthest.
        """
        wanted = self._direction(up)
        beside = next(end for end in (OF_STONE if up[-1] in OF_STONE else OF_SCAN) if end != up[-1])
        parts = list(self._parts_below(wanted))
        level = any(stands and normal @ wanted < -1.0 + 1e-9 for normal, stands in parts)
        ways = [(wanted, level)]
        if up[-1] in OF_STONE:
            ways += islice(((-normal, True) for normal, stands in parts if stands), CANDIDATES)
        frames = [_frame(upwards, self._direction(beside)) for upwards, _ in ways]
        rooms = [min(section.high.min(), -section.low.max()) for section in map(self._resting, frames)]
        best = int(np.argmax(np.round(rooms, 6)))
        return frames[best], ways[best][1]

    def _parts_below(self, upwards: np.ndarray) -> Iterator[tuple[np.ndarray, bool]]:
        """Yield the flat parts of the hull that look down, the largest first: normals, and whether it stands there."""
        hull = self._hull
        below = np.flatnonzero(hull.face_normals @ upwards < -np.cos(np.radians(TILT_DEG)))
        if not len(below):
            return
        rounded = np.round(hull.face_normals[below], 6)
        _, first, part = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        part = part.reshape(-1)
        areas = np.bincount(part, hull.area_faces[below])
        over = _over(self.solid.centre, hull.triangles[below], hull.face_normals[below])
        stands = np.bincount(part, over) > 0.0
        for k in np.argsort(-np.round(areas, 9), kind="stable"):
            yield hull.face_normals[below[first[k]]], bool(stands[k])

    def _whole_doubled(self) -> float:
        """Return the share of the volume that the surface encloses twice."""
        frames = (self.axes, self.axes[[1, 2, 0]], self.axes[[2, 0, 1]])
        shares = (np.arange(24) + 0.5) / 24
        return max(doubled_share(self.solid, frame, shares * self._height(frame[2])) for frame in frames)

    def _cut(self, frame: np.ndarray, sections: Sections) -> float:
        """Return the least cut in whole centimetres after which the stone stands firmly on a foot [m].

        The foot must reach out from the centre of mass, on each of its four sides, by a quarter of the largest section.
        Where no cut is enough, a foot that is half as long and wide as this will do; 0 where there is none either.
        """
        height = self._height(frame[2])
        sides = np.stack(sides_of(sections), axis=1)
        asked = LEAST_FOOT * sides.max(axis=0)
        # A fit smooths the sections: those that are nearly large enough are looked at.
        wide = (sides >= NEARLY * asked).all(axis=1)
        firm = (sides - 2.0 * np.abs(sections.middle) >= NEARLY * asked).all(axis=1)
        enough = None
        for cut in np.arange(np.floor(MOST_CUT * height / CUT_STEP_M) + 1.0) * CUT_STEP_M:
            index = int(np.searchsorted(sections.height, cut))
            if not (wide[index] if enough is None else firm[index]):
                continue
            left = self._left(frame, cut)
            profiles = [fitted(sections.turned(k), cut, height, left.volume) for k in range(2)]
            if all(map(has_foot, profiles)):
                if all(map(is_firm, profiles)):
                    return float(cut)
                enough = float(cut) if enough is None else enough
        return enough or 0.0

    def _left(self, frame: np.ndarray, cut: float) -> _Remainder:
        """Return what is left above a cut, in the axes of a frame whose origin is the centre of mass of the whole."""
        solid = self.solid
        moment = solid.moment(frame[1])
        if cut == 0.0:
            return _Remainder(solid.volume, 0.0, 0.0, moment)
        foot = float(((solid.vertices - solid.centre) @ frame[2]).min())
        nodes, weights = np.polynomial.legendre.leggauss(16)
        below = sections_of(solid, frame, 0.5 * cut * (1.0 + nodes))
        slices, height = 0.5 * cut * weights * below.area, below.height + foot
        volume = solid.volume - float(slices.sum())
        x, z = -float((slices * below.middle[:, 0]).sum()) / volume, -float((slices * height).sum()) / volume
        lost = float((0.5 * cut * weights * below.second[:, 0] + slices * height**2).sum())
        return _Remainder(volume, x, z, moment - lost - volume * (x**2 + z**2))


class _Remainder(NamedTuple):
    """What is left of a stone above a cut: volume, centre of mass, moment of inertia about y through it."""

    volume: float
    x: float
    z: float
    moment: float


class _Up(NamedTuple):
    """A stone with one end up, the first of its other axes in the direction of travel."""

    frame: np.ndarray
    sections: Sections
    stands: bool
    rests: float
    cut: float


def _frame(upwards: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Return right-handed axes, z upwards and x near another direction, shape (3, 3)."""
    x = beside - (beside @ upwards) * upwards
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(upwards, x), upwards])


def _is_nearest(towards: np.ndarray, x: int, y: int) -> bool:
    """Return whether a direction is nearer to this one of the four quarters than to any other."""
    return bool(x * towards[0] + y * towards[1] >= np.abs(towards[:2]).max() * (1.0 - 1e-12))


def _over(centre: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return whether a point lies over each of n triangles, bool, shape (n,)."""
    corner = triangles - centre
    sides = np.einsum("ijk,ik->ij", np.cross(corner, np.roll(corner, -1, axis=1)), normals)
    least = 1e-9 * np.abs(sides).max()
    return (sides >= -least).all(axis=1) | (sides <= least).all(axis=1)


def _named_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return axes a, b and c as rows, and the sides of the box along them, of points around the centre of mass [m]."""
    axes, sides = smallest_box(points)
    order = np.argsort(-np.round(sides, 9), kind="stable")
    axes, sides = axes[order], sides[order]
    placed = points @ axes.T
    middle = 0.5 * (placed.min(axis=0) + placed.max(axis=0))
    # An end of a stone that is the same on both has no name of its own: it takes what makes the axes right-handed.
    same = np.abs(middle) < 1e-6 * sides
    axes *= np.sign(np.where(same, axes[range(3), np.abs(axes).argmax(axis=1)], middle))[:, None]
    if np.linalg.det(axes) < 0.0:
        axes[1 if same[1] else 0 if same[0] else 2] *= -1.0
    return axes, sides


SCREENED = 4096
"""Rotations that are tried first: from each box to the next, some 5 degrees."""
FEW = 4096
"""Most points that stand for the stone until the last refinements: beyond, those farthest out in so many directions."""
REFINED = 24
"""Rotations that are refined, the best first."""
LAST = 3
"""Boxes of different volume that are refined around all points at last."""
REACH = 0.1
"""Largest step of a refinement at first [rad]."""
LEAST_GAIN = 1e-9
"""Share of the volume below which no further step is made."""


def smallest_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the box of least volume around the corners of a convex hull [m], shape (n, 3): axes and sides [m].

    The axes are the directions of the sides as rows, right-handed, in no particular order, shape (3, 3). The order of
    the corners changes nothing but the last digits.
    """
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(np.random.default_rng(0).standard_normal((SCREENED, 4))).as_matrix()
    few = points if len(points) <= FEW else _farthest(points, turns[:FEW, 0])
    volumes = np.prod([np.ptp(turns[:, k] @ few.T, axis=1) for k in range(3)], axis=0)
    boxes = [_refined(few, turns[k]) for k in np.argsort(volumes, kind="stable")[:REFINED]]
    different = np.unique([np.round(np.log(sides.prod()), 6) for _, sides in boxes], return_index=True)[1]
    last = [_refined(points, boxes[k][0]) for k in different[:LAST]]
    return min(last, key=lambda box: float(box[1].prod()))


def _farthest(points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the points that are farthest out in some directions."""
    parts = np.array_split(directions, len(directions) // 64)
    return points[np.unique(np.concatenate([(part @ points.T).argmax(axis=1) for part in parts]))]


def _refined(points: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the box of least volume near another, axes and sides."""
    from scipy.optimize import linprog
    from scipy.spatial.transform import Rotation

    reach, sides = REACH, np.ptp(points @ axes.T, axis=0)
    while reach > LEAST_GAIN:
        rows, least = _touching(points @ axes.T, reach)
        # Unknown: the small rotation, and how far the box extends on its six sides.
        costs = np.concatenate([np.zeros(3), 1.0 / sides, 1.0 / sides])
        bounds = [(-reach, reach)] * 3 + [(None, None)] * 6
        step = linprog(costs, A_ub=rows, b_ub=least, bounds=bounds)
        if not step.success or 3.0 - step.fun < LEAST_GAIN:
            break
        turned = Rotation.from_rotvec(step.x[:3]).as_matrix() @ axes
        found = np.ptp(points @ turned.T, axis=0)
        gained = float(np.log(sides.prod() / found.prod()))
        if gained > 0.0:
            axes, sides = turned, found
        if gained < 0.5 * (3.0 - step.fun):
            reach *= 0.25
    return axes, sides


def _touching(points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what the points ask of a box as rows @ unknowns <= least, after rotations of up to a reach.

    Rotated by w, a point p is at p + w x p, to first order. Only the points that are farthest out in some directions
    within the reach are asked.
    """
    shares = reach * np.linspace(-1.0, 1.0, 5)
    rows, least = [], []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        outwards = points[:, k] + (shares[:, None, None] * points[:, i] + shares[:, None] * points[:, j]).reshape(
            25, -1
        )
        for side, sign, chosen in ((3 + k, 1.0, outwards.argmax(axis=1)), (6 + k, -1.0, outwards.argmin(axis=1))):
            near = points[np.unique(chosen)]
            asked = np.zeros((len(near), 9))
            asked[:, i], asked[:, j], asked[:, side] = sign * near[:, j], -sign * near[:, i], -1.0
            rows.append(asked)
            least.append(-sign * near[:, k])
    return np.concatenate(rows), np.concatenate(least)
