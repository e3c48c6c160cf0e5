"""The lightest boulder that passes, found by a search over its dimensions and depth.

For given other sides the lightest boulder has the least height that passes; each height is tried at several depths. The
other sides are searched on a lattice that is refined around the best candidate of each row.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.keys import Key, sweep_ranges
from boulder_sweep.answers.questions import Answers, replaced
from boulder_sweep.answers.search import ALWAYS, BEYOND, FAILS, FOUND, HOLDS, NEVER, Search, search
from boulder_sweep.answers.trials import Judges, Open, Rows, beyond_reach, taken
from boulder_sweep.errors import QuestionError

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

SIDES = ("boulder_length_m", "boulder_width_m", "boulder_height_m")
HEIGHT, DEPTH, RATIO = "boulder_height_m", "embedment_depth_m", "embedment_ratio"
MILLIMETRES = 1000
"""Sides and depths are whole millimetres."""
SCALES = (0.5, 2.0)
"""If the file gives a single boulder, it is scaled within these bounds at constant proportions."""
DEPTHS = 7
"""Number of depths tried for each boulder if the depth is free, up to the deepest that overlaps the truck enough."""
DEPTHS_AT_LAST = 25
"""Number of depths at which the height of the answer is searched, and from which its depth is chosen."""
COARSE, FINE = 9, 5
"""Number of values of each other side: on the first lattice, and on each finer one."""
ROUNDS = 8
"""Number of finer lattices, each half as wide as the one before."""
CELLS = 8
"""Pieces that the range of the height is cut into by the scan."""

Sides = dict[str, np.ndarray]
"""Sides of boulders [m] by the names of their columns."""


class LightestQuestion:
    """The least boulder mass that passes, within the bounds and proportions of a file.

    Parameters
    ----------
    sweep
        The sweep. Sides and embedment with several values may take any value between the smallest and the largest;
        those with one value are fixed. If all sides have one value, the boulder is scaled as a whole.
    key
        The mass.
    judges
        How designs are judged.

    Raises
    ------
    QuestionError
        The sweep is a list of designs, which has no bounds.
    """

    rows_at_once = 16

    def __init__(self, sweep: Sweep, key: Key, judges: Judges) -> None:
        if sweep.table is not None:
            raise QuestionError("the least mass needs bounds for the boulder's sides; a list of designs has none")
        if key.most:
            raise QuestionError("the largest mass is simply that of the largest boulder; use --least mass")
        self.sweep, self.key, self.judges = sweep, key, judges
        self.bounds = sweep_ranges(sweep)
        self.bounds |= {name: (value, value) for name, value in sweep.constants.items()}
        self.free = [side for side in SIDES if self.bounds[side][0] < self.bounds[side][1]]
        self.open = Open(sweep, (*SIDES, DEPTH))

    @property
    def count(self) -> int:
        """Number of combinations of the other inputs."""
        return self.open.count

    def answered(self, start: int, stop: int) -> Answers:
        """Answer the rows ``[start, stop)``."""
        rows = self.open.rows(start, stop)
        trial = _Boulders(self, rows)
        n = stop - start
        others = self.free[:-1]
        best = np.full(n, np.inf)
        chosen = {side: np.full(n, np.mean(self.bounds[side])) for side in others}
        width = {side: self.bounds[side][1] - self.bounds[side][0] for side in others}
        for round_ in range(ROUNDS + 1 if others else 1):
            count = COARSE if round_ == 0 else FINE
            lattices = np.meshgrid(*(np.linspace(-0.5, 0.5, count) for _ in others), indexing="ij")
            tried = {}
            for side, offsets in zip(others, lattices, strict=True):
                values = chosen[side][:, None] + width[side] / 2.0**round_ * offsets.ravel()
                tried[side] = _millimetres(np.clip(values, *self.bounds[side]))
            each = max(count ** len(others), 1)
            index = np.repeat(np.arange(n), each)
            flat = {side: values.ravel() for side, values in tried.items()}
            found = trial.least(index, flat, DEPTHS, quick=True)
            mass = np.where(found.has_holds, trial.mass(index, found.holds, flat), np.inf).reshape(n, each)
            place = mass.argmin(axis=1)
            better = mass[np.arange(n), place] < best
            best = np.where(better, mass[np.arange(n), place], best)
            for side in others:
                chosen[side] = np.where(better, tried[side][np.arange(n), place], chosen[side])
        answers = trial.certified(chosen)
        return replace(answers, block=replace(answers.block, labels=self.open.labels(start, stop)))


class _Boulders:
    """Tries boulders for some rows and counts the simulations."""

    def __init__(self, asked: LightestQuestion, rows: Rows) -> None:
        self.asked, self.judges, self.rows = asked, asked.judges, rows
        self.simulated = 0
        low, high = asked.bounds[asked.free[-1]] if asked.free else SCALES
        self.first, self.last = round(low * MILLIMETRES), round(high * MILLIMETRES)

    def least(self, index: np.ndarray, others: Sides, depths: int, *, quick: bool) -> Search:
        """Search for the least height (or the last free side, or the scale), given the other sides."""

        def predicate(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
            tried = {side: values[rows] for side, values in others.items()}
            return self.codes(index[rows], places, tried, depths, quick=quick)

        first, last = (np.full(len(index), end, dtype=np.int64) for end in (self.first, self.last))
        return search(predicate, first, last, CELLS)

    def codes(self, index: np.ndarray, places: np.ndarray, others: Sides, depths: int, *, quick: bool) -> np.ndarray:
        """Return the predicate of `search`: a boulder passes if it does so at any of the depths."""
        block, judged, count = self.judged(index, places, others, depths, quick=quick)
        shape = (len(index), count)
        holds = self.judges.holds(judged).reshape(shape).any(axis=1)
        beyond = beyond_reach(block, judged).reshape(shape).all(axis=1)
        return np.where(beyond, BEYOND, np.where(holds, HOLDS, FAILS))

    def judged(
        self, index: np.ndarray, places: np.ndarray, others: Sides, depths: int, *, quick: bool
    ) -> tuple[DesignBlock, Judged, int]:
        """Judge boulders at several depths each; return designs, verdicts and the number of depths."""
        sides = self.sides(places, others)
        depth = self.depths(index, sides[HEIGHT], depths)
        count = depth.shape[1]
        columns = {side: np.repeat(values, count) for side, values in sides.items()}
        block = taken(self.rows, np.repeat(index, count), **columns, **{DEPTH: depth.ravel()})
        self.simulated += len(block)
        return block, (self.judges.quick if quick else self.judges.own)(block), count

    def sides(self, places: np.ndarray, others: Sides) -> Sides:
        """Return all sides [m] from the lattice place of the one searched for (or of the scale) and the others."""
        bounds, free = self.asked.bounds, self.asked.free
        fixed = {side: np.full(len(places), bounds[side][0]) for side in SIDES}
        if not free:
            return {side: _millimetres(values * places / MILLIMETRES) for side, values in fixed.items()}
        return fixed | others | {free[-1]: places / MILLIMETRES}

    def depths(self, index: np.ndarray, height: np.ndarray, count: int) -> np.ndarray:
        """Return the depths [m] to be tried, shape (n, count), or (n, 1) where the depth is given."""
        bounds = self.asked.bounds
        low, high = (end * (height if RATIO in bounds else 1.0) for end in bounds[RATIO if RATIO in bounds else DEPTH])
        low, high = np.broadcast_to(low, height.shape), np.broadcast_to(high, height.shape)
        if np.array_equal(low, high):
            return _millimetres(low)[:, None]
        deepest = np.clip(self._deepest(height, self.rows["bumper_height_m"][index]), low, high)
        return _millimetres(low[:, None] + (deepest - low)[:, None] * np.linspace(0.0, 1.0, count))

    def _deepest(self, height: np.ndarray, bumper: np.ndarray) -> np.ndarray:
        """Return the greatest depth [m], in whole millimetres, at which the boulder's top overlaps the truck enough."""
        overlap = self.asked.sweep.criterion.min_overlap_m
        places = np.floor((height - bumper - overlap) * MILLIMETRES + 1e-6)
        # By the very sums of the verdict, which may fall short by a bit where they are equal in decimals.
        left = height - places / MILLIMETRES - bumper
        return (places - ((left < overlap) | (left <= 0.0))) / MILLIMETRES

    def mass(self, index: np.ndarray, places: np.ndarray, others: Sides) -> np.ndarray:
        """Mass of boulders [kg]."""
        sides = self.sides(places, others)
        return np.prod([sides[side] for side in SIDES], axis=0) * self.rows["boulder_density_kg_m3"][index]

    def certified(self, others: Sides) -> Answers:
        """Return the answers for the best sides of every row, judged with the accuracy of the sweep."""
        n = len(next(iter(self.rows.values())))
        index = np.arange(n)
        found = self.least(index, others, DEPTHS_AT_LAST, quick=True)
        agrees = np.ones(n, dtype=bool)
        for has, places, holds in ((found.has_fails, found.fails, False), (found.has_holds, found.holds, True)):
            agrees &= ~has | ((self.codes(index, places, others, DEPTHS_AT_LAST, quick=False) == HOLDS) == holds)
        if not agrees.all():
            wrong = np.flatnonzero(~agrees)
            part = self.least(
                wrong, {side: values[wrong] for side, values in others.items()}, DEPTHS_AT_LAST, quick=False
            )
            found = replaced(found, wrong, part)
        block, judged, count = self.judged(index, found.shown, others, DEPTHS_AT_LAST, quick=False)
        rank = np.where(self.judges.holds(judged), judged["margin"], -1.0).reshape(n, count)
        # Show the depth with the largest margin; if none passes, the last one.
        chosen = np.where(rank.max(axis=1) < 0.0, count - 1, rank.argmax(axis=1)) + index * count
        columns = {side: block.columns[side].to_numpy()[chosen] for side in (*SIDES, DEPTH)}
        shown = taken(self.rows, index, **columns)
        at_least = found.holds == self.first
        for side, values in others.items():
            at_least &= values <= self.asked.bounds[side][0]
        kind = np.where(found.has_holds, np.where(at_least, ALWAYS, FOUND), NEVER).astype(np.int8)
        return Answers(
            shown,
            self.judges.own(shown),
            kind,
            np.where(found.has_fails, self.mass(index, found.fails, others), np.nan),
            np.where(found.has_holds, self.mass(index, found.holds, others), np.nan),
            [None] * n,
            self.simulated + n,
        )


def _millimetres(lengths: np.ndarray) -> np.ndarray:
    """Round lengths [m] to whole millimetres."""
    return np.rint(lengths * MILLIMETRES) / MILLIMETRES
