"""Records as a file has them, against the records this version knows: the form of a result may change one day.

What does not fit is never guessed at: rows of another version must not be mixed with those of this one.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_args, get_origin, get_type_hints


def entries_of(record: type, what: str, content: Any) -> dict[str, Any]:
    """Return the entries of a record if they are just those it has today, with values of the right kind.

    Parameters
    ----------
    record
        A dataclass.
    what
        What the record is of, in words.
    content
        What a JSON file has in its place; records within it are not looked into.

    Raises
    ------
    ValueError
        An entry is unknown, missing or of another kind; the text says which.
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
    """Find the version of boulder-sweep that wrote the records of a manifest; None where they do not say it."""
    for key in ("identity", "versions", "boulder-sweep"):
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, str) else None


def _fits(value: Any, type_: Any) -> bool:
    """Whether a value from a JSON file is of the kind that an annotation asks for, contents of lists aside."""
    if type_ is type(None):
        return value is None
    kinds = get_args(type_) if get_origin(type_) not in (dict, list) else ()
    if kinds:
        return any(_fits(value, kind) for kind in kinds)
    kind = get_origin(type_) or type_
    return isinstance(value, kind if kind in (str, int, dict, list) else dict)
