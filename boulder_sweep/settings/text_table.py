"""Tables as people have them: lists of designs, crash pulses and measured curves, read as rows of cells in one way.

Blank rows, commas at the ends of rows and the numbers of rows that pandas writes in front are left out. Where a comma
does not separate cells, it may be the decimal sign of the whole file. Nothing is read without a limit: on the bytes of
a file, its lines, its columns, and the characters of a row.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from typing import TextIO

import numpy as np

from boulder_sweep.locations import Location, opened
from boulder_sweep.settings.problems import Alike, Position, ProblemList, cell_position, refuse, shorten
from boulder_sweep.settings.values import NumberError, split_number

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
    """Rows of cells below a row of names.

    Parameters
    ----------
    label
        The file, for messages.
    rows
        All its rows, the names first.
    delimiter
        What separates cells; empty for a spreadsheet.
    known
        Names as a table may have them, for a message.
    problems
        Receives what is wrong, with its place.

    Attributes
    ----------
    names : list of str
        Names of the columns.
    positions : list of Position
        Where they stand.
    rows : iterator of Row
        The rows below, each with a cell for every name.

    Raises
    ------
    SettingsError
        It is empty, has too many columns, or has no names.
    """

    def __init__(
        self, label: str, rows: Iterator[Row], delimiter: str, known: Sequence[str], problems: ProblemList
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
        """Return where the cell of a column begins."""
        _, line, text = row
        index += self._first
        if self.delimiter:
            return cell_position(self.label, line, text, self.delimiter, index)
        return Position(self.label, line, index + 1)

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
                    self.problems.add(
                        Position(self.label, row[1]), "", "is not read beyond this line: too many mistakes"
                    )
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
        """Return the cells of a column as numbers, NaN for empty ones and for those that are none.

        Parameters
        ----------
        rows
            Some rows.
        index
            The column.
        key
            What it gives, for messages.
        unit
            What a message says is needed: the unit of an input.
        may_be_empty
            Whether empty cells are no mistake.
        """
        cells = self.cells(rows, index)
        text = "\n".join(cells)
        if self.delimiter in (";", "\t"):
            self._note_signs(text, rows, index)
            if "," in text:
                cells = [cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell for cell in cells]
        if text.isascii() and "_" not in text and "n" not in text.lower():
            try:
                gaps = may_be_empty and not all(cells)  # the usual case, fast
                return np.array([np.nan if gaps and not cell.strip() else float(cell) for cell in cells])
            except ValueError:
                pass
        values = np.full(len(cells), np.nan)
        for at, cell in enumerate(cells):
            if may_be_empty and not cell.strip():
                continue
            try:
                number, written = split_number(cell, unit)
                if written:
                    raise NumberError(f"'{shorten(cell)}' has a unit; units belong in the column's name")
                values[at] = float(number)
            except (NumberError, OverflowError) as error:
                self.alike.add("cells", self.position(rows[at], index), key, str(error))
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
            self.problems.add(position, "", f"{message}; {remedy}")
        elif "certain" not in self._seen:
            whole, _, decimals = (shorten(part) for part in cell.partition(","))
            message = f"'{shorten(cell)}' may be {whole}{decimals} or {whole}.{decimals}, and no other number tells"
            self.problems.add(position, "", f"{message}; write the numbers of this file without commas")

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
                    self.alike.add("lines", self.position(row, -self._first), "", message)
                    continue
                del cells[width:]
            if self._first:
                number = int(cells[0]) if cells[0].isascii() and cells[0].isdecimal() and len(cells[0]) < 18 else -1
                if number <= last:
                    message = "has no name, and does not count the rows; give it a name, or remove it"
                    self.alike.add("", unnamed, "the first column", message, most=1)
                last = number
            yield row


class _Lines:
    """Lines of a text without the comments (# ...); remembers the line that was read last."""

    def __init__(self, stream: TextIO, label: str, most: int) -> None:
        self.stream, self.label, self.most = stream, label, most
        self.number = 0
        self.text = ""
        self.taken, self.begun = 0, 1
        """Characters since the last row, and the line behind it."""

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
def open_text(path: Location, most_lines: int, known: Sequence[str], problems: ProblemList) -> Iterator[TextTable]:
    """Open a text file as a table.

    Parameters
    ----------
    path
        UTF-8; comma, semicolon or tab between the cells, the first line the column names. Lines that begin with # and
        blank rows are skipped.
    most_lines
        Most lines that it may have.
    known
        Names as a table may have them, for a message.
    problems
        Receives mistakes with line and column of the cell.

    Raises
    ------
    SettingsError
        The file cannot be read at all, or not to its end.
    """
    label = str(path)
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


def _table_of(lines: _Lines, known: Sequence[str], problems: ProblemList) -> TextTable:
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
