"""Horizontal sections of a stone, and its profile: width, near and far face over the height, in a few straight pieces.

A plane cuts every face that it passes through along a line, and the oriented lines run round the section. Area and
middle follow from them by Green's theorem, whatever the shape of the section and in however many parts.

The model takes a stone whose horizontal sections are rectangles. A section of area A within a by b becomes one of the
same area, middle and proportions: its sides are a and b times sqrt(A / (a b)), never more than the stone's. So
soil is pushed by no more width, and the boulder stands on no longer a foot, than there is, while volume and centre of
mass are kept and the moment of inertia nearly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from boulder_sweep.stones.solid import Solid

SCAN_LINES = 24
"""Lines along which a section is looked through for parts that the surface encloses twice."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a stone by m horizontal planes, of axes x and y; the origin is the centre of mass of the stone."""

    height: np.ndarray
    """Height of each over the lowest point of the stone [m], shape (m,)."""
    area: np.ndarray
    """Area [m^2], shape (m,)."""
    middle: np.ndarray
    """Centroids, in x and y [m], shape (m, 2)."""
    low: np.ndarray
    high: np.ndarray
    """Extent in x and y [m], shape (m, 2)."""
    second: np.ndarray
    """Integrals of x^2 and y^2 over the section [m^4], shape (m, 2)."""

    def turned(self, quarters: int) -> Sections:
        """Return the sections in axes that are turned anticlockwise by some quarters of a circle."""
        sections = self
        for _ in range(quarters % 4):
            # The new x is the old y, the new y is minus the old x.
            middle = np.stack([sections.middle[:, 1], -sections.middle[:, 0]], axis=1)
            low = np.stack([sections.low[:, 1], -sections.high[:, 0]], axis=1)
            high = np.stack([sections.high[:, 1], -sections.low[:, 0]], axis=1)
            second = sections.second[:, ::-1]
            sections = Sections(sections.height, sections.area, middle, low, high, second)
        return sections


def sections_of(solid: Solid, axes: np.ndarray, heights: np.ndarray) -> Sections:
    """Return sections of a stone at heights over its lowest point [m], shape (m,).

    The axes are unit vectors x, y and z (up) in the axes of the scan, right-handed, shape (3, 3).
    """
    count = len(heights)
    area = np.zeros(count)
    middle, least, most, second = (np.zeros((count, 2)) for _ in range(4))
    for k, (start, end) in enumerate(_cuts(solid, axes, heights)):
        if not len(start):
            continue
        cross = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
        area[k] = 0.5 * cross.sum()
        if area[k] > 0.0:
            middle[k] = ((start + end) * cross[:, None]).sum(axis=0) / (6.0 * area[k])
            squares = start * start + start * end + end * end
            second[k] = (squares * cross[:, None]).sum(axis=0) / 12.0
        least[k], most[k] = start.min(axis=0), start.max(axis=0)
    return Sections(np.asarray(heights, dtype=float), area, middle, least, most, second)


def doubled_share(solid: Solid, axes: np.ndarray, heights: np.ndarray) -> float:
    """Return the share of some sections that the surface encloses twice, or inside out; arguments of `sections_of`."""
    parts = np.array([_doubled(start, end) for start, end in _cuts(solid, axes, heights)])
    inside, wrong = parts.sum(axis=0)
    return float(wrong / inside) if inside > 0.0 else 0.0


