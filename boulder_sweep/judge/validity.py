"""Flags on rows outside what the model was tested on. They do not change a verdict.

This is the one register of what they mean: the words of the column ``validity`` in summaries and pictures, and the page
of the documentation follow from it. `boulder_kernels.rules` raises them. What the two crash tests of the paper cover is
taken from their data (`boulder_sweep.crash_tests.cases`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_kernels._jit import plain
from boulder_kernels.rules import FlagInputs, Tested, flags_of
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
    """

    name: str
    meaning: str
    raised_where: str
    why: str


def usual_range(name: str) -> tuple[float, float]:
    """Range met in practice, from the register of settings, rounding allowed for."""
    usual = BY_NAME[name].usual
    if usual is None:
        raise KeyError(name)
    return usual.low * (1.0 - 1e-9), usual.high * (1.0 + 1e-9)


_SIZES = [usual_range(f"boulder_{side}_m") for side in ("length", "width", "height")]
_EMBEDMENT, _ROCK = usual_range("embedment_ratio"), usual_range("boulder_density_kg_m3")

FLAGS = (
    Flag(
        "crush",
        "more crush than the vehicle's front is calibrated for",
        "`vehicle_crush_m` above `vehicle.calibrated_crush` (1 m)",
        "After about 1 m of crush the chassis stiffens, as the paper says, and the model parts from the test on the "
        "unsafe side. A second spring does not move the limit: the file says how far both are calibrated.",
    ),
    Flag(
        "rotation",
        "more rotation than in the test that passed",
        f"rotation above {TESTED_ROTATION_DEG['corrected']:g}° "
        f"({TESTED_ROTATION_DEG['as_printed']:g}° where a reading is printed)",
        "The larger boulder of the paper passed its test; the model turns it by so much. Between that and the limit "
        "no test supports the model.",
    ),
    Flag(
        "size",
        "a boulder of unusual size",
        "length, width or height outside " + ", ".join(f"{low:.1f} to {high:.1f} m" for low, high in _SIZES),
        "Slabs and pebbles are not what the model was made for. The boulders tested are 0.76 and 1.65 m long, 1.02 and "
        "1.68 m wide, 2.2 and 3.44 m high.",
    ),
    Flag(
        "embedment",
        "an unusual embedment",
        f"embedment depth over height outside {_EMBEDMENT[0]:.2g} to {_EMBEDMENT[1]:.2g}",
        "The boulders tested have 0.55 and 0.59. The range is that of usual embedments.",
    ),
    Flag(
        "rock_density",
        "a density that rock does not have",
        f"boulder density outside {_ROCK[0]:.0f} to {_ROCK[1]:.0f} kg/m³",
        "The granites tested have 2596 and 3074 kg/m³; lighter sound rock is rare.",
    ),
    Flag(
        "soil_pair",
        "soil constants that do not belong together",
        f"subgrade reaction above {FAMILY_FACTOR:g} times the API curve, or below Terzaghi's value for the friction "
        f"angle divided by {FAMILY_FACTOR:g}",
        "Friction angle and subgrade reaction of one soil rise together. The paper's own pair lies on the API curve. "
        "The factor is a judgement.",
    ),
    Flag(
        "overlap",
        "less overlap with the bumper than tested",
        f"top of the boulder less than {TESTED_OVERLAP_M:g} m over the underside of the bumper",
        "The tests had 0.49 m and 0.91 m. With less the truck may ride over, which the planar model cannot show.",
    ),
    Flag(
        "unproved",
        "no proof that the rotation stays below its limit",
        "restoring moment or separation read as printed, not overturned up to the longest horizon",
        "Forces read as printed feed energy into the motion, so nothing is proved of later times. A table leaves such "
        "rows undecided; answers and comparisons of readings count them as passing.",
    ),
)
"""In the order of the kernels, and of the column."""
BY_FLAG = {flag.name: flag for flag in FLAGS}


def largest_tested_rotation(preset: str) -> float:
    """Return the rotation that a test supports [rad]; of mixed readings the least."""
    return math.radians(TESTED_ROTATION_DEG.get(preset, min(TESTED_ROTATION_DEG.values())))


def tested_of(calibrated_crush: float, rotation: float) -> Tested:
    """Return what the model was tested on; arguments: see `boulder_sweep.judge.verdict.Limits`."""
    ranges = [end for low_high in (*_SIZES, _EMBEDMENT, _ROCK) for end in low_high]
    return Tested(calibrated_crush, rotation, TESTED_OVERLAP_M, *ranges)


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
    outcomes, designs, limits, table = facts.outcomes, facts.designs, facts.limits, facts.designs.table
    rocks = table.rho_b if designs.rocks is None else designs.rocks
    soil = run_by_run(lambda phi: family_bounds(np.degrees(phi)), table.phi)
    reached = outcomes.status, outcomes.crush_max, outcomes.theta_max, facts.overlap
    rows = FlagInputs(*reached, table.L, table.W, table.H, table.d, rocks, table.beta, *soil)
    bits = plain(flags_of)(rows, tested_of(limits.calibrated_crush, limits.tested_rotation))
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
