"""The verdict map of a grid, simulated only near the places where the verdict changes.

The longest axis of the grid is cut into lines. Along a line, designs begin to pass at some place. That place is located
on a few lines spread over the grid and interpolated for all others. Every design closer to the interpolated place than
the interpolation error is simulated; where a result contradicts the interpolation, its neighbours are simulated too,
until none does. Then the last design of every line that fails and the first that passes are simulated where that was
not done, until every change lies between two simulated designs. All other verdicts follow. A patch of different
verdicts beside which nothing was simulated, or such a second change along a line, is missed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np

from boulder_sweep.answers.draws import threads
from boulder_sweep.answers.trials import Judges, judges_of
from boulder_sweep.columns import INPUT_COLUMNS, REASONS, VERDICTS
from boulder_sweep.designs import block_of
from boulder_sweep.drawing import draw
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.judged import FAIL, HORIZON, NO_CONTACT, NUMERICAL_ERROR, OVERRIDE, PASS, UNDECIDED
from boulder_sweep.locations import Location
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings.fields import EMBEDMENT

if TYPE_CHECKING:
    import pandas as pd

    from boulder_sweep.settings import Sweep

MOST_CELLS = 20_000_000
AT_ONCE = 2048
MAP = "boulder_sweep.boundary"
"""Name of the file's writer in its metadata."""
WORSE_UPWARDS = ("impact_speed_m_s", "vehicle_mass_kg", "impact_height_m")
"""Inputs for which small values pass."""
UNKNOWN = -1
FINENESS = 16
"""A change is located to this fraction of the spacing of the axis."""
MOST_SPREAD = 4
"""Number of values of each other axis whose lines have their change located."""
LEAST_DOUBT = 0.2
"""Smallest distance from an interpolated change, in spacings of the axis, within which designs are simulated."""
BOUND_DOUBT = 0.05
"""Extra distance next to lines where all or none pass, as a share of their length."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """The map of a grid. Made by `boundary`.

    Attributes
    ----------
    sweep : Sweep
        The grid.
    verdict : ndarray of int8, shape (n,)
        Code of the verdict of every design, in the order of the grid.
    reason : ndarray of int8, shape (n,)
        Code of its reason; for designs that were not simulated, that of the nearest one along the line.
    simulated : ndarray of bool, shape (n,)
        Whether the design was simulated; the others are inferred from their neighbours.
    simulations : int
        Designs simulated, including those between the values of the axis.
    """

    sweep: Sweep
    verdict: np.ndarray
    reason: np.ndarray
    simulated: np.ndarray
    simulations: int

    @property
    def share(self) -> float:
        """Simulations as a share of those of the whole grid."""
        return self.simulations / len(self.verdict)

    def counts(self) -> dict[str, int]:
        """Return the number of designs of each verdict."""
        counts = np.bincount(self.verdict, minlength=len(VERDICTS))
        return {verdict: int(count) for verdict, count in zip(VERDICTS, counts, strict=True)}

    @property
    def frame(self) -> pd.DataFrame:
        """Inputs, verdict and reason of every design, and whether it was simulated."""
        import pandas as pd

        block = self.sweep.block(0, self.sweep.n_designs)
        columns: dict[str, Any] = {"design_id": block.design_id()}
        columns |= {name: column.to_numpy() for name, column in block.columns.items()}
        for name, label in block.labels.items():
            columns[name] = pd.Categorical.from_codes(label.codes, list(label.words))
        columns["verdict"] = pd.Categorical.from_codes(self.verdict, list(VERDICTS))
        columns["reason"] = pd.Categorical.from_codes(self.reason, list(REASONS))
        return pd.DataFrame(columns | {"simulated": self.simulated})

    def write(self, path: str | Location) -> Location:
        """Write the map to a Parquet file.

        Raises
        ------
        QuestionError
            It cannot be written.
        """
        import pyarrow as pa

        from boulder_sweep.answers.tables import write_parquet
        from boulder_sweep.store.provenance import file_metadata, identity

        judges = judges_of(self.sweep)
        own = judges.final
        found = identity(self.sweep.resolved(), *own.settings(), judges.accuracy.to_dict())
        table = pa.Table.from_pandas(self.frame, preserve_index=False)
        metadata = (table.schema.metadata or {}) | file_metadata(found, MAP)
        return write_parquet(table.replace_schema_metadata(metadata), path)

    def plot(self, path: str | Path, **shown: Any) -> None:
        """Draw the map as ``sweep plot`` draws a result; keywords as of `boulder_sweep.views.verdict_map`.

        Raises
        ------
        PictureError
            It cannot be drawn.
        """
        sets = {axis.name: axis.labels for axis in self.sweep.axes if axis.labels}
        draw("verdict_map", "draw_verdict_map", self.frame, path, title=self.sweep.name, sets=sets, **shown)


def boundary(sweep: Sweep, *, jobs: int | None = None) -> Boundary:
    """Map which designs of a grid pass by simulating only a few of them.

    Parameters
    ----------
    sweep
        A grid of at most 20 million designs.
    jobs
        Threads; all cores by default. The map does not depend on it.

    Raises
    ------
    QuestionError
        It is a list of designs, has no axis, or is too large.
    """
    sweep.require_values()
    if sweep.table is not None or not sweep.axes:
        raise QuestionError("a map needs a grid with at least one axis")
    if sweep.n_designs > MOST_CELLS:
        raise QuestionError(f"a map of {sweep.n_designs:,} designs is too large; at most {MOST_CELLS:,}")
    # Too little overlap is known from the inputs alone and ends the passing stretch of a line, so it is added last.
    judges = judges_of(replace(sweep, criterion=replace(sweep.criterion, min_overlap_m=0.0)))
    judges.final.warm_up()
    lines = _Lines(sweep, judges, threads(jobs))
    lines.fill()
    return _without_overlap(lines.map())


def _without_overlap(found: Boundary) -> Boundary:
    """Return a map with the designs left undecided whose top barely reaches the bumper."""
    block = found.sweep.block(0, found.sweep.n_designs)
    height, depth, bumper = (
        block.columns[name].to_numpy() for name in ("boulder_height_m", "embedment_depth_m", "bumper_height_m")
    )
    milder = (found.verdict == PASS) | np.isin(found.reason, (HORIZON, NUMERICAL_ERROR))
    slight = milder & (height - depth - bumper < found.sweep.criterion.min_overlap_m)
    return replace(
        found,
        verdict=np.where(slight, UNDECIDED, found.verdict).astype(np.int8),
        reason=np.where(slight, OVERRIDE, found.reason).astype(np.int8),
    )


def read_map(path: str | Path) -> tuple[pd.DataFrame, dict[str, Any], str]:
    """Read a map that `Boundary.write` wrote.

    Returns
    -------
    frame : DataFrame
        One row a design.
    settings : dict
        The resolved settings of the grid.
    judged_by : str
        By whose rules the verdicts were found; empty where by those of this version.

    Raises
    ------
    QuestionError
        The file is no such map, or cannot be read.
    """
    from boulder_sweep.answers.tables import read_parquet

    needed = ("design_id", *INPUT_COLUMNS, "verdict", "reason", "simulated")
    table, identity, judged = read_parquet(path, needed, "sweep boundary", QuestionError)
    return table.replace_schema_metadata(None).to_pandas(), identity["settings"], judged


class _Lines:
    """The lines of a grid along its longest axis, and the place on each where designs begin to pass."""

    def __init__(self, sweep: Sweep, judges: Judges, parallel: Pool) -> None:
        self.sweep, self.judges, self.parallel = sweep, judges, parallel
        self.shape = sweep.plan.lengths
        self.axis = int(np.argmax(self.shape))
        self.length = self.shape[self.axis]
        self.others = tuple(length for axis, length in enumerate(self.shape) if axis != self.axis)
        self.count = math.prod(self.others)
        self.name = sweep.axes[self.axis].name
        self.upwards = self.name not in WORSE_UPWARDS
        block = sweep.block(0, sweep.n_designs)
        if block.reasons.any:
            raise QuestionError("some designs of this grid cannot be computed; a run says which and why")
        height, depth, bumper = (
            block.columns[name].to_numpy() for name in ("boulder_height_m", "embedment_depth_m", "bumper_height_m")
        )
        over = self.by_line(height - depth <= bumper)
        self.verdict = np.where(over, FAIL, UNKNOWN).astype(np.int8)
        self.reason = np.where(over, NO_CONTACT, 0).astype(np.int8)
        self.simulated = np.zeros(over.shape, dtype=bool)
        # A boulder buried deeper and deeper passes until the truck goes over it.
        self.over_is_beyond = self.name in EMBEDMENT
        self.extra = 0
        """Designs simulated between the values of the axis."""

    def by_line(self, values: np.ndarray) -> np.ndarray:
        """Rearrange values of all designs by line and position, from failing to passing."""
        moved = np.moveaxis(values.reshape(self.shape), self.axis, -1).reshape(self.count, self.length)
        return np.ascontiguousarray(moved if self.upwards else moved[:, ::-1])

    def by_number(self, values: np.ndarray) -> np.ndarray:
        """Undo `by_line`."""
        ordered = values if self.upwards else values[:, ::-1]
        return np.moveaxis(ordered.reshape(*self.others, self.length), -1, self.axis).reshape(-1)

    def simulate(self, lines: np.ndarray, places: np.ndarray) -> None:
        """Simulate the designs that have not been simulated yet."""
        new = np.unique(lines * self.length + places)
        new = new[self.verdict.reshape(-1)[new] == UNKNOWN]
        verdict, reason = self.judged(new // self.length, (new % self.length).astype(float))
        self.verdict.reshape(-1)[new], self.reason.reshape(-1)[new] = verdict, reason
        self.simulated.reshape(-1)[new] = True

    def judged(self, lines: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Judge designs at places along lines, which may lie between the values of the axis."""
        pieces = [slice(at, at + AT_ONCE) for at in range(0, len(lines), AT_ONCE)]
        found = list(self.parallel(joblib.delayed(self._piece)(lines[own], places[own]) for own in pieces))
        if not found:
            return np.zeros(0, dtype=np.int8), np.zeros(0, dtype=np.int8)
        return np.concatenate([own[0] for own in found]), np.concatenate([own[1] for own in found])

    def _piece(self, lines: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at: dict[int, np.ndarray] = {}
        if self.others:
            axes = (axis for axis in range(len(self.shape)) if axis != self.axis)
            at = dict(zip(axes, np.unravel_index(lines, self.others), strict=True))
        given = {}
        for name, source in self.sweep.plan.given.items():
            if self.axis in source.axes:
                values = source.to_numpy() if self.upwards else source.to_numpy()[::-1]
                whole = places.astype(np.int64)
                part = places - whole
                next_ = np.minimum(whole + 1, self.length - 1)
                given[name] = np.where(part == 0.0, values[whole], (1.0 - part) * values[whole] + part * values[next_])
            else:
                place = np.zeros(len(lines), dtype=np.int64)
                for axis in source.axes:
                    place = place * self.shape[axis] + at[axis]
                given[name] = source.to_numpy()[place]
        judged = self.judges.final(block_of(given))
        return judged.verdict.astype(np.int8), judged.reason.astype(np.int8)

    def located(self, lines: np.ndarray) -> np.ndarray:
        """Return where designs begin to pass along some lines, to a fraction of the spacing of the axis.

        The result is -1 where all pass and the number of values where none does.
        """
        low, high = np.full(len(lines), -1.0), np.full(len(lines), float(self.length))
        for _ in range(math.ceil(math.log2((self.length + 1) * FINENESS))):
            middle = 0.5 * (low + high)
            whole = high - low > 1.0
            middle = np.where(whole, np.rint(middle), middle)
            inside = (middle >= 0.0) & (middle <= self.length - 1)
            holds = middle > self.length - 1
            on_grid = inside & (middle == np.rint(middle))
            places = middle[on_grid].astype(np.int64)
            self.simulate(lines[on_grid], places)
            holds[on_grid] = self.holds(lines[on_grid], places)
            between = inside & ~on_grid
            verdict, reason = self.judged(lines[between], middle[between])
            self.extra += int(between.sum())
            holds[between] = (verdict == PASS) | (self.over_is_beyond & (reason == NO_CONTACT))
            high, low = np.where(holds, middle, high), np.where(holds, low, middle)
        return 0.5 * (low + high)

    def holds(self, lines: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return whether simulated designs pass, or lie beyond the passing stretch."""
        return self.holding()[lines, places]

    def holding(self) -> np.ndarray:
        """Return whether known designs pass, or lie beyond the passing stretch; false for others."""
        return (self.verdict == PASS) | (self.over_is_beyond & (self.reason == NO_CONTACT))

    def fill(self) -> None:
        """Simulate every design whose verdict cannot be inferred from its neighbours."""
        chosen = [_spread(length) for length in self.others]
        grids = np.meshgrid(*chosen, indexing="ij")
        lines = (
            np.ravel_multi_index([grid.reshape(-1) for grid in grids], self.others) if self.others else np.zeros(1, int)
        )
        at = self.located(lines).reshape([len(own) for own in chosen] or [1])
        begins, doubt = self._interpolated(chosen, at)
        place = np.arange(self.length)
        unknown = self.verdict == UNKNOWN
        told = np.where(unknown, place >= begins[:, None], self.holding())
        near = (np.abs(place - begins[:, None]) < doubt[:, None]) & unknown
        # Where nothing else is left, the pair beside every change of verdict must have been simulated, not inferred.
        while near.any() or (near := _changing(told) & unknown).any():
            self.simulate(*np.nonzero(near))
            unknown = self.verdict == UNKNOWN
            holds = self.holding()
            # Where a simulated design contradicts its inferred verdict, its neighbours on this line and the next are
            # simulated.
            surprise = self.simulated & (holds != told)
            told = np.where(unknown, told, holds)
            near = _beside(surprise.reshape(*self.others, self.length)).reshape(surprise.shape) & unknown
        self.told = told

    def _interpolated(self, chosen: list[np.ndarray], at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where designs begin to pass on every line, and the error of that estimate."""
        smooth, plain = at, at
        # A line where all or none pass gives only a bound, from which its neighbours are poorly interpolated.
        bound = ((at < 0.0) | (at > self.length - 1)).astype(float)
        for axis, own in enumerate(chosen):
            wanted = np.arange(self.others[axis])
            smooth = _along(smooth, axis, own, wanted, smooth=True)
            plain = _along(plain, axis, own, wanted, smooth=False)
            bound = _along(bound, axis, own, wanted, smooth=False)
        partly = (bound > 0.0) & (bound < 1.0)
        doubt = LEAST_DOUBT + 2.0 * np.abs(smooth - plain) + BOUND_DOUBT * self.length * partly
        return smooth.reshape(-1), doubt.reshape(-1)

    def map(self) -> Boundary:
        """Return the map, inferring the verdicts of designs that were not simulated."""
        unknown = self.verdict == UNKNOWN
        verdict = np.where(unknown, np.where(self.told, PASS, FAIL), self.verdict).astype(np.int8)
        failed = self.reason[self.simulated & (self.verdict == FAIL)]
        usual = int(np.bincount(failed).argmax()) if len(failed) else 0
        reason = np.where(unknown & ~self.told, usual, self.reason).astype(np.int8)
        return Boundary(
            self.sweep,
            self.by_number(verdict),
            self.by_number(reason),
            self.by_number(self.simulated),
            int(self.simulated.sum()) + self.extra,
        )


def _spread(length: int) -> np.ndarray:
    """Return some positions of an axis, including both ends."""
    return np.unique(
        np.rint(np.linspace(0, length - 1, min(length, MOST_SPREAD if length > 4 else 3))).astype(np.int64)
    )


def _along(values: np.ndarray, axis: int, known: np.ndarray, wanted: np.ndarray, *, smooth: bool) -> np.ndarray:
    """Interpolate along one axis."""
    from scipy.interpolate import PchipInterpolator, interp1d

    if len(known) == 1:
        return np.repeat(values, len(wanted), axis=axis)
    if smooth and len(known) > 2:
        return PchipInterpolator(known, values, axis=axis)(wanted)
    return interp1d(known, values, axis=axis)(wanted)


def _changing(told: np.ndarray) -> np.ndarray:
    """Return the designs on both sides of every change of verdict along lines, shape (lines, length).

    Before its first design a line counts as failing, after its last as passing, so that a line on which no verdict
    changes has one such design.
    """
    padded = np.pad(told, ((0, 0), (1, 1)), constant_values=((False, False), (False, True)))
    change = padded[:, 1:] != padded[:, :-1]
    return change[:, 1:] | change[:, :-1]


def _beside(cells: np.ndarray) -> np.ndarray:
    """Return cells and their neighbours along every axis."""
    found = cells.copy()
    for axis in range(cells.ndim):
        ahead, behind = [slice(None)] * cells.ndim, [slice(None)] * cells.ndim
        ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
        found[tuple(ahead)] |= cells[tuple(behind)]
        found[tuple(behind)] |= cells[tuple(ahead)]
    return found
