"""A file of `sweep uncertainty` in place of the folder of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.columns import COLUMNS
from boulder_sweep.errors import ReportError
from boulder_sweep.text import counted

if TYPE_CHECKING:
    import pyarrow as pa

LATER = {"time_to_limit_error_s"}
"""Columns that came after the first such files; one that lacks another column is damaged."""
CHANCES = ("p_pass", "p_pass_low", "p_pass_high", "p_pass_driver")


class ChanceFile:
    """The rows of such a file, read as those of a run are (`boulder_sweep.store.finished.FinishedRows`).

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    ReportError
        It cannot be read, or another command wrote it.
    """

    def __init__(self, path: str | Path) -> None:
        from boulder_sweep.answers.tables import read_parquet

        needed = ({spec.name for spec in COLUMNS} - LATER) | {*CHANCES}
        self._table, self.identity, self.judged_by = read_parquet(path, needed, "sweep uncertainty", ReportError)
        self.columns = tuple(dict.fromkeys((*(spec.name for spec in COLUMNS), *self._table.column_names)))
        self.lacking = frozenset(self.columns) - frozenset(self._table.column_names)
        self.rows = self.rows_done = len(self._table)

    def tables(self, columns: Sequence[str] | None = None, *, verify: bool = True) -> Iterator[pa.Table]:
        """Yield all rows, or some of their columns, at once."""
        from boulder_sweep.store.schema import with_columns

        yield with_columns(self._table, self.columns if columns is None else columns)

    def row(self, number: int) -> pa.Table:
        """Return one row.

        Raises
        ------
        IndexError
            There is no such row.
        """
        if not 0 <= number < self.rows:
            raise IndexError(f"the file has {counted(self.rows, 'design')}, numbered from 0; there is no {number}")
        from boulder_sweep.store.schema import with_columns

        return with_columns(self._table.slice(number, 1), self.columns)
