"""A question about one sweep: try values, certify brackets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.keys import Ends, Key, range_of, refuse_narrow
from boulder_sweep.answers.search import (
    BEYOND,
    BLOCKED,
    CELLS,
    FAILS,
    FAR,
    FAULTY,
    HOLDS,
    NEVER,
    NOT_MONOTONE,
    UNKNOWN,
    Search,
    search,
    searched_again,
    settled,
    shorter,
    steady,
)
from boulder_sweep.answers.trials import (
    DEPTH,
    NO_FACE,
    SHARE,
    UNASKED_M,
    USUALLY,
    InputRows,
    Judges,
    Open,
    Remembered,
    beyond_reach,
    block_at,
    depth_within,
    ranges,
    rows_at,
    too_low,
    uncertain_rows,
)
from boulder_sweep.designs import block_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.judged import ERROR, UNDECIDED, with_rows
from boulder_sweep.settings.fields import EMBEDMENT
from boulder_sweep.settings.soil_readings import covered_depth

CHECKED_AT_ONCE = 65_536
"""Rows whose ranges are checked together, before any row is searched."""
FAST_OVERTURN_S = 0.3
"""No passing value is searched between two at which the design reaches the limit before this time. Where one exists,
one of its neighbours reaches the limit after 0.5 s or later (see tests/answers/test_scan.py)."""
SHALLOW, SLIDES_M = 0.45, 0.1
"""Embedment over height below which a boulder that passes by sliding so far [m] may overturn for values between two
that pass, in stretches of 1 % of the value and less."""
FINE_CELLS = 400
"""Pieces into which the range of such a boulder is cut."""
COARSE_DEPTHS, FINE_DEPTHS, DEPTH_ROUNDS = 7, 5, 5
"""Number of depths, where it is to be found: on the first lattice, on each finer one, and of finer ones, each half as
wide as the one before: in the end they are 1/128 of the range apart, some 10 mm."""

SCANNED_M, LOCATED_M = 2e-3, 2e-4
"""Errors of a step of second opinions [m] that scan a range and that locate a change: near the answer they turn designs
by up to 0.3 and 0.05 deg more or less than a fine solution. From there on, second opinions of full accuracy decide."""

if TYPE_CHECKING:
    from boulder_sweep.answers.chance import Chances
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep


@dataclass(frozen=True, eq=False)
class Answers:
    """Answers of n rows: where they change from failing to passing.

    Attributes
    ----------
    block : DesignBlock
        The designs at the answer, or at the last value tried where there is none.
    kind : ndarray of int8, shape (n,)
        Kind of answer, codes of `boulder_sweep.answers.search.WORDS`.
    fails, passes : ndarray, shape (n,)
        The bracket in the unit of the table; NaN where there is no such value.
    judged : Judged
        Outcomes and verdicts of the designs.
    stretches : list of str or None, of length n
        All passing intervals, for rows that are not monotone.
    simulated : int
        Designs simulated on the way.
    chances : Chances or None
        Probabilities at the answers, if one was asked for.
    """

    block: DesignBlock
    kind: np.ndarray
    fails: np.ndarray
    passes: np.ndarray
    judged: Judged
    stretches: list[str | None]
    simulated: int
    chances: Chances | None = None

    @property
    def found(self) -> np.ndarray:
        """Kinds of answers, `FAULTY` where designs cannot be computed although they have a face, int8, shape (n,)."""
        no_face = [code for code, word in enumerate(self.judged.reasons) if word in NO_FACE]
        faulty = np.isnan(self.passes) & (self.judged.verdict == ERROR) & ~np.isin(self.judged.reason, no_face)
        return np.where(faulty, FAULTY, self.kind).astype(np.int8)


class ValueSearch:
    """Searches designs for the smallest, or the largest, value of one input that passes."""

    cells = CELLS
    """Number of cells into which the scan divides a range."""

    def __init__(self, sweep: Sweep, key: Key, judges: Judges) -> None:
        self.sweep, self.key, self.judges = sweep, key, judges

    def trial(self, rows: InputRows, *, roughly: bool = False) -> Trial:
        """Return the object that tries values in some rows; `roughly` where it is to compare depths alone."""
        return Trial(self.key, self.judges, rows, self.sweep.criterion.min_overlap_m)

    def lattice(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and the last position that are searched between the ends of ranges."""
        first, last = self.key.ends(low, high)
        return (last, first) if self.key.most else (first, last)

    def answers_of(self, rows: InputRows, low: np.ndarray, high: np.ndarray) -> Answers:
        """Return the answers of n designs, between the ends of a range for each, shape (n,); they are not graded."""
        every = np.arange(len(low))
        first, last = self.lattice(low, high)
        trial = self.trial(rows)
        result = trial.settled(search(trial.rough, first, last, self.cells, trial.closer, trial.plain), first, last)
        result = self._again(result, every[trial.slides], trial, first, last, quick=True)
        wrong = trial.contradicted(result)
        block, judged = trial.judged(every, result.shown)
        if len(wrong):
            result = self._again(result, wrong, trial, first, last, quick=False)
            judged = with_rows(judged, wrong, trial.judged(wrong, result.shown[wrong])[1])
            block = trial.block(every, result.shown)
        chances = trial.chances(result.shown)
        return Answers(
            block,
            self._kinds(trial, result, judged, chances, high if not self.key.most else low),
            np.where(result.has_fails, self.key.values(result.fails), np.nan),
            np.where(result.has_holds, self.key.values(result.holds), np.nan),
            judged,
            [_stretches(self.key, result.changes.get(row), first[row], last[row]) for row in every.tolist()],
            trial.simulated,
            chances,
        )

    def undecided(self, judged: Judged, chances: Chances | None) -> np.ndarray:
        """Return where designs that are no answers would be if what is undecided passed, bool, shape (n,)."""
        return judged.verdict == UNDECIDED

    def _again(
        self, result: Search, rows: np.ndarray, trial: Trial, first: np.ndarray, last: np.ndarray, *, quick: bool
    ) -> Search:
        """Search some rows again, those whose boulders slide by smaller steps, too, each value before its own truck.

        Slower trucks are tried at the wide steps of the range, and of what is left of it: they take long.
        """
        whole = trial.coarse if quick else trial.final
        if not quick:
            result = searched_again(whole, result, rows, first, last, self.cells)
        if not self.key.is_steady:
            return result
        some = rows[trial.slides[rows]]

        def alone(index: np.ndarray, positions: np.ndarray) -> np.ndarray:
            return trial.alone(index, positions, quick=quick)

        result = shorter(steady(result), steady(searched_again(alone, result, some, first, last, FINE_CELLS)), last)
        some = some[result.has_holds[some]]
        return shorter(result, steady(searched_again(whole, result, some, result.holds, last, self.cells)), last)

    def _kinds(
        self, trial: Trial, result: Search, judged: Judged, chances: Chances | None, end: np.ndarray
    ) -> np.ndarray:
        """Return the kinds of the answers of some rows, codes of `WORDS`, shape (n,).

        Where nothing passes, the design at the end of the range tells by its sizes whether the truck goes over it: not
        the last position of the lattice, which may lie before it, nor its verdict, which may name another failure.
        """
        kind = result.kind.copy()
        none = np.flatnonzero(~result.has_holds & (kind != NOT_MONOTONE))
        if len(none):
            last = trial.with_values(none, end[none])
            kind[none] = np.where(too_low(last, self.sweep.criterion.min_overlap_m), BLOCKED, NEVER)
            kind[none[self.undecided(judged, chances)[none]]] = UNKNOWN
        return kind


