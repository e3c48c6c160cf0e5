"""The rows of a result for its page: one small number for each design, and the designs worth naming.

If the designs come from axes, their inputs follow from the settings; a table is read part by part.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_kernels import Control
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import CAPACITY, NEED, UNCERTAINTY, AnswerFile, answered, kind_of, result_of
from boulder_sweep.columns import BOULDER_MASS, INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import ReportError
from boulder_sweep.impact.recomputing import one_design
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.quantities import NEEDED, quantities_by
from boulder_sweep.locations import Location
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Shape
from boulder_sweep.store.reading import FinishedRows
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pyarrow as pa

RATIO, DEPTH = "embedment_ratio", "embedment_depth_m"
SIZES = ("boulder_length_m", "boulder_width_m", "boulder_height_m", "boulder_density_kg_m3")
CONDITIONS = ("soil", "vehicle", "speed")
"""What a boulder must withstand as it is; not the designer's choice."""
NOT_YET = "not computed yet"
MOST_ELEMENTS = 5000
"""Most soil elements that the page simulates with; the paper has as many."""


def condition_of(name: str) -> str:
    """Return which of the conditions an axis or a column belongs to; empty for what the designer chooses."""
    if name == "impact_speed_m_s":
        return "speed"
    if name == "impact_height_m":  # where the vehicle hits
        return "vehicle"
    section = BY_NAME[name].section if name in BY_NAME else name
    return section if section in CONDITIONS else ""


def label_of(name: str) -> str:
    """Return the name of an input in words, without its unit; a named set is called what it is."""
    if name not in BY_NAME:
        return name
    return BY_NAME[name].path.replace(".", " ").replace("_", " ").removeprefix("site ")


