"""What pictures say: names and values of inputs with their units, titles and captions in a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from boulder_sweep.columns import BY_NAME
from boulder_sweep.settings.model import Ground, Shape
from boulder_sweep.settings.units import number_text, shown_unit
from boulder_sweep.text import NO_BREAK_SPACE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from boulder_sweep.impact.trajectory import Trajectory


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
    "boulder_mass_kg": "boulder {}",
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
    """Return the unit in which values of a unit of the table, or in J or N, are printed, and its size in that one."""
    shown = shown_unit(unit, units)
    return PRINTED.get(shown.unit, shown.unit), shown.size


def size_of(name: str, units: str) -> float:
    """Return the size of the unit in which an input is printed, in the unit of the table."""
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
    return with_unit(name_of(name), unit_of(name, units))


def with_unit(words: str, unit: str) -> str:
    """Return words with a unit in brackets, if there is one."""
    return f"{words} [{unit}]" if unit else words


def value_text(name: str, value: float, units: str = "si") -> str:
    """Return the value of an input with its unit: ``φ′ = 36°``."""
    unit = unit_of(name, units)
    number = number_text(value / size_of(name, units), units)
    shown = f"{number}°" if unit == "deg" else f"{number} {unit}".rstrip()
    return SYMBOLS[name].format(shown) if name in SYMBOLS else f"{name_of(name)} {shown}"


def keep_together(words: str) -> str:
    """Return words that stay on one line."""
    return words.replace(" ", NO_BREAK_SPACE)


REASON_WORDS = {
    "no_contact": "the truck passes over it",
    "overturns": "it overturns",
    "penetration": "the truck gets too far",
    "horizon": "nothing proved at the end of the simulated time",
    "crush": "the truck would be inside the boulder",
    "override": "it hardly reaches the bumper",
    "foot": "a rounded foot is not modelled",
    "shape": "no known shape stands for it",
    "slower_truck": "a slower truck overturns it",
    "validity": "the model does not hold for it",
    "error": "too near to a limit for the accuracy",
}


LAW_WORDS = {"broms": "3 K_p (Broms)", "width_capped": "capped by the width"}
"""Laws of the soil's resistance that are not the paper's."""
NOT_A_TEST = "Simulation, not a rating by test"


def verdict_line(trajectory: Trajectory) -> str:
    """Name, verdict, and what decides it, by the row of the table: ``rwg: PASS, 13.8° of 20° allowed``."""
    row, settings = trajectory.row, trajectory.settings
    limit = settings["criterion"]["max_rotation_deg"]
    name = trajectory.name if settings["n_designs"] == 1 else f"{trajectory.name} #{trajectory.design_id}"
    if row["time_to_limit_s"] is not None:
        details = [f"past {limit:g}° after {row['time_to_limit_s']:.3f} s"]
    else:
        theta, end = row["max_rotation_deg"], row["end_time_s"]
        details = [] if theta is None else [f"{theta:.1f}° of {limit:g}° allowed"]
        if end is not None and end > settings["solver"]["horizon_s"]:
            details.append(f"simulated for {end:.4g} s")
    if row["shape"] is not None:
        details.append(f"{row['shape'].replace('_', ' ')} is the worst of the shapes of its mass and sizes")
    words = (trajectory.verdict.upper(), REASON_WORDS.get(trajectory.reason, trajectory.reason), *details)
    return f"{name}: {', '.join(filter(None, words))}"


def terms_line(settings: Mapping[str, Any], units: str = "si") -> str:
    """Return what a pass means under the settings of a table: limits, readings, and that it is a simulation."""
    limits = settings["criterion"]
    held = f"rotation up to {limits['max_rotation_deg']:g}° and rating {limits['rating']}"
    return f"Pass: {held} · {model_words(settings, units)}. {NOT_A_TEST}."


def model_words(settings: Mapping[str, Any], units: str = "si") -> str:
    """Return the readings of the paper, and soil model and ground where they are not the paper's."""
    model = settings["model"]
    law = LAW_WORDS.get(model.get("resistance", ""), "")
    readings = f"readings {model['preset'].replace('_', ' ')}"
    words = (readings, f"resistance {law}" if law else "", ground_words(settings, units), Shape.of_model(model).words)
    return ", ".join(filter(None, words))


def ground_words(settings: Mapping[str, Any], units: str = "si") -> str:
    """Return in what the soil is not a dry, level one that is the same at every depth; empty where it is one."""
    return Ground.of_dict(settings["model"].get("ground", {})).words_in(sized("m", units), sized("kPa", units))


def design_line(trajectory: Trajectory, units: str = "si") -> str:
    """Boulder, soil, vehicle and readings in one line; below it, that this is a simulation."""
    value = trajectory.inputs
    unit, metre = sized("m", units)
    size = " × ".join(f"{value[f'boulder_{side}_m'] / metre:.4g}" for side in ("length", "width", "height"))
    soil = (value_text(name, value[name], units) for name in ("friction_angle_deg", "subgrade_reaction_MN_m3"))
    truck, speed = (value_text(name, value[name], units) for name in ("vehicle_mass_kg", "impact_speed_m_s"))
    boulder = f"boulder {size} {unit} (L × W × H), {value['embedment_depth_m'] / metre:.4g} {unit} deep"
    words = (boulder, f"soil {', '.join(soil)}", f"{truck}, {speed}", model_words(trajectory.settings, units))
    flags = str(trajectory.row["validity"] or "").replace(";", ", ").replace("_", " ")
    outside = f" · Outside what the model was tested on: {flags}" if flags else ""
    return f"{' · '.join(words)}\n{NOT_A_TEST}{outside}"
