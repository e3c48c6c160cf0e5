"""What a worker of a cluster does with a task: compute, encode and stage some rows, part by part."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from boulder_sweep.errors import BackendError
from boulder_sweep.locations import location_of
from boulder_sweep.runner.computing import Computation, EncodedPart
from boulder_sweep.runner.estimate import blocks
from boulder_sweep.store.lock import LOCK_NAME
from boulder_sweep.store.storage import storage_of
from boulder_sweep.store.writer import StagedPart, stage
from boulder_sweep.text import one_line

Fingerprint = tuple[dict[str, str], str, str]
_prepared: set[str] = set()
_preparing = threading.Lock()
"""Which runs this process, a worker, is ready for."""


@dataclass(frozen=True)
class Work:
    """What every task of a run has in common; sent to the cluster once."""

    name: str
    """The token of the run, see `OutputFolder`."""
    computation: Computation
    rows_per_block: int
    rows_per_part: int
    folder: str
    table_rows: int
    fingerprint: Fingerprint


class Done(NamedTuple):
    """What a worker returns."""

    staged: list[StagedPart]
    relayed: list[EncodedPart]


def fingerprint() -> Fingerprint:
    """Return versions and hashes of the code that computes here."""
    from boulder_sweep.store.provenance import kernels_sha256, rules_sha256, versions

    return versions(), kernels_sha256(), rules_sha256()


def check_fingerprints(found: Mapping[str, Any]) -> None:
    """Refuse workers whose rows could differ from those of this machine; one that leaves meanwhile does not matter.

    Parameters
    ----------
    found
        What every worker has answered to `fingerprint`, or the exception.

    Raises
    ------
    BackendError
        Names them.
    """
    here, different = fingerprint(), []
    for address, there in found.items():
        if isinstance(there, Exception):
            if not isinstance(there, OSError):
                raise BackendError(f"the worker {address} cannot compute: {one_line(there)}")
        elif tuple(there) != here:
            different.append(address)
    if different:
        raise BackendError(other_versions_text(f"the workers {', '.join(different)}"))


def received(work: Work) -> Work:
    """Hold the work on a worker, from which the others fetch it; repeated if that worker is lost."""
    return work


def compute(work: Work, start: int, stop: int, relayed: bool) -> Done:
    """Compute, encode and stage some rows on a worker, part by part."""
    prepare(work)
    folder = location_of(work.folder)
    done = Done([], [])
    if not relayed and not (folder / LOCK_NAME).exists():
        return done
    storage = storage_of(folder)
    for begin, end in parts_of(start, stop, work.rows_per_part):
        pieces = [work.computation.judged(*rows) for rows in blocks(iter([(begin, end)]), work.rows_per_block)]
        part = work.computation.encoded(begin, pieces)
        if relayed:
            done.relayed.append(part._replace(content=bytes(part.content)))
        elif not (folder / LOCK_NAME).exists():  # this worker hung, and the run has ended without it
            break
        else:
            staged = stage(storage, work.name, work.table_rows, part.first, part.content, part.rows, part.verdicts)
            done.staged.append(staged)
    return done


def prepare(work: Work) -> None:
    """Compare versions and load or compile the kernels, once in the process of a worker.

    Raises
    ------
    BackendError
        Rows computed here could differ from those of the others.
    """
    with _preparing:
        if work.name not in _prepared:
            if fingerprint() != work.fingerprint:
                raise BackendError(other_versions_text("a worker"))
            work.computation.warm_up()
            _prepared.add(work.name)


def parts_of(start: int, stop: int, size: int) -> list[tuple[int, int]]:
    """Cut rows [start, stop) at the ends of parts."""
    ends = [*range(start - start % size + size, stop, size), stop]
    return list(zip([start, *ends[:-1]], ends, strict=True))


def other_versions_text(who: str) -> str:
    """Say that versions differ."""
    return (
        f"{who} and this machine have different versions of boulder-sweep, Python or NumPy, or processors that differ "
        f"in the last bits (with and without fused multiply-add); install the same versions everywhere, on processors "
        f"of one kind"
    )
