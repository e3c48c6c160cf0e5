"""Whom and what a report is for: its heading. Nothing that is computed depends on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from boulder_sweep.settings.problems import shorten
from boulder_sweep.settings.tree import Mapping, Scalar

if TYPE_CHECKING:
    from boulder_sweep.settings.entries import Entries

SECTION = "report"
"""Block of the file."""
MOST_CHARACTERS = 200
"""Longest entry."""


class Heading(NamedTuple):
    """The heading of a report; an entry that is not given is empty."""

    project: str = ""
    client: str = ""
    author: str = ""
    date: str = ""

    def given(self) -> dict[str, str]:
        """Return the entries that are given, in order."""
        return {name: text for name, text in self._asdict().items() if text}


NO_HEADING = Heading()


def wrong_with(text: str) -> str:
    """Say what is wrong with an entry; empty if nothing is."""
    if not text.strip():
        return "is empty; write one line of text, or leave it out"
    if not text.isprintable():
        return "must be one line of printable text"
    if len(text) > MOST_CHARACTERS:
        return f"has {len(text)} characters; at most {MOST_CHARACTERS} fit into a heading"
    return ""


def read_heading(entries: Entries) -> Heading:
    """Return the heading in a file; mistakes go to its problems."""
    entry = entries.root.entries.get(SECTION)
    if entry is None:
        return Heading()
    node = entry.value
    if isinstance(node, Scalar) and not node.text.strip() and not node.quoted:
        return Heading()  # a block of which every line is commented out
    if not isinstance(node, Mapping) or node.unit is not None:
        entries.problems.add(node.position, SECTION, f"must be a block of keys: {', '.join(Heading._fields)}")
        return Heading()
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
