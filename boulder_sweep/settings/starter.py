"""A commented settings file to begin with, written from the register of entries."""

from __future__ import annotations

import shlex
from typing import Literal

from boulder_sweep.settings.fields import EMBEDMENT, INPUTS, SECTIONS, TO_BE_FOUND, Field, fields_of
from boulder_sweep.settings.shown_units import SYSTEMS, shown_unit
from boulder_sweep.settings.values import describe
from boulder_sweep.text import printable


def default_text(field: Field, units: str = "si") -> str:
    """Return the default of an entry with its unit, to five digits in US units; empty where there is none."""
    value = field.shown_default
    if value is None or isinstance(value, str):
        return value or ""
    unit, size = shown_unit(field.unit, units) if units == "us" else (field.unit, 1.0)
    return describe(value, unit) if size == 1.0 else f"{value / size:.5g} {unit}"


CATEGORIES: dict[str, tuple[tuple[str, str], tuple[int, ...]]] = {
    "M": (("6800 kg", "15000 lb"), (30, 40, 50)),
    "SC": (("1100 kg", "2430 lb"), (30, 40, 50, 60)),
    "FS": (("2100 kg", "4630 lb"), (30, 40, 50, 60)),
    "PU": (("2300 kg", "5070 lb"), (30, 40, 50, 60)),
    "C7": (("7200 kg", "15873 lb"), (30, 40, 50)),
    "H": (("29500 kg", "65000 lb"), (30, 40, 50)),
}
"""Mass in SI and US units and nominal speeds [mph] of each category of ASTM F2656 (``docs/site.md``): small car, sedan,
pick-up, class 7 and heavy truck, after the medium-duty truck of the paper's tests."""
CLASSES = {f"{code}{mph}": (code, mph) for code, (_, speeds) in CATEGORIES.items() for mph in speeds}
"""Category and speed by designation."""
UNPUBLISHED = ("vehicle.spring", "vehicle.damper", "vehicle.bed_offset")
"""Entries without a published value but for the first category: left empty, so that a file is refused without them."""

KM_PER_MILE = 1.609344


def is_published(vehicle: str) -> bool:
    """Whether spring, damper and cargo bed of a class are published: only the paper's medium-duty truck has them."""
    return CLASSES[vehicle][0] == next(iter(CATEGORIES))


_EXAMPLES: dict[str, tuple[str, str]] = {
    "boulder.length": ("1.6 m", "5 ft"),
    "boulder.width": ("{from: 1.6 m, to: 2.4 m, step: 0.2 m}", "{from: 5 ft, to: 8 ft, step: 6 in}"),
    "boulder.height": ("{from: 2.4 m, to: 3.6 m, step: 0.2 m}", "{from: 8 ft, to: 12 ft, step: 6 in}"),
    "boulder.density": ("2600 kg/m^3", "162 pcf"),
    "boulder.mass": ("18200 kg", "40000 lb"),
    "boulder.rock": ("granite",) * 2,
    "boulder.profile": (
        "[{height: 0 m, width: 1.8 m, length: 1.7 m}, {height: 3 m, width: 1.2 m, length: 1.1 m}]",
        "[{height: 0 ft, width: 6 ft, length: 5.5 ft}, {height: 10 ft, width: 4 ft, length: 3.5 ft}]",
    ),
    "boulder.taper": ("0.8",) * 2,
    "boulder.scan": ("{file: rock.ply, up: a, facing: b}",) * 2,
    "site.embedment_ratio": ("{from: 0.45, to: 0.75, step: 0.05}",) * 2,
    "site.embedment_depth": (TO_BE_FOUND,) * 2,
    "site.impact_height": ("0.9 m", "3 ft"),
    "soil.density": ("1860 kg/m^3", "116 pcf"),
    "soil.friction_angle": ("[36 deg, 40 deg]",) * 2,
    "soil.subgrade_reaction": ("60 MN/m^3", "220 pci"),
    "soil.layers": (
        "[{from: 1.2 m, density: 2000 kg/m^3, friction_angle: 38 deg, subgrade_reaction: 50 MN/m^3}]",
        "[{from: 4 ft, density: 125 pcf, friction_angle: 38 deg, subgrade_reaction: 180 pci}]",
    ),
    "soil.cohesion": ("0 kPa", "0 psf"),
    "soil.water_table": ("0.8 m", "2.6 ft"),
    "vehicle.spring": ("3103.3 kN/m", "17720 lb/in"),
    "vehicle.damper": ("138.91 kN*s/m", "793 lb*s/in"),
    "partial_factor.friction_angle": ("1.25",) * 2,
    "solver.step": ("4 ms",) * 2,
}
"""Values shown by dotted key, in SI and US units; other entries show their default."""
_HEAD = """\
# {name}: which boulder, buried how deep, stops the truck?
#
#   sweep check {file}     is the file valid, how many designs has it?
#   sweep need {file}      which of these boulders, buried how deep?
#   sweep run {file}       simulate them all into one table, with an embedment_ratio in place of the depth
#
# Every entry takes one value, a list [a, b], or a range {{from, to, step}} or {{from, to, count}}, in SI or US units.
# Every combination of lists and ranges is a design. Lines that begin with # are optional: what they show is the
# default, or an example. Soil and truck are examples, too: replace them with your own.
"""


def starter(name: str, vehicle: str = "M30", units: Literal["si", "us"] = "si", file: str = "FILE") -> str:
    """Return the text of a settings file.

    Parameters
    ----------
    name : str
        Name of the sweep.
    vehicle : str
        Class of the vehicle, a key of `CLASSES`.
    units : {'si', 'us'}
        Units of the values.
    file : str
        Name of the file, for its first lines.
    """
    quoted = printable(shlex.quote(file))
    lines = [*_HEAD.format(name=name, file=quoted).splitlines(), f"name: {name}"]
    for section, words in SECTIONS.items():
        lines += ["", f"{section}:".ljust(60) + f"# {words}"]
        for field in fields_of(section):
            lines.append(_line(field, vehicle, SYSTEMS.index(units)))
    return "\n".join(lines) + "\n"


def _line(field: Field, vehicle: str, units: int) -> str:
    """Return one entry with its meaning, commented out where a file may do without it."""
    code, mph = CLASSES[vehicle]
    speed = f"{mph} mph" if units else f"{mph * KM_PER_MILE:.4g} km/h"
    of_class = {"vehicle.mass": CATEGORIES[code][0][units], "vehicle.speed": speed}
    if not is_published(vehicle):
        of_class |= dict.fromkeys(UNPUBLISHED, "")
    path = field.path
    example = _EXAMPLES[path][units] if path in _EXAMPLES else default_text(field, SYSTEMS[units])
    value = of_class.get(path, example)
    needed = path in of_class or (field in INPUTS and (not field.optional or field.name == EMBEDMENT[1]))
    sign = "" if needed else "# "
    empty = "" if value else "fill in: "
    return f"  {sign}{field.key}: {value}".ljust(58) + f"  # {empty}{field.meaning}"
