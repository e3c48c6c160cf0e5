"""Read the entries of a file block by block; after a mistake reading goes on with the next entry."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.settings import fields
from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.model import (
    CLOSED_FORM,
    NO_OPINION,
    PRESETS,
    PRINTED,
    RESISTANCES,
    SECOND_OPINIONS,
    SWITCHES,
    Bound,
    Distribution,
    Layer,
    ProfilePoint,
    ReadingChoice,
    Scan,
    SetDistributions,
    Shape,
)
from boulder_sweep.settings.problems import Position, Problems, did_you_mean, shorten, unknown_word, wrong
from boulder_sweep.settings.soil_readings import (
    CORRELATION,
    ENERGY,
    HOLE,
    METHODS,
    SOIL_KEYS,
    TOPSOIL,
    Log,
    unfold_soils,
)
from boulder_sweep.settings.sweep import SECTION, UNITS, DesignList
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence, block_of
from boulder_sweep.settings.units import SYSTEMS, UnitError, factor
from boulder_sweep.settings.values import Leaf, meant_by, quoted, read_block, read_count, read_input, read_single
from boulder_sweep.settings.vehicle import APPROACH, unfold_approaches
from boulder_sweep.stones.rock import ROCKS

NAMED_SETS = ("soil", "vehicle")
"""Blocks that may be a list of named sets."""
NAME = re.compile(r"\w[\w .+-]{0,79}")
"""Names of sweeps and of named sets."""
NAME_RULE = "must be at most 80 letters, digits, spaces and - _ . +, as in m30-sizing"
"""Message about a name that `NAME` refuses."""
TOP_KEYS = ("name", *fields.SECTIONS, "table", SECTION, UNITS, fields.ALLOW_UNUSUAL)
SITE_KEYS = {"soil": (*METHODS, HOLE, ENERGY, TOPSOIL.key), "vehicle": (APPROACH,)}
"""Keys of a block that stand for others, as the site gives them."""
DRAWN_SD = 5.0
"""Standard deviations from its mean up to which an uncertain input is drawn, but for one value in three million."""
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
        fields.LAYER_TOP,
        replace(fields.BY_NAME["soil_density_kg_m3"], name="density_kg_m3"),
        *(fields.BY_NAME[name] for name in ("friction_angle_deg", "subgrade_reaction_MN_m3", "cohesion_kPa")),
    )
}
"""Entries of a layer by key; all are required but the last."""


class Entries:
    """What a file says, as far as it can be read."""

    def __init__(self, root: Mapping, path: Path, problems: Problems) -> None:
        self.root = root
        self.path = path
        self.problems = problems
        self.leaves: dict[str, Leaf] = {}  # inputs by column (or axis) name, as far as they have no mistake
        self.settings: dict[str, Any] = {}  # what holds for all designs, by attribute, as far as it has no mistake
        self.given: set[str] = set()  # dotted keys that stand in the file, right or wrong
        self.misspelled: set[str] = set()  # dotted keys that are missing, while an unknown key looks like them
        self.sets: dict[str, tuple[str, ...]] = {}  # names of the named sets of a block that is a list of them
        self.table: DesignList | None = None
        self.depth_sought = False
        self.derived: dict[str, Any] = {}  # what inputs were worked out of, by the key of the file
        self.cautions: list[str] = []  # about the scan
        self.allowed: tuple[str, ...] = ()  # dotted keys whose values may be far from usual, sorted

    def read(self) -> None:
        """Read the whole file; mistakes go to `problems`."""
        for entry in self.root:
            if entry.key not in TOP_KEYS:
                self.unknown(entry, "", TOP_KEYS)
        self._read_allowed()
        self._read_list()
        self._unfold()
        for section in sorted(fields.SECTIONS, key="soil".__eq__):
            if section == "soil":  # which of its readings count depends on the boulder, the site and the vehicle
                self._unfold_soils()
            self._read_block(section)
            if section == "boulder":
                self._take_sides()
        order = [*fields.SECTIONS]
        self.leaves = dict(sorted(self.leaves.items(), key=lambda leaf: order.index(fields.BY_NAME[leaf[0]].section)))
        both = {"friction_angle_deg", "subgrade_reaction_MN_m3"}
        if any(both <= set(soil) for soil in self.derived.get("soil", ())):
            self.settings.setdefault("correlation", CORRELATION)

    @contextmanager
    def reporting(self, path: str, stands_for: Iterable[str] = ()) -> Iterator[Problems]:
        """Report the mistakes of an entry at its path; what it stands for is given then, right or wrong."""
        problems = Problems()
        with self.problems.under(path):
            with problems.under():
                yield problems
            problems.raise_if_any()
        if problems:
            self.given.update(stands_for)

    def _unfold(self) -> None:
        """Replace what stands for other entries by these."""
        with self.reporting(f"vehicle.{APPROACH}", ["vehicle.speed"]) as problems:
            approaches = unfold_approaches(self.root, problems)
        self.derived |= {APPROACH: approaches} if approaches else {}
        boulder = self.root.get("boulder")
        if isinstance(boulder, Mapping) and "rock" in boulder.entries:
            with self.reporting("boulder.rock", ["boulder.density"]):
                self.derived |= {"rock": ({"name": _unfold_rock(boulder)},)}
        if isinstance(boulder, Mapping) and "scan" in boulder.entries:
            self.given.add("boulder.scan")
            folder = self._folder_of(boulder.entries["scan"].position)
            with self.reporting("boulder.scan", [f"boulder.{key}" for key in (*SIDES, "density")]):
                self.settings["scan"], self.cautions = _unfold_scan(boulder, folder)

    def _unfold_soils(self) -> None:
        """Replace the readings of an investigation by soil constants."""
        listed = [key for key in SOIL_KEYS if fields.BY_PATH[f"soil.{key}"].name in self.listed]
        with self.reporting("soil", [f"soil.{key}" for key in SOIL_KEYS]) as problems:
            soils = unfold_soils(self.root, listed, self._feet(), problems, self._read_log)
        self.derived |= {"soil": soils} if soils else {}

    def _read_log(self, node: Scalar, hole: Scalar | None) -> Log:
        """Read the log of a borehole or of a cone."""
        from boulder_sweep.settings.logs import read_log  # needed for logs only

        return read_log(node, hole, self._folder_of(node.position))

    def _feet(self) -> tuple[float, float]:
        """Return the shallowest and the deepest foot of all designs [m]; infinity where mistakes leave them unknown.

        A depth to be found is searched from the least usual embedment down to where the truck goes over the boulder.
        """
        names = "boulder_height_m", *reversed(fields.EMBEDMENT)
        (low, high), (least, most), (from_ratio, to_ratio) = (self._drawn(name) for name in names)
        if most.size:
            return float(least.min()), float(most.max())
        if self.depth_sought and high.size:
            bumper, usual = fields.BY_NAME["bumper_height_m"], fields.BY_NAME[fields.EMBEDMENT[0]].usual
            deepest = float(high.max() - min(self.values(bumper.name), default=bumper.default))
            return (float(low.min()) * usual.low if usual else 0.0), deepest
        if not high.size or not to_ratio.size:
            return math.inf, math.inf
        if {"boulder_height_m", fields.EMBEDMENT[0]} <= self.listed:
            return float((low * from_ratio).min()), float((high * to_ratio).max())
        return float(low.min() * from_ratio.min()), float(high.max() * to_ratio.max())

    def _drawn(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the values of an input that is no input of named sets, the least and largest drawn where uncertain."""
        values, leaf = self.values(name), self.leaves.get(name)
        spread = None if leaf is None else leaf.distribution
        if not isinstance(spread, Distribution):
            return values, values
        reach = DRAWN_SD * spread.deviation(values)
        return np.maximum(spread.low, values - reach), np.minimum(spread.high, values + reach)

    def _take_sides(self) -> None:
        """Take the sides of the boulder from its profile, if it has one; they must not be given beside it."""
        sides = {f"boulder.{key}" for key in SIDES} if "boulder.profile" in self.given else set()
        points: tuple[ProfilePoint, ...] = self.settings.get("profile", ())
        if points:
            for path in sorted(self.given & {*sides, "boulder.taper"}):
                self.report(path, "is part of boulder.profile; remove one of them")
            for key, value in _sides_of(points).items():
                at = self.position_of("boulder.profile")
                self.leaves[f"boulder_{key}_m"] = Leaf(np.array([value]), False, at)
            self.settings["profile"] = _shares_of(points)
        self.given |= sides  # a profile with mistakes is reported, and its sides are not missing

    def _folder_of(self, position: Position) -> Path:
        """Return where a file lies that is named at a position: beside the settings, or in the current directory."""
        return self.path.parent if position.file == str(self.path) else Path()

    def _read_allowed(self) -> None:
        """Read ``allow_unusual: [vehicle.mass]``, or ``all``."""
        node = self.root.get(fields.ALLOW_UNUSUAL)
        if node is None:
            return
        allowed: set[str] = set()
        for item in node.items if isinstance(node, Sequence) and node.unit is None else [node]:
            word = item.text.strip() if isinstance(item, Scalar) else ""
            known = (*fields.HELD, fields.EVERYTHING)
            if word in known:
                allowed.update(fields.HELD if word == fields.EVERYTHING else [word])
            else:
                message = unknown_word(word, "an entry that is held to its usual range", known)
                self.problems.add(item.position, message, fields.ALLOW_UNUSUAL)
        self.allowed = tuple(sorted(allowed))

    def _read_list(self) -> None:
        node = self.root.get("table")
        if node is None:
            return
        from boulder_sweep.settings.tables import read_designs  # needed for tables only

        if not isinstance(node, Scalar) or not node.text.strip():
            self.problems.add(node.position, "must be the name of a .csv, .xlsx or .parquet file", "table")
            return
        self.table = read_designs(node, self._folder_of(node.position), self.problems)

    def block(self, section: str, known: Iterable[str]) -> Mapping | None:
        """Return a block of the file; None where it is left out, empty, or reported to be no block of keys."""
        node = self.root.get(section)
        if node is None or (isinstance(node, Scalar) and not node.text.strip() and not node.quoted):
            return None  # not there, or every line of it is commented out
        if isinstance(node, Mapping) and node.unit is None:
            return node
        self.problems.add(node.position, f"must be a block of keys: {', '.join(known)}", section)
        return None

    def _read_block(self, section: str) -> None:
        known = {field.key: field for field in fields.fields_of(section)}
        node = self.root.get(section)
        if section in NAMED_SETS and isinstance(node, Sequence):
            self._read_sets(section, node, known)
            return
        for inner in self.block(section, known) or ():
            field = known.get(inner.key)
            if field is None:
                self.unknown(inner, section, (*known, *SITE_KEYS.get(section, ())))
                continue
            self.given.add(field.path)
            with self.reporting(field.path):
                words = inner.value.text.lower().split() if isinstance(inner.value, Scalar) else []
                if field.name == fields.EMBEDMENT[1] and words == fields.TO_BE_FOUND.split():
                    self.depth_sought = True
                elif field in fields.INPUTS:
                    self.leaves[field.name] = read_input(inner.value, field)
                else:
                    self.settings[field.name] = _read_setting(inner.value, field)

    def _read_sets(self, section: str, node: Sequence, known: dict[str, Field]) -> None:
        """Read a list of named sets: ``[{name: loose, density: 1700 kg/m^3, ...}, ...]``."""
        before = len(self.problems)
        names: list[str] = []
        columns: dict[str, list[Leaf]] = {}
        for item in node.items or [Scalar(node.position, "")]:
            if not isinstance(item, Mapping):
                message = "must be a list of blocks, each with a name and one value per key"
                self.problems.add(item.position, message, section)
                continue
            names.append(self._read_set_name(section, item, names))
            for inner in item:
                field = known.get(inner.key)
                if inner.key == "name":
                    continue
                if field is None:
                    inputs = (key for key in known if known[key] in fields.INPUTS)
                    self.unknown(inner, section, ("name", *inputs, *SITE_KEYS.get(section, ())))
                elif field not in fields.INPUTS:
                    message = f"is not a key of {section} in a named set: it is one for all designs of a file"
                    self.problems.add(inner.position, message, field.path)
                else:
                    self.given.add(field.path)
                    with self.reporting(field.path):
                        columns.setdefault(field.name, []).append(_one_of_set(inner.value, field))
            if len(self.problems) == before:
                for name, values in columns.items():
                    if len(values) != len(names):
                        message = "must be given in every named set, or in none"
                        self.problems.add(item.position, message, fields.BY_NAME[name].path)
        if len(self.problems) == before:
            self.sets[section] = tuple(names)
            self.leaves |= {name: _axis_of_sets(section, leaves, node.position) for name, leaves in columns.items()}

    def _read_set_name(self, section: str, item: Mapping, taken: list[str]) -> str:
        """Return the name of a named set."""
        node = item.get("name")
        name = node.text.strip() if isinstance(node, Scalar) else ""
        if not NAME.fullmatch(name):
            position = item.position if node is None else node.position
            message = "every named set needs a name of at most 80 letters, digits, spaces and - _ . +"
            self.problems.add(position, message, f"{section}.name")
        elif name in taken:
            self.problems.add(item.position, f"'{name}' is given twice", f"{section}.name")
        return name

    def unknown(self, entry: Entry, section: str, known: tuple[str, ...]) -> None:
        """Report an unknown key, with the one that is meant."""
        word = entry.key.lower()
        by_key = {key: fields.BY_PATH.get(f"{section}.{key}") for key in known}
        if bool(section) and any(field.key == word for field in fields.FIELDS):  # it is one of another block
            by_key = {key: field for key, field in by_key.items() if field is not None and word in field.also}
        meant, hint = ("", "") if self.problems.full else meant_by(entry, by_key)
        if meant and not section:
            self.misspelled |= {field.path for field in fields.fields_of(meant)}
        elif meant:
            self.misspelled.add(f"{section}.{meant}")
        else:
            other = next((field for field in fields.FIELDS if word in (field.key, *field.also)), None)
            if other is not None and other.section != section:
                hint = f"; {other.key} belongs under {other.section}"
        where = section or "the file"
        name = shorten(entry.key) or "(empty)"
        path = f"{section}.{name}" if section else name
        self.problems.add(entry.position, f"is not a key of {where} (keys: {', '.join(known)}){hint}", path)

    @property
    def listed(self) -> set[str]:
        """Names of the inputs that the table gives."""
        return set() if self.table is None else set(self.table.columns)

    def single(self, name: str) -> float | None:
        """Return the single value of a quantity, its default where it has one, None for axes and tables."""
        field = fields.BY_NAME[name]
        if name in self.listed:
            return None
        leaf = self.leaves.get(name)
        if leaf is None:
            return None if field.path in self.given else field.default
        return None if leaf.is_axis else float(leaf.values[0])

    def values(self, name: str) -> np.ndarray:
        """Return all values of an input, however it is given; none where it has a mistake."""
        if self.table is not None and name in self.table.columns:
            return self.table.columns[name]
        return self.leaves[name].values if name in self.leaves else np.empty(0)

    @property
    def written_units(self) -> str:
        """The system of the unit in which the height of the boulder is written; ``si`` of a bare number."""
        height = fields.BY_NAME["boulder_height_m"]
        if self.table is not None and height.name in self.table.columns:
            return self.table.units
        leaf = self.leaves.get(height.name)
        return SYSTEMS[0] if leaf is None else leaf.system

    @property
    def gives_mass(self) -> bool:
        """Whether the file or its table gives the mass of the boulders, right or wrong."""
        return fields.BOULDER_MASS.path in self.given or fields.BOULDER_MASS.name in self.listed

    def position_of(self, path: str) -> Position:
        """Return where a dotted key stands, else its block, else the beginning of the file."""
        section, _, key = path.partition(".")
        entry = self.root.entries.get(section)
        if entry is None:
            return self.root.position
        inner = entry.value.entries.get(key) if isinstance(entry.value, Mapping) else None
        return entry.position if inner is None else inner.position

    def report(self, path: str, message: str) -> None:
        """Report what is wrong with an entry, where it stands."""
        self.problems.add(self.position_of(path), message, path)


