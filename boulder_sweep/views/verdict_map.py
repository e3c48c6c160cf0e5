"""Pass/fail maps: a plane through a table of designs, and the verdict over two of its inputs.

Two inputs are across and up, up to two over small multiples, the rest is held fixed. The table is read in pieces; only
the rows of the plane are kept.
"""

from __future__ import annotations

import itertools
import textwrap
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.columns import GRADES, INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import PictureError
from boulder_sweep.settings.fields import BY_NAME as FIELDS
from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import VERDICTS
from boulder_sweep.views.wording import RATIO, USUAL, keep_together, label, name_of, size_of, value_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    positions = {column: {name: float(at) for at, name in enumerate(names)} for column, names in sets.items()}

    def numbered(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        for piece in pieces(columns):
            there = {name: numbers for name, numbers in positions.items() if name in piece}
            yield piece.assign(**{name: piece[name].astype(str).map(at).astype(float) for name, at in there.items()})

    return numbered


def finished_pieces(finished: FinishedRows) -> Pieces:
    """Return a source of pieces of the finished rows of a result, which are first compared with their checksums."""
    verified = False

    def pieces(columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        nonlocal verified
        missing = {RATIO, *OPTIONAL_COLUMNS} - {*finished.columns}
        stored = [name for name in dict.fromkeys((DEPTH, HEIGHT, *columns)) if name not in missing]
        for table in finished.tables(stored, verify=not verified):
            (frame,) = pieces_of(table.to_pandas())(columns)
            yield frame
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
MOST = {"columns": 4, "rows": 3}
"""Most columns and rows of small multiples; of more values, evenly spaced ones are shown."""
MOST_SETS = 8
"""Most named soils or vehicles side by side."""


@dataclass(frozen=True, eq=False)
class Slice:
    """Rows of one plane, `total` of the whole table, and the inputs across, up and over small multiples."""

    rows: pd.DataFrame
    across: str
    up: str
    columns: str | None
    rows_over: str | None
    column_values: list[float]
    row_values: list[float]
    """Values over the small multiples; [nan] where there is no such input."""
    fixed: dict[str, float]
    """Inputs that vary in the table and are held, with their values here."""
    constants: dict[str, float]
    """Inputs that have one value in the whole table."""
    total: int
    flags: Mapping[str, int]
    """Number of passing rows with each flag of the column ``validity``; under ``""`` those without any."""
    grades: Mapping[str, int]
    """Number of passing rows with each grade of the column ``robustness``; empty for a table without it."""
    left_out: dict[str, int]
    """Inputs of which only some values are shown, each with the number of its values."""
    sets: Mapping[str, Sequence[str]]
    """Named soils or vehicles; their values here are positions in these lists."""

    @property
    def count(self) -> int:
        """Number of rows in the plane."""
        return len(self.rows)

    @property
    def passing(self) -> int:
        """Number of rows in the plane that pass."""
        return int((self.rows[VERDICT] == "pass").sum())


def plane(
    table: pd.DataFrame | Pieces,
    *,
    across: str | None = None,
    up: str | None = None,
    columns: str | None = None,
    rows: str | None = None,
    at: Mapping[str, float] | None = None,
    sets: Mapping[str, Sequence[str]] | None = None,
) -> Slice:
    """Choose a plane of a table of designs: inputs on the axes, and `columns` and `rows` over small multiples.

    Inputs in `at` are held at the value nearest to the one given, others that vary at their middle one. `sets` has the
    names of soils or vehicles by the column that holds them; each is drawn for itself, up to `MOST_SETS`. A
    `PictureError` refuses an input that is unknown, used twice or cannot be held, and a table in which fewer than two
    vary.
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
        follows = name in TRIPLET and len(TRIPLET & {*chosen.values(), *fixed}) > 1
        if name in held or not follows:
            values = levels[name]
            wanted_value = held.get(name, values[(len(values) - 1) // 2])
            fixed[name] = float(values[np.argmin(np.abs(values - wanted_value))])
    multiples = {
        role: _some(levels, chosen[role], MOST_SETS if chosen[role] in named else most) for role, most in MOST.items()
    }
    over = {column: values for role, values in multiples.items() if (column := chosen[role]) is not None}
    admitted = {name: [value] for name, value in fixed.items()} | over
    asked = [*filter(None, chosen.values()), *fixed, VERDICT, REASON, VALIDITY, ROBUSTNESS]
    kept = []
    for piece in pieces(list(dict.fromkeys(asked))):
        keep = np.ones(len(piece), dtype=bool)
        for name, shown in admitted.items():
            column = piece[name].to_numpy(dtype=float)
            keep &= np.logical_or.reduce([_equal(column, value) for value in shown])
        kept.append(piece[keep])
    found = pd.concat(kept, ignore_index=True)
    passes = found[found[VERDICT] == "pass"]
    flags: Counter[str] = Counter()
    for words, count in passes[VALIDITY].astype(str).value_counts().items() if VALIDITY in passes else ():
        flags.update(dict.fromkeys(str(words).split(";"), int(count)))
    grades = Counter(passes[ROBUSTNESS].dropna().astype(str)) if ROBUSTNESS in passes else Counter[str]()
    return Slice(
        rows=found,
        across=str(chosen["across"]),
        up=str(chosen["up"]),
        columns=chosen["columns"],
        rows_over=chosen["rows"],
        column_values=multiples["columns"],
        row_values=multiples["rows"],
        fixed=fixed,
        constants={name: float(values[0]) for name, values in levels.items() if len(values) == 1},
        total=total,
        flags=flags,
        grades=grades,
        left_out={name: len(levels[name]) for name, values in over.items() if len(values) < len(levels[name])},
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
    return distinct[np.diff(distinct, prepend=-np.inf) > 10.0**-DIGITS * np.abs(distinct)]


def _equal(values: np.ndarray, value: float) -> np.ndarray:
    return np.abs(values - value) <= 10.0 ** (1 - DIGITS) * max(abs(value), 1e-300)


def _some(levels: Mapping[str, np.ndarray], name: str | None, most: int) -> list[float]:
    """Values of an input over small multiples: all, or evenly spaced ones with both ends."""
    if name is None:
        return [float("nan")]
    values = levels[name]
    return values[np.round(np.linspace(0, len(values) - 1, min(most, len(values)))).astype(int)].tolist()


CLASSES = (
    ("pass", VERDICTS["pass"], "pass"),
    ("undecided", VERDICTS["undecided"], "undecided"),
    ("fail/overturns", VERDICTS["fail"], "fail: overturns"),
    ("fail/penetration", VERDICTS["fail: penetration"], "fail: truck gets too far"),
    ("fail/no_contact", VERDICTS["fail: no_contact"], "fail: truck passes over it"),
    ("error", VERDICTS["error"], "not computed"),
)
"""Verdict, or verdict and reason; colour; words of the legend."""
ROBUST, SENSITIVE, OPEN = GRADES
HATCHES = {SENSITIVE: "////", OPEN: ".."}
"""Passes that are not robust, where second opinions were asked for."""
MOST_CELLS = 400
"""A map with more values along an axis is drawn as points."""
NARROW = 2
"""With up to so many maps side by side there is no room for the legend above them."""
LEGEND_IN = 1.8
"""Width of the legend beside the maps."""
GAP_IN = 0.15
"""Least space between title and legend."""
AXIS_IN = 0.8
"""Width of the labels at the left of the maps."""
LINE_IN = {"title": 0.19, "map": 0.14}
"""Height of a further line of a title."""
CHARACTERS_PER_INCH = 15
"""Characters of the caption in one inch of the figure."""
CAPTION_LINE_IN = 0.15
"""Height of a line of the caption."""


def draw_verdict_map(
    table: pd.DataFrame | Pieces,
    path: str | Path,
    *,
    title: str = "",
    terms: str = "",
    found: str = "",
    across: str | None = None,
    up: str | None = None,
    columns: str | None = None,
    rows: str | None = None,
    at: Mapping[str, float] | None = None,
    sets: Mapping[str, Sequence[str]] | None = None,
    units: str = "si",
) -> Slice:
    """Draw which designs of a table pass, over two of their inputs; return what was drawn.

    The table is as `boulder_sweep.read` returns it; input columns, ``verdict`` and ``reason`` are used. `title` names
    the study; the caption begins with `found`, the design that is recommended, and ends with `terms`, what a pass
    means. The other arguments say what is shown, see `plane`.
    """
    shown = plane(table, across=across, up=up, columns=columns, rows=rows, at=at, sets=sets)
    if shown.count == 0:
        held = ", ".join(_held(shown, name, value, "si") for name, value in shown.fixed.items())
        raise PictureError(
            f"none of the {shown.total:,} designs lies at {held}: this is a list of designs rather than a grid; "
            "hold values that occur together (--at), or draw the table in a notebook"
        )
    n_rows, n_columns = len(shown.row_values), len(shown.column_values)
    width = max(2.2 * n_columns + 1.9, 5.2) + LEGEND_IN * (n_columns <= NARROW)
    characters = int(CHARACTERS_PER_INCH * width)
    caption = "\n".join([*textwrap.wrap(found, characters), _caption(shown, terms, characters, units)])
    height = max(1.9 * n_rows + 1.45, 3.45) + CAPTION_LINE_IN * (caption.count("\n") + 1)
    with pictures.figure(path, width, height) as fig:
        grid = fig.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
        present: set[int] = set()
        values = itertools.product(shown.row_values, shown.column_values)
        for axes, (row_value, column_value) in zip(grid.flat, values, strict=True):
            rows_here = select(select(shown.rows, shown.columns, column_value), shown.rows_over, row_value)
            present |= _panel(axes, rows_here, shown, units)
            axes.grid(visible=False)
        for axes in grid[-1]:
            axes.set_xlabel(label(shown.across, units))
        for axes in grid[:, 0]:
            axes.set_ylabel(label(shown.up, units))
        _titles(fig, grid, present, shown, f"{title}: which" if title else "Which", units)
        pictures.caption(fig, caption)
    return shown


def classes_of(rows: pd.DataFrame) -> np.ndarray:
    """Index into `CLASSES` of every row of a table, int8, shape (n,)."""
    verdict, reason = (rows[name].astype(str).to_numpy(dtype=object) for name in (VERDICT, REASON))
    codes = np.full(len(rows), -1, dtype=np.int8)
    for code, (key, _, _) in enumerate(CLASSES):
        wanted, _, why = key.partition("/")
        codes[(verdict == wanted) & ((reason == why) if why else True)] = code
    return codes


def _panel(axes: Axes, rows: pd.DataFrame, shown: Slice, units: str) -> set[int]:
    """Draw one map; return the classes that occur."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    codes = classes_of(rows)
    colours = ListedColormap([colour for _, colour, _ in CLASSES])
    norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
    x, y = (rows[name].to_numpy(dtype=float) / size_of(name, units) for name in (shown.across, shown.up))
    x_levels, x_index = np.unique(np.round(x, 9), return_inverse=True)
    y_levels, y_index = np.unique(np.round(y, 9), return_inverse=True)
    cells = np.full((len(y_levels), len(x_levels)), -1, dtype=np.int16)
    cells[y_index, x_index] = codes
    filled = len(np.unique(y_index.astype(np.int64) * max(len(x_levels), 1) + x_index))
    gridded = filled == len(rows) and 2 * filled >= cells.size and max(cells.shape, default=0) <= MOST_CELLS
    if gridded and min(cells.shape) > 1:
        masked = np.ma.masked_less(cells, 0)
        style: dict[str, Any] = {"cmap": colours, "norm": norm, "linewidth": 0.35, "edgecolors": "white"}
        axes.pcolormesh(_edges(x_levels), _edges(y_levels), masked, **style)
        for grade, hatch in _hatches(shown).items():
            graded = np.zeros(cells.shape, dtype=bool)
            graded[y_index, x_index] = rows[ROBUSTNESS].astype(str).to_numpy() == grade
            if graded.any():
                covered = np.ma.masked_array(np.zeros(cells.shape), ~graded)
                drawn = axes.pcolor(_edges(x_levels), _edges(y_levels), covered, facecolor="none", hatch=hatch)
                drawn.set_edgecolor("white")
                drawn.set_linewidth(0.0)
    else:
        known = codes >= 0  # of other rules' words, as in the mask above
        axes.scatter(x[known], y[known], c=codes[known], cmap=colours, norm=norm, s=9, linewidths=0)
    return {int(code) for code in np.unique(codes) if code >= 0}


def _hatches(shown: Slice) -> dict[str, str]:
    """Return how passes that are not robust are hatched: not at all where no second opinion was asked for."""
    return HATCHES if shown.grades.get(SENSITIVE) or (shown.grades.get(ROBUST) and not shown.grades.get(OPEN)) else {}


def _edges(levels: np.ndarray) -> np.ndarray:
    """Boundaries of cells around the values of an axis."""
    middles = 0.5 * (levels[1:] + levels[:-1])
    return np.concatenate(([2 * levels[0] - middles[0]], middles, [2 * levels[-1] - middles[-1]]))


def _titles(fig: Figure, grid: np.ndarray, present: set[int], shown: Slice, which: str, units: str) -> None:
    """Write the title of the picture and of every map, in as many lines as they need, and draw the legend."""
    n_columns = grid.shape[1]
    words = f"{which} designs stop the truck"
    beside = n_columns <= NARROW
    legend_in = _legend(fig, present, shown, beside=beside)
    headline = pictures.headline(fig, words, legend_in + GAP_IN)
    if not beside and "\n" in headline:
        fig.legends[0].remove()
        beside = True
        fig.set_figwidth(fig.get_figwidth() + LEGEND_IN)
        legend_in = _legend(fig, present, shown, beside=True)
        headline = pictures.headline(fig, words, legend_in + GAP_IN)
    map_in = (fig.get_figwidth() - AXIS_IN - legend_in * beside) / n_columns - GAP_IN
    style: Any = {"fontsize": 8.5, "fontweight": "bold"}
    further = headline.count("\n") * LINE_IN["title"]
    for row, row_value in enumerate(shown.row_values):
        lines = []
        for column, column_value in enumerate(shown.column_values):
            pairs = ((shown.rows_over, row_value), (shown.columns, column_value))
            parts = [_held(shown, name, value, units) for name, value in pairs if name is not None]
            name = pictures.break_lines(fig, ", ".join(parts), map_in, **style)
            if "\n" in name:
                name = pictures.break_lines(fig, "\n".join(parts), map_in, **style)
            grid[row, column].set_title(name, **style)
            lines.append(name.count("\n"))
        further += max(lines) * LINE_IN["map"]
    fig.set_figheight(fig.get_figheight() + further)


def _held(shown: Slice, name: str, value: float, units: str) -> str:
    """Return the value of an input in words; of a named soil or vehicle its name."""
    if name in shown.sets:
        return f"{name}: {shown.sets[name][int(value)]}"
    return value_text(name, value, units)


def _all_held(shown: Slice, values: Mapping[str, float], units: str) -> str:
    """Return the values of several inputs in words, each on one line."""
    return ", ".join(keep_together(_held(shown, name, value, units)) for name, value in values.items())


def _legend(fig: Any, present: set[int], shown: Slice, *, beside: bool) -> float:
    """Draw the legend above the maps, or beside them if the title leaves no room; return its width in inches."""
    from matplotlib.patches import Patch

    handles = [Patch(color=colour, label=words) for k, (_, colour, words) in enumerate(CLASSES) if k in present]
    hatches = {grade: hatch for grade, hatch in _hatches(shown).items() if shown.grades.get(grade)}
    if hatches:
        colour = CLASSES[0][1]
        style: dict[str, Any] = {"facecolor": colour, "edgecolor": "white", "linewidth": 0.0}
        graded = [Patch(color=colour, label=f"pass: {ROBUST}")] if shown.grades.get(ROBUST) else []
        graded += [Patch(**style, hatch=hatch, label=f"pass: {grade}") for grade, hatch in hatches.items()]
        handles = [*graded, *handles[1:]]
    position, columns = ("outside right upper", 1) if beside else ("outside upper right", len(handles))
    drawn = fig.legend(handles=handles, loc=position, ncols=columns, handlelength=1.2, columnspacing=1.2)
    return float(drawn.get_window_extent().width / fig.dpi)


def _caption(shown: Slice, terms: str, width: int, units: str) -> str:
    """Say what is shown, what all designs have in common, and what a pass means, each on a new line."""
    fixed = f", at {_all_held(shown, shown.fixed, units)}" if shown.fixed else ""
    words = [f"{shown.count:,} of {shown.total:,} designs{fixed}"]
    words.append(f"{shown.passing / max(shown.count, 1):.1%} of them pass")
    if shown.grades:
        words.append(", ".join(f"{shown.grades[grade]:,} {grade}" for grade in GRADES if shown.grades.get(grade)))
    for name, count in shown.left_out.items():
        words.append(f"{name_of(name)}: {count} values, not all shown")
    same = {name: value for name, value in shown.constants.items() if (name, value) not in USUAL}
    all_designs = f"All designs: {_all_held(shown, same, units)}" if same else ""
    lines = (" · ".join(words), _flagged(shown), all_designs, terms)
    return "\n".join(textwrap.fill(line, width) for line in lines if line)


def _flagged(shown: Slice) -> str:
    """Return how many of the passes lie outside what the model was tested on, and in what respect."""
    if not shown.passing or not shown.flags:
        return ""
    shares = {name: count / shown.passing for name, count in shown.flags.items()}
    inside = shares.pop("", 0.0)
    most = sorted(shares.items(), key=lambda item: (-item[1], item[0]))
    if not most:
        return "No pass lies outside what the model was tested on"
    named = ", ".join(keep_together(f"{name.replace('_', ' ')} {share:.0%}") for name, share in most)
    return f"Of the passes {1.0 - inside:.0%} lie outside what the model was tested on: {named}"
