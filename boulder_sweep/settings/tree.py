"""The file as a tree of plain text with positions, before it is interpreted.

YAML's own guesses (``no`` is false, ``1:30`` is 90, ``010`` is 8) never happen: every scalar keeps its text.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from boulder_sweep.settings.problems import Position


@dataclass(slots=True)
class Scalar:
    """One piece of text. `quoted` says whether it stood in quotation marks."""

    position: Position
    text: str
    quoted: bool = False


@dataclass(slots=True)
class Sequence:
    """A list; `unit` is the unit written behind its bracket, as in ``[36, 40] deg``."""

    position: Position
    items: list[Node] = field(default_factory=list)
    unit: Scalar | None = None


@dataclass(slots=True)
class Entry:
    """One key of a mapping with its value."""

    key: str
    position: Position
    value: Node


@dataclass(slots=True)
class Mapping:
    """Keys and values in the order of the file; `unit` as for lists."""

    position: Position
    entries: dict[str, Entry] = field(default_factory=dict)
    unit: Scalar | None = None

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries.values())

    def get(self, key: str) -> Node | None:
        """Return the value of a key, None where it is missing."""
        entry = self.entries.get(key)
        return None if entry is None else entry.value


Node = Scalar | Sequence | Mapping
