"""Find the first lattice position from which a predicate holds, for many rows at once: scan, then bisection.

Each row is scanned at a few positions spread over its range; where neighbours differ, the change is bisected down to
two adjacent lattice positions. All rows and changes are bisected together, so that every call of the predicate has many
designs to simulate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

FAILS, HOLDS, BEYOND, FAR = range(4)
"""Values of the predicate: it fails, it holds, there is nothing to try at this position, or it is far from holding."""
FOUND, ALWAYS, NEVER, NOT_MONOTONE, BLOCKED, UNKNOWN, FAULTY = range(7)
"""Kinds of result, codes of `WORDS`; a search gives all but the last two: designs that stay undecided, or in error."""
WORDS = ("found", "always", "never", "not_monotone", "blocked_by_overlap", "undecided", "error")
CELLS = 16
"""Number of cells into which the scan divides a range."""
STRIDE = 4
"""Cells that the scan takes as one at first. Nothing is tried between two positions that are far from holding."""

Predicate = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Maps rows and positions, shape (m,), to `FAILS`, `HOLDS`, `BEYOND` or `FAR`, shape (m,)."""


@dataclass(frozen=True, eq=False)
class Search:
    """Results of n rows. Positions are whole numbers; -1 means no such position.

    Attributes
    ----------
    kind : ndarray of int8, shape (n,)
        Code of `WORDS`.
    fails, holds : ndarray of int64, shape (n,)
        Adjacent positions between which it begins to hold; meaningless where `has_fails`, `has_holds` say so.
    has_fails, has_holds : ndarray of bool, shape (n,)
        Whether there is such a position.
    shown : ndarray of int64, shape (n,)
        The position shown for the row: `holds`, or the last position that could be tried.
    holds_last : ndarray of bool, shape (n,)
        Whether it holds at the last position that can be tried.
    changes : dict of int to list of (int, int, bool)
        For each row that is not monotone: adjacent positions where it changes, in search order, and whether it holds
        beyond.
    """

    kind: np.ndarray
    fails: np.ndarray
    holds: np.ndarray
    has_fails: np.ndarray
    has_holds: np.ndarray
    shown: np.ndarray
    holds_last: np.ndarray
    changes: dict[int, list[tuple[int, int, bool]]]


PER_ROW = ("kind", "fails", "holds", "has_fails", "has_holds", "shown", "holds_last")
"""Attributes of a `Search` that have a value for each row."""


def search(
    predicate: Predicate,
    first: np.ndarray,
    last: np.ndarray,
    cells: int = CELLS,
    closer: Predicate | None = None,
    between: Predicate | None = None,
) -> Search:
    """Search n rows.

    Parameters
    ----------
    predicate
        Evaluated at rows and positions.
    first, last : ndarray of int64, shape (n,)
        Ends of the range of every row, in search order; `last` may be less than `first`.
    cells
        Pieces that a range is cut into. An interval shorter than a cell may be missed, and so may one between two
        positions that are far from holding and at most `STRIDE` cells apart.
    closer
        Predicate by which changes are located, nearly the same; the same by default.
    between
        Predicate that is asked between two positions of the scan that hold, which may only hold more often; the same
        by default.

    Returns
    -------
    Search
        One result for each row: the first position, in search order, from which the predicate holds.
    """
    n = len(first)
    share = np.arange(cells + 1) / cells
    positions = first[:, None] + np.rint((last - first)[:, None] * share).astype(np.int64)
    rows = np.arange(n)
    codes = _scan_positions(predicate, between or predicate, positions)
    _try_last_before_beyond(predicate, positions, codes)

    holds, beyond = codes == HOLDS, codes == BEYOND
    none, at = ~holds.any(axis=1), holds.argmax(axis=1)
    column = np.arange(cells + 1)
    # From the first position where it holds, it must hold at all further positions that can be tried.
    broken = ((column > at[:, None]) & ~holds & ~beyond).any(axis=1) & ~none
    kind = np.where(none, NEVER, np.where(at == 0, ALWAYS, FOUND)).astype(np.int8)
    ends_beyond = beyond[:, -1] if n else np.zeros(0, dtype=bool)
    kind[none & ends_beyond] = BLOCKED
    kind[broken] = NOT_MONOTONE

    last_tried = cells - (~beyond[:, ::-1]).argmax(axis=1)
    shown = positions[rows, np.where(none, last_tried, at)]
    edge_rows, edge_columns = _edges(codes, kind, at)
    low, high = positions[edge_rows, edge_columns], positions[edge_rows, edge_columns + 1]
    rises = codes[edge_rows, edge_columns + 1] == HOLDS
    low, high = _bisect_changes(closer or predicate, edge_rows, low, high, rises)

    fails, held = shown.copy(), shown.copy()
    has_fails = none.copy()
    begins = rises & (edge_columns + 1 == at[edge_rows])
    fails[edge_rows[begins]], held[edge_rows[begins]] = low[begins], high[begins]
    has_fails[edge_rows[begins]] = True
    shown = np.where(none, shown, held)
    changes: dict[int, list[tuple[int, int, bool]]] = {}
    for k in np.flatnonzero(kind[edge_rows] == NOT_MONOTONE):
        change = (int(low[k]), int(high[k]), bool(rises[k]))
        changes.setdefault(int(edge_rows[k]), []).append(change)
    for row in np.flatnonzero(kind == NOT_MONOTONE):
        changes.setdefault(int(row), [])
    return Search(kind, fails, held, has_fails, ~none, shown, holds[rows, last_tried], changes)


