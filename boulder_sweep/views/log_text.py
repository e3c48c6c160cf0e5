"""The log of a borehole or of a cone as text: readings over depth, the layers made of them, and the foot."""

from __future__ import annotations

from typing import Any

from boulder_sweep.settings.soil_readings import log_title, shown_readings, strength
from boulder_sweep.settings.units import SYSTEMS, shown_unit
from boulder_sweep.text import counted

MOST_ROWS = 18
"""Most rows of readings."""
_BAR = 24


def log_lines(data: dict[str, Any], units: str = SYSTEMS[0]) -> list[str]:
    """Return a log, one of ``derived["soil"]`` of a sweep, as lines of plain characters, none longer than 80.

    Readings below the first one under the deepest foot are counted only, and of many the weaker ones stand for their
    neighbours. Depths are in ``si`` or ``us`` units.
    """
    length, metres = shown_unit("m", units)
    shown = shown_readings(data)
    each = -(-len(shown) // MOST_ROWS)
    rows = [min(shown[at : at + each], key=strength) for at in range(0, len(shown), each)]
    most = max(*map(strength, rows), 1e-9)
    marks = [(one["depth_m"], 1, f"{one['depth_m'] / metres:>9.2f} {_row(one, most)}") for one in rows]
    for at, layer in enumerate(data.get("layers", ())):
        words = f"--- from {layer['from_m'] / metres:.3g} {length}: {layer_words(data, layer, at)} "
        marks.append((layer["from_m"], 0, words.ljust(78, "-")))
    if "foot_m" in data:
        words = f"=== deepest foot of a boulder, {data['foot_m'] / metres:.4g} {length} "
        marks.append((data["foot_m"], 2, words.ljust(78, "=")))
    left = len(data["readings"]) - len(shown)
    return [
        log_title(data),
        f"{f'depth [{length}]':>9} {quantity(data):>9} {'angle [deg]':>11}",
        *(line for *_, line in sorted(marks)),
        *([f"{counted(left, 'deeper reading')} left out"] if left else []),
    ]


def quantity(data: dict[str, Any]) -> str:
    """Return the quantity of which a log has readings, with its unit."""
    return "q_c [MPa]" if data["method"] == "cpt" else "N" if "n" in data["readings"][0] else "(N1)60"


def _row(reading: dict[str, Any], most: float) -> str:
    value = f"{'>' if reading.get('at_least') else ''}{strength(reading):.3g}"
    angle = f"{reading['friction_angle_deg']:.1f}" if "friction_angle_deg" in reading else "-"
    bar = "#" * max(1, round(_BAR * strength(reading) / most))
    why = f"  left out: {reading['left_out']}" if "left_out" in reading else ""
    return f"{value:>9} {angle:>11}  {bar}{why}"


def layer_words(data: dict[str, Any], layer: dict[str, Any], at: int) -> str:
    """Return the friction angle that is taken of a layer."""
    if "friction_angle_deg" not in layer:
        return ""
    mean = f"{layer['friction_angle_deg']:.1f} deg, sd {layer['friction_angle_sd_deg']:.1f} deg"
    if data.get("weakest_layer", at) != at:
        return f"{mean}, not taken"
    weak = f"taken as {layer['weak']['friction_angle_deg']:.1f} deg, the 5 % of " if "weak" in layer else ""
    return f"{weak}{mean}"
