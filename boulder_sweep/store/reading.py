"""The rows of a result: as one table in memory, or part by part, also while a run is writing into its folder.

Parts never change, and say everything of themselves. What is there when reading begins is what is read. A folder may
be a stranger's: what a part says is checked before it is used, and no part names a file.
"""

from __future__ import annotations

import os
import warnings
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from multiprocessing.pool import ThreadPool
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple, TypeVar

from boulder_sweep.columns import COLUMNS, OPTIONAL_COLUMNS, OUTCOMES, column_spec
from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.locations import Location, is_folder, location_of, names_in, opened, read_bytes
from boulder_sweep.parquet import ParquetError, ParquetLimitError, TableFile
from boulder_sweep.store import failures
from boulder_sweep.store.folder import PartFile, Ranges, hash_of, part_file, part_files
from boulder_sweep.store.provenance import (
    check_identity,
    common_in,
    differences,
    identity_in,
    is_own,
    judged_by,
    other_version,
)
from boulder_sweep.text import counted, why

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Found = TypeVar("Found")
_THREADS = min(8, os.cpu_count() or 1)
_MOST_PART_ROWS, _MOST_PART_BYTES = 100_000, 50_000_000
"""Most rows of a part, and bytes unpacked: three times as many as a full one has; several are read at once."""
_TOGETHER = 8
"""Parts whose rows become one piece of memory: pandas takes longer for many small ones, and they waste some."""
_MOST_ROWS = 2**63 - 1
CHANGED = "changed: its bytes do not have the hash in its name"


