"""The manifest of an output folder: which run it belongs to, which parts are finished, and who wrote them when.

It is the file ``_manifest.parquet``: the columns of the table, no rows, and the records as JSON in its
metadata. A reader that takes every file of the folder for a part (DuckDB, Polars) then finds no rows in it,
where any other kind of file would make it fail.

Records have the form that this version knows. An entry that another version has more is left out, and one that was
added since may be missing; both are noted, and no run goes on there. Anything else is refused, never guessed at.
docs/formats.md says what may change between versions.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from itertools import pairwise
from typing import Any, get_args, get_origin, get_type_hints

from boulder_sweep.columns import COLUMNS, DESIGN_ID, INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.locations import Location
from boulder_sweep.settings.problems import shorten
from boulder_sweep.store import failures
from boulder_sweep.store.files import MANIFEST_NAME, PART_SUFFIX, hidden_name, part_name
from boulder_sweep.store.provenance import IDENTITY_KINDS, Session
from boulder_sweep.store.storage import Storage, storage_of

_KEY = b"boulder_sweep.manifest"
_FORMAT = 1
"""Of tables, apart from the version of the package: docs/formats.md says when it must grow."""
_IN_EVERY_TABLE = frozenset({DESIGN_ID.name, *INPUT_COLUMNS, "verdict", "reason"})
_MOST_ROWS = 2**63 - 1
_LONGEST_REASON = 200
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
    columns
        Names of the columns that are stored; of a manifest that was read.
    differing
        What another version wrote otherwise: such a table can be read, but no run goes on there.
    """

    identity: dict[str, Any]
    rows: int
    rows_per_part: int
    resume_command: str
    parts: dict[str, Part] = field(default_factory=dict)
    sessions: list[Session] = field(default_factory=list)
    merge: Merge | None = None
    columns: tuple[str, ...] = field(default=(), compare=False)
    differing: list[str] = field(default_factory=list, compare=False)

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

    records = {name: value for name, value in asdict(manifest).items() if name not in ("columns", "differing")}
    text = json.dumps({"format": _FORMAT, **records}, separators=(",", ":"))
    value = hashlib.sha256(text.encode()).hexdigest() + text
    schema = table_schema({_KEY: value.encode(), **more}, manifest.more_columns)
    sink = pa.BufferOutputStream()
    with pq.ParquetWriter(sink, schema):
        pass  # columns, and no rows
    return memoryview(sink.getvalue())


