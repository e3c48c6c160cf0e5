"""``--set KEY=VALUE``: replace single entries of the file."""

from __future__ import annotations

from collections.abc import Sequence

from boulder_sweep.settings.entries import TOP_KEYS
from boulder_sweep.settings.fields import FIELDS
from boulder_sweep.settings.model import SECOND_OPINIONS
from boulder_sweep.settings.names import UnknownNameError, named
from boulder_sweep.settings.problems import Position, ProblemList, SettingsError, nearest, shorten
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, parse_node
from boulder_sweep.settings.tree import Sequence as List

_ALTERNATIVES = {
    "site.embedment_ratio": "embedment_depth",
    "site.embedment_depth": "embedment_ratio",
    "solver.accuracy": "step",
    "solver.step": "accuracy",
    "vehicle.speed": "approach",
    "vehicle.approach": "speed",
}
"""Setting one removes the other from the file, which holds only one of them; two options contradict each other."""

OPTIONS = {"--accuracy": "solver.accuracy", "--second-opinion": "model.second_opinion"}
"""Options that set an entry: a mistake is reported for the option, not for ``--set``."""

ALL_OPINIONS = f"--second-opinion=[{', '.join(SECOND_OPINIONS)}]"
"""Asks for every second opinion."""

MAX_OVERRIDE = 20_000
"""Longest option, in characters."""


def apply_overrides(root: Mapping, overrides: Sequence[str], problems: ProblemList) -> None:
    """Put every ``key.path=value`` into the tree, in order; mistakes go to `problems`.

    Parameters
    ----------
    root : Mapping
        The tree of the file, changed in place.
    overrides : sequence of str
        As typed behind ``--set``, the key as of `boulder_sweep.settings.names.named`; the value is YAML, so lists and
        ranges work as in the file. ``--accuracy=fine`` is an option of its own.
    problems : ProblemList
        Receives what cannot be understood.
    """
    for text in overrides:
        key, equals, value_text = text.partition("=")
        option, key = (key, OPTIONS[key]) if key in OPTIONS else ("--set", key)
        path = key.strip().split(".")
        position, name = Position(option), shorten(key.strip())
        if len(path) == 1 and path[0] not in ("", *TOP_KEYS):
            try:
                path = named(path[0], FIELDS).path.split(".")
            except UnknownNameError as unknown:
                if nearest(path[0], TOP_KEYS) is None:
                    problems.add(position, name, unknown.what)
                    continue
        if not equals or not all(path) or len(path) > 4:
            problems.add(position, "", f"'{shorten(text)}' is not KEY=VALUE, for example vehicle.speed='50 mph'")
            continue
        if len(text) > MAX_OVERRIDE:
            problems.add(position, name, f"is longer than {MAX_OVERRIDE} characters; put it into the file")
            continue
        value = _read_value(value_text, name, position, problems)
        if value is not None:
            _put(root, path, value, position)


def _read_value(text: str, name: str, position: Position, problems: ProblemList) -> Node | None:
    found = ProblemList()
    try:
        value = parse_node(text, position.file, found)
    except SettingsError:
        value = None  # its problems are in `found`
    for problem in found.problems:
        problems.add(position, name, problem.message)
    if value is None:
        return None if found else Scalar(position, "")
    _move(value, position)
    return value


def _move(node: Node, position: Position) -> None:
    """Give a whole tree the place of its option: a line number within an option means nothing."""
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
            _store(block, key, opened, position)
            inner = opened
        block = inner
    other = _ALTERNATIVES.get(".".join(path))
    if other in block.entries and block.entries[other].position.file not in ("--set", *OPTIONS):
        del block.entries[other]
    _store(block, path[-1], value, position)


def _store(block: Mapping, key: str, value: Node, position: Position) -> None:
    """Replace an entry where it stands, so that axes keep their order, or append it."""
    block.entries[key] = Entry(key, position, value)
