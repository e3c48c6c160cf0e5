"""Finer steps for the rows that need them: refused for their time steps, undecided for their error, or late.

Designs whose estimated error may be wrong have a second solution already, see `boulder_kernels.error_estimates`.

A row is *late* if its motion goes on past the horizon. A shallow boulder may rock for seconds, and rocking amplifies
every error: both solutions from which the error is estimated can follow the same wrong branch, where the estimate does
not see it. So a late row passes or overturns only if `AGREEING` others agree with it, each with steps at most half as
long as those before over the whole motion; until they do it is simulated again by finer steps, and is undecided
where even the finest differ.

What is still refused by the finest steps is simulated by `boulder_kernels.impact.simulate_last_resort`, whose late rows
need finer solutions of the same kind.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from boulder_kernels import Control, OutcomeTable, Status
from boulder_kernels.plastic import is_plastic
from boulder_kernels.table import finer_step, some_rows
from boulder_sweep.columns import REASONS
from boulder_sweep.judge.accuracy import ELEMENTS_AS_FAST
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import ERROR, NUMERICAL_ERROR, OVERTURNS, PASS, Judged, with_rows
from boulder_sweep.judge.verdict import STEP_REASONS

FIRST_FACTOR, FACTOR = 0.5, 0.25
"""The step is shortened by the first factor `AGREEING` times, which confirms nearly all late rows, then by the second.
With the second alone late rows take twice as long, and no verdict of 90,000 shallow boulders changes."""
LAST_RESORT_STEPS = 2_000
"""Steps to the horizon of the last attempt, where nothing asks for shorter ones."""
MOST_STEPS = 20_000
"""It ends with at least so many steps to the horizon, with the soil in closed form; fewer with many soil elements."""

AGREEING = 2
"""Finer solutions that confirm a late row. Among 30,000 shallow boulders one was enough for all but two
(`benchmarks.late`): one step missed that a moment for an instant exceeds what holds the boulder, and one estimate was
so large that everything agreed with it."""
EVENT_TOLERANCE = 1e-5
"""Finer solutions locate events to this fraction of a step. Boulders that rock amplify what the time of the first kink
was off by, whatever the step: located as in other solutions, late ones need steps 10 times as short to agree."""
SAME_ANGLE, SAME_WAY = 1e-6, 1e-4
"""Solutions of a late row agree if what they reach differs by no more than the error estimated for the coarser, or by
less than this [rad], [m]: with the shortest steps the estimate falls below the rounding that late motion amplifies."""


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


def is_open(judged: Judged, control: Control) -> np.ndarray:
    """Return which rows finer steps, those of a control, may decide (bool, shape (n,)).

    Where errors are not confirmed, as by `fast`, rows nearer to a limit than their error stay undecided.
    """
    refused = [code for code, reason in enumerate(judged.reasons) if code >= len(REASONS) and reason in STEP_REASONS]
    unsure = [NUMERICAL_ERROR] if control.error_estimate and not control.last_resort else []
    return np.isin(judged.reason, [*unsure, *refused])


def is_late(judged: Judged, outcomes: OutcomeTable, control: Control) -> np.ndarray:
    """Return which rows need another solution to agree with them before they pass or overturn (bool, shape (n,)).

    None where errors are not confirmed, as by `fast`. None either in plastic soil, where every
    motion goes on until it rests, and loses its energy to the soil instead of rocking.
    """
    if not control.error_estimate or is_plastic(control.unloading):
        return np.zeros(len(judged), dtype=bool)
    return (outcomes.t_end > control.horizon) & ((judged.verdict == PASS) | (judged.reason == OVERTURNS))


def agree(coarse: OutcomeTable, fine: OutcomeTable, v_0: np.ndarray) -> np.ndarray:
    """Return which rows of two solutions end alike (bool, shape (n,)).

    Parameters
    ----------
    coarse, fine
        Solutions whose steps differ by a factor of two or more, each with its estimated errors.
    v_0
        Speeds of impact [m/s]: an error of the displacement is one of the time, too, see
        `boulder_kernels.error_estimates.estimate_errors`.
    """
    limit = coarse.status == Status.LIMIT
    alike = limit == (fine.status == Status.LIMIT)
    in_time = v_0 * np.abs(coarse.t_limit - fine.t_limit) <= np.maximum(coarse.x_error, SAME_WAY)
    in_angle = np.abs(coarse.theta_max - fine.theta_max) <= np.maximum(coarse.theta_error, SAME_ANGLE)
    return alike & np.isfinite(fine.x_error) & np.where(limit, in_time, in_angle)


class RowStates:
    """How far the rows of a block are decided, while some are simulated again by finer steps.

    Attributes
    ----------
    judged : Judged
        The rows as judged by the solution that counts so far.
    outcomes : OutcomeTable
        That solution, written in place.
    unconfirmed : ndarray
        Number of further solutions that must agree with it before a late row counts, shape (n,).
    """

    def __init__(self, designs: Designs, control: Control, judged: Judged, outcomes: OutcomeTable) -> None:
        n = designs.size
        self._v_0 = designs.table.v_0
        self.judged, self.outcomes = judged, outcomes
        self.unconfirmed = AGREEING * is_late(judged, outcomes, control)
        # Step of the last solution compared or taken over [s], and rows that the last resort has refused.
        self._compared_s, self._given_up = np.full(n, control.h), np.zeros(n, dtype=bool)

    def wanted(self, control: Control) -> np.ndarray:
        """Return the numbers of the rows that a solution by some control may decide or confirm."""
        # The last resort begins with longer steps than the usual ones end with.
        is_finer = control.h <= FIRST_FACTOR * self._compared_s
        may_decide = is_open(self.judged, control) & ~self._given_up
        return np.flatnonzero(may_decide | ((self.unconfirmed > 0) & is_finer))

    def update(self, rows: np.ndarray, control: Control, judged: Judged, outcomes: OutcomeTable) -> None:
        """Compare a finer solution of some rows with what counts so far: it confirms it, or takes its place.

        Parameters
        ----------
        rows
            Numbers of the rows.
        control, judged, outcomes
            How they were simulated, and what came out, in the order of `rows`. What cannot be computed changes nothing.
        """
        failed = judged.verdict == ERROR
        self._given_up[rows] = control.last_resort & failed
        confirmed = (self.unconfirmed[rows] > 0) & (judged.verdict == self.judged.verdict[rows])
        confirmed &= agree(some_rows(self.outcomes, rows), outcomes, self._v_0[rows])
        self.unconfirmed[rows[confirmed]] -= 1
        better = ~failed & ~confirmed
        self._compared_s[rows[better | confirmed]] = control.h
        replaced = rows[better]
        self.unconfirmed[replaced] = AGREEING * is_late(judged, outcomes, control)[better]
        self.judged = with_rows(self.judged, replaced, judged.rows(better))
        for values, new in zip(self.outcomes, outcomes, strict=True):
            values[replaced] = new[better]
