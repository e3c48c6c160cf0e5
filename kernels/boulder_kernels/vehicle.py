"""The truck as a Maxwell element: a spring and a damper in series (Eqs 17, 18, 40-48).

Eq 45, x_v''' + (k_v/c_v) x_v'' + (k_v/m_v) x_v' = (k_v/m_v) x_c' with x_c the contact point on the boulder,
is an exact derivative. Integrated once from the state at impact (x_v = x_c = x_v'' = 0, x_v' = v_0) it reads

    m_v x_v'' = -F_v,   F_v = k_v u,   u = x_v - x_c - (m_v/c_v) (v_0 - x_v')        (Eqs 17, 18, 41, 46)

where u is the compression of the spring and the last term the crush of the damper, which takes up the momentum
the truck has lost. So the acceleration of the truck is not a state of its own, the crush is permanent by
itself, and after a separation contact resumes from zero force exactly when u returns to zero.
"""

from __future__ import annotations

from ._jit import inlined
from .design import Constants


@inlined
def contact_lever(sin: float, versin: float, c: Constants) -> float:
    """Lever of the contact force about the centre of mass, R_v cos(gamma_v + theta) [m] (Eqs 5, 6, 48).

    In Cartesian form h cos(theta) + g_x sin(theta), right in every quadrant. Printed, the struck face lies on the
    right of the centre of mass (g_x = -c_x); truly it is the left face (g_x = c_x).
    """
    return c.h - c.h * versin + c.g_x * sin


@inlined
def contact_displacement(x_b: float, sin: float, versin: float, c: Constants) -> float:
    """Displacement x_c of the contact point on the boulder [m]: x_b plus the integral of the lever over theta."""
    return x_b + c.h * sin + c.g_x * versin


@inlined
def spring_compression(x_v: float, v_v: float, x_c: float, c: Constants) -> float:
    """Compression u of the vehicle's spring [m]; below zero the truck has come off (Eq 45, integrated).

    On a second spring it is counted from where that exerts no force, u - u_0 (Eq 111).
    """
    return x_v - x_c - c.tau_v * (c.v_0 - v_v) - c.u_0
