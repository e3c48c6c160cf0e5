"""What the answers to all questions have in common: a sweep, and a table with a row for each of its designs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from boulder_sweep.settings import Sweep


@dataclass(frozen=True, eq=False)
class Result:
    """Answers to a question about a sweep.

    Attributes
    ----------
    sweep : Sweep
        The sweep asked about.
    arrow : pyarrow.Table
        One row for each design asked about; units and meanings in the field metadata.
    """

    sweep: Sweep
    arrow: pa.Table

    def __len__(self) -> int:
        return len(self.arrow)

    @property
    def frame(self) -> pd.DataFrame:
        """The rows as a data frame; units and meanings in ``.attrs``."""
        from boulder_sweep.answers.tables import frame_of

        return frame_of(self.arrow)
