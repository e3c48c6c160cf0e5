"""Parquet files that a user names, opened in one way: plain columns only, and no more bytes than a table may have.

Packed, a page of a thousand bytes can hold gigabytes, and a word that stands once can stand in every row. What the
footer says of sizes is not believed: the reader allocates memory by the headers of the pages, so these are added up
before a row is read. Text is read as words and codes, so that no word is repeated.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from typing import IO, TYPE_CHECKING, Any

from boulder_sweep.text import printable, size_text

if TYPE_CHECKING:
    import pyarrow as pa

MOST_COLUMNS = 2000
"""Twice as many as a list of designs may have: a result has its own beside them."""
MOST_ROWS = 20_000_000
MOST_BYTES = 400_000_000
"""Most bytes of a file once it is unpacked."""
LONGEST_WORD = 1000
"""Most characters of a word in a column of text."""
_MOST_PAGES = 200_000
"""Most pages of a file: those of 20 million rows of 200 columns, as pyarrow cuts them."""
_WIDEST_NUMBER = 32
"""Width of the widest decimal number [bytes]."""
_FLOAT, _CODE = 8, 4
"""Widths of a number as it is used, and of the code of a word [bytes]."""
_HEADER_BYTES = 256
"""What is read at first of the header of a page, which is mostly shorter."""
_LONGEST_HEADER = 16 << 20
"""Longest header of a page that pyarrow takes [bytes]."""
_DEEPEST = 8
"""Most levels of a header; it has three."""
_OF_ROWS = {0: (5, 2), 3: (8, 4)}
"""By the types of pages that hold rows: the field of the header that describes them, and therein the encoding."""
_NUMBER, _SMALL = rb"([\x80-\xff]{0,4}[\0-\x7f])", rb"\x15([\0-\x7f])"
_USUAL_PAGE = re.compile(
    rb"\x15\0\x15%b\x15%b(?:\x15%b\x1c|\x2c)\x15%b" % ((_NUMBER,) * 4)  # sizes, checksum, rows
    + _SMALL * 3  # encodings: of the values, and how empty cells are marked
    + rb"(?:\x1c(?:[\x18\x28]\x08.{8}|[\x16\x36][\x80-\xff]{0,9}[\0-\x7f]|\x11)*\0)?\0\0",  # extremes, empty cells
    re.DOTALL,
)
"""Header of nearly every page of a result, which `_struct` reads as well, but ten times slower."""
_DELTA_LENGTH_BYTE_ARRAY = 6
_CODED, _SPELLED = {-1, 0, 2, 3, 8}, {-1, 0, _DELTA_LENGTH_BYTE_ARRAY}
"""Encodings of text that pyarrow reads as codes, and of words that take no more bytes than their pages; -1: of none.
By DELTA_BYTE_ARRAY a word repeats the beginning of the word before, and may be of any length."""
_LONGEST_REASON = 150
_Fields = dict[tuple[int, ...], int]
"""Numbers in a header, by those of the field and of the structs around it."""
_REMEDY = "write it again with pandas.DataFrame.to_parquet"


class ParquetError(Exception):
    """A file cannot be read as Parquet; the text says why, without the name of the file."""


class ParquetLimitError(ParquetError):
    """A file holds what no table of designs does: nested columns, long words, too many rows or bytes."""


class TableFile:
    """A Parquet file of plain columns; its rows are not read yet.

    Parameters
    ----------
    source
        The opened file.
    most_rows
        Most rows that it may have.
    most_bytes
        Most bytes that the columns may take that are read, each number as eight.
    most_text
        Most bytes that their text may take where every row spells its words.

    Attributes
    ----------
    schema : pyarrow.Schema
        Names and types; a column of text is a dictionary of words.
    rows : int
        Number of rows.

    Raises
    ------
    ParquetError
        It is no Parquet file, or damaged.
    ParquetLimitError
        A column is nested or of a type that no table has, or there are too many rows or columns.
    """

    def __init__(
        self,
        source: IO[bytes] | pa.NativeFile,
        most_rows: int = MOST_ROWS,
        most_bytes: int = MOST_BYTES,
        most_text: float = MOST_BYTES,
    ) -> None:
        import pyarrow.parquet as pq  # takes a third of a second to import: only where there is such a file

        self._source, self._most_bytes, self._most_text = source, most_bytes, most_text
        self._taken, self._text, self._pages = 0, 0, 0
        with _in_words():
            self._opened = partial(pq.ParquetFile, source, page_checksum_verification=True)
            self._file = self._opened()
            footer, self.schema = self._file.metadata, self._file.schema_arrow
            self.rows: int = footer.num_rows
            if len(self.schema) > MOST_COLUMNS:
                raise ParquetLimitError(f"has {len(self.schema):,} columns; at most {MOST_COLUMNS:,} are read")
            for field in self.schema:
                if _width(field.type) is None:
                    held = f"holds {_shown(str(field.type))}; a table has plain columns of numbers and text only"
                    raise ParquetLimitError(f"column {_shown(field.name)} {held}")
            if self.rows > most_rows:
                raise ParquetLimitError(f"has {self.rows:,} rows; at most {most_rows:,} are read")
            for index, field in enumerate(self.schema):
                stored = footer.schema.column(index) if _is_decimal(field.type) else None
                if stored and (stored.physical_type == "BYTE_ARRAY" or stored.length > _WIDEST_NUMBER):
                    raise ParquetLimitError(f"column {_shown(field.name)} holds decimals of any length; {_REMEDY}")
            self._groups = [footer.row_group(number) for number in range(footer.num_row_groups)]
            if sum(group.num_rows for group in self._groups) != self.rows:
                raise ParquetError("is damaged: it says two numbers of rows")
            self._strings = {field.name for field in self.schema if _is_string(field.type)}
            if self._strings:
                self._file = self._opened(metadata=footer, read_dictionary=[*self._strings])
                self.schema = self._file.schema_arrow

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return all rows, of the named columns or of all.

        Raises
        ------
        ParquetError
            The file is damaged.
        ParquetLimitError
            The columns have too many bytes, or a word is too long.
        """
        with _in_words():
            spelled = self._check_bytes(columns)
            file = self._file
            if spelled:
                file = self._opened(metadata=file.metadata, read_dictionary=[*(self._strings - spelled)])
            table = file.read(columns, use_threads=False)  # parts of a result are read in parallel already
            for index, name in enumerate(table.column_names):
                if name in spelled:
                    table = table.set_column(index, self.schema.field(name), table[name].dictionary_encode())
            if len(table) != self.rows:
                raise ParquetError(f"is damaged: it has {len(table):,} rows, and says {self.rows:,}")
            for name, column in zip(table.column_names, table.columns, strict=True):
                if _is_text(column.type):
                    self._check_words(_shown(name), column)
            return table

    def _check_bytes(self, columns: Sequence[str] | None) -> set[str]:
        """Add up what columns take unpacked, before any is; return those of words that pyarrow cannot read as codes."""
        spelled = set()
        wanted = self.schema.names if columns is None else set(columns)
        for index, field in enumerate(self.schema):
            if field.name not in wanted:
                continue
            is_text, width = _is_text(field.type), _width(field.type) or _CODE
            shown = _shown(field.name)
            encodings = set()
            for group in self._groups:
                rows, unpacked = 0, 0
                for size, held, encoding in _pages(self._source, group.column(index)):
                    rows, unpacked = rows + held, unpacked + size
                    self._pages += 1
                    if self._pages > _MOST_PAGES:
                        raise ParquetLimitError(f"is cut into more than {_MOST_PAGES:,} pages; {_REMEDY}")
                    encodings.add(encoding)
                if rows != group.num_rows:
                    raise ParquetError(f"is damaged: column {shown} has {rows:,} rows, and says {group.num_rows:,}")
                values = rows * width
                self._taken += values + unpacked if is_text else max(values, unpacked)
                if self._taken > self._most_bytes:
                    most = size_text(self._most_bytes)
                    raise ParquetLimitError(f"has more than {most} once unpacked, up to column {shown}")
            if is_text and _DELTA_LENGTH_BYTE_ARRAY in encodings:
                spelled.add(field.name)
            if is_text and not encodings <= (_SPELLED if field.name in spelled else _CODED):
                raise ParquetLimitError(f"column {shown} is text in an encoding that is not read; {_REMEDY}")
        return spelled

    def _check_words(self, shown: str, column: pa.ChunkedArray) -> None:
        """Refuse words that are too long, or too many rows of long ones."""
        import pyarrow.compute as pc

        for chunk in column.chunks:
            longest = pc.max(pc.utf8_length(chunk.dictionary)).as_py() or 0
            if longest > LONGEST_WORD:
                said = f"has a word of {longest:,} characters; a word may have {LONGEST_WORD:,}"
                raise ParquetLimitError(f"column {shown} {said}")
            sizes = pc.binary_length(chunk.dictionary)
            text = len(chunk) * (pc.max(sizes).as_py() or 0)
            if self._text + text > self._most_text:  # at most; now exactly
                text = pc.sum(sizes.take(chunk.indices)).as_py() or 0
            self._text += text
            if self._text > self._most_text:
                most = size_text(self._most_text)
                raise ParquetLimitError(f"has more than {most} of text, up to column {shown}")


