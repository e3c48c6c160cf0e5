"""Dask schedulers and workers as processes on loopback, started by the standard commands."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Self

from tests.faults.processes import ROOT
from tests.waiting import HANG_GUARD_S


class Cluster:
    """A scheduler and some workers, each a process of its own.

    Parameters
    ----------
    workers
        How many, of one thread each.
    folder
        Working folder of the workers.
    """

    def __init__(self, workers: int, folder: Path):
        self._folder = folder
        self.scheduler = self._start("scheduler", "--port", "0", "--no-dashboard")
        self.address = _address(self.scheduler)
        self.workers: list[subprocess.Popen[str]] = []
        for _ in range(workers):
            self.start_worker()
        for worker in self.workers:
            _wait_for(worker, "Registered to")

    def start_worker(self, *, wait: bool = False) -> None:
        """Start one more worker."""
        worker = self._start(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--worker-port", "0"
        )
        self.workers.append(worker)
        if wait:
            _wait_for(worker, "Registered to")

    def kill_worker(self, which: int = 0) -> None:
        """Kill a worker at once."""
        worker = self.workers.pop(which)
        worker.kill()
        worker.wait()

    def kill_scheduler(self) -> None:
        """Kill the scheduler at once."""
        self.scheduler.kill()
        self.scheduler.wait()

    def _start(self, *words: str) -> subprocess.Popen[str]:
        """Start a command of Dask."""
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1"],
            cwd=self._folder,
            env={
                **os.environ,
                "TEST_DASK_WORKER": "1",
                "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
            },
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()
            if process.stderr is not None:
                process.stderr.close()


def _wait_for(process: subprocess.Popen[str], pattern: str) -> str:
    """Wait until a line of the log matches; what comes later is read and dropped."""
    assert process.stderr is not None
    too_long = threading.Timer(HANG_GUARD_S, process.kill)  # hang guard
    too_long.daemon = True
    too_long.start()
    try:
        for line in process.stderr:
            if re.search(pattern, line):
                threading.Thread(target=process.stderr.read, daemon=True).start()
                return line
    finally:
        too_long.cancel()
    raise AssertionError(f"{process.args} ended")


def _address(scheduler: subprocess.Popen[str]) -> str:
    """Wait for the address of a scheduler."""
    found = re.search(r"tcp://127\.0\.0\.1:\d+", _wait_for(scheduler, "Scheduler at: *tcp"))
    assert found is not None
    return found[0]
