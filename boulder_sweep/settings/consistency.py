"""Checks across entries: what is missing, contradictory or mutually exclusive."""

from __future__ import annotations

import math
from collections.abc import Sequence

from boulder_sweep.columns import BOULDER_MASS
from boulder_sweep.designs import MOST_SOLIDITY
from boulder_sweep.settings import fields
from boulder_sweep.settings.entries import Entries
from boulder_sweep.settings.model import UNLOADINGS, WATER_KG_M3, Layer, Model, SolverSettings
from boulder_sweep.settings.shape import Shape
from boulder_sweep.stones.rock import ROCK_KG_M3

SLIDES = "or the ground slides"
"""What becomes of ground that falls as steeply as its friction angle; the page of a report says the same."""
FLOATS = "soil of {value} would float; give the density of the saturated soil below it"
"""Why a density is refused below the water table; the page of a report says the same."""


def check_complete(entries: Entries) -> None:
    """Report missing entries, entries given twice, and axes beside a table."""
    listed = set() if entries.table is None else set(entries.table.columns)
    # What a table that could not be read may contain is unknown.
    unread_table = entries.root.get("table") is not None and entries.table is None
    present = {field.path for field in fields.INPUTS if field.name in listed} | entries.given
    for field in fields.INPUTS:
        if field.name in listed and field.path in entries.given:
            message = f"is given here and as column {field.name} of the table; remove one"
            entries.problems.add(entries.position_of(field), field.path, message)
        if field.name == "boulder_density_kg_m3" and entries.gives_mass:
            continue  # that of most rocks is assumed
        if not field.optional and not unread_table and field.path not in present | entries.misspelled:
            entries.problems.add(entries.position_of(field), field.path, "is required and missing")
    _check_embedment(entries, present, unread_table)
    if entries.root.get("table") is not None:
        for name, leaf in entries.leaves.items():
            if leaf.is_axis:
                message = "must be one value beside a table; lists and ranges are axes of a grid"
                entries.problems.add(leaf.position, fields.BY_NAME[name].path, message)


def _check_embedment(entries: Entries, present: set[str], unread_table: bool) -> None:
    ways = [fields.BY_NAME[name] for name in fields.EMBEDMENT]
    given = [field for field in ways if field.path in present]
    keys = " or ".join(field.key for field in ways)
    if len(given) > 1:
        entries.problems.add(entries.position_of(given[1]), given[1].path, f"give {keys}, not both")
    elif not given and not unread_table and not {field.path for field in ways} & entries.misspelled:
        entries.problems.add(entries.position_of(ways[0]), "site", f"{keys} is required and missing")


def check_pairs(entries: Entries) -> None:
    """Report contradictory single values; those of axes and tables are reported row by row in the result."""
    bumper, hood = entries.single("bumper_height_m"), entries.single("hood_height_m")
    if bumper is not None and hood is not None and hood < bumper:
        key = "hood_height" if "vehicle.hood_height" in entries.given else "bumper_height"
        message = f"the hood ({hood:g} m) is lower than the bumper ({bumper:g} m)"
        entries.problems.add(entries.key_position("vehicle", key), f"vehicle.{key}", message)
    _check_impact_height(entries, bumper)
    _check_second_spring(entries)
    _check_shape(entries)
    _check_mass(entries)
    _check_solver(entries)
    _check_uncertain(entries)
    _check_ground(entries)


def _check_impact_height(entries: Entries, bumper: float | None) -> None:
    height, depth = entries.single("boulder_height_m"), entries.single("embedment_depth_m")
    ratio, impact = entries.single("embedment_ratio"), entries.single("impact_height_m")
    if depth is None and ratio is not None and height is not None:
        depth = ratio * height
    if height is None or depth is None or impact is None or bumper is None:
        return
    exposed = height - depth
    if exposed > bumper and impact > exposed * (1 + 1e-12):
        message = f"{impact:g} m is above the top of the boulder, which stands {exposed:g} m out of the ground"
        entries.problems.add(entries.leaves["impact_height_m"].position, "site.impact_height", message)


def _check_second_spring(entries: Entries) -> None:
    """Report half of a second spring, and one that is softer than the first."""
    names = ("vehicle_second_spring_N_m", "vehicle_second_spring_from_m")
    listed = set() if entries.table is None else set(entries.table.columns)
    both = [fields.BY_NAME[name] for name in names]
    given = [field for field in both if field.path in entries.given or field.name in listed]
    if len(given) == 1:
        lacking = next(field for field in both if field not in given)
        message = f"needs {lacking.key} beside it"
        entries.problems.add(entries.key_position("vehicle", given[0].key), given[0].path, message)
    spring, second = entries.single("vehicle_spring_N_m"), entries.single(names[0])
    if spring is not None and second is not None and second < spring:
        message = f"{second:g} N/m is softer than the first spring of {spring:g} N/m; a front that softens is refused"
        entries.problems.add(entries.key_position("vehicle", both[0].key), both[0].path, message)


