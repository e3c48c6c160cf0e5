"""A result as a table for colleagues: a spreadsheet, comma-separated values or Parquet, in SI or US units."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime
from functools import cache, lru_cache, partial
from io import BytesIO, TextIOWrapper
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from boulder_sweep.answers.advice import advice
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import CAPACITY, NEED, AnswerFile, kind_of, result_of
from boulder_sweep.answers.printing import MARK, WITHOUT_MARGIN, Screen, designs_screen, title, wrapped, yard_lines
from boulder_sweep.columns import BOULDER_MASS, BY_NAME, DESIGN_ID
from boulder_sweep.errors import ReportError
from boulder_sweep.judge.quantities import NEEDED, QUANTITIES, quantities_by
from boulder_sweep.locations import Location, location_of, replacing
from boulder_sweep.settings.sweep import SECTION, Heading, units_in
from boulder_sweep.settings.units import (
    ShownColumn,
    check_system,
    in_unit,
    shown_as,
    shown_column,
    shown_settings,
)
from boulder_sweep.store.folder import check_target
from boulder_sweep.store.reading import FinishedRows
from boulder_sweep.text import NO_BREAK_SPACE, install, printable, why
from boulder_sweep.views.wording import NOT_A_TEST

if TYPE_CHECKING:
    import pyarrow as pa

Exportable = FinishedRows | AnswerFile
Writer = Callable[[BinaryIO, Exportable, str], int]
KINDS = (".xlsx", ".csv", ".parquet")
MOST_SHEET_ROWS = 1_048_575
"""Most rows of a spreadsheet, without the header."""
PIECE = 10_000
"""Rows that become cells at once."""
LEAST_WIDTH, ABOUT_WIDTHS, ANSWER_WIDTH, LINE_POINTS = 14, (44, 12, 90), 80, 15
"""Widths of columns, in characters."""
CREATED = datetime(1980, 1, 1)
"""Date in every spreadsheet, so that the same rows give the same file."""
ANSWERS = ("least_", "most_", "found", "p_", "withstands_", "simulated_", "verdict", "reason", "margin", "robustness")
"""What names of columns begin with that are the answer, in the order in which a spreadsheet has them."""
FORMULA_SIGNS = ("=", "+", "-", "@", "\t", "\r")
"""First characters of text that a spreadsheet takes for a formula."""
RAW = ("{=", "<r>")
"""What XlsxWriter takes for an array formula, and for XML."""
_NUMBER = re.compile(r"-?[0-9][0-9,]*(?:\.([0-9]+))?(%?)", re.ASCII)


def export(out: str | Location, file: str | Path, *, units: str | None = None) -> int:
    """Write a result as one table.

    Parameters
    ----------
    out
        Folder that a sweep wrote, perhaps with a run still writing into it, or a file of `need`, `uncertainty`,
        `reserves` or of a time history.
    file
        The table: ``.xlsx``, with the answer on a sheet before it and units, settings and versions on one behind it,
        ``.csv`` or ``.parquet``.
    units
        ``si`` for the table as it is, ``us`` for US customary units, by default as in the settings file; column
        names end in the unit.

    Returns
    -------
    int
        Rows written.

    Raises
    ------
    ReportError
        The kind is unknown, the folder of the table does not exist or is the result of a run, a sheet cannot hold so
        many rows, the table cannot be written, or XlsxWriter, an extra, is not installed.
    StoreError
        There is no result in the folder, or it is damaged.
    ValueError
        The units are unknown.
    """
    if units is not None:
        check_system(units)
    target, location = Path(file), location_of(out)
    finished = result_of(location, ReportError, histories=True)
    units = units or units_in(finished.identity["settings"])
    kind = target.suffix.lower()
    if kind not in KINDS:
        raise ReportError(f"{file}: the name must end in {', '.join(KINDS[:-1])} or {KINDS[-1]}")
    check_target(target, ReportError)
    if kind == ".xlsx" and finished.rows_done > MOST_SHEET_ROWS:
        raise ReportError(
            f"a sheet holds {MOST_SHEET_ROWS:,} rows, not {finished.rows_done:,}: choose .csv or .parquet"
        )
    writers: dict[str, Writer] = {".xlsx": partial(_sheets, location), ".csv": _csv, ".parquet": _parquet}
    try:
        with replacing(target) as passing:
            return writers[kind](passing, finished, units)
    except OSError as problem:
        raise ReportError(f"{file} cannot be written: {why(problem)}") from problem


def about(finished: Exportable, columns: Iterable[ShownColumn], units: str = "si") -> Iterator[tuple[str, str, str]]:
    """Yield what a reader must know about a table, three texts for each line; settings in ``si`` or ``us`` units."""
    identity: Mapping[str, Any] = finished.identity
    answers = finished.answers() if isinstance(finished, AnswerFile) and finished.kind == NEED else None
    for line in advice(answers, units) if isinstance(answers, Need) else ():
        yield line, "", ""
    yield NOT_A_TEST, "ASTM F2656 rates barriers by crash test.", ""
    yield "rows", f"{finished.rows_done:,} of {finished.rows:,}", ""
    if finished.judged_by:
        yield "verdicts", finished.judged_by, ""
    for name, version in identity["versions"].items():
        yield f"version of {name}", version, ""
    yield "hash of the settings", identity["settings_sha256"], ""
    yield "hash of the kernels", identity["kernels_sha256"], ""
    yield "", "", ""
    yield "column", "unit", "meaning"
    for column in columns:
        yield column.name, column.unit, column.meaning
    yield "", "", ""
    yield "settings", "", ""
    for line in setting_lines(shown_settings(identity["settings"], units)):
        yield line, "", ""


def setting_lines(settings: Mapping[str, Any], indent: str = "") -> list[str]:
    """Return the settings as lines of text, one line for each list."""
    lines = []
    for name, value in settings.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{name}:", *setting_lines(value, f"{indent}  ")]
        elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            for number, one in enumerate(value, 1):
                lines += [f"{indent}{name} {number}:", *setting_lines(one, f"{indent}  ")]
        else:
            values = value if isinstance(value, list) else ["not given" if value is None else value]
            shown = ", ".join(f"{one:.12g}" if isinstance(one, float) else str(one) for one in values)
            lines.append(f"{indent}{name}: {shown}")
    return lines


def _tables(finished: Exportable, units: str) -> Iterator[tuple[list[ShownColumn], pa.Table]]:
    """Yield the rows piece by piece in the requested units."""
    import pyarrow as pa

    answers = finished.answers() if isinstance(finished, AnswerFile) and finished.kind == NEED else None
    for table in finished.tables():
        if isinstance(answers, Need):
            table = _without_tried(table, answers)
        if finished.judged_by:
            told = {
                "unit": "",
                "meaning": "by whose rules the verdict was found; a column of tables of other rules only",
            }
            whole = pa.array([finished.judged_by] * len(table))
            table = table.append_column(pa.field("judged_by", pa.string(), metadata=told), whole)
        table = _with_quantities(table, finished.identity["settings"])
        columns = [_shown(field, units) for field in table.schema]
        for index, column in enumerate(columns):
            if column.size != 1.0:
                values = in_unit(table.column(index).to_numpy(), column.size)
                table = table.set_column(index, column.name, pa.array(values, from_pandas=True))
        yield columns, table.rename_columns([column.name for column in columns])


def _without_tried(table: pa.Table, answers: Need) -> pa.Table:
    """Return answers; where there is none, without the value tried last and its outcome, unless that is an error."""
    import pyarrow.compute as pc

    names, key = table.column_names, answers.key.name
    tried = {key, *answers.derived, *names[names.index("passes_within") :]} - {*answers.sweep.plan.labels}
    tried -= set() if key.startswith("boulder_") else {BOULDER_MASS}
    passes = table["passes_at"].is_valid()
    told = pc.or_(passes, pc.equal(table["verdict"].cast("string"), "error"))  # why a row cannot be computed
    for name in tried & {*names}:
        index, where = names.index(name), told if name in ("verdict", "reason") else passes
        table = table.set_column(index, table.field(index), pc.if_else(where, table[name], None))
    return table


def _with_quantities(table: pa.Table, settings: Mapping[str, Any]) -> pa.Table:
    """Return a table of designs with what these take to build, as far as it has no such columns yet."""
    import pyarrow as pa

    if not set(table.column_names) >= {*NEEDED}:
        return table  # a time history
    names = (*NEEDED, *({BOULDER_MASS} & set(table.column_names)))
    quantities = quantities_by({name: table.column(name).to_numpy() for name in names}, settings)
    for spec in QUANTITIES:
        if spec.name not in table.column_names:
            field = pa.field(spec.name, pa.float64(), metadata={"unit": spec.unit, "meaning": spec.meaning})
            table = table.append_column(field, pa.array(quantities[spec.name], from_pandas=True))
    return table


def _shown(field: pa.Field, units: str) -> ShownColumn:
    """Return how a column is shown, by the register of columns or, of an answer, by its own metadata.

    Intervals are texts and stay in their unit. A mass is as weighed, or follows from the density.
    """
    if (field.name in BY_NAME and field.name != BOULDER_MASS) or not field.metadata:
        return shown_column(field.name, units)
    unit, meaning = (field.metadata.get(key, b"").decode() for key in (b"unit", b"meaning"))
    return shown_as(field.name, unit, meaning, units if str(field.type) == "double" else "si")


def _csv(target: BinaryIO, finished: Exportable, units: str) -> int:
    """Write comma-separated values; null is empty."""
    rows = 0
    file = TextIOWrapper(target, newline="", encoding="utf-8")
    writer = csv.writer(file)
    for columns, table in _tables(finished, units):
        if rows == 0:
            writer.writerow(_cells(column.name for column in columns))
        writer.writerows(_rows(table))
        rows += len(table)
    file.detach()
    return rows


def _rows(table: pa.Table) -> Iterator[tuple[Any, ...]]:
    """Yield the rows as cells; not all are in memory at once."""
    for first in range(0, len(table), PIECE):
        columns = table.slice(first, PIECE).columns
        yield from zip(*map(_values, columns), strict=True)


def _values(column: pa.ChunkedArray) -> list[Any]:
    """Return the cells of a column; what is no number is empty."""
    import pyarrow as pa

    if pa.types.is_floating(column.type):
        numbers = column.to_numpy()
        numbers = np.where(np.isfinite(numbers), numbers.astype(object), np.array(None))
        return list(numbers)
    if pa.types.is_dictionary(column.type):
        column = column.cast(pa.string())  # reading its words one by one takes 20 times as long
    return _cells(column.to_pylist())


def _cells(values: Iterable[Any]) -> list[Any]:
    """Return values fit for a spreadsheet: text like a formula is quoted, control characters are escaped."""
    return [_cell(value) if isinstance(value, str) else value for value in values]


@lru_cache(1000)
def _cell(text: str) -> str:
    shown = printable(text)
    first = unicodedata.normalize("NFKC", shown[:1])  # some programs take a full-width sign for the plain one
    return f"'{shown}" if first.startswith(FORMULA_SIGNS) or shown.startswith(RAW) else shown


def _parquet(target: BinaryIO, finished: Exportable, units: str) -> int:
    """Write one Parquet file with units and meanings in its field metadata, settings and versions in its own."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows, writer = 0, None
    try:
        for columns, table in _tables(finished, units):
            fields = [
                field.with_metadata({"unit": column.unit, "meaning": column.meaning})
                for field, column in zip(table.schema, columns, strict=True)
            ]
            schema = pa.schema(
                fields, {"about": "\n".join("\t".join(line) for line in about(finished, columns, units))}
            )
            writer = writer or pq.ParquetWriter(target, schema, compression="zstd")
            writer.write_table(table.cast(writer.schema))
            rows += len(table)
    finally:
        if writer is not None:
            writer.close()
    return rows


