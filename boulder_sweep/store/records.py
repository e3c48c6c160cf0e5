"""Checks that records read from a file have the format of this version.

Records of another version are refused, never guessed at: their rows must not be mixed with those of this version.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_args, get_origin, get_type_hints


def entries_of(record: type, what: str, content: Any) -> dict[str, Any]:
    """Return the entries of a record if they are exactly the expected ones, with values of the right type.

    Parameters
    ----------
    record
        A dataclass.
    what
        What the record describes, for the message.
    content
        The parsed JSON; nested records are not checked.

    Raises
    ------
    ValueError
        An entry is unknown, missing or of another type; the text says which.
    """
    if not isinstance(content, dict):
        raise ValueError(f"{what} has no named entries")
    types = get_type_hints(record)
    expected = {entry.name for entry in fields(record)}
    wrong = [f"{name} is unknown" for name in sorted(content.keys() - expected)]
    wrong += [f"{name} is missing" for name in sorted(expected - content.keys())]
    wrong += [
        f"{name} is {content[name]!r:.60}"
        for name in sorted(expected & content.keys())
        if not _fits(content[name], types[name])
    ]
    if wrong:
        raise ValueError(f"{what}: {', '.join(wrong)}")
    return content


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