def steady(result: Search) -> Search:
    """Return a search whose answers hold at all further positions that can be tried.

    Rows that are not monotone begin to hold for good where they rise last. Those that do not hold at the last position
    have no answer; shown is where the last stretch that holds ends.
    """
    fails, holds, shown = result.fails.copy(), result.holds.copy(), result.shown.copy()
    has_fails, has_holds = result.has_fails.copy(), result.has_holds.copy()
    for row, changes in result.changes.items():
        rising = bool(result.holds_last[row])
        before, behind, _ = next(change for change in reversed(changes) if change[2] == rising)
        fails[row], holds[row], shown[row] = (before, behind, behind) if rising else (behind, before, behind)
        has_fails[row], has_holds[row] = True, rising
    return replace(result, fails=fails, holds=holds, has_fails=has_fails, has_holds=has_holds, shown=shown)


def shorter(one: Search, other: Search, last: np.ndarray) -> Search:
    """Return, of two searches made `steady`, for each row the one that holds over less of its range.

    Parameters
    ----------
    one, other
        Searches of the same n rows; where both hold over as much, `one` counts.
    last : ndarray of int64, shape (n,)
        End of the range of every row, in search order.
    """
    left = [np.where(each.has_holds, np.abs(last - each.holds), -1) for each in (one, other)]
    rows = np.flatnonzero(left[1] < left[0])
    changes = {k: other.changes[row] for k, row in enumerate(rows.tolist()) if row in other.changes}
    return _replace_rows(one, rows, Search(**{name: getattr(other, name)[rows] for name in PER_ROW}, changes=changes))


def settled(predicate: Predicate, result: Search, first: np.ndarray, last: np.ndarray) -> Search:
    """Return a search by a predicate that is nearly the one it was made by: changes found once are moved a little.

    From where it was found to hold, the predicate is tried 1, 2, 4, 8 and so on further, forward until it holds or
    backward until it fails. A row in which that leads to an end of its range is left as it is.

    Parameters
    ----------
    predicate, first, last
        See `search`.
    result
        The search.
    """
    rows = np.flatnonzero(result.kind == FOUND)
    low, high = result.fails[rows].copy(), result.holds[rows].copy()
    onward = np.sign(high - low)
    ends = np.minimum(first, last)[rows], np.maximum(first, last)[rows]
    held = predicate(rows, high) == HOLDS
    low = np.where(held, low, high)
    at, direction = high.copy(), np.where(held, -onward, onward)
    inside, open_, moved, reach = np.ones(len(rows), dtype=bool), np.ones(len(rows), dtype=bool), 0, 1
    while open_.any():
        at[open_] += (direction * reach)[open_]
        inside &= (at >= ends[0]) & (at <= ends[1])
        open_ &= inside
        holds = np.zeros(len(rows), dtype=bool)
        holds[open_] = predicate(rows[open_], at[open_]) == HOLDS
        high = np.where(open_ & holds, at, high)
        low = np.where(open_ & ~holds, at, low)
        open_ &= holds == held
        moved += reach
        reach = moved
    rows, low, high = rows[inside], low[inside], high[inside]
    low, high = _bisect_changes(predicate, rows, low, high, np.ones(len(rows), dtype=bool))
    fails, held_at, shown = result.fails.copy(), result.holds.copy(), result.shown.copy()
    fails[rows], held_at[rows], shown[rows] = low, high, high
    return replace(result, fails=fails, holds=held_at, shown=shown)


def searched_again(
    predicate: Predicate, result: Search, rows: np.ndarray, first: np.ndarray, last: np.ndarray, cells: int = CELLS
) -> Search:
    """Return a search in which some of the rows are searched again, by another predicate; arguments: see `search`."""
    if not len(rows):
        return result
    part = search(lambda index, positions: predicate(rows[index], positions), first[rows], last[rows], cells)
    return _replace_rows(result, rows, part)


