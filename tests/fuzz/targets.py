"""What is fuzzed: the readers of files that nobody vouches for, and what must hold for each input.

A reader may refuse an input in words, as an error of the project. Whatever else it raises is a mistake, and so are a
warning of a library and a text that names an exception of Python.
"""

from __future__ import annotations

import io
import json
import random
import re
import struct
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import boulder_sweep
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.errors import BoulderSweepError, OlderRulesWarning, ReportError
from boulder_sweep.report.answers import answer_of, screens
from boulder_sweep.report.comparison import compare
from boulder_sweep.report.export import export
from boulder_sweep.report.rows import read_rows
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.loader import decode
from boulder_sweep.settings.problems import MAX_REPORTED, Position, Problems
from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.settings.tables import read_designs
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.stones.reading import READERS, read_scan
from boulder_sweep.stones.solid import solid_of
from boulder_sweep.store.provenance import settings_sha256
from boulder_sweep.views.log_text import log_lines
from tests.answers.designs import bare_need, site

CORPUS = Path(__file__).parents[1] / "corpus"
FOLDER = tempfile.TemporaryDirectory(prefix="boulder-sweep-fuzz-")
HERE = Path(FOLDER.name)
INNER_WORDS = re.compile(r"\b\w*(?:Error|Exception|Warning|Interrupt)\b|Traceback|\bNoneType\b|\bnumpy\b|object at 0x")
MOST_CHARACTERS = 1000
"""Longest line of a refusal."""

Mutate = Callable[[bytes, int], bytes]
"""Changes some bytes, up to a largest size: the fuzzer's own way."""


def is_refused(data: bytes, read: Callable[[], object]) -> bool:
    """Read an input and say whether it was refused; fail if it was not in words, or something else was raised."""
    refusal = ""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            read()
        except BoulderSweepError as refused:
            refusal = str(refused) or "nothing"
    others = [one for one in said if not issubclass(one.category, OlderRulesWarning)]
    assert not others, f"warning: {others[0].message} ({others[0].filename}:{others[0].lineno})"
    lines = refusal.split("\n")
    assert len(lines) <= MAX_REPORTED + 1
    for line in lines if refusal else ():
        assert line.isprintable(), line
        assert 10 < len(line) <= MOST_CHARACTERS, line
        assert not [word for word in INNER_WORDS.findall(line) if word.encode() not in data], line
    return bool(refusal)


# --- Scans ---


def least_faces(kind: str, data: bytes) -> int:
    """Return how many faces a file has at least, counted in another way than by its reader."""
    if kind == ".stl" and len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return (len(data) - 84) // 50
    if kind == ".ply":
        return max(map(int, re.findall(rb"[\r\n][ \t]*element[ \t]+face[ \t]+(\d+)", data)), default=0)
    if kind == ".obj" and b"\\" in data:  # lines that go on
        return 1
    return len(re.findall({".stl": rb"(?mi)^[ \t]*endfacet\b", ".obj": rb"(?m)^[ \t]*fo?[ \t]"}.get(kind, rb"^"), data))


def scans(data: bytes) -> bool:
    """Read a scan as each format, close it and weigh it; say whether one of them did."""
    refused = True
    for kind in READERS:
        path = HERE / f"scan{kind}"
        path.write_bytes(data)
        refused &= is_refused(data, partial(check_scan, path, data))
    return not refused


def check_scan(path: Path, data: bytes) -> None:
    """Read a scan and compare it with what its bytes say."""
    surface = read_scan(path)
    assert np.isfinite(surface.vertices).all()
    assert surface.faces.min() >= 0
    assert surface.faces.max() < len(surface.vertices)
    assert len(surface.faces) >= least_faces(path.suffix, data)
    solid = solid_of(surface)
    assert 0.0 < solid.volume < np.prod(np.ptp(surface.vertices, axis=0)) * (1.0 + 1e-9)


def changed_scan(data: bytes, most: int, mutate: Mutate, chance: random.Random) -> bytes:
    """Change the description in a GLB file entry by entry; other files byte by byte."""
    if data[:4] == b"glTF" and len(data) >= 20 and chance.random() < 0.7:
        length = struct.unpack_from("<I", data, 12)[0]
        try:
            header = json.loads(data[20 : 20 + length])
        except (ValueError, RecursionError):
            return mutate(data, most)
        change_one(header, chance)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        rest = data[20 + length :]
        return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest
    return mutate(data, most)


# --- Lists of designs ---

TABLES = (".csv", ".xlsx", ".parquet")


def designs(data: bytes) -> bool:
    """Read a list of designs as each kind of table; say whether one of them could be."""
    refused = True
    for kind in TABLES:
        path = HERE / f"designs{kind}"
        path.write_bytes(data)
        refused &= is_refused(data, partial(check_designs, path.name))
    return not refused