def _one_of_set(node: Node, field: Field) -> Leaf:
    """Return the value that a named set gives for an input, with its distribution if it has one."""
    leaf = read_input(node, field)
    if leaf.distribution is None:
        return Leaf(np.array([read_single(node, field)]), False, node.position, leaf.written)
    if leaf.is_axis:
        raise wrong(node.position, "must have one mean in a named set")
    return leaf


def _axis_of_sets(section: str, leaves: list[Leaf], position: Position) -> Leaf:
    """Return the values that the named sets give for an input, as an axis."""
    each = tuple(one if isinstance(one := leaf.distribution, Distribution) else None for leaf in leaves)
    spread = SetDistributions(section, each) if any(each) else None
    values, positions = np.concatenate([leaf.values for leaf in leaves]), tuple(leaf.position for leaf in leaves)
    return Leaf(values, True, position, leaves[0].written, positions, spread)


def _read_layers(node: Node) -> tuple[Layer, ...]:
    """Read ``[{from: 0.5 m, density: ..., friction_angle: ..., subgrade_reaction: ..., cohesion: ...}, ...]``."""
    if not isinstance(node, Sequence) or not 1 <= len(node.items) <= MOST_LAYERS:
        message = f"must be a list of 1 to {MOST_LAYERS} layers, each a block of keys: {', '.join(LAYER_FIELDS)}"
        raise wrong(node.position, message)
    layers: list[Layer] = []
    problems = Problems()
    for item in node.items:
        with problems.under():
            layer = Layer(**read_block(item, LAYER_FIELDS, "a layer", [*LAYER_FIELDS][:-1]))
            if layers and layer.from_m <= layers[-1].from_m:
                message = f"begins at {layer.from_m:g} m, not below the layer before it ({layers[-1].from_m:g} m)"
                problems.add(item.position, message)
            layers.append(layer)
    problems.raise_if_any()
    return tuple(layers)


