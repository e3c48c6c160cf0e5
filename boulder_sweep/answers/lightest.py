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
    from collections.abc import Iterable, Sequence

    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.settings import Sweep

SHARE = "share"
"""Depth between the shallowest (0) and the deepest (1) that a boulder may have, searched like a side."""
SIDES = ("boulder_length_m", "boulder_width_m", "boulder_height_m")
HEIGHT, DEPTH, RATIO = "boulder_height_m", "embedment_depth_m", "embedment_ratio"
MILLIMETRES = 1000
"""Sides and depths are whole millimetres."""
SCALES = (0.5, 2.0)
"""If the file gives a single boulder, it is scaled within these bounds at constant proportions."""
COARSE, FINE = 7, 5
"""Number of values of each other side and of the depth: on the first lattice, and on each finer one."""
ROUNDS = 8
"""Number of finer lattices, each half as wide as the one before."""
CELLS = 8
"""Pieces that the range of the height is cut into by the scan."""

Sides = dict[str, np.ndarray]
"""Sides of boulders [m] by the names of their columns, and `SHARE` of those whose depth is searched."""


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

    @property
    def searched(self) -> dict[str, tuple[float, float]]:
        """Bounds of what is searched: the free sides, and `SHARE` if the depth is free."""
        low, high = self.bounds[RATIO if RATIO in self.bounds else DEPTH]
        bounds = {side: self.bounds[side] for side in self.free}
        return bounds | {SHARE: (0.0, 1.0)} if low < high else bounds

    def answered(self, start: int, stop: int) -> Answers:
        """Answer the rows ``[start, stop)``."""
        rows = self.open.rows(start, stop)
        n = stop - start
        # If the lightest boulder is as long, wide or high as it may be, a search for this side has no way to vary the
        # others at that end; the search for another side has.
        trials = [_Boulders(self, rows, side) for side in reversed(self.free)] or [_Boulders(self, rows, None)]
        others = [trial.lightest() for trial in trials]
        found = [trial.certified(own) for trial, own in zip(trials, others, strict=True)]
        best = _lightest(found)
        sizes = {name: _taken((own.block.columns[name].to_numpy() for own in found), best) for name in SIDES}
        if SHARE in others[0]:
            sizes[SHARE] = _taken((own[SHARE] for own in others), best)
        # A side that is as small as it may be has no bracket; the same boulder has one by another side.
        found += [trial.certified(sizes) for trial in trials]
        best = _lightest(found)
        kind, fails, passes = (
            _taken((getattr(own, name) for own in found), best) for name in ("kind", "fails", "passes")
        )
        columns = {
            name: _taken((own.block.columns[name].to_numpy() for own in found), best) for name in (*SIDES, DEPTH)
        }
        block = replace(taken(rows, np.arange(n), **columns), labels=self.open.labels(start, stop))
        simulated = sum(trial.simulated for trial in trials) + n
        return Answers(block, self.judges.own(block), kind, fails, passes, [None] * n, simulated)


