"""A finished or unfinished result as a table in memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.columns import BY_NAME

from .errors import DamagedError
from .manifest import load
from .verify import load_checked

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


def read(out: str | Path, columns: Sequence[str] | None = None, *, verify: bool = True) -> pd.DataFrame:
    """Read the result of a sweep.

    Parameters
    ----------
    out
        Folder that `boulder_sweep.run` or ``sweep run`` wrote, also while it is being written.
    columns
        Names of the columns wanted; all by default.
    verify
        Compare every part with its checksum before: a second for some ten million rows.

    Returns
    -------
    pandas.DataFrame
        Rows in the order of the designs. ``.attrs`` holds ``units`` and ``meanings`` by column name,
        ``rows`` (of the whole table) and ``complete`` (whether all of them are there).

    Raises
    ------
    NotASweepError
        There is no result in the folder.
    DamagedError
        A part is gone, truncated or changed.
    """
    table, rows = _read(Path(out), columns, verify)
    # Not split into blocks: consolidating columns of one type would copy the whole table once more.
    frame = table.to_pandas(split_blocks=True, self_destruct=True)
    frame.attrs = {
        "units": {name: BY_NAME[name].unit for name in frame.columns},
        "meanings": {name: BY_NAME[name].meaning for name in frame.columns},
        "rows": rows,
        "complete": len(frame) == rows,
    }
    return frame


def read_table(folder: Path, columns: Sequence[str] | None = None, *, verify: bool = True) -> pa.Table:
    """Read the finished parts of a folder as one Arrow table; otherwise as `read`."""
    return _read(folder, columns, verify)[0]


def read_row(folder: Path, design_id: int) -> pa.Table:
    """Read one row of a result, from the one part that holds it.

    Raises
    ------
    IndexError
        The table has no such row, or not yet.
    DamagedError
        The part is gone, truncated or changed.
    """
    import pyarrow as pa  # heavy, and only readers need it
    import pyarrow.parquet as pq

    from .verify import wrong_content

    manifest = load(folder)
    if not 0 <= design_id < manifest.rows:
        raise IndexError(f"{folder} holds {manifest.rows:,} designs, numbered from 0; there is no {design_id}")
    for name, part in manifest.parts.items():
        if part.first <= design_id < part.first + part.rows:
            damage = wrong_content(folder / name, part)
            if damage:
                raise DamagedError(_damage_text(folder, {name: damage}))
            try:
                rows = pq.read_table(folder / name, page_checksum_verification=True)
            except (OSError, pa.ArrowException) as problem:
                raise DamagedError(_damage_text(folder, {name: str(problem)})) from problem
            return rows.slice(design_id - part.first, 1)
    raise IndexError(f"design {design_id} has not been computed yet; `sweep status {folder}` says how to go on")


def _read(folder: Path, columns: Sequence[str] | None, verify: bool) -> tuple[pa.Table, int]:
    """Return the finished parts, in the order of the designs, and the rows of the whole table."""
    import pyarrow as pa  # heavy, and only readers need it
    import pyarrow.dataset as ds

    from .schema import table_schema

    manifest, damaged = load_checked(folder, read_parts=verify)
    if damaged:
        raise DamagedError(_damage_text(folder, damaged))
    in_order = sorted(manifest.parts.items(), key=lambda item: item[1].first)
    files = [str(folder / name) for name, _ in in_order]
    wanted = list(columns) if columns is not None else None
    if not files:
        empty = table_schema().empty_table()
        return (empty.select(wanted) if wanted else empty), manifest.rows
    parts = ds.ParquetFileFormat(
        default_fragment_scan_options=ds.ParquetFragmentScanOptions(page_checksum_verification=True)
    )
    try:
        return ds.dataset(files, format=parts).to_table(columns=wanted), manifest.rows
    except (OSError, pa.ArrowException) as problem:
        raise DamagedError(_damage_text(folder, {"a part": str(problem)})) from problem


def _damage_text(folder: Path, damaged: dict[str, str]) -> str:
    """Say what is damaged and what to do."""
    first, what = next(iter(damaged.items()))
    more = f" and {len(damaged) - 1} more parts" if len(damaged) > 1 else ""
    return (
        f"{folder} is damaged ({first}: {what}{more}). `sweep status {folder} --verify` tells which parts are, "
        f"and running again with --resume computes them anew"
    )
