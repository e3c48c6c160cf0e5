"""Checks that records read from a file have the form that this version knows, and what of them other versions may vary.

An entry that another version has more is left out, and one that was added since may be missing; both are noted, and no
run goes on there. Anything else is refused, never guessed at. docs/formats.md says what may change between versions.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, get_args, get_origin, get_type_hints

from boulder_sweep.locations import Location
from boulder_sweep.store.errors import ImpossibleRecordsError

_DEEPEST = 32
"""Most levels of nested records; a settings file has fewer than ten."""
IDENTITY = {
    "settings": {"name": str, "inputs": dict, "model": dict, "criterion": dict, "solver": dict, "labels": dict},
    "readings": dict,
    "control": dict,
    "accuracy": dict,
    "versions": dict,
    "settings_sha256": str,
    "kernels_sha256": str,
    "rules_sha256": str,
}
"""Kinds of the entries of an identity that are looked at by name."""


def entries_of(record: type, what: str, content: Any, differing: list[str]) -> dict[str, Any]:
    """Return the entries of a record that are known, if all that are needed are there, with values of the right type.

    Parameters
    ----------
    record
        A dataclass.
    what
        What the record describes, for the message.
    content
        The parsed JSON; nested records are not checked.
    differing
        What another version wrote otherwise is added to these lines: entries that are unknown, or missing though they
        have a default.

    Raises
    ------
    ValueError
        An entry without a default is missing, or one is of another type; the text says which.
    """
    if not isinstance(content, dict):
        raise ValueError(f"{what} has no named entries")
    types = get_type_hints(record)
    expected = {entry.name for entry in fields(record) if entry.compare}
    needed = {entry.name for entry in fields(record) if entry.default is MISSING} & expected
    wrong = [f"{name} is missing" for name in sorted(needed - content.keys())]
    wrong += [
        f"{name} is {content[name]!r:.60}"
        for name in sorted(expected & content.keys())
        if not _fits(content[name], types[name])
    ]
    if wrong:
        raise ValueError(f"{what}: {', '.join(wrong)}")
    differing += [f"{what}: {name} is unknown" for name in sorted(content.keys() - expected)]
    differing += [f"{what}: {name} is missing" for name in sorted(expected - needed - content.keys())]
    return {name: value for name, value in content.items() if name in expected}


def is_deep(content: Any) -> bool:
    """Whether records are nested so deeply that functions that call themselves could fail."""
    level = [content]
    for _ in range(_DEEPEST):
        level = [
            value
            for one in level
            if isinstance(one, dict | list)
            for value in (one.values() if isinstance(one, dict) else one)
        ]
    return bool(level)


def check_kinds(path: Location, what: str, content: Any, kinds: Any) -> None:
    """Check the kinds of those nested entries that are looked at by name.

    Raises
    ------
    ImpossibleRecordsError
        One is of another kind.
    """
    if isinstance(kinds, type):
        if not isinstance(content, kinds):
            raise ImpossibleRecordsError(path, f"{what} that is {type(content).__name__}")
        return
    check_kinds(path, what, content, dict)
    for name in kinds.keys() & content.keys():
        check_kinds(path, f"{what}.{name}", content[name], kinds[name])


def version_of(content: Any) -> str | None:
    """Return the version of boulder-sweep that wrote the records of a manifest; None if it is not recorded."""
    for key in ("identity", "versions", "boulder-sweep"):
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, str) else None


def _fits(value: Any, type_: Any) -> bool:
    """Whether a value from a JSON file has the annotated type; contents of lists are not checked."""
    if type_ is type(None):
        return value is None
    kinds = get_args(type_) if get_origin(type_) not in (dict, list) else ()
    if kinds:
        return any(_fits(value, kind) for kind in kinds)
    kind = get_origin(type_) or type_
    if kind is int and isinstance(value, bool):
        return False
    return isinstance(value, kind if kind in (str, int, dict, list) else dict)
