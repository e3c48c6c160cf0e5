"""Measured time histories: a CSV file whose header names quantities and their units, and a simulation beside it.

``time [ms], displacement [mm], acceleration [g]``: the name of a quantity, then its unit in brackets or parentheses, or
behind an underline as in ``time_s`` and ``vehicle_displacement_m``. Empty cells are gaps in a track. Lines that begin
with # are skipped.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.errors import ComparisonError
from boulder_sweep.settings.problems import (
    Position,
    ProblemList,
    cell_position,
    check_regular_file,
    did_you_mean,
    refuse,
    shorten,
)
from boulder_sweep.settings.units import STANDARD_GRAVITY, UnitError, factor
from boulder_sweep.settings.values import NumberError, split_number

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory


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
            lines = list(islice(_filled_lines(stream), MOST_ROWS + 2))
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


def _filled_lines(stream: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines that hold something, each with its number."""
    return ((number, text) for number, text in enumerate(stream, 1) if _holds_something(text))


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
        problems.add(position, shorten(cell), f"is not known{did_you_mean(plain, known)}; a file may hold {names}")
        return None
    if not unit:
        problems.add(
            position, shorten(cell), f"has no unit; write it in brackets, such as '{signal.name} [{signal.unit}]'"
        )
        return None
    try:
        return _Column(signal, _factor(unit, signal.unit))
    except UnitError as error:
        problems.add(position, shorten(cell), str(error))
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
        raise UnitError(f"'{shorten(unit)}' is not a unit of acceleration (m/s^2, ft/s^2 or g)") from None


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


UNITS = {signal.name: signal.unit for signal in TEST_SIGNALS if signal is not TIME}


@dataclass(frozen=True)
class Deviation:
    """How far the simulation is from one measured signal.

    Attributes
    ----------
    signal, unit : str
        What was measured.
    until_s : float
        End of the time compared [s].
    samples : int
        Measured values compared.
    rms : float
        Root mean square of simulated minus measured.
    largest : float
        Largest difference, with its sign.
    measured_peak, simulated_peak : float
        Largest values up to that time.
    """

    signal: str
    unit: str
    until_s: float
    samples: int
    rms: float
    largest: float
    measured_peak: float
    simulated_peak: float

    @property
    def peak_error(self) -> float:
        """Simulated peak minus measured peak, as a share of the measured one."""
        if self.measured_peak == 0.0:
            return math.nan
        return (self.simulated_peak - self.measured_peak) / abs(self.measured_peak)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        error = self.peak_error
        return {**asdict(self), "peak_error": None if math.isnan(error) else error}


def simulated_signal(trajectory: Trajectory, name: str) -> np.ndarray:
    """Return what a measured signal is compared with; the boulder's own centre, as a camera tracks it."""
    if name == "rotation":
        return np.degrees(trajectory.rotation_rad)
    if name == "boulder_displacement":
        return trajectory.boulder_centre_displacement_m
    if name == VEHICLE_ACCELERATION.name:
        return trajectory.vehicle_acceleration_m_s2
    return trajectory.vehicle_displacement_m


def compare(trajectory: Trajectory, measured: TimeHistory) -> list[Deviation]:
    """Compare a simulation with measured signals, over the whole time and up to the rotation limit.

    Parameters
    ----------
    trajectory
        The simulation.
    measured
        Signals of `TEST_SIGNALS`; gaps are left out.

    Returns
    -------
    list of Deviation
        For every signal one over the time that both cover, and where the simulated boulder passes its rotation limit a
        second one up to then, because the model does not hold beyond.

    Raises
    ------
    ComparisonError
        No measured value lies within the simulated time.
    """
    end = float(trajectory.time_s[-1]) if len(trajectory) else 0.0
    limit = trajectory.motion.outcome.t_limit
    deviations = []
    for name, values in measured.signals.items():
        for until in (end, limit) if math.isfinite(limit) else (end,):
            inside = np.isfinite(values) & (measured.time_s >= 0.0) & (measured.time_s <= until)
            if not inside.any():
                continue
            times, data = measured.time_s[inside], values[inside]
            simulated = np.interp(times, trajectory.time_s, simulated_signal(trajectory, name))
            error = simulated - data
            deviations.append(
                Deviation(
                    signal=name,
                    unit=UNITS[name],
                    until_s=until,
                    samples=len(data),
                    rms=float(np.sqrt(np.mean(error**2))),
                    largest=float(error[np.argmax(np.abs(error))]),
                    measured_peak=_peak(data),
                    simulated_peak=_peak(simulated),
                )
            )
    if not deviations:
        raise ComparisonError(
            f"{measured.path}: no measured value lies within the simulated time, 0 to {end:g} s; "
            f"time counts from first touch"
        )
    return deviations


def deviation_table(by_preset: dict[str, list[Deviation]]) -> Table:
    """Return deviations by preset as a table."""
    table = Table(
        (
            "signal",
            "readings",
            "up to [s]",
            "values",
            "RMS error",
            "largest error",
            "measured peak",
            "simulated peak",
            "peak error",
        )
    )
    for preset, deviations in by_preset.items():
        for d in deviations:
            digits = {"deg": 2, "m/s^2": 1}.get(d.unit, 4)
            unit = "°" if d.unit == "deg" else f" {d.unit}"
            share = "-" if math.isnan(d.peak_error) else f"{d.peak_error:+.1%}"
            texts = (number(value, digits) + unit for value in (d.rms, d.largest, d.measured_peak, d.simulated_peak))
            label = d.signal.replace("_", " ")
            table.add(label, preset.replace("_", " "), f"{d.until_s:.3f}", str(d.samples), *texts, share)
    return table


def _peak(values: np.ndarray) -> float:
    """Value of the largest magnitude, with its sign."""
    return float(values[np.argmax(np.abs(values))])
