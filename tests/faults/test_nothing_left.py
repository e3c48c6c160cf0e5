"""Commands that end while they write leave neither files nor processes; what a killed one leaves, the next removes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.faults.processes import ROOT, signalled
from tests.faults.test_compiling import GRID
from tests.waiting import HANG_GUARD_S, is_running, wait_until

pytestmark = [pytest.mark.faults, pytest.mark.compiled]

BROWSER = """#!/bin/sh
sleep 1000 &
echo $! > {held}.child
touch {held}
wait
"""
COMMANDS = {
    "run": ["run", "grid.yaml", "-q"],
    "csv": ["export", "out.sweep", "-o", "t.csv"],
    "xlsx": ["export", "out.sweep", "-o", "t.xlsx"],
    "parquet": ["export", "out.sweep", "-o", "t.parquet"],
    "page": ["report", "out.sweep", "-o", "t.html"],
    "pdf": ["report", "out.sweep", "-o", "t.pdf"],
    "plot": ["plot", "out.sweep", "-o", "t.png"],
    "history": ["simulate", "grid.yaml", "--trajectory", "t.parquet"],
    "need": ["need", "grid.yaml", "-o", "t.parquet"],
}
"""One for each way in which files are written."""


class Place:
    """A folder with a result, and folders for temporary files that nobody else uses."""

    def __init__(self, root: Path):
        self.root, self.held, self.started = root, root / "held", list[subprocess.Popen[str]]()
        for name in ("work", "temporary", "runtime", "bin"):
            (root / name).mkdir(mode=0o700)
        (root / "work" / "grid.yaml").write_text(GRID)
        browser = root / "bin" / "chromium"
        browser.write_text(BROWSER.format(held=self.held))
        browser.chmod(0o755)

    def start(self, *words: str, held: bool = True) -> subprocess.Popen[str]:
        """Start a command."""
        module = ["tests.faults.held_command", str(self.held)] if held else ["boulder_sweep"]
        environment = {
            "PYTHONPATH": f"{ROOT}:{ROOT / 'kernels'}",
            "TMPDIR": str(self.root / "temporary"),
            "XDG_RUNTIME_DIR": str(self.root / "runtime"),
            "PATH": f"{self.root / 'bin'}:{os.environ['PATH']}",
        }
        process = subprocess.Popen(
            [sys.executable, "-m", *module, *words],
            cwd=self.root / "work",
            env=os.environ | environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.started.append(process)
        return process

    def hold(self, *words: str) -> subprocess.Popen[str]:
        """Start a command, and wait until it is held."""
        process = self.start(*words)
        wait_until(lambda: self.held.exists() or process.poll() is not None, "the command writes")
        assert process.poll() is None, process.communicate()
        return process

    def names(self) -> set[str]:
        """What is there, but for a lock, which stays."""
        found = (path for name in ("work", "temporary", "runtime") for path in (self.root / name).rglob("*"))
        return {str(path.relative_to(self.root)) for path in found if "runtime/boulder-sweep" not in str(path)}

    def child_is_running(self) -> bool:
        """Whether what a browser started is still there."""
        pid = Path(f"{self.held}.child")
        return pid.exists() and is_running(int(pid.read_text()))


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Callable[[str], Place]]:
    places = []

    def make(command: str) -> Place:
        places.append(Place(tmp_path))
        if "out.sweep" in COMMANDS[command]:
            first = places[0].start("run", "grid.yaml", "-o", "out.sweep", "-q", held=False)
            assert first.communicate(timeout=HANG_GUARD_S)[1] == ""  # hang guard
        return places[0]

    yield make
    for process in places[0].started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "twice", "to all"])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_signal_leaves_nothing(place, command, how):
    here = place(command)
    before = here.names()
    process = here.hold(*COMMANDS[command])
    number = signal.SIGTERM if how == "SIGTERM" else signal.SIGINT
    if how == "twice":
        wait_until(lambda: signalled(process, number), "the process has ended")
    elif how == "to all":  # as Ctrl-C in a terminal
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, told = process.communicate(timeout=HANG_GUARD_S)  # hang guard
    assert process.returncode == 128 + number
    assert "Traceback" not in told
    assert how == "twice" or f"interrupted by {signal.Signals(number).name}" in told
    assert here.names() == before
    wait_until(lambda: not here.child_is_running(), "the child of the browser has ended")


@pytest.mark.parametrize("command", COMMANDS)
def test_what_a_killed_command_left_goes_with_the_next(place, command):
    here = place(command)
    before = here.names()
    process = here.hold(*COMMANDS[command])
    process.kill()
    process.communicate()
    assert here.names() > before
    wait_until(lambda: not here.child_is_running(), "the browser has ended, too")
    if command == "pdf":
        (here.root / "bin" / "chromium").write_text("#!/bin/sh\nexit 1\n")
    again = here.start(*COMMANDS[command], held=False)
    again.communicate(timeout=HANG_GUARD_S)  # hang guard
    written = {f"work/{path.name}" for path in (here.root / "work").iterdir() if not path.name.startswith(".")}
    assert again.returncode == (2 if command == "pdf" else 0)
    assert {name for name in here.names() - before if not name.startswith("work/small-grid.sweep/rows-")} <= written
