"""Answers as lines for a terminal of 80 columns."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_sweep.answers.advice import MODELS, Again, advice, depth_text, mass_is_least, next_questions
from boulder_sweep.answers.recommendation import OF_A_DESIGN, PREFERENCES, RANKS, Design
from boulder_sweep.answers.search import ALWAYS, BLOCKED, FAULTY, NEVER, NOT_MONOTONE, UNKNOWN, WORDS
from boulder_sweep.columns import BY_NAME as COLUMNS
from boulder_sweep.columns import GRADES, WAY_OUT
from boulder_sweep.designs import SIDES
from boulder_sweep.judge.quantities import BACKFILLED, EXCAVATED
from boulder_sweep.judge.validity import NOT_A_RATING, flag_counts
from boulder_sweep.settings.fields import BOULDER_MASS, BY_NAME, EMBEDMENT
from boulder_sweep.settings.model import FOOT_WORDS
from boulder_sweep.settings.units import number_text, quantity_text, shown_unit
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.text import NO_BREAK_SPACE, counted

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.answers.keys import Key
    from boulder_sweep.answers.need import Need
    from boulder_sweep.answers.reserves import Reserves
    from boulder_sweep.answers.result import Result
    from boulder_sweep.answers.uncertainty import Uncertainty
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.model import Model

RATIO, DEPTH = EMBEDMENT
HEIGHT = SIDES[2]
WIDTH = 80
MOST_LINES = 40
"""Most rows of a table of designs."""
MOST_SHOWN = 16
"""Most rows of the table below a recommendation."""
HEADS = {
    "boulder_length_m": ("L", "m"),
    "boulder_width_m": ("W", "m"),
    "boulder_height_m": ("H", "m"),
    "boulder_density_kg_m3": ("rock", "kg/m³"),
    "boulder_mass_kg": ("boulder", "kg"),
    "embedment_depth_m": ("depth", "m"),
    "embedment_ratio": ("ratio", "d/H"),
    "impact_height_m": ("blow", "m"),
    "soil_density_kg_m3": ("soil", "kg/m³"),
    "friction_angle_deg": ("φ′", "deg"),
    "subgrade_reaction_MN_m3": ("β", "MN/m³"),
    "strain_rate_factor": ("K_ε", ""),
    "vehicle_mass_kg": ("truck", "kg"),
    "impact_speed_m_s": ("speed", "m/s"),
    "vehicle_spring_N_m": ("spring", "N/m"),
    "vehicle_damper_N_s_m": ("damper", "N s/m"),
    "bumper_height_m": ("bumper", "m"),
    "hood_height_m": ("hood", "m"),
    "bed_offset_m": ("bed", "m"),
}
"""Name and unit above the column of an input."""
NOTES = {
    "always": "≤, ≥: passes throughout the searched range, up to this end of it",
    "never": "never: passes nowhere in the searched range",
    "not_monotone": "*: {}; column passes_within (-o) lists all passing ranges",
    "blocked_by_overlap": "blocked: does not pass by what was asked, up to where the truck would pass or ride over the "
    "boulder",
    "undecided": "undecided: no value is known to pass, and the one tried last would if it were decided",
}
WITHOUT_MARGIN = "What each design just withstands, without a margin"
"""What the answers of `capacity` are."""
WITHSTOOD = {
    WORDS[ALWAYS]: "≥, ≤: passes throughout, up to the worst value tried",
    WORDS[NOT_MONOTONE]: "*: up to here everything passes; it passes again beyond values that fail, which counts for "
    "nothing (columns ..._passes_within, -o). never*: fails already at the mildest value tried",
    WORDS[NEVER]: "never: passes at no value tried",
    WORDS[BLOCKED]: "blocked: the truck would pass or ride over the boulder",
    WORDS[UNKNOWN]: NOTES["undecided"],
    WORDS[FAULTY]: "error: cannot be computed (column reason, -o)",
}
"""What the kinds of answers mean to a design that withstands something."""
MOST_IN_ALL = 1000
"""Most lines of a table of all answers."""
MARK = "→"
"""What stands before the boulder that is recommended."""
WRITTEN = "-o writes them all"
Row = Mapping[str, Any]
Cell = Callable[[Row], str]
Column = tuple[tuple[str, str], Cell]


class Screen(NamedTuple):
    """A table as the terminal, the page and the first sheet of a spreadsheet show it."""

    columns: list[Column]
    rows: Sequence[Row]
    part: str = ""
    """Which rows these are, where there are more."""
    signs: Sequence[str] = ()
    """What the signs of the answers mean."""
    has_each: bool = True
    """Whether a row shows every answer that it stands for."""

    def lines(self, rest: str) -> list[str]:
        """Return the table as lines, and where the rest is if there is more."""
        lines = table_lines(self.columns, self.rows)
        return [*lines, f"({self.part}; {rest})"] if self.part else lines


GRADE: Column = (("second", "opinion"), lambda row: row["robustness"] or "-")
"""Column of what second opinions say of a pass."""


def volume_columns(units: str) -> list[Column]:
    """Return the columns of the soil to excavate and to put back."""
    unit = "yd³" if units == "us" else "m³"
    return [
        (("dig", unit), lambda row: f"{row[EXCAVATED.name]:.1f}"),
        (("fill", unit), lambda row: f"{row[BACKFILLED.name]:.1f}"),
    ]


def volume_lines(heads: str) -> list[str]:
    """Return the legend of the columns of volumes if the heads of a table show them, else nothing."""
    return ["dig, fill: soil to excavate and to put back (docs/model.md)"] if "  dig  " in heads else []


def grade_lines(rows: Iterable[Row]) -> list[str]:
    """Return what the grades of rows mean, each meaning once, in the order of `GRADES`."""
    from boulder_sweep.judge.robustness import meaning_of

    occurring = {(row["robustness"], meaning_of(row)) for row in rows if row["robustness"]}
    ranked = sorted(occurring, key=lambda pair: (GRADES.index(pair[0]), pair[1]))
    return wrapped(f"{word}: {meaning}" for word, meaning in ranked)


def flag_lines(answers: Sequence[str]) -> list[str]:
    """Return what an answer is, and how many lie outside what the model was tested on, from their flags."""
    if not answers:
        return []
    flags = flag_counts(Counter(answers).items())
    named = ", ".join(f"{name} {flagged:,}" for name, flagged in flags.items() if name)
    inside = f"flags: {flags.get('', 0):,} of {counted(len(answers), 'answer')} inside what the model was tested on"
    return wrapped([f"an answer is {NOT_A_RATING}", f"{inside}{f'; {named}' if named else ''} (docs/confidence.md)"])


def foot_lines(model: Model, reasons: Iterable[str | None] = (), units: str = "si") -> list[str]:
    """Return on which foot boulders stand, and what `caution_lines` say."""
    return [*wrapped([FOOT_WORDS[model.foot]]), *caution_lines(model, reasons, units)]


def caution_lines(model: Model, reasons: Iterable[str | None] = (), units: str = "si") -> list[str]:
    """Return a line on the density of the rock if it is assumed, and one for each reason that has a remedy."""
    words = []
    if model.rock_assumed:
        words.append(f"rock: {quantity_text('kg/m^3', units, ROCK_KG_M3)} assumed (boulder.density); no pass is robust")
    occurring = set(reasons)
    for reason, remedy in WAY_OUT.items():
        if reason in occurring:
            words.append(f"{'fail' if reason == 'slower_truck' else 'undecided'} ({reason}): {remedy}")
    return wrapped(words)


def reasons_in(table: pa.Table) -> set[str | None]:
    """Return the reasons of rows, and of the designs drawn for their probabilities."""
    columns = [name for name in ("reason", "p_undecided_reason") if name in table.column_names]
    return {reason for name in columns for reason in table[name].unique().to_pylist()}


def robust_columns(table: pa.Table) -> list[Column]:
    """Return the columns of the chance of a robust pass and its interval, where second opinions were asked."""
    if "p_robust" not in table.column_names:
        return []
    return [
        (("P(robust)", ""), lambda row: f"{row['p_robust']:.4f}"),
        (("from", ""), lambda row: f"{row['p_robust_low']:.4f}"),
        (("to", ""), lambda row: f"{row['p_robust_high']:.4f}"),
    ]


def undecided_columns(table: pa.Table) -> list[Column]:
    """Return the column of the share of the designs drawn that is undecided, where some are."""
    if not any(table["p_undecided"].to_pylist()):
        return []
    return [(("not", "decided"), lambda row: "-" if row["p_undecided"] is None else f"{row['p_undecided']:.4f}")]


def undecided_lines(table: pa.Table) -> list[str]:
    """Return why designs that were drawn are undecided, and what that does to the probability of passing."""
    reasons = sorted({reason for reason in table["p_undecided_reason"].unique().to_pylist() if reason})
    words = f"not decided: undecided ({', '.join(reasons)}); if all of these passed, P(pass) would be larger by as much"
    return wrapped([words] if reasons else [])


def wrapped(texts: Iterable[str]) -> list[str]:
    """Return texts as lines of at most `WIDTH`."""
    lines = (line for text in texts for line in textwrap.wrap(text, WIDTH, subsequent_indent="  "))
    return [line.replace(NO_BREAK_SPACE, " ") for line in lines]


def _rows_screen(result: Result, columns: Sequence[Column], units: str, best: Sequence[int] = ()) -> Screen:
    """Return designs with their varying inputs and these columns: all, or evenly spaced ones, or the best of them."""
    count, of = len(result), "the best first" if best else "evenly spaced"
    indices: Sequence[int] = range(count)
    if count > MOST_LINES:
        indices = best[:MOST_LINES] or [k * (count - 1) // (MOST_LINES - 1) for k in range(MOST_LINES)]
    rows = rows_of(result.arrow.take(list(indices)), units)
    names = [name for name in HEADS if name in result.sweep.plan.given]
    part = f"{MOST_LINES} of {count:,} rows, {of}" if count > MOST_LINES else ""
    return Screen([*leading(result.sweep, result.arrow, names, units), *columns], rows, part)


def uncertainty_lines(result: Uncertainty, units: str = "si") -> list[str]:
    """Return probabilities as lines: varying inputs, verdict at the means, probability, most influential input.

    Parameters
    ----------
    result
        The probabilities.
    units
        ``si`` or ``us``.

    Returns
    -------
    list of str
        Header, one line for each row, and a legend.
    """
    lines = uncertainty_screen(result, units).lines(WRITTEN)
    return [*lines, *undecided_lines(result.arrow), *foot_lines(result.sweep.model, reasons_in(result.arrow), units)]


def uncertainty_screen(result: Uncertainty, units: str = "si") -> Screen:
    """Return the table of `uncertainty_lines`."""
    columns: list[Column] = [
        (("at the", "means"), lambda row: str(row["verdict"])),
        (("P(pass)", ""), lambda row: f"{row['p_pass']:.4f}"),
        (("from", ""), lambda row: f"{row['p_pass_low']:.4f}"),
        (("to", ""), lambda row: f"{row['p_pass_high']:.4f}"),
        *robust_columns(result.arrow),
        *undecided_columns(result.arrow),
        (("decided", "by"), lambda row: row["p_pass_driver"] or "-"),
        (("designs", "drawn"), lambda row: f"{row['p_pass_designs']:,}"),
    ]
    return _rows_screen(result, columns, units)


def reserve_lines(result: Reserves, units: str = "si") -> list[str]:
    """Return what designs withstand as lines: varying inputs, verdict, each value and its distance from the design.

    It takes the same parameters as `uncertainty_lines`.
    """
    screen = reserve_screen(result, units)
    lines = screen.lines(WRITTEN)
    lines += [*volume_lines(lines[0]), *wrapped(screen.signs)]
    lines += [*grade_lines(screen.rows), *foot_lines(result.sweep.model, reasons_in(result.arrow), units)]
    return [*wrapped([f"{WITHOUT_MARGIN} (need --most speed has one):"]), *lines]


def reserve_screen(result: Reserves, units: str = "si", recommended: Sequence[int] = ()) -> Screen:
    """Return the table of `reserve_lines`; rows that are recommended are marked.

    Of more than fit, they come first, then the ones that pass, the robust before others.
    """
    from boulder_sweep.answers.reserves import RESERVES

    rows = zip(*(result.arrow[name].to_pylist() for name in ("design_id", "verdict", "robustness")), strict=True)
    order = sorted((row not in recommended, verdict != "pass", RANKS[grade], row) for row, verdict, grade in rows)
    columns: list[Column] = [(("verdict", ""), lambda row: str(row["verdict"])), GRADE]
    for key, column, word, _ in RESERVES:
        columns.append((head_of(key.name, units), _format_withstood(key, column, f"{word}_found", units)))
    columns.append((("class,", "simulated"), lambda row: row["simulated_class"] or row["simulated_iso_speed"] or "-"))
    screen = _rows_screen(result, [*columns, *volume_columns(units)], units, [row for *_, row in order])
    if recommended:
        mark: Column = ("", ""), lambda row: MARK if row["design_id"] in recommended else ""
        screen = screen._replace(columns=[mark, *screen.columns])
    kinds = {row[f"{reserve.word}_found"] for row in screen.rows for reserve in RESERVES}
    return screen._replace(signs=[words for kind, words in WITHSTOOD.items() if kind in kinds])


def _format_withstood(key: Key, column: str, found: str, units: str) -> Cell:
    """Return a formatter for a withstood value and its distance from the value of the design."""
    answer = answer_cell(key, column, found, units)

    def cell(row: Row) -> str:
        away = "" if row[column] is None else f" ({row[column] / row[key.name] - 1.0:+.0%})" if row[key.name] else ""
        return f"{answer(row)}{away}"

    return cell


def withstood(result: Reserves, number: int, units: str = "si", where: str = "It") -> str:
    """Return what the design of a row withstands, as a sentence that begins with these words."""
    from boulder_sweep.answers.reserves import RESERVES

    row, said = rows_of(result.arrow.slice(number, 1), units)[0], list[str]()
    for (key, column, word, _), what in zip(RESERVES, ("speed", "truck", "friction angle"), strict=True):
        if row[column] is None:
            said.append(f"no {what} that was tried")
            continue
        answer = answer_cell(key, column, f"{word}_found", units)(row).strip("≤≥*")
        answer = answer if "." in answer else f"{int(answer):,}"
        to = "less" if key.most else "more"
        left = f" ({'more' if key.most else 'less'} was not tried)" * (row[f"{word}_found"] == WORDS[ALWAYS])
        said.append(f"a {what} of {answer} {head_of(key.name, units)[1]} or {to}{left}".replace(" deg", "°"))
    return f"{where} withstands {', '.join(said[:-1])} and {said[-1]}, each alone and without a margin."


def answer_cell(key: Key, column: str, found: str, units: str) -> Cell:
    """Return a formatter for an answer to a question, from the columns of its value and of what was found."""
    size = 1.0 if units == "si" else shown_unit(key.field.unit, units).size
    decimals = max(0, -math.floor(math.log10(key.step / size) + 1e-9))

    def cell(row: Row) -> str:
        kind = row[found]
        star = "*" if kind == WORDS[NOT_MONOTONE] else ""
        if row[column] is None:
            return "blocked" if kind == WORDS[BLOCKED] else f"{'never' if star else kind}{star}"
        before = {WORDS[ALWAYS]: "≥" if key.most else "≤"}.get(kind, "")
        text = depth_text(row[column]) if key.name == DEPTH else f"{row[column]:.{decimals}f}"
        return f"{before}{text}{star}"

    return cell


def head_of(name: str, units: str) -> tuple[str, str]:
    """Return name and unit over the column of an input."""
    word, unit = HEADS[name]
    if units == "si" or name not in COLUMNS:
        return word, unit
    return word, shown_unit(COLUMNS[name].unit, units).unit


def rows_of(table: pa.Table, units: str) -> list[Row]:
    """Return all rows of a table in some units."""
    rows = table.to_pylist()
    if units == "si":
        return rows
    named = ((field.name, (field.metadata or {}).get(b"unit", b"").decode()) for field in table.schema)
    sizes = {name: shown_unit(unit, units).size for name, unit in named}
    return [{n: value / sizes[n] if isinstance(value, float) else value for n, value in row.items()} for row in rows]


def table_lines(columns: Sequence[Column], rows: Sequence[Row], most: float = WIDTH) -> list[str]:
    """Return a table as lines of at most so many signs; the last columns are left out if they do not fit."""
    texts = [[*head, *(cell(row) for row in rows)] for head, cell in columns]
    widths = [max(map(len, column)) for column in texts]
    while len(widths) > 1 and sum(widths) + 2 * (len(widths) - 1) > most:
        texts.pop()
        widths.pop()
    lines = table_texts(texts)
    return [line.rstrip() for line in (*lines[:2], "  ".join("─" * width for width in widths), *lines[2:])]


def table_texts(columns: Sequence[Sequence[str]]) -> list[str]:
    """Return columns of texts side by side as lines."""
    widths = [max(map(len, column)) for column in columns]
    return ["  ".join(map(str.rjust, line, widths)) for line in zip(*columns, strict=True)]


def leading(sweep: Sweep, table: pa.Table, names: Sequence[str], units: str) -> list[Column]:
    """Return the columns that tell rows apart: names of sets, and inputs that vary; the numbers of listed designs."""
    labels: list[Column] = [((name, ""), word_of(name)) for name in sweep.plan.labels if name in table.column_names]
    if sweep.table is not None:
        return [*labels, (("design", ""), lambda row: str(row["design_id"]))]
    return labels + [(head_of(name, units), number_of(name, units)) for name in names if varies(sweep, table, name)]


def word_of(name: str) -> Cell:
    """Return a formatter for a column of words."""
    return lambda row: str(row[name])


def varies(sweep: Sweep, table: pa.Table, name: str) -> bool:
    """Whether an input differs between rows; a table holds depths, also where the file gives ratios."""
    if name == "embedment_ratio":
        given = sweep.plan.given.get(name)
        return given is not None and bool(given.values.min() < given.values.max())
    return name in table.column_names and len(set(table[name].to_pylist())) > 1


def number_of(name: str, units: str) -> Cell:
    """Return a formatter for an input in these units."""
    if name == "embedment_ratio":
        return lambda row: f"{row['embedment_depth_m'] / row['boulder_height_m']:.5g}"
    return lambda row: number_text(row[name], units)


def need_lines(
    need: Need, units: str = "si", again: Again | None = None, *, table: bool = False, notes: bool = False
) -> list[str]:
    """Return the answers as lines: the design to build, a table of at most a screen, and what is odd about it.

    Parameters
    ----------
    need
        The answers.
    units
        ``si`` or ``us``.
    again
        How the command line asked, for the commands that ask further; none otherwise.
    table
        Whether the table has every answer, with all its columns; else it has one line for each boulder, with a column
        for each soil and vehicle if they fit.
    notes
        Whether it is said what words and columns mean, and what the model leaves out.

    Returns
    -------
    list of str
        Lines of 80 columns, but for commands. Columns that do not fit are left out, the least important first.
    """
    lines = wrapped(advice(need, units) or [title(need)])
    if again is not None:
        for words, command in next_questions(need, again, units):
            lines += [f"next, {words}:", f"  {command}"]
    shown = _every_answer(need, units) if table else screen_lines(need, units)
    lines += ["", *shown]
    remarks = [*yard_lines(need), *_errors(need)]
    remarks += [] if notes else [line for line in _legend(need) if line[0] in {*"≤*"} & {*"".join(shown)}]
    remarks += undecided_lines(need.arrow) if need.probability is not None else []
    nearest = need.recommendation.nearest if need.recommendation else None
    reasons = reasons_in(need.arrow) | {row["reason"] for row in (nearest.rows if nearest else ())}
    remarks += caution_lines(need.sweep.model, reasons, units)
    if notes:
        remarks += [*volume_lines("\n".join(shown)), *_legend(need), *_grades(need), *_outside(need)]
        remarks.append(FOOT_WORDS[need.sweep.model.foot])
    shown_too = {"--table": table, "--notes": notes}
    given = [(option,) for option, is_given in shown_too.items() if is_given]
    if len(need) <= MOST_SHOWN and shown == _every_answer(need, units):
        shown_too["--table"] = True  # it would show the same
    left = () if again is None else [again.asking(*given, (option,)) for option, has in shown_too.items() if not has]
    more = ["More:", *(f"  {command}" for command in left)] if left else []
    return [*lines, *wrapped(remarks), *more]


def title(need: Need) -> str:
    """Return what is asked, where no design is named."""
    key, chance = need.key, need.probability
    asked = "" if chance is None else f" with a probability of {100.0 * chance:.4g} %"
    asked += f"{' and' if asked else ' with'} {100.0 * need.least_margin:.4g} % to spare" if need.least_margin else ""
    asked += f", {MODELS}" if need.robust else ""
    return f"The {'largest' if key.most else 'least'} {key.field.path} that passes{asked}:"


def _shown_part(need: Need) -> pa.Table:
    """Return the columns that lines are made of: rows of all would take longer to make than to search."""
    needed = {*HEADS, *need.sweep.plan.labels, "design_id", "boulder_mass_kg", "passes_at", "robustness"}
    needed |= {"margin", "p_pass", "p_robust", "p_undecided", "p_undecided_reason", EXCAVATED.name, BACKFILLED.name}
    needed |= {need.key.answer, "found"}
    return need.arrow.select([name for name in need.arrow.column_names if name in needed])


def _every_answer(need: Need, units: str) -> list[str]:
    """Return a table with a line for each answer."""
    rows = rows_of(_shown_part(need), units)
    best = need.recommendation  # whose boulder is told by its sides unless one of them is asked for
    is_marked = best is not None and best.design is not None and best.boulders > 1 and need.key.name in EMBEDMENT
    mark = [_marker(need, units)] if is_marked else []
    lines = table_lines([*mark, *_need_columns(need, units)], rows[:MOST_IN_ALL])
    if len(rows) > MOST_IN_ALL:
        lines.append(f"(the first {MOST_IN_ALL:,} of {len(rows):,} answers; -o writes them all)")
    return lines


def screen_lines(need: Need, units: str = "si") -> list[str]:
    """Return `need_screen` as lines."""
    return need_screen(need, units).lines("--table has all answers")


def need_screen(need: Need, units: str = "si", most: int = MOST_SHOWN) -> Screen:
    """Return a table of at most so many lines, one for each boulder, or else for each answer.

    Of more than fit, those come first that pass under the most conditions, and of these the ones that are preferred.
    """
    found, rows = need.recommendation, rows_of(_shown_part(need), units)
    shown = Screen(_need_columns(need, units), rows)
    if found is not None and found.conditions > 1 and need.sweep.table is None and not need.seeks_depth:
        shown = _by_boulder(need, rows, units)
    lines, count = [*shown.rows], len(shown.rows)
    if is_yard(need):
        lines.sort(key=lambda row: (row["passes_at"] is None, row["passes_at"]))
    elif count > most and found is not None:
        least = PREFERENCES[found.prefer]
        lines.sort(key=lambda row: (row.get("failing", row["passes_at"] is None), row[least]))
    part = _part(need, lines, most) if count > most else ""
    columns = [*([_marker(need, units)] if count > 1 else []), *shown.columns]
    return Screen(columns, lines[:most], part, [*_legend(need), *_errors(need)], shown.has_each)


def _part(need: Need, rows: Sequence[Row], most: int) -> str:
    """Return which rows a table shows of more, and how many of the others have an answer."""
    count, n = len(rows), sum(not row.get("failing", row["passes_at"] is None) for row in rows)
    order = "the shallowest" if is_yard(need) else "the best" if need.recommendation else ""
    if not n or not order:
        return f"{most} of {count:,}"
    if n == count:
        return f"{most} of {count:,}, {order} first"
    left = f"of the {count - most:,} left out, {n - most:,} have one" if n > most else "those left out have none"
    return f"{most} of {count:,}, {order} of the {n:,} with an answer first; {left}"


def is_yard(need: Need) -> bool:
    """Return whether the depths of listed boulders as weighed are asked for."""
    return need.sweep.table is not None and BOULDER_MASS.name in need.sweep.table.columns and need.key.name == DEPTH


def yard_lines(need: Need) -> list[str]:
    """Return which boulders of a yard serve at the site, the shallowest first; none of other questions."""
    if not is_yard(need) or len(need) == 1:
        return []
    rows = _shown_part(need).to_pylist()
    serve = sorted((row for row in rows if row["passes_at"] is not None), key=lambda row: row["passes_at"])
    names = [" ".join(str(row[name]) for name in need.sweep.plan.labels or ("design_id",)) for row in serve]
    more = "" if len(names) <= MOST_SHOWN else f" and {len(names) - MOST_SHOWN} more"
    some = f": {', '.join(names[:MOST_SHOWN])}{more}" if names else ""
    does = "serves" if len(serve) == 1 else "serve"
    return [f"{len(serve)} of the {counted(len(rows), 'boulder')} {does} at this site{some}"]


def _errors(need: Need) -> list[str]:
    """Return which rows cannot be computed, and why; of many the first."""
    rows = [row for row in need.arrow.to_pylist() if row["found"] == WORDS[FAULTY]] if need.errors else []
    names = need.sweep.plan.labels or ("design_id",)
    return [f"error: {' '.join(str(row[name]) for name in names)}: {row['reason']}" for row in rows[:MOST_SHOWN]]


def _by_boulder(need: Need, rows: Sequence[Row], units: str) -> Screen:
    """Return a line for each boulder, with columns: the value that all its rows need, and each row's if they fit.

    Whoever builds chooses the boulder and its embedment; the other inputs are conditions.
    """
    key = need.key
    names = [name for name in HEADS if name not in (key.name, *need.derived, BOULDER_MASS.name)]
    names = [name for name in names if varies(need.sweep, need.arrow, name)]
    chosen = [name for name in names if name in OF_A_DESIGN]
    ratio = number_of(RATIO, "si")  # no column of the table
    grouped: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        grouped.setdefault(tuple(ratio(row) if name == RATIO else row[name] for name in chosen), []).append(row)
    boulders: list[Row] = []
    for some in grouped.values():
        failing = sum(row["passes_at"] is None for row in some)
        boulders.append({**max(some, key=lambda row: row["passes_at"] or 0.0), "rows": some, "failing": failing})
    answer = answer_cell(key, key.answer, "found", units)
    edge = [(head_of(name, units), number_of(name, units)) for name in chosen]
    edge += [] if key.name.startswith("boulder_") else [_mass(need, units)]
    count, unit = len(boulders[0]["rows"]), head_of(key.name, units)[1]
    edge.append((("all", unit), lambda row: "-" if row["failing"] else answer(row)))
    wide = _across(need, names, boulders[0]["rows"], answer, unit, units)
    if len(table_lines([*edge, *wide], boulders, math.inf)[2]) <= WIDTH:
        return Screen([*edge, *wide], boulders)
    passes: Column = (("passes", f"in, of {count}"), lambda row: str(count - row["failing"]))
    return Screen([*edge, passes], boulders, has_each=False)


def _across(need: Need, names: Sequence[str], rows: Sequence[Row], cell: Cell, unit: str, units: str) -> list[Column]:
    """Return a column for each row of a boulder, headed by what differs of its soil and vehicle, and its own unit."""
    labels, given = need.sweep.plan.labels, need.sweep.plan.given
    different = [name for name in labels if len({row[name] for row in rows}) > 1]
    above: list[Column] = [(("", ""), word_of(name)) for name in different]
    for name in names:
        if name not in OF_A_DESIGN and not (BY_NAME[name].section in labels and name in given):
            above.append((head_of(name, units), number_of(name, units)))
    wide: list[Column] = []
    for number, row in enumerate(rows):
        words = [f"{name} {text(row)}{'°' * (of == 'deg')}".strip() for (name, of), text in above]
        if len(words) == 1 and above[0][0][1] not in ("", "deg"):
            words[0] += f" {above[0][0][1]}"
        head = words[0] if words else "", ", ".join(words[1:]) or unit
        wide.append((head, _in_row(number, cell)))
    return wide


def designs_screen(need: Need, units: str = "si") -> Screen:
    """Return the designs that the recommendation of a run names, or the nearest: least margin, then each soil's."""
    import pyarrow as pa

    found, named = need.recommendation, list[Design]()
    if found is not None and found.design is not None:
        named = [found.design, *found.others.values()]
    elif found is not None and found.nearest is not None:
        named = [Design(found.nearest.rows)]
    boulders: list[Row] = []
    for design in {tuple(one.sizes.values()): one for one in named}.values():
        rows = [_in_units(row, units) for row in design.rows]
        worst = min(rows, key=lambda row: -1.0 if row["margin"] is None else row["margin"])
        most = {spec.name: max(row[spec.name] for row in rows) for spec in (EXCAVATED, BACKFILLED)}
        boulders.append({**worst, **most, "robustness": design.grade, "rows": rows})
    if found is None or not boulders:
        return Screen([], [])
    columns: list[Column] = [(("", ""), lambda row: MARK if found.design and row is boulders[0] else "")]
    columns += [(("design", ""), word_of("design_id"))] if need.sweep.table is not None else []
    columns += [(head_of(name, units), number_of(name, units)) for name in SIDES]
    columns += [(head_of(DEPTH, units), _length(DEPTH)), _mass(need, units), (("least", "margin"), _margin), GRADE]
    columns += volume_columns(units)
    first = boulders[0]["rows"]
    table = pa.Table.from_pylist(first)
    names = [name for name in HEADS if varies(need.sweep, table, name)]
    if need.sweep.table is None and 1 < len(first) <= MOST_SHOWN:
        columns += _across(need, names, first, _margin, "", units)
    return Screen(columns, boulders)


