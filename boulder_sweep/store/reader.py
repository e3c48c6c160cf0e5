"""A finished or unfinished result as a table in memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.columns import OUTCOMES, column_spec
from boulder_sweep.locations import Location, RemotePath, location_of
from boulder_sweep.store.finished import FinishedRows
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


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
        ``rows`` (of the whole table), ``complete`` (whether all of them are finished) and ``judged_by`` (by whose
        rules, if not by those of this version; else empty). Columns that a table of an earlier version lacks are null.

    Warns
    -----
    OlderRulesWarning
        Another version wrote the table; the text says what differs.

    Raises
    ------
    NotASweepError
        There is no result in the folder.
    DamagedError
        A part is missing, truncated or changed.
    OtherVersionError
        The result was written by a version whose results this one cannot read.
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


def read_table(folder: Location, columns: Sequence[str] | None = None, *, verify: bool = True) -> pa.Table:
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
        raise IndexError(f"design {design_id} has not been computed yet; `sweep status {folder}` shows how to resume")
    return row


def _read(folder: Location, columns: Sequence[str] | None, verify: bool) -> tuple[pa.Table, FinishedRows]:
    """Return the finished parts, in the order of the designs, and what is known of them."""
    import pyarrow as pa  # heavy, and only readers need it

    from boulder_sweep.store.schema import table_schema, with_columns

    finished = FinishedRows(folder)
    known = finished.columns
    if unknown := [name for name in columns or () if name not in known]:
        raise ValueError(f"{folder} has no column {unknown[0]!r}; its columns are {', '.join(known)}")
    parts = list(finished.tables(columns, verify=verify))
    if not parts:
        parts = [with_columns(table_schema().empty_table(), known if columns is None else columns)]
    return pa.concat_tables(parts), finished
