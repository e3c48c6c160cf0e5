"""The quantities a file can give: key, column, unit, default. One register for all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Field:
    """One quantity of the file that describes designs.

    Attributes
    ----------
    section, key : str
        Where it stands in the file: ``section: {key: ...}``.
    name : str
        Its column in the table; for quantities without a column of their own, the name of its axis.
    unit : str
        Unit of a bare number, and of the column.
    default : float or None
        Value where the file says nothing; None where there is none.
    also : tuple of str
        Other words people try, for "did you mean".
    """

    section: str
    key: str
    name: str
    unit: str
    default: float | None = None
    also: tuple[str, ...] = ()

    @property
    def path(self) -> str:
        """Dotted key."""
        return f"{self.section}.{self.key}"


FIELDS: tuple[Field, ...] = (
    Field("boulder", "length", "boulder_length_m", "m", also=("l", "depth", "thickness")),
    Field("boulder", "width", "boulder_width_m", "m", also=("w", "breadth")),
    Field("boulder", "height", "boulder_height_m", "m", also=("h",)),
    Field("boulder", "density", "boulder_density_kg_m3", "kg/m^3", also=("rho", "rho_b", "unit_weight")),
    Field("site", "embedment_ratio", "embedment_ratio", "1", also=("ratio", "d/h")),
    Field("site", "embedment_depth", "embedment_depth_m", "m", also=("embedment", "depth", "d")),
    Field("site", "impact_height", "impact_height_m", "m", also=("eccentricity", "e")),
    Field("soil", "density", "soil_density_kg_m3", "kg/m^3", also=("rho", "rho_s", "unit_weight", "gamma")),
    Field("soil", "friction_angle", "friction_angle_deg", "deg", also=("phi", "friction", "angle")),
    Field(
        "soil",
        "subgrade_reaction",
        "subgrade_reaction_MN_m3",
        "MN/m^3",
        also=("beta", "n_h", "subgrade_modulus", "modulus"),
    ),
    Field("soil", "strain_rate_factor", "strain_rate_factor", "1", 1.0, also=("k_epsilon", "rate_factor")),
    Field("vehicle", "mass", "vehicle_mass_kg", "kg", also=("m_v", "weight")),
    Field("vehicle", "speed", "impact_speed_m_s", "m/s", also=("v_0", "v0", "velocity", "impact_speed")),
    Field("vehicle", "spring", "vehicle_spring_N_m", "N/m", also=("k_v", "stiffness")),
    Field("vehicle", "damper", "vehicle_damper_N_s_m", "N*s/m", also=("c_v", "damping", "dashpot")),
    Field("vehicle", "bumper_height", "bumper_height_m", "m", 0.5, also=("bumper", "e_bumper")),
    Field("vehicle", "hood_height", "hood_height_m", "m", 1.4, also=("hood", "bonnet_height")),
    Field("vehicle", "bed_offset", "bed_offset_m", "m", 2.9, also=("cargo_bed", "bed")),
)

SECTIONS = ("boulder", "site", "soil", "vehicle")
BY_NAME: dict[str, Field] = {field.name: field for field in FIELDS}
BY_PATH: dict[str, Field] = {field.path: field for field in FIELDS}

EMBEDMENT = ("embedment_ratio", "embedment_depth_m")
"""Exactly one of these is given."""

OPTIONAL = frozenset({*EMBEDMENT, "impact_height_m", *(f.name for f in FIELDS if f.default is not None)})
"""Quantities without which a file may be complete (of the embedments, one is needed)."""


def fields_of(section: str) -> tuple[Field, ...]:
    """Return the quantities of one block of the file."""
    return tuple(field for field in FIELDS if field.section == section)
