"""Where a pass needs no second opinion: designs drawn inside the free region, and a search for the worst of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from scipy.stats import beta as beta_distribution

from boulder_kernels import DesignTable
from boulder_sweep import elementary
from boulder_sweep.crash_tests.tables import Table
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
    robust,
)
from docs.studies.random_designs import RANGES

LEAST = 5000
"""Passes that are drawn, at least."""
AT_ONCE = 20_000
"""Designs drawn at once."""
CONFIDENCE = 0.95
AT_AN_END = 0.5
"""Probability that an input lies at an end of its range, where the corners are drawn."""
SEARCHES, CLIMBERS, TURNS = 3, 100, 40
"""Searches for the worst design, the designs that each goes on with, and how often it changes them."""
FARTHEST, NEARER, CHANGED = 0.25, 0.93, 0.3
"""Deviation of the first changes, as a share of a range; its factor from turn to turn; share of inputs changed."""

Ranges = dict[str, tuple[float, float]]
FREE_RANGES: Ranges = FREE | {"embedment_ratio": FREE_EMBEDMENT, "family": (0.0, 1.0)}
"""`family`: from the least subgrade reaction that goes with the friction angle to the largest, by the logarithm."""
USUAL_RANGES: Ranges = FREE_RANGES | {
    **{name: RANGES[name] for name in ("L", "W", "H", "embedment_ratio")},
    "phi": (np.radians(RANGES["phi_deg"][0]), np.radians(RANGES["phi_deg"][1])),
}
"""All usual boulders and soils, with the other inputs of the free region."""


def designs_at(shares: np.ndarray, ranges: Ranges) -> Designs:
    """Return designs by where each input lies within its range, shape (n, number of ranges), from 0 to 1."""
    low, high = np.array(list(ranges.values())).T
    columns = dict(zip(ranges, np.ascontiguousarray((low + (high - low) * shares).T), strict=True))
    d = columns["H"] * columns.pop("embedment_ratio")
    least, most = family_bounds(np.degrees(columns["phi"]))
    beta = least * elementary.exp(columns.pop("family") * elementary.log(most / least))
    bumper = np.full(len(shares), BUMPER_M)
    return Designs(DesignTable(**columns, d=d, beta=beta, e_bumper=bumper), np.full(len(shares), BED_OFFSET_M))


def small_passes(shares: np.ndarray, ranges: Ranges, evaluation: Evaluation) -> tuple[np.ndarray, Designs]:
    """Return the places of designs that pass with no more rotation than the free region has, and these designs."""
    designs = designs_at(shares, ranges)
    hit = np.flatnonzero(designs.table.H - designs.table.d > designs.table.e)
    judged = evaluation.judged(designs.rows(hit))
    rotation = judged["max_rotation_deg"] + judged["rotation_error_deg"]
    places = hit[(judged.verdict == PASS) & (rotation <= FREE_ROTATION_DEG)]
    return places, designs.rows(places)


def even(rng: np.random.Generator, count: int, axes: int) -> np.ndarray:
    """Draw places of designs evenly."""
    return rng.random((count, axes))


def cornered(rng: np.random.Generator, count: int, axes: int) -> np.ndarray:
    """Draw places of designs with half of the inputs at an end of their range."""
    shares = rng.random((count, axes))
    return np.where(rng.random(shares.shape) < AT_AN_END, np.round(shares), shares)


@cache
def drawn(
    grid: Path, draw: Callable[..., np.ndarray], ranges: tuple[tuple[str, tuple[float, float]], ...], least: int
) -> tuple[np.ndarray, Designs]:
    """Return passes of little rotation, at least so many: their places and designs."""
    rng, evaluation = np.random.default_rng(SEED), grid_evaluation(grid)
    found: list[np.ndarray] = []
    while sum(map(len, found)) < least:
        shares = draw(rng, AT_ONCE, len(ranges))
        found.append(shares[small_passes(shares, dict(ranges), evaluation)[0]])
    shares = np.concatenate(found)
    return shares, designs_at(shares, dict(ranges))


def most_lost(lost: int, count: int) -> float:
    """Return the upper bound of a share by Clopper and Pearson, of which `lost` of `count` were seen."""
    return float(beta_distribution.ppf(CONFIDENCE, lost + 1, count - lost))


def largest_rotations(designs: Designs, evaluation: Evaluation) -> np.ndarray:
    """Return the larger of the rotations under both second opinions [deg], shape (n,), up to the proof or the limit."""
    found = [by_second_opinion(designs, law, evaluation).theta_max for law in SECOND_OPINIONS]
    return np.degrees(np.maximum.reduce(found))


def worst_found(grid: Path, least: int, seed: int = SEED, climbers: int = CLIMBERS, turns: int = TURNS) -> float:
    """Return the largest rotation under a second opinion that a search inside the free region finds [deg].

    Each of the designs that turn furthest is changed a little, again and again, and the change kept where the design
    still turns no more than the free region allows by the model and further under a second opinion.
    """
    evaluation, ranges = grid_evaluation(grid), FREE_RANGES
    shares, designs = drawn(grid, cornered, tuple(ranges.items()), least)
    rotation = largest_rotations(designs, evaluation)
    best = np.argsort(-rotation, kind="stable")[:climbers]
    shares, rotation = shares[best], rotation[best]
    rng = np.random.default_rng(seed)
    for turn in range(turns):
        changed = rng.random(shares.shape) < CHANGED
        tried = shares + FARTHEST * NEARER**turn * rng.standard_normal(shares.shape) * changed
        tried = np.clip(tried, 0.0, 1.0)
        places, passes = small_passes(tried, ranges, evaluation)
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


def region_table(grid: Path, least: int = LEAST) -> Table:
    """Return how many passes of little rotation are lost in the free region, at its corners, and outside it."""
    table = Table(("drawn from", "passes", "lost", "at most (95 %)", "largest rotation [°]"))
    evaluation = grid_evaluation(grid)
    for words, draw, ranges in (
        ("the free region", even, FREE_RANGES),
        ("the same, half of the inputs at an end of their range", cornered, FREE_RANGES),
        ("all usual boulders and soils", even, USUAL_RANGES),
    ):
        _, designs = drawn(grid, draw, tuple(ranges.items()), least)
        count, lost = designs.size, int(np.count_nonzero(~robust(designs, evaluation)))
        largest = float(largest_rotations(designs, evaluation).max())
        table.add(words, str(count), str(lost), f"{most_lost(lost, count):.2%}", f"{largest:.1f}")
    return table


def region_words(grid: Path, least: int = LEAST) -> str:
    """Return the free region and what a search for its worst design finds, in words."""
    worst = max(worst_found(grid, least, SEED + n) for n in range(SEARCHES))
    passes, _ = drawn_of_grid(grid, SPEEDS["M30"])
    little = grid_evaluation(grid).judged(passes)["max_rotation_deg"] <= FREE_ROTATION_DEG
    share = (little & is_free(passes.table)).mean()
    return (
        f"The free region: {ranges_words()} The worst design that {SEARCHES} searches find in it turns by {worst:.1f}° "
        f"under a second opinion. {share:.0%} of the passes of M30 lie in it."
    )
