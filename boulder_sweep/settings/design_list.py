"""``table: designs.csv``, ``.xlsx`` or ``.parquet``: a list of designs, numbers in the units of the column names."""

from __future__ import annotations

import csv
import math
import re
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from boulder_sweep.designs import Label
from boulder_sweep.locations import Location, LocationError, is_url, location_of, source_of
from boulder_sweep.parquet import MOST_ROWS, ParquetError, TableFile
from boulder_sweep.settings.problems import (
    Position,
    ProblemList,
    SettingsError,
    cell_position,
    check_regular_file,
    refuse,
    shorten,
)
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.table_columns import (
    Alike,
    TableColumn,
    check_count,
    check_numbers,
    check_values,
    label_of,
    read_header,
    to_input_unit,
)
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.settings.values import NumberError, split_number
from boulder_sweep.text import why

if TYPE_CHECKING:
    import pyarrow as pa

MAX_TABLE_BYTES = 2_000_000_000
MAX_TABLE_ROWS = MOST_ROWS
MOST_WORDS = 2_000_000
"""Most different words of a column of a Parquet file, which can be written in a few bytes."""
MAX_UNPACKED_BYTES = 1_000_000_000
"""Largest spreadsheet once it is unpacked."""
MAX_CELL = 32_767
"""Longest text that spreadsheets keep in a cell, in characters."""
_MAX_PIECE = 10 * MAX_CELL
"""Longest stretch between two tags of a spreadsheet: a cell with every character written as ``&#x10FFFF;`` [bytes]."""
CHUNK = 20_000
"""Rows that are converted and checked at once."""

_COMMA = re.compile(r"\d,\d")

Origin = tuple[int, str]
"""Where a row stands: number of the line, and its text where that is needed to find a cell."""


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
    text = node.text.strip()
    try:
        path = location_of(text) if is_url(text) else folder / Path(text)
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
        check_regular_file(path, MAX_TABLE_BYTES, "Split it into several sweeps")
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


class _RowReader:
    """Turns rows of text into columns of numbers, a chunk at a time."""

    def __init__(self, path: Location, problems: ProblemList, position: Callable[[Origin, int], Position]) -> None:
        self.path = path
        self.position = position
        self.label = str(path)
        self.problems = problems
        self.before = len(problems.problems)
        self.alike = Alike(problems)
        self.columns: list[TableColumn | None] = []
        self.positions: list[Position] = []
        self.has_commas = False
        """Whether a comma does not separate cells, so that all numbers of the file may have one."""
        self.numbers: dict[str, list[np.ndarray]] = {}
        self.texts: dict[str, list[str]] = {}
        self.rows: list[list[str]] = []
        self.origins: list[Origin] = []
        self.count = 0

    def header(self, names: list[str], origin: Origin) -> None:
        """Take the column names."""
        check_count(names, self.label)
        self.positions = [self.position(origin, index) for index in range(len(names))]
        self.columns = read_header(names, self.positions, self.problems)

    def take(self, row: list[str], origin: Origin, hint: str = "") -> None:
        """Take a row; `hint` follows the message if it has too many cells."""
        if len(row) != len(self.columns):
            message = f"has {len(row)} cell{'' if len(row) == 1 else 's'}; the first line has {len(self.columns)}"
            message += hint if len(row) > len(self.columns) else ""
            self.alike.add("lines", self.position(origin, 0), "", message)
            return
        self.count += 1
        if self.count > MAX_TABLE_ROWS:
            raise refuse(self.label, f"has more than {MAX_TABLE_ROWS} rows")
        self.rows.append(row)
        self.origins.append(origin)
        if len(self.rows) >= CHUNK:
            self.flush()

    def finish(self) -> DesignList:
        """Return the designs; with mistakes in the header or the cells they are not usable."""
        self.flush()
        self.alike.finish()
        if self.count == 0 and len(self.problems.problems) == self.before:
            raise refuse(self.label, "has no rows below the column names")
        for column, position in zip(self.columns, self.positions, strict=True):
            if column is not None and column.field is None and _are_numbers(self.texts.get(column.name, [])):
                check_numbers(column, position, self.problems)
        numbers = {name: np.concatenate(parts) for name, parts in self.numbers.items()}
        return DesignList(self.path.name, numbers, {name: label_of(texts) for name, texts in self.texts.items()})

    def flush(self) -> None:
        """Convert and check the rows taken since the last time."""
        if not self.rows:
            return
        for index, column in enumerate(self.columns):
            if column is None:
                continue
            cells = [row[index] for row in self.rows]
            if column.field is None:
                self.texts.setdefault(column.name, []).extend(cells)
                continue
            values = to_input_unit(self.convert(cells, index, column), column)
            for row, message in check_values(values, column.field):
                if not np.isnan(values[row]):  # those have been reported as they were read
                    self.alike.add("cells", self.position(self.origins[row], index), column.name, message)
            self.numbers.setdefault(column.field.name, []).append(values)
        self.rows.clear()
        self.origins.clear()

    def convert(self, cells: list[str], index: int, column: TableColumn) -> np.ndarray:
        """Return cells as numbers, NaN for those that are none (they are reported)."""
        if all(cell.isascii() and "_" not in cell and "n" not in cell.lower() for cell in cells):
            try:
                return np.array([float(cell) for cell in cells])  # the usual case, fast
            except ValueError:
                pass
        assert column.field is not None
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            if self.has_commas and _COMMA.search(cell):
                message = f"'{shorten(cell)}' has a comma; save the file with decimal points, and thousands unseparated"
                self.alike.add("", self.position(self.origins[row], index), "", message, most=1)
                continue
            try:
                number, unit = split_number(cell, column.field.unit)
                if unit:
                    raise NumberError(f"'{shorten(cell)}' has a unit; units belong in the column's name")
                values[row] = float(number)
            except (NumberError, OverflowError) as error:
                self.alike.add("cells", self.position(self.origins[row], index), column.name, str(error))
        return values


