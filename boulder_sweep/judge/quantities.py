"""What a design takes to build: mass of the boulder, its height above ground, soil to excavate and to put back.

The model relies on soil of the given density and friction angle on both sides of the boulder, since its springs act
both ways: as far as the wedge that moves with it, d tan(pi/4 + phi/2) at the surface (Eq 1), or the wedge that is
compressed, d / tan(phi) (Eq 25), whichever is longer. Both taper to nothing at the foot of the boulder, so the trench
has a volume of ``W d (L + d t)``, with t the larger of both slopes.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from boulder_sweep import elementary
from boulder_sweep.columns import BOULDER_MASS, TO_BUILD, ColumnSpec
from boulder_sweep.settings.model import BOX, Ground, Shape

MASS = ColumnSpec(BOULDER_MASS, "kg", "mass of the boulder, its volume times its density")
ABOVE, EXCAVATED, BACKFILLED = TO_BUILD
QUANTITIES = (MASS, *TO_BUILD)
NEEDED = (
    *("boulder_length_m", "boulder_width_m", "boulder_height_m", "boulder_density_kg_m3"),
    *("embedment_depth_m", "friction_angle_deg"),
)
"""Columns that they follow from."""


def quantities(rows: Mapping[str, Any], shape: Shape, ground: Ground) -> dict[str, np.ndarray]:
    """Return the quantities of n designs by the names of `QUANTITIES`, shape (n,) each.

    The rows are values of the columns `NEEDED`, and of ``boulder_mass_kg`` where the boulders are weighed, in the units
    of the table: numbers, or arrays that broadcast against each other. Of all layers above the base, the wedge follows
    the one that makes it the longest.
    """
    L, W, H, density, d, phi = (np.asarray(rows[name], dtype=np.float64) for name in NEEDED)
    box, weighed = L * W * H, rows.get(BOULDER_MASS)
    mass = density * box * shape.filled if weighed is None else np.asarray(weighed, dtype=np.float64)
    buried = box * buried_share(shape, d / H)
    if weighed is not None and shape.is_box:  # what fills less than its box fills less of the pit
        buried = buried * np.minimum(mass / (density * box), 1.0)
    slope = wedge_slope(phi)
    for layer in ground.layers:
        slope = np.where(layer.from_m < d, np.maximum(slope, wedge_slope(np.asarray(layer.friction_angle_deg))), slope)
    excavated = W * d * (L + d * slope)
    values = (mass, H - d, excavated, excavated - buried)
    return {spec.name: value for spec, value in zip(QUANTITIES, np.broadcast_arrays(*values), strict=True)}


def quantities_by(rows: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the quantities of designs by the resolved settings of their table."""
    model = settings["model"]
    return quantities(rows, Shape.of_model(model), Ground.of_dict(model.get("ground", {})))


def wedge_slope(phi_deg: np.ndarray) -> np.ndarray:
    """Return how far the wedge reaches at the surface over its depth, by the friction angle [deg] (Eqs 1, 25)."""
    phi = np.radians(phi_deg)
    return np.maximum(elementary.tan(0.25 * np.pi + 0.5 * phi), 1.0 / elementary.tan(phi))


def buried_share(shape: Shape, ratio: np.ndarray) -> np.ndarray:
    """Return the volume of a boulder below a height over the volume of its box, exactly.

    The height is a share of the boulder's; above its top all of it lies below.
    """
    total = np.zeros(np.shape(ratio))
    for low, high in pairwise(shape.points or BOX):
        part = np.clip((ratio - low.height) / (high.height - low.height), 0.0, 1.0)
        areas = []
        for at in (0.0, 0.5 * part, part):  # width times length is of second degree: Simpson's rule is exact
            width, near, far = (
                getattr(low, name) + at * (getattr(high, name) - getattr(low, name))
                for name in ("width", "near", "far")
            )
            areas.append(width * (near + far))
        total = total + part * (high.height - low.height) / 6.0 * (areas[0] + 4.0 * areas[1] + areas[2])
    return total
