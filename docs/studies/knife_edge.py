"""The knife edge of the printed restoring moment: one design over the speed of impact, and how often it happens."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boulder_kernels import (
    Control,
    Design,
    DesignTable,
    Readings,
    Record,
    Status,
    as_printed,
    simulate_design,
    simulate_table,
)
from boulder_kernels.control import STEP_RATIO
from boulder_sweep.views.pictures import BLUE, GREY, ORANGE, figure
from docs.studies.coverage import HORIZON_S, LIMIT, random_table

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
"""Speeds around that of the example that are looked at, as a share of it."""
STEP_S = 2.5e-4
STEPS_MS = (12.0, 6.0, 3.0)
"""Longer steps of the error estimates that are looked at."""
COUNT, SEED = 20_000, 3
NEARBY = 1e-3
"""Change of speed for which designs are looked at on either side."""
NOTABLE_DEG = 0.2


@dataclass(frozen=True, eq=False)
class KnifeEdge:
    """Rotation of the example over the speed of impact.

    Attributes
    ----------
    speeds_m_s, rotations_deg : ndarray
        Speeds of impact, and the largest rotation at each.
    edge_m_s : float
        Speed at which the rotation jumps.
    width_m_s : float
        How narrowly it was located.
    below_deg, above_deg : float
        Largest rotation just below and just above it.
    """

    speeds_m_s: np.ndarray
    rotations_deg: np.ndarray
    edge_m_s: float
    width_m_s: float
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
    return KnifeEdge(
        speeds,
        rotations,
        float(at[place]),
        float(at[place + 1] - at[place]),
        float(values[place]),
        float(values[place + 1]),
    )


def rotations_deg(speeds_m_s: np.ndarray, readings: Readings, step_s: float = STEP_S) -> np.ndarray:
    """Largest rotation of the example at some speeds of impact [deg]."""
    columns = EXAMPLE._asdict() | {"v_0": speeds_m_s}
    table = DesignTable(**{name: np.broadcast_to(value, len(speeds_m_s)).copy() for name, value in columns.items()})
    return np.degrees(simulate_table(table, readings, Control(step_s, HORIZON_S, LIMIT, 0, False)).theta_max)


def histories(found: KnifeEdge) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return times [s] and the rotations just below and just above the edge over them [deg]."""
    times = np.linspace(0.0, 0.6, 1201)
    rotations = []
    for speed in (found.edge_m_s, found.edge_m_s + found.width_m_s):
        n = len(times)
        states, exchanged = np.full((n, 6), np.nan), np.zeros((n, 4))
        record = Record(times, states, np.zeros(n, np.int8), np.zeros(n, np.bool_), exchanged)
        control = Control(STEP_S, 0.6, LIMIT, 0, False)
        simulate_design(EXAMPLE._replace(v_0=speed), as_printed(), control, record)
        rotations.append(np.degrees(states[:, 2]))
    return times, rotations


def knife_edge_words() -> str:
    """Say what the edge does to the example, and how often designs graze it."""
    found = knife_edge()
    steady = knife_edge(readings=as_printed()._replace(restoring_gravity=True))
    standing, near, grazed = how_often()
    marked = "; ".join(f"{count} by steps of {step:g} + {step / STEP_RATIO:g} ms" for step, count in grazed.items())
    change = float(np.abs(np.diff(steady.rotations_deg)).max())
    return "\n".join(
        (
            f"- At {found.edge_m_s:.2f} m/s the truck of the picture turns the boulder by {found.below_deg:.2f}°. "
            f"At a speed higher by less than {_power(found.width_m_s)} m/s, it turns it by {found.above_deg:.2f}°.",
            f"- With `restoring: gravity`, everything else as printed, no two neighbours of the 401 speeds of the "
            f"picture differ by more than {change:.3f}°.",
            f"- Of {COUNT:,} random designs as printed, {standing:,} stay below 20°. A speed higher by a tenth of a "
            f"per cent changes the rotation of {near} of these by more than {NOTABLE_DEG:g}°.",
            f"- Those whose estimated error is larger than {NOTABLE_DEG:g}°: {marked}.",
        )
    )


def how_often() -> tuple[int, int, dict[float, int]]:
    """Count random designs as printed.

    Returns
    -------
    standing, near, grazed
        Designs that stay below the limit; those of them that a little more speed turns very differently; and, by the
        longer of two steps [ms], those whose estimated error is large.
    """
    table = random_table(COUNT, SEED)
    faster = table._replace(v_0=table.v_0 * (1.0 + NEARBY))
    one, other = (
        simulate_table(designs, as_printed(), Control(1e-3, HORIZON_S, LIMIT, 0, False)) for designs in (table, faster)
    )
    stands = (one.status != Status.LIMIT) & (other.status != Status.LIMIT) & np.isfinite(one.theta_max)
    change = np.degrees(np.abs(one.theta_max - other.theta_max))
    grazed = {}
    for step in STEPS_MS:
        out = simulate_table(table, as_printed(), Control(1e-3 * step, HORIZON_S, LIMIT, 0, True))
        grazed[step] = int((np.degrees(out.theta_error) > NOTABLE_DEG)[out.status != Status.LIMIT].sum())
    return int(stands.sum()), int((change[stands] > NOTABLE_DEG).sum()), grazed


def draw_knife_edge(path: str | Path) -> None:
    """Draw the example: rotation over speed, and over time on either side of the edge."""
    found = knife_edge()
    gravity = rotations_deg(found.speeds_m_s, as_printed()._replace(restoring_gravity=True))
    with figure(path, 9.2, 3.9) as fig:
        left, right = fig.subplots(1, 2)
        below = found.speeds_m_s <= found.edge_m_s
        for part, label in ((below, "restoring: printed"), (~below, None)):
            left.plot(found.speeds_m_s[part], found.rotations_deg[part], color=ORANGE, label=label)
        left.plot(found.speeds_m_s, gravity, color=BLUE, label="restoring: gravity,\nelse as printed")
        left.axvline(found.edge_m_s, color=GREY, linewidth=0.8, linestyle=":")
        left.set_title("One design, the truck a little faster or slower")
        left.set_xlabel("speed of impact [m/s]")
        left.set_ylabel("largest rotation [deg]")
        # In the band that no curve enters: the printed one stays above it on either side of its jump.
        left.legend(loc="center left", bbox_to_anchor=(0.0, 0.43))
        times, (before, after) = histories(found)
        right.plot(times, before, color=ORANGE, label=f"{found.edge_m_s:.2f} m/s")
        faster = f"faster by less than {_power(found.width_m_s)} m/s"
        right.plot(times, after, color=ORANGE, linestyle="--", label=faster)
        right.set_title("Either side of the edge, restoring: printed")
        right.set_xlabel("time [s]")
        right.set_ylabel("rotation [deg]")
        right.legend(loc="best")


def _power(value: float) -> str:
    """Round up to a power of ten."""
    return f"1e{math.ceil(math.log10(value))}"
