"""How firm a table is: how many passes small changes of the inputs, another reading or another law would take away.

A sample of the designs is simulated again with each change. It depends on the settings alone, and so do its results:
they stand in the metadata of every file of the table.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import DesignTable, Readings, as_printed, corrected, simulate_table
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import plain_designs, sampled_designs, sampled_rows
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.judge.validity import flag_counts
from boulder_sweep.judge.verdict import judge
from boulder_sweep.settings.model import RESISTANCES
from boulder_sweep.soils import plain, with_soil

if TYPE_CHECKING:
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

DESIGNS = 2048
"""Most designs of the sample, with the soil in closed form."""
FEWEST_DESIGNS = 1024
"""Smallest sample, if the sweep has this many designs."""
SHARE = 100
"""The sample is at most one in this many designs, so that it stays a small part of the run."""
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


def firmness_of(sweep: Sweep) -> dict[str, Any]:
    """Find out how firm the verdicts of a sweep are, from a sample of its designs in the closed form of the soil.

    Parameters
    ----------
    sweep
        The sweep.

    Returns
    -------
    dict
        ``designs`` of the sample, without those that cannot be computed; its ``passes``; ``lost``: the fraction of them
        that fail after each of `CHANGES`, empty where none passes; ``flags``: how many have each flag of
        `boulder_sweep.judge.validity`, under ``""`` those without any.
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
        return judge(simulate_table(table, read, fast), designs._replace(table=table), limits)

    def by(law: str, change: float = 0.0) -> DesignTable:
        """Return the designs by a law, with all friction angles changed [rad]."""
        phi = np.maximum(given.phi + change, least)
        return with_soil(given._replace(phi=phi), law, ground, change, sweep.model.shape)

    given, ground = plain(plain_designs(sweep, count).table), sweep.model.ground
    least = math.radians(LEAST_ANGLE_DEG)
    table = designs.table
    judged = verdicts(table, readings)
    passes = judged.verdict == PASS
    if sweep.cases:
        block = sweep.plan.selection(sampled_rows(sweep, count))
        only = ("verdict", "reason", "margin", "time_to_limit_s")
        worst = replace(evaluation, only=only, second_opinion=())(block)
        passes &= worst.verdict[np.asarray(block.reasons.codes) == 0] == PASS
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
    flags = flag_counts(words.items())
    return {"designs": designs.size, "passes": int(passes.sum()), "lost": lost, "flags": flags}
