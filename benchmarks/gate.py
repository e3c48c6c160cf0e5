"""The gate: it fails if a change makes a key path markedly slower.

Run as ``python -m benchmarks.gate``; exit code 1 and a sentence for each path over its threshold. What depends on no
clock is counted and compared with the record in ``counts.toml``. The kernels are timed in turn with those before their
last change, key paths in turn with a reference loop that shares no code with the project, and only the ratios count:
they hardly depend on the speed or the load of the machine. What is too slow by the clock is measured again and fails
if it is too slow each time. The thresholds are in ``gate.toml``, with room for other machines. ``--record`` renews the
record.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels.design import design_at
from boulder_kernels.soil import Kinematics

from . import counts, earlier, together
from .designs import HORIZON, ROTATION_LIMIT, first, sample
from .loops import sum_elements_often
from .peak import PeakLoop
from .report import FOLDER
from .timing import cpu_seconds, machine, median_ratio

THRESHOLDS = FOLDER / "gate.toml"
PARTS = ("counts", "reference", "threads", "waiting", "earlier")
"""The last brings a second package of kernels into the process: Numba then tells the types of arguments more slowly."""
ROUNDS = 9
TRIES = 3
"""How often a measurement by the clock must fail before the gate does."""
ROWS = 4096
SCALAR_ROWS, SCALAR_STEP_S = 512, 0.008
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
    """One path over what it is compared with.

    Parameters
    ----------
    name
        Of the path.
    ratio
        Median ratio of its CPU time to that of the reference in the same round, or another ratio.
    threshold
        Largest ratio that passes.
    of
        What it is a ratio to.
    least
        Smallest ratio that passes.
    counted
        Whether it is of counts, which are to be neither larger nor smaller.
    """

    name: str
    ratio: float
    threshold: float
    of: str = "the reference"
    least: float = 0.0
    counted: bool = False

    @property
    def passes(self) -> bool:
        """Whether the path is fast enough; a ratio of NaN is not."""
        return self.least <= self.ratio <= self.threshold

    @property
    def bounds(self) -> str:
        """The ratios that pass."""
        most = f"at most {self.threshold:.3f}" if self.threshold < float("inf") else ""
        return " and ".join(filter(None, [f"at least {self.least:.3f}" if self.least > 0.0 else "", most]))

    def __str__(self) -> str:
        """One line: the path, its ratio, its threshold, and whether it passes."""
        verdict = "ok" if self.passes else ("CHANGED" if self.counted else "TOO SLOW")
        return f"{self.name:<36} {self.ratio:8.3f} of {self.of}, {self.bounds}   {verdict}"


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

    one = bk.Control(SCALAR_STEP_S, HORIZON, ROTATION_LIMIT, 0, False)
    record = bk.no_record()

    def one_by_one() -> None:
        for row in range(SCALAR_ROWS):
            bk.simulate_design(design_at(few, row), readings, one, record)

    return {
        "lanes_fast": lanes("fast", estimate=False),
        "lanes_balanced": lanes("balanced", estimate=True),
        "one_by_one": one_by_one,
        "element_sums": lambda: sum_elements_often(lines, with_elements, SUMS),
        "whole_run": lambda: run(sweep, folder / "table", overwrite=True, jobs=together.THREADS),
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
    return [Finding(name, _ratio(own[name], others[name]), thresholds[name]) for name in works]


def _ratio(own: list[float], others: list[float]) -> float:
    """Return the ratio of times measured in turn: the median of the rounds, or of the least times where it is less.

    What other programs take from the caches lengthens either only; without them both statistics give the same.
    """
    return min(median_ratio(own, others), min(own) / min(others))


def counted(found: counts.Counts, recorded: counts.Recorded, tolerance: float) -> list[Finding]:
    """Compare counts with the record; one that is missing in the record, or only there, has changed.

    Parameters
    ----------
    found
        Counted now.
    recorded
        Counts of the record.
    tolerance
        Largest change that passes, as a share.
    """
    compiler = "" if recorded.compiler == counts.compiler() else f" with {recorded.compiler}"
    return [
        Finding(
            name,
            found.get(name, 0) / recorded.counts[name] if name in recorded.counts else float("nan"),
            1.0 + tolerance,
            f"the record{compiler}",
            1.0 - tolerance,
            counted=True,
        )
        for name in dict.fromkeys([*recorded.counts, *found])
    ]


def against(kernels: Any, name: str, thresholds: Mapping[str, float], rounds: int = earlier.ROUNDS) -> list[Finding]:
    """Time the kernels in turn with others of that name."""
    found = earlier.ratios_to(kernels, rounds)._asdict()
    return [Finding(f"{cost}, in lanes", ratio, thresholds[cost], name) for cost, ratio in found.items()]


def at_once(gain: float, rounds: int = together.ROUNDS) -> list[Finding]:
    """Time the kernels in two threads and in one, in turn with the loop of multiply-adds; nothing on one core."""
    if len(os.sched_getaffinity(0)) < together.THREADS:
        print("only one core: two threads are not compared with one")
        return []
    designs, readings, peak = sample(2 * ROWS), bk.corrected(), PeakLoop()
    control = bk.Control(earlier.LONG_S, HORIZON, ROTATION_LIMIT, 0, False)
    ratio = together.gain_over(
        lambda: [bk.simulate_table(designs, readings, control) for _ in range(4)],
        lambda: [peak() for _ in range(16)],
        rounds,
    )
    return [Finding("two threads over one", ratio, float("inf"), "that of multiply-adds", gain)]


def idle(most: float, folder: Path, rounds: int = together.ROUNDS) -> list[Finding]:
    """Find out how much of the wall time of a whole run nothing is computed."""
    share = together.idle_share(paths(folder)["whole_run"], rounds)
    return [Finding("waiting in a whole run", share, most, "its wall time")]


def confirmed(measure: Callable[[], list[Finding]], tries: int = TRIES) -> list[Finding]:
    """Measure, and measure again what does not pass, unless it was counted: a change that costs speed fails every time.

    Parameters
    ----------
    measure
        Finds the same paths each time.
    tries
        How often at most.

    Returns
    -------
    list of Finding
        Of each path the first that passes, or the last.
    """
    found = measure()
    for _ in range(tries - 1):
        slow = [finding.name for finding in found if not finding.passes and not finding.counted]
        if not slow:
            break
        print(f"too slow, so measured again: {_named([each for each in found if each.name in slow])}", flush=True)
        again = {finding.name: finding for finding in measure()}
        found = [again[finding.name] if finding.name in slow else finding for finding in found]
    return found


def thresholds_of(path: Path = THRESHOLDS, section: str = "largest_ratio") -> dict[str, float]:
    """Read the committed thresholds."""
    with path.open("rb") as stream:
        return {name: float(value) for name, value in tomllib.load(stream)[section].items()}


def complaint(findings: list[Finding]) -> str:
    """Return a message about what is too slow and what to do; empty if nothing is."""
    slow = [finding for finding in findings if not finding.passes and not finding.counted]
    changed = [finding for finding in findings if not finding.passes and finding.counted]
    messages = []
    if slow:
        messages.append(
            f"benchmark gate: too slow: {_named(slow)}. Find the cause with python -m benchmarks.kernel; if the new "
            f"cost is worth it, raise the threshold in benchmarks/{THRESHOLDS.name} and say why."
        )
    if changed:
        messages.append(
            f"benchmark gate: counts have changed: {_named(changed)}. If the change is meant, renew the record by "
            "python -m benchmarks.gate --record and say why."
        )
    return "\n".join(messages)


def _named(findings: list[Finding]) -> str:
    return ", ".join(f"{each.name} ({each.ratio:.3f}, {each.bounds})" for each in findings)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gate", description=__doc__)
    parser.add_argument("--thresholds", type=Path, default=THRESHOLDS, help="another file of thresholds")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="how often each path is timed (default %(default)s)")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, help="only these parts")
    parser.add_argument("--record", action="store_true", help="write the counts of now into the record, and no more")
    arguments = parser.parse_args()
    if arguments.record:
        counts.write(counts.measured())
        return 0
    print(machine())
    findings: list[Finding] = []
    with tempfile.TemporaryDirectory(prefix="sweep-gate-") as name:
        for part in arguments.only:
            found = confirmed(_measurement(part, arguments.thresholds, arguments.rounds, Path(name)))
            for finding in found:
                print(finding, flush=True)
            findings += found
    problem = complaint(findings)
    if problem:
        print(problem, file=sys.stderr)
    return 1 if problem else 0


def _measurement(part: str, file: Path, rounds: int, folder: Path) -> Callable[[], list[Finding]]:
    """Prepare one of the `PARTS`; the result measures it."""
    if part == "counts":
        return lambda: counted(counts.measured(), counts.read(), thresholds_of(file, "counts")["largest_change"])
    if part == "earlier":
        return _against_earlier(thresholds_of(file, "earlier"), folder)
    if part == "reference":
        return lambda: judged(paths(folder), thresholds_of(file), rounds)
    if part == "threads":
        return lambda: at_once(thresholds_of(file, "threads")["least_gain"], rounds)
    return lambda: idle(thresholds_of(file, "waiting")["whole_run"], folder, rounds)


def _against_earlier(thresholds: Mapping[str, float], folder: Path) -> Callable[[], list[Finding]]:
    """Prepare the comparison with the kernels before their last change; with none where git does not have them."""
    commit = earlier.commit_before()
    if commit is None:
        print("git does not have the kernels before their last change: only the reference is compared with")
        return list
    kernels = earlier.kernels_of(commit, folder)
    if kernels is None:
        print(f"the kernels of {commit[:9]} are called differently: only the reference is compared with")
        return list
    return lambda: against(kernels, commit[:9], thresholds)


if __name__ == "__main__":
    sys.exit(main())
