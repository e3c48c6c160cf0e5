"""What a run does to its output folder, for folders on a disk and for folders on an object store.

On a disk a file gets its final name by renaming, see `files`. An object store has no renaming: a part is put under its
temporary name and copied to the final one within the store, and the manifest is written as numbered versions, see
`generations`.
"""

from __future__ import annotations

import os
import queue
import threading
import uuid
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from stat import S_ISREG
from typing import IO, Any

from boulder_sweep.locations import Location, RemotePath
from boulder_sweep.store import errors
from boulder_sweep.store.files import (
    MANIFEST_NAME,
    check_writable,
    flush_folder,
    hidden_name,
    is_file,
    opened_folder,
    put_file,
)
from boulder_sweep.store.generations import Encode, Generations, OtherWriterError, newest, refuses_existing
from boulder_sweep.store.lock import FolderLock, ObjectLock
from boulder_sweep.text import why

_PROBE_BYTES = 1 << 16
"""More than a first manifest takes."""
_REQUESTS = 16
"""Requests to a store at the same time."""


class _Storage:
    """What folders on a disk and on an object store have in common."""

    _lock: FolderLock | ObjectLock | None = None

    def _check_lock(self) -> None:
        """Refuse to change what may belong to another run by now."""
        if self._lock is not None:
            self._lock.check()


class DiskStorage(_Storage):
    """A folder on a disk, local or shared."""

    checks_content = False

    def __init__(self, path: Path):
        self._path = path

    def make(self) -> bool:
        """Create the folder if it does not exist; True if it was created."""
        path = self._path
        if not path.parent.is_dir():
            raise errors.StoreError(f"the folder {path.parent} does not exist: {path.name} cannot be created in it")
        try:
            path.mkdir()
        except FileExistsError:
            if not path.is_dir():
                raise errors.StoreError(f"{path} is a file; the output of a sweep is a folder") from None
            return False
        except OSError as problem:
            raise errors.WriteError(f"cannot create the folder {path}: {why(problem)}") from problem
        return True

    def unmake(self) -> None:
        """Remove the folder if it is empty and can be removed."""
        with suppress(OSError):
            self._path.rmdir()

    def lock(self, last_host: str | None, holder: str) -> Lock:
        """Become the only writer."""
        self._lock = FolderLock(self._path, last_host, holder)
        return self._lock

    def check_writable(self) -> None:
        """Raise OSError if the folder cannot be written."""
        is_file(self._path / MANIFEST_NAME)  # a link would be refused only when old parts are gone
        check_writable(self._path, hidden_name(MANIFEST_NAME), _PROBE_BYTES)

    def names(self) -> list[str]:
        """Return the names in the folder."""
        return sorted(entry.name for entry in self._path.iterdir())

    def is_folder(self, name: str) -> bool:
        """Whether one of the names is that of a folder."""
        return (self._path / name).is_dir()

    def put(self, name: str, content: memoryview | bytes) -> None:
        """Write a file whole or not at all, durably."""
        put_file(self._path, name, content)

    def publish(self, names: Mapping[str, str], sizes: Mapping[str, int] | None = None) -> None:
        """Give staged files, by their temporary names, their final names, durably."""
        self._check_lock()
        with opened_folder(self._path) as at:
            for staged, final in names.items():
                os.rename(staged, final, src_dir_fd=at, dst_dir_fd=at)
            os.fsync(at)

    def remove(self, names: Iterable[str]) -> None:
        """Remove files that may exist, durably."""
        self._check_lock()
        names = sorted(names, reverse=True)  # the last rows first: no gap, wherever a run is killed
        for name in names:
            (self._path / name).unlink(missing_ok=True)
        if names:
            flush_folder(self._path)

    def open_manifest(self) -> IO[bytes]:
        """Open the manifest; raises OSError."""
        # A pipe of this name must not be waited for.
        return open(self._path / MANIFEST_NAME, "rb", opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK))

    def put_manifest(self, encode: Encode) -> None:
        """Replace the manifest in one step."""
        self._check_lock()
        put_file(self._path, MANIFEST_NAME, encode({}))

    def discard_manifest(self) -> None:
        """Remove the manifest."""
        self._check_lock()
        (self._path / MANIFEST_NAME).unlink()


