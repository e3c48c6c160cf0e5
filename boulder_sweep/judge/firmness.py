"""How firm a table is: how many passes small changes of the inputs, another reading or another law would take away.

A sample of the designs is simulated again with each change. It depends on the settings alone, and so do its results:
they stand in the metadata of every file of the table.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import DesignTable, Readings, as_printed, corrected
from boulder_sweep.judge.accuracy import QUANTILE, STEPS, STEPS_PRINTED, accuracy_of, reported_step_s, simulated
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import plain_designs, sampled_designs, sampled_rows
from boulder_sweep.judge.judged import CHANGES_SIDE, FAIL, PASS
from boulder_sweep.judge.validity import SEPARATOR, flag_counts
from boulder_sweep.judge.verdict import judge
from boulder_sweep.settings.model import RESISTANCES
from boulder_sweep.soils import plain, with_soil

if TYPE_CHECKING:
    from boulder_kernels import Control
    from boulder_sweep.judge.inputs import Designs
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

DESIGNS = 2048
"""Designs of the sample, with the soil in closed form; the steps of `balanced` and their error take 0.1 s."""
FEWEST_DESIGNS = 1024
"""Smallest sample, if the sweep has this many designs."""
SHARE = 100
"""The sample is at most one in this many designs, so that it stays a small part of the run."""
SHORTEST_STEP_S = 1e-3
"""Where steps are shorter, the sample for the numerical error is smaller in proportion."""
ANGLE_DEG = 1.0
SPEED = 0.05
LEAST_ANGLE_DEG = 1.0
CHANGES = {
    "reading": "the other reading of the paper",
    "friction_angle": f"{ANGLE_DEG:g} deg less friction angle",
    "speed": f"{SPEED:.0%} more speed",
    **{law: f"the resistance {law}" for law in RESISTANCES},
}
"""What is changed, by its name in the result; the law of the designs itself is left out."""


@dataclass(frozen=True)
class Firmness:
    """How firm the verdicts of a sweep are.

    Attributes
    ----------
    designs : int
        Designs of the sample; those that cannot be computed are left out.
    lost : dict of str to float
        Fraction of the passes of the sample that fail after each of `CHANGES`; empty where none passes.
    numerical_error_deg, numerical_error_m : float or None
        Estimated error not exceeded by 99.9 % of those that did not overturn; None if none is estimated.
    passes : int
        Passes of the sample.
    flags : dict of str to int
        Passes of the sample with each flag of `boulder_sweep.judge.validity`; under ``""`` those without any.
    changing : int
        Designs of the sample whose verdict changes with the uncertain inputs.
    """

    designs: int
    lost: dict[str, float]
    numerical_error_deg: float | None
    numerical_error_m: float | None
    passes: int
    flags: dict[str, int] = field(default_factory=dict)
    changing: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return asdict(self)


def firmness_of(sweep: Sweep) -> Firmness:
    """Find out how firm the verdicts of a sweep are, from a sample of its designs in the closed form of the soil.

    Parameters
    ----------
    sweep
        The sweep.
    """
    count = min(DESIGNS, max(FEWEST_DESIGNS, sweep.n_designs // SHARE))
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    designs, limits = sampled_designs(sweep, count), evaluation.limits
    control, readings = evaluation.control._replace(elements=0), evaluation.readings
    law = sweep.model.resistance
    other = as_printed() if readings == corrected() else corrected()

    def verdicts(table: DesignTable, read: Readings) -> Judged:
        steps = (STEPS if read.restoring_gravity else STEPS_PRINTED)["fast"]
        # Not beyond the horizon: without a proof that would cost ten times as much for a few verdicts.
        fast = control._replace(h=steps.step_s, locate_yield=False, error_estimate=False, longest_horizon=0.0)
        changed = designs._replace(table=table)
        return judge(simulated(changed, read, fast), changed, limits)

    def by(law: str, change: float = 0.0) -> DesignTable:
        """Return the designs by a law, with all friction angles changed [rad]."""
        phi = np.maximum(given.phi + change, least)
        return with_soil(given._replace(phi=phi), law, ground, change, sweep.model.shape)

    given, ground = plain(plain_designs(sweep, count).table), sweep.model.ground
    least = math.radians(LEAST_ANGLE_DEG)
    table = designs.table
    judged = verdicts(table, readings)
    passes, changing = judged.verdict == PASS, 0
    if sweep.cases:
        block = sweep.plan.selection(sampled_rows(sweep, count))
        only = ("verdict", "reason", "margin", "time_to_limit_s", "validity")
        worst = replace(evaluation, only=only, second_opinion=())(block).rows(np.asarray(block.reasons.codes) == 0)
        passes &= worst.verdict == PASS
        flagged = [CHANGES_SIDE in word.split(SEPARATOR) for word in worst.words["validity"]]
        changing = int(np.array(flagged)[worst["validity"]].sum())
    variants = {
        "reading": (table, other),
        "friction_angle": (by(law, -math.radians(ANGLE_DEG)), readings),
        "speed": (table._replace(v_0=table.v_0 * (1.0 + SPEED)), readings),
        **{another: (by(another), readings) for another in RESISTANCES if another != law},
    }
    lost = {}
    if passes.any():
        for name, (variant, read) in variants.items():
            lost[name] = float((verdicts(variant, read).verdict[passes] == FAIL).mean())
    words = Counter(judged.words["validity"][code] for code in judged["validity"][passes].tolist())
    return Firmness(
        designs=designs.size,
        lost=lost,
        **_numerical_errors(designs, readings, control),
        passes=int(passes.sum()),
        flags=flag_counts(words.items()),
        changing=changing,
    )


def _numerical_errors(designs: Designs, readings: Readings, control: Control) -> dict[str, float | None]:
    """Estimated errors not exceeded by most of the designs that did not overturn."""
    error_deg = error_m = None
    share = min(1.0, reported_step_s(control) / SHORTEST_STEP_S)
    some = designs.rows(slice(None, None, max(1, round(1.0 / share))))
    outcomes = simulated(some, readings, control._replace(longest_horizon=0.0))
    counts = np.isfinite(outcomes.theta_error) & (outcomes.theta_error > 0.0)
    if counts.any():
        of_all = (np.degrees(outcomes.theta_error[counts]), outcomes.x_error[counts])
        # Rounded so that a processor that differs in the last bits finds the same.
        error_deg, error_m = (float(f"{np.quantile(values, QUANTILE, method='higher'):.2g}") for values in of_all)
    return {"numerical_error_deg": error_deg, "numerical_error_m": error_m}