def _replace_rows(result: Search, rows: np.ndarray, part: Search) -> Search:
    """Return a search in which another replaces some rows."""
    arrays = {}
    for name in PER_ROW:
        arrays[name] = getattr(result, name).copy()
        arrays[name][rows] = getattr(part, name)
    again = set(rows.tolist())
    changes = {row: edges for row, edges in result.changes.items() if row not in again}
    changes |= {int(rows[row]): edges for row, edges in part.changes.items()}
    return Search(**arrays, changes=changes)


def _scan_positions(predicate: Predicate, between: Predicate, positions: np.ndarray) -> np.ndarray:
    """Return `FAILS`, `HOLDS` or `BEYOND` for some positions of n rows, shape (n, cells + 1)."""
    n, cells = positions.shape[0], positions.shape[1] - 1
    stride = math.gcd(cells, STRIDE)
    codes = np.full(positions.shape, FAR, dtype=np.int64)
    first = np.arange(0, cells + 1, stride)
    codes[:, first] = predicate(np.repeat(np.arange(n), len(first)), positions[:, first].ravel()).reshape(n, len(first))
    while stride > 1:
        rows, pieces = np.nonzero((codes[:, :-1:stride] != FAR) | (codes[:, stride::stride] != FAR))
        middle = pieces * stride + stride // 2
        hold = (codes[rows, pieces * stride] == HOLDS) & (codes[rows, (pieces + 1) * stride] == HOLDS)
        for asked, some in ((predicate, ~hold), (between, hold)):
            codes[rows[some], middle[some]] = asked(rows[some], positions[rows[some], middle[some]])
        stride //= 2
    return _plain(codes)


def _plain(codes: np.ndarray) -> np.ndarray:
    """Return codes with `FAR` as `FAILS`."""
    return np.where(codes == FAR, FAILS, codes)


def _try_last_before_beyond(predicate: Predicate, positions: np.ndarray, codes: np.ndarray) -> None:
    """Locate the last position that can be tried in rows that end where nothing can, and in which nothing holds so far.

    The predicate may hold only between the last position scanned and that end; such a position replaces the first one
    beyond the end in `positions` and `codes`.
    """
    ends = (codes[:, :-1] == FAILS) & (codes[:, 1:] == BEYOND)
    rows = np.flatnonzero(ends.any(axis=1) & ~(codes == HOLDS).any(axis=1))
    if not len(rows):
        return
    at = ends.shape[1] - 1 - ends[rows, ::-1].argmax(axis=1)
    low, high = positions[rows, at].copy(), positions[rows, at + 1].copy()
    low_code = codes[rows, at].copy()
    while (open_ := np.abs(high - low) > 1).any():
        middle = low + (high - low) // 2
        middle_code = _plain(predicate(rows[open_], middle[open_]))
        reached = np.zeros(len(rows), dtype=bool)
        reached[open_] = middle_code != BEYOND
        low_code[reached] = middle_code[middle_code != BEYOND]
        low = np.where(reached, middle, low)
        high = np.where(open_ & ~reached, middle, high)
    positions[rows, at + 1] = np.where(low_code == HOLDS, low, positions[rows, at + 1])
    codes[rows, at + 1] = np.where(low_code == HOLDS, HOLDS, BEYOND)
    positions[rows, at] = np.where(low_code == HOLDS, positions[rows, at], low)


def _edges(codes: np.ndarray, kind: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the changes to locate: the first, and all in rows that are not monotone."""
    holds = codes == HOLDS
    change = holds[:, :-1] != holds[:, 1:]
    column = np.arange(change.shape[1])
    wanted = (column + 1 == at[:, None]) | (kind == NOT_MONOTONE)[:, None]
    rows, columns = np.nonzero(change & wanted)
    return rows, columns


def _bisect_changes(
    predicate: Predicate, rows: np.ndarray, low: np.ndarray, high: np.ndarray, rises: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bisect changes down to adjacent positions; the predicate holds above a rising change and below a falling one."""
    low, high = low.copy(), high.copy()
    while (open_ := np.abs(high - low) > 1).any():
        middle = low + (high - low) // 2
        behind = np.zeros(len(rows), dtype=bool)
        behind[open_] = (predicate(rows[open_], middle[open_]) == HOLDS) == rises[open_]
        high = np.where(open_ & behind, middle, high)
        low = np.where(open_ & ~behind, middle, low)
    return low, high
