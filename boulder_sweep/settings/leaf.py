"""One entry of the file to numbers: a value, a list, or a range with exact steps."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from boulder_sweep.settings.distributions import Distribution, SetDistributions
from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.numbers import NumberError, Quantity, describe, read_count, read_quantity
from boulder_sweep.settings.problems import Position, did_you_mean, shorten
from boulder_sweep.settings.tree import Mapping, Node, Scalar, Sequence

MAX_AXIS = 1_000_000
"""Most values on one axis."""

OUTSIDE = "{value} is outside the admitted range of {low} to {high} ({reason})"
"""Why a value is not admitted; the page of a report says the same."""

_RANGE_KEYS = ("from", "to", "count", "step")
_TEXT_LIST = re.compile(r"\s*\[([^\[\]]*)\]\s*([^\[\],]*)", re.DOTALL)


@dataclass(frozen=True, eq=False)
class Leaf:
    """Values of one entry in the unit of the table.

    Attributes
    ----------
    values : ndarray of float64, shape (n,)
        The values in the order given.
    is_axis : bool
        Whether it was written as a list or range (an axis of the grid) or as one value.
    position : Position
        Where it stands.
    distribution : Distribution, SetDistributions or None
        Spread about the values, which are its means; None where the values are certain.
    """

    values: np.ndarray
    is_axis: bool
    position: Position
    distribution: Distribution | SetDistributions | None = None


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake within an entry."""

    position: Position
    message: str


class LeafError(Exception):
    """An entry that cannot be used, with every mistake in it."""

    def __init__(self, mistakes: list[Mistake]) -> None:
        super().__init__("; ".join(mistake.message for mistake in mistakes))
        self.mistakes = mistakes


def read_leaf(node: Node, field: Field) -> Leaf:
    """Return the values of an entry.

    Parameters
    ----------
    node : Node
        ``1.65 m``, ``[36, 40] deg``, ``[36 deg, 40 deg]``, ``{from: 1 m, to: 3 m, count: 5}`` or
        ``{from: 0.4, to: 0.7, step: 0.02}``.
    field : Field
        What it is about.

    Raises
    ------
    LeafError
        With every mistake of this entry.
    """
    node = _unfold_text_list(node)
    if isinstance(node, Mapping):
        values = _read_range(node, field)
        return Leaf(np.array(values), True, node.position)
    items: list[Node] = [node]
    if isinstance(node, Sequence):
        items = node.items
    if not items:
        raise LeafError([Mistake(node.position, "the list is empty; give at least one value")])
    if len(items) > MAX_AXIS:
        raise LeafError([Mistake(node.position, f"{len(items)} values are too many; an axis takes at most {MAX_AXIS}")])
    quantities = _read_all(items, field, node.unit if isinstance(node, Sequence) else None)
    values = _check_values(quantities, items, field)
    return Leaf(np.array(values), isinstance(node, Sequence), node.position)


def read_single(node: Node, field: Field) -> float:
    """Return the one value of an entry that cannot be an axis, within its admitted range.

    Raises
    ------
    LeafError
        Not one number, wrong unit, or outside the admitted range.
    """
    if not isinstance(node, Scalar):
        raise LeafError([Mistake(node.position, "takes one value here, not a list or a range")])
    try:
        value = _to_float(read_quantity(node, field.unit, sample=sample_of(field)).value)
    except NumberError as error:
        raise LeafError([Mistake(node.position, str(error))]) from None
    problem = outside(value, field)
    if problem:
        raise LeafError([Mistake(node.position, problem)])
    return value


def read_entries(node: Node, known: dict[str, Field], what: str) -> tuple[dict[str, float], list[Mistake]]:
    """Return the single values of a block by their keys, and every mistake in it: an unknown key, a wrong value.

    Raises
    ------
    LeafError
        It is no block.
    """
    keys = ", ".join(known)
    if not isinstance(node, Mapping) or node.unit is not None:
        raise LeafError([Mistake(node.position, f"{what} must be a block of keys: {keys}")])
    values: dict[str, float] = {}
    mistakes: list[Mistake] = []
    for entry in node:
        field = known.get(entry.key)
        if field is None:
            hint = did_you_mean(entry.key, tuple(known))
            mistakes.append(Mistake(entry.position, f"'{shorten(entry.key)}' is not a key of {what} ({keys}){hint}"))
            continue
        try:
            values[entry.key] = read_single(entry.value, field)
        except LeafError as error:
            mistakes.extend(Mistake(found.position, f"{entry.key}: {found.message}") for found in error.mistakes)
    return values, mistakes


def read_block(node: Node, known: dict[str, Field], what: str) -> dict[str, float]:
    """Return the single values of a block by the names of its fields.

    Raises
    ------
    LeafError
        With every mistake in it, see `read_entries`.
    """
    values, mistakes = read_entries(node, known, what)
    if mistakes:
        raise LeafError(mistakes)
    return {known[key].name: value for key, value in values.items()}


def sample_of(field: Field) -> str:
    """Return the value that a message about an entry suggests: its default; empty where it has none."""
    return "" if field.default is None else describe(field.default, field.unit)


def outside(value: float, field: Field) -> str:
    """Return why a value is not admitted, empty if it is."""
    bound = field.admitted
    if bound is None or bound.low <= value <= bound.high:
        return ""
    high = describe(bound.high, field.unit)
    return OUTSIDE.format(value=describe(value, field.unit), low=f"{bound.low:g}", high=high, reason=bound.reason)


