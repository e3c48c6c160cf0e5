"""Measured time histories: a CSV file whose header names quantities and their units; a rigid-wall pulse is one.

``time [ms], displacement [mm], acceleration [g]``: the name of a quantity, then its unit in brackets or parentheses, or
behind an underline as in ``time_s`` and ``vehicle_displacement_m``. Empty cells are gaps in a track. Lines that begin
with # are skipped.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.errors import FitError
from boulder_sweep.settings.problems import (
    Position,
    ProblemList,
    cell_position,
    check_regular_file,
    did_you_mean,
    refuse,
    shorten,
)
from boulder_sweep.settings.units import UnitError, factor
from boulder_sweep.settings.values import NumberError, split_number

MOST_ROWS, MOST_COLUMNS = 2_000_000, 1000
MAX_BYTES = 500_000_000
_BRACKETS = re.compile(r"(?P<name>[^\[(]*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>.*)\))\s*")
_SUFFIXES = {"m_s2": "m/s^2", "ft_s2": "ft/s^2", "m_s": "m/s", "km_h": "km/h", "ft_s": "ft/s"}
_PLAIN_SUFFIXES = ("s", "ms", "m", "mm", "cm", "in", "ft", "deg", "rad", "mph", "g")


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
VEHICLE_ACCELERATION = Signal("vehicle_acceleration", "m/s^2", ("truck_acceleration",))

PULSE_SIGNALS = (TIME, DISPLACEMENT, VELOCITY, ACCELERATION, DECELERATION)
"""What a crash pulse against a rigid wall may hold."""
TEST_SIGNALS = (TIME, ROTATION, BOULDER, VEHICLE, VEHICLE_ACCELERATION)
"""What the film and the accelerometers of a crash test may hold."""


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
    header, *rows = _rows(file)
    problems = ProblemList()
    if len(header.cells) > MOST_COLUMNS:
        raise refuse(str(file), f"has {len(header.cells):,} columns; at most {MOST_COLUMNS:,} are read")
    columns = [_column(cell, header.position(index), wanted, problems) for index, cell in enumerate(header.cells)]
    named = [column and column.signal.name for column in columns]
    for index, name in enumerate(named):
        if name is not None and name in named[:index]:
            problems.add(header.position(index), name, "stands in two columns")
    if not problems and TIME.name not in named:
        problems.add(header.position(0), "", "has no column of time, such as 'time [ms]'")
    if not problems and len(named) < 2:
        names = ", ".join(signal.name for signal in wanted if signal is not TIME)
        problems.add(header.position(0), "", f"has nothing beside time; it may hold {names}")
    problems.raise_if_any()
    values = _values(rows, columns, problems)
    if not problems:
        _check_time(rows, named.index(TIME.name), values[TIME.name], problems)
    problems.raise_if_any()
    time = values.pop(TIME.name)
    return TimeHistory(file, time, values)


class _Column(NamedTuple):
    """One column of the file."""

    signal: Signal
    factor: float


class _Row(NamedTuple):
    """A line that holds something, cut into cells."""

    file: Path
    line: int
    text: str
    delimiter: str
    cells: list[str]

    def position(self, index: int) -> Position:
        """Return where a cell begins."""
        return cell_position(str(self.file), self.line, self.text, self.delimiter, index)


def _rows(file: Path) -> list[_Row]:
    """Return the lines that hold something."""
    label = str(file)
    check_regular_file(file, MAX_BYTES, "Keep the impact, and leave out what comes before and after")
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            filled = ((number, text) for number, text in enumerate(stream, 1) if _holds_something(text))
            lines = list(islice(filled, MOST_ROWS + 2))
    except UnicodeDecodeError:
        raise refuse(label, "is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise refuse(label, f"cannot be read ({error.strerror})") from None
    if len(lines) < 3:
        raise refuse(label, "must hold a line of names and at least two rows of numbers")
    if len(lines) > MOST_ROWS + 1:
        raise refuse(label, f"has more than {MOST_ROWS:,} rows")
    delimiter = next((sign for sign in ",;\t" if sign in lines[0][1]), ",")
    try:
        cells = csv.reader([text for _, text in lines], delimiter=delimiter)
        return [_Row(file, *line, delimiter, row) for line, row in zip(lines, cells, strict=True)]
    except (csv.Error, ValueError):
        raise refuse(label, "cannot be read as CSV: a cell runs over the end of its line") from None


def _holds_something(text: str) -> bool:
    return bool(text.strip(" \t\r\n,;")) and not text.startswith("#")


def _column(cell: str, position: Position, wanted: Sequence[Signal], problems: ProblemList) -> _Column | None:
    """Return what a cell of the header names; with a mistake it is reported and None returned."""
    name, unit = _split_header(cell.strip())
    known = {word: signal for signal in wanted for word in (signal.name, *signal.other_names)}
    plain = name.strip().lower().replace(" ", "_").replace("-", "_")
    signal = known.get(plain)
    if signal is None:
        names = ", ".join(signal.name for signal in wanted)
        fitting = [word for word, one in known.items() if not unit or _is_unit(unit, one.unit)]
        problems.add(position, shorten(cell), f"is not known{did_you_mean(plain, fitting)}; a file may hold {names}")
        return None
    if not unit:
        problems.add(
            position, shorten(cell), f"has no unit; write it in brackets, such as '{signal.name} [{signal.unit}]'"
        )
        return None
    try:
        return _Column(signal, float(factor(unit, signal.unit)))
    except UnitError as error:
        problems.add(position, shorten(cell), str(error))
        return None


def _split_header(cell: str) -> tuple[str, str]:
    """Split ``name [unit]`` or ``name_unit``."""
    match = _BRACKETS.fullmatch(cell)
    if match:
        return match["name"], (match["square"] or match["round"] or "").strip()
    for suffix, unit in (*_SUFFIXES.items(), *((word, word) for word in _PLAIN_SUFFIXES)):
        if cell.endswith(f"_{suffix}"):
            return cell.removesuffix(f"_{suffix}"), unit
    return cell, ""


def _is_unit(unit: str, target: str) -> bool:
    """Whether a unit is of the kind that is wanted."""
    try:
        return factor(unit, target) > 0
    except UnitError:
        return False


def _values(rows: list[_Row], columns: Sequence[_Column | None], problems: ProblemList) -> dict[str, np.ndarray]:
    """Return the numbers of every column, converted; NaN for an empty cell."""
    values = {column.signal.name: np.full(len(rows), np.nan) for column in columns if column is not None}
    for line, row in enumerate(rows):
        if len(row.cells) != len(columns):
            plural = "" if len(row.cells) == 1 else "s"
            message = f"has {len(row.cells)} cell{plural}; the first line has {len(columns)}"
            problems.add(row.position(0), "", message)
            continue
        for index, (cell, column) in enumerate(zip(row.cells, columns, strict=True)):
            if column is not None and cell.strip():
                value = _number(cell)
                if isinstance(value, str):
                    problems.add(row.position(index), column.signal.name, value)
                else:
                    values[column.signal.name][line] = value * column.factor
    return values


def _number(cell: str) -> float | str:
    """Return the number in a cell, or what is wrong with it."""
    try:
        value = float(cell)  # the usual case, fast
    except ValueError:
        value = np.nan
    if np.isfinite(value) and cell.isascii() and "_" not in cell:
        return value
    try:
        number, unit = split_number(cell, "1")
    except NumberError as error:
        return str(error)
    return f"'{shorten(cell)}' has a unit; the column has one in its name" if unit else float(number)


def _check_time(rows: list[_Row], column: int, time: np.ndarray, problems: ProblemList) -> None:
    """Report times that are missing or do not ascend."""
    for row in np.flatnonzero(np.isnan(time))[:5]:
        problems.add(rows[row].position(column), TIME.name, "is missing in this row")
    for row in np.flatnonzero(np.diff(time) <= 0.0)[:5]:
        message = f"{time[row + 1]:.6g} s comes after {time[row]:.6g} s; times must ascend"
        problems.add(rows[row + 1].position(column), TIME.name, message)


PULSE_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
FEWEST_SAMPLES = 8
SIZES = (1e-9, 1e9)
"""Least and greatest peak of a signal that is accepted, in its unit: far beyond any impact."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A rigid-wall crash pulse.

    Attributes
    ----------
    name : str
        Where it comes from.
    time_s : ndarray, shape (n,)
        Times [s], ascending. Zero need not be first touch exactly, and rows before it are of use.
    signals : dict of str to ndarray, shape (n,)
        ``displacement`` [m], ``velocity`` [m/s], ``acceleration`` [m/s^2], one or more; NaN in gaps.
    """

    name: str
    time_s: np.ndarray
    signals: dict[str, np.ndarray]


def read_pulse(path: str | Path) -> Pulse:
    """Read a crash pulse from a CSV file; see `boulder_sweep.crash_tests.measured` for its header.

    Raises
    ------
    SettingsError
        The file is not valid.
    FitError
        Its signals contradict the direction of an impact.
    """
    return pulse_of(read_history(path, PULSE_SIGNALS))


def pulse_of(history: TimeHistory) -> Pulse:
    """Return a measured history as a crash pulse; a deceleration becomes an acceleration.

    Raises
    ------
    FitError
        A signal has fewer than 8 values, the vehicle seems to be accelerated by the wall or to move away from it, or a
        signal does not change or has a size that no impact has.
    """
    signals = dict(history.signals)
    if "deceleration" in signals:
        if "acceleration" in signals:
            raise FitError(f"{history.path}: holds both acceleration and deceleration; give one of them")
        signals["acceleration"] = -signals.pop("deceleration")
    for name, values in signals.items():
        if np.isfinite(values).sum() < FEWEST_SAMPLES:
            raise FitError(f"{history.path}: {name} has fewer than {FEWEST_SAMPLES} values")
        _check_size(f"{history.path}: the {name}", values, name)
    before = history.time_s < 0.0
    for name, values in signals.items():
        known = values[np.isfinite(values)]
        if name == "acceleration":
            zero = float(np.median(values[before & np.isfinite(values)])) if np.isfinite(values[before]).any() else 0.0
            if known.mean() > zero or known.mean() == zero > 0.0:
                raise FitError(
                    f"{history.path}: the acceleration is positive, as if the wall pushed the vehicle on; "
                    f"if it counts slowing down as positive, name the column deceleration"
                )
            continue
        # The first change that noise does not explain: the rebound, which is negative, comes later.
        moved = known - known[0] if name == "displacement" else known
        if moved[np.abs(moved) >= 0.25 * np.abs(moved).max()][0] < 0.0:
            raise FitError(f"{history.path}: the {name} is negative at first; it counts as positive towards the wall")
    return Pulse(str(history.path), history.time_s, signals)


def _check_size(label: str, values: np.ndarray, name: str) -> None:
    """Refuse a signal without motion, or of a size that no impact has; a constant deceleration stops a vehicle too."""
    size, unit = float(np.nanmax(np.abs(values))), PULSE_UNITS[name]
    if size == 0.0 or (name != "acceleration" and np.nanmin(values) == np.nanmax(values)):
        raise FitError(f"{label} does not change; it must show how the wall stops the vehicle")
    if not SIZES[0] <= size <= SIZES[1]:
        raise FitError(f"{label} reaches {size:.3g} {unit}, which is not that of an impact; check the column's unit")
