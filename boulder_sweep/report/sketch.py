"""The recommended design on the first page: a section to scale with dimensions, and the soil as it lies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.settings.model import Ground
from boulder_sweep.settings.shape import BOX, Shape

LEFT, RIGHT = 5.4, 4.0
"""How much is drawn before and behind the boulder [m]: room for constants of the soil there, and dimensions here."""
SKY, BELOW = 0.5, 0.5
"""Room above what stands, and below the boulder [m]."""
TEXT, LINE = 0.26, 0.34
"""Height of letters, and distance of lines [m]."""
CAB_M = 0.85
"""How far the cab stands above the hood."""


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
    """Of the boulder, from the near one of its foot around."""
    at_water: float
    """Where the far face is at the water table; at the foot or the top where it lies beyond them."""
    bumper: float
    hood: float
    roof: float
    left: float
    right: float
    top: float
    bottom: float
    dimensions: tuple[Dimension, ...]
    strata: tuple[Stratum, ...]
    water: float | None


def sketch_of(inputs: Mapping[str, float], settings: Mapping[str, Any]) -> Sketch:
    """Return the section of a design.

    Parameters
    ----------
    inputs
        Its inputs by the columns of the table.
    settings
        Resolved settings of its sweep, which say how the soil lies.
    """
    length, height, depth = (inputs[name] for name in ("boulder_length_m", "boulder_height_m", "embedment_depth_m"))
    bumper, hood = inputs["bumper_height_m"], inputs["hood_height_m"]
    ground = Ground.of_dict(settings["model"].get("ground", {}))
    above, roof = height - depth, hood + CAB_M
    bottom = -depth - BELOW
    points = Shape.of_model(settings["model"]).points or BOX
    shares = np.array([(point.height, point.near, point.far) for point in points])
    heights, near, far = (shares * (height, length, length)).T
    struck = float(np.interp(depth + inputs["impact_height_m"], heights, near))
    front, back = struck - near, struck + far
    around = [*zip(front, heights, strict=True), *reversed([*zip(back, heights, strict=True)])]
    water = depth - (ground.water_table_m or 0.0)
    first, last = float(front.min()), float(back.max())
    beside = last + 0.35
    low = -depth / 2 if abs((ground.water_table_m or 0.0) - depth) < 2 * LINE else -depth + 0.12  # beside its words
    dimensions = (
        Dimension(beside, 0.0, beside, above, "above ground", above, beside + 0.12, above / 2, "start"),
        Dimension(beside, -depth, beside, 0.0, "embedment", depth, beside + 0.12, low, "start"),
        Dimension(first, above + 0.2, last, above + 0.2, "length", length, first, above + 0.3, "start"),
        Dimension(-3.0, 0.0, -3.0, bumper, "bumper", bumper, -3.12, 0.12, "end"),
    )
    tops = [0.0, *(layer.from_m for layer in ground.layers)]
    own = [
        (
            inputs["friction_angle_deg"],
            inputs["soil_density_kg_m3"],
            inputs["subgrade_reaction_MN_m3"],
            ground.cohesion_kPa,
        ),
        *(
            (layer.friction_angle_deg, layer.density_kg_m3, layer.subgrade_reaction_MN_m3, layer.cohesion_kPa)
            for layer in ground.layers
        ),
    ]
    # The ground is drawn as deep as its deepest boundary within two heights of the boulder.
    known = [*tops, ground.water_table_m or 0.0]
    bottom = min(bottom, -max(level for level in known if level <= 2 * height) - BELOW)
    bottom = min(bottom, -(3 + (ground.cohesion_kPa > 0) + bool(ground.layers)) * LINE * len(tops) - 0.3)
    strata = []
    written = 0.0
    for place, (top, constants) in enumerate(zip(tops, own, strict=True)):
        if -top <= bottom:
            break
        under = min(tops[place + 1] if place + 1 < len(tops) else -bottom, -bottom)
        units = (("φ′", "deg"), ("ρ", "kg/m^3"), ("k", "MN/m^3"), ("c", "kPa"))
        named = (
            *((("from", top, "m"),) if ground.layers else ()),
            *(
                (name, value, unit)
                for (name, unit), value in zip(units, constants, strict=True)
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
        right=last + RIGHT,
        top=max(above + 0.6, roof) + SKY,
        bottom=bottom,
        dimensions=dimensions,
        strata=tuple(strata),
        water=ground.water_table_m,
    )
