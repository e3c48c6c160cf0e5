"""Load a file as a checked sweep, with what ``--set KEY=VALUE`` puts in the place of single entries."""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Mapping as MappingABC
from collections.abc import Sequence
from dataclasses import fields as fields_of
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep import elementary
from boulder_sweep.errors import SettingsWarning
from boulder_sweep.settings import fields
from boulder_sweep.settings.checks import check_complete, check_pairs, check_usual, notes_on
from boulder_sweep.settings.entries import NAME, NAME_RULE, TOP_KEYS, Entries
from boulder_sweep.settings.model import NO_OPINION, USUAL_OPINION, Criterion, Model, SolverSettings
from boulder_sweep.settings.problems import (
    Position,
    Problem,
    Problems,
    SettingsError,
    check_regular_file,
    content_of,
    nearest,
    refuse,
    shorten,
    wrong,
)
from boulder_sweep.settings.sweep import SECTION, UNITS, Axis, Heading, Sweep, wrong_with
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, parse, parse_node
from boulder_sweep.settings.tree import Sequence as List
from boulder_sweep.settings.units import SYSTEMS
from boulder_sweep.settings.values import read_input
from boulder_sweep.stones.rock import ROCK_KG_M3

MAX_DESIGNS = 2**63 - 1
"""Most designs of a sweep: ``design_id`` is a 64-bit number."""

DENSITY = "boulder_density_kg_m3"
MAX_BYTES = 500_000
"""Largest settings file; real ones have a few kilobytes. Long lists of designs belong in a table."""

_ALTERNATIVES = {
    "site.embedment_ratio": "embedment_depth",
    "site.embedment_depth": "embedment_ratio",
    "solver.accuracy": "step",
    "solver.step": "accuracy",
    "vehicle.speed": "approach",
    "vehicle.approach": "speed",
}
"""Setting one removes the other from the file, which holds only one of them; two options contradict each other."""

OPTIONS = {
    "--accuracy": "solver.accuracy",
    "--second-opinion": "model.second_opinion",
    "--no-second-opinion": "model.second_opinion",
}
"""Options that set an entry: a mistake is reported for the option, not for ``--set``."""

SECOND_OPINION, NO_SECOND_OPINION = f"--second-opinion={USUAL_OPINION[0]}", f"--no-second-opinion={NO_OPINION}"
"""Asks for the second opinion that decides, whatever the file says; asks for none."""

LISTS = (".csv", ".xlsx", ".parquet")
"""Ends of the names of files that a settings file names."""

MAX_OVERRIDE = 20_000
"""Longest option, in characters."""

Settings = Sweep | str | Path | MappingABC[str, Any]
"""A sweep, the path of its file, or what such a file would hold."""
_IN_MEMORY = Path("settings")
"""What messages call settings that are no file."""


def load(settings: str | Path | MappingABC[str, Any], overrides: Sequence[str] = ()) -> Sweep:
    """Read and check settings.

    Parameters
    ----------
    settings : str, Path, or mapping
        YAML file, or what one would hold: ``{"boulder": {"height": [2.6, 3.0], "density": "162 pcf", ...}, ...}``.
        Files that a mapping names lie in the current directory.
    overrides : sequence of str
        ``key.path=value`` entries that replace entries of the file, as ``--set`` gives them.

    Returns
    -------
    Sweep
        Checked settings; grids are expanded only block by block.

    Raises
    ------
    SettingsError
        With every mistake of the file and of the overrides.

    Warns
    -----
    SettingsWarning
        Each note on the settings, which are read all the same.
    """
    if isinstance(overrides, str):
        raise TypeError(f"overrides must be a list of strings, such as [{overrides!r}]")
    if isinstance(settings, MappingABC):
        sweep = _load_mapping(settings, overrides)
    else:
        path = Path(settings)
        sweep = load_text(_read_text(path), path, overrides)
    for note in sweep.notes:
        warnings.warn(str(note), SettingsWarning, stacklevel=2)
    return sweep


