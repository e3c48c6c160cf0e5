"""Small tables of results, for a terminal and for a page."""

from __future__ import annotations

import io
from dataclasses import dataclass, field

WIDTH = 80
"""Columns of a terminal."""


@dataclass
class Table:
    """A table of texts, numbers already rounded: names of the columns, and lines."""

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

    def turned(self) -> Table:
        """Return the table with rows and columns changed, for one that is too wide for a terminal."""
        head, *rows = zip(self.head, *self.rows, strict=True)
        return Table(head, rows)

    def text(self) -> str:
        """Return the table for a terminal, columns of numbers to the right, words wrapped where lines are too long."""
        from rich.console import Console  # only terminals need it
        from rich.table import Table as Grid
        from rich.text import Text

        grid = Grid(box=None, pad_edge=False, padding=(0, 2, 0, 0))
        for index, name in enumerate(self.head):
            numbers = sum(_is_number(row[index]) for row in self.rows)
            grid.add_column(Text(name), justify="right" if 2 * numbers > len(self.rows) else "left")
        for row in self.rows:
            grid.add_row(*map(Text, row))
        shown = io.StringIO()
        Console(file=shown, width=WIDTH, force_terminal=False).print(grid)
        return "\n".join(line.rstrip() for line in shown.getvalue().splitlines())


def number(value: float, digits: int, none: str = "-") -> str:
    """Return a number with so many decimals; `none` for NaN."""
    return none if value != value else f"{value:.{digits}f}"


def _is_number(cell: str) -> bool:
    return cell in ("-", "never", "") or cell[0].isdigit() or cell[0] in "+-−"
