"""What a result says, in sentences: what passes, the least depth and the least mass with their margin."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.answers.outputs import CAPACITY, NEED
from boulder_sweep.columns import GRADES, TO_BUILD
from boulder_sweep.judge.robustness import IN_WORDS, MEANINGS, SENSITIVE_IN_WORDS, meaning_of
from boulder_sweep.judge.validity import BY_FLAG, SEPARATOR
from boulder_sweep.report.asked import (
    Measure,
    Named,
    Sentence,
    capacity_sentences,
    listed,
    need_sentences,
    share,
    verb,
)
from boulder_sweep.report.rows import CONDITIONS, NOT_YET, ResultRows, condition_of, label_of
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.text import counted
from boulder_sweep.views.wording import REASON_WORDS

if TYPE_CHECKING:
    from boulder_sweep.answers.need import Need

SAFE = 0.95
"""Probability of passing from which on a design is called safe here."""


@dataclass(frozen=True)
class Answer:
    """What the page says first.

    Attributes
    ----------
    sentences
        The most important first.
    named
        The designs that they speak of.
    """

    sentences: tuple[Sentence, ...]
    named: tuple[Named, ...]


def answer_of(rows: ResultRows) -> Answer:
    """Describe the result of a sweep in sentences."""
    counts, total = rows.counts(), len(rows.codes)
    passing = rows.having("pass")
    n = int(passing.sum())
    if rows.need is not None:
        return _of_answers(rows, rows.need, n)
    uncertain = _uncertain(rows)
    if total == 1:
        return _of_one(rows, uncertain)
    means = ", at the means of their uncertain inputs" if uncertain else ""
    sentences: list[Sentence] = [*(sentence for sentence, _ in uncertain)]
    sentences.append((f"{n:,} of {total:,} designs {verb(n, 'pass', 'passes')} ({share(n, total)}){means}.",))
    if n and rows.grades and not uncertain:
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
    sentences += _flagged(rows, n)
    if n == 0:
        none = "No design passes at the means." if uncertain else "No design passes."
        return Answer((*sentences, (none,)), tuple(design for _, design in uncertain if design))
    withstood = _withstood(rows, passing)
    least = [_least(rows, withstood, what) for what in ("mass", "depth")]
    if withstood.kinds != _varied(rows):
        sentences.append(
            (
                f"No boulder passes {_where(rows, _varied(rows))}; "
                "the least ones below pass only under the conditions named with them.",
            )
        )
    for sentence, _ in least:
        sentences.append(sentence)
    named = {design.number: design for _, design in uncertain if design}
    for _, one in least:
        known = named.get(one.number)
        named[one.number] = (
            one if known is None else Named(f"{known.title}, {one.title[0].lower()}{one.title[1:]}", one.number)
        )
    return Answer(tuple(sentences), tuple(named.values()))


def _of_answers(rows: ResultRows, need: Need, n: int) -> Answer:
    """Describe the answers of `sweep need`."""
    sentences, named = need_sentences(rows, need)
    if n == 1:
        sentences += _of_row(rows, rows.row(named[0].number))
    elif n:
        sentences += [*([_grades(rows, n)] if need.probability is None else []), *_flagged(rows, n)]
    return Answer(tuple(sentences), tuple(named))


def _flagged(rows: ResultRows, n: int) -> list[Sentence]:
    """Say how many of the n passes lie outside what the model was tested on."""
    flagged = n - rows.flags.get("", 0)
    if flagged:
        commonest = sorted(((count, name) for name, count in rows.flags.items() if name), reverse=True)
        most = "; ".join(f"{count:,} with {_meaning(name)}" for count, name in commonest[:3])
        lie = verb(flagged, "lie", "lies")
        often = ", most often:" if len(commonest) > 3 else ":"
        return [(f"{flagged:,} of those that pass {lie} outside what the model was tested on{often} {most}.",)]
    return []


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


def _uncertain(rows: ResultRows) -> list[tuple[Sentence, Named | None]]:
    """Say how probable it is that designs pass, and name the lightest of the safe ones; nothing of a run."""
    chances = rows.chances()
    if chances is None:
        return []
    if len(chances) == 1:
        row = rows.row(0)
        driver = row["p_pass_driver"]
        most = f", decided most by {driver.replace('.', ' ').replace('_', ' ')}" if driver else ""
        interval = f"{row['p_pass_low']:.1%} to {row['p_pass_high']:.1%}"
        chance = f"The probability of passing is {row['p_pass']:.1%} ({interval}){most}."
        if row["p_undecided"]:
            why = REASON_WORDS[row["p_undecided_reason"]]
            chance += f" {row['p_undecided']:.1%} of the designs drawn are undecided ({why})."
        return [((chance,), Named("The design", 0))]
    safe = chances >= SAFE
    n = int(safe.sum())
    first = f"{n:,} of {len(chances):,} designs {verb(n, 'pass', 'passes')} with a probability of {SAFE:.0%} or more"
    if not safe.any():
        best = int(chances.argmax())
        largest = f"{first}; the largest is {chances[best]:.1%} (design {best:,})."
        return [((largest,), Named("Design with the largest probability of passing", best))]
    withstood = _withstood(rows, safe.reshape(rows.shape))
    mass = np.where(withstood.designs, rows.mass(), np.inf)
    siblings, kinds = withstood.siblings(rows, int(mass.argmin()))
    number = int(siblings[chances[siblings].argmin()])
    lead = f"{first}. The lightest {f'boulder that does so {_where(rows, kinds)}' if kinds else 'of them'}"
    sentence = _describe(rows, number, siblings, kinds, lead, f", P(pass) = {chances[number]:.1%}")
    title = f"Lightest boulder that passes with a probability of {SAFE:.0%}"
    return [(sentence, Named(f"{title} {_where(rows, kinds)}".rstrip(), number))]


def _of_one(rows: ResultRows, uncertain: list[tuple[Sentence, Named | None]]) -> Answer:
    """Describe the result of a single design."""
    row, name = rows.row(0), rows.names[rows.codes[0]]
    margin = "" if row["margin"] is None else f", with a margin of {row['margin']:.1%}"
    verdict = f"{_in_words(name, 1)}{margin}{', at the means of its uncertain inputs' if uncertain else ''}"
    sentences: list[Sentence] = [*(sentence for sentence, _ in uncertain)]
    sentences.append((f"The design {verdict}: ", *_sizes(rows, 0), " deep.", *_to_build(rows, 0)))
    if rows.kind == CAPACITY:
        sentences += capacity_sentences(row)
    sentences += _of_row(rows, row)
    return Answer(tuple(sentences), (Named("The design", 0),))


def _of_row(rows: ResultRows, row: dict[str, Any]) -> list[Sentence]:
    """Say how firm the verdict of a design is, and where it lies outside what the model was tested on."""
    sentences: list[Sentence] = []
    grade = rows.grade(row)
    meaning = meaning_of({**row, "robustness": grade})
    if meaning is not None:
        sentences.append((f"It is {grade}: {meaning}.",))
    flags = [flag for flag in (row["validity"] or "").split(SEPARATOR) if flag]
    if flags:
        sentences.append((f"It lies outside what the model was tested on: {'; '.join(map(_meaning, flags))}.",))
    return sentences


def _sizes(rows: ResultRows, number: int) -> Sentence:
    """Say how heavy a boulder is and how deep it stands."""
    mass, depth = (float(values.flat[number]) for values in (rows.mass(), rows.depth()))
    return Measure(mass, "kg"), " of rock, ", Measure(depth, "m")


def _to_build(rows: ResultRows, number: int) -> Sentence:
    """Say what a design takes to build beside its mass, as a sentence that follows another."""
    quantities = rows.to_build(number)
    above, excavated, backfilled = (Measure(quantities[spec.name], spec.unit) for spec in TO_BUILD)
    return (
        " It stands ",
        above,
        " above ground and takes ",
        excavated,
        " of excavation and ",
        backfilled,
        " of backfill.",
    )


def _meaning(flag: str) -> str:
    """What a flag says; its name where other rules have set it."""
    return BY_FLAG[flag].meaning if flag in BY_FLAG else flag


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


class Withstood(NamedTuple):
    """Designs of boulders that hold under as many of the conditions of a result as any boulder does."""

    designs: np.ndarray
    """Whether a row is one of them, in the shape of the grid."""
    kinds: tuple[str, ...]
    """The conditions under all of which they hold."""

    def siblings(self, rows: ResultRows, number: int) -> tuple[np.ndarray, tuple[str, ...]]:
        """Return the rows of a boulder under these conditions, and the conditions; none where it has a single row."""
        siblings = rows.siblings(number, self.kinds)
        return siblings, self.kinds if len(siblings) > 1 else ()


def _varied(rows: ResultRows) -> tuple[str, ...]:
    """Conditions that vary."""
    kinds = {condition_of(name) for name in rows.varying()}
    return tuple(kind for kind in CONDITIONS if kind in kinds)


def _withstood(rows: ResultRows, holds: np.ndarray) -> Withstood:
    """Find the boulders that hold under all conditions, or else under as many as possible; soils count first."""
    varied = _varied(rows)
    # The rows of a list need not have every combination.
    sizes = range(len(varied), -1, -1) if rows.axes else (len(varied), 0)
    for kinds in (kinds for size in sizes for kinds in combinations(varied, size)):
        designs = rows.everywhere(holds, kinds)
        if designs.any():
            break
    return Withstood(designs, kinds)


def _where(rows: ResultRows, kinds: tuple[str, ...]) -> str:
    """Say under which conditions; empty without any."""
    if not kinds:
        return ""
    if not rows.axes:
        return "in every row of the list that has it"
    words = [CONDITIONS[kind] for kind in kinds]
    return f"{listed(words)} of the sweep"


def _worst(rows: ResultRows, kinds: tuple[str, ...]) -> str:
    """Say of which row a margin is."""
    if not kinds:
        return ""
    if not rows.axes:
        return " in the row that is worst for it"
    if len(kinds) > 1:
        return f" in the combination of {listed(kinds)} that is worst for it"
    before = {"soil": "in", "vehicle": "against", "speed": "at"}[kinds[0]]
    return f" {before} the {kinds[0]} that is worst for it"


def _beyond(rows: ResultRows, siblings: np.ndarray, kinds: tuple[str, ...]) -> Sentence:
    """Name the conditions of a boulder where the sweep has others, under which it need not hold."""
    said: list[str | Measure] = []
    for name in rows.varying():
        kind = condition_of(name)
        if not kind or (rows.axes and kind in kinds):
            continue
        if not rows.axes and set(rows.inputs[name][siblings]) == set(rows.inputs[name]):
            continue
        said.append(f"{',' if said else ', with'} {label_of(name)} ")
        unit = BY_NAME[name].unit if name in BY_NAME else ""
        low, high = (end if isinstance(end, str) else Measure(end, unit) for end in rows.ends(name, siblings))
        said += [low] if low == high else [low, " to ", high]
    return tuple(said)


def _describe(
    rows: ResultRows, number: int, siblings: np.ndarray, kinds: tuple[str, ...], lead: str, held: str
) -> Sentence:
    """Describe a boulder behind the words that lead to it: conditions, sizes, worst row, what it takes to build."""
    return (
        lead,
        *_beyond(rows, siblings, kinds),
        ": ",
        *_sizes(rows, number),
        f" deep (design {number:,}{held}{_worst(rows, kinds)}).",
        *_to_build(rows, number),
    )


def _least(rows: ResultRows, withstood: Withstood, what: str) -> tuple[Sentence, Named]:
    """Find the design of least mass or depth among boulders that pass, in the row that is worst for it."""
    values, other = (rows.mass(), rows.depth()) if what == "mass" else (rows.depth(), rows.mass())
    least = np.where(withstood.designs, values, np.inf)
    # Ties are broken by the other quantity.
    ties = least <= least.min() * (1.0 + 1e-9)
    siblings, kinds = withstood.siblings(rows, int(np.argmin(np.where(ties, other, np.inf))))
    margins = rows.margins(siblings)
    number = int(siblings[np.argmin(np.where(np.isnan(margins), np.inf, margins))])
    title = "Lightest boulder that passes" if what == "mass" else "Shallowest embedment that passes"
    row = rows.row(number)
    grade = rows.grade(row)
    held = f", margin {row['margin']:.1%}" if row["margin"] is not None else ""
    held += f", {grade}" if grade in ("robust", "sensitive") else ""
    where = _where(rows, kinds)
    lead = f"The {title[0].lower()}{title[1:]} {where or 'among them'}"
    return _describe(rows, number, siblings, kinds, lead, held), Named(f"{title} {where}".rstrip(), number)
