"""What a design withstands: how fast and how heavy a truck and how weak a soil, with everything else unchanged.

An input is made worse until the design fails or, if the design fails as it is, better until it passes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.answers.draws import threads
from boulder_sweep.answers.keys import Key, key_of
from boulder_sweep.answers.questions import Trial, replaced
from boulder_sweep.answers.result import Result
from boulder_sweep.answers.search import FAILS, HOLDS, Search, search
from boulder_sweep.answers.trials import Judges, Rows, judges_of, ranges
from boulder_sweep.designs import block_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.locations import Location
from boulder_sweep.runner.pool import call
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
        from boulder_sweep.answers.tables import write_parquet

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
    from boulder_sweep.answers.tables import joined_tables
    from boulder_sweep.store.provenance import file_metadata, identity

    sweep = at_values(sweep)
    judges = judges_of(sweep)
    judges.final.warm_up()
    if progress is not None:
        progress(0, sweep.n_designs)
    tables, done = [], 0
    pieces = ranges(sweep.n_designs, ROWS_AT_ONCE)
    for table in threads(jobs)(call(_table, sweep, judges, start, stop) for start, stop in pieces):
        tables.append(table)
        done += len(table)
        if progress is not None:
            progress(done, sweep.n_designs)
    own = judges.final
    found = identity(sweep.resolved(), own.readings._asdict(), own.control._asdict(), judges.accuracy.to_dict())
    return Reserves(sweep, joined_tables(tables, file_metadata(found, "boulder_sweep.answers.reserves")))


def withstood(key: Key, judges: Judges, rows: Rows, passes: np.ndarray, best: float, worst: float) -> np.ndarray:
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
    own = rows[key.name] / key.tolerance
    # The nearest lattice place on the better side; a design that passes also passes there.
    first = (np.floor(own + 1e-9) if worst > best else np.ceil(own - 1e-9)).astype(np.int64)
    ends = (round(end / key.tolerance) for end in (worst, best))
    last = np.where(passes, *ends)
    # A range never runs backwards: towards the better side for a design that passes, or the worse for one that fails.
    upwards = passes == (worst > best)
    backwards = np.where(upwards, last < first, last > first)
    last = np.where(backwards, first, last)

    def predicate(codes: Callable[[np.ndarray, np.ndarray], np.ndarray], index: np.ndarray) -> Any:
        """Search for the change of verdict; for a design that passes, for the first value at which it does not."""

        def changed(inner: np.ndarray, places: np.ndarray) -> np.ndarray:
            holds = codes(index[inner], places) == HOLDS
            return np.where(holds != passes[index[inner]], HOLDS, FAILS)

        return changed

    every = np.arange(len(first))
    found = search(predicate(trial.coarse, every), first, last)
    wrong = np.flatnonzero(~_certified(trial, found, passes))
    if len(wrong):
        part = search(predicate(trial.final, wrong), first[wrong], last[wrong])
        found = replaced(found, wrong, part)
    # `fails` is the last place before the change; for a design that passes, that is the withstood value.
    at = np.where(passes, np.where(found.has_holds, found.fails, last), found.holds)
    at = np.where(passes & found.has_holds & ~found.has_fails, first, at)
    values = np.where(passes | found.has_holds, key.values(at), np.nan)
    return np.where(backwards, np.where(passes, rows[key.name], np.nan), values)


def _certified(trial: Trial, found: Search, passes: np.ndarray) -> np.ndarray:
    """Return whether the accuracy of the sweep confirms both ends of the brackets."""
    before, behind = np.flatnonzero(found.has_fails), np.flatnonzero(found.has_holds)
    ends = np.concatenate([before, behind])
    holds = trial.final(ends, np.concatenate([found.fails[before], found.holds[behind]])) == HOLDS
    agrees = np.ones(len(passes), dtype=bool)
    agrees[ends[holds == (passes[ends] == (np.arange(len(ends)) >= len(before)))]] = False
    return agrees


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
    place = np.searchsorted(bounds - 0.005, np.nan_to_num(speed), side="right")
    words = ("", *speeds)
    return [words[at] or None if known else None for at, known in zip(place, named, strict=True)]


def _table(sweep: Sweep, judges: Judges, start: int, stop: int) -> pa.Table:
    """Return the table of the designs ``[start, stop)``."""
    from boulder_sweep.answers.tables import to_build, with_columns
    from boulder_sweep.store.schema import part_table

    rows = sweep.plan.given_rows(start, stop)
    block = block_of(rows)
    judged = judges.final(block)
    judged, passes = judges.final.graded(judged, block), judges.holds(judged)
    columns: list[tuple[str, str, str, Any]] = []
    values = {}
    for own in RESERVES:
        key = key_of(own.input, most=own.worst > own.best)
        values[own.column] = withstood(key, judges, rows, passes, own.best, own.worst)
        meaning = f"{own.meaning} at which the design passes, all else unchanged; simulated"
        columns.append((own.column, key.field.unit, meaning, values[own.column]))
    speed, mass = values["withstands_speed_m_s"], rows["vehicle_mass_kg"]
    meaning = "class of ASTM F2656 whose nominal speed is withstood; simulated, which rates no barrier"
    columns.append(("simulated_class", "", meaning, classes(speed, mass)))
    meaning = "speed of tests to ISO 22343-1 (IWA 14-1) of 7200 kg that is withstood; simulated, which rates no barrier"
    columns.append(("simulated_iso_speed", "", meaning, classes(speed, mass, ISO_SPEEDS, ISO_MASS_KG)))
    columns += to_build(block, sweep)
    return with_columns(
        part_table(replace(block, start=start, stop=stop, labels=sweep.block(start, stop).labels), judged, {}), columns
    )
