"""A finished or unfinished result as a table in memory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.columns import BY_NAME

from .errors import DamagedError
from .manifest import load

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


def read(out: str | Path, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the result of a sweep, checking every page it holds.

    Parameters
    ----------
    out
        Folder that `boulder_sweep.run` or ``sweep run`` wrote, also while it is being written.
    columns
        Names of the columns wanted; all by default.

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
    folder = Path(out)
    manifest = load(folder)
    # Not split into blocks: consolidating columns of one type would copy the whole table once more.
    frame = read_table(folder, columns).to_pandas(split_blocks=True, self_destruct=True)
    frame.attrs = {
        "units": {name: BY_NAME[name].unit for name in frame.columns},
        "meanings": {name: BY_NAME[name].meaning for name in frame.columns},
        "rows": manifest.rows,
        "complete": len(frame) == manifest.rows,
    }
    return frame


def read_table(folder: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read the finished parts of a folder as one Arrow table, in the order of the designs.

    Parameters
    ----------
    folder
        The output folder.
    columns
        Names of the columns wanted; all by default.

    Raises
    ------
    NotASweepError, DamagedError
        As `read`.
    """
    import pyarrow as pa  # heavy, and only readers need it
    import pyarrow.dataset as ds

    from .schema import table_schema

    manifest = load(folder)
    files = [str(folder / name) for name in sorted(manifest.parts)]
    wanted = list(columns) if columns is not None else None
    if not files:
        empty = table_schema().empty_table()
        return empty.select(wanted) if wanted else empty
    parts = ds.ParquetFileFormat(
        default_fragment_scan_options=ds.ParquetFragmentScanOptions(page_checksum_verification=True)
    )
    try:
        return ds.dataset(files, format=parts).to_table(columns=wanted)
    except (OSError, pa.ArrowException) as problem:
        raise DamagedError(
            f"{folder} is damaged: {problem}. `sweep status {folder} --verify` tells which parts, "
            f"and running again with --resume computes them anew"
        ) from problem
