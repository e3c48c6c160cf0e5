"""Small output folders for the tests of the store."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from boulder_sweep.collector import verdict_counts
from boulder_sweep.evaluation import evaluation_of
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.opening import open_output
from boulder_sweep.store.provenance import file_metadata, new_session
from boulder_sweep.store.schema import encode, part_table
from boulder_sweep.store.writer import OutputFolder
from tests.sweep.grids import grid, plausible

IDENTITY = {"settings": {"soil": 1}, "settings_sha256": "a" * 64, "versions": {"numba": "1"}}
ROWS, SIZE = 441, 100


def open_folder(out: Path, *, identity: dict[str, Any] = IDENTITY, rows: int = ROWS, **how: bool) -> OutputFolder:
    """Take a folder for a run of 441 rows in parts of 100."""
    manifest = Manifest(identity, rows, SIZE, "sweep run x.yaml --resume")
    return open_output(out, manifest, new_session("sweep run x.yaml", 2, "threading"), **how)


def part_bytes(first: int, rows: int) -> tuple[bytes, dict[str, int]]:
    """Bytes of a part, and how many rows have which verdict."""
    sweep = grid()
    block = sweep.block(first, first + rows)
    judged = evaluation_of(sweep, plausible)(block)
    return bytes(encode(part_table(block, judged, file_metadata(IDENTITY, "sweep run x.yaml")))), verdict_counts(judged)


def commit(folder: OutputFolder, first: int, rows: int | None = None) -> None:
    """Put a part into a folder."""
    rows = min(SIZE, ROWS - first) if rows is None else rows
    content, verdicts = part_bytes(first, rows)
    folder.commit(first, content, rows, verdicts)


def finished_folder(out: Path) -> Path:
    """Make a finished folder."""
    folder = open_folder(out)
    for first in range(0, ROWS, SIZE):
        commit(folder, first)
    folder.close("finished")
    return out
