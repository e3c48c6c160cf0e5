"""The gate: it fails if a change makes the project do more, or its kernels take half as long again.

Run as ``python -m benchmarks.gate``; exit code 1 and a sentence for what fails. Whatever depends on no clock is counted
and compared with the record in ``counts.toml``, which ``--record`` renews. One thing is timed: designs in lanes, in
turn with a loop that shares no code with the project. Other programs make either only slower, so the least times of up
to nine rounds count, and a machine that is busy for a while is no reason to fail. ``--timed`` times everything finer,
on a machine that does nothing else, see ``timed.py``.
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Callable, Mapping

import llvmlite.binding

import boulder_kernels as bk
from boulder_sweep.judge.accuracy import STEPS

from . import counts, timed
from .designs import HORIZON, ROTATION_LIMIT, sample
from .findings import Finding, complaint, limits_of
from .timing import cpu_seconds, machine

ROUNDS = 9
ROWS = 4096
ANY_PROCESSOR = "any"
"""Whose record holds for processors without one of their own."""

Work = Callable[[], object]


def compared(found: counts.Counts, recorded: counts.Recorded, change: float) -> list[Finding]:
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
    of = "the record" if recorded.compiler == counts.compiler() else f"the record with {recorded.compiler}"
    ratios = {
        name: found.get(name, 0) / recorded.counts[name] if name in recorded.counts else float("nan")
        for name in dict.fromkeys([*recorded.counts, *found])
    }
    return [Finding(name, ratio, 1.0 + change, 1.0 - change, of) for name, ratio in ratios.items()]


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


@functools.cache
def lanes() -> dict[str, Work]:
    """The timed designs in lanes, by the accuracy that they are computed with."""
    designs, readings = sample(ROWS), bk.corrected()

    def work(name: str) -> Work:
        control = bk.Control(STEPS[name].step_s, HORIZON, ROTATION_LIMIT, 0, name != "fast")
        return lambda: bk.simulate_table(designs, readings, control)

    return {name: work(name) for name in ("fast", "balanced")}


def _counts() -> list[Finding]:
    return compared(counts.measured(), counts.read(), limits_of("counts")["largest_change"])


def _time() -> list[Finding]:
    limits = limits_of("time")
    record = limits["record"]
    own = record.get(llvmlite.binding.get_host_cpu_name(), record[ANY_PROCESSOR])
    return within(lanes(), timed.reference_loop(), own, limits["most"])


PARTS = {"counts": _counts, "time": _time}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gate", description=__doc__)
    parser.add_argument("--timed", action="store_true", help="instead, time what only a quiet machine can tell")
    parser.add_argument("--only", nargs="+", choices=[*PARTS, *timed.PARTS], help="only these parts")
    parser.add_argument("--times", type=int, default=1, help="how often; each must pass (default %(default)s)")
    parser.add_argument("--record", action="store_true", help="write the counts of now into the record, and no more")
    arguments = parser.parse_args()
    if arguments.record:
        counts.write(counts.measured())
        return 0
    print(machine())
    parts = PARTS | timed.PARTS
    passed = 0
    for _ in range(arguments.times):
        findings: list[Finding] = []
        for part in arguments.only or (timed.PARTS if arguments.timed else PARTS):
            found = parts[part]()
            print(*found, sep="\n", flush=True)
            findings += found
        problem = complaint(findings)
        print(problem, end="\n" if problem else "", file=sys.stderr, flush=True)
        passed += not problem
    print(f"passed {passed} of {arguments.times}")
    return 0 if passed == arguments.times else 1


if __name__ == "__main__":
    sys.exit(main())
