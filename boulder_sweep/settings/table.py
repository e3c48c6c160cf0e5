"""``table: designs.csv`` or ``.parquet``: a list of designs, plain numbers in the units of the column names."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np

from boulder_sweep.columns import BY_NAME as TABLE_COLUMNS
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.settings.fields import INPUTS, Field
from boulder_sweep.settings.leaf import outside
from boulder_sweep.settings.numbers import NumberError, split_number
from boulder_sweep.settings.problems import Place, ProblemList, SettingsError, did_you_mean, shorten
from boulder_sweep.settings.source import check_regular_file, refuse
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.tree import Scalar

MAX_TABLE_BYTES = 2_000_000_000
MAX_TABLE_ROWS = 20_000_000
CSV_CHUNK = 20_000
"""Rows of a CSV file that are converted and checked at once."""
_KNOWN = {field.name: field for field in INPUTS}


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
        if suffix == ".csv":
            columns = _read_csv(path, problems)
        else:
            columns = _read_parquet(path, problems)
    except SettingsError as error:
        for problem in error.problems:
            inside = problem.line is not None
            place = Place(problem.file, problem.line, problem.column) if inside else node.place
            problems.add(place, "table", problem.message if inside else f"{problem.file}: {problem.message}")
        return None
    return None if len(problems.problems) > before or not columns else DesignList(path.name, columns)


def check_header(names: list[str], places: list[Place], problems: ProblemList) -> list[Field | None]:
    """Return the quantity of every column, None for those that cannot be used; mistakes go to `problems`."""
    fields: list[Field | None] = []
    for index, (name, place) in enumerate(zip(names, places, strict=True)):
        field = _KNOWN.get(name)
        message = ""
        if name in names[:index]:
            message = "is a second column of this name"
        elif name == "design_id":
            message = "designs are numbered by their order; remove this column or rename the table's columns"
        elif name in OUTCOME_COLUMNS:
            message = f"is an outcome of a run ({TABLE_COLUMNS[name].meaning}), not an input; remove this column"
        elif field is None:
            message = f"is not an input column (known: {', '.join(_KNOWN)}){did_you_mean(name, _KNOWN)}"
        if message:
            problems.add(place, shorten(name) or "(empty)", message)
        fields.append(None if message else field)
    return fields


def check_values(values: np.ndarray, field: Field, limit: int = 20) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for values that are not finite or not admitted, at most `limit` of them."""
    bound = field.admitted
    assert bound is not None
    wrong = np.flatnonzero(~((values >= bound.low) & (values <= bound.high)))[:limit]
    found = []
    for row in wrong:
        value = float(values[row])
        message = "is not a finite number" if not np.isfinite(value) else outside(value, field)
        found.append((int(row), message))
    return found


def _read_parquet(path: Path, problems: ProblemList) -> dict[str, np.ndarray]:
    # pyarrow takes a third of a second to import: only for tables in this format.
    import pyarrow as pa
    import pyarrow.parquet as pq

    label = str(path)
    try:
        file = pq.ParquetFile(path)
        rows = file.metadata.num_rows
        if rows > MAX_TABLE_ROWS:
            raise refuse(label, f"has {rows} rows; a table takes at most {MAX_TABLE_ROWS}")
        if rows == 0:
            raise refuse(label, "has no rows")
        names = list(file.schema_arrow.names)
        fields = check_header(names, [Place(label)] * len(names), problems)
        columns = {}
        for name, field in zip(names, fields, strict=True):
            if field is None:
                continue
            column = file.read(columns=[name]).column(0)
            if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
                problems.add(Place(label), name, f"holds {column.type}, not numbers")
                continue
            if column.null_count:
                problems.add(Place(label), name, f"has {column.null_count} empty cells; every design needs a value")
                continue
            values = column.cast(pa.float64()).to_numpy()
            for row, message in check_values(values, field):
                problems.add(Place(label), name, f"row {row + 1}: {message}")
            columns[name] = np.ascontiguousarray(values)
    except (pa.ArrowException, OSError) as error:
        raise refuse(label, f"cannot be read as Parquet ({shorten(str(error), 100)})") from None
    return columns


