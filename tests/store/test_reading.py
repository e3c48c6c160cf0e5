"""Reading a result back: all of it, some of it, while it grows, and when it is damaged or somebody else's."""

from __future__ import annotations

import random
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import duckdb
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.locations import location_of
from boulder_sweep.runner.run import run
from boulder_sweep.store import read, reading
from boulder_sweep.store.failures import (
    DamagedError,
    ImpossibleRecordsError,
    NotASweepError,
    OtherVersionError,
    StoreError,
    TwoResultsError,
)
from boulder_sweep.store.folder import WRITING
from boulder_sweep.store.provenance import judged_by, versions
from boulder_sweep.store.reading import FinishedRows, contents, finished_table
from tests.runner.grids import grid, plausible, same_bits
from tests.store.damages import DAMAGES
from tests.store.folders import (
    IDENTITY,
    OTHER_VERSIONS,
    PARTS,
    ROWS,
    finished_folder,
    part_of,
    parts_of,
    put,
    rewrite,
)
from tests.waiting import HANG_GUARD_S


@pytest.fixture
def out(tmp_path):
    return finished_folder(tmp_path / "out")


def test_what_is_read_is_what_pandas_reads(out):
    frame = read(out)
    pd.testing.assert_frame_equal(frame, pd.read_parquet(out), check_categorical=False)
    assert (frame.attrs["rows"], frame.attrs["complete"], frame.attrs["judged_by"]) == (ROWS, True, "")
    assert isinstance(frame["verdict"].dtype, pd.CategoricalDtype)


def test_reading_needs_neither_the_kernels_nor_the_compiler(out):
    """To import them takes longer than to read a table."""
    code = f"""
import sys
from boulder_sweep.store import read
read({str(out)!r})
print(*sorted({{"numba", "boulder_kernels.table", "scipy"}} & set(sys.modules)))
"""
    found = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert found.stdout.strip() == ""


def test_some_columns(out):
    frame = read(str(out), columns=["margin", "design_id"])
    assert list(frame.columns) == ["margin", "design_id"]
    assert frame.attrs["units"] == {"margin": "1", "design_id": ""}
    with pytest.raises(TypeError, match=r"columns must be a list of names, such as \['margin'\]"):
        read(str(out), "margin")
    with pytest.raises(ValueError, match=r"has no column 'nope'; its columns are design_id, "):
        read(out, columns=["margin", "nope"])


def test_one_row(out):
    whole = finished_table(out)
    for number in (0, 109, 110, 440):
        assert same_bits(FinishedRows(out).row(number), whole.slice(number, 1))
    with pytest.raises(IndexError, match="has 441 designs, numbered from 0; there is no 441"):
        FinishedRows(out).row(441)
    changed = out / part_of(out, 2).name
    changed.write_bytes(changed.read_bytes().replace(b"parquet-cpp", b"parquet-cPP"))  # to Parquet it is intact
    with pytest.raises(DamagedError, match=f"{changed.name}: {reading.CHANGED}"):
        FinishedRows(out).row(part_of(out, 2).first)
    with pytest.raises(DamagedError):
        list(FinishedRows(out).tables())
    (out / part_of(out, 1).name).unlink()
    with pytest.raises(IndexError, match="design 110 has not been computed yet"):
        FinishedRows(out).row(110)


@pytest.mark.parametrize("there", [[0], [2], [0, 3], [1, 2, 3]])
def test_a_result_that_grows_is_its_parts_to_every_reader(out, there):
    ranges = [list(range(*part_of(out, which)[:2])) for which in there]
    for part in [part_of(out, which) for which in range(PARTS) if which not in there]:
        (out / part.name).rename(out / f".0123456789abcdef-1-{part.hash}{WRITING}")  # not finished
    expected = [row for rows in ranges for row in rows]
    frame = read(out)
    assert frame["design_id"].to_list() == expected
    assert (frame.attrs["rows"], frame.attrs["complete"]) == (ROWS, False)
    assert pd.read_parquet(out)["design_id"].to_list() == expected
    assert pl.read_parquet(f"{out}/*.parquet")["design_id"].to_list() == expected
    found = duckdb.sql(f"select design_id from '{out}/*.parquet'").fetchnumpy()["design_id"]
    assert found.tolist() == expected


