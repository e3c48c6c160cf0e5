"""What few soil elements cost: a sample of a sweep with its number of elements, and with enough."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.judge.accuracy import Accuracy, steps_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_rows
from boulder_sweep.judge.judged import ERROR
from boulder_sweep.settings.model import CLOSED_FORM, ENOUGH_ELEMENTS
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

DESIGNS = 48
"""Most designs that are simulated twice."""


def words_of_few_elements(sweep: Sweep) -> str:
    """Return in words how far sums over a sweep's soil elements are off.

    Parameters
    ----------
    sweep
        A sweep whose `Model.has_few_elements`. At most `DESIGNS` of its designs are simulated with its soil elements,
        and again in closed form, by the steps of ``fast``. Uncertain inputs have their means.
    """
    rows = sampled_rows(sweep, DESIGNS)
    few = _judged(sweep, rows)
    many = _judged(replace(sweep, model=replace(sweep.model, soil_elements=0)), rows)
    computed = (few.verdict != ERROR) & (many.verdict != ERROR)
    changed = int((few.verdict != many.verdict)[computed].sum())
    off = np.nan_to_num(few["max_rotation_deg"] - many["max_rotation_deg"])[computed]
    return (
        f"{counted(sweep.model.soil_elements, 'soil element')} against the closed form: another verdict for {changed} "
        f"of {counted(int(computed.sum()), 'design')} of this file, the rotation off by up to "
        f"{np.abs(off).max(initial=0.0):.2g} deg; take {ENOUGH_ELEMENTS} or more, or {CLOSED_FORM}"
    )


def _judged(sweep: Sweep, rows: np.ndarray) -> Judged:
    """Simulate and judge some designs of a sweep, without second opinions."""
    accuracy = Accuracy("fast", steps_of(sweep)["fast"], error_estimate=False)
    evaluation = replace(evaluation_of(sweep, accuracy), second_opinion=())
    return evaluation(sweep.plan.selection(rows))
