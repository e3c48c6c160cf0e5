"""Every entry of a settings file in one register: key, unit, admitted and usual values, default.

Inputs are declared here, settings on the attributes of the dataclasses of `boulder_sweep.settings.model`. The reader,
the checks, the tables of the documentation and the JSON Schema for editors follow from both.

The admitted range is wide: at least a million times either side of what is normal for material and mechanical
constants. A value beyond it is a typing mistake and refused. A value outside the usual range is computed as given, with
a note; of masses, densities, springs, dampers and speeds one more than `FAR` times outside must be allowed by the file.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any, Literal

from boulder_sweep import columns
from boulder_sweep.settings.model import Bound, Criterion, Field, Model, SolverSettings, Usual, entries_of
from boulder_sweep.settings.problems import did_you_mean, shorten
from boulder_sweep.settings.units import SYSTEMS, describe, shown_unit
from boulder_sweep.text import printable


def _input(path: str, name: str, admitted: Bound, usual: Usual | None = None, **more: Any) -> Field:
    """Return the entry of an input column; `more` are further attributes, and one with a default is optional."""
    section, key = path.split(".")
    column = columns.BY_NAME[name]
    if "default" in more:
        more |= {"optional": True, "shown_default": more["default"]}
    return Field(section, key, name, column.unit, column.meaning, admitted, usual, **more)


FAR = 30.0
"""How many times outside the usual range a value is refused unless the file allows it. A slip of the unit, kN for N or
t for kg, is a factor of 1000."""
ALLOW_UNUSUAL, EVERYTHING = "allow_unusual", "all"
"""The entry that allows such values, and its word for all of them."""
_SIZE = Bound(0.01, 20.0, "the model is for boulders between a pebble and a house")
_DENSITY = Bound(1e-3, 1e10, "a million times lighter or heavier than rock or soil")
_CONSTANT = "a million times softer or harder than a truck or soil"
_ABOVE_GROUND = Bound(0.0, 20.0, "counted upwards from the ground")

INPUTS: tuple[Field, ...] = (
    _input(
        "boulder.length", "boulder_length_m", _SIZE, Usual(0.6, 2.0, "usual boulders"), also=("l", "depth", "thickness")
    ),
    _input("boulder.width", "boulder_width_m", _SIZE, Usual(0.8, 2.5, "usual boulders"), also=("w", "breadth")),
    _input("boulder.height", "boulder_height_m", _SIZE, Usual(1.5, 4.0, "usual boulders"), also=("h",)),
    _input(
        "boulder.density",
        "boulder_density_kg_m3",
        _DENSITY,
        Usual(2000.0, 3074.0, "rock; a bare number is in kg/m^3, not in t/m^3 or pcf"),
        held=True,
        also=("rho", "rho_b", "unit_weight"),
    ),
    _input(
        "boulder.mass",
        "boulder_mass_kg",
        Bound(1e-3, 1e10, "a million times lighter or heavier than a boulder"),
        Usual(1500.0, 65000.0, "usual boulders; a bare number is in kg, not in t or lb"),
        held=True,
        also=("m_b", "weight"),
        optional=True,
    ),
    Field(
        "site",
        "embedment_ratio",
        "embedment_ratio",
        "1",
        "buried part of the boulder's height, d / H",
        Bound(1e-6, 1.0, "the part of the boulder's height that is buried, 0.55 or 55 %"),
        Usual(0.35, 0.75, "usual embedments"),
        also=("ratio", "d/h"),
        optional=True,
    ),
    _input(
        "site.embedment_depth",
        "embedment_depth_m",
        Bound(1e-6, 20.0, "a boulder that is not embedded is outside the model"),
        also=("embedment", "depth", "d"),
        optional=True,
    ),
    _input(
        "site.impact_height",
        "impact_height_m",
        Bound(0.0, 20.0, "counted upwards from the soil line"),
        also=("eccentricity", "e"),
        optional=True,
    ),
    _input(
        "soil.density",
        "soil_density_kg_m3",
        _DENSITY,
        Usual(1520.0, 2240.0, "sand and gravel; a bare number is in kg/m^3, not in t/m^3 or pcf"),
        held=True,
        also=("rho", "rho_s", "unit_weight", "gamma"),
    ),
    _input(
        "soil.friction_angle",
        "friction_angle_deg",
        Bound(1.0, 60.0, "no soil has less or more, and the passive coefficient diverges at 90"),
        Usual(27.0, 49.0, "loose sand to very dense gravel; a bare number is in degrees"),
        also=("phi", "friction", "angle"),
    ),
    _input(
        "soil.subgrade_reaction",
        "subgrade_reaction_MN_m3",
        Bound(1e-6, 1e9, _CONSTANT),
        Usual(2.0, 110.0, "loose to very dense sand; a bare number is in MN/m^3"),
        also=("beta", "n_h", "subgrade_modulus", "modulus"),
    ),
    _input(
        "soil.strain_rate_factor",
        "strain_rate_factor",
        Bound(0.1, 10.0, "1.0 means no gain of strength under rapid loading"),
        Usual(1.0, 1.2, "rapid loading of sand"),
        default=1.0,
        also=("k_epsilon", "rate_factor"),
    ),
    _input(
        "vehicle.mass",
        "vehicle_mass_kg",
        Bound(1e-3, 1e10, "a million times lighter or heavier than a truck"),
        Usual(1000.0, 30000.0, "car to heavy truck; a bare number is in kg, not in lb"),
        held=True,
        also=("m_v", "weight"),
    ),
    _input(
        "vehicle.speed",
        "impact_speed_m_s",
        Bound(0.0, 100.0, "up to 360 km/h"),
        Usual(4.0, 25.0, "15 to 90 km/h; a bare number is in m/s, not in mph or km/h"),
        held=True,
        also=("v_0", "v0", "velocity", "impact_speed"),
    ),
    _input(
        "vehicle.spring",
        "vehicle_spring_N_m",
        Bound(1.0, 1e13, _CONSTANT),
        Usual(2e5, 5e7, "truck fronts; a bare number is in N/m, not in kN/m"),
        held=True,
        also=("k_v", "stiffness"),
    ),
    _input(
        "vehicle.damper",
        "vehicle_damper_N_s_m",
        Bound(0.1, 1e12, _CONSTANT),
        Usual(1e4, 2e6, "truck fronts; a bare number is in N*s/m, not in kN*s/m"),
        held=True,
        also=("c_v", "damping", "dashpot"),
    ),
    _input(
        "vehicle.bumper_height",
        "bumper_height_m",
        _ABOVE_GROUND,
        Usual(0.4, 0.7, "underside of a truck's bumper"),
        default=0.5,
        also=("bumper", "e_bumper"),
    ),
    _input(
        "vehicle.hood_height",
        "hood_height_m",
        _ABOVE_GROUND,
        Usual(1.3, 1.6, "medium-duty trucks"),
        default=1.4,
        also=("hood", "bonnet_height"),
    ),
    _input(
        "vehicle.bed_offset",
        "bed_offset_m",
        Bound(0.0, 30.0, "counted backwards from the front bumper"),
        Usual(2.5, 3.2, "front bumper to leading edge of the cargo bed; penetration is counted from that edge"),
        default=2.9,
        also=("cargo_bed", "bed"),
    ),
)
"""What describes a design: each entry may be an axis of the grid."""

_OF_FILES = (
    Field(
        "soil",
        "correlation",
        "correlation",
        "1",
        "correlation of friction angle and subgrade reaction, where both have a distribution",
        Bound(-0.99, 0.99, "the correlation of two different soil properties"),
        shown_default=0.0,
    ),
    Field(
        "partial_factor",
        "friction_angle",
        "partial_factor",
        "1",
        "divides the tangent of every friction angle",
        Bound(1.0, 5.0, "1.25 is usual"),
        shown_default=1.0,
    ),
)
"""Settings that change what the inputs say, and belong to no part of `boulder_sweep.settings.model`."""
_IN_ORDER = ("boulder", "soil", "partial_factor", "criterion", "vehicle", "model", "solver")
SETTINGS: tuple[Field, ...] = tuple(
    sorted(
        (*_OF_FILES, *(entry for part in (Criterion, Model, SolverSettings) for entry in entries_of(part))),
        key=lambda entry: _IN_ORDER.index(entry.section),
    )
)
"""What holds for all designs of a file: one value each."""

LAYER_TOP = Field(
    "soil.layers", "from", "from_m", "m", "depth of the layer's upper boundary", Bound(1e-6, 20.0, "a depth")
)
"""The entry of a layer that no other has; the rest of it are entries of the soil."""

FIELDS: tuple[Field, ...] = (*INPUTS, *SETTINGS)
SECTIONS: dict[str, str] = {
    "boulder": "the boulder, a box: its size and its density or mass",
    "site": "how the boulder stands in the ground",
    "soil": "the soil around the boulder",
    "vehicle": "the vehicle: mass, speed and the Maxwell element of its front",
    "partial_factor": "partial factors, as in Eurocode 7",
    "criterion": "what a design must hold",
    "model": "which reading of the paper, which representation of the soil",
    "solver": "how accurately and how long a design is simulated",
}
BY_NAME: dict[str, Field] = {field.name: field for field in FIELDS}
BY_PATH: dict[str, Field] = {field.path: field for field in FIELDS}
HELD: tuple[str, ...] = tuple(field.path for field in FIELDS if field.held)
"""Entries whose values are held to the usual range unless the file allows them."""

BOULDER_MASS = BY_NAME["boulder_mass_kg"]
"""The mass of the boulder: an input where a file gives it; else it follows from four others."""
EMBEDMENT = ("embedment_ratio", "embedment_depth_m")
"""Exactly one of these is given."""
TO_BE_FOUND = "to be found"
"""What a file gives for the depth where a question is to find it."""
MAX_ELEMENTS = 1_000_000


def fields_of(section: str) -> tuple[Field, ...]:
    """Return the entries of one block of the file."""
    return tuple(field for field in FIELDS if field.section == section)


class UnknownNameError(ValueError):
    """A word names no entry, or several; `what` says what is wrong with it, and which entries there are."""

    def __init__(self, word: str, what: str):
        super().__init__(word, what)
        self.word, self.what = word, what

    def __str__(self) -> str:
        return f"'{shorten(self.word)}' {self.what}"


def named(word: str, among: Sequence[Field] = INPUTS) -> Field:
    """Return the entry that a word names: a path (``boulder.width``), key (``width``) or column (``boulder_width_m``).

    An input goes before a setting of the same key. Raises UnknownNameError where none or several have this name.
    """
    matches = [field for field in among if word in (field.path, field.name)]
    matches = matches or [field for field in among if word == field.key]
    matches = [field for field in matches if field in INPUTS] or matches
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise UnknownNameError(word, f"is ambiguous; use {' or '.join(field.path for field in matches)}")
    keys = [field.key for field in among]
    short = [field.path if keys.count(field.key) > 1 else field.key for field in among]
    near = [known for known in short if word.lower() in known] or [
        known for known, field in zip(short, among, strict=True) if word.lower() in field.also
    ]
    every = (*short, *(field.path for field in among), *(field.name for field in among))
    hint = f"; did you mean {' or '.join(near)}?" if near else did_you_mean(word, every)
    what = "an input" if all(field in INPUTS for field in among) else "an entry of the file"
    known = hint or f" ({', '.join(short)})"
    raise UnknownNameError(word, f"is not {what}{known}")


def default_text(field: Field, units: str = "si") -> str:
    """Return the default of an entry with its unit, to four digits in US units; empty where there is none."""
    value = field.shown_default
    if value is None or isinstance(value, str):
        return value or ""
    unit, size = shown_unit(field.unit, units) if units == "us" else (field.unit, 1.0)
    return describe(value / size, unit, digits=6 if size == 1.0 else 4)


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
#
# table: yard.csv in place of sizes and mass reads a list of boulders, one a row (boulder_height_{length}, ...).
# log: borehole.csv under soil, in place of its constants, reads blow counts or a cone over the depth.
"""


def starter(name: str, vehicle: str = "M30", units: Literal["si", "us"] = "si", file: str = "FILE") -> str:
    """Return the text of a settings file for a class of vehicles in `CLASSES`; its first lines name the `file`."""
    quoted = printable(shlex.quote(file))
    lines = [*_HEAD.format(name=name, file=quoted, length="ft" if units == "us" else "m").splitlines(), f"name: {name}"]
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
