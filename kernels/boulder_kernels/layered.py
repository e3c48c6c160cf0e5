"""Soils that are not the same at every depth: layers, water, cohesion (Eqs 105 to 108).

A layer has its own density, friction angle and subgrade reaction, and with them its own spring (Eqs 24, 25), wedge
(Eqs 1, 2) and drag (Eq 36). Its ultimate pressure is linear in the depth, p_0 + p_1 alpha, whatever law it comes from:
vertical stress grows linearly within a layer, above or below the water. Without layers, water and cohesion p_0 is 0 and
p_1 is the paper's K_p^2 rho_s g (Eq 27).

A displacement at which all of the soil yields does not exist then. The soil is either N elements with numbers of their
own, or the layers themselves, for which `boulder_kernels.layered_soil` is exact: arrays beside the constants of the
design, and `boulder_kernels.soil_laws` chooses by their type.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_kernel
from .design import (
    Constants,
    Design,
    DesignTable,
    SoilMass,
    element_depth,
    element_mass,
    spring_per_depth,
    ultimate_pressure,
    wedge_slope,
)

TO, DENSITY, FRICTION, SUBGRADE, PRESSURE, PRESSURE_SLOPE = range(6)
"""Columns of the layers of a design, shape (M, 6), from the top down: depth of the lower boundary [m], density that has
inertia [kg/m^3], friction angle [rad], constant of subgrade reaction [MN/m^3], and ultimate pressure p_0 + p_1 alpha
without the effect of the strain rate [Pa], [Pa/m]. The last layer reaches down without end."""


LEAST_RATIO = 1e-30
"""Stands in for the depth of the soil line, where a soil with cohesion never yields."""


class SoilElements(NamedTuple):
    """N soil elements of equal height from the soil line down, with values of their own; arrays of shape (N,)."""

    ratio: np.ndarray
    """Depth of the middle over the embedment depth [-]."""
    stiffness: np.ndarray
    """Spring k_n [N/m] (Eqs 24, 25)."""
    ultimate: np.ndarray
    """Ultimate force F_u,n [N] (Eqs 28, 105)."""
    drag: np.ndarray
    """Drag over the velocity squared [kg/m] (Eq 36)."""


class SoilLayers(NamedTuple):
    """M layers of soil per ratio r = alpha/d of the depth, each down to its lower boundary; arrays of shape (M,).

    Spring, ultimate force and drag of a thin slice are K r, P_0 + P_1 r and R times its height over d.
    """

    to: np.ndarray
    """Lower boundary as a ratio of the depth, at most 1; 1 in the last layer [-]."""
    K: np.ndarray
    """Spring per ratio of the depth, squared [N/m] (Eqs 24, 25)."""
    P_0: np.ndarray
    P_1: np.ndarray
    """Ultimate force per ratio of the depth [N] (Eqs 28, 105)."""
    R: np.ndarray
    """Drag over the velocity squared, per ratio of the depth [kg/m] (Eq 36)."""


_record: Any = namedtuple
LayeredConstants = _record("LayeredConstants", (*Constants._fields, "soil"))
"""The fields of `Constants`, and ``soil``, its `SoilElements` or `SoilLayers`. Of the soil as a whole they hold
bounds: K_soil and R_soil are those of the stiffest and of the heaviest element all the way down, x_yield the last
displacement at which an element reaches its ultimate resistance."""
LayeredTable = _record("LayeredTable", (*DesignTable._fields, "layers"))
"""Many designs in soils of layers: the fields of `DesignTable`, and ``layers`` of shape (n, M, 6)."""


@exact_kernel
def in_layer(design: Design, layer: np.ndarray) -> Design:
    """Return a design in the soil of one layer, given as a row of its layers; K_epsilon is that of the design."""
    p = design
    return Design(
        p.L,
        p.W,
        p.H,
        p.rho_b,
        p.d,
        p.e,
        layer[DENSITY],
        layer[FRICTION],
        layer[SUBGRADE],
        p.K_epsilon,
        p.m_v,
        p.v_0,
        p.k_v,
        p.c_v,
        p.e_bumper,
    )


@exact_kernel
def fill_elements(design: Design, layers: np.ndarray, soil: SoilElements) -> SoilMass:
    """Give N elements the values of the layers that their middles lie in (Eq 105), and return what they weigh.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of its soil are those of the layers.
    layers
        Layers of its soil, shape (M, 6).
    soil
        Elements to fill.
    """
    elements = soil.ratio.size
    h_e = design.d / elements
    mass = first = second = 0.0
    m = 0
    for n in range(1, elements + 1):
        alpha = element_depth(n, design.d, elements)
        while m < len(layers) - 1 and alpha >= layers[m, TO]:
            m += 1
        local = in_layer(design, layers[m])
        pressure = (layers[m, PRESSURE] + layers[m, PRESSURE_SLOPE] * alpha) * design.K_epsilon
        soil.ratio[n - 1] = alpha / design.d
        soil.stiffness[n - 1] = spring_per_depth(local) * alpha * h_e
        soil.ultimate[n - 1] = pressure * design.W * h_e
        soil.drag[n - 1] = local.rho_s * design.W * h_e
        m_n, height = element_mass(n, local, elements), design.d - alpha
        mass += m_n
        first += m_n * height
        second += m_n * height * height
    return SoilMass(mass, first, second)


@exact_kernel
def fill_layers(design: Design, layers: np.ndarray, soil: SoilLayers) -> SoilMass:
    """Give M layers their values (Eq 105), and return what the wedge of Eqs 1, 2 weighs in them, N -> infinity.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of its soil are those of the layers.
    layers
        Layers of its soil, shape (M, 6).
    soil
        Layers to fill.
    """
    d = design.d
    mass = first = second = 0.0
    upper = d
    for m in range(len(layers)):
        local = in_layer(design, layers[m])
        ultimate = design.K_epsilon * design.W * d
        soil.to[m] = min(layers[m, TO] / d, 1.0) if m < len(layers) - 1 else 1.0
        soil.K[m] = spring_per_depth(local) * d * d
        soil.P_0[m] = layers[m, PRESSURE] * ultimate
        soil.P_1[m] = layers[m, PRESSURE_SLOPE] * d * ultimate
        soil.R[m] = local.rho_s * design.W * d
        # The wedge at a height over the base is that height times tan(theta_w) long.
        lower = d * (1.0 - soil.to[m])
        wedge = local.rho_s * design.W * wedge_slope(local.phi)
        mass += wedge * (upper**2 - lower**2) / 2.0
        first += wedge * (upper**3 - lower**3) / 3.0
        second += wedge * (upper**4 - lower**4) / 4.0
        upper = lower
    return SoilMass(mass, first, second)


class Bounds(NamedTuple):
    """Number of elements, and bounds of the soil as a whole, as of `LayeredConstants`."""

    elements: int
    K_soil: float
    R_soil: float
    x_yield: float


@exact_kernel
def bounds_of_elements(soil: SoilElements) -> Bounds:
    """Bounds of a soil of elements."""
    K_soil = R_soil = x_yield = 0.0
    elements = soil.ratio.size
    for n in range(elements):
        K_soil = max(K_soil, soil.stiffness[n] / soil.ratio[n] * elements)
        R_soil = max(R_soil, soil.drag[n] * elements)
        x_yield = max(x_yield, soil.ultimate[n] / soil.stiffness[n])
    return Bounds(elements, K_soil, R_soil, x_yield)


@exact_kernel
def bounds_of_layers(soil: SoilLayers) -> Bounds:
    """Bounds of a soil of layers; where the soil line has strength, it never yields there."""
    K_soil = R_soil = x_yield = 0.0
    low = 0.0
    for m in range(soil.to.size):
        high = soil.to[m]
        if low < high:
            K_soil, R_soil = max(K_soil, soil.K[m]), max(R_soil, soil.R[m])
            # (P_0 + P_1 r) / (K r) changes one way along a layer.
            for end in (max(low, LEAST_RATIO), high):
                x_yield = max(x_yield, (soil.P_0[m] / end + soil.P_1[m]) / soil.K[m])
        low = high
    return Bounds(0, K_soil, R_soil, x_yield)


def uniform_layers(design: Design) -> np.ndarray:
    """Return the soil of a design as the only one of its layers, shape (1, 6)."""
    slope = ultimate_pressure(1.0, design.phi, design.rho_s, 1.0)
    return np.array([[np.inf, design.rho_s, design.phi, design.beta, 0.0, slope]])
