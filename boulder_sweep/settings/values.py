"""From text to numbers, as engineers write them: a value with or without a unit, a list, a range, a distribution.

A number is kept as an exact fraction of its decimal digits, so that ``0.40 + 15 * 0.02`` is 0.70 to the bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np

from boulder_sweep.settings.fields import FAR, Field
from boulder_sweep.settings.model import KINDS, Distribution, SetDistributions
from boulder_sweep.settings.problems import Position, Problems, did_you_mean, nearest, shorten, wrong
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence
from boulder_sweep.settings.units import (
    EXPECTED,
    SYSTEMS,
    UnitError,
    describe,
    factor,
    needed,
    range_words,
    shown_unit,
    suffix_unit,
    system_of,
)

MAX_AXIS = 1_000_000
OUTSIDE = "{value} is outside the admitted range of {low} to {high} ({reason})"
"""Why a value is not admitted; the page of a report says the same."""
WITHOUT_UNIT = ("1", "deg")
"""Units of the table in which a bare number is meant where units are asked for."""
RANGE_KEYS = ("from", "to", "count", "step")
_TEXT_LIST = re.compile(r"\s*\[([^\[\]]*)\]\s*([^\[\],]*)", re.DOTALL)

_NUMBER = re.compile(r"([+-]?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d+))?", re.ASCII)
_YES_NO = frozenset({"true", "false", "yes", "no", "on", "off", "y", "n"})
_NOT_FINITE = re.compile(r"[+-]?\.?(nan|inf|infinity)\b.*", re.IGNORECASE)
_FEET = r"(?P<feet>\d+\.?\d*|\.\d+)\s*(?:['′](?!['′])|(?:ft|foot|feet)(?![a-z])\.?)"
_FEET_AND_INCHES = re.compile(
    rf"(?P<sign>[+-]?)(?:{_FEET})?[\s-]*"
    r"(?:(?P<inches>(?:\d+\.?\d*|\.\d+)(?![\d./]))?[\s-]*(?:(?P<top>\d+)/(?P<bottom>[1-9]\d*))?"
    r"\s*(?P<mark>[\"″]|['′]{2}|(?:in|inch|inches)(?![a-z])\.?))?",
    re.ASCII,
)
_FEET_AND_A_NUMBER = re.compile(rf"[+-]?{_FEET}\s*\d{{1,2}}(?:\.\d*)?", re.ASCII)
_SEPARATED = re.compile(r"([+-]?)(\d[\d\s.,'’_]*\d)((?:[eE][+-]?\d+)?.*)", re.DOTALL)
_GROUPS = re.compile(r"([1-9]\d{0,2}(?:([\s.,'’_])\d{3})(?:\2\d{3})*)(?:(?!\2)[.,](\d+))?")
"""Digits in groups of three, and perhaps decimals behind another sign."""
_DECIMAL_COMMA = re.compile(r"[+-]?(?:0,\d+|\d+,(?!\d{3}$)\d+)")
"""A comma that stands for a decimal point: before three digits it separates thousands."""
EMPTY, NOT_A_NUMBER = "is empty", "is not a number"
"""What may be wrong with a number; the page of a report says the same."""
T = TypeVar("T")
FRACTILE_5 = 1.6448536269514722
"""Distance of the 5 % fractile of a normal distribution below its mean, in standard deviations."""
_MAX_DIGITS = 40
_MAX_EXPONENT = 300


class NumberError(ValueError):
    """Not the kind of number that is needed; the message says what is allowed."""


class Quantity(NamedTuple):
    """An exact number in the unit of the table, and the unit in which it was written; empty for a bare number."""

    value: Fraction
    written: str


@dataclass(frozen=True, eq=False)
class Leaf:
    """Values of one entry in the unit of the table."""

    values: np.ndarray  # float64, shape (n,), in the order given
    is_axis: bool  # whether it was written as a list or range
    position: Position
    written: str = ""  # the unit in which it was written; empty for bare numbers
    positions: tuple[Position, ...] = ()  # of each value; empty where all of them stand at `position`, as in a range
    distribution: Distribution | SetDistributions | None = None  # spread about the values, which are its means

    @property
    def system(self) -> str:
        """The system of the unit in which a length is written; ``si`` of a bare number."""
        return system_of(factor(self.written, "m")) if self.written else SYSTEMS[0]


def read_leaf(node: Node, field: Field) -> Leaf:
    """Return the values of an entry: ``1.65 m``, ``[36, 40] deg``, ``{from: 1 m, to: 3 m, count: 5}`` and the like.

    SettingsError holds every mistake in it.
    """
    node = _unfold_text_list(node)
    if isinstance(node, Mapping):
        values, written = _read_range(node, field)
        return Leaf(np.array(values), True, node.position, written)
    items: list[Node] = [node]
    unit = None
    if isinstance(node, Sequence):
        items, unit = node.items, node.unit
    if not items:
        raise wrong(node.position, "the list is empty; give at least one value")
    if len(items) > MAX_AXIS:
        raise wrong(node.position, f"{len(items)} values are too many; an axis takes at most {MAX_AXIS}")
    quantities = _read_all(items, field, unit)
    values = _check_values(quantities, items, field)
    positions = tuple(item.position for item in items)
    return Leaf(np.array(values), isinstance(node, Sequence), node.position, quantities[0].written, positions)


def read_single(node: Node, field: Field) -> float:
    """Return the one value of an entry that cannot be an axis; raise SettingsError where it is not admitted."""
    if not isinstance(node, Scalar):
        raise wrong(node.position, "takes one value here, not a list or a range")
    (value,) = _check_values([read_quantity(node, field.unit, sample=sample_of(field))], [node], field)
    return value


def read_block(node: Node, known: dict[str, Field], what: str, required: Collection[str] = ()) -> dict[str, float]:
    """Return the single values of a block by the names of its fields; raise SettingsError with every mistake.

    Fields are `known` by key; messages call the block `what`, such as ``a layer``.
    """
    if not isinstance(node, Mapping) or node.unit is not None:
        raise wrong(node.position, f"{what} must be a block of keys: {', '.join(known)}")
    values: dict[str, float] = {}
    problems = Problems()
    for entry in node:
        field = known.get(entry.key)
        if field is None:
            message = f"'{shorten(entry.key)}' is not a key of {what} ({', '.join(known)}){meant_by(entry, known)[1]}"
            problems.add(entry.position, message)
            continue
        with problems.under(entry.key):
            values[field.name] = read_single(entry.value, field)
    missing = [key for key in required if key not in node.entries]
    if missing and not problems:
        problems.add(node.position, f"the {what.partition(' ')[2]} lacks {', '.join(missing)}")
    problems.raise_if_any()
    return values


def meant_by(entry: Entry, known: dict[str, Field] | dict[str, Field | None]) -> tuple[str, str]:
    """Return the known key that an unknown one stands for, and ``"; did you mean ...?"``; both empty where none does.

    A key is meant only where it takes the value of the entry, unit and all, as far as its field is known.
    """
    stem, _, suffix = entry.key.partition("_")
    while suffix:
        field = known.get(stem)
        unit = suffix_unit(suffix, field.unit) if field is not None and field.unit in EXPECTED else ""
        if unit:
            number = entry.value.text if isinstance(entry.value, Scalar) else "..."
            return stem, f"; did you mean {stem}: {shorten(number)} {unit}?"
        word, _, suffix = suffix.partition("_")
        stem += f"_{word}"
    fitting = {key: field for key, field in known.items() if field is None or _fits(entry.value, field)}
    synonyms = (key for key, field in fitting.items() if field is not None and entry.key.lower() in field.also)
    key = next(synonyms, None) or nearest(entry.key, fitting)
    return (key, f"; did you mean {key}?") if key else ("", "")


def _fits(value: Node, field: Field) -> bool:
    """Return whether an entry may have a value: its unit, if it has one, is of the kind that is needed."""
    if not isinstance(value, Scalar) or field.unit not in EXPECTED:
        return True
    try:
        unit = split_number(value.text, field.unit)[1]
        return not unit or factor(unit, field.unit) > 0
    except NumberError:
        return True
    except UnitError:
        return False


def sample_of(field: Field) -> str:
    """Return the value that a message about an entry suggests: its default; empty where it has none."""
    return "" if field.default is None else describe(field.default, field.unit)


def outside(value: float, field: Field, written: str = "") -> str:
    """Return why a value is not admitted, in the unit in which it was written, if any; empty if it is."""
    bound = field.admitted
    if bound is None or bound.low <= value <= bound.high:
        return ""
    low, high = range_words(bound.low, bound.high, field.unit, written).split(" to ")
    as_percent = field.unit == "1" and not written and bound.low <= value / 100.0 <= bound.high <= 1.0
    remedy = f"; write {value:g} %" if as_percent else ""
    return OUTSIDE.format(value=describe(value, field.unit, written), low=low, high=high, reason=bound.reason) + remedy


def is_unusual(values: np.ndarray, field: Field) -> np.ndarray:
    """Return which values are so far outside the usual range that a file must allow them, bool; see `Field.held`."""
    if field.usual is None or not field.held:
        return np.zeros(values.shape, dtype=bool)
    low, high = field.usual.low / FAR, field.usual.high * FAR
    # Zero is no slip of the unit, and a vehicle may stand.
    return (values != 0.0) & ((values < low * (1.0 - 1e-9)) | (values > high * (1.0 + 1e-9)))


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
    problems = Problems()
    for item in items:
        with problems.under():
            quantities.append(read_quantity(item, field.unit, unit, sample_of(field)))
    if not problems and len({bool(quantity.written) for quantity in quantities}) > 1:
        bare = next(item for item, quantity in zip(items, quantities, strict=True) if not quantity.written)
        message = f"{quoted(bare)} has no unit while the others have one; give all of them a unit, or none"
        problems.add(bare.position, message)
    problems.raise_unlike()
    return quantities


def _check_values(quantities: list[Quantity], nodes: list[Node], field: Field) -> list[float]:
    """Return the values; every one of them must be admitted."""
    values = [_to_float(quantity.value) for quantity in quantities]
    problems = Problems()
    for node, value, quantity in zip(nodes, values, quantities, strict=True):
        if problem := outside(value, field, quantity.written):
            problems.add(node.position, problem)
    problems.raise_if_any()
    return values


def _read_range(node: Mapping, field: Field) -> tuple[list[float], str]:
    """Return the values of ``{from, to, count}`` or ``{from, to, step}``, and the unit in which they were written."""
    _check_range_keys(node)
    given = [entry for entry in node if entry.key != "count"]
    quantities = _read_all([entry.value for entry in given], field, node.unit)
    exact = {entry.key: quantity for entry, quantity in zip(given, quantities, strict=True)}
    ends = [key for key in exact if key != "step"]
    _check_values([exact[key] for key in ends], [node.entries[key].value for key in ends], field)
    first, last, written = exact["from"].value, exact["to"].value, exact["from"].written
    if "step" in exact:
        position = node.entries["step"].value.position
        in_words = partial(describe, unit=field.unit, written=written)
        return spread(first, last, _count_of_step(first, last, exact["step"].value, in_words, position)), written
    of_count = node.entries["count"].value
    count = read_count(of_count, "count", MAX_AXIS)
    if count == 1 and first != last:
        message = "a count of 1 cannot hold both ends of the range; give a count of 2 or more, or one value"
        raise wrong(of_count.position, message)
    return spread(first, last, count), written


def _check_range_keys(node: Mapping) -> None:
    problems = Problems()
    for entry in node:
        if entry.key not in RANGE_KEYS:
            hint = did_you_mean(entry.key, RANGE_KEYS)
            message = f"'{shorten(entry.key)}' is not a key of a range (from, to, count or step){hint}"
            problems.add(entry.position, message)
    problems.raise_if_any()
    missing = [key for key in ("from", "to") if key not in node.entries]
    if missing:
        raise wrong(node.position, f"the range lacks {' and '.join(missing)}")
    if "count" in node.entries and "step" in node.entries:
        raise wrong(node.entries["step"].position, "give count or step, not both")
    if "count" not in node.entries and "step" not in node.entries:
        raise wrong(node.position, "the range lacks count or step")


def _count_of_step(
    first: Fraction, last: Fraction, step: Fraction, in_words: Callable[[float], str], position: Position
) -> int:
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
        start, end, low, high = (in_words(float(value)) for value in (first, last, below, below + step))
        raise wrong(
            position,
            f"steps of {in_words(float(step))} from {start} do not end at {end} but at {low} or {high}; "
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


def read_quantity(node: Node, unit: str, outer_unit: Scalar | None = None, sample: str = "") -> Quantity:
    """Return the number a node holds, ``1.65`` or ``6.5 ft``, in a unit of the table; a bare number is in that unit.

    The unit may be an `outer_unit`, behind the bracket of the list that holds the number; a message suggests `sample`.
    SettingsError is raised where it is not a finite decimal number, or the unit is unknown or unfit.
    """
    if not isinstance(node, Scalar):
        kind = "a list" if isinstance(node, Sequence) else "a block"
        raise wrong(node.position, f"one number is needed here, not {kind}")
    try:
        number, unit_text = split_number(node.text, unit, sample)
        if outer_unit is not None:
            if unit_text:
                raise NumberError(
                    f"'{shorten(node.text)}' has a unit and so has the list ('{shorten(outer_unit.text)}'); "
                    "give one of them"
                )
            unit_text = outer_unit.text
        if node.needs_unit and not unit_text and unit not in WITHOUT_UNIT:
            units = dict.fromkeys(shown_unit(unit, system).unit for system in reversed(SYSTEMS))
            meant = " or ".join(f"{shorten(node.text.strip())} {one}" for one in units)
            raise NumberError(f"{quoted(node)} has no unit; this file is in US units: write {meant}")
        value = number * factor(unit_text, unit) if unit_text else number
        return Quantity(value, " ".join(unit_text.split()))
    except (NumberError, UnitError) as error:
        raise wrong(node.position, str(error)) from None


def split_number(text: str, unit: str, sample: str = "") -> tuple[Fraction, str]:
    """Return the plain, finite decimal number at the beginning of a text, else raise NumberError, and its unit."""
    stripped = text.strip().replace("−", "-")
    given = f"'{shorten(text)}'"
    words = needed(unit, sample)
    if not stripped or stripped in ("~", "null", "Null", "NULL"):
        raise NumberError(f"{EMPTY}; {words}")
    if stripped.lower() in _YES_NO:
        raise NumberError(f"{given} is a yes/no value; {words}")
    if _NOT_FINITE.fullmatch(stripped):
        raise NumberError(f"{given} is not a finite number; {words}")
    if length := _feet_and_inches(stripped):
        return length
    match = _NUMBER.match(stripped)
    sign, whole, decimals, exponent = match.groups() if match else ("", "", None, None)
    rest = stripped[match.end() :] if match else stripped
    if not (whole or decimals):
        raise NumberError(f"{given} {NOT_A_NUMBER}; {words}")
    if whole == "0" and rest[:1].lower() in ("x", "o", "b"):
        raise NumberError(f"{given} is not a decimal number; {words}")
    if len(whole) > 1 and whole.startswith("0"):
        cut_off = "; if a comma cuts it off a number, write that without a comma, as in 15000"
        remedy = f"remove the zero{cut_off if len(whole) == 3 else ''}"
        raise NumberError(f"{given} begins with a zero, which some programs read as octal; {remedy}")
    if re.match(r"\s*[,;]\s+\d", rest) or rest[:1] == ";":
        raise NumberError(f"{given} is not one number; write a list in brackets, such as [34, 38] deg")
    if rest[:1] in (",", "_", "'", "’", ".") or re.match(r"\s+\d", rest):
        plain = plainly(stripped)
        remedy = f"write {shorten(plain)}" if plain else "write digits and one decimal point only, as in 6800.5"
        raise NumberError(f"{given} is not a plain number; {remedy}")
    if rest[:1] == ":" or re.match(r"\s*(\+|±|\.\.|to\b|/\s*\d|-\s*\d)", rest):
        raise NumberError(f"{given} is not one number; {words}, or a range {{from: ..., to: ..., count: ...}}")
    digits = whole + (decimals or "")
    power = _MAX_EXPONENT + 1 if len(exponent or "") > 9 else int(exponent or 0)
    if len(digits) > _MAX_DIGITS or abs(power) > _MAX_EXPONENT:
        raise NumberError(f"{given} has too many digits or too large an exponent")
    value = Fraction(int(digits)) * Fraction(10) ** (power - len(decimals or ""))
    return (-value if sign == "-" else value), rest.strip()


def _feet_and_inches(text: str) -> tuple[Fraction, str] | None:
    """Return a length in feet and inches, ``5 ft 6 in`` or ``5' 6 1/2"``, as a number and its unit; None for others.

    NumberError is raised where the inches are no part of a foot, or their sign is missing.
    """
    if len(text) > _MAX_DIGITS:
        return None
    match = _FEET_AND_INCHES.fullmatch(text)
    if match is None:
        if _FEET_AND_A_NUMBER.fullmatch(text):
            raise NumberError(f"'{shorten(text)}' lacks the unit of the inches; write it as in 5 ft 6 in")
        return None
    feet, whole, top = match["feet"], match["inches"], match["top"]
    if (whole is None and top is None) != (match["mark"] is None):
        return None
    inches = Fraction(whole or 0) + Fraction(int(top or 0), int(match["bottom"] or 1))
    sign = -1 if match["sign"] == "-" else 1
    if feet is None:
        return None if match["mark"] is None else (sign * inches, "in")
    if match["mark"] is not None and (Fraction(feet).denominator != 1 or inches >= 12):
        raise NumberError(f"'{shorten(text)}': write whole feet and less than 12 inches, as in 5 ft 6 in")
    return sign * (Fraction(feet) + inches / 12), "ft"


def plainly(text: str) -> str:
    """Return a number with its unit as it must be written, ``15000 lb`` for ``15,000 lb``; empty if it is not certain.

    A sign before exactly three digits separates thousands. A comma before any other number of digits, or behind a zero,
    is a decimal one.
    """
    match = _SEPARATED.fullmatch(text)
    if match is None:
        return ""
    sign, number, rest = match.groups()
    groups = _GROUPS.fullmatch(number)
    if groups is not None:
        whole = re.sub(r"\D", "", groups[1])
        return f"{sign}{whole}{'' if groups[3] is None else '.' + groups[3]}{rest}"
    return f"{sign}{number.replace(',', '.')}{rest}" if _DECIMAL_COMMA.fullmatch(number) else ""


def refuse_bare(option: str, texts: list[str], unit: str) -> None:
    """Refuse numbers of an option that have a dimension and no unit: meant in feet, they would be read in metres.

    The option ends in ``=`` where a name comes before the number. Text that is no number is left to its reader.
    NumberError says how the numbers are written with a unit.
    """
    if unit == "1":
        return
    written: dict[str, str] = {}
    for text in texts:
        with suppress(NumberError):
            written[text] = split_number(text, unit)[1]
    if "" not in written.values():
        return
    units = [one for one in written.values() if one] or [shown_unit(unit, system).unit for system in SYSTEMS]
    space = "" if option.endswith("=") else " "
    forms = (
        space.join([option, *(f"'{text} {one}'" if written.get(text) == "" else f"'{text}'" for text in texts)])
        for one in dict.fromkeys(units[:2])
    )
    allowed = EXPECTED[unit].examples
    raise NumberError(f"{space.join([option, *texts])}: write the unit too ({allowed}), as in {' or '.join(forms)}")


def read_count(node: Node, what: str, largest: int) -> int:
    """Return a whole number from 1 to `largest`; raise SettingsError for anything else."""
    if isinstance(node, Scalar) and re.fullmatch(r"[1-9]\d{0,17}", node.text.strip(), re.ASCII):
        value = int(node.text)
        if value <= largest:
            return value
    raise wrong(node.position, f"{quoted(node)} is not valid; {what} must be a whole number from 1 to {largest}")


def quoted(node: Node) -> str:
    """Return the text of a node, to be quoted in a message; of a list or a block "this"."""
    return f"'{shorten(node.text)}'" if isinstance(node, Scalar) else "this"


_CENTRES = ("mean", "characteristic")
_SPREADS = ("sd", "cov")
NEEDED = {
    "normal": (_CENTRES, _SPREADS),
    "lognormal": (_CENTRES, _SPREADS),
    "uniform": (("low",), ("high",)),
    "triangular": (("low",), ("mode",), ("high",)),
    "beta": (("mean",), _SPREADS, ("low",), ("high",)),
}
"""For every kind what must be given, one of each group."""
_KEYS = ("distribution", *_CENTRES, *_SPREADS, "low", "high", "mode")
_WORDS = frozenset({*_KEYS, *KINDS})


def read_input(node: Node, field: Field) -> Leaf:
    """Return what an entry gives for an input: a value, a list, a range or a distribution."""
    if isinstance(node, Mapping) and not set(RANGE_KEYS) & set(node.entries) and _WORDS & set(node.entries):
        return _read_distribution(node, field)
    return read_leaf(node, field)


def _read_distribution(node: Mapping, field: Field) -> Leaf:
    """Return an uncertain input, ``{mean: 38 deg, sd: 3 deg}`` or ``{distribution: uniform, low: 36 deg, ...}``."""
    kind = _kind(node)
    _check_keys(node, kind)
    problems = Problems()

    def read(key: str | None, reader: Callable[[Node], T]) -> T | None:
        value = None if key is None else node.get(key)
        if value is not None:
            with problems.under():
                return reader(value)
        return None

    low, high, mode = (read(key, lambda value: read_single(value, field)) for key in ("low", "high", "mode"))
    sd = read("sd", lambda value: _positive(value, field.unit))
    cov = read("cov", lambda value: _positive(value, "1"))
    centre = next((key for key in _CENTRES if key in node.entries), None)
    given = read(centre, lambda value: read_leaf(value, field))
    problems.raise_if_any()
    bound = field.admitted
    assert bound is not None
    distribution = Distribution(
        kind,
        bound.low if low is None else low,
        bound.high if high is None else high,
        sd=sd,
        cov=cov,
        mode=mode,
        position=node.position,
    )
    if given is None:
        ends = (distribution.low, *(() if mode is None else (mode,)), distribution.high)
        values = np.array([sum(ends) / len(ends)])
    else:
        values = given.values if centre == "mean" else _means(node, kind, given.values, sd, cov)
    _check_spread(node, values, distribution, field)
    if given is None:
        return Leaf(values, False, node.position, distribution=distribution)
    return replace(given, values=values, position=node.position, distribution=distribution)


def _kind(node: Mapping) -> str:
    """Return the kind of the distribution; normal where a mean is given and no kind."""
    value = node.get("distribution")
    if value is None:
        named = next((key for key in node.entries if key in KINDS), None)
        if named is not None:
            message = f"write the kind as an entry of its own: {{distribution: {named}, mean: ..., sd: ...}}"
            raise wrong(node.entries[named].position, message)
        return "normal"
    word = value.text.strip() if isinstance(value, Scalar) else ""
    if word not in KINDS:
        hint = did_you_mean(word, KINDS)
        raise wrong(value.position, f"'{shorten(word)}' is not a distribution: {', '.join(KINDS)}{hint}")
    return word


def _check_keys(node: Mapping, kind: str) -> None:
    """Report keys that are unknown, do not belong to this kind, are missing or exclude each other."""
    taken = {"distribution", "low", "high", *(key for group in NEEDED[kind] for key in group)}
    problems = Problems()
    for entry in node:
        if entry.key not in taken:
            hint = "" if entry.key in _KEYS else did_you_mean(entry.key, _KEYS)
            known = ", ".join(key for key in _KEYS if key in taken)
            message = f"'{shorten(entry.key)}' is not a key of a {kind} distribution ({known}){hint}"
            problems.add(entry.position, message)
    for group in NEEDED[kind]:
        given = [key for key in group if key in node.entries]
        if len(given) > 1:
            problems.add(node.entries[given[1]].position, f"give {' or '.join(group)}, not both")
        elif not given and not problems:
            problems.add(node.position, f"a {kind} distribution needs {' or '.join(group)}")
    if node.unit is not None:
        problems.add(node.unit.position, "write the unit behind each number of a distribution")
    problems.raise_if_any()


def _positive(node: Node, unit: str) -> float:
    value = float(read_quantity(node, unit).value)
    if not 0.0 < value < math.inf:
        raise wrong(node.position, "must be more than 0; for a value without doubt, write the value alone")
    return value


def _means(node: Mapping, kind: str, fractile: np.ndarray, sd: float | None, cov: float | None) -> np.ndarray:
    """Return the means of normal or lognormal distributions whose 5 % fractiles are given, their characteristic values.

    Normal: x_k = m - 1.645 s. Lognormal: x_k = m exp(-s_ln**2 / 2 - 1.645 s_ln) with s_ln**2 = ln(1 + cov**2).
    """
    if kind == "lognormal":
        if cov is None:
            raise wrong(node.position, "a characteristic value of a lognormal distribution needs cov")
        spread = math.sqrt(math.log1p(cov * cov))
        return fractile * math.exp(FRACTILE_5 * spread + 0.5 * spread * spread)
    if cov is None:
        assert sd is not None
        return fractile + FRACTILE_5 * sd
    if FRACTILE_5 * cov >= 1.0:
        message = "a normal distribution this wide has no positive 5 % fractile; use lognormal"
        raise wrong(node.entries["cov"].position, message)
    return fractile / (1.0 - FRACTILE_5 * cov)


def _check_spread(node: Mapping, values: np.ndarray, distribution: Distribution, field: Field) -> None:
    """Report ends in the wrong order, and means and spreads that do not fit between them."""
    low, high, unit = distribution.low, distribution.high, "" if field.unit == "1" else f" {field.unit}"
    message = ""
    if not low < high:
        message = f"low ({low:g}{unit}) must be less than high ({high:g}{unit})"
    elif distribution.mode is not None and not low <= distribution.mode <= high:
        message = f"the mode must be between low and high ({low:g} to {high:g}{unit})"
    elif not (low < values.min() and values.max() < high):
        worst = values.min() if values.min() <= low else values.max()
        message = outside(float(worst), field) or f"the mean must be between low and high ({low:g} to {high:g}{unit})"
    elif distribution.kind == "beta":
        largest = np.sqrt((values - low) * (high - values))
        if np.any(distribution.deviation(values) >= largest):
            message = f"the standard deviation must be less than {largest.min():.4g}{unit} between these ends"
    if message:
        raise wrong(node.position, message)
