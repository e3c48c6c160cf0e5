"""The energy ledger: where the kinetic energy of the vehicle goes."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from .dynamics import Loads, Problem, motion_of
from .restoring import gravity_energy
from .vehicle import crush_force

Array = NDArray[np.float64]

# Path integrals carried along with the seven states of Eq 52, in this order after them.
DRAG, DAMPER, RESTORING, CLIPPED = 7, 8, 9, 10


@dataclass(frozen=True)
class Ledger:
    """Energy [J] over time, each an array of the shape of the times asked for; their sum should not change.

    Attributes
    ----------
    vehicle_kinetic, boulder_linear, boulder_angular : ndarray
        Kinetic energy of the vehicle, and of boulder and lumped soil.
    soil_elastic, soil_drag : ndarray
        Stored in the soil springs; dissipated by the drag.
    crush_spring, crush_damper : ndarray
        Stored in the spring of the Maxwell element; dissipated by its damper.
    gravity : ndarray
        Done against the restoring moment: a potential energy under the gravity reading, under the printed
        reading the work of M_R, which is no potential.
    clipped : ndarray
        Taken from nowhere where the printed clipping lets the vehicle be pulled without pulling the boulder.
        Zero under the released reading.
    """

    vehicle_kinetic: Array
    boulder_linear: Array
    boulder_angular: Array
    soil_elastic: Array
    soil_drag: Array
    crush_spring: Array
    crush_damper: Array
    gravity: Array
    clipped: Array

    @property
    def total(self) -> Array:
        """Sum of all parts [J]."""
        return np.sum([getattr(self, field.name) for field in fields(self)], axis=0)


def path_rates(impact: Problem, y: Array, load: Loads) -> Array:
    """Rates [W] of the path integrals: soil drag, crush damper, work against M_R, clipped force."""
    F_full = crush_force(impact.inputs.m_v, float(y[6]))  # in the Maxwell element, clipped or not
    return np.array(
        [
            load.soil.drag_power,
            F_full**2 / impact.inputs.c_v,  # Eq 40: the damper moves at F/c_v
            -load.M_R * y[3],
            (F_full - load.F_v) * load.v_contact,
        ]
    )


def ledger(impact: Problem, states: Array) -> Ledger:
    """Energy at each of the states.

    Parameters
    ----------
    impact : Problem
        The impact.
    states : ndarray, shape (11, n)
        The seven states of Eq 52, then the path integrals.
    """
    lumped, inputs = impact.constants, impact.inputs
    if impact.readings.restoring == "gravity":
        gravity = np.array([gravity_energy(inputs, lumped, theta) for theta in states[2]])
    else:
        gravity = states[RESTORING]
    return Ledger(
        vehicle_kinetic=inputs.m_v * states[5] ** 2 / 2,
        boulder_linear=lumped.m_eff * states[1] ** 2 / 2,
        boulder_angular=lumped.J_eff * states[3] ** 2 / 2,
        soil_elastic=np.array([impact.soil.elastic_energy(motion_of(y)) for y in states.T]),
        soil_drag=states[DRAG],
        crush_spring=(inputs.m_v * states[6]) ** 2 / (2 * inputs.k_v),
        crush_damper=states[DAMPER],
        gravity=gravity,
        clipped=states[CLIPPED],
    )
