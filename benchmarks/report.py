"""Results as blocks of the page of the benchmarks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from boulder_sweep.crash_tests.tables import Table
from docs.studies.documents import renewed

FOLDER = Path(__file__).parent
README = FOLDER / "README.md"
BLOCKS = ("kernel", "rates", "named", "peers")
"""Names of its blocks."""


def described(title: str, conditions: str, table: Table, *notes: str) -> str:
    """Return a table below what was measured, and on which machine, versions and designs; notes follow."""
    listed = "".join(f"\n- {note}" for note in notes)
    return f"**{title}**\n\n*{conditions}*\n\n{table.markdown()}" + (f"\n{listed}" if notes else "")


def write(computed: Mapping[str, str]) -> None:
    """Write blocks by name into the page; the prose around them is left alone."""
    README.write_text(renewed(README.read_text(encoding="utf-8"), computed, BLOCKS), encoding="utf-8")


def significant(value: float, digits: int = 2) -> str:
    """Write a number with few significant digits, small and large ones with an exponent."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"
    return f"{value:.{digits - 1}e}"
