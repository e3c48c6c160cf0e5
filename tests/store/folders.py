"""Small results for the tests of the store, and ways to change what their parts say."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.runner.run import run
from boulder_sweep.store.folder import PartFile, hash_of, hidden_folder, part_file, part_files
from boulder_sweep.store.part import encode
from boulder_sweep.store.provenance import PREFIX, canonical, identity
from boulder_sweep.store.reading import contents
from tests.runner.grids import grid, plausible

IDENTITY = identity(
    grid().resolved(), *evaluation_of(grid(), accuracy_of(grid()), plausible).settings(), accuracy_of(grid()).to_dict()
)
ROWS, PARTS = 441, 4


def finished_folder(out: Path) -> Path:
    """Make a finished folder of four parts."""
    run(grid(), out, jobs=1, simulate=plausible)
    return out


def parts_of(out: Path) -> dict[str, bytes]:
    """Return all files of a folder by their names."""
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def part_of(out: Path, which: int = 0) -> PartFile:
    """Return the name of a part, in what it says."""
    return part_files([path.name for path in out.iterdir()])[which]


def rows_done(out: Path) -> int:
    """Return how many rows of a folder are in intact parts, none of which is damaged; nothing else may be there."""
    if not out.exists():
        return 0
    assert all(part_file(path.name) for path in out.iterdir())
    found = contents(out)
    assert not found.damaged
    return sum(part.stop - part.first for part in found.intact)


def nothing_left(out: Path) -> bool:
    """Whether a run has left nothing but parts."""
    names = [path.name for path in out.iterdir()] if out.exists() else []
    return not hidden_folder(out).exists() and all(map(part_file, names))


def rewrite(out: Path, change: Callable[[dict[str, Any]], object], which: int = 0) -> Path:
    """Let a part say something else of itself, under the name that then is right; return its path."""
    part = part_of(out, which)
    table = pq.read_table(out / part.name)
    plain = {key.decode().removeprefix(PREFIX): value.decode() for key, value in table.schema.metadata.items()}
    texts = {"settings_sha256", "kernels_sha256", "rules_sha256", "PANDAS_ATTRS"}
    said = {key: value if key in texts else json.loads(value) for key, value in plain.items()}
    change(said)
    metadata = {
        (key if key == "PANDAS_ATTRS" else f"{PREFIX}{key}").encode(): (
            value if isinstance(value, str) else canonical(value)
        ).encode(errors="backslashreplace")
        for key, value in said.items()
    }
    (out / part.name).unlink()
    return put(out, part, table.replace_schema_metadata(metadata))


def put(out: Path, part: PartFile, table: pa.Table) -> Path:
    """Write a table as a part of some rows, under the right name."""
    content = encode(table)
    path = out / part._replace(hash=hash_of(content)).name
    path.write_bytes(content)
    return path


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
