"""``table: designs.csv``, ``.xlsx`` or ``.parquet``: a list of designs, numbers in the units of the column names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.designs import Label
from boulder_sweep.locations import Location, LocationError, is_url, location_of, source_of
from boulder_sweep.settings.problems import Position, ProblemList, SettingsError, shorten
from boulder_sweep.settings.source import check_regular_file, refuse
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.table_header import check_count, check_numbers, read_header
from boulder_sweep.settings.table_rows import (
    MAX_TABLE_ROWS,
    Alike,
    check_values,
    converted,
    label_of,
    read_csv,
    read_xlsx,
)
from boulder_sweep.settings.tree import Scalar

if TYPE_CHECKING:
    import pyarrow as pa

MAX_TABLE_BYTES = 2_000_000_000


def read_table(node: Scalar, folder: Path, problems: ProblemList) -> DesignList | None:
    """Return the designs of a table; mistakes go to `problems`.

    Parameters
    ----------
    node : Scalar
        The file's name as written in the settings, or its URL.
    folder : Path
        Where relative names begin.
    problems : ProblemList
        Receives what is wrong with the table, by line and column of the table itself.

    Returns
    -------
    DesignList or None
        None where the table cannot be used; the problems say why.
    """
    text = node.text.strip()
    try:
        path = location_of(text) if is_url(text) else folder / Path(text)
    except LocationError as refused:
        problems.add(node.position, "table", str(refused))
        return None
    before = len(problems.problems)
    suffix = path.suffix.lower()
    reader = _READERS.get(suffix)
    if reader is None:
        kinds = ", ".join(_READERS)
        problems.add(node.position, "table", f"'{shorten(node.text)}' has an unsupported type; use one of {kinds}")
        return None
    try:
        check_regular_file(path, MAX_TABLE_BYTES, "Split it into several sweeps")
        found = reader(path, problems)
    except SettingsError as error:
        for problem in error.problems:
            inside = problem.line is not None
            position = Position(problem.file, problem.line, problem.column) if inside else node.position
            problems.add(position, "table", problem.message if inside else f"{problem.file}: {problem.message}")
        return None
    if len(problems.problems) == before and not found.columns:
        problems.add(node.position, "table", f"{path} has no column that is an input")
    return None if len(problems.problems) > before else found


def _read_parquet(path: Location, problems: ProblemList) -> DesignList:
    # pyarrow takes a third of a second to import: only for tables in this format.
    import pyarrow as pa
    import pyarrow.parquet as pq

    label = str(path)
    position = Position(label)
    alike = Alike(problems)
    found = DesignList(path.name, {})
    try:
        file = pq.ParquetFile(source_of(path))
        rows = file.metadata.num_rows
        if rows > MAX_TABLE_ROWS:
            raise refuse(label, f"has {rows} rows; a table takes at most {MAX_TABLE_ROWS}")
        if rows == 0:
            raise refuse(label, "has no rows")
        names = list(file.schema_arrow.names)
        check_count(names, label)
        for name, column in zip(names, read_header(names, [position] * len(names), problems), strict=True):
            if column is None:
                continue
            cells = file.read(columns=[name]).column(0)
            numeric = pa.types.is_floating(cells.type) or pa.types.is_integer(cells.type)
            if column.field is None:
                if not numeric or check_numbers(column, position, problems):
                    found.labels[name] = _label(cells)
                continue
            if not numeric:
                problems.add(position, name, f"holds {cells.type}, not numbers")
                continue
            if cells.null_count:
                problems.add(position, name, f"has {cells.null_count} empty cells; every design needs a value")
                continue
            values = converted(cells.cast(pa.float64()).to_numpy(), column)
            for row, message in check_values(values, column.field):
                alike.add("rows", position, name, f"row {row + 1}: {message}")
            found.columns[column.field.name] = np.ascontiguousarray(values)
    except (pa.ArrowException, OSError, ValueError, LookupError, OverflowError, MemoryError) as error:
        # Of a damaged file, pyarrow raises almost anything.
        raise refuse(label, f"cannot be read as Parquet ({shorten(str(error), 100)})") from None
    alike.finish()
    return found


def _label(cells: pa.ChunkedArray) -> Label:
    """Return a text column; every word is looked at once, however often it stands in the file."""
    import pyarrow as pa

    if not pa.types.is_dictionary(cells.type):
        if pa.types.is_nested(cells.type):
            return label_of(["" if cell is None else str(cell) for cell in cells.to_pylist()])
        cells = cells.dictionary_encode()
    array = cells.unify_dictionaries().combine_chunks()
    words = label_of(["", *("" if word is None else str(word) for word in array.dictionary.to_pylist())])
    return Label(words.codes[array.indices.fill_null(-1).to_numpy(zero_copy_only=False) + 1], words.words)


_READERS: dict[str, Callable[[Location, ProblemList], DesignList]] = {
    ".csv": read_csv,
    ".xlsx": read_xlsx,
    ".parquet": _read_parquet,
}
"""By the end of the file's name."""
