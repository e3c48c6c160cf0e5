"""The manifest: what it holds survives, what is damaged is noticed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boulder_sweep.store.failures import DamagedError, ImpossibleRecordsError, NotASweepError, OtherVersionError
from boulder_sweep.store.files import MANIFEST_NAME, is_ours, is_part_name, part_name
from boulder_sweep.store.manifest import Manifest, Merge, Part, Session, load, save
from boulder_sweep.store.provenance import FORMAT
from boulder_sweep.store.storage import DiskStorage
from tests.store.folders import rewrite_records


def manifest_with_parts() -> Manifest:
    identity = {"format": FORMAT, "settings": {"name": "t", "x": [1.5, 2.0]}}
    manifest = Manifest(identity, 1000, 300, "sweep run t.yaml --resume")
    for first, rows, verdicts in ((0, 300, {"pass": 290, "fail/overturns": 10}), (600, 50, {"pass": 50})):
        name = part_name(first, first + rows, manifest.rows)
        manifest.parts[name] = Part(first, rows, 5000, "ab", verdicts, "2026")
    manifest.sessions = [Session("2026", "host", 12, "cpu", 2, "threading", "sweep run t.yaml")]
    return manifest


@pytest.mark.parametrize("merging", [False, True])
def test_what_is_saved_is_loaded(tmp_path, merging):
    manifest = manifest_with_parts()
    if merging:
        name, part = next(iter(manifest.parts.items()))
        small = {part_name(first, first + 150, 1000): replace(part, first=first, rows=150) for first in (0, 150)}
        manifest.parts = small | {key: one for key, one in manifest.parts.items() if key != name}
        manifest.merge = Merge(name, part, [*small])
    save(manifest, DiskStorage(tmp_path))
    assert load(tmp_path) == manifest
    assert [path.name for path in tmp_path.iterdir()] == [MANIFEST_NAME]


def test_counts(tmp_path):
    manifest = manifest_with_parts()
    assert manifest.rows_done == 350
    assert manifest.verdicts == {"fail/overturns": 10, "pass": 340}
    assert list(manifest.missing()) == [(300, 600), (650, 900), (900, 1000)]


def test_a_folder_without_one_is_no_result(tmp_path):
    with pytest.raises(NotASweepError, match="is not the result of a sweep"):
        load(tmp_path)


def test_every_flipped_byte_of_the_records_is_noticed(tmp_path):
    save(manifest_with_parts(), DiskStorage(tmp_path))
    path = tmp_path / MANIFEST_NAME
    content = path.read_bytes()
    first = content.index(b'{"identity"')
    last = content.index(b"sweep run t.yaml", first)
    for place in range(first - 64, last, 7):
        flipped = bytearray(content)
        flipped[place] ^= 0x10
        path.write_bytes(flipped)
        with pytest.raises(DamagedError):
            load(tmp_path)


def part_record(records: dict[str, Any]) -> dict[str, Any]:
    return next(iter(records["parts"].values()))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda records: part_record(records).pop("verdicts"), r"parquet: verdicts is missing"),
        (lambda records: part_record(records).update(rows="all"), r"parquet: rows is 'all'"),
        (lambda records: part_record(records).update(colour="red"), r"rows-\d+-\d+\.parquet: colour is unknown"),
        (lambda records: records["sessions"][0].pop("host"), r"the record of a run: host is missing"),
        (lambda records: records["sessions"][0].pop("how"), r"the record of a run: how is missing"),
        (lambda records: records["sessions"][0].update(mood="good"), r"the record of a run: mood is unknown"),
        (lambda records: records.update(sessions={}), r"the manifest: sessions is \{\}"),
        (lambda records: records.pop("parts"), r"the manifest: parts is missing"),
        (lambda records: records.pop("merge"), r"the manifest: merge is missing"),
        (
            lambda records: records.update(merge={"name": "x", "part": 1, "replaced": []}),
            r"the record of a merge: part is 1",
        ),
    ],
)
def test_records_of_another_form_are_not_guessed_at(tmp_path, change, words):
    manifest = manifest_with_parts()
    save(manifest, DiskStorage(tmp_path))
    rewrite_records(tmp_path, lambda records: None)
    assert load(tmp_path) == manifest
    rewrite_records(tmp_path, change)
    with pytest.raises(ImpossibleRecordsError, match=words) as refused:
        load(tmp_path)
    assert str(tmp_path / MANIFEST_NAME) in str(refused.value)
    assert "--overwrite" in str(refused.value)


def test_a_table_has_the_columns_of_its_settings(tmp_path):
    save(manifest_with_parts(), DiskStorage(tmp_path))
    path = tmp_path / MANIFEST_NAME
    schema = pq.read_schema(path)
    for other in (
        schema.remove(schema.get_field_index("overlap_m")),
        schema.append(pa.field("colour", pa.string())),
    ):
        pq.write_table(other.empty_table(), path)
        with pytest.raises(ImpossibleRecordsError, match="its columns do not follow from its settings"):
            load(tmp_path)


@pytest.mark.parametrize("nonsense", [[], "x", {"identity": 3}])
def test_records_that_are_no_records(tmp_path, nonsense):
    save(manifest_with_parts(), DiskStorage(tmp_path))
    path = tmp_path / MANIFEST_NAME
    schema = pq.read_schema(path)
    text = json.dumps(nonsense).encode()
    value = hashlib.sha256(text).hexdigest().encode() + text
    pq.write_table(schema.with_metadata({b"boulder_sweep.manifest": value}).empty_table(), path)
    with pytest.raises(OtherVersionError, match="an unknown version"):
        load(tmp_path)


@pytest.mark.parametrize("keep", [0, 3, 100, -1])
def test_a_truncated_one_is_noticed(tmp_path, keep):
    save(manifest_with_parts(), DiskStorage(tmp_path))
    path = tmp_path / MANIFEST_NAME
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(DamagedError):
        load(tmp_path)


@given(st.integers(1, 10**13), st.integers(1, 10**6), st.data())
def test_missing_ranges_are_the_complement_of_what_is_there(rows, size, data):
    manifest = Manifest({}, rows, max(size, rows // 50), "")
    for first in data.draw(st.sets(st.sampled_from(range(0, rows, manifest.rows_per_part)), max_size=10)):
        end = min(first + manifest.rows_per_part, rows)
        start = data.draw(st.integers(first, end - 1))
        while start < end:
            stop = data.draw(st.integers(start + 1, end))
            name = part_name(start, stop, manifest.rows)
            manifest.parts[name] = Part(start, stop - start, 1, "", {}, "")
            start = stop + data.draw(st.integers(0, 5))
    missing = list(manifest.missing())
    there = [(part.first, part.stop) for part in manifest.parts.values()]
    edge = 0
    for start, stop in sorted(missing + there):
        assert start == edge < stop
        edge = stop
    assert edge == rows
    assert missing == sorted(missing)
    for start, stop in missing:
        assert start // manifest.rows_per_part == (stop - 1) // manifest.rows_per_part


def test_small_parts_are_mergeable_only_when_they_make_a_whole_one():
    manifest = Manifest({}, 250, 100, "")

    def add(*edges):
        for first, stop in pairwise(edges):
            manifest.parts[part_name(first, stop, manifest.rows)] = Part(first, stop - first, 1, "", {}, "")

    add(0, 100)
    add(100, 150, 199)
    add(200, 230, 250)
    assert manifest.mergeable() == [[part_name(200, 230, manifest.rows), part_name(230, 250, manifest.rows)]]
    add(199, 200)
    assert len(manifest.mergeable()) == 2
    assert manifest.mergeable()[0] == [part_name(*rows, manifest.rows) for rows in ((100, 150), (150, 199), (199, 200))]


def test_parts_are_merged_in_the_order_of_their_rows_whatever_their_names():
    manifest = Manifest({}, 20, 20, "")
    for first, name in ((0, "rows-0000000000000"), (5, "rows-1"), (10, "rows-00"), (15, "rows-2")):
        manifest.parts[name] = Part(first, 5, 1, "", {}, "")
    assert manifest.mergeable() == [["rows-0000000000000", "rows-1", "rows-00", "rows-2"]]


def test_missing_ranges_of_a_huge_table_come_one_by_one():
    manifest = Manifest({}, 10**15, 131_072, "")
    missing = manifest.missing()
    assert next(missing) == (0, 131_072)
    assert next(missing) == (131_072, 262_144)


@given(st.integers(1, 10**15), st.data())
def test_names_sort_as_rows_do(rows, data):
    manifest = Manifest({}, rows, 1, "")
    one, other = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, rows - 1))
    names = [part_name(first, first + 1, manifest.rows) for first in (one, other)]
    assert (names[0] < names[1]) == (one < other)
    assert all(is_part_name(name) for name in names)


@pytest.mark.parametrize(
    "name", ["notes.txt", "rows-1.parquet", "rows-.parquet", "rows-000000000000.parquet", "rows-000000000000-.parquet",
             "data.parquet", "_x.writing", "_manifest.json", "rows-000000000000-000000000100.parquet.bak", "writing",
             "_rows.writing"],
)  # fmt: skip
def test_foreign_names(name):
    assert not is_ours(name)


@pytest.mark.parametrize(
    "name", ["rows-000000000000-000000131072.parquet", "_manifest.parquet", "_lock",
             "__manifest.parquet.writing", "_rows-000000131072-000000262144.parquet.writing"],
)  # fmt: skip
def test_own_names(name):
    assert is_ours(name)
