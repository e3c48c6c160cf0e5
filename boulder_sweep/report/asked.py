"""What a file of answers says: how many rows have one, in sentences, and the answers as a table.

The parts of sentences, here and in `boulder_sweep.report.answers`, are words and numbers with units.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import CAPACITY, NEED, UNCERTAINTY, AnswerFile
from boulder_sweep.answers.search import BLOCKED, NEVER, NOT_MONOTONE, UNKNOWN, WORDS
from boulder_sweep.columns import BOULDER_MASS, INPUT_COLUMNS
from boulder_sweep.designs import SIDES
from boulder_sweep.report.rows import DEPTH, RATIO, ResultRows, label_of
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.text import counted

MOST_LINES = 200
"""Most answers in the table of the page."""
NOTHING = {
    WORDS[NEVER]: "not pass anywhere in the searched range",
    WORDS[BLOCKED]: "not pass by what was asked, up to where the truck would pass or ride over the boulder",
    WORDS[UNKNOWN]: "not pass for certain: the last value tried is undecided",
    WORDS[NOT_MONOTONE]: "not pass but in places, between values that fail",
}
"""What is said where there is no answer."""


class Measure(NamedTuple):
    """A number in a sentence, in a unit of the table; the page shows it in the reader's."""

    value: float
    unit: str


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


def listed(words: tuple[str, ...] | list[str]) -> str:
    """Words as a list in a sentence."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else words[0]


class AnswerTable(NamedTuple):
    """Answers as the page lists them."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str | Measure, ...], ...]
    left_out: str
    """Which answers it leaves out; empty if none."""


def key_words(need: Need) -> str:
    """Return what was asked for in words: ``least embedment depth``."""
    name = "boulder mass" if need.key.name == BOULDER_MASS else label_of(need.key.name)
    return f"{'largest' if need.key.most else 'least'} {name}"


def need_sentences(rows: ResultRows, need: Need) -> tuple[list[Sentence], NamedDesign]:
    """Return how many rows have an answer, why others have none, and first, where nothing is recommended, the worst."""
    answers = need.arrow[need.key.answer].to_numpy()
    n, total = int((~np.isnan(answers)).sum()), len(answers)
    sentences: list[Sentence] = []
    if total > 1:
        sentences.append((f"{n:,} of {total:,} combinations have an answer ({share(n, total)}).",))
    without = need.arrow.filter(need.arrow["passes_at"].is_null())["found"].to_pylist()
    for word, count in Counter(without).items():
        if word in NOTHING:
            who = f"{counted(count, 'combination')}" if total > 1 else "The boulder"
            sentences.append((f"{who} {verb(count, 'do', 'does')} {NOTHING[word]}.",))
    if not n or need.recommendation is not None:
        return sentences, NamedDesign("The last value tried", 0)
    number = int(np.nanargmin(answers if need.key.most else -answers))
    where, row = f" in the worst of {n:,} combinations" if n > 1 else "", rows.row(number)
    held = f"P(pass) = {row['p_pass']:.1%}" if "p_pass" in row else f"margin {row['margin']:.1%}"
    lead = f"The {key_words(need)} that passes{where}: "
    worst = (lead, Measure(float(answers[number]), need.key.field.unit), f" (design {number:,}, {held}).")
    return [worst, *sentences], NamedDesign("The answer that is worst", number)


def answers_table(rows: ResultRows) -> AnswerTable | None:
    """Return the answers as a table; None for the result of a run, and where the sentences say it all."""
    file = rows.finished
    if not isinstance(file, AnswerFile) or (len(rows.codes) == 1 and file.kind == NEED):
        return None
    answers = file.answers()
    table = file.table
    labels = [name for name in answers.sweep.plan.labels if name in table.column_names]
    open_ = {answers.key.name, *answers.derived} if isinstance(answers, Need) else set()
    columns: list[tuple[str, str, str]] = [(name, name, "") for name in labels]
    if answers.sweep.table is not None:
        columns.append(("design", "design_id", ""))
    else:
        varying = {DEPTH if name == RATIO else name for name in rows.varying()}
        inputs = [name for name in INPUT_COLUMNS if name in varying and name not in open_]
        columns += [(label_of(name), name, BY_NAME[name].unit) for name in inputs]
    columns += _answer_columns(file.kind, answers)
    kept = table.slice(0, MOST_LINES).to_pylist()
    more = len(table) > MOST_LINES
    left = f"the first {MOST_LINES:,} of {len(table):,} answers" if more else ""
    lines = tuple(tuple(_cell(row, name, unit, open_) for _, name, unit in columns) for row in kept)
    return AnswerTable(tuple(head for head, _, _ in columns), lines, left)


def _answer_columns(kind: str, answers: Any) -> list[tuple[str, str, str]]:
    """Return head, column and unit of what a command answers."""
    if kind == NEED:
        key = answers.key
        sizes = SIDES if key.name == BOULDER_MASS else ()
        columns = [(key_words(answers), key.answer, key.field.unit), *((label_of(one), one, "m") for one in sizes)]
        columns += [("embedment depth", DEPTH, "m")] if key.name != DEPTH else []
        columns += [("mass", BOULDER_MASS, "kg")] if key.name != BOULDER_MASS else []
        chance = "p_pass" in answers.arrow.column_names
        if chance:
            robust = [("P(robust)", "p_robust", "%")] if answers.robust else []
            return [*columns, ("P(pass)", "p_pass", "%"), *robust, ("undecided", "p_undecided", "%")]
        return [*columns, ("margin", "margin", "%"), ("second opinion", "robustness", "")]
    columns_of = {
        CAPACITY: [
            ("verdict", "verdict", ""),
            ("second opinion", "robustness", ""),
            ("withstands speed", "withstands_speed_m_s", "m/s"),
            ("mass of truck", "withstands_mass_kg", "kg"),
            ("friction angle", "withstands_friction_angle_deg", "deg"),
            ("class, simulated", "simulated_class", ""),
        ],
        UNCERTAINTY: [
            ("verdict at the means", "verdict", ""),
            ("P(pass)", "p_pass", "%"),
            ("from", "p_pass_low", "%"),
            ("to", "p_pass_high", "%"),
            *([("P(robust)", "p_robust", "%")] if "p_robust" in answers.arrow.column_names else []),
            ("undecided", "p_undecided", "%"),
            ("decided by", "p_pass_driver", ""),
        ],
    }
    return columns_of[kind]


def _cell(row: dict[str, Any], name: str, unit: str, searched: set[str]) -> str | Measure:
    """Return one cell; of a row without an answer, why there is none in place of it."""
    value, none = row[name], "passes_at" in row and row["passes_at"] is None
    if none and name.startswith(("least_", "most_")):
        return "in places only" if row["found"] == WORDS[NOT_MONOTONE] else str(row["found"]).replace("_", " ")
    if value is None or (none and name in (*searched, "margin", "p_pass", "p_robust", "robustness")):
        return "–"
    if unit == "%":
        return f"{value:.1%}"
    return Measure(float(value), unit) if unit else str(value)
