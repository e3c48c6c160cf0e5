"""Constants for the plan of very large tables: what one task, one heartbeat and one part of a manifest cost.

Run as ``python -m benchmarks.scale``; prints the constants that ``docs/studies/scale.py`` works with. The time of a
design comes from ``python -m benchmarks.serial``.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from boulder_sweep.runner.remote import Done
from boulder_sweep.store.files import part_name
from boulder_sweep.store.manifest import Manifest, Part, load, save
from boulder_sweep.store.storage import DiskStorage
from boulder_sweep.store.writer import ROWS_PER_PART, StagedPart

from .cluster import CountingProxy, cpu_s, port_of, started

FEW, MANY = 2, 8
"""Workers connected to the scheduler."""
INTERVAL_S = 0.5
"""Time between heartbeats of a worker where there are so few [s]."""
IDLE_S, TASKS, PARTS = 20.0, 300, (1_000, 11_000)
VERDICTS = {
    "fail/overturns": 91_000,
    "fail/penetration": 20,
    "pass": 35_000,
    "pass/flagged": 400,
    "undecided/crush": 652,
    "undecided/override": 4_000,
}
"""Counts of one part, as in the grid of the README."""


def part(number: int) -> StagedPart:
    """Return the record of a part."""
    first = number * ROWS_PER_PART
    record = Part(first, ROWS_PER_PART, 5_500_000, f"{number:064x}", VERDICTS, "2030-01-01T00:00:00.000+00:00")
    return StagedPart(part_name(first, first + ROWS_PER_PART, 10**12), record)


def answer(number: int) -> Done:
    """Return what a task of two parts returns."""
    return Done([part(2 * number), part(2 * number + 1)], [])


def of_the_scheduler() -> dict[str, float]:
    """Measure what a scheduler and a client spend on heartbeats and on tasks."""
    import distributed

    scheduler = started("scheduler", "--port", "0")
    processes = [scheduler]
    try:
        proxy = CountingProxy(port_of(scheduler))
        address = f"tcp://127.0.0.1:{proxy.port}"

        def idle(workers: int) -> tuple[float, float]:
            while len(processes) <= workers:
                processes.append(started("worker", address, "--nthreads", "1", "--no-nanny"))
                processes[-1].stderr = None
            client.wait_for_workers(workers)
            time.sleep(3.0)
            cpu, sent = cpu_s(scheduler.pid), proxy.bytes
            time.sleep(IDLE_S)
            return (cpu_s(scheduler.pid) - cpu) / IDLE_S, (proxy.bytes - sent) / IDLE_S

        client = distributed.Client(address, set_as_default=False)
        few, many = idle(FEW), idle(MANY)
        beats = (MANY - FEW) / INTERVAL_S
        own, cpu, sent, begun = time.process_time(), cpu_s(scheduler.pid), proxy.bytes, time.monotonic()
        for future in [client.submit(answer, number, pure=False) for number in range(TASKS)]:
            future.result()
        waited = time.monotonic() - begun
        spent = cpu_s(scheduler.pid) - cpu - many[0] * waited
        passed = proxy.bytes - sent - many[1] * waited
        own = time.process_time() - own
        client.close()
    finally:
        for process in processes:
            process.kill()
            process.wait()
    return {
        "heartbeat_cpu_s": (many[0] - few[0]) / beats,
        "heartbeat_bytes": (many[1] - few[1]) / beats,
        "scheduler_idle_share": few[0] - (many[0] - few[0]) / beats * FEW / INTERVAL_S,
        "task_cpu_s": spent / TASKS,
        "task_run_cpu_s": own / TASKS,
        "task_bytes": passed / TASKS,
    }


def of_a_manifest() -> dict[str, float]:
    """Measure what a part costs in a manifest."""
    found: list[tuple[float, float, float]] = []
    for count in PARTS:
        manifest = Manifest({}, count * ROWS_PER_PART, ROWS_PER_PART, "", dict(map(part, range(count))))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            begun = time.process_time()
            save(manifest, DiskStorage(folder))
            saved = time.process_time()
            load(folder)
            loaded = time.process_time()
            size = sum(entry.stat().st_size for entry in os.scandir(folder))
        found.append((float(size), saved - begun, loaded - saved))
    size, write, read = ((large - small) / (PARTS[1] - PARTS[0]) for small, large in zip(*found, strict=True))
    return {"part_manifest_bytes": size, "part_save_cpu_s": write, "part_load_cpu_s": read}


def main() -> None:
    """Print the constants."""
    for name, value in (of_the_scheduler() | of_a_manifest()).items():
        print(f"{name} = {value:.3g}")


if __name__ == "__main__":
    main()
