"""The figures of the page: plots made by Bokeh, and the recommended design as a section to scale.

The plots are named empty figures that the page fills with what it simulates. The section has dimensions and the soil as
it lies; the template draws it.

Nothing here runs its own code in the browser (Bokeh's CustomJS would need a policy that allows text as code); the
page's script finds figures and sources by name and sets their data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, HoverTool, TapTool
from bokeh.models.annotations import BoxAnnotation, Legend
from bokeh.plotting import figure

from boulder_sweep.settings.model import BOX, Ground, ProfilePoint, Shape
from boulder_sweep.views.pictures import VERDICTS

COLOURS = {**VERDICTS, "none": "#BBBBBB"}
"""Colours of verdicts, as in `sweep plot`."""
HATCHES = {"sensitive": "/", "open": "."}
"""Patterns of passes that are not robust, by their grade."""
LINES = ("#1E88C9", "#D55E00", "#009E73")
PARTS = {
    "vehicle_kinetic": ("vehicle, moving", "#0072B2"),
    "crush_damper": ("vehicle, crushed for good", "#56B4E9"),
    "crush_spring": ("vehicle, sprung", "#B3DDF5"),
    "boulder_linear": ("boulder, moving", "#D55E00"),
    "boulder_angular": ("boulder, turning", "#E69F00"),
    "gravity": ("boulder, lifted", "#F0E442"),
    "soil_elastic": ("soil, pressed", "#009E73"),
    "soil_drag": ("soil, dragged", "#7FCFB5"),
}
"""Energies in stacking order: word and colour."""
LEFT, RIGHT = 5.3, 4.3
"""How much is drawn before and behind the boulder [m]: room for constants of the soil there, and dimensions here."""
PLAN = 1.7, 2.3
"""Room before and behind the boulder in the plan [m]: for the arrow of the truck, and for the width."""
BARS = {"si": (2.0, "2 m"), "us": (1.524, "5 ft")}
"""Length of the scale bar [m], and how it is called."""
SKY, BELOW = 0.5, 0.5
"""Room above what stands, and below the boulder [m]."""
LINE = 0.34
"""Distance of lines of text [m]."""
CAB_M = 0.85
"""How far the cab stands above the hood."""


def curves(panel: str) -> list[figure]:
    """Return the figures of one simulated design.

    Parameters
    ----------
    panel
        Name of the part of the page; the names of figures and sources begin with it.
    """
    motion = ColumnDataSource(
        {name: [0.0, 1.0] for name in ("time", "rotation", "limit", "boulder", "vehicle", "force")},
        name=f"{panel}-motion",
    )
    energies = ColumnDataSource({name: [0.0, 1.0] for name in ("time", *PARTS)}, name=f"{panel}-energies")
    rotation = _plot(panel, "rotation", [("time", "@time{0.000} s"), ("rotation", "@rotation{0.00}")])
    rotation.line("time", "rotation", source=motion, line_width=2, color=LINES[0])
    rotation.line("time", "limit", source=motion, line_width=2, color=LINES[1], line_dash="dashed")
    displacement = _plot(
        panel,
        "displacement",
        [("time", "@time{0.000} s"), ("vehicle", "@vehicle{0.000}"), ("boulder", "@boulder{0.000}")],
    )
    displacement.line("time", "vehicle", source=motion, line_width=2, color=LINES[0], legend_label="vehicle")
    displacement.line(
        *("time", "boulder"), source=motion, line_width=2, color=LINES[1], line_dash="dashed", legend_label="boulder"
    )
    force = _plot(panel, "force", [("time", "@time{0.000} s"), ("force", "@force{0.0}")])
    force.line("time", "force", source=motion, line_width=2, color=LINES[0])
    energy = _plot(panel, "energy", [])
    energy.varea_stack(
        list(PARTS),
        x="time",
        source=energies,
        color=[colour for _, colour in PARTS.values()],
        legend_label=[words for words, _ in PARTS.values()],
    )
    for plot in (displacement, energy):
        beside = plot.legend[0]
        plot.add_layout(beside, "right")
        # The page shows this one in place of the other on narrow screens.
        below = Legend(items=beside.items, visible=False, location="top_left", spacing=4, margin=0)
        below.glyph_width, below.glyph_height = 14, 14
        plot.add_layout(below, "below")
    figures = [rotation, displacement, force, energy]
    for plot in figures:
        plot.x_range = DataRange1d(range_padding=0)
        beyond = BoxAnnotation(left=0, right=0, fill_color="#888888", fill_alpha=0.25, level="overlay")
        beyond.name = f"{plot.name}-beyond"
        plot.add_layout(beyond)
    return figures


def verdict_map(panel: str) -> figure:
    """Return a map of verdicts: rectangles over two inputs, which can be chosen."""
    sides: dict[str, Any] = {side: side for side in ("left", "right", "bottom", "top")}
    cells = ColumnDataSource({**{side: [0.0] for side in sides}, "colour": ["white"]}, name=f"{panel}-cells")
    plot = _plot(panel, "map", [("", "@verdict"), ("across", "@across{0.000a}"), ("up", "@up{0.000a}")], height=420)
    drawn = plot.quad(
        **sides,
        source=cells,
        fill_color="colour",
        line_color="colour",
        line_width=0.5,
        nonselection_fill_alpha=1.0,
        nonselection_line_alpha=1.0,
        selection_line_color="black",
    )
    # One glyph for each pattern: Bokeh makes canvases for every rectangle where patterns differ within a glyph.
    for grade, pattern in HATCHES.items():
        hatched = ColumnDataSource({side: [] for side in sides}, name=f"{panel}-{grade}")
        plot.quad(
            **sides,
            source=hatched,
            fill_color=None,
            line_color=None,
            hatch_pattern=pattern,
            hatch_color="white",
            hatch_scale=8,
        )
    plot.hover.renderers = [drawn]
    plot.add_tools(TapTool(renderers=[drawn]))
    here = ColumnDataSource({"x": [0.0], "y": [0.0]}, name=f"{panel}-here")
    plot.scatter("x", "y", source=here, marker="cross", size=18, line_width=3, line_color="white", level="overlay")
    plot.scatter("x", "y", source=here, marker="cross", size=16, line_width=1.5, line_color="black", level="overlay")
    plot.grid.visible = False
    return plot


def _plot(panel: str, kind: str, tooltips: list[tuple[str, str]], height: int = 240) -> figure:
    """Return an empty figure in the style of the page."""
    plot = figure(
        name=f"{panel}-{kind}",
        height=height,
        sizing_mode="stretch_width",
        toolbar_location=None,
        tools=[],
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
    )
    if tooltips:
        hover = HoverTool(tooltips=tooltips, mode="mouse" if kind == "map" else "vline")
        hover.name = f"{panel}-{kind}-hover"
        plot.add_tools(hover)
    plot.xaxis.name, plot.yaxis.name = f"{panel}-{kind}-x", f"{panel}-{kind}-y"
    for axis in (plot.xaxis, plot.yaxis):
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "13px"
    return plot


class Dimension(NamedTuple):
    """A dimension line between two points [m], y upwards from the ground, with its name and value."""

    x0: float
    y0: float
    x1: float
    y1: float
    name: str
    value: float
    at_x: float
    at_y: float
    anchor: str


class Stratum(NamedTuple):
    """A layer of the soil as drawn: its upper and lower boundary [m] below the ground and its constants."""

    top: float
    bottom: float
    text_y: float
    constants: tuple[tuple[str, float, str], ...]
    """Name, value and unit of each."""


class Sketch(NamedTuple):
    """What the template draws; lengths in metres, y upwards from the ground, x from the struck face."""

    corners: tuple[tuple[float, float], ...]
    """Corners of the boulder, beginning with the near one of its foot."""
    at_water: float
    """Where the far face is at the water table; at the foot or the top where it lies beyond them."""
    bumper: float
    hood: float
    roof: float
    left: float
    ground: float
    """Where the ground of the elevation ends and the plan begins."""
    right: float
    """Where the ground of the plan ends."""
    top: float
    bottom: float
    dimensions: tuple[Dimension, ...]
    strata: tuple[Stratum, ...]
    water: float | None
    plan: tuple[float, float, float, float]
    """The boulder from above: x of its near side and y of its upper one, length and width."""
    bar: tuple[float, str]


def sketch_of(
    inputs: Mapping[str, float], settings: Mapping[str, Any], units: str = "si", profile: Sequence[ProfilePoint] = ()
) -> Sketch:
    """Return elevation and plan of a design.

    Parameters
    ----------
    inputs
        Its inputs by the columns of the table.
    settings
        Resolved settings of its sweep, which say how the soil lies.
    units
        ``si`` or ``us``, of the scale bar.
    profile
        Shape of this boulder, where the settings name none.
    """
    length, width, height = (inputs[f"boulder_{side}_m"] for side in ("length", "width", "height"))
    depth = inputs["embedment_depth_m"]
    bumper, hood = inputs["bumper_height_m"], inputs["hood_height_m"]
    ground = Ground.of_dict(settings["model"].get("ground", {}))
    above, roof = height - depth, hood + CAB_M
    bottom = -depth - BELOW
    points = profile or Shape.of_model(settings["model"]).points or BOX
    shares = np.array([(point.height, point.near, point.far) for point in points])
    heights, near, far = (shares * (height, length, length)).T
    struck = float(np.interp(depth + inputs["impact_height_m"], heights, near))
    front, back = struck - near, struck + far
    around = [*zip(front, heights, strict=True), *reversed([*zip(back, heights, strict=True)])]
    water = depth - (ground.water_table_m or 0.0)
    first, last = float(front.min()), float(back.max())
    beside = last + 0.35
    low = -depth / 2 if abs((ground.water_table_m or 0.0) - depth) < 2 * LINE else -depth + 0.12  # beside its words
    ends = last + RIGHT
    # The plan lies as high as the middle of the elevation, so that the two are read together.
    wide, middle = ends + PLAN[0] + length, (above + 0.6 - depth) / 2
    upper, lower = middle + width / 2, middle - width / 2

    def across(left: float, right: float, y: float, name: str) -> Dimension:
        return Dimension(left, y + 0.2, right, y + 0.2, name, right - left, left + 0.15, y + 0.3, "start")

    def upright(x: float, low: float, high: float, name: str, at: float) -> Dimension:
        return Dimension(x, low, x, high, name, high - low, x + 0.12, at, "start")

    dimensions = (
        upright(beside, 0.0, above, "above", above / 2 - 0.1),
        upright(beside, -depth, 0.0, "d =", low),
        upright(last + 2.6, -depth, above, "H =", max(above / 2 - 0.1, 0.2)),
        across(first, last, above, "L =")._replace(value=length),  # the sides may lean
        Dimension(-3.0, 0.0, -3.0, bumper, "bumper", bumper, -3.12, 0.12, "end"),
        across(wide - length, wide, upper, "L ="),
        upright(wide + 0.35, lower, upper, "W =", middle - 0.1),
    )
    tops = [0.0, *(layer.from_m for layer in ground.layers)]
    names = ("friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3")
    soils = [(*(inputs[name] for name in names), ground.cohesion_kPa)]
    soils += [
        (layer.friction_angle_deg, layer.density_kg_m3, layer.subgrade_reaction_MN_m3, layer.cohesion_kPa)
        for layer in ground.layers
    ]
    # The ground is drawn as deep as its deepest boundary within two heights of the boulder.
    known = [*tops, ground.water_table_m or 0.0]
    bottom = min(bottom, -max(level for level in known if level <= 2 * height) - BELOW)
    bottom = min(bottom, -(3 + (ground.cohesion_kPa > 0) + bool(ground.layers)) * LINE * len(tops) - 0.3)
    strata = []
    written = 0.0
    for k, (top, constants) in enumerate(zip(tops, soils, strict=True)):
        if -top <= bottom:
            break
        under = min(tops[k + 1] if k + 1 < len(tops) else -bottom, -bottom)
        symbols = (("φ′", "deg"), ("ρ", "kg/m^3"), ("β", "MN/m^3"), ("c", "kPa"))
        named = (
            *((("from", top, "m"),) if ground.layers else ()),
            *(
                (name, value, unit)
                for (name, unit), value in zip(symbols, constants, strict=True)
                if name != "c" or value
            ),
        )
        first = max(top, written) + LINE
        written = first + (len(named) - 1) * LINE
        strata.append(Stratum(top, under, -first, named))
    bottom = min(bottom, -written - 0.2)
    strata[-1] = strata[-1]._replace(bottom=-bottom)
    return Sketch(
        corners=tuple((float(x), float(z) - depth) for x, z in around),
        at_water=float(np.interp(water, heights, back)),
        bumper=bumper,
        hood=hood,
        roof=roof,
        left=-LEFT,
        ground=ends,
        right=wide + PLAN[1],
        top=max(above + 0.6, roof) + SKY,
        bottom=bottom,
        dimensions=dimensions,
        strata=tuple(strata),
        water=ground.water_table_m,
        plan=(wide - length, upper, length, width),
        bar=BARS[units],
    )
