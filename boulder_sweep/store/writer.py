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
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from boulder_sweep.store import failures
from boulder_sweep.store.files import WRITING_SUFFIX, hidden_name, is_ours, is_part_name, part_name, staged_name
from boulder_sweep.store.manifest import Manifest, Merge, Part, save, total_verdicts
from boulder_sweep.store.provenance import now
from boulder_sweep.store.storage import Lock, Storage
from boulder_sweep.store.verify import damaged_parts, merged_file
from boulder_sweep.text import NO_SPACE

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
    """The folder of a run, open for writing until `close`; made by `opening.ClaimedFolder.open`."""

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