def inputs_of(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs among the columns of a row."""
    return {name: row[name] for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS) if name in row}


class NamedSets(NamedTuple):
    """An axis of named soils or vehicles."""

    names: tuple[str, ...]
    inputs: dict[str, np.ndarray]
    """What each of them gives."""


@dataclass(frozen=True, eq=False)
class ResultRows:
    """The rows of a result."""

    finished: FinishedRows | AnswerFile
    """Those that were there when they were read."""
    names: tuple[str, ...]
    """What a code stands for: verdict and reason, ``fail: overturns``, or the grade of a pass of which second opinions
    were asked, ``pass: robust``; the last is for rows not computed yet."""
    codes: np.ndarray
    """Index of the name of every row, uint8, shape (rows,)."""
    grades: dict[str, int]
    """Designs that pass, by their robustness. Empty for a table that does not have it."""
    axes: dict[str, np.ndarray]
    """Values along each axis of the grid, the last fastest; for named sets of soils or vehicles their numbers. Empty
    for a list of designs."""
    sets: dict[str, NamedSets]
    """The axes that are named sets."""
    inputs: dict[str, np.ndarray]
    """Given inputs: single values, axes in their dimension, or one value for each row. They broadcast against each
    other, and for a grid against its shape."""
    robustness: tuple[str, ...] = ()
    """Grade of the designs of each code, asked for or not; empty words where there is none."""
    asks: bool = True
    """Whether second opinions are asked now, where the result asked for none."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis; the number of rows for a list of designs."""
        return tuple(len(values) for values in self.axes.values()) or self.codes.shape

    @property
    def settings(self) -> dict[str, Any]:
        """The resolved settings of the sweep."""
        return self.finished.identity["settings"]

    @property
    def kind(self) -> str:
        """The command that wrote the result."""
        return kind_of(self.finished)

    def having(self, verdict: str) -> np.ndarray:
        """Whether rows have a verdict, in the shape of the grid."""
        codes = [code for code, name in enumerate(self.names) if name.partition(":")[0] == verdict]
        return np.isin(self.codes, codes).reshape(self.shape)

    def counts(self) -> dict[str, int]:
        """Return the number of rows of each name."""
        counts: Counter[str] = Counter()
        for name, n in zip(self.names, np.bincount(self.codes, minlength=len(self.names)).tolist(), strict=True):
            counts[name] += n
        return dict(+counts)

    @cached_property
    def need(self) -> Need | None:
        """The answers of `sweep need`; None of any other result."""
        answers = self.finished.answers() if isinstance(self.finished, AnswerFile) and self.kind == NEED else None
        return answers if isinstance(answers, Need) else None

    def depth(self) -> np.ndarray:
        """Embedment depth [m] of every design, in the shape of the grid."""
        given = DEPTH in self.inputs
        depth = self.inputs[DEPTH] if given else self.inputs[RATIO] * self.inputs["boulder_height_m"]
        return np.broadcast_to(depth, self.shape)

    def mass(self) -> np.ndarray:
        """Mass of the boulder [kg] of every design, in the shape of the grid."""
        if BOULDER_MASS in self.inputs:
            return np.broadcast_to(self.inputs[BOULDER_MASS], self.shape)
        length, width, height, density = (self.inputs[name] for name in SIZES)
        mass = length * width * height * density * Shape.of_model(self.settings["model"]).filled
        return np.broadcast_to(mass, self.shape)

    def to_build(self, number: int) -> dict[str, float]:
        """Return what one design takes to build, by the names of `boulder_sweep.judge.quantities.QUANTITIES`."""
        columns = self.inputs | {DEPTH: self.depth()}
        names = (*NEEDED, *({BOULDER_MASS} & set(columns)))
        design = {name: np.broadcast_to(columns[name], self.shape).flat[number] for name in names}
        return {name: float(value) for name, value in quantities_by(design, self.settings).items()}

    def varying(self) -> tuple[str, ...]:
        """Axes of more than one value; of a list, the columns of more than one value."""
        if self.axes:
            return tuple(name for name, values in self.axes.items() if len(values) > 1)
        return tuple(name for name, column in self.inputs.items() if column.ndim and (column != column[0]).any())

    def over(self, values: np.ndarray, kinds: Sequence[str], ufunc: np.ufunc) -> np.ndarray:
        """Return for every row what a ufunc makes of all rows that differ from it in nothing but some conditions.

        Values and result have the shape of the grid; the ufunc takes two values: the least, the greatest, the sum.
        """
        over = [name for name in self.varying() if condition_of(name) in kinds]
        if not over:
            return values
        if self.axes:
            along = tuple(list(self.axes).index(name) for name in over)
            return np.broadcast_to(ufunc.reduce(values, axis=along, keepdims=True), self.shape)
        boulders = self.boulders(over)
        _, first, index = np.unique(boulders, return_index=True, return_inverse=True)
        made, others = values[first], np.setdiff1d(np.arange(len(values)), first)
        ufunc.at(made, index[others], values[others])
        return made[index]

    def siblings(self, number: int, kinds: Sequence[str]) -> np.ndarray:
        """Return the rows, in ascending order, that differ from one in nothing but some conditions."""
        over = [name for name in self.varying() if condition_of(name) in kinds]
        if not self.axes:
            boulders = self.boulders(over)
            return np.flatnonzero(boulders == boulders[number])
        here = np.unravel_index(number, self.shape)
        lines = [
            np.arange(length) if name in over else here[k : k + 1]
            for k, (name, length) in enumerate(zip(self.axes, self.shape, strict=True))
        ]
        return np.sort(np.ravel_multi_index(np.meshgrid(*lines, indexing="ij"), self.shape).ravel())

    def boulders(self, over: Sequence[str]) -> np.ndarray:
        """Return a number for every design of a list, the same for those that differ in nothing but some columns."""
        boulders = np.zeros(len(self.codes), np.int64)
        for name in self.varying():
            if name not in over:
                # Columns that follow from others may differ in their last digits.
                values = np.unique(self.inputs[name])
                apart = np.diff(values, prepend=values[:1]) > 1e-12 * np.abs(values)
                ranks = np.cumsum(apart)[np.searchsorted(values, self.inputs[name])]
                # Rows that are not computed yet have no inputs: they are no rows of a known boulder.
                ranks = np.where(np.isnan(self.inputs[name]), ranks.max() + 1, ranks)
                boulders = np.unique(boulders * (ranks.max() + 1) + ranks, return_inverse=True)[1]
        return boulders

    def margins(self, numbers: np.ndarray) -> np.ndarray:
        """Return the margin of some rows, given in ascending order; NaN for none."""
        margins = np.full(len(numbers), np.nan)
        for table in self.finished.tables(["design_id", "margin"], verify=False):
            ids = table.column("design_id").to_numpy()
            here = np.flatnonzero(np.isin(numbers, ids))
            margins[here] = table.column("margin").to_numpy()[np.searchsorted(ids, numbers[here])]
        return margins

    def row(self, number: int) -> dict[str, Any]:
        """Return one row of the table, None for null; IndexError where the table does not have it (yet)."""
        row: dict[str, Any] = self.finished.row(number).to_pylist()[0]
        if BOULDER_MASS in row and BOULDER_MASS not in self.settings["inputs"]:
            del row[BOULDER_MASS]  # answers tell it whether it was given or not
        return row

    def grade(self, row: dict[str, Any]) -> str | None:
        """Return the robustness of a row; where the table left it open, second opinions are asked now, if `asks`.

        None where the row does not pass, or not by today's rules; and where the row stands for the designs drawn, of
        which it is the mean.
        """
        if "p_pass" in row:
            return None
        if not self.asks or row["verdict"] != "pass" or row.get("robustness") not in ("open", None):
            return row.get("robustness")
        identity = self.finished.identity
        try:
            control = Control(**identity["control"])
            sweep = one_design(identity["settings"], inputs_of(row), control, row["step_s"] or control.h)
        except LookupError:
            return row.get("robustness")
        evaluation, block = evaluation_of(sweep, accuracy_of(sweep)), sweep.block(0, 1)
        grade: str | None = evaluation.graded(evaluation(block), block).row(0)["robustness"]
        return grade

    def chances(self) -> np.ndarray | None:
        """Return the probability of passing of every design, shape (rows,); None for the result of a run."""
        if self.kind != UNCERTAINTY:
            return None
        return next(self.finished.tables(["p_pass"])).column("p_pass").to_numpy()


def read_rows(folder: Location, finished: FinishedRows | AnswerFile | None = None) -> ResultRows:
    """Read what the page needs of a result, which may be open already.

    Raise StoreError where there is no result in the folder or it is damaged, and ReportError where a file is not one
    of answers, or rows of it are missing or in another order.
    """
    finished = finished or result_of(folder, ReportError)
    settings = finished.identity["settings"]
    order, given = settings["order"], settings["inputs"]
    if isinstance(finished, AnswerFile):
        _check_whole(finished, folder)
        if finished.kind == NEED:  # a list of the designs at the answers
            order, given = "table", _inputs_of(finished.table, given)
            finished.table = answered(finished.table)
    sets = {} if order == "table" else dict(_sets(settings))
    # Very long axes and the columns of a list are only in the table.
    names_of, long = (given, list | dict) if order == "table" else (order, dict)
    wanted = [name for name in names_of if isinstance(given.get(name), long)]
    stored = list(dict.fromkeys(column for name in wanted for column in _stored(name)))
    codes = np.full(finished.rows, 255, np.uint8)
    columns = {name: np.full(finished.rows, np.nan) for name in stored}
    names: list[tuple[str, str]] = []
    grades: Counter[str] = Counter()
    asked = bool(settings["model"].get("second_opinion")) or kind_of(finished) in (NEED, CAPACITY)
    for table in finished.tables(["design_id", "verdict", "reason", "robustness", *stored]):
        grades.update(_grades_of(table))
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
    for index, (axis, values) in enumerate(axes.items()):
        for name, along in (sets[axis].inputs if axis in sets else {axis: values}).items():
            inputs[name] = along.reshape([-1 if k == index else 1 for k in range(len(axes))])
    words, robustness = zip(*names, (NOT_YET, ""), strict=True)
    return ResultRows(finished, words, codes, dict(grades), axes, sets, inputs, robustness)


def _check_whole(file: AnswerFile, path: Location) -> None:
    """Refuse a file from which rows were taken, or whose rows were put in another order."""
    asked, ids = file.asked, next(file.tables(["design_id"])).column("design_id").to_numpy()
    if len(ids) != asked or not np.array_equal(ids, np.arange(asked)):
        raise ReportError(
            f"{path} does not hold the rows of its {counted(asked, 'design')} in their order; "
            f"write it again with `sweep {file.kind}`"
        )


def _inputs_of(table: pa.Table, given: dict[str, Any]) -> dict[str, Any]:
    """Return the inputs of answers as a list of designs has them; what follows from others is left out."""
    inputs: dict[str, Any] = {}
    for name in (name for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS) if name in table.column_names):
        optional = name in OPTIONAL_COLUMNS and name not in given
        if not optional and (name == DEPTH or not isinstance(given.get(name), str)):
            values = table[name].unique().to_pylist()
            inputs[name] = values if len(values) > 1 else values[0]
    return inputs


