"""Which drawn designs pass over the two inputs that decide most, and what each input does to the chance."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.columns import INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import PictureError
from boulder_sweep.text import chance_text
from boulder_sweep.views.figures import BLUE, GREY, LIGHT_GREY, ORANGE, PALE_ORANGE, caption, figure, headline
from boulder_sweep.views.wording import USUAL, keep_together, label, name_of, size_of, terms_line, value_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from boulder_sweep.answers.uncertainty import Uncertainty

FIFTHS = 5
LEAST_RANGE = 0.01
"""Least width of the axis of probabilities."""


def draw_uncertainty(result: Uncertainty, path: str | Path, *, design_id: int = 0, units: str = "si") -> None:
    """Draw one design of a result.

    Parameters
    ----------
    result
        The result.
    path
        Picture to write.
    design_id
        The design.
    units
        ``si`` or ``us``.

    Raises
    ------
    PictureError
        No samples are kept of this design, or the picture cannot be written.
    """
    samples = result.samples.to_pandas()
    samples = samples[samples.design_id == design_id]
    if samples.empty:
        raise PictureError(f"no samples of design {design_id} are kept; take a file with fewer designs, or one of them")
    row = result.arrow.slice(design_id, 1).to_pylist()[0]
    names = [name for name in samples.columns if name not in ("design_id", "distance")]
    changes = {name: _by_fifths(samples, name) for name in names}
    order = sorted(names, key=lambda name: float(np.ptp(changes[name])), reverse=True)
    with figure(path, 9.6, 4.9) as fig:
        left, right = fig.subplots(1, 2, width_ratios=(1.1, 1.0))
        _scatter(left, samples, order, units)
        _tornado(right, changes, order, row["p_pass"])
        name = result.sweep.name if len(result) == 1 else f"{result.sweep.name} #{design_id}"
        chance, low, high = (chance_text(row[key]) for key in ("p_pass", "p_pass_low", "p_pass_high"))
        headline(fig, f"{name}: P(pass) = {chance} ({low} to {high})")
        caption(fig, _caption(result, row, names, units))


def _caption(result: Uncertainty, row: Mapping[str, Any], uncertain: Sequence[str], units: str) -> str:
    """Say which design it is, with the means of its uncertain inputs, and what a pass means."""
    sets = [f"{axis.name}: {row[axis.name]}" for axis in result.sweep.axes if axis.labels]
    follows = () if "impact_height_m" in result.sweep.plan.given else ("impact_height_m",)
    values = {
        name: keep_together(value_text(name, row[name], units))
        for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS)
        if row.get(name) is not None and name not in follows and (name, row[name]) not in USUAL
    }
    design = ", ".join([*map(keep_together, sets), *(words for name, words in values.items() if name not in uncertain)])
    means = ", ".join(values[name] for name in uncertain if name in values)
    of = f"Design #{row['design_id']} of #0 to #{len(result) - 1}" if len(result) > 1 else "Design"
    least = json.loads(result.arrow.schema.metadata[b"boulder_sweep.question"])["margin"]
    margin = f" Here a pass also has a margin of at least {least:.0%}." if least else ""
    return (
        f"{of}: {design}. Means of the uncertain inputs: {means}.\n{terms_line(result.sweep.resolved(), units)}{margin}"
    )


def _by_fifths(samples: pd.DataFrame, name: str) -> np.ndarray:
    """Share that passes in each fifth of an input, from the lowest to the highest."""
    order = np.argsort(samples[name].to_numpy(), kind="stable")
    passes = samples.distance.to_numpy()[order] > 0.0
    return np.array([part.mean() for part in np.array_split(passes, FIFTHS)])


def _scatter(axes: Axes, samples: pd.DataFrame, order: list[str], units: str) -> None:
    """Draw the samples over the two inputs that decide most; over one and its margin where there is one only."""
    passes = samples.distance.to_numpy() > 0.0
    x = samples[order[0]].to_numpy() / size_of(order[0], units)
    y = samples[order[1]].to_numpy() / size_of(order[1], units) if len(order) > 1 else samples.distance.to_numpy()
    for rows, colour, words in ((~passes, ORANGE, "does not pass"), (passes, BLUE, "passes")):
        axes.plot(x[rows], y[rows], ".", color=colour, markersize=2.2, alpha=0.6, label=words, rasterized=True)
    axes.set_xlabel(label(order[0], units))
    axes.set_ylabel(label(order[1], units) if len(order) > 1 else "margin (below 0: does not pass)")
    axes.set_title("designs drawn")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, markerscale=4)


def _tornado(axes: Axes, changes: dict[str, np.ndarray], order: list[str], p_pass: float) -> None:
    """Draw the chance where an input lies in its lowest and in its highest fifth."""
    for position, name in enumerate(reversed(order)):
        low, high = changes[name][0], changes[name][-1]
        for value, colour, words in ((low, PALE_ORANGE, "lowest fifth (low)"), (high, BLUE, "highest fifth (high)")):
            bar = "" if position else words
            axes.barh(position, value - p_pass, left=p_pass, height=0.55, color=colour, label=bar)
        axes.annotate(
            f"low {chance_text(low)}, high {chance_text(high)}",
            (0.02, position + 0.3),
            xycoords=("axes fraction", "data"),
            va="bottom",
            fontsize=8,
            color=GREY,
        )
    axes.axvline(p_pass, color=LIGHT_GREY, zorder=0)
    axes.set_yticks(range(len(order)), [name_of(name) for name in reversed(order)])
    axes.set_xlim(*_range([p_pass, *(end for change in changes.values() for end in change[[0, -1]])]))
    axes.set_ylim(-0.5, len(order) - 0.3)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("P(pass) where the input lies in its lowest or highest fifth")
    axes.set_title("what each input does")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)


def _range(chances: Sequence[float]) -> tuple[float, float]:
    """Return limits around some probabilities: within 0 and 1, and never closer than `LEAST_RANGE`."""
    room = 0.08 * (max(chances) - min(chances))
    low = max(min(chances) - room, 0.0)
    high = min(max(max(chances) + room, low + LEAST_RANGE), 1.0)
    return min(low, high - LEAST_RANGE), high
