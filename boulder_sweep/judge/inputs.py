"""Designs as the judge takes them, whole blocks and samples of a sweep.

They are in the units of the kernels, with what only the verdict asks for beside.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels.design import FAR, HEIGHT, NEAR, WIDTH
from boulder_sweep.columns import BOULDER_MASS, SHAPES
from boulder_sweep.designs import LEAST_SOLIDITY, LEAST_TAPED, solidity_of
from boulder_sweep.settings.model import Model
from boulder_sweep.soils import plain, with_law, with_shape, with_soil
from boulder_sweep.stones.taped import taped_profiles

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.settings import Sweep

SOURCES = {
    "L": "boulder_length_m",
    "W": "boulder_width_m",
    "H": "boulder_height_m",
    "rho_b": "boulder_density_kg_m3",
    "d": "embedment_depth_m",
    "e": "impact_height_m",
    "rho_s": "soil_density_kg_m3",
    "phi": "friction_angle_deg",
    "beta": "subgrade_reaction_MN_m3",
    "K_epsilon": "strain_rate_factor",
    "m_v": "vehicle_mass_kg",
    "v_0": "impact_speed_m_s",
    "k_v": "vehicle_spring_N_m",
    "c_v": "vehicle_damper_N_s_m",
    "e_bumper": "bumper_height_m",
}
"""Column of the table that each field of a `DesignTable` comes from; only the angle changes its unit."""


NO_OUTLINES = np.empty((0, 0, 4))


class Designs(NamedTuple):
    """Designs that can be computed, n of them."""

    table: DesignTable
    """What the kernels simulate: contiguous float64 arrays of shape (n,); SI, phi in rad, beta in MN/m^3. Where the
    soil is not the same at every depth, or boulders are no boxes, a `PiecewiseTable`, whose other fields hold the
    uppermost layer."""
    bed_offset: np.ndarray
    """Distance from the front bumper to the leading edge of the cargo bed [m], shape (n,)."""
    fills: np.ndarray | None = None
    """`solidity` where the file gives masses or a shape; None of boxes."""
    rocks: np.ndarray | None = None
    """Density of the rock where the file gives masses, so that what is simulated has another [kg/m^3]."""
    factors: np.ndarray | None = None
    """Strain rate factor as given, where `table` has it scaled for soil model, slope and water; else None."""
    shape: int = -1
    """Which of `SHAPES` stands for boulders as taped and weighed; -1 where none does."""

    @property
    def size(self) -> int:
        """Number of designs in the block."""
        return len(self.bed_offset)

    def rows(self, chosen: np.ndarray | slice) -> Designs:
        """Return some of the designs, chosen by a mask, by their indices or by a slice."""
        table = type(self.table)(*(np.ascontiguousarray(column[chosen]) for column in self.table))
        given = (self.fills, self.rocks, self.factors)
        fills, rocks, factors = (None if values is None else values[chosen] for values in given)
        return Designs(table, self.bed_offset[chosen], fills, rocks, factors, self.shape)

    @property
    def given_factors(self) -> np.ndarray:
        """Strain rate factor as given [-], shape (n,)."""
        return self.table.K_epsilon if self.factors is None else self.factors

    @property
    def solidity(self) -> np.ndarray:
        """Volume of each boulder over the volume of the box of its sides, shape (n,)."""
        return np.ones(self.size) if self.fills is None else self.fills

    @property
    def taped(self) -> np.ndarray:
        """Which of them are known by sizes and mass only, so that a family of shapes stands for each, bool, (n,)."""
        known = self.rocks is None or self.has_outlines
        return np.zeros(self.size, dtype=bool) if known else (self.solidity >= LEAST_TAPED) & ~self.has_known_shape

    def in_shape(self, shape: int, model: Model) -> Designs:
        """Return boulders that are all `taped` by the shape of this number, in the soil of a model."""
        assert self.rocks is not None  # taped boulders are weighed
        given = plain(self.table)._replace(rho_b=self.rocks, K_epsilon=self.given_factors)
        table = with_shape(given, model.resistance, model.ground, SHAPES[shape], self.solidity)
        return self._replace(table=table, factors=self.given_factors, shape=shape)

    def under(self, law: str, model: Model) -> Any:
        """Return the designs as the kernels take them, by another soil model than they have; none is `taped`."""
        if not self.has_outlines:
            return with_law(self.table, law, model.resistance)
        model = replace(model, resistance=law)
        if self.shape >= 0:
            return self.in_shape(self.shape, model).table
        given = plain(self.table)._replace(K_epsilon=self.given_factors)
        return with_soil(given, law, model.ground, shape=model.shape)

    @property
    def narrowest(self) -> np.ndarray:
        """Least width of each boulder, whatever shape stands for it [m], shape (n,)."""
        table: Any = self.table
        if self.has_outlines:
            return np.asarray(table.outlines[:, :, WIDTH].min(axis=1))
        taped = self.taped
        if not taped.any():
            return np.asarray(table.W)
        shares = taped_profiles(SHAPES[0], self.solidity)[:, :, WIDTH].min(axis=1)
        return np.where(taped, shares * table.W, table.W)

    @property
    def length(self) -> np.ndarray:
        """Distance from where the vehicle strikes each boulder to its far face, where that is farthest [m], (n,)."""
        table: Any = self.table
        if not self.has_outlines:
            return self.table.L
        outlines = table.outlines
        blow = np.minimum(table.d + table.e, table.H)
        near = [np.interp(z, one[:, HEIGHT], one[:, NEAR]) for z, one in zip(blow, outlines, strict=True)]
        return np.array(near) + outlines[:, :, FAR].max(axis=1)

    @property
    def has_outlines(self) -> bool:
        """Whether what is simulated are no boxes."""
        return getattr(self.table, "outlines", NO_OUTLINES).shape[1] > 0

    @property
    def has_known_shape(self) -> np.ndarray:
        """Whether what is simulated has the shape of each boulder, bool, shape (n,)."""
        return (self.solidity >= LEAST_SOLIDITY) | self.has_outlines


def designs_of(block: DesignBlock, rows: np.ndarray | None = None, model: Model | None = None) -> Designs:
    """Return the designs of a block, or some of its n rows (bool or indices), as the kernels take them.

    The model says what is not in the block: the law of the soil's resistance, its layers, water, cohesion and slope,
    and the shape of the boulders. By default it has the paper's law, the usual soil, and boxes.
    """
    model = model or Model()
    shape = model.shape
    columns = {field: _values(block, source, rows) for field, source in SOURCES.items()}
    columns["phi"] = np.radians(columns["phi"])
    fills, rocks = None, None
    if not shape.is_box:
        fills = np.full(len(columns["L"]), shape.filled)
    if BOULDER_MASS in block.columns:
        mass, sides = _values(block, BOULDER_MASS, rows), (columns["L"], columns["W"], columns["H"])
        rocks = columns["rho_b"]
        fills = solidity_of(mass, rocks, *sides)
        # What is simulated has the mass of the boulder.
        volume = sides[0] * sides[1] * sides[2]
        columns["rho_b"] = mass / (volume * shape.filled)
    given = DesignTable(**columns)
    table = with_soil(given, model.resistance, model.ground, shape=shape)
    factors = None if table is given else given.K_epsilon
    return Designs(table, _values(block, "bed_offset_m", rows), fills, rocks, factors)


def _values(block: DesignBlock, name: str, rows: np.ndarray | None) -> np.ndarray:
    """Values of one input column, one a row."""
    values = block.columns[name].to_numpy()
    return np.ascontiguousarray(values if rows is None else values[rows], dtype=np.float64)


MOST_CORNERS = 64
"""Corners of a grid that a sample holds at most."""


def sampled_rows(sweep: Sweep, count: int) -> np.ndarray:
    """Return the numbers of about so many rows of a sweep, int64, ascending, each once; all if it has no more.

    They are the corners of the grid, and rows along a sequence that fills all axes evenly at once (every axis is cut
    into as many strata as it has values). A list of designs has one axis.
    """
    lengths = sweep.plan.lengths
    if sweep.n_designs <= count:
        return np.arange(sweep.n_designs)
    corners = _corners(lengths, min(count, MOST_CORNERS))
    spread = _spread(lengths, count - len(corners))
    rows = np.concatenate([np.array(corners, dtype=np.int64).reshape(-1, len(lengths)), spread]) @ np.array(
        sweep.plan.strides, dtype=np.int64
    )
    return np.unique(rows)


def _corners(lengths: tuple[int, ...], most: int) -> list[tuple[int, ...]]:
    """Indices of the corners; if there are too many, both ends and their neighbours along one axis."""
    ends = [(0, length - 1) if length > 1 else (0,) for length in lengths]
    if math.prod(len(pair) for pair in ends) <= most:
        return list(product(*ends))
    first, last = tuple(pair[0] for pair in ends), tuple(pair[-1] for pair in ends)
    corners = [first, last]
    for axis in range(len(ends)):
        corners.append((*first[:axis], last[axis], *first[axis + 1 :]))
        corners.append((*last[:axis], first[axis], *last[axis + 1 :]))
    return corners[:most]


def _spread(lengths: tuple[int, ...], count: int) -> np.ndarray:
    """Indices along Roberts' sequence, whose steps are powers of the root of x^(k+1) = x + 1, shape (count, k)."""
    k = len(lengths)
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (k + 1))
    steps = root ** -np.arange(1.0, k + 1.0)
    along = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    sizes = np.array(lengths, dtype=np.int64)
    return np.minimum((along * sizes).astype(np.int64), sizes - 1)


def sampled_designs(sweep: Sweep, count: int) -> Designs:
    """Return about this many designs of a sweep, without those that cannot be computed."""
    block = sweep.plan.selection(sampled_rows(sweep, count))
    return designs_of(block, block.reasons.codes == 0, sweep.model)