def shape_in(entries: Entries) -> Shape:
    """Return the shape of the boulders, as far as it can be read."""
    return Model(**{name: entries.settings[name] for name in ("profile", "taper") if name in entries.settings}).shape


def _check_shape(entries: Entries) -> None:
    """Report plastic soil beside a boulder that is no box."""
    key = "profile" if "profile" in entries.settings else "taper"
    if not shape_in(entries).is_box and entries.settings.get("unloading", UNLOADINGS[0]) != UNLOADINGS[0]:
        message = f"plastic soil knows boxes only; remove boulder.{key} or model.unloading"
        entries.problems.add(entries.key_position("boulder", key), f"boulder.{key}", message)


def _check_mass(entries: Entries) -> None:
    """Report boulders that are all heavier than solid boxes of their size."""
    density = entries.values("boulder_density_kg_m3")
    sides = [entries.values(f"boulder_{side}_m") for side in ("length", "width", "height")]
    mass = entries.values(BOULDER_MASS)
    if not all(map(len, (mass, *sides))):
        return
    assumed = "" if len(density) else " assumed for it (give boulder.density)"
    rock = float(density.max()) if len(density) else ROCK_KG_M3
    shape = shape_in(entries)
    box = rock * math.prod(float(side.max()) for side in sides) * shape.filled
    solid = "a solid box of this size" if shape.is_box else "solid rock of this profile"
    if mass.min() > MOST_SOLIDITY * box:
        message = (
            f"{mass.min():g} kg is {mass.min() / box:.2f} times the mass of {solid}, {box:.6g} kg at "
            f"the density of {rock:g} kg/m^3{assumed}; at most {MOST_SOLIDITY:g} times can be a mistake of measurement"
        )
        entries.problems.add(entries.key_position("boulder", "mass"), "boulder.mass", message)


def _check_solver(entries: Entries) -> None:
    position = entries.key_position("solver", "step")
    step, horizon = entries.settings.get("step_s"), entries.settings.get("horizon_s", SolverSettings().horizon_s)
    if {"solver.accuracy", "solver.step"} <= entries.given:
        entries.problems.add(position, "solver.step", "give accuracy or step, not both")
    elif step is not None and step > horizon:
        entries.problems.add(position, "solver.step", f"is longer than the horizon of {horizon:g} s")


def _check_uncertain(entries: Entries) -> None:
    """Report a correlation without two distributions, and a partial factor beside a distribution."""
    uncertain = {name for name, leaf in entries.leaves.items() if leaf.distribution is not None}
    pair = {"friction_angle_deg", "subgrade_reaction_MN_m3"}
    if "correlation" in entries.settings and not pair <= uncertain and pair <= set(entries.leaves):
        message = "needs a distribution of soil.friction_angle and one of soil.subgrade_reaction"
        entries.problems.add(entries.key_position("soil", "correlation"), "soil.correlation", message)
    if "partial_factor" in entries.settings and "friction_angle_deg" in uncertain:
        position = entries.key_position("partial_factor", "friction_angle")
        message = "give a partial factor or a distribution of soil.friction_angle, not both"
        entries.problems.add(position, "partial_factor.friction_angle", message)


def uppermost_is_wet(layers: Sequence[Layer], water_table_m: float) -> bool:
    """Return whether the water table lies in the uppermost layer of the soil, which `layers` leaves out."""
    return not layers or layers[0].from_m > water_table_m


def _check_ground(entries: Entries) -> None:
    """Report ground that falls as steeply as its friction angle, and soil that would float below the water table."""
    layers = entries.settings.get("layers", ())
    slope, water = entries.settings.get("slope_deg", 0.0), entries.settings.get("water_table_m")
    if slope > 0.0:
        factor = entries.settings.get("partial_factor", 1.0)
        angles = [*entries.values("friction_angle_deg"), *(layer.friction_angle_deg for layer in layers)]
        least = math.degrees(math.atan(math.tan(math.radians(min(angles))) / factor)) if len(angles) else math.inf
        if slope >= least:
            message = f"must be less than every friction angle (the least is {least:.4g} deg), {SLIDES}"
            entries.problems.add(entries.key_position("soil", "slope"), "soil.slope", message)
    if water is not None:
        top_is_wet = uppermost_is_wet(layers, water)
        bottoms = [*(layer.from_m for layer in layers[1:]), math.inf]
        densities = [layer.density_kg_m3 for layer, bottom in zip(layers, bottoms, strict=False) if bottom > water]
        densities += [*entries.values("soil_density_kg_m3")] if top_is_wet else []
        if densities and min(densities) <= WATER_KG_M3:
            message = FLOATS.format(value=f"{min(densities):g} kg/m^3")
            entries.problems.add(entries.key_position("soil", "water_table"), "soil.water_table", message)
