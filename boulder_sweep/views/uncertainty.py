"""Which drawn designs pass over the two inputs that decide most, and what each input does to the chance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import PictureError
from boulder_sweep.views.figures import BLUE, GREY, LIGHT_GREY, ORANGE, PALE_ORANGE, figure
from boulder_sweep.views.labels import label, name_of, size_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from boulder_sweep.answers.uncertainty import Uncertainty

FIFTHS = 5


def draw_uncertainty(found: Uncertainty, path: str | Path, *, design_id: int = 0, units: str = "si") -> None:
    """Draw one design of a result.

    Parameters
    ----------
    found
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
    samples = found.samples.to_pandas()
    samples = samples[samples.design_id == design_id]
    if samples.empty:
        raise PictureError(f"no samples of design {design_id} are kept; take a file with fewer designs, or one of them")
    row = found.arrow.slice(design_id, 1).to_pylist()[0]
    names = [name for name in samples.columns if name not in ("design_id", "distance")]
    changes = {name: _by_fifths(samples, name) for name in names}
    order = sorted(names, key=lambda name: float(np.ptp(changes[name])), reverse=True)
    with figure(path, 9.6, 4.4) as fig:
        left, right = fig.subplots(1, 2, width_ratios=(1.1, 1.0))
        _scatter(left, samples, order, units)
        _tornado(right, changes, order, row["p_pass"])
        fig.suptitle(
            f"{found.sweep.name}: P(pass) = {row['p_pass']:.3f} ({row['p_pass_low']:.3f} to {row['p_pass_high']:.3f})",
            x=0.01,
            ha="left",
            fontsize=11.5,
            fontweight="bold",
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
    for place, name in enumerate(reversed(order)):
        low, high = changes[name][0], changes[name][-1]
        axes.barh(place, low - p_pass, left=p_pass, height=0.55, color=PALE_ORANGE)
        axes.barh(place, high - p_pass, left=p_pass, height=0.55, color=BLUE)
        for value, word in ((low, "low"), (high, "high")):
            axes.annotate(
                f"{word} {value:.2f}",
                (value, place),
                xytext=(4 if value >= p_pass else -4, 0),
                textcoords="offset points",
                ha="left" if value >= p_pass else "right",
                va="center",
                fontsize=8,
                color=GREY,
            )
    axes.axvline(p_pass, color=LIGHT_GREY, zorder=0)
    axes.set_yticks(range(len(order)), [name_of(name) for name in reversed(order)])
    axes.margins(x=0.3)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("P(pass) where the input lies in its lowest or highest fifth")
    axes.set_title("what each input does")
