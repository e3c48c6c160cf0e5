"""Readers during a run, and more than one who wants to write."""

from __future__ import annotations

import re
import signal
from concurrent.futures import ThreadPoolExecutor

import duckdb
import pandas as pd
import polars as pl
import pytest

from boulder_sweep.runner.sweeper import run
from boulder_sweep.store import read, status
from boulder_sweep.store.manifest import load
from boulder_sweep.store.reader import read_table
from tests.faults.faulty import slowly
from tests.faults.processes import Driver, run_driver
from tests.runner.grids import grid_of, same_bits

pytestmark = pytest.mark.faults

ROWS = 12_000
OPTIONS = ("--rows", str(ROWS), "--simulate", "slowly", "--rows-per-part", "3000", "--commit-every", "0.02")

READERS = {
    "read": lambda out: read(out)["design_id"].to_list(),
    "pandas": lambda out: pd.read_parquet(out).get("design_id", pd.Series(dtype=int)).to_list(),
    "polars": lambda out: pl.read_parquet(f"{out}/*.parquet")["design_id"].to_list(),
    "duckdb": lambda out: [row for (row,) in duckdb.sql(f"select design_id from '{out}/*.parquet'").fetchall()],
}


def test_readers_during_a_run_see_whole_parts_in_order_and_never_fewer_than_before(tmp_path):
    """Others than ours up to the merge of small parts after the last row, when they may have to try again."""
    out, rows = tmp_path / "out", 2 * ROWS
    driver = Driver(out, *OPTIONS, "--rows", str(rows))
    driver.wait_for_rows()
    seen = dict.fromkeys(READERS, 0)
    looks = dict.fromkeys(READERS, 0)
    while driver.process.poll() is None:
        for name, reader in READERS.items():
            try:
                ids = reader(out)
                assert ids == list(range(len(ids))), name
                assert len(ids) >= seen[name], name
            except Exception:
                if name == "read" or load(out).rows_done < rows:
                    raise
                continue
            seen[name] = len(ids)
            looks[name] += 1
        found = status(out, verify=True)
        assert found.damaged == {}
        assert found.rows_done >= seen["read"]
    assert driver.end()[0] == 3  # the stand-in gives rows that cannot be computed, too
    assert min(looks.values()) > 0
    assert min(seen.values()) > 0
    assert {len(reader(out)) for reader in READERS.values()} == {rows}
    assert len(pl.read_parquet(out)) == rows
    assert len(list(out.glob("rows-*.parquet"))) == rows // 3000


def test_a_second_writer_is_refused_and_the_first_not_disturbed(tmp_path):
    out = tmp_path / "out"
    first = Driver(out, *OPTIONS, "--rows", "1000000")
    first.wait_for_rows()
    for how in ("--resume", "--overwrite"):
        code, told, complaints = run_driver(out, *OPTIONS, how)
        assert code == 4
        assert re.search(rf"is being written by process {first.process.pid} on \S+ since", told["problem"])
        assert complaints == ""
    done = status(out).rows_done
    first.wait_for_rows(done + 5000)
    first.signal(signal.SIGINT)
    assert first.end()[0] == 130
    found = status(out, verify=True)
    assert found.rows_done > done
    assert found.damaged == {}
    assert len(found.sessions) == 1


def test_of_many_who_begin_at_once_one_wins(tmp_path):
    out = tmp_path / "out"
    with ThreadPoolExecutor(3) as pool:
        codes = sorted(code for code, *_ in pool.map(lambda _: run_driver(out, *OPTIONS), range(3)))
    assert codes == [3, 4, 4]
    assert status(out, verify=True).complete
    assert len(status(out).sessions) == 1


def test_the_lock_of_a_killed_run_is_no_obstacle(tmp_path):
    out = tmp_path / "out"
    first = Driver(out, *OPTIONS)
    first.wait_for_rows(3000)
    first.signal(signal.SIGKILL)
    first.end()
    assert (out / "_lock").exists()
    assert run(grid_of(ROWS), out, resume=True, simulate=slowly).rows == ROWS
    assert not (out / "_lock").exists()


def test_broken_parts_are_found_and_computed_again(tmp_path):
    out = tmp_path / "out"
    run(grid_of(ROWS), out, rows_per_part=1000, simulate=slowly)
    whole = read_table(out)
    parts = sorted(out.glob("rows-*.parquet"))
    parts[1].write_bytes(parts[1].read_bytes()[:-100])
    content = bytearray(parts[4].read_bytes())
    content[len(content) // 3] ^= 0x20
    parts[4].write_bytes(content)
    parts[7].unlink()
    parts[11].write_bytes(b"")
    found = status(out, verify=True)
    assert sorted(found.damaged) == [parts[place].name for place in (1, 4, 7, 11)]
    assert found.rows_done == ROWS - 4000
    summary = run(grid_of(ROWS), out, resume=True, simulate=slowly)
    assert summary.rows_computed == 4000
    assert len([note for note in summary.notes if "was damaged" in note]) == 4
    assert status(out, verify=True).complete
    assert same_bits(read_table(out), whole)
