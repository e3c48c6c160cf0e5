"""The kernels on one core: a right-hand side, a step, an event, a design, an element of the soil, a second opinion.

Run as ``python -m benchmarks.kernel``. Every figure is CPU time of one thread, the loops timed in turn with the loop of
nothing but multiply-adds that shows what the core can do at that moment.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

import numpy as np

import boulder_kernels as bk
from boulder_kernels import lanes
from boulder_kernels.design import design_at
from boulder_kernels.layered import COUNTS, TO, filled_layers, uniform_layers
from boulder_kernels.outlined import HEIGHT, given_beside
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_kernels.soil import Kinematics
from boulder_kernels.table import some_rows
from boulder_kernels.workspace import LANES, SIZE, LayeredLanes, TaperedLanes
from boulder_sweep.judge.accuracy import LONGEST_HORIZON
from boulder_sweep.settings.model import SECOND_OPINIONS
from boulder_sweep.soils import with_law

from . import loops
from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .flops import (
    EVALUATIONS_PER_STEP,
    assembly_of,
    operations_in_machine_code,
    operations_of_step,
    packed_instructions,
)
from .peak import PeakLoop
from .report import Table
from .timing import interleaved, machine, median_ratio, versions

ATTEMPTS = 20_000
ELEMENTS = 5000
SUMS = 2000
CLOSED_FORMS = 400_000
PASSES = 300
"""Designs that stand and are simulated again for a second opinion."""
STEP_S = 0.014
ROUNDS = 9
ENDLESS = 10**9


def same_soil(designs: bk.DesignTable, count: int) -> np.ndarray:
    """Return the soil of designs cut into layers of equal height, as rows of a table for lanes, shape (6 count, n)."""
    rows = []
    for row in range(len(designs.L)):
        design = design_at(designs, row)
        layers = np.repeat(uniform_layers(design), count, axis=0)
        layers[:-1, TO] = design.d * np.arange(1, count) / count
        rows.append(layers)
    return filled_layers(np.stack(rows), count)


def same_taper(designs: bk.DesignTable) -> np.ndarray:
    """Return designs as tapered boulders whose top is as wide as their foot, as rows of a table for lanes."""
    half = 0.5 * designs.L
    point = np.stack([0.0 * half, designs.W, half, half], axis=1)
    outlines = np.stack([point, point], axis=1)
    outlines[:, 1, HEIGHT] = designs.H
    layers = np.stack([uniform_layers(design_at(designs, row)) for row in range(len(designs.L))])
    return given_beside(np.stack(designs), layers, outlines, 1)


def second_opinion_us(designs: bk.DesignTable, control: bk.Control) -> float:
    """Return how long a second opinion takes [us], per law, of designs that stand."""
    stand = bk.simulate_table(designs, bk.corrected(), control).theta_max < ROTATION_LIMIT
    passes = some_rows(designs, np.flatnonzero(stand)[:PASSES])
    asked = HeaveControl(ROTATION_LIMIT, LONGEST_HORIZON * HORIZON)
    work: dict[str, Callable[[], object]] = {
        law: partial(second_opinions, with_law(passes, law), asked) for law in SECOND_OPINIONS
    }
    least = [min(seconds) for seconds in interleaved(work, 3).values()]
    return 1e6 * sum(least) / (len(least) * len(passes.L))


def measure(rounds: int = ROUNDS) -> Table:
    """Measure everything; takes about ten seconds once the kernels are compiled."""
    designs = sample(DESIGNS)
    control = bk.Control(STEP_S, HORIZON, ROTATION_LIMIT, 0, False)
    readings = bk.corrected()
    stacked = np.stack(designs)
    ws, _ = loops.simulate_and_count(stacked, readings, control, 6)
    lanes.attempt_steps(ws)
    attempted = ws.copy()
    peak = PeakLoop()
    with_elements = bk.constants_of(design_at(designs, 0), readings, ELEMENTS)
    closed = bk.constants_of(design_at(designs, 0), readings, 0)
    lines = Kinematics(0.05, 0.03, 2.0, 0.5, 0.4, 1.5)
    times = interleaved(
        {
            "peak": peak,
            "attempt": lambda: loops.attempt_often(ws, ATTEMPTS),
            "look": lambda: loops.look_often(attempted, ATTEMPTS),
            "sums": lambda: loops.sum_elements_often(lines, with_elements, SUMS),
            "closed": lambda: loops.integrate_often(lines, closed, CLOSED_FORMS),
        },
        rounds,
    )
    least = {name: min(values) for name, values in times.items()}
    attempt_ns = 1e9 * least["attempt"] / (ATTEMPTS * LANES)
    look_ns = 1e9 * least["look"] / (ATTEMPTS * LANES)
    evaluation_ns = attempt_ns / EVALUATIONS_PER_STEP
    sum_ns = 1e9 * least["sums"] / (SUMS * ELEMENTS)
    closed_ns = 1e9 * least["closed"] / CLOSED_FORMS

    of_evaluation, of_step = operations_of_step()
    assembly = assembly_of(lanes.attempt_steps, np.zeros(SIZE))
    executed = operations_in_machine_code(assembly)
    instructions = packed_instructions(assembly)
    flops_attempted = executed.flops * ATTEMPTS * LANES
    share = median_ratio(times["peak"], times["attempt"]) * flops_attempted / peak.flops
    # The rate of a processor that does only this mix, with one packed instruction per unit and cycle:
    mix = executed.flops / (2 * instructions)

    _, (attempts, in_use, attended) = loops.simulate_and_count(stacked, readings, control, ENDLESS)
    tables = {0: stacked} | {count: np.concatenate([stacked, same_soil(designs, count)]) for count in COUNTS}
    work: dict[str, Callable[[], object]] = {
        str(count): partial(lanes.simulate_lanes, table, readings, control, LayeredLanes if count else None, count)
        for count, table in tables.items()
    }
    work["taper"] = partial(lanes.simulate_lanes, same_taper(designs), readings, control, TaperedLanes, 1)
    of_soils = {name: min(seconds) for name, seconds in interleaved(work, 3).items()}
    whole, taper = of_soils.pop("0"), of_soils.pop("taper")
    ratios = [f"{seconds / whole:.1f}" for seconds in of_soils.values()]
    started = 1e9 * whole / DESIGNS - attempts / DESIGNS * (attempt_ns + look_ns)
    table = Table(
        "kernel",
        "Kernels on one core",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; corrected readings; CPU time of one thread, least of "
        f"{rounds} rounds; designs: {DESIGNS} random ones, step {1e3 * STEP_S:g} ms, no error estimate",
        ["what", "figure"],
    )
    table.rows = [
        ["one evaluation of the right-hand side in lanes, its stage included", f"{evaluation_ns:.2f} ns"],
        ["one attempted step of six evaluations", f"{attempt_ns:.1f} ns"],
        ["checking a step and accepting it", f"{look_ns:.1f} ns"],
        [
            "flops of a step in the machine code (in the formulas)",
            f"{executed.flops} ({of_step.flops}), and {executed.least_or_most} minima and maxima",
        ],
        [
            "flops of one evaluation in the formulas, without its stage",
            f"{of_evaluation.flops}, {of_evaluation.divide} of them divisions",
        ],
        ["rate of the steps", f"{executed.flops / attempt_ns:.1f} GFLOP/s"],
        ["highest rate of a loop of fused multiply-adds", f"{1e-9 * peak.flops / least['peak']:.1f} GFLOP/s"],
        ["share of that peak (median of the rounds)", f"{100 * share:.0f} %"],
        ["highest rate that this mix of instructions allows", f"{100 * mix:.0f} % of the peak"],
        ["attempted steps per design (lanes occupied)", f"{attempts / DESIGNS:.1f} ({in_use / attempts:.1%})"],
        ["steps handled in the group of events: events, peaks, the end", f"{attended / DESIGNS:.1f} per design"],
        ["cost of one of these, including the start of designs", f"{started * DESIGNS / attended:.0f} ns"],
        ["a whole design", f"{1e6 * whole / DESIGNS:.2f} us"],
        [
            f"the same in {', '.join(map(str, COUNTS[:-1]))} and {COUNTS[-1]} layers of soil",
            f"{', '.join(ratios[:-1])} and {ratios[-1]} times as long",
        ],
        ["the same as a tapered boulder", f"{taper / whole:.2f} times as long"],
        [
            "a second opinion of a design that stands, one by one, per law",
            f"{second_opinion_us(designs, control):.0f} us",
        ],
        ["element sums", f"{sum_ns:.2f} ns per element, {1e-3 * sum_ns * ELEMENTS:.1f} us for N = {ELEMENTS}"],
        ["closed form instead, one by one", f"{closed_ns:.0f} ns"],
    ]
    peaks = sorted(1e-9 * peak.flops / seconds for seconds in times["peak"])
    table.notes = [
        f"{instructions} packed instructions make up a step, {executed.add + executed.multiply - instructions} of them "
        "fused; the formulas count common terms each time they occur, the machine code once.",
        f"The multiply-add loop reached {peaks[0]:.0f} to {peaks[-1]:.0f} GFLOP/s in the {rounds} rounds.",
    ]
    return table


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kernel", description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="how often each loop is timed (default %(default)s)")
    print(measure(parser.parse_args().rounds).markdown())


if __name__ == "__main__":
    main()
