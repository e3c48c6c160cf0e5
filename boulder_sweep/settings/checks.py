"""Checks across entries: mistakes for which a file is refused, and notes on valid settings that never stop a run."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from boulder_sweep.columns import BOULDER_MASS, SHAPES, WAY_OUT
from boulder_sweep.designs import LEAST_SOLIDITY, LEAST_TAPED, MOST_SOLIDITY, SIDES
from boulder_sweep.investigation import api_curve, off_families, terzaghi_curve
from boulder_sweep.settings import fields
from boulder_sweep.settings.entries import Entries
from boulder_sweep.settings.fields import BY_NAME, Field
from boulder_sweep.settings.model import (
    BOUNDED,
    CLOSED_FORM,
    ENOUGH_ELEMENTS,
    WATER_KG_M3,
    Distribution,
    Layer,
    Model,
    SetDistributions,
    SolverSettings,
)
from boulder_sweep.settings.problems import MAX_ALIKE, Position, Problem
from boulder_sweep.settings.sweep import DesignList, Sweep
from boulder_sweep.settings.units import describe, range_words
from boulder_sweep.settings.values import is_unusual
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.text import counted

_OWN_NAMES = ("id", "name", "no", "boulder", "stone")
"""Ends of the names of columns that tell boulders apart."""
SLIDES = "or the ground slides"
"""What becomes of ground that falls as steeply as its friction angle; the page of a report says the same."""
FLOATS = "soil of {value} would float; give the density of the saturated soil below it"
"""Why a density is refused below the water table; the page of a report says the same."""

_FRONT = ("vehicle_mass_kg", "impact_speed_m_s", "vehicle_spring_N_m", "vehicle_damper_N_s_m")
LEAST_CRUSH, MOST_CRUSH = 0.5, 1.25
"""Crush at a rigid wall over the calibrated one, between which spring and damper are taken for the vehicle's. A
boulder gives way and takes less of the front than a wall: hence more than 1."""


def check_complete(entries: Entries) -> None:
    """Report missing entries, entries given twice, and axes beside a table."""
    # What a table that could not be read may contain is unknown.
    table_refused = entries.root.get("table") is not None and entries.table is None
    present = {field.path for field in fields.INPUTS if field.name in entries.listed} | entries.given
    for field in fields.INPUTS:
        if field.name in entries.listed and field.path in entries.given:
            entries.report(field.path, f"is given here and as column {field.name} of the table; remove one")
        if field.name == "boulder_density_kg_m3" and entries.gives_mass:
            continue  # the density of most rocks is assumed
        if not field.optional and not table_refused and field.path not in present | entries.misspelled:
            column = f"; give it here or as column {field.name} of {table.file}" if (table := entries.table) else ""
            entries.report(field.path, f"is required and missing{column}")
    _check_embedment(entries, present, table_refused)
    if entries.root.get("table") is not None:
        for name, leaf in entries.leaves.items():
            if leaf.is_axis:
                field = BY_NAME[name]
                first = describe(float(leaf.values[0]), field.unit, leaf.written)
                message = "must be one value beside a table; lists and ranges are axes of a grid: ask once for each "
                message += f"value, --set {field.path}={shlex.quote(first)}"
                entries.problems.add(leaf.position, message, field.path)


def check_usual(entries: Entries) -> None:
    """Report values so far from usual that the file must allow them. In a table such a value makes its row an error."""
    found: list[tuple[Position, str, Field, np.ndarray, str]] = []
    for field in fields.INPUTS:
        leaf = entries.leaves.get(field.name)
        if leaf is not None:
            places = leaf.positions or [leaf.position] * len(leaf.values)
            at: dict[Position, list[float]] = {}
            for position, value in [*zip(places, leaf.values.tolist(), strict=True), *_ends(leaf.distribution)]:
                at.setdefault(position, []).append(value)
            found += [(position, field.path, field, np.array(values), leaf.written) for position, values in at.items()]
    layers = np.array([layer.density_kg_m3 for layer in entries.settings.get("layers", ())])
    found.append((entries.position_of("soil.layers"), "soil.layers", BY_NAME["soil_density_kg_m3"], layers, ""))
    far = [
        (position, path, field, values[off], written)
        for position, path, field, values, written in found
        if field.path not in entries.allowed and (off := is_unusual(values, field)).any()
    ]
    remedy = _allowing([*entries.allowed, *(field.path for _, _, field, _, _ in far)])
    for position, path, field, values, written in far:
        entries.problems.add(position, f"{_far_words(values, field, written)}; {remedy}", path)


def _ends(spread: Distribution | SetDistributions | None) -> Iterator[tuple[Position, float]]:
    """Yield both ends of distributions that reach from one to the other, each with its position."""
    for one in spread.each if isinstance(spread, SetDistributions) else (spread,):
        if one is not None and one.kind in BOUNDED:
            yield from ((one.position, one.low), (one.position, one.high))


def _allowing(paths: Iterable[str]) -> str:
    """Return how the values of some entries are allowed."""
    return f"if it is meant, the file allows it by {fields.ALLOW_UNUSUAL}: [{', '.join(sorted(set(paths)))}]"


def _far_words(values: np.ndarray, field: Field, written: str = "") -> str:
    """Return how far values are from usual, in the unit in which they were written, if any."""
    assert field.usual is not None
    low, high = float(values.min()), float(values.max())
    usual = range_words(field.usual.low, field.usual.high, field.unit, written, digits=4)
    remark = field.usual.remark.partition("; a bare number")[0] if written else field.usual.remark
    far = f"less than 1/{fields.FAR:g} of" if high < field.usual.low else f"more than {fields.FAR:g} times"
    if low < field.usual.low < high:
        far = f"more than {fields.FAR:g} times outside"
    return f"{range_words(low, high, field.unit, written)} is {far} the usual {usual} ({remark})"


def _check_embedment(entries: Entries, present: set[str], table_refused: bool) -> None:
    ways = [BY_NAME[name] for name in fields.EMBEDMENT]
    given = [field.path for field in ways if field.path in present]
    keys = " or ".join(field.key for field in ways)
    if len(given) > 1:
        entries.report(given[1], f"give {keys}, not both")
    elif not given and not table_refused and not {field.path for field in ways} & entries.misspelled:
        message = f"{keys} is required and missing; {ways[1].key}: {fields.TO_BE_FOUND} leaves it to 'sweep need'"
        entries.problems.add(entries.position_of(ways[0].path), message, "site")


def check_pairs(entries: Entries) -> None:
    """Report contradictory single values; values of axes and tables are reported row by row in the result."""
    bumper, hood = entries.single("bumper_height_m"), entries.single("hood_height_m")
    if bumper is not None and hood is not None and hood < bumper:
        key = "hood_height" if "vehicle.hood_height" in entries.given else "bumper_height"
        entries.report(f"vehicle.{key}", f"the hood ({hood:g} m) is lower than the bumper ({bumper:g} m)")
    _check_impact_height(entries, bumper)
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
        entries.problems.add(entries.leaves["impact_height_m"].position, message, "site.impact_height")


def _check_mass(entries: Entries) -> None:
    """Report boulders that are all heavier than solid boxes of their size."""
    density = entries.values("boulder_density_kg_m3")
    sides = [entries.values(name) for name in SIDES]
    mass = entries.values(BOULDER_MASS)
    if not all(map(len, (mass, *sides))):
        return
    assumed = "" if len(density) else " assumed for it (give boulder.density)"
    rock = float(density.max()) if len(density) else ROCK_KG_M3
    shape = Model(**{name: entries.settings[name] for name in ("profile", "taper") if name in entries.settings}).shape
    box = rock * math.prod(float(side.max()) for side in sides) * shape.filled
    solid = "a solid box of this size" if shape.is_box else "solid rock of this profile"
    times = float(mass.min()) / box
    if times > MOST_SOLIDITY:
        message = (
            f"{mass.min():g} kg is {times:.2f} times the mass of {solid}, {box:.6g} kg at "
            f"the density of {rock:g} kg/m^3{assumed}; at most {MOST_SOLIDITY:g} times can be a mistake of measurement"
        )
        if 0.1 < times / 1000 <= MOST_SOLIDITY:
            message += "; a thousandth of it fits: is it in kg and not in t, or in lb and not in kip?"
        at, key = entries.position_of("boulder.mass"), "boulder.mass"
        if entries.table is not None and BOULDER_MASS in entries.listed:
            at, key = entries.table.position(int(mass.argmin())), entries.table.written[BOULDER_MASS]
        entries.problems.add(at, message, key)


def _check_solver(entries: Entries) -> None:
    step, horizon = entries.settings.get("step_s"), entries.settings.get("horizon_s", SolverSettings().horizon_s)
    if {"solver.accuracy", "solver.step"} <= entries.given:
        entries.report("solver.step", "give accuracy or step, not both")
    elif step is not None and step > horizon:
        entries.report("solver.step", f"is longer than the horizon of {horizon:g} s")


def _check_uncertain(entries: Entries) -> None:
    """Report a correlation without two distributions, and a partial factor beside a distribution."""
    uncertain = {name for name, leaf in entries.leaves.items() if leaf.distribution is not None}
    pair = {"friction_angle_deg", "subgrade_reaction_MN_m3"}
    if "correlation" in entries.settings and not pair <= uncertain and pair <= set(entries.leaves):
        message = "needs a distribution of soil.friction_angle and one of soil.subgrade_reaction"
        entries.report("soil.correlation", message)
    if "partial_factor" in entries.settings and "friction_angle_deg" in uncertain:
        message = "give a partial factor or a distribution of soil.friction_angle, not both"
        entries.report("partial_factor.friction_angle", message)


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
            entries.report("soil.slope", message)
    if water is not None:
        top_is_wet = uppermost_is_wet(layers, water)
        bottoms = [*(layer.from_m for layer in layers[1:]), math.inf]
        densities = [layer.density_kg_m3 for layer, bottom in zip(layers, bottoms, strict=False) if bottom > water]
        densities += [*entries.values("soil_density_kg_m3")] if top_is_wet else []
        if densities and min(densities) <= WATER_KG_M3:
            message = FLOATS.format(value=f"{min(densities):g} kg/m^3")
            entries.report("soil.water_table", message)


def notes_on(sweep: Sweep, positions: Mapping[str, Position], written: Mapping[str, str]) -> Iterator[Problem]:
    """Yield a note for every unusual value and for data that do not belong together.

    Inputs stand at `positions` by their dotted keys; their units are as `written` by the columns of the table.
    """
    table = sweep.table
    listed = {} if table is None else {BY_NAME[name].path: Position(table.source) for name in table.columns}
    for path, message in _remarks(sweep, written):
        if message:
            at = listed.get(path) or positions.get(path, Position(str(sweep.path)))
            yield Problem(at, message, path)
    if table is not None:
        yield from _on_list(sweep, table)


def _remarks(sweep: Sweep, written: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield dotted keys, and what is to be remarked of each; empty where nothing is."""
    values = sweep.values
    for name, of_input in values.items():
        if sweep.table is None or name not in sweep.table.columns:
            yield BY_NAME[name].path, _unusual(name, of_input, written.get(name, ""))
    for axis in sweep.axes:
        if len(set(axis.values.tolist())) < len(axis.values):
            yield BY_NAME[axis.name].path, "contains a value more than once"
    if "embedment_depth_m" in values:
        depth, height = _pairs(sweep, "embedment_depth_m", "boulder_height_m")
        ratio = depth / height
        off = _without_partner(_outside(ratio, BY_NAME["embedment_ratio"]))
        if off.any():
            yield "site.embedment_depth", f"depth over height: {_unusual('embedment_ratio', ratio[off])}"
    yield "boulder.mass", _on_mass(sweep)
    if "boulder_density_kg_m3" in sweep.distributions and BOULDER_MASS not in values and sweep.model.shape.is_box:
        yield "boulder.mass", "no mass: each boulder is a solid box of its sizes; weigh any that is no sawn block"
    yield "vehicle.spring", _off_front(sweep)
    if not sweep.model.shape.stands_flat:
        foot = "its foot is less than half as wide or long as the largest section"
        yield "boulder", f"{foot}: undecided (foot), {WAY_OUT['foot']}"
    limit, usual = sweep.criterion.max_rotation_deg, BY_NAME["max_rotation_deg"].usual
    if usual is not None and limit > usual.high:
        yield "criterion.max_rotation", f"{limit:g} deg is large: {usual.remark}"
    if 0 < sweep.model.soil_elements < ENOUGH_ELEMENTS:
        few = f"{counted(sweep.model.soil_elements, 'soil element')}: sums over so few may give other verdicts"
        yield "model.soil", f"{few}; take {ENOUGH_ELEMENTS} or more, or {CLOSED_FORM}"
    if sweep.partial_factor != 1.0:
        angles = values["friction_angle_deg"]
        ends = " to ".join(dict.fromkeys((f"{angles.min():.4g}", f"{angles.max():.4g}")))
        message = f"tan(friction angle) is divided by {sweep.partial_factor:g}: simulated and listed as {ends} deg"
        yield "partial_factor.friction_angle", message
    angle, reaction = _pairs(sweep, "friction_angle_deg", "subgrade_reaction_MN_m3")
    yield "soil.subgrade_reaction", _off_families(angle, reaction) or _mixed_families(angle, reaction)


