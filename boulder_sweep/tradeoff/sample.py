"""The sample of designs of a trade-off study, and the time it takes to simulate them."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from boulder_kernels import Control, OutcomeTable, Readings
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST
from boulder_sweep.judge.pilot import simulated
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.tradeoff.points import Method, Point, compared

if TYPE_CHECKING:
    from boulder_sweep.judge.inputs import Designs
    from boulder_sweep.judge.judged import Judged

FEWEST_DESIGNS = 64
"""Smallest number of designs for sums over elements, which cost up to a thousand times as much."""
_SHORTEST_TIMING_S = 0.05


class Sample:
    """The designs that all methods simulate."""

    def __init__(self, designs: Designs, readings: Readings, limits: Limits, control: Control) -> None:
        self.designs, self.readings, self.limits, self.control = designs, readings, limits, control

    def solve(
        self, step_s: float, elements: int = 0, *, error_estimate: bool = False, locate_yield: bool = False
    ) -> OutcomeTable:
        """Simulate the designs."""
        control = self.control._replace(
            h=step_s, elements=elements, error_estimate=error_estimate, locate_yield=locate_yield
        )
        return simulated(self.designs, self.readings, control)

    def judged(self, outcomes: OutcomeTable, step_s: float) -> Judged:
        """Return their verdicts."""
        return judge(outcomes, self.designs, self.limits, step_s)

    def measured(self, method: Method, known: OutcomeTable, accuracy: str) -> Point:
        """Simulate the designs by one method, long enough to time it, and compare."""
        rows = _part(self.designs.size, method.soil_elements)
        fewer = self.rows(rows)
        spent, best = 0.0, math.inf
        fewer.rows(np.arange(1)).solve(1e-3 * method.step_ms, method.soil_elements)  # compiles, and fills the caches
        while spent < _SHORTEST_TIMING_S:
            begun = time.thread_time()
            out = fewer.solve(
                1e-3 * method.step_ms,
                method.soil_elements,
                error_estimate=method.error_estimate,
                locate_yield=method.locate_yield,
            )
            took = time.thread_time() - begun
            spent, best = spent + took, min(best, took)
        ref = type(known)(*(column[rows] for column in known))
        step_s = 1e-3 * method.step_ms
        both = (out, fewer.judged(out, step_s)), (ref, fewer.judged(ref, step_s))
        return compared(method, accuracy, 1e6 * best / len(rows), *both)

    def rows(self, chosen: np.ndarray) -> Sample:
        """Return a sample of some of the designs, by their places."""
        return Sample(self.designs.rows(chosen), self.readings, self.limits, self.control)


def _part(count: int, elements: int) -> np.ndarray:
    """Rows of the sample that are simulated with so many elements, spread evenly."""
    wanted = count if not elements else max(FEWEST_DESIGNS, count * ELEMENTS_AS_FAST // elements)
    return np.unique(np.linspace(0, count - 1, min(wanted, count)).astype(np.int64))
