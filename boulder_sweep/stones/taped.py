"""What is taken of a stone that nobody has scanned: the density of its rock, and shapes of its sizes and its mass.

The mass over the density of the rock is its volume, and that over the box of its sizes its fill f. Three shapes have
this volume within these sizes, on a flat foot. The sides of a section at the height z over the foot are sqrt(p) s(z)
times the sides of the box. Where s falls linearly from 1 to t over a height h, the volume is p (1 + t + t^2)/3 W L h,
and t follows from f. With p = 1 a foot of half the largest section, t = 1/2, fills 7/12; a stone that fills less has
sections that do not fill their rectangles, p = 12 f/7.
"""

from __future__ import annotations

import numpy as np

ROCK_KG_M3 = 2650.0
"""Density of rock where none is known: granite's and most others'."""
ROCKS = {
    "granite": (2500.0, 2640.0, 2810.0),
    "granodiorite": (2670.0, 2730.0, 2790.0),
    "diorite": (2720.0, 2850.0, 2990.0),
    "gabbro": (2700.0, 3030.0, 3500.0),
    "diabase": (2500.0, 2910.0, 3200.0),
    "basalt": (2700.0, 2990.0, 3300.0),
    "andesite": (2400.0, 2610.0, 2800.0),
    "limestone": (1930.0, 2550.0, 2900.0),
    "dolomite": (2280.0, 2700.0, 2900.0),
    "sandstone": (1610.0, 2350.0, 2760.0),
    "marble": (2600.0, 2750.0, 2900.0),
    "quartzite": (2500.0, 2600.0, 2700.0),
    "gneiss": (2590.0, 2800.0, 3000.0),
}
"""Least, average and largest density of kinds of rock [kg/m^3] (Telford, Geldart and Sheriff: Applied Geophysics, 2nd
ed., Cambridge University Press 1990, Table 2.1)."""
LEAST_FOOT = 0.5
"""A foot that is shorter or narrower than this share of the largest section counts as rounded."""


def is_flat(foot: float, largest: float) -> bool:
    """Return whether a foot counts as flat by one of its sides and the same side of the largest section."""
    return foot >= LEAST_FOOT * largest * (1.0 - 1e-9)


LEAST_FILL = (1.0 + LEAST_FOOT + LEAST_FOOT**2) / 3.0
"""Fill of a frustum whose smaller end has half the sides of the larger one, which fill the box: 7/12."""
_NARROW = {
    "narrower_downwards": (True, False),
    "barrel": (True, False, True),
    "narrower_upwards": (False, True),
}
"""Which points of each shape, evenly spaced from the foot to the top, are the narrow ones."""


def taped_profiles(shape: str, fills: np.ndarray) -> np.ndarray:
    """Return the profiles of one shape for stones of some fills.

    Parameters
    ----------
    shape
        One of `boulder_sweep.columns.SHAPES`.
    fills
        Volume over the volume of the box of the overall sizes, more than 0 and at most 1, shape (n,).

    Returns
    -------
    ndarray, shape (n, P, 4)
        Height, width, and reach towards the vehicle and away from it, as shares of height, width and length.
    """
    plan = np.minimum(1.0, fills / LEAST_FILL)
    end = 0.5 * (np.sqrt(np.maximum(12.0 * fills / plan - 3.0, 0.0)) - 1.0)  # t^2 + t + 1 = 3 f/p
    narrow = np.array(_NARROW[shape])
    sides = np.sqrt(plan)[:, None] * np.where(narrow, end[:, None], 1.0)
    heights = np.broadcast_to(np.linspace(0.0, 1.0, len(narrow)), sides.shape)
    return np.stack([heights, sides, 0.5 * sides, 0.5 * sides], axis=-1)
