"""Sweeps, stand-ins for the kernels and comparisons that the tests of the run share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, Status
from boulder_sweep.settings import Sweep, load_text

GRID = """
name: {name}
boulder:  {{length: 1.65 m, width: {width}, height: {height}, density: 2596 kg/m^3}}
site:     {{{site}}}
soil:     {{density: 1859.9 kg/m^3, friction_angle: {friction}, subgrade_reaction: {subgrade}, strain_rate_factor: 1.0}}
vehicle:  {{mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.5 m,
           hood_height: 1.4 m, bed_offset: 2.9 m}}
criterion: {{max_rotation: {rotation}, rating: P1}}
model:    {{readings: corrected, soil: {soil}}}
solver:   {{step: {step}, horizon: 1 s}}
"""
DEFAULTS = {
    "name": "test",
    "width": "1.68 m",
    "height": "{from: 1.6 m, to: 3.4 m, count: 7}",
    "site": "embedment_ratio: {from: 0.40, to: 0.70, step: 0.05}",
    "friction": "[36, 40, 43.2] deg",
    "subgrade": "[25, 60, 95] MN/m^3",
    "rotation": "20 deg",
    "soil": "closed_form",
    "step": "4 ms",
}


def grid(**changes: str) -> Sweep:
    """Return a sweep of 441 designs (7 heights, 7 ratios, 3 friction angles, 3 subgrade reactions), or another."""
    return load_text(grid_text(**changes), Path("test.yaml"))


def grid_text(**changes: str) -> str:
    """Return the settings file of `grid`."""
    return GRID.format(**{**DEFAULTS, **changes})


def grid_of(rows: int, **changes: str) -> Sweep:
    """Return a sweep of as many designs as asked for, all along the axis of the subgrade reaction."""
    return grid(**{**_one_axis(rows), **changes})


def grid_of_text(rows: int, **changes: str) -> str:
    """Return the settings file of `grid_of`."""
    return grid_text(**{**_one_axis(rows), **changes})


def _one_axis(rows: int) -> dict[str, str]:
    subgrade = f"{{from: 20 MN/m^3, to: 100 MN/m^3, count: {rows}}}"
    return {"height": "2.6 m", "site": "embedment_ratio: 0.5", "friction": "40 deg", "subgrade": subgrade}


def plausible(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Stand in for the kernels: every status, and numbers that depend on every input; no simulation."""
    mixed = sum(np.sin(column * (place + 1.0)) for place, column in enumerate(table))
    share = np.mod(np.abs(mixed) * 1000.0, 1.0)
    status = np.full(len(share), Status.SETTLED, dtype=np.int8)
    for kind, below in (
        (Status.HORIZON, 0.6),
        (Status.LIMIT, 0.5),
        (Status.OUTWARD, 0.2),
        (Status.INVALID, 0.1),
        (Status.NO_CONTACT, 0.05),
    ):
        status[share < below] = kind
    computed = ~np.isin(status, (Status.INVALID, Status.NO_CONTACT))
    theta = np.where(status == Status.LIMIT, control.theta_limit, share * control.theta_limit)

    def kept(values: np.ndarray) -> np.ndarray:
        return np.where(computed, values, np.nan)

    return OutcomeTable(
        status=status,
        theta_max=kept(theta),
        x_b_max=kept(share * 0.3),
        x_v_max=kept(1.0 + 6.0 * share),
        F_v_max=kept(1e6 * (0.5 + share)),
        crush_max=kept(0.3 + 0.5 * share),
        t_limit=np.where(status == Status.LIMIT, 0.1 + share, np.nan),
        t_end=kept(0.3 + share),
        theta_error=kept(1e-4 * share),
        x_error=kept(1e-5 * share),
        step=np.full(len(share), control.h),
    )


def settled(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Stand in for the kernels, as fast as can be: every design passes with the same numbers."""
    n = len(table.L)
    columns: dict[str, Any] = dict.fromkeys(OutcomeTable._fields, np.full(n, 0.1))
    columns["status"] = np.full(n, Status.SETTLED, dtype=np.int8)
    columns["t_limit"] = np.full(n, np.nan)
    return OutcomeTable(**columns)


def partly_impossible() -> Sweep:
    """Return a sweep of 252 designs of which some are buried deeper than they are high."""
    return grid(site="embedment_depth: [1.0 m, 1.7 m, 2.3 m, 3.0 m]")


def same_bits(one: pa.Table, other: pa.Table) -> bool:
    """Whether two tables hold the same bits: names, types, nulls, words, and floats down to the sign of zero."""
    if one.schema.names != other.schema.names or len(one) != len(other):
        return False
    return all(_same_column(one[name], other[name]) for name in one.schema.names)


def _same_column(one: pa.ChunkedArray, other: pa.ChunkedArray) -> bool:
    """Whether two columns hold the same bits."""
    if one.type != other.type or one.is_null().to_pylist() != other.is_null().to_pylist():
        return False
    if pa.types.is_floating(one.type):
        left, right = (column.fill_null(0.0).to_numpy().view(np.int64) for column in (one, other))
        return bool(np.array_equal(left, right))
    return one.to_pylist() == other.to_pylist()
