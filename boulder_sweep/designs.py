"""From axes to columns of designs, block by block: the grid is never expanded as a whole.

The number of a design is its position in the grid, the last axis changing fastest. Which value a design
takes on an axis follows from its number by division, so any block of rows can be made without the others.
A column that depends on few values stays a dictionary of them with a code per row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from boulder_sweep.columns import BOULDER_MASS, INPUT_COLUMNS, OPTIONAL_COLUMNS

SIDES = ("boulder_length_m", "boulder_width_m", "boulder_height_m")
LEAST_SOLIDITY, MOST_SOLIDITY = 0.95, 1.15
"""Volume of a boulder by its mass, over the volume of the box of its sides, between which it counts as this box: sides
are taped to 5 cm, and mass and density are not known better. More is a mistake."""
LEAST_TAPED = 0.4
"""Least share of its box that a boulder fills: between this and `LEAST_SOLIDITY` the worst of a family of shapes stands
for it (`boulder_sweep.stones.taped`). With less it is no block, and no shape stands for it."""
MAX_DICTIONARY = 1 << 16
"""Largest dictionary of a column; beyond that a column holds one value per row."""


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One input of a block of designs, of n rows."""

    codes: np.ndarray | None
    """Row i has ``values[codes[i]]``, int32, shape (n,); None where `values` has one entry per row."""
    values: np.ndarray
    """Values in the unit of the column, float64."""

    def __len__(self) -> int:
        return len(self.values if self.codes is None else self.codes)

    def to_numpy(self) -> np.ndarray:
        """Return one float64 per row."""
        if self.codes is None:
            return self.values
        if len(self.values) == 1:
            return np.full(len(self.codes), self.values[0])
        return self.values.take(self.codes.astype(np.intp))  # faster than by codes of 32 bits


@dataclass(frozen=True, slots=True, eq=False)
class Reasons:
    """Why rows cannot be computed."""

    codes: np.ndarray
    """0 where the row can be computed, otherwise an index into `REASONS`; int8, shape (n,)."""

    def __getitem__(self, row: int) -> str:
        return REASONS[int(self.codes[row])]

    @property
    def any(self) -> bool:
        """Whether some row cannot be computed."""
        return bool(self.codes.any())


@dataclass(frozen=True, slots=True, eq=False)
class Label:
    """Text that belongs to the designs and decides nothing: an ID, or the name of a soil."""

    codes: np.ndarray
    """Row i has ``words[codes[i]]``, int32. A `DesignPlan` has one along the axis `axis`, a block one for each row."""
    words: tuple[str, ...]
    axis: int = 0
    """Position of the axis it goes along; of no meaning in a block."""

    def at(self, indices: np.ndarray) -> Label:
        """Return the label at some indices along its axis, with no more words than these need."""
        used, codes = np.unique(self.codes[indices], return_inverse=True)
        return Label(codes.astype(np.int32), tuple(self.words[code] for code in used))


@dataclass(frozen=True, slots=True, eq=False)
class DesignBlock:
    """Rows ``[start, stop)`` of a sweep, or some of them."""

    start: int
    stop: int
    """Numbers of the first design and of the one after the last."""
    columns: dict[str, Column]
    """Every input column of the table but ``design_id``, in the order of the table."""
    reasons: Reasons
    labels: dict[str, Label] = field(default_factory=dict)
    numbers: np.ndarray | None = None
    """Numbers of the designs where they are not all of ``[start, stop)``, int64, shape (n,)."""
    cases: tuple[DesignBlock, ...] = ()
    """The same rows with other values of their uncertain inputs, by which they are judged, too; none as a rule."""

    def __len__(self) -> int:
        return self.stop - self.start if self.numbers is None else len(self.numbers)

    def design_id(self) -> np.ndarray:
        """Return the numbers of the designs, int64."""
        return np.arange(self.start, self.stop, dtype=np.int64) if self.numbers is None else self.numbers