def _sets(settings: dict[str, Any]) -> Iterator[tuple[str, NamedSets]]:
    """Yield the axes that are named sets, each with the inputs that it gives."""
    given, order = settings["inputs"], settings["order"]
    for axis, names in settings.get("labels", {}).items():
        listed = {name: value for name, value in given.items() if isinstance(value, list) and name not in order}
        inputs = {name: np.array(value) for name, value in listed.items() if BY_NAME[name].section == axis}
        yield axis, NamedSets(tuple(names), inputs)


def _stored(name: str) -> tuple[str, ...]:
    """Columns that a quantity follows from."""
    return (DEPTH, "boulder_height_m") if name == RATIO else (name,)


def _column(columns: dict[str, np.ndarray], name: str) -> np.ndarray:
    return columns[DEPTH] / columns["boulder_height_m"] if name == RATIO else columns[name]


def _axes(
    settings: dict[str, Any], sets: dict[str, NamedSets], columns: dict[str, np.ndarray]
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the axes with their values; named sets are counted by their names."""
    given = settings["inputs"]
    counted_by = [(given | settings.get("labels", {}))[name] for name in settings["order"]]
    lengths = [int(axis["count"]) if isinstance(axis, dict) else len(axis) for axis in counted_by]
    for k, (name, length) in enumerate(zip(settings["order"], lengths, strict=True)):
        if name in sets:
            yield name, np.arange(length)
        elif isinstance(given[name], list):
            yield name, np.array(given[name])
        else:
            step = int(np.prod(lengths[k + 1 :], dtype=np.int64))
            yield name, _column(columns, name)[: step * length : step]


def _grades_of(table: Any) -> dict[str, int]:
    """Return the number of passing designs of a part for each grade."""
    import pyarrow.compute as pc

    words = table.column("robustness").filter(pc.equal(table.column("verdict").cast("string"), "pass"))
    return {one["values"] or "": one["counts"] for one in pc.value_counts(words.cast("string")).to_pylist()}


def _codes(table: Any, names: list[tuple[str, str]], *, asked: bool) -> np.ndarray:
    """Code of every row of a part; new names, each with the grade of its designs, are added.

    A pass has no reason; where second opinions were asked, its grade stands in for it.
    """
    import pyarrow.compute as pc

    verdicts, reasons, grades = (table.column(name).combine_chunks() for name in ("verdict", "reason", "robustness"))
    reasons = pc.coalesce(grades.cast("string"), reasons.cast("string")).dictionary_encode()
    whys = reasons.dictionary.to_pylist()
    pairs = verdicts.indices.to_numpy().astype(np.int64) * max(len(whys), 1) + reasons.indices.to_numpy()
    codes = np.zeros(int(pairs.max(initial=0)) + 1, np.uint8)
    for pair in np.unique(pairs):
        verdict, why = verdicts.dictionary[int(pair) // len(whys)].as_py(), whys[int(pair) % len(whys)]
        grade = why if verdict == "pass" else ""
        name = f"{verdict}: {why}" if why and (asked or not grade) else verdict
        if (name, grade) not in names:
            names.append((name, grade))
        codes[pair] = names.index((name, grade))
    return codes[pairs]
