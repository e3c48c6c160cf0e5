"""``table: designs.csv``, ``.xlsx`` or ``.parquet``: a list of designs, numbers in the units of the column names."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.columns import BY_NAME as TABLE_COLUMNS
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.designs import Label
from boulder_sweep.locations import Location, LocationError, is_url, location_of, opened, source_of
from boulder_sweep.parquet import MOST_BYTES, MOST_ROWS, ParquetError, TableFile
from boulder_sweep.settings.fields import INPUTS, Field
from boulder_sweep.settings.problems import (
    Alike,
    Position,
    ProblemList,
    SettingsError,
    check_regular_file,
    nearest,
    refuse,
    shorten,
)
from boulder_sweep.settings.shown_units import system_of
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.text_table import MAX_BYTES, MAX_COLUMNS, Row, TextTable, open_text
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.settings.units import factor, name_suffix, suffix_unit
from boulder_sweep.settings.values import outside
from boulder_sweep.text import install, size_text, why

if TYPE_CHECKING:
    import pyarrow as pa

MAX_TABLE_ROWS = MOST_ROWS
MOST_WORDS = 2_000_000
"""Most different words of a column."""
_TOO_MANY_WORDS = f"column {{}} has more than {MOST_WORDS:,} different words"
_FLOAT = 8
"""Bytes of a number as it is used."""
_NAMES = [field.name for field in INPUTS]
_STORED_INDEX = "__index_level_0__"
"""Where pandas stores the numbers of rows in a Parquet file."""
MAX_UNPACKED_BYTES = 100_000_000
"""Largest spreadsheet once it is unpacked: some two million cells."""
MOST_CELLS = 20_000_000
"""Most cells of a sheet, with the empty ones: a single cell far out makes as many as it likes."""
MAX_CELL = 32_767
"""Longest text that spreadsheets keep in a cell, in characters."""
_MAX_PIECE = 10 * MAX_CELL
"""Longest stretch between two tags of a spreadsheet: a cell with every character written as ``&#x10FFFF;`` [bytes]."""


def read_designs(node: Scalar, folder: Path, problems: ProblemList) -> DesignList | None:
    """Return the designs of a table; mistakes go to `problems`.

    Parameters
    ----------
    node : Scalar
        The file's name as written in the settings, or its URL.
    folder : Path
        Where relative names begin.
    problems : ProblemList
        Receives what is wrong with the table, by line and column of the table itself.

    Returns
    -------
    DesignList or None
        None where the table cannot be used; the problems say why.
    """
    try:
        path = located(node.text, folder)
    except LocationError as refused:
        problems.add(node.position, "table", str(refused))
        return None
    before = len(problems.problems)
    suffix = path.suffix.lower()
    reader = _READERS.get(suffix)
    if reader is None:
        kinds = ", ".join(_READERS)
        problems.add(node.position, "table", f"'{shorten(node.text)}' has an unsupported type; use one of {kinds}")
        return None
    try:
        check_regular_file(path, MAX_BYTES, "Split it into several sweeps")
        designs = reader(path, problems)
    except SettingsError as error:
        for problem in error.problems:
            inside = problem.line is not None
            position = Position(problem.file, problem.line, problem.column) if inside else node.position
            problems.add(position, "table", problem.message if inside else f"{problem.file}: {problem.message}")
        return None
    if len(problems.problems) == before and not designs.columns:
        problems.add(node.position, "table", f"{path} has no column that is an input")
    return None if len(problems.problems) > before else designs


def located(name: str, folder: Path) -> Location:
    """Return where a file lies by its name or URL; relative names begin in `folder`.

    Raises
    ------
    LocationError
        It is the URL of nothing that can be opened.
    """
    name = name.strip()
    return location_of(name) if is_url(name) else folder / Path(name)


