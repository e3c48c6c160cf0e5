"""Finer steps for the rows that need them: refused for their time steps, undecided for their error, or late.

Designs whose estimated error may be wrong have a second solution already, see `boulder_kernels.error_estimates`.

A row is *late* if its motion goes on past the horizon. A shallow boulder may rock for seconds, and rocking amplifies
every error: both solutions from which the error is estimated can follow the same wrong branch, where the estimate does
not see it. So a late row passes or overturns only if `AGREEING` others agree with it, and fails by how far the truck
gets only if one does, each with steps at most half as long as those before over the whole motion; until they do it is
simulated again by finer steps, and is undecided where even the finest differ.

What is still refused by the finest steps is simulated by `boulder_kernels.impact.simulate_last_resort`, whose late rows
need finer solutions of the same kind.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from boulder_kernels import Control
from boulder_kernels._jit import plain
from boulder_kernels.control import EVENT_TOLERANCE
from boulder_kernels.rules import (
    AGREEING,
    FIRST_FACTOR,
    Confirmation,
    after_finer,
    agree,
    confirmations,
    is_wanted,
)
from boulder_kernels.table import finer_step, some_rows
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import with_rows
from boulder_sweep.judge.verdict import JudgedOnce

FACTOR = 0.25
"""The step is shortened by `FIRST_FACTOR` `AGREEING` times, which confirms nearly all late rows, then by this factor.
With this one alone late rows take twice as long, and no verdict of 90,000 shallow boulders changes."""
LAST_RESORT_STEPS = 2_000
"""Steps to the horizon of the last attempt, where nothing asks for shorter ones."""
MOST_STEPS = 20_000
"""It ends with at least so many steps to the horizon, with the soil in closed form; fewer with many soil elements."""


def finer_controls(control: Control) -> Iterator[Control]:
    """Yield the controls by which open rows are simulated again, each finer than the one before.

    Parameters
    ----------
    control
        How they were simulated first.

    Notes
    -----
    The budget of a row is the last of these controls; sums over soil elements are too slow for it. It
    depends on the settings alone, so a row is the same whatever rows are simulated beside it. Where errors are
    estimated there are enough of them to confirm a late row, however slow.
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


class RowStates:
    """How far the rows of a block are decided, while some are simulated again by finer steps.

    Attributes
    ----------
    judged : Judged
        The rows as judged by the solution that counts so far.
    outcomes : OutcomeTable
        That solution, written in place.
    rule : ndarray of int, shape (n,)
        The rule of `boulder_kernels.rules` that decides each row by it.
    """

    def __init__(self, designs: Designs, control: Control, once: JudgedOnce) -> None:
        n = designs.size
        self._v_0 = designs.table.v_0
        self.judged, self.outcomes, self.rule = once
        needed = plain(confirmations)(self.rule, self.outcomes.t_end, control)
        self._confirmation = Confirmation(needed, np.full(n, control.h), np.zeros(n, dtype=bool))

    @property
    def unconfirmed(self) -> np.ndarray:
        """Numbers of the late rows with which not enough other solutions agree yet."""
        return np.flatnonzero(self._confirmation.unconfirmed)

    def wanted(self, control: Control) -> np.ndarray:
        """Return the numbers of the rows that a solution by some control may decide or confirm."""
        return np.flatnonzero(plain(is_wanted)(self._confirmation, self.rule, self.outcomes.status, control))

    def update(self, rows: np.ndarray, control: Control, once: JudgedOnce) -> None:
        """Compare a finer solution of some rows with what counts so far: it confirms it, or takes its place.

        Parameters
        ----------
        rows
            Numbers of the rows.
        control, once
            How they were simulated, and what came out, in the order of `rows`.
        """
        judged, outcomes, rule = once
        alike = plain(agree)(some_rows(self.outcomes, rows), outcomes, self._v_0[rows])
        needed = plain(confirmations)(rule, outcomes.t_end, control)
        confirmation = some_rows(self._confirmation, rows)
        confirmation, replaces = plain(after_finer)(confirmation, self.rule[rows], rule, alike, needed, control)
        replaced = rows[replaces]
        for values, new in zip(self._confirmation, confirmation, strict=True):
            values[rows] = new
        for values, new in zip((*self.outcomes, self.rule), (*outcomes, rule), strict=True):
            values[replaced] = new[replaces]
        self.judged = with_rows(self.judged, replaced, judged.rows(replaces))
