"""Soils that are not the same at every depth: layers, water, cohesion (Eqs 105 to 108).

A layer has its own density, friction angle and subgrade reaction, and with them its own spring (Eqs 24, 25), wedge
(Eqs 1, 2) and drag (Eq 36). Its ultimate pressure is linear in the depth, p_0 + p_1 alpha, whatever law it comes from:
vertical stress grows linearly within a layer, above or below the water. Without layers, water and cohesion p_0 is 0 and
p_1 is the paper's K_p^2 rho_s g (Eq 27).

A displacement at which all of the soil yields does not exist then. The soil is either N elements with numbers of their
own, or the layers themselves, for which `boulder_kernels.layered_soil` is exact: arrays beside the constants of the
design or, in lanes, numbers; `boulder_kernels.soil_laws` chooses by their type.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_inlined, exact_kernel, through
from .design import (
    Constants,
    Design,
    DesignTable,
    Readings,
    SoilMass,
    body_of_box,
    constants_with,
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


class SoilSums(NamedTuple):
    """What is integrated over all layers once for a design; zero before the first."""

    S_1: float
    S_2: float
    S_3: float
    """Integrals of K r^i over r = 0 ... 1, i = 1, 2, 3 [N/m]."""
    L_1: float
    L_2: float
    L_3: float
    """Sums of K low^(i + 1) over the layers, i = 1, 2, 3 [N/m]."""
    U_0: float
    U_1: float
    """Sums of the integrals of P_0 + P_1 r, and of that times r, from r = 0 to the lower ends of the layers [N]."""
    Z_0: float
    Z_1: float
    Z_2: float
    Z_3: float
    """Sums of R (low^i + high^i) over the layers, i = 1 ... 4 [kg/m]."""


NO_SUMS = SoilSums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class SoilLayers(NamedTuple):
    """M layers of soil per ratio r = alpha/d of the depth, each down to its lower boundary; arrays of shape (M,).

    Spring, ultimate force and drag of a thin slice are K r, P_0 + P_1 r and R times its height over d.
    """

    to: np.ndarray
    """Lower boundary as a ratio of the depth, at most 1; 1 in the last layer [-]."""
    K: np.ndarray
    """Spring per ratio of the depth, squared [N/m] (Eqs 24, 25)."""
    inverse_K: np.ndarray
    """1/K [m/N]."""
    P_0: np.ndarray
    P_1: np.ndarray
    """Ultimate force per ratio of the depth [N] (Eqs 28, 105)."""
    R: np.ndarray
    """Drag over the velocity squared, per ratio of the depth [kg/m] (Eq 36)."""
    sums: np.ndarray
    """The fields of `SoilSums`, shape (12,)."""


class Layer(NamedTuple):
    """One layer of soil, with the fields of `SoilLayers`."""

    low: float
    """Upper boundary as a ratio of the depth [-]."""
    to: float
    K: float
    inverse_K: float
    P_0: float
    P_1: float
    R: float


class FewLayers(NamedTuple):
    """As many layers as its type says, number by number: the soil of a design in a lane."""

    sums: SoilSums
    layers: tuple[Layer, ...]


_record: Any = namedtuple
LayeredConstants = _record("LayeredConstants", (*Constants._fields, "soil"))
"""The fields of `Constants`, and ``soil``, its `SoilElements`, `SoilLayers` or `FewLayers`. Of the soil as a whole they
hold bounds: K_soil and R_soil are those of the stiffest and of the heaviest element all the way down, x_yield the last
displacement at which an element reaches its ultimate resistance."""
LayeredTable = _record("LayeredTable", (*DesignTable._fields, "layers"))
"""Many designs in soils of layers: the fields of `DesignTable`, and ``layers`` of shape (n, M, 6)."""
OutlinedTable = _record("OutlinedTable", (*LayeredTable._fields, "outlines"))
"""Many designs of boulders that are no boxes: the fields of `LayeredTable`, and ``outlines`` of shape (n, P, 4), see
`boulder_kernels.outlined`."""
LAYERED = (LayeredTable, OutlinedTable)
"""Tables that hold layers."""


class Bounds(NamedTuple):
    """Number of elements, and bounds of the soil as a whole, as of `LayeredConstants`."""

    elements: int
    K_soil: float
    R_soil: float
    x_yield: float


class Lumped(NamedTuple):
    """What follows from the soil of a design, or from its layers down to one of them."""

    mass: SoilMass
    """What the wedge of Eqs 1, 2 weighs."""
    bounds: Bounds
    sums: SoilSums
    """Of layers; zero for elements."""


@exact_inlined
def nothing_lumped() -> Lumped:
    """Return what follows from no layer."""
    return Lumped(SoilMass(0.0, 0.0, 0.0), Bounds(0, 0.0, 0.0, 0.0), NO_SUMS)


@exact_inlined
def in_layer(design: Design, density: float, friction: float, subgrade: float) -> Design:
    """Return a design in the soil of one layer; K_epsilon is that of the design."""
    p = design
    return Design(
        p.L,
        p.W,
        p.H,
        p.rho_b,
        p.d,
        p.e,
        density,
        friction,
        subgrade,
        p.K_epsilon,
        p.m_v,
        p.v_0,
        p.k_v,
        p.c_v,
        p.e_bumper,
    )


@exact_kernel
def fill_elements(design: Design, layers: np.ndarray, soil: SoilElements) -> Lumped:
    """Give N elements the values of the layers that their middles lie in (Eq 105), and return what follows from them.

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
    mass = first = second = K_soil = R_soil = x_yield = 0.0
    m = 0
    for n in range(1, elements + 1):
        alpha = element_depth(n, design.d, elements)
        while m < len(layers) - 1 and alpha >= layers[m, TO]:
            m += 1
        local = in_layer(design, layers[m, DENSITY], layers[m, FRICTION], layers[m, SUBGRADE])
        pressure = (layers[m, PRESSURE] + layers[m, PRESSURE_SLOPE] * alpha) * design.K_epsilon
        soil.ratio[n - 1] = alpha / design.d
        soil.stiffness[n - 1] = spring_per_depth(local) * alpha * h_e
        soil.ultimate[n - 1] = pressure * design.W * h_e
        soil.drag[n - 1] = local.rho_s * design.W * h_e
        m_n, height = element_mass(n, local, elements), design.d - alpha
        mass += m_n
        first += m_n * height
        second += m_n * height * height
        K_soil = max(K_soil, soil.stiffness[n - 1] / soil.ratio[n - 1] * elements)
        R_soil = max(R_soil, soil.drag[n - 1] * elements)
        x_yield = max(x_yield, soil.ultimate[n - 1] / soil.stiffness[n - 1])
    bounds = Bounds(elements, K_soil, R_soil, x_yield)
    return Lumped(SoilMass(mass, first, second), bounds, nothing_lumped().sums)


