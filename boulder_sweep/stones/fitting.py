"""The profile of a stone: width, near and far face over the height, in a few straight pieces.

The model takes a stone whose horizontal sections are rectangles. A section of area A within a by b becomes one of the
same area, middle and proportions: its sides are a and b times sqrt(A / (a b)), never more than those of the stone. So
soil is pushed by no more width, and the boulder stands on no longer a foot, than there is, while volume and centre of
mass are kept and the moment of inertia nearly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from boulder_sweep.stones.sections import Sections

MOST_PIECES = 8
GOOD_FIT = 0.005
"""Root mean square of the error, as a share of the largest side, with which no further piece is tried."""
LEAST_SECTIONS = 4
"""Sections that a piece holds at least."""
LEAST_WEIGHT = 0.1
"""Weight of the smallest sections in a fit, as a share of that of the largest."""
LEAST_SIDE = 0.02
"""Shortest side of a profile, as a share of its longest: a pointed top ends in a small flat."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A stone of rectangular sections, between n heights linear.

    Attributes
    ----------
    height : ndarray, shape (n,)
        Heights over the foot, from 0 [m].
    width : ndarray, shape (n,)
        Across the direction of travel [m].
    near, far : ndarray, shape (n,)
        Distances of the near and the far face from the middle of the foot [m].
    foot_x : float
        Middle of the foot in the axes of the sections, whose origin is below the centre of mass of the uncut stone [m].
    error : float
        Root mean square, over the volume, of the error of length, width and middle against the sections [m].
    """

    height: np.ndarray
    width: np.ndarray
    near: np.ndarray
    far: np.ndarray
    foot_x: float
    error: float

    @property
    def length(self) -> np.ndarray:
        """Lengths of the sections along the direction of travel [m], shape (n,)."""
        return self.near + self.far

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
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
    """Return the profile of a stone that has been cut off at its foot.

    The points of the pieces are chosen by dynamic programming, the sides there by least squares, weighted by the area
    of the sections and a little more. The lengths are then changed in proportion, so that the volume is kept.

    Parameters
    ----------
    sections
        Its sections, in the axes in which it will stand.
    foot, top
        Heights of the foot and of the top in the heights of the sections [m].
    volume
        Volume above the foot [m^3].
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
    for places in _divisions(z, curves, weights):
        knots = points[places]
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
    """Yield where n sections are divided into one piece, two, ... with the least squared error.

    Every piece is fitted by a line of its own. A place is the number of sections below.
    """
    costs = _costs(z, curves, weights)
    best, before = costs[0], [np.zeros(len(z) + 1, dtype=int)]
    for pieces in range(1, min(MOST_PIECES, len(z) // LEAST_SECTIONS) + 1):
        places = [len(z)]
        for chosen in reversed(before):
            places.append(int(chosen[places[-1]]))
        yield places[::-1]
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
    place = np.arange(len(n))
    return np.where(place[None, :] - place[:, None] >= LEAST_SECTIONS, np.maximum(total, 0.0), np.inf)


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
