"""Flags on rows outside what the model was tested on. They change no verdict, but some of them a grade.

This is the one register of what they mean: the words of the column ``validity`` in summaries and pictures, and the page
of the documentation follow from it. `boulder_kernels.rules` raises them, all but ``changes_side``, for which a design
has to be judged more than once (`boulder_sweep.judge.quantiles`). What the two crash tests of the paper cover is taken
from their data (`boulder_sweep.crash_tests.cases`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_kernels.numerics import records_of
from boulder_kernels.outcomes import empty_outcomes
from boulder_kernels.rules import FLAGS as RAISED
from boulder_kernels.rules import ISLAND_SLIDE, UNSTUDIED, FlagInputs, FlagRange, TestedRange, write_flags
from boulder_sweep.investigation import FAMILY_FACTOR, family_bounds
from boulder_sweep.judge.judged import CHANGES_SIDE
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Ground

TESTED_OVERLAP_M = 0.49
"""Overlap of bumper and boulder in the tests: 0.492 m and 0.91 m."""
TESTED_ROTATION_DEG = {"corrected": 13.8, "as_printed": 7.7}
"""Rotation of the boulder that passed its test, by the model itself [deg]; the measured one is not in the text."""
SEPARATOR = ";"
NOT_A_RATING = "a simulation, not a rating by test"
"""Stands beside every pass and every rating."""


@dataclass(frozen=True)
class Flag:
    """One flag, by its name in the column."""

    name: str
    meaning: str
    """What is outside, in words that follow "passes with"."""
    raised_where: str
    """The condition on which it is raised."""
    why: str
    """Why it matters, and where the threshold comes from."""


def _usual_range(name: str) -> tuple[float, float]:
    """Range met in practice, from the register of settings, rounding allowed for."""
    usual = BY_NAME[name].usual
    assert usual is not None
    return _rounded(usual.low, usual.high)


def _rounded(low: float, high: float) -> tuple[float, float]:
    """Return the ends of a range, with room for values that were rounded."""
    return low * (1.0 - 1e-9), high * (1.0 + 1e-9)


VEHICLE = {
    "m_v": (5000.0, 9000.0),
    "v_0": (11.0, 18.0),
    "k_v": (0.75 * 3103.3e3, 1.25 * 3103.3e3),
    "c_v": (0.75 * 138.91e3, 1.25 * 138.91e3),
}
"""Vehicles from which the study of second opinions draws, about the one that was tested, SI."""
RATE = (math.sqrt(VEHICLE["k_v"][0] / VEHICLE["m_v"][1]), math.sqrt(VEHICLE["k_v"][1] / VEHICLE["m_v"][0]))
"""Angular frequency sqrt(k/m) of these vehicles [1/s]."""
DAMPING = (
    VEHICLE["c_v"][0] / math.sqrt(VEHICLE["k_v"][1] * VEHICLE["m_v"][1]),
    VEHICLE["c_v"][1] / math.sqrt(VEHICLE["k_v"][0] * VEHICLE["m_v"][0]),
)
"""Damper of these vehicles over sqrt(k m) [-]."""
NOWHERE = 1e9
"""A friction angle that no soil has [deg]."""
_SIZES = [_usual_range(f"boulder_{side}_m") for side in ("length", "width", "height")]
_EMBEDMENT, _ROCK = _usual_range("embedment_ratio"), (2400.0, 3074.0)
_ANGLE, _SOIL = _usual_range("friction_angle_deg"), _usual_range("soil_density_kg_m3")
_RATE_FACTOR = _usual_range("strain_rate_factor")

FLAGS = (
    Flag(
        "crush",
        "more crush than the vehicle's front is calibrated for",
        "`vehicle_crush_m` above `vehicle.calibrated_crush` (1 m)",
        "After about 1 m of crush the chassis stiffens, as the paper says, and the model parts from the test on the "
        "unsafe side.",
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
        "The boulders tested have 0.55 and 0.59. The range covers usual embedments.",
    ),
    Flag(
        "rock_density",
        "rock lighter or heavier than the study's",
        f"boulder density outside {_ROCK[0]:.0f} to {_ROCK[1]:.0f} kg/m³",
        "The granites tested have 2596 and 3074 kg/m³, and the study of second opinions draws from this range. Some "
        "limestones are lighter.",
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
        "slides",
        "a boulder that slides",
        f"displacement above {ISLAND_SLIDE:g} m",
        "Shallow boulders may stop a truck by sliding with it, and overturn in better soil or by a slower truck, which "
        "does not push them aside. The boulder that passed its test moves by 0.28 m in the model.",
    ),
    Flag(
        "vehicle",
        "a vehicle unlike the one that was tested",
        f"mass outside {VEHICLE['m_v'][0]:.0f} to {VEHICLE['m_v'][1]:.0f} kg, speed outside {VEHICLE['v_0'][0]:g} to "
        f"{VEHICLE['v_0'][1]:g} m/s, √(k/m) outside {RATE[0]:.1f} to {RATE[1]:.1f} 1/s, or c/√(k m) outside "
        f"{DAMPING[0]:.2f} to {DAMPING[1]:.2f}",
        "Spring and damper were fitted to one truck of 6.8 t at 13.4 m/s, and no other was tested. The ranges are "
        "those from which the study of second opinions draws.",
    ),
    Flag(
        "soil",
        "a soil outside the realistic range",
        f"friction angle outside {_ANGLE[0]:.0f} to {_ANGLE[1]:.0f}°, density outside {_SOIL[0]:.0f} to "
        f"{_SOIL[1]:.0f} kg/m³, or strain rate factor outside {_RATE_FACTOR[0]:.1f} to {_RATE_FACTOR[1]:.1f}, in any "
        "layer",
        "From loose sand to very dense gravel. Beyond, resistance grows without bound with the friction angle, and no "
        "soil is known to gain more strength under rapid loading.",
    ),
    Flag(
        CHANGES_SIDE,
        "a verdict that changes with the uncertain inputs",
        "another verdict with the uncertain inputs at their 5 %, at their mean or at their 95 % quantiles",
        "The design has the worst of the verdicts. Shallow boulders may pass in weak soil, by sliding, and fail in "
        "better soil. How likely a pass is, `sweep uncertainty` says.",
    ),
)
"""The flags in the order of the kernels and of the column."""
_UNSTUDIED = sum(1 << RAISED.index(name) for name in UNSTUDIED)
"""Bits of the flags of designs that the study of second opinions does not speak for."""
BY_FLAG = {flag.name: flag for flag in FLAGS}


def largest_tested_rotation(preset: str) -> float:
    """Return the rotation that a test supports [rad]; of mixed readings the least."""
    return math.radians(TESTED_ROTATION_DEG.get(preset, min(TESTED_ROTATION_DEG.values())))


def tested_of(calibrated_crush: float, rotation: float, *, odd_layers: bool) -> TestedRange:
    """Return what the model was tested on; arguments: see `boulder_sweep.judge.verdict.Limits`."""
    # No friction angle of the uppermost layer makes up for deeper ones.
    angle = (NOWHERE, NOWHERE) if odd_layers else _ANGLE
    vehicle = (_rounded(*VEHICLE["m_v"]), _rounded(*RATE), _rounded(*DAMPING), _rounded(*VEHICLE["v_0"]))
    ranges = (*_SIZES, _EMBEDMENT, _ROCK, *vehicle, angle, _SOIL, _RATE_FACTOR)
    least, most = (FlagRange(*ends) for ends in zip(*ranges, strict=True))
    return TestedRange(calibrated_crush, rotation, TESTED_OVERLAP_M, least, most)


def has_odd_layers(ground: Ground) -> bool:
    """Return whether a deeper layer of the soil has a friction angle or density outside the realistic range."""

    def outside(value: float, ends: tuple[float, float]) -> bool:
        return not ends[0] <= value <= ends[1]

    return any(outside(one.friction_angle_deg, _ANGLE) or outside(one.density_kg_m3, _SOIL) for one in ground.layers)


def run_by_run(function: Callable[[np.ndarray], np.ndarray], column: np.ndarray) -> np.ndarray:
    """Return a function of n values, one along its last axis for each, computed once for neighbours that are equal.

    Values such as a soil's seldom change from one design of a grid to the next.
    """
    starts = np.flatnonzero(column[1:] != column[:-1]) + 1
    if 4 * len(starts) >= len(column):
        return function(column)
    starts = np.concatenate([[0], starts])
    return np.repeat(function(column[starts]), np.diff(starts, append=len(column)), axis=-1)


def _bits(designs: Any, limits: Any, counted: np.ndarray, overlap: np.ndarray) -> np.ndarray:
    """Return the flags of n designs as bits, from what they reach: the first arguments of `write_flags`."""
    table = designs.table
    rocks = table.rho_b if designs.rocks is None else designs.rocks
    least_beta, most_beta = run_by_run(lambda phi: family_bounds(np.degrees(phi)), table.phi)
    vehicle = (table.m_v, table.v_0, table.k_v, table.c_v)
    sizes = (table.L, table.W, table.H, table.d, rocks, table.beta, least_beta, most_beta)
    soil = (np.degrees(table.phi), table.rho_s, designs.given_factors)
    tested = tested_of(limits.calibrated_crush, limits.tested_rotation, odd_layers=limits.odd_layers)
    bits = np.empty(designs.size, dtype=np.int64)
    write_flags(counted, overlap, records_of(FlagInputs, (*sizes, *vehicle, *soil)), tested, bits)
    return bits


def are_studied(designs: Any, limits: Any) -> np.ndarray:
    """Return which of n designs lie where the study of second opinions has drawn, bool, shape (n,)."""
    nothing, enough = empty_outcomes(designs.size), np.full(designs.size, math.inf)
    return _bits(designs, limits, nothing, enough) & _UNSTUDIED == 0


def flagged(facts: Any, counted: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the column ``validity`` of n rows, of which this counts: codes, and the words they stand for."""
    bits = _bits(facts.designs, facts.limits, counted, facts.overlap)
    used = np.flatnonzero(np.bincount(bits, minlength=1))
    words = {mask: SEPARATOR.join(flag.name for k, flag in enumerate(FLAGS) if mask >> k & 1) for mask in used.tolist()}
    named = ("", *sorted(set(words.values()) - {""}))
    codes = np.zeros(1 << len(RAISED), dtype=np.int32)
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
