"""The fastest rates of a design, and the longest step that is stable for it.

Within a step the motion is smooth, and an explicit method is stable where its step times every rate of the
linearised motion lies in the stability region of the method. The rates are bounded from above, once per design, for
the states that the motion can reach: by the energy of the truck, and up to the rotation at which the simulation ends.
A design that would need too many steps is refused before it starts, and the status names the rate that asks for them.
Rates of an impossible design are not numbers, which `np.sqrt` also gives without the compiler.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined
from .design import Constants
from .numerics import sine_versine
from .outcomes import Status

STABLE_OSCILLATION = 1.5
"""Largest step times angular frequency. On the imaginary axis the method amplifies by 0.3 % a step there (its limit
for none is 1.0), which the damping of the soil and the length of an impact more than cover."""
STABLE_DECAY = 3.0
"""Largest step times rate of decay (the method's limit on the negative real axis is 3.3)."""
MOST_SHORTENING = 25.0
"""No design takes more than this many times the steps asked for,"""
STEPS_ALWAYS = 2_500
"""unless it needs no more than these to the horizon;"""
MOST_STEPS = 500_000
"""and none takes more than these."""
RETRY = 0.25
"""Factor on the step of a design whose motion became non-finite all the same, for its retry."""
ACCEPTED = -1
"""Refusal of a design that is not refused."""
QUARTER_TURN = 0.5 * math.pi


class Rates(NamedTuple):
    """Upper bounds of what drives the motion to and fro, and of what slows it down."""

    soil: float
    """Squared angular frequency [1/s^2] by the springs of the soil."""
    truck: float
    """The same by the spring of the truck."""
    turning: float
    """The same by forces that turn with the boulder: weight, contact and soil times the arm gained per angle."""
    relaxation: float
    """Rate [1/s] of the truck's spring against its damper, k_v/c_v."""
    drag: float
    """Rate [1/s] of the drag of the soil at its fastest."""


@exact_inlined
def largest_force(c: Constants) -> float:
    """Upper bound of the contact force [N]: the damper passes on no more, nor does the spring stop it by more."""
    stored = c.v_0 * c.k_v / np.sqrt(c.k_m)
    return min(stored, c.v_0 * c.k_v / (c.k_m * c.tau_v)) if c.tau_v > 0.0 else stored


@exact_inlined
def largest_speed(reach: float, inverse_J: float, c: Constants) -> float:
    """Upper bound of the speed of the boulder anywhere in the soil [m/s].

    Parameters
    ----------
    reach
        Bound of the lever of the soil [m].
    inverse_J
        Reciprocal of the moment of inertia that turns [1/(kg m^2)].
    c
        Constants of the design.

    Notes
    -----
    The energy of the truck bounds it, were it all in the boulder. So does a blow, whose point of contact moves off at
    no more than twice the speed of the truck: an end of the boulder then moves at most 1 + sqrt(1 + (reach/gyration)^2)
    times as fast as the truck, whatever the lever of the blow.
    """
    mobility = c.inverse_m_eff + reach * reach * inverse_J
    by_energy = np.sqrt(c.k_v / c.k_m * mobility)
    by_blow = 1.0 + np.sqrt(mobility / c.inverse_m_eff)
    return c.v_0 * min(by_energy, by_blow)


@exact_inlined
def rates_of(theta_stop: float, c: Constants) -> Rates:
    """Upper bounds of the rates of a design.

    Parameters
    ----------
    theta_stop
        Rotation at which the simulation ends [rad].
    c
        Constants of the design.

    Notes
    -----
    The stiffness matrix of boulder and truck is a sum, and its largest eigenvalue at most the sum of those of its
    terms. The soil's follows from the integrals of r, r lever and r lever^2 over the depth, r = 0 ... 1, with the
    lever (r d - z_0) cos(theta) + l_n sin(theta). Where the printed restoring moment doubles the net moment, the
    boulder turns as if half as heavy.
    """
    sin = sine_versine(theta_stop).sin if theta_stop < QUARTER_TURN else 1.0
    inverse_J = 2.0 * c.inverse_J_eff if c.theta_corner < theta_stop else c.inverse_J_eff
    d, z_0, l_n = c.d, c.z_0, abs(c.l_n)

    first = abs(d / 3.0 - 0.5 * z_0)
    second = 0.25 * d * d - (2.0 / 3.0) * z_0 * d + 0.5 * z_0 * z_0 + 2.0 * sin * l_n * first + 0.5 * (l_n * sin) ** 2
    first += 0.5 * l_n * sin
    across, around = 0.5 * c.inverse_m_eff, second * inverse_J
    coupled = first * first * c.inverse_m_eff * inverse_J
    soil = c.K_soil * (0.5 * (across + around) + np.sqrt(0.25 * (across - around) ** 2 + coupled))

    lever = min(abs(c.h) + abs(c.g_x) * sin, np.sqrt(c.h * c.h + c.g_x * c.g_x))
    truck = c.k_v * (c.inverse_m_eff + lever * lever * inverse_J) + c.k_m

    # The energy of the truck presses the soil no further than it takes to store it.
    pressed = 0.5 * c.K_soil * min(c.x_yield, 2.0 * c.v_0 * np.sqrt(c.k_v / (c.k_m * c.K_soil)))
    upright = max(abs(z_0), abs(d - z_0))
    turning = abs(c.C_cos) * sin + abs(c.C_sin)
    turning += largest_force(c) * (abs(c.g_x) + abs(c.h) * sin) + pressed * (l_n + upright * sin)

    mean_square = d * d / 3.0 - z_0 * d + z_0 * z_0 + sin * l_n * abs(d - 2.0 * z_0) + (l_n * sin) ** 2
    speed = largest_speed(upright + l_n * sin, inverse_J, c)
    drag = 2.0 * c.R_soil * speed * (c.inverse_m_eff + mean_square * inverse_J)
    return Rates(soil, truck, turning * inverse_J, c.k_m * c.tau_v, drag)


@exact_inlined
def stable_step(r: Rates) -> float:
    """Longest step that is stable for a design [s]."""
    oscillation = np.sqrt(r.soil + r.truck + r.turning)
    return min(STABLE_OSCILLATION / oscillation, STABLE_DECAY / (r.relaxation + r.drag))


@exact_inlined
def refusal(h: float, h_asked: float, horizon: float, r: Rates) -> int:
    """Status with which a design is refused because of its steps, or ACCEPTED.

    Parameters
    ----------
    h, h_asked
        Step of the design, and step asked for [s].
    horizon
        Longest simulated time [s].
    r
        Rates of the design.
    """
    asked = horizon / h_asked
    most = min(max(MOST_SHORTENING * asked, STEPS_ALWAYS), MOST_STEPS)
    if horizon / h <= most:
        return ACCEPTED
    if h >= h_asked:
        return Status.STEP_BUDGET.value
    oscillation = np.sqrt(r.soil + r.truck + r.turning)
    if STABLE_DECAY * oscillation < STABLE_OSCILLATION * (r.relaxation + r.drag):
        return Status.WEAK_DAMPER.value if r.relaxation >= r.drag else Status.THICK_SOIL.value
    if r.soil >= max(r.truck, r.turning):
        return Status.STIFF_SOIL.value
    return Status.STIFF_VEHICLE.value if r.truck >= r.turning else Status.LITTLE_INERTIA.value
