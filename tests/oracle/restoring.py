"""The restoring moment: Eqs 37 to 39 as printed, and the couple of weight and corner reaction."""

from __future__ import annotations

from math import cos, sin

from .constants import Constants
from .inputs import GRAVITY, Inputs


def printed_sign(constants: Constants, theta: float) -> float:
    """sign(sin(gamma_N + theta_b)) of Eqs 37 and 39: -1 once the lower right corner is left of the centre."""
    s = sin(constants.gamma_N + theta)
    return float((s > 0) - (s < 0))


def printed_limit(constants: Constants, theta: float) -> float:
    """Largest absolute restoring moment [N m], Eq 37."""
    return constants.m_b * GRAVITY * constants.R_N * abs(cos(constants.gamma_N + theta))


def printed_forward(limit: float, sign: float, net: float) -> float:
    """Restoring moment [N m] while the boulder turns forward, Eqs 37 and 39.

    Parameters
    ----------
    limit : float
        From `printed_limit`.
    sign : float
        From `printed_sign`.
    net : float
        Moment of soil and vehicle [N m], the bracket in Eq 39.
    """
    return -sign * min(max(net, -limit), limit)


def gravity_couple(inputs: Inputs, constants: Constants, theta: float, side: float) -> float:
    """Couple [N m] of the weight at the boulder's own centre and the corner on which it stands.

    On the lower right corner (`side` = 1, turned clockwise) the centre lies L/2 cos(theta) - H/2 sin(theta)
    to the left of the corner; on the lower left corner (`side` = -1) it is the mirror image.
    """
    tilt = side * theta
    return -side * constants.m_b * GRAVITY * (inputs.L / 2 * cos(tilt) - inputs.H / 2 * sin(tilt))


def gravity_hold(inputs: Inputs, constants: Constants) -> float:
    """Largest moment [N m] the weight balances while the boulder stands upright at rest."""
    return constants.m_b * GRAVITY * inputs.L / 2


def gravity_energy(inputs: Inputs, constants: Constants, theta: float) -> float:
    """Potential energy [J] of the weight that `gravity_couple` derives from, zero when upright."""
    lift = inputs.L / 2 * sin(abs(theta)) + inputs.H / 2 * (cos(theta) - 1)
    return constants.m_b * GRAVITY * lift
