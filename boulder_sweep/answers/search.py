"""The least place of a lattice from which on something holds, for many rows at once: scan, then bisection.

A row is scanned at some places spread over its range; between neighbours that differ, the change is bisected down to
two adjacent places of the lattice. All rows and all changes go through a bisection together, so that every call of the
predicate has many designs to simulate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

FAILS, HOLDS, BEYOND = range(3)
"""What the predicate may say: it does not hold, it holds, or there is nothing to try at that place."""
FOUND, ALWAYS, NEVER, NOT_MONOTONE, BLOCKED = range(5)
"""What was found in a row, codes of `WORDS`."""
WORDS = ("found", "always", "never", "not_monotone", "blocked_by_overlap")
CELLS = 16
"""Pieces that a range is cut into by the scan."""

Predicate = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Rows and places, each of shape (m,), to `FAILS`, `HOLDS` or `BEYOND`, shape (m,)."""


@dataclass(frozen=True, eq=False)
class Search:
    """What was found in n rows. Places are whole numbers, -1 stands in for a place that there is not.

    Attributes
    ----------
    kind : ndarray of int8, shape (n,)
        Code of `WORDS`.
    fails, holds : ndarray of int64, shape (n,)
        Adjacent places between which it begins to hold; meaningless where `has_fails`, `has_holds` say so.
    has_fails, has_holds : ndarray of bool, shape (n,)
        Whether there is such a place.
    shown : ndarray of int64, shape (n,)
        The place that stands for the row: `holds`, or the last place that could be tried.
    changes : dict of int to list of (int, int, bool)
        By row, for rows that are not monotone: adjacent places at which it changes, in the order of the search, and
        whether it holds from there on.
    """

    kind: np.ndarray
    fails: np.ndarray
    holds: np.ndarray
    has_fails: np.ndarray
    has_holds: np.ndarray
    shown: np.ndarray
    changes: dict[int, list[tuple[int, int, bool]]]


def search(predicate: Predicate, first: np.ndarray, last: np.ndarray, cells: int = CELLS) -> Search:
    """Search n rows.

    Parameters
    ----------
    predicate
        Says what holds where.
    first, last : ndarray of int64, shape (n,)
        Ends of the range of every row, in the order of the search: `last` may be less than `first`.
    cells
        Pieces that a range is cut into. A stretch shorter than a piece, between two that are alike, is not seen.

    Returns
    -------
    Search
        One answer a row, the first place in the order of the search from which on it holds.
    """
    n = len(first)
    share = np.arange(cells + 1) / cells
    places = first[:, None] + np.rint((last - first)[:, None] * share).astype(np.int64)
    rows = np.arange(n)
    codes = predicate(np.repeat(rows, cells + 1), places.ravel()).reshape(n, cells + 1)
    _try_last_before_beyond(predicate, places, codes)

    holds, beyond = codes == HOLDS, codes == BEYOND
    none, at = ~holds.any(axis=1), holds.argmax(axis=1)
    column = np.arange(cells + 1)
    # From the first place where it holds it must hold at every further one that can be tried.
    broken = ((column > at[:, None]) & ~holds & ~beyond).any(axis=1) & ~none
    kind = np.where(none, NEVER, np.where(at == 0, ALWAYS, FOUND)).astype(np.int8)
    ends_beyond = beyond[:, -1] if n else np.zeros(0, dtype=bool)
    kind[none & ends_beyond] = BLOCKED
    kind[broken] = NOT_MONOTONE

    last_tried = cells - (~beyond[:, ::-1]).argmax(axis=1)
    shown = places[rows, np.where(none, last_tried, at)]
    edge_rows, edge_columns = _edges(codes, kind, at)
    low, high = places[edge_rows, edge_columns], places[edge_rows, edge_columns + 1]
    rises = codes[edge_rows, edge_columns + 1] == HOLDS
    low, high = _bisected(predicate, edge_rows, low, high, rises)

    fails, held = shown.copy(), shown.copy()
    has_fails = none.copy()
    begins = rises & (edge_columns + 1 == at[edge_rows])
    fails[edge_rows[begins]], held[edge_rows[begins]] = low[begins], high[begins]
    has_fails[edge_rows[begins]] = True
    shown = np.where(none, shown, held)
    changes: dict[int, list[tuple[int, int, bool]]] = {}
    for place in np.flatnonzero(kind[edge_rows] == NOT_MONOTONE):
        change = (int(low[place]), int(high[place]), bool(rises[place]))
        changes.setdefault(int(edge_rows[place]), []).append(change)
    for row in np.flatnonzero(kind == NOT_MONOTONE):
        changes.setdefault(int(row), [])
    return Search(kind, fails, held, has_fails, ~none, shown, changes)


def _try_last_before_beyond(predicate: Predicate, places: np.ndarray, codes: np.ndarray) -> None:
    """Try the very last place of rows in which it holds nowhere and that end where nothing can be tried.

    What holds may hold between the last place scanned and that end only: then it is put in place of the first one
    beyond, in `places` and `codes`.
    """
    ends = (codes[:, :-1] == FAILS) & (codes[:, 1:] == BEYOND)
    rows = np.flatnonzero(ends.any(axis=1) & ~(codes == HOLDS).any(axis=1))
    if not len(rows):
        return
    at = ends.shape[1] - 1 - ends[rows, ::-1].argmax(axis=1)
    low, high = places[rows, at].copy(), places[rows, at + 1].copy()
    low_code = codes[rows, at].copy()
    while (open_ := np.abs(high - low) > 1).any():
        middle = low + (high - low) // 2
        found = predicate(rows[open_], middle[open_])
        reached = np.zeros(len(rows), dtype=bool)
        reached[open_] = found != BEYOND
        low_code[reached] = found[found != BEYOND]
        low = np.where(reached, middle, low)
        high = np.where(open_ & ~reached, middle, high)
    places[rows, at + 1] = np.where(low_code == HOLDS, low, places[rows, at + 1])
    codes[rows, at + 1] = np.where(low_code == HOLDS, HOLDS, BEYOND)
    places[rows, at] = np.where(low_code == HOLDS, places[rows, at], low)


def _edges(codes: np.ndarray, kind: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the changes to be located: the first, and all of rows that are not monotone."""
    holds = codes == HOLDS
    change = holds[:, :-1] != holds[:, 1:]
    column = np.arange(change.shape[1])
    wanted = (column + 1 == at[:, None]) | (kind == NOT_MONOTONE)[:, None]
    rows, columns = np.nonzero(change & wanted)
    return rows, columns


def _bisected(
    predicate: Predicate, rows: np.ndarray, low: np.ndarray, high: np.ndarray, rises: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Narrow changes down to adjacent places; it holds behind a change that rises, before one that does not."""
    low, high = low.copy(), high.copy()
    while (open_ := np.abs(high - low) > 1).any():
        middle = low + (high - low) // 2
        behind = np.zeros(len(rows), dtype=bool)
        behind[open_] = (predicate(rows[open_], middle[open_]) == HOLDS) == rises[open_]
        high = np.where(open_ & behind, middle, high)
        low = np.where(open_ & ~behind, middle, low)
    return low, high