def _read_profile(node: Node) -> tuple[ProfilePoint, ...]:
    """Read ``[{height: 0 m, width: 1.2 m, length: 1.1 m}, ...]``, or ``near`` and ``far`` for ``length``, in metres."""
    if not isinstance(node, Sequence) or not 2 <= len(node.items) <= MOST_POINTS or node.unit is not None:
        message = f"must be a list of 2 to {MOST_POINTS} points from the foot up, each a block of keys: "
        raise wrong(node.position, message + ", ".join(PROFILE_FIELDS))
    points: list[ProfilePoint] = []
    problems = Problems()
    for item in node.items:
        with problems.under():
            point = _read_point(item)
            if not points and not problems and point.height != 0.0:
                problems.add(item.position, f"the first point is the foot, at 0 m, not {point.height:g} m")
            if points and point.height <= points[-1].height:
                message = f"is {point.height:g} m high, not above the point before it ({points[-1].height:g} m)"
                problems.add(item.position, message)
            points.append(point)
    problems.raise_if_any()
    if not max(point.width for point in points) * max(point.near + point.far for point in points) > 0.0:
        raise wrong(node.position, "has neither width nor length")
    if not Shape(_shares_of(tuple(points))).stands_up:
        raise wrong(node.position, "its centre of mass does not lie over its foot: it would fall over by itself")
    return tuple(points)


