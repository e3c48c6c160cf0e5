"""Whom and what a report is for: its heading. Nothing that is computed depends on it."""

from __future__ import annotations

from typing import NamedTuple

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
