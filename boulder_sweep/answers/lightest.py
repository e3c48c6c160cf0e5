"""The lightest boulder that passes, found by a search over its dimensions and depth.

For given other sides the lightest boulder has the least height that passes; each height is tried at several depths. The
other sides are searched on a lattice that is refined around the best candidate of each row. A lattice passes over
boulders that pass in narrow stretches only, so random ones around its answer are tried at last, until none is lighter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.keys import Key, refuse_deep, sweep_ranges
from boulder_sweep.answers.questions import Answers, Brackets
from boulder_sweep.answers.search import (
    ALWAYS,
    BEYOND,
    FAILS,
    FOUND,
    HOLDS,
    NEVER,
    Predicate,
    Search,
    contradicted,
    last_before,
    search,
    searched_again,
)
from boulder_sweep.answers.trials import (
    MILLIMETRES,
    SHARE,
    USUALLY,
    InputRows,
    Judges,
    Open,
    Remembered,
    beyond_reach,
    block_at,
    depth_within,
    millimetres,
    rows_at,
)
from boulder_sweep.designs import SIDES
from boulder_sweep.errors import QuestionError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.settings import Sweep

SCALE = "scale"
"""Scale of all sides together, searched where the file gives a single boulder."""
HEIGHT, DEPTH, RATIO = "boulder_height_m", "embedment_depth_m", "embedment_ratio"
SCALES = (0.5, 2.0)
"""If the file gives a single boulder, it is scaled within these bounds at constant proportions."""
COARSE, FINE = 7, 5
"""Number of values of each other side and of the depth: on the first lattice, and on each finer one."""
ROUNDS = 8
"""Number of finer lattices, each half as wide as the one before."""
CELLS = 8
"""Pieces that the range of the height is cut into by the scan."""
NEAREST, FARTHEST = 1e-3, 0.1
"""Bounds of the reach of random neighbours, log-uniform: of each side [m], of scale and of depth (as a share)."""
UNLUCKY = 3
"""Draws in a row without a lighter boulder after which none is looked for any more."""
WORTH = 1e-4
"""Share of the mass by which a boulder must be lighter to be worth another draw."""

Sides = dict[str, np.ndarray]
"""Sides of boulders [m] by the names of their columns, `SHARE` of those whose depth is searched, `SCALE` of those that
are scaled."""


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
        The sweep is a list of designs, which has no bounds, or a boulder reaches below the readings of the soil that
        count.
    """

    rows_at_once = 16
    neighbours = 8192
    """Random boulders around the lightest so far that are drawn at a time."""

    def __init__(self, sweep: Sweep, key: Key, judges: Judges) -> None:
        if sweep.table is not None:
            raise QuestionError("the least mass needs bounds for the boulder's sides; a list of designs has none")
        if key.most:
            raise QuestionError("the largest boulder has the largest mass; use --least mass")
        self.sweep, self.key, self.judges = sweep, key, judges
        self.bounds = sweep_ranges(sweep)
        self.bounds |= {name: (value, value) for name, value in sweep.constants.items()}
        self.bounds |= {RATIO: USUALLY} if sweep.depth_sought else {}
        self.free = [side for side in SIDES if self.bounds[side][0] < self.bounds[side][1]]
        self.open = Open(sweep, (*SIDES, DEPTH))
        if not self.free and RATIO in self.bounds:  # with a free side no boulder is taller than one of the file
            tallest = self.bounds[HEIGHT][1] * SCALES[1]
            foot = min(self.bounds[RATIO][1] * tallest, tallest - self.bounds["bumper_height_m"][0])
            refuse_deep(sweep, foot, "boulder.height a range, which bounds the search")

    @property
    def count(self) -> int:
        """Number of combinations of the other inputs."""
        return self.open.count

    @property
    def searched(self) -> dict[str, tuple[float, float]]:
        """Bounds of what is searched: the free sides or the scale, and `SHARE` if the depth is free."""
        low, high = self.bounds[RATIO if RATIO in self.bounds else DEPTH]
        bounds = {side: self.bounds[side] for side in self.free} or {SCALE: SCALES}
        return bounds | {SHARE: (0.0, 1.0)} if low < high else bounds

    def given(self, start: int, stop: int) -> InputRows:
        """Return the other inputs of the rows ``[start, stop)``."""
        return self.open.rows(start, stop)

    def trial(self, rows: InputRows, side: str, final: Remembered) -> Boulders:
        """Return the object that tries boulders in some rows, by a side or the scale."""
        return Boulders(self, rows, side, final)

    def answered(self, start: int, stop: int) -> Answers:
        """Answer the rows ``[start, stop)``."""
        rows = self.given(start, stop)
        final = Remembered(self.judges)
        # If the lightest boulder is as long, wide or high as it may be, a search for this side has no way to vary the
        # others at that end; the search for another side has.
        trials = [self.trial(rows, side, final) for side in reversed(self.free or [SCALE])]
        best = _lightest(rows, [trial.certified(trial.lightest()) for trial in trials])
        sizes = trials[0].lighter(best.sizes, np.isfinite(best.passes))
        # A side that is as small as it may be has no bracket; the same boulder has one by another side.
        best = _lightest(rows, [best, *(trial.bracketed(sizes) for trial in trials)])
        block = replace(best.block, labels=self.open.labels(start, stop))
        judged = self.judges.final.graded(final(block), block)
        simulated = sum(trial.simulated for trial in trials) + final.count
        return Answers(block, best.kind, best.fails, best.passes, judged, [None] * (stop - start), simulated)