class ObjectStorage(_Storage):
    """A folder on an object store, or on any other file system of fsspec."""

    checks_content = True
    """Whether it sees to it itself that a file holds what was written, so that comparing its size is enough."""

    def __init__(self, path: RemotePath):
        self._path = path
        self._token = uuid.uuid4().hex
        self._generations: Generations | None = None

    def make(self) -> bool:
        """Create nothing, for folders exist by their files only; True if there are none."""
        try:
            if S_ISREG(self._path.stat().st_mode):
                raise errors.StoreError(f"{self._path} is a file; the output of a sweep is a folder")
        except FileNotFoundError:
            return True
        except OSError as problem:
            raise errors.WriteError(f"cannot write into {self._path}: {problem.strerror}") from None
        return not self.names()

    def unmake(self) -> None:
        """Do nothing."""

    def lock(self, last_host: str | None, holder: str) -> Lock:
        """Become the only writer; then look which version of the manifest is the newest."""
        try:
            only_new = refuses_existing(self._path, self._token)
            lock = ObjectLock(self._path, self._token, only_new, holder)
        except OSError as problem:
            raise errors.WriteError(f"cannot write into {self._path}: {problem.strerror}") from None
        self._lock = lock
        self._generations = Generations(self._path, self._token, only_new)
        try:
            self._generations.look()
        except BaseException:
            lock.release()
            raise
        return lock

    def check_writable(self) -> None:
        """Do nothing: `lock` has written."""

    def names(self) -> list[str]:
        """Return the names in the folder."""
        return self._path.names()

    def is_folder(self, name: str) -> bool:
        """Whether one of the names is that of a folder."""
        return name.endswith("/")

    def put(self, name: str, content: memoryview | bytes) -> None:
        """Write a file whole or not at all."""
        (self._path / name).put(content)

    def publish(self, names: Mapping[str, str], sizes: Mapping[str, int] | None = None) -> None:
        """Copy staged files to their final names and remove the staged ones."""
        self._check_lock()
        for_size = sizes or {}
        self._each(lambda name: self._publish(name, names[name], for_size.get(name)), names)

    def remove(self, names: Iterable[str]) -> None:
        """Remove files that may exist, unless they are another run's by now."""
        self._check_lock()
        self._each(lambda name: (self._path / name).unlink(missing_ok=True), names)

    def open_manifest(self) -> IO[bytes]:
        """Open the newest version of the manifest.

        Raises
        ------
        FileNotFoundError
            There is none.
        StoreError
            The store does not answer, which says nothing about the manifest.
        """
        try:
            return BytesIO(newest(self._path).content)
        except FileNotFoundError:
            raise
        except OSError as problem:
            raise errors.StoreError(f"{self._path} cannot be read: {problem.strerror}") from None

    def put_manifest(self, encode: Encode) -> None:
        """Write the next version of the manifest."""
        if self._generations is None:
            raise RuntimeError("a manifest is written with the lock held only")
        try:
            self._generations.put(encode)
        except OtherWriterError:
            raise errors.FolderInUseError(f"{self._path} was taken over by another run") from None

    def discard_manifest(self) -> None:
        """Remove the manifest."""
        if self._generations is not None:
            self._generations.discard()

    def _publish(self, staged_name: str, name: str, size: int | None) -> None:
        """Copy one staged file to its final name."""
        staged = self._path / staged_name
        if size is not None and staged.stat().st_size != size:
            raise errors.DamagedError(f"{staged} is not what a worker wrote there: it has another size")
        staged.copy_to(self._path / name)
        with suppress(OSError):
            staged.unlink(missing_ok=True)

    def _each(self, act: Callable[[str], Any], names: Iterable[str]) -> None:
        """Send requests for several files at the same time."""
        waiting = queue.SimpleQueue[str]()
        done: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()
        for name in names:
            waiting.put(name)

        def work() -> None:
            with suppress(queue.Empty):
                while True:
                    name = waiting.get_nowait()
                    try:
                        act(name)
                    except BaseException as problem:
                        done.put(problem)
                    else:
                        done.put(None)

        count = waiting.qsize()
        for _ in range(min(count, _REQUESTS)):  # not those of a pool: Python would wait for them at its end
            threading.Thread(target=work, name="requests", daemon=True).start()
        for problem in [done.get() for _ in range(count)]:
            if problem is not None:
                raise problem


Lock = FolderLock | ObjectLock
"""The right to write into a folder."""
Storage = DiskStorage | ObjectStorage
"""What a run does to its output folder, and where the manifest is read. Both have the same methods."""


def storage_of(place: Location) -> Storage:
    """Return how a run writes into a folder."""
    return DiskStorage(place) if isinstance(place, Path) else ObjectStorage(place)