@contextmanager
def _in_words() -> Iterator[None]:
    """Raise whatever pyarrow does as `ParquetError`: of a damaged file, it raises almost anything."""
    import pyarrow as pa

    try:
        yield
    except (pa.ArrowException, OSError, ValueError, LookupError, OverflowError, MemoryError) as problem:
        said = printable(" ".join(str(problem).split())[:_LONGEST_REASON]) or "memory is short"
        raise ParquetError(f"cannot be read as Parquet ({said})") from problem


def _shown(name: str) -> str:
    """Return a name or a type, fit to be shown."""
    return printable(name if len(name) <= 80 else f"{name[:77]}...")


@lru_cache(maxsize=64)
def _width(kind: pa.DataType) -> int | None:
    """Return the bytes of a value, which becomes a float or a code; None for a type that no table has."""
    import pyarrow.types as kinds

    if _is_text(kind) or _is_string(kind):
        return _CODE
    if kinds.is_dictionary(kind):
        kind = kind.value_type
    if kinds.is_null(kind):
        return _FLOAT
    if kinds.is_primitive(kind) or kinds.is_decimal(kind):
        return max(int(kind.bit_width) // 8, _FLOAT)
    return None


@lru_cache(maxsize=64)
def _is_text(kind: pa.DataType) -> bool:
    """Whether a column is words and codes."""
    import pyarrow.types as kinds

    return bool(kinds.is_dictionary(kind) and _is_string(kind.value_type))


@lru_cache(maxsize=64)
def _is_string(kind: pa.DataType) -> bool:
    import pyarrow.types as kinds

    return bool(kinds.is_string(kind) or kinds.is_large_string(kind))


@lru_cache(maxsize=64)
def _is_decimal(kind: pa.DataType) -> bool:
    import pyarrow.types as kinds

    return bool(kinds.is_decimal(kind))


def _pages(source: IO[bytes] | pa.NativeFile, chunk: Any) -> Iterator[tuple[int, int, int]]:
    """Yield unpacked bytes, rows (0 of a dictionary) and encoding of the pages of a column."""
    at, left = chunk.data_page_offset, chunk.num_values
    if chunk.has_dictionary_page and 0 < chunk.dictionary_page_offset < at:
        at = chunk.dictionary_page_offset
    while left > 0:
        source.seek(at)
        content = source.read(_HEADER_BYTES)
        if usual := _USUAL_PAGE.match(content):
            unpacked, packed, rows = _usual(usual[1]), _usual(usual[2]), _usual(usual[4])
            encoding, length = usual[5][0] >> 1, usual.end()
        else:
            header, length = _header(source, at)
            unpacked, packed = header.get((2,), -1), header.get((3,), -1)
            described, encoded = _OF_ROWS.get(header.get((1,), -1), (0, 0))
            rows, encoding = header.get((described, 1), 0), header.get((described, encoded), -1)
        if unpacked < 0 or packed < 0 or rows < 0:
            raise ParquetError("is damaged: a page has no size")
        yield unpacked, rows, encoding
        left -= rows
        at += length + packed


def _usual(digits: bytes) -> int:
    """Return a signed integer of seven bits a byte; -1 for any that is negative."""
    value = 0
    for digit in reversed(digits):
        value = value << 7 | digit & 127
    return -1 if value & 1 else value >> 1


def _header(source: IO[bytes] | pa.NativeFile, at: int) -> tuple[_Fields, int]:
    """Return the header of a page (parquet.thrift: PageHeader), and its length."""
    size = _HEADER_BYTES
    while True:
        source.seek(at)
        content = source.read(size)
        try:
            fields: _Fields = {}
            return fields, _struct(content, 0, (), fields)
        except IndexError:
            if len(content) < size or size >= _LONGEST_HEADER:
                raise ParquetError("is damaged: it ends within a page") from None
            size *= 16


def _struct(content: bytes, at: int, above: tuple[int, ...], fields: _Fields) -> int:
    """Read the numbers in a struct of Thrift's compact protocol, and return where it ends."""
    number = 0
    while head := content[at]:
        kind, step = head & 15, head >> 4
        number, at = (number + step, at + 1) if step else _integer(content, at + 1)
        if kind in (4, 5, 6):
            fields[*above, number], at = _integer(content, at)
        elif kind == 8:
            length, at = _varint(content, at)
            at += length
        elif kind == 12 and len(above) < _DEEPEST:
            at = _struct(content, at, (*above, number), fields)
        elif kind not in (1, 2):  # true and false have no more bytes
            raise ParquetError("is damaged: a page has no header")
    return at + 1


def _integer(content: bytes, at: int) -> tuple[int, int]:
    """Read a signed integer, and where it ends."""
    value, at = _varint(content, at)
    return (value >> 1) ^ -(value & 1), at


def _varint(content: bytes, at: int) -> tuple[int, int]:
    """Read an unsigned integer of seven bits a byte, and where it ends."""
    value = shift = 0
    while (byte := content[at]) > 127:
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if shift > 63:
            raise ParquetError("is damaged: a page has no header")
    return value | byte << shift, at + 1
