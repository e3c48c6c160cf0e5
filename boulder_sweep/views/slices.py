"""A plane through a table of designs: two inputs across, up to two over small multiples, the rest held fixed.

The table is read in pieces; only the rows that a picture needs are kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.columns import INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import PictureError
from boulder_sweep.settings.fields import BY_NAME as FIELDS
from boulder_sweep.views.wording import RATIO

if TYPE_CHECKING:
    import pandas as pd

    from boulder_sweep.store.reading import FinishedRows


DEPTH, HEIGHT = "embedment_depth_m", "boulder_height_m"
VERDICT, REASON, VALIDITY, ROBUSTNESS = "verdict", "reason", "validity", "robustness"
Pieces = Callable[[Sequence[str]], Iterable["pd.DataFrame"]]
"""Yields the named columns of a table, `RATIO` among them, piece by piece; further columns may come along, and
any of `boulder_sweep.columns.OPTIONAL_COLUMNS` is left out where the table does not have it."""


def pieces_of(table: pd.DataFrame | Pieces) -> Pieces:
    """Return a table in memory as a single piece, and a source of pieces unchanged."""
    if callable(table):
        return table
    whole = table.assign(**{RATIO: table[DEPTH] / table[HEIGHT]})
    return lambda columns: [whole]


def with_positions(pieces: Pieces, sets: Mapping[str, Sequence[str]]) -> Pieces:
    """Return a table whose columns of names hold the position of each name in its list instead."""
    if not sets:
        return pieces
    positions = {
        column: {name: float(position) for position, name in enumerate(names)} for column, names in sets.items()
    }

    def numbered(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        for piece in pieces(columns):
            numbers = {
                name: piece[name].astype(str).map(positions[name]).astype(float) for name in positions if name in piece
            }
            yield piece.assign(**numbers)

    return numbered


def finished_pieces(finished: FinishedRows) -> Pieces:
    """Return a source of pieces of the finished rows of a result, which are first compared with their checksums."""
    verified = False

    def pieces(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        nonlocal verified
        there = [name for name in columns if name in finished.columns or name not in OPTIONAL_COLUMNS]
        stored = list(
            dict.fromkeys(column for name in there for column in ((DEPTH, HEIGHT) if name == RATIO else (name,)))
        )
        for table in finished.tables(stored, verify=not verified):
            frame = table.to_pandas()
            yield frame.assign(**{RATIO: frame[DEPTH] / frame[HEIGHT]}) if RATIO in columns else frame
        verified = True

    return pieces


ACROSS = (RATIO, DEPTH, "boulder_width_m", "boulder_length_m", "impact_speed_m_s")
UP = (HEIGHT, "boulder_width_m", "boulder_length_m", "vehicle_mass_kg")
OVER = ("friction_angle_deg", "subgrade_reaction_MN_m3", "impact_speed_m_s", "boulder_width_m")
"""What is shown across, up and over small multiples, the first of each that varies."""
DEPENDENT = ("impact_height_m",)
"""Follows from other inputs unless a file gives it; held only on request."""
TRIPLET = {RATIO, DEPTH, HEIGHT}
"""Two of them give the third."""
DIGITS = 9
"""Inputs that agree to so many digits are the same value; products of axes differ in their last bits."""
MOST_SETS = 8
"""Most named soils or vehicles side by side."""


@dataclass(frozen=True, eq=False)
class Slice:
    """Rows of one plane.

    Attributes
    ----------
    rows : DataFrame
        The rows shown, with the columns of the table and ``embedment_ratio``.
    across, up : str
        Inputs on the axes of each picture.
    columns, rows_over : str or None
        Inputs over the small multiples.
    column_values, row_values : list of float
        Their values shown; [nan] where there is none.
    fixed : dict of str to float
        Inputs that vary in the table and are held, with their values here.
    constants : dict of str to float
        Inputs that have one value in the whole table.
    total : int
        Number of rows of the table.
    flags : dict of str to int
        Number of passing rows with each flag of the column ``validity``; under ``""`` those without any.
    grades : dict of str to int
        Number of passing rows with each grade of the column ``robustness``; empty for a table without it.
    left_out : dict of str to int
        Inputs of which only some values are shown, each with the number of its values.
    sets : dict of str to sequence of str
        Named soils or vehicles; their values here are positions in these lists.
    """

    rows: pd.DataFrame
    across: str
    up: str
    columns: str | None
    rows_over: str | None
    column_values: list[float]
    row_values: list[float]
    fixed: dict[str, float]
    constants: dict[str, float]
    total: int
    flags: Mapping[str, int] = field(default_factory=dict)
    grades: Mapping[str, int] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)
    sets: Mapping[str, Sequence[str]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of rows in the plane."""
        return len(self.rows)

    @property
    def passing(self) -> int:
        """Number of rows in the plane that pass."""
        return int((self.rows[VERDICT] == "pass").sum()) if VERDICT in self.rows else 0


