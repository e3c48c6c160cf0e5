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
from boulder_sweep.store.provenance import file_metadata, identity, new_session
from boulder_sweep.store.schema import encode, part_table, verdict_counts
from boulder_sweep.store.writer import EncodedPart, OutputFolder, claim_output
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
    """Write the manifest of a folder anew with other records, whole and with their checksum."""
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


OTHER_VERSIONS: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "earlier": (
        lambda identity: (identity.pop("format"), identity["versions"].update({"boulder-sweep": "0.2.0"})),
        "was written by boulder-sweep 0.2.0 in another format than this version, {}, reads: run it again, or use the "
        "version that wrote it",
    ),
    "later": (
        lambda identity: identity.update(format=99, versions={"boulder-sweep": "7.8.9"}),
        "was written by boulder-sweep 7.8.9 in another format than this version, {}, reads: run it again, or use the "
        "version that wrote it",
    ),
    **{
        f"unknown, {name}": (
            change,
            "was written by an unknown version of boulder-sweep in another format than this version, {}, reads: run "
            "it again",
        )
        for name, change in {
            "from a source tree": lambda identity: identity.update(format=1, versions={"boulder-sweep": "unknown"}),
            "not recorded": lambda identity: identity.update(format=1, versions={}),
        }.items()
    },
    "of a long name": (
        lambda identity: identity.update(format=1, versions={"boulder-sweep": "9\n" * 10**5}),
        "was written by boulder-sweep 9 9 9 9 9 ",
    ),
}
"""Changes of an identity, and how the result is refused; a place for this version."""
