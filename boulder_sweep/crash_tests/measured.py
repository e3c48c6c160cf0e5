"""Measured time histories: a CSV file whose header names quantities and their units; a rigid-wall pulse is one.

``time [ms], displacement [mm], acceleration [g]``: the name of a quantity, then its unit in brackets or parentheses, or
behind an underline as in ``time_s`` and ``vehicle_displacement_m``. Units may stand in a line of their own below the
names. Empty cells are gaps in a track. Lines that begin with # are skipped.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.errors import FitError
from boulder_sweep.settings.problems import Position, Problems, check_regular_file, did_you_mean, refuse, shorten
from boulder_sweep.settings.tables import MAX_BYTES, TextTable, open_table
from boulder_sweep.settings.units import UnitError, factor

MOST_ROWS = 2_000_000
_BRACKETS = re.compile(r"(?P<name>[^\[(]*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>.*)\))\s*")
_SUFFIXES = {"m_s2": "m/s^2", "ft_s2": "ft/s^2", "m_s": "m/s", "km_h": "km/h", "ft_s": "ft/s"}
_SUFFIXES |= {unit: unit for unit in ("s", "ms", "m", "mm", "cm", "in", "ft", "deg", "rad", "mph", "g")}


class Signal(NamedTuple):
    """A quantity that a file may hold."""

    name: str
    unit: str
    """Unit it is converted to: s, m, m/s, m/s^2 or deg."""
    other_names: tuple[str, ...] = ()
    positive: str = ""
    """When it is positive, in words, where a film or a sensor may give either sign."""


_ALONG = "in the direction in which the truck travels"
TIME = Signal("time", "s", ("t",))
DISPLACEMENT = Signal("displacement", "m", ("x", "crush", "vehicle_displacement"))
VELOCITY = Signal("velocity", "m/s", ("v", "speed", "vehicle_velocity"))
ACCELERATION = Signal("acceleration", "m/s^2", ("a", "vehicle_acceleration"))
DECELERATION = Signal("deceleration", "m/s^2", ("vehicle_deceleration",))
ROTATION = Signal("rotation", "deg", ("boulder_rotation", "angle"), "while the boulder's top moves away from the truck")
BOULDER = Signal("boulder_displacement", "m", ("boulder_centre_displacement",), _ALONG)
VEHICLE = Signal("vehicle_displacement", "m", ("truck_displacement",), _ALONG)
VEHICLE_ACCELERATION = Signal("vehicle_acceleration", "m/s^2", ("truck_acceleration",), "while the truck gains speed")

PULSE_SIGNALS = (TIME, DISPLACEMENT, VELOCITY, ACCELERATION, DECELERATION)
"""What a crash pulse against a rigid wall may hold."""
TEST_SIGNALS = (TIME, ROTATION, BOULDER, VEHICLE, VEHICLE_ACCELERATION)
"""What the film and the accelerometers of a crash test may hold."""


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """A measured time history of n ascending times."""

    path: Path
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    """Values by name in SI units (angles in degrees), shape (n,), NaN where there is a gap."""


def read_history(path: str | Path, wanted: Sequence[Signal]) -> TimeHistory:
    """Read a CSV file of measurements over time; `wanted` are the quantities it may hold, time among them.

    Return at least one quantity besides time and at least two rows. Raise `SettingsError` with every mistake of the
    file, with line and column.
    """
    file = Path(path)
    check_regular_file(file, MAX_BYTES, "Keep the impact, and leave out what comes before and after")
    problems = Problems()
    with open_table(file, MOST_ROWS, [f"{signal.name} [{signal.unit}]" for signal in wanted], problems) as table:
        columns = _columns(table, wanted, problems)
        parts: dict[str, list[np.ndarray]] = {column.signal.name: [] for column in columns}
        last = -np.inf
        for rows in table.chunks():
            for index, column in enumerate(columns):
                name = column.signal.name
                values = table.numbers(rows, index, name, may_be_empty=column.signal is not TIME) * column.factor
                if column.signal is TIME:
                    for row in np.flatnonzero(np.diff(values, prepend=last) <= 0.0):
                        before = values[row - 1] if row else last
                        message = f"{values[row]:.6g} s comes after {before:.6g} s; times must ascend"
                        table.alike.add("rows", table.position(rows[row], index), message, name)
                    last = values[-1]
                parts[name].append(values)
    problems.raise_if_any()
    found = {name: np.concatenate([np.empty(0), *values]) for name, values in parts.items()}
    time = found.pop(TIME.name)
    if len(time) < 2:
        raise refuse(str(file), "must hold a line of names and at least two rows of numbers")
    return TimeHistory(file, time, found)


class _Column(NamedTuple):
    """One column of the file."""

    signal: Signal
    factor: float


def _columns(table: TextTable, wanted: Sequence[Signal], problems: Problems) -> list[_Column]:
    """Return what the columns are; refuse unknown names and units, and a file without time or all else."""
    names = _with_units(table, wanted)
    found = [_column(name, at, wanted, problems) for name, at in zip(names, table.positions, strict=True)]
    columns = [column for column in found if column is not None]
    named = [column and column.signal.name for column in found]
    for index, name in enumerate(named):
        if name is not None and name in named[:index]:
            problems.add(table.positions[index], "stands in two columns", name)
    if not problems and TIME.name not in named:
        problems.add(table.positions[0], "has no column of time, such as 'time [ms]'")
    if not problems and len(named) < 2:
        others = ", ".join(signal.name for signal in wanted if signal is not TIME)
        problems.add(table.positions[0], f"has nothing beside time; it may hold {others}")
    problems.raise_if_any()
    return columns


def _with_units(table: TextTable, wanted: Sequence[Signal]) -> list[str]:
    """Return the names of columns with their units, which stand below them in some files."""
    row = next(table.rows, None)
    if row is None:
        return table.names
    units = [table.cells([row], index)[0].strip(" []()") for index in range(len(table.names))]
    bare = not any(_split_header(name)[1] for name in table.names)
    if bare and all(any(_is_unit(unit, signal.unit) for signal in wanted) for unit in units):
        return [f"{name} [{unit}]" for name, unit in zip(table.names, units, strict=True)]
    table.put_back(row)
    return table.names


def _column(cell: str, position: Position, wanted: Sequence[Signal], problems: Problems) -> _Column | None:
    """Return what a cell of the header names; with a mistake it is reported and None returned."""
    name, unit = _split_header(cell.strip())
    known = {word: signal for signal in wanted for word in (signal.name, *signal.other_names)}
    plain = name.strip().lower().replace(" ", "_").replace("-", "_")
    signal = known.get(plain)
    if signal is None:
        names = ", ".join(signal.name for signal in wanted)
        fitting = [word for word, one in known.items() if not unit or _is_unit(unit, one.unit)]
        problems.add(position, f"is not known{did_you_mean(plain, fitting)}; a file may hold {names}", shorten(cell))
        return None
    if not unit:
        problems.add(
            position, f"has no unit; write it in brackets, such as '{signal.name} [{signal.unit}]'", shorten(cell)
        )
        return None
    try:
        return _Column(signal, float(factor(unit, signal.unit)))
    except UnitError as error:
        problems.add(position, str(error), shorten(cell))
        return None


def _split_header(cell: str) -> tuple[str, str]:
    """Split ``name [unit]`` or ``name_unit``."""
    match = _BRACKETS.fullmatch(cell)
    if match:
        return match["name"], (match["square"] or match["round"] or "").strip()
    for suffix, unit in _SUFFIXES.items():
        if cell.endswith(f"_{suffix}"):
            return cell.removesuffix(f"_{suffix}"), unit
    return cell, ""


def _is_unit(unit: str, target: str) -> bool:
    """Whether a unit is of the kind that is wanted."""
    try:
        return factor(unit, target) > 0
    except UnitError:
        return False


PULSE_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
FEWEST_SAMPLES = 8
SIZES = (1e-9, 1e9)
"""Least and greatest peak of a signal that is accepted, in its unit: far beyond any impact."""


def read_pulse(path: str | Path) -> TimeHistory:
    """Read a crash pulse from a CSV file; see `boulder_sweep.crash_tests.measured` for its header, and `pulse_of`."""
    return pulse_of(read_history(path, PULSE_SIGNALS))


def pulse_of(history: TimeHistory) -> TimeHistory:
    """Return a measured history as a crash pulse; a deceleration becomes an acceleration.

    It has one or more of ``displacement`` [m], ``velocity`` [m/s] and ``acceleration`` [m/s^2]. Zero need not be first
    touch exactly, and rows before it are of use. Raise `FitError` where a signal has fewer than 8 values, the vehicle
    seems to be accelerated by the wall or to move away from it, or a signal does not change or has a size that no
    impact has.
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
    return replace(history, signals=signals)


def _check_size(label: str, values: np.ndarray, name: str) -> None:
    """Refuse a signal without motion, or of a size that no impact has; a constant deceleration stops a vehicle too."""
    size, unit = float(np.nanmax(np.abs(values))), PULSE_UNITS[name]
    if size == 0.0 or (name != "acceleration" and np.nanmin(values) == np.nanmax(values)):
        raise FitError(f"{label} does not change; it must show how the wall stops the vehicle")
    if not SIZES[0] <= size <= SIZES[1]:
        raise FitError(f"{label} reaches {size:.3g} {unit}, which no impact reaches; check the column's unit")
