"""The shapes and styles of a side view."""

from __future__ import annotations

from typing import NamedTuple


class Shape(NamedTuple):
    """One thing to draw; lengths in metres."""

    kind: str
    """``polygon``, ``line``, ``arrow``, ``circle`` or ``text``."""
    style: str
    """What it is, key of `STYLES`."""
    points: tuple[tuple[float, float], ...]
    """Corners; tail and head of an arrow; centre of a circle; place of a text."""
    text: str = ""
    radius: float = 0.0


class Style(NamedTuple):
    """Style of a shape."""

    fill: str = "none"
    line: str = "none"
    width: float = 0.0
    """Of the line, in points."""
    dash: tuple[float, ...] = ()
    size: float = 9.0
    """Of a text, in points."""


STYLES: dict[str, Style] = {
    "soil": Style(fill="#EADFCB"),
    "wedge": Style(fill="#CBB48A", line="#A68A5B", width=0.8),
    "first_place": Style(line="#8A8A8A", width=1.0, dash=(4.0, 3.0)),
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
