"""Tables and measured curves from anywhere: an answer after bounded work, in bounded memory, never a traceback."""

from __future__ import annotations

import io
import os
import random
import threading
import zipfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from openpyxl import Workbook

from boulder_sweep.crash_tests.measured import PULSE_SIGNALS, TEST_SIGNALS, read_history
from boulder_sweep.settings import SettingsError, load_text
from tests.counting import calls_of
from tests.waiting import HANG_GUARD_S

SETTINGS = """\
name: t
table: {file}
boulder: {{length: 1.65 m, width: 1.68 m, density: 2596 kg/m^3}}
site: {{embedment_ratio: 0.5}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 60 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""
HEIGHT = "boulder_height_m"
TABLE = f'{HEIGHT},friction_angle_deg,vehicle_mass_lb,note\n2.5,40,15000,a\n2.6,41,15000,b\n3,42,14000,"c, d"\n'
PULSE = "time [ms], displacement [mm], acceleration [g]\n0,0,0\n1,13,-1\n2,26,-2\n3,38,-3\n4,50,\n5,61,-4\n"
TOKENS = [
    *(b"nan", b"inf", b"-1e999", b"1" * 400, b"\0", b"\x1b[31m", b'"', b"'", b",", b";", b"\t", b"\n", b"\r", b"#"),
    *(b"\xff", b"\xef\xbb\xbf", "１２".encode(), "−1".encode(), b"0x1f", b"1_0", b"=cmd()", b"[", b"]", b"design_id"),
    *(b"verdict", HEIGHT.encode(), b"time [s]", b"-", b" ", b"e", b"."),
]  # fmt: skip


def parquet(**columns: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink, compression="zstd")
    return sink.getvalue()


def read(path: Path) -> None:
    """Read a table, or a measured curve if its name says so; all that may be raised is a list of mistakes."""
    try:
        if path.name.startswith("pulse"):
            read_history(path, PULSE_SIGNALS if path.name == "pulse.csv" else TEST_SIGNALS)
        else:
            assert load_text(SETTINGS.format(file=path.name), path.parent / "grid.yaml").n_designs > 0
    except SettingsError as refused:
        if not refused.problems or not all(map(str, refused.problems)):
            raise AssertionError("refused without a word") from refused


def mutated(content: bytes, chance: random.Random) -> bytes:
    """Change some bytes: one by one, by pieces that are moved or lost, or by words that mean something."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        position = chance.randrange(len(changed) + 1)
        how = chance.random()
        if how < 0.3 and position < len(changed):
            changed[position] = chance.randrange(256)
        elif how < 0.6:
            changed[position:position] = chance.choice(TOKENS)
        elif how < 0.8:
            del changed[position : position + chance.randint(1, 30)]
        else:
            other = chance.randrange(len(changed) + 1)
            changed[position:position] = changed[other : other + chance.randint(1, 60)]
    return bytes(changed)


def fuzz(folder: Path, inputs: int, seed: int) -> None:
    """Read so many files that are wrong in some way."""
    chance = random.Random(seed)
    note = pa.array(["a", "b", "a"]).dictionary_encode()
    files = {
        "table.csv": TABLE.encode(),
        "pulse.csv": PULSE.encode(),
        "pulse-test.csv": b"time [s]; rotation [deg]\n0;0\n0.1;2\n0.2;3\n",
        "table.parquet": parquet(**{HEIGHT: [2.5, 2.6, 3.0], "friction_angle_deg": [40, 41, 42], "note": note}),
    }
    for number in range(inputs):
        name = chance.choice(list(files))
        content = mutated(files[name], chance)
        path = folder / name
        path.write_bytes(content)
        try:
            read(path)
        except Exception as problem:
            (folder / f"failing-{name}").write_bytes(content)
            raise AssertionError(f"seed {seed}, input {number}: {content!r:.300}") from problem


@pytest.fixture(scope="module")
def seed():
    return int(os.environ.get("TEST_SEED", "20263"))


def test_a_thousand_wrong_files_are_refused_in_words(tmp_path, seed):
    fuzz(tmp_path, 1000, seed)


@pytest.mark.nightly
def test_many_wrong_files_are_refused_in_words(tmp_path, seed):
    fuzz(tmp_path, 100_000, seed + 1)


def spreadsheet(note: str = "a") -> bytes:
    book = Workbook()
    for row in ([HEIGHT, "note"], [2.5, note], [2.6, "b"], [3, "c"]):
        book.active.append(row)
    sink = io.BytesIO()
    book.save(sink)
    return sink.getvalue()


def test_a_spreadsheet_with_a_flipped_bit_is_refused_or_read_right(tmp_path, seed):
    """Of a damaged file, zlib, the parser of XML and openpyxl raise almost anything."""
    chance, content, path = random.Random(seed), spreadsheet(), tmp_path / "table.xlsx"
    refusals = []
    for number in range(100):
        flipped = bytearray(content)
        flipped[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(flipped)
        try:
            sweep = load_text(SETTINGS.format(file=path.name), tmp_path / "grid.yaml")
        except SettingsError as error:
            refusals.append(str(error))
        else:
            assert sweep.table.columns[HEIGHT].tolist() == [2.5, 2.6, 3.0], number
            assert list(sweep.table.labels) == ["note"], number
    assert len(refusals) > 50
    assert [text for text in refusals if "table.xlsx" not in text] == []


def test_a_cell_longer_than_a_spreadsheet_can_hold_is_refused_unread(tmp_path, monkeypatch):
    packed, path = io.BytesIO(), tmp_path / "table.xlsx"
    with (
        zipfile.ZipFile(io.BytesIO(spreadsheet("&LONG;"))) as old,
        zipfile.ZipFile(packed, "w", zipfile.ZIP_LZMA) as new,
    ):
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"&amp;LONG;", b"x" * 1_000_000))
    path.write_bytes(packed.getvalue())
    monkeypatch.setattr("openpyxl.load_workbook", lambda *_, **__: pytest.fail("the cell was read"))
    with pytest.raises(SettingsError, match=r"table\.xlsx: has a cell of more than 32,767 characters"):
        load_text(SETTINGS.format(file=path.name), tmp_path / "grid.yaml")


