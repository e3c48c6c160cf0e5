"""One ``sweep run`` in a separate process, with a timer around the kernels.

Run as ``python -m benchmarks.sweep_child BEGUN RECORD ARGUMENT...``: the arguments are those of ``sweep``, BEGUN is the
monotonic time at which the process was started, and RECORD the file that takes the measurements.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from pathlib import Path
from typing import Any


class KernelClock:
    """Replaces `simulate_table` and measures the CPU time of every call."""

    def __init__(self, simulate: Any) -> None:
        self._simulate = simulate
        self._busy = threading.Lock()
        self.seconds = 0.0
        self.first_block: float | None = None
        """When the first block of the run proper was ready, monotonic [s]; samples are not blocks."""

    def __call__(self, *arguments: Any) -> Any:
        """Simulate."""
        begun = time.thread_time()
        result = self._simulate(*arguments)
        spent = time.thread_time() - begun
        with self._busy:
            self.seconds += spent
            if self.first_block is None and threading.current_thread() is not threading.main_thread():
                self.first_block = time.monotonic()
        return result


def main() -> None:
    begun, record = float(sys.argv[1]), Path(sys.argv[2])
    from boulder_sweep.cli.main import main
    from boulder_sweep.judge import evaluation

    clock = KernelClock(evaluation.simulate_table)
    vars(evaluation)["simulate_table"] = clock
    code: str | int | None = None
    try:
        main(sys.argv[3:])
    except SystemExit as end:
        code = end.code
    first = None if clock.first_block is None else clock.first_block - begun
    peak = int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) * 1024
    found = {"kernel_cpu_s": clock.seconds, "first_block_s": first, "peak_bytes": peak}
    record.write_text(json.dumps(found))
    sys.exit(code)


if __name__ == "__main__":
    main()
