"""Two threads against one, and the time in which a whole run does nothing: what CPU time does not show.

Both are found by looking at what the threads do, not from wall time: what other programs take of the processors, or
other machines of those of a virtual one, lengthens only that.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection
from statistics import median
from types import TracebackType
from typing import NamedTuple, Self

THREADS = 2
ROUNDS = 9
_LOOKING = """
import json, os, select, sys
folder, seen = f"/proc/{sys.argv[1]}/task", {}
print("begun", flush=True)
while not select.select([sys.stdin], [], [], 0.002)[0]:
    awake, asleep = [], []
    for thread in os.listdir(folder) if os.path.isdir(folder) else ():
        try:
            with open(f"{folder}/{thread}/stat") as stat:
                sleeps = stat.read().rpartition(")")[2].split()[0] not in ("R", "D")
        except OSError:
            continue  # the thread has ended meanwhile
        (asleep if sleeps else awake).append(int(thread))
    look = json.dumps([sorted(awake), sorted(asleep)])
    seen[look] = seen.get(look, 0) + 1
print(json.dumps([[*json.loads(look), count] for look, count in seen.items()]))
"""
"""Program that counts looks by which threads of a process they find awake, and which asleep: those that neither run,
nor are ready to run (R), nor wait for the disk (D)."""


class Looking:
    """Another process that looks every two milliseconds at which threads of this one sleep, within a context.

    A thread that waits for its turn on a processor does not sleep. Read the shares after the context.
    """

    def __enter__(self) -> Self:
        """Return once the other process looks."""
        command = [sys.executable, "-S", "-c", _LOOKING, str(os.getpid())]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None, "the pipe was asked for"
        self._process.stdout.readline()  # it has begun
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the other process and take its counts."""
        found = json.loads(self._process.communicate()[0])
        self._looks = [(set(awake), set(asleep), count) for awake, asleep, count in found if awake or asleep]

    @property
    def idle(self) -> float:
        """Share of the looks at which every thread slept; NaN where the system does not show the states of threads."""
        idle = sum(count for awake, _, count in self._looks if not awake)
        return idle / whole if (whole := sum(count for *_, count in self._looks)) else float("nan")

    def asleep(self, thread: int) -> float:
        """Share of the looks at which the thread of that native identifier slept; 0 where no look met it."""
        looks = [(thread in asleep, count) for awake, asleep, count in self._looks if thread in awake | asleep]
        return sum(slept * count for slept, count in looks) / max(sum(count for _, count in looks), 1)

    def one_asleep(self, threads: Collection[int]) -> float:
        """Share of the looks that met all of these threads at which not all were awake; 0 where none met all."""
        looks = [(asleep, count) for awake, asleep, count in self._looks if awake | asleep >= set(threads)]
        slept = sum(count for asleep, count in looks if not asleep.isdisjoint(threads))
        return slept / max(sum(count for _, count in looks), 1)


def in_threads(work: Callable[[], object], count: int = THREADS) -> None:
    """Do the same work in several threads at once."""
    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def gain_over(work: Callable[[], object], reference: Callable[[], object], rounds: int = ROUNDS) -> float:
    """How much faster two threads are than one, over the same of a reference that shares nothing.

    Where the host gives two processors the time of one, two threads of the reference gain nothing, either. So the
    result is also at most the share of the two threads that is awake until the first one ends.

    Returns
    -------
    float
        Median over the rounds: 1 where the work of two threads runs at once as far as the machine allows, one half
        where one thread waits for the other.
    """
    in_threads(work)
    in_threads(reference)
    return median(_gain_over(work, reference) for _ in range(rounds))


def _gain_over(work: Callable[[], object], reference: Callable[[], object]) -> float:
    """`gain_over` of one round."""
    alone, together, reference_together = (timed(work, 1), timed(work, THREADS), timed(reference, THREADS))
    gain = alone.seconds / together.seconds
    reference_gain = timed(reference, 1).seconds / reference_together.seconds
    return min(gain / reference_gain, 1.0 - together.one_asleep / THREADS)


class Timed(NamedTuple):
    """What some threads took that did the same work at once."""

    seconds: float
    """Time the slowest computes, and sleeps because it waits for another [s]."""
    one_asleep: float
    """Share of the time in which one sleeps while none has ended."""


def timed(work: Callable[[], object], count: int) -> Timed:
    """Do the same work in several threads at once, and say what they took."""
    times: dict[int, float] = {}

    def one() -> None:
        begun = time.thread_time()
        work()
        times[threading.get_native_id()] = time.thread_time() - begun

    with Looking() as looking:
        in_threads(one, count)
    slowest = max(spent / max(1.0 - looking.asleep(thread), 0.01) for thread, spent in times.items())
    return Timed(slowest, looking.one_asleep(times))


def idle_share(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """How much of the wall time of some work none of its threads computes, wants to, or waits for the disk.

    Parameters
    ----------
    work
        Work with any number of threads; done once before, uncounted.
    rounds
        How often it is done.

    Returns
    -------
    float
        Between 0 and 1; NaN where the system does not show the states of threads.
    """
    work()
    with Looking() as looking:
        for _ in range(rounds):
            work()
    return looking.idle
