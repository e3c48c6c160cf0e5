"""From a result to the rows of its page: part by part, one byte for the verdict and the grade of each design."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.answers.files import CAPACITY, NEED, AnswerFile, answered, kind_of, result_of
from boulder_sweep.columns import INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import ReportError
from boulder_sweep.judge.validity import flag_counts
from boulder_sweep.locations import Location
from boulder_sweep.report.rows import DEPTH, NOT_YET, RATIO, NamedSets, Rows
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pyarrow as pa


def read_rows(folder: Location) -> Rows:
    """Read what the page needs of a result.

    Raises
    ------
    StoreError
        There is no result in the folder, or it is damaged.
    ReportError
        The file is not one of answers, or rows of it are missing or in another order.
    """
    finished = result_of(folder, ReportError)
    settings = finished.identity["settings"]
    order, given = settings["order"], settings["inputs"]
    if isinstance(finished, AnswerFile):
        _check_whole(finished, folder)
        if finished.kind == NEED:  # a list of the designs at the answers
            order, given = "table", _inputs_of(finished.table, given)
            finished.table = answered(finished.table)
    sets = {} if order == "table" else dict(_sets(settings))
    # Very long axes and the columns of a list are only in the table.
    if order == "table":
        wanted = [name for name, value in given.items() if isinstance(value, list | dict)]
    else:
        wanted = [name for name in order if isinstance(given.get(name), dict)]
    stored = list(dict.fromkeys(own for name in wanted for own in _stored(name)))
    codes = np.full(finished.rows, 255, np.uint8)
    columns = {name: np.full(finished.rows, np.nan) for name in stored}
    names: list[tuple[str, str]] = []
    flags: Counter[str] = Counter()
    grades: Counter[str] = Counter()
    asked = bool(settings["model"].get("second_opinion")) or kind_of(finished) in (NEED, CAPACITY)
    for table in finished.tables(["design_id", "verdict", "reason", "validity", "robustness", *stored]):
        if "validity" not in finished.lacking:
            flags.update(_of_passes(table, "validity"))
        if "robustness" not in finished.lacking:
            grades.update(_of_passes(table, "robustness"))
        rows = table.column("design_id").to_numpy()
        codes[rows] = _codes(table, names, asked=asked)
        for name in stored:
            columns[name][rows] = table.column(name).to_numpy()
    codes[codes == 255] = len(names)
    inputs = {name: np.array(float(value)) for name, value in given.items() if isinstance(value, float | int)}
    axes: dict[str, np.ndarray] = {}
    if order == "table":
        inputs |= {name: _column(columns, name) for name in wanted}
    else:
        axes = dict(_axes(settings, sets, columns))
    for place, (axis, values) in enumerate(axes.items()):
        for name, along in (sets[axis].inputs if axis in sets else {axis: values}).items():
            inputs[name] = along.reshape([-1 if k == place else 1 for k in range(len(axes))])
    told = flag_counts(flags.items()) if flags else {}
    words, robustness = zip(*names, (NOT_YET, ""), strict=True)
    return Rows(folder, finished, words, codes, told, dict(grades), axes, sets, inputs, robustness)


def _check_whole(file: AnswerFile, path: Location) -> None:
    """Refuse a file from which rows were taken, or whose rows were put in another order."""
    asked, ids = file.asked, next(file.tables(["design_id"])).column("design_id").to_numpy()
    if len(ids) != asked or not np.array_equal(ids, np.arange(asked)):
        raise ReportError(
            f"{path} does not hold the rows of its {counted(asked, 'design')} in their order; "
            f"write it again with `sweep {file.kind}`"
        )


def _inputs_of(table: pa.Table, given: dict[str, Any]) -> dict[str, Any]:
    """Return the inputs of answers as those of a list of designs; what follows from others is left out."""
    found: dict[str, Any] = {}
    for name in (name for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS) if name in table.column_names):
        optional = name in OPTIONAL_COLUMNS and name not in given
        if not (optional or isinstance(given.get(name), str)):
            values = table[name].unique().to_pylist()
            found[name] = values if len(values) > 1 else values[0]
    return found


def _sets(settings: dict[str, Any]) -> Iterator[tuple[str, NamedSets]]:
    """Yield the axes that are named sets, each with the inputs that it gives."""
    given, order = settings["inputs"], settings["order"]
    for axis, names in settings.get("labels", {}).items():
        own = {name: value for name, value in given.items() if isinstance(value, list) and name not in order}
        inputs = {name: np.array(value) for name, value in own.items() if BY_NAME[name].section == axis}
        yield axis, NamedSets(tuple(names), inputs)


def _stored(name: str) -> tuple[str, ...]:
    """Columns that a quantity follows from."""
    return (DEPTH, "boulder_height_m") if name == RATIO else (name,)


def _column(columns: dict[str, np.ndarray], name: str) -> np.ndarray:
    return columns[DEPTH] / columns["boulder_height_m"] if name == RATIO else columns[name]


def _axes(
    settings: dict[str, Any], sets: dict[str, NamedSets], columns: dict[str, np.ndarray]
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the axes with their values."""
    given, lengths = settings["inputs"], _lengths(settings)
    for place, (name, length) in enumerate(zip(settings["order"], lengths, strict=True)):
        if name in sets:
            yield name, np.arange(length)
        elif isinstance(given[name], list):
            yield name, np.array(given[name])
        else:
            step = int(np.prod(lengths[place + 1 :], dtype=np.int64))
            yield name, _column(columns, name)[: step * length : step]


def _lengths(settings: dict[str, Any]) -> list[int]:
    """Return the number of values along each axis; named sets count their names."""
    given = settings["inputs"] | settings.get("labels", {})
    axes = (given[name] for name in settings["order"])
    return [int(axis["count"]) if isinstance(axis, dict) else len(axis) for axis in axes]


def _of_passes(table: Any, name: str) -> dict[str, int]:
    """Return the number of passing designs of a part for each word of a column."""
    import pyarrow.compute as pc

    words = table.column(name).filter(pc.equal(table.column("verdict").cast("string"), "pass"))
    return {one["values"] or "": one["counts"] for one in pc.value_counts(words.cast("string")).to_pylist()}


def _codes(table: Any, names: list[tuple[str, str]], *, asked: bool) -> np.ndarray:
    """Code of every row of a part; new names, each with the grade of its designs, are added.

    A pass has no reason; where second opinions were asked, its grade stands in for it.
    """
    verdicts, reasons = (table.column(name).combine_chunks() for name in ("verdict", "reason"))
    reasons = _coalesced(table.column("robustness"), reasons)
    whys = reasons.dictionary.to_pylist()
    pairs = verdicts.indices.to_numpy().astype(np.int64) * max(len(whys), 1) + reasons.indices.to_numpy()
    place = np.zeros(int(pairs.max(initial=0)) + 1, np.uint8)
    for pair in np.unique(pairs):
        verdict, why = verdicts.dictionary[int(pair) // len(whys)].as_py(), whys[int(pair) % len(whys)]
        grade = why if verdict == "pass" else ""
        name = f"{verdict}: {why}" if why and (asked or not grade) else verdict
        if (name, grade) not in names:
            names.append((name, grade))
        place[pair] = names.index((name, grade))
    return place[pairs]


def _coalesced(first: Any, second: Any) -> Any:
    """Words of the first column, of the second where it has none."""
    import pyarrow.compute as pc

    return pc.coalesce(first.combine_chunks().cast("string"), second.cast("string")).dictionary_encode()
