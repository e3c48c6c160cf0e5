"""Parquet files that a user names, opened in one way: plain columns only, and no more bytes than a table may have.

Packed, a page of a thousand bytes can hold gigabytes, and a word that stands once can stand in every row. What the
columns take once they are unpacked is added up from the heads of their pages before one is unpacked: the footer may say
less, and pyarrow believes the page. Text is read as words and codes, so that no word is repeated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from typing import IO, TYPE_CHECKING

from boulder_sweep.text import printable, size_text

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

MOST_COLUMNS = 2000
"""Twice as many as a list of designs may have: a result has its own beside them."""
MOST_ROWS = 20_000_000
MOST_BYTES = 400_000_000
"""Most bytes of a file once it is unpacked."""
LONGEST_WORD = 1000
"""Most characters of a word in a column of text."""
_WIDEST_NUMBER = 32
"""Width of the widest decimal number [bytes]."""
_FLOAT, _CODE = 8, 4
"""Widths of a number as it is used, and of the code of a word [bytes]."""
_MARKS = {"RLE", "BIT_PACKED"}
"""Encodings of what marks empty cells."""
_CODED = {"PLAIN", "PLAIN_DICTIONARY", "RLE_DICTIONARY"} | _MARKS
"""Encodings of text that pyarrow reads as codes."""
_SPELLED = {"DELTA_LENGTH_BYTE_ARRAY"} | _MARKS
"""Encodings of text of which no word takes more bytes than its page. By DELTA_BYTE_ARRAY a word repeats the beginning
of the word before, and may be of any length."""
_MOST_PAGES = 100_000
"""Most pages of a piece of a column: every one has a head that is read."""
_USUAL_HEAD, _LONGEST_HEAD = 256, 65_536
"""Bytes that nearly every head of a page fits in, and most of one, which may hold its smallest and largest word."""
_REMEDY = "write it again with pandas.DataFrame.to_parquet"


class ParquetError(Exception):
    """A file cannot be read as Parquet; the text says why, without the name of the file."""


class ParquetLimitError(ParquetError):
    """A file holds what no table of designs does: nested columns, long words, too many rows or bytes."""


class TableFile:
    """A Parquet file of plain columns; its rows are not read yet.

    It may have no more than `most_rows`; the columns that are read take at most `most_bytes`, each number as eight, and
    their text at most `most_text` where every row spells its words. In the schema, a column of text is a dictionary of
    words. Raise `ParquetError` where it is no Parquet file, or damaged, and `ParquetLimitError` where a column is
    nested or of a type that no table has, or there are too many rows or columns.
    """

    def __init__(
        self,
        source: IO[bytes] | pa.NativeFile,
        most_rows: int = MOST_ROWS,
        most_bytes: int = MOST_BYTES,
        most_text: float = MOST_BYTES,
    ) -> None:
        import pyarrow.parquet as pq  # takes a third of a second to import: only where there is such a file
        import pyarrow.types as kinds

        self._source, self._most_bytes, self._most_text = source, most_bytes, most_text
        self._taken, self._text = 0, 0
        with _in_words():
            self._opened = partial(pq.ParquetFile, page_checksum_verification=True)
            self._file = self._opened(source)
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
                stored = footer.schema.column(index) if kinds.is_decimal(field.type) else None
                if stored and (stored.physical_type == "BYTE_ARRAY" or stored.length > _WIDEST_NUMBER):
                    raise ParquetLimitError(f"column {_shown(field.name)} holds decimals of any length; {_REMEDY}")
            self._check_chunks()
            self._groups = [footer.row_group(number) for number in range(footer.num_row_groups)]
            if sum(group.num_rows for group in self._groups) != self.rows:
                raise ParquetError("is damaged: it says two numbers of rows")
            self._strings = {field.name for field in self.schema if _is_string(field.type)}
            if self._strings:
                self._file = self._opened(source, metadata=footer, read_dictionary=[*self._strings])
                self.schema = self._file.schema_arrow

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return all rows, of the named columns or of all.

        Raise `ParquetError` where the file is damaged, and `ParquetLimitError` where the columns have too many bytes,
        or a word is too long.
        """
        with _in_words():
            spelled = self._check_bytes(columns)
            file = self._file
            if spelled:
                file = self._opened(self._source, metadata=file.metadata, read_dictionary=[*(self._strings - spelled)])
            table = file.read(columns, use_threads=False)  # parts of a result are read in parallel already
            for index, name in enumerate(table.column_names):
                if name in spelled:
                    table = table.set_column(index, self.schema.field(name), table[name].dictionary_encode())
            if len(table) != self.rows:
                raise ParquetError(f"is damaged: it has {len(table):,} rows, and says {self.rows:,}")
            for name, column in zip(table.column_names, table.columns, strict=True):
                if _is_text(column.type):
                    self._check_words(name, column)
            return table

    def _check_chunks(self) -> None:
        """Have pyarrow look at what the footer says of every piece of a column, where it can refuse it.

        Asked for a single damaged piece, it ends the process. A read of all looks at them first, in one go, and then
        meets a file that was closed. Nothing of Python is called in this: a thread of pyarrow that still calls Python
        when the process ends would end it with an abort.
        """
        import pyarrow as pa

        unread = pa.BufferReader(pa.allocate_buffer(self._source.seek(0, 2)))
        file = self._opened(unread, metadata=self._file.metadata, pre_buffer=True)
        unread.close()
        try:
            file.read(use_threads=False)
        except pa.ArrowInvalid as problem:
            if "closed" not in str(problem):
                raise

    def _check_bytes(self, columns: Sequence[str] | None) -> set[str]:
        """Add up the unpacked bytes of columns before reading; return text that pyarrow cannot read as codes."""
        spelled = set()
        wanted = self.schema.names if columns is None else set(columns)
        for index, field in enumerate(self.schema):
            if field.name not in wanted:
                continue
            is_text = _is_text(field.type)
            encodings: set[str] = set()
            for group in self._groups:
                stored = group.column(index)
                if stored.num_values != group.num_rows:
                    raise ParquetError(f"is damaged: column {_shown(field.name)} has not one value in each row")
                encodings.update(stored.encodings)
                values, unpacked = group.num_rows * (_width(field.type) or _CODE), self._unpacked(stored, field.name)
                self._taken += values + unpacked if is_text else max(values, unpacked)
                if self._taken > self._most_bytes:
                    most = size_text(self._most_bytes)
                    raise ParquetLimitError(f"has more than {most} once unpacked, up to column {_shown(field.name)}")
            if is_text and not encodings <= _CODED:
                if not encodings <= _SPELLED:
                    raise ParquetLimitError(
                        f"column {_shown(field.name)} is text in an encoding that is not read; {_REMEDY}"
                    )
                spelled.add(field.name)
        return spelled

    def _unpacked(self, stored: pq.ColumnChunkMetaData, name: str) -> int:
        """Add up the bytes that the pages of a piece of a column take once they are unpacked."""
        at = min(filter(None, (stored.dictionary_page_offset, stored.data_page_offset)))
        end, total = at + stored.total_compressed_size, 0
        for _ in range(_MOST_PAGES):
            if at == end:
                return total
            head, length = self._head(at, end)
            unpacked, packed = head[2], head[3]
            if min(unpacked, packed) < 0 or at + length + packed > end:
                raise ParquetError(f"is damaged: a page of column {_shown(name)} is longer than its column")
            total += unpacked
            at += length + packed
        raise ParquetLimitError(f"column {_shown(name)} is in more than {_MOST_PAGES:,} pages; {_REMEDY}")

    def _head(self, at: int, end: int) -> tuple[dict[int, int], int]:
        """Return the whole numbers in the head of a page, and its length, see `_whole_numbers`."""
        for longest in (_USUAL_HEAD, _LONGEST_HEAD):
            self._source.seek(at)
            data = self._source.read(min(longest, end - at))
            with suppress(IndexError):  # it is longer
                return _whole_numbers(data, 0, 3)
        raise LookupError("no head of a page")

    def _check_words(self, name: str, column: pa.ChunkedArray) -> None:
        """Refuse words that are too long, or too many rows of long ones."""
        import pyarrow.compute as pc

        for chunk in column.chunks:
            longest = pc.max(pc.utf8_length(chunk.dictionary)).as_py() or 0
            if longest > LONGEST_WORD:
                said = f"has a word of {longest:,} characters; a word may have {LONGEST_WORD:,}"
                raise ParquetLimitError(f"column {_shown(name)} {said}")
            sizes = pc.binary_length(chunk.dictionary)
            text = len(chunk) * (pc.max(sizes).as_py() or 0)
            if self._text + text > self._most_text:  # at most; now exactly
                text = pc.sum(sizes.take(chunk.indices)).as_py() or 0
            self._text += text
            if self._text > self._most_text:
                most = size_text(self._most_text)
                raise ParquetLimitError(f"has more than {most} of text, up to column {_shown(name)}")


