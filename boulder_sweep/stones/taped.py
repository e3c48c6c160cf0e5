"""Shapes that a stone may have of which only the overall sizes and the mass are known.

The mass over the density of the rock is its volume, and that over the box of its sizes its fill f. Three shapes have
this volume within these sizes, on a flat foot. The sides of a section at the height z over the foot are sqrt(p) s(z)
times the sides of the box. Where s falls linearly from 1 to t over a height h, the volume is p (1 + t + t^2)/3 W L h,
and t follows from f. With p = 1 a foot of half the largest section, t = 1/2, fills 7/12; a stone that fills less has
sections that do not fill their rectangles, p = 12 f/7.
"""

from __future__ import annotations

import numpy as np

from boulder_sweep.stones.rock import LEAST_FOOT

LEAST_FILL = (1.0 + LEAST_FOOT + LEAST_FOOT**2) / 3.0
"""Fill of a frustum whose smaller end has half the sides of the larger one, which fill the box: 7/12."""
_NARROW = {
    "narrower_downwards": (True, False),
    "barrel": (True, False, True),
    "narrower_upwards": (False, True),
}
"""Which points of each shape, evenly spaced from the foot to the top, are the narrow ones."""


def taped_profiles(shape: str, fills: np.ndarray) -> np.ndarray:
    """Return the profiles of one of `boulder_sweep.columns.SHAPES` for stones of some fills, shape (n, P, 4).

    The fills, shape (n,), are more than 0 and at most 1. A point has its height, width, and reach towards the vehicle
    and away from it, as shares of height, width and length.
    """
    plan = np.minimum(1.0, fills / LEAST_FILL)
    end = 0.5 * (np.sqrt(np.maximum(12.0 * fills / plan - 3.0, 0.0)) - 1.0)  # t^2 + t + 1 = 3 f/p
    narrow = np.array(_NARROW[shape])
    sides = np.sqrt(plan)[:, None] * np.where(narrow, end[:, None], 1.0)
    heights = np.broadcast_to(np.linspace(0.0, 1.0, len(narrow)), sides.shape)
    return np.stack([heights, sides, 0.5 * sides, 0.5 * sides], axis=-1)
