"""What ``-o`` of a command wrote: the folder of a run, or a file of answers, read in one way."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import Location
from boulder_sweep.store.manifest import MANIFEST_NAME
from boulder_sweep.store.reader import FinishedRows

if TYPE_CHECKING:
    import pyarrow as pa


class AnswerFile:
    """The rows of a file of answers or of a time history, read as those of a run are (`FinishedRows`).

    Parameters
    ----------
    path
        The file.
    refusal
        The error to raise.

    Attributes
    ----------
    rows, rows_done, identity, judged_by
        As of `FinishedRows`.

    Raises
    ------
    BoulderSweepError
        It cannot be read, is damaged, or no command wrote it.
    """

    def __init__(self, path: Path, refusal: type[BoulderSweepError]) -> None:
        from boulder_sweep.answers.tables import read_parquet

        self._table, self.identity, self.judged_by = read_parquet(path, (), "sweep", refusal)
        self.rows = self.rows_done = len(self._table)

    def tables(self) -> Iterator[pa.Table]:
        """Yield all rows at once."""
        yield self._table


def result_of(place: Location, refusal: type[BoulderSweepError]) -> FinishedRows | AnswerFile:
    """Return the rows of what a command wrote: a folder, or a file beside none.

    Raises
    ------
    StoreError
        There is no result in the folder, or it is damaged.
    BoulderSweepError
        As of `AnswerFile`.
    """
    if not isinstance(place, Path) or not place.is_file() or place.suffix.lower() != ".parquet":
        return FinishedRows(place)
    in_a_run = (place.resolve().parent / MANIFEST_NAME).exists()
    return FinishedRows(place) if in_a_run else AnswerFile(place, refusal)