class Table(NamedTuple):
    """What every part says of its table."""

    identity: dict[str, Any]
    """What all rows have in common, see `provenance.identity`."""
    ranges: Ranges

    @property
    def described(self) -> dict[str, Any]:
        """Everything that must be equal for rows to belong to one table."""
        return self.identity | {"rows": self.ranges.rows, "parts": self.ranges.count}

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, which follow from the settings."""
        settings = self.identity["settings"]
        more = (*(name for name in OPTIONAL_COLUMNS if name in settings["inputs"]), *settings.get("labels", ()))
        return (*(spec.name for spec in COLUMNS), *more)


class PartSummary(NamedTuple):
    """What a part says of itself."""

    table: Table
    verdicts: dict[str, int]
    """Number of rows of each verdict and reason, from `part.verdict_counts`."""
    bytes: int
    """Size of its file."""


@dataclass
class Contents:
    """The parts in a folder: those that are intact, by their names, and what is wrong with the others."""

    intact: dict[PartFile, PartSummary] = field(default_factory=dict)
    damaged: dict[str, str] = field(default_factory=dict)


def contents(folder: Location) -> Contents:
    """Read every part of a folder: compare its bytes with its name, and what it says with its rows.

    Raise TwoResultsError where two intact parts hold the same rows, OtherVersionError where another version wrote
    them, StoreError where they cannot be read.
    """
    found, known = Contents(), dict[frozenset[Any], Table]()
    parts = _parts_in(folder)
    for part, described in zip(parts, _ahead(lambda part: _described(folder, part, known), parts), strict=True):
        if isinstance(described, str):
            found.damaged[part.name] = described
        else:
            found.intact[part] = described
    refuse_two(folder, list(found.intact))
    return found


def _ahead(read: Callable[[PartFile], Found], parts: Iterable[PartFile]) -> Iterator[Found]:
    """Yield what is read of each part, in their order, a few at a time.

    Nothing is begun after a failure, and neither an error nor the end of the process waits for these threads: a store
    may be silent.
    """
    left = iter(parts)
    with ThreadPool(_THREADS) as pool:  # hashes are computed without the interpreter's lock
        ahead = deque(pool.apply_async(read, (part,)) for part in islice(left, _THREADS))
        while ahead:
            found = ahead.popleft().get()
            ahead.extend(pool.apply_async(read, (part,)) for part in islice(left, 1))
            yield found


def _described(folder: Location, part: PartFile, known: dict[frozenset[Any], Table]) -> PartSummary | str:
    """Return what a part says of itself, or what is wrong with it; `known` are tables that were checked already."""
    try:
        content = read_bytes(folder / part.name)
    except OSError as problem:
        if isinstance(folder, Path):
            return f"cannot be read: {problem.strerror}"
        raise failures.StoreError(f"{folder} cannot be read: {why(problem)}") from None  # says nothing of the part
    try:
        file, table = _looked_at(folder, part, _source(content, part), known)
        return PartSummary(table, _own(folder, part, file, table), len(content))
    except (failures.DamagedError, ParquetError) as problem:
        return problem.what if isinstance(problem, failures.ImpossibleRecordsError) else str(problem)


def _source(content: bytes, part: PartFile) -> Any:
    """Return bytes of a part as what pyarrow reads, once they have the hash in its name."""
    import pyarrow as pa  # heavy, and only readers need it

    if hash_of(content) != part.hash:
        raise failures.DamagedError(CHANGED)
    return pa.BufferReader(content)


def _looked_at(
    folder: Location, part: PartFile, source: Any, known: dict[frozenset[Any], Table]
) -> tuple[TableFile, Table]:
    """Open a part; return its file, and what it says of its table."""
    file = TableFile(source, _MOST_PART_ROWS, _MOST_PART_BYTES)
    common = frozenset(common_in(file.schema.metadata).items())
    if common not in known:
        known[common] = _table_of(folder, part, file)
    return file, known[common]


def _table_of(folder: Location, part: PartFile, file: TableFile) -> Table:
    """Return what an opened part says of its table."""
    try:
        said = identity_in(common_in(file.schema.metadata))
        if other := other_version(said):
            raise failures.OtherVersionError(
                f"{folder} {other}. `sweep run` writes into another folder, or into this one once it is empty"
            )
        rows, count = (said.pop(key, None) for key in ("rows", "ranges"))
        check_identity(said)
        if not (type(rows) is type(count) is int and 1 <= count <= rows <= _MOST_ROWS):
            raise ValueError(f"a table of {rows} rows in {count} parts")
    except (ValueError, RecursionError) as problem:
        raise failures.ImpossibleRecordsError(folder / part.name, str(problem)) from None
    return Table(said, Ranges(rows, count))


def _own(folder: Location, part: PartFile, file: TableFile, table: Table) -> dict[str, int]:
    """Return the rows of an opened part by verdict, once it holds the rows that its name says, in all columns."""
    ranges = table.ranges
    try:
        said = identity_in({key: value for key, value in (file.schema.metadata or {}).items() if is_own(key)})
        bounds, verdicts = (part.first, part.stop), said.get("verdicts")
        if said.get("range") != [*bounds] or bounds not in ranges or file.rows != part.stop - part.first:
            raise ValueError(f"the rows {said.get('range')}, {file.rows} of {ranges.rows}")
        if not isinstance(verdicts, dict) or sum(_counts(verdicts)) != file.rows:
            raise ValueError("impossible counts")
        if {*file.schema.names} != {*table.columns}:
            raise ValueError("its columns do not follow from its settings")
    except (ValueError, RecursionError) as problem:
        raise failures.ImpossibleRecordsError(folder / part.name, str(problem)) from None
    return verdicts


def _counts(verdicts: Mapping[str, Any]) -> Iterator[int]:
    return (count if type(count) is int and count >= 0 else -_MOST_ROWS for count in verdicts.values())


def _parts_in(folder: Location) -> list[PartFile]:
    """Return the parts in a folder, in the order of their rows."""
    try:
        return part_files(names_in(folder))
    except NotADirectoryError:
        return []
    except OSError as problem:
        raise failures.StoreError(f"{folder} cannot be read: {why(problem)}") from None


def refuse_two(folder: Location, parts: Sequence[PartFile]) -> None:
    """Refuse two parts that hold the same rows by TwoResultsError."""
    seen: dict[int, PartFile] = {}
    for part in parts:
        other = seen.setdefault(part.first, part)
        if other is not part:
            raise failures.TwoResultsError(
                f"{folder} holds two different results for the same rows: {other.name} and {part.name}. `sweep run` of "
                f"its settings file with --resume removes a damaged one; if both are intact, remove the wrong one"
            )


def refuse_no_result(folder: Location) -> None:
    """Say by NotASweepError why a path without parts holds no result; StoreError where it cannot be read."""
    try:
        is_there = is_folder(folder)
    except OSError as problem:
        raise failures.StoreError(f"{folder} cannot be read: {why(problem)}") from None
    if is_there:
        raise failures.NotASweepError(f"{folder} is not the result of a sweep: no rows of it are finished")
    if not isinstance(folder, Path) or not folder.exists():
        raise failures.NotASweepError(
            f"there is no {folder}; the result of a run is a folder, such as m30-sizing.sweep"
        )
    if advice := failures.settings_file(folder):
        raise failures.NotASweepError(advice)
    advice = "; `sweep report`, `plot`, `export` and `compare` take a file of answers"
    if part_file(folder.name):
        advice = f": name the folder it lies in, {folder.resolve().parent}"
    elif folder.suffix.lower() != ".parquet":
        advice = ""
    raise failures.NotASweepError(f"{folder} is a file; the result of a run is a folder{advice}")


class FinishedRows:
    """The rows of a result that are finished now; later ones, of a run that is writing into its folder, are ignored.

    `rows` are the whole table's, `rows_done` the finished ones; `identity` is what all rows have in common, see
    `provenance`; `judged_by` says whose rules judged them, empty where this version's did: others are warned of.

    Raise NotASweepError where there is no result in the folder; DamagedError or OtherVersionError where no part can
    be read, two hold the same rows, or another version wrote them.
    """

    def __init__(self, folder: Location):
        self._folder = folder
        self._parts = _parts_in(folder)
        if not self._parts:
            refuse_no_result(folder)
        self._known = dict[frozenset[Any], Table]()
        with self._open(self._parts[0]) as source, self._in_words(self._parts[0]):
            file, self._table = _looked_at(folder, self._parts[0], source, self._known)
        self._schema = file.schema
        self.identity, ranges = self._table
        if strange := next((part for part in self._parts if (part.first, part.stop) not in ranges), None):
            raise self._damaged(strange, f"its rows are no part of a table of {ranges.rows:,} rows")
        refuse_two(folder, self._parts)
        self.rows, self.rows_done = ranges.rows, sum(part.stop - part.first for part in self._parts)
        self.columns = self._table.columns
        self.judged_by = judged_by(self.identity)
        if self.judged_by:
            warnings.warn(f"{folder} was {self.judged_by}", OlderRulesWarning, stacklevel=2)

    def tables(self, columns: Sequence[str] | None = None, *, verify: bool = True) -> Iterator[pa.Table]:
        """Yield all rows in the order of the designs, a part at a time; of all columns, or of some.

        Raise DamagedError where a part is truncated, of another run or, if its hash is to be verified, changed.
        """
        wanted = list(columns) if columns is not None else None
        return _ahead(lambda part: self._read(part, wanted, verify), self._parts)

    def row(self, number: int) -> pa.Table:
        """Return one row, from the one part that holds it.

        Raise IndexError where there is no such row, or not yet; DamagedError where its part is truncated, changed or
        of another run.
        """
        if not 0 <= number < self.rows:
            held = counted(self.rows, "design")
            raise IndexError(f"{self._folder} has {held}, numbered from 0; there is no {number}")
        at = bisect_right(self._parts, number, key=lambda part: part.first) - 1
        if at < 0 or number >= self._parts[at].stop:
            raise IndexError(f"design {number} has not been computed yet; `sweep run` with --resume goes on")
        return self._read(self._parts[at], None, verify=True).slice(number - self._parts[at].first, 1)

    def _open(self, part: PartFile) -> IO[bytes]:
        """Open the file of a part."""
        try:
            return opened(self._folder / part.name)
        except FileNotFoundError as problem:
            text = f"{self._folder} was changed while it was read: {part.name} is gone"
            raise failures.StoreError(text) from problem
        except OSError as problem:
            if isinstance(self._folder, Path):
                raise self._damaged(part, str(problem.strerror)) from problem
            raise failures.StoreError(f"{self._folder} cannot be read: {why(problem)}") from None

    def _read(self, part: PartFile, columns: list[str] | None, verify: bool) -> pa.Table:
        """Read columns of a part, or all of them."""
        with self._open(part) as source, self._in_words(part):
            checked = _source(source.read(), part) if verify else source
            file, other = _looked_at(self._folder, part, checked, self._known)
            if other is not self._table and (unlike := differences(self._table.described, other.described)):
                raise self._damaged(part, f"of another run: {unlike[0]}")
            if not file.schema.equals(self._schema):
                raise self._damaged(part, "its columns differ from the first part's")
            table = file.read(columns)
            _own(self._folder, part, file, self._table)
        return table if columns is None else table.select(columns)

    @contextmanager
    def _in_words(self, part: PartFile) -> Iterator[None]:
        """Say of what is wrong with a part which it is, and what to do."""
        try:
            yield
        except ParquetLimitError as problem:
            raise failures.ImpossibleRecordsError(self._folder / part.name, str(problem)) from problem
        except (OSError, ParquetError) as problem:
            raise self._damaged(part, str(problem)) from problem
        except failures.DamagedError as problem:
            raise self._damaged(part, CHANGED) if str(problem) == CHANGED else problem from None

    def _damaged(self, part: PartFile, what: str) -> failures.DamagedError:
        """Return the error that says what is damaged and what to do."""
        return failures.DamagedError(
            f"{self._folder} is damaged ({part.name}: {what}). `sweep run` of its settings file with --resume "
            f"recomputes damaged parts, and with --resume --dry-run lists them"
        )


def finished_table(folder: Location, columns: Sequence[str] | None = None, *, verify: bool = True) -> pa.Table:
    """Read the finished parts of a folder as one Arrow table; otherwise as `read`."""
    return _read(folder, columns, verify)[0]


def _read(folder: Location, columns: Sequence[str] | None, verify: bool) -> tuple[pa.Table, FinishedRows]:
    """Return the finished parts, in the order of the designs, and what is known of them."""
    import pyarrow as pa  # heavy, and only readers need it

    if isinstance(columns, str):
        raise TypeError(f"columns must be a list of names, such as [{columns!r}]")
    finished = FinishedRows(folder)
    if unknown := [name for name in columns or () if name not in finished.columns]:
        raise ValueError(f"{folder} has no column {unknown[0]!r}; its columns are {', '.join(finished.columns)}")
    parts, pieces = finished.tables(columns, verify=verify), []
    while some := list(islice(parts, _TOGETHER)):
        pieces.append(pa.concat_tables(some).combine_chunks())
    return pa.concat_tables(pieces), finished


def read(out: str | Location, columns: Sequence[str] | None = None, *, verify: bool = True) -> pd.DataFrame:
    """Read the result of a sweep.

    Parameters
    ----------
    out
        Folder that `boulder_sweep.run` or ``sweep run`` wrote, or is still writing; a path, or a URL such as
        ``s3://bucket/m30.sweep``.
    columns
        Names of the columns wanted; all by default.
    verify
        Compare every part with the hash in its name first: about a second per ten million rows.

    Returns
    -------
    pandas.DataFrame
        Rows in the order of the designs. ``.attrs`` contains ``units`` and ``meanings`` by column name,
        ``rows`` (of the whole table), ``complete`` (whether all of them are finished) and ``judged_by`` (whose
        rules judged them; empty where this version's did).

    Warns
    -----
    OlderRulesWarning
        The rows were judged by other rules.

    Raises
    ------
    NotASweepError
        There is no result in the folder.
    DamagedError
        A part is truncated, changed or of another run, or two hold the same rows.
    OtherVersionError
        The result was written by another version.
    LocationError
        The folder is a URL that cannot be read.
    ValueError
        The result has no such column.
    """
    table, finished = _read(location_of(out), columns, verify)
    # Split into blocks: consolidating columns of one type would copy the whole table once more.
    frame = table.to_pandas(split_blocks=True, self_destruct=True)
    for spec in OUTCOMES:
        if spec.type == "dictionary" and spec.name in frame:
            frame[spec.name] = _ordered(frame[spec.name], spec.words)
    frame.attrs = {
        "units": {name: column_spec(name).unit for name in frame.columns},
        "meanings": {name: column_spec(name).meaning for name in frame.columns},
        "rows": finished.rows,
        "complete": len(frame) == finished.rows,
        "judged_by": finished.judged_by,
    }
    return frame


def _ordered(words: pd.Series, known: Sequence[str]) -> pd.Series:
    """Return a column of words with the known ones first and the others sorted, whatever parts they come from."""
    there = list(words.cat.categories)
    wanted = [*(word for word in known if word in there), *sorted(set(there) - set(known))]
    return words.cat.reorder_categories(wanted)