def test_a_result_on_an_object_store(out):
    there = location_of("memory://reading/out.sweep")
    for name, content in parts_of(out).items():
        there.fs.pipe_file((there / name).path, content)
    assert read("memory://reading/out.sweep").equals(read(out))
    assert FinishedRows(there).row(300).equals(FinishedRows(out).row(300))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("gone", "there is no .*gone; the result of a run is a folder"),
        ("empty", "is not the result of a sweep: no rows of it are finished"),
        ("x.yaml", r"x\.yaml is a settings file; run it first:\n  sweep run"),
        (
            "sought.yaml",
            r"sought\.yaml is a settings file; run it first:\n  sweep need .*sought.yaml -o sought.parquet$",
        ),
        ("x.csv", r"x\.csv is a file; the result of a run is a folder$"),
        ("x.parquet", "is a file; the result of a run is a folder; `sweep report`, .* take a file of answers"),
        ("part", r"is a file; the result of a run is a folder: name the folder it lies in, .*out$"),
    ],
)
def test_no_result(out, tmp_path, name, words):
    path = out / part_of(out).name if name == "part" else tmp_path / name
    (tmp_path / "empty").mkdir()
    for file in ("x.yaml", "x.csv", "x.parquet"):
        (tmp_path / file).write_text("")
    (tmp_path / "sought.yaml").write_text((Path(__file__).parents[2] / "configs/site.yaml").read_text())
    with pytest.raises(NotASweepError, match=words):
        read(path)


@pytest.mark.parametrize("kind", DAMAGES)
def test_damage_is_never_read_as_data_and_computed_again(out, kind):
    """Once by every kind; ``python -m tests.store.damages`` damages as often as asked for."""
    whole = parts_of(out)
    DAMAGES[kind](out, random.Random(7))
    for act in (read, finished_table, lambda folder: list(FinishedRows(folder).tables())):
        if kind == "gone":
            continue
        with pytest.raises(StoreError) as told:
            act(out)
        assert isinstance(told.value, DamagedError) or kind == "a_link_to_nothing"
        assert str(told.value).isprintable()
        assert "rows-" in str(told.value)
    if kind in ("of_another_run", "twice", "a_folder"):
        with pytest.raises(StoreError):
            run(grid(), out, resume=True, simulate=plausible)
        return
    summary = run(grid(), out, resume=True, simulate=plausible)
    assert parts_of(out) == whole
    assert summary.rows == ROWS > summary.rows_computed
    assert summary.rows_computed > 100 or kind == "overlapping"
    assert kind == "gone" or [note for note in summary.notes if "was damaged" in note]


def test_two_results_for_the_same_rows_are_refused_with_both_names(out):
    one = part_of(out, 1)
    table = pq.read_table(out / one.name)
    column = table["margin"].combine_chunks().fill_null(0.5)
    other = put(out, one, table.set_column(table.column_names.index("margin"), table.field("margin"), column))
    names = sorted([one.name, other.name])
    for act in (read, FinishedRows, contents, lambda folder: run(grid(), folder, resume=True, simulate=plausible)):
        with pytest.raises(TwoResultsError, match=f"{names[0]} and {names[1]}") as told:
            act(out)
        assert told.value.exit_code == 4
    assert other.exists()
    assert (out / one.name).exists()


def _deep(said):
    nested: dict = {}
    for _ in range(200):
        nested = {"a": nested}
    said["settings"]["x"] = nested


