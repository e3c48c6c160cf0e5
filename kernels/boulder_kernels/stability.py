"""The fastest rate of a design, and the longest step that is stable for it."""

from __future__ import annotations

import math

from ._jit import kernel
from .design import Constants

STABLE_OSCILLATION = 1.5
"""Largest step times angular frequency: the damping of the soil covers the little by which the method amplifies an
undamped oscillation there (its limit on the imaginary axis is 1.0)."""
STABLE_DECAY = 3.0
"""Largest step times rate of decay (the method's limit on the negative real axis is 3.3)."""


@kernel
def oscillation_rate(c: Constants) -> float:
    """Upper bound of the angular frequency of boulder, soil and truck at small displacements [rad/s].

    The stiffness of the soil against translation is K_soil/2; against rotation it is the same integral weighted by the
    squared lever (alpha - z_0)^2 + nothing else at theta_b = 0. The spring of the truck acts through both and its own
    mass. A sum of the squares bounds the largest eigenvalue, the trace of a positive matrix.
    """
    d, z_0 = c.d, c.z_0
    rocking = c.K_soil * (0.25 * d * d - (2.0 / 3.0) * z_0 * d + 0.5 * z_0 * z_0)
    lever = abs(c.h) + abs(c.g_x)
    trace = 0.5 * c.K_soil * c.inverse_m_eff + rocking * c.inverse_J_eff
    trace += c.k_v * (c.inverse_m_eff + lever * lever * c.inverse_J_eff) + c.k_m
    return math.sqrt(trace)


@kernel
def decay_rate(c: Constants) -> float:
    """Fastest rate of decay [1/s]: the truck's spring against its damper, k_v/c_v, and the drag of the soil at v_0."""
    relaxation = c.k_m * c.tau_v
    drag = 2.0 * c.R_soil * c.v_0 * (c.inverse_m_eff + (c.d * c.d + c.z_0 * c.z_0) * c.inverse_J_eff)
    return relaxation + drag


@kernel
def shortened_step(h: float, c: Constants) -> float:
    """Step that was asked for, or the longest stable one for this design where that is shorter [s]."""
    return min(h, STABLE_OSCILLATION / oscillation_rate(c), STABLE_DECAY / decay_rate(c))