def _read_point(node: Node) -> ProfilePoint:
    """Read one point of a profile."""
    given = set(node.entries) if isinstance(node, Mapping) else set()
    reaches = given & {"near", "far"}
    if "length" in given and reaches:
        raise wrong(node.position, "give length, or near and far, not both")
    needed = ("height", "width", *(("near", "far") if reaches else ("length",)))
    values = read_block(node, PROFILE_FIELDS, "a point", needed)
    half = 0.5 * values.get("length", 0.0)
    near, far = values.get("near", half), values.get("far", half)
    if near + far < 0.0:
        raise wrong(node.position, "near and far together are the length, which cannot be negative")
    return ProfilePoint(values["height"], values["width"], near, far)


def _unfold_scan(boulder: Mapping, folder: Path) -> tuple[Scan, list[str]]:
    """Replace the scan of a boulder, and its mass, by profile and density; return the scan and what makes one doubt it.

    A relative name begins in `folder`.
    """
    entry = boulder.entries.pop("scan")
    words = _read_scan_words(entry.value)
    problems = Problems()
    for key in _OF_SCAN:
        if key in boulder.entries:
            problems.add(boulder.entries[key].position, f"{key} follows from the scan; remove one of them")
    if len({"mass", "density"} & set(boulder.entries)) != 1:
        message = "beside a scan give the mass of the whole boulder, or its density: one of them"
        problems.add(entry.position, message)
    problems.raise_if_any()
    mass = boulder.entries.pop("mass", None)
    mass_kg = None if mass is None else read_single(mass.value, fields.BOULDER_MASS)
    from boulder_sweep.stones.weighing import scanned  # needed for scans only

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