@exact_inlined
def layer_of(
    design: Design, low: float, to: float, density: float, friction: float, subgrade: float, p_0: float, p_1: float
) -> Layer:
    """Return one layer of the soil of a design (Eq 105).

    Parameters
    ----------
    design
        The design, SI.
    low, to
        Its boundaries as ratios of the depth.
    density, friction, subgrade, p_0, p_1
        A row of the layers of the design, see `PRESSURE_SLOPE`.
    """
    ultimate = design.K_epsilon * design.W * design.d
    spring = spring_per_depth(in_layer(design, density, friction, subgrade))
    drag = density * design.W * design.d
    K = spring * design.d * design.d
    return Layer(low, to, K, 1.0 / K, p_0 * ultimate, p_1 * design.d * ultimate, drag)


@exact_inlined
def lumped_with(so_far: Lumped, layer: Layer, density: float, friction: float, design: Design) -> Lumped:
    """Add a layer of given density [kg/m^3] and friction angle [rad] to what follows from those above it."""
    low, to, K, R = layer.low, layer.to, layer.K, layer.R
    # The wedge at a height over the base is that height times tan(theta_w) long.
    upper, lower = design.d * (1.0 - low), design.d * (1.0 - to)
    u_2, l_2 = upper * upper, lower * lower
    wedge = density * design.W * wedge_slope(friction)
    mass = SoilMass(
        so_far.mass.mass + wedge * (u_2 - l_2) / 2.0,
        so_far.mass.first + wedge * (u_2 * upper - l_2 * lower) / 3.0,
        so_far.mass.second + wedge * (u_2 * u_2 - l_2 * l_2) / 4.0,
    )
    low_2, to_2 = low * low, to * to
    low_3, to_3, low_4, to_4 = low_2 * low, to_2 * to, low_2 * low_2, to_2 * to_2
    s = so_far.sums
    sums = SoilSums(
        s.S_1 + K * (to_2 - low_2) / 2.0,
        s.S_2 + K * (to_3 - low_3) / 3.0,
        s.S_3 + K * (to_4 - low_4) / 4.0,
        s.L_1 + K * low_2,
        s.L_2 + K * low_3,
        s.L_3 + K * low_4,
        s.U_0 + (layer.P_0 * to + layer.P_1 * to_2 / 2.0),
        s.U_1 + (layer.P_0 * to_2 / 2.0 + layer.P_1 * to_3 / 3.0),
        s.Z_0 + R * (low + to),
        s.Z_1 + R * (low_2 + to_2),
        s.Z_2 + R * (low_3 + to_3),
        s.Z_3 + R * (low_4 + to_4),
    )
    # (P_0 + P_1 r) / (K r) changes one way along a layer; where the soil line has strength, it never yields there.
    first = (layer.P_0 / max(low, LEAST_RATIO) + layer.P_1) / K
    last = (layer.P_0 / max(to, LEAST_RATIO) + layer.P_1) / K
    within = low < to
    bounds = Bounds(
        0,
        max(so_far.bounds.K_soil, K if within else 0.0),
        max(so_far.bounds.R_soil, R if within else 0.0),
        max(so_far.bounds.x_yield, max(first, last) if within else 0.0),
    )
    return Lumped(mass, bounds, sums)


