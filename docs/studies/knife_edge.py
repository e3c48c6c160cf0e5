"""The knife edge of the printed restoring moment: one design over the speed of impact."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, Design, DesignTable, Readings, as_printed, simulate_table
from docs.studies.wild import HORIZON_S, LIMIT

EXAMPLE = Design(
    L=1.52,
    W=1.29,
    H=3.96,
    rho_b=3069.0,
    d=2.46,
    e=0.95,
    rho_s=1952.0,
    phi=math.radians(30.53),
    beta=12.46,
    K_epsilon=1.17,
    m_v=3198.0,
    v_0=23.2,
    k_v=2.0524e6,
    c_v=79430.0,
    e_bumper=0.5,
)
"""A tall granite boulder in loose soil before a light truck at 83 km/h."""
SPAN = 0.02
"""Half the range of speeds around the example's speed, as a share of it."""
STEP_S = 2.5e-4


class KnifeEdge(NamedTuple):
    """Largest rotations of the example over the speed of impact [deg], and where they jump."""

    rotations_deg: np.ndarray
    edge_m_s: float
    width_m_s: float
    """How narrowly the jump was located."""
    below_deg: float
    above_deg: float


def knife_edge(readings: Readings | None = None) -> KnifeEdge:
    """Find the jump of the example's rotation over the speed of impact."""
    readings = readings or as_printed()
    low, high = EXAMPLE.v_0 * (1.0 - SPAN), EXAMPLE.v_0 * (1.0 + SPAN)
    speeds = np.linspace(low, high, 401)
    rotations = rotations_deg(speeds, readings)
    at, values = speeds, rotations
    for _ in range(4):
        place = int(np.argmax(np.abs(np.diff(values))))
        at = np.linspace(at[place], at[place + 1], 201)
        values = rotations_deg(at, readings)
    place = int(np.argmax(np.abs(np.diff(values))))
    edge, beyond = at[place : place + 2].tolist()
    return KnifeEdge(rotations, edge, beyond - edge, *values[place : place + 2].tolist())


def rotations_deg(speeds_m_s: np.ndarray, readings: Readings, step_s: float = STEP_S) -> np.ndarray:
    """Largest rotation of the example at some speeds of impact [deg]."""
    columns = EXAMPLE._asdict() | {"v_0": speeds_m_s}
    table = DesignTable(**{name: np.broadcast_to(value, len(speeds_m_s)).copy() for name, value in columns.items()})
    return np.degrees(simulate_table(table, readings, Control(step_s, HORIZON_S, LIMIT, 0, False)).theta_max)


def knife_edge_words() -> str:
    """Say what the edge does to the example."""
    found = knife_edge()
    steady = knife_edge(readings=as_printed()._replace(restoring_gravity=True))
    change = float(np.abs(np.diff(steady.rotations_deg)).max())
    return (
        f"At {found.edge_m_s:.2f} m/s a truck turns one boulder by {found.below_deg:.2f}°; at a speed higher by less "
        f"than {_power(found.width_m_s)} m/s, by {found.above_deg:.2f}°. With `restoring: gravity`, everything else as "
        f"printed, no two neighbours of 401 speeds around it differ by more than {change:.3f}°."
    )


def _power(value: float) -> str:
    """Round up to a power of ten."""
    return f"1e{math.ceil(math.log10(value))}"
