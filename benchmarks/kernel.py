"""The kernels on one core: a design, layers, a taper, an element of the soil, a second opinion.

Run as ``python -m benchmarks.kernel``. Every figure is CPU time of one thread; what is compared is timed in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels import Constants
from boulder_kernels.design import HEIGHT, design_at
from boulder_kernels.outcomes import empty_outcomes
from boulder_kernels.pieces import COUNTS, TO, given_pieces, uniform_layers
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_kernels.soil import Kinematics, Reaction, closed_form, element_sums
from boulder_kernels.table import LaneDesigns, simulate_lanes, some_rows
from boulder_sweep.judge.accuracy import LONGEST_HORIZON
from boulder_sweep.settings.model import SECOND_OPINIONS
from boulder_sweep.soils import with_law

from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .report import Table
from .timing import interleaved, machine, versions

ELEMENTS = 5000
SUMS = 2000
CLOSED_FORMS = 400_000
PASSES = 300
"""Designs that stand and are simulated again for a second opinion."""
STEP_S = 0.014
ROUNDS = 5


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


def same_soil(designs: bk.DesignTable, count: int) -> np.ndarray:
    """Return designs whose soil is cut into layers of equal height, as rows of a table for lanes."""
    rows = []
    for row in range(len(designs.L)):
        design = design_at(designs, row)
        layers = np.repeat(uniform_layers(design), count, axis=0)
        layers[:-1, TO] = design.d * np.arange(1, count) / count
        rows.append(layers)
    boxes = np.empty((len(rows), 0, 4))
    return given_pieces(np.stack(designs), np.stack(rows), boxes, count)


def same_taper(designs: bk.DesignTable) -> np.ndarray:
    """Return designs as tapered boulders whose top is as wide as their foot, as rows of a table for lanes."""
    half = 0.5 * designs.L
    point = np.stack([0.0 * half, designs.W, half, half], axis=1)
    outlines = np.stack([point, point], axis=1)
    outlines[:, 1, HEIGHT] = designs.H
    layers = np.stack([uniform_layers(design_at(designs, row)) for row in range(len(designs.L))])
    return given_pieces(np.stack(designs), layers, outlines, 1)


def measure() -> Table:
    """Measure everything; takes about ten seconds once the kernels are compiled."""
    designs = sample(DESIGNS)
    control = bk.Control(STEP_S, HORIZON, ROTATION_LIMIT, 0, False)
    readings = bk.corrected()
    stacked = np.stack(designs)
    stand = bk.simulate_table(designs, readings, control).theta_max < ROTATION_LIMIT
    passes = some_rows(designs, np.flatnonzero(stand)[:PASSES])
    asked = HeaveControl(ROTATION_LIMIT, LONGEST_HORIZON * HORIZON)
    with_elements = bk.constants_of(design_at(designs, 0), readings, ELEMENTS)
    closed = bk.constants_of(design_at(designs, 0), readings, 0)
    lines = Kinematics(0.05, 0.03, 2.0, 0.5, 0.4, 1.5)
    layered = {count: same_soil(designs, count) for count in COUNTS}

    def in_lanes(given: LaneDesigns) -> Callable[[], object]:
        out = empty_outcomes(given.designs.shape[1])
        return partial(simulate_lanes, *given, readings, control, bk.no_record(), out)

    work: dict[str, Callable[[], object]] = {
        "box": in_lanes(LaneDesigns(stacked)),
        **{f"{count} layers": in_lanes(LaneDesigns(table, count, True)) for count, table in layered.items()},
        "taper": in_lanes(LaneDesigns(same_taper(designs), 1, has_outline=True)),
        **{law: partial(second_opinions, with_law(passes, law), asked) for law in SECOND_OPINIONS},
        "sums": partial(repeated(element_sums), lines, with_elements, SUMS),
        "closed": partial(repeated(closed_form), lines, closed, CLOSED_FORMS),
    }
    least = {name: min(seconds) for name, seconds in interleaved(work, ROUNDS).items()}
    ratios = [f"{least[f'{count} layers'] / least['box']:.1f}" for count in COUNTS]
    opinion_s = sum(least[law] for law in SECOND_OPINIONS) / (len(SECOND_OPINIONS) * len(passes.L))
    sum_ns = 1e9 * least["sums"] / (SUMS * ELEMENTS)
    return Table(
        "kernel",
        "Kernels on one core",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; corrected readings; CPU time of one thread, least of "
        f"{ROUNDS} rounds; designs: {DESIGNS} random ones, step {1e3 * STEP_S:g} ms, no error estimate",
        ["what", "figure"],
        [
            ["a whole design", f"{1e6 * least['box'] / DESIGNS:.2f} us"],
            [
                f"the same in {', '.join(map(str, COUNTS[:-1]))} and {COUNTS[-1]} layers of soil",
                f"{', '.join(ratios[:-1])} and {ratios[-1]} times as long",
            ],
            ["the same as a tapered boulder", f"{least['taper'] / least['box']:.2f} times as long"],
            ["a second opinion of a design that stands, one by one, per soil model", f"{1e6 * opinion_s:.0f} us"],
            ["element sums", f"{sum_ns:.2f} ns per element, {1e-3 * sum_ns * ELEMENTS:.1f} us for N = {ELEMENTS}"],
            ["closed form instead, one by one", f"{1e9 * least['closed'] / CLOSED_FORMS:.0f} ns"],
        ],
    )


if __name__ == "__main__":
    print(measure().markdown())
