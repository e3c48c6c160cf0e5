"""From the requested accuracy to a time step, and how it is reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_kernels.table import finer_step

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
"""Steps of each named accuracy: but for ``fast``, three times those of the solution that is reported."""
STEPS_PRINTED = {"fast": Steps(0.006), "balanced": Steps(0.006), "fine": Steps(0.003, locate_yield=True)}
"""The same where the restoring moment is read as printed: it jumps where the angular velocity passes zero, and a
design close to that jump needs shorter steps to end on the right side of it."""
LADDER = (
    *(Steps(0.018), Steps(0.012)),
    *(Steps(1e-3 * step, locate_yield=True) for step in (12, 9, 6, 4.5, 3, 2.25, 1.5, 1.125)),
    *(Steps(1e-3 * step, locate_yield=True) for step in (0.75, 0.5625, 0.375, 0.1875)),
)
"""Steps a pilot run chooses from, cheapest first. Still longer steps save little because events dominate the cost."""


ELEMENTS_AS_FAST = 16
"""Number of soil elements that cost about as much as the closed form."""


@dataclass(frozen=True)
class Accuracy:
    """How accurately a sweep is computed.

    Parameters
    ----------
    asked
        ``fast``, ``balanced``, ``fine``, ``0.01 deg`` or ``step``.
    steps
        Steps of the integrator; where ``error_estimate``, a solution with a third of the step is reported.
    error_estimate
        Whether doubtful rows are solved a second time, and rows closer to a limit than their error again by finer
        steps; without, the error of a row is that of the steps of one solution, and such rows stay undecided.
    achieved_deg
        Quantile `QUANTILE` of the estimated error of the rotation over the designs of a pilot run [deg]; None unless
        the requested accuracy is a number.
    pilot_designs
        Designs of the pilot run; 0 without one.
    met
        Whether the requested accuracy was achieved.
    paired
        Whether every row is solved twice for its error, see `boulder_kernels.table.is_paired`.
    """

    asked: str
    steps: Steps
    error_estimate: bool
    achieved_deg: float | None = None
    pilot_designs: int = 0
    met: bool = True
    paired: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, for the metadata of the table."""
        reported_s = finer_step(self.steps.step_s) if self.error_estimate else self.steps.step_s
        found: dict[str, Any] = {
            "asked": self.asked,
            "step_s": self.steps.step_s if self.paired else reported_s,
            "reported_step_s": reported_s,
            "yield_located": self.steps.locate_yield,
            "verdicts": "guarded by the estimated error"
            if self.error_estimate
            else "guarded by the error of one solution, neither confirmed nor refined",
        }
        if self.achieved_deg is not None:
            found["pilot_designs"] = self.pilot_designs
            found["estimated_error_p99_9_deg"] = self.achieved_deg
            found["met"] = self.met
        return found


def steps_of(sweep: Sweep) -> dict[str, Steps]:
    """Return the steps of the named accuracies for the readings of a sweep."""
    return STEPS_PRINTED if sweep.model.readings.restoring == "printed" else STEPS
