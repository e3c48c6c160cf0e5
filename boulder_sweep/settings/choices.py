"""The entries that are more than a number.

Words, readings of the paper, soil representation, accuracy, second opinions, layers, and the shape of the boulder: by a
profile, or by a scan (``scan: {file: rock.ply, up: a, facing: b}``), which becomes its profile and its density.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from boulder_sweep.errors import ScanError
from boulder_sweep.settings.fields import BOULDER_MASS, BY_NAME, LAYER_TOP, MAX_ELEMENTS, Field
from boulder_sweep.settings.model import (
    ACCURACIES,
    CLOSED_FORM,
    NO_OPINION,
    PRESETS,
    PRINTED,
    RESISTANCES,
    SECOND_OPINIONS,
    SWITCHES,
    Bound,
    Layer,
    ReadingChoice,
)
from boulder_sweep.settings.problems import Mistakes, did_you_mean, unknown_word, wrong
from boulder_sweep.settings.shape import ProfilePoint, Scan, Shape
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence, block_of
from boulder_sweep.settings.units import UnitError, factor
from boulder_sweep.settings.values import NumberError, quoted, read_count, read_entries, read_single, split_number
from boulder_sweep.stones.rock import ROCKS

MOST_LAYERS = 100
MOST_POINTS = 100
_SIDE = Bound(0.0, 20.0, "a length")
_REACH = Bound(
    -20.0, 20.0, "a length; negative where a boulder that leans does not reach back over the middle of its foot"
)
PROFILE_FIELDS = {
    key: Field("boulder.profile", key, key, "m", meaning, bound)
    for key, meaning, bound in (
        ("height", "height over the foot", _SIDE),
        ("width", "width at that height", _SIDE),
        ("length", "length at that height", _SIDE),
        ("near", "in place of length: reach towards the vehicle from the middle of the foot", _REACH),
        ("far", "in place of length: reach away from the vehicle", _REACH),
    )
}
SCAN_KEYS = ("file", "up", "facing", "unit")
"""Keys of a scan; all are required but the last."""
_SCAN_FORM = "{file: rock.ply, up: a, facing: b}"
SIDES = ("length", "width", "height")
"""Keys of the boulder that a profile stands for."""
_OF_SCAN = (*SIDES, "taper", "profile")
"""Keys of the boulder that a scan stands for."""
LAYER_FIELDS = {
    field.key: field
    for field in (
        LAYER_TOP,
        *(BY_NAME[name] for name in ("soil_density_kg_m3", "friction_angle_deg", "subgrade_reaction_MN_m3")),
        BY_NAME["cohesion_kPa"],
    )
}
"""Entries of a layer by key; all are required but the last."""
_NAMES = dict(zip(LAYER_FIELDS, Layer.__dataclass_fields__, strict=True))


def read_layers(node: Node) -> tuple[Layer, ...]:
    """Read ``[{from: 0.5 m, density: ..., friction_angle: ..., subgrade_reaction: ..., cohesion: ...}, ...]``.

    Raises
    ------
    LeafError
        With every mistake in the list.
    """
    if not isinstance(node, Sequence) or not 1 <= len(node.items) <= MOST_LAYERS:
        message = f"must be a list of 1 to {MOST_LAYERS} layers, each a block of keys: {', '.join(LAYER_FIELDS)}"
        raise wrong(node.position, message)
    layers: list[Layer] = []
    mistakes = Mistakes()
    for item in node.items:
        with mistakes:
            layer = _read_layer(item)
            if layers and layer.from_m <= layers[-1].from_m:
                message = f"begins at {layer.from_m:g} m, not below the layer before it ({layers[-1].from_m:g} m)"
                mistakes.add(item.position, message)
            layers.append(layer)
    mistakes.raise_if_any()
    return tuple(layers)


def _read_layer(node: Node) -> Layer:
    """Read one layer; single values only."""
    mistakes = Mistakes()
    values = read_entries(node, LAYER_FIELDS, "a layer", mistakes)
    assert isinstance(node, Mapping)  # anything else has been refused
    missing = [key for key in LAYER_FIELDS if key not in node.entries and key != "cohesion"]
    if missing:
        mistakes.add(node.position, f"the layer lacks {', '.join(missing)}")
    mistakes.raise_if_any()
    return Layer(**{_NAMES[key]: value for key, value in values.items()})


def read_profile(node: Node) -> tuple[ProfilePoint, ...]:
    """Read ``[{height: 0 m, width: 1.2 m, length: 1.1 m}, ...]``, or ``near`` and ``far`` in place of ``length``.

    Returns
    -------
    tuple of ProfilePoint
        In metres; see `shares_of`.

    Raises
    ------
    LeafError
        With every mistake in the list.
    """
    keys = ", ".join(PROFILE_FIELDS)
    if not isinstance(node, Sequence) or not 2 <= len(node.items) <= MOST_POINTS or node.unit is not None:
        raise wrong(
            node.position, f"must be a list of 2 to {MOST_POINTS} points from the foot up, each a block of keys: {keys}"
        )
    points: list[ProfilePoint] = []
    mistakes = Mistakes()
    for item in node.items:
        with mistakes:
            point = _read_point(item)
            if not points and not mistakes and point.height != 0.0:
                mistakes.add(item.position, f"the first point is the foot, at 0 m, not {point.height:g} m")
            if points and point.height <= points[-1].height:
                message = f"is {point.height:g} m high, not above the point before it ({points[-1].height:g} m)"
                mistakes.add(item.position, message)
            points.append(point)
    if (
        not mistakes
        and not max(point.width for point in points) * max(point.near + point.far for point in points) > 0.0
    ):
        mistakes.add(node.position, "has neither width nor length")
    if not mistakes and not Shape(shares_of(tuple(points))).stands_up:
        message = "its centre of mass does not lie over its foot: it would fall over by itself"
        mistakes.add(node.position, message)
    mistakes.raise_if_any()
    return tuple(points)


def _read_point(node: Node) -> ProfilePoint:
    """Read one point of a profile."""
    mistakes = Mistakes()
    values = read_entries(node, PROFILE_FIELDS, "a point", mistakes)
    assert isinstance(node, Mapping)  # anything else has been refused
    given = set(node.entries)
    if "length" in given and given & {"near", "far"}:
        mistakes.add(node.position, "give length, or near and far, not both")
    wanted = ("height", "width", *(("near", "far") if given & {"near", "far"} else ("length",)))
    missing = [key for key in wanted if key not in given]
    if missing and not mistakes:
        mistakes.add(node.position, f"the point lacks {', '.join(missing)}")
    mistakes.raise_if_any()
    half = 0.5 * values.get("length", 0.0)
    if values.get("near", half) + values.get("far", half) < 0.0:
        raise wrong(node.position, "near and far together are the length, which cannot be negative")
    return ProfilePoint(values["height"], values["width"], values.get("near", half), values.get("far", half))


def unfold_scan(boulder: Mapping, folder: Path) -> tuple[Scan, list[str]]:
    """Replace the scan of a boulder, and the mass of the whole stone beside it, by profile and density.

    Returns what the scan is, and what makes one doubt it.

    Parameters
    ----------
    boulder
        The block of the boulder, changed in place.
    folder
        Where the scan lies if its name is relative.

    Raises
    ------
    LeafError
        With every mistake in it.
    """
    entry = boulder.entries.pop("scan")
    words = _read_scan_words(entry.value)
    mistakes = Mistakes()
    for key in _OF_SCAN:
        if key in boulder.entries:
            mistakes.add(boulder.entries[key].position, f"{key} follows from the scan; remove one of them")
    if len({"mass", "density"} & set(boulder.entries)) != 1:
        message = "beside a scan give the mass of the whole boulder, or its density: one of them"
        mistakes.add(entry.position, message)
    mistakes.raise_if_any()
    mass = boulder.entries.pop("mass", None)
    mass_kg = None if mass is None else read_single(mass.value, BOULDER_MASS)
    # What reads scans is needed for them only.
    from boulder_sweep.stones.weighing import scanned

    try:
        metres = float(factor(words.get("unit", "m"), "m"))
        scan = scanned(folder / words["file"], metres=metres, mass_kg=mass_kg)
        standing = scan.stone.standing(words["up"], words["facing"])
    except (ScanError, UnitError) as error:
        raise wrong(entry.value.position, str(error)) from None
    profile, position = standing.profile, entry.position
    if mass_kg is not None:
        boulder.entries["density"] = Entry("density", position, Scalar(position, f"{scan.density_kg_m3!r} kg/m^3"))
    points: list[Node] = []
    for values in zip(profile.height, profile.width, profile.near, profile.far, strict=True):
        texts = (f"{float(value)!r} m" for value in values)
        points.append(block_of(position, dict(zip(("height", "width", "near", "far"), texts, strict=True))))
    boulder.entries["profile"] = Entry("profile", position, Sequence(position, points))
    said = Scan(words["file"], scan.sha256, standing.up, standing.facing, standing.cut_m)
    return said, scan.surface_cautions


def unfold_rock(boulder: Mapping) -> None:
    """Give a boulder the density of its kind of rock: a triangular distribution over the published range.

    Parameters
    ----------
    boulder
        The block of the boulder, changed in place.

    Raises
    ------
    LeafError
        There is no such rock, or a density beside it.
    """
    entry = boulder.entries["rock"]
    if "density" in boulder.entries:
        raise wrong(boulder.entries["density"].position, "density follows from boulder.rock; remove one of them")
    word = _one_of(entry.value, tuple(ROCKS), BY_NAME["rock"].kind)
    texts = (f"{value:g} kg/m^3" for value in ROCKS[word])
    spread = {"distribution": "triangular", **dict(zip(("low", "mode", "high"), texts, strict=True))}
    boulder.entries["density"] = Entry("density", entry.position, block_of(entry.position, spread))


def _read_scan_words(node: Node) -> dict[str, str]:
    """Return the words of a scan by key."""
    if not isinstance(node, Mapping) or node.unit is not None:
        raise wrong(node.position, f"must be a block, as in {_SCAN_FORM}; 'sweep stone' lists the ways to stand")
    mistakes, words = Mistakes(), {}
    for one in node:
        if one.key not in SCAN_KEYS:
            mistakes.add(one.position, unknown_word(one.key, "a key of a scan", SCAN_KEYS))
        elif not isinstance(one.value, Scalar) or not one.value.text.strip():
            mistakes.add(one.value.position, f"{one.key} must be one word")
        else:
            words[one.key] = one.value.text.strip()
    missing = [key for key in SCAN_KEYS if key != "unit" and key not in node.entries]
    if missing:
        message = f"the scan lacks {', '.join(missing)}, as in {_SCAN_FORM}; 'sweep stone' lists the ways to stand"
        mistakes.add(node.position, message)
    mistakes.raise_if_any()
    return words


def sides_of(points: tuple[ProfilePoint, ...]) -> dict[str, float]:
    """Return length, width and height [m] of the box around a profile in metres, by the keys of the file."""
    return {
        "length": max(point.near for point in points) + max(point.far for point in points),
        "width": max(point.width for point in points),
        "height": points[-1].height,
    }


def shares_of(points: tuple[ProfilePoint, ...]) -> tuple[ProfilePoint, ...]:
    """Return a profile in metres as shares of the box around it."""
    sides = sides_of(points)
    L, W, H = sides["length"], sides["width"], sides["height"]
    return tuple(ProfilePoint(one.height / H, one.width / W, one.near / L, one.far / L) for one in points)


def read_setting(node: Node, field: Field) -> Any:
    """Return the value of an entry that cannot be an axis.

    Raises
    ------
    LeafError
        With every mistake of this entry.
    """
    if field.choices:
        return _one_of(node, field.choices, field.kind)
    reader = _READERS.get(field.name)
    return read_single(node, field) if reader is None else reader(node)


def _one_of(node: Node, choices: tuple[str, ...], what: str) -> str:
    """Return one of some words; capitals do not matter."""
    word = node.text.strip() if isinstance(node, Scalar) else ""
    for choice in choices:
        if word.lower() == choice.lower():
            return choice
    raise wrong(node.position, f"{quoted(node)} is not {what}: {', '.join(choices)}{did_you_mean(word, choices)}")


def _read_readings(node: Node) -> ReadingChoice:
    """Read a preset, or single switches on top of one (``corrected`` where none is named)."""
    if not isinstance(node, Mapping):
        return ReadingChoice.of_preset(_one_of(node, PRESETS, "a reading of the paper"))
    mistakes = Mistakes()
    preset, switches = "corrected", {}
    for entry in node:
        with mistakes:
            if entry.key == "preset":
                preset = _one_of(entry.value, PRESETS, "a reading of the paper")
            elif entry.key in SWITCHES:
                value = _one_of(entry.value, (PRINTED, SWITCHES[entry.key], "corrected"), f"a value of {entry.key}")
                switches[entry.key] = SWITCHES[entry.key] if value == "corrected" else value
            else:
                mistakes.add(entry.position, unknown_word(entry.key, "a reading", ("preset", *SWITCHES)))
    mistakes.raise_if_any()
    return ReadingChoice(**{**ReadingChoice.of_preset(preset).as_dict(), **switches})


def _read_soil(node: Node) -> int:
    """Read ``closed_form`` (0) or ``{elements: N}`` (N)."""
    if isinstance(node, Mapping) and list(node.entries) == ["elements"]:
        return read_count(node.entries["elements"].value, "the number of soil elements", MAX_ELEMENTS)
    if isinstance(node, Scalar) and node.text.strip() == CLOSED_FORM:
        return 0
    message = f"{quoted(node)} is not a representation of the soil: closed_form, or {{elements: 5000}}"
    raise wrong(node.position, message)


def _read_accuracy(node: Node) -> str | float:
    """Read a name, or the error of the rotation that is admitted."""
    field = BY_NAME["accuracy"]
    if isinstance(node, Scalar):
        word = node.text.strip()
        if word in ACCURACIES:
            return word
        try:
            split_number(node.text, field.unit)
        except NumberError:
            choices, hint = ", ".join(ACCURACIES), did_you_mean(word, ACCURACIES)
            message = f"{quoted(node)} is not {choices}, nor an angle such as 0.01 deg{hint}"
            raise wrong(node.position, message) from None
    return read_single(node, field)


def _read_second_opinion(node: Node) -> tuple[str, ...]:
    """Read one law or a list of laws, in the order of the register; ``none`` for no second opinion."""
    if isinstance(node, Scalar) and node.text.strip().lower() == NO_OPINION:
        return ()
    items = node.items if isinstance(node, Sequence) else [node]
    asked, mistakes = set(), Mistakes()
    for item in items:
        if isinstance(item, Scalar) and item.text.strip().lower() == RESISTANCES[0]:
            message = (
                f"{RESISTANCES[0]} is no second opinion: with friction and vertical motion it would pass many designs "
                f"that fail, and no test speaks for that; choose {' or '.join(SECOND_OPINIONS)}"
            )
            mistakes.add(item.position, message)
            continue
        with mistakes:
            asked.add(_one_of(item, SECOND_OPINIONS, BY_NAME["second_opinion"].kind))
    mistakes.raise_if_any()
    return tuple(law for law in SECOND_OPINIONS if law in asked)


_READERS: dict[str, Callable[[Node], Any]] = {
    "readings": _read_readings,
    "soil_elements": _read_soil,
    "layers": read_layers,
    "profile": read_profile,
    "accuracy": _read_accuracy,
    "second_opinion": _read_second_opinion,
}
"""Readers by name; an entry without one is a single number within its admitted range."""
