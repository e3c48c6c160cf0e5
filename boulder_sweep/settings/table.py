"""``table: designs.csv`` or ``.parquet``: a list of designs, plain numbers in the units of the column names."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np

from boulder_sweep.designs import Label
from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.leaf import outside
from boulder_sweep.settings.numbers import NumberError, split_number
from boulder_sweep.settings.problems import Place, ProblemList, SettingsError, shorten
from boulder_sweep.settings.source import check_regular_file, refuse
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.table_header import TableColumn, check_numbers, read_header
from boulder_sweep.settings.tree import Scalar

MAX_TABLE_BYTES = 2_000_000_000
MAX_TABLE_ROWS = 20_000_000
CSV_CHUNK = 20_000
"""Rows of a CSV file that are converted and checked at once."""
MAX_ALIKE = 5
"""Most problems reported of one column, and of lines with a wrong number of cells."""
MAX_TEXT = 200
"""Longest text that is carried along, in characters."""
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+(\s.*)?")


def read_table(node: Scalar, folder: Path, problems: ProblemList) -> DesignList | None:
    """Return the designs of a table; mistakes go to `problems`.

    Parameters
    ----------
    node : Scalar
        The file's name as written in the settings.
    folder : Path
        Where relative names begin.
    problems : ProblemList
        Receives what is wrong with the table, by line and column of the table itself.

    Returns
    -------
    DesignList or None
        None where the table cannot be used; the problems say why.
    """
    path = folder / Path(node.text.strip())
    before = len(problems.problems)
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        problems.add(node.place, "table", f"'{shorten(node.text)}' is neither a .csv nor a .parquet file")
        return None
    try:
        check_regular_file(path, MAX_TABLE_BYTES, "Split it into several sweeps")
        found = _read_csv(path, problems) if suffix == ".csv" else _read_parquet(path, problems)
    except SettingsError as error:
        for problem in error.problems:
            inside = problem.line is not None
            place = Place(problem.file, problem.line, problem.column) if inside else node.place
            problems.add(place, "table", problem.message if inside else f"{problem.file}: {problem.message}")
        return None
    if len(problems.problems) == before and not found.columns:
        problems.add(node.place, "table", f"{path} has no column that is an input")
    return None if len(problems.problems) > before else found


class _Alike:
    """Reports problems of one kind up to a limit, then counts them."""

    def __init__(self, problems: ProblemList) -> None:
        self.problems = problems
        self.counts: Counter[tuple[str, str]] = Counter()
        self.last: dict[tuple[str, str], Place] = {}

    def add(self, kind: str, place: Place, key: str, message: str, most: int = MAX_ALIKE) -> None:
        self.counts[kind, key] += 1
        self.last[kind, key] = Place(place.file, place.line)
        if self.counts[kind, key] <= most:
            self.problems.add(place, key, message)

    def finish(self) -> None:
        """Say how many more there are."""
        for (kind, key), count in self.counts.items():
            if kind and count > MAX_ALIKE:
                self.problems.add(self.last[kind, key], key, f"and {count - MAX_ALIKE} more {kind} like these")


def _check_values(values: np.ndarray, field: Field) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for values that are not finite or not admitted."""
    bound = field.admitted
    assert bound is not None
    wrong = np.flatnonzero(~((values >= bound.low) & (values <= bound.high)))
    return [
        (int(row), outside(float(values[row]), field) if np.isfinite(values[row]) else "is not a finite number")
        for row in wrong
    ]


def _label(texts: list[str]) -> Label:
    """Return texts, one a row, as codes and words; fit to be printed."""
    words, codes = np.unique(np.array([shorten(text, MAX_TEXT) for text in texts], dtype=object), return_inverse=True)
    return Label(codes.astype(np.int32), tuple(words.tolist()))


def _converted(values: np.ndarray, column: TableColumn) -> np.ndarray:
    """Return values in the unit of the input."""
    return values if column.factor == 1 else values * float(column.factor)


def _read_parquet(path: Path, problems: ProblemList) -> DesignList:
    # pyarrow takes a third of a second to import: only for tables in this format.
    import pyarrow as pa
    import pyarrow.parquet as pq

    label = str(path)
    place = Place(label)
    alike = _Alike(problems)
    found = DesignList(path.name, {})
    try:
        file = pq.ParquetFile(path)
        rows = file.metadata.num_rows
        if rows > MAX_TABLE_ROWS:
            raise refuse(label, f"has {rows} rows; a table takes at most {MAX_TABLE_ROWS}")
        if rows == 0:
            raise refuse(label, "has no rows")
        names = list(file.schema_arrow.names)
        for name, column in zip(names, read_header(names, [place] * len(names), problems), strict=True):
            if column is None:
                continue
            cells = file.read(columns=[name]).column(0)
            numeric = pa.types.is_floating(cells.type) or pa.types.is_integer(cells.type)
            if column.field is None:
                if not numeric or check_numbers(column, place, problems):
                    texts = ["" if cell is None else str(cell) for cell in cells.to_pylist()]
                    found.labels[name] = _label(texts)
                continue
            if not numeric:
                problems.add(place, name, f"holds {cells.type}, not numbers")
                continue
            if cells.null_count:
                problems.add(place, name, f"has {cells.null_count} empty cells; every design needs a value")
                continue
            values = _converted(cells.cast(pa.float64()).to_numpy(), column)
            for row, message in _check_values(values, column.field):
                alike.add("rows", place, name, f"row {row + 1}: {message}")
            found.columns[column.field.name] = np.ascontiguousarray(values)
    except (pa.ArrowException, OSError) as error:
        raise refuse(label, f"cannot be read as Parquet ({shorten(str(error), 100)})") from None
    alike.finish()
    return found


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


