"""Every entry of a settings file in one register: key, unit, admitted and usual values, default.

The reader, the checks, the tables of the documentation and the JSON Schema for editors follow from it. Name, unit
and meaning of an input that is a column of the result come from the register of columns.

The admitted range is wide: at least a million times either side of what is normal wherever a material or
mechanical constant is concerned. A value beyond it is a typing mistake and refused. A value outside the usual range
is computed as given, with a note.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from boulder_sweep import columns


class Bound(NamedTuple):
    """Smallest and largest value admitted, ends included, and why there is an end."""

    low: float
    high: float
    reason: str


class Usual(NamedTuple):
    """Range met in practice, and what to think of when a value lies outside."""

    low: float
    high: float
    remark: str


@dataclass(frozen=True, slots=True)
class Field:
    """One entry of the file.

    Attributes
    ----------
    section, key : str
        Where it stands in the file: ``section: {key: ...}``.
    name : str
        Its column in the table; for other inputs the name of the axis, for settings the attribute of `Criterion`,
        `Model`, `SolverSettings` or `Sweep` that holds it.
    unit : str
        Unit of a bare number, and of the column; empty for words.
    meaning : str
        What it is, in one line.
    admitted : Bound or None
        Values that are accepted; None for words.
    usual : Usual or None
        Values met in practice.
    default : float or None
        Value of an input that the file does not give; None where there is none. (Settings have the defaults of their
        dataclasses.)
    also : tuple of str
        Other words people try, for "did you mean".
    optional : bool
        Whether a file may be complete without it.
    """

    section: str
    key: str
    name: str
    unit: str
    meaning: str
    admitted: Bound | None = None
    usual: Usual | None = None
    default: float | None = None
    also: tuple[str, ...] = ()
    optional: bool = False

    @property
    def path(self) -> str:
        """Dotted key."""
        return f"{self.section}.{self.key}"


def _input(
    path: str,
    name: str,
    admitted: Bound,
    usual: Usual | None = None,
    *,
    default: float | None = None,
    also: tuple[str, ...] = (),
    optional: bool = False,
) -> Field:
    """Return the entry of an input column."""
    section, key = path.split(".")
    column = columns.BY_NAME[name]
    optional = optional or default is not None
    return Field(section, key, name, column.unit, column.meaning, admitted, usual, default, also, optional)


_SIZE = Bound(0.01, 20.0, "the model is for boulders between a pebble and a house")
_DENSITY = Bound(1e-3, 1e10, "a million times lighter or heavier than rock or soil")
_CONSTANT = "a million times softer or harder than a truck or soil"
_ABOVE_GROUND = Bound(0.0, 20.0, "counted upwards from the ground")

INPUTS: tuple[Field, ...] = (
    _input(
        "boulder.length",
        "boulder_length_m",
        _SIZE,
        Usual(0.6, 2.0, "usual boulders"),
        also=("l", "depth", "thickness"),
    ),
    _input("boulder.width", "boulder_width_m", _SIZE, Usual(0.8, 2.5, "usual boulders"), also=("w", "breadth")),
    _input("boulder.height", "boulder_height_m", _SIZE, Usual(1.5, 4.0, "usual boulders"), also=("h",)),
    _input(
        "boulder.density",
        "boulder_density_kg_m3",
        _DENSITY,
        Usual(2400.0, 3074.0, "rock; a bare number is in kg/m^3, not in t/m^3 or pcf"),
        also=("rho", "rho_b", "unit_weight"),
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
        also=("m_v", "weight"),
    ),
    _input(
        "vehicle.speed",
        "impact_speed_m_s",
        Bound(0.0, 100.0, "up to 360 km/h"),
        Usual(4.0, 25.0, "15 to 90 km/h; a bare number is in m/s, not in mph or km/h"),
        also=("v_0", "v0", "velocity", "impact_speed"),
    ),
    _input(
        "vehicle.spring",
        "vehicle_spring_N_m",
        Bound(1.0, 1e13, _CONSTANT),
        Usual(2e5, 5e7, "truck fronts; a bare number is in N/m, not in kN/m"),
        also=("k_v", "stiffness"),
    ),
    _input(
        "vehicle.damper",
        "vehicle_damper_N_s_m",
        Bound(0.1, 1e12, _CONSTANT),
        Usual(1e4, 2e6, "truck fronts; a bare number is in N*s/m, not in kN*s/m"),
        also=("c_v", "damping", "dashpot"),
    ),
    _input(
        "vehicle.second_spring",
        "vehicle_second_spring_N_m",
        Bound(1.0, 1e13, _CONSTANT),
        Usual(2e5, 5e7, "truck fronts; a bare number is in N/m, not in kN/m"),
        also=("k_2", "second_stiffness"),
        optional=True,
    ),
    _input(
        "vehicle.second_spring_from",
        "vehicle_second_spring_from_m",
        Bound(1e-3, 100.0, "counted from the first touch"),
        also=("s_2", "beyond"),
        optional=True,
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

SETTINGS: tuple[Field, ...] = (
    Field(
        "soil",
        "correlation",
        "correlation",
        "1",
        "correlation of friction angle and subgrade reaction, where both have a distribution",
        Bound(-0.99, 0.99, "the correlation of two different soil properties"),
    ),
    Field("soil", "layers", "layers", "", "layers below the uppermost, which the other entries describe"),
    Field(
        "soil",
        "cohesion",
        "cohesion_kPa",
        "kPa",
        "effective cohesion of the uppermost layer",
        Bound(0.0, 1000.0, "more is rock"),
        also=("c", "c'"),
    ),
    Field(
        "soil",
        "water_table",
        "water_table_m",
        "m",
        "depth of the water table below the soil line; densities below it are those of the saturated soil",
        Bound(0.0, 1000.0, "counted downwards from the soil line"),
        also=("water", "ground_water", "groundwater", "water_level"),
    ),
    Field(
        "soil",
        "slope",
        "slope_deg",
        "deg",
        "angle at which the ground falls away behind the boulder",
        Bound(0.0, 60.0, "less than the friction angle, or the ground does not stand"),
        also=("ground_slope", "inclination"),
    ),
    Field(
        "partial_factor",
        "friction_angle",
        "partial_factor",
        "1",
        "divides the tangent of every friction angle",
        Bound(1.0, 5.0, "1.25 is usual"),
    ),
    Field(
        "criterion",
        "max_rotation",
        "max_rotation_deg",
        "deg",
        "rotation at which the boulder counts as overturned",
        Bound(0.01, 90.0, "the model holds up to about 20 deg"),
        Usual(1.0, 20.0, "beyond 20 deg the model no longer holds and a truck may ramp up"),
    ),
    Field("criterion", "rating", "rating", "", "penetration rating required"),
    Field(
        "criterion",
        "min_overlap",
        "min_overlap_m",
        "m",
        "least height of the boulder's top over the underside of the bumper; with less the truck may ride over",
        Bound(0.0, 20.0, "counted upwards from the underside of the bumper"),
        also=("overlap", "engagement"),
    ),
    Field(
        "vehicle",
        "calibrated_crush",
        "calibrated_crush_m",
        "m",
        "crush up to which spring and damper describe the vehicle's front; a row is flagged where the vehicle drives "
        "on by more, counted from the boulder",
        Bound(0.0, 100.0, "the chassis stiffens at about 1 m of crush"),
        also=("crush", "max_crush"),
    ),
    Field("model", "readings", "readings", "", "how the misprinted equations of the paper are read"),
    Field("model", "soil", "soil_elements", "", "closed form of the soil, or a number of soil elements"),
    Field("model", "resistance", "resistance", "", "law of the ultimate resistance of the soil"),
    Field("model", "unloading", "unloading", "", "whether the soil springs back, and whether a gap opens"),
    Field(
        "solver",
        "accuracy",
        "accuracy",
        "deg",
        "named accuracy, or the error of the rotation that is admitted",
        Bound(1e-9, 10.0, "error of the rotation that is admitted"),
    ),
    Field(
        "solver",
        "step",
        "step_s",
        "s",
        "time step in place of an accuracy; no error is estimated",
        Bound(1e-7, 1.0, "a step of some milliseconds is usual"),
    ),
    Field(
        "solver",
        "horizon",
        "horizon_s",
        "s",
        "how long an impact is simulated",
        Bound(1e-4, 100.0, "an impact is over within a second or so"),
    ),
)
"""What holds for all designs of a file: one value each."""

LAYER_TOP = Field(
    "soil.layers",
    "from",
    "from_m",
    "m",
    "depth of the layer's upper boundary",
    Bound(1e-6, 20.0, "a depth"),
)
"""The entry of a layer that no other has; the rest of it are entries of the soil."""

FIELDS: tuple[Field, ...] = (*INPUTS, *SETTINGS)
SECTIONS: dict[str, str] = {
    "boulder": "the boulder, a box: its size and density",
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

EMBEDMENT = ("embedment_ratio", "embedment_depth_m")
"""Exactly one of these is given."""

MAX_ELEMENTS = 1_000_000
"""Most soil elements per design."""


def fields_of(section: str) -> tuple[Field, ...]:
    """Return the entries of one block of the file."""
    return tuple(field for field in FIELDS if field.section == section)
