"""What a result says: the design that it recommends, and in sentences how many others pass and why the rest do not.

A run is answered by the rules of `sweep need`: of its designs that hold under all conditions with a margin, the robust
ones come first, then the lightest. Of a file of answers, the table of the terminal. Parts of sentences are words and
numbers with units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from boulder_sweep.answers.advice import listed
from boulder_sweep.answers.keys import key_of
from boulder_sweep.answers.need import MARGIN, Need
from boulder_sweep.answers.outputs import CAPACITY, NEED, UNCERTAINTY, AnswerFile, asked_sweep
from boulder_sweep.answers.printing import (
    MOST_LINES,
    Screen,
    need_screen,
    reserve_screen,
    uncertainty_screen,
    volume_lines,
)
from boulder_sweep.answers.recommendation import PREFERENCES, RANKS, Design, Nearest, Recommendation
from boulder_sweep.columns import BOULDER_MASS, GRADES
from boulder_sweep.judge.quantities import EXCAVATED, NEEDED, quantities_by
from boulder_sweep.judge.robustness import IN_WORDS, MEANINGS, SENSITIVE_IN_WORDS
from boulder_sweep.report.rows import CONDITIONS, DEPTH, NOT_YET, ResultRows, condition_of, inputs_of, label_of
from boulder_sweep.settings.units import SYSTEMS
from boulder_sweep.text import counted
from boulder_sweep.views.wording import REASON_WORDS

SAFE = 0.95
"""Probability of passing from which on a design is called safe here."""
MOST_ASKED = 20
"""Most designs of which second opinions are asked for a recommendation."""
RECOMMENDED, NEAREST = "Recommended design", "Nearest design, which does not qualify"
SCREENS: dict[str, Callable[..., Screen]] = {
    NEED: need_screen,
    CAPACITY: reserve_screen,
    UNCERTAINTY: uncertainty_screen,
}
"""How the answers of a command are shown as a table."""


class Measure(NamedTuple):
    """A number in a sentence, in a unit of the table; the page shows it in the reader's."""

    value: float
    unit: str
    before: str = ""
    """Of a number that is a bound: ``at most ``."""
    up: int = 0
    """Of a depth, which has three decimals: 1 if it is rounded up, -1 if down."""


Sentence = tuple[str | Measure, ...]


@dataclass(frozen=True)
class NamedDesign:
    """A design worth naming."""

    title: str
    number: int
    """Row of the design in the result."""


def verb(count: int, many: str, one: str) -> str:
    """The form of a verb that goes with a number."""
    return one if count == 1 else many


def share(n: int, total: int) -> str:
    """Share of a total in per cent; never rounded to 0 % or 100 % unless exact."""
    return f"{n / total if n in (0, total) else min(max(n / total, 0.001), 0.999):.1%}"


def need_sentences(rows: ResultRows, need: Need) -> tuple[list[Sentence], NamedDesign]:
    """Return the worst answer, or that there is none, where nothing is recommended; and its row."""
    answers = need.arrow[need.key.answer].to_numpy()
    n, last = int((~np.isnan(answers)).sum()), NamedDesign("The last value tried", 0)
    if need.recommendation is not None:
        return [], last
    if not n:
        return [("Nothing that was tried passes.",)], last
    number = int(np.nanargmin(answers if need.key.most else -answers))
    where, row = f" in the worst of {n:,} combinations" if n > 1 else "", rows.row(number)
    held = f"P(pass) = {row['p_pass']:.1%}" if "p_pass" in row else f"margin {row['margin']:.1%}"
    lead = f"The {'largest' if need.key.most else 'least'} {label_of(need.key.name)} that passes{where}: "
    worst = (lead, Measure(float(answers[number]), need.key.field.unit), f" (design {number:,}, {held}).")
    return [worst], NamedDesign("The answer that is worst", number)