class Source:
    """Values of one quantity over some axes of the grid, the last axis changing fastest.

    The axes are given by their positions, ascending; there are none for a constant.
    """

    def __init__(self, values: np.ndarray, axes: tuple[int, ...] = ()) -> None:
        self.values = np.ascontiguousarray(values)
        self.axes = axes

        self.dictionary: tuple[np.ndarray | None, np.ndarray] = None, self.values
        """Indices into the dictionary for every value (None: its own index), and the dictionary."""

    def find_dictionary(self) -> None:
        """Look for repeated values; called once, before the first block, so that all blocks cost the same."""
        head = self.values[: 2 * MAX_DICTIONARY]
        if len(head) < len(self.values) and len(np.unique(head)) > MAX_DICTIONARY:
            return  # a long list without repetition: sorting it all would be wasted
        unique, inverse = np.unique(self.values, return_inverse=True)
        if len(unique) < len(self.values):
            self.dictionary = inverse.astype(np.int32), unique


@dataclass(frozen=True, eq=False)
class Formula:
    """A quantity computed from others row by row, where the combinations are too many to keep."""

    function: Callable[..., np.ndarray]
    inputs: tuple[Source | Formula, ...]


PlannedInput = Source | Formula
Known = TypeVar("Known")
"""What is known of a quantity: its values, or how they follow from the axes."""

REASONS = (
    "",
    "embedment depth is not less than the boulder's height",
    "hood is lower than the bumper",
    "impact height is above the top of the boulder",
    "boulder is heavier than a solid box of its size and rock",
    "unusual",
)
UNUSUAL = REASONS[-1]
"""Stands among what is given of designs for whether some of it is so far from usual that the file must allow it, 1 or
0; a file without a list of designs is refused for such a value."""


