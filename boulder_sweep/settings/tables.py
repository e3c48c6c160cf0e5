"""Tables as people have them: lists of designs (``table: designs.csv``), crash pulses, measured curves, logs.

A file of text, or the first sheet of a spreadsheet, is read as rows of cells in one way. Blank rows, commas at the ends
of rows and the numbers of rows that pandas writes in front are left out. Where a comma does not separate cells, it may
be the decimal sign of the whole file. Nothing is read without a limit. A list of designs may be a Parquet file, too.
"""

from __future__ import annotations

import csv
import io
import math
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TextIO

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
    Problems,
    SettingsError,
    check_regular_file,
    nearest,
    refuse,
    shorten,
    wrong,
)
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.settings.units import factor, name_suffix, suffix_unit, system_of
from boulder_sweep.settings.values import NumberError, outside, split_number
from boulder_sweep.text import install, size_text, why

if TYPE_CHECKING:
    import pyarrow as pa

MAX_BYTES = 500_000_000
MAX_COLUMNS = 1000
LONGEST_ROW = 1_000_000
"""Most characters of a row."""
CHUNK = 200_000
"""Characters that are converted and checked at once."""
MOST_MISTAKES = 10_000
"""Mistakes after which a table is not read further."""
INDEX_NAMES = ("", "Unnamed: 0")
"""What pandas writes above the numbers of rows: nothing, or this where it has read and written them before."""

_CERTAIN_COMMA = re.compile(r"^\s*[+−-]?(?:0?,\d|\d{4,},\d|\d+,\d{1,2}(?!\d)|\d+,\d{4})", re.MULTILINE | re.ASCII)
"""A number whose comma cannot separate thousands."""
_COMMA_IN_NUMBER = re.compile(r"(?<=\d),(?=\d)")

Row = tuple[list[str], int, str]
"""Cells, the number of the line, and its text; in a spreadsheet the text is empty."""