HOSTILE = {
    "no identity": lambda said: [said.pop(key) for key in list(said) if key not in ("PANDAS_ATTRS", "format")],
    "settings that are none": lambda said: said.update(settings=[1]),
    "inputs that are none": lambda said: said["settings"].update(inputs=7),
    "model that is none": lambda said: said["settings"].update(model="x"),
    "labels that are none": lambda said: said["settings"].update(labels=3),
    "versions that are none": lambda said: said.update(versions="x"),
    "accuracy that is none": lambda said: said.update(accuracy=[]),
    "deep": _deep,
    "no rows": lambda said: said.update(rows=0),
    "rows that are none": lambda said: said.update(rows=True),
    "endless table": lambda said: said.update(rows=10**30),
    "fewer rows than parts": lambda said: said.update(rows=3),
    "no parts": lambda said: said.update(ranges=0),
    "other parts": lambda said: said.update(ranges=5),
    "negative range": lambda said: said.update(range=[-5, 110]),
    "range that is none": lambda said: said.update(range="0"),
    "counts that are no numbers": lambda said: said.update(verdicts={"pass": "many"}),
    "counts below nothing": lambda said: said.update(verdicts={"pass": -5, "fail": 115}),
    "no counts": lambda said: said.pop("verdicts"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_part_that_says_what_no_sweep_writes_is_refused_in_words(out, kind):
    path = rewrite(out, HOSTILE[kind])
    before = parts_of(out)
    for act in (read, lambda folder: list(FinishedRows(folder).tables())):
        with pytest.raises(DamagedError) as refused:
            act(out)
        assert str(refused.value).isprintable()
        assert len(str(refused.value)) < 1000
    assert path.name in contents(out).damaged
    assert parts_of(out) == before


@pytest.mark.parametrize("text", [b"[" * 100_000, b"{", b"\xff", b"", b"1" + 5000 * b"0"])
@pytest.mark.parametrize("key", ["settings", "rows", "range"])
def test_records_that_cannot_be_parsed_are_refused(out, key, text):
    part = part_of(out)
    table = pq.read_table(out / part.name)
    (out / part.name).unlink()
    put(out, part, table.replace_schema_metadata(table.schema.metadata | {f"boulder_sweep.{key}".encode(): text}))
    with pytest.raises(ImpossibleRecordsError) as refused:
        read(out)
    assert refused.value.exit_code == 2


@pytest.mark.parametrize("version", OTHER_VERSIONS)
def test_a_table_of_another_version_is_refused_and_left_alone(out, version):
    change, words = OTHER_VERSIONS[version]
    for which in range(PARTS):
        rewrite(out, change, which)
    before = parts_of(out)
    for act in (
        read,
        FinishedRows,
        contents,
        *(lambda folder, how=how: run(grid(), folder, simulate=plausible, **how) for how in ({}, {"resume": True})),
    ):
        with pytest.raises(OtherVersionError) as refused:
            act(out)
        said = str(refused.value)
        assert said.startswith(f"{out} {words.format(versions()['boulder-sweep'])}")
        assert said.isprintable()
        assert len(said) < 500
    assert parts_of(out) == before


def test_nothing_is_said_of_a_table_of_this_version(out):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(out).attrs["judged_by"] == ""


@pytest.mark.parametrize("name", ["rules_sha256", "kernels_sha256"])
def test_other_rules_or_kernels_are_told(out, name):
    for which in range(PARTS):
        rewrite(out, lambda said: said.update({name: "abcdef012345", "versions": {}}), which)
    words = rf"judged by the rules of version unknown \(.*{name[:-7]} abcdef01\W"
    with pytest.warns(OlderRulesWarning, match=words):
        read(out)


def test_who_wrote_no_hash_is_not_of_this_version():
    assert judged_by({}) == "judged by the rules of version unknown (rules unknown, kernels unknown)"
    assert judged_by(IDENTITY) == ""
    long = judged_by({"rules_sha256": "\x1b[2J" * 99, "versions": {"boulder-sweep": "9\n" * 10**6}})
    assert long.isprintable()
    assert len(long) < 200


def test_parts_may_differ_in_the_heading_of_reports(out):
    rewrite(out, lambda said: said["settings"].update(report={"client": "City"}), 2)
    assert len(read(out)) == ROWS
    assert run(grid(), out, resume=True, simulate=plausible).rows_computed == 0


def test_a_table_that_says_it_is_huge_is_looked_at_in_no_time(out):
    for name in list(parts_of(out))[1:]:
        (out / name).unlink()
    rewrite(out, lambda said: said.update(rows=2**62, ranges=2**62 // 110))
    assert (len(read(out)), read(out).attrs["rows"]) == (110, 2**62)


def test_a_part_that_goes_while_it_is_read_is_told(out):
    finished = FinishedRows(out)
    (out / part_of(out, 3).name).unlink()
    with pytest.raises(StoreError, match=r"was changed while it was read: rows-.* is gone"):
        list(finished.tables())


def test_no_part_is_asked_for_after_one_that_a_store_did_not_give(out, monkeypatch):
    """Each would take as long to fail as the first, and nobody waits for the others."""
    asked, given_up = [], threading.Event()
    store = location_of("memory://silent/out")
    for name, content in parts_of(out).items():
        (store / name).write_bytes(content)

    def silent(self, path, **_):
        asked.append(path)
        if len(asked) == 1:
            raise TimeoutError
        given_up.wait(HANG_GUARD_S)  # hang guard
        raise TimeoutError

    monkeypatch.setattr(reading, "_THREADS", 2)
    monkeypatch.setattr(type(store.fs), "cat_file", silent)
    with pytest.raises(StoreError, match="no answer, or failures only, for"):
        contents(store)
    given_up.set()
    assert len(asked) <= 2
