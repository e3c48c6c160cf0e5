"""Load a file as a checked sweep; every mistake is reported at once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields as fields_of
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from boulder_sweep import elementary
from boulder_sweep.settings import fields
from boulder_sweep.settings.consistency import check_complete, check_pairs
from boulder_sweep.settings.entries import NAME, NAME_RULE, Entries
from boulder_sweep.settings.heading import NO_HEADING, SECTION, Heading, wrong_with
from boulder_sweep.settings.model import Criterion, Model, SolverSettings
from boulder_sweep.settings.overrides import apply_overrides
from boulder_sweep.settings.problems import ProblemList, SettingsError, check_regular_file, reason_of, refuse, shorten
from boulder_sweep.settings.tree import Mapping, Scalar, parse
from boulder_sweep.stones.rock import ROCK_KG_M3

if TYPE_CHECKING:
    from boulder_sweep.settings.sweep import Axis, Sweep

MAX_DESIGNS = 2**63 - 1
"""Most designs of a sweep: ``design_id`` is a 64-bit number."""

DENSITY = "boulder_density_kg_m3"
MAX_BYTES = 500_000
"""Largest settings file; real ones have a few kilobytes. Long lists of designs belong in a table."""

_BYTE_ORDER_MARKS = (
    (b"\xff\xfe\x00\x00", "UTF-32"),
    (b"\x00\x00\xfe\xff", "UTF-32"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
)

Part = TypeVar("Part", Criterion, Model, SolverSettings)


def load(path: str | Path, overrides: Sequence[str] = ()) -> Sweep:
    """Read and check a file of settings.

    Parameters
    ----------
    path : str or Path
        YAML file.
    overrides : sequence of str
        ``key.path=value`` entries that replace those of the file, as ``--set`` gives them.

    Returns
    -------
    Sweep
        Checked settings; grids are expanded only block by block.

    Raises
    ------
    SettingsError
        With every mistake of the file and of the overrides.
    """
    path = Path(path)
    return load_text(_read_text(path), path, overrides)


def load_text(text: str, path: Path, overrides: Sequence[str] = ()) -> Sweep:
    """Check the text of a file of settings; `path` names it in messages. Otherwise as `load`."""
    problems = ProblemList()
    root = parse(text, str(path), problems)
    if root is None:
        raise SettingsError(problems.in_order())
    apply_overrides(root, overrides, problems)
    entries = Entries(root, path, problems)
    name = _read_name(entries)
    entries.read()
    heading = _read_heading(entries)
    check_complete(entries)
    check_pairs(entries)
    problems.raise_if_any()
    return _build(name, heading, entries, tuple(overrides))


def _read_text(path: Path) -> str:
    """Return the text of a settings file.

    Raises
    ------
    SettingsError
        The file cannot be read, is too large, or is not UTF-8 text.
    """
    check_regular_file(path, MAX_BYTES, "Put a long list of designs into a separate file: table: designs.csv")
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)  # a file may grow between the check and the reading
    except OSError as error:
        raise refuse(str(path), f"cannot be read ({reason_of(error)})") from None
    if len(data) > MAX_BYTES:
        raise refuse(str(path), f"is larger than {MAX_BYTES / 1e6:g} MB")
    return decode(data, str(path))


def decode(data: bytes, label: str) -> str:
    """Return `data` as text, or say why it cannot be.

    Raises
    ------
    SettingsError
        UTF-16 or UTF-32, zero bytes, or bytes that are not UTF-8.
    """
    for mark, encoding in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            raise refuse(label, f"is {encoding} text; save it as UTF-8")
    if b"\x00" in data:
        raise refuse(label, "is not a text file (it contains zero bytes); a YAML file in UTF-8 is needed")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = error.start - (before.rfind(b"\n") + 1) + 1
        raise refuse(label, "is not UTF-8 text; save it as UTF-8", line, column) from None


def _read_name(entries: Entries) -> str:
    """Return the name of the sweep; it also names files, so few characters are allowed."""
    default = re.sub(r"[^\w.+-]+", "-", entries.path.stem).strip("-.")[:80] or "sweep"
    node = entries.root.get("name")
    if node is None:
        return default
    if isinstance(node, Scalar) and NAME.fullmatch(node.text):
        return node.text
    entries.problems.add(node.position, "name", NAME_RULE)
    return default


def _read_heading(entries: Entries) -> Heading:
    """Return the heading in a file; mistakes go to its problems."""
    entry = entries.root.entries.get(SECTION)
    if entry is None:
        return NO_HEADING
    node = entry.value
    if isinstance(node, Scalar) and not node.text.strip() and not node.quoted:
        return NO_HEADING  # a block of which every line is commented out
    if not isinstance(node, Mapping) or node.unit is not None:
        entries.problems.add(node.position, SECTION, f"must be a block of keys: {', '.join(Heading._fields)}")
        return NO_HEADING
    found: dict[str, str] = {}
    for inner in node:
        path, value = f"{SECTION}.{shorten(inner.key)}", inner.value
        if inner.key not in Heading._fields:
            entries.unknown(inner, SECTION, Heading._fields)
        elif not isinstance(value, Scalar):
            entries.problems.add(value.position, path, "must be one line of text, not a list or a block")
        elif wrong := wrong_with(value.text):
            entries.problems.add(value.position, path, wrong)
        else:
            found[inner.key] = value.text.strip()
    return Heading(**found)


def _build(name: str, heading: Heading, entries: Entries, overrides: tuple[str, ...]) -> Sweep:
    """Put the checked parts together."""
    from boulder_sweep.settings.notes import notes_on
    from boulder_sweep.settings.sweep import Sweep

    factor = entries.settings.get("partial_factor", 1.0)
    if factor != 1.0:
        _apply_partial_factor(entries, factor)
    axes = _axes(entries)
    listed = set() if entries.table is None else set(entries.table.columns)
    constants: dict[str, float] = {}
    for field in fields.INPUTS:
        value = entries.single(field.name)
        if value is not None and field.name not in listed:
            constants[field.name] = value
    choices = _choices(entries)
    if entries.gives_mass and DENSITY not in {*constants, *listed, *entries.leaves}:
        constants[DENSITY] = ROCK_KG_M3
        choices = (choices[0], replace(choices[1], rock_assumed=True), choices[2])
    spreads = {name: leaf.distribution for name, leaf in entries.leaves.items() if leaf.distribution is not None}
    sweep = Sweep(
        name,
        entries.path,
        axes,
        constants,
        entries.table,
        *choices,
        distributions=spreads,
        correlation=entries.settings.get("correlation", 0.0),
        partial_factor=factor,
        overrides=overrides,
        heading=heading,
        derived=entries.derived,
    )
    positions = {field.name: entries.position_of(field) for field in fields.INPUTS}
    object.__setattr__(sweep, "notes", tuple(notes_on(sweep, positions)))
    return sweep


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
    from boulder_sweep.settings.sweep import Axis

    axes: list[Axis] = []
    count = 1
    for section in entries.root:
        if section.key == SECTION:
            continue
        if section.key in entries.sets:
            labels = entries.sets[section.key]
            columns = {field.name: entries.leaves[field.name].values for field in entries.inputs_of_sets(section.key)}
            axes.append(Axis(section.key, np.arange(float(len(labels))), columns, labels))
            count *= len(labels)
        if not isinstance(section.value, Mapping):
            continue
        for entry in section.value:
            field = fields.BY_PATH[f"{section.key}.{entry.key}"]
            leaf = entries.leaves.get(field.name)  # settings have none
            if leaf is not None and leaf.is_axis:
                axes.append(Axis(field.name, leaf.values))
                count *= len(leaf.values)
    if count > MAX_DESIGNS:
        message = f"the grid has {count} designs; at most {MAX_DESIGNS} can be numbered"
        entries.problems.add(entries.root.position, "", message)
        entries.problems.raise_if_any()
    return tuple(axes)


def _choices(entries: Entries) -> tuple[Criterion, Model, SolverSettings]:
    """Return the settings that are not columns; what is not given has the default of its dataclass."""
    given = entries.settings
    if "step_s" in given:
        given = {"accuracy": None, **given}
    return _part(Criterion, given), _part(Model, given), _part(SolverSettings, given)


def _part(kind: type[Part], given: dict[str, Any]) -> Part:
    """Return one dataclass of settings, made of what is given for it."""
    return kind(**{attribute.name: given[attribute.name] for attribute in fields_of(kind) if attribute.name in given})
