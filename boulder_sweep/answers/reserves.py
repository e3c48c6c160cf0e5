"""What a design withstands: how fast and how heavy a truck and how weak a soil, with everything else unchanged.

An input is made worse until the design fails or, if the design fails as it is, better until it passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.answers.keys import Key, key_of
from boulder_sweep.answers.questions import Trial
from boulder_sweep.answers.result import (
    Result,
    TableColumn,
    collected,
    joined_tables,
    rows_table,
    to_build,
    write_parquet,
)
from boulder_sweep.answers.search import FAILS, HOLDS, Predicate, contradicted, search, searched_again
from boulder_sweep.answers.trials import InputRows, Judges, judges_of, ranges
from boulder_sweep.designs import block_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.locations import Location
from boulder_sweep.runner.pool import Pool, call
from boulder_sweep.text import ProgressCallback

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.settings import Sweep

ROWS_AT_ONCE = 2048
MPH = 0.44704
CLASSES = {"M30": 30 * MPH, "M40": 40 * MPH, "M50": 50 * MPH}
"""Nominal speeds [m/s] of the ASTM F2656 classes for a medium-duty truck."""
CLASS_MASS_KG = 6800.0
KM_H = 1.0 / 3.6
ISO_SPEEDS = {"48 km/h": 48 * KM_H, "64 km/h": 64 * KM_H, "80 km/h": 80 * KM_H}
"""Speeds [m/s] of tests to IWA 14-1, which ISO 22343-1 supersedes, with a truck of 7200 kg (docs/bibliography.md)."""
ISO_MASS_KG = 7200.0
CLASS_TOLERANCE = 0.02
"""A class applies to a truck of one mass; none is named if the mass differs by more than this share."""


class Reserve(NamedTuple):
    """One input that is made worse."""

    input: str
    """Key of the file."""
    column: str
    """Column of what is withstood."""
    best: float
    """Best value tried."""
    worst: float
    """Worst value tried, unless the design itself has a worse one."""
    meaning: str


RESERVES = (
    Reserve("speed", "withstands_speed_m_s", 1.0, 40.0, "largest impact speed"),
    Reserve("vehicle.mass", "withstands_mass_kg", 100.0, 60_000.0, "largest mass of the vehicle"),
    Reserve("friction_angle", "withstands_friction_angle_deg", 59.0, 15.0, "smallest friction angle of the soil"),
)


@dataclass(frozen=True, eq=False)
class Reserves(Result):
    """What the designs of a sweep withstand: inputs, outcome and withstood values of each. Made by `reserves`."""

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {"name": self.sweep.name, "rows": self.arrow.to_pylist()}

    def write(self, path: str | Location) -> Location:
        """Write the table to a Parquet file.

        Raises
        ------
        QuestionError
            It cannot be written.
        """
        return write_parquet(self.arrow, path)


def reserves(sweep: Sweep, *, jobs: int | None = None, progress: ProgressCallback | None = None) -> Reserves:
    """Find what every design of a sweep withstands.

    Parameters
    ----------
    sweep
        The sweep.
    jobs
        Threads; all cores by default.
    progress
        Called as the search progresses.

    Returns
    -------
    Reserves
        One row a design. If a design fails at every value tried, the column is null; if it never fails, the column
        holds the last value tried, or the design's own value if that is worse still.

    Raises
    ------
    SettingsError
        An input has a distribution.
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    """
    sweep = at_values(sweep)
    judges = judges_of(sweep)
    judges.final.warm_up()
    calls = (call(_table, sweep, judges, start, stop) for start, stop in ranges(sweep.n_designs, ROWS_AT_ONCE))
    tables = collected(Pool(jobs)(calls), sweep.n_designs, progress)
    return Reserves(sweep, joined_tables(tables, sweep, judges, "boulder_sweep.answers.reserves"))


def withstood(key: Key, judges: Judges, rows: InputRows, passes: np.ndarray, best: float, worst: float) -> np.ndarray:
    """Return the worst value of an input that each of n designs withstands; NaN where it fails at every value.

    Parameters
    ----------
    key
        The input.
    judges
        How designs are judged.
    rows
        Inputs of the designs.
    passes
        Whether they pass as they are.
    best, worst
        Range over which the input is changed. It begins at the design's own value: a design that passes beyond `worst`
        withstands its own value, and nothing is tried for one that fails beyond `best`.
    """
    trial = Trial(key, judges, rows)
    position = rows[key.name] / key.tolerance
    # The nearest lattice position on the better side; a design that passes also passes there.
    first = (np.floor(position + 1e-9) if worst > best else np.ceil(position - 1e-9)).astype(np.int64)
    ends = (round(end / key.tolerance) for end in (worst, best))
    last = np.where(passes, *ends)
    # A range never runs backwards: towards the better side for a design that passes, or the worse for one that fails.
    upwards = passes == (worst > best)
    backwards = np.where(upwards, last < first, last > first)
    last = np.where(backwards, first, last)

    def change(codes: Predicate) -> Predicate:
        """Search for the change of verdict; for a design that passes, for the first value at which it does not."""

        def changed(index: np.ndarray, positions: np.ndarray) -> np.ndarray:
            return np.where((codes(index, positions) == HOLDS) != passes[index], HOLDS, FAILS)

        return changed

    result = search(change(trial.coarse), first, last)
    wrong = contradicted(change(trial.final), result)
    result = searched_again(change(trial.final), result, wrong, first, last)
    # `fails` is the last position before the change; for a design that passes, that is the withstood value.
    at = np.where(passes, np.where(result.has_holds, result.fails, last), result.holds)
    at = np.where(passes & result.has_holds & ~result.has_fails, first, at)
    values = np.where(passes | result.has_holds, key.values(at), np.nan)
    return np.where(backwards, np.where(passes, rows[key.name], np.nan), values)


def classes(
    speed: np.ndarray, mass: np.ndarray, speeds: Mapping[str, float] = CLASSES, of_kg: float = CLASS_MASS_KG
) -> list[str | None]:
    """Return the highest class whose nominal speed is withstood; none for other truck masses.

    Parameters
    ----------
    speed, mass
        Withstood speed [m/s] and truck mass [kg] of n designs, shape (n,).
    speeds, of_kg
        Nominal speeds by class in ascending order, and the truck mass they apply to.
    """
    named = np.abs(mass / of_kg - 1.0) <= CLASS_TOLERANCE
    bounds = np.array(list(speeds.values()))
    # 30 mph is 13.41 m/s on the lattice of withstood speeds.
    index = np.searchsorted(bounds - 0.005, np.nan_to_num(speed), side="right")
    words = ("", *speeds)
    return [words[at] or None if known else None for at, known in zip(index, named, strict=True)]


def _table(sweep: Sweep, judges: Judges, start: int, stop: int) -> pa.Table:
    """Return the table of the designs ``[start, stop)``."""
    rows = sweep.plan.given_rows(start, stop)
    block = block_of(rows)
    judged = judges.final(block)
    judged, passes = judges.final.graded(judged, block), judges.holds(judged)
    columns: list[TableColumn] = []
    values = {}
    for reserve in RESERVES:
        key = key_of(reserve.input, most=reserve.worst > reserve.best)
        values[reserve.column] = withstood(key, judges, rows, passes, reserve.best, reserve.worst)
        meaning = f"{reserve.meaning} at which the design passes, all else unchanged; simulated"
        columns.append((reserve.column, key.field.unit, meaning, values[reserve.column]))
    speed, mass = values["withstands_speed_m_s"], rows["vehicle_mass_kg"]
    meaning = "class of ASTM F2656 whose nominal speed is withstood; simulated, which rates no barrier"
    columns.append(("simulated_class", "", meaning, classes(speed, mass)))
    meaning = "speed of tests to ISO 22343-1 (IWA 14-1) of 7200 kg that is withstood; simulated, which rates no barrier"
    columns.append(("simulated_iso_speed", "", meaning, classes(speed, mass, ISO_SPEEDS, ISO_MASS_KG)))
    columns += to_build(block, sweep)
    return rows_table(start, replace(block, labels=sweep.block(start, stop).labels), judged, columns)
