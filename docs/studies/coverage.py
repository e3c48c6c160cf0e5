"""How often the estimated error of a design covers its true error, and how large the true errors are."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, Status, as_printed, corrected, simulate_table
from boulder_sweep.judge.accuracy import LADDER, STEPS, STEPS_PRINTED, Steps, finer_step
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.settings import load
from docs.studies.random_designs import random_designs

PRESETS: dict[str, Readings] = {"corrected": corrected(), "as printed": as_printed()}
LIMIT = math.radians(20.0)
HORIZON_S = 1.0
REFERENCE_STEP_S = 5e-5
ROUNDING_RAD, ROUNDING_M = 1e-11, 1e-11
"""Errors below these are rounding, of the reference as well."""
NUMBERS = tuple(steps for steps in LADDER if finer_step(steps.step_s) in (0.006, 0.003, 0.0005, 0.000125))
"""Some of those that an accuracy given as a number may come to."""


LEAST, LEAST_UNCONFIRMED = 0.99, 0.98
"""Least share of the errors that must be covered, and the share for one solution as printed."""


@dataclass(frozen=True)
class Coverage:
    """Estimated and true errors of some designs, by one reading and one step.

    Attributes
    ----------
    designs : str
        Which designs.
    readings, accuracy : str
        How they were read, and what was asked for.
    steps : Steps
        Of the accuracy, and whether the yield is located.
    steps_s : tuple of float
        Steps of the solutions that every design has [s].
    standing : int
        Designs that turn no further than the limit.
    rotation : float
        Share of them whose estimated error of the rotation is no smaller than the true one.
    displacement : float
        Share of all designs whose estimated error of the displacements is no smaller than the true one.
    largest_miss_deg : float
        Largest error of the rotation that is not covered [deg].
    p99_9_deg, largest_deg : float
        True errors of the rotation: 99.9 % of the standing designs, and the largest [deg].
    p99_9_m, largest_m : float
        The same of the displacements, over all designs whose verdict is not undecided [m].
    flips : int
        Designs that come down on the wrong side of the limit without being undecided.
    undecided : int
        Designs nearer to the limit than their estimated error.
    """

    designs: str
    readings: str
    accuracy: str
    steps: Steps
    steps_s: tuple[float, ...]
    standing: int
    rotation: float
    displacement: float
    largest_miss_deg: float
    p99_9_deg: float
    largest_deg: float
    p99_9_m: float
    largest_m: float
    flips: int
    undecided: int

    @property
    def is_enough(self) -> bool:
        """Whether so many estimated errors hold as must."""
        unconfirmed = self.accuracy == "fast" and self.readings != "corrected"
        return min(self.rotation, self.displacement) >= (LEAST_UNCONFIRMED if unconfirmed else LEAST)


def random_table(count: int, seed: int) -> DesignTable:
    """Return random realistic designs as columns."""
    designs = random_designs(count, seed)
    return DesignTable(*(np.array(column, dtype=float) for column in zip(*designs, strict=True)))


def grid_table(path: Path, count: int) -> DesignTable:
    """Return a sample of the designs of a file."""
    return sampled_designs(load(path), count).table


def coverages(tables: dict[str, DesignTable]) -> Iterator[Coverage]:
    """Yield one entry for each set of designs, preset and accuracy.

    Parameters
    ----------
    tables
        Sets of designs by what they are called.
    """
    for designs, table in tables.items():
        for preset, readings in PRESETS.items():
            known = _solved(table, readings, Steps(REFERENCE_STEP_S, locate_yield=True), estimate=False)
            named = STEPS if readings.restoring_gravity else STEPS_PRINTED
            for accuracy, steps in [*named.items(), *(("a number", steps) for steps in NUMBERS)]:
                paired = accuracy == "a number" or not readings.restoring_gravity
                finer_s = finer_step(steps.step_s)
                steps_s = (steps.step_s, finer_s) if paired else (finer_s,)
                if accuracy == "fast":
                    steps_s = (steps.step_s,)
                found = _solved(table, readings, steps, estimate=accuracy != "fast", paired=paired)
                yield _compared(designs, preset, accuracy, steps, steps_s, found, known)


def _solved(
    table: DesignTable, readings: Readings, steps: Steps, *, estimate: bool, paired: bool = False
) -> OutcomeTable:
    """Simulate a table of designs."""
    control = Control(steps.step_s, HORIZON_S, LIMIT, 0, estimate, True, steps.locate_yield, paired=paired)
    return simulate_table(table, readings, control)


def _compared(
    designs: str,
    readings: str,
    accuracy: str,
    steps: Steps,
    steps_s: tuple[float, ...],
    found: OutcomeTable,
    known: OutcomeTable,
) -> Coverage:
    """Compare estimated with true errors."""
    computed = np.isfinite(found.theta_max) & np.isfinite(known.theta_max)
    fell, falls = found.status == Status.LIMIT, known.status == Status.LIMIT
    standing = computed & ~fell & ~falls
    alike = computed & (fell == falls)
    unsure = computed & ~fell & (LIMIT - found.theta_max < found.theta_error)
    rotation = np.abs(found.theta_max - known.theta_max)
    x = np.maximum(np.abs(found.x_b_max - known.x_b_max), np.abs(found.x_v_max - known.x_v_max))
    missed = standing & (rotation > found.theta_error + ROUNDING_RAD)
    missed_x = alike & (x > found.x_error + ROUNDING_M)
    decided = x[alike & ~unsure]
    degrees = np.degrees(rotation[standing])
    return Coverage(
        designs=designs,
        readings=readings,
        accuracy=accuracy,
        steps=steps,
        steps_s=steps_s,
        standing=int(standing.sum()),
        rotation=1.0 - float(missed.sum() / max(standing.sum(), 1)),
        displacement=1.0 - float(missed_x.sum() / max(alike.sum(), 1)),
        largest_miss_deg=math.degrees(float(rotation[missed].max(initial=0.0))),
        p99_9_deg=float(np.quantile(degrees, 0.999, method="higher")),
        largest_deg=float(degrees.max()),
        p99_9_m=float(np.quantile(decided, 0.999, method="higher")),
        largest_m=float(decided.max()),
        flips=int((computed & (fell != falls) & ~unsure).sum()),
        undecided=int(unsure.sum()),
    )
