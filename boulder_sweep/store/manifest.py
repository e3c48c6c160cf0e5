"""The manifest of an output folder: what run it is, which parts are finished, and who wrote them when.

It is the file ``_manifest.parquet``: the columns of the table, no rows, and the records as JSON in its
metadata. A reader that takes every file of the folder as a part (DuckDB, Polars) then finds nothing in it,
where any other kind of file would make it fail.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from .errors import DamagedError, NotASweepError
from .files import WRITING_SUFFIX, put_file
from .lock import LOCK_NAME

MANIFEST_NAME = "_manifest.parquet"
_KEY = b"boulder_sweep.manifest"
_FORMAT = 1
_PART_PREFIX, _PART_SUFFIX = "rows-", ".parquet"
_DIGITS = 12


@dataclass(frozen=True)
class Version:
    """One state of a part on the disk."""

    rows: int
    bytes: int
    sha256: str


@dataclass(frozen=True)
class Part:
    """A part of the table as it was last written.

    Parameters
    ----------
    first
        Row number of its first row in the whole table.
    now
        What its file is.
    verdicts
        How many rows have each verdict and reason, keyed ``verdict/reason``.
    written
        When, in ISO 8601.
    before
        What its file still is if the run was killed between announcing `now` and replacing the file.
    """

    first: int
    now: Version
    verdicts: dict[str, int]
    written: str
    before: Version | None = None
    verdicts_before: dict[str, int] | None = None


@dataclass
class Session:
    """One run into the folder: the first, or one that went on."""

    started: str
    host: str
    pid: int
    cpu: str
    jobs: int
    backend: str
    command: str
    ended: str | None = None
    how: str | None = None
    """How it ended: ``finished``, or what stopped it; None while it runs, and for ever if it was killed."""


@dataclass
class Manifest:
    """All that is known about an output folder beside its rows.

    Parameters
    ----------
    identity
        What must be equal for rows to belong to one table, see `provenance`.
    rows
        Rows of the whole table.
    rows_per_part
        Rows of every part but the last.
    resume_command
        Command that goes on with the run.
    parts
        Finished parts by file name.
    sessions
        Runs into this folder, oldest first.
    """

    identity: dict[str, Any]
    rows: int
    rows_per_part: int
    resume_command: str
    parts: dict[str, Part] = field(default_factory=dict)
    sessions: list[Session] = field(default_factory=list)

    @property
    def part_count(self) -> int:
        """How many parts the whole table has."""
        return -(-self.rows // self.rows_per_part)

    @property
    def rows_done(self) -> int:
        """Rows in finished parts."""
        return sum(part.now.rows for part in self.parts.values())

    @property
    def verdicts(self) -> dict[str, int]:
        """How many finished rows have each verdict and reason, keyed ``verdict/reason``."""
        total: dict[str, int] = {}
        for part in self.parts.values():
            for key, count in part.verdicts.items():
                total[key] = total.get(key, 0) + count
        return dict(sorted(total.items()))

    def missing(self) -> Iterator[tuple[int, int]]:
        """Yield the ranges [start, stop) of rows that are not there, in order, none across two parts."""
        for first in range(0, self.rows, self.rows_per_part):
            part = self.parts.get(self.part_name(first))
            start = first + (part.now.rows if part else 0)
            stop = min(first + self.rows_per_part, self.rows)
            if start < stop:
                yield start, stop

    def part_name(self, first: int) -> str:
        """Return the file name of the part that begins with a row; names sort as the rows do."""
        digits = max(_DIGITS, len(str(self.rows)))
        return f"{_PART_PREFIX}{first:0{digits}d}{_PART_SUFFIX}"


def is_ours(name: str) -> bool:
    """Whether a sweep gives its files such a name, passing names included."""
    if name.endswith(WRITING_SUFFIX):
        return name.startswith("_") and is_ours(name[1 : -len(WRITING_SUFFIX)])
    middle = name.removeprefix(_PART_PREFIX).removesuffix(_PART_SUFFIX)
    is_part = name == f"{_PART_PREFIX}{middle}{_PART_SUFFIX}" and middle.isdigit() and len(middle) >= _DIGITS
    return is_part or name in (MANIFEST_NAME, LOCK_NAME)


def is_part_name(name: str) -> bool:
    """Whether a file name is that of a part."""
    return is_ours(name) and name.startswith(_PART_PREFIX)


def save(manifest: Manifest, folder: Path) -> None:
    """Replace the manifest of a folder in one step.

    Raises
    ------
    OSError
        The one before is still there then.
    """
    import pyarrow as pa  # heavy, and only runs need it
    import pyarrow.parquet as pq

    from .schema import table_schema

    text = json.dumps({"format": _FORMAT, **asdict(manifest)}, separators=(",", ":"))
    value = hashlib.sha256(text.encode()).hexdigest() + text
    schema = table_schema({_KEY: value.encode()})
    sink = pa.BufferOutputStream()
    pq.write_table(schema.empty_table(), sink)
    put_file(folder, MANIFEST_NAME, memoryview(sink.getvalue()))


def load(folder: Path) -> Manifest:
    """Read the manifest of a folder.

    Raises
    ------
    NotASweepError
        There is none.
    DamagedError
        It cannot be trusted.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = folder / MANIFEST_NAME
    try:
        metadata = pq.read_metadata(path).metadata or {}
    except FileNotFoundError:
        raise NotASweepError(f"{folder} holds no result of a sweep (no {MANIFEST_NAME})") from None
    except (OSError, pa.ArrowException) as problem:
        raise DamagedError(f"{path} cannot be read: {problem}") from problem
    value = metadata.get(_KEY, b"")
    checksum, text = value[:64], value[64:]
    if hashlib.sha256(text).hexdigest().encode() != checksum:
        raise DamagedError(
            f"{path} is damaged: its checksum does not fit. The parts beside it can still be read as a "
            f"table, but no run can go on with them"
        )
    content = json.loads(text)
    if content.pop("format") != _FORMAT:
        raise DamagedError(f"{path} was written by another version of boulder-sweep")
    content["parts"] = {name: _part(record) for name, record in content["parts"].items()}
    content["sessions"] = [Session(**record) for record in content["sessions"]]
    return Manifest(**content)


def _part(record: dict[str, Any]) -> Part:
    """Rebuild a part from its JSON."""
    before = record.pop("before")
    now = record.pop("now")
    return Part(now=Version(**now), before=Version(**before) if before else None, **record)
