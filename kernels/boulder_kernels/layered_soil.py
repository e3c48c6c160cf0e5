"""Reaction of soils that are not the same at every depth: sums over elements, and their limit, exact layer by layer.

Displacement and velocity are linear in the depth, as in `boulder_kernels.soil`, and so is the ultimate pressure of a
layer. Its springs are then quadratic in the depth; they pass their ultimate force at no more than four depths, the
drag turns at one, and between these nothing but polynomials is to be integrated.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import inlined, kernel
from .flat import WIDTH, add, field, partial_sums, total
from .layered import SoilElements, SoilLayers
from .soil import TINY, Kinematics, Potential, Reaction

GAUSS = 1.0 / math.sqrt(3.0)
"""Nodes of the two-point Gauss rule are plus and minus this, its weights 1."""


@inlined
def add_element(sums: np.ndarray, j: int, first: int, k: Kinematics, soil: SoilElements) -> None:
    """Add force and moment of element first + j to the partial sums j."""
    ratio, ultimate = field(soil.ratio, first, j), field(soil.ultimate, first, j)
    spring = field(soil.stiffness, first, j) * (k.A - k.slope_x * ratio)
    v = k.B - k.slope_v * ratio
    pressed = min(max(spring, -ultimate), ultimate) + field(soil.drag, first, j) * v * abs(v)
    add(sums, j, -pressed, pressed * (k.lever_d * ratio + k.q))


@kernel
def reaction_of_elements(k: Kinematics, soil: SoilElements) -> Reaction:
    """Sum force and moment over elements with values of their own (Eqs 19-21, 26, 28, 36)."""
    sums = partial_sums()
    whole = soil.ratio.size - soil.ratio.size % WIDTH
    for first in range(0, whole, WIDTH):
        for j in range(WIDTH):
            add_element(sums, j, first, k, soil)
    for j in range(soil.ratio.size - whole):
        add_element(sums, j, whole, k, soil)
    return Reaction(total(sums, 0), total(sums, WIDTH))


@kernel
def potential_of_elements(A: float, slope_x: float, soil: SoilElements) -> Potential:
    """Elastic energy of elements with values of their own, as convex as that of each."""
    V = V_A = V_X = 0.0
    for n in range(soil.ratio.size):
        ratio = soil.ratio[n]
        displacement = A - slope_x * ratio
        stiffness, ultimate = soil.stiffness[n], soil.ultimate[n]
        over = max(abs(displacement) - ultimate / stiffness, 0.0)
        pressed = min(max(stiffness * displacement, -ultimate), ultimate)
        V += 0.5 * stiffness * (displacement * displacement - over * over)
        V_A += pressed
        V_X -= ratio * pressed
    return Potential(V, V_A, V_X)


@kernel
def power_of_elements(k: Kinematics, soil: SoilElements) -> float:
    """Power that the drag of elements with values of their own takes out of the motion [W]."""
    total = 0.0
    for n in range(soil.ratio.size):
        total += soil.drag[n] * abs(k.B - k.slope_v * soil.ratio[n]) ** 3
    return total


class Breaks(NamedTuple):
    """Where the springs of a layer change between elastic and ultimate, as ascending ratios of the depth."""

    r_1: float
    r_2: float
    r_3: float
    r_4: float


@inlined
def roots_within(a: float, b: float, c: float, low: float, high: float) -> tuple[float, float]:
    """Roots of a r^2 + b r + c, moved to the nearer end where they lie outside low ... high; low twice for none."""
    squared = b * b - 4.0 * a * c
    if not squared >= 0.0:
        return low, low
    q = -0.5 * (b + math.copysign(math.sqrt(squared), b))
    q = math.copysign(max(abs(q), TINY), q)
    a = math.copysign(max(abs(a), TINY), a)
    return min(max(q / a, low), high), min(max(c / q, low), high)


@kernel
def layer_breaks(A: float, s: float, K: float, P_0: float, P_1: float, low: float, high: float) -> Breaks:
    """Return where K r (A - s r) passes P_0 + P_1 r or its negative between two ratios of the depth (for Eq 108).

    Parameters
    ----------
    A, s
        Displacement at the soil line, and its decrease over the whole depth [m].
    K, P_0, P_1
        Spring [N/m] and ultimate force [N] of the layer, as of `SoilLayers`.
    low, high
        Ends of the layer as ratios of the depth.
    """
    a, b = roots_within(K * s, P_1 - K * A, P_0, low, high)
    c, e = roots_within(K * s, -P_1 - K * A, -P_0, low, high)
    a, b, c, e = min(a, b), max(a, b), min(c, e), max(c, e)
    middle, other = max(a, c), min(b, e)
    return Breaks(min(a, c), min(middle, other), max(middle, other), max(b, e))


@inlined
def layer_pressed(r: float, A: float, s: float, K: float, P_0: float, P_1: float) -> float:
    """Force of the springs at a ratio of the depth, per ratio [N] (Eqs 26, 28)."""
    ultimate = P_0 + P_1 * r
    return min(max(K * r * (A - s * r), -ultimate), ultimate)


@kernel
def reaction_of_layers(k: Kinematics, soil: SoilLayers) -> Reaction:
    """Force and moment of layers, integrated over the depth exactly (Eq 108, the limit of Eqs 19, 20, 26, 28, 36).

    Between two break points all integrands are polynomials of at most third order, for which two points of Gauss are
    exact.
    """
    pressed = pressed_r = 0.0
    p = math.copysign(max(abs(k.slope_v), TINY), k.slope_v)
    low = 0.0
    for m in range(soil.to.size):
        high, K, P_0, P_1, R = soil.to[m], soil.K[m], soil.P_0[m], soil.P_1[m], soil.R[m]
        breaks = layer_breaks(k.A, k.slope_x, K, P_0, P_1, low, high)
        start = low
        for end in (breaks.r_1, breaks.r_2, breaks.r_3, breaks.r_4, high):
            middle, half = 0.5 * (start + end), 0.5 * (end - start)
            for side in (-GAUSS, GAUSS):
                r = middle + side * half
                spring = half * layer_pressed(r, k.A, k.slope_x, K, P_0, P_1)
                pressed += spring
                pressed_r += r * spring
            start = end
        start = low
        for end in (min(max(k.B / p, low), high), high):
            middle, half = 0.5 * (start + end), 0.5 * (end - start)
            for side in (-GAUSS, GAUSS):
                r = middle + side * half
                v = k.B - k.slope_v * r
                drag = half * R * v * abs(v)
                pressed += drag
                pressed_r += r * drag
            start = end
        low = high
    return Reaction(-pressed, k.lever_d * pressed_r + k.q * pressed)


@kernel
def potential_of_layers(A: float, slope_x: float, soil: SoilLayers) -> Potential:
    """Elastic energy of layers and its slopes, exactly (Eq 108); see `boulder_kernels.soil.closed_potential`.

    A slice that has reached its ultimate force P holds P |u| - P^2/(2 K r); the integral of the second term is that of
    (P_0 + P_1 r)^2/r.
    """
    V = V_A = V_X = 0.0
    low = 0.0
    for m in range(soil.to.size):
        high, K, P_0, P_1 = soil.to[m], soil.K[m], soil.P_0[m], soil.P_1[m]
        breaks = layer_breaks(A, slope_x, K, P_0, P_1, low, high)
        start = low
        for end in (breaks.r_1, breaks.r_2, breaks.r_3, breaks.r_4, high):
            middle, half = 0.5 * (start + end), 0.5 * (end - start)
            within = abs(K * middle * (A - slope_x * middle)) <= P_0 + P_1 * middle
            for side in (-GAUSS, GAUSS):
                r = middle + side * half
                displacement = A - slope_x * r
                spring = half * layer_pressed(r, A, slope_x, K, P_0, P_1)
                V += (0.5 if within else 1.0) * spring * displacement
                V_A += spring
                V_X -= r * spring
            if not within and end > start:
                stored = P_1 * (2.0 * P_0 + P_1 * middle) * 2.0 * half
                if P_0 != 0.0:
                    stored += P_0 * P_0 * math.log(end / max(start, TINY))
                V -= 0.5 / K * stored
            start = end
        low = high
    return Potential(V, V_A, V_X)


@kernel
def power_of_layers(k: Kinematics, soil: SoilLayers) -> float:
    """Power that the drag of layers takes out of the motion [W], integrated exactly (Eqs 34-36)."""
    total = 0.0
    p = math.copysign(max(abs(k.slope_v), TINY), k.slope_v)
    low = 0.0
    for m in range(soil.to.size):
        high = soil.to[m]
        start = low
        for end in (min(max(k.B / p, low), high), high):
            middle, half = 0.5 * (start + end), 0.5 * (end - start)
            for side in (-GAUSS, GAUSS):
                total += half * soil.R[m] * abs(k.B - k.slope_v * (middle + side * half)) ** 3
            start = end
        low = high
    return total
