"""Designs per second of wall time, with one thread and with two: ``python -m benchmarks.rates``.

Threads of one process work on the same 8192 designs repeatedly, as the workers of a sweep do on their blocks; the
rate is the highest of several rounds. Three accuracies: 0.01 deg and 0.1 mm, 1e-4 deg and 0.002 mm, and the first
with an estimate of the error on every row.
"""

from __future__ import annotations

import argparse
import threading
import time

import boulder_kernels as bk
from boulder_kernels.control import STEP_RATIO

from .accuracy import control, reference_of
from .designs import DESIGNS, sample
from .points import Peaks, point_of
from .report import Table, significant
from .timing import machine, versions

REPEATS = 12
ROUNDS = 7
WAYS = {
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


def measure(rounds: int = ROUNDS) -> Table:
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
    for name, how in WAYS.items():
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


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rates", description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="how often each is timed (default %(default)s)")
    print(measure(parser.parse_args().rounds).markdown())


if __name__ == "__main__":
    main()
