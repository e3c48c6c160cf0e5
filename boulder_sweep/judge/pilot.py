"""From the requested accuracy to time steps: by name, or by a pilot run on a sample of the designs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from boulder_kernels import Control, OutcomeTable, Readings, Status, simulate_table
from boulder_kernels.table import is_paired
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST, LADDER, Accuracy, Steps, steps_of
from boulder_sweep.judge.evaluation import control_of, readings_of
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.soils import is_layered

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.settings import Sweep


MOST_CORNERS = 64


def sampled_rows(sweep: Sweep, count: int) -> np.ndarray:
    """Choose rows of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    count
        Approximate number of rows; all rows if the sweep has no more.

    Returns
    -------
    ndarray of int64, shape (n,)
        Row numbers, ascending, each once: the corners of the grid, and rows along a sequence that fills all axes
        evenly at once (every axis is cut into as many strata as it has values). A list of designs has one axis.
    """
    lengths = sweep.plan.lengths
    if sweep.n_designs <= count:
        return np.arange(sweep.n_designs)
    places = _corners(lengths, min(count, MOST_CORNERS))
    spread = _spread(lengths, count - len(places))
    rows = np.concatenate([np.array(places, dtype=np.int64).reshape(-1, len(lengths)), spread]) @ np.array(
        sweep.plan.strides, dtype=np.int64
    )
    return np.unique(rows)


def _corners(lengths: tuple[int, ...], most: int) -> list[tuple[int, ...]]:
    """Places of the corners; if there are too many, both ends and their neighbours along one axis."""
    ends = [(0, length - 1) if length > 1 else (0,) for length in lengths]
    if math.prod(len(pair) for pair in ends) <= most:
        return list(product(*ends))
    first, last = tuple(pair[0] for pair in ends), tuple(pair[-1] for pair in ends)
    found = [first, last]
    for axis in range(len(ends)):
        found.append((*first[:axis], last[axis], *first[axis + 1 :]))
        found.append((*last[:axis], first[axis], *last[axis + 1 :]))
    return found[:most]


def _spread(lengths: tuple[int, ...], count: int) -> np.ndarray:
    """Places along Roberts' sequence, whose steps are powers of the root of x^(k+1) = x + 1, shape (count, k)."""
    k = len(lengths)
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (k + 1))
    steps = root ** -np.arange(1.0, k + 1.0)
    along = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    sizes = np.array(lengths, dtype=np.int64)
    return np.minimum((along * sizes).astype(np.int64), sizes - 1)


DESIGNS = 4096
"""Designs of a pilot run, soil in closed form."""
FEWEST_DESIGNS = 256
"""Smallest number of designs, for any number of soil elements."""
QUANTILE = 0.999
"""Fraction of the designs whose estimated error must not exceed the requested accuracy."""
AT_ONCE, AT_ONCE_CLOSED = 256, 4096
"""Designs simulated per call, with element sums and in closed form: an interruption waits for the current call."""


def accuracy_of(sweep: Sweep) -> Accuracy:
    """Return how accurately a sweep is computed.

    If the accuracy is a number, a pilot run on a sample of the sweep chooses the step. The sample, and therefore the
    step, depends only on the settings.

    Parameters
    ----------
    sweep
        The sweep, with a step, a named accuracy, or a tolerance [deg].
    """
    solver = sweep.solver
    if solver.step_s is not None:
        return Accuracy("step", Steps(solver.step_s), error_estimate=False)
    if isinstance(solver.accuracy, float):
        return pilot(sweep, solver.accuracy)
    name = str(solver.accuracy)
    found = Accuracy(name, steps_of(sweep)[name], error_estimate=name != "fast")
    model = sweep.model
    layered = is_layered(model.resistance, model.ground, model.shape)
    paired = is_paired(readings_of(sweep), control_of(sweep, found), layered=layered)
    return replace(found, paired=found.error_estimate and paired)


@lru_cache(maxsize=8)
def pilot(sweep: Sweep, wanted_deg: float) -> Accuracy:
    """Choose the step of a sweep by a pilot run on a sample of its designs.

    Parameters
    ----------
    sweep
        The sweep.
    wanted_deg
        Tolerance of the rotation [deg], to be met by a fraction `QUANTILE` of the designs.

    Returns
    -------
    Accuracy
        The first steps of `LADDER` that meet it, or those that come closest if none does.
    """
    designs = sampled_designs(sweep, pilot_size(sweep.model.elements))
    readings = readings_of(sweep)
    found: list[tuple[float, int]] = []
    for rung, steps in enumerate(LADDER):
        control = control_of(sweep, Accuracy("", steps, error_estimate=True, paired=True))
        # Rounded, so that a processor that differs in the last bits finds the same.
        achieved = float(f"{estimated_error_deg(designs, readings, control):.3g}")
        found.append((achieved, rung))
        if achieved <= wanted_deg:
            break
    achieved, rung = min(found)
    return Accuracy(
        asked=f"{wanted_deg:g} deg",
        steps=LADDER[rung],
        error_estimate=True,
        achieved_deg=achieved,
        pilot_designs=designs.size,
        met=achieved <= wanted_deg,
        paired=True,
    )


def pilot_size(elements: int) -> int:
    """Return the number of designs in a pilot run, by the number of soil elements (0: closed form)."""
    return max(FEWEST_DESIGNS, DESIGNS * ELEMENTS_AS_FAST // max(elements, ELEMENTS_AS_FAST))


def sampled_designs(sweep: Sweep, count: int) -> Designs:
    """Return about this many designs of a sweep, without those that cannot be computed."""
    return designs_of(*_sampled(sweep, count), sweep.model.resistance, sweep.model.ground)


def plain_designs(sweep: Sweep, count: int) -> Designs:
    """Return the same designs in the soil that their inputs describe, by the paper's law of the resistance."""
    return designs_of(*_sampled(sweep, count), shape=sweep.model.shape)


def _sampled(sweep: Sweep, count: int) -> tuple[DesignBlock, np.ndarray]:
    """Return a block of about this many designs, and which of them can be computed."""
    block = sweep.plan.selection(sampled_rows(sweep, count))
    return block, np.asarray(block.reasons.codes) == 0


def simulated(designs: Designs, readings: Readings, control: Control) -> OutcomeTable:
    """Simulate designs in pieces, so that an interruption takes effect soon."""
    size = AT_ONCE if control.elements or designs.laws else AT_ONCE_CLOSED
    rows = [designs.rows(slice(at, at + size)) for at in range(0, designs.size, size)] or [designs]
    pieces = [simulate_table(some.table, readings, control, *some.laws) for some in rows]
    return type(pieces[0])(*(np.concatenate(columns) for columns in zip(*pieces, strict=True)))


def estimated_error_deg(designs: Designs, readings: Readings, control: Control) -> float:
    """Quantile of the estimated errors of the rotation [deg]; 0 where no error could be estimated.

    A boulder that overturns has no error of its largest rotation, but its other errors stand for one: those of the
    displacements, over the embedment depth or half the height of the boulder, as `estimate_errors` compares them.
    """
    outcomes = simulated(designs, readings, control)
    arm = np.maximum(designs.table.d, 0.5 * designs.table.H)
    limit = (outcomes.status == Status.LIMIT) & np.isfinite(outcomes.theta_error)
    errors = np.where(limit, outcomes.x_error / arm, outcomes.theta_error)
    counts = ~np.isnan(errors)
    if not counts.any():
        return 0.0
    return math.degrees(float(np.quantile(errors[counts], QUANTILE, method="higher")))
