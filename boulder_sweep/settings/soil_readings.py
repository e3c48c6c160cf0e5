"""Readings of an investigation in place of soil constants: ``spt: {n: 28, energy_ratio: 60 %, depth: 1.5 m}``.

They are worked out while the file is read and stand for entries of the table from then on; what was used is kept, so
that it can be printed, stored and reported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any, TypeVar

import numpy as np

from boulder_sweep import investigation as sand
from boulder_sweep.settings.distributions import FRACTILE_5
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Bound, Field
from boulder_sweep.settings.problems import LeafError, Mistakes, wrong
from boulder_sweep.settings.shown_units import quantity_text
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence, block_of
from boulder_sweep.settings.values import read_block, read_single

Angles = TypeVar("Angles", float, dict[str, float])
SOIL_KEYS = ("friction_angle", "density", "subgrade_reaction")
"""What readings stand for, as far as a file does not give it."""
_BLOWS, _SHARE = Bound(1.0, 200.0, "a blow count"), Bound(0.3, 1.0, "60 % is usual")
_DEPTH = ("depth", "depth_m", "m", "depth of the reading below the ground", Bound(0.1, 30.0, "a depth"))
_READINGS = {
    "spt": (
        ("n", "n", "1", "blows for the last 300 mm (1 ft), as logged", _BLOWS),
        ("energy_ratio", "energy_ratio", "1", "energy of the hammer that reaches the rods", _SHARE),
        ("n60", "n60", "1", "in place of these two: blows at an energy ratio of 60 %", _BLOWS),
        _DEPTH,
        ("n1_60", "n1_60", "1", "in place of the three: blow count corrected for energy and stress", _BLOWS),
    ),
    "cpt": (("q_c", "q_c_MPa", "MPa", "resistance of the cone", Bound(0.01, 150.0, "a cone resistance")), _DEPTH),
}
READING_FIELDS = {
    method: {key: Field(f"soil.{method}", key, name, unit, meaning, bound) for key, name, unit, meaning, bound in rows}
    for method, rows in _READINGS.items()
}
"""Entries of a reading by kind of test and key."""
_LOOSENESS = Bound(0.0, 1.0, "a share, 0.65 or 65 %")
RELATIVE_DENSITY = Field(
    "soil", "relative_density", "relative_density", "1", "relative density of the sand", _LOOSENESS
)
METHODS = (*READING_FIELDS, RELATIVE_DENSITY.key)
SOURCE_OF_DENSITY = "EM 1110-2-2504, Table 3-1"
_SCATTER_DEG = {"spt": sand.SPT_SD_DEG, "cpt": sand.CPT_SD_DEG, RELATIVE_DENSITY.key: sand.DENSITY_SD_DEG}
CORRELATION = 0.99
"""Of friction angle and subgrade reaction where the second follows from the first; 1 is not admitted."""


def readings_of(node: Node, method: str, density_kg_m3: float | None) -> list[dict[str, Any]]:
    """Return the readings of a test as plain data, each with the friction angles that follow, by their sources.

    Parameters
    ----------
    node : Node
        ``{n: 28, energy_ratio: 60 %, depth: 1.5 m}``, ``{n1_60: 30}``, ``{q_c: 14 MPa, depth: 1.5 m}``, a list of
        such, or a relative density.
    method : str
        One of `METHODS`.
    density_kg_m3 : float or None
        Density of the soil for the stress at a reading; None where the file does not give it.

    Raises
    ------
    LeafError
        With every mistake; a reading outside of what its correlation holds for is one.
    """
    if method == RELATIVE_DENSITY.key:
        ratio = read_single(node, RELATIVE_DENSITY)
        angle = _inside(node, lambda: sand.angle_by_relative_density(ratio))
        return [{method: ratio, **_by_lowest({SOURCE_OF_DENSITY: angle})}]
    items = node.items if isinstance(node, Sequence) and node.unit is None else [node]
    if not items:
        raise wrong(node.position, "the list is empty; give at least one reading")
    readings, mistakes = [], Mistakes()
    for item in items:
        with mistakes:
            readings.append(_reading(item, method, density_kg_m3))
    mistakes.raise_if_any()
    return readings


def _reading(node: Node, method: str, density_kg_m3: float | None) -> dict[str, Any]:
    """Return one reading of a penetration test."""
    values = read_block(node, READING_FIELDS[method], "a reading")
    if "n60" in values:
        if {"n", "energy_ratio"} & set(values):
            raise wrong(node.position, "n60 is at an energy ratio of 60 %; give it, or n and energy_ratio, not both")
        values |= {"n": values.pop("n60"), "energy_ratio": 0.6}
    position, raw = node.position, {"n", "energy_ratio", "depth_m"}
    if method == "spt":
        if "n1_60" in values and raw & set(values):
            raise wrong(position, "give n, energy_ratio and depth, or n1_60, not both")
        if "n1_60" not in values and not raw <= set(values):
            message = "a reading is n, the blows as logged, with energy_ratio and depth; n60, the blows at an energy "
            message += "ratio of 60 %, with depth; or n1_60, which is corrected for the stress, too"
            raise wrong(position, message)
    elif len(values) < 2:
        raise wrong(position, "a reading of a cone has q_c and depth")
    if "depth_m" in values:
        stress = sand.vertical_stress(values["depth_m"], density_kg_m3)
        values |= {"stress_kPa": stress, "stress_factor": sand.stress_factor(stress)}
        if method == "spt":
            values["rod_factor"] = sand.rod_factor(values["depth_m"])
            values["n1_60"] = sand.normalized_blow_count(values["n"], values["energy_ratio"], values["depth_m"], stress)
    if method == "spt":
        angles = _inside(node, lambda: sand.angles_by_blow_count(values["n1_60"]))
    else:
        angles = _inside(node, lambda: sand.angles_by_cone(values["q_c_MPa"], values["stress_kPa"]))
    return {**values, **_by_lowest(angles)}


def _by_lowest(angles: dict[str, float]) -> dict[str, Any]:
    """Return the lowest of the angles by several correlations, and all of them, as a reading keeps them."""
    return {"friction_angle_deg": min(angles.values()), "friction_angles_deg": angles}


def _inside(node: Node, of_correlation: Callable[[], Angles]) -> Angles:
    """Return what a correlation gives, or say that it does not hold here."""
    try:
        return of_correlation()
    except sand.OutsideError as error:
        raise wrong(node.position, f"{error}; give soil.friction_angle as measured") from None


def soil_of(node: Node, method: str, lacking: Collection[str], density_kg_m3: float | None) -> dict[str, Any]:
    """Return the soil constants by readings as plain data: the readings, and what is taken of them.

    Of several readings the weakest counts, and of several correlations the lowest. The standard deviation is the
    scatter about it, or what keeps the highest correlation within the 95 % fractile, if that is more.

    Raises
    ------
    LeafError
        With every mistake.
    """
    readings = readings_of(node, method, density_kg_m3)
    angles = _weakest(readings)["friction_angles_deg"]
    source = min(angles, key=angles.__getitem__)
    angle, highest = angles[source], max(angles.values())
    sd = max(_SCATTER_DEG[method], math.ceil(100.0 * (highest - angle) / FRACTILE_5) / 100.0)
    data: dict[str, Any] = {"method": method, "source": source, "readings": readings}
    if "friction_angle" in lacking:
        data |= {"friction_angle_deg": angle, "friction_angle_sd_deg": sd}
    if "density" in lacking:
        data["density_low_kg_m3"], data["density_high_kg_m3"] = sand.densities(angle)
    if "subgrade_reaction" in lacking:
        if angle < sand.API_ANGLES[0]:
            message = f"the API curve begins at {sand.API_ANGLES[0]:g} deg, and these readings give {angle:.4g} deg"
            raise wrong(node.position, f"{message}; give soil.subgrade_reaction as measured")
        # The curve as it is; what the angle may be off by is carried along it, at the slope of its logarithm.
        curve = sand.api_curve(np.array([angle, *sand.API_ANGLES]))
        spread = sd * math.log(curve[2] / curve[1]) / float(sand.API_ANGLES[1] - sand.API_ANGLES[0])
        data |= {"subgrade_reaction_MN_m3": float(curve[0]), "subgrade_reaction_cov": math.sqrt(math.expm1(spread**2))}
    return data


def _weakest(readings: list[dict[str, Any]]) -> dict[str, Any]:
    return min(readings, key=lambda reading: reading["friction_angle_deg"])


def soil_words(data: dict[str, Any], units: str = "si") -> str:
    """Return in one line what is taken of readings, by what `soil_of` returned."""
    weakest = _weakest(data["readings"])
    count = len(data["readings"])
    of = f", the weakest of {count} readings" if count > 1 else ""
    parts = []
    if "friction_angle_deg" in data:
        angle, sd = data["friction_angle_deg"], data["friction_angle_sd_deg"]
        others = "".join(
            f"; by {name} it is {other:.4g} deg"
            for name, other in weakest.get("friction_angles_deg", {}).items()
            if name != data["source"]
        )
        source = f"{data['source']}{', the lowest' if others else ''}{others}"
        parts.append(
            f"friction angle {angle:.4g} deg, sd {sd:g} deg, by {_reading_words(weakest, units)}{of} ({source})"
        )
    if "density_low_kg_m3" in data:
        ends = data["density_low_kg_m3"], data["density_high_kg_m3"]
        density = quantity_text("kg/m^3", units, *ends, digits=".0f")
        parts.append(f"density {density}, uniform (EM 1110-2-2504, Table 3-1)")
    if "subgrade_reaction_MN_m3" in data:
        beta = quantity_text("MN/m^3", units, data["subgrade_reaction_MN_m3"], digits=".3g")
        cov = data["subgrade_reaction_cov"]
        parts.append(f"subgrade reaction {beta}, cov {100.0 * cov:.0f} %, which follows the angle (API)")
    return "; ".join(parts) or "the readings are not used: the file gives every constant"


def _reading_words(reading: dict[str, Any], units: str) -> str:
    depth = quantity_text("m", units, reading.get("depth_m", 0.0))
    if "q_c_MPa" in reading:
        return f"q_c {quantity_text('MPa', units, reading['q_c_MPa'])} at {depth}, C_N {reading['stress_factor']:.3g}"
    if "relative_density" in reading:
        return f"relative density {100.0 * reading['relative_density']:g} %"
    corrected = f"(N1)60 {reading['n1_60']:.4g}"
    if "n" not in reading:
        return corrected
    energy = f"{100.0 * reading['energy_ratio']:g} %"
    factors = f"C_N {reading['stress_factor']:.3g}, rods {reading['rod_factor']:g}"
    return f"N {reading['n']:g} ({energy}) at {depth}, {corrected} with {factors}"


def unfold_soils(root: Mapping, listed: Collection[str], mistakes: Mistakes) -> list[dict[str, Any]]:
    """Replace the readings of every soil by distributions of the constants that it does not give.

    Parameters
    ----------
    root : Mapping
        The tree of the file, changed in place.
    listed : collection of str
        Keys of the soil that a table of designs gives.
    mistakes : Mistakes
        Receives what is wrong with them.

    Returns
    -------
    list of dict
        What `soil_of` keeps of each, under the name of its soil where it is a named one.
    """
    data: list[dict[str, Any]] = []
    for soil in root.blocks("soil"):
        given = [key for key in METHODS if key in soil.entries]
        if not given:
            continue
        entry = soil.entries[given[0]]
        lacking = [key for key in SOIL_KEYS if key not in soil.entries and key not in listed]
        constants: dict[str, Any] = {}
        with mistakes:
            if len(given) > 1:
                raise wrong(soil.entries[given[1]].position, f"give one of {', '.join(given)}")
            if "water_table" in soil.entries and "subgrade_reaction" in lacking:
                message = "the API curve is that of dry sand; with a water table give soil.subgrade_reaction"
                raise wrong(entry.position, message)
            constants = soil_of(entry.value, given[0], lacking, _plain_density(soil))
            data.append(soil.label | constants)
        for key in given[1:]:
            del soil.entries[key]
        soil.replace(given[0], _soil_entries(entry, constants))
    return data


def _plain_density(soil: Mapping) -> float | None:
    """Return the density of a soil where it is one plain value."""
    node = soil.get("density")
    try:
        return read_single(node, BY_NAME["soil_density_kg_m3"]) if isinstance(node, Scalar) else None
    except LeafError:
        return None  # reported where it stands


def _soil_entries(entry: Entry, data: dict[str, Any]) -> list[Entry]:
    """Return the distributions that readings stand for."""
    forms: dict[str, dict[str, str]] = {}
    if "friction_angle_deg" in data:
        mean, sd = data["friction_angle_deg"], data["friction_angle_sd_deg"]
        forms["friction_angle"] = {"mean": f"{mean!r} deg", "sd": f"{sd!r} deg"}
    if "density_low_kg_m3" in data:
        ends = {end: f"{data[f'density_{end}_kg_m3']!r} kg/m^3" for end in ("low", "high")}
        forms["density"] = {"distribution": "uniform", **ends}
    if "subgrade_reaction_MN_m3" in data:
        mean, cov = data["subgrade_reaction_MN_m3"], data["subgrade_reaction_cov"]
        forms["subgrade_reaction"] = {"distribution": "lognormal", "mean": f"{mean!r} MN/m^3", "cov": f"{cov!r}"}
    return [Entry(key, entry.position, block_of(entry.value.position, form)) for key, form in forms.items()]
