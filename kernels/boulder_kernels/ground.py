"""The soil as it lies: laws of its ultimate resistance, layers, water, cohesion, slope (Eqs 101 to 108, 145).

The ultimate pressure at the depth alpha is

    p_u = S (K_p sigma' + 2 c sqrt(K_p)) K_epsilon

with the effective vertical stress sigma', Rankine's pressure with Bell's term for the cohesion c (Eq 105), and the
factor S = K/K_p by which the law of the resistance, K, exceeds a wall's passive pressure. Water takes its own weight
from the stress below the table (Eq 106), and nothing from the inertia of the soil. Ground that falls away reduces both
terms as it reduces Coulomb's plane wedge (Eq 107). A slope alone, and water up to the soil line, leave the pressure
proportional to depth: each is then a factor on K_epsilon, as another law is, and the closed form holds.

Without layers, water and cohesion all laws grow in proportion to depth, sigma_u = K rho_s g alpha K_epsilon, and differ
in the coefficient K alone. So another law than the paper's is the factor K / K_p^2 on K_epsilon (Eq 27), and everything
made for the paper's law holds: the closed form, the energy ledger, the proofs.

To add a law: write its coefficient, and choose it in `coefficient_of`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel, kernel
from .design import FAR, HEIGHT, NEAR, WIDTH, DesignTable, G, at_height
from .pieces import PRESSURE, PRESSURE_SLOPE, TO

KP_SQUARED, BROMS, WIDTH_CAPPED = range(3)
"""Laws of the ultimate resistance."""
WATER = 1000.0
"""Density of water [kg/m^3]."""


class Ground(NamedTuple):
    """The soil around a boulder, apart from the constants of the uppermost layer, which the design holds."""

    law: int
    """Law of the ultimate resistance."""
    slope: float
    """Angle at which the ground falls away behind the boulder [rad]."""
    water: float
    """Depth of the water table [m]; infinite where there is none."""
    cohesion: float
    """Effective cohesion of the uppermost layer [kPa]."""
    below: np.ndarray
    """Deeper layers, shape (M, 5): depth of the upper boundary [m], density [kg/m^3], friction angle [rad], constant of
    subgrade reaction [MN/m^3] and effective cohesion [kPa]."""


@exact_inlined
def tangent_coefficient(phi: float) -> float:
    """Rankine's coefficient K_p of passive earth pressure for an angle [rad] (with Eq 27), by the tangent itself.

    `boulder_kernels.design.passive_pressure_coefficient` is the same to rounding, without a call of the C library.
    """
    tangent = math.tan(0.25 * math.pi + 0.5 * phi)
    return tangent * tangent


@exact_inlined
def capped_coefficient(K_p: float, W: float, d: float) -> float:
    """K_p^2, or K_p R where this is less (Eq 102).

    R = 1 + 1.6 (K_p - K_a)^0.67 / (1 + 5 W/d) is the increase of the passive pressure on a wall of limited width by the
    soil beside it, after Ovesen and Brinch Hansen, for a wall that stands alone and reaches the surface.

    ``K_p``: Rankine's coefficient; ``W, d``: width of the boulder and depth of embedment [m].
    """
    R = 1.0 + 1.6 * math.pow(K_p - 1.0 / K_p, 0.67) / (1.0 + 5.0 * W / d)
    return min(K_p * K_p, K_p * R)


@exact_inlined
def coefficient_of(law: int, K_p: float, W: float, d: float) -> float:
    """Coefficient K of a law [-], of Rankine's coefficient, the width and the depth of embedment [m].

    The paper takes K_p^2, for slender piles (Eq 27); Broms (1964), for short rigid piles, 3 K_p (Eq 101).
    """
    if law == BROMS:
        return 3.0 * K_p
    if law == WIDTH_CAPPED:
        return capped_coefficient(K_p, W, d)
    return K_p * K_p


@exact_inlined
def slope_factor(phi: float, slope: float) -> float:
    """Passive pressure where the ground falls by a slope [rad] over that where it is level (Eq 107).

    Coulomb's coefficient for a smooth vertical wall is cos^2(phi) / (1 - sqrt(sin(phi) sin(phi - i) / cos(i)))^2. A
    friction angle phi [rad] below the slope, which only a random draw may give, counts as equal to it.
    """
    sin = math.sin(phi)
    falling = 1.0 - np.sqrt(sin * math.sin(max(phi - slope, 0.0)) / math.cos(slope))
    return ((1.0 - sin) / falling) ** 2


@exact_inlined
def put_factor(table: DesignTable, row: int, ground: Ground) -> None:
    """Multiply K_epsilon of a design by what law, slope and water up to the soil line make of the paper's pressure."""
    phi, rho_s = table.phi[row], table.rho_s[row]
    submerged = 1.0 - WATER / rho_s if ground.water == 0.0 else 1.0
    K_epsilon = table.K_epsilon[row] * slope_factor(phi, ground.slope) * submerged
    if ground.law != KP_SQUARED:
        K_p = tangent_coefficient(phi)
        K_epsilon *= coefficient_of(ground.law, K_p, table.W[row], table.d[row]) / (K_p * K_p)
    table.K_epsilon[row] = K_epsilon