class _Lines:
    """Lines of a file with the comments (# ...) taken out; remembers the line that was read last."""

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


def _read_csv(path: Path, problems: ProblemList) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file.

    Parameters
    ----------
    path : Path
        UTF-8 text, comma, semicolon or tab between the cells, first line the column names. Lines that begin
        with # and empty lines are passed over.
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
            return _CsvReader(stream, label, problems).read()
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


class _CsvReader:
    def __init__(self, stream: TextIO, label: str, problems: ProblemList) -> None:
        self.lines = _Lines(stream)
        self.label = label
        self.problems = problems
        self.fields: list[Field | None] = []
        self.parts: dict[str, list[np.ndarray]] = {}
        self.rows: list[list[str]] = []
        self.origins: list[tuple[int, str]] = []
        self.count = 0
        self.delimiter = ","

    def read(self) -> dict[str, np.ndarray]:
        """Read everything; with mistakes in the header or the cells the result is not usable."""
        lines = iter(self.lines)
        header = next((line for line in lines if line.strip()), None)
        if header is None:
            raise refuse(self.label, "is empty; the first line must hold the column names")
        self.delimiter = next((sign for sign in ",;\t" if sign in header), ",")
        before = len(self.problems.problems)
        try:
            cells = next(csv.reader([header], delimiter=self.delimiter))
            names = [cell.strip() for cell in cells]
            places = [self.place(self.lines.number, header, index) for index in range(len(names))]
            self.fields = check_header(names, places, self.problems)
            self.parts = {field.name: [] for field in self.fields if field is not None}
            for row in csv.reader(lines, delimiter=self.delimiter):
                if not row or (len(row) == 1 and not row[0].strip()):
                    continue
                self.take(row)
        except csv.Error as error:
            raise refuse(self.label, f"cannot be read as CSV ({error})", self.lines.number, 1) from None
        self.flush()
        if self.count == 0 and len(self.problems.problems) == before:
            raise refuse(self.label, "has no rows below the column names")
        return {name: np.concatenate(parts) for name, parts in self.parts.items() if parts}

    def take(self, row: list[str]) -> None:
        if len(row) != len(self.fields):
            message = f"has {len(row)} cell{'' if len(row) == 1 else 's'}; the first line has {len(self.fields)}"
            self.problems.add(Place(self.label, self.lines.number, 1), "", message)
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
        for index, field in enumerate(self.fields):
            if field is None:
                continue
            values = self.convert([row[index] for row in self.rows], index, field)
            for row, message in check_values(values, field):
                if not np.isnan(values[row]):  # those have been reported as they were read
                    self.problems.add(self.place(*self.origins[row], index), field.name, message)
            self.parts[field.name].append(values)
        self.rows.clear()
        self.origins.clear()

    def convert(self, cells: list[str], index: int, field: Field) -> np.ndarray:
        """Return cells as numbers, NaN for those that are none (they are reported)."""
        if not any("_" in cell or "n" in cell.lower() for cell in cells):
            try:
                return np.array([float(cell) for cell in cells])  # the usual case, fast
            except ValueError:
                pass
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            try:
                number, unit = split_number(cell, field.unit)
                if unit:
                    raise NumberError(f"'{shorten(cell)}' has a unit; the column is in {field.unit} by its name")
                values[row] = float(number)
            except (NumberError, OverflowError) as error:
                self.problems.add(self.place(*self.origins[row], index), field.name, str(error))
        return values

    def place(self, line: int, text: str, index: int) -> Place:
        """Return where a cell begins; with quotation marks in the line, only the line is certain."""
        if '"' in text:
            return Place(self.label, line)
        cells = text.split(self.delimiter)
        return Place(self.label, line, sum(len(cell) + 1 for cell in cells[:index]) + 1)
