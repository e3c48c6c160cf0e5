"""Readers during a run, and more than one who wants to write."""

from __future__ import annotations

import signal
from concurrent.futures import ThreadPoolExecutor

import duckdb
import pandas as pd
import polars as pl
import pytest

from boulder_sweep.runner.run import run
from boulder_sweep.store import read
from tests.faults.faulty import Bar
from tests.faults.processes import Driver, run_driver
from tests.runner.grids import grid_of, plausible
from tests.store.folders import nothing_left, parts_of, rows_done
from tests.waiting import wait_until

pytestmark = pytest.mark.faults

ROWS = 40_000
HALF = ROWS // 2
"""The end of a part."""
OPTIONS = ("--rows", str(ROWS), "--simulate", "held")

READERS = {
    "read": lambda out: read(out)["design_id"].to_list(),
    "pandas": lambda out: pd.read_parquet(out).get("design_id", pd.Series(dtype=int)).to_list(),
    "polars": lambda out: pl.read_parquet(f"{out}/*.parquet")["design_id"].to_list(),
    "duckdb": lambda out: [row for (row,) in duckdb.sql(f"select design_id from '{out}/*.parquet'").fetchall()],
}


@pytest.fixture
def bar(tmp_path):
    bar = Bar(tmp_path / "held", ROWS)
    bar.allow(HALF)
    return bar


def wait_for_rows(out, rows):
    """Wait until so many rows are there."""
    wait_until(lambda: rows_done(out) >= rows, f"{rows} rows are there")


def test_readers_during_a_run_see_whole_parts_in_order_and_never_fewer_than_before(tmp_path, bar):
    out = tmp_path / "out"
    bar.allow(ROWS // 4)
    driver = Driver(out, *OPTIONS, **bar.environment)
    wait_for_rows(out, ROWS // 4)
    seen = dict.fromkeys(READERS, 0)

    def look():
        for name, reader in READERS.items():
            ids = reader(out)
            assert ids == sorted(set(ids)), name
            assert len(ids) >= seen[name], name
            seen[name] = len(ids)

    for reached in (HALF, ROWS * 3 // 4):
        bar.allow(reached)
        while rows_done(out) < reached:
            look()
        look()
        assert set(seen.values()) == {reached}
    bar.allow()
    while driver.process.poll() is None:
        look()
    assert driver.end()[0] == 3  # the stand-in gives rows that cannot be computed, too
    assert {len(reader(out)) for reader in READERS.values()} == {ROWS}
    assert len(pl.read_parquet(out)) == ROWS
    assert nothing_left(out)


def test_a_second_writer_is_refused_and_the_first_not_disturbed(tmp_path, bar):
    out = tmp_path / "out"
    first = Driver(out, *OPTIONS, **bar.environment)
    wait_for_rows(out, HALF)
    for how in ("--resume", "--overwrite"):
        code, told, complaints = run_driver(out, *OPTIONS, how, **bar.environment)
        assert (code, complaints) == (4, "")
        assert f"another run on this machine writes into {out}" in told["problem"]
    first.signal(signal.SIGINT)
    assert first.end()[0] == 130
    assert rows_done(out) == HALF


@pytest.mark.parametrize("round_", range(3))
def test_writers_at_once_without_a_lock_do_no_harm(tmp_path, bar, round_):
    """As on two machines that share the folder."""
    bar.allow()
    out = tmp_path / "out"
    run(grid_of(ROWS), tmp_path / "whole", simulate=plausible)

    def write(number):
        locks = tmp_path / f"locks-{number}"
        locks.mkdir()
        return run_driver(out, *OPTIONS, "--resume", XDG_RUNTIME_DIR=str(locks), **bar.environment)

    with ThreadPoolExecutor(3) as pool:
        assert [code for code, *_ in pool.map(write, range(3))] == [3, 3, 3]
    assert parts_of(out) == parts_of(tmp_path / "whole")
    assert nothing_left(out)