def check_designs(name: str) -> None:
    """Read a list of designs; every design has a number in every column, and a word under every label."""
    problems = Problems()
    found = read_designs(Scalar(Position("sweep.yaml", 1, 8), name), HERE, problems)
    problems.raise_if_any()
    assert found is not None
    assert len(found) > 0
    for name, column in found.columns.items():
        assert (column.dtype, column.shape) == (np.float64, (len(found),)), name
        assert np.isfinite(column).all(), name
    for name, label in found.labels.items():
        assert label.codes.shape == (len(found),), name
        assert 0 <= label.codes.min() <= label.codes.max() < len(label.words), name
        assert all(isinstance(word, str) for word in label.words), name


def changed_table(data: bytes, most: int, mutate: Mutate, chance: random.Random) -> bytes:
    """Change one file in a spreadsheet and pack it again; other tables byte by byte."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = {entry.filename: archive.read(entry) for entry in archive.infolist() if entry.file_size < most}
    except Exception:
        return mutate(data, most)
    if not files or chance.random() < 0.1:
        return mutate(data, most)
    one = chance.choice(sorted(files))
    files[one] = mutate(files[one], most)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return packed.getvalue()


# --- Logs ---

LOGS = (".csv", ".xlsx", ".ags", ".gef", ".xml")
SITE_OF_A_LOG = """\
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_depth: 2.2 m}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
soil: {log: LOG, topsoil: 0.2 m}
"""


def logs(data: bytes) -> bool:
    """Read the log of a hole in each format, and draw it; say whether one of them could be."""
    refused = True
    for kind in LOGS:
        path = HERE / f"log{kind}"
        path.write_bytes(data)
        refused &= is_refused(data, partial(check_log, path.name))
    return not refused


def check_log(name: str) -> None:
    """Read a log as the soil of a site: its layers go down, and its drawing is plain."""
    sweep = load_text(SITE_OF_A_LOG.replace("LOG", name), HERE / "grid.yaml")
    check_sweep(sweep)
    (log,) = sweep.derived["soil"]
    json.dumps(sweep.resolved(), allow_nan=False)
    tops = [layer.from_m for layer in sweep.model.ground.layers]
    assert tops == sorted(set(tops))
    assert len(derived_words(sweep.derived)) == 1
    for line in log_lines(log)[1:]:
        assert line.isascii(), line
        assert len(line) <= 80, line


# --- Settings ---


def settings(data: bytes) -> bool:
    """Read the bytes of a file of settings; those that name a URL are left out, so that none is opened."""
    if b"://" in data:
        return False
    return not is_refused(data, lambda: check_sweep(load_text(decode(data, "grid.yaml"), HERE / "grid.yaml")))


def check_sweep(sweep: Sweep) -> None:
    """Look at the last design of checked settings."""
    assert sweep.n_designs >= 1
    last = sweep.block(sweep.n_designs - 1, sweep.n_designs)
    for name, column in last.columns.items():
        assert column.to_numpy().shape == (1,), name
        assert np.isfinite(column.to_numpy()).all(), name


# --- Answers ---

UNCERTAIN = {"friction": "{mean: [36, 40] deg, cov: 5 %}", "site": "embedment_depth: 2.2 m"}
QUESTIONS: dict[str, Callable[[], Any]] = {
    "depth": lambda: bare_need(site(), margin=0.1),
    "ratio": lambda: bare_need(site(height="3.4 m", site="embedment_ratio: [0.5, 0.7]"), robust=True),
    "height": lambda: bare_need(site(height="[2.6, 3.6] m", friction="[38, 40] deg"), "height"),
    "speed": lambda: bare_need(site(height="[3.0, 3.4] m"), most="speed"),
    "chance": lambda: bare_need(site(**UNCERTAIN, height="3.4 m"), probability=0.9),
    "capacity": lambda: capacity(site(height="[3.0, 3.4] m")),
    "uncertainty": lambda: boulder_sweep.uncertainty(site(**UNCERTAIN, height="[3.0, 3.4] m"), half_width=0.2),
}
GONE = "(gone)"
"""In a list of changes: the entry is taken out."""
PARTS = ("settings", "question", "control", "readings", "versions", "accuracy")
PREFIX = "boulder_sweep."


@cache
def answered(name: str) -> tuple[Path, dict[str, Any]]:
    """Return a sound file of answers, and what its metadata hold."""
    path = HERE / f"{name}.parquet"
    QUESTIONS[name]().write(path)
    metadata = pq.read_schema(path).metadata
    return path, {part: json.loads(metadata.get(f"{PREFIX}{part}".encode(), b"{}")) for part in PARTS}


def answers(data: bytes) -> bool:
    """Change the metadata and columns of a sound file of answers, and read it as each command does.

    The input is JSON: the name of the file, then pairs of the path of an entry and its new value. A path that begins
    with ``columns`` names a column, of which every row gets the value.
    """
    try:
        name, *changes = json.loads(data)
        sound, entries = answered(name)
        entries = json.loads(json.dumps(entries))
        table = pq.read_table(sound)
        for path, value in zip(changes[::2], changes[1::2], strict=True):
            if path[0] == "columns":
                table = with_column(table, path[1], value)
            else:
                put(entries, path, value)
        entries["settings_sha256"] = settings_sha256(entries["settings"])
        texts = {key: value if isinstance(value, str) else json.dumps(value) for key, value in entries.items()}
        metadata = {f"{PREFIX}{key}".encode(): text.encode() for key, text in texts.items()}
        table = table.replace_schema_metadata({**table.schema.metadata, **metadata})
        changed = HERE / "changed.parquet"
        pq.write_table(table, changed, compression="none")
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, pa.ArrowException):
        return False  # no list of changes
    if is_refused(data, lambda: AnswerFile(changed, ReportError)):
        return False
    is_refused(data, lambda: AnswerFile(changed, ReportError).answers())
    is_refused(data, lambda: export(changed, HERE / "changed.csv", units="us"))
    if not is_refused(data, lambda: described(changed)) and crc32(data) % 8 == 0:  # takes long
        is_refused(data, lambda: compare(sound, changed).to_dict())
    return True


def described(path: Path) -> None:
    """Read what the page of a report says."""
    rows = read_rows(path)
    screens(rows, answer_of(rows))


def with_column(table: pa.Table, name: str, value: Any) -> pa.Table:
    """Return a table with one value in all rows of a column, or without it."""
    place = table.column_names.index(name)
    if value == GONE:
        return table.remove_column(place)
    kind = table.schema.field(name).type
    values = pa.array([value] * len(table))
    values = values.dictionary_encode().cast(kind) if pa.types.is_dictionary(kind) else values.cast(kind)
    return table.set_column(place, table.schema.field(name), values)


def put(entries: Any, path: list[Any], value: Any) -> None:
    """Put a value in the place of an entry, or take the entry out."""
    for step in path[:-1]:
        entries = entries[step]
    if value == GONE:
        del entries[path[-1]]
    else:
        entries[path[-1]] = value


def changed_answers(data: bytes, most: int, mutate: Mutate, chance: random.Random) -> bytes:
    """Make, alter or drop one change of a file of answers."""
    try:
        name, *changes = json.loads(data)
        entries = answered(name)[1]
    except (ValueError, LookupError, TypeError):
        name, changes = chance.choice(sorted(QUESTIONS)), []
        entries = answered(name)[1]
    if changes and chance.random() < 0.4:
        at = 2 * chance.randrange(len(changes) // 2)
        if chance.random() < 0.5:
            changes[at + 1] = scrap(entries, chance)
        else:
            del changes[at : at + 2]
    else:
        column = chance.random() < 0.2
        path = (
            ["columns", chance.choice(pq.read_schema(answered(name)[0]).names)]
            if column
            else chance.choice(paths(entries))
        )
        changes += [path, scrap(entries, chance)]
    return json.dumps([name, *changes]).encode()


# --- Changes of JSON ---

SCRAPS: tuple[Any, ...] = (
    *(GONE, None, True, False, "", "x", "a" * 300, [], {}, [[]], [None], {"": {}}, ["x", "x"], {"count": 2}),
    *(0, 1, -1, 2, 3, 5, 0.5, -0.0, 1e-320, 1e308, -1e308, 2**31, 2**63, 10**400, 1e9, 255, 65535, 5120, 5126),
    *(float("nan"), float("inf"), "nan", "1", "\ud800", "\x1b[31m", "\n", "../x", "é"),
)


def paths(tree: Any, before: tuple[Any, ...] = ()) -> list[list[Any]]:
    """Return the place of every entry of a tree, and of one more in each block."""
    inner = list(tree.items()) if isinstance(tree, dict) else list(enumerate(tree)) if isinstance(tree, list) else []
    found = [[*before, "x"]] if isinstance(tree, dict) else []
    for key, value in inner:
        found += [[*before, key], *paths(value, (*before, key))]
    return found


def scrap(tree: Any, chance: random.Random) -> Any:
    """Return some value: one that is often wrong, or one that stands elsewhere."""
    if chance.random() < 0.6:
        return chance.choice(SCRAPS)
    value = tree
    for step in chance.choice(paths(tree)):
        value = value[step] if not isinstance(value, dict) else value.get(step, step)
    if isinstance(value, float | int) and chance.random() < 0.5:
        with suppress(OverflowError):  # an integer of 400 digits times 1e30
            return value * chance.choice((-1, 2, 1000, 1e-3, 1e30))
    return [value] * chance.randrange(4) if chance.random() < 0.2 else value


def change_one(tree: Any, chance: random.Random) -> None:
    """Change one entry of a tree."""
    if found := paths(tree):
        value = json.loads(json.dumps(scrap(tree, chance)))
        with suppress(LookupError):
            put(tree, chance.choice(found), value)


class Target(NamedTuple):
    """What is tried with each input, which says whether it was read, and how inputs are changed if not by bytes."""

    attempt: Callable[[bytes], bool]
    changed: Callable[[bytes, int, Mutate, random.Random], bytes] | None = None


TARGETS = {
    "scans": Target(scans, changed_scan),
    "designs": Target(designs, changed_table),
    "logs": Target(logs, changed_table),
    "settings": Target(settings),
    "answers": Target(answers, changed_answers),
}
