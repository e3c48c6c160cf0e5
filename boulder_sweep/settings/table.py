"""``table: designs.csv`` or ``.parquet``: an explicit list of designs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from boulder_sweep.columns import BY_NAME as TABLE_COLUMNS
from boulder_sweep.columns import INPUT_COLUMNS, OUTCOME_COLUMNS
from boulder_sweep.settings.fields import BY_NAME, Field
from boulder_sweep.settings.leaf import outside
from boulder_sweep.settings.problems import Place, ProblemList, SettingsError, did_you_mean, shorten
from boulder_sweep.settings.source import check_regular_file, refuse
from boulder_sweep.settings.sweep import DesignList
from boulder_sweep.settings.tree import Scalar

MAX_TABLE_BYTES = 2_000_000_000
MAX_TABLE_ROWS = 20_000_000
_KNOWN = (*INPUT_COLUMNS, "embedment_ratio")


def read_table(node: Scalar, folder: Path, problems: ProblemList) -> DesignList | None:
    """Return the designs of a table; mistakes go to `problems`.

    Parameters
    ----------
    node : Scalar
        The file's name as written in the settings.
    folder : Path
        Where relative names begin.
    problems : ProblemList
        Receives what is wrong with the table, by line and column of the table itself.

    Returns
    -------
    DesignList or None
        None where the table cannot be used; the problems say why.
    """
    path = folder / Path(node.text.strip())
    before = len(problems.problems)
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        problems.add(node.place, "table", f"'{shorten(node.text)}' is neither a .csv nor a .parquet file")
        return None
    try:
        check_regular_file(path, MAX_TABLE_BYTES, "Split it into several sweeps")
        if suffix == ".csv":
            from boulder_sweep.settings.csv_table import read_csv

            columns = read_csv(path, problems)
        else:
            columns = _read_parquet(path, problems)
    except SettingsError as error:
        for problem in error.problems:
            inside = problem.line is not None
            place = Place(problem.file, problem.line, problem.column) if inside else node.place
            problems.add(place, "table", problem.message if inside else f"{problem.file}: {problem.message}")
        return None
    return None if len(problems.problems) > before or not columns else DesignList(path.name, columns)


def check_header(names: list[str], places: list[Place], problems: ProblemList) -> list[Field | None]:
    """Return the quantity of every column, None for those that cannot be used; mistakes go to `problems`."""
    fields: list[Field | None] = []
    for index, (name, place) in enumerate(zip(names, places, strict=True)):
        field = BY_NAME.get(name)
        message = ""
        if name in names[:index]:
            message = "is a second column of this name"
        elif name == "design_id":
            message = "designs are numbered by their order; remove this column or rename the table's columns"
        elif name in OUTCOME_COLUMNS:
            message = f"is an outcome of a run ({TABLE_COLUMNS[name].meaning}), not an input; remove this column"
        elif field is None:
            message = f"is not an input column (known: {', '.join(_KNOWN)}){did_you_mean(name, _KNOWN)}"
        if message:
            problems.add(place, shorten(name) or "(empty)", message)
        fields.append(None if message else field)
    return fields


def check_values(values: np.ndarray, field: Field, limit: int = 20) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for values that are not finite or not admitted, at most `limit` of them."""
    from boulder_sweep.settings.bounds import ADMITTED

    bound = ADMITTED[field.name]
    wrong = np.flatnonzero(~((values >= bound.low) & (values <= bound.high)))[:limit]
    found = []
    for row in wrong:
        value = float(values[row])
        message = "is not a finite number" if not np.isfinite(value) else outside(value, field.name, field.unit)
        found.append((int(row), message))
    return found


def _read_parquet(path: Path, problems: ProblemList) -> dict[str, np.ndarray]:
    # pyarrow takes a third of a second to import: only for tables in this format.
    import pyarrow as pa
    import pyarrow.parquet as pq

    label = str(path)
    try:
        file = pq.ParquetFile(path)
        rows = file.metadata.num_rows
        if rows > MAX_TABLE_ROWS:
            raise refuse(label, f"has {rows} rows; a table takes at most {MAX_TABLE_ROWS}")
        if rows == 0:
            raise refuse(label, "has no rows")
        names = list(file.schema_arrow.names)
        fields = check_header(names, [Place(label)] * len(names), problems)
        columns = {}
        for name, field in zip(names, fields, strict=True):
            if field is None:
                continue
            column = file.read(columns=[name]).column(0)
            if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
                problems.add(Place(label), name, f"holds {column.type}, not numbers")
                continue
            if column.null_count:
                problems.add(Place(label), name, f"has {column.null_count} empty cells; every design needs a value")
                continue
            values = column.cast(pa.float64()).to_numpy()
            for row, message in check_values(values, field):
                problems.add(Place(label), name, f"row {row + 1}: {message}")
            columns[name] = np.ascontiguousarray(values)
    except (pa.ArrowException, OSError) as error:
        raise refuse(label, f"cannot be read as Parquet ({shorten(str(error), 100)})") from None
    return columns
