"""The output folder of a run: taken, written part by part, let go.

A part is put in place whole (see `files`) and then recorded in the manifest with its rows and checksum. The
last part of a slow run grows: the file is replaced by a longer one now and then, announced in the manifest
before, so that a long run keeps few large files at all times and ends with the same files as a fast one.
Compaction thus goes along with writing; nobody ever sees a row twice or misses one that was there before.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from . import errors
from .files import flush_folder, put_file
from .lock import LOCK_NAME, FolderLock
from .manifest import (
    MANIFEST_NAME,
    Manifest,
    Part,
    Session,
    Version,
    is_ours,
    is_part_name,
    load,
    save,
)
from .provenance import PREFIX, differences, now
from .verify import sha256_of_bytes, verified_parts

ROWS_PER_PART = 131_072
"""Rows of a part; a quarter of a second of work and some 10 MB."""


class OutputFolder:
    """The folder of a run, open for writing until `close`; made by `open_output`."""

    def __init__(self, path: Path, lock: FolderLock, manifest: Manifest, created: bool):
        self.path = path
        self.manifest = manifest
        self.damaged: dict[str, str] = {}
        """Parts that were found damaged when the folder was opened, with what was wrong; they are missing."""
        self._lock = lock
        self._created = created
        self._busy = threading.RLock()
        self._ended: str | None = None
        self._open = True

    def commit(self, first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]) -> None:
        """Put a part in place, or a longer version of one, and record it.

        Parameters
        ----------
        first
            Row number of its first row.
        content
            The bytes of its file.
        rows
            How many rows it has.
        verdicts
            How many of them have each verdict and reason.

        Raises
        ------
        WriteError
            The disk is full or the folder cannot be written; what was there before still is.
        """
        with self._busy:
            if not self._open:
                return  # the run was stopped while this part was encoded
            name = self.manifest.part_name(first)
            before = self.manifest.parts.get(name)
            try:
                self._put(Part(first, _version(content, rows), verdicts, now()), name, content, before)
            except OSError as problem:
                self.manifest.parts.pop(name, None)
                if before is not None:
                    self.manifest.parts[name] = before
                raise errors.WriteError(
                    f"cannot write into {self.path}: {problem.strerror}. {self.manifest.rows_done:,} of "
                    f"{self.manifest.rows:,} rows are safe; make room and go on with: "
                    f"{self.manifest.resume_command}"
                ) from problem
            finally:
                if self._ended is not None:
                    self.close(self._ended)

    def sign_of_life(self) -> None:
        """Show that the run is alive; cheap, to be called often."""
        self._lock.renew()

    def close(self, how: str, patience_s: float = 0.2) -> None:
        """Record how the run ended and let the folder go; later calls do nothing.

        Parameters
        ----------
        how
            ``finished``, or what stopped it.
        patience_s
            How long to wait for a part that another thread is writing just now [s]; if that takes longer, the
            other thread closes the folder when it is done.
        """
        self._ended = self._ended or how
        if not self._busy.acquire(timeout=patience_s):
            return
        try:
            if self._open:
                self._open = False
                session = self.manifest.sessions[-1]
                session.ended, session.how = now(), self._ended
                with suppress(OSError):  # a full disk must not hide what stopped the run
                    save(self.manifest, self.path)
                self._lock.release()
        finally:
            self._busy.release()

    def discard(self) -> None:
        """Let the folder go as if it had never been taken, if nothing has been written into it."""
        if self.manifest.parts or len(self.manifest.sessions) > 1:
            self.close("refused")
            return
        self._open = False
        with suppress(OSError):
            (self.path / MANIFEST_NAME).unlink()
        self._lock.release()
        if self._created:
            with suppress(OSError):
                self.path.rmdir()

    def _put(self, part: Part, name: str, content: memoryview | bytes, before: Part | None) -> None:
        """Put a part in place and record it; announce it first where it replaces a shorter one."""
        if before is not None:
            self.manifest.parts[name] = replace(part, before=before.now, verdicts_before=before.verdicts)
            save(self.manifest, self.path)
        put_file(self.path, name, content)
        self.manifest.parts[name] = part
        save(self.manifest, self.path)


def _version(content: memoryview | bytes, rows: int) -> Version:
    """Return what a file of this content will be."""
    return Version(rows, len(content), sha256_of_bytes(content))


def open_output(
    out: Path,
    manifest: Manifest,
    session: Session,
    *,
    resume: bool = False,
    overwrite: bool = False,
) -> OutputFolder:
    """Take a folder for a run.

    Parameters
    ----------
    out
        The folder; it may exist if it is empty, or as `resume` and `overwrite` say.
    manifest
        What the run is, without parts.
    session
        Who runs it.
    resume
        Keep the finished parts of the same run if there are any. Damaged ones become missing.
    overwrite
        Remove what a sweep wrote there before.

    Raises
    ------
    StoreError
        The folder cannot be used; see the classes in `errors` for the reasons.
    """
    if resume and overwrite:
        raise errors.StoreError("--resume and --overwrite exclude each other")
    created = _make(out)
    try:
        lock = _locked(out)
    except BaseException:
        if created:
            with suppress(OSError):
                out.rmdir()
        raise
    try:
        folder = _taken(out, lock, manifest, resume, overwrite, created)
        folder.manifest.sessions.append(session)
        save(folder.manifest, out)
    except OSError as problem:
        lock.release()
        raise errors.WriteError(f"cannot write into {out}: {problem.strerror}") from problem
    except BaseException:
        lock.release()
        raise
    return folder


def _make(out: Path) -> bool:
    """Make the folder if it is not there; True if it was made."""
    if not out.parent.is_dir():
        raise errors.StoreError(f"there is no folder {out.parent} to make {out.name} in")
    try:
        out.mkdir()
    except FileExistsError:
        if not out.is_dir():
            raise errors.StoreError(f"{out} is a file; the output of a sweep is a folder") from None
        return False
    except OSError as problem:
        raise errors.WriteError(f"cannot make the folder {out}: {problem.strerror}") from problem
    return True


def _locked(out: Path) -> FolderLock:
    """Lock the folder, with words for who else may hold it."""
    holder, host = "another run", None
    with suppress(errors.StoreError):
        sessions = load(out).sessions
        if sessions and sessions[-1].ended is None:
            last = sessions[-1]
            holder, host = f"process {last.pid} on {last.host} since {last.started}", last.host
    return FolderLock(out, host, holder)


def _taken(
    out: Path, lock: FolderLock, manifest: Manifest, resume: bool, overwrite: bool, created: bool
) -> OutputFolder:
    """Bring a locked folder into the state from which the run goes on."""
    names = sorted(entry.name for entry in out.iterdir())
    foreign = [name for name in names if not is_ours(name) or (out / name).is_dir()]
    there = None
    if MANIFEST_NAME in names and not (overwrite and _is_damaged(out)):
        there = load(out)
    parts = [name for name in names if is_part_name(name)]
    if there is None and not overwrite and parts:
        raise errors.DamagedError(f"{out} holds parts but no {MANIFEST_NAME}; --overwrite starts again")
    if there is None or overwrite:
        unknown = parts if there is None else [name for name in parts if name not in there.parts]
        foreign += [name for name in unknown if not _is_written_by_us(out / name)]
        if foreign:
            raise errors.ForeignFilesError(out, foreign)
    if there is not None and not (resume or overwrite):
        raise errors.OutputExistsError(out, there.rows_done, there.rows)
    if there is None or overwrite:
        _remove(out, [name for name in names if is_ours(name) and name not in (LOCK_NAME, MANIFEST_NAME)])
        return OutputFolder(out, lock, manifest, created)
    return _resumed(out, lock, manifest, there, names)


def _resumed(out: Path, lock: FolderLock, manifest: Manifest, there: Manifest, names: list[str]) -> OutputFolder:
    """Go on with the run that is there, if it is the same."""
    different = differences(there.identity, manifest.identity)
    if there.rows != manifest.rows:
        different.append(f"rows: {there.rows:,} -> {manifest.rows:,}")
    if different:
        raise errors.SettingsDifferError(out, different)
    there.parts, damaged = verified_parts(out, there)
    there.resume_command = manifest.resume_command
    keep = {*there.parts, MANIFEST_NAME, LOCK_NAME}
    _remove(out, [name for name in names if is_ours(name) and name not in keep])
    folder = OutputFolder(out, lock, there, created=False)
    folder.damaged = damaged
    return folder


def _remove(out: Path, names: list[str]) -> None:
    """Remove files and make that durable."""
    for name in names:
        (out / name).unlink(missing_ok=True)
    if names:
        flush_folder(out)


def _is_damaged(out: Path) -> bool:
    """Whether the manifest cannot be trusted."""
    try:
        load(out)
    except errors.DamagedError:
        return True
    return False


def _is_written_by_us(path: Path) -> bool:
    """Whether a file that is named like a part says itself that a sweep wrote it."""
    import pyarrow as pa  # heavy, and only needed where a manifest is missing
    import pyarrow.parquet as pq

    try:
        metadata: dict[bytes, Any] = pq.read_metadata(path).metadata or {}
    except (OSError, pa.ArrowException):
        return False
    return any(key.startswith(PREFIX.encode()) for key in metadata)
