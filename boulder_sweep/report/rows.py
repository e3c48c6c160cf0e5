"""Contents of the page for a table of any size: one small number for each design, and the designs worth naming.

`boulder_sweep.report.reading` reads them. If the designs come from axes, their inputs follow from the settings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.answers.files import UNCERTAINTY, AnswerFile, kind_of
from boulder_sweep.columns import BOULDER_MASS, INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.impact.explanation import one_design
from boulder_sweep.judge.accuracy import accuracy_of, known_control
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.quantities import NEEDED, quantities_by
from boulder_sweep.locations import Location
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import completed
from boulder_sweep.settings.shape import Shape
from boulder_sweep.store.reader import FinishedRows, read_row

RATIO, DEPTH = "embedment_ratio", "embedment_depth_m"
SIZES = ("boulder_length_m", "boulder_width_m", "boulder_height_m", "boulder_density_kg_m3")
CONDITIONS = {"soil": "in every soil", "vehicle": "against every vehicle", "speed": "at every speed"}
"""What a boulder must withstand as it is, in the words of a sentence; not the designer's choice."""
NOT_YET = "not computed yet"
MOST_CELLS = 1_500_000
"""Most designs of a grid whose verdicts go into the page; of larger grids, some values of the longest axes are left
out."""
MOST_POINTS = 20_000
"""The same for a list of designs, each of which carries its inputs."""

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


