"""What can go wrong with an output folder, in words for the user who named it."""

from __future__ import annotations

import shlex

from boulder_sweep.errors import EXIT_CONFLICT, EXIT_INTERNAL, EXIT_WRONG_USE, BoulderSweepError
from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.text import printable

_LONGEST = 200
"""Most characters of a stranger's records that a message quotes."""


def settings_file(path: object) -> str:
    """Say that a path at which a result is expected is a settings file, and what to do; empty for another."""
    if not str(path).lower().endswith((".yaml", ".yml")):
        return ""
    return f"{path} is a settings file; run it first: sweep run {shlex.quote(str(path))}"


class StoreError(BoulderSweepError):
    """An output folder cannot be used, or can no longer be written."""


def refuse_to_guess(location: Location, problem: OSError) -> None:
    """Raise StoreError where a file is on an object store: what does not answer is not damaged."""
    if isinstance(location, RemotePath):
        raise StoreError(f"{location} cannot be read: {problem.strerror}") from None


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
        super().__init__(f"{out} {said}. Into the same folder, `sweep run` needs --overwrite")


class DamagedError(StoreError):
    """A part or the manifest is damaged: truncated, changed or missing."""

    exit_code = EXIT_INTERNAL


class ImpossibleRecordsError(DamagedError):
    """A manifest is intact, but holds what no sweep writes: somebody else made it."""

    exit_code = EXIT_WRONG_USE

    def __init__(self, path: Location, what: str):
        super().__init__(path, what)
        self.path, self.what = path, printable(what[:_LONGEST])

    def __str__(self) -> str:
        return (
            f"{self.path} holds what no sweep writes ({self.what}); nothing beside it was read or changed. Get the "
            f"folder anew from where it came, or start again with --overwrite"
        )


class WriteError(StoreError):
    """The folder could not be written; finished parts are intact, and the run can be resumed."""


class LinkError(StoreError):
    """A link lies where a file is to be written; whoever put it there would choose what is overwritten."""


class FolderRemovedError(StoreError):
    """The output folder was removed during the run, or moved, or is that of another run by now."""

    def __init__(self, out: Location):
        super().__init__(out)
        self.out = out

    def __str__(self) -> str:
        return (
            f"{self.out} was removed, moved or replaced during the run, or its file _lock was; nothing more is "
            f"written. Run again to compute what is missing"
        )


class DoesNotFitError(StoreError):
    """The result cannot fit on the disk or in memory; found before any work."""