@contextmanager
def open_table(path: Location, most_rows: int, known: Sequence[str], problems: ProblemList) -> Iterator[TextTable]:
    """Open a text file, or the first sheet of a spreadsheet (.xlsx), as a table; see `open_text`.

    In a spreadsheet row and column of a cell are its position. Empty rows are skipped, formulas count by their stored
    value.

    Raises
    ------
    SettingsError
        The file cannot be read at all, or openpyxl is not installed.
    """
    if path.suffix.lower() != ".xlsx":
        with open_text(path, most_rows, known, problems) as table:
            yield table
        return
    label = str(path)
    try:
        from openpyxl import load_workbook  # an extra, for tables in this format only
    except ImportError:
        raise refuse(label, f"spreadsheets need openpyxl: {install('report')}") from None
    yield TextTable(label, _sheet_rows(path, load_workbook), "", known, problems)


def _designs_of(table: TextTable, path: Location, problems: ProblemList) -> DesignList:
    """Return the designs of a table of text; with mistakes in the header or the cells they are not usable."""
    before = len(problems.problems)
    columns = read_header(table.names, table.positions, problems)
    numbers: dict[str, list[np.ndarray]] = {column.field.name: [] for column in columns if column and column.field}
    words: dict[str, _Words] = {column.name: _Words() for column in columns if column and not column.field}
    count = 0
    for rows in table.chunks():
        count += len(rows)
        if count * len(numbers) * _FLOAT > MOST_BYTES:
            raise refuse(table.label, f"has more than {size_text(MOST_BYTES)} of numbers")
        for index, column in enumerate(columns):
            if column is None:
                continue
            if column.field is None:
                words[column.name].take(table.cells(rows, index))
                if len(words[column.name].codes) > MOST_WORDS:
                    raise refuse(table.label, _TOO_MANY_WORDS.format(column.name))
                continue
            values = to_input_unit(table.numbers(rows, index, column.name, column.field.unit), column)
            for row, message in check_values(values, column.field):
                if not np.isnan(values[row]):  # those have been reported as they were read
                    table.alike.add("cells", table.position(rows[row], index), column.name, message)
            numbers[column.field.name].append(values)
    if count == 0 and len(problems.problems) == before:
        raise refuse(table.label, "has no rows below the column names")
    for column, position in zip(columns, table.positions, strict=True):
        if column is not None and column.field is None and _are_numbers(words[column.name].codes):
            check_numbers(column, position, problems)
    values_of = {name: np.concatenate(parts or [np.empty(0)]) for name, parts in numbers.items()}
    labels = {name: own.label() for name, own in words.items()}
    return DesignList(path.name, values_of, labels, _system(columns))


class _Words:
    """A column of text, taken in parts; every word is kept once."""

    def __init__(self) -> None:
        self.codes: dict[str, int] = {}
        self.parts: list[np.ndarray] = []

    def take(self, cells: list[str]) -> None:
        """Take the next cells, fit to be printed."""
        codes = self.codes
        known = {cell: codes.setdefault(shorten(cell, MAX_TEXT), len(codes)) for cell in dict.fromkeys(cells)}
        self.parts.append(np.array([known[cell] for cell in cells], dtype=np.int32))

    def label(self) -> Label:
        """Return what was taken."""
        found = label_of(list(self.codes))
        return Label(found.codes[np.concatenate(self.parts)] if self.parts else found.codes, found.words)


def _are_numbers(cells: Iterable[str]) -> bool:
    """Whether every cell that is not empty holds a plain number, and there is one."""
    filled = [cell for cell in cells if cell]
    try:
        return bool(filled) and all(np.isfinite(float(cell)) for cell in filled)
    except ValueError:
        return False


def _read_rows(path: Location, problems: ProblemList) -> DesignList:
    with open_table(path, MAX_TABLE_ROWS, _NAMES, problems) as table:
        return _designs_of(table, path, problems)


