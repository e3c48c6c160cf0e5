"""The state of an impact and its rate (Eqs 10, 11, 52)."""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined
from .design import Constants
from .modes import Switches
from .restoring import couple_moment
from .soil import soil_kinematics, soil_reaction
from .trigonometry import sine_versine
from .vehicle import contact_displacement, contact_lever, spring_compression


class State(NamedTuple):
    """State of the motion; the acceleration of the truck follows from it (see `boulder_kernels.vehicle`)."""

    x_b: float
    """Displacement of the common centre of mass of boulder and soil [m]."""
    v_b: float
    """Its velocity [m/s]."""
    theta_b: float
    """Rotation of the boulder [rad]."""
    omega_b: float
    """Its angular velocity [rad/s]."""
    x_v: float
    """Displacement of the truck [m]."""
    v_v: float
    """Its velocity [m/s]."""


class Acceleration(NamedTuple):
    """Second derivatives of the three displacements, and the net moment they came from."""

    a_b: float
    """Acceleration of the centre of mass [m/s^2] (Eq 10)."""
    alpha_b: float
    """Angular acceleration [rad/s^2] (Eq 11)."""
    a_v: float
    """Acceleration of the truck [m/s^2] (Eq 17)."""
    M: float
    """Moment of soil and truck without the restoring moment [N m]."""


@inlined
def acceleration(
    x_b: float, v_b: float, theta_b: float, omega_b: float, x_v: float, v_v: float, s: Switches, c: Constants
) -> Acceleration:
    """Right-hand side of Eq 52 in the present modes.

    Parameters
    ----------
    x_b, v_b, theta_b, omega_b, x_v, v_v
        The state, as in `State`.
    s
        Factors of the present modes.
    c
        Constants of the design.
    """
    sin, versin = sine_versine(theta_b)
    soil = soil_reaction(soil_kinematics(x_b, v_b, omega_b, sin, versin, c), c)
    u = spring_compression(x_v, v_v, contact_displacement(x_b, sin, versin, c), c)
    F_v = s.k_contact * u  # Eqs 18, 41, 46
    M = soil.M + F_v * contact_lever(sin, versin, c)
    return Acceleration(
        (soil.F + F_v) * c.inverse_m_eff,
        (s.net * M + couple_moment(sin, versin, s, c)) * c.inverse_J_eff,
        -s.k_truck * u,
        M,
    )