def _sheets(location: Location, target: BinaryIO, finished: Exportable, units: str) -> int:
    """Write a spreadsheet: the answer, the designs, and what a reader must know about them."""
    try:
        from xlsxwriter import Workbook
        from xlsxwriter.exceptions import FileCreateError
    except ImportError as lacking:
        raise ReportError(f"spreadsheets need XlsxWriter: {install('report')}") from lacking

    rows, columns, whole = 0, _ordered(finished, units), BytesIO()  # a ZipFile on a full disk ends with a traceback
    names = [column.name for column in columns]
    plain = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    with TemporaryDirectory() as place:  # the library leaves files behind where it fails
        book = Workbook(whole, {"constant_memory": True, "tmpdir": place, "use_zip64": True, **plain})
        book.set_properties({"created": CREATED})
        heading = finished.identity["settings"].get(SECTION, {})
        _write_answer(book, Heading(**heading).given(), *_answer(location, finished, units))
        designs = book.add_worksheet("designs")
        designs.freeze_panes(1, 1)
        designs.write_row(0, 0, _cells(names))
        for _, table in _tables(finished, units):
            for values in _rows(table.select(names)):
                rows += 1
                designs.write_row(rows, 0, values)
        for number, name in enumerate(names):  # widths that are known before make each cell slower
            designs.set_column(number, number, max(len(name) + 4, LEAST_WIDTH))
        if rows:
            designs.autofilter(0, 0, rows, len(names) - 1)
        sheet = book.add_worksheet("about")
        for number, width in enumerate(ABOUT_WIDTHS):
            sheet.set_column(number, number, width)
        for number, line in enumerate(about(finished, columns, units)):
            sheet.write_row(number, 0, _cells(line))
        try:
            book.close()
        except FileCreateError as problem:
            raise problem.args[0] from None
    target.write(whole.getbuffer())
    return rows


