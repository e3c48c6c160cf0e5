"""What a cluster costs: bytes that pass the scheduler for each design, and who spends the CPU time.

Run as ``python -m benchmarks.cluster [MILLIONS]``: a scheduler, two workers of one thread each and a run of so many
million designs, all on loopback. CPU time is split where the first block is handed out: what comes before (starting,
importing, choosing the time step, the sample of how firm the table is) does not grow with the table.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import boulder_sweep
from boulder_sweep.runner.sweeper import run

WORKERS = 2
SETTLE_S, IDLE_S = 10.0, 10.0
"""Time for the workers to connect, and to watch the scheduler doing nothing [s]."""
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


class CountingProxy:
    """Passes connections on to a port of this machine and counts the bytes."""

    def __init__(self, port: int):
        self.bytes = 0
        self._target = port
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            here, _ = self._server.accept()
            there = socket.create_connection(("127.0.0.1", self._target))
            for source, sink in ((here, there), (there, here)):
                threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while content := source.recv(1 << 16):
                self.bytes += len(content)
                sink.sendall(content)
            sink.shutdown(socket.SHUT_WR)
        except OSError:
            return


def cpu_s(process: int) -> float:
    """Return the CPU time of a process so far [s]."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) * _TICK_S


def started(*words: str) -> subprocess.Popen[str]:
    """Start a command of Dask on loopback."""
    command = [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1", "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def port_of(scheduler: subprocess.Popen[str]) -> int:
    """Wait for the port of a scheduler."""
    for line in scheduler.stderr or ():
        found = re.search(r"Scheduler at: *tcp://127\.0\.0\.1:(\d+)", line)
        if found:
            threading.Thread(target=lambda: (scheduler.stderr or sys.stdin).read(), daemon=True).start()
            return int(found[1])
    raise RuntimeError("the scheduler has ended")


def main() -> None:
    """Run the sweep and print what it cost."""
    millions = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    sizes = [
        f"boulder.width={{from: 1.2 m, to: 2.4 m, count: {max(1, round(millions * 1e6 / 107_008 * 11))}}}",
        "solver.accuracy=fast",
    ]
    sweep = boulder_sweep.load("configs/m30_sizing.yaml", sizes)
    scheduler = started("scheduler", "--port", "0")
    workers: list[subprocess.Popen[str]] = []
    try:
        proxy = CountingProxy(port_of(scheduler))
        address = f"tcp://127.0.0.1:{proxy.port}"
        for _ in range(WORKERS):
            workers.append(started("worker", address, "--nthreads", "1", "--no-nanny"))
            workers[-1].stderr = None
        time.sleep(SETTLE_S)
        idle = cpu_s(scheduler.pid)
        time.sleep(IDLE_S)
        idle = (cpu_s(scheduler.pid) - idle) / IDLE_S
        before: dict[str, float] = {}
        begun = [0.0, 0.0]

        def spent() -> dict[str, float]:
            return {
                "scheduler": cpu_s(scheduler.pid),
                "this process": cpu_s(os.getpid()),
                "workers": sum(cpu_s(worker.pid) for worker in workers),
            }

        def begin(_: object) -> None:
            if not before:
                before.update(spent())
                begun[:] = time.monotonic(), proxy.bytes

        with tempfile.TemporaryDirectory() as folder:
            summary = run(
                sweep,
                Path(folder) / "out",
                backend="dask",
                scheduler=address,
                progress=begin,
            )
        after, seconds = spent(), time.monotonic() - begun[0]
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
    print(f"{summary.rows:,} designs in {summary.parts} parts, {summary.seconds:.1f} s with {WORKERS} workers")
    sent = proxy.bytes - begun[1]
    print(f"bytes that pass the scheduler: {proxy.bytes:,}, {proxy.bytes / summary.rows:.3f} for each design;")
    print(f"of them while it computes, {seconds:.0f} s of heartbeats included: {sent:,.0f}, {sent / summary.rows:.3f}")
    print(f"CPU time of {'':<14}{'starting':>10}{'computing':>13}{'share':>9}{'of both':>9}")
    both, computing = sum(after.values()), sum(after.values()) - sum(before.values())
    for name, total in after.items():
        own = total - before[name]
        print(f"{name:<26}{before[name]:>8.1f} s{own:>11.1f} s{own / computing:>9.2%}{total / both:>9.2%}")
    work = after["workers"] - before["workers"]
    tasks = max(after["scheduler"] - before["scheduler"] - idle * seconds, 0.0)
    alone = tasks + idle * work / WORKERS
    print(
        f"The scheduler takes {1e3 * idle:.0f} ms a second without any task, {idle * seconds:.1f} s of its time here;"
    )
    print(f"where the workers have {WORKERS} cores to themselves its share is {alone / (alone + work):.2%}.")


if __name__ == "__main__":
    main()
