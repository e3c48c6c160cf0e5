"""The output folder of a run: opened, written part by part, closed.

Whoever computes a part stages it: the file is written complete (see `files`) under a temporary name. The run
commits staged parts in the order of their rows: they get their names and are recorded in the manifest with rows
and checksum. A file never changes, so readers are never disturbed. The temporary name holds a token of the run and
the checksum, and the file is read again before it gets its final name: what a worker of another run stages, at any
time, is never taken for a part of this one.

A slow run writes small parts, so that its progress can be read and an interruption loses little. When all rows are
there, small parts are merged into those a fast run would have written: the merge is announced in the manifest, the
merged file is written under a temporary name, the small ones are removed, and it gets its final name. So no row is
ever seen twice, and a run killed in the middle can finish the merge.
"""

from __future__ import annotations

import errno
import hashlib
import secrets
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from boulder_sweep.locations import Location
from boulder_sweep.store import failures
from boulder_sweep.store.files import (
    MANIFEST_NAME,
    WRITING_SUFFIX,
    hidden_name,
    is_kept,
    is_ours,
    is_part_name,
    part_name,
    staged_name,
)
from boulder_sweep.store.manifest import Manifest, Merge, Part, load, save, total_verdicts
from boulder_sweep.store.provenance import PREFIX, Session, differences, now
from boulder_sweep.store.storage import Lock, Storage, storage_of
from boulder_sweep.store.verify import damaged_parts, merged_file
from boulder_sweep.text import NO_SPACE, why

ROWS_PER_PART = 131_072
"""Rows of a part; a quarter of a second of work and some 10 MB."""


class EncodedPart(NamedTuple):
    """A part of the table as the bytes of its file."""

    first: int
    """Row number of its first row."""
    rows: int
    content: memoryview | bytes
    verdicts: dict[str, int]
    """Number of rows of each verdict and reason, keyed as in `Part`."""


class StagedPart(NamedTuple):
    """A part written under a temporary name."""

    name: str
    """Its final name."""
    part: Part


def stage(storage: Storage, token: str, table_rows: int, encoded: EncodedPart) -> StagedPart:
    """Write a part under its temporary name; other machines that share the folder may do that, too.

    Parameters
    ----------
    storage
        How the output folder is written.
    token
        Of the run, see `OutputFolder`.
    table_rows
        Rows of the whole table.
    encoded
        The part.

    Raises
    ------
    OSError
        The disk is full or the folder cannot be written; nothing has changed.
    """
    part = _part(encoded)
    staged = StagedPart(part_name(part.first, part.stop, table_rows), part)
    storage.put(staged_name(staged.name, token, part.sha256), encoded.content)
    return staged