def load_text(text: str, path: Path, overrides: Sequence[str] = ()) -> Sweep:
    """Check the text of a file of settings; `path` names it in messages. Otherwise as `load`."""
    problems = Problems()
    return _checked(parse(text, str(path), problems), path, overrides, problems)


def sweep_of(settings: Settings) -> Sweep:
    """Return settings as a sweep: itself, or as `load` reads a file or a mapping."""
    return settings if isinstance(settings, Sweep) else load(settings)


def _load_mapping(settings: MappingABC[str, Any], overrides: Sequence[str]) -> Sweep:
    """Check settings that are no file."""
    problems = Problems()
    root = parse(json.dumps(settings, default=_plain, ensure_ascii=False), str(_IN_MEMORY), problems)
    _move(root, Position(str(_IN_MEMORY)))  # lines and columns of it would tell nothing
    return replace(_checked(root, _IN_MEMORY, overrides, problems), path=None)


def _plain(value: Any) -> Any:
    """Return an array, a number of NumPy or a path as plain data."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def _checked(root: Mapping, path: Path, overrides: Sequence[str], problems: Problems) -> Sweep:
    """Read and check a tree."""
    _apply_overrides(root, overrides, problems)
    units = _read_units(root, problems)
    entries = Entries(root, path, problems)
    name = _read_name(entries)
    entries.read()
    heading = _read_heading(entries)
    check_complete(entries)
    check_usual(entries)
    check_pairs(entries)
    problems.raise_if_any()
    return _build(name, heading, units or entries.written_units, entries, tuple(overrides))


def _read_text(path: Path) -> str:
    """Return the text of a settings file."""
    if path.suffix.lower() in LISTS and path.is_file():
        message = "is no settings file; a list of designs is named in one, with what its columns do not give: table: "
        raise refuse(str(path), message + path.name)
    check_regular_file(path, MAX_BYTES, "Put a long list of designs into a separate file: table: designs.csv")
    return decode(content_of(path, MAX_BYTES), str(path))


def decode(data: bytes, label: str) -> str:
    """Return bytes as text; raise SettingsError for zero bytes, as in UTF-16, and for what is not UTF-8."""
    if b"\x00" in data:
        raise refuse(label, "is not a text file (it contains zero bytes); save it as text in UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = error.start - (before.rfind(b"\n") + 1) + 1
        raise refuse(label, "is not UTF-8 text; save it as UTF-8", line, column) from None


def _apply_overrides(root: Mapping, overrides: Sequence[str], problems: Problems) -> None:
    """Put every ``key.path=value`` into the tree, in order: keys as `fields.named` takes them, values as in the file.

    ``--accuracy=fine`` is an option of its own.
    """
    for text in overrides:
        key, equals, value_text = text.partition("=")
        option, key = (key, OPTIONS[key]) if key in OPTIONS else ("--set", key)
        path = key.strip().split(".")
        position, name = Position(option), shorten(key.strip())
        if len(path) == 1 and path[0] not in ("", *TOP_KEYS):
            try:
                path = fields.named(path[0], fields.FIELDS).path.split(".")
            except fields.UnknownNameError as unknown:
                if nearest(path[0], TOP_KEYS) is None:
                    problems.add(position, unknown.what, name)
                    continue
        if not equals or not all(path) or len(path) > 4:
            problems.add(position, f"'{shorten(text)}' is not KEY=VALUE, for example vehicle.speed='50 mph'")
            continue
        if len(text) > MAX_OVERRIDE:
            problems.add(position, f"is longer than {MAX_OVERRIDE} characters; put it into the file", name)
            continue
        value = _read_value(value_text, name, position, problems)
        if value is not None:
            _put(root, path, value, position)


def _read_value(text: str, name: str, position: Position, problems: Problems) -> Node | None:
    inner = Problems()
    try:
        value = parse_node(text, position.file, inner)
    except SettingsError:
        value = None  # its problems are in `inner`
    for problem in inner:
        problems.add(position, problem.message, name)
    if value is None:
        return None if inner else Scalar(position, "")
    _move(value, position)
    return value


def _move(node: Node, position: Position) -> None:
    """Give a whole tree the position of its option: a line number within an option means nothing."""
    node.position = position
    if isinstance(node, Scalar):
        return
    if node.unit is not None:
        node.unit.position = position
    if isinstance(node, Mapping):
        for entry in node:
            entry.position = position
            _move(entry.value, position)
    else:
        for item in node.items:
            _move(item, position)


def _put(root: Mapping, path: list[str], value: Node, position: Position) -> None:
    """Set one entry, opening blocks on the way where there are none."""
    block = root
    for depth, key in enumerate(path[:-1]):
        inner = block.get(key)
        if isinstance(inner, List) and all(isinstance(item, Mapping) for item in inner.items):
            for item in inner.items:  # named sets: the entry holds for all of them
                assert isinstance(item, Mapping)
                _put(item, path[depth + 1 :], value, position)
            return
        if not isinstance(inner, Mapping):
            opened = Mapping(position)
            if path[: depth + 1] == ["model", "readings"] and isinstance(inner, Scalar):
                # `readings: corrected` with one switch on top of it: the preset stays.
                opened.entries["preset"] = Entry("preset", inner.position, inner)
            block.entries[key] = Entry(key, position, opened)
            inner = opened
        block = inner
    other = _ALTERNATIVES.get(".".join(path))
    if other in block.entries and block.entries[other].position.file not in ("--set", *OPTIONS):
        del block.entries[other]
    block.entries[path[-1]] = Entry(path[-1], position, value)  # where it stands, so that axes keep their order


def _read_name(entries: Entries) -> str:
    """Return the name of the sweep; it also names files, so few characters are allowed."""
    default = re.sub(r"[^\w.+-]+", "-", entries.path.stem).strip("-.")[:80] or "sweep"
    node = entries.root.get("name")
    if node is None:
        return default
    if isinstance(node, Scalar) and NAME.fullmatch(node.text):
        return node.text
    entries.problems.add(node.position, NAME_RULE, "name")
    return default


def _read_heading(entries: Entries) -> Heading:
    """Return the heading in a file; mistakes go to its problems."""
    texts: dict[str, str] = {}
    for inner in entries.block(SECTION, Heading._fields) or ():
        path, value = f"{SECTION}.{shorten(inner.key)}", inner.value
        if inner.key not in Heading._fields:
            entries.unknown(inner, SECTION, Heading._fields)
        elif not isinstance(value, Scalar):
            entries.problems.add(value.position, "must be one line of text, not a list or a block", path)
        elif mistake := wrong_with(value.text):
            entries.problems.add(value.position, mistake, path)
        else:
            texts[inner.key] = value.text.strip()
    return Heading(**texts)


def _read_units(root: Mapping, problems: Problems) -> str:
    """Return the units named in a file, empty where none are; with ``us``, or in feet, no number may lack its unit."""
    node = root.get(UNITS)
    units = node.text.strip() if isinstance(node, Scalar) else ""
    if node is not None and units not in SYSTEMS:
        problems.add(node.position, f"must be {' or '.join(SYSTEMS)}", UNITS)
    if units == "us" or (node is None and _is_in_feet(root)):
        _need_units(root)
    return units


def _is_in_feet(root: Mapping) -> bool:
    """Whether the file itself gives the height of the boulder in feet or inches; an option says nothing of the rest."""
    field, boulder = fields.BY_NAME["boulder_height_m"], root.get("boulder")
    height = boulder.get(field.key) if isinstance(boulder, Mapping) else None
    if height is None or height.position.file in ("--set", *OPTIONS):
        return False
    try:
        return read_input(height, field).system == "us"
    except SettingsError:
        return False  # its mistake is reported as the block is read


def _need_units(node: Node) -> None:
    """Ask for a unit behind every number below a node that has a dimension."""
    if isinstance(node, Scalar):
        node.needs_unit = True
        return
    for inner in node.items if isinstance(node, List) else [entry.value for entry in node]:
        _need_units(inner)


def _build(name: str, heading: Heading, units: str, entries: Entries, overrides: tuple[str, ...]) -> Sweep:
    """Put the checked parts together."""
    factor = entries.settings.get("partial_factor", 1.0)
    if factor != 1.0:
        _apply_partial_factor(entries, factor)
    axes = _axes(entries)
    single = {field.name: entries.single(field.name) for field in fields.INPUTS}
    constants = {name: value for name, value in single.items() if value is not None}
    if entries.gives_mass and DENSITY not in {*constants, *entries.listed, *entries.leaves}:
        constants[DENSITY] = ROCK_KG_M3
        entries.settings["rock_assumed"] = True
    spreads = {name: leaf.distribution for name, leaf in entries.leaves.items() if leaf.distribution is not None}
    sweep = Sweep(
        name,
        entries.path,
        axes,
        constants,
        entries.table,
        *_choices(entries),
        distributions=spreads,
        correlation=entries.settings.get("correlation", 0.0),
        partial_factor=factor,
        overrides=overrides,
        heading=heading,
        units=units,
        depth_sought=entries.depth_sought,
        derived=entries.derived | ({"table": ({"file": entries.table.file},)} if entries.table else {}),
        allowed=entries.allowed,
    )
    positions = {field.path: entries.position_of(field.path) for field in fields.INPUTS}
    written = {name: leaf.written for name, leaf in entries.leaves.items()}
    at = entries.position_of("boulder.profile")  # which stands for a scan by now
    cautions = [Problem(at, caution, "boulder.scan") for caution in entries.cautions]
    return replace(sweep, notes=(*cautions, *notes_on(sweep, positions, written)))


def _apply_partial_factor(entries: Entries, factor: float) -> None:
    """Replace every friction angle by its design value, atan(tan(angle) / factor)."""
    field = fields.BY_NAME["friction_angle_deg"]

    def design(angle: np.ndarray) -> np.ndarray:
        return np.degrees(elementary.arctan(elementary.tan(np.radians(angle)) / factor))

    leaf = entries.leaves.get(field.name)
    if leaf is not None:
        entries.leaves[field.name] = replace(leaf, values=design(leaf.values))
    if "layers" in entries.settings:
        layers = entries.settings["layers"]
        angles = design(np.array([layer.friction_angle_deg for layer in layers]))
        entries.settings["layers"] = tuple(
            replace(layer, friction_angle_deg=float(angle)) for layer, angle in zip(layers, angles, strict=True)
        )
    if entries.table is not None and field.name in entries.table.columns:
        entries.table.columns[field.name] = design(entries.table.columns[field.name])


def _axes(entries: Entries) -> tuple[Axis, ...]:
    """Return the axes in the order of the file."""
    axes: list[Axis] = []
    for section in entries.root:
        if section.key == SECTION:
            continue
        if section.key in entries.sets:
            labels = entries.sets[section.key]
            names = [field.name for field in fields.fields_of(section.key) if field.name in entries.leaves]
            columns = {name: entries.leaves[name].values for name in names}
            axes.append(Axis(section.key, np.arange(float(len(labels))), columns, labels))
        for entry in section.value if isinstance(section.value, Mapping) else ():
            field = fields.BY_PATH[f"{section.key}.{entry.key}"]
            leaf = entries.leaves.get(field.name)  # settings have none
            if leaf is not None and leaf.is_axis:
                axes.append(Axis(field.name, leaf.values))
    count = math.prod(map(len, axes))
    if count > MAX_DESIGNS:
        raise wrong(entries.root.position, f"the grid has {count} designs; at most {MAX_DESIGNS} can be numbered")
    return tuple(axes)


def _choices(entries: Entries) -> tuple[Criterion, Model, SolverSettings]:
    """Return the settings that are not columns; what is not given has the default of its dataclass."""
    given = entries.settings
    if "step_s" in given:
        given = {"accuracy": None, **given}
    criterion, model, solver = (
        {attribute.name: given[attribute.name] for attribute in fields_of(kind) if attribute.name in given}
        for kind in (Criterion, Model, SolverSettings)
    )
    return Criterion(**criterion), Model(**model), SolverSettings(**solver)