def _unfold_text_list(node: Node) -> Node:
    """Turn the text ``"[36, 40] deg"`` in quotation marks into the list it stands for."""
    if not isinstance(node, Scalar):
        return node
    match = _TEXT_LIST.fullmatch(node.text)
    if match is None:
        return node
    items: list[Node] = [Scalar(node.position, part) for part in match[1].split(",")] if match[1].strip() else []
    unit = match[2].strip()
    return Sequence(node.position, items, Scalar(node.position, unit) if unit else None)


def _read_all(items: list[Node], field: Field, unit: Scalar | None) -> list[Quantity]:
    """Read every number of an entry; all of them with a unit or none."""
    quantities: list[Quantity] = []
    mistakes: dict[str, Mistake] = {}
    for item in items:
        try:
            quantities.append(read_quantity(item, field.unit, unit, sample_of(field)))
        except NumberError as error:
            mistakes.setdefault(str(error), Mistake(item.position, str(error)))
    if not mistakes and len({quantity.has_unit for quantity in quantities}) > 1:
        bare = next(item for item, quantity in zip(items, quantities, strict=True) if not quantity.has_unit)
        text = shorten(bare.text) if isinstance(bare, Scalar) else ""
        message = f"'{text}' has no unit while the others have one; give all of them a unit, or none"
        mistakes[message] = Mistake(bare.position, message)
    if mistakes:
        raise LeafError(list(mistakes.values()))
    return quantities


def _check_values(quantities: list[Quantity], nodes: list[Node], field: Field) -> list[float]:
    """Return the values; every one of them must be admitted."""
    values = [_to_float(quantity.value) for quantity in quantities]
    problems = ((node, outside(value, field)) for node, value in zip(nodes, values, strict=True))
    mistakes = [Mistake(node.position, problem) for node, problem in problems if problem]
    if mistakes:
        raise LeafError(mistakes)
    return values


def _read_range(node: Mapping, field: Field) -> list[float]:
    """Return the values of ``{from, to, count}`` or ``{from, to, step}``."""
    _check_range_keys(node)
    ends = [entry for entry in node if entry.key in ("from", "to", "step")]
    quantities = _read_all([entry.value for entry in ends], field, node.unit)
    exact = {entry.key: quantity.value for entry, quantity in zip(ends, quantities, strict=True)}
    bounding = [
        (quantity, entry.value) for entry, quantity in zip(ends, quantities, strict=True) if entry.key != "step"
    ]
    _check_values([quantity for quantity, _ in bounding], [value for _, value in bounding], field)
    try:
        if "step" in exact:
            count = _count_of_step(exact["from"], exact["to"], exact["step"], field.unit)
        else:
            count = _count_of_count(exact["from"], exact["to"], node.entries["count"].value)
    except NumberError as error:
        key = "step" if "step" in exact else "count"
        raise LeafError([Mistake(node.entries[key].value.position, str(error))]) from None
    return spread(exact["from"], exact["to"], count)


def _check_range_keys(node: Mapping) -> None:
    mistakes = []
    for entry in node:
        if entry.key not in _RANGE_KEYS:
            hint = did_you_mean(entry.key, _RANGE_KEYS)
            message = f"'{shorten(entry.key)}' is not a key of a range (from, to, count or step){hint}"
            mistakes.append(Mistake(entry.position, message))
    if not mistakes:
        missing = [key for key in ("from", "to") if key not in node.entries]
        if missing:
            mistakes.append(Mistake(node.position, f"the range lacks {' and '.join(missing)}"))
        elif "count" in node.entries and "step" in node.entries:
            mistakes.append(Mistake(node.entries["step"].position, "give count or step, not both"))
        elif "count" not in node.entries and "step" not in node.entries:
            mistakes.append(Mistake(node.position, "the range lacks count or step"))
    if mistakes:
        raise LeafError(mistakes)


def _count_of_count(first: Fraction, last: Fraction, node: Node) -> int:
    count = read_count(node, "count", MAX_AXIS)
    if count == 1 and first != last:
        raise NumberError("a count of 1 cannot hold both ends of the range; give a count of 2 or more, or one value")
    return count


def _count_of_step(first: Fraction, last: Fraction, step: Fraction, unit: str) -> int:
    """Return how many values the steps make; the last one must be the end of the range, exactly."""
    if step == 0:
        raise NumberError("step must not be 0")
    steps = (last - first) / step
    if steps < 0:
        way = "downwards" if last < first else "upwards"
        raise NumberError(
            f"the range goes {way} and the step does not; swap from and to, or change the sign of the step"
        )
    if steps >= MAX_AXIS:
        raise NumberError(f"this gives more than {MAX_AXIS} values, the limit for one axis; use a larger step")
    if steps.denominator != 1:
        below = first + math.floor(steps) * step
        above = below + step
        raise NumberError(
            f"steps of {describe(float(step), unit)} from {describe(float(first), unit)} do not end at "
            f"{describe(float(last), unit)} but at {describe(float(below), unit)} or "
            f"{describe(float(above), unit)}; use one of these for 'to', or give count"
        )
    return int(steps) + 1


def spread(first: Fraction, last: Fraction, count: int) -> list[float]:
    """Return `count` equidistant values from `first` to `last`, each the float nearest to its exact value."""
    if count == 1:
        return [float(first)]
    common = first.denominator * last.denominator
    start = first.numerator * last.denominator
    span = last.numerator * first.denominator - start
    # Integer over integer is rounded once, to the nearest float.
    return [(start * (count - 1) + span * i) / (common * (count - 1)) for i in range(count)]


def _to_float(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
