"""When a boulder begins to turn: a first step that ends there.

A boulder stands on its base until the blow overcomes the couple of its weight, a few milliseconds after the first
touch, so the first step of nearly every simulation would be cut there. Up to then boulder and truck only move along the
direction of travel, on soil that is far from its ultimate resistance: a linear motion but for the drag, which a power
series of the time describes. So the instant is known beforehand, well enough for a step that ends just behind it.
Where it does not, the event is found within that step or a later one, as any other.
"""

from __future__ import annotations

from ._jit import exact_inlined
from .design import Constants
from .events import AT_END, needs_moment
from .gaps import TOLERANCE, GapFactors
from .soil import Kinematics
from .soil_laws import soil_reaction

SMALL = 1e-5
"""Share of the displacement at which the soil yields, or of the depth where that is less, by which it is moved to find
its stiffness: soil with cohesion may be said to yield nowhere, or far away."""
BEHIND = 1.0 + 0.3 * AT_END * TOLERANCE
"""The step is to end where the net moment is over the couple by this factor."""


@exact_inlined
def corrected(t: float, m_1: float, m_2: float, m_3: float, m_4: float, m_5: float, m_6: float, aim: float) -> float:
    """One step of Newton's method to the time [s] at which a series without constant term reaches an aim."""
    value = t * (m_1 + t * (m_2 + t * (m_3 + t * (m_4 + t * (m_5 + t * m_6)))))
    slope = m_1 + t * (2.0 * m_2 + t * (3.0 * m_3 + t * (4.0 * m_4 + t * (5.0 * m_5 + t * (6.0 * m_6)))))
    return t + (aim - value) / slope


@exact_inlined
def onset_of(c: Constants) -> float:
    """Time after the first touch at which the net moment exceeds the couple of the weight [s].

    Parameters
    ----------
    c
        Constants of a design, in any soil that has not been moved yet.

    Returns
    -------
    float
        No positive number where the blow does not turn the boulder away from the truck.

    Notes
    -----
    With the compression of the spring u, its rate without the damper w = v_v - v_b, and x = x_b, v = v_b the motion is

        u' = w - r u, w' = -(k_m + p) u + q x, x' = v, v' = p u - q x

    (Eqs 10, 17, 45), where r = k_v/c_v, p = k_v/m_eff and q is the stiffness of the soil over m_eff, if all of it moves
    alike; the net moment is h k_v u plus what such a displacement of the soil turns. The series are cut behind t^6.
    """
    moved = SMALL * min(c.x_yield, c.d)
    soil = soil_reaction(Kinematics(moved, 0.0, 0.0, 0.0, -c.z_0, c.d), c)
    r, p = c.tau_v * c.k_m, c.k_v * c.inverse_m_eff
    q, both = -soil.F / moved * c.inverse_m_eff, c.k_m + p
    u_1 = c.v_0
    u_2 = -0.5 * r * u_1
    w_2, v_2 = -0.5 * both * u_1, 0.5 * p * u_1
    u_3, w_3, v_3 = (w_2 - r * u_2) / 3.0, -both * u_2 / 3.0, p * u_2 / 3.0
    x_3 = v_2 / 3.0
    u_4, w_4, v_4 = 0.25 * (w_3 - r * u_3), 0.25 * (q * x_3 - both * u_3), 0.25 * (p * u_3 - q * x_3)
    x_4 = 0.25 * v_3
    u_5, w_5, v_5 = 0.2 * (w_4 - r * u_4), 0.2 * (q * x_4 - both * u_4), 0.2 * (p * u_4 - q * x_4)
    x_5 = 0.2 * v_4
    u_6, x_6 = (w_5 - r * u_5) / 6.0, v_5 / 6.0
    of_u, of_x = c.k_v * c.h, soil.M / moved
    m_1, m_2, m_3 = of_u * u_1, of_u * u_2, of_u * u_3 + of_x * x_3
    m_4, m_5, m_6 = of_u * u_4 + of_x * x_4, of_u * u_5 + of_x * x_5, of_u * u_6 + of_x * x_6
    aim = BEHIND * c.C_cos
    t = aim / m_1
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    return corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)


@exact_inlined
def first_length(h: float, g: GapFactors, c: Constants) -> float:
    """Length of the first step of a simulation by steps of length h [s].

    Parameters
    ----------
    h
        Length of the steps.
    g, c
        Factors of the gaps at the first touch, and constants of the design. As printed a boulder is not seated, and the
        first step is like any.
    """
    onset = onset_of(c)
    return onset if needs_moment(g) & (onset > 0.0) & (onset < h) else h