def _sheet_rows(path: Location, load_workbook: Callable[..., Any]) -> Iterator[Row]:
    """Yield the rows of the first sheet, empty cells at their ends as far as the first row has names.

    Raises
    ------
    SettingsError
        The file is damaged, larger than a spreadsheet can be, or has formulas without values.
    """
    label = str(path)
    try:
        source = source_of(path)
        with zipfile.ZipFile(source) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_UNPACKED_BYTES:
                raise refuse(label, f"has more than {size_text(MAX_UNPACKED_BYTES)} once unpacked; save it as CSV")
            for entry in archive.infolist():
                if entry.filename.endswith(".xml"):
                    _check_pieces(archive, entry, label)
        width, looked = 0, False
        with closing(load_workbook(source, read_only=True, data_only=True)) as book:
            for number, cells in _first_sheet(book, label, values_only=True):
                if None in cells and not looked:
                    looked = True
                    _check_formulas(source, load_workbook, label)
                texts = ["" if cell is None else str(cell) for cell in cells]
                filled = max((index + 1 for index, text in enumerate(texts) if text.strip()), default=0)
                width = width or filled
                yield [*texts, *[""] * (width - len(texts))][: max(width, filled)], number, ""
    except (SettingsError, MemoryError):
        raise
    except Exception as error:  # of a damaged file, zlib, the parser of XML and openpyxl raise almost anything
        reason = "it is damaged, locked by a password, or of another kind; save it as CSV"
        if isinstance(error, OSError) and error.errno is not None:
            reason = why(error)
        raise refuse(label, f"cannot be read as a spreadsheet ({reason})") from None


def _first_sheet(book: Any, label: str, *, values_only: bool = False) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Yield the rows of the first sheet with their numbers."""
    count = 0
    for number, cells in enumerate(book.worksheets[0].iter_rows(values_only=values_only), 1):
        count += len(cells)
        if count > MOST_CELLS:
            raise refuse(label, f"has more than {MOST_CELLS:,} cells, with the empty ones; save it as CSV", number, 1)
        yield number, cells


def _check_formulas(source: IO[bytes] | str | Path, load_workbook: Callable[..., Any], label: str) -> None:
    """Refuse formulas that nobody has worked out: a program that writes a file without opening it leaves them so."""
    with (
        closing(load_workbook(source, read_only=True, data_only=True)) as values,
        closing(load_workbook(source, read_only=True)) as formulas,
    ):
        rows = zip(*(_first_sheet(book, label) for book in (values, formulas)), strict=True)
        for (number, valued), (_, formed) in rows:
            for index, (found, written) in enumerate(zip(valued, formed, strict=True), 1):
                is_text = found.data_type == "str"  # an empty one is a value
                if found.value is None and written.value is not None and not is_text:
                    message = "has formulas without values: open and save it once in a spreadsheet program"
                    raise refuse(label, message, number, index)


def _check_pieces(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, label: str) -> None:
    """Refuse a cell that no spreadsheet can hold, before the parser of XML keeps several copies of it.

    Reading to the end also compares the checksum.
    """
    length = 0
    with archive.open(entry) as content:
        while chunk := content.read(_MAX_PIECE):
            first, *others = chunk.split(b"<")
            length += len(first)
            if length > _MAX_PIECE:
                raise refuse(label, f"has a cell of more than {MAX_CELL:,} characters, which no spreadsheet can hold")
            if others:
                length = len(others[-1])


def _read_columns(path: Location, problems: ProblemList) -> DesignList:
    label = str(path)
    try:
        with opened(path) as source:
            return _checked_columns(TableFile(source, MAX_TABLE_ROWS, most_text=math.inf), path, problems)
    except ParquetError as problem:
        raise refuse(label, str(problem)) from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


def _checked_columns(file: TableFile, path: Location, problems: ProblemList) -> DesignList:
    """Return the designs of an opened file, read column by column."""
    import pyarrow as pa  # takes a third of a second to import: only for tables in this format

    label = str(path)
    position = Position(label)
    alike = Alike(problems)
    if file.rows == 0:
        raise refuse(label, "has no rows")
    names = file.schema.names
    if len(names) > MAX_COLUMNS:
        raise refuse(label, f"has {len(names):,} columns; at most {MAX_COLUMNS:,} are read")
    columns = read_header(names, [position] * len(names), problems)
    designs = DesignList(path.name, {}, units=_system(columns))
    for name, column in zip(names, columns, strict=True):
        if column is None:
            continue
        cells = file.read([name]).column(0)
        kinds = pa.types.is_floating, pa.types.is_integer, pa.types.is_decimal
        numeric = any(is_kind(cells.type) for is_kind in kinds)
        if name == _STORED_INDEX and numeric:
            continue
        if column.field is None:
            if not numeric or check_numbers(column, position, problems):
                designs.labels[name] = _label(name, cells, label)
            continue
        if not numeric:
            held = "text" if pa.types.is_dictionary(cells.type) else cells.type
            problems.add(position, name, f"holds {held}, not numbers")
            continue
        if cells.null_count:
            problems.add(position, name, f"has {cells.null_count} empty cells; every design needs a value")
            continue
        values = to_input_unit(cells.cast(pa.float64(), safe=False).to_numpy(), column)
        for row, message in check_values(values, column.field):
            alike.add("rows", position, name, f"row {row + 1}: {message}")
        designs.columns[column.field.name] = np.ascontiguousarray(values)
    alike.finish()
    return designs


def _label(name: str, cells: pa.ChunkedArray, label: str) -> Label:
    """Return a text column; every word is looked at once, however often it stands in the file."""
    import pyarrow as pa

    if not pa.types.is_dictionary(cells.type):
        cells = cells.dictionary_encode()
    array = cells.unify_dictionaries().combine_chunks()
    words = array.dictionary
    if len(words) > MOST_WORDS:
        raise refuse(label, _TOO_MANY_WORDS.format(name))
    if pa.types.is_temporal(words.type):
        words = words.cast(pa.string())  # Python has no year 20000, and no nanoseconds
    found = label_of(["", *("" if word is None else str(word) for word in words.to_pylist())])
    return Label(found.codes[array.indices.fill_null(-1).to_numpy(zero_copy_only=False) + 1], found.words)


_READERS: dict[str, Callable[[Location, ProblemList], DesignList]] = {
    ".csv": _read_rows,
    ".xlsx": _read_rows,
    ".parquet": _read_columns,
}
"""Readers by the end of the file's name."""


