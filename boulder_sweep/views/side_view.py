"""The side view: one instant drawn by matplotlib; a GIF of the whole impact by Pillow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from boulder_sweep.errors import PictureError
from boulder_sweep.locations import replacing
from boulder_sweep.text import ProgressCallback, why
from boulder_sweep.views import pictures
from boulder_sweep.views.scene import STYLES, SceneItem, SideView, samples_shown
from boulder_sweep.views.time_curves import require_samples
from boulder_sweep.views.wording import NOT_A_TEST, verdict_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from boulder_sweep.impact.trajectory import Trajectory


WIDTH_IN = 7.6
HEAD_PT, HEAD_PT_PER_M = 9.0, 40.0
"""Heads of arrows [pt]: smaller for short arrows, so that their length can still be read."""


def draw_still(trajectory: Trajectory, path: str | Path, *, time_s: float | None = None) -> None:
    """Draw truck, boulder, wedge and forces to scale at one instant [s], by default when the contact force peaks."""
    require_samples(trajectory)
    when = trajectory.decided.maxima.t_F_v if time_s is None else time_s
    sample = int(np.argmin(np.abs(trajectory.time_s - when)))
    view = SideView(trajectory)
    with pictures.figure(path, WIDTH_IN, height_of(view)) as fig:
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
    pictures.headline(fig, verdict_line(view.trajectory), size=11.0)
    fig.text(0.99, 0.01, NOT_A_TEST, ha="right", fontsize=7.5, color=pictures.GREY)
    return axes


def draw(axes: Axes, shapes: Iterable[SceneItem], *, behind: bool = False) -> list[Any]:
    """Draw shapes; return what was added, so that it can be removed before the next frame."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, FancyArrowPatch, Polygon

    artists: list[Any] = []
    order = 1.0 if behind else 2.0
    for shape in shapes:
        style = STYLES[shape.style]
        dash: Any = (0, style.dash) if style.dash else "-"
        if shape.kind == "text":
            drawn: Any = axes.text(*shape.points[0], shape.text, fontsize=style.size, color=style.line, va="bottom")
        elif shape.kind == "line":
            x, y = zip(*shape.points, strict=True)
            drawn = axes.add_line(Line2D(x, y, color=style.line, linewidth=style.width, linestyle=dash))
        elif shape.kind == "arrow":
            (x0, y0), (x1, y1) = shape.points
            head = min(HEAD_PT, HEAD_PT_PER_M * float(np.hypot(x1 - x0, y1 - y0)))
            look: Any = {"arrowstyle": "-|>", "mutation_scale": head, "shrinkA": 0.0, "shrinkB": 0.0}
            arrow = FancyArrowPatch(*shape.points, **look, color=style.line, linewidth=style.width)
            drawn = axes.add_patch(arrow)
        elif shape.kind == "circle":
            circle = Circle(shape.points[0], shape.radius, facecolor=style.fill, edgecolor=style.line)
            drawn = axes.add_patch(circle)
        else:
            polygon = Polygon(shape.points, facecolor=style.fill, edgecolor=style.line, linewidth=style.width)
            drawn = axes.add_patch(polygon)
        drawn.set_zorder(order)
        drawn.set_clip_on(True)
        artists.append(drawn)
        order += 0.001
    return artists


KINDS = (".gif",)
EVERY_S = 0.005
"""Time between two frames [s]."""
MOST_FRAMES = 120
FRAMES_PER_S = 20
"""Frames per second of playing: with 5 ms between frames, ten times slower than real time."""
LAST_FRAME_S = 1.5
"""How long a GIF shows its last frame before it starts again [s]."""
COLOURS = 48
"""Colours of a GIF; the drawing needs few."""
FILM_DPI = 84
SWATCH = 40
"""Height of a strip of each colour in the picture that the palette of a GIF is taken from."""


def animate(trajectory: Trajectory, path: str | Path, progress: ProgressCallback | None = None) -> None:
    """Animate the side view (.gif); `progress` is called with how many frames of how many are drawn."""
    target = pictures.checked_kind(path, KINDS)
    require_samples(trajectory)
    try:
        with replacing(target) as file:
            _write_gif(trajectory, file, progress)
    except OSError as problem:
        raise PictureError(f"{path} cannot be written: {why(problem)}") from problem


def frames(trajectory: Trajectory, progress: ProgressCallback | None = None) -> Iterator[np.ndarray]:
    """Yield the frames of an animation, uint8 of shape (height, width, 3); `progress`: see `animate`."""
    pictures.require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    view = SideView(trajectory)
    with matplotlib.rc_context(pictures.STYLE):
        fig = Figure(figsize=(WIDTH_IN, height_of(view)), dpi=FILM_DPI, layout="constrained")
        canvas = FigureCanvasAgg(fig)
        axes = stage(fig, view)
        title = axes.set_title(view.caption(0), fontsize=8.5, fontweight="normal", family="monospace")
        canvas.draw()
        fig.set_layout_engine("none")  # placed once; the frames must not jump
        chosen = samples_shown(trajectory, MOST_FRAMES, EVERY_S)
        for drawn, sample in enumerate(chosen, start=1):
            title.set_text(view.caption(sample))
            moving = draw(axes, view.moving(sample))
            canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[..., :3].copy()
            for artist in moving:
                artist.remove()
            if progress is not None:
                progress(drawn, len(chosen))


def _write_gif(trajectory: Trajectory, target: BinaryIO, progress: ProgressCallback | None) -> None:
    from PIL import Image  # comes with matplotlib

    pictures = [Image.fromarray(picture) for picture in frames(trajectory, progress)]
    # One palette for all, from frames spread over the film, so that every colour is in it and none flickers.
    width, height = pictures[0].size
    sample = pictures[:: max(1, len(pictures) // 6)]
    colours = sorted({"#FFFFFF"} | {c for style in STYLES.values() for c in (style.fill, style.line) if c != "none"})
    sheet = Image.new("RGB", (width, height * len(sample) + SWATCH * len(colours)))
    for k, picture in enumerate(sample):
        sheet.paste(picture, (0, k * height))
    for k, colour in enumerate(colours):  # thin lines would lose theirs to the many pixels of soil and sky
        sheet.paste(Image.new("RGB", (width, SWATCH), colour), (0, height * len(sample) + k * SWATCH))
    palette = sheet.quantize(COLOURS)
    reduced = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    times = [1000 // FRAMES_PER_S] * (len(reduced) - 1) + [round(1000 * LAST_FRAME_S)]
    first, *others = reduced
    first.save(target, "GIF", save_all=True, append_images=others, duration=times, loop=0, optimize=True)