def _whole_numbers(data: bytes, at: int, depth: int) -> tuple[dict[int, int], int]:
    """Return the whole numbers in a record by the numbers of their fields, and the position behind it.

    The record is in the compact protocol of Apache Thrift, in which Parquet writes the heads of its pages: field 2 is
    the size of a page once it is unpacked, and field 3 its size in the file [bytes].
    """
    found, field = {}, 0
    while start := data[at]:
        kind, step, at = start & 15, start >> 4, at + 1
        if step:
            field += step
        else:
            number, at = _unsigned(data, at)
            field = (number >> 1) ^ -(number & 1)  # its lowest bit is its sign
        if kind in (4, 5, 6):
            number, at = (data[at], at + 1) if data[at] < 128 else _unsigned(data, at)
            found[field] = (number >> 1) ^ -(number & 1)
        elif kind == 8:
            size, at = _unsigned(data, at)
            at += size
        elif kind == 12 and depth:
            at = _whole_numbers(data, at, depth - 1)[1]
        elif kind in (3, 7):
            at += 1 if kind == 3 else 8
        elif kind not in (1, 2):  # true and false are their own kinds
            raise ValueError("no head of a page")
    return found, at + 1


def _unsigned(data: bytes, at: int) -> tuple[int, int]:
    """Return a number of seven bits a byte, the lowest first, and the position behind it."""
    number = 0
    for place in range(10):
        number |= (data[at + place] & 127) << 7 * place
        if data[at + place] < 128:
            return number, at + place + 1
    raise ValueError("a number of more than 64 bits")


@contextmanager
def _in_words() -> Iterator[None]:
    """Raise whatever pyarrow does as `ParquetError`: of a damaged file, it raises almost anything.

    A file system that fails gives its errors a number, and these pass.
    """
    import pyarrow as pa

    try:
        yield
    except MemoryError as problem:
        raise ParquetError("takes more memory than there is") from problem
    except (pa.ArrowException, OSError, ValueError, LookupError, OverflowError) as problem:
        if isinstance(problem, OSError) and problem.errno is not None:
            raise
        raise ParquetError("cannot be read as Parquet: it is damaged, or of another kind") from problem


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
