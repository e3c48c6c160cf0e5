"""Small tables of results, for a terminal and for a page."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

WIDTH = 80
"""Columns of a terminal."""


@dataclass
class Table:
    """A table of texts, numbers already rounded.

    Attributes
    ----------
    head : tuple of str
        Names of the columns.
    rows : list of tuple of str
        Lines.
    """

    head: tuple[str, ...]
    rows: list[tuple[str, ...]] = field(default_factory=list)

    def add(self, *cells: str) -> None:
        """Add a line of cells, one for each column of the head."""
        if len(cells) != len(self.head):
            raise ValueError(f"{len(cells)} cells for {len(self.head)} columns")
        self.rows.append(cells)

    def markdown(self) -> str:
        """Return the table for a page."""
        lines = [self.head, tuple("---" for _ in self.head), *self.rows]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)

    def text(self, width: int = WIDTH) -> str:
        """Return the table for a terminal, numbers to the right, no line longer than `width`.

        Words are wrapped where a column must be narrower; if that is not enough, rows and columns change places.
        """
        lines = [self.head, *self.rows]
        right = [all(_is_number(row[k]) for row in self.rows) for k in range(len(self.head))]
        if (widths := _widths(lines, width)) is None:
            lines = list(zip(*lines, strict=True))
            right = [False] + [True] * len(self.rows)
            widths = _widths(lines, width) or [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join(text for line in lines for text in _lines(line, widths, right))


def number(value: float, digits: int, none: str = "-") -> str:
    """Return a number with so many decimals; `none` for NaN."""
    return none if value != value else f"{value:.{digits}f}"


def _widths(lines: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """Return the widths of columns, the widest ones narrowed until all fit; None where their words are too long."""
    columns = list(zip(*lines, strict=True))
    widths = [max(map(len, column)) for column in columns]
    least = [max(len(word) for cell in column for word in [*cell.split(), ""]) for column in columns]
    while sum(widths) + 2 * (len(widths) - 1) > width:
        spare = [full - word for full, word in zip(widths, least, strict=True)]
        if not any(spare):
            return None
        widths[max(range(len(widths)), key=lambda k: (spare[k] > 0, widths[k]))] -= 1
    return widths


def _lines(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> Iterator[str]:
    """Yield the lines of a row, its cells wrapped."""
    wrapped = (textwrap.wrap(cell, w, break_on_hyphens=False) for cell, w in zip(cells, widths, strict=True))
    for parts in zip_longest(*wrapped, fillvalue=""):
        padded = [part.rjust(w) if r else part.ljust(w) for part, w, r in zip(parts, widths, right, strict=True)]
        yield "  ".join(padded).rstrip()


def _is_number(cell: str) -> bool:
    return cell in ("-", "never", "") or cell[0].isdigit() or cell[0] in "+-−"
