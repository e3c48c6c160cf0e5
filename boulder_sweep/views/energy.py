"""Where the energy of the vehicle goes, stacked over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.views import figures
from boulder_sweep.views.figures import (
    AMBER,
    BLACK,
    BLUE,
    BROWN,
    GREEN,
    LIGHT_GREY,
    ORANGE,
    PALE_ORANGE,
    PURPLE,
    SKY,
    YELLOW,
)
from boulder_sweep.views.labels import sized
from boulder_sweep.views.trajectory import require_samples
from boulder_sweep.views.wording import design_line, verdict_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boulder_sweep.impact.trajectory import Trajectory

LAYERS = (
    ("crush_damper_J", "crush of the vehicle (lasting)", ORANGE),
    ("crush_spring_J", "crush of the vehicle (springs back)", AMBER),
    ("soil_drag_J", "soil: drag (lost)", GREEN),
    ("soil_elastic_J", "soil: springs", YELLOW),
    ("gravity_J", "weight of the boulder lifted", PURPLE),
    ("boulder_linear_J", "boulder moving", BLUE),
    ("boulder_angular_J", "boulder turning", SKY),
    ("vehicle_kinetic_J", "vehicle moving", LIGHT_GREY),
)
"""What is stacked, from below: first what is lost for good, last what the vehicle still has."""


def draw_energy(trajectory: Trajectory, path: str | Path, *, units: str = "si") -> None:
    """Draw the energy ledger of one impact, stacked over time.

    Parameters
    ----------
    trajectory
        The impact.
    path
        Picture to write (.png, .svg, .pdf).
    units
        ``si`` or ``us``.

    Raises
    ------
    PictureError
        There is nothing to draw, or the picture cannot be written.

    Notes
    -----
    Under printed readings the work against the restoring moment can be negative, and the pull on the vehicle
    without a partner takes energy out of nothing. Negative parts are stacked below zero, so that the bands above
    zero rise over the line of the energy at first touch by as much.
    """
    require_samples(trajectory)
    ledger = trajectory.energy()
    time = ledger.time_s
    unit, size = sized("J", units)
    initial = ledger.initial / size
    with figures.figure(path, 8.0, 4.9) as fig:
        axes = fig.subplots()
        above, below = np.zeros_like(time), np.zeros_like(time)
        layers = [(getattr(ledger, name) / size, label, colour) for name, label, colour in LAYERS]
        if ledger.soil_plastic_J.max() > 0.0:
            layers.insert(3, (ledger.soil_plastic_J / size, "soil: pressed for good", BROWN))
        if ledger.crush_spent_J.any():
            layers.insert(1, (ledger.crush_spent_J / size, "crush of the vehicle (spent as it stiffened)", PALE_ORANGE))
        if np.abs(ledger.pull_J).max() > 0.0:
            layers.append((ledger.pull_J / size, "out of nothing (printed separation)", BLACK))
        handles = []
        for values, label, colour in layers:
            up, down = np.maximum(values, 0.0), np.minimum(values, 0.0)
            style: dict[str, Any] = {"color": colour, "linewidth": 0.4, "edgecolor": "white"}
            handles.append(axes.fill_between(time, above, above + up, label=label, **style))
            axes.fill_between(time, below, below + down, **style)
            above, below = above + up, below + down
        axes.axhline(initial, color=BLACK, linestyle="--", linewidth=1.0)
        axes.annotate(
            f"at first touch {initial:.0f} {unit}",
            (0.01, initial),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=8.5,
        )
        axes.set_xlim(0.0, float(time[-1]))
        figures.limit_y(axes, 1.05 * float(below.min()), 1.09 * max(float(above.max()), initial))
        axes.grid(visible=False)
        _mark_limit(axes, trajectory)
        axes.set_xlabel("time since first touch [s]")
        axes.set_ylabel(f"energy [{unit}]")
        axes.set_title(
            f"The parts add up to the energy at first touch to within {ledger.largest_residual:.0e} of it.",
            fontsize=8.5,
            fontweight="normal",
        )
        axes.legend(handles=handles[::-1], loc="center left", bbox_to_anchor=(1.0, 0.5))
        figures.headline(fig, verdict_line(trajectory))
        figures.caption(fig, design_line(trajectory, units))


def _mark_limit(axes: Axes, trajectory: Trajectory) -> None:
    """Mark the time of the rotation limit."""
    when = trajectory.motion.outcome.t_limit
    if math.isfinite(when):
        axes.axvline(when, color=BLACK, linestyle=":", linewidth=1.2)
        limit = math.degrees(trajectory.motion.control.theta_limit)
        words = f" {limit:g}°: beyond, the model no longer holds"
        axes.annotate(words, (when, 0.02), xycoords=("data", "axes fraction"), fontsize=8.5)
