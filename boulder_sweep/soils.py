"""Soils as they lie, and the laws of their ultimate resistance: from settings to what the kernels take.

The ultimate pressure at the depth alpha is

    p_u = S (K_p sigma' + 2 c sqrt(K_p)) K_epsilon

with the effective vertical stress sigma', Rankine's pressure with Bell's term for the cohesion c (Eq 105), and the
factor S = K/K_p by which the law of the resistance, K, exceeds a wall's passive pressure. Water takes its own weight
from the stress below the table (Eq 106), and nothing from the inertia of the soil. Ground that falls away reduces both
terms as it reduces Coulomb's plane wedge (Eq 107). A slope alone, and water up to the soil line, leave the pressure
proportional to depth: each is then a factor on K_epsilon, as another law is, and the closed form holds.

Without layers, water and cohesion all laws grow in proportion to depth, sigma_u = K rho_s g alpha K_epsilon, and differ
in the coefficient K alone. So another law than the paper's is the factor K / K_p^2 on K_epsilon (Eq 27), and everything
made for the paper's law holds: the closed form, the energy ledger, the proofs. The page
``docs/soil.md`` says where the equations come from.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels.design import G
from boulder_kernels.layered import LayeredTable, OutlinedTable
from boulder_sweep import elementary
from boulder_sweep.settings.model import WATER_KG_M3, Ground
from boulder_sweep.settings.shape import BOX, Shape


def passive_coefficient(phi: np.ndarray) -> np.ndarray:
    """Return Rankine's coefficient K_p of passive earth pressure for angles phi [rad] (with Eq 27)."""
    return elementary.tan(0.25 * np.pi + 0.5 * phi) ** 2


def kp_squared(table: DesignTable) -> np.ndarray:
    """Return K = K_p^2 of n designs, shape (n,): the paper's law for slender piles (Eq 27)."""
    return passive_coefficient(table.phi) ** 2


def broms(table: DesignTable) -> np.ndarray:
    """Return K = 3 K_p of n designs, shape (n,): Broms (1964), for short rigid piles (Eq 101)."""
    return 3.0 * passive_coefficient(table.phi)


def width_capped(table: DesignTable) -> np.ndarray:
    """Return K_p^2, or K_p R where this is less, of n designs, shape (n,) (Eq 102).

    R = 1 + 1.6 (K_p - K_a)^0.67 / (1 + 5 W/d) is the increase of the passive pressure on a wall of limited width by the
    soil beside it, after Ovesen and Brinch Hansen, for a wall that stands alone and reaches the surface.
    """
    K_p = passive_coefficient(table.phi)
    R = 1.0 + 1.6 * elementary.power(K_p - 1.0 / K_p, 0.67) / (1.0 + 5.0 * table.W / table.d)
    return np.minimum(K_p**2, K_p * R)


LAWS: dict[str, Callable[[DesignTable], np.ndarray]] = {
    "kp_squared": kp_squared,
    "broms": broms,
    "width_capped": width_capped,
}
"""By the names of `boulder_sweep.settings.model.RESISTANCES`."""


def with_law(table: DesignTable, law: str, present: str = "kp_squared") -> DesignTable:
    """Return n designs with the ultimate resistance of another law.

    Parameters
    ----------
    table
        The designs, SI.
    law
        A name of `LAWS`.
    present
        The law that the designs have.

    Returns
    -------
    DesignTable
        The designs themselves where the law is the present one.
    """
    if law == present:
        return table
    return table._replace(K_epsilon=table.K_epsilon * (LAWS[law](table) / LAWS[present](table)))


def slope_factor(phi: np.ndarray, slope: float) -> np.ndarray:
    """Return the passive pressure where the ground falls by `slope` [rad] over that where it is level (Eq 107).

    Coulomb's coefficient for a smooth vertical wall is cos^2(phi) / (1 - sqrt(sin(phi) sin(phi - i) / cos(i)))^2.

    Parameters
    ----------
    phi
        Friction angles [rad]. A settings file has none below the slope; one that is drawn counts as equal to it.
    slope
        Angle of the ground [rad].
    """
    sin = elementary.sin(phi)
    falling = 1.0 - np.sqrt(sin * elementary.sin(np.maximum(phi - slope, 0.0)) / elementary.cos(slope))
    return ((1.0 - sin) / falling) ** 2


def with_soil(table: DesignTable, law: str, ground: Ground, turned: float = 0.0, shape: Shape | None = None) -> Any:
    """Return n designs with the ultimate resistance of a law in the soil as it lies.

    Parameters
    ----------
    table
        The designs, SI; their soil is the uppermost layer.
    law
        A name of `boulder_sweep.soils.LAWS`.
    ground
        The rest.
    turned
        Change of the friction angles of the deeper layers [rad].
    shape
        Shape of the boulders; boxes by default.

    Returns
    -------
    DesignTable, LayeredTable or OutlinedTable
        The first where the resistance is proportional to depth, the last where boulders are no boxes.
    """
    if shape is not None and not shape.is_box:
        return beside_outlines(with_soil(table, law, ground, turned), law, shape)
    if ground.is_usual:
        return with_law(table, law)
    slope = np.radians(ground.slope_deg)
    if ground.is_proportional:
        submerged = 1.0 - WATER_KG_M3 / table.rho_s if ground.water_table_m == 0.0 else 1.0
        changed = table._replace(K_epsilon=table.K_epsilon * slope_factor(table.phi, slope) * submerged)
        return with_law(changed, law)
    return LayeredTable(*table, layers_of(table, law, ground, turned))


