"""The folder of a table: one file for each range of rows, each of which appears whole and never changes.

A folder contains ``rows-<first>-<stop>-<hash>.parquet``, and nothing else. The ranges follow from the settings, the
hash comes from the file's bytes: damage shows by name, and the same work has the same name. Nobody need record what
is finished. A local file is written in a hidden folder beside the table's and renamed; where that folder cannot be,
it is written in the table's folder, under a name that readers skip. On an object store a file is one request.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import WRITING, Location, created, is_file, names_in, put, remove, remove_abandoned
from boulder_sweep.signals import undone
from boulder_sweep.store import failures
from boulder_sweep.text import why

FEWEST_ROWS, MOST_ROWS = 64, 32_768
"""Rows of a range: fewer cost more to store than to compute, more would leave cores without work and take memory."""
TOGETHER = 4
"""The number of ranges is a multiple of this, so that few workers end at the same time."""
_DIGITS = 12
_NAME = re.compile(rf"rows-([0-9]{{{_DIGITS},20}})-([0-9]{{{_DIGITS},20}})-([0-9a-f]{{16}})\.parquet")
_TRIES = 20


@dataclass(frozen=True)
class Ranges:
    """The ranges [first, stop) of the rows of a table, in order; their lengths differ by one at most."""

    rows: int
    count: int

    def __iter__(self) -> Iterator[tuple[int, int]]:
        return (self.bounds(number) for number in range(self.count))

    def bounds(self, number: int) -> tuple[int, int]:
        """Return first row and stop of a range."""
        return number * self.rows // self.count, (number + 1) * self.rows // self.count

    def of(self, row: int) -> tuple[int, int]:
        """Return the range that holds a row."""
        return self.bounds(((row + 1) * self.count - 1) // self.rows)

    def __contains__(self, bounds: tuple[int, int]) -> bool:
        return 0 <= bounds[0] < bounds[1] <= self.rows and self.of(bounds[0]) == bounds


def ranges_of(rows: int, rows_wanted: float) -> Ranges:
    """Return the ranges of a table of 1 row or more; so many are wanted, by the work that a range should have."""
    size = min(max(int(rows_wanted), FEWEST_ROWS), MOST_ROWS)
    count = -(-rows // size)
    if rows >= TOGETHER * FEWEST_ROWS:
        count = min(-(-count // TOGETHER) * TOGETHER, rows // FEWEST_ROWS // TOGETHER * TOGETHER)
    return Ranges(rows, count)


class PartFile(NamedTuple):
    """The name of a part, in what it says."""

    first: int
    stop: int
    hash: str

    @property
    def name(self) -> str:
        """Name of the file; names sort as the rows do."""
        return f"rows-{self.first:0{_DIGITS}d}-{self.stop:0{_DIGITS}d}-{self.hash}.parquet"


def hash_of(content: bytes | memoryview) -> str:
    """Return what the name of a part says of its bytes: the first 16 digits of their SHA-256."""
    return hashlib.sha256(content).hexdigest()[:16]


def part_file(name: str) -> PartFile | None:
    """Return what the name of a part says; None for any other name."""
    match = _NAME.fullmatch(name)
    part = PartFile(int(match[1]), int(match[2]), match[3]) if match else None
    return part if part and part.name == name else None


def part_files(names: Sequence[str]) -> list[PartFile]:
    """Return the parts among some names, in the order of their rows."""
    return sorted(part for name in names if (part := part_file(name)))


def put_part(out: Location, first: int, stop: int, content: bytes | memoryview) -> PartFile:
    """Write a part; it appears whole, or not at all. Another worker may write the same part, too.

    Raise WriteError where it cannot be written; other parts are unchanged.
    """
    part = PartFile(first, stop, hash_of(content))
    try:
        if isinstance(out, Path):
            _put_on_disk(out, part.name, content)
        else:
            put(out / part.name, content)
    except OSError as problem:
        raise failures.WriteError(f"cannot write into {out}: {why(problem)}") from problem
    return part


def check_writable(out: Location) -> None:
    """Raise WriteError where a folder cannot be written; what is on an object store shows with the first part."""
    if isinstance(out, Path):
        try:
            with _passing(out):
                pass
        except OSError as problem:
            raise failures.WriteError(f"cannot write into {out}: {why(problem)}") from problem


def _put_on_disk(out: Path, name: str, content: bytes | memoryview) -> None:
    for left in range(_TRIES, 0, -1):
        try:
            with _passing(out) as (passing, file, at):
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                os.rename(passing.name, out / name, src_dir_fd=at)
            break
        except FileNotFoundError:  # another worker that is done has removed the hidden folder
            if left == 1 or not out.is_dir():
                raise
    folder = os.open(out, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@contextmanager
def _passing(out: Path) -> Iterator[tuple[Path, BinaryIO, int]]:
    """Give a file in which a part may be written: its path, open, and a descriptor of its folder."""
    hidden, device, flags = hidden_folder(out), out.stat().st_dev, os.O_RDONLY | os.O_DIRECTORY

    def folder() -> tuple[Path, str, int]:
        try:
            with suppress(FileExistsError):
                hidden.mkdir()
            at = os.open(hidden, flags | os.O_NOFOLLOW)
            if os.fstat(at).st_dev == device and os.access(hidden, os.W_OK):
                return hidden, "", at
            os.close(at)
        except OSError:
            pass
        return out, ".", os.open(out, flags)

    with undone(folder, lambda _: _remove_empty(hidden)) as (place, before, at):
        try:
            with created(place, before, at) as (passing, file):
                yield passing, file, at
        finally:
            os.close(at)


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # others write there, too
        folder.rmdir()


def hidden_folder(out: Path) -> Path:
    """Return the hidden folder beside a table in which its files are written."""
    whole = out.resolve()
    return whole.with_name(f".{whole.name}{WRITING}")


def clear(out: Location) -> None:
    """Remove unfinished files that nobody writes any more, and the hidden folder if it is empty; never fails."""
    if not isinstance(out, Path):
        return
    hidden = hidden_folder(out)
    for folder in (hidden, out):
        remove_abandoned(folder)
    _remove_empty(hidden)


def make(out: Location) -> bool:
    """Make a folder if there is none; True where it is new, StoreError where it cannot be made.

    On object stores folders exist by their files only.
    """
    if not isinstance(out, Path):
        return False
    if not out.parent.is_dir():
        raise failures.StoreError(f"the folder {out.parent} does not exist: {out.name} cannot be created in it")
    try:
        out.mkdir()
    except FileExistsError:
        if not out.is_dir():
            raise failures.StoreError(f"{out} is a file; the output of a sweep is a folder") from None
        return False
    except OSError as problem:
        raise failures.WriteError(f"cannot create the folder {out}: {why(problem)}") from problem
    return True


def remove_parts(out: Location, names: Sequence[str]) -> None:
    """Remove parts, the last rows first; WriteError where one cannot be removed."""
    try:
        for name in sorted(names, reverse=True):
            remove(out / name)
    except OSError as problem:
        raise failures.WriteError(f"cannot remove a file from {out}: {why(problem)}") from problem


@contextmanager
def locked(out: Location) -> Iterator[None]:
    """Refuse a second run into a folder from this machine by FolderInUseError.

    Two runs would do no harm, but the work twice. So where there are no locks, there is none.
    """
    from filelock import FileLock, Timeout  # only runs need it

    whole = str(out.resolve() if isinstance(out, Path) else out)
    name = hashlib.sha256(whole.encode(errors="surrogateescape")).hexdigest()[:32]
    lock = None
    with suppress(OSError, NotImplementedError):
        lock = FileLock(_runtime_folder() / f"{name}.lock", thread_local=False)
        try:
            lock.acquire(timeout=0)
        except Timeout:
            raise failures.FolderInUseError(f"another run on this machine writes into {out}") from None
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


def _runtime_folder() -> Path:
    """Return a folder of this user for what lasts as long as processes."""
    given = os.environ.get("XDG_RUNTIME_DIR")
    place = given or os.environ.get("TMPDIR") or "/tmp"
    folder = Path(place) / ("boulder-sweep" if given else f"boulder-sweep-{os.getuid()}")
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.is_symlink() or folder.stat().st_uid != os.getuid():
        raise OSError(errno.EPERM, f"{folder} is another user's")
    return folder


def check_target(target: Location, refusal: type[BoulderSweepError]) -> None:
    """Check that a file may be written at a location; readers would take one within a result for rows of it.

    Raise the refusal where its folder does not exist, cannot be written or holds the result of a run, or a folder has
    its name, and LinkError where a link has its name.
    """
    folder = target.absolute().parent if isinstance(target, Path) else target.parent
    if isinstance(target, Path) and not folder.is_dir():
        raise refusal(f"{target}: the folder {folder} does not exist")
    try:
        if part_files(names_in(folder)):
            raise refusal(f"{target}: the folder {folder} holds the result of a run; name a file outside it")
    except PermissionError:
        pass  # who may write there need not be allowed to read
    except OSError as problem:
        raise refusal(f"{target} cannot be written: {why(problem)}") from problem
    if not (isinstance(target, Path) and isinstance(folder, Path)):
        return
    if target.is_dir():
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EISDIR)}")
    try:
        is_there = is_file(target)
    except OSError as problem:
        raise refusal(f"{target} cannot be written: {problem.strerror}") from problem
    if not os.access(folder, os.W_OK | os.X_OK) or (is_there and not os.access(target, os.W_OK)):
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EACCES)}")
