"""A table of designs in pieces, and the few rows of it that a picture needs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.columns import OPTIONAL_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

    from boulder_sweep.store.reader import FinishedRows

RATIO = "embedment_ratio"
DEPTH, HEIGHT = "embedment_depth_m", "boulder_height_m"
VERDICT, REASON, VALIDITY, ROBUSTNESS = "verdict", "reason", "validity", "robustness"
MOST_KEPT = 2_000_000
"""Most rows kept: a dozen maps with as many cells as a map may have. Of more, only rows that differ in the picture."""
_RASTER = 500
"""Distinct positions along an axis of a map; more than it has pixels."""

Pieces = Callable[[Sequence[str]], Iterable["pd.DataFrame"]]
"""Yields the named columns of a table, `RATIO` among them, piece by piece; further columns may come along, and those
of `boulder_sweep.columns.OPTIONAL_COLUMNS`, `VALIDITY` and `ROBUSTNESS` are left out where the table does not have
them."""


def pieces_of(table: pd.DataFrame | Pieces) -> Pieces:
    """Return a table in memory as a single piece, and a source of pieces unchanged."""
    if callable(table):
        return table
    whole = table.assign(**{RATIO: table[DEPTH] / table[HEIGHT]})
    return lambda columns: [whole]


def with_places(pieces: Pieces, sets: Mapping[str, Sequence[str]]) -> Pieces:
    """Return a table whose columns of names hold the place of each name instead."""
    if not sets:
        return pieces
    places = {column: {name: float(place) for place, name in enumerate(names)} for column, names in sets.items()}

    def placed(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        for piece in pieces(columns):
            own = {name: piece[name].astype(str).map(places[name]).astype(float) for name in places if name in piece}
            yield piece.assign(**own)

    return placed


def finished_pieces(finished: FinishedRows) -> Pieces:
    """Return a source of pieces of the finished rows of a result.

    Parameters
    ----------
    finished
        The rows; the first time they are compared with their checksums.
    """
    verified = False

    def pieces(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        nonlocal verified
        held = set(finished.columns) - finished.lacking
        there = [name for name in columns if name in held or name not in (*OPTIONAL_COLUMNS, VALIDITY, ROBUSTNESS)]
        stored = list(dict.fromkeys(own for name in there for own in ((DEPTH, HEIGHT) if name == RATIO else (name,))))
        for table in finished.tables(stored, verify=not verified):
            frame = table.to_pandas()
            yield frame.assign(**{RATIO: frame[DEPTH] / frame[HEIGHT]}) if RATIO in columns else frame
        verified = True

    return pieces


class Kept:
    """The rows that a picture shows, collected piece by piece.

    Parameters
    ----------
    across, up
        Inputs on the axes.
    over
        Inputs over small multiples; None where there is none.
    levels
        Different values of every input, ascending.

    Attributes
    ----------
    count, passing : int
        How many rows there are, and how many of them pass.
    flags : Counter
        How many of these have each flag of the column ``validity``; under ``""`` those without any.
    grades : Counter
        How many of these have each grade of the column ``robustness``.
    thinned : bool
        Whether only rows are left that can be told apart in a picture.
    """

    def __init__(self, across: str, up: str, over: Sequence[str | None], levels: Mapping[str, np.ndarray]):
        self.count = self.passing = 0
        self.flags: Counter[str] = Counter()
        self.grades: Counter[str] = Counter()
        self.thinned = False
        self._ends = {
            name: (levels[name].min(initial=np.inf), levels[name].max(initial=-np.inf)) for name in (across, up)
        }
        self._over = [name for name in over if name is not None]
        self.columns = list(dict.fromkeys([across, up, *self._over, VERDICT, REASON, VALIDITY, ROBUSTNESS]))
        self._parts: list[pd.DataFrame] = []
        self._held = 0

    def add(self, rows: pd.DataFrame) -> None:
        """Add rows."""
        self.count += len(rows)
        if VERDICT in rows:
            passes = rows[VERDICT] == "pass"
            self.passing += int(passes.sum())
            if VALIDITY in rows:
                for words, count in rows.loc[passes, VALIDITY].astype(str).value_counts().items():
                    self.flags.update(dict.fromkeys(str(words).split(";"), int(count)))
            if ROBUSTNESS in rows:
                self.grades.update(rows.loc[passes, ROBUSTNESS].dropna().astype(str).tolist())
        if self._held == 0:
            self._parts = [rows]  # also without any rows, for its columns
        elif len(rows):
            self._parts.append(rows)
        self._held += len(rows)
        if self._held > MOST_KEPT:
            self._thin()

    def rows(self) -> pd.DataFrame:
        """Return the rows, in the order of the table."""
        import pandas as pd

        if len(self._parts) != 1:
            self._parts = [pd.concat(self._parts, ignore_index=True)]
        return self._parts[0]

    def _thin(self) -> None:
        """Of several rows at the same position, keep the one that would be drawn last."""
        rows = self.rows()
        places = rows[self._over].copy()
        for name, (least, most) in self._ends.items():
            share = (rows[name].to_numpy(dtype=float) - least) / max(most - least, 1e-300)
            places[name] = np.round(share * _RASTER).astype(np.int32)
        self._parts = [rows[~places.duplicated(keep="last").to_numpy()]]
        self._held = len(self._parts[0])
        self.thinned = True
