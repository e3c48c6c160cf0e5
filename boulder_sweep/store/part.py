"""A part of a table: the rows of one range, as the bytes of a Parquet file that says everything of itself.

The ranges of a table follow from its settings alone (`folder.Ranges`), and so do the bytes of each part. Nothing in
them depends on machine, moment, number of workers or interruptions: a part may be written twice without harm. Its
metadata holds what all rows of the table have in common (`provenance`), its range, and its rows by verdict.

Inputs repeat a few values over and over, so they are dictionary-encoded and stay codes from the grid to the
file. Computed numbers hardly ever repeat: their bytes are stored split by significance, which compresses best.
Every page has a checksum.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep.columns import (
    COLUMNS,
    DESIGN_ID,
    GRADES,
    INPUTS,
    OPTIONAL_COLUMNS,
    OUTCOMES,
    STANDINGS,
    VERDICTS,
    ColumnSpec,
    OutcomeColumn,
    column_spec,
)
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.store.provenance import PREFIX, canonical

if TYPE_CHECKING:
    from boulder_sweep.designs import Column, DesignBlock

COMPRESSION, COMPRESSION_LEVEL = "zstd", 3
PANDAS_ATTRIBUTES = b"PANDAS_ATTRS"
"""Metadata that pandas copies into ``DataFrame.attrs``."""
_TYPES = {
    "int64": pa.int64(),
    "float64": pa.float64(),
    "dictionary": pa.dictionary(pa.int32(), pa.string()),
}


def table_schema(metadata: Mapping[bytes, bytes] | None = None, more: Iterable[str] = ()) -> pa.Schema:
    """Return the schema of the table, with unit and meaning of every column in its field metadata.

    `more` names the columns that not every table has: optional inputs, and text columns that the settings file gives.
    """
    specs = [*COLUMNS, *(column_spec(name) for name in more)]
    return pa.schema([_field(spec, _TYPES[spec.type]) for spec in specs], metadata=_complete(metadata, specs))


def part_table(block: DesignBlock, judged: Judged, metadata: Mapping[bytes, bytes]) -> pa.Table:
    """Combine the inputs and outcomes of the same rows; null where a value is NaN.

    The columns are in the order of the register; those that not every table has come last.
    """
    arrays = [number_array(block.design_id())]
    arrays += [_input_array(block.columns[spec.name]) for spec in INPUTS]
    arrays += [_outcome_array(spec, judged) for spec in OUTCOMES]
    optional = [name for name in OPTIONAL_COLUMNS if name in block.columns]
    arrays += [_input_array(block.columns[name]) for name in optional]
    arrays += [word_array(label.codes, label.words) for label in block.labels.values()]
    specs = [*COLUMNS, *(column_spec(name) for name in (*optional, *block.labels))]
    fields = [_field(spec, array.type) for spec, array in zip(specs, arrays, strict=True)]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=_complete(metadata, specs)))


def encoded_part(
    block: DesignBlock, judged: Judged, metadata: Mapping[bytes, bytes]
) -> tuple[memoryview, dict[str, int]]:
    """Return the bytes of a part, and its rows of each verdict and reason, see `verdict_counts`.

    The metadata is what all parts have in common, see `provenance.file_metadata`.
    """
    verdicts = verdict_counts(judged)
    own = {"range": [block.start, block.stop], "verdicts": verdicts}
    entries = {f"{PREFIX}{key}".encode(): canonical(value).encode() for key, value in own.items()}
    return encode(part_table(block, judged, {**metadata, **entries})), verdicts


def encode(table: pa.Table) -> memoryview:
    """Return the bytes of a Parquet file with the whole table in one row group."""
    split = [field.name for field in table.schema if pa.types.is_floating(field.type)]
    by_dictionary = [field.name for field in table.schema if pa.types.is_dictionary(field.type)]
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression=COMPRESSION,
        compression_level=COMPRESSION_LEVEL,
        use_dictionary=by_dictionary,
        use_byte_stream_split=split,
        column_encoding={DESIGN_ID.name: "DELTA_BINARY_PACKED"},
        write_page_checksum=True,
        row_group_size=max(len(table), 1),
    )
    return memoryview(sink.getvalue())


def verdict_counts(judged: Judged) -> dict[str, int]:
    """Count the rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` without one.

    Passes are counted by their robustness, sensitive ones by what they stand under, too.
    """
    width = len(judged.reasons)
    counts = np.bincount(judged.verdict.astype(np.int64) * width + judged.reason)
    rows = {}
    for code in np.flatnonzero(counts):
        verdict, reason = VERDICTS[code // width], judged.reasons[code % width]
        rows[f"{verdict}/{reason}" if reason else verdict] = int(counts[code])
    passing = judged.verdict == PASS
    grade, standing = judged["robustness"][passing], judged["stands_under"][passing]
    rows.pop("pass", None)
    pairs = np.bincount((grade.astype(np.int64) + 1) * (len(STANDINGS) + 1) + standing + 1)  # -1 is none
    for code in np.flatnonzero(pairs):
        graded, under = divmod(int(code), len(STANDINGS) + 1)
        word = GRADES[graded - 1]
        laws = STANDINGS[under - 1].split(";")[1:] if word == "sensitive" and under else []
        key = f"pass/{word}" + (f" (stands under {' and '.join(laws)})" if laws else "")
        rows[key] = rows.get(key, 0) + int(pairs[code])
    return dict(sorted((key, count) for key, count in rows.items() if count))


def _field(spec: ColumnSpec, type_: pa.DataType) -> pa.Field:
    """One field with its unit and meaning."""
    return pa.field(spec.name, type_, metadata={"unit": spec.unit, "meaning": spec.meaning})


def _complete(metadata: Mapping[bytes, bytes] | None, specs: Sequence[ColumnSpec]) -> dict[bytes, bytes]:
    """File metadata with the units for pandas added."""
    attributes = {
        "units": {spec.name: spec.unit for spec in specs},
        "meanings": {spec.name: spec.meaning for spec in specs},
    }
    return {PANDAS_ATTRIBUTES: json.dumps(attributes).encode(), **(metadata or {})}


def _input_array(column: Column) -> pa.Array:
    """One input column; its codes become the indices of a dictionary array without a lookup."""
    missing = np.isnan(column.values)
    if column.codes is None:
        return number_array(column.values, missing)
    mask = missing[column.codes] if missing.any() else None
    return pa.DictionaryArray.from_arrays(number_array(column.codes, mask), number_array(column.values), safe=False)


def _outcome_array(spec: OutcomeColumn, judged: Judged) -> pa.Array:
    """Return one outcome column as an Arrow array."""
    values = judged[spec.name]
    if spec.type == "dictionary":
        return word_array(values, judged.words[spec.name])
    return number_array(values, np.isnan(values))


def word_array(codes: np.ndarray, words: tuple[str, ...]) -> pa.DictionaryArray:
    """Array of words from codes; code -1 is null."""
    indices = number_array(codes.astype(np.int32, copy=False), codes < 0)
    return pa.DictionaryArray.from_arrays(indices, _texts(words), safe=False)


def number_array(values: np.ndarray, missing: np.ndarray | None = None) -> pa.Array:
    """Array of numbers, null where they are missing; it shares their memory.

    Avoids `pyarrow.array`, which imports pandas to check for its types: a good part of the time of a run of a hundred
    thousand designs.
    """
    valid = None
    if missing is not None and missing.any():
        valid = pa.py_buffer(np.packbits(~missing, bitorder="little"))
    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [valid, pa.py_buffer(values)])


def _texts(words: tuple[str, ...]) -> pa.Array:
    """Array of words, made as `number_array` and for the same reason."""
    encoded = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(words), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))
