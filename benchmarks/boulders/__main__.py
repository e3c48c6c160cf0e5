"""Draw the designs of the benchmark and integrate them: ``python -m benchmarks.boulders``, ten minutes of CPU time.

The kernels only choose designs of a family and leave out those not at rest within the time simulated; every reference
value is the oracle's (`tests.oracle`, DOP853 that lands on every event and kink). Each design is integrated by two
tolerances; the file holds the finer values, and its metadata say how far apart both are.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from math import degrees, isnan, nan, radians
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.boulders import FILE, REFERENCE
from benchmarks.late import shallow
from boulder_kernels import Control, Design, DesignTable, Status, corrected, simulate_table
from boulder_sweep.columns import BY_NAME
from boulder_sweep.designs import impact_height_of_face
from docs.studies.random_designs import random_designs
from tests.oracle import CORRECTED, Inputs, simulate

HORIZON_S, LIMIT_DEG = 1.0, 20.0
TOLERANCES = (1e-9, 1e-11)
"""Relative tolerances of both integrations, the reference last."""
SEED = 6
TRUCK = {"m_v": 6800.0, "v_0": 13.4, "k_v": 3103.3e3, "c_v": 138.91e3}
COUNTS = {"realistic": 150, "near the limit": 60, "shallow": 30, "soft soil": 15, "stiff vehicle": 15}
"""Designs of each family beside both crash tests."""

Row = dict[str, float]
_COLUMNS: dict[str, tuple[str, Any]] = {
    "boulder_length_m": ("L", 1.0),
    "boulder_width_m": ("W", 1.0),
    "boulder_height_m": ("H", 1.0),
    "boulder_density_kg_m3": ("rho_b", 1.0),
    "embedment_depth_m": ("d", 1.0),
    "impact_height_m": ("e", 1.0),
    "soil_density_kg_m3": ("rho_s", 1.0),
    "friction_angle_deg": ("phi", degrees(1.0)),
    "subgrade_reaction_MN_m3": ("beta", 1.0),
    "strain_rate_factor": ("K_epsilon", 1.0),
    "vehicle_mass_kg": ("m_v", 1.0),
    "impact_speed_m_s": ("v_0", 1.0),
    "vehicle_spring_N_m": ("k_v", 1.0),
    "vehicle_damper_N_s_m": ("c_v", 1.0),
    "bumper_height_m": ("e_bumper", 1.0),
}
"""Inputs by column: the symbol of the paper, and its factor to the unit of the column."""


def crash_tests() -> list[Row]:
    """Return the inputs of both crash tests of the paper (Tables 1 to 3), in the units of the columns."""
    common = {"soil_density_kg_m3": 1859.9, "friction_angle_deg": 43.2, "subgrade_reaction_MN_m3": 95.0}
    common |= {"strain_rate_factor": 1.0, "vehicle_spring_N_m": 3103.3e3, "vehicle_damper_N_s_m": 138.91e3}
    abg = dict(zip(list(_COLUMNS)[:6], (0.762, 1.016, 2.2, 3074.0, 1.2, 0.754), strict=True))
    rwg = dict(zip(list(_COLUMNS)[:6], (1.65, 1.68, 3.44, 2596.0, 2.03, 0.938), strict=True))
    abg |= {"vehicle_mass_kg": 6795.0, "impact_speed_m_s": 13.36, "bumper_height_m": 0.508}
    rwg |= {"vehicle_mass_kg": 6722.0, "impact_speed_m_s": 14.5, "bumper_height_m": 0.5}
    return [{name: (common | own)[name] for name in _COLUMNS} for own in (abg, rwg)]


def _row(design: Design) -> Row:
    return {name: getattr(design, symbol) * factor for name, (symbol, factor) in _COLUMNS.items()}


def _shallow(count: int) -> list[Row]:
    """Draw boulders buried by 2 to 35 % of their height, hit by any car."""
    drawn = shallow(count, SEED)
    drawn["impact_height_m"] = impact_height_of_face(
        drawn.boulder_height_m.to_numpy(),
        drawn.embedment_depth_m.to_numpy(),
        drawn.bumper_height_m.to_numpy(),
        drawn.hood_height_m.to_numpy(),
    )
    return [{name: float(row[name]) for name in _COLUMNS} for row in drawn.to_dict("records")]


def table_of(rows: list[Row]) -> DesignTable:
    """Return rows as the kernels take them."""
    columns = {symbol: np.array([row[name] for row in rows]) / factor for name, (symbol, factor) in _COLUMNS.items()}
    return DesignTable(**columns)


def _settled(rows: list[Row], low_deg: float = 0.0, high_deg: float = 90.0) -> list[Row]:
    """Keep the rows that overturn or come to rest within the horizon, and turn by so much if nothing stops them."""
    stopped = simulate_table(
        table_of(rows), corrected(), Control(2e-3, HORIZON_S, radians(LIMIT_DEG), 0, False, True, True)
    )
    free = simulate_table(table_of(rows), corrected(), Control(2e-3, HORIZON_S, radians(90.0), 0, False, True, True))
    decided = np.isin(stopped.status, (Status.LIMIT, Status.SETTLED))
    turned = np.degrees(free.theta_max)
    return [row for row, kept in zip(rows, decided & (turned >= low_deg) & (turned <= high_deg), strict=True) if kept]


def families() -> Iterator[tuple[str, list[Row]]]:
    """Draw the designs of every family."""
    yield "crash test", crash_tests()
    usual = [_row(design) for design in random_designs(3000, SEED)]
    rng = np.random.default_rng(SEED)

    def scaled(name: str, low: float, high: float) -> list[Row]:
        factors = np.exp(rng.uniform(np.log(low), np.log(high), len(usual)))
        return [row | {name: row[name] * factor} for row, factor in zip(usual, factors, strict=True)]

    drawn = {
        "realistic": _settled(usual),
        "near the limit": _settled(usual[1000:], 16.0, 25.0),
        "shallow": _settled(_shallow(600)),
        "soft soil": _settled(scaled("subgrade_reaction_MN_m3", 0.005, 0.1)),
        "stiff vehicle": _settled(scaled("vehicle_spring_N_m", 5.0, 50.0)),
    }
    for name, count in COUNTS.items():
        yield name, drawn[name][:count]


def reference(row: Row, rtol: float) -> tuple[float, ...]:
    """Integrate one impact by the oracle; return the values of `REFERENCE`, the last NaN where it does not overturn."""
    symbols = {symbol: row[name] / factor for name, (symbol, factor) in _COLUMNS.items()}
    symbols.pop("e_bumper")
    limit = radians(LIMIT_DEG)
    impact = simulate(Inputs(**symbols), CORRECTED, horizon=HORIZON_S, rotation_limit=limit, rtol=rtol)
    time = impact.time_of_rotation(limit * (1 - 1e-15))
    overturns = abs(float(impact.states(impact.t_end)[2, 0])) >= limit * (1 - 1e-12)
    return (
        LIMIT_DEG if overturns else degrees(impact.max_rotation.value),
        impact.max_displacement.value,
        impact.max_vehicle_displacement.value,
        impact.peak_force.value / 1e3,
        (impact.t_end if isnan(time) else time) if overturns else nan,
    )


def _both(row: Row) -> list[tuple[float, ...]]:
    return [reference(row, rtol) for rtol in TOLERANCES]


def benchmark(jobs: int = 2) -> pa.Table:
    """Draw all designs and integrate them; return the file of the benchmark."""
    labelled = [(name, row) for name, rows in families() for row in rows]
    values = np.empty((len(labelled), len(TOLERANCES), len(REFERENCE)))
    with ProcessPoolExecutor(jobs) as pool:
        for n, found in enumerate(pool.map(_both, [row for _, row in labelled])):
            values[n] = found
            print(f"\r{n + 1} of {len(labelled)} designs integrated", end="", file=sys.stderr)
    print(file=sys.stderr)
    apart = np.nanmax(np.abs(values[:, 0] - values[:, 1]), axis=0)
    fields: list[pa.Field] = [pa.field("design_id", pa.int64()), pa.field("family", pa.string())]
    arrays: list[pa.Array] = [pa.array(range(len(labelled))), pa.array([name for name, _ in labelled])]
    for name in (*_COLUMNS, *REFERENCE):
        column = BY_NAME[name]
        fields.append(pa.field(name, pa.float64(), metadata={"unit": column.unit, "meaning": column.meaning}))
        given = [row[name] for _, row in labelled] if name in _COLUMNS else values[:, 1, REFERENCE.index(name)]
        arrays.append(pa.array(given, from_pandas=True))
    about = {
        "model": "corrected readings, N -> infinity, uniform elastic soil, resistance K_p squared, g = 9.80665 m/s^2",
        "until": f"{HORIZON_S} s, or the instant at which the rotation reaches {LIMIT_DEG} degrees",
        "method": f"DOP853, relative tolerance {TOLERANCES[-1]}, every event and kink located",
        "largest difference by a tolerance of 1e-9": dict(zip(REFERENCE, map(float, apart), strict=True)),
    }
    return pa.table(arrays, schema=pa.schema(fields, metadata={"benchmark": json.dumps(about)}))


if __name__ == "__main__":
    made = benchmark()
    pq.write_table(made, FILE, compression="zstd")
    print(f"{FILE.name}: {made.num_rows} designs")
    print(json.dumps(json.loads(made.schema.metadata[b"benchmark"]), indent=2))
