"""Two threads against one, and the time in which a whole run does nothing: what CPU time does not show.

Neither depends on what else the machine does: waiting for a processor is taken out.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

THREADS = 2
ROUNDS = 9
_LOOKING = """
import os, select, sys
folder, idle, looks = f"/proc/{sys.argv[1]}/task", 0, 0
print("begun", flush=True)
while not select.select([sys.stdin], [], [], 0.002)[0]:
    states = set()
    for thread in os.listdir(folder) if os.path.isdir(folder) else ():
        try:
            with open(f"{folder}/{thread}/stat") as stat:
                states.add(stat.read().rpartition(")")[2].split()[0])
        except OSError:
            pass  # the thread has ended meanwhile
    looks += bool(states)
    idle += bool(states) and not states & {"R", "D"}
print(idle, looks)
"""
"""Program that counts the looks at which no thread of a process runs, is ready to (R), or waits for the disk (D)."""


def in_threads(work: Callable[[], object], count: int = THREADS) -> None:
    """Do the same work in several threads at once."""
    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def gain_over(work: Callable[[], object], reference: Callable[[], object], rounds: int = ROUNDS) -> float:
    """How much faster two threads are than one, over the same of a reference that shares nothing.

    Returns
    -------
    float
        Median over the rounds: 1 where the work of two threads runs at once as far as the machine allows, one half
        where one thread waits for the other.
    """
    in_threads(work)
    in_threads(reference)
    return median(_gain(work) / _gain(reference) for _ in range(rounds))


def _gain(work: Callable[[], object]) -> float:
    """How much faster two threads are than one."""
    return THREADS * _time_in_threads(work, 1) / _time_in_threads(work, THREADS)


def _time_in_threads(work: Callable[[], object], count: int) -> float:
    """Wall time of the slowest of some threads, without what it waited for a processor [s].

    Other programs would decide a plain wall time. What remains is work and waiting for the other thread.
    """
    times = []

    def timed() -> None:
        work()
        times.append(time.monotonic() - begun - _waited_for_processor())

    begun = time.monotonic()
    in_threads(timed, count)
    return max(times)


def _waited_for_processor() -> float:
    """How long this thread was ready since its start and did not run [s]; 0 where the system does not tell."""
    try:
        return 1e-9 * int(Path("/proc/thread-self/schedstat").read_text().split()[1])
    except OSError:
        return 0.0


def idle_share(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """How much of the wall time of some work none of its threads computes, wants to, or waits for the disk.

    Another process looks at the states of the threads every two milliseconds. A thread that waits for its turn on a
    processor counts as one that computes, so other programs change nothing.

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
    command = [sys.executable, "-c", _LOOKING, str(os.getpid())]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as looking:
        assert looking.stdout is not None, "the pipe was asked for"
        looking.stdout.readline()  # it has begun
        for _ in range(rounds):
            work()
        idle, looks = looking.communicate()[0].split()
    return int(idle) / int(looks) if int(looks) else float("nan")
