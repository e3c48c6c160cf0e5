"""How well the shapes of a boulder as taped and weighed stand for stones: their verdicts beside the stone's own."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.columns import BOULDER_MASS, SHAPES
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import SIDES, DesignBlock, block_of
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.settings.model import ProfilePoint, Shape
from boulder_sweep.soils import with_soil
from boulder_sweep.stones.rock import LEAST_FOOT, ROCKS
from docs.studies.forms import BED_OFFSET_M, BUMPER_M, HOOD_M, grid_evaluation

STONES = 300
SEED = 20
PIECES = 16
AROUND = 96
"""Points of a section."""
FILLS = (0.45, 0.95)
"""Fill of the stones."""
PLAN, UPRIGHT = (2.0, 12.0), (1.0, 12.0)
"""Exponents of sections, from an ellipse to nearly a rectangle, and of the sides over the height."""
CUT = (0.3, 1.0)
"""Where the foot is cut, below the middle, as a share of where it has half the sides of the middle."""
NOISE = 0.06
"""Standard deviation of the radius of a section, as a share, in waves around it and along the height."""
TAPE_M = 0.05
"""To what a tape is read."""
NEAR = (0.85, 1.15)
"""Depths, over the least at which the stone passes by its own profile."""
RATIOS = (0.15, 0.9)
"""Embedments between which that depth is looked for, over the height."""
RANGES = {
    "boulder_density_kg_m3": (2300.0, 2900.0),
    "soil_density_kg_m3": (1600.0, 2200.0),
    "friction_angle_deg": (32.0, 44.0),
    "impact_speed_m_s": (8.0, 16.0),
}
SIZES = {"boulder_length_m": (0.9, 2.0), "boulder_width_m": (0.9, 2.5), "boulder_height_m": (1.8, 3.5)}


class Stones(NamedTuple):
    """Stones on flat feet, n of them, in sites near the limit."""

    given: dict[str, np.ndarray]
    """Inputs by the columns of the table, the taped sizes among them, shape (n,)."""
    outlines: np.ndarray
    """Their own outlines, see `boulder_kernels.design`, shape (n, P, 4)."""


def stone(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return the profile of a stone in shares of its overall sizes, shape (P, 4), and its fill.

    A superellipsoid of random exponents, the radius of which has noise, is cut flat below, where its section has at
    least half the sides of the largest. As in a scan,
    a section becomes the rectangle of its area, middle and proportions.
    """
    while True:
        plan, upright = np.exp(rng.uniform(*np.transpose(np.log([PLAN, UPRIGHT]))))
        heights = np.linspace(-rng.uniform(*CUT) * (1.0 - LEAST_FOOT**upright) ** (1.0 / upright), 1.0, PIECES + 1)
        size = (1.0 - np.abs(heights) ** upright).clip(0.0) ** (1.0 / upright)
        angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
        cos, sin = np.cos(angle), np.sin(angle)
        radius = (np.abs(cos) ** plan + np.abs(sin) ** plan) ** (-1.0 / plan)
        noise = np.zeros((PIECES + 1, AROUND))
        for wave in range(1, 6):
            for along in range(3):
                phase, shift = rng.uniform(0.0, 2.0 * np.pi, 2)
                waves = np.cos(wave * angle + phase)[None, :] * np.cos(np.pi * along * heights + shift)[:, None]
                noise += rng.normal(0.0, NOISE / 2.0) * waves / np.sqrt(wave)
        radius = size[:, None] * radius * (1.0 + noise)
        x, y = radius * cos, radius * sin
        cross = x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y
        area = 0.5 * cross.sum(axis=1)
        safe = np.maximum(area, 1e-9)
        middle = ((x + np.roll(x, -1, axis=1)) * cross).sum(axis=1) / (6.0 * safe)
        middle[-1] = middle[-2]
        length, width = np.ptp(x, axis=1), np.ptp(y, axis=1)
        taped = np.ptp(x), np.ptp(y), heights[-1] - heights[0]
        shrink = np.sqrt(area / np.maximum(length * width, 1e-9))
        a, b = length * shrink / taped[0], width * shrink / taped[1]
        centre = (middle - middle[0]) / taped[0]
        share = (heights - heights[0]) / taped[2]
        profile = np.stack([share, b, 0.5 * a - centre, 0.5 * a + centre], axis=-1)
        shape = Shape(tuple(ProfilePoint(*point) for point in profile.tolist()))
        if shape.stands_flat and shape.stands_up and FILLS[0] <= shape.filled <= FILLS[1]:
            return profile, shape.filled


def blocks(stones: Stones, depth: np.ndarray) -> DesignBlock:
    """Return the stones as taped and weighed, at some depths [m]."""
    return block_of(stones.given | {"embedment_depth_m": depth})


def by_own_profile(stones: Stones, depth: np.ndarray, evaluation: Evaluation) -> Judged:
    """Judge stones by their own profiles at some depths [m]."""
    given = {name: values for name, values in stones.given.items() if name != BOULDER_MASS}
    designs, model = designs_of(block_of(given | {"embedment_depth_m": depth})), evaluation.model
    # The soil does not depend on the profile.
    any_shape = Shape(tuple(ProfilePoint(k / PIECES, 1.0 - 0.5 * k / PIECES, 0.5, 0.5) for k in range(PIECES + 1)))
    table = with_soil(designs.table, model.resistance, model.ground, shape=any_shape)._replace(outlines=stones.outlines)
    alone = replace(evaluation, control=evaluation.control._replace(side_by_side=False))
    return alone.judged(designs._replace(table=table))


