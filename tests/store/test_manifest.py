"""The manifest: what it holds survives, what is damaged is noticed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boulder_sweep.store.errors import DamagedError, NotASweepError
from boulder_sweep.store.manifest import (
    MANIFEST_NAME,
    Manifest,
    Part,
    Session,
    Version,
    is_ours,
    is_part_name,
    load,
    save,
)


def manifest_with_parts() -> Manifest:
    manifest = Manifest({"settings": {"name": "t", "x": [1.5, 2.0]}}, 1000, 300, "sweep run t.yaml --resume")
    whole = Part(0, Version(300, 5000, "ab"), {"pass": 290, "fail/overturns": 10}, "2026")
    grown = Part(600, Version(50, 900, "cd"), {"pass": 50}, "2026", Version(20, 400, "ef"), {"pass": 20})
    manifest.parts = {manifest.part_name(part.first): part for part in (whole, grown)}
    manifest.sessions = [Session("2026", "host", 12, "cpu", 2, "threading", "sweep run t.yaml")]
    return manifest


def test_what_is_saved_is_loaded(tmp_path):
    manifest = manifest_with_parts()
    save(manifest, tmp_path)
    assert load(tmp_path) == manifest
    assert [path.name for path in tmp_path.iterdir()] == [MANIFEST_NAME]


def test_counts(tmp_path):
    manifest = manifest_with_parts()
    assert manifest.part_count == 4
    assert manifest.rows_done == 350
    assert manifest.verdicts == {"fail/overturns": 10, "pass": 340}
    assert list(manifest.missing()) == [(300, 600), (650, 900), (900, 1000)]


def test_a_folder_without_one_is_no_result(tmp_path):
    with pytest.raises(NotASweepError, match="holds no result of a sweep"):
        load(tmp_path)


def test_every_flipped_byte_of_the_records_is_noticed(tmp_path):
    save(manifest_with_parts(), tmp_path)
    path = tmp_path / MANIFEST_NAME
    content = path.read_bytes()
    first = content.index(b'"format"')
    last = content.index(b"sweep run t.yaml", first)
    for place in range(first - 64, last, 7):
        flipped = bytearray(content)
        flipped[place] ^= 0x10
        path.write_bytes(flipped)
        with pytest.raises(DamagedError):
            load(tmp_path)


@pytest.mark.parametrize("keep", [0, 3, 100, -1])
def test_a_truncated_one_is_noticed(tmp_path, keep):
    save(manifest_with_parts(), tmp_path)
    path = tmp_path / MANIFEST_NAME
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(DamagedError):
        load(tmp_path)


@given(st.integers(1, 10**13), st.integers(1, 10**6), st.data())
def test_missing_ranges_are_the_complement_of_what_is_there(rows, size, data):
    manifest = Manifest({}, rows, max(size, rows // 50), "")
    firsts = range(0, rows, manifest.rows_per_part)
    for first in data.draw(st.lists(st.sampled_from(firsts), max_size=10)):
        most = min(manifest.rows_per_part, rows - first)
        there = data.draw(st.integers(1, most))
        manifest.parts[manifest.part_name(first)] = Part(first, Version(there, 1, ""), {}, "")
    missing = list(manifest.missing())
    assert sum(stop - start for start, stop in missing) == rows - manifest.rows_done
    assert missing == sorted(missing)
    for start, stop in missing:
        assert start // manifest.rows_per_part == (stop - 1) // manifest.rows_per_part


def test_missing_ranges_of_a_huge_table_come_one_by_one():
    manifest = Manifest({}, 10**15, 131_072, "")
    missing = manifest.missing()
    assert next(missing) == (0, 131_072)
    assert next(missing) == (131_072, 262_144)


@given(st.integers(1, 10**15), st.data())
def test_names_sort_as_rows_do(rows, data):
    manifest = Manifest({}, rows, 1, "")
    one, other = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, rows - 1))
    assert (manifest.part_name(one) < manifest.part_name(other)) == (one < other)
    assert is_part_name(manifest.part_name(one))


@pytest.mark.parametrize(
    "name", ["notes.txt", "rows-1.parquet", "rows-00000000000x.parquet", "data.parquet", "_x.writing", "_manifest.json",
             "rows-000000000000.parquet.bak", "writing", "_rows.writing"],
)  # fmt: skip
def test_foreign_names(name):
    assert not is_ours(name)


@pytest.mark.parametrize(
    "name", ["rows-000000000000.parquet", "_manifest.parquet", "_lock", "__manifest.parquet.writing",
             "_rows-000000131072.parquet.writing"],
)  # fmt: skip
def test_own_names(name):
    assert is_ours(name)
