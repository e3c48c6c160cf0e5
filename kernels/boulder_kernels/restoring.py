"""Restoring moment of the weight (Eqs 37-39), and the couple that stands in its place."""

from __future__ import annotations

from ._jit import inlined
from .design import Constants
from .modes import Switches


@inlined
def couple_moment(sin: float, versin: float, switches: Switches, c: Constants) -> float:
    """Moment of the couple of the weight in the present mode, b (C_cos cos + w sin) [N m].

    Corrected reading: m_b g (L/2 cos(theta) - H/2 sin|theta|) towards theta = 0, the weight at the boulder's own
    centre against the corner it turns about; it vanishes at the classical tipping angle, tan(theta) = L/H.
    Printed reading: the limit m_b g R_N |cos(gamma_N + theta)| of Eq 37.
    """
    return switches.couple * (c.C_cos - c.C_cos * versin + switches.couple_sin * sin)


@inlined
def signed_arm(sin: float, versin: float, c: Constants) -> float:
    """Printed reading: m_b g (d_N cos(theta) + l_n sin(theta)), the moment of Eq 37 before its modulus [N m]."""
    return c.C_cos - c.C_cos * versin + c.C_sin * sin


@inlined
def holding_moment(sin: float, versin: float, c: Constants) -> float:
    """Largest moment that the restoring moment can balance [N m] (Eq 37; seated: m_b g L/2).

    Printed, m_b g R_N |cos(gamma_N + theta)| = m_b g |d_N cos(theta) + l_n sin(theta)|. Corrected, it is asked for
    only at theta = 0.
    """
    return abs(signed_arm(sin, versin, c))
