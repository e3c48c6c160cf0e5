"""From an accuracy asked for to the step that gives it, and what to say of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .settings import Sweep

STEPS_S = {"fast": 0.012, "balanced": 0.008, "fine": 0.004}
"""Step behind each named accuracy [s]; where errors are estimated, the solution reported has half of it."""
STEPS_PRINTED_S = {"fast": 0.006, "balanced": 0.004, "fine": 0.002}
"""The same where the restoring moment is read as printed: it jumps where the angular velocity passes zero, and a
design that grazes this edge needs shorter steps to come down on the right side."""
LADDER_S = (
    *(0.012, 0.008, 0.006, 0.004, 0.003, 0.002, 0.0015, 0.001),
    *(0.00075, 0.0005, 0.000375, 0.00025, 0.000125, 0.0000625),
)
"""Steps that a pilot chooses from [s], longest first. Longer ones save nothing: a design's events cost the same."""


@dataclass(frozen=True)
class Accuracy:
    """How accurately a sweep is computed.

    Parameters
    ----------
    asked
        ``fast``, ``balanced``, ``fine``, ``0.01 deg`` or ``step``.
    step_s
        Step of the integrator [s]; where the error is estimated, the finer of two solutions, by half this step, is
        reported.
    error_estimate
        Whether the error of every row is estimated, and verdicts nearer to a limit than it are undecided.
    achieved_deg
        Quantile `QUANTILE` of the estimated error of the rotation over the designs of a pilot [deg]; None where the
        accuracy asked for is no number.
    pilot_designs
        Designs of the pilot; 0 without one.
    met
        Whether what was asked for was achieved.
    """

    asked: str
    step_s: float
    error_estimate: bool
    achieved_deg: float | None = None
    pilot_designs: int = 0
    met: bool = True

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, for the metadata of the table."""
        found: dict[str, Any] = {
            "asked": self.asked,
            "step_s": self.step_s,
            "reported_step_s": 0.5 * self.step_s if self.error_estimate else self.step_s,
            "verdicts": "guarded by the estimated error" if self.error_estimate else "unguarded: no error is estimated",
        }
        if self.achieved_deg is not None:
            found["pilot_designs"] = self.pilot_designs
            found["estimated_error_p99_9_deg"] = self.achieved_deg
            found["met"] = self.met
        return found


def accuracy_of(sweep: Sweep) -> Accuracy:
    """Return how accurately a sweep is computed.

    Where the accuracy is a number, a pilot on a sample of the sweep chooses the step. The sample and so the step depend
    on nothing but the settings.

    Parameters
    ----------
    sweep
        The sweep, with a step, an accuracy by name, or the error admitted [deg].
    """
    solver = sweep.solver
    if solver.step_s is not None:
        return Accuracy("step", solver.step_s, error_estimate=False)
    if isinstance(solver.accuracy, float):
        # The kernels are heavy and the named accuracies do without them.
        from .pilot import pilot

        return pilot(sweep, solver.accuracy)
    name = str(solver.accuracy)
    return Accuracy(name, steps_of(sweep)[name], error_estimate=name != "fast")


def steps_of(sweep: Sweep) -> dict[str, float]:
    """Return the steps behind the named accuracies [s], for the readings of a sweep."""
    return STEPS_PRINTED_S if sweep.model.readings.restoring == "printed" else STEPS_S