def _ordered(finished: Exportable, units: str) -> list[ShownColumn]:
    """Return the columns as a spreadsheet has them: number and answer first, what is the same in all rows last."""
    columns, held = list[ShownColumn](), dict[str, set[Any]]()
    for columns, table in _tables(finished, units):
        for column, values in zip(columns, table.columns, strict=True):
            some = held.setdefault(column.name, set())
            if len(some) < 2:
                some.update(values.unique()[:2].to_pylist())
    kind = kind_of(finished)

    def place(column: ShownColumn) -> int:
        if column.name == DESIGN_ID.name or not kind:
            return -1  # a time history stays as it is
        ranks = (rank for rank, begin in enumerate(ANSWERS) if column.name.startswith(begin))
        return next(ranks, len(ANSWERS) + (len(held[column.name]) < 2))

    return sorted(columns, key=place)


def _answer(location: Location, finished: Exportable, units: str) -> tuple[list[str], Screen]:
    """Return what the terminal says of answers, or the page of a run; nothing of a time history."""
    from boulder_sweep.report.answers import SCREENS, answer_of  # loads the kernels
    from boulder_sweep.report.rows import read_rows

    if isinstance(finished, AnswerFile):
        if not finished.kind:
            return [], Screen([], [])
        answers, said = finished.answers(), [WITHOUT_MARGIN] if finished.kind == CAPACITY else []
        if isinstance(answers, Need):
            said = [*(advice(answers, units) or [title(answers)]), *yard_lines(answers)]
        return said, SCREENS[finished.kind](answers, units)
    if not finished.rows_done:
        return ["No design is computed yet."], Screen([], [])

    answer = answer_of(read_rows(location, finished))
    counts = ["".join(map(str, sentence)) for sentence in answer.sentences]
    return [*advice(answer.need, units), *counts], designs_screen(answer.need, units)


