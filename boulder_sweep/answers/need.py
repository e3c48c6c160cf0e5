"""The smallest input that passes (depth, height, soil strength), or the largest (speed).

For every combination of the other inputs, one input is scanned and the change from failing to passing is bisected down
to two neighbours on a lattice of round numbers, with the quick solution. Both neighbours are then judged as ``sweep
run`` would judge them. If that disagrees, the row is searched again with the accuracy of the sweep.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.answers.keys import BOULDER_MASS, Ends, Key, key_of, margin_asked, share
from boulder_sweep.answers.questions import Question
from boulder_sweep.answers.recommendation import PREFERENCES, Recommendation, recommended
from boulder_sweep.answers.result import (
    Result,
    TableColumn,
    chance_columns,
    joined_tables,
    rows_table,
    to_build,
)
from boulder_sweep.answers.search import FAULTY, UNKNOWN, WORDS
from boulder_sweep.answers.trials import Judges, judges_of, ranges
from boulder_sweep.columns import INPUTS, OUTCOME_COLUMNS
from boulder_sweep.designs import SIDES
from boulder_sweep.drawing import draw
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.judge.robustness import can_be_asked
from boulder_sweep.runner.pool import Pool, call
from boulder_sweep.settings.fields import EMBEDMENT
from boulder_sweep.settings.loader import sweep_of
from boulder_sweep.store.provenance import file_metadata
from boulder_sweep.text import ProgressCallback

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.loader import Settings

WORTH_A_THREAD = 2048
"""Rows for which another thread is worth starting."""


@dataclass(frozen=True, eq=False, repr=False)
class Need(Result):
    """Answers to a question, one row for every combination of the other inputs. Made by `need`.

    Attributes
    ----------
    sweep, arrow
        The sweep asked about, and one row for each answer: inputs, answer, bracket, outcome at the answer.
    key : Key
        The input asked for.
    least_margin : float
        Margin asked for.
    simulated : int
        Designs simulated during the search.
    probability : float or None
        Probability of passing asked for; None where no input is uncertain.
    robust : bool
        Whether only a pass counts that stands under every second opinion with the margin.
    recommendation : Recommendation or None
        The design to build, and why; None where the question is not about a least size or embedment, or none was
        wanted. The file of the answers has it, too.
    """

    key: Key
    least_margin: float
    simulated: int
    probability: float | None = None
    robust: bool = False
    recommendation: Recommendation | None = None

    @property
    def derived(self) -> tuple[str, ...]:
        """Input columns that follow from others or from the answer."""
        given = self.sweep.plan.given
        derived = tuple(name for name in ("embedment_depth_m", "impact_height_m") if name not in given)
        return (*derived, *EMBEDMENT) if self.key.name in EMBEDMENT else derived

    @property
    def seeks_depth(self) -> bool:
        """Whether a depth was found for each answer."""
        return self.sweep.depth_sought and self.key.name not in EMBEDMENT

    def counts(self) -> dict[str, int]:
        """Return the number of rows of each kind of answer."""
        counted = Counter(self.arrow["found"].to_pylist())
        return {word: counted[word] for word in WORDS if word in counted}

    @property
    def errors(self) -> int:
        """Number of rows that cannot be computed, other than where the boulder has no face left for the truck."""
        return self.counts().get(WORDS[FAULTY], 0)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "name": self.sweep.name,
            "asked": self.key.answer,
            "unit": self.key.field.unit,
            "margin": self.least_margin,
            "robust": self.robust,
            "simulated": self.simulated,
            "found": self.counts(),
            "recommendation": None if self.recommendation is None else self.recommendation.to_dict(),
            "rows": self.arrow.to_pylist(),
        }

    def plot(self, path: str | Path, *, units: str = "si") -> None:
        """Draw a design chart in ``si`` or ``us`` units: the answer over the size of the boulder, one curve a soil.

        Raises
        ------
        PictureError
            It cannot be drawn.
        """
        draw("answer_charts", "draw_design_chart", self, path, units=units)


RECOMMENDATION = "recommendation"
"""Entry of the metadata of a file of answers."""
MARGIN = 0.25
"""Margin that is asked for where none is named."""


def need(
    sweep: Settings,
    least: str | None = None,
    *,
    most: str | None = None,
    margin: str | float | None = None,
    probability: str | float | None = None,
    seed: int = 0,
    between: Ends = None,
    robust: bool | None = None,
    prefer: str | None = "mass",
    jobs: int | None = None,
    progress: ProgressCallback | None = None,
    ready: Callable[[], None] | None = None,
) -> Need:
    """Find the smallest value of an input that passes, for every combination of the others, and the design to build.

    Parameters
    ----------
    sweep
        The sweep, the path of its file, or a mapping that `boulder_sweep.load` takes. If the input asked for is an axis
        of its grid, the axis gives the search range.
    least, most
        The input whose smallest or largest passing value is wanted; only one of the two.
        ``embedment_depth`` by default.
    margin
        Least margin to the limits, ``0.25`` or ``"25 %"``, which is the default; 0 where a probability is asked for.
    probability
        Required probability of passing, ``0.95`` or ``"95 %"``, if inputs have distributions.
    seed
        Seed of the samples for it.
    between
        Search range, instead of the axis or the usual range.
    robust
        Whether only a pass counts that stands under every second opinion, with the margin, see
        `boulder_sweep.judge.robustness`. By default so where second opinions know such designs and no probability is
        asked for.
    prefer
        What is to be least among designs that qualify: ``mass``, ``depth`` or ``excavation``; None where no design is
        to be recommended, which takes its own simulations.
    jobs
        Threads; all cores by default. The answers do not depend on it.
    progress
        Called as the search progresses, with how many rows of how many are answered; with a probability asked for,
        with how many values of how many are tried, from the threads that try them.
    ready
        Called once the question is known to be one that can be answered, before anything is computed.

    Returns
    -------
    Need
        One row for each combination.

    Raises
    ------
    QuestionError
        The question is contradictory or out of range.
    SettingsError
        An input has a distribution, or the file is not valid.
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    """
    sweep = sweep_of(sweep)
    if probability is None:
        sweep = at_values(sweep)
    if least and most:
        raise QuestionError("use either --least or --most, not both")
    if prefer is not None and prefer not in PREFERENCES:
        raise QuestionError(f"--prefer {prefer}: must be {', '.join(PREFERENCES)}")
    word = most or least or "embedment_depth"
    key = key_of(word, most=bool(most))
    if key.name == "friction_angle_deg" and sweep.partial_factor != 1.0:
        raise QuestionError(
            "the friction angle is asked for, and partial_factor would not be applied to the answer; remove it from "
            "the file, then multiply the tangent of the answer by it"
        )
    if BOULDER_MASS.name in sweep.plan.given and key.name in (*SIDES, "boulder_density_kg_m3"):
        raise QuestionError(
            f"{key.field.path} cannot be searched while the file has boulder.mass, which holds for one boulder; "
            "remove it from the file and give boulder.density"
        )
    chance = None if probability is None else share(probability, "--probability")
    if chance is not None and not 0.0 < chance < 1.0:
        raise QuestionError(f"--probability {probability}: must be more than 0 and less than 100 %")
    if robust is None:
        robust = chance is None and can_be_asked(sweep) and bool(sweep.model.second_opinion)
    if margin is None:
        margin = MARGIN if chance is None else 0.0
    least_margin = margin_asked(margin)
    if robust and not can_be_asked(sweep):
        raise QuestionError("--robust: second opinions know rock of given density and corrected readings only")
    if robust and not sweep.model.second_opinion:
        raise QuestionError(
            "--robust needs second opinions: leave out --no-second-opinion, or second_opinion: none in the file"
        )
    asked = _question(sweep, key, between, judges_of(sweep, least_margin, robust=robust), chance, seed)
    if ready is not None:
        ready()
    return _answered(asked, chance, prefer, jobs, progress)


def _answered(
    asked: Question,
    chance: float | None,
    prefer: str | None,
    jobs: int | None,
    progress: ProgressCallback | None,
) -> Need:
    """Return the answers to a question; arguments: see `need`."""
    judges, key, pool = asked.judges, asked.key, Pool(jobs)
    judges.final.asked().warm_up()
    done = _Progress(progress, asked)
    shared = max(-(-asked.count // (jobs or os.cpu_count() or 1)), WORTH_A_THREAD)
    pieces = list(ranges(asked.count, min(asked.rows_at_once, shared)))
    tables, simulated = [], 0
    for table, count in pool(call(_table_of, asked, start, stop) for start, stop in pieces):
        tables.append(table)
        simulated += count
        done.answered(len(table))
    question = {"asked": key.answer, "margin": judges.least_margin}
    question |= {} if chance is None else {"probability": chance}
    question |= {"robust": True} if judges.robust else {}
    table = joined_tables(tables, asked.sweep, judges, "boulder_sweep.need", question)
    best = None if prefer is None else recommended(asked, table, prefer)
    table = _outcomes_of_answers(table)
    if best is not None:
        metadata = table.schema.metadata | file_metadata({RECOMMENDATION: best.to_dict()})
        table = table.replace_schema_metadata(metadata)
    return Need(asked.sweep, table, key, judges.least_margin, simulated, chance, judges.robust, best)


def _outcomes_of_answers(table: pa.Table) -> pa.Table:
    """Return answers without the outcome of the value tried last, where nothing passes as asked.

    Why it cannot be computed or decided remains.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    from boulder_sweep.store.part import number_array

    def rows_with(column: str, *words: str) -> pa.Array:
        """Return which rows have one of these words; comparing with a word by pyarrow imports pandas."""
        other = np.array([word not in words for word in table[column].to_pylist()], dtype=bool)
        return number_array(np.zeros(len(table)), other).is_valid()

    passes = table["passes_at"].is_valid()
    with_reason = pc.or_(passes, rows_with("verdict", "undecided", "error"))
    with_chance = pc.or_(passes, rows_with("found", WORDS[UNKNOWN]))
    for index, name in enumerate(table.column_names):
        if name.startswith(("p_pass", "p_robust", "p_undecided")):
            where = with_chance
        elif name in OUTCOME_COLUMNS:
            where = with_reason if name in ("verdict", "reason") else passes
        else:
            continue
        column = table[name]
        table = table.set_column(
            index, table.field(index), pc.if_else(where, column, pa.nulls(len(table), column.type))
        )
    return table