def test_the_longest_cell_of_a_spreadsheet_is_read(tmp_path):
    (tmp_path / "table.xlsx").write_bytes(spreadsheet("\N{GRINNING FACE}" * 16_383))
    assert load_text(SETTINGS.format(file="table.xlsx"), tmp_path / "grid.yaml").n_designs == 3


def test_columns_of_every_type(tmp_path):
    columns = {
        "list": pa.array([[2.0], [3.0]]),
        "struct": pa.array([{"a": [1]}, {"a": None}]),
        "map": pa.array([[("k", 1)], []], type=pa.map_(pa.string(), pa.int64())),
        "bytes": pa.array([b"\xff\x1b", None]),
        "day": pa.array([1, 2], type=pa.date32()),
        "time": pa.array([1, None], type=pa.timestamp("ns")),
        "decimal": pa.array([1, 2], type=pa.decimal128(10, 2)),
        "truth": pa.array([True, None]),
        "nothing": pa.nulls(2),
        "half": pa.array(np.array([2.0, 2.5], dtype=np.float16)),
        "unsigned": pa.array([2, 2**64 - 1], type=pa.uint64()),
        "text": pa.array(["2.5", "=cmd()"]),
        "words": pa.array(["a", None]).dictionary_encode(),
    }
    for kind, values in columns.items():
        for name in (HEIGHT, f"{kind}_name"):
            path = tmp_path / "table.parquet"
            path.write_bytes(parquet(**{HEIGHT: pa.array([2.0, 2.5]), name: values}))
            read(path)


@pytest.mark.parametrize("values", [[2.0, float("nan")], [2.0, float("inf")], [2.0, None], [2.0, -1.0]])
def test_numbers_that_are_none(tmp_path, values):
    path = tmp_path / "table.parquet"
    path.write_bytes(parquet(**{HEIGHT: pa.array(values)}))
    with pytest.raises(SettingsError, match=HEIGHT):
        load_text(SETTINGS.format(file=path.name), tmp_path / "grid.yaml")


@pytest.mark.parametrize("name", ["table.csv", "table.parquet", "pulse.csv"])
def test_a_named_pipe_is_not_waited_for(tmp_path, name):
    """Whoever opens it for reading waits for one who opens it for writing, whom there is not."""
    os.mkfifo(tmp_path / name)
    writer = threading.Timer(HANG_GUARD_S, lambda: os.open(tmp_path / name, os.O_RDWR))  # hang guard
    writer.daemon = True
    writer.start()
    assert calls_of(lambda: read(tmp_path / name)) < 100_000
    assert writer.is_alive()
    writer.cancel()


@pytest.mark.parametrize("name", ["table.csv", "table.parquet", "pulse.csv"])
def test_more_columns_than_a_table_has(tmp_path, name):
    names = [f"c{position} [s]" for position in range(5000)]
    text = (",".join(names) + "\n" + ",".join("1" * len(names)) + "\n").encode()
    (tmp_path / name).write_bytes(parquet(**{name: [1.0] for name in names}) if name.endswith("parquet") else text * 2)
    assert calls_of(lambda: read(tmp_path / name)) < 100_000  # a few a column; there are 12 million pairs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f'{HEIGHT},note\n2,"' + '\n","' * 300_000, "has a row of more than 1,000,000 characters; is a quotation mark"),
        (f"{HEIGHT},note\n2," + "x" * 1_000_001, "has a row of more than 1,000,000 characters"),
        (f"{HEIGHT},note\n2," + '"' + "x" * 200_000, "is a quotation mark not closed, or does text"),
        (f"{HEIGHT}\n" + "2\n" * 6, "has more than 6 lines"),
        (f"{HEIGHT}\n" + "\n#\n" * 3, "has more than 6 lines"),
        (f"{HEIGHT},a_id\n2,a\n2,b\n2,c\n", "column a_id has more than 2 different words"),
        (f"{HEIGHT},friction_angle_deg\n2,40\n2,40\n2,40\n", "has more than 40 bytes of numbers"),
        (f"{HEIGHT}\n" + "x\n" * 300, "is not read beyond this line: too many mistakes"),
    ],
)
def test_every_limit_of_a_text(tmp_path, monkeypatch, text, words):
    monkeypatch.setattr("boulder_sweep.settings.design_list.MAX_TABLE_ROWS", 6 if "lines" in words else 10**6)
    monkeypatch.setattr("boulder_sweep.settings.design_list.MOST_WORDS", 2)
    monkeypatch.setattr(
        "boulder_sweep.settings.design_list._TOO_MANY_WORDS", "column {} has more than 2 different words"
    )
    monkeypatch.setattr("boulder_sweep.settings.design_list.MOST_BYTES", 40 if "bytes" in words else 10**6)
    monkeypatch.setattr("boulder_sweep.settings.text_table.MOST_MISTAKES", 100)
    monkeypatch.setattr("boulder_sweep.settings.text_table.CHUNK", 300)
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(SettingsError) as refused:
        load_text(SETTINGS.format(file="table.csv"), tmp_path / "grid.yaml")
    assert words in str(refused.value)
