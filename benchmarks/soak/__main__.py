"""Kill, lose and stop what a run needs, by the hundred: ``python -m benchmarks.soak``.

Runs are started by the command line and killed with SIGKILL, some in a row, at moments drawn from the seed: after a
share of the usual time, at a change of the folder, or at a write into an object store, which the server holds until
the run is dead. Then they are resumed. Workers of Dask clusters are killed or stopped in the middle of runs, and
stopped ones go on when their run is dead and another one overwrites its table. Every table must be, bit for bit, that
of a run that nothing was done to, and whoever reads meanwhile sees right rows only, each once, and all that were
there before. The plan is the same for the same seed; what a process does just then is not.

Exit code 1 if a row is lost, doubled or wrong, a process hangs, a run fails, or time runs out. The tables of failed
trials are kept. Two quiet cores need about a quarter of an hour for everything.
"""

from __future__ import annotations

import argparse
import math
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..report import Table, write_between_markers
from .processes import HANG_S, WORKERS, Cluster, Store, end_all
from .trials import LARGE, OTHER_SPEED, Found, Reference, Trial, Usual, killed, left_over, plan, without_a_worker

SEED = 20263
KINDS = {
    "disk": "runs killed, local folder",
    "store": "runs killed, object store",
    "lost": f"one of {WORKERS} Dask workers killed",
    "stopped": f"one of {WORKERS} Dask workers stopped",
    "left-over": "overwritten while workers of a killed run go on",
}
WANTED = {"disk": 100, "store": 100, "lost": 50, "stopped": 20, "left-over": 5}
LANES = {"disk": 2, "store": 2, "lost": 2, "stopped": 5, "left-over": 1}
"""Trials at the same time; a run with a stopped worker only waits."""
_LEAST_OF_A_LANE = 4
"""Trials that are worth another lane, with a cluster of its own."""
MOST_MINUTES = 40.0
_MOST_MISSES = 20
"""Trials in which a run was over before anything was done to it."""


