"""Speed against accuracy, measured on the designs of a sweep.

A sample of the grid, its corners included, is simulated by many methods: with longer and shorter steps, with the soil
in closed form and by sums over N elements, as printed and corrected. Each is compared with one far finer solution of
the same readings with the soil in closed form, the limit of the sums.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_kernels import OutcomeTable, Readings, Status, as_printed, corrected, simulate_table
from boulder_kernels._jit import plain
from boulder_kernels.control import STEP_RATIO
from boulder_kernels.settling import proof_is_possible
from boulder_sweep.drawing import draw
from boulder_sweep.errors import NothingToMeasureError
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST, STEPS, STEPS_PRINTED, Accuracy, Steps, readings_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import Designs, sampled_designs
from boulder_sweep.judge.judged import FAIL, PASS, UNDECIDED
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.locations import replacing

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

DESIGNS, SECONDS = 4096, 60.0
"""Designs of the sample, and time after which no new measurement is started [s]."""
STEPS_MS = (
    (False, False, (16.0, 12.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)),
    (True, False, (8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)),
    (False, True, (18.0, 12.0, 9.0, 6.0, 3.0)),
    (True, True, (12.0, 9.0, 6.0, 4.5, 3.0, 1.5, 0.75)),
)
"""Whether the yield is located, whether errors are estimated, and steps, then the longer of two solutions [ms]."""
ELEMENTS, STEPS_OF_SUMS_MS = (50, 200, 1000, 5000), (12.0, 4.0, 2.0)
FEWEST_DESIGNS = 64
"""Smallest number of designs for sums over elements, which cost up to a thousand times as much."""
REFERENCE_STEP_MS = 0.05
_SHORTEST_TIMING_S = 0.05


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
    def steps(self) -> str:
        """Steps of the solutions that every design has [ms], and ``y`` where the yield is located."""
        finer = self.step_ms / STEP_RATIO
        steps = ((finer,) if self.checked else (self.step_ms, finer)) if self.error_estimate else (self.step_ms,)
        return "+".join(f"{step:g}" for step in steps) + (" y" if self.locate_yield else "")


@dataclass
class Point:
    """Cost and accuracy of one method, measured on some designs."""

    method: Method
    accuracy: str
    """Named accuracy that uses this method; empty where none does."""
    designs: int
    cpu_us: float
    """CPU time per design, one core [us]."""
    rotation_p99_deg: float
    rotation_max_deg: float
    """Error of the largest rotation, over the designs that neither solution stopped at the limit [deg]."""
    displacement_p99_m: float
    displacement_max_m: float
    """Error of the largest displacement of boulder or truck, over the designs that both or neither stopped [m]."""
    flips: int
    """Designs that pass by one solution and fail by the other."""
    undecided: int
    estimated_p99_9_deg: float | None
    """99.9 % quantile of the estimated errors of the rotation, which asks for these steps [deg]; None: not known."""
    pareto: bool = False
    """Whether no other method with these readings is both cheaper and more accurate (rotation, 99 %)."""

    def to_dict(self) -> dict[str, Any]:
        """Return one row of the table."""
        values = asdict(self)
        return {**values.pop("method")._asdict(), **values}


@dataclass(frozen=True)
class Tradeoff:
    """Speed and accuracy of several methods, measured on one grid."""

    sweep: Sweep
    points: tuple[Point, ...]
    reference_deg: dict[str, float]
    """Largest difference between the reference solution and one with twice its step [deg], by readings."""
    left_out: int
    """How many methods there was no time for."""

    def write(self, folder: Path) -> list[Path]:
        """Write table and picture into a folder, and return the files: none where nothing was measured."""
        import pyarrow as pa  # heavy, and the measuring does without it
        import pyarrow.parquet as pq

        if not self.points:
            return []
        files = [folder / "tradeoff.parquet", folder / "tradeoff.png"]
        with replacing(files[0]) as file:
            pq.write_table(pa.Table.from_pylist([point.to_dict() for point in self.points]), file)
        draw("work_precision", "draw_tradeoff", self, files[1])
        return files


def measure(sweep: Sweep, *, designs: int = DESIGNS, seconds: float = SECONDS) -> Tradeoff:
    """Measure speed against accuracy on a sample of a sweep's designs, on which alone sample and errors depend.

    Readings, criterion and horizon of the sweep count; both presets are measured anyway. No new measurement is started
    after so many seconds. A `NothingToMeasureError` says that no design of the sample can be computed.
    """
    begun = time.monotonic()
    sweep = at_values(sweep)
    sweep.need_depth()
    sample = sampled_designs(sweep, designs)
    if not sample.size:
        raise NothingToMeasureError(
            f"{sweep.name}: none of the designs can be computed, so there is nothing to measure; "
            "the table of a run says why"
        )
    evaluation = evaluation_of(sweep, Accuracy("", Steps(1e-3 * REFERENCE_STEP_MS), error_estimate=False))
    evaluation.warm_up()
    points: list[Point] = []
    left_out, references = 0, {}
    presets = {"corrected": corrected(), "as_printed": as_printed()}
    for name, readings in ({sweep.model.preset: readings_of(sweep)} | presets).items():

        def solve(some: Designs, method: Method, readings: Readings = readings) -> OutcomeTable:
            how = evaluation.control._replace(
                h=1e-3 * method.step_ms,
                elements=method.soil_elements,
                error_estimate=method.error_estimate,
                locate_yield=method.locate_yield,
                paired=not method.checked,
            )
            return simulate_table(some.table, readings, how)

        known = None
        for method, accuracy in _methods(name, readings):
            if time.monotonic() - begun > seconds:
                left_out += 1
                continue
            if known is None:
                finest = Method(name, 0, REFERENCE_STEP_MS, locate_yield=True, error_estimate=False)
                known, twice = (solve(sample, finest._replace(step_ms=k * REFERENCE_STEP_MS)) for k in (1, 2))
                apart = np.abs(known.theta_max - twice.theta_max)
                references[name] = math.degrees(float(np.nanmax(apart, initial=0.0)))
            points.append(_measured(solve, sample, evaluation.limits, method, accuracy, known))
    mark_front(points)
    return Tradeoff(sweep, tuple(points), references, left_out)


def _methods(name: str, readings: Readings) -> Iterator[tuple[Method, str]]:
    """Yield the methods, and the named accuracies as they are computed by these readings; cheap ones first."""
    named = STEPS if readings.restoring_gravity else STEPS_PRINTED
    for located, estimate, steps in STEPS_MS:
        for step in steps:
            method_steps = Steps(1e-3 * step, located)
            these = [key for key, of in named.items() if of == method_steps and estimate == (key != "fast")]
            checked = estimate and bool(these) and plain(proof_is_possible)(readings)
            yield Method(name, 0, step, located, estimate, checked), "".join(these)
    yield from ((Method(name, elements, step, False, False), "") for elements in ELEMENTS for step in STEPS_OF_SUMS_MS)


def _measured(
    solve: Callable[[Designs, Method], OutcomeTable],
    designs: Designs,
    limits: Limits,
    method: Method,
    accuracy: str,
    known: OutcomeTable,
) -> Point:
    """Simulate designs by one method, long enough to time it, and compare with a far finer solution of all."""
    wanted = max(FEWEST_DESIGNS, designs.size * ELEMENTS_AS_FAST // max(method.soil_elements, ELEMENTS_AS_FAST))
    rows = np.unique(np.linspace(0, designs.size - 1, min(wanted, designs.size)).astype(np.int64))
    designs, ref = designs.rows(rows), type(known)(*(column[rows] for column in known))
    solve(designs.rows(np.arange(1)), method)  # compiles, and fills the caches
    spent, best = 0.0, math.inf
    while spent < _SHORTEST_TIMING_S:
        begun = time.thread_time()
        out = solve(designs, method)
        took = time.thread_time() - begun
        spent, best = spent + took, min(best, took)
    both = np.isfinite(out.theta_max) & np.isfinite(ref.theta_max)
    stopped, stopped_ref = out.status == Status.LIMIT, ref.status == Status.LIMIT
    standing, alike = both & ~stopped & ~stopped_ref, both & (stopped == stopped_ref)
    rotation = np.degrees(np.abs(out.theta_max - ref.theta_max))[standing]
    movement = np.maximum(np.abs(out.x_b_max - ref.x_b_max), np.abs(out.x_v_max - ref.x_v_max))[alike]
    verdict, truth = (judge(outcome, designs, limits).verdict for outcome in (out, ref))
    estimated = math.degrees(_quantile(out.theta_error[standing], 0.999)) if method.error_estimate else math.nan
    return Point(
        method,
        accuracy,
        len(rows),
        1e6 * best / len(rows),
        _quantile(rotation, 0.99),
        _quantile(rotation, 1.0),
        _quantile(movement, 0.99),
        _quantile(movement, 1.0),
        flips=int((np.isin(verdict, (PASS, FAIL)) & np.isin(truth, (PASS, FAIL)) & (verdict != truth)).sum()),
        undecided=int((verdict == UNDECIDED).sum()),
        estimated_p99_9_deg=estimated if math.isfinite(estimated) else None,
    )


def _quantile(errors: np.ndarray, share: float) -> float:
    """Return the quantile of some errors that is one of them; zero where there are none."""
    return float(np.quantile(errors, share, method="higher")) if errors.size else 0.0


def mark_front(points: Sequence[Point]) -> None:
    """Mark the points that no other one with the same readings beats in both cost and accuracy."""
    for point in points:
        rivals = [p for p in points if p.method.readings == point.method.readings and p is not point]
        point.pareto = not any(
            p.cpu_us <= point.cpu_us and p.rotation_p99_deg <= point.rotation_p99_deg for p in rivals
        )
