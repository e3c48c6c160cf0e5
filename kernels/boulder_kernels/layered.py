"""Soils that are not the same at every depth: layers, water, cohesion (Eqs 105 to 107).

A layer has its own density, friction angle and subgrade reaction, and with them its own spring (Eqs 24, 25), wedge
(Eqs 1, 2) and drag (Eq 36). Its ultimate pressure is linear in the depth, p_0 + p_1 alpha, whatever law it comes from:
vertical stress grows linearly within a layer, above or below the water. Without layers, water and cohesion p_0 is 0 and
p_1 is the paper's K_p^2 rho_s g (Eq 27).

A displacement at which all of the soil yields does not exist then. The soil is N elements with numbers of their own,
in arrays beside the constants of the design; `boulder_kernels.soil` chooses by their type.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from ._jit import array_kernel, exact_kernel, function_of
from .design import (
    Constants,
    Design,
    SoilMass,
    constants_with,
    element_depth,
    element_mass,
    spring_per_depth,
    ultimate_pressure,
)
from .readings import Readings

TO, DENSITY, FRICTION, SUBGRADE, PRESSURE, PRESSURE_SLOPE = range(6)
"""Columns of the layers of a design, shape (M, 6), from the top down: depth of the lower boundary [m], density that has
inertia [kg/m^3], friction angle [rad], constant of subgrade reaction [MN/m^3], and ultimate pressure p_0 + p_1 alpha
without the effect of the strain rate [Pa], [Pa/m]. The last layer reaches down without end."""


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


_record: Any = namedtuple
LayeredConstants = _record("LayeredConstants", (*Constants._fields, "soil"))
"""The fields of `Constants`, and ``soil``, the `SoilElements`. Of the soil as a whole they hold bounds: K_soil and
R_soil are those of the stiffest and of the heaviest element all the way down, x_yield the last displacement at which
an element reaches its ultimate resistance."""


def layered(c: Constants, soil: SoilElements) -> Any:
    """Return constants together with the elements of their soil."""
    return LayeredConstants(*c, soil)


@overload(layered, inline="always", strict=False)
def _layered(c: Any, soil: Any) -> Callable[..., Any]:
    values = ", ".join(f"c.{name}" for name in Constants._fields)
    return function_of(f"def layered(c, soil):\n return Record({values}, soil)", Record=LayeredConstants)


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
    """Give N elements the values of the layers that their middles lie in, and return what they weigh.

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


@array_kernel
def layered_constants(design: Design, layers: np.ndarray, readings: Readings, elements: int) -> Any:
    """Constants of the motion of one design in a soil of layers, as N elements.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of its soil are those of the layers.
    layers
        Layers of its soil, shape (M, 6).
    readings
        Which formulas are read as printed.
    elements
        Number N of soil elements; positive.

    Returns
    -------
    LayeredConstants
        Non-finite or non-positive where the design is impossible, as of `boulder_kernels.design.is_computable`.
    """
    soil = SoilElements(np.empty(elements), np.empty(elements), np.empty(elements), np.empty(elements))
    mass = fill_elements(design, layers, soil)
    K_soil = R_soil = x_yield = 0.0
    for n in range(elements):
        K_soil = max(K_soil, soil.stiffness[n] / soil.ratio[n] * elements)
        R_soil = max(R_soil, soil.drag[n] * elements)
        x_yield = max(x_yield, soil.ultimate[n] / soil.stiffness[n])
    return layered(constants_with(design, readings, elements, mass, K_soil, R_soil, x_yield), soil)


@array_kernel
def uniform_layers(design: Design) -> np.ndarray:
    """Return the soil of a design as the only one of its layers, shape (1, 6)."""
    slope = ultimate_pressure(1.0, design.phi, design.rho_s, 1.0)
    return np.array([[np.inf, design.rho_s, design.phi, design.beta, 0.0, slope]])
