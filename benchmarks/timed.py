"""What the gate times only when asked to, on a machine that does nothing else: ``python -m benchmarks.gate --timed``.

Single paths in proportion to a loop that shares no code with the project, the kernels to those before their last
change, two threads to one, and how much of a whole run is spent waiting. The bounds are in ``gate.toml``.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels.design import design_at
from boulder_kernels.soil import Kinematics

from . import earlier, small_run, together
from .designs import HORIZON, ROTATION_LIMIT, first, sample
from .findings import Finding, limits_of
from .loops import sum_elements_often
from .peak import PeakLoop
from .timing import cpu_seconds, median_ratio

ROUNDS = 9
ROWS = 4096
SCALAR_ROWS, SCALAR_STEP_S = 512, 0.008
ELEMENTS = 5000
SUMS = 3000


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


def reference_loop() -> Callable[[], None]:
    """Return the reference, some 10 ms of work, compiled."""
    x = np.linspace(0.0, 0.5, 512)
    reference_work(x, 1)
    return lambda: reference_work(x, 100_000)


def paths(folder: Path) -> dict[str, Callable[[], object]]:
    """Key paths by name; `folder` takes the tables of whole runs."""
    from boulder_sweep.runner.sweeper import run

    designs = sample(ROWS)
    few = first(designs, SCALAR_ROWS)
    readings = bk.corrected()
    with_elements = bk.constants_of(design_at(designs, 0), readings, ELEMENTS)
    lines = Kinematics(0.05, 0.03, 2.0, 0.5, 0.4, 1.5)
    sweep = small_run.loaded(folder)
    one = bk.Control(SCALAR_STEP_S, HORIZON, ROTATION_LIMIT, 0, False)
    record = bk.no_record()

    def one_by_one() -> None:
        for row in range(SCALAR_ROWS):
            bk.simulate_design(design_at(few, row), readings, one, record)

    return {
        "one_by_one": one_by_one,
        "element_sums": lambda: sum_elements_often(lines, with_elements, SUMS),
        "whole_run": lambda: run(sweep, folder / "table", overwrite=True, jobs=small_run.JOBS),
    }


def judged(
    works: Mapping[str, Callable[[], object]], limits: Mapping[str, float], rounds: int = ROUNDS
) -> list[Finding]:
    """Time paths alternately with the reference; the medians of the ratios, or the ratios of the least times if less.

    Parameters
    ----------
    works
        Paths by name; each is done once before, uncounted.
    limits
        Largest ratio of each.
    rounds
        How often each is timed.

    Raises
    ------
    ValueError
        A path has no limit, or a limit no path.
    """
    if set(works) != set(limits):
        raise ValueError(f"paths and limits differ: {sorted(set(works) ^ set(limits))}")
    reference = reference_loop()
    for work in works.values():
        work()
    own: dict[str, list[float]] = {name: [] for name in works}
    others: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            # The reference runs before and after, so that a change of clock speed in between affects both.
            before = cpu_seconds(reference)
            own[name].append(cpu_seconds(work))
            others[name].append(0.5 * (before + cpu_seconds(reference)))
    ratios = {name: min(median_ratio(own[name], others[name]), min(own[name]) / min(others[name])) for name in works}
    return [Finding(name, ratio, limits[name], of="the reference") for name, ratio in ratios.items()]


def against(kernels: Any, name: str, limits: Mapping[str, float], rounds: int = earlier.ROUNDS) -> list[Finding]:
    """Time the kernels in turn with others of that name."""
    found = earlier.ratios_to(kernels, rounds)._asdict()
    return [Finding(f"{cost}, in lanes", ratio, limits[cost], of=name) for cost, ratio in found.items()]


def _paths() -> list[Finding]:
    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as name:
        return judged(paths(Path(name)), limits_of("paths"))


def _threads() -> list[Finding]:
    """Time the kernels in two threads and in one, in turn with the loop of multiply-adds; nothing on one core."""
    if len(os.sched_getaffinity(0)) < together.THREADS:
        print("only one core: two threads are not compared with one")
        return []
    designs, readings, peak = sample(2 * ROWS), bk.corrected(), PeakLoop()
    control = bk.Control(earlier.LONG_S, HORIZON, ROTATION_LIMIT, 0, False)
    ratio = together.gain_over(
        lambda: [bk.simulate_table(designs, readings, control) for _ in range(4)], lambda: [peak() for _ in range(16)]
    )
    least = limits_of("threads")["least_gain"]
    return [Finding("two threads over one", ratio, least=least, of="that of multiply-adds")]


def _waiting() -> list[Finding]:
    """Find out how much of the wall time of a whole run nothing is computed."""
    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as name:
        share = together.idle_share(paths(Path(name))["whole_run"])
    return [Finding("waiting in a whole run", share, limits_of("waiting")["whole_run"], of="its wall time")]


def _earlier() -> list[Finding]:
    """Time the kernels against those before their last change; nothing where git does not have them."""
    commit = earlier.commit_before()
    if commit is None:
        print("git does not have the kernels before their last change: they are not compared")
        return []
    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as name:
        kernels = earlier.kernels_of(commit, Path(name))
        if kernels is None:
            print(f"the kernels of {commit[:9]} are called differently: they are not compared")
            return []
        return against(kernels, commit[:9], limits_of("earlier"))


PARTS: dict[str, Callable[[], list[Finding]]] = {
    "paths": _paths,
    "threads": _threads,
    "waiting": _waiting,
    "earlier": _earlier,
}
"""The last brings a second package of kernels into the process: Numba then tells the types of arguments more slowly."""
