"""A time history as an Arrow table and as a Parquet file, units and provenance in the metadata."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep.errors import HistoryFileError
from boulder_sweep.impact.trajectory_columns import BY_NAME
from boulder_sweep.store.files import check_target, replacing
from boulder_sweep.text import why

_TYPES = {"float64": pa.float64(), "dictionary": pa.dictionary(pa.int32(), pa.string())}


def arrow_table(columns: Mapping[str, np.ndarray], metadata: Mapping[bytes, bytes]) -> pa.Table:
    """Return a time history as an Arrow table.

    Parameters
    ----------
    columns
        Its columns by name, each of shape (n,).
    metadata
        Settings, versions and the call that repeats it, see `boulder_sweep.store.provenance.file_metadata`.

    Returns
    -------
    pyarrow.Table
        n rows; unit and meaning in the field metadata, settings and versions in the file metadata.
    """
    fields, arrays = [], []
    for name, values in columns.items():
        spec = BY_NAME[name]
        array = pa.array(values)
        arrays.append(array.dictionary_encode() if spec.type == "dictionary" else array)
        fields.append(pa.field(name, _TYPES[spec.type], metadata={"unit": spec.unit, "meaning": spec.meaning}))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=metadata))


def write(table: pa.Table, path: str | Path) -> None:
    """Write a time history to a Parquet file.

    Raises
    ------
    HistoryFileError
        The name has another ending, its folder does not exist or holds the result of a run, or it cannot be written.
    """
    target = checked_history(path)
    try:
        with replacing(target) as file:
            pq.write_table(table, file, compression="zstd", write_page_checksum=True)
    except OSError as problem:
        raise HistoryFileError(f"{path} cannot be written: {why(problem)}") from problem


def checked_history(path: str | Path) -> Path:
    """Return the path of a time history if it can be written there.

    Raises
    ------
    HistoryFileError
        The name has another ending, its folder does not exist or holds the result of a run, or it cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".parquet":
        raise HistoryFileError(f"{path}: a time history is a Parquet file; its name must end in .parquet")
    check_target(target, HistoryFileError)
    return target
