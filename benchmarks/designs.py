"""The designs that all benchmarks share: a fixed random sample of realistic boulders, soils and one truck."""

from __future__ import annotations

import math

import numpy as np

from boulder_kernels import DesignTable

DESIGNS = 8192
"""Size of the sample."""
SEED = 20
BUMPER_HEIGHT = 0.5
"""Underside of the truck's bumper over the soil line [m]."""
HOOD_HEIGHT = 1.4
"""Top of its hood [m]."""
TRUCK = {"m_v": 6800.0, "v_0": 13.4, "k_v": 3103.3e3, "c_v": 138.91e3}
"""The truck of the paper's crash tests at 30 mph, SI."""
TERZAGHI = (2.2, 17.6)
"""Subgrade reaction of loose to dense sand after Terzaghi [MN/m^3]."""
API_ANGLES, API = (30.0, 43.0), (10.5, 110.0)
"""Subgrade reaction over friction angle after the API curve [deg], [MN/m^3]; several times Terzaghi's."""
ROTATION_LIMIT = math.radians(20.0)
"""Rotation at which a design has overturned [rad]."""
HORIZON = 1.0
"""Longest simulated time [s]."""


def sample(count: int = DESIGNS, seed: int = SEED) -> DesignTable:
    """Draw designs that the truck hits.

    Parameters
    ----------
    count
        Number of designs. The first rows are the same for any count.
    seed
        Of the random numbers.

    Returns
    -------
    DesignTable
        SI, phi in rad, beta in MN/m^3. Either family of the subgrade reaction gives about half of the rows, and none
        mixes the two: Terzaghi's values at any friction angle, or the one value of the API curve at this angle.
    """
    rng = np.random.default_rng(seed)
    rows: list[dict[str, float]] = []
    while len(rows) < count:
        row = _draw(rng)
        if row["H"] - row["d"] > BUMPER_HEIGHT:
            rows.append(row)
    return DesignTable(**{name: np.array([row[name] for row in rows]) for name in DesignTable._fields})


def first(table: DesignTable, count: int) -> DesignTable:
    """Return the first rows of a table."""
    return DesignTable(*(np.ascontiguousarray(column[:count]) for column in table))


def _draw(rng: np.random.Generator) -> dict[str, float]:
    """Draw one design from the realistic ranges."""
    H = rng.uniform(1.5, 4.0)
    d = rng.uniform(0.35, 0.75) * H
    angle = rng.uniform(27.0, 49.0)
    terzaghi = rng.random() < 0.5
    drawn = rng.uniform(*TERZAGHI)
    return {
        "L": rng.uniform(0.6, 2.0),
        "W": rng.uniform(0.8, 2.5),
        "H": H,
        "rho_b": rng.uniform(2400.0, 3074.0),
        "d": d,
        "e": 0.5 * (min(H - d, HOOD_HEIGHT) + BUMPER_HEIGHT),
        "rho_s": rng.uniform(1520.0, 2240.0),
        "phi": math.radians(angle),
        "beta": drawn if terzaghi else float(np.interp(angle, API_ANGLES, API)),
        "K_epsilon": rng.uniform(1.0, 1.2),
        "e_bumper": BUMPER_HEIGHT,
        **TRUCK,
    }
