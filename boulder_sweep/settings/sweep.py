"""A sweep: everything a settings file says, checked and in the units of the table."""

from __future__ import annotations

import hashlib
import math
import shlex
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.columns import BOULDER_MASS
from boulder_sweep.designs import LEAST_SOLIDITY, SIDES, UNUSUAL, DesignBlock, DesignPlan, Label, Source
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.fields import ALLOW_UNUSUAL, BY_NAME, EMBEDMENT, HELD, INPUTS, TO_BE_FOUND
from boulder_sweep.settings.model import CLOSED_FORM, Criterion, Distribution, Model, SetDistributions, SolverSettings
from boulder_sweep.settings.problems import Position, Problem
from boulder_sweep.settings.soil_readings import soil_words
from boulder_sweep.settings.units import SYSTEMS
from boulder_sweep.settings.values import is_unusual
from boulder_sweep.settings.vehicle import APPROACH, approach_words

_AT_ONCE = 65_536
"""Designs looked at together."""
_SOME_RATIO = 0.5
"""Embedment over height of designs whose depth is to be found, for what does not depend on it."""
MAX_LISTED = 1000
"""Longest axis that `Sweep.resolved` lists value by value."""

IMPACT_HEIGHT_RULE = "Eq 9: (min(boulder_height - embedment_depth, hood_height) + bumper_height) / 2"

SECTION = "report"
"""Block of the file that holds the heading."""
UNITS = "units"
"""Entry of the file that says in which units results are shown."""
SHOWN = (SECTION, UNITS)
"""Entries on which no row depends."""
MOST_CHARACTERS = 200
"""Longest entry of a heading."""


class Heading(NamedTuple):
    """The heading of a report: whom and what it is for, and who answers for it. An entry that is not given is empty."""

    project: str = ""
    client: str = ""
    site: str = ""
    date: str = ""
    revision: str = ""
    author: str = ""
    checked_by: str = ""

    def given(self) -> dict[str, str]:
        """Return the entries that are given, in order."""
        return {name: text for name, text in self._asdict().items() if text}


NO_HEADING = Heading()


def wrong_with(text: str) -> str:
    """Say what is wrong with an entry of a heading; empty if nothing is."""
    if not text.strip():
        return "is empty; write one line of text, or leave it out"
    if not text.isprintable():
        return "must be one line of printable text"
    if len(text) > MOST_CHARACTERS:
        return f"has {len(text)} characters; at most {MOST_CHARACTERS} fit into a heading"
    return ""


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of the grid: the values of one input, or named sets of several."""

    name: str  # column of the table, or ``embedment_ratio``; ``soil`` or ``vehicle`` for named sets
    values: np.ndarray  # float64, in the unit of the column, in the order of the file; of named sets their numbers
    sets: dict[str, np.ndarray] = field(default_factory=dict)  # values by column name, of named sets only
    labels: tuple[str, ...] = ()  # names of the named sets

    def __len__(self) -> int:
        return len(self.values)

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Values by column name."""
        return self.sets or {self.name: self.values}


@dataclass(frozen=True, eq=False)
class DesignList:
    """The explicit list of designs of ``table: FILE``."""

    file: str  # without its folder
    columns: dict[str, np.ndarray]  # float64, shape (n,)
    labels: dict[str, Label] = field(default_factory=dict)  # text columns that are carried into the result
    units: str = SYSTEMS[0]  # ``us`` where the column of the height is in feet or inches
    source: str = ""  # the file, for messages
    lines: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))  # of the rows; none in a Parquet file
    written: dict[str, str] = field(default_factory=dict)  # names of the columns as the file has them

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def position(self, row: int) -> Position:
        """Return where a row stands."""
        return Position(self.source, int(self.lines[row]) if len(self.lines) else None)

    def called(self, row: int) -> str:
        """Return what the list calls the boulder of a row, ``stone_id 16``, else its number from 1 up."""
        own = [(name, one) for name, one in self.labels.items() if name.lower().endswith(("id", "name"))]
        return f"{own[0][0]} {own[0][1].words[own[0][1].codes[row]]}" if own else f"row {row + 1}"


