"""Load settings the way every command does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from boulder_sweep.cli.output import say

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


def load_sweep(path: str, overrides: Sequence[str], quiet: bool) -> Sweep:
    """Load settings and print the notes on them."""
    from boulder_sweep.settings import load

    sweep = load(path, overrides)
    if not quiet:
        for note in sweep.notes:
            say(f"note: {note}")
    return sweep


def refuse_unwritable(table: str | None, picture: str | None = None) -> None:
    """Refuse a table or a picture that cannot be written, before anything is computed; None where none is wanted."""
    if table is not None:
        from boulder_sweep.answers.tables import checked_parquet

        checked_parquet(table)
    if picture is not None:
        from boulder_sweep.views.figures import checked_kind, require_matplotlib

        require_matplotlib()
        checked_kind(picture)
