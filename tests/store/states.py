"""How far a run into a folder got, as tests ask for it."""

from __future__ import annotations

import fcntl
import os
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from boulder_sweep.locations import Location, RemotePath, location_of
from boulder_sweep.store.files import LOCK_NAME
from boulder_sweep.store.lock import _is_alive, _record
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.verify import load_checked


@dataclass
class State:
    """The manifest of a folder with its undamaged parts, and what is wrong with the others."""

    folder: Location
    manifest: Manifest
    damaged: dict[str, str]

    def __getattr__(self, name: str):
        return getattr(self.manifest, name)

    @property
    def parts(self) -> int:
        """Number of undamaged parts."""
        return len(self.manifest.parts)

    @property
    def complete(self) -> bool:
        """Whether all rows are there."""
        return self.manifest.rows_done == self.manifest.rows

    @property
    def missing(self) -> list[tuple[int, int]]:
        """Missing ranges [start, stop) of rows, neighbours joined."""
        edges = pairwise([0, *(edge for rows in self.manifest.ranges for edge in rows), self.manifest.rows])
        return [(start, stop) for start, stop in list(edges)[::2] if start < stop]

    @property
    def running(self) -> bool:
        """Whether a run holds the folder."""
        return is_locked(self.folder)


def status(out: str | Path, *, verify: bool = False) -> State:
    """Look at a folder, with `verify` at every byte; nothing is changed."""
    folder = location_of(out)
    return State(folder, *load_checked(folder, read_parts=verify))


def is_locked(folder: Location) -> bool:
    """Whether a run seems to be writing into a folder."""
    if isinstance(folder, RemotePath):
        there = _record(folder / LOCK_NAME)
        return there is not None and _is_alive(there)
    try:
        descriptor = os.open(folder / LOCK_NAME, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        pass
    finally:
        os.close(descriptor)
    return False
