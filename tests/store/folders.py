"""Small output folders for the tests of the store."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.store.files import MANIFEST_NAME
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.opening import claim_output
from boulder_sweep.store.provenance import file_metadata, identity, new_session
from boulder_sweep.store.schema import encode, part_table, verdict_counts
from boulder_sweep.store.writer import EncodedPart, OutputFolder
from tests.runner.grids import grid, plausible

IDENTITY = identity(
    grid().resolved(), *evaluation_of(grid(), accuracy_of(grid()), plausible).settings(), accuracy_of(grid()).to_dict()
)
ROWS, SIZE = 441, 100


def open_folder(
    out: Path,
    *,
    identity: dict[str, Any] = IDENTITY,
    rows: int = ROWS,
    resume_command: str = "sweep run x.yaml --resume",
    **how: bool,
) -> OutputFolder:
    """Take a folder for a run of 441 rows in parts of 100."""
    manifest = Manifest(identity, rows, SIZE, resume_command)
    claimed = claim_output(out, **how)
    try:
        return claimed.open(manifest, new_session("sweep run x.yaml", 2, "threading"))
    except BaseException:
        claimed.release()
        raise


def part_bytes(first: int, rows: int) -> tuple[bytes, dict[str, int]]:
    """Bytes of a part, and how many rows have which verdict."""
    sweep = grid()
    block = sweep.block(first, first + rows)
    judged = evaluation_of(sweep, accuracy_of(sweep), plausible)(block)
    return bytes(encode(part_table(block, judged, file_metadata(IDENTITY, "sweep run x.yaml")))), verdict_counts(judged)


def encoded_part(first: int, of: int | None = None) -> EncodedPart:
    """A part of 100 rows; with the content of those from another row on, if one is given."""
    content, verdicts = part_bytes(first if of is None else of, SIZE)
    return EncodedPart(first, SIZE, content, verdicts)


def commit(folder: OutputFolder, first: int, rows: int | None = None) -> None:
    """Put a part into a folder."""
    rows = min(SIZE, ROWS - first) if rows is None else rows
    content, verdicts = part_bytes(first, rows)
    folder.commit([folder.stage(EncodedPart(first, rows, content, verdicts))])


def finished_folder(out: Path) -> Path:
    """Make a finished folder."""
    folder = open_folder(out)
    for first in range(0, ROWS, SIZE):
        commit(folder, first)
    folder.close("finished")
    return out


def rewrite_records(out: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Write the manifest of a folder anew with other records, whole and with their checksum, as another version may."""
    path = out / MANIFEST_NAME
    schema = pq.read_schema(path)
    key = b"boulder_sweep.manifest"
    records = json.loads(schema.metadata[key][64:])
    change(records)
    text = json.dumps(records).encode()
    value = hashlib.sha256(text).hexdigest().encode() + text
    pq.write_table(schema.with_metadata({**schema.metadata, key: value}).empty_table(), path)


def part_record(records: dict[str, Any]) -> dict[str, Any]:
    """Return the record of the first part."""
    return next(iter(records["parts"].values()))


OTHER_FORMS: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "format": (lambda records: records.update(format=2), r"its format is 2, and this version knows 1"),
    "no format": (lambda records: records.pop("format"), r"do not say their format"),
    "part knows less": (lambda records: part_record(records).pop("verdicts"), r"parquet: verdicts is missing"),
    "part by other words": (
        lambda records: part_record(records).update(rows="all of them"),
        r"parquet: rows is 'all of them'",
    ),
    "session without a host": (
        lambda records: records["sessions"][0].pop("host"),
        r"the record of a run: host is missing",
    ),
    "sessions by name": (lambda records: records.update(sessions={}), r"the manifest: sessions is \{\}"),
    "no parts": (lambda records: records.pop("parts"), r"the manifest: parts is missing"),
    "other merge": (
        lambda records: records.update(merge={"name": "x", "part": 1, "replaced": []}),
        r"the record of a merge: part is 1",
    ),
}
"""What is not read: a change of the records, and how it is told."""
READABLE_FORMS: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "part knows more": (
        lambda records: part_record(records).update(colour="red"),
        r"the record of rows-\d+-\d+\.parquet: colour is unknown",
    ),
    "session knows more": (
        lambda records: records["sessions"][0].update(mood="good"),
        r"the record of a run: mood is unknown",
    ),
    "session knows less": (lambda records: records["sessions"][0].pop("how"), r"the record of a run: how is missing"),
    "no merge": (lambda records: records.pop("merge"), r"the manifest: merge is missing"),
}
"""What other versions may write and is read all the same, and how it is told where a run is to go on."""
