"""Signals while the kernels are compiled for the first time."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import uuid
from typing import NamedTuple

import pytest

from tests.faults.processes import MARK, ROOT, marked, signalled
from tests.waiting import HANG_GUARD_S, wait_until

pytestmark = [pytest.mark.faults, pytest.mark.compiled]

LONGEST_S = 6.0
"""Before a signal [s]; compiling takes longer."""
GRID = """\
name: small grid
boulder: {length: 1.65 m, width: 1.68 m, height: [1.6, 2.6, 3.4] m, density: 2596 kg/m^3}
site: {embedment_ratio: 0.5}
soil: {density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: [60, 95] MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


class Compiling(NamedTuple):
    """A command whose kernels are compiled, and the mark of its processes."""

    process: subprocess.Popen[str]
    mark: str

    def compiles(self) -> bool:
        """Whether a process of its own compiles."""
        return any("_jit.main()" in command for command in marked(self.mark))

    def stop(self, number: int, again: bool = False) -> tuple[int, str]:
        """Send a signal; exit code, and what was told on stderr. No process is left."""
        self.process.send_signal(number)
        if again:
            wait_until(lambda: signalled(self.process, number), "the process has ended")
        _, told = self.process.communicate(timeout=HANG_GUARD_S)  # hang guard
        wait_until(lambda: not marked(self.mark), "nothing is compiled any more")
        return self.process.returncode, told


@pytest.fixture
def start(tmp_path):
    """Start a command with no compiled kernels on the disk, and wait until it has them compiled for a while [s]."""
    (tmp_path / "grid.yaml").write_text(GRID)
    started = []

    def begin(*words, after=0.0):
        mark = uuid.uuid4().hex
        process = subprocess.Popen(
            [sys.executable, "-m", "boulder_sweep", *words],
            cwd=tmp_path,
            env={
                **os.environ,
                "PYTHONPATH": f"{ROOT}:{ROOT / 'kernels'}",
                "BOULDER_SWEEP_CACHE_DIR": str(tmp_path / f"cache-{len(started)}"),
                MARK: mark,
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        command = Compiling(process, mark)
        wait_until(lambda: command.compiles() or process.poll() is not None, "kernels are compiled")
        time.sleep(after)
        assert process.poll() is None, process.communicate()
        return command

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("tries", [2, pytest.param(20, marks=pytest.mark.nightly)])
def test_the_first_signal_stops_a_run_soon_and_without_a_traceback(start, tmp_path, tries):
    seed = int(os.environ.get("TEST_SEED", "20260"))
    chance = random.Random(seed)
    for attempt in range(tries):
        command = start("run", "grid.yaml", "-o", f"out-{attempt}", after=chance.uniform(0.0, LONGEST_S))
        number = chance.choice([signal.SIGINT, signal.SIGTERM])
        code, told = command.stop(number)
        assert code == 128 + number, f"TEST_SEED={seed}: {told}"
        assert told.splitlines()[-2].startswith(f"interrupted by {signal.Signals(number).name}; 0 of 6 rows are safe.")
        assert "Traceback" not in told
        assert "ignored" not in told
        assert not (tmp_path / f"out-{attempt}").exists()


def test_a_command_that_is_no_run_stops_as_soon(start):
    code, told = start("simulate", "grid.yaml").stop(signal.SIGINT)
    assert (code, told.splitlines()[-1]) == (130, "interrupted by SIGINT")


def test_the_second_signal_ends_it_at_once(start):
    code, told = start("run", "grid.yaml").stop(signal.SIGINT, again=True)
    assert code == 130
    assert "Traceback" not in told


def test_what_compiles_ends_with_a_process_that_is_killed(start):
    assert start("simulate", "grid.yaml").stop(signal.SIGKILL)[0] == -signal.SIGKILL