def _cuts(solid: Solid, axes: np.ndarray, heights: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield where planes cut a stone: starts and ends of lines, shape (k, 2) each."""
    points = (solid.vertices - solid.centre) @ axes.T
    z = points[:, 2] - points[:, 2].min()
    face_z = z[solid.faces]
    low, high = face_z.min(axis=1), face_z.max(axis=1)
    for height in heights:
        yield _lines(points, z, solid.faces[(low < height) & (high >= height)], height)


def _lines(points: np.ndarray, z: np.ndarray, faces: np.ndarray, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where a plane cuts some faces: starts and ends of lines, shape (k, 2), the stone on their left.

    A point on the plane counts as above it, so that every face that is cut has one point or two above.
    """
    above = z[faces] >= height
    # The point that is alone on its side first; then the two others, in the order of the face.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), above.argmin(axis=1))
    rows = np.arange(len(faces))
    a, b, c = (faces[rows, (alone + k) % 3] for k in range(3))

    def cut(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return where the plane cuts the edges from p to q; the same bits for both faces of an edge."""
        p, q = np.where(p < q, (p, q), (q, p))
        share = (height - z[p]) / (z[q] - z[p])
        return points[p, :2] + share[:, None] * (points[q, :2] - points[p, :2])

    first, second = cut(a, b), cut(a, c)
    up = z[a] >= height
    return np.where(up[:, None], first, second), np.where(up[:, None], second, first)


def _doubled(start: np.ndarray, end: np.ndarray) -> tuple[float, float]:
    """Return how much of the section is enclosed at all, and how much twice or more or the wrong way round.

    Along a line the winding number is the sum of the crossings so far, 0 outside and 1 inside.
    """
    inside = wrong = 0.0
    if not len(start):
        return inside, wrong
    low, high = start[:, 1].min(), start[:, 1].max()
    step = (high - low) / SCAN_LINES
    for y in low + step * (np.arange(SCAN_LINES) + 0.5):
        above = start[:, 1] >= y
        crossed = above != (end[:, 1] >= y)
        p, q = start[crossed], end[crossed]
        x = p[:, 0] + (y - p[:, 1]) / (q[:, 1] - p[:, 1]) * (q[:, 0] - p[:, 0])
        order = np.argsort(x, kind="stable")
        winding = np.cumsum(np.where(above[crossed], 1, -1)[order])[:-1]
        lengths = step * np.diff(x[order])
        inside += lengths[winding != 0].sum()
        wrong += lengths[(winding < 0) | (winding > 1)].sum()
    return inside, wrong


MOST_PIECES = 8
GOOD_FIT = 0.005
"""Root mean square of the error, as a share of the largest side, with which no further piece is tried."""
LEAST_SECTIONS = 4
"""Sections that a piece holds at least."""
LEAST_WEIGHT = 0.1
"""Weight of the smallest sections in a fit, as a share of the weight of the largest."""
LEAST_SIDE = 0.02
"""Shortest side of a profile, as a share of its longest: a pointed top ends in a small flat."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A stone of rectangular sections, between n heights linear."""

    height: np.ndarray
    """Heights over the foot, from 0 [m], shape (n,)."""
    width: np.ndarray
    """Across the direction of travel [m], shape (n,)."""
    near: np.ndarray
    far: np.ndarray
    """Distances of the near and the far face from the middle of the foot [m], shape (n,)."""
    foot_x: float
    """Middle of the foot in the axes of the sections, whose origin is below the centre of mass of the uncut stone
    [m]."""
    error: float
    """Root mean square, over the volume, of the error of length, width and middle against the sections [m]."""

    @property
    def length(self) -> np.ndarray:
        """Lengths of the sections along the direction of travel [m], shape (n,)."""
        return self.near + self.far

    @property
    def volume(self) -> float:
        """Volume within the profile [m^3]."""
        return self._integral(lambda w, near, far, z: w * (near + far))

    @property
    def centre(self) -> tuple[float, float]:
        """Centre of mass: how far beyond the middle of the foot, and how high above it [m]."""
        x = self._integral(lambda w, near, far, z: 0.5 * w * (far**2 - near**2))
        z = self._integral(lambda w, near, far, z: w * (near + far) * z)
        return x / self.volume, z / self.volume

    @property
    def moment(self) -> float:
        """Moment of inertia about the axis across the travel through the centre of mass, for 1 kg/m^3 [m^5]."""
        x, z = self.centre
        about_foot = self._integral(lambda w, near, far, z: w * ((far**3 + near**3) / 3.0 + (near + far) * z**2))
        return about_foot - self.volume * (x**2 + z**2)

    def _integral(self, function: Callable[..., np.ndarray]) -> float:
        """Integrate a polynomial of degree 5 or less of the sides and the height over the height."""
        nodes, weights = np.polynomial.legendre.leggauss(3)
        share = 0.5 * (1.0 + nodes)[:, None]
        step = np.diff(self.height)
        inside = (part[:-1] + share * np.diff(part) for part in (self.width, self.near, self.far, self.height))
        return float((0.5 * weights[:, None] * step * function(*inside)).sum())


def sides_of(sections: Sections) -> tuple[np.ndarray, np.ndarray]:
    """Return length and width of the rectangles of n sections [m], shape (n,) each."""
    extent = sections.high - sections.low
    around = np.prod(extent, axis=1)
    filled = np.sqrt(np.clip(np.divide(sections.area, around, out=np.zeros_like(around), where=around > 0.0), 0.0, 1.0))
    return extent[:, 0] * filled, extent[:, 1] * filled


def fitted(sections: Sections, foot: float, top: float, volume: float) -> Profile:
    """Return the profile of a stone that has been cut off at its foot, with a volume above that [m^3].

    Foot and top are in the heights of the sections [m]. The points of the pieces are chosen by dynamic programming, the
    sides there by least squares, weighted by the area of the sections and a little more. The lengths are then changed
    in proportion, so that the volume is kept.
    """
    within = (sections.height > foot) & (sections.height < top)
    z = sections.height[within] - foot
    length, width = (side[within] for side in sides_of(sections))
    middle = sections.middle[within, 0]
    curves = np.stack([length, width, middle], axis=1)
    weights = sections.area[within] + LEAST_WEIGHT * sections.area[within].max()
    weights /= weights.sum()
    size = float(max(length.max(), width.max()))
    points = np.concatenate([[0.0], 0.5 * (z[:-1] + z[1:]), [top - foot]])
    for bounds in _divisions(z, curves, weights):
        knots = points[bounds]
        values = _least_squares(z, curves, weights, knots, LEAST_SIDE * size)
        missed = _hats(z, knots) @ values - curves
        error = float(np.sqrt((weights[:, None] * missed**2).sum() / 3.0))
        if error <= GOOD_FIT * size:
            break
    length, width, middle = values.T
    foot_x, middle = float(middle[0]), middle - middle[0]
    profile = Profile(knots, width, 0.5 * length - middle, 0.5 * length + middle, foot_x, error)
    length = length * (volume / profile.volume)
    return Profile(knots, width, 0.5 * length - middle, 0.5 * length + middle, foot_x, error)


def _hats(z: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return what a continuous piecewise linear function at z takes from each of its values at the knots."""
    return np.stack([np.interp(z, knots, row) for row in np.eye(len(knots))], axis=1)


def _divisions(z: np.ndarray, curves: np.ndarray, weights: np.ndarray) -> Iterator[list[int]]:
    """Yield the bounds that divide n sections into one piece, two, ... with the least squared error.

    Every piece is fitted by a line of its own. A bound is the number of sections below it.
    """
    costs = _costs(z, curves, weights)
    best, before = costs[0], [np.zeros(len(z) + 1, dtype=int)]
    for pieces in range(1, min(MOST_PIECES, len(z) // LEAST_SECTIONS) + 1):
        bounds = [len(z)]
        for chosen in reversed(before):
            bounds.append(int(chosen[bounds[-1]]))
        yield bounds[::-1]
        if pieces < MOST_PIECES:
            total = best[:, None] + costs
            before.append(total.argmin(axis=0))
            best = total.min(axis=0)


def _costs(z: np.ndarray, curves: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the squared error of the best lines through sections i to j - 1, shape (n + 1, n + 1).

    It is infinite for fewer than `LEAST_SECTIONS`.
    """

    def sums(part: np.ndarray) -> np.ndarray:
        """Return the sums over the sections i to j - 1."""
        to = np.concatenate([[0.0], np.cumsum(weights * part)])
        return to[None, :] - to[:, None]

    z = z - z.mean()
    n, s, ss = sums(np.ones_like(z)), sums(z), sums(z * z)
    total = np.zeros_like(n)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = ss - s * s / n
        for curve in (curves - curves.mean(axis=0)).T:
            y, yy, yz = sums(curve), sums(curve * curve), sums(curve * z)
            total += yy - y * y / n - (yz - s * y / n) ** 2 / spread
    # Divisions that are alike are not told apart by their last digits.
    total = np.round(total / (weights[:, None] * curves**2).sum(), 9)
    index = np.arange(len(n))
    return np.where(index[None, :] - index[:, None] >= LEAST_SECTIONS, np.maximum(total, 0.0), np.inf)


def _least_squares(
    z: np.ndarray, curves: np.ndarray, weights: np.ndarray, knots: np.ndarray, least: float
) -> np.ndarray:
    """Return lengths and widths, of at least `least`, and middles at the knots, shape (knots, 3)."""
    from scipy.optimize import nnls

    root = np.sqrt(weights)
    hats = _hats(z, knots) * root[:, None]
    # The hats add up to one, so that what is over the least side is a combination of them, too.
    sides = [least + nnls(hats, root * (curve - least))[0] for curve in curves.T[:2]]
    return np.stack([*sides, np.linalg.lstsq(hats, root * curves[:, 2], rcond=None)[0]], axis=1)
