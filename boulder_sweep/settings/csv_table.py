"""A CSV file of designs: one row per design, plain numbers in the units that the column names say."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np

from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.numbers import NumberError, split_number
from boulder_sweep.settings.problems import Place, ProblemList, shorten
from boulder_sweep.settings.source import refuse
from boulder_sweep.settings.table import MAX_TABLE_ROWS, check_header, check_values

_CHUNK = 20_000


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


def read_csv(path: Path, problems: ProblemList) -> dict[str, np.ndarray]:
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
            return _Reader(stream, label, problems).read()
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None


class _Reader:
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
        if len(self.rows) >= _CHUNK:
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
