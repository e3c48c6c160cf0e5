"""Answers as lines for a terminal of 80 columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from boulder_sweep.answers.keys import BOULDER_MASS
from boulder_sweep.answers.lightest import SIDES

if TYPE_CHECKING:
    from boulder_sweep.answers.keys import Key
    from boulder_sweep.answers.need import Need

WIDTH = 80
MOST_LINES = 40
"""Rows that are shown; of more, evenly spaced ones."""
HEADS = {
    "boulder_length_m": ("L", "m"),
    "boulder_width_m": ("W", "m"),
    "boulder_height_m": ("H", "m"),
    "boulder_density_kg_m3": ("rock", "kg/m³"),
    "embedment_depth_m": ("depth", "m"),
    "embedment_ratio": ("ratio", "d/H"),
    "impact_height_m": ("blow", "m"),
    "soil_density_kg_m3": ("soil", "kg/m³"),
    "friction_angle_deg": ("φ′", "deg"),
    "subgrade_reaction_MN_m3": ("β", "MN/m³"),
    "strain_rate_factor": ("K_ε", ""),
    "vehicle_mass_kg": ("truck", "kg"),
    "impact_speed_m_s": ("speed", "m/s"),
    "vehicle_spring_N_m": ("spring", "N/m"),
    "vehicle_damper_N_s_m": ("damper", "N s/m"),
    "bumper_height_m": ("bumper", "m"),
    "hood_height_m": ("hood", "m"),
    "bed_offset_m": ("bed", "m"),
}
"""Name and unit over the column of an input."""
NOTES = {
    "always": "≤, ≥: passes in the whole range that was searched, also at this end of it",
    "never": "never: passes nowhere in the range that was searched",
    "not_monotone": "*: fails again further on; passes_within in the table (-o) lists what passes",
    "blocked_by_overlap": "blocked: fails up to where the truck would pass over the boulder",
}
SHORT = {"as_printed": "printed", "corrected": "corrected"}

Row = Mapping[str, Any]
Cell = Callable[[Row], str]
Column = tuple[tuple[str, str], Cell]


def need_lines(need: Need, width: int = WIDTH, most: int = MOST_LINES) -> list[str]:
    """Return the answers as lines.

    Parameters
    ----------
    need
        The answers.
    width
        Columns of the terminal; what does not fit is left out, the least important first.
    most
        Rows shown at most.

    Returns
    -------
    list of str
        Head, one line a row, and what the words in them mean.
    """
    count = len(need)
    shown = range(count) if count <= most else [place * (count - 1) // (most - 1) for place in range(most)]
    rows = [need.arrow.slice(place, 1).to_pylist()[0] for place in shown]
    lines = table_lines(need_columns(need), rows, width)
    if count > most:
        lines.append(f"({most} of {count:,} rows, evenly spaced; -o writes them all)")
    occurring = {row[name] for row in rows for name in row if name.startswith("found")}
    lines += [note for word, note in NOTES.items() if word in occurring]
    return lines


def need_columns(need: Need) -> list[Column]:
    """Return the columns of a terminal table: what varies, the answer, what follows from it."""
    key = need.key
    open_ = (key.name, *need.derived)
    columns = [(HEADS[name], _number(name)) for name in HEADS if name not in open_ and _varies(need, name)]
    if key.name == BOULDER_MASS.name:
        columns.append((("mass", "kg"), _answer(key, "")))
        columns += [(HEADS[name], _size(name)) for name in (*SIDES, "embedment_depth_m")]
        columns.append((("margin", ""), _margin))
        return columns + [((SHORT[name], key.field.unit), _answer(key, f"_{name}")) for name in need.others]
    columns.append((HEADS[key.name], _answer(key, "")))
    if key.name == "embedment_depth_m":
        columns.append((("ratio", "d/H"), _ratio))
        columns.append((("above", "m"), _above_ground))
    columns += [(("mass", "t"), _mass), (("margin", ""), _margin)]
    columns += [((SHORT[name], key.field.unit), _answer(key, f"_{name}")) for name in need.others]
    return columns


def table_lines(columns: Sequence[Column], rows: Sequence[Row], width: int) -> list[str]:
    """Return a table as lines not longer than a width; columns that do not fit are left out, the last ones first."""
    texts = [[*head, *(cell(row) for row in rows)] for head, cell in columns]
    widths = [max(map(len, column)) for column in texts]
    while len(widths) > 1 and sum(widths) + 2 * (len(widths) - 1) > width:
        texts.pop()
        widths.pop()
    lines = [
        "  ".join(text.rjust(own) for text, own in zip(line, widths, strict=True)) for line in zip(*texts, strict=True)
    ]
    return [*lines[:2], "  ".join("─" * own for own in widths), *lines[2:]]


def _varies(need: Need, name: str) -> bool:
    """Whether an input differs between rows."""
    return name in need.arrow.column_names and len(need.arrow[name].unique()) > 1


def _number(name: str) -> Cell:
    return lambda row: f"{row[name]:.5g}"


def _size(name: str) -> Cell:
    """Return what shows a side of the boulder, or its depth, where there is an answer."""
    return lambda row: "" if row["passes_at"] is None else f"{row[name]:.3f}"


def _answer(key: Key, suffix: str) -> Cell:
    """Return what shows the answer by some readings."""
    decimals = max(0, -math.floor(math.log10(key.tolerance) + 1e-9))
    name, found = f"{key.answer}{suffix}", f"found{suffix}"

    def cell(row: Row) -> str:
        if row[name] is None:
            return "blocked" if row[found] == "blocked_by_overlap" else str(row[found])
        before = {"always": "≥" if key.most else "≤"}.get(row[found], "")
        return f"{before}{row[name]:.{decimals}f}{'*' if row[found] == 'not_monotone' else ''}"

    return cell


def _ratio(row: Row) -> str:
    if row["passes_at"] is None:
        return ""
    return f"{row['embedment_depth_m'] / row['boulder_height_m']:.3f}"


def _above_ground(row: Row) -> str:
    if row["passes_at"] is None:
        return ""
    return f"{row['boulder_height_m'] - row['embedment_depth_m']:.2f}"


def _mass(row: Row) -> str:
    return f"{row['boulder_mass_kg'] / 1000:.1f}"


def _margin(row: Row) -> str:
    if row["margin"] is None or row["passes_at"] is None:
        return ""
    return f"{row['margin']:.1%}"
