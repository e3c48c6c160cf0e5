"""Work and precision for each time step: the basis of the named accuracies.

Run as ``python -m benchmarks.accuracy``. Every step simulates the same random designs; errors are relative to a
much finer step that also locates the yield of the soil. Rotations and displacements are compared where neither
solution reached the limit of rotation; where only one of them did, the verdict is flipped, and counted.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import asdict, fields
from functools import partial

import numpy as np

import boulder_kernels as bk
from boulder_kernels.control import STEP_RATIO

from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .points import LIMIT, Peaks, Point, observed_order, point_of
from .report import FIGURES, Table, significant
from .timing import machine, timed, versions

STEPS_MS = (16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5)
STEPS_WITH_ERROR_MS = (18.0, 12.0, 9.0, 6.0, 3.0, 1.5)
"""Longer steps of the two solutions."""
SHOWN_MS = (16.0, 14.0, 12.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
"""Steps in the tables; the data file has all."""
REFERENCE_STEP_S = 5e-5
PRESETS = {"corrected": bk.corrected(), "as_printed": bk.as_printed()}


def control(
    step_s: float, *, error_estimate: bool = False, locate_yield: bool = False, paired: bool = False
) -> bk.Control:
    """Return the control: simulate to the rotation limit, the horizon, or the proof of rest."""
    return bk.Control(step_s, HORIZON, ROTATION_LIMIT, 0, error_estimate, True, locate_yield, paired=paired)


def reference_of(table: bk.DesignTable, readings: bk.Readings) -> bk.OutcomeTable:
    """Return the reference solution."""
    return bk.simulate_table(table, readings, control(REFERENCE_STEP_S, locate_yield=True))


def kernel_points(table: bk.DesignTable, preset: str, known: bk.OutcomeTable, repeats: int) -> list[Point]:
    """Points of the kernels: plain, with error estimate, with located yield."""
    readings, points = PRESETS[preset], []
    ways = {
        "events located": (STEPS_MS, {}),
        "with error estimate": (STEPS_WITH_ERROR_MS, {"error_estimate": True, "paired": True}),
        "yield located, too": (STEPS_MS, {"locate_yield": True}),
    }
    for way, (steps_ms, options) in ways.items():
        for step_ms in steps_ms:
            how = control(1e-3 * step_ms, **options)
            out, seconds = timed(partial(bk.simulate_table, table, readings, how), repeats)
            point = point_of(preset, way, 1e-3 * step_ms, 1e6 * seconds / table.L.size, Peaks.of(out), Peaks.of(known))
            if how.error_estimate:
                both = (out.status != LIMIT) & (known.status != LIMIT)
                covered = out.theta_error >= np.abs(out.theta_max - known.theta_max)
                point.coverage = float(np.mean(covered[both]))
            points.append(point)
    return points


def measure(count: int = DESIGNS, repeats: int = 2) -> list[Point]:
    """Measure all points of both presets."""
    designs = sample(count)
    points = []
    for preset, readings in PRESETS.items():
        known = reference_of(designs, readings)
        points += kernel_points(designs, preset, known, repeats)
    return points


def tables(points: list[Point], count: int) -> list[Table]:
    """Return one table for each preset."""
    conditions = (
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; {count} random designs, {HORIZON:g} s, limit 20 deg; "
        f"errors against a step of {1e3 * REFERENCE_STEP_S:g} ms; CPU time of one thread"
    )
    found = []
    for preset in PRESETS:
        table = Table(
            f"accuracy-{preset}",
            f"Work and precision, readings `{preset}`",
            conditions,
            [
                "way",
                "step",
                "CPU time per design",
                "rotation: max, 99 %, rms [deg]",
                "displacement: max, 99 %, rms [mm]",
                "verdicts flipped",
            ],
        )
        for p in points:
            estimated = not np.isnan(p.coverage)
            if p.preset != preset or not (estimated or p.step_ms in SHOWN_MS):
                continue
            way = f"{p.way}, covers {100 * p.coverage:.1f} %" if estimated else p.way
            table.rows.append(
                [
                    way,
                    f"{p.step_ms:g} and {p.step_ms / STEP_RATIO:g} ms" if estimated else f"{p.step_ms:g} ms",
                    f"{p.cpu_us:.2f} us",
                    ", ".join(significant(v) for v in (p.theta_max_deg, p.theta_p99_deg, p.theta_rms_deg)),
                    ", ".join(significant(v) for v in (p.x_max_mm, p.x_p99_mm, p.x_rms_mm)),
                    str(p.flips),
                ]
            )
        for way in ("events located", "yield located, too"):
            these = [p for p in points if p.preset == preset and p.way == way]
            order = observed_order(these, 8.0, 1.0)
            table.notes.append(f"Observed order of the rms error from 8 to 1 ms, {way}: {order:.1f}.")
        found.append(table)
    return found


def write(points: list[Point]) -> None:
    """Write the points as a data file and as figures."""
    from .plots import plot_order, plot_steps

    FIGURES.mkdir(exist_ok=True)
    with (FIGURES / "accuracy.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, [field.name for field in fields(Point)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {name: f"{value:.5g}" if isinstance(value, float) else value for name, value in asdict(p).items()}
            for p in points
        )
    plot_steps(points, FIGURES / "accuracy.png")
    plot_order(points, FIGURES / "order.png")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("--designs", type=int, default=DESIGNS, help="size of the sample (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=2, help="repeats of a timed run (default %(default)s)")
    parser.add_argument("--write", action="store_true", help="write data and figures into benchmarks/figures")
    arguments = parser.parse_args()
    points = measure(arguments.designs, arguments.repeats)
    if arguments.write:
        write(points)
    for table in tables(points, arguments.designs):
        print(table.markdown(), end="\n\n")


if __name__ == "__main__":
    main()