def is_layered(law: str, ground: Ground, shape: Shape) -> bool:
    """Return whether the soil of designs may yield at one depth after another, see `boulder_kernels.table.is_layered`.

    Parameters: see `with_soil`.
    """
    if shape.is_box:
        return not ground.is_proportional
    return not ground.is_proportional or len(shape.points) > len(BOX) or law == "width_capped"


def layers_of(table: DesignTable, law: str, ground: Ground, turned: float = 0.0) -> np.ndarray:
    """Return the layers of n designs as `boulder_kernels.layered` takes them, shape (n, M, 6) (Eqs 105, 106).

    Parameters: see `with_soil`. A layer that the water table cuts becomes two.
    """
    n, slope = table.d.size, np.radians(ground.slope_deg)
    water = np.inf if ground.water_table_m is None else ground.water_table_m
    tops = [0.0, *(layer.from_m for layer in ground.layers)]
    wet = [water] if 0.0 < water < np.inf and water not in tops else []
    bounds = np.array(sorted([*tops, *wet, np.inf]))
    found = np.empty((n, len(bounds) - 1, 6))
    stress = np.zeros(n)
    for m, (top, bottom) in enumerate(pairwise(bounds)):
        below = int(np.searchsorted(tops, top, side="right")) - 1
        if below == 0:
            rho_s, phi, beta, cohesion = table.rho_s, table.phi, table.beta, ground.cohesion_kPa
        else:
            layer = ground.layers[below - 1]
            angle = np.radians(layer.friction_angle_deg) + turned
            rho_s, phi, beta = (
                np.full(n, value) for value in (layer.density_kg_m3, angle, layer.subgrade_reaction_MN_m3)
            )
            cohesion = layer.cohesion_kPa
        K_p = passive_coefficient(phi)
        factor = LAWS[law](table._replace(phi=phi)) / K_p * slope_factor(phi, slope)
        weight = G * (rho_s - (WATER_KG_M3 if top >= water else 0.0))
        # sigma' is the stress at the upper boundary, and from there on the weight times the depth below it.
        found[:, m, 0] = bottom
        found[:, m, 1], found[:, m, 2], found[:, m, 3] = rho_s, phi, beta
        found[:, m, 4] = factor * (K_p * (stress - weight * top) + 2e3 * cohesion * np.sqrt(K_p))
        found[:, m, 5] = factor * K_p * weight
        stress = stress + weight * (bottom - top)
    return found


def outlines_of(table: Any, shape: Shape) -> np.ndarray:
    """Return the outlines of n boulders of a shape as `boulder_kernels.outline` takes them, shape (n, P, 4)."""
    sides = np.stack([table.H, table.W, table.L, table.L], axis=1)
    points = np.array([(point.height, point.width, point.near, point.far) for point in shape.points])
    return np.ascontiguousarray(points * sides[:, None, :])


SLICES = 16
"""Slices of the buried depth in which the law that depends on the width takes that of their middle."""


def beside_outlines(table: Any, law: str, shape: Shape) -> OutlinedTable:
    """Return n designs in some soil with boulders of a shape (Eq 145).

    A law that depends on the width takes the local one, slice by slice (`SLICES`): the pressure is no line along the
    depth then. All others leave the pressure as it is beside a box.
    """
    plain_table = plain(table)
    if isinstance(table, LayeredTable):
        layers = table.layers
    else:
        slope = kp_squared(table) * table.rho_s * G
        layers = np.zeros((table.d.size, 1, 6))
        layers[:, 0] = np.stack(
            [np.full_like(slope, np.inf), table.rho_s, table.phi, table.beta, 0.0 * slope, slope], axis=1
        )
    if law == "width_capped":
        layers = _by_local_width(plain_table, layers, shape)
    return OutlinedTable(*plain_table, np.ascontiguousarray(layers), outlines_of(plain_table, shape))


def _by_local_width(table: DesignTable, layers: np.ndarray, shape: Shape) -> np.ndarray:
    """Return layers cut into slices, with the law that depends on the width by that of the middle of each."""
    n, count = table.d.size, layers.shape[1]
    cuts = table.d[:, None] * np.arange(1, SLICES) / SLICES
    bottoms = np.sort(np.concatenate([layers[:, :, 0], cuts], axis=1), axis=1)
    tops = np.concatenate([np.zeros((n, 1)), bottoms[:, :-1]], axis=1)
    own = (layers[:, None, :, 0] <= tops[:, :, None]).sum(axis=2).clip(max=count - 1)
    found = np.take_along_axis(layers, own[:, :, None], axis=1)
    found[:, :, 0] = bottoms
    middle = 0.5 * (np.minimum(tops, table.d[:, None]) + np.minimum(bottoms, table.d[:, None]))
    heights, widths = np.array([(point.height, point.width) for point in shape.points]).T
    share = np.interp((table.d[:, None] - middle) / table.H[:, None], heights, widths)
    for m in range(found.shape[1]):
        here = table._replace(phi=found[:, m, 2])
        factor = width_capped(here._replace(W=table.W * share[:, m])) / width_capped(here)
        found[:, m, 4:] *= factor[:, None]
    return found


def plain(table: Any) -> DesignTable:
    """Return designs without the layers and outlines that they may have."""
    return DesignTable(*table[: len(DesignTable._fields)])
