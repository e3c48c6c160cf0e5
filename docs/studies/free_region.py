"""Where a pass needs no second opinion: designs drawn inside the free region, and a search for the worst of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from boulder_kernels import DesignTable
from boulder_sweep import elementary
from boulder_sweep.investigation import family_bounds
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import FREE, FREE_EMBEDMENT, FREE_ROTATION_DEG, is_free
from boulder_sweep.settings.model import SECOND_OPINIONS
from docs.studies.forms import (
    BED_OFFSET_M,
    BUMPER_M,
    SEED,
    SPEEDS,
    by_second_opinion,
    drawn_of_grid,
    grid_evaluation,
)

LEAST = 5000
"""Passes that are drawn, at least."""
AT_ONCE = 20_000
"""Designs drawn at once."""
AT_AN_END = 0.5
"""Probability that an input lies at an end of its range, where the corners are drawn."""
SEARCHES, CLIMBERS, TURNS = 3, 100, 40
"""Searches for the worst design, the designs that each goes on with, and how often it changes them."""
FARTHEST, NEARER, CHANGED = 0.25, 0.93, 0.3
"""Deviation of the first changes, as a share of a range; its factor from turn to turn; share of inputs changed."""

RANGES = FREE | {"embedment_ratio": FREE_EMBEDMENT, "family": (0.0, 1.0)}
"""`family`: from the least subgrade reaction that goes with the friction angle to the largest, by the logarithm."""


def designs_at(shares: np.ndarray) -> Designs:
    """Return designs by where each input lies within its range, shape (n, number of ranges), from 0 to 1."""
    low, high = np.array(list(RANGES.values())).T
    columns = dict(zip(RANGES, np.ascontiguousarray((low + (high - low) * shares).T), strict=True))
    d = columns["H"] * columns.pop("embedment_ratio")
    least, most = family_bounds(np.degrees(columns["phi"]))
    beta = least * elementary.exp(columns.pop("family") * elementary.log(most / least))
    bumper = np.full(len(shares), BUMPER_M)
    return Designs(DesignTable(**columns, d=d, beta=beta, e_bumper=bumper), np.full(len(shares), BED_OFFSET_M))


def small_passes(shares: np.ndarray, evaluation: Evaluation) -> tuple[np.ndarray, Designs]:
    """Return the places of designs that pass with no more rotation than the free region has, and these designs."""
    designs = designs_at(shares)
    hit = np.flatnonzero(designs.table.H - designs.table.d > designs.table.e)
    judged = evaluation.judged(designs.rows(hit))
    rotation = judged["max_rotation_deg"] + judged["rotation_error_deg"]
    places = hit[(judged.verdict == PASS) & (rotation <= FREE_ROTATION_DEG)]
    return places, designs.rows(places)


def cornered(rng: np.random.Generator) -> np.ndarray:
    """Draw places of designs with half of the inputs at an end of their range."""
    shares = rng.random((AT_ONCE, len(RANGES)))
    return np.where(rng.random(shares.shape) < AT_AN_END, np.round(shares), shares)


@cache
def drawn(grid: Path, draw: Callable[[np.random.Generator], np.ndarray], least: int) -> tuple[np.ndarray, Designs]:
    """Return passes of little rotation, at least so many: their places and designs."""
    rng, evaluation = np.random.default_rng(SEED), grid_evaluation(grid)
    found: list[np.ndarray] = []
    while sum(map(len, found)) < least:
        shares = draw(rng)
        found.append(shares[small_passes(shares, evaluation)[0]])
    shares = np.concatenate(found)
    return shares, designs_at(shares)


def largest_rotations(designs: Designs, evaluation: Evaluation) -> np.ndarray:
    """Return the larger of the rotations under both second opinions [deg], shape (n,), up to the proof or the limit."""
    found = [by_second_opinion(designs, law, evaluation).theta_max for law in SECOND_OPINIONS]
    return np.degrees(np.maximum.reduce(found))


def worst_found(grid: Path, seed: int) -> float:
    """Return the largest rotation under a second opinion that a search inside the free region finds [deg].

    Each of the designs that turn furthest is changed a little, again and again, and the change kept where the design
    still turns no more than the free region allows by the model and further under a second opinion.
    """
    evaluation = grid_evaluation(grid)
    shares, designs = drawn(grid, cornered, LEAST)
    rotation = largest_rotations(designs, evaluation)
    best = np.argsort(-rotation, kind="stable")[:CLIMBERS]
    shares, rotation = shares[best], rotation[best]
    rng = np.random.default_rng(seed)
    for turn in range(TURNS):
        changed = rng.random(shares.shape) < CHANGED
        tried = shares + FARTHEST * NEARER**turn * rng.standard_normal(shares.shape) * changed
        tried = np.clip(tried, 0.0, 1.0)
        places, passes = small_passes(tried, evaluation)
        further = largest_rotations(passes, evaluation)
        places, further = places[further > rotation[places]], further[further > rotation[places]]
        shares[places], rotation[places] = tried[places], further
    return float(rotation.max())


def ranges_words() -> str:
    """Return the free region in words."""

    def span(name: str, unit: str, scale: float = 1.0) -> str:
        low, high = (f"{end / scale:.4g}" for end in FREE[name])
        return f"{low} to {high}{unit}"

    return (
        f"largest rotation at most {FREE_ROTATION_DEG:g}°, φ′ {span('phi', '°', np.radians(1.0))}, depth over height "
        f"{FREE_EMBEDMENT[0]:g} to {FREE_EMBEDMENT[1]:g}, length {span('L', ' m')}, width {span('W', ' m')}, height "
        f"{span('H', ' m')}, rock {span('rho_b', ' kg/m³')}, soil {span('rho_s', ' kg/m³')}, K_ε "
        f"{span('K_epsilon', '')}, no flag `soil_pair`; impact height {span('e', ' m')}, truck "
        f"{span('m_v', ' t', 1e3)}, {span('v_0', ' m/s')}, spring {span('k_v', ' kN/m', 1e3)}, damper "
        f"{span('c_v', ' kN s/m', 1e3)}."
    )


def region_words(grid: Path) -> str:
    """Return the free region and what a search for its worst design finds, in words."""
    worst = max(worst_found(grid, SEED + n) for n in range(SEARCHES))
    passes, _ = drawn_of_grid(grid, SPEEDS["M30"])
    little = grid_evaluation(grid).judged(passes)["max_rotation_deg"] <= FREE_ROTATION_DEG
    share = (little & is_free(passes.table)).mean()
    return (
        f"The free region: {ranges_words()} The worst design that {SEARCHES} searches find in it turns by {worst:.1f}° "
        f"under a second opinion. {share:.0%} of the passes of M30 lie in it."
    )
