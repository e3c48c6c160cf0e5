"""Measured time histories: a CSV file whose header names quantities and their units.

``time [ms], displacement [mm], acceleration [g]``: the name of a quantity, then its unit in brackets or parentheses, or
behind an underline as in ``time_s`` and ``vehicle_displacement_m``. Empty cells are gaps in a track. Lines that begin
with # are passed over.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.settings.numbers import NumberError, split_number
from boulder_sweep.settings.problems import Place, Problem, ProblemList, SettingsError, did_you_mean, shorten
from boulder_sweep.settings.source import check_regular_file
from boulder_sweep.settings.units import STANDARD_GRAVITY, UnitError, factor

MOST_ROWS, MOST_COLUMNS = 2_000_000, 1000
MAX_BYTES = 500_000_000
_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*")
_SUFFIXES = {"m_s2": "m/s^2", "ft_s2": "ft/s^2", "m_s": "m/s", "km_h": "km/h", "ft_s": "ft/s"}
_PLAIN_SUFFIXES = ("s", "ms", "m", "mm", "cm", "in", "ft", "deg", "rad", "mph", "g")
_GRAVITY_NAMES = ("g", "G", "g0", "gee")


class Signal(NamedTuple):
    """A quantity that a file may hold."""

    name: str
    unit: str
    """Unit it is converted to: s, m, m/s, m/s^2 or deg."""
    other_names: tuple[str, ...] = ()
    sign: float = 1.0
    """-1 where `other_names` hold it with the opposite sign; such names are then the only ones."""


TIME = Signal("time", "s", ("t",))
DISPLACEMENT = Signal("displacement", "m", ("x", "crush", "vehicle_displacement"))
VELOCITY = Signal("velocity", "m/s", ("v", "speed", "vehicle_velocity"))
ACCELERATION = Signal("acceleration", "m/s^2", ("a", "vehicle_acceleration"))
DECELERATION = Signal("deceleration", "m/s^2", ("vehicle_deceleration",))
ROTATION = Signal("rotation", "deg", ("boulder_rotation", "angle"))
BOULDER = Signal("boulder_displacement", "m", ("boulder_centre_displacement",))
VEHICLE = Signal("vehicle_displacement", "m", ("truck_displacement",))

PULSE_SIGNALS = (TIME, DISPLACEMENT, VELOCITY, ACCELERATION, DECELERATION)
"""What a crash pulse against a rigid wall may hold."""
TEST_SIGNALS = (TIME, ROTATION, BOULDER, VEHICLE)
"""What the film of a crash test may hold."""


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """A measured time history.

    Attributes
    ----------
    path : Path
        The file.
    time_s : ndarray, shape (n,)
        Times, ascending [s].
    signals : dict of str to ndarray, shape (n,)
        Values by name in SI units (angles in degrees), NaN where there is a gap.
    """

    path: Path
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]


def read_history(path: str | Path, wanted: Sequence[Signal]) -> TimeHistory:
    """Read a CSV file of measurements over time.

    Parameters
    ----------
    path
        UTF-8 text; comma, semicolon or tab between the cells.
    wanted
        Quantities it may hold; time among them.

    Returns
    -------
    TimeHistory
        With at least one quantity beside time and at least two rows.

    Raises
    ------
    SettingsError
        Every mistake of the file, with line and column.
    """
    file = Path(path)
    rows, delimiter = _rows(file)
    problems = ProblemList()
    line, header = rows[0]
    if len(header) > MOST_COLUMNS:
        raise _refusal(str(file), f"has {len(header):,} columns; at most {MOST_COLUMNS:,} are read")
    columns = [_column(cell, Place(str(file), line), wanted, problems) for cell in header]
    named = [column.signal.name for column in columns if column is not None]
    for name in sorted({name for name in named if named.count(name) > 1}):
        problems.add(Place(str(file), line), name, "stands in two columns")
    if not problems and TIME.name not in named:
        problems.add(Place(str(file), line), "", "has no column of time, such as 'time [ms]'")
    if not problems and len(named) < 2:
        names = ", ".join(signal.name for signal in wanted if signal is not TIME)
        problems.add(Place(str(file), line), "", f"has nothing beside time; it may hold {names}")
    problems.raise_if_any()
    values = _values(file, rows[1:], header, columns, problems, delimiter)
    time = values.pop(TIME.name)
    if not problems:
        _check_time(file, rows[1:], time, problems)
    problems.raise_if_any()
    return TimeHistory(file, time, values)


class _Column(NamedTuple):
    """One column of the file."""

    signal: Signal
    factor: float


def _rows(file: Path) -> tuple[list[tuple[int, list[str]]], str]:
    """Return the lines that hold something, each with its number, cut into cells."""
    label = str(file)
    check_regular_file(file, MAX_BYTES, "Keep the impact, and leave out what comes before and after")
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(islice(_filled_lines(stream), MOST_ROWS + 2))
    except UnicodeDecodeError:
        raise _refusal(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise _refusal(label, f"cannot be read ({error.strerror})") from None
    if len(lines) < 3:
        raise _refusal(label, "must hold a line of names and at least two rows of numbers")
    if len(lines) > MOST_ROWS + 1:
        raise _refusal(label, f"has more than {MOST_ROWS:,} rows")
    delimiter = next((sign for sign in ",;\t" if sign in lines[0][1]), ",")
    try:
        cells = csv.reader([text for _, text in lines], delimiter=delimiter)
        return [(number, row) for (number, _), row in zip(lines, cells, strict=True)], delimiter
    except (csv.Error, ValueError):
        raise _refusal(label, "cannot be read as CSV: a cell runs over the end of its line") from None


def _filled_lines(stream: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines that hold something, each with its number."""
    return ((number, text) for number, text in enumerate(stream, 1) if _holds_something(text))


