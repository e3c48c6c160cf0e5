"""One entry of the file to numbers: a value, a list, or a range with exact steps."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.numbers import Quantity, describe, quoted, read_count, read_quantity
from boulder_sweep.settings.problems import (
    LeafError,
    Mistake,
    Mistakes,
    Position,
    did_you_mean,
    shorten,
    unknown_word,
    wrong,
)
from boulder_sweep.settings.tree import Mapping, Node, Scalar, Sequence

MAX_AXIS = 1_000_000
"""Most values on one axis."""

OUTSIDE = "{value} is outside the admitted range of {low} to {high} ({reason})"
"""Why a value is not admitted; the page of a report says the same."""

RANGE_KEYS = ("from", "to", "count", "step")
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
    """

    values: np.ndarray
    is_axis: bool
    position: Position


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
        return Leaf(np.array(_read_range(node, field)), True, node.position)
    items: list[Node] = [node]
    unit = None
    if isinstance(node, Sequence):
        items, unit = node.items, node.unit
    if not items:
        raise wrong(node.position, "the list is empty; give at least one value")
    if len(items) > MAX_AXIS:
        raise wrong(node.position, f"{len(items)} values are too many; an axis takes at most {MAX_AXIS}")
    values = _check_values(_read_all(items, field, unit), items, field)
    return Leaf(np.array(values), isinstance(node, Sequence), node.position)


def read_single(node: Node, field: Field) -> float:
    """Return the one value of an entry that cannot be an axis, within its admitted range.

    Raises
    ------
    LeafError
        Not one number, wrong unit, or outside the admitted range.
    """
    if not isinstance(node, Scalar):
        raise wrong(node.position, "takes one value here, not a list or a range")
    (value,) = _check_values([read_quantity(node, field.unit, sample=sample_of(field))], [node], field)
    return value


def read_entries(node: Node, known: dict[str, Field], what: str, mistakes: Mistakes) -> dict[str, float]:
    """Return the single values of a block by their keys; unknown keys and wrong values go to `mistakes`.

    Raises
    ------
    LeafError
        It is no block.
    """
    if not isinstance(node, Mapping) or node.unit is not None:
        raise wrong(node.position, f"{what} must be a block of keys: {', '.join(known)}")
    values: dict[str, float] = {}
    for entry in node:
        field = known.get(entry.key)
        if field is None:
            mistakes.add(entry.position, unknown_word(entry.key, f"a key of {what}", known))
            continue
        try:
            values[entry.key] = read_single(entry.value, field)
        except LeafError as error:
            for found in error.mistakes:
                mistakes.add(found.position, f"{entry.key}: {found.message}")
    return values


def read_block(node: Node, known: dict[str, Field], what: str) -> dict[str, float]:
    """Return the single values of a block by the names of its fields.

    Raises
    ------
    LeafError
        With every mistake in it, see `read_entries`.
    """
    mistakes = Mistakes()
    values = read_entries(node, known, what, mistakes)
    mistakes.raise_if_any()
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
    mistakes = Mistakes()
    for item in items:
        with mistakes:
            quantities.append(read_quantity(item, field.unit, unit, sample_of(field)))
    if not mistakes and len({quantity.has_unit for quantity in quantities}) > 1:
        bare = next(item for item, quantity in zip(items, quantities, strict=True) if not quantity.has_unit)
        message = f"{quoted(bare)} has no unit while the others have one; give all of them a unit, or none"
        mistakes.add(bare.position, message)
    unlike: dict[str, Mistake] = {}  # the same mistake in many values is reported once
    for mistake in mistakes:
        unlike.setdefault(mistake.message, mistake)
    Mistakes(unlike.values()).raise_if_any()
    return quantities


def _check_values(quantities: list[Quantity], nodes: list[Node], field: Field) -> list[float]:
    """Return the values; every one of them must be admitted."""
    values = [_to_float(quantity.value) for quantity in quantities]
    mistakes = Mistakes()
    for node, value in zip(nodes, values, strict=True):
        problem = outside(value, field)
        if problem:
            mistakes.add(node.position, problem)
    mistakes.raise_if_any()
    return values


def _read_range(node: Mapping, field: Field) -> list[float]:
    """Return the values of ``{from, to, count}`` or ``{from, to, step}``."""
    _check_range_keys(node)
    given = [entry for entry in node if entry.key != "count"]
    quantities = _read_all([entry.value for entry in given], field, node.unit)
    exact = {entry.key: quantity for entry, quantity in zip(given, quantities, strict=True)}
    ends = [key for key in exact if key != "step"]
    _check_values([exact[key] for key in ends], [node.entries[key].value for key in ends], field)
    first, last = exact["from"].value, exact["to"].value
    if "step" in exact:
        position = node.entries["step"].value.position
        return spread(first, last, _count_of_step(first, last, exact["step"].value, field.unit, position))
    of_count = node.entries["count"].value
    count = read_count(of_count, "count", MAX_AXIS)
    if count == 1 and first != last:
        message = "a count of 1 cannot hold both ends of the range; give a count of 2 or more, or one value"
        raise wrong(of_count.position, message)
    return spread(first, last, count)


def _check_range_keys(node: Mapping) -> None:
    mistakes = Mistakes()
    for entry in node:
        if entry.key not in RANGE_KEYS:
            hint = did_you_mean(entry.key, RANGE_KEYS)
            message = f"'{shorten(entry.key)}' is not a key of a range (from, to, count or step){hint}"
            mistakes.add(entry.position, message)
    mistakes.raise_if_any()
    missing = [key for key in ("from", "to") if key not in node.entries]
    if missing:
        raise wrong(node.position, f"the range lacks {' and '.join(missing)}")
    if "count" in node.entries and "step" in node.entries:
        raise wrong(node.entries["step"].position, "give count or step, not both")
    if "count" not in node.entries and "step" not in node.entries:
        raise wrong(node.position, "the range lacks count or step")


def _count_of_step(first: Fraction, last: Fraction, step: Fraction, unit: str, position: Position) -> int:
    """Return how many values the steps make; the last one must be the end of the range, exactly."""
    if step == 0:
        raise wrong(position, "step must not be 0")
    steps = (last - first) / step
    if steps < 0:
        way = "downwards" if last < first else "upwards"
        message = f"the range goes {way} and the step does not; swap from and to, or change the sign of the step"
        raise wrong(position, message)
    if steps >= MAX_AXIS:
        raise wrong(position, f"this gives more than {MAX_AXIS} values, the limit for one axis; use a larger step")
    if steps.denominator != 1:
        below = first + math.floor(steps) * step
        start, end, low, high = (describe(float(value), unit) for value in (first, last, below, below + step))
        raise wrong(
            position,
            f"steps of {describe(float(step), unit)} from {start} do not end at {end} but at {low} or {high}; "
            "use one of these for 'to', or give count",
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
