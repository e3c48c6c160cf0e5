"""Speed against accuracy, measured on the designs of a sweep.

A sample of the grid, its corners included, is simulated by many methods: with longer and shorter steps, with the soil
in closed form and by sums over N elements, as printed and corrected. Each is compared with one far finer solution of
the same readings with the soil in closed form, the limit of the sums.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import OutcomeTable, Readings, as_printed, corrected
from boulder_kernels._jit import plain
from boulder_kernels.settling import proof_is_possible
from boulder_sweep.drawing import draw
from boulder_sweep.errors import NothingToMeasureError
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Accuracy, Steps, readings_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.runner.pool import THREADING, pool
from boulder_sweep.store.files import replacing
from boulder_sweep.tradeoff.points import Method, Point, SampledDesigns, mark_front

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.settings import Sweep

DESIGNS = 4096
"""Designs of the sample."""
STEPS_MS = (16.0, 12.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)
STEPS_LOCATED_MS = (8.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5)
STEPS_WITH_ERROR_MS = (18.0, 12.0, 9.0, 6.0, 3.0)
STEPS_LOCATED_WITH_ERROR_MS = (12.0, 9.0, 6.0, 4.5, 3.0, 1.5, 0.75)
"""With an error estimate the longer steps of the two solutions [ms]."""
STEPS_OF_SUMS_MS = (12.0, 4.0, 2.0)
ELEMENTS = (50, 200, 1000, 5000)
REFERENCE_STEP_S = 5e-5
SECONDS = 60.0
TARGETS_DEG = (0.1, 0.01, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Tradeoff:
    """What was measured.

    Parameters
    ----------
    sweep
        The sweep.
    points
        Every method, in the order they were measured.
    reference_deg
        Largest difference between the reference solution and one with twice its step [deg], by readings.
    left_out
        Ways for which the time did not suffice.
    """

    sweep: Sweep
    points: tuple[Point, ...]
    reference_deg: dict[str, float]
    left_out: tuple[Method, ...]

    reference_step_ms = 1e3 * REFERENCE_STEP_S

    @property
    def own_readings(self) -> str:
        """Readings of the sweep itself."""
        return self.sweep.model.preset

    def best(self, wanted_deg: float, *, error_estimate: bool) -> Point | None:
        """Return the cheapest method with the readings of the sweep whose largest error keeps to an angle [deg].

        Parameters
        ----------
        wanted_deg
            The angle.
        error_estimate
            Whether to choose among methods that estimate the error of every design, or among plain steps.
        """
        fit = [
            point
            for point in self._points_of_sweep()
            if (point.can_be_asked_for if error_estimate else point.method.is_plain)
            and point.rotation_max_deg <= wanted_deg
            and not point.flips
        ]
        return min(fit, key=lambda point: point.cpu_us, default=None)

    def recommendation(self) -> list[str]:
        """Return what to use for which accuracy on this grid, and what it costs, in sentences."""
        if not self.points:
            return ["Nothing was measured: the time limit was too short."]
        asked = self.sweep.solver.accuracy
        targets = (asked, *TARGETS_DEG) if isinstance(asked, float) else TARGETS_DEG
        by_words: dict[str, list[str]] = {}
        for target in dict.fromkeys(targets):
            by_words.setdefault(self._advice(target), []).append(f"{target:g}")
        sentences = [f"For {' or '.join(values)} deg {advice}." for advice, values in by_words.items()]
        best = (self.best(target, error_estimate=True) for target in targets)
        if any(point is not None and not point.accuracy for point in best):
            sentences.append(
                "An accuracy given as a number bounds the estimated errors, which are larger than the true ones."
            )
        sums = [p for p in self._points_of_sweep() if p.method.soil_elements == max(ELEMENTS)]
        closed = {p.method.step_ms: p.cpu_us for p in self._points_of_sweep() if p.method.is_plain}
        if sums:
            ratio = sums[0].cpu_us / closed[sums[0].method.step_ms]
            sentences.append(
                f"Sums over {max(ELEMENTS)} soil elements cost {ratio:,.0f} times the closed form, which is their "
                f"limit, and are {min(p.rotation_max_deg for p in sums):.1g} deg off it at most: for comparison only."
            )
        return sentences

    def _points_of_sweep(self) -> Iterator[Point]:
        """Yield the points with the readings of the sweep."""
        return (point for point in self.points if point.method.readings == self.own_readings)

    def _advice(self, wanted_deg: float) -> str:
        """Say what to use for an accuracy [deg]."""
        guarded, plain = (self.best(wanted_deg, error_estimate=estimate) for estimate in (True, False))
        more = ""
        if plain is not None:
            more = f"; unconfirmed, solver: {{step: {plain.method.step_ms:g} ms}} takes {plain.cpu_us:.3g} us"
        if guarded is None:
            return f"{self._none_guarded(plain)}{more}"
        ask = guarded.accuracy or f"{_rounded_up(guarded.estimated_p99_9_deg):g} deg"
        return (
            f"use solver: {{accuracy: {ask}}} (steps of {guarded.method.steps}): {guarded.cpu_us:.3g} us a design, "
            f"{_duration(guarded, self.sweep.n_designs)} for this grid on one core, with confirmed errors{more}"
        )

    def _none_guarded(self, plain: Point | None) -> str:
        """Say why no method with an error estimate can be named, where `plain` steps suffice or none (None)."""
        if any(method.error_estimate and method.readings == self.own_readings for method in self.left_out):
            measured = any(point.method.error_estimate for point in self._points_of_sweep())
            which = "accurate enough " if measured else ""
            return f"no method with confirmed errors {which}was measured in the time; allow more --seconds"
        return "no measured step is short enough" if plain is None else "no step with confirmed errors is short enough"

    def table(self) -> pa.Table:
        """Return one row for every method."""
        import pyarrow as pa  # heavy, and the measuring does without it

        return pa.Table.from_pylist([point.to_dict() for point in self.points])

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "name": self.sweep.name,
            "designs": self.sweep.n_designs,
            "reference_step_s": REFERENCE_STEP_S,
            "reference_error_deg": self.reference_deg,
            "points": [point.to_dict() for point in self.points],
            "left_out": [method._asdict() for method in self.left_out],
            "recommendation": self.recommendation(),
        }

    def write(self, folder: str | Path) -> list[Path]:
        """Write table and picture into a folder, which is made; return the files: none where nothing was measured."""
        import pyarrow.csv as pa_csv
        import pyarrow.parquet as pq

        target = Path(folder)
        draw("pictures", "require_matplotlib")
        draw("pictures", "make_folder", target)
        if not self.points:
            return []
        files = [target / f"tradeoff.{kind}" for kind in ("parquet", "csv", "png")]
        with replacing(files[0]) as file:
            pq.write_table(self.table(), file)
        with replacing(files[1]) as file:
            pa_csv.write_csv(self.table(), file)
        draw("work_precision", "draw_tradeoff", self, files[2])
        return files


def measure(
    sweep: Sweep,
    *,
    designs: int = DESIGNS,
    seconds: float = SECONDS,
    backend: str = THREADING,
    scheduler: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> Tradeoff:
    """Measure speed against accuracy on a sample of a sweep's designs.

    Parameters
    ----------
    sweep
        The sweep. Its readings, criterion and horizon count; both presets are measured anyway.
    designs
        Size of the sample. The sample depends on the sweep alone, and so do the errors; the times do not.
    seconds
        No new measurement is started after this much time [s].
    backend, scheduler
        Where to measure: ``threading`` for this machine, or ``dask`` for a worker of a cluster, as for
        `boulder_sweep.run`.
    progress
        Told what is being measured; not by a worker.

    Raises
    ------
    NothingToMeasureError
        No design of the sample can be computed.
    """
    begun = time.monotonic()
    sweep = at_values(sweep)
    if backend != THREADING:
        with pool(1, backend, scheduler) as workers:
            return next(workers([(measure, (sweep,), {"designs": designs, "seconds": seconds})]))
    sample_designs = sampled_designs(sweep, designs)
    if not sample_designs.size:
        raise NothingToMeasureError(
            f"{sweep.name}: none of the designs can be computed, so there is nothing to measure; "
            "the table of a run says why"
        )
    evaluation = evaluation_of(sweep, Accuracy("", Steps(REFERENCE_STEP_S), error_estimate=False))
    limits, control = evaluation.limits, evaluation.control
    evaluation.warm_up()
    presets = {"corrected": corrected(), "as_printed": as_printed()}
    if sweep.model.preset not in presets:
        presets = {sweep.model.preset: readings_of(sweep), **presets}
    presets = dict(sorted(presets.items(), key=lambda item: item[0] != sweep.model.preset))

    points: list[Point] = []
    left_out: list[Method] = []
    references: dict[str, float] = {}
    for name, readings in presets.items():
        if time.monotonic() - begun > seconds:
            left_out += _methods(name, readings)
            continue
        sample = SampledDesigns(sample_designs, readings, limits, control)
        if progress is not None:
            progress(f"{name}: reference by steps of {1e3 * REFERENCE_STEP_S:g} ms, sample of {sample_designs.size:,}")
        known, twice = (
            sample.solve(Method(name, 0, 1e3 * step, locate_yield=True, error_estimate=False))
            for step in (REFERENCE_STEP_S, 2.0 * REFERENCE_STEP_S)
        )
        references[name] = _largest_difference_deg(known, twice)
        for method in _methods(name, readings):
            if time.monotonic() - begun > seconds:
                left_out.append(method)
                continue
            if progress is not None:
                progress(f"{name}: {method.soil}, {method.steps}")
            points.append(sample.measured(method, known, _name_of(method, readings)))
    mark_front(points)
    return Tradeoff(sweep, tuple(points), references, tuple(left_out))


def _methods(name: str, readings: Readings) -> Iterator[Method]:
    """Yield the methods, cheap ones first; named accuracies as they are computed by these readings."""
    yield from (Method(name, 0, step, False, False) for step in STEPS_MS)
    yield from (Method(name, 0, step, True, False) for step in STEPS_LOCATED_MS)
    for located, steps in ((False, STEPS_WITH_ERROR_MS), (True, STEPS_LOCATED_WITH_ERROR_MS)):
        for step in steps:
            method = Method(name, 0, step, located, True)
            checked = bool(_name_of(method, readings)) and plain(proof_is_possible)(readings)
            yield method._replace(checked=checked)
    yield from (Method(name, elements, step, False, False) for elements in ELEMENTS for step in STEPS_OF_SUMS_MS)


def _name_of(method: Method, readings: Readings) -> str:
    """Name of the accuracy that a method stands for, or nothing."""
    if method.soil_elements:
        return ""
    method_steps = Steps(1e-3 * method.step_ms, method.locate_yield)
    for name, steps in (STEPS if readings.restoring_gravity else STEPS_PRINTED).items():
        if steps == method_steps and method.error_estimate == (name != "fast"):
            return name
    return ""


def _largest_difference_deg(one: OutcomeTable, other: OutcomeTable) -> float:
    """Largest difference of the rotations of two solutions [deg]."""
    difference = np.abs(one.theta_max - other.theta_max)
    return math.degrees(float(np.nanmax(difference, initial=0.0)))


def _rounded_up(value: float) -> float:
    """Round up to one significant digit."""
    if value <= 0.0:
        return 1e-9
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit * (1.0 - 1e-12)) * unit


def _duration(point: Point, rows: int) -> str:
    seconds = 1e-6 * point.cpu_us * rows
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds / 60:,.0f} min"