def _holds_something(text: str) -> bool:
    return bool(text.strip(" \t\r\n,;")) and not text.startswith("#")


def _refusal(label: str, message: str) -> SettingsError:
    return SettingsError([Problem(label, None, None, "", message)])


def _column(cell: str, place: Place, wanted: Sequence[Signal], problems: ProblemList) -> _Column | None:
    """Return what a cell of the header names; with a mistake it is reported and None returned."""
    name, unit = _split_header(cell.strip())
    known = {word: signal for signal in wanted for word in (signal.name, *signal.other_names)}
    plain = name.strip().lower().replace(" ", "_").replace("-", "_")
    signal = known.get(plain)
    if signal is None:
        names = ", ".join(signal.name for signal in wanted)
        problems.add(place, shorten(cell), f"is not known{did_you_mean(plain, known)}; a file may hold {names}")
        return None
    if not unit:
        problems.add(
            place, shorten(cell), f"has no unit; write it in brackets, such as '{signal.name} [{signal.unit}]'"
        )
        return None
    try:
        return _Column(signal, _factor(unit, signal.unit))
    except UnitError as error:
        problems.add(place, shorten(cell), str(error))
        return None


def _split_header(cell: str) -> tuple[str, str]:
    """Split ``name [unit]`` or ``name_unit``."""
    match = _BRACKETS.fullmatch(cell)
    if match:
        return match["name"], match["unit"].strip()
    for suffix, unit in (*_SUFFIXES.items(), *((word, word) for word in _PLAIN_SUFFIXES)):
        if cell.endswith(f"_{suffix}"):
            return cell.removesuffix(f"_{suffix}"), unit
    return cell, ""


def _factor(unit: str, target: str) -> float:
    """Return the factor from a unit to the one wanted."""
    if target != "m/s^2":
        return float(factor(unit, target))
    if unit in _GRAVITY_NAMES:
        return float(STANDARD_GRAVITY)
    try:
        return float(factor(f"({unit})*s", "m/s"))
    except UnitError:
        raise UnitError(f"'{shorten(unit)}' is no unit of acceleration (m/s^2, ft/s^2 or g)") from None


def _values(
    file: Path,
    rows: list[tuple[int, list[str]]],
    header: list[str],
    columns: Sequence[_Column | None],
    problems: ProblemList,
    delimiter: str,
) -> dict[str, np.ndarray]:
    """Return the numbers of every column, converted; NaN for an empty cell."""
    values = {column.signal.name: np.full(len(rows), np.nan) for column in columns if column is not None}
    for row, (line, cells) in enumerate(rows):
        if len(cells) != len(header):
            plural = "" if len(cells) == 1 else "s"
            message = f"has {len(cells)} cell{plural}; the first line has {len(header)}"
            problems.add(Place(str(file), line, 1), "", message)
            continue
        at = 1
        for cell, column in zip(cells, columns, strict=True):
            if column is not None and cell.strip():
                values[column.signal.name][row] = _number(cell, column, Place(str(file), line, at), problems)
            at += len(cell) + len(delimiter)
    return values


def _number(cell: str, column: _Column, place: Place, problems: ProblemList) -> float:
    try:
        value = float(cell)  # the usual case, fast
    except ValueError:
        value = np.nan
    if np.isfinite(value) and "_" not in cell:
        return value * column.factor
    try:
        number, unit = split_number(cell, "1")
        message = f"'{shorten(cell)}' has a unit; the column has one in its name" if unit else ""
    except NumberError as error:
        number, message = Fraction(0), str(error)
    if message:
        problems.add(place, column.signal.name, message)
    return float(number) * column.factor


def _check_time(file: Path, rows: list[tuple[int, list[str]]], time: np.ndarray, problems: ProblemList) -> None:
    """Report times that are missing or do not ascend."""
    for row in np.flatnonzero(np.isnan(time))[:5]:
        problems.add(Place(str(file), rows[row][0]), TIME.name, "is missing in this row")
    for row in np.flatnonzero(np.diff(time) <= 0.0)[:5]:
        message = f"{time[row + 1]:.6g} s comes after {time[row]:.6g} s; times must ascend"
        problems.add(Place(str(file), rows[row + 1][0]), TIME.name, message)
