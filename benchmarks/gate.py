"""The gate: it fails if a change makes the project do more, or its kernels take half as long again.

Run as ``python -m benchmarks.gate``; exit code 1 and a sentence for what fails. What depends on no clock is counted and
compared with ``gate.toml``: calls of kernels while a few designs are simulated with the compiler off, and the designs
that a small run simulates. One thing is timed: designs in lanes, in turn with a loop that shares no code with the
project. Other programs make either only slower, so the least times of up to nine rounds count, and a machine that is
busy for a while is no reason to fail. ``--record`` prints what to write into ``gate.toml``.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import subprocess
import sys
import tempfile
import threading
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import numba
import numpy as np

import boulder_kernels as bk
from boulder_sweep.judge.accuracy import STEPS

from .designs import HORIZON, ROTATION_LIMIT, sample
from .report import FOLDER
from .timing import cpu_seconds, machine

LIMITS = FOLDER / "gate.toml"
ROUNDS = 9
ROWS = 4096
COUNTED_ROWS = 64
"""Designs that are simulated with the compiler off."""
RUN = """
name: benchmark
boulder: {length: 1.3 m, width: {from: 0.8 m, to: 2.5 m, count: 10}, height: {from: 1.5 m, to: 4.0 m, count: 10},
          density: 2650 kg/m^3}
site: {embedment_ratio: {from: 0.35, to: 0.75, count: 10}}
soil: {density: 1880 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 85.125 MN/m^3, strain_rate_factor: 1.1}
vehicle:
  {mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m,
    bumper_height: 0.5 m, hood_height: 1.4 m, bed_offset: 2.9 m}