def _unfold_rock(boulder: Mapping) -> str:
    """Give a boulder the density of its kind of rock, a triangular distribution over the published range; name it."""
    entry = boulder.entries["rock"]
    if "density" in boulder.entries:
        raise wrong(boulder.entries["density"].position, "density follows from boulder.rock; remove one of them")
    word = _one_of(entry.value, tuple(ROCKS), fields.BY_NAME["rock"].kind)
    texts = (f"{value:g} kg/m^3" for value in ROCKS[word])
    spread = {"distribution": "triangular", **dict(zip(("low", "mode", "high"), texts, strict=True))}
    boulder.entries["density"] = Entry("density", entry.position, block_of(entry.position, spread))
    return word


def _read_scan_words(node: Node) -> dict[str, str]:
    """Return the words of a scan by key."""
    if not isinstance(node, Mapping) or node.unit is not None:
        raise wrong(node.position, f"must be a block, as in {_SCAN_FORM}; 'sweep stone' lists the ways to stand")
    problems, words = Problems(), {}
    for one in node:
        if one.key not in SCAN_KEYS:
            problems.add(one.position, unknown_word(one.key, "a key of a scan", SCAN_KEYS))
        elif not isinstance(one.value, Scalar) or not one.value.text.strip():
            problems.add(one.value.position, f"{one.key} must be one word")
        else:
            words[one.key] = one.value.text.strip()
    missing = [key for key in SCAN_KEYS if key != "unit" and key not in node.entries]
    if missing:
        message = f"the scan lacks {', '.join(missing)}, as in {_SCAN_FORM}; 'sweep stone' lists the ways to stand"
        problems.add(node.position, message)
    problems.raise_if_any()
    return words


