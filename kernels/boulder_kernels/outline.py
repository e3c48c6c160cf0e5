"""Boulders that are no boxes: their outline, and what it makes of them as rigid bodies (Eqs 141 to 144).

**The outline** gives width and length over the height, piecewise linear. At a height z over the foot the boulder is
w(z) wide, and reaches near(z) towards the vehicle and far(z) away from it, counted from the middle of its foot. Volume,
centre and moment of inertia are integrals of polynomials over the pieces between the points of the outline. Gauss's
rule of three points is exact up to the fifth degree, which none of them exceeds. A box has an outline without points.
"""

from __future__ import annotations

import math

import numpy as np

from ._jit import exact_inlined, exact_kernel
from .design import Body, Design, body_of_box

HEIGHT, WIDTH, NEAR, FAR = range(4)
"""Columns of an outline, shape (P, 4), from the foot to the top: height over the foot, ascending from 0 to H, width,
and reach towards the vehicle and away from it [m]. Between its points it is linear."""

NODES = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss's rule of three points on 0 ... 1."""


@exact_inlined
def piece_at(outline: np.ndarray, z: float) -> int:
    """Return the number of the piece of an outline that a height [m] lies in, at a point of the outline the lower."""
    i = 0
    while i < len(outline) - 2 and outline[i + 1, HEIGHT] < z:
        i += 1
    return i


@exact_inlined
def slope_of(outline: np.ndarray, i: int, column: int) -> float:
    """Return by how much a column of an outline grows with the height on its piece i [-]."""
    return (outline[i + 1, column] - outline[i, column]) / (outline[i + 1, HEIGHT] - outline[i, HEIGHT])


@exact_inlined
def on_piece(outline: np.ndarray, i: int, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m] on its piece i [m]."""
    return outline[i, column] + slope_of(outline, i, column) * (z - outline[i, HEIGHT])


@exact_inlined
def at_height(outline: np.ndarray, column: int, z: float) -> float:
    """Return a column of an outline at a height z [m]; beyond its top that at the top [m]."""
    z = min(z, outline[-1, HEIGHT])
    return on_piece(outline, piece_at(outline, z), column, z)


@exact_kernel
def body_of_outline(design: Design, outline: np.ndarray) -> Body:
    """Mass, centre, moment of inertia and reach of a boulder with an outline (Eqs 141 to 144).

    Parameters
    ----------
    design
        The design, SI; its density is the mass over the volume within the outline.
    outline
        The outline, shape (P, 4).
    """
    d = design.d
    volume = x = z_c = xx = zz = line = 0.0
    for i in range(len(outline) - 1):
        low, high = outline[i, HEIGHT], outline[i + 1, HEIGHT]
        buried = min(high, d)
        for g in range(3):
            z = low + NODES[g] * (high - low)
            w, near, far = (on_piece(outline, i, WIDTH, z), on_piece(outline, i, NEAR, z), on_piece(outline, i, FAR, z))
            slice_ = WEIGHTS[g] * (high - low) * w
            area = slice_ * (near + far)
            volume += area
            z_c += area * z
            zz += area * z * z
            x += slice_ * 0.5 * (far * far - near * near)
            xx += slice_ * (far * far * far + near * near * near) / 3.0
            if low < buried:
                z = low + NODES[g] * (buried - low)
                line += WEIGHTS[g] * (buried - low) * (d - z) * on_piece(outline, i, FAR, z)
    x, z_c, line = x / volume, z_c / volume, line / (0.5 * d * d)
    m_b = design.rho_b * volume
    J = design.rho_b * (xx + zz) - m_b * (x * x + z_c * z_c)
    struck = at_height(outline, NEAR, d + design.e)
    foot_near, foot_far = outline[0, NEAR], outline[0, FAR]
    half = 0.5 * (foot_near + foot_far)
    return Body(m_b, J, struck + x, z_c, struck + line, half, 0.5 * (foot_far - foot_near) - x)


@exact_kernel
def body_with(design: Design, outline: np.ndarray) -> Body:
    """Return the boulder with an outline, shape (P, 4), or the box of the design where it has no points."""
    return body_of_outline(design, outline) if len(outline) > 0 else body_of_box(design)
