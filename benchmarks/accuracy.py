"""Work and precision: named accuracies, designs a second, parts of a design: ``python -m benchmarks.accuracy``.

Errors are relative to a much finer step that also locates the yield of the soil. Rotations and displacements are
compared where neither solution reached the limit of rotation. The named accuracies have the same control as in ``sweep
run``; their ratios are medians over rounds in which all three were timed in turn. Rates are wall time, of threads that
work on the same designs repeatedly, as the workers of a sweep do on their blocks: measure them on an idle machine.
"""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Callable
from functools import partial

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels import Constants
from boulder_kernels.control import STEP_RATIO
from boulder_kernels.design import design_at
from boulder_kernels.soil import Kinematics, Reaction, closed_form, element_sums
from boulder_kernels.table import is_paired
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Steps

from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .report import FOLDER, described, significant, write
from .timing import here, interleaved, median_ratio, timed

STEPS_MS = (16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5)
FIGURE = FOLDER / "figures" / "accuracy.png"
REFERENCE_STEP_S = 5e-5
PRESETS = {"corrected": bk.corrected(), "as_printed": bk.as_printed()}
ROUNDS = 5
REPEATS = 12
"""How often a thread goes through the designs while rates are taken."""
ELEMENTS, SUMS, CLOSED_FORMS = 5000, 2000, 400_000
"""Elements of a sum, and how often sums and closed forms are evaluated."""

LIMIT = bk.Status.LIMIT.value


