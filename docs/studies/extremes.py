"""How designs from the whole admitted box end."""

from __future__ import annotations

from collections import Counter

import numpy as np

from boulder_kernels import Control, corrected
from boulder_sweep.columns import INPUT_COLUMNS, VERDICTS
from boulder_sweep.designs import block_of
from boulder_sweep.judge.accuracy import LONGEST_HORIZON, STEPS
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import ERROR, UNDECIDED, Judged
from boulder_sweep.judge.verdict import Limits, judge
from boulder_sweep.settings.fields import INPUTS

SPARE = 4
"""Designs drawn for each one that is kept."""


def box_designs(count: int, seed: int) -> Designs:
    """Draw designs from the whole admitted box, by their logarithm where its lower end is positive.

    Parameters
    ----------
    count
        Number of designs; those buried deeper than they are high are drawn again.
    seed
        Of the random numbers.
    """
    rng = np.random.default_rng(seed)
    ends = {field.name: field.admitted for field in INPUTS if field.admitted is not None}

    def drawn(name: str) -> np.ndarray:
        low, high, _ = ends[name]
        if low <= 0.0:
            return rng.uniform(low, high, SPARE * count)
        return np.exp(rng.uniform(np.log(low), np.log(high), SPARE * count))

    given = {name: drawn(name) for name in INPUT_COLUMNS if name != "impact_height_m"}
    given["hood_height_m"] = np.maximum(given["hood_height_m"], given["bumper_height_m"])
    kept = np.flatnonzero(given["embedment_depth_m"] < given["boulder_height_m"])[:count]
    return designs_of(block_of({name: values[kept] for name, values in given.items()}))


def box_endings(count: int = 4000, seed: int = 1) -> list[Counter[str]]:
    """Count how designs from the whole admitted box end, by the steps of `balanced` and by finer ones."""
    designs = box_designs(count, seed)
    limits = Limits(float(np.radians(20.0)), "P1")
    control = Control(STEPS["balanced"].step_s, 1.0, limits.rotation, 0, True, longest_horizon=LONGEST_HORIZON)
    evaluation = Evaluation(corrected(), control, limits)
    once = judge(evaluation.simulate(designs.table, corrected(), control), designs, limits)
    return [Counter(_endings(rows)) for rows in (once, evaluation.judged(designs))]


def left_open(endings: Counter[str]) -> int:
    """Return how many designs end undecided or refused."""
    return sum(number for word, number in endings.items() if is_left_open(word))


def box_words() -> str:
    """Say how many designs from the whole admitted box end undecided or refused."""
    usual, finer = box_endings()
    share = left_open(finer) / finer.total()
    return (
        f"Of {finer.total()} designs drawn from the whole admitted box {left_open(finer)} ({share:.1%}) end undecided "
        f"or refused; by the usual steps alone it would be {left_open(usual)}."
    )


def is_left_open(ending: str) -> bool:
    """Whether an ending of `box_endings` decides nothing."""
    return ending.startswith((VERDICTS[ERROR], VERDICTS[UNDECIDED]))


def _endings(judged: Judged) -> list[str]:
    """Return verdict and reason of every row; of refused ones the cause alone."""
    words = []
    for verdict, reason in zip(judged.verdict, judged.reason, strict=True):
        found = judged.reasons[reason].partition(" (")[0]
        words.append(", ".join(word for word in (VERDICTS[verdict], found) if word))
    return words