def screens(rows: ResultRows, answer: Answer) -> dict[str, Screen]:
    """Return the answers as tables by system of units; none of a run, or of one that is the design recommended."""
    file, found = rows.finished, answer.need.recommendation
    best = found.design.rows if found and found.design else []
    if not isinstance(file, AnswerFile) or (rows.need and best and len(rows.codes) == 1):
        return {}
    answers = file.answers()
    more: list[Any] = [MOST_LINES] if file.kind == NEED else []
    more += [[row["design_id"] for row in best]] if file.kind == CAPACITY else []
    made = {system: SCREENS[file.kind](answers, system, *more) for system in SYSTEMS}
    heads = "  ".join(head[0] for head, _ in made[SYSTEMS[0]].columns)
    return {system: one._replace(signs=[*one.signs, *volume_lines(heads)]) for system, one in made.items()}


@dataclass(frozen=True, eq=False)
class Answer:
    """What the page says of a result."""

    need: Need
    """The question with its recommendation; of a run, as if it had been asked which of its designs to build."""
    row: dict[str, Any]
    """The design that is recommended under the conditions that are worst for it; the nearest one where none is."""
    sentences: tuple[Sentence, ...]
    """What else there is to say, the most important first."""
    named: NamedDesign
    """What the row is."""


def answer_of(rows: ResultRows) -> Answer:
    """Describe a result in sentences, with the design worth naming."""
    passing = rows.having("pass")
    n = int(passing.sum())
    need = rows.need or _as_need(rows, passing)
    found = need.recommendation
    near = None if found is None or found.nearest is None else found.nearest.design or found.nearest.rows
    shown = near if found is None or found.design is None else found.design
    if rows.need is None:
        sentences, named = _counts(rows, n), NamedDesign("Design 0", 0)
    else:
        sentences, named = need_sentences(rows, need)
        if len(rows.codes) > 1 and rows.grades.get("open", 0) < n and need.probability is None:
            sentences.append(_grades(rows, n))
    if shown is None:
        return Answer(need, rows.row(named.number), tuple(sentences), named)
    row = worst_of(shown.rows if isinstance(shown, Design) else shown)
    title = NEAREST if shown is near else RECOMMENDED
    return Answer(need, row, tuple(sentences), NamedDesign(title, _number_of(rows, need, row)))


