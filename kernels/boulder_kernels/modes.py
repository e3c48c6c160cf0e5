"""The modes of a motion: what is held fixed during a step and changes only where a step ends.

The forces are smooth but for a few switches: the truck touches or has come off; the boulder is seated on its base,
or turns one way or the other, and the couple of its weight jumps with it. Switched inside the right-hand side, a
jump makes the integrator first order, because the negative stage weights of Dormand and Prince push the state
over it and back. So the switches are modes: frozen within a step, the right-hand side is smooth, and the step is
cut at the instant at which the mode changes.

One linear form serves every reading. With M the moment of soil and truck, the restoring moment is

    M_R = a M + b (C_cos cos(theta) + w sin(theta))

and only a, b and w change with the mode.
"""

from __future__ import annotations

from typing import NamedTuple

from ._jit import inlined
from .design import Constants, Readings

SEATED = 0
"""Gravity reading: theta_b = 0 and at rest; the weight balances the other moments."""
TURNING_FORWARD = 1
"""Gravity reading: theta_b > 0."""
TURNING_BACK = 2
"""Gravity reading: theta_b < 0."""
LAST_OF_GRAVITY = TURNING_BACK
"""Modes up to this one are of the gravity reading."""
HELD = 3
"""Printed reading, omega > 0, or come to rest: the restoring moment equals the net moment (Eq 39)."""
LIMITED_FORWARD = 4
"""Printed reading, omega > 0: net moment over the limit, restoring moment at it (Eq 37)."""
LIMITED_BACK = 5
"""Printed reading, omega > 0: net moment below minus the limit."""
FREE = 6
"""Printed reading, omega < 0: no restoring moment (Eq 38)."""


class Modes(NamedTuple):
    """The switches of one step."""

    turning: int
    """One of the modes of rotation above."""
    touching: bool
    """Whether truck and boulder touch."""
    corner: float
    """Printed reading: sign of sin(gamma_N + theta_b) (Eqs 37, 39); 1 otherwise."""
    arm: float
    """Printed reading: sign of -cos(gamma_N + theta_b), whose modulus Eq 37 is limited by; 1 otherwise."""
    yielded_top: int
    """Soil at the soil line: 0 below its ultimate resistance, 1 at it forwards, -1 backwards."""
    yielded_base: int
    """The same at the base of the boulder."""


class Switches(NamedTuple):
    """The modes as factors of the right-hand side."""

    net: float
    """1 + a: share of the net moment of soil and truck that accelerates the boulder."""
    couple: float
    """b: sign of the couple."""
    couple_sin: float
    """w: coefficient of sin(theta_b) in the couple [N m]."""
    k_contact: float
    """Spring of the contact, k_v or 0 [N/m]."""
    k_truck: float
    """Spring over mass that decelerates the truck, k_v/m_v or 0 [1/s^2]."""


@inlined
def switches_of(modes: Modes, readings: Readings, c: Constants) -> Switches:
    """Factors of the right-hand side for the modes of a step (Eqs 37-39, 47)."""
    net, couple, couple_sin = 1.0, 0.0, 0.0
    turning = modes.turning
    if turning == SEATED:
        net = 0.0
    elif turning == TURNING_FORWARD:
        couple, couple_sin = -1.0, c.C_sin
    elif turning == TURNING_BACK:
        couple, couple_sin = 1.0, -c.C_sin
    elif turning == HELD:
        net = 1.0 - modes.corner
    elif turning == LIMITED_FORWARD:
        couple, couple_sin = -modes.corner * modes.arm, c.C_sin
    elif turning == LIMITED_BACK:
        couple, couple_sin = modes.corner * modes.arm, c.C_sin
    k_contact = c.k_v if modes.touching else 0.0
    k_truck = c.k_m if modes.touching or not readings.separation_released else 0.0
    return Switches(net, couple, couple_sin, k_contact, k_truck)
