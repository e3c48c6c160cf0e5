"""The rows of a result: as one table in memory, or part by part, even while a run is writing into its folder.

Files never change, but a run that has all its rows replaces small parts by larger ones with the same rows, see
`writer`. A file that existed a moment ago may then be gone: its rows are looked up again in the new manifest.
"""

from __future__ import annotations

import os
import warnings
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from boulder_sweep.columns import OUTCOMES, column_spec
from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.locations import Location, RemotePath, location_of
from boulder_sweep.parquet import ParquetError, ParquetLimitError, TableFile
from boulder_sweep.store.failures import DamagedError, ImpossibleRecordsError, StoreError, refuse_to_guess
from boulder_sweep.store.files import MANIFEST_NAME
from boulder_sweep.store.manifest import Manifest, Part, load
from boulder_sweep.store.provenance import check_identity, judged_by
from boulder_sweep.store.verify import load_checked, wrong_bytes
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from concurrent.futures import Future

    import pandas as pd
    import pyarrow as pa

_THREADS = min(8, os.cpu_count() or 1)
_MOST_PART_ROWS, _MOST_PART_BYTES = 1_000_000, 150_000_000
"""Most rows of a part, and bytes unpacked: three times as many as a full one has; several are read at once."""


def read(out: str | Path | RemotePath, columns: Sequence[str] | None = None, *, verify: bool = True) -> pd.DataFrame:
    """Read the result of a sweep.

    Parameters
    ----------
    out
        Folder that `boulder_sweep.run` or ``sweep run`` wrote, or is still writing; a path, or a URL such as
        ``s3://bucket/m30.sweep``.
    columns
        Names of the columns wanted; all by default.
    verify
        Compare every part with its checksum first: about a second per ten million rows.

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
        A part is missing, truncated or changed.
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
    return words if wanted == there else words.cat.reorder_categories(wanted)


def finished_table(folder: Location, columns: Sequence[str] | None = None, *, verify: bool = True) -> pa.Table:
    """Read the finished parts of a folder as one Arrow table; otherwise as `read`."""
    return _read(folder, columns, verify)[0]


def read_row(folder: Location, design_id: int) -> pa.Table:
    """Read one row of a result, from the one part that holds it.

    Raises
    ------
    IndexError
        The table has no such row, or it is not computed yet.
    DamagedError
        The part is missing, truncated or changed.
    """
    finished = FinishedRows(folder)
    if not 0 <= design_id < finished.rows:
        held = counted(finished.rows, "design")
        raise IndexError(f"{folder} has {held}, numbered from 0; there is no {design_id}")
    row = finished.row(design_id)
    if row is None:
        raise IndexError(f"design {design_id} has not been computed yet; `sweep run` with --resume goes on")
    return row


def _read(folder: Location, columns: Sequence[str] | None, verify: bool) -> tuple[pa.Table, FinishedRows]:
    """Return the finished parts, in the order of the designs, and what is known of them."""
    import pyarrow as pa  # heavy, and only readers need it

    from boulder_sweep.store.schema import table_schema

    finished = FinishedRows(folder)
    known = finished.columns
    if unknown := [name for name in columns or () if name not in known]:
        raise ValueError(f"{folder} has no column {unknown[0]!r}; its columns are {', '.join(known)}")
    parts = list(finished.tables(columns, verify=verify))
    if not parts:
        more = [name for name in known if name not in table_schema().names]
        parts = [table_schema(more=more).empty_table().select(list(known if columns is None else columns))]
    return pa.concat_tables(parts), finished


class FinishedRows:
    """The rows of a result that are finished now; later ones are ignored.

    Parameters
    ----------
    folder
        The output folder; a run may be writing into it.

    Attributes
    ----------
    rows : int
        Rows of the whole table.
    rows_done : int
        Rows that are finished.
    columns : tuple of str
        Names of the columns.
    identity : dict
        What all rows have in common, see `provenance`.
    judged_by : str
        Whose rules judged the rows; empty where this version's did.

    Warns
    -----
    OlderRulesWarning
        The rows were judged by other rules.

    Raises
    ------
    NotASweepError
        There is no result in the folder.
    DamagedError, OtherVersionError
        Its manifest cannot be trusted, or another version wrote it.
    """

    def __init__(self, folder: Location):
        manifest = load(folder)
        try:
            check_identity(manifest.identity)
        except ValueError as problem:
            raise ImpossibleRecordsError(folder / MANIFEST_NAME, str(problem)) from None
        self.rows, self.rows_done, self.identity = manifest.rows, manifest.rows_done, manifest.identity
        self.columns = manifest.columns
        self.judged_by = judged_by(manifest.identity)
        if self.judged_by:
            warnings.warn(f"{folder} was {self.judged_by}", OlderRulesWarning, stacklevel=2)
        self._folder = folder
        self._schemas: dict[str, pa.Schema] = {}
        self._index = _Index(manifest)
        self._ranges = manifest.ranges

    def tables(self, columns: Sequence[str] | None = None, *, verify: bool = True) -> Iterator[pa.Table]:
        """Yield all rows in the order of the designs, about a part at a time.

        Parameters
        ----------
        columns
            Names of the columns wanted; all by default.
        verify
            Compare every part with its checksum.

        Raises
        ------
        DamagedError
            A part is missing, truncated or changed.
        """
        from concurrent.futures import ThreadPoolExecutor  # imports logging, which a short run does without

        _, damaged = load_checked(self._folder, read_parts=False)
        if damaged:
            raise self._damaged(damaged)
        wanted = list(columns) if columns is not None else None
        ahead: deque[Future[list[pa.Table]]] = deque()
        with ThreadPoolExecutor(_THREADS) as pool:
            try:
                for first, stop in self._ranges:
                    ahead.append(pool.submit(self._between, first, stop, wanted, verify))
                    if len(ahead) > _THREADS:
                        yield from ahead.popleft().result()
                while ahead:
                    yield from ahead.popleft().result()
            finally:
                for waiting in ahead:
                    waiting.cancel()

    def row(self, number: int) -> pa.Table | None:
        """Return one row; None where it is not finished.

        Raises
        ------
        DamagedError
            Its part is missing, truncated or changed.
        """
        if not any(first <= number < stop for first, stop in self._ranges):
            return None
        return self._between(number, number + 1, None, verify=True)[0]

    def _between(self, first: int, stop: int, columns: list[str] | None, verify: bool) -> list[pa.Table]:
        """Read the rows [first, stop)."""
        tables = []
        while first < stop:
            name, part, file = self._open_part(first)
            with file:
                table = self._read(file, name, part, columns, verify)
            end = min(stop, part.stop)
            tables.append(table.slice(first - part.first, end - first))
            first = end
        return tables

    def _open_part(self, row: int) -> tuple[str, Part, IO[bytes]]:
        """Open the file that holds a row. An open file stays readable, even if it is removed."""
        index = self._index
        while True:
            for name, part in index.of(row):
                try:
                    return name, part, (self._folder / name).open("rb")
                except FileNotFoundError:
                    continue
                except OSError as problem:
                    refuse_to_guess(self._folder / name, problem)
                    raise self._damaged({name: str(problem.strerror)}) from problem
            before, index = index, _Index(load(self._folder))
            if index.manifest.identity != self.identity:
                raise StoreError(f"{self._folder} was replaced by the result of another sweep while it was read")
            if index.manifest == before.manifest:
                name = next((name for name, _ in index.of(row)), f"the part with row {row}")
                raise self._damaged({name: "missing"})
            self._index = index

    def _read(self, file: IO[bytes], name: str, part: Part, columns: list[str] | None, verify: bool) -> pa.Table:
        """Read a part from its open file."""
        import pyarrow as pa  # heavy, and only readers need it

        source: Any = file
        try:
            if verify:
                content = file.read()
                if wrong := wrong_bytes(content, part):
                    raise self._damaged({name: wrong})
                source = pa.BufferReader(content)
            opened = TableFile(source, _MOST_PART_ROWS, _MOST_PART_BYTES)
            if set(opened.schema.names) != set(self.columns):
                raise self._damaged({name: "the manifest lists other columns"})
            schema = self._schemas.setdefault("of all parts", opened.schema)  # one step: several threads read
            if opened.rows != part.rows or not opened.schema.equals(schema):
                raise self._damaged({name: "other rows or columns than recorded"})
            table = opened.read(columns)
        except ParquetLimitError as problem:
            raise ImpossibleRecordsError(self._folder / name, str(problem)) from problem
        except (OSError, ParquetError) as problem:
            raise self._damaged({name: str(problem)}) from problem
        return table if columns is None else table.select(columns)

    def _damaged(self, damaged: dict[str, str]) -> DamagedError:
        """Return the error that says what is damaged and what to do."""
        first, what = next(iter(damaged.items()))
        more = f" and {len(damaged) - 1} more parts" if len(damaged) > 1 else ""
        return DamagedError(
            f"{self._folder} is damaged ({first}: {what}{more}). `sweep run` of its settings file with --resume "
            f"recomputes damaged parts, and with --resume --dry-run lists them"
        )


class _Index:
    """Which rows are in which file, by a manifest."""

    def __init__(self, manifest: Manifest):
        self.manifest = manifest
        self._names = sorted(manifest.parts, key=lambda name: manifest.parts[name].first)
        self._firsts = [manifest.parts[name].first for name in self._names]

    def of(self, row: int) -> Iterator[tuple[str, Part]]:
        """Yield the files in which a row may be, in the order to try them."""
        k = bisect_right(self._firsts, row) - 1
        if k >= 0:
            name = self._names[k]
            if row < self.manifest.parts[name].stop:
                yield name, self.manifest.parts[name]
        merge = self.manifest.merge
        if merge is not None and merge.part.first <= row < merge.part.stop:
            for name in merge.names:
                yield name, merge.part
