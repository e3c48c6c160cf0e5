"""Pass/fail maps: the verdict over embedment and height, small multiples over the soil."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.columns import GRADES
from boulder_sweep.errors import PictureError
from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import VERDICTS
from boulder_sweep.views.slices import ROBUSTNESS, Pieces, Slice, plane, select
from boulder_sweep.views.wording import USUAL, keep_together, label, name_of, size_of, value_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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

    Parameters
    ----------
    table
        A result table, as `boulder_sweep.read` returns it; input columns, ``verdict`` and ``reason`` are used. Or what
        yields it piece by piece, see `boulder_sweep.views.slices`.
    title
        Name of the study.
    terms
        What a pass means, for the caption.
    found
        Which design is recommended, in sentences: the beginning of the caption.
    across, up, columns, rows, at, sets
        What is shown, see `boulder_sweep.views.slices.plane`.
    """
    shown = plane(table, across=across, up=up, columns=columns, rows=rows, at=at, sets=sets)
    if shown.count == 0:
        held = ", ".join(_held(shown, name, value, "si") for name, value in shown.fixed.items())
        raise PictureError(
            f"none of the {shown.total:,} designs lies at {held}: this is a list of designs rather than a grid; "
            "hold values that occur together (--at), or draw the table in a notebook"
        )
    n_columns, n_rows = len(shown.column_values), len(shown.row_values)
    width = max(2.2 * n_columns + 1.9, 5.2) + LEGEND_IN * (n_columns <= NARROW)
    characters = int(CHARACTERS_PER_INCH * width)
    caption = _caption(shown, terms, characters, units)
    caption = "\n".join([*textwrap.wrap(found, characters), caption])
    height = max(1.9 * n_rows + 1.45, 3.45) + CAPTION_LINE_IN * (caption.count("\n") + 1)
    with pictures.figure(path, width, height) as fig:
        grid = fig.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
        present: set[int] = set()
        for row, row_value in enumerate(shown.row_values):
            for column, column_value in enumerate(shown.column_values):
                axes = grid[row, column]
                cell_rows = select(select(shown.rows, shown.columns, column_value), shown.rows_over, row_value)
                present |= _panel(axes, cell_rows, shown, units)
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
    verdict = rows["verdict"].astype(str).to_numpy(dtype=object)
    reason = rows["reason"].astype(str).to_numpy(dtype=object)
    codes = np.full(len(rows), -1, dtype=np.int8)
    for code, (key, _, _) in enumerate(CLASSES):
        wanted, _, why = key.partition("/")
        match = (verdict == wanted) & ((reason == why) if why else True)
        codes[match] = code
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
            parts = _panel_title(shown, row_value, column_value, units)
            name = pictures.break_lines(fig, ", ".join(parts), map_in, **style)
            if "\n" in name:
                name = pictures.break_lines(fig, "\n".join(parts), map_in, **style)
            grid[row, column].set_title(name, **style)
            lines.append(name.count("\n"))
        further += max(lines) * LINE_IN["map"]
    fig.set_figheight(fig.get_figheight() + further)


def _panel_title(shown: Slice, row_value: float, column_value: float, units: str) -> list[str]:
    pairs = ((shown.rows_over, row_value), (shown.columns, column_value))
    return [_held(shown, name, value, units) for name, value in pairs if name is not None]


def _held(shown: Slice, name: str, value: float, units: str) -> str:
    """Return the value of an input in words; of a named soil or vehicle its name."""
    if name in shown.sets:
        return f"{name}: {shown.sets[name][int(value)]}"
    return value_text(name, value, units)


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
    fixed = ", ".join(keep_together(_held(shown, name, value, units)) for name, value in shown.fixed.items())
    words = [f"{shown.count:,} of {shown.total:,} designs" + (f", at {fixed}" if fixed else "")]
    words.append(f"{shown.passing / max(shown.count, 1):.1%} of them pass")
    if shown.grades:
        words.append(", ".join(f"{shown.grades[grade]:,} {grade}" for grade in GRADES if shown.grades.get(grade)))
    for name, count in shown.left_out.items():
        words.append(f"{name_of(name)}: {count} values, not all shown")
    same = [
        keep_together(_held(shown, name, value, units))
        for name, value in shown.constants.items()
        if (name, value) not in USUAL
    ]
    lines = (" · ".join(words), _flagged(shown), f"All designs: {', '.join(same)}" if same else "", terms)
    return "\n".join(textwrap.fill(line, width) for line in lines if line)


def _flagged(shown: Slice) -> str:
    """Return how many of the passes lie outside what the model was tested on, and in what respect."""
    if not shown.passing or not shown.flags:
        return ""
    shares = {name: count / shown.passing for name, count in shown.flags.items()}
    inside = shares.pop("", 0.0)
    most = sorted(shares.items(), key=lambda item: (-item[1], item[0]))
    named = ", ".join(keep_together(f"{name.replace('_', ' ')} {share:.0%}") for name, share in most)
    if not named:
        return "No pass lies outside what the model was tested on"
    return f"Of the passes {1.0 - inside:.0%} lie outside what the model was tested on: {named}"