def _on_list(sweep: Sweep, table: DesignList) -> Iterator[Problem]:
    """Yield what is to be remarked of the rows of a list, where they stand: of values alike, at the farthest off."""
    for name, values in table.columns.items():
        field = BY_NAME[name]
        unit = "" if field.unit == "1" else field.unit  # which the name of the column gives
        far = is_unusual(values, field) if sweep.is_held(name) else np.zeros(values.shape, dtype=bool)
        if far.any():  # of single values and axes the file has been refused
            rows = counted(int(far.sum()), "design")
            words = f"{_far_words(values[far], field, unit)}: {rows} not computed (error, unusual), the first is"
            words += f" design {far.argmax()}; {_allowing([*sweep.allowed, field.path])}"
            yield Problem(table.position(int(far.argmax())), words, field.path)
        off = np.flatnonzero(_outside(values, field) & ~far)
        low = 0.0 if field.usual is None else field.usual.low
        for some in (off[values[off] < low], off[values[off] > low]):
            if len(some):
                row = int(some[np.abs(values[some] - low).argmax()])
                more = f" ({len(some) - 1} more like it)" if len(some) > 1 else ""
                words = f"{table.called(row)}: {_unusual(name, values[row : row + 1], unit)}{more}"
                yield Problem(table.position(row), words, field.path)
    heavy = np.flatnonzero(sweep.fills > MOST_SOLIDITY)
    for row in heavy[:MAX_ALIKE].tolist():
        words = f"{table.called(row)} fills {sweep.fills[row]:.0%} of the box of its sizes by its mass: above "
        words += f"{MOST_SOLIDITY:.0%} a size or the mass is wrong; not computed (error)"
        words += f" ({len(heavy)} boulders like it)" if len(heavy) > MAX_ALIKE else ""
        yield Problem(table.position(row), words, "boulder.mass")
    ids = [(name, one) for name, one in table.labels.items() if name.lower().endswith(_OWN_NAMES)]
    for name, one in ids if all(BY_NAME[name].section == "boulder" for name in table.columns) else ():
        again = np.setdiff1d(np.arange(len(table)), np.unique(one.codes, return_index=True)[1])
        if twice := [row for row in again.tolist() if one.words[one.codes[row]]]:  # which it may with several soils
            yield Problem(table.position(twice[0]), f"{one.words[one.codes[twice[0]]]} stands twice", name)


