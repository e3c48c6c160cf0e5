"""Counts of work that depend on no clock: instructions, flops, compiled functions, calls, and what a run does.

Instructions, flops and compiled functions are counted in machine code, which a process of its own compiles for one
named processor on whatever processor this is, from nothing. Calls are counted in another process, with the compiler
off, while a few designs are simulated; threads, bytes and designs in a third, during a small run. So the counts change
with the code and the compiler only, and a change of two per cent is a change.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from .flops import operations_in_machine_code, operations_of_step
from .report import FOLDER
from .small_run import counts_of_run
from .timing import versions

RECORD = FOLDER / "counts.toml"
TARGET = {"NUMBA_CPU_NAME": "x86-64-v4", "NUMBA_CPU_FEATURES": "-prefer-256-bit"}
"""The processor that the counted code is compiled for: one with 512-bit vectors, whatever this one is."""
KERNELS = ("attempt_steps", "run_lanes", "run_rows", "element_sums")
"""Kernels whose machine code is counted, with all that they call; a step in lanes is the first."""
DESIGNS = 64
"""Designs that are simulated with the compiler off."""
STEP_S = 0.012
CACHE_VARIABLE = "BOULDER_SWEEP_CACHE_DIR"
HEAD = """\
# What benchmarks.gate compares its counts with; written by python -m benchmarks.gate --record.
# Renew it in the commit that is meant to change them, and say there why they grow.
"""
Counts = dict[str, int]
_INSTRUCTION = re.compile(r"^\t[a-z]")
_SYMBOL = re.compile(r"^(\w[\w.$]*):")
_PROFILED = ("closed_form", "step", "work_out")


class Recorded(NamedTuple):
    """Counts with the compiler they were made with."""

    compiler: str
    counts: Counts


def measured() -> Counts:
    """Count everything; half a minute of CPU time.

    Raises
    ------
    RuntimeError
        The kernels cannot be compiled or run.
    """
    evaluation, step = operations_of_step()
    of_formulas = {"flops of an evaluation, formulas": evaluation.flops, "flops of a step, formulas": step.flops}
    return of_formulas | count("calls") | count("run") | count("code", *KERNELS)


def read(path: Path = RECORD) -> Recorded:
    """Read a record."""
    with path.open("rb") as stream:
        found = tomllib.load(stream)
    return Recorded(found["compiler"], found["counts"])


def write(counts: Counts, path: Path = RECORD) -> None:
    """Write a record."""
    lines = [f'compiler = "{compiler()}"', "", "[counts]", *(f'"{name}" = {count}' for name, count in counts.items())]
    path.write_text(HEAD + "\n".join(lines) + "\n")


def compiler() -> str:
    """What compiles the kernels, and for which processor."""
    return f"{versions('numba', 'llvmlite')}, {TARGET['NUMBA_CPU_NAME']}"


def count(what: str, *kernels: str, folder: Path | None = None, environment: Mapping[str, str] = os.environ) -> Counts:
    """Count in a process of its own, which finds no code compiled before where it counts that.

    Parameters
    ----------
    what
        ``calls``, ``run`` or ``code``.
    kernels
        For the code: which of `KERNELS`, the first ones in their order.
    folder
        Where Python finds the sources; the working directory by default.
    environment
        Variables of the process.

    Raises
    ------
    RuntimeError
        The process fails.
    """
    command = [sys.executable, "-m", "benchmarks.counts", what, *kernels]
    own = {"calls": {"NUMBA_DISABLE_JIT": "1"}, "run": {}, "code": TARGET}[what]
    done = subprocess.run(command, cwd=folder, env={**environment, **own}, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"counting the {what} failed:\n{done.stderr[-2000:]}")
    return Counts(json.loads(done.stdout))


def instructions(assembly: str) -> int:
    """Count the instructions in the text of machine code, without those of wrappers that Python calls it through."""
    count, counted = 0, False
    for line in assembly.splitlines():
        if symbol := _SYMBOL.match(line):
            counted = symbol[1].startswith("_ZN") and not symbol[1].startswith("_ZN7cpython")
        elif counted and _INSTRUCTION.match(line):
            count += 1
    return count


def _of_code(names: Sequence[str]) -> Counts:
    """Count in machine code; runs in a process with `TARGET`, and calls nothing that it compiles."""
    import numba
    import numpy as np

    import boulder_kernels as bk
    from boulder_kernels import lanes, soil
    from boulder_kernels import table as rows

    from .designs import HORIZON, ROTATION_LIMIT

    number = numba.float64
    control = numba.typeof(bk.Control(STEP_S, HORIZON, ROTATION_LIMIT, 0, False))
    table, how = numba.typeof(np.zeros((2, 2))), (numba.typeof(bk.corrected()), control)
    lane_arrays = numba.typeof(lanes.empty_workspace()), numba.typeof(lanes.empty_queue())
    nothing = numba.types.none
    lines = numba.types.NamedTuple([number] * len(soil.Kinematics._fields), soil.Kinematics)
    of_design = [numba.int64 if name == "elements" else number for name in bk.Constants._fields]
    constants = numba.types.NamedTuple(of_design, bk.Constants)
    found: dict[str, tuple[Any, tuple[Any, ...]]] = {
        "attempt_steps": (lanes.attempt_steps, (number[::1],)),
        "run_lanes": (lanes.run_lanes, (table, *how, *lane_arrays, table)),
        "run_rows": (
            rows.run_rows,
            (table, *(nothing,) * 3, *how, numba.typeof(bk.no_record()), table),
        ),
        "element_sums": (soil.element_sums, (lines, constants)),
    }
    counts: Counts = {}
    before = _compiled()
    for name in names:
        assembly = _assembly(*found[name])
        counts[f"instructions of {name}"] = instructions(assembly)
        if name == "attempt_steps":
            counts["flops of a step, machine code"] = operations_in_machine_code(assembly).flops
        there = _compiled()
        for kind, count in there.items():
            counts |= {f"{kind} compiled for {name}": count - before[kind]} if count > before[kind] else {}
        before = there
    return counts


def _compiled() -> Counts:
    """Count the kernels that were compiled for others in this process, and the types that they were compiled for."""
    from boulder_kernels._jit import Kernel

    modules = [module for name, module in sys.modules.items() if name.startswith("boulder_kernels")]
    kernels = {value for module in modules for value in vars(module).values() if isinstance(value, Kernel)}
    kinds = [len(kernel.overloads) for kernel in kernels if kernel.is_compiled]
    return {"functions": sum(kind > 0 for kind in kinds), "specialisations": sum(kinds)}


def _assembly(kernel: Any, signature: tuple[Any, ...]) -> str:
    """Compile a kernel anew, because code from the cache cannot be inspected, and return its machine code."""
    import numba

    from boulder_kernels._jit import compiler

    compiler()  # tells Numba of what is no kernel
    options = {name: value for name, value in kernel.options.items() if name not in ("cache", "nopython")}
    again = numba.njit(**options)(kernel.py_func)
    again.compile(signature)
    return str(again.inspect_asm(again.signatures[0]))


def _of_calls() -> Counts:
    """Count calls in the simulation of a few designs; runs in a process with the compiler off."""
    import numpy as np

    import boulder_kernels as bk
    from boulder_kernels.table import simulate_rows

    from .designs import HORIZON, ROTATION_LIMIT, sample

    designs = sample(DESIGNS)
    control = bk.Control(STEP_S, HORIZON, ROTATION_LIMIT, 0, False)
    counts: Counts = {}
    with np.errstate(all="ignore"):
        one_by_one = partial(simulate_rows, np.stack(designs), None, None, None)
        ways = (("lanes", partial(bk.simulate_table, designs)), ("one by one", one_by_one))
        for name, simulate in ways:
            tally = _calls_of(simulate, bk.corrected(), control)
            counts |= {f"calls of {called}, {name}": count for called, count in tally.items() if count}
    return counts


def _calls_of(simulate: Callable[..., object], *arguments: Any) -> Counts:
    """Count the calls of some kernels, and of all, during a simulation."""
    tally = dict.fromkeys((*_PROFILED, "all"), 0)

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call" and "boulder_kernels" in frame.f_code.co_filename:
            tally["all"] += 1
            with suppress(KeyError):
                tally[frame.f_code.co_name] += 1

    sys.setprofile(note)
    try:
        simulate(*arguments)
    finally:
        sys.setprofile(None)
    return tally


def _of_run() -> Counts:
    """Count during a small run; runs in a process with nothing else."""
    with tempfile.TemporaryDirectory(prefix="sweep-counts-") as name:
        return counts_of_run(Path(name))


if __name__ == "__main__":
    _, asked, *names = sys.argv
    print(json.dumps({"calls": _of_calls, "run": _of_run}[asked]() if asked != "code" else _of_code(names)))
