"""Where the energy of the truck goes: stored at a state, and exchanged along the motion by quadrature.

Every entry comes from its own law: stored energies are potentials, exchanged ones integrals of their own power, and
none is what the others leave over. So the sum of all of them stays at the truck's initial energy only if the forces of
the motion are the ones these laws describe.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import kernel
from .dense_output import DenseOutput, state_at
from .design import Constants
from .dynamics import State, acceleration, contact_displacement, contact_lever, couple_moment, spring_compression
from .modes import Modes, Switches
from .numerics import sine_versine
from .outlined import lift_of
from .soil import soil_kinematics
from .soil_laws import drag_power, soil_energy

GAUSS_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
GAUSS_WEIGHTS = (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692)
"""Nodes and weights of the four-point Gauss-Legendre rule on 0 ... 1."""


class Stored(NamedTuple):
    """Energies that follow from the state [J]."""

    truck_kinetic: float
    boulder_kinetic: float
    """Of boulder and lumped soil, m_eff v_b^2/2."""
    boulder_rotational: float
    """Of boulder and lumped soil, J_eff omega_b^2/2."""
    soil_elastic: float
    crush_elastic: float
    """In the spring of the vehicle."""
    gravity: float
    """Corrected reading: m_b g times the rise of the boulder's centre over its corner; as printed 0, where the
    restoring moment has no potential and counts among the exchanged energies."""


class Exchanged(NamedTuple):
    """Energies exchanged since the impact [J]."""

    drag: float
    """Dissipated by the drag of the soil (Eq 36)."""
    damper: float
    """Dissipated by the damper of the vehicle."""
    restoring: float
    """Taken up by the restoring moment, minus the integral of M_R omega_b."""
    pull: float
    """Printed separation only: given to the truck by the air that pulls it, which no force on the boulder answers."""


@kernel
def nothing_exchanged() -> Exchanged:
    """Exchanged energies at the impact."""
    return Exchanged(0.0, 0.0, 0.0, 0.0)


@kernel
def stored_energies(y: State, m_v: float, touching: bool, gravity_couple: bool, c: Constants) -> Stored:
    """Stored energies at a state [J].

    Parameters
    ----------
    y
        The state.
    m_v
        Mass of the truck [kg].
    touching
        Whether truck and boulder touch.
    gravity_couple
        Whether the restoring moment is the couple of the weight.
    c
        Constants of the design.
    """
    sin, versin = sine_versine(y.theta_b)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    return Stored(
        0.5 * m_v * y.v_v * y.v_v,
        0.5 * c.m_eff * y.v_b * y.v_b,
        0.5 * c.J_eff * y.omega_b * y.omega_b,
        soil_energy(k, c),
        0.5 * c.k_v * u * u if touching else 0.0,
        lift_of(sin, versin, c) if gravity_couple else 0.0,
    )


@kernel
def exchange_rates(y: State, modes: Modes, s: Switches, c: Constants) -> Exchanged:
    """Powers at a state [W], in the places of the energies they add up to."""
    sin, versin = sine_versine(y.theta_b)
    drag = drag_power(soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c), c)
    u = spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c)
    F_truck = s.k_truck * u / c.k_m * c.k_v
    # tau_v = m_v/c_v and k_v/k_m = m_v, so 1/c_v = tau_v k_m / k_v.
    damper = F_truck * F_truck * c.tau_v * c.k_m / c.k_v
    M = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, s, c).M
    M_R = (s.net - 1.0) * M + couple_moment(sin, versin, s, c)
    pull = 0.0
    if not modes.touching:
        v_c = y.v_b + y.omega_b * contact_lever(sin, versin, c)
        pull = -F_truck * v_c
    return Exchanged(drag, damper, -M_R * y.omega_b, pull)


@kernel
def add_exchanged(
    before: Exchanged,
    dense: DenseOutput,
    h: float,
    tau: float,
    modes: Modes,
    switches: Switches,
    c: Constants,
) -> Exchanged:
    """Add the energies exchanged in the part 0 ... tau of a step of length h [s] by Gauss-Legendre quadrature."""
    drag, damper, restoring, pull = before.drag, before.damper, before.restoring, before.pull
    for node in range(4):
        rates = exchange_rates(state_at(dense, GAUSS_NODES[node] * tau), modes, switches, c)
        weight = GAUSS_WEIGHTS[node] * tau * h
        drag += weight * rates.drag
        damper += weight * rates.damper
        restoring += weight * rates.restoring
        pull += weight * rates.pull
    return Exchanged(drag, damper, restoring, pull)