def _on_mass(sweep: Sweep) -> str:
    """Return what is assumed of boulders that were weighed, and what stands for those that are no boxes."""
    table = sweep.table
    rows = np.flatnonzero((sweep.fills <= MOST_SOLIDITY) | (table is None))  # the others have notes of their own
    if BOULDER_MASS not in sweep.plan.given or not len(rows):
        return ""
    low, high = float(sweep.fills[rows].min()), float(sweep.fills[rows].max())
    share = " to ".join(dict.fromkeys((f"{low:.0%}", f"{high:.0%}")))
    if table is not None and high > 1.0:
        share += f" ({table.called(int(rows[sweep.fills[rows].argmax()]))})"
    words = [f"by its mass a boulder fills {share} of the box of its length, width and height"]
    if sweep.model.rock_assumed:
        words[0] += f" if its rock has {ROCK_KG_M3:g} kg/m^3, which is assumed: give boulder.density. No pass is robust"
    if sweep.is_taped:
        family = ", ".join(SHAPES).replace("_", " ")
        words.append(f"below {LEAST_SOLIDITY:.0%} it is judged by the worst of these shapes: {family}")
        if low < LEAST_TAPED:
            words.append(f"below {LEAST_TAPED:.0%} designs are undecided (shape): {WAY_OUT['shape']}")
    if high > 1.0 and sweep.model.shape.is_box:
        words.append("more than 100 % is the rounding of the tape: the boulder is a box of the mass as weighed")
    return "; ".join(words) if len(words) > 1 or sweep.model.rock_assumed else ""