def cases_screen(design: Design, names: Sequence[str], units: str = "si") -> Screen:
    """Return a design in all its soils and before all its vehicles; the names are what tells these apart."""
    count, table = len(design.rows), [_in_units(row, units) for row in design.rows[:MOST_LINES]]
    columns: list[Column] = [
        (head_of(name, units), number_of(name, units)) if name in HEADS else ((name, ""), word_of(name))
        for name in names
    ]
    columns += [(("rotation", "deg"), _rotation), (("penetration", shown_unit("m", units).unit), _penetration)]
    if "p_pass" in table[0]:
        columns.append((("P(pass)", ""), lambda row: f"{row['p_pass']:.4f}"))
    else:
        columns += [(("margin", ""), _margin), (GRADE[0], lambda row: row["robustness"] or row["reason"] or "-")]
    return Screen(columns, table, f"the first {MOST_LINES} of {count:,} cases" if count > MOST_LINES else "")


def _rotation(row: Row) -> str:
    return "-" if row["max_rotation_deg"] is None else f"{row['max_rotation_deg']:.1f}"


def _penetration(row: Row) -> str:
    value = row["penetration_m"]
    return "-" if value is None else "none" if value <= 0.0 else f"{value:.2f}"


def _in_units(row: Row, units: str) -> Row:
    """Return a row of a run in some units."""
    sizes = {name: shown_unit(COLUMNS[name].unit, units).size for name in row if name in COLUMNS}
    return {name: value / sizes.get(name, 1.0) if isinstance(value, float) else value for name, value in row.items()}


