"""Answers of ``sweep need`` as lines for a terminal of 80 columns: a table, or many of them boulder by soil."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING

from boulder_sweep.answers.keys import BOULDER_MASS, sweep_ranges
from boulder_sweep.answers.lightest import DEPTH, HEIGHT, RATIO, SIDES
from boulder_sweep.answers.printing import (
    GRADE,
    HEADS,
    MOST_LINES,
    WIDTH,
    Cell,
    Column,
    Row,
    answer_cell,
    flag_lines,
    foot_lines,
    grade_lines,
    head_of,
    leading,
    number_of,
    reasons_in,
    rows_of,
    table_lines,
    table_texts,
    undecided_columns,
    undecided_lines,
    varies,
    volume_columns,
    volume_lines,
    word_of,
    wrapped,
)
from boulder_sweep.columns import GRADES
from boulder_sweep.judge.quantities import BACKFILLED, EXCAVATED
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.shown_units import shown_unit
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.answers.need import Need

MOST_IN_ALL = 1000
"""Most lines of tables; of more, whole tables are left out."""
SOIL = "soil"
NEAR_M = 1.5e-3
"""How near to an end of a range a side or depth is at it: both are whole millimetres [m]."""
NOTES = {
    "always": "≤, ≥: passes throughout the searched range, up to this end of it",
    "never": "never: passes nowhere in the searched range",
    "not_monotone": "*: {}; column passes_within (-o) lists all passing ranges",
    "blocked_by_overlap": "blocked: does not pass up to where the truck would pass or ride over the boulder",
    "undecided": "undecided: no value is known to pass, and the one tried last would if it were decided",
}


def need_lines(need: Need, units: str = "si", file: str = "GRID.yaml") -> list[str]:
    """Return the answers as lines.

    Parameters
    ----------
    need
        The answers.
    units
        ``si`` or ``us``.
    file
        The settings file, for the command that asks further.

    Returns
    -------
    list of str
        Header, one line for each row, or tables with a line for each boulder and a column for each soil; then a
        legend, how often nothing passes, and the flags of what passes. Columns that do not fit are left out, the least
        important first.
    """
    rows = rows_of(_shown_part(need), units)
    by_soil = _by_soil(need, rows, units) if len(rows) > MOST_LINES else []
    tables = by_soil or [table_lines(_need_columns(need, units), rows[:MOST_IN_ALL])]
    kept = tables[: max(1, MOST_IN_ALL // len(tables[0]))]
    lines = [line for k, table in enumerate(kept) for line in ([""] * (k > 0) + table)]
    if len(kept) < len(tables):
        lines.append(f"(the first {len(kept)} of {len(tables)} tables; -o writes all {len(rows):,} rows)")
    elif not by_soil and len(rows) > MOST_IN_ALL:
        lines.append(f"(the first {MOST_IN_ALL:,} of {len(rows):,} rows; -o writes them all)")
    remarks = [*volume_lines(tables[0][0]), *_legend(need, file), *_grades(need), *_outside(need)]
    if need.probability is not None:
        remarks += undecided_lines(need.arrow)
    remarks += foot_lines(need.sweep.model, reasons_in(need.arrow), units)
    if need.key.name == BOULDER_MASS.name:
        remarks += _edges(need, units, file)
    return [*lines, *wrapped(remarks)]


def _shown_part(need: Need) -> pa.Table:
    """Return the columns that lines are made of: rows of all would take longer to make than to search."""
    needed = {*HEADS, *need.sweep.plan.labels, "design_id", "boulder_mass_kg", "passes_at", "robustness"}
    needed |= {"margin", "p_pass", "p_undecided", "p_undecided_reason", EXCAVATED.name, BACKFILLED.name}
    needed |= {need.key.answer, "found"}
    return need.arrow.select([name for name in need.arrow.column_names if name in needed])


def _by_soil(need: Need, rows: Sequence[Row], units: str) -> list[list[str]]:
    """Return tables with a line for each boulder and a column for each soil, as many columns as fit.

    None for the lightest boulder, which differs by soil, for a list of designs, or where no soil varies.
    """
    key, open_ = need.key, (need.key.name, *need.derived)
    names = [name for name in HEADS if name not in (*open_, BOULDER_MASS.name) and varies(need.sweep, need.arrow, name)]
    labels = [name for name in need.sweep.plan.labels if name in need.arrow.column_names]
    soils = [((name, ""), word_of(name)) for name in labels if name == SOIL]
    soils += [(head_of(name, units), number_of(name, units)) for name in names if BY_NAME[name].section == SOIL]
    if not soils or need.sweep.table is not None or key.name == BOULDER_MASS.name:
        return []
    others = [((name, ""), word_of(name)) for name in labels if name != SOIL]
    others += [(head_of(name, units), number_of(name, units)) for name in names if BY_NAME[name].section != SOIL]
    others += [] if key.name.startswith("boulder_") else [_mass(units)]
    answer = answer_cell(key, key.answer, "found", units)
    answers: dict[tuple[str, ...], dict[tuple[str, ...], str]] = {}
    for row in rows:
        by_soil = answers.setdefault(tuple(cell(row) for _, cell in others), {})
        by_soil[tuple(cell(row) for _, cell in soils)] = answer(row)
    heads = list(dict.fromkeys(soil for by_soil in answers.values() for soil in by_soil))
    titles = [" ".join(head).strip() for head, _ in soils]
    edge = [[*head, *texts] for (head, _), texts in zip(others, zip(*answers, strict=True), strict=True)]
    left = table_texts(edge) if edge else ["", "", *[""] * len(answers)]
    left = [text.rjust(max(len(left[0]), *map(len, titles))) for text in left]
    columns = [[*soil, "", "", *(by_soil.get(soil, "") for by_soil in answers.values())] for soil in heads]
    each = max(len(text) for column in columns for text in column) + 2
    most = max(1, (WIDTH - len(left[0])) // each)
    word, unit = head_of(key.name, units)
    title = f"{'largest' if key.most else 'least'} {word}{f' [{unit}]' if unit else ''} by boulder and soil"
    tables = []
    for start in range(0, len(columns), most):
        part = columns[start : start + most]
        lines = [title.rjust(len(left[0]))] * (start == 0)
        for k, edge_text in enumerate([*(text.rjust(len(left[0])) for text in titles), *left]):
            lines.append((edge_text + "".join(column[k].rjust(each) for column in part)).rstrip())
            if k == len(titles) + 1:
                lines.append("─" * (len(left[0]) + each * len(part)))
        tables.append(lines)
    return tables


def _legend(need: Need, file: str) -> list[str]:
    """Return what the words of the answers mean, how many rows have each, and what to ask next."""
    counts = need.counts()
    smaller = "smaller" if need.key.most else "greater"
    steady = f"passes here and at all {smaller} values, and in other places between values that fail"
    broken = f"{steady} (never*: there alone)" if need.key.is_steady else "fails again further on"
    lines = [
        f"{note.format(broken)} ({counted(counts[word], 'row')})" for word, note in NOTES.items() if word in counts
    ]
    if "never" in counts or "blocked_by_overlap" in counts:
        if need.key.name == BOULDER_MASS.name:
            lines.append(f"next: wider ranges for the sides and the embedment in {file}")
        else:
            lines.append(f"next: another boulder: sweep need {shlex.quote(file)} --least mass")
    return lines


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


def _edges(need: Need, units: str, file: str) -> list[str]:
    """Return at which ends of the ranges in the file the lightest boulders lie."""
    passing = need.arrow.filter(need.arrow["passes_at"].is_valid())
    if not len(passing):
        return []
    value = {name: passing[name].to_numpy() for name in (*SIDES, DEPTH, "bumper_height_m")}
    bounds = sweep_ranges(need.sweep)
    unit, metre = shown_unit("m", units)
    distances = {}
    for name in (*SIDES, DEPTH, RATIO):
        low, high = bounds.get(name, (0.0, 0.0))
        for which, end in (("least", low), ("largest", high)) if low < high else ():
            if name == RATIO:
                distances[f"d/H is the {which}, {end:g}"] = value[DEPTH] - end * value[HEIGHT]
            else:
                distances[f"{HEADS[name][0]} is the {which}, {end / metre:.4g} {unit}"] = value[name] - end
    overlap = value[HEIGHT] - value["bumper_height_m"] - value[DEPTH]
    distances["the depth is the largest that overlaps the bumper enough"] = overlap - need.sweep.criterion.min_overlap_m
    counts = {words: int((abs(off) < NEAR_M).sum()) for words, off in distances.items()}
    ends = {words: count for words, count in counts.items() if count}
    if not ends:
        return ["edges: the lightest boulders lie within the ranges of the file, at no end of one"]
    listed = "; ".join(f"{words} ({count} of {len(passing)})" for words, count in ends.items())
    return [f"edges: {listed}. Wider ranges in {file} may hold a lighter boulder"]


def _need_columns(need: Need, units: str) -> list[Column]:
    """Return the columns of a terminal table: varying inputs, the answer, and what follows from it."""
    key = need.key
    unit = key.field.unit if units == "si" else shown_unit(key.field.unit, units).unit
    hidden = (key.name, *need.derived, BOULDER_MASS.name)  # the mass has a column of its own
    columns = leading(need.sweep, need.arrow, [name for name in HEADS if name not in hidden], units)
    if key.name == BOULDER_MASS.name:
        columns.append((("mass", unit), answer_cell(key, key.answer, "found", units)))
        columns += [(head_of(name, units), _where_it_passes(_length(name))) for name in (*SIDES, DEPTH)]
    else:
        columns.append((head_of(key.name, units), answer_cell(key, key.answer, "found", units)))
        if key.name == DEPTH:
            columns.append((("ratio", "d/H"), _where_it_passes(lambda row: f"{row[DEPTH] / row[HEIGHT]:.3f}")))
            columns.append((("above", unit), _where_it_passes(lambda row: f"{row[HEIGHT] - row[DEPTH]:.2f}")))
        columns.append(_mass(units))
    if "p_pass" in need.arrow.column_names:
        columns.append((("P(pass)", ""), _chance))
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
    return lambda row: f"{row[name]:.3f}"


def _chance(row: Row) -> str:
    return "" if row["passes_at"] is None and not row["p_undecided"] else f"{row['p_pass']:.3f}"


def _margin(row: Row) -> str:
    return "" if row["margin"] is None else f"{row['margin']:.1%}"


def _mass(units: str) -> Column:
    """Return the column of the mass of the boulder: tonnes, or pounds."""
    if units == "us":
        return ("mass", "lb"), lambda row: f"{row['boulder_mass_kg']:.0f}"
    return ("mass", "t"), lambda row: f"{row['boulder_mass_kg'] / 1000:.1f}"
