"""Results as tables: printed, and written into the README between its markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = Path(__file__).parent
README = FOLDER / "README.md"


@dataclass
class Table:
    """One table of results.

    Parameters
    ----------
    name
        Name of its place in the README.
    title
        What was measured.
    conditions
        Machine, versions, designs, what was counted.
    header, rows
        Text of the cells.
    notes
        What a reader must know to interpret it.
    """

    name: str
    title: str
    conditions: str
    header: list[str]
    rows: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def markdown(self) -> str:
        """Return the table with title, conditions and notes."""
        lines = [f"**{self.title}**", "", f"*{self.conditions}*", "", _row(self.header)]
        lines.append("|" + "---|" * len(self.header))
        lines += [_row(row) for row in self.rows]
        if self.notes:
            lines += [""] + [f"- {note}" for note in self.notes]
        return "\n".join(lines)


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def write_between_markers(tables: Sequence[Table], readme: Path = README) -> None:
    """Write each table between its markers in the README; the prose around them is left alone.

    Raises
    ------
    ValueError
        The README has no place for a table.
    """
    text = readme.read_text()
    for table in tables:
        begin, end = f"<!-- begin {table.name} -->", f"<!-- end {table.name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"{readme.name} has no place for the table {table.name!r}: {begin} ... {end}")
        before, rest = text.split(begin)
        after = rest.split(end)[1]
        text = f"{before}{begin}\n{table.markdown()}\n{end}{after}"
    readme.write_text(text)


def significant(value: float, digits: int = 2) -> str:
    """Write a number with few significant digits, small and large ones with an exponent."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"
    return f"{value:.{digits - 1}e}"
