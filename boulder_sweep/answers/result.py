"""What the answers to all questions have in common: a sweep, a table with a row for each of its designs, and its file.

Every column of a table has a unit and a meaning.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.columns import DESIGN_ID, REASONS
from boulder_sweep.drawing import draw
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantities import QUANTITIES, quantities
from boulder_sweep.locations import Location, location_of, put, replacing
from boulder_sweep.store.folder import check_target
from boulder_sweep.store.provenance import file_metadata, identity
from boulder_sweep.text import ProgressCallback, why

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from boulder_sweep.answers.chance import Chances
    from boulder_sweep.answers.trials import Judges
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

TableColumn = tuple[str, str, str, Any]
"""Name, unit, meaning, and n values: numbers, NaN for none; words, None for none; or an array of Arrow."""


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """Answers to a question about a sweep.

    Attributes
    ----------
    sweep : Sweep
        The sweep asked about.
    arrow : pyarrow.Table
        One row for each design asked about; units and meanings in the field metadata.
    """

    sweep: Sweep
    arrow: pa.Table

    def __len__(self) -> int:
        return len(self.arrow)

    def __repr__(self) -> str:
        return str(draw("notebook", "text_of", self))

    def _repr_html_(self) -> str:
        """Return what the command prints, as a notebook shows it."""
        return str(draw("notebook", "html_of", self))

    def write(self, path: str | Location) -> list[Location]:
        """Write the answers to a Parquet file; return the paths of all that is written.

        Raises
        ------
        QuestionError
            The name has another ending, its folder does not exist, or it cannot be written.
        """
        return [write_parquet(self.arrow, path)]

    @property
    def frame(self) -> pd.DataFrame:
        """The rows as a data frame; units and meanings in ``.attrs``."""
        frame = self.arrow.to_pandas()
        frame.attrs = _attributes(self.arrow)
        return frame


def chance_columns(chances: Chances, where: str = "") -> list[TableColumn]:
    """Return the columns of the chances of passing, and of a robust pass if they are known; `where` they hold."""
    from boulder_sweep.store.part import word_array

    low = "lower end of the interval of p_pass"
    high = "upper end of the interval of p_pass, at which all that is undecided passes"
    reason = "commonest reason of the designs drawn that are undecided; null where none is"
    sampled, robust = chances
    columns: list[TableColumn] = [
        ("p_pass", "1", f"chance that the design passes{where}", sampled.estimate),
        ("p_pass_low", "1", low, sampled.low),
        ("p_pass_high", "1", high, sampled.high),
        ("p_undecided", "1", "chance that the design is undecided", sampled.unknown),
        ("p_undecided_reason", "", reason, word_array(sampled.cause - 1, REASONS[1:])),
    ]
    if robust is None:
        return columns
    stands = (
        "stands under the second opinion that decides: robust, or open only because outside the ranges of the study"
    )
    return [
        *columns,
        ("p_robust", "1", f"chance that the design passes{where}, and {stands}", robust.estimate),
        ("p_robust_low", "1", "lower end of the interval of p_robust", robust.low),
        ("p_robust_high", "1", "upper end of the interval of p_robust", robust.high),
    ]


def rows_table(
    start: int, block: DesignBlock, judged: Judged, columns: Sequence[TableColumn], at: int | None = None
) -> pa.Table:
    """Return n designs and their outcomes as a table with columns of an answer.

    Parameters
    ----------
    start
        Number of the first row.
    at
        Index of the first of the further columns; behind all others by default.
    """
    import pyarrow as pa

    from boulder_sweep.store.part import number_array, part_table, word_array

    def array_of(values: np.ndarray | pa.Array | Sequence[str | None]) -> pa.Array:
        if isinstance(values, pa.Array):
            return values
        if isinstance(values, np.ndarray):
            return number_array(values, np.isnan(values))
        known = tuple(dict.fromkeys(text for text in values if text is not None))
        codes = {None: -1} | {text: code for code, text in enumerate(known)}
        return word_array(np.array([codes[text] for text in values], dtype=np.int32), known)

    table = part_table(replace(block, start=start, stop=start + len(block)), judged, {})
    first = table.num_columns if at is None else at
    for index, (name, unit, meaning, values) in enumerate(columns, first):
        array = array_of(values)
        field = pa.field(name, array.type, metadata={"unit": unit, "meaning": meaning})
        table = table.add_column(index, field, array)
    return table


def to_build(block: DesignBlock, sweep: Sweep) -> list[TableColumn]:
    """Return what the designs of a block take to build as columns."""
    rows = {name: column.to_numpy() for name, column in block.columns.items()}
    values = quantities(rows, sweep.model.shape, sweep.model.ground)
    return [(q.name, q.unit, q.meaning, values[q.name]) for q in QUANTITIES if q.name not in block.columns]


def collected(tables: Iterable[pa.Table], count: int, progress: ProgressCallback | None) -> list[pa.Table]:
    """Collect tables of `count` rows in all, and report how many are there, first none."""
    parts, done = [], 0
    if progress is not None:
        progress(0, count)
    for table in tables:
        parts.append(table)
        done += len(table)
        if progress is not None:
            progress(done, count)
    return parts


def joined_tables(
    tables: Sequence[pa.Table],
    sweep: Sweep,
    judges: Judges,
    repeat: str,
    question: Mapping[str, Any] | None = None,
) -> pa.Table:
    """Concatenate tables of consecutive rows, and add the metadata of a file, also for pandas.

    Parameters
    ----------
    repeat
        Function that answers the same again.
    question
        What was asked beside the sweep.
    """
    import pyarrow as pa

    from boulder_sweep.store.part import PANDAS_ATTRIBUTES

    entries = identity(sweep.resolved(), *judges.final.settings(), judges.accuracy.to_dict())
    metadata = file_metadata(entries if question is None else entries | {"question": question}, repeat=repeat)
    table = pa.concat_tables(tables).unify_dictionaries().combine_chunks()
    attributes = json.dumps(_attributes(table)).encode()
    return table.replace_schema_metadata({PANDAS_ATTRIBUTES: attributes, **metadata})


def _attributes(table: pa.Table) -> dict[str, dict[str, str]]:
    """Return units and meanings of the columns of a table."""
    fields = {field.name: field.metadata or {} for field in table.schema}
    return {
        f"{entry}s": {name: metadata.get(entry.encode(), b"").decode() for name, metadata in fields.items()}
        for entry in ("unit", "meaning")
    }


def write_parquet(table: pa.Table, path: str | Location) -> Location:
    """Write a table to a Parquet file, by path or URL.

    Raises
    ------
    QuestionError
        The name has another ending, its folder does not exist or holds the result of a run, or it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    target = checked_parquet(path)
    split = [field.name for field in table.schema if field.name != DESIGN_ID.name and pa.types.is_floating(field.type)]
    words = [field.name for field in table.schema if pa.types.is_dictionary(field.type)]
    content = io.BytesIO()
    try:
        with replacing(target) if isinstance(target, Path) else nullcontext(content) as file:
            pq.write_table(
                table,
                file,
                compression="zstd",
                use_dictionary=words,
                use_byte_stream_split=split,
                write_page_checksum=True,
            )
        if not isinstance(target, Path):
            put(target, content.getbuffer())
    except OSError as problem:
        raise QuestionError(f"{path} cannot be written: {why(problem)}") from problem
    return target


def checked_parquet(path: str | Location) -> Location:
    """Check and return the path or URL of a Parquet file to be written.

    Raises
    ------
    QuestionError
        The name has another ending, or its folder does not exist or holds the result of a run.
    """
    target = location_of(path)
    if target.suffix.lower() != ".parquet":
        raise QuestionError(f"{path}: answers are a Parquet file; its name must end in .parquet")
    check_target(target, QuestionError)
    return target
