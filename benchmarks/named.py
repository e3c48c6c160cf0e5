"""What the named accuracies cost and how accurate they are: ``python -m benchmarks.named``.

Uses the same control as ``sweep run`` under each name, for both presets. Ratios are medians over rounds in which all
three were timed in turn.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

import boulder_kernels as bk
from boulder_kernels.control import STEP_RATIO
from boulder_kernels.table import is_paired
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Steps

from .accuracy import PRESETS, control, reference_of
from .designs import DESIGNS, ROTATION_LIMIT, sample
from .points import LIMIT, Peaks, point_of
from .report import Table, significant
from .timing import interleaved, machine, median_ratio, versions

ROUNDS = 5


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


def measure(count: int = DESIGNS, rounds: int = ROUNDS) -> Table:
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


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.named", description=__doc__)
    parser.add_argument("--designs", type=int, default=DESIGNS, help="size of the sample (default %(default)s)")
    print(measure(parser.parse_args().designs).markdown())


if __name__ == "__main__":
    main()