MAX_TEXT = 200
"""Longest text that is carried along, in characters."""
_ID = re.compile(r"(.*_)?(id|no|nr|number|name|label|comment|note)", re.IGNORECASE)
"""Unknown columns with these names may hold numbers; any other name could be a misspelled input."""
_LABEL = re.compile(r"\w[\w .+/()#-]{0,79}")


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column that can be used.

    Attributes
    ----------
    name : str
        Its name in the file.
    field : Field or None
        The input it gives; None for a text column.
    factor : Fraction
        From its numbers to the unit of the input.
    """

    name: str
    field: Field | None
    factor: Fraction = Fraction(1)


_STEMS: dict[str, Field] = {field.name.removesuffix(name_suffix(field.unit)): field for field in INPUTS}
"""Inputs by the name of the column without its unit."""


def read_header(names: list[str], positions: list[Position], problems: ProblemList) -> list[TableColumn | None]:
    """Return what every column is, None for those that cannot be used; mistakes go to `problems`."""
    columns: list[TableColumn | None] = []
    for name, position in zip(names, positions, strict=True):
        column = _column(name)
        if isinstance(column, TableColumn):
            same = [other for other in columns if other is not None and _key(other) == _key(column)]
            if same:
                column = f"gives the same as column {same[0].name}" if same[0].name != name else "appears twice"
        if isinstance(column, str):
            problems.add(position, shorten(name) or "(empty)", column)
        columns.append(column if isinstance(column, TableColumn) else None)
    return columns


def _system(columns: Sequence[TableColumn | None]) -> str:
    """Return the units of the column with the heights, see `DesignList`."""
    sizes = (one.factor for one in columns if one and one.field and one.field.name == "boulder_height_m")
    return system_of(next(sizes, 1))


def _key(column: TableColumn) -> str:
    return column.name if column.field is None else column.field.name


def _column(name: str) -> TableColumn | str:
    """Return a column, or what is wrong with its name."""
    if name == "design_id":
        return "designs are numbered in their order; rename or remove this column"
    if name in OUTCOME_COLUMNS:
        return f"is an outcome of a run ({TABLE_COLUMNS[name].meaning}), not an input; remove this column"
    if column := _input_column(name):
        return column
    if name in _STEMS:
        return f"the unit is missing at the end of the name, such as {name}{name_suffix(_STEMS[name].unit)}"
    meant = "" if _ID.fullmatch(name) else _meant(name)
    if meant:
        return f"is not an input; did you mean {meant}?"
    if not _LABEL.fullmatch(name):
        return "the name of a text column may hold letters, digits, spaces and _ . + - / ( ) #"
    return TableColumn(name, None)


def _input_column(name: str) -> TableColumn | None:
    """Return the column of an input, if its name is one with its unit at the end."""
    for stem, field in _STEMS.items():
        if name == field.name:
            return TableColumn(name, field)
        if name.startswith(f"{stem}_"):
            unit = suffix_unit(name.removeprefix(f"{stem}_"), field.unit)
            if unit:
                return TableColumn(name, field, factor(unit, field.unit))
    return None


def check_numbers(column: TableColumn, position: Position, problems: ProblemList) -> bool:
    """Report an unknown column that holds nothing but numbers; return whether it may be carried along."""
    if _ID.fullmatch(column.name):
        return True
    message = f"is not an input (inputs: {', '.join(_STEMS)}, each with its unit at the end)"
    message += "; a column of numbers that is to be carried along needs a name that ends in _id or _name"
    problems.add(position, shorten(column.name), message)
    return False


def _meant(name: str) -> str:
    """Return the input that a misspelled name stands for, with the unit it was given; empty if there is none near."""
    word = name.lower()
    plain = "_".join(re.findall(r"[^\W_]+", word))  # a quarry writes "Length (m)"
    for likely in (plain, f"boulder_{plain}"):
        if _input_column(likely):
            return likely
    for cut in [i for i, sign in enumerate(name) if sign == "_"] + [len(name)]:
        stem, suffix = name[:cut], name[cut + 1 :]
        near = nearest(stem, _STEMS, cutoff=0.8)
        if near is None:
            continue
        unit = _STEMS[near].unit
        if suffix and suffix_unit(suffix, unit):
            return f"{near}_{suffix}"
        if not suffix:
            return f"{near}{name_suffix(unit)}" if unit == "1" else f"{near}, with its unit at the end"
    for stem, field in _STEMS.items():
        if word in (stem, field.key, *field.also):
            return f"{stem}, with its unit at the end" if field.unit != "1" else stem
    return ""


def check_values(values: np.ndarray, field: Field) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for values that are not finite or not admitted."""
    bound = field.admitted
    assert bound is not None
    wrong = np.flatnonzero(~((values >= bound.low) & (values <= bound.high)))
    return [
        (int(row), outside(float(values[row]), field) if np.isfinite(values[row]) else "is not a finite number")
        for row in wrong
    ]


def label_of(texts: list[str]) -> Label:
    """Return texts, one a row, as codes and words; fit to be printed."""
    words, codes = np.unique(np.array([shorten(text, MAX_TEXT) for text in texts], dtype=object), return_inverse=True)
    return Label(codes.astype(np.int32), tuple(words.tolist()))


def to_input_unit(values: np.ndarray, column: TableColumn) -> np.ndarray:
    """Return values in the unit of the input."""
    return values if column.factor == 1 else values * float(column.factor)