class _Progress:
    """Reports how many rows have been answered, or, where every row takes long, how many values have been tried.

    Parameters
    ----------
    report
        Called with how many of how many are done, first with none; None for no reports.
    asked
        The question.
    """

    def __init__(self, report: ProgressCallback | None, asked: Question):
        self._report, self._rows = report, asked.count
        self._done, self._rows_done, self._total = 0, 0, self._rows
        self._lock = Lock()  # values are tried by several threads
        if report is None:
            return
        if values := asked.values_to_try():
            self._total = values
            asked.tried = self._tried
        report(0, self._total)

    def answered(self, count: int) -> None:
        """Report that some more rows have been answered."""
        with self._lock:
            self._rows_done += count
            self._reach(self._rows_done * self._total // self._rows)

    def _tried(self, count: int) -> None:
        with self._lock:
            self._reach(min(self._done + count, self._total))

    def _reach(self, done: int) -> None:
        if self._report is not None and done > self._done:
            self._done = done
            self._report(done, self._total)


def _question(sweep: Sweep, key: Key, between: Ends, judges: Judges, probability: float | None, seed: int) -> Question:
    """Return the question of the kind that is asked."""
    if probability is None:
        return Question(sweep, key, between, judges)
    from boulder_sweep.answers.probability import ProbabilityQuestion  # imports scipy.stats

    return ProbabilityQuestion(sweep, key, between, judges, probability, seed)


def _table_of(asked: Question, start: int, stop: int) -> tuple[pa.Table, int]:
    """Answer some rows; the table and the designs simulated.

    The table has the inputs, the answer and its bracket, and the outcome at the answer.
    """
    from boulder_sweep.store.part import word_array

    answers, key = asked.answered(start, stop), asked.key
    unit = key.field.unit
    what = f"{'largest' if key.most else 'smallest'} value of {key.field.path} that passes"
    next_to_it = f"value next to it of {key.field.path} that does not pass; where none passes, the last one tried"
    columns: list[TableColumn] = [
        (key.answer, unit, f"{what}; null where none does", answers.passes),
        ("fails_at", unit, next_to_it, answers.fails),
        ("passes_at", unit, "the same as the answer: judged as a run judges it", answers.passes),
        ("found", "", ", ".join(WORDS), word_array(answers.found, WORDS)),
        ("passes_within", unit, "where it is not monotone: all stretches that pass", answers.stretches),
        *to_build(answers.block, asked.sweep),
    ]
    if answers.chances is not None:
        columns += chance_columns(answers.chances, " at the answer")
    return rows_table(start, answers.block, answers.judged, columns, at=1 + len(INPUTS)), answers.simulated
