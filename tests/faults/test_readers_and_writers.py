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
from boulder_sweep.store.manifest import load
from boulder_sweep.store.reader import finished_table
from tests.store.states import status

from boulder_sweep.store import read
from tests.faults.faulty import Bar
from tests.faults.processes import Driver, run_driver
from tests.runner.grids import grid_of, plausible, same_bits
from tests.waiting import wait_until

pytestmark = pytest.mark.faults

ROWS = 12_000
OPTIONS = ("--rows", str(ROWS), "--simulate", "held", "--rows-per-part", "3000", "--commit-every", "0.02")

READERS = {
    "read": lambda out: read(out)["design_id"].to_list(),
    "pandas": lambda out: pd.read_parquet(out).get("design_id", pd.Series(dtype=int)).to_list(),
    "polars": lambda out: pl.read_parquet(f"{out}/*.parquet")["design_id"].to_list(),
    "duckdb": lambda out: [row for (row,) in duckdb.sql(f"select design_id from '{out}/*.parquet'").fetchall()],
}


@pytest.fixture
def bar(tmp_path):
    bar = Bar(tmp_path / "held", ROWS)
    bar.allow(6000)
    return bar


def wait_for_rows(out, rows):
    """Wait until so many rows are recorded."""
    wait_until(lambda: (out / "_manifest.parquet").exists() and status(out).rows_done >= rows, f"{rows} rows are there")


def test_readers_during_a_run_see_whole_parts_in_order_and_never_fewer_than_before(tmp_path):
    """Others than ours up to the merge of small parts after the last row, when they may have to try again."""
    out, rows = tmp_path / "out", 2 * ROWS
    bar = Bar(tmp_path / "held", rows)
    bar.allow(6000)
    driver = Driver(out, *OPTIONS, "--rows", str(rows), **bar.environment)
    wait_for_rows(out, 6000)
    seen = dict.fromkeys(READERS, 0)

    def look():
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
        found = status(out, verify=True)
        assert found.damaged == {}
        assert found.rows_done >= seen["read"]

    for reached in (6000, 12_000, 18_000):
        bar.allow(reached)
        while status(out).rows_done < reached:
            look()
        look()
        assert set(seen.values()) == {reached}
    bar.allow()
    while driver.process.poll() is None:
        look()
    assert driver.end()[0] == 3  # the stand-in gives rows that cannot be computed, too
    assert {len(reader(out)) for reader in READERS.values()} == {rows}
    assert len(pl.read_parquet(out)) == rows
    assert len(list(out.glob("rows-*.parquet"))) == rows // 3000


def test_a_second_writer_is_refused_and_the_first_not_disturbed(tmp_path, bar):
    out = tmp_path / "out"
    first = Driver(out, *OPTIONS, **bar.environment)
    wait_for_rows(out, 6000)
    for how in ("--resume", "--overwrite"):
        code, told, complaints = run_driver(out, *OPTIONS, how, **bar.environment)
        assert code == 4
        assert re.search(rf"is being written by process {first.process.pid} on \S+ since", told["problem"])
        assert complaints == ""
    bar.allow(9000)
    wait_for_rows(out, 9000)
    first.signal(signal.SIGINT)
    assert first.end()[0] == 130
    found = status(out, verify=True)
    assert found.rows_done == 9000
    assert found.damaged == {}
    assert len(found.sessions) == 1


def test_of_many_who_begin_at_once_one_wins(tmp_path, bar):
    bar.allow()
    out = tmp_path / "out"
    with ThreadPoolExecutor(3) as pool:
        codes = sorted(code for code, *_ in pool.map(lambda _: run_driver(out, *OPTIONS, **bar.environment), range(3)))
    assert codes == [3, 4, 4]
    assert status(out, verify=True).complete
    assert len(status(out).sessions) == 1


def test_the_lock_of_a_killed_run_is_no_obstacle(tmp_path, bar):
    out = tmp_path / "out"
    first = Driver(out, *OPTIONS, **bar.environment)
    wait_for_rows(out, 6000)
    first.signal(signal.SIGKILL)
    first.end()
    assert (out / "_lock").exists()
    assert run(grid_of(ROWS), out, resume=True, simulate=plausible).rows == ROWS
    assert not (out / "_lock").exists()


def test_broken_parts_are_found_and_computed_again(tmp_path):
    out = tmp_path / "out"
    run(grid_of(ROWS), out, rows_per_part=1000, simulate=plausible)
    whole = finished_table(out)
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
    summary = run(grid_of(ROWS), out, resume=True, simulate=plausible)
    assert summary.rows_computed == 4000
    assert len([note for note in summary.notes if "was damaged" in note]) == 4
    assert status(out, verify=True).complete
    assert same_bits(finished_table(out), whole)