@dataclass(frozen=True, eq=False)
class _SizedBrackets(Brackets):
    """Brackets of the mass [kg], with what is searched of the boulders that pass or were tried last: `sizes`."""

    sizes: Sides


class Boulders:
    """Tries boulders for some rows and counts the simulations.

    Parameters
    ----------
    side
        The side that is searched for, given the others and the depth, or `SCALE`.
    final
        Judges designs with the accuracy of the sweep; counts its own simulations.
    """

    def __init__(self, asked: LightestQuestion, rows: InputRows, side: str, final: Remembered) -> None:
        self.asked, self.judges, self.rows, self.side = asked, asked.judges, rows, side
        self._final = final
        self.simulated = 0
        low, high = asked.searched[side]
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
                tried[name] = values if name == SHARE else millimetres(values)
            each = count ** len(bounds)
            index = np.repeat(np.arange(n), each)
            flat = {name: values.ravel() for name, values in tried.items()}
            result = self.least(index, flat)
            mass = np.where(result.has_holds, self.mass(index, result.holds, flat), np.inf).reshape(n, each)
            column = mass.argmin(axis=1)
            better = mass[np.arange(n), column] < best
            best = np.where(better, mass[np.arange(n), column], best)
            for name in bounds:
                chosen[name] = np.where(better, tried[name][np.arange(n), column], chosen[name])
        return chosen

    def least(self, index: np.ndarray, others: Sides) -> Search:
        """Search for the least of the side (or the scale) that passes, given the other sides and the depth."""
        return search(self.predicate(index, others, quick=True), *self.ends(len(index)), CELLS)

    def ends(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends of the side (or the scale) for some searches."""
        return np.full(count, self.first, dtype=np.int64), np.full(count, self.last, dtype=np.int64)

    def predicate(self, index: np.ndarray, others: Sides, *, quick: bool) -> Predicate:
        """Return the predicate of a search in rows, given the other sides and the depth of each."""
        return lambda rows, positions: self.codes(index[rows], positions, rows_at(others, rows), quick=quick)

    def codes(self, index: np.ndarray, positions: np.ndarray, others: Sides, *, quick: bool) -> np.ndarray:
        """Return the predicate of `search`."""
        block = self.block(index, positions, others)
        self.simulated += len(block) if quick else 0
        judged = self.judges.coarse(block) if quick else self._final(block)
        return np.where(beyond_reach(block, judged), BEYOND, np.where(self._final.holds(judged, block), HOLDS, FAILS))

    def block(self, index: np.ndarray, positions: np.ndarray, others: Sides) -> DesignBlock:
        """Return the designs with boulders of these sizes."""
        sides = self.sides(positions, others)
        share = others.get(SHARE, np.zeros(len(index)))
        return block_at(self.rows, index, **sides, **{DEPTH: self.depth(index, sides[HEIGHT], share)})

    def sides(self, positions: np.ndarray, others: Sides) -> Sides:
        """Return all sides [m] from the lattice position of the one searched for (or of the scale) and the others."""
        fixed = {side: np.full(len(positions), self.asked.bounds[side][0]) for side in SIDES}
        if self.side == SCALE:
            return {side: millimetres(values * positions / MILLIMETRES) for side, values in fixed.items()}
        return fixed | {side: others[side] for side in SIDES if side in others} | {self.side: positions / MILLIMETRES}

    def depth(self, index: np.ndarray, height: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return depths [m] from shares between the shallowest (0) and the deepest (1), shape (n,)."""
        bounds = self.asked.bounds
        low, high = (end * (height if RATIO in bounds else 1.0) for end in bounds[RATIO if RATIO in bounds else DEPTH])
        if np.array_equal(low, high):
            return millimetres(np.broadcast_to(low, height.shape))
        bumper = self.rows["bumper_height_m"][index]
        return depth_within(low, high, share, height, bumper, self.asked.sweep.criterion.min_overlap_m)

    def mass(self, index: np.ndarray, positions: np.ndarray, others: Sides) -> np.ndarray:
        """Mass of boulders [kg]."""
        sides = self.sides(positions, others)
        solid = np.prod([sides[side] for side in SIDES], axis=0) * self.rows["boulder_density_kg_m3"][index]
        return self.asked.sweep.model.shape.filled * solid

    def certified(self, others: Sides) -> _SizedBrackets:
        """Return what the search finds for other sides and depths, one for each row, with the sweep's accuracy."""
        index = np.arange(len(next(iter(self.rows.values()))))
        result, final = self.least(index, others), self.predicate(index, others, quick=False)
        result = searched_again(final, result, contradicted(final, result), *self.ends(len(index)), CELLS)
        return self.brackets(others, result.shown, result.has_holds, result.fails, result.has_fails)

    def bracketed(self, sizes: Sides) -> _SizedBrackets:
        """Return boulders with the last lighter ones that fail, by the side that is searched for."""
        positions = self.positions(sizes)
        index = np.arange(len(positions))
        predicate = self.predicate(index, sizes, quick=False)
        has_holds = predicate(index, positions) == HOLDS
        first = np.where(has_holds, self.first, positions)
        fails, holds, has_fails = last_before(predicate, positions, first)
        return self.brackets(sizes, holds, has_holds, fails, has_fails)

    def brackets(
        self, others: Sides, positions: np.ndarray, passes: np.ndarray, fails: np.ndarray, has_fails: np.ndarray
    ) -> _SizedBrackets:
        """Return the brackets of all rows, from positions of the side and whether boulders of this side pass."""
        index = np.arange(len(positions))
        sides = self.sides(positions, others)
        at_least = positions == self.first
        for side in self.asked.free:
            at_least &= sides[side] <= self.asked.bounds[side][0]
        return _SizedBrackets(
            self.block(index, positions, others),
            np.where(passes, np.where(at_least, ALWAYS, FOUND), NEVER).astype(np.int8),
            np.where(has_fails, self.mass(index, fails, others), np.nan),
            np.where(passes, self.mass(index, positions, others), np.nan),
            others | {self.side: positions / MILLIMETRES},
        )

    def lighter(self, sizes: Sides, passing: np.ndarray) -> Sides:
        """Return boulders that pass and are lighter than the ones given, tried at random around the lightest so far."""
        sizes = {name: values.copy() for name, values in sizes.items()}
        mass = self.mass(np.arange(len(passing)), self.positions(sizes), sizes)
        unlucky = np.where(passing, 0, UNLUCKY)
        draw = 0
        while (rows := np.flatnonzero(unlucky < UNLUCKY)).size:
            index, tried, masses = self.neighbours(rows, sizes, mass, draw)
            # With the sweep's accuracy: the quick evaluation misses some that pass in a narrow stretch.
            kept = self.codes(index, self.positions(tried), tried, quick=False) == HOLDS
            index, masses = index[kept], masses[kept]
            tried = rows_at(tried, kept)
            lucky, chosen = _least_of_each(index, masses)
            unlucky[rows] += 1
            unlucky[lucky[masses[chosen] < (1.0 - WORTH) * mass[lucky]]] = 0
            mass[lucky] = masses[chosen]
            for name, values in tried.items():
                sizes[name][lucky] = values[chosen]
            draw += 1
        return sizes

    def neighbours(
        self, rows: np.ndarray, sizes: Sides, mass: np.ndarray, draw: int
    ) -> tuple[np.ndarray, Sides, np.ndarray]:
        """Return rows, sizes and masses of random boulders that are lighter than the ones given."""
        count = self.asked.neighbours
        # The same for every row, so that an answer does not depend on the rows that are searched with it.
        rng = np.random.default_rng(draw)
        reach = NEAREST * (FARTHEST / NEAREST) ** rng.random(count)
        index = np.repeat(rows, count)
        tried = {}
        for name, ends in self.asked.searched.items():
            values = np.clip(sizes[name][rows][:, None] + reach * rng.uniform(-1.0, 1.0, count), *ends)
            if name == SHARE:
                # What passes by sliding may do so at any depth.
                values = np.where(rng.random(count) < 0.5, values, rng.random(count)).ravel()
                tried[name] = values
            else:
                tried[name] = millimetres(values).ravel()
        masses = self.mass(index, self.positions(tried), tried)
        kept = masses < mass[index]
        return index[kept], rows_at(tried, kept), masses[kept]

    def positions(self, sizes: Sides) -> np.ndarray:
        """Return the positions of the side that is searched for."""
        return np.rint(sizes[self.side] * MILLIMETRES).astype(np.int64)


def _lightest(rows: InputRows, answers: Sequence[_SizedBrackets]) -> _SizedBrackets:
    """Return the lightest of several answers for each row; rather one with a bracket."""
    masses = [np.where(np.isnan(one.passes), np.inf, one.passes) + 1e-6 * np.isnan(one.fails) for one in answers]
    best, index = np.argmin(masses, axis=0), np.arange(len(masses[0]))

    def picked(arrays: Iterable[np.ndarray]) -> np.ndarray:
        return np.stack(list(arrays))[best, index]

    columns = {name: picked(one.block.columns[name].to_numpy() for one in answers) for name in (*SIDES, DEPTH)}
    kind, fails, passes = (picked(getattr(one, name) for one in answers) for name in ("kind", "fails", "passes"))
    sizes = {name: picked(one.sizes[name] for one in answers) for name in answers[0].sizes}
    return _SizedBrackets(block_at(rows, index, **columns), kind, fails, passes, sizes)


def _least_of_each(index: np.ndarray, masses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows in `index`, and for each the entry of its least mass; the first of equal ones."""
    order = np.argsort(masses, kind="stable")
    rows, first = np.unique(index[order], return_index=True)
    return rows, order[first]
