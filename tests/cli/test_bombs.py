"""Files that hold far more than they seem to: every command that reads one refuses it in words, in little memory."""

from __future__ import annotations

import gc
import io
import os
import re
import shutil
import struct
import subprocess
import sys
import weakref
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from openpyxl import Workbook

from boulder_sweep.parquet import ParquetError, ParquetLimitError, TableFile
from boulder_sweep.store.folder import PartFile, hash_of
from tests.stones.files import glb, gltf, prism, regular

SETTINGS = """\
name: stones
table: {file}
boulder: {{length: 1.65 m, width: 1.68 m, density: 2596 kg/m^3}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
solver: {{accuracy: fast}}
"""
MOST_MEMORY_KB = 1_000_000
MOST_CPU_S = 20
TEXT, READ = "stone", "verdict"
"""Columns that become a bomb: of a list and of answers, and of a result, of which every command reads the verdicts."""
PIECE = 50_000
DRIVER = f"""
import re, resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_CPU, ({MOST_CPU_S}, {MOST_CPU_S}))
from boulder_sweep.cli import main
try:
    main.main(sys.argv[1:])
finally:
    peak = re.search(r"VmHWM:\\s*(\\d+)", Path("/proc/self/status").read_text())
    print(f"peak: {{peak[1]}}", file=sys.__stderr__)
"""


def sweep(folder: Path, *words: str) -> tuple[int, str, int]:
    """Run a command in a process of its own; return its exit code, what it said, and the most memory it took [kB]."""
    # Each thread of OpenBLAS sets memory aside.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    said, found, peak = done.stderr.rpartition("peak: ")
    assert found, f"ended by signal {-done.returncode}: {done.stderr}"
    return done.returncode, said, int(peak)


def of_rows(base: pa.Table, rows: int, words: pa.Array | pa.ChunkedArray) -> pa.Table:
    """Return the rows of a table again and again, with other words in the column that becomes a bomb."""
    table = base.take(np.arange(rows) % len(base))
    name = bomb_of(table)
    return table.set_column(table.column_names.index(name), name, words)


def bomb_of(table: pa.Table) -> str:
    is_result = READ in table.column_names and "fails_at" not in table.column_names
    return READ if is_result else TEXT


def codes(rows: int, word: str) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int32)), pa.array([word]))


def repeated(base: pa.Table, path: Path) -> None:
    pq.write_table(of_rows(base, 10_000, codes(10_000, "y" * 100_000)), path, compression="zstd")


def million(base: pa.Table, path: Path) -> None:
    pq.write_table(of_rows(base, len(base), codes(len(base), "y" * 1_000_000)), path, compression="zstd")


def nested(base: pa.Table, path: Path) -> None:
    ends = np.linspace(0, 20_000_000, len(base) + 1).astype(np.int32)
    lists = pa.ListArray.from_arrays(pa.array(ends), pa.array(np.zeros(20_000_000, np.int8)))
    pq.write_table(of_rows(base, len(base), lists), path, compression="zstd")


def different(base: pa.Table, path: Path) -> None:
    """Half a gigabyte of words that begin alike: no dictionary holds them."""
    with pq.ParquetWriter(path, of_rows(base, 1, pa.array(["y"])).schema, compression="zstd") as writer:
        for first in range(0, 10 * PIECE, PIECE):
            words = pa.array([f"{'y' * 990}{number}" for number in range(first, first + PIECE)])
            writer.write_table(of_rows(base, PIECE, words))


def prefixes(base: pa.Table, path: Path) -> None:
    words = pa.array([f"{'y' * 1_000_000}{number}" for number in range(len(base))])
    how = {"column_encoding": {bomb_of(base): "DELTA_BYTE_ARRAY"}, "use_dictionary": False}
    pq.write_table(of_rows(base, len(base), words), path, compression="zstd", **how)


def constant(base: pa.Table, path: Path) -> None:
    """Rows that all are the same, of some hundred bytes a column."""
    schema = of_rows(base, 1, codes(1, "y")).schema
    piece = of_rows(base.slice(0, 1), 500_000, codes(500_000, "y"))
    with pq.ParquetWriter(path, schema, compression="zstd", use_dictionary=True) as writer:
        for _ in range(3 if len(schema) > 10 else 45):
            writer.write_table(piece, row_group_size=len(piece))