class TextTable:
    """Rows of cells, each with a cell for every name in the row above them; raises SettingsError without such names.

    `label` is the file, for messages; a spreadsheet has an empty `delimiter`; `known` are names for a message.
    """

    def __init__(
        self, label: str, rows: Iterator[Row], delimiter: str, known: Sequence[str], problems: Problems
    ) -> None:
        self.label, self.delimiter, self.problems = label, delimiter, problems
        self.alike = Alike(problems)
        filled = (row for row in rows if _is_filled(row[0]))
        header = next(filled, None)
        if header is None:
            raise refuse(label, "is empty; the first line must hold the column names")
        names = [cell.strip() for cell in header[0]]
        while not names[-1]:
            names.pop()
        if len(names) > MAX_COLUMNS:
            raise refuse(label, f"has {len(names):,} columns; at most {MAX_COLUMNS:,} are read")
        if all(_is_number(name) for name in names if name):
            sample = (", " if delimiter in ("", "\t") else delimiter).join(known[: max(2, len(names))])
            tabs = " (with tabs between them)" if delimiter == "\t" else ""
            words = f"such as {sample}{tabs}; known names are {', '.join(known)}"
            raise refuse(label, f"the first line holds numbers; write a line of names above it, {words}", header[1], 1)
        self._first = int(names[0] in INDEX_NAMES)
        self.names = names[self._first :]
        self.positions = [self.position(header, index) for index in range(len(self.names))]
        self._width = len(names)
        self._seen: dict[str, tuple[Position, str]] = {}
        self.rows = self._even(filled, self.position(header, -self._first))

    def position(self, row: Row, index: int) -> Position:
        """Return where the cell of a column begins; with quotation marks in the line, only the line is certain."""
        _, line, text = row
        index += self._first
        if '"' in text:
            return Position(self.label, line)
        before = sum(len(cell) + 1 for cell in text.split(self.delimiter)[:index]) if self.delimiter else index
        return Position(self.label, line, before + 1)

    def put_back(self, row: Row) -> None:
        """Let a row be the next one again."""
        self.rows = chain([row], self.rows)

    def chunks(self) -> Iterator[list[Row]]:
        """Yield the rows, some at once, up to the end or too many mistakes."""
        chunk: list[Row] = []
        size = 0
        for row in self.rows:
            chunk.append(row)
            size += len(row[2]) or sum(map(len, row[0]))
            if size >= CHUNK:
                yield chunk
                chunk, size = [], 0
                if self.alike.counts.total() > MOST_MISTAKES:
                    self.problems.add(Position(self.label, row[1]), "is not read beyond this line: too many mistakes")
                    break
        if chunk:
            yield chunk
        self._check_signs()
        self.alike.finish()

    def cells(self, rows: list[Row], index: int) -> list[str]:
        """Return the cells of a column."""
        index += self._first
        return [row[0][index] for row in rows]

    def numbers(
        self, rows: list[Row], index: int, key: str, unit: str = "1", *, may_be_empty: bool = False
    ) -> np.ndarray:
        """Return the cells of a column as numbers, NaN for empty ones and for others that are none, which are reported.

        Messages begin with the `key`, and say that numbers in the `unit` are needed.
        """
        cells = self.cells(rows, index)
        text = "\n".join(cells)
        if self.delimiter in (";", "\t"):
            self._note_signs(text, rows, index)
            if "," in text:
                cells = [cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell for cell in cells]
        if text.isascii() and "_" not in text and "n" not in text.lower():
            with suppress(ValueError):  # the usual case, fast
                gaps = may_be_empty and not all(cells)
                return np.array([np.nan if gaps and not cell.strip() else float(cell) for cell in cells])
        values = np.full(len(cells), np.nan)
        for at, cell in enumerate(cells):
            if may_be_empty and not cell.strip():
                continue
            try:
                number, written = split_number(cell, unit)
                if written:
                    raise NumberError(f"'{shorten(cell)}' is not a plain number; a unit belongs in the column's name")
                values[at] = float(number)
            except (NumberError, OverflowError) as error:
                self.alike.add("cells", self.position(rows[at], index), str(error), key)
        return values

    def _note_signs(self, text: str, rows: list[Row], index: int) -> None:
        """Note where the first comma and the first point stand, and whether a comma is certainly a decimal one."""
        if "certain" not in self._seen and _CERTAIN_COMMA.search(text):
            self._seen["certain"] = self.positions[index], ""
        for sign in ",.":
            if sign in text and sign not in self._seen:
                row = next(row for row in rows if sign in row[0][index + self._first])
                self._seen[sign] = self.position(row, index), row[0][index + self._first]

    def _check_signs(self) -> None:
        """Report numbers of which nobody can say where their decimals begin."""
        if "," not in self._seen:
            return
        position, cell = self._seen[","]
        if "." in self._seen:
            place, other = self._seen["."]
            message = f"'{shorten(cell)}' has a comma, and '{shorten(other)}' in line {place.line} a point"
            remedy = "write all numbers with decimal points, or all with decimal commas, and thousands unseparated"
            self.problems.add(position, f"{message}; {remedy}")
        elif "certain" not in self._seen:
            whole, _, decimals = (shorten(part) for part in cell.partition(","))
            message = f"'{shorten(cell)}' may be {whole}{decimals} or {whole}.{decimals}, and no other number tells"
            self.problems.add(position, f"{message}; write the numbers of this file without commas")

    def _even(self, rows: Iterator[Row], unnamed: Position) -> Iterator[Row]:
        """Yield rows with a cell for every name; report others, and an index that is none."""
        width, last = self._width, -1
        hint = " (a comma begins a cell: write 15000 for 15,000, 1.5 for 1,5, and text with a comma in quotation marks)"
        for row in rows:
            cells = row[0]
            if len(cells) != width:
                if len(cells) < width or _is_filled(cells[width:]):
                    message = f"has {len(cells)} cell{'' if len(cells) == 1 else 's'}; the first line has {width}"
                    message += hint if len(cells) > width and self.delimiter == "," else ""
                    self.alike.add("lines", self.position(row, -self._first), message)
                    continue
                del cells[width:]
            if self._first:
                number = int(cells[0]) if cells[0].isascii() and cells[0].isdecimal() and len(cells[0]) < 18 else -1
                if number <= last:
                    message = "has no name, and does not count the rows; give it a name, or remove it"
                    self.alike.add("", unnamed, message, "the first column", most=1)
                last = number
            yield row