def _pairs(sweep: Sweep, one: str, other: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of two inputs that occur, shape (n,) where they are listed together, (n, m) where crossed."""
    for group in sweep.groups:
        if one in group and other in group:
            return group[one], group[other]
    ones, others = np.meshgrid(_thinned(sweep.values[one]), _thinned(sweep.values[other]))
    return ones, others


def wall_crush(mass: np.ndarray, speed: np.ndarray, spring: np.ndarray, damper: np.ndarray) -> np.ndarray:
    """Return by how much the fronts of vehicles, in SI units, are crushed at a rigid wall (Eqs 49 to 51) [m]."""
    by_damper = mass * speed / damper
    decay, squared = -0.5 * spring / damper, spring / mass - (0.5 * spring / damper) ** 2
    b = np.sqrt(np.maximum(squared, 0.0))
    # An over-damped vehicle only comes to rest with its spring released.
    stops = np.arctan2(b, decay)
    by_spring = speed * np.exp(decay * stops / np.where(b > 0.0, b, np.inf)) * np.sin(stops)
    return by_damper + np.where(b > 0.0, by_spring / np.where(b > 0.0, b, 1.0), 0.0)


def _off_front(sweep: Sweep) -> str:
    """Return a caution if a vehicle's front would be crushed far from what spring and damper were fitted to.

    The crush grows with mass and speed, and falls with spring and damper, so the ends of axes suffice.
    """
    calibrated = sweep.model.calibrated_crush_m
    groups = [group for group in sweep.groups if {*group} & {*_FRONT}]
    front = []
    for name in _FRONT:
        varying = [name in group for group in groups]
        values = sweep.values[name]
        if not any(len(group) > 1 and name in group for group in groups):
            values = np.unique([values.min(), values.max()])
        front.append(values.reshape([-1 if varies else 1 for varies in varying]))
    crush = wall_crush(*front)
    least, largest = float(crush.min()), float(crush.max())
    if largest > MOST_CRUSH * calibrated:
        crushed = f"{largest:.3g} m" if least == largest else f"up to {largest:.3g} m"
    elif least < LEAST_CRUSH * calibrated:
        crushed = f"only {least:.3g} m"
    else:
        return ""
    return (
        f"against a rigid wall the front of this vehicle would be crushed by {crushed}; its spring and damper are "
        f"calibrated up to {calibrated:g} m (vehicle.calibrated_crush): do they belong to a vehicle of this mass and "
        "speed?"
    )


def _without_partner(off: np.ndarray) -> np.ndarray:
    """Return which pairs are off; of crossed axes, which make pairs nobody means, those with a value always off."""
    return off if off.ndim == 1 else off & (off.all(axis=0, keepdims=True) | off.all(axis=1, keepdims=True))


def _outside(values: np.ndarray, field: Field) -> np.ndarray:
    """Return which values lie outside the range met in practice, bool."""
    if field.usual is None:
        return np.zeros(values.shape, dtype=bool)
    slack = 1e-9 * field.usual.high
    return (values < field.usual.low - slack) | (values > field.usual.high + slack)


def _unusual(name: str, values: np.ndarray, written: str = "") -> str:
    """Return a note if a value lies outside the range met in practice, in the unit in which it was written, if any."""
    usual, unit = BY_NAME[name].usual, BY_NAME[name].unit
    if usual is None or not _outside(values, BY_NAME[name]).any():
        return ""
    low, high = float(values.min()), float(values.max())
    given = range_words(low, high, unit, written)
    ends = range_words(usual.low, usual.high, unit, written, digits=4)
    remark = usual.remark.partition("; a bare number")[0] if written else usual.remark
    outcome = "computed as given"
    if name == "embedment_ratio" and high >= 1.0:
        some = "designs of 1 or more " if low < 1.0 else ""
        outcome = f"{some}cannot be computed, since the depth must be less than the boulder's height"
    return f"{given} is outside the usual range of {ends} ({remark}); {outcome}"


def _off_families(angle: np.ndarray, reaction: np.ndarray) -> str:
    """Return a note if some soil constants belong to neither family of data."""
    off = _without_partner(off_families(angle, reaction))
    if not off.any():
        return ""
    phi, beta = angle[off][0], reaction[off][0]
    curves = f"Terzaghi's values give {terzaghi_curve(phi):.2g}, the API curve {api_curve(phi):.2g}"
    return f"{beta:g} MN/m^3 does not go with {phi:g} deg: {curves} MN/m^3; take both soil constants from one source"


def _mixed_families(angle: np.ndarray, reaction: np.ndarray) -> str:
    """Return a note if some soils follow Terzaghi's values and others the API curve."""
    pairs = angle.ravel(), reaction.ravel()
    near_api = np.abs(np.log(pairs[1] / api_curve(pairs[0]))) < np.abs(np.log(pairs[1] / terzaghi_curve(pairs[0])))
    if near_api.all() or not near_api.any():
        return ""
    one, other = np.flatnonzero(near_api)[-1], np.flatnonzero(~near_api)[0]
    return (
        "two families of data are mixed: "
        f"{pairs[1][one]:g} MN/m^3 at {pairs[0][one]:g} deg lies near the API curve, "
        f"{pairs[1][other]:g} MN/m^3 at {pairs[0][other]:g} deg near Terzaghi's values, which are "
        "several times smaller for the same soil; take both soil constants from one source"
    )


def _thinned(values: np.ndarray) -> np.ndarray:
    """Return at most 200 values, ends included."""
    return values if len(values) <= 200 else values[np.linspace(0, len(values) - 1, 200).astype(int)]
