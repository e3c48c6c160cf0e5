"""The designs of a trade between speed and accuracy, and how long it takes to simulate them."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings
from boulder_sweep.judge.pilot import simulated
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.tradeoff.points import Point, Way, compared

if TYPE_CHECKING:
    from boulder_sweep.judge.judged import Judged

FEWEST_DESIGNS = 64
"""Designs, at least, that are simulated with sums over elements, which take up to a thousand times as long."""
ELEMENTS_AS_FAST = 16
"""Number of elements up to which all designs are."""
_SHORTEST_TIMING_S = 0.05


class Sample:
    """The designs that all ways simulate."""

    def __init__(
        self, table: DesignTable, bed_offset: np.ndarray, readings: Readings, limits: Limits, horizon: float
    ) -> None:
        self.table, self.bed_offset = table, bed_offset
        self.readings, self.limits, self.horizon = readings, limits, horizon

    def solve(
        self, step_s: float, elements: int = 0, *, error_estimate: bool = False, locate_yield: bool = False
    ) -> OutcomeTable:
        """Simulate the designs."""
        control = Control(step_s, self.horizon, self.limits.rotation, elements, error_estimate, True, locate_yield)
        return simulated(self.table, self.readings, control)

    def judged(self, outcomes: OutcomeTable) -> Judged:
        """Return their verdicts."""
        return judge(outcomes, self.table.L, self.bed_offset, self.limits)

    def measured(self, way: Way, known: OutcomeTable, accuracy: str) -> Point:
        """Simulate the designs in one way, long enough to time it, and compare."""
        rows = _part(self.table.L.size, way.soil_elements)
        fewer = Sample(_rows(self.table, rows), self.bed_offset[rows], self.readings, self.limits, self.horizon)
        spent, best = 0.0, math.inf
        fewer.first().solve(1e-3 * way.step_ms, way.soil_elements)  # compiles, and fills the caches
        while spent < _SHORTEST_TIMING_S:
            begun = time.thread_time()
            out = fewer.solve(
                1e-3 * way.step_ms,
                way.soil_elements,
                error_estimate=way.error_estimate,
                locate_yield=way.locate_yield,
            )
            took = time.thread_time() - begun
            spent, best = spent + took, min(best, took)
        ref = OutcomeTable(*(column[rows] for column in known))
        return compared(way, accuracy, 1e6 * best / len(rows), (out, fewer.judged(out)), (ref, fewer.judged(ref)))

    def first(self) -> Sample:
        """Return a sample of the first design alone."""
        return Sample(_rows(self.table, np.arange(1)), self.bed_offset[:1], self.readings, self.limits, self.horizon)


def _part(count: int, elements: int) -> np.ndarray:
    """Rows of the sample that are simulated with so many elements, spread evenly."""
    wanted = count if not elements else max(FEWEST_DESIGNS, count * ELEMENTS_AS_FAST // elements)
    return np.unique(np.linspace(0, count - 1, min(wanted, count)).astype(np.int64))


def _rows(table: DesignTable, rows: np.ndarray) -> DesignTable:
    return DesignTable(*(np.ascontiguousarray(column[rows]) for column in table))
