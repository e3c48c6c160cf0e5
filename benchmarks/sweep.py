"""Whole sweeps, from process start to finished table: throughput, overhead, memory, start-up, scaling.

Run as ``python -m benchmarks.sweep``. Every run is a separate process. Wall time is what a user waits for, and is
only meaningful on an idle machine; CPU time and memory are meaningful anywhere.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .designs import API, API_ANGLES
from .report import Table
from .timing import machine, versions

SIZES = (10_000, 100_000, 1_000_000)
LARGE = 10_000_000
SCALING_ROWS = 1_000_000
SETTINGS = """\
name: benchmark
boulder: {{length: {length}, width: {width}, height: {height}, density: 2650 kg/m^3}}
site: {{embedment_ratio: {embedment}}}
soil: {{density: {soil}, friction_angle: 40 deg, subgrade_reaction: {reaction}, strain_rate_factor: {rate}}}
vehicle:
  {{mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m,
    bumper_height: 0.5 m, hood_height: 1.4 m, bed_offset: 2.9 m}}
criterion: {{max_rotation: 20 deg, rating: P1}}
model: {{readings: corrected, soil: closed_form}}
solver: {{accuracy: balanced, horizon: 1 s}}
"""
RANGES = {
    "embedment": (0.35, 0.75, ""),
    "height": (1.5, 4.0, " m"),
    "width": (0.8, 2.5, " m"),
    "reaction": (0.5 * (API[0] + API[1]), API[1], " MN/m^3"),
    "length": (0.6, 2.0, " m"),
    "soil": (1520.0, 2240.0, " kg/m^3"),
    "rate": (1.0, 1.2, ""),
}
"""Axes in the order in which a larger grid takes them up; ten values each."""
assert API_ANGLES[0] < 40.0 <= API_ANGLES[1], "the friction angle of the grid is on the API curve"


def settings_of(rows: int) -> str:
    """Return a settings file of a grid of a power of ten rows; all stiffnesses are from one family."""
    axes = len(str(rows)) - 1
    if rows != 10**axes or not 1 <= axes <= len(RANGES):
        raise ValueError(f"a benchmark grid has 10 to 10^{len(RANGES)} rows, by powers of ten, not {rows}")
    values = {}
    for place, (name, (low, high, unit)) in enumerate(RANGES.items()):
        if place < axes:
            values[name] = f"{{from: {low}{unit}, to: {high}{unit}, count: 10}}"
        else:
            values[name] = f"{0.5 * (low + high)}{unit}"
    return SETTINGS.format(**values)


@dataclass
class Run:
    """What one process took."""

    rows: int
    wall_s: float
    cpu_s: float
    kernel_cpu_s: float
    first_block_s: float
    peak_bytes: int

    @property
    def computing_s(self) -> float:
        """Wall time from the first block to the finished table [s]."""
        return self.wall_s - self.first_block_s

    @property
    def beside_kernels(self) -> float:
        """Share of the CPU time that was not spent in kernels."""
        return 1.0 - self.kernel_cpu_s / self.cpu_s


class Started:
    """A sweep that runs in a separate process."""

    def __init__(
        self, rows: int, jobs: int, accuracy: str, folder: Path, cache: Path | None = None, core: int | None = None
    ) -> None:
        self.rows = rows
        self._scratch = tempfile.TemporaryDirectory(dir=folder)
        here = Path(self._scratch.name)
        (here / "grid.yaml").write_text(settings_of(rows))
        self._record = here / "record.json"
        environment = os.environ | ({"BOULDER_SWEEP_CACHE_DIR": str(cache)} if cache else {})
        self._begun = time.monotonic()
        with on_core(core):
            self._process = subprocess.Popen(
                [
                    *(sys.executable, "-m", "benchmarks.sweep_child", repr(self._begun), str(self._record)),
                    *("run", str(here / "grid.yaml"), "-o", str(here / "table")),
                    *("--jobs", str(jobs), "--accuracy", accuracy, "--quiet", "--json"),
                ],
                env=environment,
                stdout=subprocess.DEVNULL,
            )

    def finish(self) -> Run:
        """Wait for its end.

        Raises
        ------
        RuntimeError
            The sweep failed.
        """
        _, status, used = os.wait4(self._process.pid, 0)
        wall = time.monotonic() - self._begun
        self._process.returncode = os.waitstatus_to_exitcode(status)
        if self._process.returncode != 0:
            raise RuntimeError(f"the sweep of {self.rows} rows ended with exit code {self._process.returncode}")
        record = json.loads(self._record.read_text())
        self._scratch.cleanup()
        return Run(
            self.rows,
            wall,
            used.ru_utime + used.ru_stime,
            record["kernel_cpu_s"],
            record["first_block_s"],
            record["peak_bytes"],
        )


@contextmanager
def on_core(core: int | None) -> Iterator[None]:
    """Pin what is started within the context to one core; None: any core."""
    before = os.sched_getaffinity(0)
    if core is not None:
        os.sched_setaffinity(0, {sorted(before)[core]})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def throughput(sizes: tuple[int, ...], folder: Path) -> Table:
    """Sweeps of several sizes at two accuracies."""
    table = Table(
        "sweep",
        "Whole sweeps, process start to finished table",
        f"{machine()}; {versions('numba', 'numpy', 'pyarrow', 'joblib')}; `sweep run --jobs 2`, corrected readings, "
        "warm cache of compiled kernels; errors of the rows confirmed by balanced, not by fast",
        ["designs", "accuracy", "wall time", "designs/s", "CPU time per design", "not in kernels", "peak memory"],
    )
    for accuracy in ("balanced", "fast"):
        for rows in sizes:
            run = Started(rows, 2, accuracy, folder).finish()
            table.rows.append(
                [
                    f"{rows:.0e}".replace("e+0", "e"),
                    accuracy,
                    f"{run.wall_s:.2f} s",
                    f"{rows / run.wall_s:,.0f}",
                    f"{1e6 * run.cpu_s / rows:.2f} us",
                    f"{100 * run.beside_kernels:.0f} %",
                    f"{run.peak_bytes / 1e6:.0f} MB",
                ]
            )
    table.notes = [
        "The grid includes designs that the truck passes over; they cost nothing in the kernels.",
        "All figures include the start-up, half a second of imports and loading.",
    ]
    return table


def start_up(folder: Path) -> Table:
    """Process start to the first block, without and with compiled kernels on the disk."""
    cache = folder / "cache"
    cold = Started(10_000, 2, "balanced", folder, cache).finish()
    warm = min(
        (Started(10_000, 2, "balanced", folder, cache).finish() for _ in range(3)), key=lambda r: r.first_block_s
    )
    table = Table(
        "start",
        "Start-up",
        f"{machine()}; {versions('numba', 'pyarrow', 'pandas')}; `sweep run` of 10 000 designs; warm: least of three",
        ["", "process start to first block", "CPU time of the process"],
    )
    for name, run in (("cold: kernels compiled", cold), ("warm: kernels from the disk", warm)):
        table.rows.append([name, f"{run.first_block_s:.2f} s", f"{run.cpu_s:.2f} s"])
    return table


def scaling(folder: Path, rows: int = SCALING_ROWS) -> Table:
    """Measure one core, two cores, and two independent processes on one core each."""
    one = Started(rows, 1, "balanced", folder, core=0).finish()
    two = Started(rows, 2, "balanced", folder).finish()
    both = [Started(rows, 1, "balanced", folder, core=core) for core in range(2)]
    apart = [process.finish() for process in both]
    table = Table(
        "scaling",
        "One core and two",
        f"{machine()}; `sweep run` of {rows:.0e} designs, balanced; one core: pinned to it with all its threads",
        ["", "process start to first block", "from there to the finished table", "over one core", "start-up included"],
    )
    slower = max(run.computing_s for run in apart)
    table.rows = [
        ["one core", f"{one.first_block_s:.2f} s", f"{one.computing_s:.2f} s", "1", "1"],
        [
            "two cores",
            f"{two.first_block_s:.2f} s",
            f"{two.computing_s:.2f} s",
            f"{one.computing_s / two.computing_s:.2f}",
            f"{one.wall_s / two.wall_s:.2f}",
        ],
        [
            "two independent processes, twice the designs",
            f"{max(run.first_block_s for run in apart):.2f} s",
            f"{slower:.2f} s",
            f"{2 * one.computing_s / slower:.2f}",
            f"{2 * one.wall_s / max(run.wall_s for run in apart):.2f}",
        ],
    ]
    return table


def measure(*, large: bool = False) -> list[Table]:
    """Measure everything; takes about a minute, and two more with the large grid."""
    sizes = (*SIZES, LARGE) if large else SIZES
    with tempfile.TemporaryDirectory(prefix="sweep-benchmark-") as name:
        folder = Path(name)
        Started(100, 2, "balanced", folder).finish()  # compiles where the cache is cold
        return [throughput(sizes, folder), start_up(folder), scaling(folder)]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sweep", description=__doc__)
    parser.add_argument("--large", action="store_true", help="a grid of 10^7 designs, too")
    for table in measure(large=parser.parse_args().large):
        print(table.markdown(), end="\n\n")


if __name__ == "__main__":
    main()
