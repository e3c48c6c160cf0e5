"""What a design withstands: how fast and how heavy a truck and how weak a soil, with everything else unchanged.

Three questions of ``sweep need``, put to every design. Each answer is the end of the stretch from zero, or of the soil
from the strongest, in which everything passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.answers.keys import Key, key_of, usual_ends
from boulder_sweep.answers.questions import ValueSearch
from boulder_sweep.answers.result import (
    Result,
    TableColumn,
    collected,
    joined_tables,
    rows_table,
    to_build,
)
from boulder_sweep.answers.search import WORDS
from boulder_sweep.answers.trials import Judges, judges_of, ranges, rows_at
from boulder_sweep.designs import block_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.runner.pool import Pool, call
from boulder_sweep.settings.loader import sweep_of
from boulder_sweep.text import ProgressCallback

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.loader import Settings

ROWS_AT_ONCE = 2048
MPH = 0.44704
CLASSES = {"M30": 30 * MPH, "M40": 40 * MPH, "M50": 50 * MPH}
"""Nominal speeds [m/s] of the ASTM F2656 classes for a medium-duty truck."""
CLASS_MASS_KG = 6800.0
KM_H = 1.0 / 3.6
ISO_SPEEDS = {"48 km/h": 48 * KM_H, "64 km/h": 64 * KM_H, "80 km/h": 80 * KM_H}
"""Speeds [m/s] of tests to IWA 14-1, which ISO 22343-1 supersedes, with a truck of 7200 kg (docs/references.md)."""
ISO_MASS_KG = 7200.0
CLASS_TOLERANCE = 0.02
"""A class applies to a truck of one mass; none is named if the mass differs by more than this share."""


class Reserve(NamedTuple):
    """One input that is made worse."""

    key: Key
    column: str
    """Column of what is withstood."""
    word: str
    """What the columns of its bracket are called by."""
    meaning: str


RESERVES = (
    Reserve(key_of("speed", most=True), "withstands_speed_m_s", "speed", "largest impact speed"),
    Reserve(key_of("vehicle.mass", most=True), "withstands_mass_kg", "mass", "largest mass of the vehicle"),
    Reserve(key_of("friction_angle"), "withstands_friction_angle_deg", "soil", "smallest friction angle of the soil"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Reserves(Result):
    """What the designs of a sweep withstand: inputs, outcome and withstood values of each. Made by `capacity`."""

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {"name": self.sweep.name, "rows": self.arrow.to_pylist()}


def capacity(sweep: Settings, *, jobs: int | None = None, progress: ProgressCallback | None = None) -> Reserves:
    """Find what every design of a sweep withstands.

    Parameters
    ----------
    sweep
        The sweep, the path of its file, or a mapping that `boulder_sweep.load` takes.
    jobs
        Threads; all cores by default.
    progress
        Called as the search progresses.

    Returns
    -------
    Reserves
        One row a design, with the answer to each question and its bracket, as `boulder_sweep.need` gives them: from
        zero, or from 49 degrees, to the end of the usual range or to the design's own value where that lies beyond.

    Raises
    ------
    QuestionError
        The depth is to be found.
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    """
    sweep = at_values(sweep_of(sweep))
    sweep.need_depth()
    judges = judges_of(sweep)
    judges.final.asked().warm_up()
    calls = (call(_table, sweep, judges, start, stop) for start, stop in ranges(sweep.n_designs, ROWS_AT_ONCE))
    tables = collected(Pool(jobs)(calls), sweep.n_designs, progress)
    return Reserves(sweep, joined_tables(tables, sweep, judges, "boulder_sweep.capacity"))


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
    from boulder_sweep.store.part import word_array

    rows = sweep.plan.given_rows(start, stop)
    block = block_of(rows)
    judged = judges.final(block)
    judged = judges.final.graded(judged, block)
    columns: list[TableColumn] = []
    withstood = {}
    for key, column, word, meaning in RESERVES:
        own, usual = rows[key.name], usual_ends(key)
        asked = {name: values for name, values in rows.items() if name != key.name}
        ends = np.minimum(usual[0], own), np.maximum(usual[1], own)
        # Designs that differ in this input alone ask the same.
        every = np.stack([*ends, *asked.values()])
        _, once, each = np.unique(every, axis=1, return_index=True, return_inverse=True)
        answers = ValueSearch(sweep, key, judges).answers_of(rows_at(asked, once), *(end[once] for end in ends))
        each = each.reshape(-1)
        withstood[column], kinds = answers.passes[each], word_array(answers.found[each], WORDS)
        stretches = [answers.stretches[row] for row in each.tolist()]
        safe = "all greater angles" if key.name == "friction_angle_deg" else "all smaller values"
        meaning = f"{meaning} at which the design passes, as at {safe}; simulated"
        columns += [
            (column, key.field.unit, meaning, withstood[column]),
            (f"{word}_fails_at", key.field.unit, "value next to it that does not pass", answers.fails[each]),
            (f"{word}_found", "", "kind of the answer, in the words of sweep need", kinds),
            (f"{word}_passes_within", key.field.unit, "where not monotone: all stretches that pass", stretches),
        ]
    speed, mass = withstood["withstands_speed_m_s"], rows["vehicle_mass_kg"]
    meaning = "class of ASTM F2656 whose nominal speed is withstood; simulated, which rates no barrier"
    columns.append(("simulated_class", "", meaning, classes(speed, mass)))
    meaning = "speed of tests to ISO 22343-1 (IWA 14-1) of 7200 kg that is withstood; simulated, which rates no barrier"
    columns.append(("simulated_iso_speed", "", meaning, classes(speed, mass, ISO_SPEEDS, ISO_MASS_KG)))
    columns += to_build(block, sweep)
    return rows_table(start, replace(block, labels=sweep.block(start, stop).labels), judged, columns)
