"""The smallest box around a stone, over all its directions.

The volume of a box that just holds the stone has a kink wherever another point of the stone comes to touch it, and is
least at such kinks, with edges of the stone in faces of the box (J. O'Rourke, Finding minimal enclosing boxes, 1985).
So no gradient leads there. For small rotations, though, the sides of the box follow from a linear programme, and its
solutions lie at the kinks. Rotations in all directions are screened, the best are refined, and the best of these wins.
"""

from __future__ import annotations

import numpy as np

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
    """Return the box of least volume around the convex hull of some points.

    Parameters
    ----------
    points
        Corners of the hull, around the origin [m], shape (n, 3). Their order changes nothing but the last digits.

    Returns
    -------
    axes : ndarray, shape (3, 3)
        Directions of the sides as rows, right-handed, in no particular order.
    sides : ndarray, shape (3,)
        Lengths along them [m].
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
