"""Answers as lines for a terminal of 80 columns."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from boulder_sweep.answers.search import ALWAYS, BLOCKED, NEVER, NOT_MONOTONE, UNKNOWN, WORDS
from boulder_sweep.columns import BY_NAME as COLUMNS
from boulder_sweep.columns import GRADES, WAY_OUT
from boulder_sweep.judge.quantities import BACKFILLED, EXCAVATED
from boulder_sweep.judge.validity import NOT_A_RATING, flag_counts
from boulder_sweep.settings.model import FOOT_WORDS
from boulder_sweep.settings.shown_units import number_text, quantity_text, shown_unit
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.answers.keys import Key
    from boulder_sweep.answers.reserves import Reserves
    from boulder_sweep.answers.result import Result
    from boulder_sweep.answers.uncertainty import Uncertainty
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.model import Model

WIDTH = 80
MOST_LINES = 40
"""Most rows of a plain table; of longer ones evenly spaced rows are shown, or all boulder by soil."""
HEADS = {
    "boulder_length_m": ("L", "m"),
    "boulder_width_m": ("W", "m"),
    "boulder_height_m": ("H", "m"),
    "boulder_density_kg_m3": ("rock", "kg/m³"),
    "boulder_mass_kg": ("stone", "kg"),
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
    "vehicle_second_spring_N_m": ("spring 2", "N/m"),
    "vehicle_second_spring_from_m": ("beyond", "m"),
    "bumper_height_m": ("bumper", "m"),
    "hood_height_m": ("hood", "m"),
    "bed_offset_m": ("bed", "m"),
}
"""Name and unit above the column of an input."""
WITHSTOOD = {
    WORDS[ALWAYS]: "≥, ≤: passes throughout, up to the worst value tried",
    WORDS[NOT_MONOTONE]: "*: up to here everything passes; it passes again beyond values that fail, which counts for "
    "nothing (columns ..._passes_within, -o). never*: fails already at the mildest value tried",
    WORDS[NEVER]: "never: passes at no value tried",
    WORDS[BLOCKED]: "blocked: the truck would pass or ride over the boulder",
    WORDS[UNKNOWN]: "undecided: passes at no value tried; see the reason below",
}
"""What the kinds of answers mean to a design that withstands something."""
Row = Mapping[str, Any]
Cell = Callable[[Row], str]
Column = tuple[tuple[str, str], Cell]


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
    """Return what the columns of volumes are, where the heads of a table show that they fitted in."""
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
    return wrapped([f"an answer is {NOT_A_RATING}", f"{inside}{f'; {named}' if named else ''} (docs/validity.md)"])


def foot_lines(model: Model, reasons: Iterable[str | None] = (), units: str = "si") -> list[str]:
    """Return on which foot boulders stand, of what rock they are if that is assumed, and what to do about reasons."""
    words = [FOOT_WORDS[model.foot]]
    if model.rock_assumed:
        words.append(f"rock: {quantity_text('kg/m^3', units, ROCK_KG_M3)} assumed (boulder.density); no pass is robust")
    occurring = set(reasons)
    for reason, advice in WAY_OUT.items():
        if reason in occurring:
            words.append(f"{'fail' if reason == 'slower_truck' else 'undecided'} ({reason}): {advice}")
    return wrapped(words)


def reasons_in(table: pa.Table) -> set[str | None]:
    """Return the reasons of rows, and of the designs drawn for their probabilities."""
    columns = [name for name in ("reason", "p_undecided_reason") if name in table.column_names]
    return {reason for name in columns for reason in table[name].unique().to_pylist()}


def undecided_columns(table: pa.Table) -> list[Column]:
    """Return the column of the share of the designs drawn that is undecided, where some are."""
    if not any(table["p_undecided"].to_pylist()):
        return []
    return [(("not", "decided"), lambda row: f"{row['p_undecided']:.4f}")]


def undecided_lines(table: pa.Table) -> list[str]:
    """Return why designs that were drawn are undecided, and what that does to the probability of passing."""
    reasons = sorted({reason for reason in table["p_undecided_reason"].unique().to_pylist() if reason})
    words = f"not decided: undecided ({', '.join(reasons)}); if all of these passed, P(pass) would be larger by as much"
    return wrapped([words] if reasons else [])


def wrapped(texts: Iterable[str]) -> list[str]:
    """Return texts as lines of at most `WIDTH`."""
    return [line for text in texts for line in textwrap.wrap(text, WIDTH, subsequent_indent="  ")]


def _rows_lines(result: Result, columns: Sequence[Column], units: str) -> tuple[list[str], list[Row]]:
    """Return designs as lines, and those shown: their varying inputs and these columns, of all or evenly spaced ones.

    Columns that do not fit are left out, the least important first.
    """
    count = len(result)
    indices: Sequence[int] = range(count)
    if count > MOST_LINES:
        indices = [k * (count - 1) // (MOST_LINES - 1) for k in range(MOST_LINES)]
    rows = rows_of(result.arrow.take(list(indices)), units)
    names = [name for name in HEADS if name in result.sweep.plan.given]
    lines = table_lines([*leading(result.sweep, result.arrow, names, units), *columns], rows)
    if count > MOST_LINES:
        lines.append(f"({MOST_LINES} of {count:,} rows, evenly spaced; -o writes them all)")
    return lines, rows


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
    columns: list[Column] = [
        (("at the", "means"), lambda row: str(row["verdict"])),
        (("P(pass)", ""), lambda row: f"{row['p_pass']:.4f}"),
        (("from", ""), lambda row: f"{row['p_pass_low']:.4f}"),
        (("to", ""), lambda row: f"{row['p_pass_high']:.4f}"),
        *undecided_columns(result.arrow),
        (("decided", "by"), lambda row: row["p_pass_driver"] or "-"),
        (("designs", "drawn"), lambda row: f"{row['p_pass_designs']:,}"),
    ]
    lines, _ = _rows_lines(result, columns, units)
    return [*lines, *undecided_lines(result.arrow), *foot_lines(result.sweep.model, reasons_in(result.arrow), units)]


def reserve_lines(result: Reserves, units: str = "si") -> list[str]:
    """Return what designs withstand as lines: varying inputs, verdict, each value and its distance from the design.

    Parameters are those of `uncertainty_lines`.
    """
    from boulder_sweep.answers.reserves import RESERVES

    columns: list[Column] = [(("verdict", ""), lambda row: str(row["verdict"])), GRADE]
    for key, column, word, _ in RESERVES:
        columns.append((head_of(key.name, units), _format_withstood(key, column, f"{word}_found", units)))
    columns.append((("class,", "simulated"), lambda row: row["simulated_class"] or row["simulated_iso_speed"] or "-"))
    lines, rows = _rows_lines(result, [*columns, *volume_columns(units)], units)
    lines += volume_lines(lines[0])
    kinds = {row[f"{reserve.word}_found"] for row in rows for reserve in RESERVES}
    lines += wrapped(words for kind, words in WITHSTOOD.items() if kind in kinds)
    return [*lines, *grade_lines(rows), *foot_lines(result.sweep.model, reasons_in(result.arrow), units)]


def _format_withstood(key: Key, column: str, found: str, units: str) -> Cell:
    """Return a formatter for a withstood value and its distance from the value of the design."""
    answer = answer_cell(key, column, found, units)

    def cell(row: Row) -> str:
        away = "" if row[column] is None else f" ({row[column] / row[key.name] - 1.0:+.0%})" if row[key.name] else ""
        return f"{answer(row)}{away}"

    return cell


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
        return f"{before}{row[column]:.{decimals}f}{star}"

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


def table_lines(columns: Sequence[Column], rows: Sequence[Row]) -> list[str]:
    """Return a table as lines of at most `WIDTH`; columns that do not fit are left out, starting with the last."""
    texts = [[*head, *(cell(row) for row in rows)] for head, cell in columns]
    widths = [max(map(len, column)) for column in texts]
    while len(widths) > 1 and sum(widths) + 2 * (len(widths) - 1) > WIDTH:
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
