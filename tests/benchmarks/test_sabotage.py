"""The gate stops what makes the kernels or a run slower, and lets an unchanged copy through on a busy machine.

Each sabotage is made in a copy of the sources, and the gate is run on the copy.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import boulder_kernels as bk
from benchmarks import counts, gate

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
TRIALS = 20
BUSY = "import numpy as np\nx = np.ones(2_000_000)\nwhile True:\n    x *= 1.0\n"
"""A program that keeps a processor and its memory busy."""


def sabotaged(folder: Path, *sources: str, file: str, old: str, new: str) -> dict[str, str]:
    """Copy sources, spoil one of them, and return the environment in which it is imported."""
    for name in ("benchmarks", *sources):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "figures"))
    text = (folder / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    kernels = folder if "kernels" in sources else ROOT
    return os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{kernels / 'kernels'}"}


def complaint_about_counts(folder: Path, environment: dict[str, str], kernels: tuple[str, ...]) -> str:
    """What the gate says of the counts of a copy."""
    code = f"import json; from benchmarks import counts; print(json.dumps(counts.measured({kernels!r})))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=environment, check=True, capture_output=True, text=True
    )
    found = json.loads(done.stdout)
    recorded = counts.read()
    compared = recorded._replace(counts={name: recorded.counts[name] for name in found})
    return gate.complaint(gate.counted(found, compared, gate.thresholds_of(section="counts")["largest_change"]))


def run_gate(folder: Path, environment: dict[str, str], part: str) -> subprocess.CompletedProcess[str]:
    """Run the command on a copy."""
    command = [sys.executable, "-m", "benchmarks.gate", "--only", part]
    return subprocess.run(command, cwd=folder, env=environment, check=False, capture_output=True, text=True)


@pytest.mark.compiled
def test_a_lane_step_done_twice_fails(tmp_path):
    after = "        store(ws, END_STATE, lane, y_end)\n"
    again = "0.0 * field(ws, STEP, lane), load(ws, SWITCHES, lane), load(ws, CONSTANTS, lane)"
    environment = sabotaged(
        tmp_path,
        "kernels",
        file="kernels/boulder_kernels/lane_steps.py",
        old=after,
        new=f"        y_end, k_end = step(y_end, k_end, {again})\n{after}",
    )
    complaint = complaint_about_counts(tmp_path, environment, ("attempt_steps",))
    for name in ("flops of a step, machine code", "instructions of attempt_steps", "calls of step, lanes"):
        assert f"{name} (1." in complaint or f"{name} (2." in complaint


@pytest.mark.compiled
def test_a_loop_that_is_no_longer_vectorised_fails(tmp_path):
    loop = '"""Advance every lane by its step, in one vectorised loop."""\n    align_stack()\n'
    loop += "    for lane in range(LANES):\n"
    environment = sabotaged(
        tmp_path,
        "kernels",
        file="kernels/boulder_kernels/lane_steps.py",
        old=loop,
        new=f"{loop}        if field(ws, STEP, lane) < 0.0:\n            return\n",
    )
    complaint = complaint_about_counts(tmp_path, environment, ("attempt_steps",))
    assert "flops of a step, machine code (0." in complaint


def test_a_proof_of_rest_that_no_longer_ends_a_simulation_fails(tmp_path):
    line = "def barrier_energy(m: Maxima, c: Constants) -> float:\n"
    environment = sabotaged(
        tmp_path,
        "kernels",
        file="kernels/boulder_kernels/settling.py",
        old=line,
        new="def barrier_energy(m: Maxima, c: Constants) -> float:\n    return NO_PROOF\n\n\n"
        "def unused_barrier_energy(m: Maxima, c: Constants) -> float:\n",
    )
    complaint = complaint_about_counts(tmp_path, environment, ())
    assert "calls of step, lanes (" in complaint
    assert "calls of step, one by one (" in complaint


@pytest.mark.compiled
def test_kernels_that_keep_the_lock_of_the_interpreter_fail(tmp_path):
    if len(os.sched_getaffinity(0)) < 2:
        return
    environment = sabotaged(
        tmp_path,
        "kernels",
        "boulder_sweep",
        file="kernels/boulder_kernels/_jit.py",
        old='{"nogil": True, ',
        new='{"nogil": False, ',
    )
    done = run_gate(tmp_path, environment, "threads")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "too slow: two threads over one (0." in done.stderr


@pytest.mark.compiled
def test_a_fifth_of_a_second_of_sleep_in_every_block_fails(tmp_path):
    before = '        reason = ""\n        for _ in range(tries):\n'
    environment = sabotaged(
        tmp_path,
        "boulder_sweep",
        file="boulder_sweep/runner/computing.py",
        old=before,
        new=f"        __import__('time').sleep(0.2)\n{before}",
    )
    done = run_gate(tmp_path, environment, "waiting")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "too slow: waiting in a whole run (" in done.stderr


@contextmanager
def busy(programs: int) -> Iterator[None]:
    """Keep the machine busy within the context."""
    running = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(programs)]
    try:
        yield
    finally:
        for program in running:
            program.kill()
            program.wait()


@pytest.mark.compiled
def test_an_unchanged_copy_passes_on_a_busy_machine(tmp_path):
    """With fewer rounds than the gate itself has, which is steadier still."""
    works = gate.paths(tmp_path)
    measurements = (
        lambda: gate.judged(works, gate.thresholds_of(), rounds=1),
        lambda: gate.against(bk, "themselves", gate.thresholds_of(section="earlier"), rounds=9),
        lambda: gate.at_once(gate.thresholds_of(section="threads")["least_gain"], rounds=3),
        lambda: gate.idle(gate.thresholds_of(section="waiting")["whole_run"], tmp_path, rounds=2),
    )
    gate.judged(works, gate.thresholds_of(), rounds=1)
    failed = []
    with busy(programs=len(os.sched_getaffinity(0))):
        for _ in range(TRIALS):
            findings = [finding for measure in measurements for finding in gate.confirmed(measure)]
            failed += filter(None, [gate.complaint(findings)])
    assert len(failed) <= TRIALS // 20, "\n".join(failed)