criterion: {max_rotation: 20 deg, rating: P1}
model: {readings: corrected, soil: closed_form}
solver: {accuracy: balanced, horizon: 1 s}
"""
"""Settings of the small run: a grid of 1000 designs."""
COUNTED = ("closed_form", "step", "follow")
"""Kernels whose calls are counted one by one, besides the calls of all kernels."""
PREPARING = "interruptible work"
"""Name of the threads that prepare a run; how many designs they try depends on the clock."""
ANY_PROCESSOR = "any"
"""Whose record holds for processors without one of their own."""

Work = Callable[[], object]


class Finding(NamedTuple):
    """One figure over the recorded one."""

    name: str
    ratio: float
    most: float
    """Largest ratio that passes."""
    least: float = 0.0
    """Smallest ratio that passes."""

    @property
    def passes(self) -> bool:
        """Whether the ratio is within its bounds; NaN is not."""
        return self.least <= self.ratio <= self.most

    def __str__(self) -> str:
        """One line: the figure, its ratio to the record, its bounds, and whether it passes."""
        least = f"at least {self.least:.3f} and " if self.least else ""
        verdict = "ok" if self.passes else "FAILS"
        return f"{self.name:<36} {self.ratio:8.3f} of the record, {least}at most {self.most:.3f}   {verdict}"


def limits() -> dict[str, Any]:
    """Read the committed bounds and records."""
    with LIMITS.open("rb") as stream:
        return tomllib.load(stream)


def compared(found: Mapping[str, int], recorded: Mapping[str, int], change: float) -> list[Finding]:
    """Compare counts with the record; one that is missing in the record, or only there, has changed.

    Parameters
    ----------
    found
        Counted now.
    recorded
        Counts of the record.
    change
        Largest change that passes, as a share, more or less.
    """
    names = dict.fromkeys([*recorded, *found])
    ratios = {name: found.get(name, 0) / recorded[name] if name in recorded else float("nan") for name in names}
    return [Finding(name, ratio, 1.0 + change, 1.0 - change) for name, ratio in ratios.items()]


def within(
    works: Mapping[str, Work], reference: Work, record: Mapping[str, float], most: float, rounds: int = ROUNDS
) -> list[Finding]:
    """Time work in turn with a reference, until a round after which all of it passes.

    Parameters
    ----------
    works
        Work by name; each is done once before, untimed, as the reference is.
    reference
        What shares nothing with it.
    record
        Ratio of the least time of each to the least of the reference.
    most
        Largest ratio that passes, as a multiple of the record.
    rounds
        How many rounds at most.
    """
    for work in (reference, *works.values()):
        work()
    own, reference_s = dict.fromkeys(works, float("inf")), float("inf")
    findings: list[Finding] = []
    for _ in range(rounds):
        for name, work in works.items():
            reference_s = min(reference_s, cpu_seconds(reference))
            own[name] = min(own[name], cpu_seconds(work))
        findings = [Finding(f"time of {name}", own[name] / reference_s / record[name], most) for name in works]
        if all(each.passes for each in findings):
            break
    return findings


@numba.njit(nogil=True, error_model="numpy", fastmath={"contract"})
def reference_work(x: np.ndarray, times: int) -> None:
    """Iterate a polynomial map in the first-level cache: vector arithmetic that shares no code with the project."""
    for _ in range(times):
        for i in range(x.size):
            z = x[i]
            p = 0.3
            for _ in range(12):
                p = p * z + 0.1
            x[i] = p


def reference_loop() -> Work:
    """Return the reference, some 10 ms of work, compiled."""
    x = np.linspace(0.0, 0.5, 512)
    reference_work(x, 1)
    return lambda: reference_work(x, 100_000)


@functools.cache
def lanes() -> dict[str, Work]:
    """Return the timed work: designs in lanes, by the accuracy that they are computed with."""
    designs, readings = sample(ROWS), bk.corrected()

    def work(name: str) -> Work:
        control = bk.Control(STEPS[name].step_s, HORIZON, ROTATION_LIMIT, 0, name != "fast")
        return lambda: bk.simulate_table(designs, readings, control)

    return {name: work(name) for name in ("fast", "balanced")}


def calls() -> dict[str, int]:
    """Count the calls of kernels while a few designs are simulated; the compiler must be off."""
    tally = dict.fromkeys((*COUNTED, "all kernels"), 0)

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call" and "boulder_kernels" in frame.f_code.co_filename:
            tally["all kernels"] += 1
            with suppress(KeyError):
                tally[frame.f_code.co_name] += 1

    designs = sample(COUNTED_ROWS)
    control = bk.Control(STEPS["fast"].step_s, HORIZON, ROTATION_LIMIT, 0, False)
    with np.errstate(all="ignore"):
        sys.setprofile(note)
        try:
            bk.simulate_table(designs, bk.corrected(), control)
        finally:
            sys.setprofile(None)
    return {f"calls of {name}": count for name, count in tally.items()}


def designs_of_run() -> int:
    """Count the designs that a small run hands to the kernels."""
    import boulder_sweep
    from boulder_sweep.runner.run import run

    simulated: list[int] = []  # appending from several threads at once loses nothing

    def simulate(table: Any, *others: Any) -> Any:
        if threading.current_thread().name != PREPARING:
            simulated.append(len(table.L))
        return bk.simulate_table(table, *others)

    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as name:
        file = Path(name, "gate.yaml")
        file.write_text(RUN)
        run(boulder_sweep.load(file), Path(name, "table"), jobs=2, simulate=simulate)
    return sum(simulated)


def counts() -> dict[str, int]:
    """Count everything; calls in a process of its own, with the compiler off.

    Raises
    ------
    RuntimeError
        That process fails.
    """
    program = "import json; from benchmarks.gate import calls; print(json.dumps(calls()))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=FOLDER.parent, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"counting the calls failed:\n{done.stderr[-2000:]}")
    return {**json.loads(done.stdout), "designs simulated by a run": designs_of_run()}


def complaint(findings: Sequence[Finding]) -> str:
    """Return a message about what does not pass and what to do; empty if everything does."""
    bad = [str(each).removesuffix("FAILS").strip() for each in findings if not each.passes]
    if not bad:
        return ""
    return (
        f"benchmark gate: {'; '.join(bad)}. Counts that are meant to change are written into benchmarks/{LIMITS.name} "
        "from python -m benchmarks.gate --record; where time is lost, python -m benchmarks.accuracy kernel shows. Say "
        "in the commit why."
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gate", description=__doc__)
    parser.add_argument("--record", action="store_true", help="print the counts of now, and no more")
    if parser.parse_args().record:
        print("[counts]", *(f'"{name}" = {count}' for name, count in counts().items()), sep="\n")
        return 0
    print(machine())
    known = limits()
    record = known["time"]["record"]
    own = record.get(llvmlite.binding.get_host_cpu_name(), record[ANY_PROCESSOR])
    findings = compared(counts(), known["counts"], known["largest_change"])
    findings += within(lanes(), reference_loop(), own, known["time"]["most"])
    print(*findings, sep="\n")
    problem = complaint(findings)
    print(problem, end="\n" if problem else "", file=sys.stderr)
    return 1 if problem else 0


if __name__ == "__main__":
    sys.exit(main())
