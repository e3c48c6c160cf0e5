"""CPU time and memory in proportion to another checkout, such as an earlier version of the project.

Run as ``python -m benchmarks.ratio FOLDER``: kernels by four settings on random designs and on those of
``configs/m30_sizing.yaml``, whole runs of 10^6 designs from process start to table, and short commands. Each checkout
has a process and a folder of compiled kernels of its own. Both are timed in turn in every round, so that the load of
the machine hits both alike.
"""

from __future__ import annotations

import argparse
import importlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

FOLDER = Path(__file__).resolve().parent.parent
ROUNDS, RUN_ROUNDS, COMMAND_ROUNDS = 9, 3, 7
RUN_ROWS = 1_000_000


COMMANDS = {
    "simulate": ("simulate", "configs/rwg.yaml"),
    "run": ("run", "configs/rwg.yaml", "-o", "{table}", "--overwrite"),
    "need": ("need", "configs/site.yaml"),
    "check": ("check", "configs/rwg.yaml"),
}
"""Short commands, in the folder of a checkout."""
MEASURED = """
import resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(done.returncode)
"""
"""Runs a command, and prints its CPU time [s] and largest memory [kB]. A process of its own, because a command begins
with the memory of the process that starts it, and that counts."""


class Setting(NamedTuple):
    """How designs are simulated, by the steps that each checkout has for an accuracy."""

    accuracy: str
    printed: bool = False


SETTINGS = {name: Setting(name) for name in ("fast", "balanced", "fine")} | {"as_printed": Setting("balanced", True)}
"""Settings whose costs are compared."""