def plane(
    table: pd.DataFrame | Pieces,
    *,
    across: str | None = None,
    up: str | None = None,
    columns: str | None = None,
    rows: str | None = None,
    at: Mapping[str, float] | None = None,
    most: tuple[int, int] = (4, 3),
    sets: Mapping[str, Sequence[str]] | None = None,
) -> Slice:
    """Choose a plane of a table of designs.

    Parameters
    ----------
    table
        A result table, or its input columns and whatever is to be shown; or a function that yields the columns asked
        for piece by piece, as often as it is called: only the rows of the plane are kept.
    across, up
        Inputs on the axes; by default embedment and height where they vary.
    columns, rows
        Inputs over small multiples; by default subgrade reaction and friction angle where they vary.
    at
        Values at which other inputs are held, by default the middle one of those in the table. The nearest value
        in the table is taken.
    most
        Most columns and rows of small multiples; of more values, evenly spaced ones are shown.
    sets
        Named soils or vehicles: the names by the column that holds them. Each is drawn for itself, up to `MOST_SETS`.

    Raises
    ------
    PictureError
        An input is unknown, is used twice, or cannot be held at a value because it has another one in every design;
        or fewer than two inputs vary.
    """
    import pandas as pd  # heavy; most commands draw no map

    named = dict(sets or {})
    pieces = with_positions(pieces_of(table), named)
    levels, total = _levels_of(pieces, named)
    held = dict(at or {})
    chosen: dict[str, str | None] = {"across": across, "up": up, "columns": columns, "rows": rows}
    _check(levels, [name for name in chosen.values() if name], held)
    varying = _independent(levels, {*filter(None, chosen.values()), *held})
    for role, wanted in (
        ("across", ACROSS),
        ("up", UP),
        ("columns", (*named, *OVER[::-1][2:])),
        ("rows", (*named, *OVER)),
    ):
        free = [name for name in varying if name not in chosen.values() and name not in held]
        if chosen[role] is None:
            candidates = [name for name in wanted if name in free]
            anything = free if role in ("across", "up") else []
            chosen[role] = next(iter([*candidates, *anything]), None)
    if chosen["across"] is None or chosen["up"] is None:
        raise PictureError("a map needs two inputs that vary and are not held at a value; this table has one or none")
    fixed: dict[str, float] = {}
    for name in varying:
        if name in chosen.values():
            continue
        if name in held or not _follows(name, {*filter(None, chosen.values()), *fixed}):
            values = levels[name]
            wanted_value = held.get(name, values[(len(values) - 1) // 2])
            fixed[name] = float(values[np.argmin(np.abs(values - wanted_value))])
    shown_columns, shown_rows = (
        _some(levels, chosen[role], MOST_SETS if chosen[role] in named else n)
        for role, n in (("columns", most[0]), ("rows", most[1]))
    )
    admitted = [(name, [value]) for name, value in fixed.items()]
    multiples = ((chosen["columns"], shown_columns), (chosen["rows"], shown_rows))
    admitted += [(name, values) for name, values in multiples if name is not None]
    asked = [*filter(None, chosen.values()), *fixed, VERDICT, REASON, VALIDITY, ROBUSTNESS]
    kept = []
    for piece in pieces(list(dict.fromkeys(asked))):
        keep = np.ones(len(piece), dtype=bool)
        for name, shown in admitted:
            column = piece[name].to_numpy(dtype=float)
            keep &= np.logical_or.reduce([_equal(column, value) for value in shown])
        kept.append(piece[keep])
    found = pd.concat(kept, ignore_index=True)
    passes = found[found[VERDICT] == "pass"] if VERDICT in found else found[:0]
    flags: Counter[str] = Counter()
    for words, count in passes[VALIDITY].astype(str).value_counts().items() if VALIDITY in passes else ():
        flags.update(dict.fromkeys(str(words).split(";"), int(count)))
    grades = Counter(passes[ROBUSTNESS].dropna().astype(str)) if ROBUSTNESS in passes else Counter[str]()
    left_out = {
        str(chosen[role]): len(levels[str(chosen[role])])
        for role, shown in (("columns", shown_columns), ("rows", shown_rows))
        if chosen[role] and len(shown) < len(levels[str(chosen[role])])
    }
    return Slice(
        rows=found,
        across=str(chosen["across"]),
        up=str(chosen["up"]),
        columns=chosen["columns"],
        rows_over=chosen["rows"],
        column_values=shown_columns,
        row_values=shown_rows,
        fixed=fixed,
        constants={name: float(values[0]) for name, values in levels.items() if len(values) == 1},
        total=total,
        flags=dict(flags),
        grades=dict(grades),
        left_out=left_out,
        sets=named,
    )


def _check(levels: Mapping[str, np.ndarray], chosen: Sequence[str], held: Mapping[str, float]) -> None:
    """Refuse inputs that do not exist or are used twice, and values that no design has."""
    named = [*chosen, *held]
    for name in named:
        if name not in levels:
            raise PictureError(f"{name} is not an input column; there are {', '.join(levels)}")
        if named.count(name) > 1:
            raise PictureError(f"{name} is used twice; an input is one axis of the map, or it is held at a value")
    for name, value in held.items():
        if len(levels[name]) == 1 and not _equal(levels[name], value)[0]:
            raise PictureError(f"{name} cannot be held at {value:.6g}: it is {levels[name][0]:.6g} in every design")


def _independent(levels: Mapping[str, np.ndarray], asked: set[str]) -> list[str]:
    """Return the inputs that vary independently, and those asked for.

    A grid has embedment as depth or as ratio. Unless both are asked for, the other one follows: the one that is not
    asked for, or else the one with more values.
    """
    varying = [name for name, values in levels.items() if len(values) > 1 and (name in asked or name not in DEPENDENT)]
    if RATIO in varying and DEPTH in varying:
        fewer, more = (RATIO, DEPTH) if len(levels[RATIO]) <= len(levels[DEPTH]) else (DEPTH, RATIO)
        if more not in asked:
            varying.remove(more)
        elif fewer not in asked:
            varying.remove(fewer)
    return varying


def _follows(name: str, given: set[str]) -> bool:
    """Whether an input is determined by others that are shown or held."""
    return name in TRIPLET and len(TRIPLET & given) > 1


def select(rows: pd.DataFrame, name: str | None, value: float) -> pd.DataFrame:
    """Return the rows at one value of an input; all of them where there is no such input."""
    return rows if name is None else rows[_equal(rows[name].to_numpy(dtype=float), value)]


def _levels_of(pieces: Pieces, sets: Collection[str]) -> tuple[dict[str, np.ndarray], int]:
    """Return the different values of every input, and the number of rows; a named set stands for what it gives."""
    levels: dict[str, np.ndarray] = {}
    total = 0
    given = [name for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS, RATIO) if FIELDS[name].section not in sets]
    for piece in pieces([*given, *sets]):
        total += len(piece)
        for name in (*given, *sets):
            if name in piece:
                values = piece[name].astype(float).unique()
                levels[name] = np.unique(np.concatenate([levels.get(name, values), values]))
    return {name: _levels(values) for name, values in levels.items()}, total


def _levels(values: np.ndarray) -> np.ndarray:
    """Different values of an input, ascending; nearly equal ones count once."""
    distinct = np.unique(values[np.isfinite(values)])
    if len(distinct) < 2:
        return distinct
    new = np.ones(len(distinct), dtype=bool)
    new[1:] = np.diff(distinct) > 10.0**-DIGITS * np.abs(distinct[1:])
    return distinct[new]


def _equal(values: np.ndarray, value: float) -> np.ndarray:
    return np.abs(values - value) <= 10.0 ** (1 - DIGITS) * max(abs(value), 1e-300)


def _some(levels: Mapping[str, np.ndarray], name: str | None, most: int) -> list[float]:
    """Values of an input over small multiples: all, or evenly spaced ones with both ends."""
    if name is None:
        return [float("nan")]
    values = levels[name]
    if len(values) > most:
        values = values[np.round(np.linspace(0, len(values) - 1, most)).astype(int)]
    return [float(value) for value in values]
