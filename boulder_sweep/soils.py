"""Soils as they lie, from settings to what the kernels take: laws of the resistance, layers, water, cohesion, slope.

The equations stand in `boulder_kernels.ground`; ``docs/model.md`` derives them.
"""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels import ground as kernels
from boulder_kernels.pieces import FRICTION, PRESSURE, PiecewiseTable
from boulder_kernels.table import some_rows
from boulder_sweep.settings.model import BOX, RESISTANCES, Ground, ProfilePoint, Shape
from boulder_sweep.stones.taped import taped_profiles

SLICES = 16
"""Slices of the buried depth in which the law that depends on the width takes the width of their middle."""


def coefficients(table: DesignTable, law: str) -> np.ndarray:
    """Return the coefficient K of a law of the resistance [-] for n designs, SI, shape (n,)."""
    values = np.empty(table.d.size)
    kernels.write_coefficients(table, RESISTANCES.index(law), values)
    return values


def with_law(table: Any, law: str, present: str = RESISTANCES[0]) -> Any:
    """Return n designs, SI, boxes, with the ultimate resistance of another law than the `present` one they have."""
    if law == present:
        return table
    ratios = layer_coefficients(table, law) / layer_coefficients(table, present)
    if not isinstance(table, PiecewiseTable):
        return table._replace(K_epsilon=table.K_epsilon * ratios[:, 0])
    layers = table.layers.copy()
    layers[:, :, PRESSURE:] *= ratios[:, :, None]
    return table._replace(layers=layers)


def layer_coefficients(table: Any, law: str) -> np.ndarray:
    """Return the coefficient K of a law [-] in every layer of n designs, shape (n, M); M is 1 of a uniform soil."""
    if not isinstance(table, PiecewiseTable):
        return coefficients(table, law)[:, None]
    angles = np.moveaxis(table.layers[:, :, FRICTION], 1, 0)
    return np.stack([coefficients(plain(table)._replace(phi=phi.copy()), law) for phi in angles], axis=-1)


def ground_of(law: str, ground: Ground) -> kernels.Ground:
    """Return the soil as it lies as the kernels take it; parameters: see `with_soil`."""
    layers = np.array([astuple(layer) for layer in ground.layers]).reshape(-1, 5)
    layers[:, 2] = np.radians(layers[:, 2])
    water = np.inf if ground.water_table_m is None else ground.water_table_m
    return kernels.Ground(
        RESISTANCES.index(law), float(np.radians(ground.slope_deg)), float(water), float(ground.cohesion_kPa), layers
    )


def layers_count(law: str, ground: Ground, shape: Shape) -> int:
    """Return how many layers the soil of a design has; none where the resistance beside a box grows with depth."""
    count = 0 if shape.is_box else 1
    if not ground.is_proportional:
        tops = {0.0, *(layer.from_m for layer in ground.layers)}
        count = len(tops if ground.water_table_m is None else tops | {ground.water_table_m})
    return count if shape.is_box or law != "width_capped" else count + SLICES - 1


def profile_of(shape: Shape) -> np.ndarray:
    """Return height, width and reaches of boulders as shares of their sides, shape (P, 4); P = 0 of boxes."""
    return np.array([] if shape.is_box else [astuple(point) for point in shape.points]).reshape(-1, 4)


def with_soil(table: DesignTable, law: str, ground: Ground, shape: Shape | None = None) -> Any:
    """Return n designs, SI, with the ultimate resistance of a law in the soil as it lies; boxes by default.

    Their own soil is the uppermost layer. Where boulders are boxes and the resistance is proportional to depth they
    stay a `DesignTable`, else they become a `PiecewiseTable`.
    """
    shape = shape or Shape()
    if shape.is_box and ground.is_usual:
        return with_law(table, law)
    profile, n = profile_of(shape), table.d.size
    table = table._replace(K_epsilon=table.K_epsilon.copy())
    layers, outlines = np.empty((n, layers_count(law, ground, shape), 6)), np.empty((n, len(profile), 4))
    kernels.put_soil(table, ground_of(law, ground), not ground.is_proportional, SLICES, profile, layers, outlines)
    is_uniform = shape.is_box and ground.is_proportional
    return table if is_uniform else PiecewiseTable(*table, layers, outlines)


def with_shape(table: DesignTable, law: str, ground: Ground, shape: str, fills: np.ndarray) -> PiecewiseTable:
    """Return the same for boulders as taped and weighed, by one of `boulder_sweep.columns.SHAPES` that they may have.

    Their density is the rock's; `fills` are their volumes over the volumes of the boxes of their sides, shape (n,).
    """
    profiles = taped_profiles(shape, fills)
    if law != "width_capped":  # no other looks at the width
        soil = with_soil(table, law, ground, shape=Shape(_points(profiles[0])))
        return soil._replace(outlines=profiles * np.stack([table.H, table.W, table.L, table.L], axis=-1)[:, None, :])
    rows = [np.flatnonzero(fills == fill) for fill in np.unique(fills)]
    each = [with_soil(some_rows(table, some), law, ground, shape=Shape(_points(profiles[some[0]]))) for some in rows]
    order = np.argsort(np.concatenate(rows))
    return PiecewiseTable(*(np.ascontiguousarray(np.concatenate(column)[order]) for column in zip(*each, strict=True)))


def _points(profile: np.ndarray) -> tuple[ProfilePoint, ...]:
    """Return a profile of shape (P, 4) as points."""
    return tuple(ProfilePoint(*point) for point in profile.tolist())


def is_layered(law: str, ground: Ground, shape: Shape) -> bool:
    """Return whether the soil of designs may yield at one depth after another, see `boulder_kernels.table.is_layered`.

    Parameters: see `with_soil`.
    """
    if shape.is_box:
        return not ground.is_proportional
    return not ground.is_proportional or len(shape.points) > len(BOX) or law == "width_capped"


def plain(table: Any) -> DesignTable:
    """Return designs without the layers and outlines that they may have."""
    return DesignTable(*table[: len(DesignTable._fields)])