def embedment_of_ratio(ratio: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return the embedment depth d = ratio * H [m]."""
    return ratio * height


def impact_height_of_face(
    height: np.ndarray | float, embedment: np.ndarray | float, bumper: np.ndarray | float, hood: np.ndarray | float
) -> np.ndarray:
    """Return the impact height over the soil line [m], Eq 9.

    e = (e' + e_bumper) / 2 with e' = min(H - d, hood height).
    """
    return 0.5 * (np.minimum(height - embedment, hood) + bumper)


def refusal(
    height: np.ndarray, embedment: np.ndarray, bumper: np.ndarray, hood: np.ndarray, impact: np.ndarray
) -> np.ndarray:
    """Return for every row the index in `REASONS` of why it cannot be computed, int8.

    An impact height given by the user must lie on the boulder; where the bumper passes over the boulder
    there is no impact and its height does not matter.
    """
    exposed = height - embedment
    codes = np.zeros(exposed.shape, dtype=np.int8)
    codes[(impact > exposed * (1.0 + 1e-12)) & (exposed > bumper)] = 3
    codes[hood < bumper] = 2
    codes[exposed <= 0.0] = 1
    return codes


def solidity_of(
    mass: np.ndarray, density: np.ndarray, length: np.ndarray, width: np.ndarray, height: np.ndarray
) -> np.ndarray:
    """Return the volume of boulders of a mass [kg] and rock [kg/m^3] over their boxes' [m]."""
    return mass / (density * (length * width * height))


def refusal_of_mass(codes: np.ndarray, mass: np.ndarray, density: np.ndarray, *sides: np.ndarray) -> np.ndarray:
    """Return the same as `refusal` for boulders that were weighed."""
    heavy = solidity_of(mass, density, *sides) > MOST_SOLIDITY
    return np.where(codes == 0, 4 * heavy, codes).astype(np.int8)


def refusal_of_unusual(codes: np.ndarray, unusual: np.ndarray) -> np.ndarray:
    """Return the same as `refusal` for designs of which some are `UNUSUAL`."""
    return np.where(unusual > 0.0, REASONS.index(UNUSUAL), codes).astype(np.int8)


def _completed(
    given: Mapping[str, Known], zero: Known, combine: Callable[..., Known]
) -> tuple[dict[str, Known], Known]:
    """Return every input column of designs by name, and for every row the index in `REASONS`.

    ``embedment_ratio`` may be given in place of ``embedment_depth_m``, and ``impact_height_m`` may be missing, as in a
    file; `zero` then stands for it, and lies on every boulder. `combine` is called with a function of arrays and what
    it is to be applied to; it returns its values.
    """
    known = dict(given)
    height, bumper, hood = known["boulder_height_m"], known["bumper_height_m"], known["hood_height_m"]
    if "embedment_depth_m" not in known:
        known["embedment_depth_m"] = combine(embedment_of_ratio, known["embedment_ratio"], height)
    embedment = known["embedment_depth_m"]
    impact = known.get("impact_height_m", zero)
    if "impact_height_m" not in known:
        known["impact_height_m"] = combine(impact_height_of_face, height, embedment, bumper, hood)
    refusals = combine(refusal, height, embedment, bumper, hood, impact)
    if BOULDER_MASS in known:
        weighed = (known[name] for name in (BOULDER_MASS, "boulder_density_kg_m3", *SIDES))
        refusals = combine(refusal_of_mass, refusals, *weighed)
    if UNUSUAL in known:
        refusals = combine(refusal_of_unusual, refusals, known[UNUSUAL])
    names = (*INPUT_COLUMNS, *(name for name in OPTIONAL_COLUMNS if name in known))
    return {name: known[name] for name in names}, refusals


class DesignPlan:
    """How every input column of a sweep follows from its axes, whose lengths are in the order of the file.

    What is given may lack columns as in `_completed`. The cases are plans of the same lengths with other values of
    uncertain inputs, see `DesignBlock.cases`.
    """

    def __init__(
        self,
        lengths: Sequence[int],
        given: Mapping[str, Source],
        labels: Mapping[str, Label] | None = None,
        cases: Sequence[DesignPlan] = (),
    ) -> None:
        self.cases = tuple(cases)
        self.labels = dict(labels or {})
        self.lengths = tuple(int(length) for length in lengths)
        self.n_designs = math.prod(self.lengths)
        self.strides = tuple(math.prod(self.lengths[k + 1 :]) for k in range(len(self.lengths)))
        self.given = dict(given)
        quantities: dict[str, PlannedInput] = dict(given)
        self.columns, self.refusals = _completed(quantities, Source(np.zeros(1)), self.combine)
        for quantity in self.columns.values():
            if isinstance(quantity, Source):
                quantity.find_dictionary()

    def combine(self, function: Callable[..., np.ndarray], *inputs: PlannedInput) -> PlannedInput:
        """Return ``function(*inputs)`` over all combinations if these are few, else per row."""
        sources = [quantity for quantity in inputs if isinstance(quantity, Source)]
        if len(sources) < len(inputs):
            return Formula(function, inputs)
        axes = tuple(sorted({axis for source in sources for axis in source.axes}))
        shape = tuple(self.lengths[axis] for axis in axes)
        if math.prod(shape) > max(MAX_DICTIONARY, *(len(source.values) for source in sources)):
            return Formula(function, inputs)
        grids = []
        for source in sources:
            lengths = tuple(self.lengths[axis] if axis in source.axes else 1 for axis in axes)
            grids.append(np.broadcast_to(source.values.reshape(lengths), shape))
        return Source(function(*grids).reshape(-1), axes)

    def block(self, start: int, stop: int) -> DesignBlock:
        """Return the designs ``[start, stop)``; raise IndexError where these are not within the sweep."""
        return self._block(_RowIndices(self, start, stop))

    def selection(self, numbers: np.ndarray) -> DesignBlock:
        """Return some designs by their numbers, int64, ascending, at least one; raise IndexError as `block`."""
        return self._block(_RowIndices(self, int(numbers[0]), int(numbers[-1]) + 1, numbers))

    def _block(self, rows: _RowIndices) -> DesignBlock:
        """Return the designs of some rows."""
        columns = {name: rows.column(quantity) for name, quantity in self.columns.items()}
        labels = {name: label.at(rows.index((label.axis,))) for name, label in self.labels.items()}
        reasons = Reasons(rows.values(self.refusals))
        cases = tuple(case._block(_RowIndices(case, rows.start, rows.stop, rows.numbers)) for case in self.cases)
        return DesignBlock(rows.start, rows.stop, columns, reasons, labels, rows.numbers, cases)

    def given_rows(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return what is given of the designs ``[start, stop)``, one value a row; what follows from it is left out.

        What differs in a case is there again under the name of `in_case`. Raise IndexError as `block`.
        """
        rows = _RowIndices(self, start, stop)
        given = {name: rows.values(source) for name, source in self.given.items()}
        for number, case in enumerate(self.cases):
            for name, values in case.given_rows(start, stop).items():
                if not np.array_equal(values, given[name]):
                    given[in_case(name, number)] = values
        return given


def in_case(name: str, number: int) -> str:
    """Return the name of an input in a case, among what is given row by row."""
    return f"{name}@{number}"


def input_of(name: str) -> str:
    """Return the input that a name of `in_case` is about; any other name is its own."""
    return name.partition("@")[0]


def block_of(given: Mapping[str, np.ndarray]) -> DesignBlock:
    """Return designs given row by row as a block, numbered from 0, with the same bits as the same designs in a grid.

    Arrays have the shape (n,) and the units of the table; columns may be missing as in `_completed`. What differs in a
    case of the block stands under the name of `in_case`.
    """
    base = {name: values for name, values in given.items() if input_of(name) == name}
    values, codes = _completed(base, np.zeros(1), lambda function, *inputs: function(*inputs))
    columns = {name: Column(None, np.ascontiguousarray(one)) for name, one in values.items()}
    numbers = sorted({int(name.rpartition("@")[2]) for name in given.keys() - base.keys()})
    cases = (
        {input_of(name): values for name, values in given.items() if name == in_case(input_of(name), number)}
        for number in numbers
    )
    return DesignBlock(0, len(codes), columns, Reasons(codes), cases=tuple(block_of(base | case) for case in cases))


def some(block: DesignBlock, rows: np.ndarray) -> DesignBlock:
    """Return some rows of a block by their indices, without labels, numbered from 0."""
    columns = {name: Column(None, column.to_numpy()[rows]) for name, column in block.columns.items()}
    reasons = Reasons(block.reasons.codes[rows])
    return DesignBlock(0, len(rows), columns, reasons, cases=tuple(some(case, rows) for case in block.cases))


class _RowIndices:
    """Indices of a range of rows, or of some, along the axes; of 32 bits where they fit, several times as fast."""

    def __init__(self, plan: DesignPlan, start: int, stop: int, numbers: np.ndarray | None = None) -> None:
        if not 0 <= start <= stop <= plan.n_designs:
            raise IndexError(f"rows {start} to {stop} are not within the {plan.n_designs} designs of this sweep")
        self.plan = plan
        self.start, self.stop, self.numbers = start, stop, numbers
        self.count = stop - start if numbers is None else len(numbers)
        self.digits: dict[int, np.ndarray] = {}
        self.indices: dict[tuple[int, ...], np.ndarray] = {}

    def index(self, axes: tuple[int, ...]) -> np.ndarray:
        """Return the index of every row among the combinations of some axes, int32 or int64."""
        if axes not in self.indices:
            combinations = math.prod(self.plan.lengths[axis] for axis in axes)
            index = np.zeros(self.count, dtype=_whole_numbers(combinations))
            for axis in axes:
                index *= self.plan.lengths[axis]
                index += self.digit(axis)
            self.indices[axes] = index
        return self.indices[axes]

    def digit(self, axis: int) -> np.ndarray:
        """Return the index of every row along one axis, int32 or int64."""
        if axis not in self.digits:
            stride, length = self.plan.strides[axis], self.plan.lengths[axis]
            if self.numbers is not None:
                self.digits[axis] = self.numbers // stride % length
                return self.digits[axis]
            first, beyond = divmod(self.start, stride)
            largest = max(beyond, length, stride) + self.count
            # The number of a design may need 64 bits; how far it is from the first of the block hardly ever does.
            within: np.ndarray = np.arange(beyond, beyond + self.count, dtype=_whole_numbers(largest))
            index = within // stride + first % length
            self.digits[axis] = index - index // length * length  # several times as fast as a remainder
        return self.digits[axis]

    def column(self, quantity: PlannedInput) -> Column:
        """Return a quantity as a column, with codes where its dictionary is small."""
        if isinstance(quantity, Source):
            lookup, dictionary = quantity.dictionary
            if len(dictionary) <= MAX_DICTIONARY:
                index = self.index(quantity.axes)
                return Column(index.astype(np.int32, copy=False) if lookup is None else lookup[index], dictionary)
        return Column(None, np.ascontiguousarray(self.values(quantity)))

    def values(self, quantity: PlannedInput) -> np.ndarray:
        """Return one value per row."""
        if isinstance(quantity, Source):
            return quantity.values[self.index(quantity.axes)]
        return quantity.function(*(self.values(value) for value in quantity.inputs))


def _whole_numbers(largest: int) -> type[np.int32 | np.int64]:
    """Return the shortest type that holds whole numbers up to the largest."""
    return np.int32 if largest <= np.iinfo(np.int32).max else np.int64
