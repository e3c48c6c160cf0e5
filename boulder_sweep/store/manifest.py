"""The manifest of an output folder: which run it belongs to, which parts are finished, and who wrote them when.

It is the file ``_manifest.parquet``: the columns of the table, no rows, and the records as JSON in its
metadata. A reader that takes every file of the folder for a part (DuckDB, Polars) then finds no rows in it,
where any other kind of file would make it fail.

Records have exactly the form that `save` writes. Anything else is refused, never guessed at.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields
from itertools import pairwise
from typing import Any, get_args, get_origin, get_type_hints

from boulder_sweep.columns import COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.locations import Location
from boulder_sweep.settings.problems import shorten
from boulder_sweep.store import failures
from boulder_sweep.store.files import MANIFEST_NAME, hidden_name, part_name
from boulder_sweep.store.provenance import IDENTITY_KINDS, Session, other_version
from boulder_sweep.store.storage import Storage, storage_of

_KEY = b"boulder_sweep.manifest"
_MOST_ROWS = 2**63 - 1
_DEEPEST = 32
"""Most levels of nested records; a settings file has fewer than ten."""


@dataclass(frozen=True)
class Part:
    """A finished part of the table; its file never changes.

    Parameters
    ----------
    first, rows
        Number of its first row in the whole table, and its number of rows.
    bytes, sha256
        Size and checksum of its file.
    verdicts
        How many rows have each verdict and reason, keyed ``verdict/reason``, or ``verdict`` without one.
    written
        When, in ISO 8601.
    """

    first: int
    rows: int
    bytes: int
    sha256: str
    verdicts: dict[str, int]
    written: str

    @property
    def stop(self) -> int:
        """Number of the row after its last."""
        return self.first + self.rows


@dataclass(frozen=True)
class Merge:
    """Several parts about to be replaced by one with the same rows."""

    name: str
    part: Part
    replaced: list[str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its file, final or temporary, in the order to try: it may be renamed between the first two tries."""
        return self.name, hidden_name(self.name), self.name


