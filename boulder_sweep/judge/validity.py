"""Flags on rows outside what the model was tested on. They do not change a verdict.

This is the one register: the column ``validity``, its words in summaries and pictures, and the page of the
documentation follow from it. What the two crash tests of the paper cover is taken from their data
(`boulder_sweep.crash_tests.cases`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_kernels import Status
from boulder_sweep.investigation import FAMILY_FACTOR, family_bounds
from boulder_sweep.settings.fields import BY_NAME

TESTED_OVERLAP_M = 0.49
"""Overlap of bumper and boulder in the tests: 0.492 m and 0.91 m."""
TESTED_ROTATION_DEG = {"corrected": 13.8, "as_printed": 7.7}
"""Rotation of the boulder that passed its test, by the model itself [deg]; the measured one is not in the text."""
SEPARATOR = ";"
NOT_A_RATING = "a simulation, not a rating by test"
"""Stands beside every pass and every rating."""


@dataclass(frozen=True)
class Flag:
    """One flag.

    Attributes
    ----------
    name : str
        Its name in the column.
    meaning : str
        What is outside, in words that follow "passes with".
    raised_where : str
        The condition.
    why : str
        Why it matters, and where the threshold comes from.
    raised : callable
        From what is known of n rows (`boulder_sweep.judge.verdict.Facts`) to a mask, shape (n,).
    """

    name: str
    meaning: str
    raised_where: str
    why: str
    raised: Callable[[Any], np.ndarray]


def usual_range(name: str) -> tuple[float, float]:
    """Range met in practice, from the register of settings, rounding allowed for."""
    usual = BY_NAME[name].usual
    if usual is None:
        raise KeyError(name)
    return usual.low * (1.0 - 1e-9), usual.high * (1.0 + 1e-9)


def _outside(values: np.ndarray, low: float | np.ndarray, high: float | np.ndarray) -> np.ndarray:
    return (values < low) | (values > high)


_SIZES = {side: usual_range(f"boulder_{name}_m") for side, name in (("L", "length"), ("W", "width"), ("H", "height"))}
_EMBEDMENT, _ROCK = usual_range("embedment_ratio"), usual_range("boulder_density_kg_m3")

FLAGS = (
    Flag(
        "crush",
        "more crush than the vehicle's front is calibrated for",
        "`vehicle_crush_m` above `vehicle.calibrated_crush` (1 m)",
        "After about 1 m of crush the chassis stiffens, as the paper says, and the model parts from the test on the "
        "unsafe side. A second spring does not move the limit: the file says how far both are calibrated.",
        lambda facts: facts.outcomes.crush_max > facts.limits.calibrated_crush,
    ),
    Flag(
        "rotation",
        "more rotation than in the test that passed",
        f"rotation above {TESTED_ROTATION_DEG['corrected']:g}° "
        f"({TESTED_ROTATION_DEG['as_printed']:g}° where a reading is printed)",
        "The larger boulder of the paper passed its test; the model turns it by so much. Between that and the limit "
        "no test supports the model.",
        lambda facts: facts.outcomes.theta_max > facts.limits.tested_rotation,
    ),
    Flag(
        "size",
        "a boulder of unusual size",
        "length, width or height outside " + ", ".join(f"{low:.1f} to {high:.1f} m" for low, high in _SIZES.values()),
        "Slabs and pebbles are not what the model was made for. The boulders tested are 0.76 and 1.65 m long, 1.02 and "
        "1.68 m wide, 2.2 and 3.44 m high.",
        lambda facts: np.logical_or.reduce(
            [_outside(getattr(facts.designs.table, side), *ends) for side, ends in _SIZES.items()]
        ),
    ),
    Flag(
        "embedment",
        "an unusual embedment",
        f"embedment depth over height outside {_EMBEDMENT[0]:.2g} to {_EMBEDMENT[1]:.2g}",
        "The boulders tested have 0.55 and 0.59. The range is that of usual embedments.",
        lambda facts: _outside(facts.designs.table.d / facts.designs.table.H, *_EMBEDMENT),
    ),
    Flag(
        "rock_density",
        "a density that rock does not have",
        f"boulder density outside {_ROCK[0]:.0f} to {_ROCK[1]:.0f} kg/m³",
        "The granites tested have 2596 and 3074 kg/m³; lighter sound rock is rare.",
        lambda facts: _outside(
            facts.designs.table.rho_b if facts.designs.rocks is None else facts.designs.rocks, *_ROCK
        ),
    ),
    Flag(
        "soil_pair",
        "soil constants that do not belong together",
        f"subgrade reaction above {FAMILY_FACTOR:g} times the API curve, or below Terzaghi's value for the friction "
        f"angle divided by {FAMILY_FACTOR:g}",
        "Friction angle and subgrade reaction of one soil rise together. The paper's own pair lies on the API curve. "
        "The factor is a judgement.",
        lambda facts: _outside(
            facts.designs.table.beta, *run_by_run(lambda phi: family_bounds(np.degrees(phi)), facts.designs.table.phi)
        ),
    ),
    Flag(
        "overlap",
        "less overlap with the bumper than tested",
        f"top of the boulder less than {TESTED_OVERLAP_M:g} m over the underside of the bumper",
        "The tests had 0.49 m and 0.91 m. With less the truck may ride over, which the planar model cannot show.",
        lambda facts: facts.overlap < TESTED_OVERLAP_M,
    ),
    Flag(
        "unproved",
        "no proof that the rotation stays below its limit",
        "restoring moment or separation read as printed, not overturned up to the longest horizon",
        "Forces read as printed feed energy into the motion, so nothing is proved of later times. A table leaves such "
        "rows undecided; answers and comparisons of readings count them as passing.",
        lambda facts: np.asarray(facts.outcomes.status) == Status.UNPROVABLE,
    ),
)
"""In the order in which they stand in the column."""
BY_FLAG = {flag.name: flag for flag in FLAGS}


def run_by_run(function: Callable[[np.ndarray], np.ndarray], column: np.ndarray) -> np.ndarray:
    """Return a function of n values, computed once for neighbours that are equal.

    Parameters
    ----------
    function
        Takes values and returns numbers for each, along the last axis.
    column
        Values of shape (n,), such as those of a soil: from one design of a grid to the next they seldom change.
    """
    starts = np.flatnonzero(column[1:] != column[:-1]) + 1
    if 4 * len(starts) >= len(column):
        return function(column)
    starts = np.concatenate([[0], starts])
    return np.repeat(function(column[starts]), np.diff(starts, append=len(column)), axis=-1)


def flagged(facts: Any) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the column ``validity`` of n rows: codes, and the words they stand for."""
    bits = np.zeros(len(facts.verdict), dtype=np.uint16)
    for bit, flag in enumerate(FLAGS):
        bits |= flag.raised(facts).astype(np.uint16) << bit
    used = np.flatnonzero(np.bincount(bits, minlength=1))
    words = {mask: SEPARATOR.join(flag.name for k, flag in enumerate(FLAGS) if mask >> k & 1) for mask in used.tolist()}
    named = ("", *sorted(set(words.values()) - {""}))
    codes = np.zeros(1 << len(FLAGS), dtype=np.int32)
    for mask, word in words.items():
        codes[mask] = named.index(word)
    return codes.take(bits), named


def meanings(word: str) -> list[str]:
    """Return what the flags of one row say, in words."""
    return [BY_FLAG[name].meaning for name in word.split(SEPARATOR) if name]


def flag_counts(counts: Iterable[tuple[str, int]]) -> dict[str, int]:
    """Return how many rows have each flag, and under ``""`` how many have none, from counts of the column's words."""
    totals = dict.fromkeys(["", *BY_FLAG], 0)
    for word, count in counts:
        for name in word.split(SEPARATOR):
            totals[name] = totals.get(name, 0) + count
    return {name: count for name, count in totals.items() if count or not name}
