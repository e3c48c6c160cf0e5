"""How many soil elements are enough: sums over N elements against their limit in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.settings.model import PRESETS

ELEMENTS = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000)
PAPERS_N = 5000
"""Number of elements above which the paper saw no change."""
STEP_S = 5e-4
"""Short enough that the elements show, not the steps, down to some 1e-8 deg."""
SAMPLE_S = 0.01


@dataclass(frozen=True)
class Convergence:
    """Results for every number of elements; 0 stands for the closed form.

    Attributes
    ----------
    rotation_deg : dict of (str, str, int) to float
        Largest rotation by test, preset and number of elements; for the boulder that overturns, its rotation limit
        says more and `time_to_limit_s` is what converges.
    time_to_limit_s : dict of (str, str, int) to float
        Time at which 20 deg are reached; NaN where never.
    elements : tuple of int
        Numbers of elements.
    """

    rotation_deg: dict[tuple[str, str, int], float]
    time_to_limit_s: dict[tuple[str, str, int], float]
    elements: tuple[int, ...]

    def difference(self, test: str, preset: str, n: int) -> float:
        """Largest rotation by N elements minus that of the closed form [deg]."""
        return self.rotation_deg[test, preset, n] - self.rotation_deg[test, preset, 0]

    def order(self, test: str, preset: str) -> float:
        """Order of convergence between 100 elements and 1000: minus the slope in a double logarithmic plot."""
        many, few = (abs(self.difference(test, preset, n)) for n in (1000, 100))
        return math.log10(few / many) if few > 0.0 and many > 0.0 else math.nan

    def table(self) -> Table:
        """Return the passing test's rotation and the overturning test's time to 20 deg over N."""
        head = ["elements N"]
        head += [f"RWG {preset.replace('_', ' ')}: max rotation [deg]" for preset in PRESETS]
        head += [f"ABG {preset.replace('_', ' ')}: 20° at [ms]" for preset in PRESETS]
        found = Table(tuple(head))
        for n in (*self.elements, 0):
            cells = [f"{n}" if n else "closed form"]
            cells += [number(self.rotation_deg["rwg", preset, n], 4) for preset in PRESETS]
            cells += [number(1e3 * self.time_to_limit_s["abg", preset, n], 3) for preset in PRESETS]
            found.add(*cells)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "elements": [
                {
                    "test": test,
                    "preset": preset,
                    "soil_elements": n or "closed_form",
                    "max_rotation_deg": rotation,
                    "time_to_limit_s": None if math.isnan(t := self.time_to_limit_s[test, preset, n]) else t,
                }
                for (test, preset, n), rotation in self.rotation_deg.items()
            ]
        }


def convergence(elements: Sequence[int] = ELEMENTS) -> Convergence:
    """Simulate both crash tests under both presets with ever more soil elements, and in closed form.

    Parameters
    ----------
    elements
        Numbers of elements.
    """
    rotation, reached = {}, {}
    for test in NAMES:
        sweep = crash_test(test)
        for preset in PRESETS:
            for n in (*elements, 0):
                outcome = simulate(
                    sweep, readings=preset, soil_elements=n, step_s=STEP_S, sample_s=SAMPLE_S
                ).motion.outcome
                rotation[test, preset, n] = math.degrees(outcome.maxima.theta)
                reached[test, preset, n] = outcome.t_limit
    return Convergence(rotation, reached, tuple(elements))
