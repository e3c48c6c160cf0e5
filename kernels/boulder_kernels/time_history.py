"""The time history of one impact: its record, the forces at a sample, and where the energy of the truck goes.

Energy is stored at a state, and exchanged along the motion by quadrature. Every entry comes from its own law: stored
energies are potentials, exchanged ones integrals of their own power, and none is what the others leave over. So the sum
of all of them stays at the truck's initial energy only if the forces of the motion are the ones these laws describe.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, taken
from .design import Constants, Readings
from .dormand_prince import DenseOutput, state_at
from .dynamics import (
    Acceleration,
    Modes,
    State,
    Switches,
    acceleration,
    contact_displacement,
    contact_lever,
    couple_moment,
    lift_of,
    spring_compression,
    switches_of,
)
from .numerics import sine_versine
from .soil import soil_kinematics
from .soil_laws import drag_power, soil_energy

GAUSS_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
GAUSS_WEIGHTS = (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692)
"""Nodes and weights of the four-point Gauss-Legendre rule on 0 ... 1."""


class StoredEnergies(NamedTuple):
    """Energies that follow from the state [J]."""

    truck_kinetic: float
    boulder_kinetic: float
    """Translation of boulder and lumped soil, m_eff v_b^2/2."""
    boulder_rotational: float
    """Rotation of boulder and lumped soil, J_eff omega_b^2/2."""
    soil_elastic: float
    crush_elastic: float
    """In the spring of the vehicle."""
    gravity: float
    """Corrected reading: m_b g times the rise of the boulder's centre over its corner; as printed 0, where the
    restoring moment has no potential and counts among the exchanged energies."""


class ExchangedEnergies(NamedTuple):
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
def nothing_exchanged() -> ExchangedEnergies:
    """Exchanged energies at the impact."""
    return ExchangedEnergies(0.0, 0.0, 0.0, 0.0)


@kernel
def stored_energies(y: State, m_v: float, touching: bool, gravity_couple: bool, c: Constants) -> StoredEnergies:
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
    return StoredEnergies(
        0.5 * m_v * y.v_v * y.v_v,
        0.5 * c.m_eff * y.v_b * y.v_b,
        0.5 * c.J_eff * y.omega_b * y.omega_b,
        soil_energy(k, c),
        0.5 * c.k_v * u * u if touching else 0.0,
        lift_of(sin, versin, c) if gravity_couple else 0.0,
    )


@kernel
def exchange_rates(y: State, modes: Modes, s: Switches, c: Constants) -> ExchangedEnergies:
    """Powers at a state [W], in the fields of the energies they add up to."""
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
    return ExchangedEnergies(drag, damper, -M_R * y.omega_b, pull)


@kernel
def add_exchanged(
    before: ExchangedEnergies,
    dense: DenseOutput,
    tau: float,
    modes: Modes,
    switches: Switches,
    c: Constants,
) -> ExchangedEnergies:
    """Add the energies exchanged in the part 0 ... tau of a step by Gauss-Legendre quadrature."""
    drag, damper, restoring, pull = before.drag, before.damper, before.restoring, before.pull
    for node in range(4):
        rates = exchange_rates(state_at(dense, GAUSS_NODES[node] * tau), modes, switches, c)
        weight = GAUSS_WEIGHTS[node] * tau * dense.h
        drag += weight * rates.drag
        damper += weight * rates.damper
        restoring += weight * rates.restoring
        pull += weight * rates.pull
    return ExchangedEnergies(drag, damper, restoring, pull)


class Record(NamedTuple):
    """Where a simulation writes its time history; empty arrays for none."""

    times: np.ndarray
    """Times asked for [s], ascending, shape (n,)."""
    states: np.ndarray
    """State at each, shape (n, 6), order of `State`; rows beyond the end of the simulation stay as they are."""
    turning: np.ndarray
    """Mode of rotation at each, int8, shape (n,)."""
    touching: np.ndarray
    """Whether the truck touched, bool, shape (n,)."""
    exchanged: np.ndarray
    """Energy exchanged up to each [J], shape (n, 4), order of `ExchangedEnergies`."""


def no_record() -> Record:
    """Return a record that keeps nothing."""
    return Record(
        np.empty(0, np.float64),
        np.empty((0, 6), np.float64),
        np.empty(0, np.int8),
        np.empty(0, np.bool_),
        np.empty((0, 4), np.float64),
    )


@kernel
def write_samples(
    record: Record,
    written: int,
    t: float,
    t_end: float,
    dense: DenseOutput,
    modes: Modes,
    switches: Switches,
    c: Constants,
    exchanged: ExchangedEnergies,
) -> int:
    """Write the samples that lie in a step from t to t_end [s], and return how many have been written in all."""
    while written < record.times.size and record.times[written] <= t_end:
        tau = (record.times[written] - t) / dense.h
        y = state_at(dense, tau)
        states = record.states[written]
        states[0], states[1], states[2] = y.x_b, y.v_b, y.theta_b
        states[3], states[4], states[5] = y.omega_b, y.x_v, y.v_v
        record.turning[written] = modes.turning
        record.touching[written] = modes.touching
        so_far = add_exchanged(exchanged, dense, tau, modes, switches, c)
        sums = record.exchanged[written]
        sums[0], sums[1], sums[2], sums[3] = (
            so_far.drag,
            so_far.damper,
            so_far.restoring,
            so_far.pull,
        )
        written += 1
    return written


class Sample(NamedTuple):
    """What follows from the state at one sample."""

    rate: Acceleration
    """Accelerations, and the moment of soil and truck without the restoring moment."""
    stored: StoredEnergies
    """Energies stored at this instant [J]."""


@inlined
def modes_of(y: State, turning: int, touching: bool, c: Any) -> Modes:
    """Return the modes of a sample; the signs of Eq 37 follow from the rotation itself."""
    corner = math.copysign(1.0, c.theta_corner - y.theta_b)
    arm = math.copysign(1.0, c.C_cos * math.cos(y.theta_b) + c.C_sin * math.sin(y.theta_b))
    return Modes(turning, touching, corner, arm, 0, 0)


@inlined
def state_of(record: Record, sample: int) -> State:
    """Return the state at a sample."""
    y: State = taken(record.states[sample], 0, 0, State)
    return y


@inlined
def sample_of(record: Record, sample: int, c: Any, m_v: float, readings: Readings) -> Sample:
    """Evaluate one sample; arguments: see `evaluate_samples`."""
    y = state_of(record, sample)
    touching = record.touching[sample] > 0
    modes = modes_of(y, int(record.turning[sample]), touching, c)
    rate = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches_of(modes, readings, c), c)
    # Printed separation: the spring goes on pulling the truck after release, so it holds energy all along.
    holds = touching or not readings.separation_released
    return Sample(rate, stored_energies(y, m_v, holds, readings.restoring_gravity, c))


@kernel
def evaluate_samples(
    record: Record,
    c: Any,
    m_v: float,
    readings: Readings,
    rates: np.ndarray,
    stored: np.ndarray,
) -> None:
    """Evaluate the samples of a record.

    Parameters
    ----------
    record
        The record, with n samples.
    c
        Constants of the motion.
    m_v
        Mass of the vehicle [kg].
    readings
        Which formulas are read as printed.
    rates
        Where the fields of `Acceleration` go, shape (4, n).
    stored
        Where the fields of `StoredEnergies` go, shape (6, n) [J].
    """
    for i in range(record.times.size):
        s = sample_of(record, i, c, m_v, readings)
        rates[0, i], rates[1, i], rates[2, i], rates[3, i] = s.rate.a_b, s.rate.alpha_b, s.rate.a_v, s.rate.M
        e = s.stored
        stored[0, i], stored[1, i], stored[2, i] = e.truck_kinetic, e.boulder_kinetic, e.boulder_rotational
        stored[3, i], stored[4, i], stored[5, i] = e.soil_elastic, e.crush_elastic, e.gravity
