"""The side view drawn by matplotlib: one instant, and the frames of an animation."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.views import figures
from boulder_sweep.views.scene import STYLES, Shape, SideView
from boulder_sweep.views.trajectory import require_samples
from boulder_sweep.views.wording import NOT_A_TEST, verdict_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from boulder_sweep.impact.trajectory import Trajectory

WIDTH_IN = 7.6
HEAD_PT, HEAD_PT_PER_M = 9.0, 40.0
"""Heads of arrows [pt]: smaller for short arrows, so that their length can still be read."""


def draw_still(trajectory: Trajectory, path: str | Path, *, time_s: float | None = None) -> None:
    """Draw truck, boulder, soil wedge and forces to scale at one instant.

    Parameters
    ----------
    trajectory
        The impact.
    path
        Picture to write (.png, .svg, .pdf).
    time_s
        When [s]; by default when the contact force peaks.

    Raises
    ------
    PictureError
        There is nothing to draw, or the picture cannot be written.
    """
    require_samples(trajectory)
    when = trajectory.motion.outcome.maxima.t_F_v if time_s is None else time_s
    sample = int(np.argmin(np.abs(trajectory.time_s - when)))
    view = SideView(trajectory)
    with figures.figure(path, WIDTH_IN, height_of(view)) as fig:
        axes = stage(fig, view)
        draw(axes, view.moving(sample))
        axes.set_title(view.caption(sample), fontsize=8.5, fontweight="normal", family="monospace")


def height_of(view: SideView) -> float:
    """Height of a figure [in] that shows the whole window to scale under two lines of title."""
    w = view.window
    return WIDTH_IN * (w.top - w.bottom) / (w.right - w.left) + 0.55


def stage(fig: Figure, view: SideView) -> Axes:
    """Draw everything that does not move."""
    axes = fig.subplots()
    w = view.window
    axes.set_xlim(w.left, w.right)
    axes.set_ylim(w.bottom, w.top)
    axes.set_aspect("equal")
    axes.set_axis_off()
    draw(axes, view.ground(), behind=True)
    fig.suptitle(verdict_line(view.trajectory), x=0.01, ha="left", fontsize=11.0, fontweight="bold")
    fig.text(0.99, 0.01, NOT_A_TEST, ha="right", fontsize=7.5, color=figures.GREY)
    return axes


def draw(axes: Axes, shapes: Iterable[Shape], *, behind: bool = False) -> list[Any]:
    """Draw shapes; return what was added, so that it can be removed before the next frame."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, FancyArrowPatch, Polygon

    artists: list[Any] = []
    order = 1.0 if behind else 2.0
    for shape in shapes:
        style = STYLES[shape.style]
        dash: Any = (0, style.dash) if style.dash else "-"
        if shape.kind == "polygon":
            patch: Any = Polygon(shape.points, facecolor=style.fill, edgecolor=style.line, linewidth=style.width)
            artists.append(axes.add_patch(patch))
        elif shape.kind == "circle":
            patch = Circle(shape.points[0], shape.radius, facecolor=style.fill, edgecolor=style.line)
            artists.append(axes.add_patch(patch))
        elif shape.kind == "arrow":
            (x0, y0), (x1, y1) = shape.points
            head = min(HEAD_PT, HEAD_PT_PER_M * float(np.hypot(x1 - x0, y1 - y0)))
            patch = FancyArrowPatch(
                *shape.points,
                arrowstyle="-|>",
                mutation_scale=head,
                shrinkA=0.0,
                shrinkB=0.0,
                color=style.line,
                linewidth=style.width,
            )
            artists.append(axes.add_patch(patch))
        elif shape.kind == "line":
            x, y = zip(*shape.points, strict=True)
            line = Line2D(x, y, color=style.line, linewidth=style.width, linestyle=dash)
            artists.append(axes.add_line(line))
        else:
            text = axes.text(*shape.points[0], shape.text, fontsize=style.size, color=style.line, va="bottom")
            artists.append(text)
        artists[-1].set_zorder(order)
        artists[-1].set_clip_on(True)
        order += 0.001
    return artists
