"""Forces and energies at the samples of a record, for time histories and for the page of a report."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, unless_none
from .design import Readings
from .dynamics import Acceleration, State, acceleration
from .energy import Stored, stored_energies
from .impact import Record
from .modes import Modes, switches_of
from .plastic import memory_of
from .second_spring import SecondSpring, on_second_spring, spent_energy
from .unloading import plastic_work, recall


class Sample(NamedTuple):
    """What follows from the state at one sample."""

    rate: Acceleration
    """Accelerations, and the moment of soil and truck without the restoring moment."""
    stored: Stored
    """Stored energies [J]; of plastic soil, what its elements would give back."""
    spent: float
    """Energy that was spent when a second spring took over [J] (Eq 112)."""


@inlined
def moved(u_0: float, c: Any, second: SecondSpring) -> Any:
    """Return the constants of a motion whose vehicle's spring is offset by u_0 [m]; 0 for the first spring."""
    return c if u_0 == 0.0 else on_second_spring(c, second.k_2, u_0)


@inlined
def spent_by(u_0: float, c: Any, second: SecondSpring) -> float:
    """Energy that was spent when a second spring took over [J]; nothing before."""
    return spent_energy(u_0, c.k_v, second.k_2)


constants_at = unless_none("u_0 c second", moved, "c")
"""Constants of the motion at a sample with an offset u_0 of the vehicle's spring [m], of the first constants."""
spent_at = unless_none("u_0 c second", spent_by, "0.0")
"""Energy that was spent by then when a second spring took over [J]."""


@inlined
def modes_of(y: State, turning: int, touching: bool, c: Any) -> Modes:
    """Return the modes of a sample; the signs of Eq 37 follow from the rotation itself."""
    corner = math.copysign(1.0, c.theta_corner - y.theta_b)
    arm = math.copysign(1.0, c.C_cos * math.cos(y.theta_b) + c.C_sin * math.sin(y.theta_b))
    return Modes(turning, touching, corner, arm, 0, 0)


@inlined
def state_of(record: Record, sample: int) -> State:
    """Return the state at a sample."""
    y = record.states[sample]
    return State(y[0], y[1], y[2], y[3], y[4], y[5])


@inlined
def sample_of(
    record: Record, sample: int, first: Any, second: SecondSpring | None, m_v: float, readings: Readings
) -> Sample:
    """Evaluate one sample; arguments: see `evaluate_samples`."""
    u_0 = record.offset[sample]
    y, c = state_of(record, sample), constants_at(u_0, first, second)
    touching = record.touching[sample] > 0
    modes = modes_of(y, int(record.turning[sample]), touching, c)
    rate = acceleration(y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, switches_of(modes, readings, c), c)
    # Printed separation: the spring goes on pulling the truck after release, so it holds energy all along.
    holds = touching or not readings.separation_released
    stored = stored_energies(y, m_v, holds, readings.restoring_gravity, c)
    return Sample(rate, stored, spent_at(u_0, first, second))


@kernel
def evaluate_samples(
    record: Record,
    first: Any,
    second: SecondSpring | None,
    m_v: float,
    readings: Readings,
    rates: np.ndarray,
    stored: np.ndarray,
    spent: np.ndarray,
) -> None:
    """Evaluate the samples of a record in elastic or plastic soil.

    Parameters
    ----------
    record
        The record, with n samples.
    first
        Constants of the motion on the vehicle's first spring. What plastic soil remembers in them is overwritten.
    second
        Second spring of the vehicle, or None.
    m_v
        Mass of the vehicle [kg].
    readings
        Which formulas are read as printed.
    rates
        Where the fields of `Acceleration` go, shape (4, n).
    stored
        Where those of `Stored` go, shape (6, n) [J].
    spent
        Where the energies go that were spent when a second spring took over, by plastic soil up to the step of the
        sample, and by it since then, shape (3, n) [J]. The last is a part of the elastic energy of the soil.
    """
    memory = memory_of(first)
    for i in range(record.times.size):
        recall(i, memory)
        s = sample_of(record, i, first, second, m_v, readings)
        rates[0, i], rates[1, i], rates[2, i], rates[3, i] = s.rate.a_b, s.rate.alpha_b, s.rate.a_v, s.rate.M
        e = s.stored
        stored[0, i], stored[1, i], stored[2, i] = e.truck_kinetic, e.boulder_kinetic, e.boulder_rotational
        stored[3, i], stored[4, i], stored[5, i] = e.soil_elastic, e.crush_elastic, e.gravity
        before, since = plastic_work(state_of(record, i), first, memory)
        spent[0, i], spent[1, i], spent[2, i] = s.spent, before, since