def drawn(rng: np.random.Generator, count: int) -> Stones:
    """Return stones in random sites, the depth open."""
    given = {name: rng.uniform(*ends, count) for name, ends in (RANGES | SIZES).items()}
    given["subgrade_reaction_MN_m3"] = 60.0 * np.exp((given["friction_angle_deg"] - 38.0) / 8.0)
    vehicle = {
        "strain_rate_factor": 1.0,
        "vehicle_mass_kg": 6804.0,
        "vehicle_spring_N_m": 3103.3e3,
        "vehicle_damper_N_s_m": 138.91e3,
        "bumper_height_m": BUMPER_M,
        "hood_height_m": HOOD_M,
        "bed_offset_m": BED_OFFSET_M,
    }
    given |= {name: np.full(count, value) for name, value in vehicle.items()}
    each = [stone(rng) for _ in range(count)]
    profiles, fills = np.array([profile for profile, _ in each]), np.array([fill for _, fill in each])
    length, width, height = (given[side] for side in SIDES)
    given[BOULDER_MASS] = given["boulder_density_kg_m3"] * fills * length * width * height
    outlines = profiles * np.stack([height, width, length, length], axis=-1)[:, None, :]
    return Stones(given, outlines)


def some(stones: Stones, chosen: np.ndarray) -> Stones:
    """Return some of the stones."""
    return Stones({name: values[chosen] for name, values in stones.given.items()}, stones.outlines[chosen])


@cache
def near_the_limit(evaluation: Evaluation, count: int = STONES) -> tuple[Stones, np.ndarray]:
    """Return stones in sites near the limit: the depth is near the least at which each passes by its own profile."""
    rng = np.random.default_rng(SEED)
    stones = drawn(rng, 4 * count)
    low, high = (ratio * stones.given["boulder_height_m"] for ratio in RATIOS)
    high = np.minimum(
        high, stones.given["boulder_height_m"] - 1.1 * (BUMPER_M + evaluation.limits.criterion.min_overlap_m)
    )
    ends = [by_own_profile(stones, depth, evaluation).verdict == PASS for depth in (low, high)]
    kept = np.flatnonzero(~ends[0] & ends[1])[:count]
    stones, low, high = some(stones, kept), low[kept], high[kept]
    for _ in range(10):
        middle = 0.5 * (low + high)
        passes = by_own_profile(stones, middle, evaluation).verdict == PASS
        low, high = np.where(passes, low, middle), np.where(passes, middle, high)
    return stones, high * rng.uniform(*NEAR, len(kept))


def rounded(stones: Stones) -> Stones:
    """Return the stones with sizes as a tape gives them."""
    return stones._replace(
        given=stones.given | {side: np.round(stones.given[side] / TAPE_M) * TAPE_M for side in SIDES}
    )


@cache
def verdicts(grid: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return which stones pass by their own profile, and by what may stand for them, bool, shape (n,) each."""
    evaluation = replace(grid_evaluation(grid), second_opinion=())
    stones, depth = near_the_limit(evaluation)
    block = blocks(stones, depth)
    designs = evaluation.designs(block)
    found = {
        "the worst of the three shapes": evaluation(block),
        f"the same, sizes taped to {100.0 * TAPE_M:g} cm": evaluation(blocks(rounded(stones), depth)),
    }
    alone = replace(evaluation, control=evaluation.control._replace(side_by_side=False))
    for number, shape in enumerate(SHAPES):
        found[shape.replace("_", " ")] = alone.judged(designs.in_shape(number, evaluation.model))
    box = stones.given | {"embedment_depth_m": depth, "boulder_density_kg_m3": designs.table.rho_b}
    found["the box of its sizes and mass"] = evaluation(block_of({k: v for k, v in box.items() if k != BOULDER_MASS}))
    own = by_own_profile(stones, depth, evaluation).verdict == PASS
    return own, {name: judged.verdict == PASS for name, judged in found.items()}


def rocks_table() -> Table:
    """Return the densities of kinds of rock."""
    table = Table(("`boulder.rock`", "from, kg/m³", "mostly", "to"))
    for name, (low, mode, high) in ROCKS.items():
        table.add(f"`{name}`", *(f"{value:.0f}" for value in (low, mode, high)))
    return table


def taped_table(grid: Path) -> Table:
    """Return how verdicts differ from those by the stones' own profiles."""
    own, found = verdicts(grid)
    table = Table(("in place of the boulder itself", "passes where it fails", "does not pass where it does"))
    for name, passes in found.items():
        unsafe, lost = (f"{100.0 * np.mean(those):.1f} %" for those in (passes & ~own, own & ~passes))
        table.add(name, unsafe, lost)
    return table


def taped_words(grid: Path) -> str:
    """Return what the table is about."""
    own, _ = verdicts(grid)
    stones, _ = near_the_limit(replace(grid_evaluation(grid), second_opinion=()))
    length, width, height = (stones.given[side] for side in SIDES)
    fills = stones.given[BOULDER_MASS] / (stones.given["boulder_density_kg_m3"] * length * width * height)
    return (
        f"{own.size} generated boulders fill {fills.min():.0%} to {fills.max():.0%} of their sizes, half of them "
        f"{np.quantile(fills, 0.25):.0%} to {np.quantile(fills, 0.75):.0%}; by their own profiles {own.sum()} pass."
    )
