"""The output folder of a run: opened, written part by part, closed.

Whoever computes a part stages it: the file is written complete (see `files`) under a temporary name. The run
commits staged parts in the order of their rows: they get their names and are recorded in the manifest with rows
and checksum. A file never changes, so readers are never disturbed.

A slow run writes small parts, so that its progress can be read and an interruption loses little. When all rows are
there, small parts are merged into those a fast run would have written: the merge is announced in the manifest, the
merged file is written under a temporary name, the small ones are removed, and it gets its final name. So no row is
ever seen twice, and a run killed in the middle can finish the merge.
"""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from boulder_sweep.store import errors
from boulder_sweep.store.files import WRITING_SUFFIX, opened_folder, put_file
from boulder_sweep.store.lock import FolderLock
from boulder_sweep.store.manifest import MANIFEST_NAME, Manifest, Merge, Part, hidden_name, is_ours, part_name, save
from boulder_sweep.store.merging import finish_merge
from boulder_sweep.store.provenance import now

ROWS_PER_PART = 131_072
"""Rows of a part; a quarter of a second of work and some 10 MB."""


class StagedPart(NamedTuple):
    """A part written under a temporary name."""

    name: str
    """Its final name."""
    part: Part


def stage(
    folder: Path, table_rows: int, first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]
) -> StagedPart:
    """Write a part under its temporary name; other machines that share the folder may do that, too.

    Parameters
    ----------
    folder
        The output folder.
    table_rows
        Rows of the whole table.
    first
        Row number of the first row of the part.
    content
        The bytes of its file.
    rows
        Number of its rows.
    verdicts
        Number of rows of each verdict and reason.

    Raises
    ------
    OSError
        The disk is full or the folder cannot be written; nothing has changed.
    """
    name = part_name(first, first + rows, table_rows)
    put_file(folder, hidden_name(name), content)
    return StagedPart(name, _part(first, content, rows, verdicts))


class OutputFolder:
    """The folder of a run, open for writing until `close`; made by `opening.open_output`."""

    def __init__(self, path: Path, lock: FolderLock, manifest: Manifest, created: bool):
        self.path = path
        self.manifest = manifest
        self.damaged: dict[str, str] = {}
        """Parts found damaged when the folder was opened, and what was wrong; their rows count as missing."""
        self._lock = lock
        self._created = created
        self._busy = threading.RLock()
        self._ended: str | None = None
        self._open = True

    def stage(self, first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]) -> StagedPart:
        """Write a part under its temporary name; any thread may do that at any time.

        Parameters
        ----------
        first
            Row number of its first row.
        content
            The bytes of its file.
        rows
            Number of its rows.
        verdicts
            Number of rows of each verdict and reason.

        Raises
        ------
        WriteError
            The disk is full or the folder cannot be written; earlier parts are unchanged.
        """
        try:
            staged = stage(self.path, self.manifest.rows, first, content, rows, verdicts)
        except OSError as problem:
            raise self.write_error(problem) from problem
        if not self._open:  # the run was stopped meanwhile
            (self.path / hidden_name(staged.name)).unlink(missing_ok=True)
        return staged

    def commit(self, staged: Sequence[StagedPart]) -> None:
        """Give staged parts their names and record them; after `close` they are removed instead.

        Raises
        ------
        WriteError
            As for `stage`.
        """
        with self._writing() as is_open, opened_folder(self.path) as at:
            if not is_open:  # the run was stopped while these parts were written
                for name, _ in staged:
                    with suppress(OSError):
                        os.unlink(hidden_name(name), dir_fd=at)
                return
            for name, _ in staged:
                os.rename(hidden_name(name), name, src_dir_fd=at, dst_dir_fd=at)
            os.fsync(at)
            self.manifest.parts.update(staged)
            try:
                save(self.manifest, self.path)
            except OSError:
                for name, _ in staged:
                    del self.manifest.parts[name]
                raise

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
        verdicts: dict[str, int] = {}
        for part in parts:
            for key, count in part.verdicts.items():
                verdicts[key] = verdicts.get(key, 0) + count
        rows = sum(part.rows for part in parts)
        merged = _part(parts[0].first, content, rows, dict(sorted(verdicts.items())))
        with self._writing() as is_open:
            if not is_open:
                return
            name = part_name(merged.first, merged.stop, self.manifest.rows)
            self.manifest.merge = Merge(name, merged, names)
            try:
                save(self.manifest, self.path)
                put_file(self.path, hidden_name(name), content)
            except OSError:
                self.manifest.merge = None
                raise
            finish_merge(self.manifest, self.path)
            save(self.manifest, self.path)

    def heartbeat(self) -> None:
        """Show that the run is alive; cheap, call it often."""
        self._lock.renew()

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
                with suppress(OSError):  # a full disk must not hide what stopped the run
                    save(self.manifest, self.path)
                self._lock.release()
        finally:
            self._busy.release()

    def discard(self) -> None:
        """Release the folder and remove all traces, if nothing has been written into it."""
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

    def write_error(self, problem: OSError) -> errors.WriteError:
        """Describe why the folder cannot be written, and how to resume."""
        done = f"{self.manifest.rows_done:,} of {self.manifest.rows:,} rows are safe"
        return errors.WriteError(
            f"cannot write into {self.path}: {problem.strerror}. {done}; free some space and resume with: "
            f"{self.manifest.resume_command}"
        )

    def _remove_staged(self) -> None:
        """Remove parts that were staged and not committed."""
        merging = None if self.manifest.merge is None else hidden_name(self.manifest.merge.name)
        with suppress(OSError):
            for path in self.path.iterdir():
                if path.name.endswith(WRITING_SUFFIX) and is_ours(path.name) and path.name != merging:
                    path.unlink(missing_ok=True)


def _part(first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]) -> Part:
    """Return the record of a part."""
    return Part(first, rows, len(content), hashlib.sha256(content).hexdigest(), verdicts, now())
