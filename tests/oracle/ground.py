"""Soils that are not the same at every depth: layers, ground water, cohesion, ground that falls away; as elements.

Per element, from the same equations as in `tests.oracle.soil`, with the values of the layer that its middle lies in.
The ultimate pressure is (K_p sigma'_v + 2 c sqrt(K_p)) times the factor of the law and the strain rate; on ground that
falls away behind the boulder it is reduced by the weakest of all plane wedges, found by trying.
"""

from __future__ import annotations

from math import pi, radians, sqrt, tan

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from .constants import Constants, element_depths
from .inputs import GRAVITY, Ground, Inputs, layer_at
from .soil import Motion, SoilTotals, polar, spring_energies, stretch, velocity

Array = NDArray[np.float64]
WATER = 1000.0  # density of water [kg/m^3]


def vertical_stress(ground: Ground, alpha: float) -> float:
    """Effective vertical stress at a depth [Pa]: weight of the soil above it, less the pressure of the water."""
    tops = [layer.top for layer in ground.layers]
    bottoms = [*tops[1:], np.inf]
    weight = sum(
        layer.rho_s * max(min(alpha, bottom) - top, 0.0)
        for layer, top, bottom in zip(ground.layers, tops, bottoms, strict=True)
    )
    return GRAVITY * (weight - WATER * max(alpha - ground.water, 0.0))


def slope_factor(phi: float, slope: float) -> float:
    """Passive force on a smooth wall where the ground falls by `slope` [rad], over that where it is level.

    A wedge above a plane at an angle a, which may fall as the ground does, weighs as 1/(tan(a) + tan(slope)), and
    pushes with tan(a + phi) times that.
    """

    def least(i: float) -> float:
        found = minimize_scalar(
            lambda a: tan(a + phi) / (tan(a) + tan(i)),
            bounds=(1e-9 - i, pi / 2 - phi - 1e-9),
            method="bounded",
            options={"xatol": 1e-12},
        )
        return float(found.fun)

    return least(slope) / least(0.0)


def ultimate_pressure(inputs: Inputs, ground: Ground, alpha: float) -> float:
    """Ultimate pressure at a depth [Pa], with the effect of the strain rate."""
    layer = layer_at(ground, alpha)
    K_p = tan(radians(45) + layer.phi / 2) ** 2
    if inputs.resistance == "broms":
        shape = 3.0
    elif inputs.resistance == "width_capped":
        shape = min(K_p, 1 + 1.6 * (K_p - 1 / K_p) ** 0.67 / (1 + 5 * inputs.W / inputs.d))
    else:
        shape = K_p
    level = shape * (K_p * vertical_stress(ground, alpha) + 2 * layer.cohesion * sqrt(K_p))
    return level * slope_factor(layer.phi, ground.slope) * inputs.K_epsilon


class LayeredSoil:
    """The soil of one impact as N elements, in place of `tests.oracle.soil.Soil`."""

    dx_yield = np.inf  # no displacement is that of all elements

    def __init__(self, inputs: Inputs, constants: Constants) -> None:
        assert inputs.ground is not None
        assert constants.elements is not None
        self.alpha = element_depths(inputs.d, constants.elements)
        h_e = inputs.d / constants.elements
        layers = [layer_at(inputs.ground, float(alpha)) for alpha in self.alpha]
        beta, phi, rho_s = (np.array([getattr(layer, name) for layer in layers]) for name in ("beta", "phi", "rho_s"))
        # Eqs 24 and 25, 28, and 36
        self.k_n = 1e6 * beta * inputs.W * h_e * self.alpha / (inputs.d / np.tan(phi))
        pressures = [ultimate_pressure(inputs, inputs.ground, float(alpha)) for alpha in self.alpha]
        self.F_u = np.array(pressures) * inputs.W * h_e
        self.c_n = rho_s * inputs.W * h_e
        self.R_n, self.gamma_n = polar(constants, inputs, self.alpha)

    def end_stretch(self, motion: Motion) -> Array:
        """Displacement [m] of the uppermost and lowest element."""
        return stretch(self.R_n, self.gamma_n, motion)[[0, -1]]

    def end_velocity(self, motion: Motion) -> Array:
        """Velocity [m/s] of the uppermost and lowest element."""
        return velocity(self.R_n, self.gamma_n, motion)[[0, -1]]

    def totals(self, motion: Motion) -> SoilTotals:
        """Sum the soil's reaction over all elements (Eqs 19 and 20)."""
        v_n = velocity(self.R_n, self.gamma_n, motion)
        F_c = self.c_n * v_n * np.abs(v_n)
        F_n = -(np.clip(self.k_n * stretch(self.R_n, self.gamma_n, motion), -self.F_u, self.F_u) + F_c)
        M_n = -F_n * self.R_n * np.cos(self.gamma_n + motion.theta - pi)
        return SoilTotals(float(F_n.sum()), float(M_n.sum()), float((F_c * v_n).sum()))

    def elastic_energy(self, motion: Motion) -> float:
        """Energy stored in the springs [J]."""
        return float(spring_energies(self.k_n, self.F_u, stretch(self.R_n, self.gamma_n, motion)).sum())