def tables() -> dict[str, dict[str, np.ndarray]]:
    """Designs that are simulated, by name, as columns of a `DesignTable`."""
    from boulder_sweep import load
    from boulder_sweep.judge.inputs import designs_of

    from .designs import DESIGNS, sample

    sweep = load(FOLDER / "configs" / "m30_sizing.yaml")
    grid = designs_of(sweep.block(0, sweep.n_designs)).table._asdict()
    every = max(sweep.n_designs // DESIGNS, 1)
    return {
        "random": sample()._asdict(),
        "m30_sizing": {name: np.ascontiguousarray(column[::every]) for name, column in grid.items()},
    }


class Kernels:
    """A process with the kernels of one checkout, which times them when asked to."""

    def __init__(self, checkout: Path, cache: Path, designs: Path) -> None:
        command = [sys.executable, "-P", str(Path(__file__).resolve()), str(designs)]  # not the modules beside this one
        self._process = subprocess.Popen(
            command, env=_environment(checkout, cache), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def cpu_s(self, designs: str, setting: Setting) -> float:
        """CPU time of one simulation of a table of designs [s]."""
        assert self._process.stdin is not None, "the pipe was asked for"
        assert self._process.stdout is not None, "the pipe was asked for"
        self._process.stdin.write(f"{designs} {setting.accuracy} {setting.printed:d}\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def end(self) -> None:
        """End the process."""
        self._process.communicate()


def answer_requests(designs: Path) -> None:
    """Time the kernels of this process as its standard input asks; the designs are the files of a folder."""
    import boulder_kernels as bk

    try:
        accuracy = importlib.import_module("boulder_sweep.judge.accuracy")
    except ModuleNotFoundError:  # versions before the first release have it elsewhere
        accuracy = importlib.import_module("boulder_sweep.accuracy")
    known = {
        file.stem: bk.DesignTable(*(np.ascontiguousarray(column) for column in np.load(file)))
        for file in designs.glob("*.npy")
    }
    for line in sys.stdin:
        name, asked, printed = line.split()
        steps = (accuracy.STEPS_PRINTED if printed == "1" else accuracy.STEPS)[asked]
        control = bk.Control(steps.step_s, 1.0, np.radians(20.0), 0, asked != "fast", True, steps.locate_yield)
        readings = bk.as_printed() if printed == "1" else bk.corrected()
        begun = time.process_time()
        bk.simulate_table(known[name], readings, control)
        print(time.process_time() - begun, flush=True)


def whole_run(checkout: Path, cache: Path, accuracy: str, folder: Path) -> tuple[float, float]:
    """CPU time [s] and largest memory [MB] of a ``sweep run``, from process start to table."""
    from .sweep import settings_of

    grid = folder / "grid.yaml"
    grid.write_text(settings_of(RUN_ROWS))
    with tempfile.TemporaryDirectory(dir=folder) as name:
        words = ("run", str(grid), "-o", f"{name}/table", "--jobs", "2", "--accuracy", accuracy, "--quiet")
        return command_of(checkout, cache, words)


def command_of(checkout: Path, cache: Path, words: Sequence[str]) -> tuple[float, float]:
    """CPU time [s] and largest memory [MB] of a command of a checkout.

    Raises
    ------
    RuntimeError
        It failed.
    """
    command = [sys.executable, "-S", "-c", MEASURED, sys.executable, "-m", "boulder_sweep", *words]
    environment = _environment(checkout, cache)
    done = subprocess.run(command, cwd=checkout, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)} in {checkout} ended with exit code {done.returncode}")
    cpu_s, memory_kB = map(float, done.stdout.split())
    return cpu_s, memory_kB / 1e3


def _environment(checkout: Path, cache: Path) -> dict[str, str]:
    """Return variables under which Python finds a checkout, compiled to bytecode as an installed package is."""
    path = os.pathsep.join((str(checkout), str(checkout / "kernels")))
    own = {"PYTHONPATH": path, "BOULDER_SWEEP_CACHE_DIR": str(cache), "PYTHONPYCACHEPREFIX": f"{cache}-bytecode"}
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | own


def compare_kernels(checkouts: tuple[Path, Path], caches: tuple[Path, Path], folder: Path, rounds: int) -> None:
    """Print the ratios of the kernels' times."""
    known = tables()
    for name, table in known.items():
        np.save(folder / f"{name}.npy", np.stack(list(table.values())))
    both = [Kernels(checkout, cache, folder) for checkout, cache in zip(checkouts, caches, strict=True)]
    print("kernels      designs     now [us]  other [us]  ratio of least, median of ratios")
    for setting_name, setting in SETTINGS.items():
        for name, table in known.items():
            count = len(table["L"])
            for kernels in both:
                kernels.cpu_s(name, setting)
            times = [[kernels.cpu_s(name, setting) for kernels in both] for _ in range(rounds)]
            now, other = (1e6 * min(column) / count for column in zip(*times, strict=True))
            ratio = median(a / b for a, b in times)
            print(f"{setting_name:<12} {name:<11} {now:8.3f} {other:11.3f}  {now / other:.3f}, {ratio:.3f}", flush=True)
    for kernels in both:
        kernels.end()


def compare_runs(checkouts: tuple[Path, Path], caches: tuple[Path, Path], folder: Path, rounds: int) -> None:
    """Print the ratios of the CPU times of whole runs, and the memory."""
    print("run of 10^6  now [s]  other [s]  ratio of least, median of ratios   memory [MB]")
    both = tuple(zip(checkouts, caches, strict=True))
    for accuracy in ("fast", "balanced"):
        for one in both:
            whole_run(*one, accuracy, folder)
        print_ratio(accuracy, [[whole_run(*one, accuracy, folder) for one in both] for _ in range(rounds)])


def compare_commands(checkouts: tuple[Path, Path], caches: tuple[Path, Path], folder: Path, rounds: int) -> None:
    """Print the same of short commands: the first one where nothing has been compiled, then the others, warm."""
    print("command      now [s]  other [s]  ratio of least, median of ratios   memory [MB]")
    both = tuple(zip(checkouts, caches, strict=True))

    def timed(name: str, fresh: str = "") -> list[tuple[float, float]]:
        words = [word.format(table=folder / "one.sweep") for word in COMMANDS[name]]
        return [command_of(checkout, Path(f"{cache}{fresh}"), words) for checkout, cache in both]

    print_ratio("run, first", [timed("run", "-fresh")])
    for name in COMMANDS:
        timed(name)
        print_ratio(name, [timed(name) for _ in range(rounds)])


def print_ratio(name: str, found: Sequence[Sequence[tuple[float, float]]]) -> None:
    """Print one line: CPU times of this and the other checkout by turns, their ratio, and the memory."""
    now, other = (min(run[0] for run in column) for column in zip(*found, strict=True))
    ratio = median(a[0] / b[0] for a, b in found)
    memory = [max(run[1] for run in column) for column in zip(*found, strict=True)]
    used = f"{memory[0]:.0f} and {memory[1]:.0f}"
    print(f"{name:<12} {now:7.2f} {other:10.2f}  {now / other:.3f}, {ratio:.3f}   {used}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ratio", description=__doc__)
    parser.add_argument("checkout", type=Path, help="folder of another checkout")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="how often the kernels are timed")
    parser.add_argument("--only", choices=("kernels", "runs", "commands"), help="only one part")
    arguments = parser.parse_args()
    checkouts = (FOLDER, arguments.checkout.resolve())
    with tempfile.TemporaryDirectory(prefix="sweep-ratio-") as name:
        folder = Path(name)
        caches = (folder / "cache-0", folder / "cache-1")
        if arguments.only in (None, "kernels"):
            compare_kernels(checkouts, caches, folder, arguments.rounds)
        if arguments.only in (None, "runs"):
            compare_runs(checkouts, caches, folder, RUN_ROUNDS)
        if arguments.only in (None, "commands"):
            compare_commands(checkouts, caches, folder, COMMAND_ROUNDS)


if __name__ == "__main__":
    if __package__:
        main()
    else:
        answer_requests(Path(sys.argv[1]))
