"""The five places where the paper can be read in two ways."""

from __future__ import annotations

from typing import NamedTuple


class Readings(NamedTuple):
    """Which formula stands at each place where the printed one is wrong; False reads it as printed."""

    inertia_box: bool
    """Eq 16: moment of inertia of a box, m_b/12 (H^2 + L^2), in place of a quarter of it."""
    arm_geometric: bool
    """Eqs 5, 6: height of the blow over the centre of mass e + d - c_y, in place of e + d_1."""
    contact_left_face: bool
    """Eqs 45, 48: the struck face is the left one, lever h cos + c_x sin in place of h cos - c_x sin."""
    restoring_gravity: bool
    """Eqs 37-39: the couple of the weight at the corner, in place of a moment against the net moment."""
    separation_released: bool
    """Eq 47: the truck coasts once the contact force is used up, in place of being pulled forward."""


def as_printed() -> Readings:
    """Return the readings that reproduce the paper as it stands in print."""
    return Readings(False, False, False, False, False)


def corrected() -> Readings:
    """Return the readings with every known misprint put right: the default for design."""
    return Readings(True, True, True, True, True)
