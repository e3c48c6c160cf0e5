"""What can go wrong with an output folder, in words for the user who named it."""

from __future__ import annotations

from boulder_sweep.errors import EXIT_CONFLICT, EXIT_INTERNAL, BoulderSweepError
from boulder_sweep.places import Place


class StoreError(BoulderSweepError):
    """An output folder cannot be used, or can no longer be written."""


class OutputExistsError(StoreError):
    """The output exists, and neither resume nor overwrite was requested."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Place, rows_done: int, rows: int):
        self.out, self.rows_done, self.rows = out, rows_done, rows
        state = "is finished" if rows_done == rows else f"holds {rows_done:,} of {rows:,} rows"
        super().__init__(f"{out} exists and {state}: use --resume to continue it or --overwrite to start again")


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

    def __init__(self, out: Place, differences: list[str]):
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

    def __init__(self, out: Place, names: list[str]):
        self.out, self.names = out, names
        shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
        super().__init__(f"{out} contains files that no sweep wrote ({shown}): choose another folder or move them")


class NotASweepError(StoreError):
    """There is no sweep result at the given place."""


class OtherVersionError(StoreError):
    """A result is in a format that this version does not know.

    Parameters
    ----------
    path
        The file, or the folder where no single file is meant.
    why
        What differs from what this version writes.
    version
        Version that wrote it, if the file says so.
    """

    exit_code = EXIT_CONFLICT

    def __init__(self, path: Place, why: str, version: str | None = None):
        self.path, self.why, self.version = path, why, version
        noted = f", {version}" if version else ""
        super().__init__(
            f"{path} was written by another version of boulder-sweep{noted} ({why}). Resume or inspect it "
            f"with that version; pandas, Polars and DuckDB can read the parts as a table in any case. "
            f"`sweep run` with --overwrite starts again"
        )


class DamagedError(StoreError):
    """A part or the manifest is damaged: truncated, changed or missing."""

    exit_code = EXIT_INTERNAL


class WriteError(StoreError):
    """The folder could not be written; finished parts are intact, and the run can be resumed."""


class DoesNotFitError(StoreError):
    """The result cannot fit on the disk or in memory; found before any work."""
