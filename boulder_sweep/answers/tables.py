"""Answers as Arrow tables and Parquet files, a unit and a meaning with every column."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep.answers.search import WORDS
from boulder_sweep.columns import DESIGN_ID, INPUTS
from boulder_sweep.errors import QuestionError
from boulder_sweep.store.schema import part_table

if TYPE_CHECKING:
    from boulder_sweep.answers.keys import Key
    from boulder_sweep.answers.questions import Answers

MASS = ("boulder_mass_kg", "kg", "mass of the boulder, L W H times its density")


def answer_table(key: Key, start: int, answers: Sequence[Answers], readings: Sequence[str]) -> pa.Table:
    """Return answers as a table: the inputs, the answer and its bracket, the outcome at the answer.

    Parameters
    ----------
    key
        The input asked for.
    start
        Number of the first row.
    answers
        Answers by the readings of the sweep, then by others.
    readings
        Names of the readings, in that order.
    """
    own = answers[0]
    block = replace(own.block, start=start, stop=start + len(own.block))
    table = part_table(block, own.judged, {})
    at = 1 + len(INPUTS)
    sense = "largest" if key.most else "smallest"
    unit = key.field.unit
    what = f"{sense} value of {key.field.path} that passes"
    stretches = pa.array(own.stretches, pa.string()).dictionary_encode()
    columns: list[tuple[str, str, str, pa.Array]] = [
        (key.answer, unit, f"{what}; null where none does", _numbers(own.passes)),
        (
            "fails_at",
            unit,
            f"value next to it of {key.field.path} that does not pass; where none passes, the last one tried",
            _numbers(own.fails),
        ),
        ("passes_at", unit, "the same as the answer: judged as a run judges it", _numbers(own.passes)),
        ("found", "", "found, always, never, not_monotone or blocked_by_overlap", _words(own.kind)),
        (
            "passes_within",
            unit,
            "where it fails again further on: all stretches that pass",
            stretches,
        ),
        (*MASS, pa.array(boulder_mass(table))),
    ]
    for other, name in zip(answers[1:], readings[1:], strict=True):
        columns += [
            (
                f"{key.answer}_{name}",
                unit,
                f"{what} by the readings {name}",
                _numbers(other.passes),
            ),
            (f"found_{name}", "", f"as found, by the readings {name}", _words(other.kind)),
        ]
    for place, (name, own_unit, meaning, array) in enumerate(columns):
        field = pa.field(name, array.type, metadata={"unit": own_unit, "meaning": meaning})
        table = table.add_column(at + place, field, array)
    return table


def boulder_mass(table: pa.Table) -> np.ndarray:
    """Mass of the boulders of a table [kg]."""
    sides = ("boulder_length_m", "boulder_width_m", "boulder_height_m", "boulder_density_kg_m3")
    return np.prod([table[side].to_numpy() for side in sides], axis=0)


def joined_tables(tables: Sequence[pa.Table], metadata: Mapping[bytes, bytes]) -> pa.Table:
    """Put tables of consecutive rows together, with the metadata of a file beside that for pandas."""
    import json

    from boulder_sweep.store.schema import PANDAS_ATTRIBUTES

    table = pa.concat_tables(tables).unify_dictionaries().combine_chunks()
    own = {field.name: field.metadata or {} for field in table.schema}
    attributes = {
        f"{entry}s": {name: found.get(entry.encode(), b"").decode() for name, found in own.items()}
        for entry in ("unit", "meaning")
    }
    return table.replace_schema_metadata({PANDAS_ATTRIBUTES: json.dumps(attributes).encode(), **metadata})


def write_parquet(table: pa.Table, path: str | Path) -> Path:
    """Write a table to a Parquet file.

    Raises
    ------
    QuestionError
        The name has another ending, its folder does not exist, or it cannot be written.
    """
    target = checked_parquet(path)
    split = [field.name for field in table.schema if field.name != DESIGN_ID.name and pa.types.is_floating(field.type)]
    words = [field.name for field in table.schema if pa.types.is_dictionary(field.type)]
    try:
        pq.write_table(
            table,
            target,
            compression="zstd",
            use_dictionary=words,
            use_byte_stream_split=split,
            write_page_checksum=True,
        )
    except OSError as problem:
        why = os.strerror(problem.errno) if problem.errno else str(problem)
        raise QuestionError(f"{path} cannot be written: {why}") from problem
    return target


def checked_parquet(path: str | Path) -> Path:
    """Return the path of a Parquet file to be written.

    Raises
    ------
    QuestionError
        The name has another ending, or its folder does not exist.
    """
    target = Path(path)
    if target.suffix.lower() != ".parquet":
        raise QuestionError(f"{path}: answers are a Parquet file; its name must end in .parquet")
    if not target.absolute().parent.is_dir():
        raise QuestionError(f"{path}: the folder {target.absolute().parent} does not exist")
    return target


def _numbers(values: np.ndarray) -> pa.Array:
    return pa.array(values, mask=np.isnan(values))


def _words(codes: np.ndarray) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(codes.astype(np.int32)), pa.array(WORDS))
