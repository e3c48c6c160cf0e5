"""The processes that the soak does things to: runs, Dask clusters and the object store; nothing else is ever ended."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, Self

from .store_server import BUCKET, CREDENTIALS

HANG_S = 60.0
"""A process that takes longer to end, or to be ready, hangs [s]."""
WORKERS = 3
_LOOK_EVERY_S = 0.001
_OWN: set[subprocess.Popen[str]] = set()


def started(words: list[str], log: Path, **options: Any) -> subprocess.Popen[str]:
    """Start a module of Python in a process group of its own; what it complains of goes into a file."""
    with log.open("w") as complaints:
        process = subprocess.Popen(
            [sys.executable, "-m", *words], stderr=complaints, text=True, start_new_session=True, **options
        )
    _OWN.add(process)
    return process


def ended(process: subprocess.Popen[str]) -> None:
    """Kill a process and its group, if it has not ended by itself, and wait for it."""
    if process.poll() is None:  # not waited for yet, so that the number is still its own
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    _OWN.discard(process)


def end_all() -> None:
    """Kill everything that was started and has not ended."""
    for process in list(_OWN):
        ended(process)


def wait_for(reached: Callable[[], Any], what: str) -> Any:
    """Look again and again until something is there; return it.

    Raises
    ------
    TimeoutError
        It does not come.
    """
    until = time.monotonic() + HANG_S
    while time.monotonic() < until:
        if found := reached():
            return found
        time.sleep(0.02)
    raise TimeoutError(f"waited {HANG_S:.0f} s in vain for {what}")


class Run:
    """``sweep run`` as a process."""

    def __init__(self, grid: Path, out: str, log: Path, *options: str):
        self._log = log
        self.since = time.monotonic()
        """When it was started, or something was last done to it."""
        words = ["boulder_sweep", "run", str(grid), "-o", out, "-q", "--json", *options]
        self.process = started(words, log, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def has_ended(self) -> bool:
        """Whether it has ended."""
        return self.process.poll() is not None

    def signal(self, number: int) -> None:
        """Send a signal to the whole group."""
        self.since = time.monotonic()
        if self.process.poll() is None:
            os.killpg(self.process.pid, number)

    def end(self, limit_s: float = HANG_S) -> int | None:
        """Wait for the end; exit code, None for a run that hangs, which is killed."""
        try:
            return self.process.wait(limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            ended(self.process)

    def complaint(self) -> str:
        """Return the last that it said."""
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return lines[-1][:300] if lines else "(no word)"


class Watch(Protocol):
    """Waits for a moment of a run."""

    def reached(self) -> bool:
        """Look once, after a millisecond or so."""

    def done(self) -> None:
        """Let go whatever is held."""


class Time:
    """A moment so long after the start [s]."""

    def __init__(self, seconds: float):
        self._at = time.monotonic() + seconds

    def reached(self) -> bool:
        """Look once."""
        time.sleep(_LOOK_EVERY_S)
        return time.monotonic() >= self._at

    def done(self) -> None:
        """Do nothing."""


class Changes:
    """The moment in which the names in a folder have changed so many times."""

    def __init__(self, folder: Path, number: float):
        self.seen = 0
        self._folder, self._number = folder, number
        self._names = self._look()

    def reached(self) -> bool:
        """Look once."""
        time.sleep(_LOOK_EVERY_S)
        names = self._look()
        self.seen += names != self._names
        self._names = names
        return self.seen >= self._number

    def done(self) -> None:
        """Do nothing."""

    def _look(self) -> list[str]:
        return names_in(self._folder)


class Parts:
    """The moment in which a folder, empty at first or emptied, holds so many parts, finished or not."""

    def __init__(self, folder: Path, number: int):
        self._folder, self._number = folder, number
        self._emptied = False

    def reached(self) -> bool:
        """Look once."""
        time.sleep(_LOOK_EVERY_S)
        there = len(data_files(self._folder))
        self._emptied = self._emptied or there == 0
        return self._emptied and there >= self._number

    def done(self) -> None:
        """Do nothing."""


def data_files(folder: Path) -> list[str]:
    """Return the names of the parts in a folder, whatever they are called, unfinished ones too."""
    return [name for name in names_in(folder) if ".parquet" in name and "manifest" not in name]


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder, none where there is no folder."""
    try:
        with os.scandir(folder) as entries:  # a thousand times a second
            return sorted(entry.name for entry in entries)
    except FileNotFoundError:
        return []