class Question(ValueSearch):
    """The smallest, or the largest, value of one input that passes, between ends that the user may give.

    Raises
    ------
    QuestionError
        The search range is empty, too narrow or not admitted, or it reaches below the readings of the soil that count.
    """

    rows_at_once = 8192
    """Rows of a block; small enough that an interruption takes effect soon."""
    tried: Callable[[int], None] | None = None
    """Called with how many values have been tried, by the threads that try them; for questions with slow rows."""

    def __init__(self, sweep: Sweep, key: Key, between: Ends, judges: Judges) -> None:
        super().__init__(sweep, key, judges)
        self.between = between
        self.seeks_depth = sweep.depth_sought and key.name not in EMBEDMENT
        self.open = Open(sweep, (key.name, DEPTH) if self.seeks_depth else (key.name,))
        pieces = (self.open.rows(start, stop) for start, stop in ranges(self.count, CHECKED_AT_ONCE))
        refuse_narrow(sweep, key, pieces, between)  # also refuses a wrong range, before anything is computed
        if covered_depth(sweep.derived) < math.inf:
            self._refuse_deep()

    def _refuse_deep(self) -> None:
        """Refuse a range in which a foot is deeper than the readings of the soil that count, by a `QuestionError`."""
        covered, low, high, foot = covered_depth(self.sweep.derived), math.inf, 0.0, 0.0
        for start, stop in ranges(self.count, CHECKED_AT_ONCE):
            rows = self.open.rows(start, stop)
            first, last = range_of(self.sweep, self.key, rows, self.between)
            rows |= {SHARE: np.ones(stop - start)} if self.seeks_depth else {}
            trial = Trial(self.key, self.judges, rows, self.sweep.criterion.min_overlap_m)
            columns = trial.with_values(np.arange(stop - start), last).columns
            low, high = min(low, float(first.min())), max(high, float(last.max()))
            foot = max(foot, float(columns["embedment_depth_m"].to_numpy().max()))
        if foot < covered:
            return
        field = self.key.field
        unit = "" if field.unit == "1" else f" {field.unit}"
        of = "embedment" if field.name in EMBEDMENT else field.key
        remedy = f"they count where the file gives {field.path}: [{low:.6g}, {high:.6g}]{unit}, in place of its {of}"
        if self.sweep.table is not None:
            remedy = "search less deep (--between); or they count where the table has a design with such a foot"
        raise QuestionError(
            f"the search goes down to a foot at {foot:.4g} m, and the readings of the soil below {covered:.4g} m were "
            f"left out, since no foot in the file is so deep; {remedy}"
        )

    @property
    def count(self) -> int:
        """Number of combinations of the other inputs."""
        return self.open.count

    def values_to_try(self) -> int:
        """Return how many values are tried in all, for questions that report each; else 0."""
        return 0

    def answered(self, start: int, stop: int) -> Answers:
        """Answer the rows ``[start, stop)``."""
        rows = uncertain_rows(self.open.sweep, self.open.rows(start, stop), start, stop)
        ends, tried = range_of(self.sweep, self.key, rows, self.between), 0
        if self.seeks_depth:
            shares, tried = self._best_depths(rows, *ends)
            rows |= {SHARE: shares}
        answers = self.answers_of(rows, *ends)
        return replace(
            answers,
            simulated=answers.simulated + tried,
            judged=self.graded(answers.judged, answers.block, ~np.isnan(answers.passes)),
            block=replace(answers.block, labels=self.open.labels(start, stop)),
        )

    def graded(self, judged: Judged, block: DesignBlock, found: np.ndarray) -> Judged:
        """Return the outcomes at the answers with their grades; what is found, (n,), may be known to be robust."""
        return self.judges.final.graded(judged, block, stand=found & self.judges.robust)

    def _best_depths(self, rows: InputRows, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the depths, as `SHARE`, at which the answers of n designs are the best, and how many were simulated.

        Depths lie on a lattice that is refined around the best of each row; of equally good ones the deepest is taken,
        and where nothing passes the deepest of all.
        """
        n, simulated = len(low), 0
        first, last = self.lattice(low, high)
        best, chosen = np.full(n, -np.inf), np.full(n, 0.5)
        for round_ in range(DEPTH_ROUNDS + 1):
            count = FINE_DEPTHS if round_ else COARSE_DEPTHS
            shares = np.clip(chosen[:, None] + np.linspace(0.5, -0.5, count) / 2.0**round_, 0.0, 1.0)
            index = np.repeat(np.arange(n), count)
            trial = self.trial(rows_at(rows, index) | {SHARE: shares.ravel()}, roughly=True)
            result = search(trial.coarse, first[index], last[index], self.cells)
            result = steady(result) if self.key.is_steady else result
            simulated += trial.simulated
            value = np.where(result.has_holds, result.holds if self.key.most else -result.holds, -np.inf)
            column = value.reshape(n, count).argmax(axis=1)
            found = value.reshape(n, count)[np.arange(n), column]
            chosen = np.where(found > best, shares[np.arange(n), column], chosen)
            best = np.maximum(best, found)
        return np.where(np.isfinite(best), chosen, 1.0), simulated


class Trial:
    """Tries values of the input in some rows and counts the simulations.

    Parameters
    ----------
    rows
        The other inputs; with `SHARE` in place of the depth, which then follows from the height.
    least_overlap_m
        By how much a boulder must overlap the bumper [m].
    """

    def __init__(self, key: Key, judges: Judges, rows: InputRows, least_overlap_m: float) -> None:
        self.key, self.judges, self.rows, self.least_overlap_m = key, judges, rows, least_overlap_m
        self.simulated = 0
        self.slides = np.zeros(len(next(iter(rows.values()))), dtype=bool)
        """Rows of which some value that passes makes a shallow boulder slide, shape (n,)."""
        self._final = Remembered(judges)
        self._alone = [replace(each, against_slower=False) for each in (judges.final, judges.coarse)]

    def rough(self, index: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Predicate of the search like `coarse`, but by rough second opinions, if any are asked."""
        return self._codes(index, positions, quick=True, tolerance_m=SCANNED_M)

    def closer(self, index: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Predicate of the search between `rough` and `coarse`."""
        return self._codes(index, positions, quick=True, tolerance_m=LOCATED_M)

    def plain(self, index: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Predicate of the search like `coarse`, but without second opinions."""
        return self._codes(index, positions, quick=True, tolerance_m=UNASKED_M)

    def coarse(self, index: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Predicate of the search, without an error estimate."""
        return self._codes(index, positions, quick=True)

    def final(self, index: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Predicate of the search, with the accuracy of the sweep."""
        return self._codes(index, positions, quick=False)

    def alone(self, index: np.ndarray, positions: np.ndarray, *, quick: bool) -> np.ndarray:
        """Predicate of the search, each design before its own truck alone."""
        block = self.block(index, positions)
        self.simulated += len(index)
        return self.codes(block, self._alone[quick](block))

    def judged(self, index: np.ndarray, positions: np.ndarray, *, quick: bool = False) -> tuple[DesignBlock, Judged]:
        """Return the designs with these values, and their verdicts."""
        block, remembered = self.block(index, positions), self._final.count
        judged = self.judges.coarse(block) if quick else self._final(block)
        self.simulated += len(index) if quick else self._final.count - remembered
        return block, judged

    def block(self, index: np.ndarray, positions: np.ndarray) -> DesignBlock:
        """Return the designs with the values at some positions."""
        return self.with_values(index, self.key.values(positions))

    def with_values(self, index: np.ndarray, values: np.ndarray) -> DesignBlock:
        """Return the designs with these values."""
        inputs = {self.key.name: values}
        if SHARE not in self.rows:
            return block_at(self.rows, index, **inputs)
        rows = rows_at(self.rows, index) | inputs
        height, bumper, share = rows["boulder_height_m"], rows["bumper_height_m"], rows.pop(SHARE)
        low, high = (end * height for end in USUALLY)
        depth = depth_within(low, high, share, height, bumper, self.least_overlap_m)
        return block_of(rows | {DEPTH: depth})

    def settled(self, result: Search, first: np.ndarray, last: np.ndarray) -> Search:
        """Return the results of a rough search by `coarse`."""
        return settled(self.coarse, result, first, last) if self.judges.robust else result

    def contradicted(self, result: Search) -> np.ndarray:
        """Return the rows of a quick search that the accuracy of the sweep does not confirm, shape (m,)."""
        bracketed = np.flatnonzero(result.has_holds & result.has_fails)
        # Both ends together: what needs finer steps fills the lanes better.
        index = np.concatenate([np.arange(len(result.shown)), bracketed])
        holds = self.final(index, np.concatenate([result.shown, result.fails[bracketed]])) == HOLDS
        wrong = holds[: len(result.shown)] != result.has_holds
        wrong[bracketed] |= holds[len(result.shown) :]
        # Rows that are not monotone have several brackets, all of which must be certified.
        return np.flatnonzero(wrong | (result.kind == NOT_MONOTONE))

    def chances(self, positions: np.ndarray) -> Chances | None:
        """Return the probabilities at some values, one for each row; None if none is asked for."""
        return None

    def _codes(
        self, index: np.ndarray, positions: np.ndarray, *, quick: bool, tolerance_m: float | None = None
    ) -> np.ndarray:
        block, judged = self.judged(index, positions, quick=quick)
        codes = self.codes(block, judged, tolerance_m)
        if self.key.is_steady:
            depth, height = (block.columns[name].to_numpy() for name in ("embedment_depth_m", "boulder_height_m"))
            sliding = (depth < SHALLOW * height) & (judged["max_displacement_m"] > SLIDES_M)
            self.slides[index[sliding & (codes == HOLDS)]] = True
        return codes

    def codes(self, block: DesignBlock, judged: Judged, tolerance_m: float | None = None) -> np.ndarray:
        """Return what a search asks of judged designs."""
        codes = np.where(self._final.holds(judged, block, tolerance_m), HOLDS, FAILS)
        codes[judged["time_to_limit_s"] < FAST_OVERTURN_S] = FAR
        return np.where(beyond_reach(block, judged), BEYOND, codes)


def _stretches(key: Key, changes: list[tuple[int, int, bool]] | None, first: int, last: int) -> str | None:
    """Return the passing intervals of a row that is not monotone, ``1.21 to 1.45, 1.9 to 2.3``; None for other rows."""
    if changes is None:
        return None
    # An interval without a lower change begins at the start of the range; one without an upper change ends at its end.
    starts = [] if changes and changes[0][2] else [first]
    stops: list[int] = []
    for before, behind, holds in changes:
        (starts if holds else stops).append(behind if holds else before)
    if len(stops) < len(starts):
        stops.append(last)
    pairs = (sorted(pair) for pair in zip(starts, stops, strict=True))
    return ", ".join(" to ".join(f"{value:.10g}" for value in key.values(np.array(pair))) for pair in pairs)
