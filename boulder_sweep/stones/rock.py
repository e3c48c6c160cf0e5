"""What is taken of stones where nobody has measured it, for settings and scans alike."""

from __future__ import annotations

ROCK_KG_M3 = 2650.0
"""Density of rock where none is known: that of granite and most others."""
LEAST_FOOT = 0.5
"""A foot that is shorter or narrower than this share of the largest section counts as rounded."""


def is_flat(foot: float, largest: float) -> bool:
    """Return whether a foot counts as flat by one of its sides and the same side of the largest section."""
    return foot >= LEAST_FOOT * largest * (1.0 - 1e-9)