def _are_numbers(cells: list[str]) -> bool:
    """Whether every cell that is not empty holds a plain number, and there is one."""
    filled = [cell for cell in cells if cell.strip()]
    try:
        return bool(filled) and all(np.isfinite(float(cell)) for cell in filled)
    except ValueError:
        return False


class _Lines:
    """Lines of a file without the comments (# ...); remembers the line that was read last."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.number = 0
        self.text = ""

    def __iter__(self) -> Iterator[str]:
        for line in self.stream:
            self.number += 1
            self.text = line
            if line.startswith("#"):
                continue
            yield line


def _read_csv(path: Location, problems: ProblemList) -> DesignList:
    """Return the designs of a CSV file.

    Parameters
    ----------
    path : Path or RemotePath
        UTF-8 text, comma, semicolon or tab between the cells, first line the column names. Lines that begin
        with # and empty lines are skipped.
    problems : ProblemList
        Receives mistakes with line and column of the cell.

    Raises
    ------
    SettingsError
        The file cannot be read at all.
    """
    label = str(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return _read_lines(_Lines(stream), path, problems)
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


def _read_lines(source: _Lines, path: Location, problems: ProblemList) -> DesignList:
    """Take the lines of a CSV file."""
    label = str(path)
    lines = iter(source)
    header = next((line for line in lines if line.strip()), None)
    if header is None:
        raise refuse(label, "is empty; the first line must hold the column names")
    delimiter = next((sign for sign in ",;\t" if sign in header), ",")
    hint = " (a comma begins a cell: write 15000 for 15,000, 1.5 for 1,5, and text with a comma in quotation marks)"
    hint = hint if delimiter == "," else ""
    rows = _RowReader(path, problems, lambda origin, index: cell_position(label, *origin, delimiter, index))
    rows.has_commas = delimiter != ","
    try:
        names = [cell.strip() for cell in next(csv.reader([header], delimiter=delimiter))]
        rows.header(names, (source.number, header))
        for row in csv.reader(lines, delimiter=delimiter):
            if row and (len(row) > 1 or row[0].strip()):
                rows.take(row, (source.number, source.text), hint)
    except csv.Error as error:
        raise refuse(label, f"cannot be read as CSV ({error})", source.number, 1) from None
    return rows.finish()


def _read_xlsx(path: Location, problems: ProblemList) -> DesignList:
    """Return the designs of the first sheet of a spreadsheet; row and column of a cell are its position.

    Parameters
    ----------
    path : Path or RemotePath
        Excel workbook; first row the column names. Empty rows are skipped, formulas count by their stored value.
    problems : ProblemList
        Receives mistakes.

    Raises
    ------
    SettingsError
        The file cannot be read at all, or openpyxl is not installed.
    """
    label = str(path)
    try:
        from openpyxl import load_workbook  # an extra, for tables in this format only
    except ImportError:
        raise refuse(label, "spreadsheets need openpyxl: pip install 'boulder-sweep[report]'") from None
    rows = _RowReader(path, problems, lambda origin, index: Position(label, origin[0], index + 1))
    for number, cells in enumerate(_sheet_rows(path, load_workbook), 1):
        texts = ["" if cell is None else str(cell) for cell in cells]
        origin = (number, "")
        if not any(text.strip() for text in texts):
            continue
        if rows.columns:
            rows.take((texts + [""] * len(rows.columns))[: max(len(rows.columns), _filled(texts))], origin)
        else:
            rows.header([text.strip() for text in texts[: _filled(texts)]], origin)
    if not rows.columns:
        raise refuse(label, "is empty; the first row must hold the column names")
    return rows.finish()


def _sheet_rows(path: Location, load_workbook: Callable[..., Any]) -> Iterator[tuple[object, ...]]:
    """Yield the rows of the first sheet.

    Raises
    ------
    SettingsError
        The file is damaged, or larger than a spreadsheet can be.
    """
    label = str(path)
    try:
        source = source_of(path)
        with zipfile.ZipFile(source) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_UNPACKED_BYTES:
                raise refuse(label, f"has more than {MAX_UNPACKED_BYTES / 1e9:g} GB once unpacked; save it as CSV")
            for entry in archive.infolist():
                if entry.filename.endswith(".xml"):
                    _check_pieces(archive, entry, label)
        book = load_workbook(source, read_only=True, data_only=True)
        yield from book.worksheets[0].iter_rows(values_only=True)
        book.close()
    except (SettingsError, MemoryError):
        raise
    except Exception as error:  # of a damaged file, zlib, the parser of XML and openpyxl raise almost anything
        reason = "it is damaged, locked by a password, or of another kind; save it as CSV"
        if isinstance(error, OSError) and error.errno is not None:
            reason = why(error)
        raise refuse(label, f"cannot be read as a spreadsheet ({reason})") from None


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


def _filled(texts: list[str]) -> int:
    """Return how many cells a row has up to the last one that is not empty."""
    return max(index + 1 for index, text in enumerate(texts) if text.strip())


def _read_columns(path: Location, problems: ProblemList) -> DesignList:
    label = str(path)
    try:
        with path.open("rb") as source:
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
    designs = DesignList(path.name, {})
    if file.rows == 0:
        raise refuse(label, "has no rows")
    names = file.schema.names
    check_count(names, label)
    for name, column in zip(names, read_header(names, [position] * len(names), problems), strict=True):
        if column is None:
            continue
        cells = file.read([name]).column(0)
        numeric = pa.types.is_floating(cells.type) or pa.types.is_integer(cells.type)
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
        raise refuse(label, f"column {name} has {len(words):,} different words; a table takes at most {MOST_WORDS:,}")
    if pa.types.is_temporal(words.type):
        words = words.cast(pa.string())  # Python has no year 20000, and no nanoseconds
    found = label_of(["", *("" if word is None else str(word) for word in words.to_pylist())])
    return Label(found.codes[array.indices.fill_null(-1).to_numpy(zero_copy_only=False) + 1], found.words)


_READERS: dict[str, Callable[[Location, ProblemList], DesignList]] = {
    ".csv": _read_csv,
    ".xlsx": _read_xlsx,
    ".parquet": _read_columns,
}
"""By the end of the file's name."""
