"""A time history as an Arrow table and as a Parquet file, units and provenance in the metadata."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from .store.provenance import file_metadata, identity
from .trajectory_columns import BY_NAME

if TYPE_CHECKING:
    from .trajectory import Trajectory

_TYPES = {"float64": pa.float64(), "dictionary": pa.dictionary(pa.int32(), pa.string())}


class HistoryFileError(Exception):
    """A time history cannot be written; the message says why and what would be right."""

    exit_code = 2


def arrow_table(trajectory: Trajectory, *, energy: bool = False) -> pa.Table:
    """Return a time history as an Arrow table.

    Parameters
    ----------
    trajectory
        The time history, n samples.
    energy
        Whether to add the energy ledger.

    Returns
    -------
    pyarrow.Table
        n rows; unit and meaning in the field metadata, settings and versions in the file metadata.
    """
    columns = trajectory.columns(energy=energy)
    fields, arrays = [], []
    for name, values in columns.items():
        spec = BY_NAME[name]
        array = pa.array(values)
        arrays.append(array.dictionary_encode() if spec.type == "dictionary" else array)
        fields.append(pa.field(name, _TYPES[spec.type], metadata={"unit": spec.unit, "meaning": spec.meaning}))
    control = trajectory.motion.control._asdict()
    metadata = file_metadata(
        identity(trajectory.settings, trajectory.settings["model"]["readings"], control),
        f"boulder_sweep.simulate({trajectory.name!r}, {trajectory.design_id})",
    )
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=metadata))


def write(trajectory: Trajectory, path: str | Path, *, energy: bool = False) -> None:
    """Write a time history to a Parquet file; see `arrow_table`.

    Raises
    ------
    HistoryFileError
        The name has another ending, its folder does not exist, or it cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".parquet":
        raise HistoryFileError(f"{path}: a time history is a Parquet file; its name must end in .parquet")
    if not target.absolute().parent.is_dir():
        raise HistoryFileError(f"{path}: the folder {target.absolute().parent} does not exist")
    table = arrow_table(trajectory, energy=energy)
    try:
        pq.write_table(table, target, compression="zstd", write_page_checksum=True)
    except OSError as problem:
        why = os.strerror(problem.errno) if problem.errno else str(problem)
        raise HistoryFileError(f"{path} cannot be written: {why}") from problem
