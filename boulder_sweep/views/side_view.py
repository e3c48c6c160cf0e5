"""The side view of an impact: plain shapes in metres; one instant drawn by matplotlib, a GIF of the whole by Pillow.

X points in the direction of travel from where the boulder's near face was, Y up from the soil line.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from boulder_kernels.design import FAR, HEIGHT, NEAR, G, wedge_slope
from boulder_sweep.columns import SHAPES
from boulder_sweep.errors import PictureError
from boulder_sweep.impact.history import soil_profile
from boulder_sweep.judge.verdict import PENETRATION_LIMITS_M
from boulder_sweep.locations import replacing
from boulder_sweep.stones.taped import taped_profiles
from boulder_sweep.text import ProgressCallback, why
from boulder_sweep.views import pictures
from boulder_sweep.views.time_curves import require_samples
from boulder_sweep.views.wording import NOT_A_TEST, verdict_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from boulder_sweep.impact.trajectory import Trajectory


class SceneItem(NamedTuple):
    """One thing to draw; lengths in metres."""

    kind: str
    """``polygon``, ``line``, ``arrow``, ``circle`` or ``text``."""
    style: str
    """What it is, key of `STYLES`."""
    points: tuple[tuple[float, float], ...]
    """Corners; tail and head of an arrow; centre of a circle; position of a text."""
    text: str = ""
    radius: float = 0.0


class Style(NamedTuple):
    """Style of a shape."""

    fill: str = "none"
    line: str = "none"
    width: float = 0.0
    """Width of the line in points."""
    dash: tuple[float, ...] = ()
    size: float = 9.0
    """Size of a text in points."""


STYLES: dict[str, Style] = {
    "soil": Style(fill="#EADFCB"),
    "wedge": Style(fill="#CBB48A", line="#A68A5B", width=0.8),
    "initial": Style(line="#8A8A8A", width=1.0, dash=(4.0, 3.0)),
    "boulder": Style(fill="#A9ABB0", line="#4B4D52", width=1.4),
    "centre": Style(fill="#222222"),
    "weight": Style(size=8.0, line="#4B4D52", width=1.8),
    "truck": Style(fill="#7FB2D6", line="#2B5B7F", width=1.1),
    "bed": Style(fill="#D7E6F1", line="#2B5B7F", width=1.1),
    "window": Style(fill="#EAF3F9", line="#2B5B7F", width=0.8),
    "wheel": Style(fill="#333333", line="#111111", width=0.8),
    "bed_edge": Style(line="#CC79A7", width=2.4),
    "limit": Style(line="#CC79A7", width=1.4, dash=(5.0, 3.0), size=8.0),
    "soil_force": Style(size=8.0, line="#009E73", width=1.8),
    "contact_force": Style(size=8.0, line="#D55E00", width=2.6),
    "scale": Style(line="#222222", width=2.0, size=8.0),
}

SLICES = 8
"""Soil forces drawn along the buried face."""
LONGEST_ARROW_M = 1.5
"""Length of the largest contact force; all forces share one scale."""
SHORTEST_ARROW_M = 0.03


class Window(NamedTuple):
    """What a view shows [m]."""

    left: float
    right: float
    bottom: float
    top: float

    def height_in(self, width_in: float) -> float:
        """Height of a picture of this width that shows it to scale."""
        return width_in * (self.top - self.bottom) / (self.right - self.left)

    def show(self, axes: Axes) -> None:
        """Show it to scale."""
        axes.set_xlim(self.left, self.right)
        axes.set_ylim(self.bottom, self.top)
        axes.set_aspect("equal")


@dataclass(frozen=True)
class SideView:
    """Draws the samples of one trajectory, all in the same window and on the same scale of force."""

    trajectory: Trajectory

    @property
    def window(self) -> Window:
        """The whole impact with some space around it."""
        design, inputs = self.trajectory.motion.design, self.trajectory.inputs
        wedge = design.L + design.d * wedge_slope(design.phi)
        right, top = max(wedge, self.rating_line + 0.3) + 0.6, max(design.H - design.d, 2.55) + 0.95
        return Window(-(inputs["bed_offset_m"] + 1.6), right, -design.d - 0.55, top)

    @property
    def rating_line(self) -> float:
        """How far the cargo bed may come: the far face of the boulder and the limit of the rating [m]."""
        rating = self.trajectory.settings["criterion"]["rating"]
        return max(x for x, _ in self._corners(self.trajectory.motion.outline)) + PENETRATION_LIMITS_M[rating]

    @property
    def metres_per_newton(self) -> float:
        """Scale of the forces."""
        peak = self.trajectory.motion.outcome.maxima.F_v
        return LONGEST_ARROW_M / peak if peak > 0.0 else 1e-6

    def ground(self) -> list[SceneItem]:
        """Return what does not move: soil, initial position of the boulder, line of the rating, scale of force."""
        w, rating = self.window, self.trajectory.settings["criterion"]["rating"]
        unit = 1000e3 if LONGEST_ARROW_M / self.metres_per_newton > 1600e3 else 500e3
        length, x, y = unit * self.metres_per_newton, w.left + 0.25, w.bottom + 0.25
        line = self.rating_line
        return [
            SceneItem("polygon", "soil", ((w.left, w.bottom), (w.right, w.bottom), (w.right, 0.0), (w.left, 0.0))),
            SceneItem("line", "limit", ((line, 0.0), (line, w.top - 0.75))),
            SceneItem("text", "limit", ((line + 0.06, w.top - 0.8),), f"{rating}: cargo bed\nmust stop here"),
            SceneItem("line", "initial", self._initial(self.trajectory.motion.outline)),
            *self._other_shapes(),
            SceneItem("line", "scale", ((x, y), (x + length, y))),
            SceneItem("text", "scale", ((x, y + 0.08),), f"{unit / 1e3:.0f} kN"),
            SceneItem("text", "contact_force", ((x, y + 0.80),), "force of the vehicle"),
            SceneItem("text", "soil_force", ((x, y + 0.58),), f"soil, each 1/{SLICES} of its depth"),
            SceneItem("text", "weight", ((x, y + 0.36),), "weight of the boulder"),
        ]

    def _other_shapes(self) -> list[SceneItem]:
        """Return the other shapes that a boulder as taped and weighed may have, where they stand at first."""
        row, design = self.trajectory.row, self.trajectory.motion.design
        others = [shape for shape in SHAPES if shape != row["shape"]] if row["shape"] is not None else []
        profiles = (taped_profiles(shape, np.array([row["solidity"]]))[0] for shape in others)
        sizes = (design.H, design.W, design.L, design.L)
        return [SceneItem("line", "initial", self._initial(profile * sizes)[::-1]) for profile in profiles]

    def moving(self, sample: int) -> list[SceneItem]:
        """Return what moves, at one sample: soil wedge, boulder, truck, forces."""
        return [
            *self._wedge(sample),
            *self._boulder(sample),
            *truck_shapes(self.trajectory, sample),
            *self._soil_forces(sample),
            *self._contact(sample),
        ]

    def caption(self, sample: int) -> str:
        """Return time, rotation and displacements in a line."""
        t = self.trajectory
        boulder, vehicle = t.boulder_centre_displacement_m[sample], t.vehicle_displacement_m[sample]
        return (
            f"t = {t.time_s[sample] * 1e3:5.0f} ms    rotation {math.degrees(t.rotation_rad[sample]):5.1f}°    "
            f"boulder {boulder:5.2f} m    vehicle {vehicle:5.2f} m"
        )

    def _position(self, sample: int, x: float, y: float) -> tuple[float, float]:
        """Position of a point of the boulder, given relative to the common centre of mass, x forward and y up [m]."""
        c, theta = self.trajectory.motion.constants, float(self.trajectory.rotation_rad[sample])
        sin, cos = math.sin(theta), math.cos(theta)
        centre = c.c_x + float(self.trajectory.boulder_displacement_m[sample])
        return centre + x * cos + y * sin, -c.z_0 - x * sin + y * cos

    def _boulder(self, sample: int) -> list[SceneItem]:
        motion = self.trajectory.motion
        c, body = motion.constants, motion.body
        corners = [(x - c.c_x, z - c.c_y) for x, z in self._corners(motion.outline)]
        centre = self._position(sample, body.x - c.c_x, body.y - c.c_y)
        weight = body.m_b * G
        tip = (centre[0], centre[1] - weight * self.metres_per_newton)
        return [
            SceneItem("polygon", "boulder", tuple(self._position(sample, *corner) for corner in corners)),
            SceneItem("circle", "centre", (centre,), radius=0.05),
            SceneItem("arrow", "weight", (centre, tip)),
        ]

    def _faces(self, outline: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Near and far face at heights over the foot, in x from where the boulder is struck [m]."""
        design = self.trajectory.motion.design
        struck, near = (np.interp(z, outline[:, HEIGHT], outline[:, NEAR]) for z in (design.d + design.e, heights))
        return struck - near, struck + np.interp(heights, outline[:, HEIGHT], outline[:, FAR])

    def _corners(self, outline: np.ndarray) -> list[tuple[float, float]]:
        """Corners of a boulder from the near one of its foot around, x from where it is struck, z over the foot."""
        heights = outline[:, HEIGHT]
        near, far = ([*zip(side.tolist(), heights.tolist(), strict=True)] for side in self._faces(outline, heights))
        return [near[0], *far, *near[:0:-1]]

    def _initial(self, outline: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Corners of a boulder where it stands at first, from the near one of its foot around and back to it."""
        corners = [(x, z - self.trajectory.motion.design.d) for x, z in self._corners(outline)]
        return (*corners, corners[0])

    def _face(self, depth: float, *, is_near: bool) -> float:
        """Where a face of the boulder is at a depth, in x from the common centre of mass [m]."""
        motion = self.trajectory.motion
        near, far = self._faces(motion.outline, np.array([motion.design.d - depth]))
        return float((near if is_near else far)[0] - motion.constants.c_x)

    def _wedge(self, sample: int) -> list[SceneItem]:
        """The soil that moves with the boulder: a wedge cut into slices, each moving with its element."""
        c, slope = self.trajectory.motion.constants, wedge_slope(self.trajectory.motion.design.phi)
        levels = [k / 24 * c.d for k in range(25)]
        near = [self._position(sample, self._face(level, is_near=False), c.z_0 - level) for level in levels]
        far = [(x + (c.d - level) * slope, y) for (x, y), level in zip(near, levels, strict=True)]
        return [SceneItem("polygon", "wedge", (*near, *far[::-1]))]

    def _soil_forces(self, sample: int) -> list[SceneItem]:
        motion = self.trajectory.motion
        c = motion.constants
        arrows = []
        for z, force in zip(*soil_profile(motion, sample, SLICES), strict=True):
            length = float(force) * self.metres_per_newton
            if abs(length) < SHORTEST_ARROW_M:
                continue
            # Pressed forward the soil pushes on the far face; pressed back, on the near one.
            x, y = self._position(sample, self._face(float(z), is_near=length >= 0.0), c.z_0 - float(z))
            arrows.append(SceneItem("arrow", "soil_force", ((x - length, y), (x, y))))
        return arrows

    def _contact(self, sample: int) -> list[SceneItem]:
        length = float(self.trajectory.contact_force_N[sample]) * self.metres_per_newton
        if length < SHORTEST_ARROW_M:
            return []
        c, design = self.trajectory.motion.constants, self.trajectory.motion.design
        head = self._position(sample, -c.c_x, design.e + c.z_0)
        return [SceneItem("arrow", "contact_force", ((head[0] - length, head[1]), head))]


def samples_shown(trajectory: Trajectory, most: int, every_s: float) -> np.ndarray:
    """Return the samples of an animation: one every `every_s` seconds, at most `most`."""
    last = len(trajectory) - 1
    duration = float(trajectory.time_s[-1])
    count = min(most, max(2, round(duration / every_s) + 1))
    return np.unique(np.round(np.linspace(0, last, count)).astype(int))


CRUSH_ZONE_M = 1.7
"""Length of the front that is drawn shorter when it is crushed."""
LEAST_LEFT = 0.25
"""Fraction of the zone that always remains visible."""
WHEEL_RADIUS_M = 0.42
BED_LENGTH_M = 6.0


def truck_shapes(trajectory: Trajectory, sample: int) -> list[SceneItem]:
    """Return the truck at one sample.

    The damper's crush m_v (v_0 - v)/c_v stays, the spring's comes and goes with the force; together they are how far
    the front is pushed in. Behind the crush zone everything moves with the vehicle.
    """
    design, inputs = trajectory.motion.design, trajectory.inputs
    x_v = float(trajectory.vehicle_displacement_m[sample])
    lost = design.v_0 - float(trajectory.vehicle_velocity_m_s[sample])
    crush = design.m_v / design.c_v * lost + float(trajectory.contact_force_N[sample]) / design.k_v
    bumper, hood, offset = (inputs[f"{name}_m"] for name in ("bumper_height", "hood_height", "bed_offset"))
    zone = min(max(CRUSH_ZONE_M, crush / (1.0 - LEAST_LEFT)), offset)

    def at(behind: float, height: float) -> tuple[float, float]:
        """Location of a point given by its distance behind the undamaged front."""
        left = min(behind / zone, 1.0)
        return x_v - behind - min(crush, (1.0 - LEAST_LEFT) * zone) * (1.0 - left), height

    roof, cab, end = max(hood + 0.85, 2.2), max(offset - 0.25, zone), offset + BED_LENGTH_M
    nose = ((0.0, bumper), (0.0, hood - 0.25), (0.15, hood), (0.38 * cab, hood + 0.05), (0.55 * cab, roof))
    pane = ((0.44 * cab, hood + 0.1), (0.57 * cab, roof - 0.15), (0.85 * cab, roof - 0.15), (0.85 * cab, hood + 0.1))
    shapes = (
        ("polygon", "truck", ((cab, 0.7), (cab, 1.05), (end, 1.05), (end, 0.7))),
        ("polygon", "bed", ((offset, 1.05), (offset, 2.3), (end, 2.3), (end, 1.05))),
        ("polygon", "truck", (*nose, (cab, roof), (cab, bumper))),
        ("polygon", "window", pane),
        ("line", "bed_edge", ((offset, 0.75), (offset, 2.45))),
        ("circle", "wheel", ((0.36 * cab, WHEEL_RADIUS_M),)),
        ("circle", "wheel", ((offset + 3.2, WHEEL_RADIUS_M),)),
    )
    return [
        SceneItem(kind, style, tuple(at(*corner) for corner in corners), radius=WHEEL_RADIUS_M)
        for kind, style, corners in shapes
    ]


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
    return view.window.height_in(WIDTH_IN) + 0.55


def stage(fig: Figure, view: SideView) -> Axes:
    """Draw everything that does not move."""
    axes = fig.subplots()
    view.window.show(axes)
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
    for place, shape in enumerate(shapes):
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
            drawn = axes.add_patch(FancyArrowPatch(*shape.points, **look, color=style.line, linewidth=style.width))
        elif shape.kind == "circle":
            circle = Circle(shape.points[0], shape.radius, facecolor=style.fill, edgecolor=style.line)
            drawn = axes.add_patch(circle)
        else:
            polygon = Polygon(shape.points, facecolor=style.fill, edgecolor=style.line, linewidth=style.width)
            drawn = axes.add_patch(polygon)
        drawn.set_zorder((1.0 if behind else 2.0) + 0.001 * place)
        drawn.set_clip_on(True)
        artists.append(drawn)
    return artists


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
    target = pictures.checked_kind(path, pictures.ANIMATED)
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
