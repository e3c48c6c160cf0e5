"""Starting, watching and finding the processes that the tests do things to."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import uuid
from pathlib import Path
from typing import Any

from tests.waiting import HANG_GUARD_S, wait_until

ROOT = Path(__file__).parents[2]
MARK = "TEST_MARK"


class Driver:
    """A process that runs a sweep (see `driver`), in a session of its own, with a mark that its children inherit."""

    def __init__(self, out: Path | str, *options: str, **environment: str):
        self.mark = uuid.uuid4().hex
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.driver", str(out), *options],
            cwd=ROOT,
            env={**os.environ, **environment, MARK: self.mark},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait_for_rows(self, rows: int = 1) -> None:
        """Wait until the process reports that so many rows are done."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.strip().isdigit() and int(line) >= rows:
                return
        raise AssertionError(f"the run ended before: {self.process.communicate()}")

    def signal(self, number: int) -> None:
        """Send a signal to the process."""
        self.process.send_signal(number)

    def end(self) -> tuple[int, dict[str, Any], str]:
        """Wait for the end; exit code, what was told at last, and what went to stderr."""
        told, complaints = self.process.communicate(timeout=HANG_GUARD_S)  # hang guard
        lines = told.splitlines()
        last = json.loads(lines[-1]) if lines and lines[-1].startswith("{") else {}
        return self.process.returncode, last, complaints

    def leaves_nothing_behind(self) -> None:
        """Wait until no process with the mark is alive."""
        wait_until(lambda: not marked(self.mark), "no process of the run is left")


def run_driver(out: Path, *options: str, **environment: str) -> tuple[int, dict[str, Any], str]:
    """Run a process to its end."""
    return Driver(out, *options, **environment).end()


def signalled(process: subprocess.Popen[str], number: int) -> bool:
    """Send a signal; True where the process has ended. Two that come at once may count as one."""
    process.send_signal(number)
    return process.poll() is not None


def marked(mark: str) -> list[str]:
    """Command lines of all processes whose environment holds the mark."""
    found = []
    for process in Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            if mark.encode() in (process / "environ").read_bytes():
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue  # it has just ended
    return found