def _sides_of(points: tuple[ProfilePoint, ...]) -> dict[str, float]:
    """Return length, width and height [m] of the box around a profile in metres, by the keys of the file."""
    return {
        "length": max(point.near for point in points) + max(point.far for point in points),
        "width": max(point.width for point in points),
        "height": points[-1].height,
    }


def _shares_of(points: tuple[ProfilePoint, ...]) -> tuple[ProfilePoint, ...]:
    """Return a profile in metres as shares of the box around it."""
    sides = _sides_of(points)
    L, W, H = sides["length"], sides["width"], sides["height"]
    return tuple(ProfilePoint(one.height / H, one.width / W, one.near / L, one.far / L) for one in points)


def _read_setting(node: Node, field: Field) -> Any:
    """Return the value of an entry that cannot be an axis."""
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
    problems = Problems()
    preset, switches = "corrected", {}
    for entry in node:
        with problems.under():
            if entry.key == "preset":
                preset = _one_of(entry.value, PRESETS, "a reading of the paper")
            elif entry.key in SWITCHES:
                value = _one_of(entry.value, (PRINTED, SWITCHES[entry.key], "corrected"), f"a value of {entry.key}")
                switches[entry.key] = SWITCHES[entry.key] if value == "corrected" else value
            else:
                problems.add(entry.position, unknown_word(entry.key, "a reading", ("preset", *SWITCHES)))
    problems.raise_if_any()
    return replace(ReadingChoice.of_preset(preset), **switches)


def _read_soil(node: Node) -> int:
    """Read ``closed_form`` (0) or ``{elements: N}`` (N)."""
    if isinstance(node, Mapping) and list(node.entries) == ["elements"]:
        return read_count(node.entries["elements"].value, "the number of soil elements", fields.MAX_ELEMENTS)
    if isinstance(node, Scalar) and node.text.strip() == CLOSED_FORM:
        return 0
    message = f"{quoted(node)} is not a representation of the soil: closed_form, or {{elements: 5000}}"
    raise wrong(node.position, message)


def _read_second_opinion(node: Node) -> tuple[str, ...]:
    """Read one law or a list of laws, in the order of the register; ``none`` for no second opinion."""
    if isinstance(node, Scalar) and node.text.strip().lower() == NO_OPINION:
        return ()
    items = node.items if isinstance(node, Sequence) else [node]
    asked, problems = set(), Problems()
    for item in items:
        if isinstance(item, Scalar) and item.text.strip().lower() == RESISTANCES[0]:
            message = (
                f"{RESISTANCES[0]} is no second opinion: with friction and vertical motion it would pass many designs "
                f"that fail, and no test speaks for that; choose {' or '.join(SECOND_OPINIONS)}"
            )
            problems.add(item.position, message)
            continue
        with problems.under():
            asked.add(_one_of(item, SECOND_OPINIONS, fields.BY_NAME["second_opinion"].kind))
    problems.raise_if_any()
    return tuple(law for law in SECOND_OPINIONS if law in asked)


_READERS: dict[str, Callable[[Node], Any]] = {
    "readings": _read_readings,
    "soil_elements": _read_soil,
    "layers": _read_layers,
    "profile": _read_profile,
    "second_opinion": _read_second_opinion,
}
"""Readers by name; an entry without one is a single number within its admitted range."""