class _Lines:
    """Lines of a text without the comments (# ...); remembers the line that was read last."""

    def __init__(self, stream: TextIO, label: str, most: int) -> None:
        self.stream, self.label, self.most = stream, label, most
        self.number = 0
        self.text = ""
        self.taken, self.begun = 0, 1  # characters since the last row, and the line behind it

    def __iter__(self) -> Iterator[str]:
        readline = self.stream.readline
        while text := readline(LONGEST_ROW + 1):
            self.number += 1
            if self.number > self.most:
                raise refuse(self.label, f"has more than {self.most:,} lines")
            self.taken += len(text)
            if self.taken > LONGEST_ROW:
                remedy = "is a quotation mark not closed?"
                raise refuse(self.label, f"has a row of more than {LONGEST_ROW:,} characters; {remedy}", self.number, 1)
            self.text = text
            if text[0] != "#":
                yield text
            else:
                self.taken = 0


@contextmanager
def open_table(path: Location, most_lines: int, known: Sequence[str], problems: Problems) -> Iterator[TextTable]:
    """Open a text file, or the first sheet of a spreadsheet (.xlsx), as a table; see `TextTable`.

    A text is UTF-8; comma, semicolon or tab between the cells, the first line the column names. Lines that begin with #
    and blank rows are skipped. In a spreadsheet row and column of a cell are its position, and formulas count by their
    stored value. SettingsError is raised where the file cannot be read to its end, or openpyxl is not installed.
    """
    label = str(path)
    if path.suffix.lower() == ".xlsx":
        yield TextTable(label, _sheet_rows(path), "", known, problems)
        return
    try:
        with io.TextIOWrapper(opened(path), encoding="utf-8-sig", newline="") as stream:
            lines = _Lines(stream, label, most_lines)
            try:
                yield _table_of(lines, known, problems)
            except csv.Error:
                message = "cannot be read as CSV; is a quotation mark not closed, or does text follow a closed one?"
                raise refuse(label, message, lines.begun, 1) from None
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


def _table_of(lines: _Lines, known: Sequence[str], problems: Problems) -> TextTable:
    """Return the lines of a text as a table; what stands most often between names separates cells."""
    texts = iter(lines)
    header = next((text for text in texts if text.strip(" \t\r\n,;")), "")
    delimiter = max(",;\t", key=_COMMA_IN_NUMBER.sub("", header).count)

    def rows() -> Iterator[Row]:
        for cells in csv.reader(chain([header], texts), delimiter=delimiter, strict=True):
            lines.taken, lines.begun = 0, lines.number + 1
            yield cells, lines.number, lines.text

    return TextTable(lines.label, rows(), delimiter, known, problems)


def _is_filled(cells: list[str]) -> bool:
    return bool(cells) and bool(cells[0].strip() or "".join(cells).strip())


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


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


def read_designs(node: Scalar, folder: Path, problems: Problems) -> DesignList | None:
    """Return the designs of a table by its name or URL, or None: `problems` say why, by its own lines and columns."""
    before = len(problems)
    with problems.under("table", node.position):
        path = located(node, folder)
        reader = _READERS.get(path.suffix.lower())
        if reader is None:
            kinds = ", ".join(_READERS)
            raise wrong(node.position, f"'{shorten(node.text)}' has an unsupported type; use one of {kinds}")
        check_regular_file(path, MAX_BYTES, "Split it into several sweeps")
        designs = reader(path, problems)
        if len(problems) == before and not designs.columns:
            raise wrong(node.position, f"{path} has no column that is an input")
    return None if len(problems) > before else designs


