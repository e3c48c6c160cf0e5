"""The columns of a table of designs: inputs in any unit that fits, and text that is carried along."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from boulder_sweep.columns import BY_NAME as TABLE_COLUMNS
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.designs import Label
from boulder_sweep.settings.fields import INPUTS, Field
from boulder_sweep.settings.problems import Position, ProblemList, nearest, shorten
from boulder_sweep.settings.units import factor, name_suffix, suffix_unit
from boulder_sweep.settings.values import outside

MAX_TEXT = 200
"""Longest text that is carried along, in characters."""
_ID = re.compile(r"(.*_)?(id|no|nr|number|name|label|comment|note)", re.IGNORECASE)
"""Names of unknown columns that may hold numbers: those of others could be a misspelled input."""
_LABEL = re.compile(r"\w[\w .+/()#-]{0,79}")


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column that can be used.

    Attributes
    ----------
    name : str
        Its name in the file.
    field : Field or None
        The input it gives; None for a text column.
    factor : Fraction
        From its numbers to the unit of the input.
    """

    name: str
    field: Field | None
    factor: Fraction = Fraction(1)


_STEMS: dict[str, Field] = {field.name.removesuffix(name_suffix(field.unit)): field for field in INPUTS}
"""Inputs by the name of the column without its unit."""


def read_header(names: list[str], positions: list[Position], problems: ProblemList) -> list[TableColumn | None]:
    """Return what every column is, None for those that cannot be used; mistakes go to `problems`."""
    columns: list[TableColumn | None] = []
    for name, position in zip(names, positions, strict=True):
        column = _column(name)
        if isinstance(column, TableColumn):
            same = [other for other in columns if other is not None and _key(other) == _key(column)]
            if same:
                column = f"gives the same as column {same[0].name}" if same[0].name != name else "appears twice"
        if isinstance(column, str):
            problems.add(position, shorten(name) or "(empty)", column)
        columns.append(column if isinstance(column, TableColumn) else None)
    return columns


def _key(column: TableColumn) -> str:
    return column.name if column.field is None else column.field.name


def _column(name: str) -> TableColumn | str:
    """Return a column, or what is wrong with its name."""
    if name == "design_id":
        return "designs are numbered in their order; rename or remove this column"
    if name in OUTCOME_COLUMNS:
        return f"is an outcome of a run ({TABLE_COLUMNS[name].meaning}), not an input; remove this column"
    for stem, field in _STEMS.items():
        if name == field.name:
            return TableColumn(name, field)
        if name.startswith(f"{stem}_"):
            unit = suffix_unit(name.removeprefix(f"{stem}_"), field.unit)
            if unit:
                return TableColumn(name, field, factor(unit, field.unit))
    if name in _STEMS:
        return f"the unit is missing at the end of the name, such as {name}{name_suffix(_STEMS[name].unit)}"
    meant = "" if _ID.fullmatch(name) else _meant(name)
    if meant:
        return f"is not an input; did you mean {meant}?"
    if not _LABEL.fullmatch(name):
        return "the name of a text column may hold letters, digits, spaces and _ . + - / ( ) #"
    return TableColumn(name, None)


def check_numbers(column: TableColumn, position: Position, problems: ProblemList) -> bool:
    """Report an unknown column that holds nothing but numbers; return whether it may be carried along."""
    if _ID.fullmatch(column.name):
        return True
    message = f"is not an input (inputs: {', '.join(_STEMS)}, each with its unit at the end)"
    message += "; a column of numbers that is to be carried along needs a name that ends in _id or _name"
    problems.add(position, shorten(column.name), message)
    return False


def _meant(name: str) -> str:
    """Return the input that a misspelled name stands for, with the unit it was given; empty if there is none near."""
    word = name.lower()
    for cut in [i for i, sign in enumerate(name) if sign == "_"] + [len(name)]:
        stem, suffix = name[:cut], name[cut + 1 :]
        near = nearest(stem, _STEMS, cutoff=0.8)
        if near is None:
            continue
        unit = _STEMS[near].unit
        if suffix and suffix_unit(suffix, unit):
            return f"{near}_{suffix}"
        if not suffix:
            return f"{near}{name_suffix(unit)}" if unit == "1" else f"{near}, with its unit at the end"
    for stem, field in _STEMS.items():
        if word in (stem, field.key, *field.also):
            return f"{stem}, with its unit at the end" if field.unit != "1" else stem
    return ""


def check_values(values: np.ndarray, field: Field) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for values that are not finite or not admitted."""
    bound = field.admitted
    assert bound is not None
    wrong = np.flatnonzero(~((values >= bound.low) & (values <= bound.high)))
    return [
        (int(row), outside(float(values[row]), field) if np.isfinite(values[row]) else "is not a finite number")
        for row in wrong
    ]


def label_of(texts: list[str]) -> Label:
    """Return texts, one a row, as codes and words; fit to be printed."""
    words, codes = np.unique(np.array([shorten(text, MAX_TEXT) for text in texts], dtype=object), return_inverse=True)
    return Label(codes.astype(np.int32), tuple(words.tolist()))


def to_input_unit(values: np.ndarray, column: TableColumn) -> np.ndarray:
    """Return values in the unit of the input."""
    return values if column.factor == 1 else values * float(column.factor)