class Soak:
    """All trials.

    Parameters
    ----------
    folder
        For tables and logs.
    seed
        Of the plans.
    until
        When no trial is begun any more, by the monotonic clock [s].
    """

    def __init__(self, folder: Path, seed: int, until: float):
        self._folder, self._seed, self._until = folder, seed, until
        self._store: Store | None = None
        self._usual_of_store: Usual | None = None
        self._clusters = 0
        self._measuring = threading.Lock()
        self._trial("disk", "first").undisturbed()  # compiles the kernels, where they are not compiled
        frame, self._usual = self._trial("disk", "whole").undisturbed()
        self._reference = Reference(frame)
        say(f"a run takes {self._usual.seconds:.1f} s and {self._usual.changes} changes of the folder")

    def measure(self, kind: str, wanted: int) -> Found:
        """Do one kind of thing so many times, or a little more often."""
        total, begun = Found(kind), time.monotonic()
        numbers, taking = iter(range(wanted + _MOST_MISSES)), threading.Lock()

        def trials() -> Iterator[int]:
            while total.disturbed < wanted and time.monotonic() < self._until:
                with taking:
                    number = next(numbers, None)
                if number is None:
                    return
                yield number
                say(f"{kind}: {min(total.disturbed, wanted)} of {wanted}")

        work = {"disk": self._kill, "store": self._kill, "left-over": self._leave_over}.get(kind, self._disturb)
        with ThreadPoolExecutor(LANES[kind]) as pool:
            lanes = [
                pool.submit(work, kind, trials(), total)
                for _ in range(min(LANES[kind], -(-wanted // _LEAST_OF_A_LANE)))
            ]
            try:
                for lane in lanes:
                    if (problem := lane.exception()) is not None:
                        self._done(total, Found(kind, failures=[f"{kind}: {type(problem).__name__}: {problem}"]))
            except BaseException:  # Ctrl-C: the lanes must not go on
                self._until = -math.inf
                end_all()
                raise
        if total.disturbed < wanted:
            total.failures.append(f"{kind}: no more than {total.disturbed} of {wanted} came about")
        say(f"{kind}: {time.monotonic() - begun:.0f} s, {'right' if total.right else 'WRONG'}")
        return total

    def _trial(self, kind: str, which: object, reference: Reference | None = None) -> Trial:
        """Return a trial in a folder of its kind."""
        folder = self._folder / kind
        folder.mkdir(exist_ok=True)
        if kind == "store" and self._store is None:
            self._store = Store(self._folder)
        return Trial(f"{kind}-{which}", folder, reference, self._store if kind == "store" else None)

    def _done(self, total: Found, found: Found) -> None:
        """Add up, and tell what was wrong."""
        total.add(found)
        for failure in found.failures:
            say(f"WRONG: {failure}")
        if found.hangs:
            say(f"WRONG: {found.name}: {found.hangs} processes hung")

    def _kill(self, kind: str, numbers: Iterator[int], total: Found) -> None:
        """Kill runs."""
        usual = self._usual
        if kind == "store":
            with self._measuring:
                usual = self._usual_of_store = self._usual_of_store or self._trial(kind, "whole").undisturbed()[1]
        for number in numbers:
            trial = self._trial(kind, number, self._reference)
            self._done(total, killed(trial, plan(self._seed, kind, number), usual))

    def _disturb(self, kind: str, numbers: Iterator[int], total: Found) -> None:
        """Kill or stop workers, one for each run, on a cluster of this lane."""
        cluster: Cluster | None = None
        usual = Usual(0.0, 0)
        try:
            for number in numbers:
                if cluster is None:
                    cluster = self._cluster()
                    run = self._trial(kind, f"usual-{number}", self._reference)
                    usual = run.undisturbed("--backend", "dask", "--scheduler", cluster.address)[1]
                how = signal.SIGKILL if kind == "lost" else signal.SIGSTOP
                aim = plan(self._seed, kind, number)[0]._replace(signal=how)
                found = without_a_worker(self._trial(kind, number, self._reference), aim, usual, cluster, number)
                self._done(total, found)
                if found.right:
                    cluster.fill()
                else:  # whatever it has still in hand
                    cluster.close()
                    cluster = None
        finally:
            if cluster is not None:
                cluster.close()

    def _leave_over(self, kind: str, numbers: Iterator[int], total: Found) -> None:
        """Overwrite tables while workers of killed runs go on."""
        frame, _ = self._trial(kind, "whole").undisturbed(*LARGE, *OTHER_SPEED)
        reference, cluster = Reference(frame), self._cluster()
        try:
            # Workers that have computed before write their parts soon after they go on.
            self._trial(kind, "usual").undisturbed(*LARGE, "--backend", "dask", "--scheduler", cluster.address)
            for number in numbers:
                chance = random.Random(f"{self._seed} {kind} {number}")
                self._done(total, left_over(self._trial(kind, number, reference), chance, cluster))
        finally:
            cluster.close()

    def _cluster(self) -> Cluster:
        """Start a cluster."""
        with self._measuring:
            self._clusters += 1
            folder = self._folder / f"cluster-{self._clusters}"
        return Cluster(folder)


def say(text: str) -> None:
    """Tell how far it is."""
    print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)


def table(results: list[Found], seed: int, minutes: float) -> Table:
    """Return the results as a table."""
    found = Table(
        "soak",
        "Faults",
        f"399,600 designs in each table (left over: 1,598,400), seed {seed}, {minutes:.0f} minutes",
        ["what", "how often", "tables", "lost", "doubled", "wrong", f"hangs over {HANG_S:.0f} s", "other", "longest"],
    )
    for one in results:
        counts = (one.disturbed, one.tables, one.lost, one.doubled, one.wrong, one.hangs, len(one.failures))
        found.rows.append([KINDS[one.name], *(f"{count:,}" for count in counts), f"{one.longest_s:.1f} s"])
    found.notes = [
        "Lost, doubled, wrong: rows, summed over all looks at all tables. Other: trials that ended in another way than "
        "they should, or tables that could not be read, wrong rows included.",
        "Some of the rows, and not all, were there just then: "
        + ", ".join(
            f"{one.halfway} of {one.disturbed} ({KINDS[one.name]})" for one in results if one.name != "left-over"
        )
        + ".",
        "Longest: from what was done to a run, or from the start of the one that resumed it, to its end.",
    ]
    return found


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=__doc__.splitlines()[0])
    for kind, often in WANTED.items():
        parser.add_argument(f"--{kind}", type=int, default=often, metavar="N", help=f"{KINDS[kind]} [{often}]")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--minutes", type=float, default=MOST_MINUTES, help=f"at most so many [{MOST_MINUTES:g}]")
    parser.add_argument("--write", action="store_true", help="write the table into benchmarks/README.md")
    arguments = parser.parse_args()
    wanted = {kind: getattr(arguments, kind.replace("-", "_")) for kind in KINDS}
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    folder, begun = Path(tempfile.mkdtemp(prefix="soak-")), time.monotonic()
    try:
        soak = Soak(folder, arguments.seed, begun + 60.0 * arguments.minutes)
        results = [soak.measure(kind, wanted[kind]) for kind in KINDS if wanted[kind]]
    finally:
        end_all()
    found = table(results, arguments.seed, (time.monotonic() - begun) / 60.0)
    print(found.markdown())
    if arguments.write:
        write_between_markers([found])
    for failure in (failure for one in results for failure in one.failures):
        print(failure, file=sys.stderr)
    right = all(one.right for one in results)
    if right:
        shutil.rmtree(folder)
    else:
        say(f"what is left of it is in {folder}")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
