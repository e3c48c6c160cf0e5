"""Reaction of the soil on the boulder: Eqs 19 to 36, element by element.

Each function here takes the depth of the elements and their height as arrays, so that the same literal
formulas serve the sum over N elements (all of height d/N) and the quadrature nodes of its limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, sin, tan

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from .constants import Constants, element_depths
from .inputs import GRAVITY, Inputs

Array = NDArray[np.float64]

# Nodes per panel. Spring and drag are quadratic in the depth, with the lever cubic: two nodes would be exact.
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class Motion:
    """Motion of boulder and soil: x_b [m], theta_b [rad] and their rates v_b [m/s], omega [rad/s]."""

    x_b: float
    theta: float
    v_b: float
    omega: float


@dataclass(frozen=True)
class SoilTotals:
    """Sum over the soil elements.

    Attributes
    ----------
    F : float
        Force on the boulder [N], the sum in Eq 10.
    M : float
        Moment about the centre of mass [N m], the sum in Eq 11; clockwise is positive.
    drag_power : float
        Power the drag takes out of the boulder [W].
    """

    F: float
    M: float
    drag_power: float


def polar(constants: Constants, inputs: Inputs, alpha: Array) -> tuple[Array, Array]:
    """Polar coordinates R_n [m] and gamma_n [rad] of elements at depth alpha [m], Eqs 7 and 8.

    The arctan of Eq 7 is right as printed: its denominator L - c_x is never negative.
    """
    d_n = alpha - (inputs.d - constants.c_y)  # depth below the centre of mass
    l_n = constants.l_n
    return np.sqrt(d_n**2 + l_n**2), np.arctan(d_n / l_n) + pi / 2


def stretch(R_n: Array, gamma_n: Array, motion: Motion) -> Array:
    """Displacement Delta x_n [m] of the elements, Eq 22."""
    return motion.x_b + R_n * np.sin(gamma_n + motion.theta) - R_n * np.sin(gamma_n)


def velocity(R_n: Array, gamma_n: Array, motion: Motion) -> Array:
    """Velocity of the elements [m/s], Eq 35."""
    return motion.v_b + motion.omega * R_n * np.cos(gamma_n + motion.theta)


def spring_constants(inputs: Inputs, alpha: Array, height: Array) -> Array:
    """Spring constants k_n [N/m], Eqs 24 and 25, with 1/N = height/d."""
    L_soil_c = inputs.d / tan(inputs.phi)  # Eq 25
    return 1e6 * inputs.beta * inputs.d * inputs.W / L_soil_c * (height / inputs.d) * alpha


def lateral_coefficient(inputs: Inputs) -> float:
    """Ultimate pressure over the vertical stress: K_p^2 of Eq 27, Broms' 3 K_p, or at most a wide wall's."""
    K_p = (1 + sin(inputs.phi)) / (1 - sin(inputs.phi))
    if inputs.resistance == "broms":
        return 3 * K_p
    if inputs.resistance == "width_capped":
        K_a, slenderness = 1 / K_p, inputs.W / inputs.d
        beside = (K_p - K_a) ** 0.67 * 1.6 / (1 + 5 * slenderness)
        return min(K_p * K_p, K_p + K_p * beside)
    return K_p * K_p


def ultimate_forces(inputs: Inputs, alpha: Array, height: Array) -> Array:
    """Largest force F_u,n [N] each spring can give, Eqs 27 and 28, with d/N = height."""
    sigma_n = lateral_coefficient(inputs) * inputs.rho_s * GRAVITY * alpha * inputs.K_epsilon  # Eq 27
    return sigma_n * inputs.W * height


def spring_forces(k_n: Array, F_u: Array, dx_n: Array) -> Array:
    """Spring forces F_k,n [N], Eqs 21 and 26, limited to the ultimate force of Eq 28 both ways."""
    return np.clip(k_n * dx_n, -F_u, F_u)


def spring_energies(k_n: Array, F_u: Array, dx_n: Array) -> Array:
    """Energy stored in the springs [J]: work of `spring_forces` from rest, elastic also beyond the cap."""
    within = np.abs(k_n * dx_n) <= F_u
    return np.where(within, k_n * dx_n**2 / 2, F_u * np.abs(dx_n) - F_u**2 / (2 * k_n))


def drag_forces(inputs: Inputs, height: Array, v_n: Array) -> Array:
    """Drag forces F_c,n [N], Eqs 34 and 36, with d/N = height."""
    return inputs.rho_s * inputs.W * height * v_n**2 * np.sign(v_n)


def yield_displacement(inputs: Inputs) -> float:
    """Displacement [m] at which every spring reaches its cap: F_u,n / k_n, the same at all depths."""
    one = np.array([1.0])
    return float((ultimate_forces(inputs, one, one) / spring_constants(inputs, one, one))[0])


class Soil:
    """The soil of one impact, as N elements or, where `constants.elements` is None, as their limit."""

    def __init__(self, inputs: Inputs, constants: Constants) -> None:
        self.inputs = inputs
        self.constants = constants
        self.dx_yield = yield_displacement(inputs)
        # The uppermost and lowest depth of the sum or integral: what happens to the soil happens there first.
        if constants.elements is None:
            self.ends = np.array([0.0, inputs.d])
        else:
            self._alpha = element_depths(inputs.d, constants.elements)
            self._height = np.full(constants.elements, inputs.d / constants.elements)
            self._R, self._gamma = polar(constants, inputs, self._alpha)
            self.ends = self._alpha[[0, -1]]
        self._R_ends, self._gamma_ends = polar(constants, inputs, self.ends)

    def end_stretch(self, motion: Motion) -> Array:
        """Displacement [m] at the upper and lower end of the soil, shape (2,)."""
        return stretch(self._R_ends, self._gamma_ends, motion)

    def end_velocity(self, motion: Motion) -> Array:
        """Velocity [m/s] at the upper and lower end of the soil, shape (2,)."""
        return velocity(self._R_ends, self._gamma_ends, motion)

    def break_points(self, motion: Motion) -> Array:
        """Depths [m] where the integrand changes its form: at the cap and where the drag turns, shape (3,).

        Displacement and velocity are linear in the depth, so two values of each give the crossing. A crossing
        beyond the soil is moved to its end, where it splits off a panel of no height.
        """
        top, bottom = self.end_stretch(motion)
        v_top, v_bottom = self.end_velocity(motion)
        crossings = [
            _crossing(top - self.dx_yield, bottom - self.dx_yield),
            _crossing(top + self.dx_yield, bottom + self.dx_yield),
            _crossing(v_top, v_bottom),
        ]
        return np.sort(crossings) * self.inputs.d

    def nodes(self, motion: Motion) -> tuple[Array, Array, Array, Array]:
        """Depth alpha [m], height [m], R [m] and gamma [rad] of the elements or quadrature nodes."""
        if self.constants.elements is not None:
            return self._alpha, self._height, self._R, self._gamma
        edges = np.concatenate(([0.0], self.break_points(motion), [self.inputs.d]))
        half = np.diff(edges)[:, None] / 2
        alpha = (edges[:-1, None] + half + half * _GAUSS_NODES).ravel()
        height = (half * _GAUSS_WEIGHTS).ravel()
        return alpha, height, *polar(self.constants, self.inputs, alpha)

    def totals(self, motion: Motion) -> SoilTotals:
        """Sum the soil's reaction over all elements (Eqs 19 and 20)."""
        alpha, height, R_n, gamma_n = self.nodes(motion)
        dx_n = stretch(R_n, gamma_n, motion)
        v_n = velocity(R_n, gamma_n, motion)
        k_n = spring_constants(self.inputs, alpha, height)
        F_u = ultimate_forces(self.inputs, alpha, height)
        F_c = drag_forces(self.inputs, height, v_n)
        F_n = -(spring_forces(k_n, F_u, dx_n) + F_c)  # Eq 19
        M_n = -F_n * R_n * np.cos(gamma_n + motion.theta - pi)  # Eq 20
        return SoilTotals(float(F_n.sum()), float(M_n.sum()), float((F_c * v_n).sum()))

    def elastic_energy(self, motion: Motion) -> float:
        """Energy stored in the springs [J]."""
        alpha, height, R_n, gamma_n = self.nodes(motion)
        k_n = spring_constants(self.inputs, alpha, height)
        solid = k_n > 0  # a node in a panel of no height has neither stiffness nor energy
        F_u = ultimate_forces(self.inputs, alpha, height)
        dx_n = stretch(R_n, gamma_n, motion)
        return float(spring_energies(k_n[solid], F_u[solid], dx_n[solid]).sum())

    def totals_by_quad(self, motion: Motion) -> tuple[float, float]:
        """Force [N] and moment [N m] for N -> infinity by adaptive quadrature, to check `totals` by."""

        def force(alpha: float, with_lever: bool) -> float:
            depth, one = np.array([alpha]), np.array([1.0])
            R_n, gamma_n = polar(self.constants, self.inputs, depth)
            F_k = spring_forces(
                spring_constants(self.inputs, depth, one),
                ultimate_forces(self.inputs, depth, one),
                stretch(R_n, gamma_n, motion),
            )
            F = -(F_k + drag_forces(self.inputs, one, velocity(R_n, gamma_n, motion)))
            return float((-F * R_n * np.cos(gamma_n + motion.theta - pi) if with_lever else F)[0])

        points = [p for p in self.break_points(motion) if 0 < p < self.inputs.d]
        options = {"epsabs": 0.0, "epsrel": 1e-11, "limit": 200, "points": points or None}
        return (
            quad(force, 0.0, self.inputs.d, args=(False,), **options)[0],
            quad(force, 0.0, self.inputs.d, args=(True,), **options)[0],
        )


def _crossing(top: float, bottom: float) -> float:
    """Where a line from `top` to `bottom` crosses zero, as a fraction of the depth limited to 0 ... 1."""
    slope = bottom - top
    fraction = -top / slope if slope != 0.0 else inf
    return min(max(fraction, 0.0), 1.0)