class OutputFolder:
    """The folder of a run, open for writing until `close`; made by `ClaimedFolder.open`."""

    def __init__(self, storage: Storage, lock: Lock, manifest: Manifest):
        self.path = storage.path
        self._storage = storage
        self.manifest = manifest
        self.token = secrets.token_hex(8)
        """New for every opening, and known to its workers only."""
        self.rows_safe = manifest.rows_done
        """Rows that the manifest on the storage records; that of this run may be ahead while it is being written."""
        self.damaged: dict[str, str] = {}
        """Parts found damaged when the folder was opened, and what was wrong; their rows count as missing."""
        self._lock = lock
        self._busy = threading.RLock()
        self._ended: str | None = None
        self._open = True

    def stage(self, encoded: EncodedPart) -> StagedPart:
        """Write a part under its temporary name; any thread may do that at any time.

        Raises
        ------
        WriteError
            The disk is full or the folder cannot be written; earlier parts are unchanged.
        """
        try:
            staged = stage(self._storage, self.token, self.manifest.rows, encoded)
        except OSError as problem:
            raise self.write_error(problem) from problem
        if not self._open:  # the run was stopped meanwhile
            self._remove([self._temporary(staged)])
        return staged

    def is_staged(self, staged: StagedPart) -> bool:
        """Whether a part that a worker has staged is seen from here; raises as `stage`."""
        try:
            return (self.path / self._temporary(staged)).exists()
        except OSError as problem:
            raise self.write_error(problem) from problem

    def commit(self, staged: Sequence[StagedPart]) -> None:
        """Give staged parts their names and record them; after `close` they are removed instead.

        Raises
        ------
        WriteError
            As for `stage`.
        DamagedError
            One is not what was staged.
        FolderInUseError, FolderRemovedError
            The folder is not this run's any more.
        """
        temporary = {self._temporary(one): one for one in staged}
        with self._writing() as is_open:
            if not is_open:  # the run was stopped while these parts were written
                self._remove(temporary)
                return
            # An object store lets nobody see half of a file, and checks what it holds: sizes are enough there.
            parts = {name: one.part for name, one in temporary.items()}
            unchecked = {} if self._storage.checks_content else parts
            for name, wrong in damaged_parts(self.path, unchecked, read_parts=True).items():
                self.check()
                raise failures.DamagedError(
                    f"{self.path / name} is not what a worker wrote there ({wrong}). "
                    f"Resume with: {self.manifest.resume_command}"
                )
            sizes = {name: part.bytes for name, part in parts.items()}
            self._storage.publish({name: one.name for name, one in temporary.items()}, sizes)
            self.manifest.parts.update(staged)
            try:
                save(self.manifest, self._storage)
            except (OSError, failures.StoreError):
                for one in staged:
                    del self.manifest.parts[one.name]
                raise
            self.rows_safe = self.manifest.rows_done

    def merge(self, names: list[str], content: memoryview | bytes) -> None:
        """Replace neighbouring parts by one that holds the same rows.

        Parameters
        ----------
        names
            Names of the parts, in order.
        content
            The bytes of the file that replaces them.

        Raises
        ------
        WriteError
            As for `commit`.
        """
        parts = [self.manifest.parts[name] for name in names]
        rows = sum(part.rows for part in parts)
        merged = _part(EncodedPart(parts[0].first, rows, content, total_verdicts(parts)))
        with self._writing() as is_open:
            if not is_open:
                return
            name = part_name(merged.first, merged.stop, self.manifest.rows)
            self.manifest.merge = Merge(name, merged, names)
            try:
                save(self.manifest, self._storage)
                self._storage.put(hidden_name(name), content)
            except (OSError, failures.StoreError):
                self.manifest.merge = None
                raise
            finish_merge(self.manifest, self._storage)
            save(self.manifest, self._storage)

    def heartbeat(self) -> None:
        """Show that the run is alive; cheap, call it often.

        Raises
        ------
        FolderInUseError, FolderRemovedError
            The folder is not this run's any more.
        """
        self._lock.renew()

    def check(self) -> None:
        """Look whether the folder is still this run's; errors as for `heartbeat`."""
        self._lock.check()

    def close(self, how: str, patience_s: float = 0.2) -> None:
        """Record how the run ended and release the folder; later calls do nothing.

        Parameters
        ----------
        how
            ``finished``, or what stopped it.
        patience_s
            How long to wait for a part that another thread is writing [s]; if that takes longer, the
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
                self._remove_staged()
                with suppress(OSError, failures.StoreError):  # a full disk must not hide what stopped the run
                    save(self.manifest, self._storage)
                self._lock.release()
        finally:
            self._busy.release()

    def discard(self) -> None:
        """Release the folder and remove all traces, if nothing has been written into it."""
        if self.manifest.parts or len(self.manifest.sessions) > 1:
            self.close("refused")
            return
        self._open = False
        self._remove_staged()
        with suppress(OSError, failures.StoreError):  # a folder that is gone must not hide why the run was refused
            self._storage.discard_manifest()
        self._lock.release()
        self._storage.unmake()

    @contextmanager
    def _writing(self) -> Iterator[bool]:
        """Keep others from closing the folder while something is written; False if it is closed."""
        with self._busy:
            try:
                yield self._open
            except OSError as problem:
                raise self.write_error(problem) from problem
            finally:
                if self._ended is not None:
                    self.close(self._ended)

    def _temporary(self, staged: StagedPart) -> str:
        """Return the temporary name of a part of this run."""
        return staged_name(staged.name, self.token, staged.part.sha256)

    def write_error(self, problem: OSError) -> failures.StoreError:
        """Describe why the folder cannot be written, and how to resume."""
        if problem.errno == errno.ENOENT and isinstance(self.path, Path) and not self.path.exists():
            return failures.FolderRemovedError(self.path)
        done = f"{self.rows_safe:,} of {self.manifest.rows:,} rows are safe"
        advice = "free some space and resume" if problem.errno in NO_SPACE else "resume"
        return failures.WriteError(
            f"cannot write into {self.path}: {problem.strerror}. {done}; {advice} with: {self.manifest.resume_command}"
        )

    def _remove_staged(self) -> None:
        """Remove parts that were staged and not committed."""
        merge = self.manifest.merge
        keep = set(self.manifest.parts) | set(() if merge is None else merge.names)
        with suppress(OSError, failures.StoreError):
            self._storage.remove(name for name in self._storage.names() if _is_staged(name) and name not in keep)

    def _remove(self, names: Iterable[str]) -> None:
        """Remove files that nobody needs, if the storage lets it."""
        with suppress(OSError, failures.StoreError):
            self._storage.remove(names)


def _is_staged(name: str) -> bool:
    """Whether a name is that of a part, final or temporary."""
    return is_part_name(name) or (name.endswith(WRITING_SUFFIX) and is_ours(name))


def _part(encoded: EncodedPart) -> Part:
    """Return the record of a part."""
    first, rows, content, verdicts = encoded
    return Part(first, rows, len(content), hashlib.sha256(content).hexdigest(), verdicts, now())


def finish_merge(manifest: Manifest, storage: Storage) -> None:
    """Let the merged part, complete under its temporary name, replace the small ones.

    Parameters
    ----------
    manifest
        Announces the merge; updated in place, and the caller must save it.
    storage
        How the output folder is written.
    """
    merge = manifest.merge
    if merge is None:
        return
    # The small ones are removed first: a reader in between misses rows for a moment, but never sees any twice.
    storage.remove(merge.replaced)
    if (storage.path / hidden_name(merge.name)).exists():
        storage.publish({hidden_name(merge.name): merge.name})
    for name in merge.replaced:
        manifest.parts.pop(name, None)
    manifest.parts[merge.name] = merge.part
    manifest.merge = None


def recover_merge(manifest: Manifest, storage: Storage) -> None:
    """Finish a merge during which a run was killed, or drop it if it had only been announced.

    Parameters and effect are those of `finish_merge`.
    """
    if manifest.merge is not None and merged_file(storage.path, manifest.merge) is None:
        manifest.merge = None
    finish_merge(manifest, storage)


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