@dataclass(frozen=True, eq=False)
class Sweep:
    """A checked file of settings. Made by `boulder_sweep.load`.

    Attributes
    ----------
    name : str
        Name of the sweep.
    path : Path or None
        The file it came from.
    axes : tuple of Axis
        Axes in the order of the file, the last one fastest.
    constants : dict of str to float
        Single values by column name (or ``embedment_ratio``), defaults filled in.
    table : DesignList or None
        Explicit list of designs in place of axes.
    criterion : Criterion
        Limits a design must hold.
    model : Model
        Reading of the paper and representation of the soil.
    solver : SolverSettings
        Accuracy or step, and the time simulated.
    distributions : dict of str to Distribution or SetDistributions
        Uncertain inputs by column name; their means are the values in `constants` and `axes`.
    correlation : float
        Correlation of friction angle and subgrade reaction, where both are uncertain.
    taken_at : dict of str to str
        What uncertain inputs were taken at where one value was needed, by column name: ``mean``, or a quantile and the
        side of the distribution, such as ``p5 low``; see `boulder_sweep.at_values`.
    cases : tuple of Sweep
        The same designs with other values of the uncertain inputs; a row has the worst of the verdicts.
    partial_factor : float
        Partial factor on tan(friction angle). The friction angles in `constants`, `axes` and `table` are design
        values: the factor has been applied to them.
    overrides : tuple of str
        Entries that replaced entries of the file, as ``--set`` gives them.
    heading : Heading
        Project, client, author and date for the heading of a report.
    derived : dict of str to Any
        What inputs were worked out of, by the key of the file, such as the run-up that gives a speed.
    units : str
        In which results are shown, ``si`` or ``us``; rows do not depend on it.
    depth_sought : bool
        Whether the depth is to be found: questions search it, and no design can be computed without one.
    allowed : tuple of str
        Dotted keys whose values may be far from usual; a listed design with another such value cannot be computed. A
        sweep that no file describes may take any.
    notes : tuple of Problem
        Notes that are not errors.
    """

    name: str
    path: Path | None
    axes: tuple[Axis, ...]
    constants: dict[str, float]
    table: DesignList | None = None
    criterion: Criterion = field(default_factory=Criterion)
    model: Model = field(default_factory=Model)
    solver: SolverSettings = field(default_factory=SolverSettings)
    distributions: dict[str, Distribution | SetDistributions] = field(default_factory=dict)
    correlation: float = 0.0
    taken_at: dict[str, str] = field(default_factory=dict)
    cases: tuple[Sweep, ...] = ()
    partial_factor: float = 1.0
    notes: tuple[Problem, ...] = ()
    overrides: tuple[str, ...] = ()
    heading: Heading = NO_HEADING
    derived: dict[str, Any] = field(default_factory=dict)
    units: str = SYSTEMS[0]
    depth_sought: bool = False
    allowed: tuple[str, ...] = HELD

    @property
    def groups(self) -> list[dict[str, np.ndarray]]:
        """Values by column name of each axis, or of the list of designs; the values of a group vary together."""
        return [axis.columns for axis in self.axes] if self.table is None else [self.table.columns]

    @cached_property
    def values(self) -> dict[str, np.ndarray]:
        """All values by column name, of single ones an array of one."""
        values = {name: np.array([value]) for name, value in self.constants.items()}
        for group in self.groups:
            values |= group
        return values

    @cached_property
    def plan(self) -> DesignPlan:
        """How the columns of the designs follow from constants, axes and table."""
        given = {name: Source(np.array([value])) for name, value in self.constants.items()}
        labels: dict[str, Label] = {}
        for k, group in enumerate(self.groups):
            given |= {name: Source(values, (k,)) for name, values in group.items()}
        for k, axis in enumerate(self.axes):
            if axis.labels:
                labels[axis.name] = Label(np.arange(len(axis), dtype=np.int32), axis.labels, k)
        if self.table is not None:
            labels = self.table.labels
            rows = np.zeros(len(self.table), dtype=bool)
            for name, values in self.table.columns.items():
                if self.is_held(name):  # of anything but a list, the file has been refused for such a value
                    rows |= is_unusual(values, BY_NAME[name])
            if rows.any():
                given[UNUSUAL] = Source(rows.astype(np.float64), (0,))
        # Estimates of the cost take some depth; `block` gives no design without its own.
        some_depth = {EMBEDMENT[0]: Source(np.array([_SOME_RATIO]))} if self.depth_sought else {}
        plan = DesignPlan(self.lengths, given | some_depth, labels, [case.plan for case in self.cases])
        plan.given = given
        return plan

    def is_held(self, name: str) -> bool:
        """Return whether an input is held to its usual range: a value far outside it is not computed."""
        return BY_NAME[name].held and BY_NAME[name].path not in self.allowed

    @property
    def lengths(self) -> tuple[int, ...]:
        """Numbers of values of the axes; of a list of designs, the number of its rows."""
        return tuple(map(len, self.axes)) if self.table is None else (len(self.table),)

    @property
    def n_designs(self) -> int:
        """Number of designs, exact."""
        return math.prod(self.lengths)

    def block(self, start: int, stop: int) -> DesignBlock:
        """Return the designs ``[start, stop)``; nothing outside of them is made.

        Raises
        ------
        IndexError
            The rows are not within the sweep.
        QuestionError
            The depth is to be found.
        """
        self.need_depth()
        return self.plan.block(start, stop)

    def need_depth(self) -> None:
        """Raise QuestionError where the depth is to be found, and say which command finds it."""
        if self.depth_sought:
            raise QuestionError(
                f"{BY_NAME[EMBEDMENT[1]].path} is {TO_BE_FOUND}, and one that is given is needed here. This command "
                f"finds it:\n  {self.need_command}"
            )

    @property
    def need_command(self) -> str:
        """The command that asks ``sweep need`` of this file, with the entries that replaced some of it."""
        if self.path is None:
            return "boulder_sweep.need(sweep)"
        words = ["sweep", "need", str(self.path)]
        for entry in self.overrides:
            words += [] if entry.startswith("--") else ["--set", entry]
        return shlex.join(words)

    def why_none_runs(self) -> str:
        """Return why no design can be computed, by the first one; empty where one can, or the depth is to be found."""
        if self.depth_sought:
            return ""
        for start in range(0, self.n_designs, _AT_ONCE):
            if not self.block(start, min(start + _AT_ONCE, self.n_designs)).reasons.codes.all():
                return ""
        return self.block(0, 1).reasons[0]

    def resolved(self) -> dict[str, Any]:
        """Return everything that decides the results, and the heading, as plain data.

        Defaults are filled in, units are in the names. Two files that mean the same designs, written in other units or
        another layout, give the same. Very long axes and tables are represented by a SHA-256 of their values.
        """
        inputs = self._inputs()
        inputs.setdefault("impact_height_m", IMPACT_HEIGHT_RULE)
        more: dict[str, Any] = {}
        if self.distributions:
            spreads = {name: spread.to_dict() for name, spread in self.distributions.items()}
            more = {"distributions": spreads, "correlation": self.correlation}
        if self.taken_at:
            more = {"taken_at": dict(self.taken_at)}
        if self.cases:
            more["judged_at"] = [
                {"taken_at": dict(case.taken_at), **{name: case._inputs()[name] for name in case.taken_at}}
                for case in self.cases
            ]
        if self.plan.labels:
            more["labels"] = {name: _texts_listed(label) for name, label in self.plan.labels.items()}
        if self.partial_factor != 1.0:
            more["partial_factor"] = {"friction_angle": self.partial_factor}
        if self.derived:
            more["derived"] = self.derived
        if self.table is not None and self.allowed:
            more[ALLOW_UNUSUAL] = list(self.allowed)
        ground = self.model.ground
        return {
            "name": self.name,
            "n_designs": self.n_designs,
            "order": "table" if self.table is not None else [axis.name for axis in self.axes],
            "inputs": inputs,
            **more,
            "criterion": asdict(self.criterion),
            "model": {
                "preset": self.model.preset,
                "readings": asdict(self.model.readings),
                "soil": self.model.soil_elements or CLOSED_FORM,
                "calibrated_crush_m": self.model.calibrated_crush_m,
                "resistance": self.model.resistance,
                "foot": self.model.foot,
                **({"rock_assumed": True} if self.model.rock_assumed else {}),
                **({} if self.model.shape.is_box else {"profile": [asdict(one) for one in self.model.shape.points]}),
                **({} if self.model.scan is None else {"scan": asdict(self.model.scan)}),
                **({} if ground.is_usual else {"ground": asdict(ground)}),
                **({"second_opinion": list(opinions)} if (opinions := self.model.second_opinion) else {}),
            },
            "solver": asdict(self.solver),
            **({SECTION: given} if (given := self.heading.given()) else {}),
            **({UNITS: self.units} if self.units != SYSTEMS[0] else {}),
        }

    @cached_property
    def fills(self) -> np.ndarray:
        """Shares of the boxes of their sides that boulders fill by their mass: of a list each, else the ends."""
        values = self.values
        if BOULDER_MASS not in values:
            return np.ones(1)
        names = (BOULDER_MASS, "boulder_density_kg_m3", *SIDES)
        with_mass = (group for group in self.groups if len(group) > 1 and BOULDER_MASS in group)
        listed = next(with_mass, {}) if self.table is None else self.table.columns
        if all(name in listed or len(values[name]) == 1 for name in names):
            mass, rock, *sides = (values[name] for name in names)
            return np.asarray(mass / (rock * np.prod(np.broadcast_arrays(*sides), axis=0)))
        ends = [(float(values[name].min()), float(values[name].max())) for name in names]
        return np.array([ends[0][i] / math.prod(end[1 - i] for end in ends[1:]) for i in range(2)])

    @property
    def is_taped(self) -> bool:
        """Whether a family of shapes stands for some boulder, see `boulder_sweep.stones.taped`."""
        return self.model.shape.is_box and self.fills.min() < LEAST_SOLIDITY

    def _inputs(self) -> dict[str, Any]:
        """Return the values of the inputs by column name, lists where they vary."""
        varying = {
            name: _or_hash(values.tolist(), np.ascontiguousarray(values, dtype="<f8").tobytes())
            for group in self.groups
            for name, values in group.items()
        }
        sought = {EMBEDMENT[1]: TO_BE_FOUND} if self.depth_sought else {}
        given = self.constants | sought | varying
        return {entry.name: given[entry.name] for entry in INPUTS if entry.name in given}


