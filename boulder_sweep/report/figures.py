"""The figures of the page: plots made by Bokeh, the recommended design as a section to scale, and logs of the ground.

The plots are named empty figures that the page fills with what it simulates. The template draws the others: the section
with dimensions and the soil as it lies, and of a borehole or a cone the readings over depth with their layers.

Nothing here runs its own code in the browser (Bokeh's CustomJS would need a policy that allows text as code); the
page's script finds figures and sources by name and sets their data.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, HoverTool, TapTool
from bokeh.models.annotations import BoxAnnotation
from bokeh.plotting import figure

from boulder_sweep.settings.model import BOX, Ground, ProfilePoint, Shape
from boulder_sweep.settings.soil_readings import log_title, shown_readings, strength
from boulder_sweep.settings.units import shown_unit
from boulder_sweep.views.log_text import layer_words, quantity
from boulder_sweep.views.pictures import VERDICTS

COLOURS = {**VERDICTS, "none": "#BBBBBB"}
"""Colours of verdicts, as in `sweep plot`."""
HATCHES = {"sensitive": "/", "open": "."}
"""Patterns of passes that are not robust, by their grade."""
TEXT, RULE = "#1d2329", "#c9d1d8"
"""Colours of words and of axes, as in the style of the page."""
HEIGHT_PX, LEGEND_LINE_PX = 240, 22
"""Height of the curves, and of a line of a legend below them, which has two entries."""
LINES = ("#1E88C9", "#D55E00", "#009E73")
PARTS = {
    "vehicle_kinetic": ("vehicle, moving", "#0072B2"),
    "crush_damper": ("vehicle, crushed", "#56B4E9"),
    "crush_spring": ("vehicle, sprung", "#B3DDF5"),
    "boulder_linear": ("boulder, moving", "#D55E00"),
    "boulder_angular": ("boulder, turning", "#E69F00"),
    "gravity": ("boulder, lifted", "#F0E442"),
    "soil_elastic": ("soil, pressed", "#009E73"),
    "soil_drag": ("soil, dragged", "#7FCFB5"),
}
"""Energies in stacking order: word and colour."""
LEFT, RIGHT = 5.3, 4.7
"""How much is drawn before and behind the boulder [m]: room for constants of the soil there, and dimensions here."""
PLAN = 1.7, 2.45
"""Room before and behind the boulder in the plan [m]: for the arrow of the truck, and for the width."""
BARS = {"si": (2.0, "2 m"), "us": (1.524, "5 ft")}
"""Length of the scale bar [m], and how it is called."""
SKY, BELOW = 0.5, 0.7
"""Room above what stands, and below the boulder [m]."""
LINE = 0.34
"""Distance of lines of text [m]."""
CAB_M = 0.85
"""How far the cab stands above the hood."""
_TICKS = 5
"""Intervals of an axis, about."""
_LINE = 0.07
"""Distance of lines of text, as a share of the axis of depth."""


def curves(panel: str) -> list[figure]:
    """Return the figures of one simulated design; their names and the names of their sources begin with the panel's."""
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
        height=HEIGHT_PX + LEGEND_LINE_PX,
    )
    displacement.line("time", "vehicle", source=motion, line_width=2, color=LINES[0], legend_label="vehicle")
    displacement.line(
        *("time", "boulder"), source=motion, line_width=2, color=LINES[1], line_dash="dashed", legend_label="boulder"
    )
    force = _plot(panel, "force", [("time", "@time{0.000} s"), ("force", "@force{0.0}")])
    force.line("time", "force", source=motion, line_width=2, color=LINES[0])
    energy = _plot(panel, "energy", [], height=HEIGHT_PX + len(PARTS) // 2 * LEGEND_LINE_PX)
    energy.varea_stack(
        list(PARTS),
        x="time",
        source=energies,
        color=[colour for _, colour in PARTS.values()],
        legend_label=[words for words, _ in PARTS.values()],
    )
    for plot in (displacement, energy):
        (legend,) = plot.legend
        legend.ncols, legend.spacing, legend.glyph_width, legend.glyph_height = 2, 10, 20, 14
        legend.label_text_color, legend.background_fill_color, legend.border_line_color = TEXT, None, None
        plot.add_layout(legend, "below")
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


def _plot(panel: str, kind: str, tooltips: list[tuple[str, str]], height: int = HEIGHT_PX) -> figure:
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
        axis.axis_label_text_color = axis.major_label_text_color = TEXT
        axis.axis_line_color = axis.major_tick_line_color = axis.minor_tick_line_color = RULE
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "13px"
    plot.grid.grid_line_color = RULE
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
    truck: float
    """Where the front of the truck is; before 0 where the boulder leans out below the blow."""
    plan: tuple[float, float, float, float]
    """The boulder from above: x of its near side and y of its upper one, greatest length and width."""
    foot: tuple[float, float, float, float] | None
    """The same of its foot, where that is smaller."""
    bar: tuple[float, str]


def sketch_of(
    inputs: Mapping[str, float], settings: Mapping[str, Any], units: str = "si", profile: Sequence[ProfilePoint] = ()
) -> Sketch:
    """Return elevation and plan of a design, whose inputs go by the columns of the table.

    The settings say how the soil lies; the scale bar is in the units; the profile is the shape of this boulder
    where the settings name none.
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
    edge, last = float(front.min()), float(back.max())
    beside = last + 0.35
    low = -depth / 2 if abs((ground.water_table_m or 0.0) - depth) < 2 * LINE else -depth + 0.12  # beside its words
    ends = last + RIGHT
    # The plan lies as high as the middle of the elevation, so that the two are read together.
    wide, middle = ends + PLAN[0] + length, (above - depth) / 2
    upper, lower = middle + width / 2, middle - width / 2
    foot = float(near[0] + far[0]), points[0].width * width
    stands_out = foot[0] < 0.99 * length or foot[1] < 0.99 * width

    def upright(x: float, low: float, high: float, name: str, at: float) -> Dimension:
        return Dimension(x, low, x, high, name, high - low, x + 0.12, at, "start")

    dimensions = (
        upright(beside, 0.0, above, "above", above / 2 - 0.1),
        upright(beside, -depth, 0.0, "d =", low),
        upright(last + 2.7, -depth, above, "H =", middle - 0.1),
        # Below the foot, where it is clear of the truck; the sides may lean.
        Dimension(edge, -depth - 0.2, last, -depth - 0.2, "L =", length, edge, -depth - 0.54, "start"),
        Dimension(-3.0, 0.0, -3.0, bumper, "bumper", bumper, -3.12, 0.12, "end"),
        Dimension(wide - length, upper + 0.2, wide, upper + 0.2, "L =", length, wide - length, upper + 0.36, "start"),
        upright(wide + 0.35, lower, upper, "W =", middle - 0.1),
    )
    tops = [0.0, *(layer.from_m for layer in ground.layers)]
    names = ("friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3")
    soils = [(*(inputs[name] for name in names), ground.cohesion_kPa)]
    soils += [
        (layer.friction_angle_deg, layer.density_kg_m3, layer.subgrade_reaction_MN_m3, layer.cohesion_kPa)
        for layer in ground.layers
    ]
    has_cohesion = any(constants[-1] for constants in soils)
    # The ground is drawn as deep as its deepest boundary within two heights of the boulder.
    known = [*tops, ground.water_table_m or 0.0]
    bottom = min(bottom, -max(level for level in known if level <= 2 * height) - BELOW)
    bottom = min(bottom, -(2 + (has_cohesion and len(tops) > 1)) * LINE * len(tops) - 0.3)
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
                if name != "c" or has_cohesion
            ),
        )
        first = max(top, written) + LINE
        written = first + (len(named) - 1) // 2 * LINE  # two to a line
        strata.append(Stratum(top, under, -first, named))
    bottom = min(bottom, -written - 0.2, lower - 1.0)
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
        top=max(above, roof, upper + 0.75) + SKY,
        bottom=bottom,
        dimensions=dimensions,
        strata=tuple(strata),
        water=ground.water_table_m,
        truck=min(float(np.interp(depth + bumper, heights, front)), *front[heights >= depth + bumper].tolist(), 0.0),
        plan=(wide - length, upper, length, width),
        foot=(wide - length + float(front[0]) - edge, middle + foot[1] / 2, *foot) if stands_out else None,
        bar=BARS[units],
    )


class Reading(NamedTuple):
    """A reading: its depth [m], its value, whether the ground may be stronger, and why it does not count, if so."""

    depth: float
    value: float
    at_least: bool
    left_out: str


class Label(NamedTuple):
    """Words beside the figure: the depth where they stand [m], and a length that follows them, if any [m]."""

    at: float
    words: str
    length: float | None


class LogChart(NamedTuple):
    """What the template draws of a log; depths [m] below the ground."""

    title: str
    quantity: str
    readings: tuple[Reading, ...]
    layers: tuple[tuple[float, float], ...]
    """Upper and lower boundary of each layer."""
    foot: float | None
    labels: tuple[Label, ...]
    depths: tuple[float, ...]
    """Ticks of the depth; the last one is the end of the axis."""
    values: tuple[float, ...]
    """Ticks of the value; the last one is the end of the axis."""


def log_charts(settings: Mapping[str, Any], units: str = "si") -> list[LogChart]:
    """Return a figure of each log from which the soil was taken; depths are marked at round numbers in the units."""
    return [
        _chart(data, shown_unit("m", units)[1]) for data in settings.get("derived", {}).get("soil", ()) if "log" in data
    ]


def _chart(data: dict[str, Any], size: float) -> LogChart:
    """Return the figure of a log; depths are marked in a unit of so many metres."""
    readings = tuple(
        Reading(one["depth_m"], strength(one), bool(one.get("at_least")), one.get("left_out", ""))
        for one in shown_readings(data)
    )
    foot = data.get("foot_m")
    deepest = max([reading.depth for reading in readings] + ([] if foot is None else [foot]))
    depths = tuple(depth * size for depth in _ticks(deepest / size))
    layers = [layer for layer in data.get("layers", ()) if layer["from_m"] < depths[-1]]
    words = [Label(layer["from_m"], layer_words(data, layer, at), None) for at, layer in enumerate(layers)]
    words += [] if foot is None else [Label(foot, "deepest foot", foot)]
    return LogChart(
        log_title(data),
        quantity(data),
        readings,
        tuple((layer["from_m"], min(layer["to_m"], depths[-1])) for layer in layers),
        foot,
        tuple(_apart(sorted(words), _LINE * depths[-1])),
        depths,
        _ticks(max(reading.value for reading in readings)),
    )


def _apart(labels: list[Label], distance: float) -> Iterator[Label]:
    """Yield labels from the top down, moved down where one would touch another."""
    free = 0.5 * distance
    for label in labels:
        at = max(label.at, free)
        free = at + distance
        yield label._replace(at=at)


def _ticks(most: float) -> tuple[float, ...]:
    """Return round numbers from 0 to the first one that is `most` or more."""
    rough = max(most, 1e-9) / _TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough)
    return tuple(round(float(tick), 9) for tick in step * np.arange(np.ceil(most / step - 1e-9) + 1))
