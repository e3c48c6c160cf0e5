"""From the requested accuracy to the control of the integrator."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_kernels import Control, Readings
from boulder_kernels._jit import plain
from boulder_kernels.control import EVENT_TOLERANCE
from boulder_kernels.rules import AGREEING, FIRST_FACTOR
from boulder_kernels.settling import proof_is_possible
from boulder_kernels.table import finer_step, is_paired
from boulder_sweep.soils import is_layered

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


class Steps(NamedTuple):
    """Time steps of the integrator."""

    step_s: float
    """Length of a step [s]; where errors are checked, the solution reported has a third of it."""
    locate_yield: bool = False
    """Whether steps also end where the soil reaches its ultimate resistance. This costs a little more per step, and the
    error falls with the fifth power of the step instead of the third."""


STEPS = {"fast": Steps(0.012), "balanced": Steps(0.012), "fine": Steps(0.006, locate_yield=True)}
"""Steps of each named accuracy: but for ``fast``, three times the steps of the solution that is reported."""
STEPS_PRINTED = {"fast": Steps(0.006), "balanced": Steps(0.006), "fine": Steps(0.003, locate_yield=True)}
"""Steps of each named accuracy for the restoring moment as printed: it jumps where the angular velocity passes zero,
and a design close to that jump needs shorter steps to end on the right side of it."""
ELEMENTS_AS_FAST = 16
"""Number of soil elements that cost about as much as the closed form."""
DESIGNS_A_PIECE = 10_000
"""With fewer designs for each of their pieces, boulders of several are simulated one after another: lanes are several
times as fast, but take 10 s longer to compile for each piece, once, and are mostly idle where few rows are late."""
FACTOR = 0.25
"""The step of open rows is shortened by `FIRST_FACTOR` `AGREEING` times, which confirms nearly all late rows, then by
this factor. With this one alone late rows take twice as long, and no verdict of 90,000 shallow boulders changes."""
LAST_RESORT_STEPS = 2_000
"""Steps to the horizon of the last attempt, where nothing asks for shorter ones."""
MOST_STEPS = 20_000
"""Steps to the horizon at which shortening ends, with the soil in closed form; fewer with many soil elements."""
LONGEST_HORIZON = 10.0
"""A design without proof of its verdict at the horizon is simulated for up to this many horizons."""


@dataclass(frozen=True)
class Accuracy:
    """How accurately a sweep is computed."""

    asked: str
    """``fast``, ``balanced``, ``fine`` or ``step``."""
    steps: Steps
    """Steps of the integrator; where `error_estimate`, a solution with a third of the step is reported."""
    error_estimate: bool
    """Whether doubtful rows are solved a second time, and rows closer to a limit than their error again by finer steps;
    without, the error of a row is estimated from the steps of one solution, and such rows stay undecided."""
    paired: bool = False
    """Whether every row is solved twice for its error, see `boulder_kernels.table.is_paired`."""

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, for the metadata of the table."""
        reported_s = finer_step(self.steps.step_s) if self.error_estimate else self.steps.step_s
        return {
            "asked": self.asked,
            "step_s": self.steps.step_s if self.paired else reported_s,
            "reported_step_s": reported_s,
            "yield_located": self.steps.locate_yield,
            "verdicts": "guarded by the estimated error"
            if self.error_estimate
            else "guarded by the error of one solution, neither confirmed nor refined",
        }


def steps_of(sweep: Sweep) -> dict[str, Steps]:
    """Return the steps of the named accuracies for the readings of a sweep."""
    return STEPS_PRINTED if sweep.model.readings.restoring == "printed" else STEPS


def readings_of(sweep: Sweep) -> Readings:
    """Return the readings of a sweep's model as the kernels name them."""
    return Readings(*sweep.model.readings.corrected)


def control_of(sweep: Sweep, accuracy: Accuracy) -> Control:
    """Return how the motion is integrated for a sweep: step, horizon, limit, soil, error estimate.

    What goes on past the horizon is followed only where finer steps can confirm it, and where a proof of its end is
    possible at all.
    """
    shape, horizon = sweep.model.shape, float(sweep.solver.horizon_s)
    goes_on = accuracy.error_estimate and plain(proof_is_possible)(readings_of(sweep))
    return Control(
        h=accuracy.steps.step_s,
        horizon=horizon,
        theta_limit=math.radians(sweep.criterion.max_rotation_deg),
        elements=sweep.model.soil_elements,
        error_estimate=accuracy.error_estimate,
        locate_yield=accuracy.steps.locate_yield,
        longest_horizon=LONGEST_HORIZON * horizon if goes_on else 0.0,
        paired=accuracy.paired,
        side_by_side=shape.is_box or goes_in_lanes(len(shape.points) - 1, sweep.n_designs),
    )


def goes_in_lanes(pieces: int, designs: int) -> bool:
    """Return whether so many boulders whose outline has so many pieces are simulated side by side."""
    return pieces == 1 or designs >= DESIGNS_A_PIECE * pieces


def finer_controls(control: Control) -> Iterator[Control]:
    """Yield the controls by which open rows are simulated again, each finer than the one before.

    The budget of a row is the last of these controls; sums over soil elements are too slow for it. It depends on the
    settings alone, so a row is the same whatever rows are simulated beside it. Where errors are estimated there are
    enough of them to confirm a late row, however slow.
    """
    finest = control.horizon / MOST_STEPS * max(1.0, control.elements / ELEMENTS_AS_FAST)
    h = control.h
    finer = control._replace(locate_yield=True, paired=True, event_tolerance=EVENT_TOLERANCE)
    confirming = AGREEING if control.error_estimate else 0
    while h > finest or confirming > 0:
        h *= FIRST_FACTOR if confirming > 0 else FACTOR
        confirming -= 1
        yield finer._replace(h=h)
    if control.elements == 0:
        h = min(control.h, control.horizon / LAST_RESORT_STEPS)
        for times in range(1 + AGREEING if control.error_estimate else 1):
            yield finer._replace(h=h * FACTOR**times, last_resort=True)


def reported_step_s(control: Control) -> float:
    """Return the step of the solution that is reported [s]; of a doubtful design it is half of that."""
    return finer_step(control.h) if control.error_estimate else control.h


def accuracy_of(sweep: Sweep) -> Accuracy:
    """Return how accurately a sweep is computed."""
    solver = sweep.solver
    if solver.step_s is not None:
        return Accuracy("step", Steps(solver.step_s), error_estimate=False)
    name = str(solver.accuracy)
    accuracy = Accuracy(name, steps_of(sweep)[name], error_estimate=name != "fast")
    model = sweep.model
    layered = is_layered(model.resistance, model.ground, model.shape)
    paired = is_paired(readings_of(sweep), control_of(sweep, accuracy), layered=layered)
    return replace(accuracy, paired=accuracy.error_estimate and paired)
