"""The admitted box of inputs and the named refusals, as tables made from the settings and the rules themselves."""

from __future__ import annotations

from collections import Counter
from functools import cache

import numpy as np

from boulder_kernels import Control, Status, corrected
from boulder_sweep.columns import INPUT_COLUMNS, VERDICTS
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import block_of
from boulder_sweep.judge.accuracy import LONGEST_HORIZON, STEPS
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import ERROR, UNDECIDED, Judged
from boulder_sweep.judge.verdict import STATUS_REASONS, Limits, judge
from boulder_sweep.settings.fields import FIELDS, INPUTS, MAX_ELEMENTS

SPARE = 4
"""Designs drawn for each one that is kept."""


def admitted_table() -> Table:
    """Return every bound of the settings; the reasons stand in the messages of refusals."""
    table = Table(("entry", "least", "most", "unit"))
    for field in FIELDS:
        if field.admitted is not None:
            low, high, _ = field.admitted
            table.add(f"`{field.path}`", f"{low:g}", f"{high:g}", field.unit)
    table.add("soil elements", "1", f"{MAX_ELEMENTS:g}", "1")
    return table


def refusal_table() -> Table:
    """Return every reason for which a design of the box may have no result."""
    table = Table(("status", "reason in the table"))
    for status, reason in STATUS_REASONS.items():
        table.add(f"`{Status(status).name}`", reason)
    return table


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


@cache
def box_shares_table(count: int = 4000, seed: int = 1) -> Table:
    """Return how designs from the whole admitted box end, by the steps of `balanced` and by finer ones."""
    designs = box_designs(count, seed)
    limits = Limits(float(np.radians(20.0)), "P1")
    control = Control(STEPS["balanced"].step_s, 1.0, limits.rotation, 0, True, longest_horizon=LONGEST_HORIZON)
    evaluation = Evaluation(corrected(), control, limits)
    once = judge(evaluation.simulate(designs.table, corrected(), control), designs, limits)
    table = Table(("ends as", "by the usual steps", "with finer steps", "share"))
    counts = [Counter(_endings(rows)) for rows in (once, evaluation.judged(designs))]
    for ending in sorted({**counts[0], **counts[1]}, key=lambda word: -counts[1][word]):
        table.add(ending, str(counts[0][ending]), str(counts[1][ending]), f"{counts[1][ending] / count:.1%}")
    first, last = (sum(number for word, number in found.items() if is_left_open(word)) for found in counts)
    table.add("undecided or refused, together", str(first), str(last), f"{last / count:.1%}")
    return table


def is_left_open(ending: str) -> bool:
    """Whether an ending, as of `box_shares_table`, decides nothing."""
    return ending.startswith((VERDICTS[ERROR], VERDICTS[UNDECIDED]))


def _endings(judged: Judged) -> list[str]:
    """Return verdict and reason of every row; of refused ones the cause alone."""
    words = []
    for verdict, reason in zip(judged.verdict, judged.reason, strict=True):
        found = judged.reasons[reason].partition(" (")[0]
        words.append(", ".join(word for word in (VERDICTS[verdict], found) if word))
    return words