def meets(run: Run, watch: Watch) -> bool:
    """Wait for a moment; False if the run ends before, or hangs."""
    until = time.monotonic() + HANG_S
    while not run.has_ended() and time.monotonic() < until:
        if watch.reached():
            return True
    return False


class Store:
    """The object store, and the environment that leads there."""

    def __init__(self, folder: Path):
        self._process = started(
            ["benchmarks.soak.store_server"], folder / "store.log", stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self._changed = threading.Condition()
        self._reached: set[str] = set()
        self._counts: dict[str, int] = {}
        self._port = 0
        threading.Thread(target=self._listen, daemon=True).start()
        wait_for(lambda: self._port, "the object store")
        self.endpoint = f"http://127.0.0.1:{self._port}"
        os.environ |= CREDENTIALS | {"AWS_ENDPOINT_URL": self.endpoint}

    def say(self, line: str) -> None:
        """Give the server a command."""
        assert self._process.stdin is not None
        with self._changed:
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()

    def has_reached(self, name: str) -> bool:
        """Wait a moment; whether a write into the folder is held."""
        with self._changed:
            self._changed.wait_for(lambda: name in self._reached, 5 * _LOOK_EVERY_S)
            return name in self._reached

    def let_go(self, name: str) -> None:
        """Let a held write pass, and watch the folder no more."""
        self.say(f"go {name}")
        with self._changed:
            self._reached.discard(name)

    def writes(self, name: str) -> int:
        """Return how many writes into a folder there were."""
        self._counts.pop(name, None)
        self.say(f"count {name}")
        return int(wait_for(lambda: self._counts.get(name), f"the count of {name}"))

    def remove(self, name: str) -> None:
        """Remove a folder: the server keeps everything in memory."""
        import fsspec

        files = fsspec.filesystem("s3", use_listings_cache=False, skip_instance_cache=True)
        files.rm(f"{BUCKET}/{name}", recursive=True)

    def close(self) -> None:
        """End the server."""
        ended(self._process)

    def _listen(self) -> None:
        """Take what the server tells."""
        for line in self._process.stdout or ():
            word, *rest = line.split()
            with self._changed:
                if word == "port":
                    self._port = int(rest[0])
                elif word == "reached":
                    self._reached.add(rest[0])
                elif word == "count":
                    self._counts[rest[0]] = int(rest[1])
                self._changed.notify_all()


class Writes:
    """The moment in which a write into a folder of the store is held."""

    def __init__(self, store: Store, name: str, number: int, before: bool):
        self._store, self._name = store, name
        store.say(f"watch {name} {number} {'before' if before else 'after'}")

    def reached(self) -> bool:
        """Look once."""
        return self._store.has_reached(self._name)

    def count(self) -> int:
        """Return how many writes there were since the start."""
        return self._store.writes(self._name)

    def done(self) -> None:
        """Let the write pass."""
        self._store.let_go(self._name)


class Cluster:
    """A Dask scheduler and its workers of one thread each, started by the standard commands."""

    def __init__(self, folder: Path):
        self._folder = folder
        folder.mkdir(parents=True)
        record = folder / "scheduler.json"
        self._scheduler = self._started("scheduler", "--port", "0", "--scheduler-file", str(record))

        def address() -> str:
            with_address = re.search(r'"address": *"(tcp://[^"]+)"', record.read_text()) if record.exists() else None
            return with_address[1] if with_address else ""

        self.address: str = wait_for(address, "a Dask scheduler")
        self.workers: list[subprocess.Popen[str]] = []
        self.fill()

    def fill(self) -> None:
        """Start the workers that are missing."""
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        logs = []
        while len(self.workers) < WORKERS:
            self.workers.append(self._started("worker", self.address, "--nthreads", "1", "--no-nanny"))
            logs.append(self._log)
        wait_for(lambda: all("Registered to" in log.read_text() for log in logs), "Dask workers")

    def close(self) -> None:
        """Kill everything."""
        for process in (*self.workers, self._scheduler):
            ended(process)

    def _started(self, *words: str) -> subprocess.Popen[str]:
        """Start a command of Dask on loopback."""
        self._log = self._folder / f"{len(names_in(self._folder))}.log"
        command = ["dask", *words, "--host", "127.0.0.1", "--no-dashboard"]
        root = str(Path(__file__).parents[2])
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
        return started(command, self._log, cwd=self._folder, env=environment, stdout=subprocess.DEVNULL)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