def _in_row(number: int, cell: Cell) -> Cell:
    """Return a formatter of one of the rows of a boulder."""
    return lambda row: cell(row["rows"][number])


def _marker(need: Need, units: str) -> Column:
    """Return the column that marks the boulder of the recommendation."""
    found, metre = need.recommendation, shown_unit("m", units).size
    design = None if found is None else found.design
    sizes = {} if design is None else {n: design.sizes[n] / metre for n in SIDES if n != need.key.name}
    return ("", ""), lambda row: MARK if sizes and all(row[name] == size for name, size in sizes.items()) else ""


def _legend(need: Need) -> list[str]:
    """Return what the words of the answers mean, and how many rows have each."""
    counts = need.counts()
    smaller = "smaller" if need.key.most else "greater"
    steady = f"passes here and at all {smaller} values, and in other places between values that fail"
    broken = f"{steady} (never*: there alone)" if need.key.is_steady else "fails again further on"
    return [f"{note.format(broken)} ({counted(counts[word], 'row')})" for word, note in NOTES.items() if word in counts]


def _grades(need: Need) -> list[str]:
    """Return how many answers have each grade, where not every one has a line, and what these mean."""
    rows = need.arrow.filter(need.arrow["passes_at"].is_valid()).to_pylist()
    grades = [row["robustness"] for row in rows]
    counts = {grade: grades.count(grade) for grade in GRADES if grade in grades}
    listed = ", ".join(f"{count:,} {grade}" for grade, count in counts.items())
    return [*([f"second opinion: {listed}"] if len(need) > MOST_LINES and listed else []), *grade_lines(rows)]


