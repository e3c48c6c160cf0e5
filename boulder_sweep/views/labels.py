"""Names and values of inputs with their units, as pictures show them, in SI or US units."""

from __future__ import annotations

from boulder_sweep.columns import BY_NAME
from boulder_sweep.settings.shown_units import shown_unit
from boulder_sweep.text import NO_BREAK_SPACE

RATIO = "embedment_ratio"
WORDS = {
    RATIO: "embedment depth / boulder height",
    "boulder_height_m": "boulder height",
    "embedment_depth_m": "embedment depth",
    "friction_angle_deg": "friction angle φ′",
    "subgrade_reaction_MN_m3": "subgrade reaction β",
}
SYMBOLS = {
    "friction_angle_deg": "φ′ = {}",
    "subgrade_reaction_MN_m3": "β = {}",
    "boulder_width_m": "width {}",
    "boulder_length_m": "length {}",
    "boulder_height_m": "height {}",
    "boulder_density_kg_m3": "boulder {}",
    "soil_density_kg_m3": "soil {}",
    "impact_speed_m_s": "speed {}",
    "vehicle_mass_kg": "vehicle {}",
    "vehicle_spring_N_m": "spring {}",
    "vehicle_damper_N_s_m": "damper {}",
}
USUAL = (("strain_rate_factor", 1.0),)
"""Constants that a caption need not mention."""
PRINTED = {"1": "", "MN/m^3": "MN/m³", "kg/m^3": "kg/m³", "kN*s/m": "kN·s/m", "lb*s/in": "lb·s/in", "kip*ft": "kip·ft"}


def sized(unit: str, units: str) -> tuple[str, float]:
    """Return the unit in which values of a unit of the table are printed, and its size in that one.

    Parameters
    ----------
    unit
        Unit of a column; ``J`` and ``N`` beside.
    units
        ``si`` or ``us``.
    """
    shown = shown_unit(unit, units)
    return PRINTED.get(shown.unit, shown.unit), shown.size


def size_of(name: str, units: str) -> float:
    """Return the size of the unit in which an input is printed, in that of the table."""
    return sized(BY_NAME[name].unit, units)[1] if name in BY_NAME else 1.0


def unit_of(name: str, units: str = "si") -> str:
    """Return the unit of an input as printed; empty for plain numbers."""
    return sized(BY_NAME[name].unit, units)[0] if name in BY_NAME else ""


def name_of(name: str) -> str:
    """Return an input in words, without its unit: ``boulder height``."""
    unit = BY_NAME[name].unit if name in BY_NAME else ""
    suffix = "_" + unit.replace("/", "_").replace("*", "_").replace("^", "")
    return WORDS.get(name) or name.removesuffix(suffix).replace("_", " ")


def label(name: str, units: str = "si") -> str:
    """Return an input with its unit, for an axis: ``boulder height [m]``."""
    unit = unit_of(name, units)
    return f"{name_of(name)} [{unit}]" if unit else name_of(name)


def value_text(name: str, value: float, units: str = "si") -> str:
    """Return the value of an input with its unit: ``φ′ = 36°``."""
    unit = unit_of(name, units)
    number = f"{value / size_of(name, units):.5g}"
    shown = f"{number}°" if unit == "deg" else f"{number} {unit}".rstrip()
    return SYMBOLS[name].format(shown) if name in SYMBOLS else f"{name_of(name)} {shown}"


def unbroken(words: str) -> str:
    """Return words that stay on one line."""
    return words.replace(" ", NO_BREAK_SPACE)
