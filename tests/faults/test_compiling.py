"""Signals while the kernels are compiled for the first time."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.faults.processes import ROOT, signalled
from tests.waiting import HANG_GUARD_S, wait_until

pytestmark = [pytest.mark.faults, pytest.mark.compiled]

LAST = 40
"""The signal arrives when so many functions are compiled at the most, of more than a hundred."""
MORE = 25
"""No more functions are compiled after it, of those that are still missing."""
GRID = """\
name: small grid
boulder: {length: 1.65 m, width: 1.68 m, height: [1.6, 2.6, 3.4] m, density: 2596 kg/m^3}
site: {embedment_ratio: 0.5}
soil: {density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: [60, 95] MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


COMMAND = """
import os, sys
from numba.core import event

compiled = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)

class Told(event.Listener):
    def on_start(self, started):
        pass

    def on_end(self, ended):
        os.write(compiled, b".")

event.register("numba:compile", Told())
from boulder_sweep.cli.main import main
main(sys.argv[2:])
"""
"""A command of sweep that writes a dot into a file for every function that it has compiled."""


class Compiling(NamedTuple):
    """A command that compiles, and the file with a dot for every function."""

    process: subprocess.Popen[str]
    compiled: Path

    def count(self) -> int:
        """How many functions are compiled."""
        return self.compiled.stat().st_size if self.compiled.exists() else 0

    def stop(self, number: int, again: bool = False) -> tuple[int, str, int]:
        """Send a signal; exit code, what was told on stderr, and how many functions were compiled afterwards."""
        before = self.count()
        self.process.send_signal(number)
        if again:
            wait_until(lambda: signalled(self.process, number), "the process has ended")
        _, told = self.process.communicate(timeout=HANG_GUARD_S)  # hang guard
        return self.process.returncode, told, self.count() - before


@pytest.fixture
def start(tmp_path):
    """Start a command with no compiled kernels on the disk, and wait until it has compiled some functions."""
    (tmp_path / "grid.yaml").write_text(GRID)
    started = []

    def begin(*words, functions=1):
        cache, compiled = tmp_path / f"cache-{len(started)}", tmp_path / f"compiled-{len(started)}"
        process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, str(compiled), *words],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'kernels'}", "BOULDER_SWEEP_CACHE_DIR": str(cache)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        compiling = Compiling(process, compiled)
        wait_until(lambda: compiling.count() >= functions or process.poll() is not None, "functions are compiled")
        assert process.poll() is None, process.communicate()
        return compiling

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("tries", [2, pytest.param(20, marks=pytest.mark.nightly)])
def test_the_first_signal_stops_a_run_soon_and_without_a_traceback(start, tmp_path, tries):
    seed = int(os.environ.get("TEST_SEED", "20260"))
    chance = random.Random(seed)
    for attempt in range(tries):
        command = start("run", "grid.yaml", "-o", f"out-{attempt}", functions=chance.randint(1, LAST))
        number = chance.choice([signal.SIGINT, signal.SIGTERM])
        code, told, more = command.stop(number)
        assert code == 128 + number, f"TEST_SEED={seed}: {told}"
        assert more < MORE, f"TEST_SEED={seed}"
        assert told.splitlines()[-1].startswith(f"interrupted by {signal.Signals(number).name}; 0 of 6 rows are safe.")
        assert "Traceback" not in told
        assert "ignored" not in told
        assert not (tmp_path / f"out-{attempt}").exists()


def test_a_command_that_is_no_run_stops_as_soon(start):
    code, told, more = start("simulate", "grid.yaml").stop(signal.SIGINT)
    assert (code, told.splitlines()[-1]) == (130, "interrupted by SIGINT")
    assert more < MORE


def test_the_second_signal_ends_it_at_once(start):
    code, told, more = start("run", "grid.yaml").stop(signal.SIGINT, again=True)
    assert code == 130
    assert more < MORE
    assert "Traceback" not in told