def load(folder: Location) -> Manifest:
    """Read the manifest of a folder, by whichever version it was written.

    Raises
    ------
    NotASweepError
        There is none.
    DamagedError
        It cannot be trusted.
    ImpossibleRecordsError
        It is intact, but no sweep writes such names and numbers.
    OtherVersionError
        It is intact, but of a format that this version does not know.
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
    except (ValueError, RecursionError) as problem:
        raise failures.ImpossibleRecordsError(path, str(problem)) from None
    try:
        manifest = _from_json(content)
        _check_claims(path, manifest)
        manifest.columns = tuple(footer.schema.names)
        manifest.differing = [*_differing_columns(manifest), *manifest.differing]
        return manifest
    except ValueError as unfamiliar:
        version = _version_of(content)
        why = shorten(str(unfamiliar), _LONGEST_REASON)
        raise failures.OtherVersionError(path, why, None if version is None else shorten(version)) from None


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
        expected = part_name(part.first, part.stop, rows) if within else ""
        # The first tables named the first row only. More zeros would sort otherwise than the rows do.
        if not within or name not in (expected, expected.rpartition("-")[0] + PART_SUFFIX):
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


def check_resumable(manifest: Manifest, folder: Location) -> None:
    """Check that a run of this version may go on with a table.

    Raises
    ------
    OtherVersionError
        Another version wrote it, with other columns or records.
    """
    if manifest.differing:
        why = "; ".join(manifest.differing[:3]) + ("; ..." if len(manifest.differing) > 3 else "")
        raise failures.OtherVersionError(
            folder / MANIFEST_NAME, shorten(why, 300), _version_of({"identity": manifest.identity})
        )


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


def _differing_columns(manifest: Manifest) -> list[str]:
    """Say which columns a table has more or less than today.

    Raises
    ------
    ValueError
        It lacks one that every version has.
    """
    there, expected = set(manifest.columns), {*(spec.name for spec in COLUMNS), *manifest.more_columns}
    lacking = expected - there
    if lacking & _IN_EVERY_TABLE:
        raise ValueError(f"its table lacks columns: {', '.join(sorted(lacking & _IN_EVERY_TABLE))}")
    differing = ((lacking, "lacks"), (there - expected, "also has"))
    return [f"its table {verb} {', '.join(sorted(names))}" for names, verb in differing if names]


def _from_json(content: Any) -> Manifest:
    """Rebuild a manifest from its JSON.

    Raises
    ------
    ValueError
        It is not what `save` writes; the text says where.
    """
    if not isinstance(content, dict) or "format" not in content:
        raise ValueError("its records do not say their format")
    if content["format"] != _FORMAT:
        raise ValueError(f"its format is {content['format']}, and this version knows {_FORMAT} only")
    differing: list[str] = []
    known = {key: value for key, value in content.items() if key != "format"}
    entries = _entries_of(Manifest, "the manifest", known, differing)
    entries["parts"] = {name: _part(name, record, differing) for name, record in entries["parts"].items()}
    runs = [_entries_of(Session, "the record of a run", record, differing) for record in entries["sessions"]]
    entries["sessions"] = [Session(**run) for run in runs]
    if entries.get("merge") is not None:
        merge = _entries_of(Merge, "the record of a merge", entries["merge"], differing)
        entries["merge"] = Merge(**{**merge, "part": _part(merge["name"], merge["part"], differing)})
    return Manifest(**entries, differing=differing)


def _part(name: str, record: Any, differing: list[str]) -> Part:
    """Rebuild the record of a part; the first tables kept the size of a file, which could still grow, apart."""
    if isinstance(record, dict) and isinstance(record.get("now"), dict):
        record = {**record, **record["now"]}
    return Part(**_entries_of(Part, f"the record of {shorten(name)}", record, differing))


def _entries_of(record: type, what: str, content: Any, differing: list[str]) -> dict[str, Any]:
    """Return the known entries of a record, if all that its dataclass needs are there, with values of the right type.

    `what` describes the record, for the message. Nested records are not checked. What another version wrote otherwise
    is added to the lines `differing`: entries that are unknown, or missing though they have a default.

    Raises
    ------
    ValueError
        An entry without a default is missing, or one is of another type; the text says which.
    """
    if not isinstance(content, dict):
        raise ValueError(f"{what} has no named entries")
    types = get_type_hints(record)
    expected = {entry.name for entry in fields(record) if entry.compare}
    needed = {entry.name for entry in fields(record) if entry.default is MISSING} & expected
    wrong = [f"{name} is missing" for name in sorted(needed - content.keys())]
    wrong += [
        f"{name} is {content[name]!r:.60}"
        for name in sorted(expected & content.keys())
        if not _fits(content[name], types[name])
    ]
    if wrong:
        raise ValueError(f"{what}: {', '.join(wrong)}")
    differing += [f"{what}: {name} is unknown" for name in sorted(content.keys() - expected)]
    differing += [f"{what}: {name} is missing" for name in sorted(expected - needed - content.keys())]
    return {name: value for name, value in content.items() if name in expected}


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


def _version_of(content: Any) -> str | None:
    """Return the version of boulder-sweep that wrote the records of a manifest; None if it is not recorded."""
    for key in ("identity", "versions", "boulder-sweep"):
        content = content.get(key) if isinstance(content, dict) else None
    return content if isinstance(content, str) else None


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
