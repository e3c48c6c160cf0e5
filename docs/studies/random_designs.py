"""Random designs from the realistic range of boulders, soils and trucks, the same for the same seed."""

from __future__ import annotations

import math

import numpy as np

from boulder_kernels import Design, DesignTable
from boulder_sweep.designs import impact_height_of_face

RANGES = {
    "L": (0.6, 2.0),
    "W": (0.8, 2.5),
    "H": (1.5, 4.0),
    "rho_b": (2400.0, 3074.0),
    "embedment_ratio": (0.35, 0.75),
    "rho_s": (1520.0, 2240.0),
    "phi_deg": (27.0, 49.0),
    "beta": (2.0, 110.0),
    "K_epsilon": (1.0, 1.2),
    "m_v": (4000.0, 12000.0),
    "v_0": (8.0, 24.0),
    "k_v": (1.0e6, 8.0e6),
    "c_v": (0.04e6, 0.4e6),
    "e_bumper": (0.45, 0.55),
    "hood": (1.3, 1.6),
}
"""Least and largest value of each input, SI, angle in degrees; beta in MN/m^3 by its logarithm, the others evenly."""


def random_designs(count: int, seed: int = 0) -> list[Design]:
    """Draw designs that the truck does touch.

    Parameters
    ----------
    count
        How many.
    seed
        Seed of the generator.
    """
    rng = np.random.default_rng(seed)
    found: list[Design] = []
    while len(found) < count:
        draw = {name: float(rng.uniform(low, high)) for name, (low, high) in RANGES.items()}
        softest, stiffest = RANGES["beta"]
        draw["beta"] = math.exp(rng.uniform(math.log(softest), math.log(stiffest)))
        d = draw.pop("embedment_ratio") * draw["H"]
        hood, phi = draw.pop("hood"), math.radians(draw.pop("phi_deg"))
        if draw["H"] - d <= draw["e_bumper"]:
            continue
        e = float(impact_height_of_face(draw["H"], d, draw["e_bumper"], hood))
        found.append(Design(**draw, d=d, phi=phi, e=e))
    return found


def random_table(count: int, seed: int) -> DesignTable:
    """Return random realistic designs as columns."""
    designs = random_designs(count, seed)
    return DesignTable(*(np.array(column, dtype=float) for column in zip(*designs, strict=True)))
