"""Opening an output folder for a run: new, resumed or overwritten, or refused with the reason."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from boulder_sweep.locations import Location
from boulder_sweep.store import failures
from boulder_sweep.store.files import MANIFEST_NAME, is_kept, is_ours, is_part_name
from boulder_sweep.store.manifest import Manifest, load, save
from boulder_sweep.store.provenance import PREFIX, Session, differences
from boulder_sweep.store.storage import Lock, Storage, storage_of
from boulder_sweep.store.verify import damaged_parts
from boulder_sweep.store.writer import OutputFolder, recover_merge
from boulder_sweep.text import why


class ClaimedFolder:
    """An output folder locked for a run that has not begun; nothing is changed in it yet.

    Attributes
    ----------
    rows_done : int
        Rows that a resumed run keeps, if their parts are intact.
    """

    def __init__(self, storage: Storage, lock: Lock, resume: bool, overwrite: bool):
        self._storage, self._lock = storage, lock
        self._names = storage.names()
        there = _allowed(storage, self._names, resume, overwrite)
        self._there = None if overwrite else there
        self.rows_done = 0 if self._there is None else self._there.rows_done
        storage.check_writable()

    def open(self, manifest: Manifest, session: Session) -> OutputFolder:
        """Begin the run.

        Parameters
        ----------
        manifest
            Describes the run, without parts.
        session
            When, where and by which command the run was started.

        Raises
        ------
        SettingsDifferError
            The folder holds rows of other settings or another version.
        WriteError
            The folder cannot be written.
        """
        try:
            if self._there is None:
                self._storage.remove(name for name in self._names if is_ours(name) and not is_kept(name))
                folder = OutputFolder(self._storage, self._lock, manifest)
            else:
                folder = self._resumed(manifest, self._there)
            folder.manifest.sessions.append(session)
            save(folder.manifest, self._storage)
        except OSError as problem:
            raise failures.WriteError(f"cannot write into {self._storage.path}: {why(problem)}") from problem
        return folder

    def release(self) -> None:
        """Release the folder as it was."""
        self._lock.release()
        self._storage.unmake()

    def _resumed(self, manifest: Manifest, there: Manifest) -> OutputFolder:
        """Resume the run in the folder, if it is the same."""
        storage = self._storage
        refuse_other_settings(there, manifest.identity, manifest.rows, storage.path)
        there.identity = manifest.identity  # the heading of reports may be another
        recover_merge(there, storage)
        # Where the storage checks content itself, reading all of it again may take hours.
        damaged = damaged_parts(storage.path, there.parts, read_parts=not storage.checks_content)
        there.parts = {name: part for name, part in there.parts.items() if name not in damaged}
        there.resume_command = manifest.resume_command
        storage.remove(name for name in self._names if is_ours(name) and name not in there.parts and not is_kept(name))
        folder = OutputFolder(storage, self._lock, there)
        folder.damaged = damaged
        return folder


def claim_output(out: Location, *, resume: bool = False, overwrite: bool = False) -> ClaimedFolder:
    """Lock a folder for a run, and check that it can be used.

    Parameters
    ----------
    out
        The folder; it may exist if it is empty, or with `resume` or `overwrite`.
    resume
        Keep the finished parts of the same run, if any. Damaged ones count as missing.
    overwrite
        Remove what an earlier sweep wrote there.

    Raises
    ------
    StoreError
        The folder cannot be used; see the classes in `errors` for the reasons.
    """
    if resume and overwrite:
        raise failures.StoreError("--resume and --overwrite cannot be used together")
    storage = storage_of(out)
    storage.make()
    lock = None
    try:
        lock = _locked(storage)
        return ClaimedFolder(storage, lock, resume, overwrite)
    except BaseException as problem:
        if lock is not None:
            lock.release()
        storage.unmake()
        if isinstance(problem, OSError):
            raise failures.WriteError(f"cannot write into {out}: {why(problem)}") from problem
        raise


def refuse_other_settings(there: Manifest, identity: Mapping[str, Any], rows: int, out: Location) -> None:
    """Refuse to go on in a folder whose rows are of other settings, kernels or versions.

    Raises
    ------
    SettingsDifferError
        Says what differs.
    """
    different = differences(there.identity, identity)
    if there.rows != rows:
        different.append(f"rows: {there.rows:,} -> {rows:,}")
    if different:
        raise failures.SettingsDifferError(out, different)


def _locked(storage: Storage) -> Lock:
    """Lock the folder; an error names who else may hold it."""
    holder, host = "another run", None
    with suppress(failures.StoreError):
        sessions = load(storage.path).sessions
        if sessions and sessions[-1].ended is None:
            last = sessions[-1]
            holder, host = f"process {last.pid} on {last.host} since {last.started}", last.host
    return storage.lock(host, holder)


def _allowed(storage: Storage, names: list[str], resume: bool, overwrite: bool) -> Manifest | None:
    """Check that a run may use a folder; return its manifest, None if there is none to resume from."""
    out = storage.path
    names = [name for name in names if not (name == ".DS_Store" or name.startswith(".nfs"))]  # of the system
    foreign = [name for name in names if not is_ours(name) or storage.is_folder(name)]
    there = None
    try:
        there = load(out)
    except failures.NotASweepError:
        pass
    except (failures.DamagedError, failures.OtherVersionError):
        if not overwrite:
            raise
    parts = [name for name in names if is_part_name(name)]
    if there is None and not overwrite and parts:
        raise failures.DamagedError(f"{out} contains parts but no {MANIFEST_NAME}; use --overwrite to start again")
    if there is None or overwrite:
        unknown = parts if there is None else [name for name in parts if name not in there.parts]
        foreign += [name for name in unknown if not _is_written_by_us(out / name)]
        if foreign:
            raise failures.ForeignFilesError(out, foreign)
    if there is not None and not (resume or overwrite):
        raise failures.OutputExistsError(out, there.rows_done, there.rows)
    return there


def _is_written_by_us(path: Location) -> bool:
    """Whether the metadata of a file that is named like a part shows that a sweep wrote it."""
    import pyarrow as pa  # heavy, and only needed where a manifest is missing
    import pyarrow.parquet as pq

    try:
        with path.open("rb") as file:
            metadata: dict[bytes, Any] = pq.read_metadata(file).metadata or {}
    except (OSError, pa.ArrowException, UnicodeDecodeError):
        return False
    return any(key.startswith(PREFIX.encode()) for key in metadata)
