"""Reaction of soils that are not the same at every depth: sums over elements, and their limit, exact layer by layer.

Displacement and velocity are linear in the depth, as in `boulder_kernels.soil`, and so is the ultimate pressure of a
layer. Its springs are then quadratic in the depth. The boulder presses the soil one way above a depth, the pivot, and
the other way below it. On either side the springs of a layer pass their ultimate force at no more than two depths, the
roots of a polynomial; the drag turns at one; and between these nothing but polynomials is to be integrated.

What is integrated over all of a layer is known before (`boulder_kernels.layered.SoilSums`), so that only what changes
is worked out at a state: without a branch, and for few layers without a loop, as loops over lanes need it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, overload, through
from .layered import FewLayers, Layer, SoilElements, SoilLayers, SoilSums
from .numerics import WIDTH, add, field, partial_sums, total
from .soil import TINY, Kinematics, Potential, Reaction


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
    return Potential(V, V_A, V_X, V)


@kernel
def power_of_elements(k: Kinematics, soil: SoilElements) -> float:
    """Power that the drag of elements with values of their own takes out of the motion [W]."""
    total = 0.0
    for n in range(soil.ratio.size):
        total += soil.drag[n] * abs(k.B - k.slope_v * soil.ratio[n]) ** 3
    return total


class Line(NamedTuple):
    """Displacement and velocity along the depth, and where they change their signs."""

    S: float
    """Decrease of displacement over the depth, made positive [m]."""
    inverse_S: float
    """1/S [1/m]."""
    alpha: float
    """Displacement at the soil line, turned with it [m]."""
    pivot: float
    """Ratio of the depth at which the boulder does not press: above it alpha - S r is positive, below it negative."""
    turn: float
    """Ratio of the depth at which the velocity changes its sign."""


@inlined
def line_of(A: float, slope_x: float, B: float, slope_v: float) -> Line:
    """Return the lines of displacement and velocity, of `boulder_kernels.soil.Kinematics`."""
    S, P = max(abs(slope_x), TINY), max(abs(slope_v), TINY)
    inverse = 1.0 / (S * P)  # one division for both
    inverse_S, alpha = inverse * P, (A if slope_x >= 0.0 else -A)
    return Line(S, inverse_S, alpha, alpha * inverse_S, (B if slope_v >= 0.0 else -B) * (inverse * S))


@inlined
def side_of(slope: float) -> float:
    """Return the sign of a slope; that of zero is positive, whatever sign zero has."""
    return 1.0 if slope >= 0.0 else -1.0


class Walk(NamedTuple):
    """What has been met on the way down through the layers; the sums are over the layers, i = 1, 2 ... 4."""

    between: float
    """Integral of the difference of K r |x| and the ultimate force over where it changes sign within the layers: less
    above the pivot, more below [N]."""
    between_r: float
    """The same times r [N]."""
    energy: float
    """What the springs hold less than if the soil did not yield [J]."""
    least_energy: float
    """Lower bound of that, without a logarithm [J]."""
    E_1: float
    E_2: float
    E_3: float
    """Sums of K r^(i + 1) at the pivot, or at the end of a layer next to it."""
    F_1: float
    F_2: float
    G_2: float
    G_3: float
    """Sums of P_0 r^i and of P_1 r^i there."""
    D_0: float
    D_1: float
    D_2: float
    D_3: float
    """Sums of R r^i at where the velocity changes its sign, or at the end of a layer next to it."""
    start: float
    split: Layer
    """The layer with the pivot inside, from there on; one without height as long as there is none."""


class Released(NamedTuple):
    """What the springs of a part of a layer hold less for its yielding [J], and a bound from below."""

    energy: float
    least: float


@inlined
def released(low: float, high: float, n: float, KS: float, eP: float, layer: Layer) -> Released:
    """Half the integral of the square of the excess over K r, where the soil yields; arguments: see `add_part`.

    The last term is that of P_0^2/r. Differences of powers at the two ends have their difference as a factor.
    """
    length, both, product = high - low, low + high, low * high
    squares, cubes = both * both - product, both * (both * both - 2.0 * product)
    powers = 0.25 * KS * KS * cubes - (2.0 / 3.0) * n * KS * squares + (0.5 * n * n + KS * eP) * both - 2.0 * n * eP
    P_2, share = layer.P_0 * layer.P_0, 0.5 * layer.inverse_K
    logarithm = math.log(max(high, TINY) / max(low, TINY))
    least = share * length * (powers + P_2 * (2.0 / max(both, TINY)))
    return Released(share * (length * powers + P_2 * logarithm), least)


@inlined
def add_part(w: Walk, line: Line, above: bool, low: float, high: float, layer: Layer) -> Walk:
    """Add what a part of a layer presses less than its base (for Eq 108).

    Parameters
    ----------
    w
        What has been met above it.
    line
        Displacement along the depth.
    above
        Whether the part lies above the pivot, or else below.
    low, high
        Its ends as ratios of the depth.
    layer
        The layer.

    Notes
    -----
    With x = e (alpha - S r), e = 1 above the pivot and -1 below, the excess K r x - P_0 - P_1 r is -e times the
    polynomial K S r^2 - n r + e P_0, where n = K alpha - e P_1. Above the pivot the base is what springs without a
    limit would press, and the soil yields between the roots; below, the base is the ultimate force, and the soil is
    elastic between the roots.
    """
    K, KS = layer.K, layer.K * line.S
    eP = layer.P_0 if above else -layer.P_0
    n = K * line.alpha - (layer.P_1 if above else -layer.P_1)
    half = 0.5 * n
    squared = half * half - KS * eP
    T = half + math.copysign(np.sqrt(max(squared, 0.0)) + TINY, n)
    one, other = T * (layer.inverse_K * line.inverse_S), eP / T
    a = min(max(min(one, other), low), high)
    b = min(max(max(one, other), low), high)
    b = b if squared >= 0.0 else a
    both, product = a + b, a * b
    square = both * both
    third, fourth = (1.0 / 3.0) * (square - product), 0.25 * both * (square - 2.0 * product)
    length = a - b if above else b - a
    between = half * both - KS * third - eP
    between_r = n * third - KS * fourth - eP * (0.5 * both)
    first = released(a if above else low, b if above else a, n, KS, eP, layer)
    last = released(b, b if above else high, n, KS, eP, layer)
    return Walk(
        w.between + length * between,
        w.between_r + length * between_r,
        w.energy + (first.energy + last.energy),
        w.least_energy + (first.least + last.least),
        w.E_1,
        w.E_2,
        w.E_3,
        w.F_1,
        w.F_2,
        w.G_2,
        w.G_3,
        w.D_0,
        w.D_1,
        w.D_2,
        w.D_3,
        w.start,
        w.split,
    )


@inlined
def start_walk() -> Walk:
    """Return what has been met before the first layer."""
    none = Layer(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    return Walk(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, none)


@inlined
def pass_layer(w: Walk, line: Line, layer: Layer) -> Walk:
    """Add a layer to what has been met; the part below the pivot of the layer that it lies in is left for the end."""
    K, P_0, P_1, R = layer.K, layer.P_0, layer.P_1, layer.R
    pivot = min(max(line.pivot, layer.low), layer.to)
    above = line.alpha > line.S * layer.low  # known before the pivot is
    split = above & (line.alpha < line.S * layer.to)
    turn = min(max(line.turn, layer.low), layer.to)
    pivot_2, turn_2 = pivot * pivot, turn * turn
    pivot_3 = pivot_2 * pivot
    rest = Layer(
        0.0,
        layer.to if split else w.split.to,
        K if split else w.split.K,
        layer.inverse_K if split else w.split.inverse_K,
        P_0 if split else w.split.P_0,
        P_1 if split else w.split.P_1,
        0.0,
    )
    w = add_part(w, line, above, layer.low, pivot if above else layer.to, layer)
    return Walk(
        w.between,
        w.between_r,
        w.energy,
        w.least_energy,
        w.E_1 + K * pivot_2,
        w.E_2 + K * pivot_3,
        w.E_3 + K * (pivot_2 * pivot_2),
        w.F_1 + P_0 * pivot,
        w.F_2 + P_0 * pivot_2,
        w.G_2 + P_1 * pivot_2,
        w.G_3 + P_1 * pivot_3,
        w.D_0 + R * turn,
        w.D_1 + R * turn_2,
        w.D_2 + R * (turn_2 * turn),
        w.D_3 + R * (turn_2 * turn_2),
        pivot if split else w.start,
        rest,
    )


@inlined
def end_walk(w: Walk, line: Line) -> Walk:
    """Add what was left of the layer that the pivot lies in."""
    return add_part(w, line, False, w.start, w.split.to, w.split)


def walk_through(line: Line, soil: Any) -> Walk:
    """Return what is met on the way down through all layers, `SoilLayers` or `FewLayers`."""
    if isinstance(soil, FewLayers):
        return end_walk(pass_layers(start_walk(), line, soil.layers), line)
    return _walk_by_arrays(line, soil)


pass_layers = through(pass_layer)


@overload(walk_through)
def _walk_through(line: Any, soil: Any) -> Callable[..., Walk]:
    if soil.instance_class is FewLayers:
        return lambda line, soil: end_walk(pass_layers(start_walk(), line, soil.layers), line)
    return _walk_by_arrays


def _walk_by_arrays(line: Line, soil: SoilLayers) -> Walk:
    w = start_walk()
    low = 0.0
    for m in range(soil.to.size):
        layer = Layer(low, soil.to[m], soil.K[m], soil.inverse_K[m], soil.P_0[m], soil.P_1[m], soil.R[m])
        w = pass_layer(w, line, layer)
        low = soil.to[m]
    return end_walk(w, line)


def sums_of(soil: Any) -> SoilSums:
    """Return the sums of layers."""
    return soil.sums if isinstance(soil, FewLayers) else SoilSums(*soil.sums)


@overload(sums_of)
def _sums_of(soil: Any) -> Callable[..., SoilSums]:
    if soil.instance_class is FewLayers:
        return lambda soil: soil.sums
    return _sums_from_array


def _sums_from_array(soil: SoilLayers) -> SoilSums:
    s = soil.sums
    return SoilSums(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])


class Turned(NamedTuple):
    """Integrals of R r^i over the depth, i = 0 ... 3, whose sign changes with that of the velocity [kg/m]."""

    N_0: float
    N_1: float
    N_2: float
    N_3: float


@inlined
def turned(w: Walk, sums: SoilSums) -> Turned:
    """Return the integrals with the sign that the velocity has at the soil line, if it changes it further down."""
    return Turned(
        2.0 * w.D_0 - sums.Z_0,
        0.5 * (2.0 * w.D_1 - sums.Z_1),
        (1.0 / 3.0) * (2.0 * w.D_2 - sums.Z_2),
        0.25 * (2.0 * w.D_3 - sums.Z_3),
    )


class Pressed(NamedTuple):
    """What the springs press [N], and the same times r [N]."""

    force: float
    moment: float


@inlined
def pressed_by(w: Walk, line: Line, sums: SoilSums, slope_x: float) -> Pressed:
    """Put together what the springs press (Eq 108): above the pivot as if without limit, below it the ultimate force.

    Both less what was met on the way.
    """
    E_1, E_2, E_3 = 0.5 * (w.E_1 - sums.L_1), (1.0 / 3.0) * (w.E_2 - sums.L_2), 0.25 * (w.E_3 - sums.L_3)
    side = side_of(slope_x)
    less_0 = w.F_1 + 0.5 * w.G_2 - sums.U_0
    less_1 = 0.5 * w.F_2 + (1.0 / 3.0) * w.G_3 - sums.U_1
    force = line.alpha * E_1 - line.S * E_2 + less_0 + w.between
    moment = line.alpha * E_2 - line.S * E_3 + less_1 + w.between_r
    return Pressed(side * force, side * moment)


@inlined
def reaction_of_layers(k: Kinematics, soil: Any) -> Reaction:
    """Force and moment of layers, integrated over the depth exactly (Eq 108, the limit of Eqs 19, 20, 26, 28, 36).

    The drag is v|v| integrated up to where v changes its sign, and from there on.
    """
    line, sums = line_of(k.A, k.slope_x, k.B, k.slope_v), sums_of(soil)
    w = walk_through(line, soil)
    springs = pressed_by(w, line, sums, k.slope_x)
    n, B, p = turned(w, sums), k.B, k.slope_v
    BB, Bp, pp = B * B, 2.0 * (B * p), p * p
    drag = side_of(p)
    pressed = springs.force + drag * (BB * n.N_0 - Bp * n.N_1 + pp * n.N_2)
    pressed_r = springs.moment + drag * (BB * n.N_1 - Bp * n.N_2 + pp * n.N_3)
    return Reaction(-pressed, k.lever_d * pressed_r + k.q * pressed)


@inlined
def potential_of_layers(A: float, slope_x: float, soil: Any) -> Potential:
    """Elastic energy of layers and its slopes, exactly (Eq 108); see `boulder_kernels.soil.closed_potential`.

    A slice that presses K r x - P too much, were it not limited, holds (K r x - P)^2/(2 K r) too much.
    """
    line, sums = line_of(A, slope_x, 0.0, 0.0), sums_of(soil)
    w = walk_through(line, soil)
    springs = pressed_by(w, line, sums, slope_x)
    V = 0.5 * (A * (A * sums.S_1 - slope_x * sums.S_2) - slope_x * (A * sums.S_2 - slope_x * sums.S_3))
    return Potential(V - w.energy, springs.force, -springs.moment, V - w.least_energy)


@inlined
def power_of_layers(k: Kinematics, soil: Any) -> float:
    """Power that the drag of layers takes out of the motion [W], integrated exactly (Eqs 34-36)."""
    line, sums = line_of(k.A, k.slope_x, k.B, k.slope_v), sums_of(soil)
    n, B, p = turned(walk_through(line, soil), sums), k.B, k.slope_v
    return side_of(p) * (B**3 * n.N_0 - 3.0 * B * p * (B * n.N_1 - p * n.N_2) - p**3 * n.N_3)
