"""Entries that hold what a site gives: the street to a boulder in place of a speed.

Each is worked out while the file is read and stands for entries of the table from then on; what was used is kept, so
that it can be printed, stored and reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from boulder_sweep.approach import Approach, NoApproachError
from boulder_sweep.settings.leaf import LeafError, Mistake, read_single
from boulder_sweep.settings.model import Bound, Field
from boulder_sweep.settings.problems import did_you_mean, shorten
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence

APPROACH = "approach"
SPEED = "speed"
APPROACH_FIELDS = {
    key: Field("vehicle.approach", key, name, unit, meaning, bound)
    for key, name, unit, meaning, bound in (
        (
            "length",
            "length_m",
            "m",
            "length of the run-up: from its beginning, or the end of its last curve, to the boulder",
            Bound(0.0, 1e5, "a length"),
        ),
        ("from", "from_m_s", "m/s", "speed at the beginning of the run-up", Bound(0.0, 100.0, "up to 360 km/h")),
        (
            "acceleration",
            "acceleration_m_s2",
            "m/s^2",
            "acceleration of the vehicle at full throttle on level ground",
            Bound(0.0, 20.0, "tyres transmit about 1 g at most"),
        ),
        (
            "curve_radius",
            "curve_radius_m",
            "m",
            "radius of the curve that ends where the run-up begins",
            Bound(1.0, 1e5, "no truck turns tighter"),
        ),
        (
            "friction",
            "friction",
            "1",
            "coefficient of friction of the tyres in that curve; 1 if not given, the conservative value",
            Bound(0.05, 2.0, "0.6 is usual on a road, 1 is conservative"),
        ),
        (
            "grade",
            "grade",
            "1",
            "rise over run of the street in the direction of travel, negative downhill",
            Bound(-0.5, 0.5, "no street is steeper"),
        ),
    )
}
"""Entries of a run-up by key."""
NEEDS_ACCELERATION = (
    "lacks acceleration: that of the vehicle at full throttle on level ground, averaged over the run-up, by its maker "
    "or a timed run from rest (2 s / t^2); no values for classes of vehicles are built in"
)


def read_approach(node: Node) -> Approach:
    """Read ``{length: 80 m, from: 0 mph, acceleration: 1.5 m/s^2, curve_radius: 25 m, friction: 0.8, grade: -4 %}``.

    Raises
    ------
    LeafError
        With every mistake in it.
    """
    values = read_block(node, APPROACH_FIELDS, "an approach")
    given = node.entries if isinstance(node, Mapping) else {}
    mistakes = []
    if "length" not in given:
        mistakes.append(Mistake(node.position, "lacks length, that of the run-up to the boulder"))
    if "acceleration" not in given:
        mistakes.append(Mistake(node.position, NEEDS_ACCELERATION))
    if not {"from", "curve_radius"} & set(given):
        mistakes.append(Mistake(node.position, "lacks from (0 mph for a start from rest) or curve_radius"))
    if "friction" in given and "curve_radius" not in given:
        mistakes.append(Mistake(given["friction"].position, "friction limits the speed in a curve: give curve_radius"))
    if mistakes:
        raise LeafError(mistakes)
    approach = Approach(**values)
    try:
        speed = approach.impact_speed_m_s
    except NoApproachError as error:
        raise LeafError([Mistake(node.position, str(error))]) from None
    if speed > 100.0:
        message = f"reaches {speed:.4g} m/s; more than 100 m/s (360 km/h) is not admitted"
        raise LeafError([Mistake(node.position, message)])
    return approach


def read_block(node: Node, known: dict[str, Field], what: str) -> dict[str, float]:
    """Return the single values of a block by the names of its fields.

    Raises
    ------
    LeafError
        With every mistake in it: no block, an unknown key, a wrong value.
    """
    keys = ", ".join(known)
    if not isinstance(node, Mapping) or node.unit is not None:
        raise LeafError([Mistake(node.position, f"{what} must be a block of keys: {keys}")])
    values: dict[str, float] = {}
    mistakes: list[Mistake] = []
    for entry in node:
        field = known.get(entry.key)
        if field is None:
            hint = did_you_mean(entry.key, tuple(known))
            mistakes.append(Mistake(entry.position, f"'{shorten(entry.key)}' is not a key of {what} ({keys}){hint}"))
            continue
        try:
            values[field.name] = read_single(entry.value, field)
        except LeafError as error:
            mistakes.extend(Mistake(found.position, f"{entry.key}: {found.message}") for found in error.mistakes)
    if mistakes:
        raise LeafError(mistakes)
    return values


def approach_data(approach: Approach) -> dict[str, Any]:
    """Return what is kept of a run-up as plain data: what was given, and the speeds that follow."""
    given = {name: value for name, value in asdict(approach).items() if value is not None}
    if approach.curve_radius_m is None:
        del given["friction"]
    else:
        given["curve_speed_m_s"] = approach.curve_speed_m_s
    return {**given, "impact_speed_m_s": approach.impact_speed_m_s}


def approach_words(data: dict[str, Any]) -> str:
    """Return in one line how a speed follows from a run-up, by what `approach_data` returned."""
    start, curve = data.get("from_m_s", math.inf), data.get("curve_speed_m_s", math.inf)
    first = "from rest" if start == 0.0 else f"from {_speed(min(start, curve))}"
    if curve < start:
        first += f", the most in a curve of {data['curve_radius_m']:.4g} m (sqrt({data['friction']:g} g r))"
    street = "" if data["grade"] == 0.0 else f", grade {100.0 * data['grade']:+g} %"
    run = f"over {data['length_m']:.4g} m with {data['acceleration_m_s2']:.4g} m/s^2{street}"
    return f"{_speed(data['impact_speed_m_s'])} is the most that reaches the boulder: {first}, {run}"


def derived_words(derived: dict[str, Any]) -> list[str]:
    """Return how inputs were worked out, a line each, by `boulder_sweep.settings.Sweep.derived`."""
    lines = []
    for key, path, words in ((APPROACH, "vehicle.speed", approach_words),):
        for data in derived.get(key, []):
            of_set = f" ({data['name']})" if "name" in data else ""
            lines.append(f"{path}{of_set}: {words(data)}")
    return lines


def _speed(speed: float) -> str:
    return f"{speed:.4g} m/s ({speed / 0.44704:.3g} mph)"


def unfold_approaches(root: Mapping) -> tuple[list[Mistake], list[dict[str, Any]]]:
    """Replace the approach of every vehicle by its speed.

    Parameters
    ----------
    root : Mapping
        The tree of the file, changed in place.

    Returns
    -------
    mistakes : list of Mistake
        What is wrong with them.
    data : list of dict
        What `approach_data` keeps of each, under the name of its vehicle where it is a named one.
    """
    mistakes: list[Mistake] = []
    data: list[dict[str, Any]] = []
    for vehicle in blocks_of(root, "vehicle"):
        entry = vehicle.entries.get(APPROACH)
        if entry is None:
            continue
        try:
            approach = read_approach(entry.value)
        except LeafError as error:
            mistakes += error.mistakes
            del vehicle.entries[APPROACH]
            continue
        if SPEED in vehicle.entries:
            mistakes.append(Mistake(entry.position, f"give {SPEED} or {APPROACH}, not both"))
        name = vehicle.get("name")
        data.append(({"name": name.text.strip()} if isinstance(name, Scalar) else {}) | approach_data(approach))
        speed = Scalar(entry.value.position, f"{approach.impact_speed_m_s!r} m/s")
        replace_entry(vehicle, APPROACH, [Entry(SPEED, entry.position, speed)])
    return mistakes, data


def blocks_of(root: Mapping, section: str) -> Iterator[Mapping]:
    """Yield the block of a section, or each of its named sets."""
    node = root.get(section)
    for one in node.items if isinstance(node, Sequence) else [node]:
        if isinstance(one, Mapping):
            yield one


def replace_entry(block: Mapping, key: str, new: list[Entry]) -> None:
    """Put entries in the place of one."""
    entries: dict[str, Entry] = {}
    for entry in block:
        entries |= {one.key: one for one in new} if entry.key == key else {entry.key: entry}
    block.entries = entries
