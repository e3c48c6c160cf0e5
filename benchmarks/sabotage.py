"""Whether the gate stops what makes the project slower, and lets an untouched copy through beside busy programs.

Run as ``python -m benchmarks.sabotage`` on a machine that does nothing else. Each sabotage is made in a copy of the
sources. Those that counts show are also tests.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from . import counts
from .earlier import ROOT
from .findings import complaint, limits_of
from .gate import compared
from .timing import machine

UNTOUCHED, BUSY_PROGRAMS = 50, 4
BUSY = "import numpy as np\nx = np.ones(2_000_000)\nwhile True:\n    x *= 1.0\n"
"""A program that keeps a processor and its memory busy."""


class Sabotage(NamedTuple):
    """A change of one source that makes the project do more, or wait."""

    file: str
    old: str
    new: str
    shown_by: tuple[str, ...]
    """What of the gate shows it: of `counts.count` with its arguments, or a part that is timed."""
    counts: tuple[str, ...] = ()
    """Names of counts that must fail."""
    trials: int = 1


_STORED = "        store(ws, END_STATE, lane, y_end)\n"
_ATTEMPT = (
    '"""Advance every lane by its step, in one vectorised loop."""\n    align_stack()\n    for lane in range(LANES):\n'
)
_PROOF = "def barrier_energy(m: Maxima, c: Constants) -> float:\n"
_ONCE = "        out = simulate_lanes(given.designs, readings, control, given.soil, given.parts)\n"
_SIMULATED = "        outcomes = self.simulate(designs.table, self.readings, control)\n"
_TRIES = '        reason = ""\n        for _ in range(tries):\n'
_COMMITTED = "committer.start()\n"
_STAGED = "    storage.put(staged_name(staged.name, token, part.sha256), encoded.content)\n"
_STEP_TWICE = (
    "        y_end, k_end, _ = step(y_end, k_end, "
    "0.0 * field(ws, STEP, lane), load(ws, SWITCHES, lane), load(ws, CONSTANTS, lane))\n"
)
_DESIGN_TWICE = Sabotage("kernels/boulder_kernels/table.py", _ONCE, 2 * _ONCE, ("time",), trials=10)
SABOTAGES = {
    "a lane step done twice, by calls": Sabotage(
        "kernels/boulder_kernels/lane_steps.py",
        _STORED,
        _STEP_TWICE + _STORED,
        ("calls",),
        ("calls of step, lanes",),
        trials=10,
    ),
    "a lane step done twice, by machine code": Sabotage(
        "kernels/boulder_kernels/lane_steps.py",
        _STORED,
        _STEP_TWICE + _STORED,
        ("code", "attempt_steps"),
        ("flops of a step, machine code", "instructions of attempt_steps"),
    ),
    "a loop that is no longer vectorised": Sabotage(
        "kernels/boulder_kernels/lane_steps.py",
        _ATTEMPT,
        f"{_ATTEMPT}        if field(ws, STEP, lane) < 0.0:\n            return\n",
        ("code", "attempt_steps"),
        ("flops of a step, machine code",),
    ),
    "a proof of rest that no longer ends a simulation": Sabotage(
        "kernels/boulder_kernels/settling.py",
        _PROOF,
        f"{_PROOF}    return NO_PROOF\n\n\n{_PROOF.replace('barrier', 'unused_barrier')}",
        ("calls",),
        ("calls of step, lanes", "calls of step, one by one"),
    ),
    "a design simulated twice by the kernels, by calls": _DESIGN_TWICE._replace(
        shown_by=("calls",), counts=("calls of step, lanes",), trials=1
    ),
    "a design simulated twice by a run": Sabotage(
        "boulder_sweep/judge/evaluation.py",
        _SIMULATED,
        2 * _SIMULATED,
        ("run",),
        ("designs simulated in a run",),
    ),
    "a run that starts another thread": Sabotage(
        "boulder_sweep/runner/running.py",
        _COMMITTED,
        f"__import__('threading').Thread(target=int).start(); {_COMMITTED}",
        ("run",),
        ("threads started by a run",),
    ),
    "parts that are written twice": Sabotage(
        "boulder_sweep/store/writer.py",
        _STAGED,
        2 * _STAGED,
        ("run",),
        ("bytes written by a run", "flushes to the disk by a run"),
    ),
    "a file that nobody needs beside every part": Sabotage(
        "boulder_sweep/store/writer.py",
        _STAGED,
        f"{_STAGED}    storage.put('_size', str(len(encoded.content)).encode())\n",
        ("run",),
        ("files of a table", "flushes to the disk by a run"),
    ),
    "a design simulated twice by the kernels, by time": _DESIGN_TWICE,
    "kernels that keep the lock of the interpreter": Sabotage(
        "kernels/boulder_kernels/_jit.py", '{"nogil": True, ', '{"nogil": False, ', ("threads",)
    ),
    "a fifth of a second of sleep in every block": Sabotage(
        "boulder_sweep/runner/workers.py",
        _TRIES,
        f"        __import__('time').sleep(0.2)\n{_TRIES}",
        ("waiting",),
    ),
}


def sabotaged(folder: Path, sabotage: Sabotage) -> dict[str, str]:
    """Copy the sources into a folder, spoil one of them, and return the environment in which Python finds them.

    Raises
    ------
    ValueError
        The source is not what it was when the sabotage was written.
    """
    of_kernels = sabotage.file.startswith("kernels/")
    for name in ("benchmarks", "boulder_sweep", *(["kernels"] if of_kernels else [])):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "figures", "peers"))
    file = folder / sabotage.file
    text = file.read_text(encoding="utf-8")
    if text.count(sabotage.old) != 1:
        raise ValueError(f"{sabotage.file} does not have once what is to be replaced: {sabotage.old!r}")
    file.write_text(text.replace(sabotage.old, sabotage.new), encoding="utf-8")
    # Numba compiles what lies in another folder anew, so the copy leaves kernels that are not spoiled where they are.
    kernels = (folder if of_kernels else ROOT) / "kernels"
    environment = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{kernels}"}
    return environment | ({counts.CACHE_VARIABLE: str(folder / "cache")} if of_kernels else {})


def complaint_about_counts(folder: Path, environment: Mapping[str, str], sabotage: Sabotage) -> str:
    """What the gate says of those counts of a copy that show a sabotage."""
    found = counts.count(*sabotage.shown_by, folder=folder, environment=environment)
    recorded = counts.read()
    recorded = recorded._replace(counts={name: recorded.counts[name] for name in found})
    return complaint(compared(found, recorded, limits_of("counts")["largest_change"]))


def caught(folder: Path, sabotage: Sabotage) -> int:
    """Sabotage a copy in an empty folder, and return in how many trials the gate fails."""
    environment = sabotaged(folder, sabotage)
    if sabotage.counts:
        said = [complaint_about_counts(folder, environment, sabotage) for _ in range(sabotage.trials)]
        return sum(all(f"{name} (" in text for name in sabotage.counts) for text in said)
    return sabotage.trials - passed(*sabotage.shown_by, times=sabotage.trials, folder=folder, environment=environment)


def passed(*parts: str, times: int, folder: Path = ROOT, environment: Mapping[str, str] = os.environ) -> int:
    """Return how often the gate passes, with these parts, on the sources of a folder.

    Raises
    ------
    RuntimeError
        The gate did not come to an end.
    """
    command = [sys.executable, "-m", "benchmarks.gate", "--only", *parts, "--times", str(times)]
    done = subprocess.run(command, cwd=folder, env=dict(environment), capture_output=True, text=True, check=False)
    if (found := re.search(r"^passed (\d+) of", done.stdout, re.MULTILINE)) is None:
        raise RuntimeError(f"the gate failed:\n{done.stderr[-2000:]}")
    return int(found[1])


@contextmanager
def busy(programs: int = BUSY_PROGRAMS) -> Iterator[None]:
    """Keep the machine busy within the context."""
    running = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(programs)]
    try:
        yield
    finally:
        for program in running:
            program.kill()
            program.wait()


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sabotage", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=[*SABOTAGES, "untouched"], help="only these", metavar="NAME")
    wanted = parser.parse_args().only or [*SABOTAGES, "untouched"]
    print(machine())
    failed = 0
    for name in filter(SABOTAGES.get, wanted):
        with tempfile.TemporaryDirectory(prefix="sweep-sabotage-") as folder:
            stopped, trials = caught(Path(folder), SABOTAGES[name]), SABOTAGES[name].trials
        print(f"{name}: stopped {stopped} of {trials} times", flush=True)
        failed += stopped < trials
    if "untouched" in wanted:
        passed("time", times=1)  # compiles what is not compiled yet
        with busy():
            through = passed("time", times=UNTOUCHED)
        print(f"untouched beside {BUSY_PROGRAMS} busy programs: passed {through} of {UNTOUCHED} times")
        failed += through < UNTOUCHED
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
