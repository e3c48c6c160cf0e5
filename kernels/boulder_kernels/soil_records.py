"""What is known of the soil at one instant: its motion, and what it answers with."""

from __future__ import annotations

from typing import NamedTuple

TINY = 1e-30
"""Stands in for a slope of zero, so that a break point at infinity is clamped and not 0/0."""


class Reaction(NamedTuple):
    """Force and moment of the soil on the boulder."""

    F: float
    """Sum of F_n [N] (Eq 19)."""
    M: float
    """Sum of M_n about the common centre of mass [N m] (Eq 20)."""


class Kinematics(NamedTuple):
    """Displacement and velocity of the soil along the depth, as lines."""

    A: float
    """Displacement at the soil line [m]."""
    slope_x: float
    """Decrease of displacement over the whole depth, sin(theta) d [m]."""
    B: float
    """Velocity at the soil line [m/s]."""
    slope_v: float
    """Decrease of velocity over the whole depth, omega cos(theta) d [m/s]."""
    q: float
    """Depth of the centre of mass relative to the soil line as a lever, l_n sin - z_0 cos [m]."""
    lever_d: float
    """Increase of the lever over the whole depth, cos(theta) d [m]."""


class Potential(NamedTuple):
    """Elastic energy of the soil and its slopes."""

    V: float
    """Energy stored in the springs [J]."""
    V_A: float
    """Its derivative by the displacement at the soil line [N]."""
    V_X: float
    """Its derivative by the decrease of displacement over the depth [N]."""
