"""What can go wrong with an output folder, in words for the one who pointed there."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep.errors import EXIT_CONFLICT, EXIT_INTERNAL, BoulderSweepError


class StoreError(BoulderSweepError):
    """An output folder cannot be used, or can no longer be written."""


class OutputExistsError(StoreError):
    """The output exists, and neither to resume nor to overwrite it was asked for."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Path, rows_done: int, rows: int):
        self.out, self.rows_done, self.rows = out, rows_done, rows
        state = "is finished" if rows_done == rows else f"holds {rows_done:,} of {rows:,} rows"
        super().__init__(f"{out} exists and {state}: --resume goes on with it, --overwrite starts again")


class SettingsDifferError(StoreError):
    """To resume would mix rows of different settings, kernels or versions.

    Parameters
    ----------
    out
        The output folder.
    differences
        One line each: what, there and here.
    """

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Path, differences: list[str]):
        self.out, self.differences = out, differences
        lines = "".join(f"\n  {difference}" for difference in differences)
        super().__init__(
            f"{out} was begun with something else, and rows must not be mixed; what differs (there -> here):"
            f"{lines}\nGo on with what it was begun with, use --overwrite, or choose another folder"
        )


class FolderInUseError(StoreError):
    """Another run writes into the folder."""

    exit_code = EXIT_CONFLICT


class ForeignFilesError(StoreError):
    """The folder holds files that no sweep wrote."""

    exit_code = EXIT_CONFLICT

    def __init__(self, out: Path, names: list[str]):
        self.out, self.names = out, names
        shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
        super().__init__(f"{out} holds what no sweep wrote ({shown}): choose another folder, or move these away")


class NotASweepError(StoreError):
    """There is no result of a sweep where one was to be read."""


class OtherVersionError(StoreError):
    """A result is written in a form that this version does not know.

    Parameters
    ----------
    path
        The file, or the folder where no single file is meant.
    why
        What is not as this version writes it.
    version
        Version that wrote it, where the file says so.
    """

    exit_code = EXIT_CONFLICT

    def __init__(self, path: Path, why: str, version: str | None = None):
        self.path, self.why, self.version = path, why, version
        noted = f", {version}" if version else ""
        super().__init__(
            f"{path} was written by another version of boulder-sweep{noted} ({why}). Go on with it, or look at it, "
            f"with that version; pandas, Polars and DuckDB read the parts as a table in any case. "
            f"`sweep run` with --overwrite starts again"
        )


class DamagedError(StoreError):
    """A part or the manifest is damaged: truncated, changed or gone."""

    exit_code = EXIT_INTERNAL


class WriteError(StoreError):
    """The folder could not be written; what was finished before is whole, and the run can go on later."""

    exit_code = EXIT_INTERNAL


class DoesNotFitError(StoreError):
    """The result cannot fit on the disk or in memory, known before any work."""
