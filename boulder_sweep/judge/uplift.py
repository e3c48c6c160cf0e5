"""How strongly a blow lifts the boulder, which the planar model cannot show: see ``docs/uplift.md``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels.design import G
from boulder_sweep import elementary

WALL_FRICTION = 2.0 / 3.0
"""Friction angle between boulder and soil over that of the soil: EN 1997-1, 9.5.1, for smooth concrete."""


def side_friction(table: DesignTable) -> np.ndarray:
    """Return the friction of soil at rest on both sides of n boulders [N], shape (n,).

    K_0 tan(delta) rho_s g d^2 L with K_0 = 1 - sin(phi') (Jaky) and delta = 2/3 phi'; the paper leaves it out.

    Parameters
    ----------
    table
        n designs, SI.
    """
    coefficient = run_by_run(lambda phi: (1.0 - elementary.sin(phi)) * elementary.tan(WALL_FRICTION * phi), table.phi)
    return coefficient * table.rho_s * G * table.d**2 * table.L


def blow_lift(F_v: np.ndarray, table: DesignTable) -> np.ndarray:
    """Return how strongly blows lift n boulders, as a share of what holds them down, shape (n,) (Eq 103).

    The moment of the blow about the far lower corner turns the box with the angular acceleration
    F_v (e + d) / (m_b (L^2 + H^2) / 3), and its centre rises with L/2 times that. The force this takes over weight
    and side friction, F_v (e + d) 3 L / (2 (L^2 + H^2) (m_b g + S)), is what the ground must push the boulder up with,
    and what it would have to pull with when the rotation is braked as fast.

    Parameters
    ----------
    F_v
        Peak force of every blow [N].
    table
        n designs, SI.
    """
    weight = table.rho_b * table.L * table.W * table.H * G
    turned = F_v * (table.e + table.d) * 1.5 * table.L / (table.L**2 + table.H**2)
    return turned / (weight + side_friction(table))


def run_by_run(function: Callable[[np.ndarray], np.ndarray], column: np.ndarray) -> np.ndarray:
    """Return a function of n values, computed once for neighbours that are equal.

    Parameters
    ----------
    function
        Takes values and returns numbers for each, along the last axis.
    column
        Values of shape (n,), such as those of a soil: from one design of a grid to the next they seldom change.
    """
    starts = np.flatnonzero(column[1:] != column[:-1]) + 1
    if 4 * len(starts) >= len(column):
        return function(column)
    starts = np.concatenate([[0], starts])
    return np.repeat(function(column[starts]), np.diff(starts, append=len(column)), axis=-1)
