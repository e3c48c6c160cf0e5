"""How far a run got: whether its parts match the manifest, what is missing or damaged, and how to resume it."""

from __future__ import annotations

import hashlib
import os
import shlex
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from boulder_sweep.locations import Location, LocationError, location_of
from boulder_sweep.store.failures import refuse_to_guess
from boulder_sweep.store.lock import is_locked
from boulder_sweep.store.manifest import Manifest, Merge, Part, load
from boulder_sweep.store.provenance import Session, judged_by

_ATTEMPTS = 20
"""More than the merges that a run can start while parts are checked."""
_CHANGED = "changed: its checksum differs"
_MISSING_SHOWN = 100


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
    gaps = pairwise([0, *(edge for rows in manifest.ranges for edge in rows), manifest.rows])
    missing = [(start, stop) for start, stop in list(gaps)[::2] if start < stop]
    command, settings_missing = None, None
    if manifest.rows_done != manifest.rows:
        command, settings_missing = _into(out, manifest.resume_command)
    return RunStatus(
        out=str(folder),
        rows=manifest.rows,
        rows_done=manifest.rows_done,
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
    """Return the path of a settings file, by its location relative to the folder if there is one now."""
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


def load_checked(folder: Location, *, read_parts: bool) -> tuple[Manifest, dict[str, str]]:
    """Read the manifest of a folder and compare the parts with it.

    Parameters
    ----------
    folder
        The output folder; a run may be writing into it.
    read_parts
        Whether to compare checksums, or only sizes.

    Returns
    -------
    manifest : Manifest
        With the undamaged parts only, by their current file names.
    damaged : dict
        What is wrong with the others, by file name.
    """
    whole: dict[str, Part] = {}
    for _ in range(_ATTEMPTS):
        manifest = load(folder)
        known = deepcopy(manifest)
        unknown = {name: part for name, part in manifest.parts.items() if whole.get(name) != part}
        damaged = damaged_parts(folder, unknown, read_parts=read_parts)
        whole |= {name: part for name, part in unknown.items() if name not in damaged}
        if manifest.merge is not None and damaged.keys() & set(manifest.merge.replaced):
            damaged = _without_merged(folder, manifest, damaged)
        # Parts may have been merged since the manifest was read: then check new and suspect parts again.
        if not damaged or load(folder) == known:
            break
    manifest.parts = {name: part for name, part in manifest.parts.items() if name not in damaged}
    return manifest, damaged


def _without_merged(folder: Location, manifest: Manifest, damaged: dict[str, str]) -> dict[str, str]:
    """Put the merged part into the manifest if a run was killed during the merge."""
    merge = manifest.merge
    name = None if merge is None else merged_file(folder, merge)
    if merge is None or name is None:
        return damaged
    for replaced in merge.replaced:
        manifest.parts.pop(replaced, None)
    manifest.parts[name] = merge.part
    return {name: wrong for name, wrong in damaged.items() if name not in merge.replaced}


def merged_file(folder: Location, merge: Merge) -> str | None:
    """Return the name of a merged part on disk, final or temporary; None if it is not intact."""
    return next((name for name in merge.names if not wrong_content(folder / name, merge.part)), None)


def damaged_parts(folder: Location, parts: Mapping[str, Part], *, read_parts: bool) -> dict[str, str]:
    """Compare parts, by file name, with their records in the manifest.

    Returns
    -------
    dict
        What is wrong with the damaged ones, by file name.
    """
    check = wrong_content if read_parts else wrong_size
    if len(parts) == 1:  # as when a slow run commits: no thread for that
        return {name: wrong for name, part in parts.items() if (wrong := check(folder / name, part))}
    from concurrent.futures import ThreadPoolExecutor  # imports logging, which a short run does without

    # Checksums are computed without the interpreter's lock, so threads work in parallel.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        results = pool.map(lambda name: check(folder / name, parts[name]), parts)
        return {name: wrong for name, wrong in zip(parts, results, strict=True) if wrong}


def wrong_size(path: Location, part: Part) -> str:
    """Describe how the size of a file differs from its record; empty if it does not."""
    try:
        size = path.stat().st_size
    except OSError as problem:
        if not isinstance(problem, FileNotFoundError):
            refuse_to_guess(path, problem)
        return "missing"
    return _other_size(size, part)


def _other_size(size: int, part: Part) -> str:
    """Describe how a size differs from its record; empty if it does not."""
    if size == part.bytes:
        return ""
    kind = "truncated" if size < part.bytes else "longer than written"
    return f"{kind}: {size:,} bytes instead of {part.bytes:,}"


def wrong_content(path: Location, part: Part) -> str:
    """Describe how a file differs from its record, by checksum; empty if it does not."""
    if wrong := wrong_size(path, part):
        return wrong
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        refuse_to_guess(path, problem)
        return f"cannot be read: {problem.strerror}"
    return "" if digest == part.sha256 else _CHANGED


def wrong_bytes(content: bytes, part: Part) -> str:
    """Describe how the content of a file differs from its record, by checksum; empty if it does not."""
    if wrong := _other_size(len(content), part):
        return wrong
    return "" if hashlib.sha256(content).hexdigest() == part.sha256 else _CHANGED
