"""Which parts of a result are damaged, and what is missing."""

from __future__ import annotations

import pytest

from boulder_sweep.store.failures import NotASweepError
from tests.store.folders import IDENTITY, ROWS, commit, finished_folder, open_folder
from tests.store.states import status


def test_a_finished_run(tmp_path):
    found = status(finished_folder(tmp_path / "out"), verify=True)
    assert found.complete
    assert found.rows == found.rows_done == ROWS
    assert found.parts == 5
    assert found.missing == []
    assert found.damaged == {}
    assert not found.running
    assert sum(found.verdicts.values()) == ROWS
    assert found.identity == IDENTITY


def test_a_run_under_way(tmp_path):
    folder = open_folder(tmp_path / "out")
    commit(folder, 0)
    commit(folder, 200, rows=30)
    found = status(tmp_path / "out")
    assert found.running
    assert not found.complete
    assert found.rows_done == 130
    assert found.parts == 2
    assert found.missing == [(100, 200), (230, ROWS)]
    assert found.sessions[-1].ended is None
    folder.close("interrupted by signal 2")
    after = status(tmp_path / "out")
    assert not after.running
    assert after.sessions[-1].how == "interrupted by signal 2"


@pytest.mark.parametrize("verify", [False, True])
def test_truncated_and_lost_parts_are_found(tmp_path, verify):
    out = finished_folder(tmp_path / "out")
    path = out / "rows-000000000100-000000000200.parquet"
    path.write_bytes(path.read_bytes()[:500])
    (out / "rows-000000000300-000000000400.parquet").unlink()
    found = status(out, verify=verify)
    assert found.damaged["rows-000000000100-000000000200.parquet"].startswith("truncated: 500 bytes instead of")
    assert found.damaged["rows-000000000300-000000000400.parquet"] == "missing"
    assert found.missing == [(100, 200), (300, 400)]
    assert found.rows_done == ROWS - 200


def test_every_flipped_bit_is_found_by_verifying(tmp_path):
    out = finished_folder(tmp_path / "out")
    path = out / "rows-000000000400-000000000441.parquet"
    content = path.read_bytes()
    for place in range(0, len(content), max(len(content) // 40, 1)):
        flipped = bytearray(content)
        flipped[place] ^= 1 << (place % 8)
        path.write_bytes(flipped)
        found = status(out, verify=True)
        assert found.damaged == {path.name: "changed: its checksum differs"}
        assert found.missing == [(400, ROWS)]
    path.write_bytes(content)
    assert status(out, verify=True).complete


def test_nothing_is_changed_by_looking(tmp_path):
    out = finished_folder(tmp_path / "out")
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    status(out, verify=True)
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before


def test_no_result(tmp_path):
    with pytest.raises(NotASweepError):
        status(tmp_path)