@exact_kernel
def fill_layers(design: Design, layers: np.ndarray, soil: SoilLayers) -> Lumped:
    """Give M layers their values (Eq 105), and return what follows from them.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of its soil are those of the layers.
    layers
        Layers of its soil, shape (M, 6).
    soil
        Layers to fill.
    """
    so_far = nothing_lumped()
    low = 0.0
    for m in range(len(layers)):
        to = min(layers[m, TO] / design.d, 1.0) if m < len(layers) - 1 else 1.0
        density, friction, subgrade = layers[m, DENSITY], layers[m, FRICTION], layers[m, SUBGRADE]
        layer = layer_of(design, low, to, density, friction, subgrade, layers[m, PRESSURE], layers[m, PRESSURE_SLOPE])
        soil.to[m], soil.K[m], soil.inverse_K[m], soil.R[m] = to, layer.K, layer.inverse_K, layer.R
        soil.P_0[m], soil.P_1[m] = layer.P_0, layer.P_1
        so_far = lumped_with(so_far, layer, density, friction, design)
        low = to
    s = so_far.sums
    soil.sums[0], soil.sums[1], soil.sums[2] = s.S_1, s.S_2, s.S_3
    soil.sums[3], soil.sums[4], soil.sums[5] = s.L_1, s.L_2, s.L_3
    soil.sums[6], soil.sums[7] = s.U_0, s.U_1
    soil.sums[8], soil.sums[9], soil.sums[10], soil.sums[11] = s.Z_0, s.Z_1, s.Z_2, s.Z_3
    return so_far


class GivenLayer(NamedTuple):
    """One layer of the soil of a design, a row of its layers; see `PRESSURE_SLOPE`."""

    to: float
    density: float
    friction: float
    subgrade: float
    p_0: float
    p_1: float


COUNTS = (1, 2, 4, 8)
"""Numbers of layers for which lanes are compiled; another number is filled up by layers without height."""


def lanes_count(layers: int) -> int:
    """Return the number of layers that lanes are compiled for, at least as many as given; 0 if there are too many."""
    return next((count for count in COUNTS if count >= layers), 0)


def filled_layers(layers: np.ndarray, count: int) -> np.ndarray:
    """Return layers of designs, shape (n, M, 6), as rows of a table for lanes, shape (6 count, n).

    The last layer is repeated without height.
    """
    missing = count - layers.shape[1]
    filled = np.concatenate([layers, np.repeat(layers[:, -1:], missing, axis=1)], axis=1)
    return np.ascontiguousarray(filled.reshape(len(layers), count * len(GivenLayer._fields)).T)


@exact_inlined
def with_record(c: Constants, soil: Any) -> Any:
    """Return constants together with the record of their soil."""
    return LayeredConstants(
        c.m_eff,
        c.J_eff,
        c.inverse_m_eff,
        c.inverse_J_eff,
        c.c_x,
        c.c_y,
        c.l_n,
        c.z_0,
        c.d,
        c.elements,
        c.K_soil,
        c.R_soil,
        c.x_yield,
        c.h,
        c.g_x,
        c.k_v,
        c.k_m,
        c.tau_v,
        c.v_0,
        c.C_cos,
        c.C_sin,
        c.d_N,
        c.theta_corner,
        soil,
    )


@exact_inlined
def add_given(met: Any, design: Design, given: GivenLayer) -> Any:
    """Work out a layer below others: what follows from them, their lower end, and they."""
    so_far, low, above = met
    to = min(given.to / design.d, 1.0)
    layer = layer_of(design, low, to, given.density, given.friction, given.subgrade, given.p_0, given.p_1)
    return lumped_with(so_far, layer, given.density, given.friction, design), to, (*above, layer)


add_all_given = through(add_given)


@exact_inlined
def constants_of_few(design: Design, readings: Readings, given: tuple[GivenLayer, ...]) -> Any:
    """Return the constants of a design in as many layers as given, the last of them down without end."""
    so_far, _, layers = add_all_given((nothing_lumped(), 0.0, ()), design, given)
    b = so_far.bounds
    c = constants_with(design, body_of_box(design), readings, 0, so_far.mass, b.K_soil, b.R_soil, b.x_yield)
    return with_record(c, FewLayers(so_far.sums, layers))


def uniform_layers(design: Design) -> np.ndarray:
    """Return the soil of a design as the only one of its layers, shape (1, 6)."""
    slope = ultimate_pressure(1.0, design.phi, design.rho_s, 1.0)
    return np.array([[np.inf, design.rho_s, design.phi, design.beta, 0.0, slope]])
