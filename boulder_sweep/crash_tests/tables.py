"""Small tables of results, for a terminal and for a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


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
        """Add a line."""
        if len(cells) != len(self.head):
            raise ValueError(f"{len(cells)} cells for {len(self.head)} columns")
        self.rows.append(cells)

    def markdown(self) -> str:
        """Return the table for a page."""
        lines = [self.head, tuple("---" for _ in self.head), *self.rows]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)

    def text(self) -> str:
        """Return the table for a terminal: columns as wide as they must be, numbers to the right."""
        lines = [self.head, *self.rows]
        widths = [max(len(line[k]) for line in lines) for k in range(len(self.head))]
        right = [all(_is_number(row[k]) for row in self.rows) for k in range(len(self.head))]
        return "\n".join(_line(line, widths, right) for line in lines)


def number(value: float, digits: int, none: str = "-") -> str:
    """Return a number with so many decimals; `none` for NaN."""
    return none if value != value else f"{value:.{digits}f}"


def _line(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> str:
    padded = [cell.rjust(w) if r else cell.ljust(w) for cell, w, r in zip(cells, widths, right, strict=True)]
    return "  ".join(padded).rstrip()


def _is_number(cell: str) -> bool:
    return cell in ("-", "never", "") or cell[0].isdigit() or cell[0] in "+-−"