def _outside(need: Need) -> list[str]:
    """Return what a pass is, and how many answers lie outside what the model was tested on."""
    return flag_lines(need.arrow.filter(need.arrow["passes_at"].is_valid())["validity"].to_pylist())


def _need_columns(need: Need, units: str) -> list[Column]:
    """Return the columns of a terminal table: varying inputs, the answer, and what follows from it."""
    key = need.key
    unit = key.field.unit if units == "si" else shown_unit(key.field.unit, units).unit
    hidden = (key.name, *need.derived, BOULDER_MASS.name)  # the mass has a column of its own
    columns = leading(need.sweep, need.arrow, [name for name in HEADS if name not in hidden], units)
    columns.append((head_of(key.name, units), answer_cell(key, key.answer, "found", units)))
    if need.seeks_depth:
        columns.append((head_of(DEPTH, units), _where_it_passes(_length(DEPTH))))
    if key.name == DEPTH:
        columns.append((("ratio", "d/H"), _where_it_passes(lambda row: f"{row[DEPTH] / row[HEIGHT]:.3f}")))
        columns.append((("above", unit), _where_it_passes(lambda row: f"{row[HEIGHT] - row[DEPTH]:.2f}")))
    columns.append(_mass(need, units))
    if "p_pass" in need.arrow.column_names:
        columns.append((("P(pass)", ""), _chance("p_pass")))
        if need.robust:
            columns.append((("P(robust)", ""), _chance("p_robust")))
        columns += undecided_columns(need.arrow)
    else:
        columns.append((("margin", ""), _where_it_passes(_margin)))
        columns.append((GRADE[0], lambda row: (row["passes_at"] and row["robustness"]) or "-"))
    return [*columns, *((head, _where_it_passes(cell)) for head, cell in volume_columns(units))]


def _where_it_passes(cell: Cell) -> Cell:
    """Return a formatter that leaves a cell empty where nothing passes."""
    return lambda row: "" if row["passes_at"] is None else cell(row)


def _length(name: str) -> Cell:
    """Return a formatter for a side of the boulder or its depth."""
    return lambda row: depth_text(row[name]) if name == DEPTH else f"{row[name]:.3f}"


def _chance(name: str) -> Cell:
    """Return a formatter for a probability at the answer."""
    return lambda row: "" if row[name] is None else f"{row[name]:.3f}"


def _margin(row: Row) -> str:
    return "" if row["margin"] is None else f"{row['margin']:.1%}"


def _mass(need: Need, units: str) -> Column:
    """Return the column of the mass of the boulder: tonnes, or pounds, with a sign where it is no less."""
    least = "≥ " * mass_is_least(need.sweep)
    if units == "us":
        return ("mass", f"{least}lb"), lambda row: f"{row['boulder_mass_kg']:.0f}"
    return ("mass", f"{least}t"), lambda row: f"{row['boulder_mass_kg'] / 1000:.1f}"
