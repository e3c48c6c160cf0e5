"""What can go wrong with an output folder, in words for the user who named it."""

from __future__ import annotations

import shlex

from boulder_sweep.errors import EXIT_CONFLICT, EXIT_INTERNAL, EXIT_WRONG_USE, BoulderSweepError
from boulder_sweep.locations import Location
from boulder_sweep.text import printable

_LONGEST = 200
"""Most characters of a stranger's records that a message quotes."""


def settings_file(path: object) -> str:
    """Say that a path at which a result is expected is a settings file, and what to do; empty for another."""
    if not str(path).lower().endswith((".yaml", ".yml")):
        return ""
    return f"{path} is a settings file; run it first:\n  sweep run {shlex.quote(str(path))}"


class StoreError(BoulderSweepError):
    """An output folder cannot be used, or can no longer be written."""


class OutputExistsError(StoreError):
    """The output exists, and neither resume nor overwrite was requested."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Location, rows_done: int, rows: int):
        self.out, self.rows_done, self.rows = out, rows_done, rows
        if rows_done == rows:
            state = f"is finished: see it with `sweep report {out}`, or"
        else:
            state = f"holds {rows_done:,} of {rows:,} rows: use --resume to continue it, or"
        super().__init__(f"{out} exists and {state} use --overwrite to start again")


class SettingsDifferError(StoreError):
    """Resuming would mix rows of different settings, kernels or versions.

    Parameters
    ----------
    out
        The output folder.
    differences
        One line each: entry, value there and here.
    """

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Location, differences: list[str]):
        self.out, self.differences = out, differences
        lines = "".join(f"\n  {difference}" for difference in differences)
        super().__init__(
            f"{out} was started with other settings or another version, and rows must not be mixed. "
            f"Differences (there -> here):{lines}\n"
            f"Resume with the original settings, use --overwrite, or choose another folder"
        )


class FolderInUseError(StoreError):
    """Another run is writing into the folder."""

    exit_code = EXIT_CONFLICT


class ForeignFilesError(StoreError):
    """The folder contains files that no sweep wrote."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Location, names: list[str]):
        self.out, self.names = out, names
        shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
        super().__init__(f"{out} contains files that no sweep wrote ({shown}): choose another folder or move them")


class NotASweepError(StoreError):
    """There is no sweep result at the given location."""


class OtherVersionError(StoreError):
    """A result is in the format of another version.

    Parameters
    ----------
    out
        The folder.
    said
        Which version wrote it, and what to do, see `provenance.other_version`.
    """

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Location, said: str):
        self.out = out
        super().__init__(f"{out} {said}. `sweep run` writes into another folder, or into this one once it is empty")


class DamagedError(StoreError):
    """A part is damaged: truncated, changed, or of another run."""

    exit_code = EXIT_INTERNAL


class TwoResultsError(DamagedError):
    """Two parts hold the same rows with different content."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Location, first: str, second: str):
        self.out, self.names = out, (first, second)
        super().__init__(
            f"{out} holds two different results for the same rows: {first} and {second}. `sweep run` of "
            f"its settings file with --resume removes a damaged one; if both are intact, remove the wrong one"
        )


class ImpossibleRecordsError(DamagedError):
    """A part is intact, but says of itself what no sweep writes: somebody else made it."""

    exit_code = EXIT_WRONG_USE

    def __init__(self, path: Location, what: str):
        super().__init__(path, what)
        self.path, self.what = path, printable(what[:_LONGEST])

    def __str__(self) -> str:
        return (
            f"{self.path} holds what no sweep writes ({self.what}). Get the folder anew from where it came, or start "
            f"again with --overwrite"
        )


class WriteError(StoreError):
    """The folder could not be written; finished parts are intact, and the run can be resumed."""


class DoesNotFitError(StoreError):
    """The result cannot fit on the disk; found before any work."""
