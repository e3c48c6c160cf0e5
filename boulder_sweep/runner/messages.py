"""What workers tell the coordinating thread."""

from __future__ import annotations

from typing import NamedTuple

from boulder_sweep.store.writer import StagedPart


class Computed(NamedTuple):
    """Some rows are computed."""

    rows: int


class Note(NamedTuple):
    """Something the user should know, such as a lost worker."""

    text: str


class Ended(NamedTuple):
    """There will be no more messages."""

    problem: BaseException | None
    """What went wrong, if anything did."""


Message = Computed | StagedPart | Note | Ended
"""A `StagedPart` is a part that is written and waits to be committed."""
