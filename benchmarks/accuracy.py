"""Work and precision: of every step, of the named accuracies, and designs a second: ``python -m benchmarks.accuracy``.

Every step simulates the same random designs; errors are relative to a much finer step that also locates the yield of
the soil. Rotations and displacements are compared where neither solution reached the limit of rotation; where only one
of them did, the verdict is flipped, and counted. The named accuracies have the same control as in ``sweep run``; their
ratios are medians over rounds in which all three were timed in turn. Rates are wall time, of threads that work on the
same designs repeatedly, as the workers of a sweep do on their blocks: measure them on an idle machine.
"""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

import boulder_kernels as bk
from boulder_kernels.control import STEP_RATIO
from boulder_kernels.table import is_paired
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Steps

from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .report import FIGURES, Table, significant, write_between_markers
from .timing import interleaved, machine, median_ratio, timed, versions

STEPS_MS = (16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5)
REFERENCE_STEP_S = 5e-5
PRESETS = {"corrected": bk.corrected(), "as_printed": bk.as_printed()}
WAYS = {"events located": False, "yield located, too": True}
"""Ways to step, and whether steps also end where the soil yields."""
ROUNDS = 5
REPEATS = 12
"""How often a thread goes through the designs while rates are taken."""

LIMIT = bk.Status.LIMIT.value


class Peaks(NamedTuple):
    """What is compared: arrays of shape (n,)."""

    theta: np.ndarray
    """Largest rotation of each design [rad]."""
    x_b: np.ndarray
    """Largest displacement of the boulder [m]."""
    x_v: np.ndarray
    """Largest displacement of the truck [m]."""
    overturned: np.ndarray
    """Whether the rotation reached its limit."""

    @classmethod
    def of(cls, out: bk.OutcomeTable) -> Peaks:
        """Return the peaks of outcomes."""
        return cls(out.theta_max, out.x_b_max, out.x_v_max, out.status == LIMIT)


@dataclass
class Point:
    """Cost and errors of one way to simulate."""

    preset: str
    way: str
    step_ms: float
    cpu_us: float
    theta_max_deg: float
    theta_p99_deg: float
    theta_rms_deg: float
    x_max_mm: float
    x_p99_mm: float
    x_rms_mm: float
    flips: int


def point_of(preset: str, way: str, step_s: float, cpu_us: float, found: Peaks, known: Peaks) -> Point:
    """Compare peaks with the reference's peaks."""
    both = ~found.overturned & ~known.overturned
    theta = np.degrees(np.abs(found.theta - known.theta))[both]
    x = 1e3 * np.maximum(np.abs(found.x_b - known.x_b), np.abs(found.x_v - known.x_v))[both]

    def sizes(errors: np.ndarray) -> tuple[float, float, float]:
        return float(errors.max()), float(np.quantile(errors, 0.99)), float(np.sqrt(np.mean(errors**2)))

    flips = int(np.sum(found.overturned != known.overturned))
    return Point(preset, way, 1e3 * step_s, cpu_us, *sizes(theta), *sizes(x), flips)


def observed_order(points: list[Point], longest_ms: float, shortest_ms: float) -> float:
    """Slope of the rms error of the rotation over the step, both logarithmic."""
    chosen = [p for p in points if shortest_ms <= p.step_ms <= longest_ms]
    steps, errors = [p.step_ms for p in chosen], [p.theta_rms_deg for p in chosen]
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def control(
    step_s: float, *, error_estimate: bool = False, locate_yield: bool = False, paired: bool = False
) -> bk.Control:
    """Return the control: simulate to the rotation limit, the horizon, or the proof of rest."""
    return bk.Control(step_s, HORIZON, ROTATION_LIMIT, 0, error_estimate, True, locate_yield, paired=paired)


def reference_of(table: bk.DesignTable, readings: bk.Readings) -> bk.OutcomeTable:
    """Return the reference solution."""
    return bk.simulate_table(table, readings, control(REFERENCE_STEP_S, locate_yield=True))


