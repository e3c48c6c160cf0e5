"""A time history as an Arrow table and as a Parquet file, units and provenance in the metadata."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from .store.provenance import file_metadata, identity
from .trajectory_columns import BY_NAME

if TYPE_CHECKING:
    from .trajectory import Trajectory

_TYPES = {"float64": pa.float64(), "dictionary": pa.dictionary(pa.int32(), pa.string())}


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
    """Write a time history to a Parquet file; see `arrow_table`."""
    pq.write_table(arrow_table(trajectory, energy=energy), path, compression="zstd", write_page_checksum=True)