def declared(base: pa.Table, path: Path) -> None:
    """A footer that says ten times the rows there are, wherever it says their number."""
    pq.write_table(of_rows(base, 10_000, codes(10_000, "y")), path, compression="zstd")
    content = path.read_bytes()
    start = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    path.write_bytes(content[:start] + content[start:].replace(varint(2 * 10_000), varint(2 * 100_000)))


def varint(number: int) -> bytes:
    """Return a number as a footer holds it: seven bits a byte."""
    digits = []
    while number > 127:
        digits.append(number & 127 | 128)
        number >>= 7
    return bytes([*digits, number])


SAID = {
    repeated: "column (stone|verdict) has a word of 100,000 characters; a word may have 1,000",
    million: "column (stone|verdict) has a word of 1,000,000 characters; a word may have 1,000",
    nested: "column (stone|verdict) holds list<element: int8>; a table has plain columns",
    different: "(MB once unpacked, up to column |has [0-9,]+ rows; at most 100,000)",
    prefixes: "column (stone|verdict) is text in an encoding that is not read; write it again",
    constant: "(has [0-9,]+ rows; at most (20,000|100),000|has more than [0-9]+ MB once unpacked, up to column )",
    declared: "is damaged: ",
}
LISTS = {
    "check": ("check", "list.yaml"),
    "run": ("run", "list.yaml"),
    "simulate": ("simulate", "list.yaml"),
    "need": ("need", "list.yaml"),
    "capacity": ("capacity", "list.yaml"),
    "uncertainty": ("uncertainty", "list.yaml"),
    "tradeoff": ("tradeoff", "list.yaml"),
}
RESULTS = {
    "report": ("report", "{}"),
    "export": ("export", "{}", "-o", "table.csv"),
    "plot": ("plot", "{}"),
    "compare": ("compare", "{}", "{}"),
}
COMMANDS = [
    *(("list", *words) for words in LISTS.values()),
    *(("answers", *(word.format("bomb.parquet") for word in words)) for words in RESULTS.values()),
    *(("result", *(word.format("stones.sweep") for word in words)) for words in RESULTS.values()),
    ("result", "simulate", "stones.sweep"),
]
OFTEN = [("list", "check"), ("answers", "export"), ("result", "report")]
"""One command of each way to read; the others wait for the night."""