class _Boulders:
    """Tries boulders for some rows and counts the simulations.

    Parameters
    ----------
    asked
        The question.
    rows
        The other inputs.
    side
        The side that is searched for, given the others and the depth; None if the boulder is scaled.
    """

    def __init__(self, asked: LightestQuestion, rows: Rows, side: str | None) -> None:
        self.asked, self.judges, self.rows, self.side = asked, asked.judges, rows, side
        self.simulated = 0
        low, high = asked.bounds[side] if side else SCALES
        self.first, self.last = round(low * MILLIMETRES), round(high * MILLIMETRES)

    def lightest(self) -> Sides:
        """Return the other sides and the depths of the lightest boulders of a lattice that is refined around them."""
        n = len(next(iter(self.rows.values())))
        bounds = {name: ends for name, ends in self.asked.searched.items() if name != self.side}
        best = np.full(n, np.inf)
        chosen = {name: np.full(n, np.mean(ends)) for name, ends in bounds.items()}
        for round_ in range(ROUNDS + 1 if bounds else 0):
            count = COARSE if round_ == 0 else FINE
            # From the ends of each downwards: of depths at which boulders are equally light, the deepest is taken.
            lattices = np.meshgrid(*(np.linspace(0.5, -0.5, count) for _ in bounds), indexing="ij")
            tried = {}
            for (name, ends), offsets in zip(bounds.items(), lattices, strict=True):
                values = chosen[name][:, None] + (ends[1] - ends[0]) / 2.0**round_ * offsets.ravel()
                values = np.clip(values, *ends)
                tried[name] = values if name == SHARE else _millimetres(values)
            each = count ** len(bounds)
            index = np.repeat(np.arange(n), each)
            flat = {name: values.ravel() for name, values in tried.items()}
            found = self.least(index, flat, quick=True)
            mass = np.where(found.has_holds, self.mass(index, found.holds, flat), np.inf).reshape(n, each)
            place = mass.argmin(axis=1)
            better = mass[np.arange(n), place] < best
            best = np.where(better, mass[np.arange(n), place], best)
            for name in bounds:
                chosen[name] = np.where(better, tried[name][np.arange(n), place], chosen[name])
        return chosen

    def least(self, index: np.ndarray, others: Sides, *, quick: bool) -> Search:
        """Search for the least of the side (or the scale) that passes, given the other sides and the depth."""

        def predicate(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
            return self.codes(index[rows], places, {name: values[rows] for name, values in others.items()}, quick=quick)

        first, last = (np.full(len(index), end, dtype=np.int64) for end in (self.first, self.last))
        return search(predicate, first, last, CELLS)

    def codes(self, index: np.ndarray, places: np.ndarray, others: Sides, *, quick: bool) -> np.ndarray:
        """Return the predicate of `search`."""
        block = self.block(index, places, others)
        self.simulated += len(block)
        judged = (self.judges.quick if quick else self.judges.own)(block)
        return np.where(beyond_reach(block, judged), BEYOND, np.where(self.judges.holds(judged), HOLDS, FAILS))

    def block(self, index: np.ndarray, places: np.ndarray, others: Sides) -> DesignBlock:
        """Return the designs with boulders of these sizes."""
        sides = self.sides(places, others)
        share = others.get(SHARE, np.zeros(len(index)))
        return taken(self.rows, index, **sides, **{DEPTH: self.depth(index, sides[HEIGHT], share)})

    def sides(self, places: np.ndarray, others: Sides) -> Sides:
        """Return all sides [m] from the lattice place of the one searched for (or of the scale) and the others."""
        fixed = {side: np.full(len(places), self.asked.bounds[side][0]) for side in SIDES}
        if self.side is None:
            return {side: _millimetres(values * places / MILLIMETRES) for side, values in fixed.items()}
        return fixed | {side: others[side] for side in SIDES if side in others} | {self.side: places / MILLIMETRES}

    def depth(self, index: np.ndarray, height: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return depths [m] from their places between the shallowest (0) and the deepest (1), shape (n,)."""
        bounds = self.asked.bounds
        low, high = (end * (height if RATIO in bounds else 1.0) for end in bounds[RATIO if RATIO in bounds else DEPTH])
        if np.array_equal(low, high):
            return _millimetres(np.broadcast_to(low, height.shape))
        deepest = np.clip(self._deepest(height, self.rows["bumper_height_m"][index]), low, high)
        return _millimetres(low + (deepest - low) * share)

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
        """Return the answers for some other sides and depths, one for each row, judged with the sweep's accuracy."""
        n = len(next(iter(self.rows.values())))
        index = np.arange(n)
        found = self.least(index, others, quick=True)
        agrees = np.ones(n, dtype=bool)
        for has, places, holds in ((found.has_fails, found.fails, False), (found.has_holds, found.holds, True)):
            agrees &= ~has | ((self.codes(index, places, others, quick=False) == HOLDS) == holds)
        if not agrees.all():
            wrong = np.flatnonzero(~agrees)
            part = self.least(wrong, {name: values[wrong] for name, values in others.items()}, quick=False)
            found = replaced(found, wrong, part)
        at_least = found.holds == self.first
        sides = self.sides(found.holds, others)
        for side in self.asked.free:
            at_least &= sides[side] <= self.asked.bounds[side][0]
        kind = np.where(found.has_holds, np.where(at_least, ALWAYS, FOUND), NEVER).astype(np.int8)
        shown = self.block(index, found.shown, others)
        self.simulated += n
        return Answers(
            shown,
            self.judges.own(shown),
            kind,
            np.where(found.has_fails, self.mass(index, found.fails, others), np.nan),
            np.where(found.has_holds, self.mass(index, found.holds, others), np.nan),
            [None] * n,
            self.simulated,
        )


def _lightest(found: Sequence[Answers]) -> np.ndarray:
    """Return the place of the lightest of several answers, one after the other, for each row; rather with a bracket."""
    n = len(found[0].passes)
    masses = [np.where(np.isnan(own.passes), np.inf, own.passes) + 1e-6 * np.isnan(own.fails) for own in found]
    return np.argmin(masses, axis=0) * n + np.arange(n)


def _taken(values: Iterable[np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return what stands at some places of arrays, one after the other."""
    return np.concatenate(list(values))[places]


def _millimetres(lengths: np.ndarray) -> np.ndarray:
    """Round lengths [m] to whole millimetres."""
    return np.rint(lengths * MILLIMETRES) / MILLIMETRES