def errors_of(found: bk.OutcomeTable, known: bk.OutcomeTable) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of rotations [deg] and of displacements [mm] where neither solution overturned, shape (m,) each."""
    both = (found.status != LIMIT) & (known.status != LIMIT)
    x = np.maximum(np.abs(found.x_b_max - known.x_b_max), np.abs(found.x_v_max - known.x_v_max))
    return np.degrees(np.abs(found.theta_max - known.theta_max))[both], 1e3 * x[both]


def control(
    step_s: float, *, error_estimate: bool = False, locate_yield: bool = False, paired: bool = False
) -> bk.Control:
    """Return the control: simulate to the rotation limit, the horizon, or the proof of rest."""
    return bk.Control(step_s, HORIZON, ROTATION_LIMIT, 0, error_estimate, True, locate_yield, paired=paired)


def reference_of(table: bk.DesignTable, readings: bk.Readings) -> bk.OutcomeTable:
    """Return the reference solution."""
    return bk.simulate_table(table, readings, control(REFERENCE_STEP_S, locate_yield=True))


def draw_steps() -> None:
    """Draw the error of the rotation over the CPU time for every step, one panel for each preset."""
    from matplotlib.figure import Figure

    designs, figure = sample(DESIGNS), Figure(figsize=(12.0, 4.6))
    for panel, (preset, readings) in zip(figure.subplots(1, len(PRESETS), sharey=True), PRESETS.items(), strict=True):
        known = reference_of(designs, readings)
        for way, locate_yield in (("events located", False), ("yield located, too", True)):
            points = []
            for step_ms in STEPS_MS:
                how = control(1e-3 * step_ms, locate_yield=locate_yield)
                out, seconds = timed(partial(bk.simulate_table, designs, readings, how), repeats=2)
                degrees, _ = errors_of(out, known)
                points.append((1e6 * seconds / DESIGNS, degrees.max(), np.sqrt(np.mean(degrees**2))))
            cpu_us, largest, rms = np.transpose(points)
            panel.loglog(cpu_us, largest, "o-", markersize=4, label=f"{way}: largest")
            panel.loglog(cpu_us, rms, "s--", markersize=4, label=f"{way}: rms")
        panel.set_title(f"readings: {preset}", fontsize=10)
        panel.set_xlabel("CPU time per design, one core [us]")
        panel.set_ylabel("error of the largest rotation [deg]")
        panel.grid(which="major", color="0.9", linewidth=0.6)
        panel.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(FIGURE, dpi=110)


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


def named_table() -> str:
    """Measure all named accuracies in both presets."""
    designs = sample(DESIGNS)
    errors = ("rotation: max [deg]", "displacement: max [mm]", "wrong verdicts")
    table = Table(("readings", "accuracy", "steps", "CPU time per design", "over `fast`", *errors))
    for preset, readings in PRESETS.items():
        known = reference_of(designs, readings)
        named = STEPS if readings.restoring_gravity else STEPS_PRINTED
        ways = {name: named_control(name, steps) for name, steps in named.items()}
        works = {name: partial(bk.simulate_table, designs, readings, how) for name, how in ways.items()}
        times = interleaved(works, ROUNDS)
        for name, work in works.items():
            found = work()
            degrees, millimetres = (errors.max() for errors in errors_of(found, known))
            table.add(
                preset,
                f"`{name}`",
                steps_text(name, named[name], readings),
                f"{1e6 * min(times[name]) / DESIGNS:.2f} us",
                f"{median_ratio(times[name], times['fast']):.2f}",
                significant(degrees),
                significant(millimetres),
                str(wrong_verdicts(found, known)),
            )
    conditions = f"{here()}; {DESIGNS} random designs; CPU time of one thread"
    return described("The named accuracies", conditions, table)


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


def rates_table() -> str:
    """Measure all ways with one thread and with two, in turn."""
    designs = sample(DESIGNS)
    known = reference_of(designs, bk.corrected())
    errors = ("rotation: max [deg]", "displacement: max [mm]")
    table = Table(("accuracy asked for", "step", *errors, "one thread", "two threads", "ratio"))
    for name, how in ASKED.items():
        found = bk.simulate_table(designs, bk.corrected(), how)
        degrees, millimetres = (errors.max() for errors in errors_of(found, known))
        rates: dict[int, list[float]] = {1: [], 2: []}
        for _ in range(ROUNDS):
            for threads, values in rates.items():
                values.append(rate(designs, how, threads))
        one, two = max(rates[1]), max(rates[2])
        steps = f"{1e3 * how.h / (STEP_RATIO if how.error_estimate else 1.0):g} ms"
        per_second = (f"{one:,.0f}", f"{two:,.0f}", f"{two / one:.2f}")
        table.add(name, steps, significant(degrees), significant(millimetres), *per_second)
    conditions = f"{here()}; {DESIGNS} random designs, corrected readings; wall time, the best of {ROUNDS} rounds"
    return described("Designs a second", conditions, table)


def repeated(reaction: Callable[[Kinematics, Constants], Reaction]) -> Callable[[Kinematics, Constants, int], float]:
    """Return a compiled loop that evaluates a soil, each time at a state that depends on the previous result."""

    @numba.njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
    def often(k: Kinematics, c: Constants, times: int) -> float:
        total = 0.0
        for _ in range(times):
            moved = Kinematics(k.A + 1e-12 * total, k.slope_x, k.B, k.slope_v, k.q, k.lever_d)
            total += reaction(moved, c).M
        return total

    return often


def kernel_table() -> str:
    """Measure a whole design, and the soil by sums and in closed form, in turn."""
    designs, readings, how = sample(DESIGNS), bk.corrected(), ASKED["0.01 deg, 0.1 mm"]
    summed, closed = (bk.constants_of(design_at(designs, 0), readings, elements) for elements in (ELEMENTS, 0))
    lines = Kinematics(0.05, 0.03, 2.0, 0.5, 0.4, 1.5)
    times = interleaved(
        {
            "design": partial(bk.simulate_table, designs, readings, how),
            "sums": partial(repeated(element_sums), lines, summed, SUMS),
            "closed form": partial(repeated(closed_form), lines, closed, CLOSED_FORMS),
        },
        ROUNDS,
    )
    design, of_sums, of_closed_forms = (min(seconds) for seconds in times.values())
    sum_ns = 1e9 * of_sums / (SUMS * ELEMENTS)
    table = Table(("what", "figure"))
    table.add("a whole design", f"{1e6 * design / DESIGNS:.2f} us")
    table.add("element sums", f"{sum_ns:.2f} ns per element, {1e-3 * sum_ns * ELEMENTS:.1f} us for N = {ELEMENTS}")
    table.add("closed form instead, one by one", f"{1e9 * of_closed_forms / CLOSED_FORMS:.0f} ns")
    conditions = (
        f"{here()}; corrected readings; CPU time of one thread, least of {ROUNDS} rounds; designs: {DESIGNS} random "
        f"ones, step {1e3 * how.h:g} ms, no error estimate"
    )
    return described("Kernels on one core", conditions, table)


TABLES: dict[str, Callable[[], str]] = {"named": named_table, "rates": rates_table, "kernel": kernel_table}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"{', '.join(TABLES)}; by default all of them")
    parser.add_argument("--draw", action="store_true", help="draw every step into benchmarks/figures, and no more")
    parser.add_argument("--write", action="store_true", help="write the tables into benchmarks/README.md")
    asked = parser.parse_args()
    if asked.draw:
        draw_steps()
        return
    computed = {name: TABLES[name]() for name in asked.tables or TABLES}
    print("\n\n".join(computed.values()))
    if asked.write:
        write(computed)


if __name__ == "__main__":
    main()
