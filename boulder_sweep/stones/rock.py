"""What is taken of stones where nobody has measured it, for settings and scans alike."""

from __future__ import annotations

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
