"""The output folder of a run: opened, written part by part, closed.

A part is put in place whole (see `files`) and then recorded in the manifest with its rows and checksum; its
file never changes, so readers are never disturbed. A slow run writes small parts, so that its progress can be
read and an interruption loses little. When all rows are there, small parts are merged into those a fast run would have
written: the merge is announced in the manifest, the merged file is written under a ``_`` name, the small ones
are removed, and it gets its final name. So no row is ever seen twice, and a run killed in the middle can finish
the merge.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from boulder_sweep.store import errors
from boulder_sweep.store.files import put_file
from boulder_sweep.store.lock import FolderLock
from boulder_sweep.store.manifest import MANIFEST_NAME, Manifest, Merge, Part, hidden_name, save
from boulder_sweep.store.merging import finish_merge
from boulder_sweep.store.provenance import now

ROWS_PER_PART = 131_072
"""Rows of a part; a quarter of a second of work and some 10 MB."""


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

    def commit(self, first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]) -> None:
        """Put a part in place and record it.

        Parameters
        ----------
        first
            Row number of its first row.
        content
            The bytes of its file.
        rows
            How many rows it has.
        verdicts
            Number of rows of each verdict and reason.

        Raises
        ------
        WriteError
            The disk is full or the folder cannot be written; earlier parts are unchanged.
        """
        name = self.manifest.part_name(first, first + rows)
        with self._writing() as is_open:
            if not is_open:
                return  # the run was stopped while this part was encoded
            put_file(self.path, name, content)
            self.manifest.parts[name] = _part(first, content, rows, verdicts)
            try:
                save(self.manifest, self.path)
            except OSError:
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
            name = self.manifest.part_name(merged.first, merged.stop)
            self.manifest.merge = Merge(name, merged, names)
            try:
                save(self.manifest, self.path)
                put_file(self.path, hidden_name(name), content)
            except OSError:
                self.manifest.merge = None
                raise
            finish_merge(self.manifest, self.path)
            save(self.manifest, self.path)

    def sign_of_life(self) -> None:
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
                done = f"{self.manifest.rows_done:,} of {self.manifest.rows:,} rows are safe"
                raise errors.WriteError(
                    f"cannot write into {self.path}: {problem.strerror}. {done}; free some space and resume with: "
                    f"{self.manifest.resume_command}"
                ) from problem
            finally:
                if self._ended is not None:
                    self.close(self._ended)


def _part(first: int, content: memoryview | bytes, rows: int, verdicts: dict[str, int]) -> Part:
    """Return the record of a part."""
    return Part(first, rows, len(content), hashlib.sha256(content).hexdigest(), verdicts, now())
