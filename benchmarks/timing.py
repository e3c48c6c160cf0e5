"""CPU time of a piece of work, the machine it was taken on, and versions.

CPU time rather than wall time, because other processes may use the machine; the minimum of several repeats, because any
disturbance makes a measurement longer.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import TypeVar

Result = TypeVar("Result")


def cpu_seconds(work: Callable[[], object]) -> float:
    """Return the CPU time of all threads of this process while work is done once [s]."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def timed(work: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """Do compiled work several times; return its result and the minimum CPU time [s]."""
    best, result = float("inf"), None
    for _ in range(repeats):
        begun = time.process_time()
        result = work()
        best = min(best, time.process_time() - begun)
    assert result is not None, "there must be one repeat at least"
    return result, best


def interleaved(works: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """CPU times of several pieces of work, done in turn so that a change of clock speed affects all of them [s].

    Parameters
    ----------
    works
        Work by name; each is done once before, uncounted.
    rounds
        How often each is done.
    """
    for work in works.values():
        work()
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            times[name].append(cpu_seconds(work))
    return times


def median_ratio(times: list[float], others: list[float]) -> float:
    """Return the median ratio of times measured in turn."""
    return median(a / b for a, b in zip(times, others, strict=True))


def processor() -> str:
    """Name of the processor."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def machine() -> str:
    """Processor, cores and width of its vectors, in one line."""
    import llvmlite.binding

    features = llvmlite.binding.get_host_cpu_features()
    vectors = next((name for name in ("avx512f", "avx2", "sse2") if features.get(name)), "no known vectors")
    return f"{processor()} ({llvmlite.binding.get_host_cpu_name()}, {vectors}), {os.cpu_count()} cores"


def here() -> str:
    """Machine, Python, and versions of what speed depends on, in one line."""
    found = (f"{package} {version(package)}" for package in ("numba", "llvmlite", "numpy", "scipy"))
    return f"{machine()}; {', '.join([f'Python {platform.python_version()}', *found])}"
