"""Numbers as engineers write them: a plain decimal number, with or without a unit after it.

A number is kept as an exact fraction of its decimal digits, so that ``0.40 + 15 * 0.02`` is 0.70 to the bit.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from boulder_sweep.settings.problems import shorten, wrong
from boulder_sweep.settings.tree import Node, Scalar, Sequence
from boulder_sweep.settings.units import EXPECTED, UnitError, factor

_NUMBER = re.compile(r"([+-]?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d+))?", re.ASCII)
_YES_NO = frozenset({"true", "false", "yes", "no", "on", "off", "y", "n"})
_NOT_FINITE = re.compile(r"[+-]?\.?(nan|inf|infinity)\b.*", re.IGNORECASE)
_FEET_AND_INCHES = re.compile(r"[+-]?[\d.]+\s*['′](?!\d{3}).*|[+-]?[\d.]+\s*(\"|″|'')")
EMPTY, NOT_A_NUMBER = "is empty", "is not a number"
"""What may be wrong with a number; the page of a report says the same."""
_MAX_DIGITS = 40
_MAX_EXPONENT = 300


class NumberError(ValueError):
    """Not the kind of number that is needed; the message says what is allowed."""


class Quantity(NamedTuple):
    """An exact number in the unit of the table, and whether it was given with a unit."""

    value: Fraction
    has_unit: bool


def read_quantity(node: Node, unit: str, outer_unit: Scalar | None = None, sample: str = "") -> Quantity:
    """Return the number a node holds, converted to `unit`.

    Parameters
    ----------
    node : Node
        Must be a piece of text such as ``1.65``, ``6.5 ft`` or ``95 MN/m^3``.
    unit : str
        Unit of the table; the unit of a bare number.
    outer_unit : Scalar, optional
        Unit after the bracket of the list that holds the number.
    sample : str
        A value of the entry, which a message suggests; one of its unit by default.

    Raises
    ------
    LeafError
        Not a finite decimal number, or an unknown or unfit unit.
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
        return Quantity(number * factor(unit_text, unit) if unit_text else number, has_unit=bool(unit_text))
    except (NumberError, UnitError) as error:
        raise wrong(node.position, str(error)) from None


def split_number(text: str, unit: str, sample: str = "") -> tuple[Fraction, str]:
    """Return the number at the beginning of a text and the rest, its unit; `sample`: see `read_quantity`.

    Raises
    ------
    NumberError
        The text does not begin with a plain, finite decimal number.
    """
    stripped = text.strip().replace("−", "-")
    given = f"'{shorten(text)}'"
    words = needed(unit, sample)
    if not stripped or stripped in ("~", "null", "Null", "NULL"):
        raise NumberError(f"{EMPTY}; {words}")
    if stripped.lower() in _YES_NO:
        raise NumberError(f"{given} is a yes/no value; {words}")
    if _NOT_FINITE.fullmatch(stripped):
        raise NumberError(f"{given} is not a finite number; {words}")
    match = _NUMBER.match(stripped)
    sign, whole, decimals, exponent = match.groups() if match else ("", "", None, None)
    rest = stripped[match.end() :] if match else stripped
    if not (whole or decimals):
        raise NumberError(f"{given} {NOT_A_NUMBER}; {words}")
    if whole == "0" and rest[:1].lower() in ("x", "o", "b"):
        raise NumberError(f"{given} is not a decimal number; {words}")
    if len(whole) > 1 and whole.startswith("0"):
        raise NumberError(f"{given} begins with a zero, which some programs read as octal; remove the zero")
    if _FEET_AND_INCHES.fullmatch(stripped):
        raise NumberError(f"{given} is in feet and inches; write one number, such as 5.5 ft or 66 in")
    if re.match(r"\s*[,;]\s+\d", rest) or rest[:1] == ";":
        raise NumberError(f"{given} is not one number; write a list in brackets, such as [34, 38] deg")
    if rest[:1] in (",", "_", "'", ".") or re.match(r"\s+\d", rest):
        raise NumberError(
            f"{given} is not a plain number; use a decimal point and no thousands separators, as in 6800.5"
        )
    if rest[:1] == ":" or re.match(r"\s*(\+|±|\.\.|to\b|/\s*\d|-\s*\d)", rest):
        raise NumberError(f"{given} is not one number; {words}, or a range {{from: ..., to: ..., count: ...}}")
    digits = whole + (decimals or "")
    power = _MAX_EXPONENT + 1 if len(exponent or "") > 9 else int(exponent or 0)
    if len(digits) > _MAX_DIGITS or abs(power) > _MAX_EXPONENT:
        raise NumberError(f"{given} has too many digits or too large an exponent")
    value = Fraction(int(digits)) * Fraction(10) ** (power - len(decimals or ""))
    return (-value if sign == "-" else value), rest.strip()


def read_count(node: Node, what: str, largest: int) -> int:
    """Return a whole number from 1 to `largest`.

    Raises
    ------
    LeafError
        Not a whole number, or outside that range.
    """
    if isinstance(node, Scalar) and re.fullmatch(r"[1-9]\d{0,17}", node.text.strip(), re.ASCII):
        value = int(node.text)
        if value <= largest:
            return value
    message = f"{quoted(node)} is not valid; {what} must be a whole number from 1 to {largest}"
    raise wrong(node.position, message)


def quoted(node: Node) -> str:
    """Return the text of a node, to be quoted in a message; of a list or a block "this"."""
    return f"'{shorten(node.text)}'" if isinstance(node, Scalar) else "this"


def describe(value: float, unit: str) -> str:
    """Return a value with its unit, for messages."""
    return f"{value:.6g}" if unit == "1" else f"{value:.6g} {unit}"


def needed(unit: str, sample: str = "") -> str:
    """Return what an entry takes whose bare numbers are in a unit of the table, with an example."""
    expected = EXPECTED[unit]
    return "a number is needed" if unit == "1" else f"{expected.words} is needed, such as {sample or expected.sample}"
