"""What can go wrong with an output folder, in words for the user who named it."""

from __future__ import annotations

import shlex
from contextlib import suppress
from pathlib import Path

from boulder_sweep.errors import EXIT_CONFLICT, EXIT_INTERNAL, EXIT_WRONG_USE, BoulderSweepError
from boulder_sweep.locations import Location
from boulder_sweep.settings import SettingsError, load
from boulder_sweep.text import printable

_LONGEST = 200
"""Most characters of a stranger's records that a message quotes."""


def settings_file(path: object) -> str:
    """Say that a path at which a result is expected is a settings file, and what to do; empty for another."""
    if not str(path).lower().endswith((".yaml", ".yml")):
        return ""
    command = f"sweep run {shlex.quote(str(path))}"
    with suppress(SettingsError):
        if load(str(path)).depth_sought:
            command = shlex.join(["sweep", "need", str(path), "-o", f"{Path(str(path)).stem}.parquet"])
    return f"{path} is a settings file; run it first:\n  {command}"


class StoreError(BoulderSweepError):
    """An output folder cannot be used, or can no longer be written."""


class OutputExistsError(StoreError):
    """The output exists, and neither resume nor overwrite was requested."""

    exit_code = EXIT_CONFLICT


class SettingsDifferError(StoreError):
    """Resuming would mix rows of different settings, kernels or versions."""

    exit_code = EXIT_CONFLICT


class FolderInUseError(StoreError):
    """Another run is writing into the folder."""

    exit_code = EXIT_CONFLICT


class ForeignFilesError(StoreError):
    """The folder contains files that no sweep wrote."""

    exit_code = EXIT_CONFLICT


class NotASweepError(StoreError):
    """There is no sweep result at the given location."""


class OtherVersionError(StoreError):
    """A result is in the format of another version."""

    exit_code = EXIT_CONFLICT


class DamagedError(StoreError):
    """A part is damaged: truncated, changed, or of another run."""

    exit_code = EXIT_INTERNAL


class TwoResultsError(DamagedError):
    """Two parts hold the same rows with different content."""

    exit_code = EXIT_CONFLICT


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