def _read_csv(path: Path, problems: ProblemList) -> DesignList:
    """Return the designs of a CSV file.

    Parameters
    ----------
    path : Path
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
            return _CsvReader(stream, path, problems).read()
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


class _CsvReader:
    def __init__(self, stream: TextIO, path: Path, problems: ProblemList) -> None:
        self.lines = _Lines(stream)
        self.path = path
        self.label = str(path)
        self.problems = problems
        self.alike = _Alike(problems)
        self.columns: list[TableColumn | None] = []
        self.numbers: dict[str, list[np.ndarray]] = {}
        self.texts: dict[str, list[str]] = {}
        self.rows: list[list[str]] = []
        self.origins: list[tuple[int, str]] = []
        self.count = 0
        self.delimiter = ","

    def read(self) -> DesignList:
        """Read everything; with mistakes in the header or the cells the result is not usable."""
        lines = iter(self.lines)
        header = next((line for line in lines if line.strip()), None)
        if header is None:
            raise refuse(self.label, "is empty; the first line must hold the column names")
        self.delimiter = next((sign for sign in ",;\t" if sign in header), ",")
        before = len(self.problems.problems)
        places: list[Place] = []
        try:
            names = [cell.strip() for cell in next(csv.reader([header], delimiter=self.delimiter))]
            places = [self.place(self.lines.number, header, index) for index in range(len(names))]
            self.columns = read_header(names, places, self.problems)
            for row in csv.reader(lines, delimiter=self.delimiter):
                if not row or (len(row) == 1 and not row[0].strip()):
                    continue
                self.take(row)
        except csv.Error as error:
            raise refuse(self.label, f"cannot be read as CSV ({error})", self.lines.number, 1) from None
        self.flush()
        self.alike.finish()
        if self.count == 0 and len(self.problems.problems) == before:
            raise refuse(self.label, "has no rows below the column names")
        for column, place in zip(self.columns, places, strict=True):
            if column is not None and column.field is None and _are_numbers(self.texts.get(column.name, [])):
                check_numbers(column, place, self.problems)
        numbers = {name: np.concatenate(parts) for name, parts in self.numbers.items()}
        return DesignList(self.path.name, numbers, {name: _label(texts) for name, texts in self.texts.items()})

    def take(self, row: list[str]) -> None:
        if len(row) != len(self.columns):
            message = f"has {len(row)} cell{'' if len(row) == 1 else 's'}; the first line has {len(self.columns)}"
            if self.delimiter == "," and len(row) > len(self.columns):
                message += " (numbers need a decimal point, and text with a comma needs quotation marks)"
            self.alike.add("lines", Place(self.label, self.lines.number, 1), "", message)
            return
        self.count += 1
        if self.count > MAX_TABLE_ROWS:
            raise refuse(self.label, f"has more than {MAX_TABLE_ROWS} rows", self.lines.number, 1)
        self.rows.append(row)
        self.origins.append((self.lines.number, self.lines.text))
        if len(self.rows) >= CSV_CHUNK:
            self.flush()

    def flush(self) -> None:
        """Convert and check the rows read since the last time."""
        if not self.rows:
            return
        for index, column in enumerate(self.columns):
            if column is None:
                continue
            cells = [row[index] for row in self.rows]
            if column.field is None:
                self.texts.setdefault(column.name, []).extend(cells)
                continue
            values = _converted(self.convert(cells, index, column), column)
            for row, message in _check_values(values, column.field):
                if not np.isnan(values[row]):  # those have been reported as they were read
                    self.alike.add("cells", self.place(*self.origins[row], index), column.name, message)
            self.numbers.setdefault(column.field.name, []).append(values)
        self.rows.clear()
        self.origins.clear()

    def convert(self, cells: list[str], index: int, column: TableColumn) -> np.ndarray:
        """Return cells as numbers, NaN for those that are none (they are reported)."""
        if not any("_" in cell or "n" in cell.lower() for cell in cells):
            try:
                return np.array([float(cell) for cell in cells])  # the usual case, fast
            except ValueError:
                pass
        assert column.field is not None
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            if _DECIMAL_COMMA.fullmatch(cell):
                message = f"'{shorten(cell)}' has a decimal comma; save the file with decimal points"
                self.alike.add("", self.place(*self.origins[row], index), "", message, most=1)
                continue
            try:
                number, unit = split_number(cell, column.field.unit)
                if unit:
                    raise NumberError(f"'{shorten(cell)}' has a unit; units belong in the column's name")
                values[row] = float(number)
            except (NumberError, OverflowError) as error:
                self.alike.add("cells", self.place(*self.origins[row], index), column.name, str(error))
        return values

    def place(self, line: int, text: str, index: int) -> Place:
        """Return where a cell begins; with quotation marks in the line, only the line is certain."""
        if '"' in text:
            return Place(self.label, line)
        cells = text.split(self.delimiter)
        return Place(self.label, line, sum(len(cell) + 1 for cell in cells[:index]) + 1)


def _are_numbers(cells: list[str]) -> bool:
    """Whether every cell that is not empty holds a plain number, and there is one."""
    filled = [cell for cell in cells if cell.strip()]
    try:
        return bool(filled) and all(np.isfinite(float(cell)) for cell in filled)
    except ValueError:
        return False
