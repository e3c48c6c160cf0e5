"""What of a run one thread alone must do, and so how many cores it can use.

Run as ``python -m benchmarks.serial [MILLIONS]``: a run in threads, with a clock of CPU time around each kind of work.
One thread alone passes messages on and commits parts. Workers do the rest: kernels, encoding, checksums and writing
without the lock of the interpreter, and between them some work with NumPy, which holds it for a part of its time; all
of that time is counted here as holding it.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import boulder_sweep
from boulder_sweep.judge import evaluation
from boulder_sweep.runner import running, workers
from boulder_sweep.runner.sweeper import run
from boulder_sweep.store import schema, storage, writer

CORES = 64


class Clock:
    """CPU time of threads by kind of work [s]."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._busy = threading.Lock()

    def watch(self, owner: Any, name: str, kind: str) -> None:
        """Measure every call of a function."""
        function: Callable[..., Any] = getattr(owner, name)

        def watched(*arguments: Any, **options: Any) -> Any:
            begun = time.thread_time()
            try:
                return function(*arguments, **options)
            finally:
                with self._busy:
                    self.seconds[kind] += time.thread_time() - begun

        setattr(owner, name, watched)


def speed_up(share: float, cores: int) -> float:
    """Return the speed-up on some cores where one thread alone must do a share of the work (Amdahl)."""
    return 1.0 / (share + (1.0 - share) / cores)


def main() -> None:
    """Run a sweep in threads and print who spent the CPU time."""
    millions = float(sys.argv[1]) if len(sys.argv) > 1 else 4.0
    clock = Clock()
    for owner, name, kind in (
        (evaluation, "simulate_table", "kernels"),
        (schema, "encode", "encoding"),
        (writer, "_part", "checksums"),
        (storage, "put_file", "writing"),
        (workers.Computation, "judged", "blocks"),
        (workers.Computation, "encoded", "parts"),
        (running.Committer, "run", "committing"),
        (running.Run, "_coordinate", "messages"),
    ):
        clock.watch(owner, name, kind)
    for accuracy in ("fast", "balanced"):
        count = max(1, round(millions * 1e6 / 107_008 * 11))
        sizes = [f"boulder.width={{from: 1.2 m, to: 2.4 m, count: {count}}}", f"solver.accuracy={accuracy}"]
        sweep = boulder_sweep.load("configs/m30_sizing.yaml", sizes)
        started: list[float] = []

        def begin(_: object, started: list[float] = started) -> None:
            if not started:
                clock.seconds.clear()
                started.append(time.process_time())

        with tempfile.TemporaryDirectory() as folder:
            summary = run(sweep, Path(folder) / "out", progress=begin)
        total, found = time.process_time() - started[0], clock.seconds
        alone = found["committing"] + found["messages"]
        between = found["blocks"] - found["kernels"] + found["parts"] - found["encoding"]
        print(f"{accuracy}: {summary.rows:,} designs, {1e6 * total / summary.rows:.2f} us of CPU time each")
        for kind in ("kernels", "encoding", "checksums", "writing"):
            print(f"  {kind:<42}{found[kind] / total:>8.2%}")
        print(f"  {'between them, at most with the lock':<42}{between / total:>8.2%}")
        print(f"  {'one thread alone':<42}{alone / total:>8.2%}")
        one, locked = speed_up(alone / total, CORES), speed_up((alone + between) / total, CORES)
        print(
            f"  speed-up on {CORES} cores: {one:.0f} with a worker process per core, at least {locked:.0f} in threads"
        )


if __name__ == "__main__":
    main()
