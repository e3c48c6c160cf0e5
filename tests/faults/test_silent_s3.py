"""An S3 server that hangs while a run writes into it."""

from __future__ import annotations

import signal

import pytest

from boulder_sweep.locations import location_of
from boulder_sweep.runner.run import run
from boulder_sweep.store.reading import finished_table
from tests.faults.processes import Driver
from tests.faults.s3_server import BUCKET, S3Server
from tests.runner.grids import grid_of, plausible, same_bits

pytestmark = [pytest.mark.faults, pytest.mark.nightly]

OUT, ROWS = f"s3://{BUCKET}/out", 200_000
HOW = ("--rows", str(ROWS), "--simulate", "slowly")


@pytest.mark.parametrize("number", [signal.SIGINT, None])
def test_a_run_ends_while_the_store_hangs_and_goes_on_to_the_same_table(tmp_path, monkeypatch, number):
    """At the first signal, or by itself when a request was not answered in time."""
    with S3Server() as server:
        for name, value in server.environment.items():
            monkeypatch.setenv(name, value)
        driver = Driver(OUT, *HOW)
        try:
            driver.wait_for_rows(10_000)
            server.send(signal.SIGSTOP)
            if number is not None:
                driver.signal(number)
            code, told, complaints = driver.end()
        finally:
            driver.process.kill()
            server.send(signal.SIGCONT)
        assert complaints == ""
        assert "rows are safe" in told["problem"]
        assert "--resume" in told["problem"] or "resume=True" in told["problem"]
        if number is None:
            assert code == 2
            assert f"cannot write into {OUT}: " in told["problem"]
        else:
            assert code == 128 + number
        run(grid_of(ROWS), OUT, resume=True, simulate=plausible)
        run(grid_of(ROWS), tmp_path / "whole", simulate=plausible)
        assert same_bits(finished_table(location_of(OUT)), finished_table(tmp_path / "whole"))