def located(node: Scalar, folder: Path) -> Location:
    """Return where a file lies by its name or URL; relative names begin in `folder`."""
    name = node.text.strip()
    try:
        return location_of(name) if is_url(name) else folder / Path(name)
    except LocationError as error:
        raise wrong(node.position, str(error)) from None


def _read_rows(path: Location, problems: Problems) -> DesignList:
    with open_table(path, MOST_ROWS, _NAMES, problems) as table:
        return _designs_of(table, path, problems)


def _designs_of(table: TextTable, path: Location, problems: Problems) -> DesignList:
    """Return the designs of a table; with mistakes in the header or the cells they are not usable."""
    before = len(problems)
    columns = read_header(table.names, table.positions, problems)
    numbers: dict[str, list[np.ndarray]] = {column.field.name: [] for column in columns if column and column.field}
    words: dict[str, _Words] = {column.name: _Words() for column in columns if column and not column.field}
    lines: list[int] = []
    for rows in table.chunks():
        lines += [row[1] for row in rows]
        if len(lines) * len(numbers) * _FLOAT > MOST_BYTES:
            raise refuse(table.label, f"has more than {size_text(MOST_BYTES)} of numbers")
        for index, column in enumerate(columns):
            if column is None:
                continue
            if column.field is None:
                words[column.name].take(table.cells(rows, index))
                if len(words[column.name].codes) > MOST_WORDS:
                    raise refuse(table.label, _TOO_MANY_WORDS.format(column.name))
                continue
            values = table.numbers(rows, index, column.name, column.field.unit) * float(column.factor)
            for row, message in check_values(values, column.field):
                if not np.isnan(values[row]):  # those have been reported as they were read
                    table.alike.add("cells", table.position(rows[row], index), message, column.name)
            numbers[column.field.name].append(values)
    if not lines and len(problems) == before:
        raise refuse(table.label, "has no rows below the column names")
    for column, position in zip(columns, table.positions, strict=True):
        if column is not None and column.field is None and _are_numbers(words[column.name].codes):
            check_numbers(column, position, problems)
    values_of = {name: np.concatenate(parts or [np.empty(0)]) for name, parts in numbers.items()}
    labels = {name: own.label() for name, own in words.items()}
    return DesignList(path.name, values_of, labels, _system(columns), table.label, np.array(lines), _written(columns))


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


def _sheet_rows(path: Location) -> Iterator[Row]:
    """Yield the rows of the first sheet, empty cells at their ends as far as the first row has names."""
    label = str(path)
    try:
        from openpyxl import load_workbook  # an extra, for tables in this format only
    except ImportError:
        raise refuse(label, f"spreadsheets need openpyxl: {install('report')}") from None
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
    """Refuse a cell that no spreadsheet can hold, before the parser of XML keeps several copies of it."""
    length = 0
    with archive.open(entry) as content:
        while chunk := content.read(_MAX_PIECE):  # to the end, which compares the checksum
            first, *others = chunk.split(b"<")
            length += len(first)
            if length > _MAX_PIECE:
                raise refuse(label, f"has a cell of more than {MAX_CELL:,} characters, which no spreadsheet can hold")
            if others:
                length = len(others[-1])


def _read_columns(path: Location, problems: Problems) -> DesignList:
    label = str(path)
    try:
        with opened(path) as source:
            return _checked_columns(TableFile(source, MOST_ROWS, most_text=math.inf), path, problems)
    except ParquetError as problem:
        raise refuse(label, str(problem)) from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


def _checked_columns(file: TableFile, path: Location, problems: Problems) -> DesignList:
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
    designs = DesignList(path.name, {}, units=_system(columns), source=label, written=_written(columns))
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
            problems.add(position, f"holds {held}, not numbers", name)
            continue
        if cells.null_count:
            problems.add(position, f"has {cells.null_count} empty cells; every design needs a value", name)
            continue
        values = cells.cast(pa.float64(), safe=False).to_numpy() * float(column.factor)
        for row, message in check_values(values, column.field):
            alike.add("rows", position, f"row {row + 1}: {message}", name)
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