@dataclass
class Manifest:
    """Everything known about an output folder apart from its rows.

    Parameters
    ----------
    identity
        What all rows of one table have in common, see `provenance`.
    rows
        Rows of the whole table.
    rows_per_part
        Rows of every part but the last.
    resume_command
        Command that resumes the run.
    parts
        Finished parts by file name.
    sessions
        Runs into this folder, oldest first.
    merge
        The merge under way, if any.
    """

    identity: dict[str, Any]
    rows: int
    rows_per_part: int
    resume_command: str
    parts: dict[str, Part] = field(default_factory=dict)
    sessions: list[Session] = field(default_factory=list)
    merge: Merge | None = None

    @property
    def rows_done(self) -> int:
        """Rows in finished parts."""
        return sum(part.rows for part in self.parts.values())

    @property
    def ranges(self) -> list[tuple[int, int]]:
        """Rows [first, stop) of the finished parts, in order."""
        return sorted((part.first, part.stop) for part in self.parts.values())

    @property
    def verdicts(self) -> dict[str, int]:
        """How many finished rows have each verdict and reason, keyed as in `Part`."""
        return total_verdicts(self.parts.values())

    def missing(self) -> Iterator[tuple[int, int]]:
        """Return the missing ranges [start, stop) of rows, in order, none across two parts."""
        start = 0
        for first, stop in [*self.ranges, (self.rows, self.rows)]:
            yield from parts_of(start, first, self.rows_per_part)
            start = stop

    def mergeable(self) -> list[list[str]]:
        """Return groups of names of parts, in order, that together make one full part of the table."""
        groups: dict[int, list[str]] = {}
        for name in sorted(self.parts, key=lambda name: self.parts[name].first):
            groups.setdefault(self.parts[name].first // self.rows_per_part, []).append(name)
        whole = []
        for number, names in groups.items():
            rows = min(self.rows_per_part, self.rows - number * self.rows_per_part)
            if len(names) > 1 and sum(self.parts[name].rows for name in names) == rows:
                whole.append(names)
        return whole

    @property
    def more_columns(self) -> tuple[str, ...]:
        """Names of the columns that not every table has: optional inputs, text of the settings."""
        settings = self.identity.get("settings")
        if not isinstance(settings, dict):
            return ()
        inputs = settings.get("inputs", {})
        return (*(name for name in OPTIONAL_COLUMNS if name in inputs), *settings.get("labels", ()))

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns, in order."""
        return (*(spec.name for spec in COLUMNS), *self.more_columns)


def total_verdicts(parts: Iterable[Part]) -> dict[str, int]:
    """Count the rows of each verdict and reason in several parts."""
    total: Counter[str] = Counter()
    for part in parts:
        total.update(part.verdicts)
    return dict(sorted(total.items()))


def parts_of(start: int, stop: int, size: int) -> Iterator[tuple[int, int]]:
    """Cut rows [start, stop) at the ends of parts, lazily."""
    while start < stop:
        end = min(start - start % size + size, stop)
        yield start, end
        start = end


def save(manifest: Manifest, storage: Storage) -> None:
    """Replace the manifest of a folder in one step.

    Raises
    ------
    OSError
        The previous one is unchanged then.
    FolderInUseError
        Another run has replaced it; on object stores only.
    """
    storage.put_manifest(lambda more: _encoded(manifest, more))


def _encoded(manifest: Manifest, more: Mapping[bytes, bytes]) -> memoryview:
    """Return the bytes of the file of a manifest, with some more metadata."""
    import pyarrow as pa  # heavy, and only runs need it
    import pyarrow.parquet as pq

    from boulder_sweep.store.schema import table_schema

    text = json.dumps(asdict(manifest), separators=(",", ":"))
    value = hashlib.sha256(text.encode()).hexdigest() + text
    schema = table_schema({_KEY: value.encode(), **more}, manifest.more_columns)
    sink = pa.BufferOutputStream()
    with pq.ParquetWriter(sink, schema):
        pass  # columns, and no rows
    return memoryview(sink.getvalue())


def load(folder: Location) -> Manifest:
    """Read the manifest of a folder.

    Raises
    ------
    NotASweepError
        There is none.
    DamagedError
        It cannot be trusted.
    ImpossibleRecordsError
        It is intact, but no sweep writes such names and numbers.
    OtherVersionError
        It is intact, but of another format.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = folder / MANIFEST_NAME
    try:
        with storage_of(folder).open_manifest() as file:  # pyarrow takes no names that are not Unicode
            footer = pq.read_metadata(file)
    except (FileNotFoundError, NotADirectoryError):
        raise failures.NotASweepError(_no_result(folder)) from None
    except (OSError, pa.ArrowException) as problem:
        raise failures.DamagedError(f"{path} cannot be read: {problem}") from problem
    except ValueError as problem:  # a name of a column that is no text
        raise failures.ImpossibleRecordsError(path, str(problem)) from None
    value = (footer.metadata or {}).get(_KEY, b"")
    checksum, text = value[:64], value[64:]
    if hashlib.sha256(text).hexdigest().encode() != checksum:
        raise failures.DamagedError(
            f"{path} is damaged: its checksum does not match. The parts beside it can still be read as a "
            f"table, but no run can resume from them"
        )
    try:
        content = json.loads(text)
        if _is_deep(content):
            raise ValueError("its records are nested too deeply")
        if said := other_version(content.get("identity") if isinstance(content, dict) else None):
            raise failures.OtherVersionError(folder, said)
        manifest = _from_json(content)
        _check_claims(path, manifest)
        if {*footer.schema.names} != {*manifest.columns}:
            raise ValueError("its columns do not follow from its settings")
        return manifest
    except (ValueError, RecursionError) as problem:
        raise failures.ImpossibleRecordsError(path, str(problem)) from None


def _check_claims(path: Location, manifest: Manifest) -> None:
    """Check every name and number of a manifest, before any is used: the folder may be a stranger's.

    Raises
    ------
    ImpossibleRecordsError
        One is impossible.
    """
    rows, size, parts, merge = manifest.rows, manifest.rows_per_part, manifest.parts, manifest.merge
    if not (0 <= rows <= _MOST_ROWS and 1 <= size <= _MOST_ROWS):
        raise failures.ImpossibleRecordsError(path, f"a table of {rows} rows in parts of {size}")
    for name, part in (*parts.items(), *([] if merge is None else [(merge.name, merge.part)])):
        within = 0 <= part.first < part.stop <= rows and part.first // size == (part.stop - 1) // size
        if not within or name != part_name(part.first, part.stop, rows):  # more zeros would sort otherwise
            raise failures.ImpossibleRecordsError(
                path, f"{name:.60} with the rows {part.first} to {part.stop} of {rows}"
            )
        if part.bytes < 1 or not all(type(count) is int and count >= 0 for count in part.verdicts.values()):
            raise failures.ImpossibleRecordsError(path, f"{name} with impossible counts")
    for (_, stop), (first, _) in pairwise(manifest.ranges):
        if first < stop:
            raise failures.ImpossibleRecordsError(path, f"row {first} twice")
    if merge is not None:
        if not all(isinstance(name, str) and name in parts for name in merge.replaced) or merge.name in parts:
            raise failures.ImpossibleRecordsError(path, "a merge of parts that it does not have")
        edges = sorted(edge for name in merge.replaced for edge in (parts[name].first, parts[name].stop))
        # Neighbours share an edge, each of which is there twice, and the ends are those of the merged part.
        ends = [merge.part.first, merge.part.stop]
        if [*edges[:1], *edges[-1:]] != ends or edges[1:-1:2] != edges[2:-1:2]:
            raise failures.ImpossibleRecordsError(path, "a merge of other rows than it replaces")
    _check_kinds(path, "identity", manifest.identity, IDENTITY_KINDS)


def _no_result(folder: Location) -> str:
    """Describe why a path holds no result."""
    if not folder.exists():
        return f"there is no {folder}; the result of a run is a folder, such as m30-sizing.sweep"
    if folder.is_dir():
        return f"{folder} is not the result of a sweep (no {MANIFEST_NAME})"
    if advice := failures.settings_file(folder):
        return advice
    around = folder.resolve().parent
    advice = "; `sweep report`, `plot`, `export` and `compare` take a file of answers"
    if (around / MANIFEST_NAME).exists():
        advice = f": name the folder it lies in, {around}"
    elif folder.suffix.lower() != ".parquet":
        advice = ""
    return f"{folder} is a file; the result of a run is a folder{advice}"


def _from_json(content: Any) -> Manifest:
    """Rebuild a manifest from its JSON.

    Raises
    ------
    ValueError
        It is not what `save` writes; the text says where.
    """
    entries = _entries_of(Manifest, "the manifest", content)
    entries["parts"] = {name: _part(name, record) for name, record in entries["parts"].items()}
    entries["sessions"] = [Session(**_entries_of(Session, "the record of a run", one)) for one in entries["sessions"]]
    if entries["merge"] is not None:
        merge = _entries_of(Merge, "the record of a merge", entries["merge"])
        entries["merge"] = Merge(**{**merge, "part": _part(merge["name"], merge["part"])})
    return Manifest(**entries)


def _part(name: str, record: Any) -> Part:
    return Part(**_entries_of(Part, f"the record of {shorten(name)}", record))


def _entries_of(record: type, what: str, content: Any) -> dict[str, Any]:
    """Return the entries of a record; its dataclass must have the same ones, with values of these types.

    `what` describes the record, for the message. Nested records are not checked.

    Raises
    ------
    ValueError
        An entry is missing, unknown or of another type; the text says which.
    """
    if not isinstance(content, dict):
        raise ValueError(f"{what} has no named entries")
    types = get_type_hints(record)
    expected = {entry.name for entry in fields(record)}
    wrong = [f"{name} is missing" for name in sorted(expected - content.keys())]
    wrong += [f"{shorten(name)} is unknown" for name in sorted(content.keys() - expected)]
    wrong += [
        f"{name} is {content[name]!r:.60}"
        for name in sorted(expected & content.keys())
        if not _fits(content[name], types[name])
    ]
    if wrong:
        raise ValueError(f"{what}: {', '.join(wrong)}")
    return content


def _is_deep(content: Any) -> bool:
    """Whether records are nested so deeply that functions that call themselves could fail."""
    level = [content]
    for _ in range(_DEEPEST):
        nested = [one.values() if isinstance(one, dict) else one for one in level if isinstance(one, dict | list)]
        level = [value for values in nested for value in values]
    return bool(level)


def _check_kinds(path: Location, what: str, content: Any, kinds: Any) -> None:
    """Check the kinds of those nested entries that are looked at by name.

    Raises
    ------
    ImpossibleRecordsError
        One is of another kind.
    """
    if isinstance(kinds, type):
        if not isinstance(content, kinds):
            raise failures.ImpossibleRecordsError(path, f"{what} that is {type(content).__name__}")
        return
    _check_kinds(path, what, content, dict)
    for name in kinds.keys() & content.keys():
        _check_kinds(path, f"{what}.{name}", content[name], kinds[name])


def _fits(value: Any, type_: Any) -> bool:
    """Whether a value from a JSON file has the annotated type; contents of lists are not checked."""
    if type_ is type(None):
        return value is None
    kinds = get_args(type_) if get_origin(type_) not in (dict, list) else ()
    if kinds:
        return any(_fits(value, kind) for kind in kinds)
    kind = get_origin(type_) or type_
    if kind is int and isinstance(value, bool):
        return False
    return isinstance(value, kind if kind in (str, int, dict, list) else dict)
