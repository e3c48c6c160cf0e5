"""How far a run got, what is missing or damaged, and how to resume it."""

from __future__ import annotations

import shlex
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from boulder_sweep.locations import LocationError, location_of
from boulder_sweep.store.lock import is_locked
from boulder_sweep.store.manifest import Session
from boulder_sweep.store.provenance import judged_by
from boulder_sweep.store.verify import load_checked


@dataclass(frozen=True)
class RunStatus:
    """State of an output folder.

    Parameters
    ----------
    out
        The folder.
    rows, rows_done
        Rows of the whole table, and those in finished, undamaged parts.
    parts
        Finished, undamaged files.
    running
        Whether a run is writing into it now.
    verified
        Whether every part was read and its checksum compared.
    damaged
        What is wrong with damaged parts, by file name.
    missing
        Missing ranges [start, stop) of rows; the first hundred, neighbours joined.
    verdicts
        Number of rows of each verdict and reason, keyed ``verdict/reason``.
    bytes
        Size of the finished parts.
    sessions
        Runs into this folder, oldest first.
    identity
        Settings, versions and hashes that all rows share.
    resume_command
        The command that resumes the run in this folder, which may have been moved; None if it is complete.
    judged_by
        By whose rules the rows were judged; empty where by those of this version.
    settings_missing
        The settings file that `resume_command` names, if there is none of this name.
    """

    out: str
    rows: int
    rows_done: int
    parts: int
    running: bool
    verified: bool
    damaged: dict[str, str]
    missing: list[tuple[int, int]]
    verdicts: dict[str, int]
    bytes: int
    resume_command: str | None
    sessions: list[Session] = field(repr=False)
    identity: dict[str, Any] = field(repr=False)
    judged_by: str = ""
    settings_missing: str | None = None

    @property
    def complete(self) -> bool:
        """Whether all rows are finished."""
        return self.rows_done == self.rows

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {**asdict(self), "complete": self.complete}


_MISSING_SHOWN = 100


def status(out: str | Path, *, verify: bool = False) -> RunStatus:
    """Inspect an output folder; nothing is changed, and a run may be writing into it.

    Parameters
    ----------
    out
        The folder, by path or URL.
    verify
        Read every part and compare its checksum: finds changed bytes, not only missing ones.

    Raises
    ------
    NotASweepError
        There is no result in the folder.
    DamagedError
        The manifest cannot be trusted.
    """
    folder = location_of(out)
    running = is_locked(folder)
    manifest, damaged = load_checked(folder, read_parts=verify)
    there = sorted((part.first, part.stop) for part in manifest.parts.values())
    gaps = pairwise([0, *(edge for rows in there for edge in rows), manifest.rows])
    missing = [(start, stop) for start, stop in list(gaps)[::2] if start < stop]
    done = manifest.rows_done
    command, settings_missing = None, None
    if done != manifest.rows:
        command, settings_missing = _into(out, manifest.resume_command)
    return RunStatus(
        out=str(folder),
        rows=manifest.rows,
        rows_done=done,
        parts=len(manifest.parts),
        running=running,
        verified=verify,
        damaged=damaged,
        missing=missing[:_MISSING_SHOWN],
        verdicts=manifest.verdicts,
        bytes=sum(part.bytes for part in manifest.parts.values()),
        resume_command=command,
        judged_by=judged_by(manifest.identity),
        settings_missing=settings_missing,
        sessions=manifest.sessions,
        identity=manifest.identity,
    )


def _into(out: str | Path, command: str) -> tuple[str, str | None]:
    """Return the command that resumes a run, as things are named now, and its settings file if there is none."""
    if command.startswith("boulder_sweep.run(sweep, "):
        return f"boulder_sweep.run(sweep, {str(out)!r}, resume=True)", None
    try:
        words = shlex.split(command) if command.startswith("sweep run ") else []
        if len(words) < 5 or words[3] != "-o":
            return command, None
        settings = _moved_with(out, words[2], words[4])
    except (ValueError, LocationError):  # not what a run writes there
        return command, None
    here = shlex.join([*words[:2], settings, "-o", str(out), *words[5:]])
    return here, None if _exists(Path(settings)) else settings


def _moved_with(out: str | Path, settings: str, recorded_out: str) -> str:
    """Return the path of a settings file, by its place relative to the folder if there is one now."""
    now, then = location_of(out), location_of(recorded_out)
    if not isinstance(now, Path) or not isinstance(then, Path) or then.is_absolute() or Path(settings).is_absolute():
        return settings
    levels, folders, whole = len(then.parts), then.parts[:-1], now.resolve()
    above = whole.parent.parts
    if ".." in then.parts or above[len(above) - len(folders) :] != folders:
        return settings
    # The directory that the run was started in, by its present name.
    parts = now.parts if ".." not in now.parts and len(now.parts) >= levels else whole.parts
    start = Path(*parts[: len(parts) - levels])
    return str(start / settings) if _exists(start / settings) else settings


def _exists(file: Path) -> bool:
    """Whether there is a file of this name; none where nobody may look."""
    try:
        return file.exists()
    except (OSError, ValueError):
        return False
