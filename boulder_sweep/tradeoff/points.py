"""One method of simulating a sample: its cost, and its error against a far finer solution."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, OutcomeTable, Readings, Status
from boulder_kernels.control import STEP_RATIO
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST, simulated
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import FAIL, PASS, UNDECIDED, Judged
from boulder_sweep.judge.verdict import Limits, judge

FEWEST_DESIGNS = 64
"""Smallest number of designs for sums over elements, which cost up to a thousand times as much."""
_SHORTEST_TIMING_S = 0.05
ROUNDING_DEG = 1e-9
"""Errors below it are rounding, of the finer solution as well [deg]."""


class Method(NamedTuple):
    """How designs are simulated."""

    readings: str
    """``corrected``, ``as_printed``, or ``mixed``: the readings of the file."""
    soil_elements: int
    """N; 0 for the closed form."""
    step_ms: float
    locate_yield: bool
    """Whether steps end where the soil yields."""
    error_estimate: bool
    """Whether a solution by a third of the step is reported, with an error that a second solution gives or confirms."""
    checked: bool = False
    """Whether only doubtful designs have a second solution, as by a named accuracy; else all have one, by the step."""

    @property
    def is_plain(self) -> bool:
        """Whether it is what a file gets with ``solver: {step: ...}`` and the soil in closed form."""
        return not (self.soil_elements or self.locate_yield or self.error_estimate)

    @property
    def soil(self) -> str:
        """Representation of the soil in words."""
        return f"N = {self.soil_elements}" if self.soil_elements else "closed form"

    @property
    def steps(self) -> str:
        """Steps in words."""
        steps = " + ".join(f"{step:g}" for step in self.steps_ms) + " ms"
        return f"{steps}, yield located" if self.locate_yield else steps

    @property
    def steps_ms(self) -> tuple[float, ...]:
        """Steps of the solutions that every design has [ms]."""
        if not self.error_estimate:
            return (self.step_ms,)
        return (self.finer_step_ms,) if self.checked else (self.step_ms, self.finer_step_ms)

    @property
    def finer_step_ms(self) -> float:
        """Step of the solution that is reported where errors are estimated [ms]."""
        return self.step_ms / STEP_RATIO


@dataclass
class Point:
    """Cost and accuracy of one method.

    Parameters
    ----------
    method
        How the designs were simulated.
    accuracy
        Named accuracy that uses this method; empty where none does.
    designs
        Designs of the sample.
    cpu_us
        CPU time per design, one core [us].
    rotation_rms_deg, rotation_p99_deg, rotation_max_deg
        Error of the largest rotation, over the designs that neither solution stopped at the limit [deg].
    displacement_rms_m, displacement_p99_m, displacement_max_m
        Error of the largest displacement of boulder or truck, the larger, over the designs that both solutions or
        neither stopped at the limit [m].
    flips
        Designs that pass by one solution and fail by the other.
    undecided
        Designs left undecided.
    not_computed
        Designs that the finer solution has and this one has not.
    estimated_p99_9_deg
        99.9 % quantile of the estimated errors of the rotation [deg], over the designs that were not stopped at the
        limit: what to ask for to get these steps. NaN without an estimate, and where the error of more is not known.
    covered
        Share of the designs that neither solution stopped at the limit whose estimated error is no smaller than their
        error. NaN without an estimate.
    pareto
        Whether no other method with these readings is both cheaper and more accurate (rotation, 99 %).
    """

    method: Method
    accuracy: str
    designs: int
    cpu_us: float
    rotation_rms_deg: float
    rotation_p99_deg: float
    rotation_max_deg: float
    displacement_rms_m: float
    displacement_p99_m: float
    displacement_max_m: float
    flips: int
    undecided: int
    not_computed: int
    estimated_p99_9_deg: float
    covered: float
    pareto: bool = False

    @property
    def can_be_asked_for(self) -> bool:
        """Whether settings can ask for these steps with errors: by a name, or by the error that most designs keep."""
        return self.method.error_estimate and (bool(self.accuracy) or math.isfinite(self.estimated_p99_9_deg))

    def to_dict(self) -> dict[str, object]:
        """Return one row of the table of results; None where there is no value."""
        values = {name: None if value != value else value for name, value in vars(self).items() if name != "method"}
        return {**self.method._asdict(), **values}


@dataclass(frozen=True)
class SampledDesigns:
    """The designs that all methods simulate, and how their outcomes are judged."""

    designs: Designs
    readings: Readings
    limits: Limits
    control: Control

    def solve(self, method: Method) -> OutcomeTable:
        """Simulate the designs by one method, whatever readings it names."""
        control = self.control._replace(
            h=1e-3 * method.step_ms,
            elements=method.soil_elements,
            error_estimate=method.error_estimate,
            locate_yield=method.locate_yield,
            paired=not method.checked,
        )
        return simulated(self.designs, self.readings, control)

    def measured(self, method: Method, known: OutcomeTable, accuracy: str) -> Point:
        """Simulate the designs by one method, long enough to time it, and compare."""
        rows = _part(self.designs.size, method.soil_elements)
        fewer = self.rows(rows)
        spent, best = 0.0, math.inf
        fewer.rows(np.arange(1)).solve(method)  # compiles, and fills the caches
        while spent < _SHORTEST_TIMING_S:
            begun = time.thread_time()
            out = fewer.solve(method)
            took = time.thread_time() - begun
            spent, best = spent + took, min(best, took)
        ref = type(known)(*(column[rows] for column in known))
        both = ((outcome, judge(outcome, fewer.designs, self.limits)) for outcome in (out, ref))
        return compared(method, accuracy, 1e6 * best / len(rows), *both)

    def rows(self, chosen: np.ndarray) -> SampledDesigns:
        """Return a sample of some of the designs, by their indices."""
        return replace(self, designs=self.designs.rows(chosen))


def _part(count: int, elements: int) -> np.ndarray:
    """Rows of the sample that are simulated with so many elements, spread evenly."""
    wanted = count if not elements else max(FEWEST_DESIGNS, count * ELEMENTS_AS_FAST // elements)
    return np.unique(np.linspace(0, count - 1, min(wanted, count)).astype(np.int64))


def compared(
    method: Method,
    accuracy: str,
    cpu_us: float,
    solved: tuple[OutcomeTable, Judged],
    known: tuple[OutcomeTable, Judged],
) -> Point:
    """Compare the outcomes of one method with those of a far finer solution.

    Parameters
    ----------
    method, accuracy, cpu_us
        As of `Point`.
    solved, known
        Outcomes and verdicts of this method and of the finer solution, n designs each.
    """
    (out, judged), (ref, truth) = solved, known
    limit = Status.LIMIT
    both = np.isfinite(out.theta_max) & np.isfinite(ref.theta_max)
    standing = both & (out.status != limit) & (ref.status != limit)
    alike = both & ((out.status == limit) == (ref.status == limit))
    errors = np.degrees(np.abs(out.theta_max - ref.theta_max))[standing]
    boulder, truck = np.abs(out.x_b_max - ref.x_b_max), np.abs(out.x_v_max - ref.x_v_max)
    verdicts = judged.verdict, truth.verdict
    estimated_p99_9_deg, covered = _estimates(method, out, errors, standing)
    decided = np.isin(verdicts[0], (PASS, FAIL)) & np.isin(verdicts[1], (PASS, FAIL))
    return Point(
        method,
        accuracy,
        len(out.status),
        cpu_us,
        *_sizes(errors),
        *_sizes(np.maximum(boulder, truck)[alike]),
        flips=int((decided & (verdicts[0] != verdicts[1])).sum()),
        undecided=int((verdicts[0] == UNDECIDED).sum()),
        not_computed=int((np.isfinite(ref.theta_max) & ~np.isfinite(out.theta_max)).sum()),
        estimated_p99_9_deg=estimated_p99_9_deg,
        covered=covered,
    )


def _sizes(errors: np.ndarray) -> tuple[float, float, float]:
    """Return root mean square, 99 % quantile and largest of some errors; zeros where there are none."""
    if not errors.size:
        return 0.0, 0.0, 0.0
    return (
        float(np.sqrt(np.mean(errors**2))),
        float(np.quantile(errors, 0.99, method="higher")),
        float(errors.max()),
    )


def _estimates(method: Method, out: OutcomeTable, errors: np.ndarray, standing: np.ndarray) -> tuple[float, float]:
    """Quantile of the estimated errors [deg], and how often they cover the errors of the standing designs."""
    if not method.error_estimate:
        return math.nan, math.nan
    estimated = np.degrees(out.theta_error[standing])
    if not estimated.size:
        return 0.0, 1.0
    covers = estimated + ROUNDING_DEG >= errors
    largest = float(np.quantile(estimated, 0.999, method="higher"))
    return largest if math.isfinite(largest) else math.nan, float(np.mean(covers))


def mark_front(points: Iterable[Point]) -> None:
    """Mark the points that no other one with the same readings beats in both cost and accuracy."""
    points = list(points)
    for point in points:
        rivals = (p for p in points if p.method.readings == point.method.readings and p is not point)
        point.pareto = not any(
            p.cpu_us <= point.cpu_us and p.rotation_p99_deg <= point.rotation_p99_deg for p in rivals
        )