@pytest.fixture(scope="module")
def bases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A list of designs, and what commands wrote of it."""
    folder = tmp_path_factory.mktemp("bases")
    words = pa.array(["a", "b", "c"]).dictionary_encode()
    columns = {"boulder_height_m": [3.0, 3.2, 3.4], "embedment_depth_m": [2.0, 2.1, 2.2], TEXT: words}
    pq.write_table(pa.table(columns), folder / "list.parquet")
    (folder / "list.yaml").write_text(SETTINGS.format(file="list.parquet"))
    for words in (("run", "list.yaml"), ("need", "list.yaml", "-o", "answers.parquet")):
        assert sweep(folder, *words)[0] == 0
    return folder


@pytest.fixture(scope="module")
def bombs(bases: Path) -> Callable[[str, Callable[[pa.Table, Path], None]], Path]:
    """Return the folder with a bomb; it is made once."""
    (part,) = (bases / "stones.sweep").glob("rows-*")
    table = {"list": pq.read_table(bases / "list.parquet"), "answers": pq.read_table(bases / "answers.parquet")}
    table["result"] = pq.read_table(part)

    def bomb(kind: str, make: Callable[[pa.Table, Path], None]) -> Path:
        folder = bases / f"{kind}-{make.__name__}"
        if folder.exists():
            return folder
        folder.mkdir()
        (folder / "list.yaml").write_text(SETTINGS.format(file="bomb.parquet"))
        make(table[kind], folder / "bomb.parquet")
        if kind == "result":
            rows = pq.read_metadata(folder / "bomb.parquet").num_rows
            said = {b"boulder_sweep.rows": str(rows), b"boulder_sweep.ranges": "1"}
            base = table[kind]
            make(base.replace_schema_metadata(base.schema.metadata | said), folder / "bomb.parquet")
            shutil.copytree(bases / "stones.sweep", folder / "stones.sweep")
            (folder / "stones.sweep" / part.name).unlink()
            _put_part(folder)
        return folder

    return bomb


def _put_part(folder: Path) -> None:
    """Make the file the one part of the result, under the name that is right."""
    content = (folder / "bomb.parquet").read_bytes()
    rows = pq.read_metadata(folder / "bomb.parquet").num_rows
    (folder / "bomb.parquet").rename(folder / "stones.sweep" / PartFile(0, rows, hash_of(content)).name)


@pytest.mark.parametrize("make", SAID, ids=lambda make: make.__name__)
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(one, id="-".join(one[:2]), marks=[] if one[:2] in OFTEN else pytest.mark.nightly)
        for one in COMMANDS
    ],
)
def test_bombs_are_refused_in_words(bombs, command, make):
    kind, *words = command
    code, said, peak = sweep(bombs(kind, make), *words)
    assert re.search(SAID[make], said), said
    assert code == (1 if kind == "result" and make is declared else 2), said
    assert "stones.sweep/rows-" in said or "stones.sweep is damaged (rows-" in said or "bomb.parquet" in said
    assert not re.search(r"Traceback|internal error|[A-Z]\w+(Error|Exception|Invalid)\b", said), said
    assert peak < MOST_MEMORY_KB


def glb_of(description: bytes) -> bytes:
    chunks = struct.pack("<I4s", len(description), b"JSON") + description
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def instances() -> bytes:
    """A mesh of 2,000 triangles, in 2,000 places."""
    header, buffer = gltf(*prism(regular(1001, 1.0), 1.0))
    header["nodes"] = [{"mesh": 0} for _ in range(2_000)]
    header["scenes"] = [{"nodes": list(range(2_000))}]
    return glb(header, buffer)


def ply_of(*lines: str, data: bytes = b"", form: str = "binary_little_endian") -> bytes:
    return "\n".join(["ply", f"format {form} 1.0", *lines, "end_header\n"]).encode() + data


def spreadsheet(sheet: str) -> bytes:
    """A spreadsheet of one sheet, by the text of its cells."""
    packed = io.BytesIO()
    Workbook().save(packed)
    content = io.BytesIO()
    with zipfile.ZipFile(packed) as old, zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = old.read(name)
            if name.endswith("sheet1.xml"):
                text = text.replace(b"<sheetData>", b"<sheetData>" + sheet.encode())
            new.writestr(name, text)
    return content.getvalue()


def ten_times(levels: int) -> str:
    """Lists of ten references to the list before."""
    lines = ["a0: &a0 [x]", *(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, levels))]
    return "\n".join(lines)


VERTICES = ("element vertex 3", "property float x", "property float y", "property float z")
CORNERS = "property list uint int vertex_indices"
MANY = "length: {{from: 1 m, to: 2 m, count: 1000000000000}}, width: 1.7 m, height: 3 m, density: 2600"
DEEP = b"[" * 900_000
FILES: dict[str, Callable[[], bytes]] = {
    "header.ply": lambda: ply_of(
        "comment xend_header", "element vertex 2000000000", *VERTICES[1:], "element face 2000000000", CORNERS
    ),
    "corners.ply": lambda: ply_of(*VERTICES, "element face 1", CORNERS, data=bytes(36) + struct.pack("<I", 1 << 31)),
    "polygon.ply": lambda: ply_of(
        *VERTICES, "element face 1", CORNERS, data=bytes(36) + struct.pack("<I", 5_000_000) + bytes(20_000_000)
    ),
    "comments.ply": lambda: ply_of(*["comment"] * 2_000_000),
    "properties.ply": lambda: ply_of("element vertex 900000", *(f"property double p{k}" for k in range(3_000))),
    "count.stl": lambda: bytes(80) + struct.pack("<I", 80_000_000),
    "mixed.stl": lambda: b"solid x\n" + b"EndFacet\n" * 8_100_000,
    "line.obj": lambda: b"f" + b" 1" * 20_000_000,
    "lines.obj": lambda: b"#\n" * 8_100_000,
    "faces.obj": lambda: b"v 0 0 0\n" + b"f 1 1 1\n" * 1_100_000,
    "description.glb": lambda: glb_of(b" " * 180_000_000 + b"{}"),
    "deep.glb": lambda: glb_of(DEEP),
    "instances.glb": instances,
    "accessor.glb": lambda: glb(
        {
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1 << 40, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 12}],
        },
        bytes(12),
    ),
    "cell.csv": lambda: b"boulder_height_m\n" + b"1" * 200_000_000,
    "names.csv": lambda: b"a," * 2_000_000 + b"a\n1\n",
    "lines.csv": lambda: b"boulder_height_m,embedment_depth_m\n" + b"\n" * 21_000_000,
    "quoted.csv": lambda: b'boulder_height_m\n"' + b"\n" * 20_000_000,
    "far.xlsx": lambda: spreadsheet('<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'),
    "cells.xlsx": lambda: spreadsheet('<row r="1">' + "<c><v>1</v></c>" * 12_000_000 + "</row>"),
    "references.yaml": lambda: ten_times(12).encode(),
    "deep.yaml": lambda: b"a: " + DEEP[:400_000],
    "long.yaml": lambda: b"name: " + b"x" * 60_000_000,
    "many.yaml": lambda: (
        SCAN_SETTINGS.replace("scan: {{file: {file}, up: c, facing: a}}, mass: 12 t", MANY).format().encode()
    ),
    "wide.yaml": lambda: b"a: [" + b"1, " * 150_000 + b"1]",
}
SCAN_SETTINGS = SETTINGS.replace("table: {file}\n", "").replace(
    "length: 1.65 m, width: 1.68 m, density: 2596 kg/m^3", "scan: {{file: {file}, up: c, facing: a}}, mass: 12 t"
)
READ_BY = {
    (".ply", ".stl", ".obj", ".glb"): (
        ("stone", "{}"),
        *((command, "scan.yaml") for command in ("check", "run", "simulate", "need", "explore")),
    ),
    (".csv",): (
        ("fit-vehicle", "{}", "--mass", "6804 kg"),
        ("validate", "--case", "rwg", "--measured", "{}"),
        *LISTS.values(),
    ),
    (".xlsx",): tuple(LISTS.values()),
    (".yaml",): tuple((command, "{}") for command in (*LISTS, "explore")),
}
OTHERS = [
    pytest.param(name, words, id=f"{words[0]}-{name}", marks=pytest.mark.nightly if place else [])
    for ends, commands in READ_BY.items()
    for name in FILES
    if name.endswith(ends)
    for place, words in enumerate(commands)
]


@pytest.mark.parametrize(("name", "words"), OTHERS)
def test_what_is_more_than_it_seems_is_refused_in_words(tmp_path, name, words):
    (tmp_path / name).write_bytes(FILES[name]())
    if not name.endswith(".yaml"):
        (tmp_path / "list.yaml").write_text(SETTINGS.format(file=name))
        (tmp_path / "scan.yaml").write_text(SCAN_SETTINGS.format(file=name))
    code, said, peak = sweep(tmp_path, *(word.format(name) for word in words))
    assert code == 2, said
    assert name in said
    assert len(said) < 5_000
    assert not re.search(r"Traceback|internal error|[A-Z]\w+(Error|Exception|Invalid)\b", said), said
    assert peak < MOST_MEMORY_KB


VERSIONS = [
    *({"compression": codec} for codec in ("none", "snappy", "gzip", "brotli", "lz4", "zstd")),
    {"data_page_version": "2.0"},
    {"use_dictionary": False},
    {"use_dictionary": False, "column_encoding": "DELTA_LENGTH_BYTE_ARRAY"},
    {"write_page_checksum": True, "write_statistics": False},
    {"row_group_size": 7},
    {"store_schema": False},
    {"write_page_index": True},
]


@pytest.mark.parametrize("how", VERSIONS, ids=lambda how: ",".join(f"{key}={value}" for key, value in how.items()))
def test_whatever_pyarrow_writes_is_read(tmp_path, how):
    rows = 100_000 if "row_group_size" not in how else 100
    numbers = np.round(np.random.default_rng(1).random(rows), 2)
    table = pa.table(
        {
            "number": pa.array(numbers, mask=numbers > 0.9),
            "count": pa.array(np.arange(rows)),
            "truth": pa.array(numbers > 0.5),
            "decimal": pa.array(np.arange(rows)).cast(pa.decimal128(20, 0)),
            "word": pa.array(["é" * 100, None, "b", ""] * (rows // 4)),
            "name": pa.array([f"stone {row}" for row in range(rows)]),
        }
    )
    if "column_encoding" in how:
        table = table.select(["word", "name"])
        how = {**how, "column_encoding": dict.fromkeys(table.column_names, how["column_encoding"])}
    pq.write_table(table, tmp_path / "table.parquet", **how)
    with (tmp_path / "table.parquet").open("rb") as file:
        found = TableFile(file).read()
    assert found.column_names == table.column_names
    for name in table.column_names:
        assert found[name].cast(table[name].type).equals(table[name]), name


@pytest.mark.parametrize("writer", ["polars", "duckdb"])
def test_what_others_write_is_read(tmp_path, writer):
    path = tmp_path / "table.parquet"
    frame = pd.DataFrame({"number": np.arange(50_000) / 7.0, "word": [f"stone {row % 99}" for row in range(50_000)]})
    if writer == "polars":
        pl.from_pandas(frame).write_parquet(path)
    else:
        duckdb.sql(f"COPY frame TO '{path}' (FORMAT parquet)")
    with path.open("rb") as file:
        assert TableFile(file).read().to_pandas().astype({"word": str}).equals(frame.astype({"word": str}))


def test_a_footer_that_says_less_than_its_pages_is_not_believed(tmp_path):
    """Pyarrow unpacks what the page says."""

    def written(values: np.ndarray) -> tuple[bytes, Any]:
        out = io.BytesIO()
        how = {"compression": "zstd", "use_dictionary": False, "data_page_size": 2**30, "write_statistics": False}
        rows = {"row_group_size": len(values), "write_batch_size": len(values), "max_rows_per_page": len(values)}
        pq.write_table(pa.table({"number": values}), out, store_schema=False, **how, **rows)
        return out.getvalue(), pq.read_metadata(io.BytesIO(out.getvalue())).row_group(0).column(0)

    def number(value: int) -> bytes:
        """Return a number from 64 to 8191 as Thrift writes it."""
        return bytes([value << 1 & 127 | 128, value >> 6])

    many, chunk = written(np.arange(1_000_000.0) % 977.0)
    few, other = written(np.random.default_rng(1).random(chunk.total_compressed_size // 8 - 20))
    size = int.from_bytes(few[-8:-4], "little")
    footer = few[-8 - size : -8].replace(number(other.total_compressed_size), number(chunk.total_compressed_size))
    path = tmp_path / "lie.parquet"
    path.write_bytes(b"".join([many[: 4 + chunk.total_compressed_size], footer, few[-8:]]))
    said = pq.read_metadata(path).row_group(0).column(0)
    assert said.total_compressed_size == chunk.total_compressed_size
    assert said.total_uncompressed_size < 1_000_000 < 8_000_000 < chunk.total_uncompressed_size
    with path.open("rb") as file, pytest.raises(ParquetLimitError, match="has more than 1 MB once unpacked"):
        TableFile(file, most_bytes=1_000_000).read()


@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"\x15",
        b"\x15\x00\x15" + b"\xff" * 11,
        b"\x1c" * 50,
        b"\x19\x00",
        b"\x18\xff\xff\xff\x7f",
        bytes(1),
        b"\x15\x00\x15\x01\x15\x00\x00",
        b"\x15\x00\x15\x00\x15\x01\x00",
        b"\x15\x00\x15\x00\x15\xfe\x7f\x00",
    ],
    ids=range(10),
)
def test_a_head_of_a_page_that_is_none_is_damage(tmp_path, head):
    path = tmp_path / "head.parquet"
    pq.write_table(pa.table({"number": np.arange(40.0)}), path, use_dictionary=False, compression="none")
    at = pq.read_metadata(path).row_group(0).column(0).data_page_offset
    with path.open("rb") as file:
        opened = TableFile(file)
        opened._source = io.BytesIO(bytes(at) + head)
        with pytest.raises(ParquetError, match="damaged"):
            opened.read()


def test_a_page_cut_short_is_damaged(tmp_path):
    path = tmp_path / "cut.parquet"
    pq.write_table(pa.table({"number": np.arange(50_000.0)}), path, use_dictionary=False)
    content = path.read_bytes()
    path.write_bytes(content[:4] + bytes(100) + content[104:])
    with path.open("rb") as file, pytest.raises(ParquetError, match="cannot be read as Parquet"):
        TableFile(file).read()


def test_a_file_that_was_read_is_let_go(tmp_path: Path) -> None:
    """Pyarrow keeps for good what a file of Python raises inside it, with all that hangs on it."""
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table({"a": [1.0, 2.0]}), path)
    with path.open("rb") as stream:
        opened = TableFile(stream, 10, 10_000)
        opened.read(["a"])
        kept = weakref.ref(opened)
        del opened
        gc.collect()
        assert kept() is None