@exact_inlined
def put_uniform(table: DesignTable, row: int, layers: np.ndarray) -> None:
    """Write the soil of a design as its only layer, with the paper's law."""
    K_p = tangent_coefficient(table.phi[row])
    layers[0, TO], layers[0, 1], layers[0, 2] = np.inf, table.rho_s[row], table.phi[row]
    layers[0, 3], layers[0, PRESSURE] = table.beta[row], 0.0
    layers[0, PRESSURE_SLOPE] = K_p * K_p * table.rho_s[row] * G


@exact_inlined
def put_layers(table: DesignTable, row: int, ground: Ground, layers: np.ndarray) -> None:
    """Write the layers of a design, as many as `layers` has rows; one that the water table cuts becomes two."""
    rho_s, phi, beta, cohesion = table.rho_s[row], table.phi[row], table.beta[row], ground.cohesion
    top = stress = 0.0
    deeper = 0
    for m in range(len(layers)):
        bottom = ground.below[deeper, 0] if deeper < len(ground.below) else np.inf
        if top < ground.water < bottom:
            bottom = ground.water
        K_p = tangent_coefficient(phi)
        factor = coefficient_of(ground.law, K_p, table.W[row], table.d[row]) / K_p * slope_factor(phi, ground.slope)
        weight = G * (rho_s - (WATER if top >= ground.water else 0.0))
        # sigma' is the stress at the upper boundary, and from there on the weight times the depth below it.
        layers[m, TO], layers[m, 1], layers[m, 2], layers[m, 3] = bottom, rho_s, phi, beta
        layers[m, PRESSURE] = factor * (K_p * (stress - weight * top) + 2e3 * cohesion * np.sqrt(K_p))
        layers[m, PRESSURE_SLOPE] = factor * K_p * weight
        stress += weight * (bottom - top)
        top = bottom
        if deeper < len(ground.below) and bottom == ground.below[deeper, 0]:
            rho_s, phi = ground.below[deeper, 1], ground.below[deeper, 2]
            beta, cohesion = ground.below[deeper, 3], ground.below[deeper, 4]
            deeper += 1


@exact_inlined
def put_slices(table: DesignTable, row: int, slices: int, profile: np.ndarray, layers: np.ndarray) -> None:
    """Cut the layers of a design into slices; the soil model that depends on the width takes the width at mid-slice.

    The pressure is no line along the depth then. The slices fill `layers` from its first row on, the layers to be cut
    are its last rows. As many rows as there are cuts lie between, so none is written over before it has been cut.
    """
    W, H, d = table.W[row], table.H[row], table.d[row]
    top, cut, here = 0.0, 1, slices - 1
    for m in range(len(layers)):
        lowest = layers[here, TO]
        bottom = min(lowest, d * cut / slices if cut < slices else np.inf)
        middle = 0.5 * (min(top, d) + min(bottom, d))
        local = W * at_height(profile, WIDTH, (d - middle) / H)
        K_p = tangent_coefficient(layers[here, 2])
        factor = capped_coefficient(K_p, local, d) / capped_coefficient(K_p, W, d)
        layers[m, 1], layers[m, 2], layers[m, 3] = layers[here, 1], layers[here, 2], layers[here, 3]
        layers[m, PRESSURE] = factor * layers[here, PRESSURE]
        layers[m, PRESSURE_SLOPE] = factor * layers[here, PRESSURE_SLOPE]
        layers[m, TO] = top = bottom
        if bottom == lowest and here < len(layers) - 1:
            here += 1
        else:
            cut += 1


@kernel
def put_soil(
    table: DesignTable,
    ground: Ground,
    layered: bool,
    slices: int,
    profile: np.ndarray,
    layers: np.ndarray,
    outlines: np.ndarray,
) -> None:
    """Write what the soil as it lies makes of n designs.

    ``table``: the designs, SI, arrays of shape (n,); K_epsilon is multiplied where the pressure is proportional to
    depth; ``ground``: what lies around them; ``layered``: whether the pressure is not proportional to the depth;
    ``slices``: slices of the buried depth that a law which depends on the width takes beside a boulder that is no box;
    ``profile``: height, width and reaches of the boulders as shares of their sides, shape (P, 4); P = 0 of boxes;
    ``layers``: where the layers go, shape (n, M, 6), see `boulder_kernels.pieces`: one for every boundary of soil or
    water, and one more for every cut between slices; M may be 0 where nothing asks for layers; ``outlines``: where the
    outlines go, shape (n, P, 4), see `boulder_kernels.design`.
    """
    cuts = slices - 1 if len(profile) > 0 and ground.law == WIDTH_CAPPED else 0
    for row in range(len(layers)):
        if layered:
            put_layers(table, row, ground, layers[row, cuts:])
        else:
            put_factor(table, row, ground)
            if layers.shape[1] > 0:
                put_uniform(table, row, layers[row, cuts:])
        if cuts > 0:
            put_slices(table, row, slices, profile, layers[row])
        for point in range(len(profile)):
            outlines[row, point, HEIGHT] = profile[point, HEIGHT] * table.H[row]
            outlines[row, point, WIDTH] = profile[point, WIDTH] * table.W[row]
            outlines[row, point, NEAR] = profile[point, NEAR] * table.L[row]
            outlines[row, point, FAR] = profile[point, FAR] * table.L[row]


@exact_kernel
def write_coefficients(table: DesignTable, law: int, out: np.ndarray) -> None:
    """Write the coefficient K of a law for n designs, SI, shape (n,)."""
    for row in range(len(out)):
        out[row] = coefficient_of(law, tangent_coefficient(table.phi[row]), table.W[row], table.d[row])
