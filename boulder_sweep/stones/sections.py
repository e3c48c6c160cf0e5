"""Horizontal sections of a stone: area, middle and extent over its height.

A plane cuts every face that it passes through along a line, and the oriented lines run round the section. Area and
middle follow from them by Green's theorem, whatever the shape of the section and in however many parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from boulder_sweep.stones.solid import Solid

SCAN_LINES = 24
"""Lines along which a section is looked through for parts that the surface encloses twice."""


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a stone by m horizontal planes, of axes x and y.

    Attributes
    ----------
    height : ndarray, shape (m,)
        Height of each over the lowest point of the stone [m].
    area : ndarray, shape (m,)
        Area [m^2].
    middle : ndarray, shape (m, 2)
        Centroid, in x and y [m]; the origin is the centre of mass of the stone.
    low, high : ndarray, shape (m, 2)
        Extent in x and y [m].
    second : ndarray, shape (m, 2)
        Integrals of x^2 and y^2 over the section [m^4].
    """

    height: np.ndarray
    area: np.ndarray
    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    second: np.ndarray

    def turned(self, quarters: int) -> Sections:
        """Return the sections in axes that are turned anticlockwise by some quarters of a circle."""
        found = self
        for _ in range(quarters % 4):
            # The new x is the old y, the new y is minus the old x.
            middle = np.stack([found.middle[:, 1], -found.middle[:, 0]], axis=1)
            low = np.stack([found.low[:, 1], -found.high[:, 0]], axis=1)
            high = np.stack([found.high[:, 1], -found.low[:, 0]], axis=1)
            second = found.second[:, ::-1]
            found = Sections(found.height, found.area, middle, low, high, second)
        return found


def sections_of(solid: Solid, axes: np.ndarray, heights: np.ndarray) -> Sections:
    """Return sections of a stone.

    Parameters
    ----------
    solid
        The stone.
    axes
        Unit vectors x, y and z (up) in the axes of the scan, right-handed, shape (3, 3).
    heights
        Heights over the lowest point [m], shape (m,).
    """
    count = len(heights)
    area = np.zeros(count)
    middle, least, most, second = (np.zeros((count, 2)) for _ in range(4))
    for place, (start, end) in enumerate(_cuts(solid, axes, heights)):
        if not len(start):
            continue
        cross = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
        area[place] = 0.5 * cross.sum()
        if area[place] > 0.0:
            middle[place] = ((start + end) * cross[:, None]).sum(axis=0) / (6.0 * area[place])
            squares = start * start + start * end + end * end
            second[place] = (squares * cross[:, None]).sum(axis=0) / 12.0
        least[place], most[place] = start.min(axis=0), start.max(axis=0)
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
