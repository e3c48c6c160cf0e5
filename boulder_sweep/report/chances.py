"""A file of `sweep uncertainty` in place of the folder of a run."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.columns import COLUMNS
from boulder_sweep.errors import OlderRulesWarning, ReportError
from boulder_sweep.store.provenance import identity_in, judged_by
from boulder_sweep.text import counted, one_line

if TYPE_CHECKING:
    import pyarrow as pa

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
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            self._table = pq.read_table(path)
        except (OSError, pa.ArrowException) as problem:
            raise ReportError(f"{path} cannot be read as a Parquet file: {one_line(problem)}") from problem
        self.identity = identity_in(self._table.schema.metadata)
        if "settings" not in self.identity or not set(CHANCES) <= set(self._table.column_names):
            raise ReportError(f"{path} is neither the folder of a run nor a file that `sweep uncertainty` wrote")
        self.judged_by = judged_by(self.identity)
        if self.judged_by:
            warnings.warn(f"{path} was {self.judged_by}", OlderRulesWarning, stacklevel=2)
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
        return self._table.slice(number, 1)