_READERS = {".csv": _read_rows, ".xlsx": _read_rows, ".parquet": _read_columns}
"""Readers by the end of the file's name."""

MAX_TEXT = 200
"""Longest text that is carried along, in characters."""
_ID = re.compile(r"(.*_)?(id|no|nr|number|name|label|comment|note)", re.IGNORECASE)
"""Unknown columns with these names may hold numbers; any other name could be a misspelled input."""
_LABEL = re.compile(r"\w[\w .+/()#-]{0,79}")


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column that can be used."""

    name: str  # in the file
    field: Field | None  # the input it gives; None for a text column
    factor: Fraction = Fraction(1)  # from its numbers to the unit of the input


_STEMS: dict[str, Field] = {field.name.removesuffix(name_suffix(field.unit)): field for field in INPUTS}
"""Inputs by the name of the column without its unit."""
_ROCK = ("rock", "boulder_rock", "rock_type")
_ROCK_REMEDY = (
    "is not read, for a file has one boulder.rock for its whole list: write a list for each kind of rock, or add a "
    "column boulder_density_kg_m3"
)


def read_header(names: list[str], positions: list[Position], problems: Problems) -> list[TableColumn | None]:
    """Return what every column is, None for those that cannot be used; mistakes go to `problems`."""
    columns: list[TableColumn | None] = []
    for name, position in zip(names, positions, strict=True):
        column = _column(name)
        if isinstance(column, TableColumn):
            same = [other for other in columns if other is not None and _key(other) == _key(column)]
            if same:
                column = f"gives the same as column {same[0].name}" if same[0].name != name else "appears twice"
        if isinstance(column, str):
            problems.add(position, column, shorten(name) or "(empty)")
        columns.append(column if isinstance(column, TableColumn) else None)
    if "boulder_density_kg_m3" not in {_key(column) for column in columns if column}:
        for one, position in zip(columns, positions, strict=True):
            if one is not None and _plain(one.name.lower()) in _ROCK:
                problems.add(position, _ROCK_REMEDY, one.name)
    return columns


def _system(columns: Sequence[TableColumn | None]) -> str:
    """Return the units of the column with the heights, see `DesignList`."""
    sizes = (one.factor for one in columns if one and one.field and one.field.name == "boulder_height_m")
    return system_of(next(sizes, 1))


def _written(columns: Sequence[TableColumn | None]) -> dict[str, str]:
    """Return the names of inputs as the file has them, by column name."""
    return {one.field.name: one.name for one in columns if one and one.field}


def _key(column: TableColumn) -> str:
    return column.name if column.field is None else column.field.name


def _column(name: str) -> TableColumn | str:
    """Return a column, or what is wrong with its name."""
    if name == "design_id":
        return "designs are numbered in their order; rename or remove this column"
    if name in OUTCOME_COLUMNS:
        return f"is an outcome of a run ({TABLE_COLUMNS[name].meaning}), not an input; remove this column"
    if column := _input_column(name) or _headed(name):
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


def _headed(name: str) -> TableColumn | None:
    """Return the column of an input by a heading with its unit in brackets: a quarry writes ``Length (m)``."""
    plain = _plain(name.lower())
    column = _input_column(plain) or _input_column(f"boulder_{plain}")
    return replace(column, name=name) if column and re.search(r"[(\[]", name) else None


def check_numbers(column: TableColumn, position: Position, problems: Problems) -> bool:
    """Report an unknown column that holds nothing but numbers; return whether it may be carried along."""
    if _ID.fullmatch(column.name):
        return True
    message = f"is not an input (inputs: {', '.join(_STEMS)}, each with its unit at the end)"
    message += "; a column of numbers that is to be carried along needs a name that ends in _id or _name"
    problems.add(position, message, shorten(column.name))
    return False


def _plain(name: str) -> str:
    """Return the words of a name joined by ``_``."""
    return "_".join(re.findall(r"[^\W_]+", name))


def _meant(name: str) -> str:
    """Return the input that a misspelled name stands for, with the unit it was given; empty if there is none near."""
    word = name.lower()
    plain = _plain(word)
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
