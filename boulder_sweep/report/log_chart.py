"""The log of a borehole or of a cone as a figure of the page: readings over depth, their layers, the deepest foot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.settings.soil_readings import log_title, shown_readings, strength
from boulder_sweep.settings.shown_units import shown_unit
from boulder_sweep.views.log_text import layer_words, quantity

_TICKS = 5
"""Intervals of an axis, about."""
_LINE = 0.07
"""Distance of lines of text, as a share of the axis of depth."""


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
    """Return a figure of each log from which the soil of a sweep was taken.

    Parameters
    ----------
    settings
        Resolved settings of the sweep.
    units
        ``si`` or ``us``: depths are marked at round numbers in these.
    """
    return [_chart(data, shown_unit("m", units)[1]) for data in settings.get("derived", {}).get("soil", ()) if "log" in data]


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