def measure_steps(count: int = DESIGNS, repeats: int = 2) -> list[Point]:
    """Measure every step, with events located and with the yield of the soil located, too, for both presets."""
    designs, points = sample(count), []
    for preset, readings in PRESETS.items():
        known = Peaks.of(reference_of(designs, readings))
        for way, locate_yield in WAYS.items():
            for step_ms in STEPS_MS:
                how = control(1e-3 * step_ms, locate_yield=locate_yield)
                out, seconds = timed(partial(bk.simulate_table, designs, readings, how), repeats)
                points.append(point_of(preset, way, 1e-3 * step_ms, 1e6 * seconds / count, Peaks.of(out), known))
    return points


def steps_table(points: list[Point]) -> Table:
    """Return the observed orders; the figures have the points."""
    table = Table(
        "steps",
        "Observed order of the rms error from 8 to 1 ms",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; {HORIZON:g} s, limit 20 deg; errors against a step of "
        f"{1e3 * REFERENCE_STEP_S:g} ms; CPU time of one thread",
        ["readings", "way", "order"],
    )
    for preset in PRESETS:
        for way in WAYS:
            order = observed_order([p for p in points if (p.preset, p.way) == (preset, way)], 8.0, 1.0)
            table.rows.append([preset, way, f"{order:.1f}"])
    return table


def named_control(name: str, steps: Steps) -> bk.Control:
    """Return the control that a sweep uses."""
    return control(steps.step_s, error_estimate=name != "fast", locate_yield=steps.locate_yield)


def steps_text(name: str, steps: Steps, readings: bk.Readings) -> str:
    """Return in words the steps of the solutions that every design has."""
    longer = 1e3 * steps.step_s
    finer = f"{longer / STEP_RATIO:g} ms"
    if name == "fast":
        text = f"{longer:g} ms"
    else:
        text = f"{longer:g} and {finer}" if is_paired(readings, named_control(name, steps), layered=False) else finer
    return text + (", yield located" if steps.locate_yield else "")


def wrong_verdicts(found: bk.OutcomeTable, known: bk.OutcomeTable) -> int:
    """Count the designs on the wrong side of the limit that are not undecided by their own error."""
    unsure = (found.status != LIMIT) & (ROTATION_LIMIT - found.theta_max < found.theta_error)
    unsure |= np.isinf(found.theta_error)
    return int(np.sum(((found.status == LIMIT) != (known.status == LIMIT)) & ~unsure))


def named_table(count: int = DESIGNS, rounds: int = ROUNDS) -> Table:
    """Measure all named accuracies in both presets."""
    designs = sample(count)
    table = Table(
        "named",
        "The named accuracies",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; {count} random designs; CPU time of one thread",
        [
            *("readings", "accuracy", "steps", "CPU time per design", "over `fast`"),
            *("rotation: max [deg]", "displacement: max [mm]", "wrong verdicts"),
        ],
    )
    for preset, readings in PRESETS.items():
        known = reference_of(designs, readings)
        named = STEPS if readings.restoring_gravity else STEPS_PRINTED
        ways = {name: named_control(name, steps) for name, steps in named.items()}
        works = {name: partial(bk.simulate_table, designs, readings, how) for name, how in ways.items()}
        times = interleaved(works, rounds)
        for name, work in works.items():
            found = work()
            cpu_us = 1e6 * min(times[name]) / count
            p = point_of(preset, name, named[name].step_s, cpu_us, Peaks.of(found), Peaks.of(known))
            table.rows.append(
                [
                    preset,
                    f"`{name}`",
                    steps_text(name, named[name], readings),
                    f"{cpu_us:.2f} us",
                    f"{median_ratio(times[name], times['fast']):.2f}",
                    significant(p.theta_max_deg),
                    significant(p.x_max_mm),
                    str(wrong_verdicts(found, known)),
                ]
            )
    return table