def _write_answer(book: Any, heading: Mapping[str, str], sentences: list[str], shown: Screen) -> None:
    """Write the first sheet: for whom, a sentence to a cell, and a table with numbers as shown, one row in bold."""
    if not sentences and not shown.columns:
        return
    sheet = book.add_worksheet("answer")
    style = cache(lambda kind, bold: book.add_format({"num_format": kind, "bold": bold, "align": "right"}))
    lines = [*zip(*(head for head, _ in shown.columns), strict=True)]
    lines += [tuple(cell(row) for _, cell in shown.columns) for row in shown.rows]
    widths = [2 + max(map(len, texts)) for texts in zip(*lines, strict=True)]
    widths += [LEAST_WIDTH] * -((sum(widths) - ANSWER_WIDTH) // LEAST_WIDTH)
    for number, width in enumerate(widths):
        sheet.set_column(number, number, width)
    wraps = book.add_format({"text_wrap": True, "valign": "top"})
    texts = [*(f"{name.replace('checked_by', 'checker')}: {text}" for name, text in heading.items()), *sentences]
    for number, text in enumerate(_cells(text.replace(NO_BREAK_SPACE, " ") for text in texts)):
        sheet.set_row(number, LINE_POINTS * len(wrapped([text])))
        sheet.merge_range(number, 0, number, len(widths) - 1, text, wraps)
    top = len(texts) + bool(texts)
    for number, line in enumerate(lines):
        for place, text in enumerate(line):
            value, kind = _number(text)
            sheet.write(top + number, place, value, style(kind, number < 2 or line[0] == MARK))
    if shown.part:
        sheet.write_row(top + len(lines), 0, [f"({shown.part}; all are on the sheet designs)"])


def _number(text: str) -> tuple[str | float | None, str]:
    """Return the number that a text is, and the format in which a spreadsheet shows it so; or the text as a cell."""
    match = _NUMBER.fullmatch(text)
    if match is None:
        return "–" if text == "-" else _cell(text) or None, "General"
    decimals, percent = match.groups("")
    kind = ("#,##0" if "," in text else "0") + ("." + "0" * len(decimals) if decimals else "") + percent
    value = float(text.replace(",", "").removesuffix("%"))
    return round(value / 100.0, len(decimals) + 2) if percent else value, kind