class NamedSets(NamedTuple):
    """An axis of named soils or vehicles."""

    names: tuple[str, ...]
    inputs: dict[str, np.ndarray]
    """What each of them gives."""


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a result.

    Attributes
    ----------
    folder : Location
        Where they are.
    finished : FinishedRows or AnswerFile
        Those that were there when they were read.
    names : tuple of str
        What a code stands for: verdict and reason, ``fail: overturns``, or the grade of a pass of which second opinions
        were asked, ``pass: robust``; the last is for rows not computed yet.
    codes : ndarray of uint8, shape (rows,)
        Index of the name of every row.
    flags : dict of str to int
        Designs that pass, by validity flags; under ``""`` those without. Empty for a table that does not have them.
    grades : dict of str to int
        Designs that pass, by their robustness. Empty for a table that does not have it.
    axes : dict of str to ndarray
        Values along each axis of the grid, the last fastest; for named sets of soils or vehicles their numbers. Empty
        for a list of designs.
    sets : dict of str to NamedSets
        The axes that are named sets.
    inputs : dict of str to ndarray
        Given inputs: single values, axes in their dimension, or one value for each row. They broadcast against each
        other, and for a grid against its shape.
    robustness : tuple of str
        Grade of the designs of each code, asked for or not; empty words where there is none.
    """

    folder: Location
    finished: FinishedRows | AnswerFile
    names: tuple[str, ...]
    codes: np.ndarray
    flags: dict[str, int]
    grades: dict[str, int]
    axes: dict[str, np.ndarray]
    sets: dict[str, NamedSets]
    inputs: dict[str, np.ndarray]
    robustness: tuple[str, ...] = ()

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
        places = [place for place, name in enumerate(self.names) if name.partition(":")[0] == verdict]
        return np.isin(self.codes, places).reshape(self.shape)

    def counts(self) -> dict[str, int]:
        """Return the number of rows of each name."""
        found: Counter[str] = Counter()
        for name, n in zip(self.names, np.bincount(self.codes, minlength=len(self.names)).tolist(), strict=True):
            found[name] += n
        return dict(+found)

    def depth(self) -> np.ndarray:
        """Embedment depth [m] of every design, in a shape that broadcasts against that of the grid."""
        if DEPTH in self.inputs:
            return self.inputs[DEPTH]
        return self.inputs[RATIO] * self.inputs["boulder_height_m"]

    def mass(self) -> np.ndarray:
        """Mass of the boulder [kg] of every design, in the same shape."""
        if BOULDER_MASS in self.inputs:
            return self.inputs[BOULDER_MASS]
        length, width, height, density = (self.inputs[name] for name in SIZES)
        return length * width * height * density * Shape.of_model(self.settings["model"]).filled

    def to_build(self, number: int) -> dict[str, float]:
        """Return what one design takes to build, by the names of `boulder_sweep.judge.quantities.QUANTITIES`."""
        columns = self.inputs | {DEPTH: self.depth()}
        names = (*NEEDED, *({BOULDER_MASS} & set(columns)))
        own = {name: np.broadcast_to(columns[name], self.shape).flat[number] for name in names}
        return {name: float(value) for name, value in quantities_by(own, self.settings).items()}

    def varying(self) -> tuple[str, ...]:
        """Axes of more than one value; of a list, the columns of more than one value."""
        if self.axes:
            return tuple(name for name, values in self.axes.items() if len(values) > 1)
        return tuple(name for name, column in self.inputs.items() if column.ndim and (column != column[0]).any())

    def ends(self, name: str, numbers: np.ndarray) -> tuple[str | float, str | float]:
        """Return the least and the greatest value of designs on an axis or in a column; the name of a named set."""
        if not self.axes:
            values = self.inputs[name][numbers]
        else:
            index = np.unravel_index(numbers, self.shape)[list(self.axes).index(name)]
            if name in self.sets:
                return self.sets[name].names[int(index.min())], self.sets[name].names[int(index.max())]
            values = self.axes[name][index]
        return float(values.min()), float(values.max())

    def everywhere(self, holds: np.ndarray, kinds: Sequence[str]) -> np.ndarray:
        """Return which designs hold whatever is varied of some conditions.

        Parameters
        ----------
        holds : ndarray of bool, shape ``self.shape``
            Whether a design holds in its own row.
        kinds
            Conditions of `CONDITIONS`.

        Returns
        -------
        ndarray of bool, shape ``self.shape``
            Whether all rows hold that differ from a row in nothing else.
        """
        over = [name for name in self.varying() if condition_of(name) in kinds]
        if not over:
            return holds
        if self.axes:
            places = tuple(list(self.axes).index(name) for name in over)
            return np.broadcast_to(holds.all(axis=places, keepdims=True), self.shape)
        boulders = self.boulders(over)
        found = np.ones(boulders.max() + 1, bool)
        np.logical_and.at(found, boulders, holds)
        return found[boulders]

    def siblings(self, number: int, kinds: Sequence[str]) -> np.ndarray:
        """Return the rows, in ascending order, that differ from one in nothing but some conditions."""
        over = [name for name in self.varying() if condition_of(name) in kinds]
        if not self.axes:
            boulders = self.boulders(over)
            return np.flatnonzero(boulders == boulders[number])
        here = np.unravel_index(number, self.shape)
        lines = [
            np.arange(length) if name in over else here[place : place + 1]
            for place, (name, length) in enumerate(zip(self.axes, self.shape, strict=True))
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
                places = np.cumsum(apart)[np.searchsorted(values, self.inputs[name])]
                # Rows that are not computed yet have no inputs: they are no rows of a known boulder.
                places = np.where(np.isnan(self.inputs[name]), places.max() + 1, places)
                boulders = np.unique(boulders * (places.max() + 1) + places, return_inverse=True)[1]
        return boulders

    def margins(self, numbers: np.ndarray) -> np.ndarray:
        """Return the margin of some rows, given in ascending order; NaN for none."""
        found = np.full(len(numbers), np.nan)
        for table in self.finished.tables(["design_id", "margin"], verify=False):
            ids = table.column("design_id").to_numpy()
            here = np.flatnonzero((numbers >= ids.min(initial=0)) & (numbers <= ids.max(initial=-1)))
            found[here] = table.column("margin").to_numpy()[np.searchsorted(ids, numbers[here])]
        return found

    def row(self, number: int) -> dict[str, Any]:
        """Return one row of the table, None for null.

        Raises
        ------
        IndexError
            The table does not have this row (yet).
        """
        found = self.finished.row(number) if isinstance(self.finished, AnswerFile) else read_row(self.folder, number)
        row: dict[str, Any] = found.to_pylist()[0]
        if BOULDER_MASS in row and BOULDER_MASS not in self.settings["inputs"]:
            del row[BOULDER_MASS]  # answers tell it whether it was given or not
        return row

    def grade(self, row: dict[str, Any]) -> str | None:
        """Return the robustness of a row; where the table left it open, second opinions are asked now.

        None where the row does not pass, or not by today's rules, or its settings are not those of this version.
        """
        if row["verdict"] != "pass" or row.get("robustness") not in ("open", None):
            return row.get("robustness")
        identity = self.finished.identity
        inputs = {name: row[name] for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS) if name in row}
        try:
            control = known_control(identity["control"])
            sweep = one_design(completed(identity["settings"]), inputs, control, row["step_s"] or control.h)
        except (LookupError, TypeError, ValueError):
            return row.get("robustness")
        evaluation, block = evaluation_of(sweep, accuracy_of(sweep)), sweep.block(0, 1)
        grade: str | None = evaluation.graded(evaluation(block), block).row(0)["robustness"]
        return grade

    def chances(self) -> np.ndarray | None:
        """Return the probability of passing of every design, shape (rows,); None for the result of a run."""
        if self.kind != UNCERTAINTY:
            return None
        return next(self.finished.tables(["p_pass"])).column("p_pass").to_numpy()


@dataclass(frozen=True, eq=False)
class Thinned:
    """The part of a grid or list that goes into the page.

    Attributes
    ----------
    places : tuple of ndarray
        Indices kept along each axis; for a list, the rows.
    words : str
        What is left out; empty if nothing is.
    """

    places: tuple[np.ndarray, ...]
    words: str


def thinned(rows: Rows, most_cells: int = MOST_CELLS, most_points: int = MOST_POINTS) -> Thinned:
    """Choose the rows that go into the page: all, or values spread evenly along the longest axes."""
    if not rows.axes:
        computed = np.flatnonzero(~rows.having(NOT_YET))  # the inputs of the others are in no file yet
        n, kept = len(computed), min(len(computed), most_points)
        words = f"{kept:,} of the {n:,} designs of the list, spread evenly" if kept < n else ""
        return Thinned((computed[np.round(np.linspace(0, n - 1, kept)).astype(np.int64)],), words)
    lengths = list(rows.shape)
    while np.prod(lengths, dtype=float) > most_cells:
        longest = int(np.argmax(lengths))
        lengths[longest] = -(-lengths[longest] // 2)
    places = tuple(
        np.round(np.linspace(0, whole - 1, kept)).astype(np.int64)
        for whole, kept in zip(rows.shape, lengths, strict=True)
    )
    left = [
        f"{kept:,} of {whole:,} values of {name}"
        for name, whole, kept in zip(rows.axes, rows.shape, lengths, strict=True)
        if kept < whole
    ]
    return Thinned(places, f"{', '.join(left)}, spread evenly" if left else "")