ASKED = {
    "0.01 deg, 0.1 mm": control(0.014),
    "1e-4 deg, 0.002 mm": control(0.004),
    "1e-4 deg, 0.002 mm, errors confirmed": control(0.012, error_estimate=True),
}


def rate(designs: bk.DesignTable, how: bk.Control, threads: int) -> float:
    """Return the designs per second of several threads together."""

    def work() -> None:
        for _ in range(REPEATS):
            bk.simulate_table(designs, bk.corrected(), how)

    workers = [threading.Thread(target=work) for _ in range(threads)]
    begun = time.monotonic()
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return threads * REPEATS * designs.L.size / (time.monotonic() - begun)


def rates_table(rounds: int = ROUNDS) -> Table:
    """Measure all ways with one thread and with two, in turn."""
    designs = sample(DESIGNS)
    known = Peaks.of(reference_of(designs, bk.corrected()))
    conditions = f"{DESIGNS} random designs, corrected readings; wall time, the best of {rounds} rounds"
    table = Table(
        "rates",
        "Designs a second",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; {conditions}",
        [
            *("accuracy asked for", "step", "rotation: max [deg]", "displacement: max [mm]"),
            *("one thread", "two threads", "ratio"),
        ],
    )
    for name, how in ASKED.items():
        found = bk.simulate_table(designs, bk.corrected(), how)
        point = point_of("corrected", name, how.h, 0.0, Peaks.of(found), known)
        rates: dict[int, list[float]] = {1: [], 2: []}
        for _ in range(rounds):
            for threads, values in rates.items():
                values.append(rate(designs, how, threads))
        one, two = max(rates[1]), max(rates[2])
        steps = f"{1e3 * how.h / (STEP_RATIO if how.error_estimate else 1.0):g} ms"
        table.rows.append(
            [
                *(name, steps, significant(point.theta_max_deg), significant(point.x_max_mm)),
                *(f"{one:,.0f}", f"{two:,.0f}", f"{two / one:.2f}"),
            ]
        )
    return table


def draw(points: Sequence[Point]) -> None:
    """Draw the error of the rotation over the CPU time and over the step, one panel for each preset."""
    from matplotlib.figure import Figure

    for name, words in (("accuracy", "CPU time per design, one core [us]"), ("order", "step [ms]")):
        figure = Figure(figsize=(12.0, 4.6))
        for panel, preset in zip(figure.subplots(1, len(PRESETS), sharey=True), PRESETS, strict=True):
            for way in WAYS:
                these = [p for p in points if (p.preset, p.way) == (preset, way)]
                across = [p.cpu_us if name == "accuracy" else p.step_ms for p in these]
                panel.loglog(across, [p.theta_max_deg for p in these], "o-", markersize=4, label=f"{way}: largest")
                panel.loglog(across, [p.theta_rms_deg for p in these], "s--", markersize=4, label=f"{way}: rms")
            panel.set_title(f"readings: {preset}", fontsize=10)
            panel.set_xlabel(words)
            panel.set_ylabel("error of the largest rotation [deg]")
            panel.grid(which="major", color="0.9", linewidth=0.6)
            panel.legend(fontsize=7)
        figure.tight_layout()
        figure.savefig(FIGURES / f"{name}.png", dpi=110)


def main() -> None:
    works: dict[str, Callable[[], Table]] = {
        "steps": lambda: steps_table(points),
        "named": lambda: named_table(asked.designs),
        "rates": rates_table,
    }
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"{', '.join(works)}; by default all")
    parser.add_argument("--designs", type=int, default=DESIGNS, help="size of the sample (default %(default)s)")
    parser.add_argument("--write", action="store_true", help="write the tables into benchmarks/README.md, and figures")
    asked = parser.parse_args()
    names = asked.tables or list(works)
    points = measure_steps(asked.designs) if "steps" in names else []
    tables = [works[name]() for name in names]
    for table in tables:
        print(table.markdown(), end="\n\n")
    if asked.write:
        write_between_markers(tables)
        if points:
            draw(points)


if __name__ == "__main__":
    main()