def worst_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the row with the least probability or margin; one that does not pass before all others."""
    name = "p_pass" if "p_pass" in rows[0] else "margin"
    return min(rows, key=lambda row: -2.0 if row[name] is None else row[name])


def _number_of(rows: ResultRows, need: Need, row: dict[str, Any]) -> int:
    """Return the number of a row; of an answer, that under its conditions, whatever its own depth is."""
    if rows.need is None:
        return int(row["design_id"])
    own = [name for name in inputs_of(row) if name not in (*need.derived, need.key.name)]
    answers = need.arrow.select(own).to_pylist()
    return next((k for k, other in enumerate(answers) if all(other[name] == row[name] for name in own)), 0)


def _as_need(rows: ResultRows, passing: np.ndarray) -> Need:
    """Return the result of a run as the answer to which of its designs to build."""
    chances, columns = rows.chances(), {k: v for k, v in rows.inputs.items() if v.shape == rows.codes.shape}
    sweep = asked_sweep(rows.finished.identity, pa.table(columns))
    asked = Need(sweep, pa.table({}), key_of("embedment_depth"), MARGIN, 0)
    if chances is not None:
        asked = replace(asked, least_margin=0.0, probability=SAFE)
    return replace(asked, recommendation=_Designs(rows, passing, asked).recommended())


class _Designs:
    """Boulders at their depths in a run, each with a row for every soil, vehicle and speed.

    `passing` says whether a row passes, in the shape of the grid; `asked`, what is asked of a design.
    """

    def __init__(self, rows: ResultRows, passing: np.ndarray, asked: Need) -> None:
        self.rows, self.passing, self.computed = rows, passing, ~rows.having(NOT_YET)
        self.kinds = tuple(kind for kind in CONDITIONS if kind in {condition_of(name) for name in rows.varying()})
        ranks = np.array([RANKS[grade or None] for grade in rows.robustness])
        self.rank = ranks[rows.codes].reshape(rows.shape)
        chances, every = rows.chances(), np.arange(len(rows.codes))
        has = np.nan_to_num(rows.margins(every), nan=-1.0) if chances is None else chances
        self.has, self.asked = has.reshape(rows.shape), asked
        self.members = rows.over(np.ones(rows.shape, np.int64), self.kinds, np.add)
        self.worst = rows.over(self.rank, self.kinds, np.maximum)
        self.first = rows.over(every.reshape(rows.shape), self.kinds, np.minimum).ravel() == every
        self.graded = chances is not None or not rows.asks or "second_opinion" in rows.settings["model"]
        self.tried: dict[int, Design] = {}

    def _count(self, held: np.ndarray) -> int:
        """Return the number of designs among rows of which a design has all or none."""
        return round(float((1.0 / self.members[held]).sum()))

    def _order(self, held: np.ndarray, prefer: str) -> list[int]:
        """Return the first rows of designs, the least by a preference first."""
        numbers = np.flatnonzero(held)
        if not len(numbers):
            return []
        columns = self.rows.inputs | {DEPTH: self.rows.depth()}
        design = {name: np.broadcast_to(columns[name], self.rows.shape).ravel()[numbers] for name in NEEDED}
        least = quantities_by(design, self.rows.settings) | {DEPTH: design[DEPTH]}
        least[BOULDER_MASS] = self.rows.mass().ravel()[numbers]
        # Of a boulder in several soils, what is dug in the one that takes the most.
        dug = np.full(self.rows.shape, -np.inf)
        dug.flat[numbers] = least[EXCAVATED.name]
        least[EXCAVATED.name] = self.rows.over(dug, self.kinds, np.maximum).ravel()[numbers]
        columns_of = [least[PREFERENCES[name]] for name in (prefer, *PREFERENCES)]
        order = np.lexsort([numbers, *(np.round(values, 9) for values in reversed(columns_of))])
        return numbers[order][self.first[numbers[order]]].tolist()

    def _design(self, number: int) -> Design:
        """Return a design with all its rows, and ask second opinions where the run asked none."""
        read = []
        numbers = self.rows.siblings(number, self.kinds)
        for each in numbers[self.computed.ravel()[numbers]].tolist():
            row = self.rows.row(each)
            read.append({**row, **self.rows.to_build(each), "robustness": self.rows.grade(row)})
        return Design(read)

    def _best(self, held: np.ndarray, prefer: str) -> Design | None:
        """Return the design of best grade that is the least by a preference.

        Where the run asked for no second opinions, some designs are asked: one that is open may be robust.
        """
        robust, open_ = RANKS["robust"], RANKS["open"]
        steps = [(self.worst <= open_, robust), (self.worst == robust, robust), (self.worst <= open_, open_)]
        for among, rank in (*steps[self.graded :], (held, RANKS["sensitive"])):
            for number in self._order(held & among, prefer)[:MOST_ASKED]:
                if number not in self.tried:
                    self.tried[number] = self._design(number)
                if RANKS[self.tried[number].grade] <= rank:
                    return self.tried[number]
        return None

    def recommended(self) -> Recommendation:
        """Return the recommendation of the whole result."""
        asked, rows = self.asked, self.rows
        enough = self.has >= (asked.least_margin if asked.probability is None else asked.probability)
        held = rows.over(enough & (self.passing | (asked.probability is not None)), self.kinds, np.minimum)
        found = {name: self._best(held, name) for name in PREFERENCES}
        best = found["mass"]
        others = {
            name: design
            for name, design in found.items()
            if best is not None and design is not None and design.grade == best.grade and design.sizes != best.sizes
        }
        alike = 0
        if best is not None:
            rank = RANKS[best.grade]
            alike = self._count(held & (self.worst <= (rank if self.graded else max(rank, RANKS["open"]))))
            alike -= sum(not self.graded and RANKS[design.grade] > rank for design in self.tried.values())
        counts = (self._count(np.ones(rows.shape, bool)), self._count(held), alike, int(self.members.max()))
        nearest = self._nearest() if best is None and asked.probability is None else None
        return Recommendation("mass", best, others, *counts, nearest, of_run=True)

    def _nearest(self) -> Nearest:
        """Return the design that passes in the most of its rows, then a robust one, then the one with most margin."""
        over = self.rows.over
        share = over(self.passing.astype(float), self.kinds, np.add) / self.members
        rank = over(np.where(self.passing, self.rank, 0), self.kinds, np.maximum)
        has = over(self.has, self.kinds, np.minimum)
        keys = (-has, rank, -share, ~self.computed)
        design = self._design(int(np.lexsort([key.ravel() for key in keys])[0]))
        read = [{**row, "passes_at": row[DEPTH] if row["verdict"] == "pass" else None} for row in design.rows]
        passes = all(row["passes_at"] is not None for row in read)
        return Nearest(read, design if passes else None, design.margin if passes else 0.0, False, {})


def _counts(rows: ResultRows, n: int) -> list[Sentence]:
    """Say how many of the rows of a run pass, and why the others do not."""
    counts, total = rows.counts(), len(rows.codes)
    if total == 1:
        return []
    sentences = _uncertain(rows)
    means = ", at the means of their uncertain inputs" if sentences else ""
    sentences.append((f"{n:,} of {total:,} designs {verb(n, 'pass', 'passes')} ({share(n, total)}){means}.",))
    if n and rows.grades and not means:
        sentences.append(_grades(rows, n))
    if NOT_YET in counts:
        left = f"{counted(counts[NOT_YET], 'design')} {verb(counts[NOT_YET], 'are', 'is')}"
        sentences.append((f"The run is not finished: {left} not computed yet.",))
    others = [
        f"{count:,} {_in_words(name, count)}"
        for name, count in counts.items()
        if name.partition(":")[0] not in ("pass", NOT_YET)
    ]
    if others:
        sentences.append((f"Of the others, {'; '.join(others)}.",))
    return sentences


def _grades(rows: ResultRows, n: int) -> Sentence:
    """Say how many of the passes are robust."""
    robust, sensitive, left = (rows.grades.get(grade, 0) for grade in GRADES)
    if left == n:
        asked = rows.kind in (NEED, CAPACITY) or "second_opinion" in rows.finished.identity["settings"]["model"]
        reason = MEANINGS["open"].capitalize() if asked else "No second opinion was asked for"
        return (f"{reason}; whether a pass stands under another form of the model is open.",)
    parts = ((robust, f"robust ({IN_WORDS})"), (sensitive, f"sensitive ({SENSITIVE_IN_WORDS})"), (left, "open"))
    by_grade = listed(tuple(f"{count:,} {verb(count, 'are', 'is')} {words}" for count, words in parts if count))
    return (f"Of the {n:,} that {verb(n, 'pass', 'passes')}, {by_grade}.",)


def _uncertain(rows: ResultRows) -> list[Sentence]:
    """Say how probable it is that designs pass; nothing of a run."""
    chances = rows.chances()
    if chances is None:
        return []
    n = int((chances >= SAFE).sum())
    first = f"{n:,} of {len(chances):,} designs {verb(n, 'pass', 'passes')} with a probability of {SAFE:.0%} or more"
    best = int(chances.argmax())
    return [(f"{first}." if n else f"{first}; the largest is {chances[best]:.1%} (design {best:,}).",)]


VERBS = {
    "pass": ("pass", "passes"),
    "fail": ("fail", "fails"),
    "undecided": ("are undecided", "is undecided"),
    "error": ("cannot be computed", "cannot be computed"),
}
"""Verdicts of many designs and of one in a sentence."""


def _in_words(name: str, count: int) -> str:
    """Verdict and reason of so many designs for a sentence."""
    verdict, _, reason = name.partition(": ")
    does = verb(count, *VERBS[verdict])
    return f"{does} ({REASON_WORDS.get(reason, reason)})" if reason and verdict != "pass" else does
