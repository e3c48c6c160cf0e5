"""The gate: it fails if a change makes a key path markedly slower.

Run as ``python -m benchmarks.gate``; exit code 1 and a sentence for each path over its threshold. Every path is timed
in turn with a reference loop that shares no code with the project, and only the ratio counts: it hardly
depends on the speed or the load of the machine. The thresholds are in ``gate.toml``, with room for other machines.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels.design import design_at
from boulder_kernels.soil import Kinematics

from .designs import HORIZON, ROTATION_LIMIT, first, sample
from .loops import sum_elements_often
from .report import FOLDER
from .timing import cpu_seconds, machine, median_ratio

THRESHOLDS = FOLDER / "gate.toml"
ROUNDS = 9
ROWS = 4096
SCALAR_ROWS = 512
ELEMENTS = 5000
SUMS = 3000
RUN_ROWS = 20_000
RUN_SETTINGS = """\
name: gate
boulder: {length: 1.65 m, width: {from: 0.8 m, to: 2.5 m, count: 20}, height: {from: 1.6 m, to: 4.0 m, count: 20},
          density: 2596 kg/m^3}
site: {embedment_ratio: {from: 0.40, to: 0.70, count: 10}}
soil: {density: 1859.9 kg/m^3, friction_angle: 40 deg,
       subgrade_reaction: {from: 45 MN/m^3, to: 110 MN/m^3, count: 5}, strain_rate_factor: 1.0}
vehicle: {mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.5 m,
          hood_height: 1.4 m, bed_offset: 2.9 m}
criterion: {max_rotation: 20 deg, rating: P1}
model: {readings: corrected, soil: closed_form}
solver: {accuracy: balanced, horizon: 1 s}
"""


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


@dataclass(frozen=True)
class Finding:
    """One path over the reference.

    Parameters
    ----------
    name
        Of the path.
    ratio
        Median ratio of its CPU time to that of the reference in the same round.
    threshold
        Largest ratio that passes.
    """

    name: str
    ratio: float
    threshold: float

    @property
    def passes(self) -> bool:
        """Whether the path is fast enough; a ratio of NaN is not."""
        return self.ratio <= self.threshold

    def __str__(self) -> str:
        """One line: the path, its ratio, its threshold, and whether it passes."""
        verdict = "ok" if self.passes else "TOO SLOW"
        return f"{self.name:<24} {self.ratio:8.3f} of the reference, at most {self.threshold:8.3f}   {verdict}"


def paths(folder: Path) -> dict[str, Callable[[], object]]:
    """Key paths by name; `folder` takes the tables of whole runs."""
    from boulder_sweep import load
    from boulder_sweep.judge.accuracy import STEPS
    from boulder_sweep.runner.sweeper import run

    designs = sample(ROWS)
    few = first(designs, SCALAR_ROWS)
    readings = bk.corrected()
    with_elements = bk.constants_of(design_at(designs, 0), readings, ELEMENTS)
    lines = Kinematics(0.05, 0.03, 2.0, 0.5, 0.4, 1.5)
    settings = folder / "gate.yaml"
    settings.write_text(RUN_SETTINGS)
    sweep = load(settings)
    if sweep.n_designs != RUN_ROWS:
        raise ValueError(f"the grid of the gate has {sweep.n_designs} designs, not {RUN_ROWS}")

    def lanes(name: str, *, estimate: bool) -> Callable[[], object]:
        control = bk.Control(STEPS[name].step_s, HORIZON, ROTATION_LIMIT, 0, estimate)
        return lambda: bk.simulate_table(designs, readings, control)

    one = bk.Control(STEPS["balanced"].step_s, HORIZON, ROTATION_LIMIT, 0, False)
    record = bk.no_record()

    def one_by_one() -> None:
        for row in range(SCALAR_ROWS):
            bk.simulate_design(design_at(few, row), readings, one, record)

    return {
        "lanes_fast": lanes("fast", estimate=False),
        "lanes_balanced": lanes("balanced", estimate=True),
        "one_by_one": one_by_one,
        "element_sums": lambda: sum_elements_often(lines, with_elements, SUMS),
        "whole_run": lambda: run(sweep, folder / "table", overwrite=True),
    }


def judged(
    works: Mapping[str, Callable[[], object]], thresholds: Mapping[str, float], rounds: int = ROUNDS
) -> list[Finding]:
    """Time paths alternately with the reference and compare the ratios with the thresholds.

    Parameters
    ----------
    works
        Paths by name; each is done once before, uncounted.
    thresholds
        Largest ratio of each.
    rounds
        How often each is timed.

    Raises
    ------
    ValueError
        A path has no threshold, or a threshold no path.
    """
    if set(works) != set(thresholds):
        raise ValueError(f"paths and thresholds differ: {sorted(set(works) ^ set(thresholds))}")
    x = np.linspace(0.0, 0.5, 512)

    def reference() -> None:
        reference_work(x, 100_000)

    reference()
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
    return [Finding(name, median_ratio(own[name], others[name]), thresholds[name]) for name in works]


def thresholds_of(path: Path = THRESHOLDS) -> dict[str, float]:
    """Read the committed thresholds."""
    with path.open("rb") as stream:
        return {name: float(value) for name, value in tomllib.load(stream)["largest_ratio"].items()}


def complaint(findings: list[Finding]) -> str:
    """Return a message about what is too slow and what to do; empty if nothing is."""
    slow = [finding for finding in findings if not finding.passes]
    if not slow:
        return ""
    names = ", ".join(f"{f.name} ({f.ratio:.3f}, at most {f.threshold:.3f})" for f in slow)
    return (
        f"benchmark gate: too slow: {names}. Find the cause with python -m benchmarks.kernel; if the new cost "
        f"is worth it, raise the threshold in benchmarks/{THRESHOLDS.name} and say why."
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gate", description=__doc__)
    parser.add_argument("--thresholds", type=Path, default=THRESHOLDS, help="another file of thresholds")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="how often each path is timed (default %(default)s)")
    arguments = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as folder:
        findings = judged(paths(Path(folder)), thresholds_of(arguments.thresholds), arguments.rounds)
    for finding in findings:
        print(finding)
    problem = complaint(findings)
    if problem:
        print(problem, file=sys.stderr)
    return 1 if problem else 0


if __name__ == "__main__":
    sys.exit(main())