def units_in(settings: dict[str, Any]) -> str:
    """Return `Sweep.units` by what `Sweep.resolved` returned."""
    return str(settings.get(UNITS, SYSTEMS[0]))


def allowed_in(settings: dict[str, Any]) -> tuple[str, ...]:
    """Return `Sweep.allowed` by what `Sweep.resolved` returned; of a grid every value has been allowed."""
    return tuple(settings.get(ALLOW_UNUSUAL, ())) if settings["order"] == "table" else HELD


def _texts_listed(label: Label) -> Any:
    """Return the texts of a label as a list; see `_or_hash`."""
    texts = [label.words[code] for code in label.codes]
    return _or_hash(texts, "\x00".join(texts).encode(errors="surrogatepass"))


def _or_hash(values: list[Any], data: bytes) -> Any:
    """Return values, or their number, ends and hash where there are very many."""
    if len(values) <= MAX_LISTED:
        return values
    digest = hashlib.sha256(data).hexdigest()
    return {"count": len(values), "first": values[0], "last": values[-1], "sha256": digest}


def derived_words(derived: dict[str, Any], units: str = "si") -> list[str]:
    """Return how inputs were worked out, a line each, by `Sweep.derived`."""
    lines = []
    for key, path, words in (("soil", "soil", soil_words), (APPROACH, "vehicle.speed", approach_words)):
        for data in derived.get(key, []):
            of_set = f" ({data['name']})" if "name" in data else ""
            lines.append(f"{path}{of_set}: {words(data, units)}")
    return lines
